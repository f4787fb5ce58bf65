//! Radiosity as a renderer of which a test replaces parts.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use footlight::picture::Image;
use footlight::radiosity::Radiosity;
use footlight::renderer::{Cost, Prepared, Quality, Setup, Transport, TransportError};
use footlight::units::ErrorUnit;
use footlight::work::Work;

/// Radiosity with a scale, quality or cost of its own where there is one.
#[derive(Default)]
pub struct Altered {
    /// The finest step of the scale.
    pub finest: Option<Quality>,
    /// What is rendered, whatever quality is asked for.
    pub quality: Option<Quality>,
    /// What everything costs.
    pub cost: Option<Cost>,
    /// What it states of its steps' errors, from step 1 on.
    pub stated: Vec<f64>,
    /// Whether its images may be stored as those of radiosity.
    pub is_stored: bool,
    /// Images rendered so far.
    pub rendered: Arc<AtomicUsize>,
}

impl Altered {
    /// Radiosity that states no errors: only two coarse steps estimate them, and mixtures reduce them.
    pub fn unstated() -> Arc<Altered> {
        Arc::new(Altered {
            is_stored: true,
            ..Altered::default()
        })
    }
}

struct Counting(Box<dyn Prepared>, Arc<AtomicUsize>);

impl Transport for Altered {
    fn name(&self) -> &str {
        Radiosity.name()
    }

    fn results_version(&self) -> Option<String> {
        Radiosity.results_version().filter(|_| self.is_stored)
    }

    fn finest(&self) -> Quality {
        self.finest.unwrap_or(Radiosity.finest())
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        let inner = Radiosity.prepare(setup, self.quality.unwrap_or(quality), work)?;
        Ok(Box::new(Counting(inner, Arc::clone(&self.rendered))))
    }

    fn stated_error(&self, _: &Setup, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let light = self.stated.get(usize::from(quality.0) - 1).copied();
        // A percent shows as five steps.
        light.map(|error| match unit {
            ErrorUnit::Light => error,
            ErrorUnit::Steps => 500.0 * error,
        })
    }

    fn cost(&self, setup: &Setup, quality: Quality) -> Cost {
        let quality = self.quality.unwrap_or(quality);
        self.cost.unwrap_or_else(|| Radiosity.cost(setup, quality))
    }
}

impl Prepared for Counting {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        self.1.fetch_add(settings.len(), Ordering::Relaxed);
        self.0.render(settings, work)
    }
}
