//! One call of the operator with everything that it needs, to run on any thread while the engine
//! continues.

use super::SetupImages;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_transport::layered::Layered;
use footlight_transport::{Prepared, Quality, Setup, Transport, TransportError};

/// A call of the operator.
pub(crate) struct Job {
    pub setup: Setup,
    pub quality: Quality,
    pub settings: Vec<Vec<f64>>,
    /// A prepared operator; without it the job prepares one.
    operator: Option<Box<dyn Prepared>>,
}

/// Result of a job.
pub(crate) struct Rendered {
    /// To be returned to the rendering, unless preparing it failed.
    pub operator: Option<Box<dyn Prepared>>,
    /// One for each setting.
    pub images: Result<Vec<Image>, TransportError>,
}

impl Job {
    /// Renders.
    pub fn run(self, renderer: &dyn Transport, work: Work<'_>) -> Rendered {
        let Job {
            setup,
            quality,
            settings,
            operator,
        } = self;
        let prepared = match operator {
            Some(operator) => Ok(operator),
            None => {
                // Check the memory before preparing, not after.
                let view = &setup.view;
                let pixels = view.width.saturating_mul(view.height);
                let images = size_of::<[f32; 3]>().saturating_mul(pixels * settings.len());
                let left = work.holding(images);
                Layered::new(&setup.rig, renderer).prepare(&setup, quality, left)
            }
        };
        match prepared {
            Ok(mut operator) => {
                let images = operator.render(&settings, work);
                Rendered {
                    operator: Some(operator),
                    images,
                }
            }
            Err(error) => Rendered {
                operator: None,
                images: Err(error),
            },
        }
    }
}

impl SetupImages {
    /// Creates a job that renders `settings`, with the prepared operator if there is one, which
    /// must be returned. Drops operators of other steps when they use more than a quarter of
    /// `memory` (bytes).
    pub fn new_job(&mut self, quality: Quality, settings: Vec<Vec<f64>>, memory: usize) -> Job {
        self.make_room(quality, memory);
        self.in_job = Some(quality.0);
        Job {
            setup: self.setup.clone(),
            quality,
            settings,
            operator: self.operators.remove(&quality.0),
        }
    }

    /// Takes an operator back.
    pub fn return_operator(&mut self, quality: Quality, operator: Option<Box<dyn Prepared>>) {
        self.in_job = None;
        if let Some(operator) = operator {
            self.operators.entry(quality.0).or_insert(operator);
        }
    }
}
