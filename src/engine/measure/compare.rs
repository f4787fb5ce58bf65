//! Every bank alone against its reference image.

use std::path::Path;

use crate::engine::{Engine, Error};
use crate::picture::Image;
use crate::radiosity::emitter_mask;
use crate::renderer::Quality;
use crate::study::comparison::Compared;
use crate::study::{BankError, Comparison, Reference, difference};

impl Engine {
    /// Renders every bank alone at unit setting, timed from nothing prepared, and compares each
    /// with its reference image in `folder`.
    ///
    /// # Errors
    /// [`Error::Reference`] when a reference is missing or does not fit, [`Error::NoSetup`],
    /// [`Error::NoBanks`], else what rendering says.
    pub fn compare(&mut self, folder: &Path, quality: Quality) -> Result<Compared, Error> {
        let names = self.bank_names()?;
        let settings = self.alone_each(&names)?;
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let work = self.host.work();
        let (store, memory) = (self.host.store.as_ref(), work.memory);
        let size = (rendering.setup.view.width, rendering.setup.view.height);
        let references = Reference::load(store, folder, &names, size, memory)?;
        let near = emitter_mask::emitters(&rendering.setup, work)?;
        let counted = difference::away_from(&near, size.0);
        let (images, seconds) = self.render_alone(&settings, quality)?;
        let pairs = names.iter().zip(images.iter().zip(&references));
        let errors = pairs.map(|(name, (i, r))| BankError::new(name, i, r, &counted));
        let comparison = Comparison {
            quality: quality.0,
            seconds: seconds.iter().sum(),
            banks: errors.collect(),
        };
        Ok(Compared {
            comparison,
            images,
            references,
        })
    }

    /// Images of settings from an operator prepared for the purpose, with the seconds to prepare it
    /// and to render them.
    pub(in crate::engine) fn render_alone(
        &self,
        settings: &[Vec<f64>],
        quality: Quality,
    ) -> Result<(Vec<Image>, [f64; 2]), Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let (work, clock) = (self.host.work(), self.host.clock.as_ref());
        let begin = clock.seconds();
        let renderer = self.host.renderer.as_ref();
        let mut operator = rendering.prepare(renderer, quality, work)?;
        let prepared = clock.seconds();
        let images = operator.render(settings, work)?;
        Ok((images, [prepared - begin, clock.seconds() - prepared]))
    }

    /// Names of the banks; a show without any has nothing to measure.
    pub(in crate::engine) fn bank_names(&self) -> Result<Vec<String>, Error> {
        let names: Vec<String> = self.show().banks.iter().map(|b| b.name.clone()).collect();
        if names.is_empty() {
            return Err(Error::NoBanks);
        }
        Ok(names)
    }

    /// The setting of each bank alone at full.
    pub(in crate::engine) fn alone_each(&self, names: &[String]) -> Result<Vec<Vec<f64>>, Error> {
        names.iter().map(|name| self.alone(name)).collect()
    }
}
