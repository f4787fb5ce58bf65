//! Radiosity as a renderer of which a test replaces parts.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};

/// Radiosity with a scale, quality or cost of its own where there is one.
#[derive(Default)]
pub struct Altered {
    /// The finest step of the scale.
    pub finest: Option<Quality>,
    /// The coarsest step that takes 9 MB more than there is.
    pub too_large: Option<Quality>,
    /// What is rendered, whatever quality is asked for.
    pub quality: Option<Quality>,
    /// What everything costs.
    pub cost: Option<Cost>,
    /// What it states of its steps' errors, from step 1 on.
    pub stated: Vec<f64>,
    /// Whether its images may be stored as those of radiosity.
    pub is_stored: bool,
    /// Whether every step costs what it does but renders the cheapest, in which a pixel has a share
    /// of its neighbour's light: at step 1 of the one beside it, at step 2 of the one below.
    pub is_smeared: bool,
    /// Images rendered so far.
    pub rendered: Arc<AtomicUsize>,
}

impl Altered {
    /// A quick operator that states no errors: only two coarse steps estimate them, and mixtures reduce
    /// them.
    pub fn unstated() -> Altered {
        Altered {
            is_stored: true,
            is_smeared: true,
            ..Altered::default()
        }
    }
}

struct Counting {
    inner: Box<dyn Prepared>,
    smear: Option<Quality>,
    rendered: Arc<AtomicUsize>,
}

/// The image with a share of the light of each pixel's neighbour.
fn smeared(image: &Image, quality: Quality) -> Image {
    let (width, height) = image.size();
    let (share, across, down) = match quality {
        Quality(1) => (0.3, 1, 0),
        Quality(2) => (0.2, 0, 1),
        _ => (0.0, 0, 0),
    };
    let value = |i: usize| {
        let (x, y, channel) = (i / 3 % width, i / 3 / width, i % 3);
        let (x, y) = ((x + across).min(width - 1), (y + down).min(height - 1));
        let neighbour = image.data()[3 * (y * width + x) + channel];
        (1.0 - share) * image.data()[i] + share * neighbour
    };
    let data = (0..image.data().len()).map(value).collect();
    Image::from_data(width, height, data).unwrap()
}

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
        if self.too_large.is_some_and(|step| quality >= step) {
            return Err(TransportError::Memory {
                what: "the stage",
                needed: work.memory + (9 << 20),
                budget: work.memory,
            });
        }
        let smear = self.is_smeared.then_some(quality);
        let rendered = smear.map_or(quality, |_| Quality(1));
        let inner = Radiosity.prepare(setup, self.quality.unwrap_or(rendered), work)?;
        Ok(Box::new(Counting {
            inner,
            smear,
            rendered: Arc::clone(&self.rendered),
        }))
    }

    fn usual_error(&self, _: &Setup, quality: Quality) -> Option<f64> {
        self.stated.get(usize::from(quality.0) - 1).copied()
    }

    fn cost(&self, setup: &Setup, quality: Quality) -> Cost {
        let quality = self.quality.unwrap_or(quality.min(Radiosity.finest()));
        self.cost.unwrap_or_else(|| Radiosity.cost(setup, quality))
    }
}

impl Prepared for Counting {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        self.rendered.fetch_add(settings.len(), Ordering::Relaxed);
        let images = self.inner.render(settings, work)?;
        Ok(match self.smear {
            Some(quality) => images.iter().map(|image| smeared(image, quality)).collect(),
            None => images,
        })
    }
}
