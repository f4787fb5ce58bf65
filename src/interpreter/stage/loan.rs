//! What a stage lends to a rendering that goes on elsewhere while the stage itself may change.

use std::sync::Arc;

use super::{KEPT_SHARE, Means, Stage};
use crate::files::Store;
use crate::picture::Image;
use crate::pool::Pool;
use crate::pool::archive::Wanted;
use crate::renderer::layered::Layered;
use crate::renderer::{Cost, Prepared, Quality, Setup, Transport, TransportError};
use crate::work::Work;

/// All that the pictures of a rendering follow from, but for quality and settings.
pub type Footing = Setup;

/// A rendering on its own feet, to be done anywhere.
pub struct Loan {
    footing: Footing,
    quality: Quality,
    settings: Vec<Vec<f64>>,
    operator: Option<Box<dyn Prepared>>,
}

/// What a rendering brings home.
pub struct Returned {
    /// To be given back, unless preparing it failed.
    pub operator: Option<Box<dyn Prepared>>,
    /// One for each setting.
    pub images: Result<Vec<Image>, TransportError>,
}

impl Loan {
    /// Renders.
    pub fn render(self, transport: &dyn Transport, work: Work<'_>) -> Returned {
        let prepared = match self.operator {
            Some(operator) => Ok(operator),
            None => Layered::new(&self.footing.rig, transport).prepare(
                &self.footing,
                self.quality,
                work,
            ),
        };
        match prepared {
            Ok(mut operator) => {
                let images = operator.render(&self.settings, work);
                Returned {
                    operator: Some(operator),
                    images,
                }
            }
            Err(error) => Returned {
                operator: None,
                images: Err(error),
            },
        }
    }
}

/// Pictures to be rendered, with their addresses where they are to be kept.
pub struct Missing {
    /// What is to be rendered.
    pub settings: Vec<Vec<f64>>,
    /// As many, unless the operator's pictures are not to be kept.
    pub wanted: Option<Vec<Wanted>>,
}

impl Stage {
    /// What its operators render from.
    pub fn setup(&self) -> Setup {
        let (scene, rig) = (Arc::clone(&self.scene), Arc::clone(&self.rig));
        Setup::new(scene, rig, self.view.clone())
    }

    /// True when pictures of this footing are pictures of this stage.
    pub fn stands_on(&self, footing: &Footing) -> bool {
        self.setup() == *footing
    }

    /// True when they show the same scene from the same place, in whatever light.
    pub fn sees(&self, footing: &Footing) -> bool {
        self.setup().has_same_scene(footing)
    }

    /// Hands out what renders `settings`, with the operator if it is prepared.
    pub fn lend(&mut self, quality: Quality, settings: Vec<Vec<f64>>) -> Loan {
        self.lent = Some(quality.0);
        Loan {
            footing: self.setup(),
            quality,
            settings,
            operator: self.operators.remove(&quality.0),
        }
    }

    /// Takes an operator back.
    pub fn give_back(&mut self, quality: Quality, operator: Option<Box<dyn Prepared>>) {
        self.lent = None;
        if let Some(operator) = operator {
            self.operators.entry(quality.0).or_insert(operator);
        }
    }

    /// Of the pictures of `settings` those that are at hand, in their order with gaps, and those
    /// that are not; `refined` as in [`Stage::pictures`].
    pub fn find(
        &mut self,
        quality: Quality,
        settings: &[Vec<f64>],
        refined: Option<usize>,
        store: &dyn Store,
    ) -> (Vec<Option<Arc<Image>>>, Missing) {
        let Some(ground) = self.ground else {
            let missing = Missing {
                settings: settings.to_vec(),
                wanted: None,
            };
            return (vec![None; settings.len()], missing);
        };
        let wanted = self.wanted(ground, quality, settings, refined);
        let size = (self.view.width, self.view.height);
        let found = self.archive.find(&wanted, size, store);
        let open = |((setting, wanted), found): ((&Vec<f64>, Wanted), &Option<Arc<Image>>)| {
            found.is_none().then(|| (setting.clone(), wanted))
        };
        let pairs = settings.iter().zip(wanted).zip(&found).filter_map(open);
        let (settings, wanted) = pairs.unzip();
        let missing = Missing {
            settings,
            wanted: Some(wanted),
        };
        (found, missing)
    }

    /// Keeps pictures that were rendered elsewhere.
    pub fn take_in(
        &mut self,
        wanted: Option<&[Wanted]>,
        images: Vec<Image>,
        means: Means<'_>,
    ) -> Vec<Arc<Image>> {
        let Some(wanted) = wanted else {
            return images.into_iter().map(Arc::new).collect();
        };
        let pairs = wanted.iter().zip(images);
        pairs
            .map(|(w, image)| self.archive.take_in(w, image, means.store))
            .collect()
    }

    /// Lets go of pictures that nothing uses, beyond their share of the memory, bytes.
    pub fn trim(&mut self, memory: usize) {
        self.archive.trim(memory / KEPT_SHARE);
    }

    /// True when coarse pictures rendered elsewhere find their way into the pool.
    pub fn keeps(&self) -> bool {
        self.ground.is_some()
    }

    /// What rendering so many sources alone takes, in the operator's units.
    pub fn cost_of_units(
        &self,
        transport: &dyn Transport,
        quality: Quality,
        pictures: usize,
    ) -> f64 {
        let cost = self.cost(transport, quality);
        let prepare = match self.is_prepared(quality) {
            true => 0.0,
            false => cost.prepare,
        };
        Cost { prepare, ..cost }.alone(pictures as f64)
    }

    /// The settings of coarse pictures.
    pub fn units(&self) -> Vec<Vec<f64>> {
        Pool::unit_settings(self.rig.sources.len())
    }
}
