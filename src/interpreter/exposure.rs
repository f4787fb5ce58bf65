//! The automatic exposure of a sequence, found anew after an edit from what the edit changed.
//!
//! It follows from the bright light of every key image ([`tone::auto_exposure`]), of which only
//! some pixels are looked at. A preview of these pixels alone is the same to the bit as the same
//! pixels of a whole preview, and costs a sixteenth at 640x360; keys whose setting is known from
//! before the edit cost nothing. So pictures, sequences and pages are exposed alike, and a picture
//! after an edit waits for no key image.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Error, Interpreter};
use crate::picture::{Image, tone};
use crate::pool::{Pool, Projection};

/// What is known of the key images of one pool.
pub(super) struct Brightness {
    /// The pool's pictures, to know it again; being held here, no other can take their place.
    pictures: Vec<Arc<Image>>,
    projection: Projection,
    thin: Pool,
    /// Bright light by the bits of a key's setting.
    known: BTreeMap<Vec<u64>, f64>,
}

impl Brightness {
    fn new(pool: &Pool, projection: Projection) -> Brightness {
        let (width, height) = pool.size();
        Brightness {
            pictures: pool.pictures().cloned().collect(),
            projection,
            thin: pool.thinned(tone::sampling(width, height)),
            known: BTreeMap::new(),
        }
    }

    fn is_of(&self, pool: &Pool, projection: Projection) -> bool {
        let same = |(a, b): (&Arc<Image>, &Arc<Image>)| Arc::ptr_eq(a, b);
        self.projection == projection
            && self.pictures.len() == pool.pictures().count()
            && self.pictures.iter().zip(pool.pictures()).all(same)
    }
}

impl Interpreter {
    /// The exposure, in stops, of the whole sequence as the pool shows it.
    pub(super) fn auto_exposure(&mut self) -> Result<f64, Error> {
        let projection = self.method().projection;
        // These look at scalar products of whole pictures.
        if matches!(projection, Projection::FullError | Projection::Corrections) {
            let playback = self.playback()?;
            return Ok(tone::auto_exposure(playback.images().iter()));
        }
        self.coarse()?;
        let old = self.brightness.take();
        let pool = self.rendered()?;
        let kept = old.filter(|b| b.is_of(pool, projection));
        let mut brightness = kept.unwrap_or_else(|| Brightness::new(pool, projection));
        let work = self.host.work();
        let seen = brightness.thin.projected(projection, work);
        let mut known = BTreeMap::new();
        for key in self.keys().keys() {
            work.check()?;
            let bits: Vec<u64> = key.iter().map(|level| level.to_bits()).collect();
            let light = match brightness.known.get(&bits) {
                Some(light) => *light,
                None => tone::bright_light(&seen.preview(key, work)?),
            };
            known.insert(bits, light);
        }
        let brightest = known.values().copied().fold(0.0, f64::max);
        brightness.known = known;
        self.brightness = Some(brightness);
        Ok(tone::exposure(brightest))
    }
}
