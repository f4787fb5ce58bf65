//! Radiosity with parts replaced by a test.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};

/// Radiosity with optional overrides of scale, quality and cost.
#[derive(Default)]
pub struct Altered {
    /// The finest step of the scale.
    pub finest: Option<Quality>,
    /// The coarsest step that needs 9 MB more than available.
    pub too_large: Option<Quality>,
    /// The quality rendered, whatever is requested.
    pub quality: Option<Quality>,
    /// The cost of everything.
    pub cost: Option<Cost>,
    /// Stated errors of its steps, from step 1 on.
    pub stated: Vec<f64>,
    /// True when its images may be stored like those of radiosity.
    pub is_stored: bool,
    /// True when every step has its normal cost but renders the cheapest one, with a share of each
    /// pixel's neighbour added: at step 1 of the one to the side, at step 2 of the one below.
    pub is_smeared: bool,
    /// Number of images rendered so far.
    pub rendered: Arc<AtomicUsize>,
}

impl Altered {
    /// A quick operator without stated errors: only two coarse steps estimate them, and mixtures
    /// reduce them.
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

/// The image with a share of each pixel's neighbour.
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
