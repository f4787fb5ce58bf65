//! A show put on trial: every source rendered at all qualities that a pool deals with.

use super::{Error, Interpreter, refine};
use crate::picture::Image;
use crate::study::Trial;
use crate::transport::Quality;

impl Interpreter {
    /// Renders every source alone at both coarse qualities and the refined one.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, or its operator has one quality only,
    /// so that there is nothing to try; else what rendering says.
    pub fn trial(&mut self) -> Result<Trial, Error> {
        let [cheap, fine] = self.coarse_steps();
        let keys = self.keys().clone();
        let n = keys.coordinates();
        let mut pictures = Vec::new();
        for quality in [Quality(cheap), Quality(fine), self.refined_step()] {
            let unit =
                |i: usize| -> Vec<f64> { (0..n).map(|j| f64::from(u8::from(i == j))).collect() };
            let images: Result<Vec<Image>, Error> =
                (0..n).map(|i| self.render(&unit(i), quality)).collect();
            pictures.push(images?);
        }
        let [coarser, coarse, refined] = pictures.as_slice() else {
            return Err(refine::no_stage());
        };
        if cheap == fine {
            let why = "there is one quality only, so that nothing can be tried";
            return Err(Error::Usage(why.to_owned()));
        }
        Trial::new(keys, [coarser, coarse, refined], self.host.threads)
            .ok_or_else(|| Error::Usage("the show has no source to try".to_owned()))
    }
}

#[cfg(test)]
#[path = "trial_test.rs"]
mod tests;
