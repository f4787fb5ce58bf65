//! The automatic exposure of a sequence, updated incrementally after an edit.
//!
//! It follows from the bright light of every key image ([`tone::auto_exposure`]), of which only
//! some pixels are sampled. Blending only these pixels gives the bits of the full image's pixels at
//! a sixteenth of the cost at 640x360; keys whose setting is unchanged by an edit cost nothing. So
//! images, sequences and pages share one exposure, and an image after an edit waits for no key
//! image.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Engine, Error, frame};
use crate::pool::Pool;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::tone::{self, Tone};
use footlight_show::timeline::KeySequence;
use footlight_transport::Quality;

/// Most key images sampled; a show with effects has thousands, mostly alike.
const MOST_KEYS: usize = 500;

/// Brightness of the key images of one pool.
struct Brightness {
    /// The pool's images, which identify it; holding them here prevents reuse of their addresses.
    pictures: Vec<Arc<Image>>,
    thin: Pool,
    /// Bright light by the bits of a key's setting.
    known: BTreeMap<Vec<u64>, f64>,
}

impl Brightness {
    fn new(pool: &Pool) -> Brightness {
        let (width, height) = pool.size();
        Brightness {
            pictures: pool.pictures().cloned().collect(),
            thin: pool.thinned(tone::sampling(width, height)),
            known: BTreeMap::new(),
        }
    }

    fn is_of(&self, pool: &Pool) -> bool {
        let same = |(a, b): (&Arc<Image>, &Arc<Image>)| Arc::ptr_eq(a, b);
        self.pictures.len() == pool.pictures().count()
            && self.pictures.iter().zip(pool.pictures()).all(same)
    }
}

/// The exposure of a sequence, with data for its update.
#[derive(Default)]
pub(super) struct Exposure {
    /// In stops, with the number of refined images and the quality of the others at that time.
    found: Option<(f64, (usize, [Quality; 2]))>,
    /// Brightness of each key before the last edit.
    brightness: Option<Brightness>,
}

impl Exposure {
    /// Drops the exposure, but keeps the brightness of keys.
    pub fn expire(&mut self) {
        self.found = None;
    }
}

impl Engine {
    /// One tone for the whole sequence, so that images of different moments compare: the show's own
    /// exposure, or an automatic one from all key images.
    ///
    /// # Errors
    /// As [`Engine::coarse`].
    pub fn tone(&mut self) -> Result<Tone, Error> {
        if let Some(exposure) = self.document.show().preview.exposure {
            return Ok(self.document.tone_at(exposure));
        }
        let estimate = self.estimate();
        let images = (estimate.refined(), estimate.coarse_steps());
        if let Some((exposure, at)) = self.exposure.found
            && at == images
        {
            return Ok(self.document.tone_at(exposure));
        }
        let exposure = self.auto_exposure()? + self.document.show().preview.bias;
        self.exposure.found = Some((exposure, images));
        Ok(self.document.tone_at(exposure))
    }

    /// The automatic exposure, in stops, of the whole sequence with the current pool.
    fn auto_exposure(&mut self) -> Result<f64, Error> {
        self.coarse()?;
        if let Some(heads) = self.heads() {
            let (document, work) = (&self.document, self.work());
            let pool = self.estimate().rendered()?;
            let mut brightest = 0.0_f64;
            for time in document.exposed() {
                let (setting, poses) = (document.setting(time), document.timeline().poses(time));
                let image = frame((pool, Some(&heads)), &setting, &poses, work)?;
                brightest = brightest.max(tone::bright_light(&image));
            }
            return Ok(tone::exposure(brightest));
        }
        let old = self.exposure.brightness.take();
        let pool = self.estimate().rendered()?;
        let kept = old.filter(|b| b.is_of(pool));
        let mut brightness = kept.unwrap_or_else(|| Brightness::new(pool));
        let work = self.work();
        let mut known = BTreeMap::new();
        for key in brightest(self.document.keys(), &brightness.thin, work)? {
            work.check()?;
            let bits: Vec<u64> = key.iter().map(|level| level.to_bits()).collect();
            let light = match brightness.known.get(&bits) {
                Some(light) => *light,
                None => tone::bright_light(&brightness.thin.preview(key, work)?),
            };
            known.insert(bits, light);
        }
        let brightest = known.values().copied().fold(0.0, f64::max);
        brightness.known = known;
        self.exposure.brightness = Some(brightness);
        Ok(tone::exposure(brightest))
    }
}

/// The [`MOST_KEYS`] brightest keys by the sum of their banks' bright light.
fn brightest<'k>(
    keys: &'k KeySequence,
    thin: &Pool,
    work: Work<'_>,
) -> Result<Vec<&'k Vec<f64>>, Error> {
    let all = keys.keys().iter();
    if all.len() <= MOST_KEYS {
        return Ok(all.collect());
    }
    let coordinates = keys.coordinates();
    let unit = |c: usize| -> Vec<f64> { (0..coordinates).map(|i| f64::from(i == c)).collect() };
    let light: Vec<f64> = (0..coordinates)
        .map(|c| Ok(tone::bright_light(&thin.preview(&unit(c), work)?)))
        .collect::<Result<_, Error>>()?;
    let total = |key: &Vec<f64>| -> f64 { key.iter().zip(&light).map(|(x, y)| x * y).sum() };
    let mut found: Vec<(f64, &Vec<f64>)> = all.map(|key| (total(key), key)).collect();
    found.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    Ok(found
        .into_iter()
        .take(MOST_KEYS)
        .map(|(_, key)| key)
        .collect())
}
