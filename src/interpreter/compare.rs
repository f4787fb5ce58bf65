//! `compare`: every bank alone against its reference picture.

use std::path::Path;

use super::output::{ending, unknown_ending};
use super::{Call, Error, Interpreter, Reply, json, refine};
use crate::picture::Image;
use crate::report;
use crate::study::comparison::Compared;
use crate::study::{BankError, Comparison, Reference, difference};
use crate::radiosity::seen;
use crate::renderer::{Quality};

impl Interpreter {
    pub(super) fn answer_compare(&mut self, call: &Call) -> Result<Reply, Error> {
        if let Some(word) = call.words.first() {
            return Err(Error::Usage(format!(
                "`{word}` is left over; the folder stands behind --reference"
            )));
        }
        let folder = call.option("reference").ok_or_else(|| {
            Error::Usage(
                "say where the reference pictures are: compare --reference DIR, with DIR/BANK.exr \
                 for every bank, or its halves BANK_A.exr and BANK_B.exr"
                    .to_owned(),
            )
        })?;
        let quality = match call.option("quality") {
            Some(text) => self.quality(text)?,
            None => Quality(self.coarse_steps()[1]),
        };
        let path = call.option("output").map(Path::new);
        if let Some(p) = path.filter(|p| !["png", "svg"].contains(&ending(p).as_str())) {
            return Err(unknown_ending(p, ".png or .svg"));
        }
        let compared = self.compare(Path::new(folder), quality)?;
        let text = match call.option("json") {
            Some(_) => json(&compared.comparison)?,
            None => report::comparison::describe(&compared.comparison),
        };
        let Some(path) = path else {
            return Ok(Reply::text(text));
        };
        let drawing = report::comparison::drawing(&self.show().title, &compared)?;
        let bytes = match ending(path).as_str() {
            "svg" => drawing.svg().into_bytes(),
            _ => drawing.png()?,
        };
        self.host.store.write(path, &bytes)?;
        Ok(match call.option("json") {
            Some(_) => Reply::text(text),
            None => Reply::text(format!("{text}wrote {}", path.display())),
        })
    }

    /// Renders every bank alone at unit setting, timed from nothing prepared, and holds each
    /// against its picture in `folder`.
    ///
    /// # Errors
    /// [`Error::Study`] when a reference is missing or does not fit, [`Error::Usage`] without
    /// stage, view or banks, else what rendering says.
    pub fn compare(&mut self, folder: &Path, quality: Quality) -> Result<Compared, Error> {
        let names = self.bank_names()?;
        let settings = self.units(&names)?;
        let stage = self.stage.as_ref().ok_or_else(refine::no_stage)?;
        let work = self.host.work();
        let (store, memory) = (self.host.store.as_ref(), work.memory);
        let size = (stage.view.width, stage.view.height);
        let references = Reference::load(store, folder, &names, size, memory)?;
        let near = seen::emitters(&stage.setup(), work)?;
        let counted = difference::away_from(&near, size.0);
        let (images, seconds) = self.banks_anew(&settings, quality)?;
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

    /// Pictures of settings from an operator prepared for the purpose, with the seconds to prepare
    /// it and to render them.
    pub(super) fn banks_anew(
        &self,
        settings: &[Vec<f64>],
        quality: Quality,
    ) -> Result<(Vec<Image>, [f64; 2]), Error> {
        let stage = self.stage.as_ref().ok_or_else(refine::no_stage)?;
        let (work, clock) = (self.host.work(), self.host.clock.as_ref());
        let begin = clock.seconds();
        let transport = self.host.transport.as_ref();
        let mut operator = stage.prepare(transport, quality, work)?;
        let prepared = clock.seconds();
        let images = operator.render(settings, work)?;
        Ok((images, [prepared - begin, clock.seconds() - prepared]))
    }

    /// Names of the banks; a show without any has nothing to measure.
    pub(super) fn bank_names(&self) -> Result<Vec<String>, Error> {
        let names: Vec<String> = self.show().banks.iter().map(|b| b.name.clone()).collect();
        if names.is_empty() {
            return Err(Error::Usage("the show has no bank to render".to_owned()));
        }
        Ok(names)
    }

    /// The setting of each bank alone at full.
    pub(super) fn units(&self, names: &[String]) -> Result<Vec<Vec<f64>>, Error> {
        names.iter().map(|name| self.alone(name)).collect()
    }
}
