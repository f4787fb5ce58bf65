//! Converts errors of light to displayed errors.
//!
//! The error of a moment is assumed to be spread evenly over its image. It is then most visible
//! where the image is darkest, because the display's code rises steepest there: the 99th percentile
//! over the pixels uses the slope at the 1st percentile of their darkest channels.

use super::Error;
use super::estimate::{Estimate, OF_ALL_LIGHT};
use crate::plan::Moment;
use crate::pool::Pool;
use footlight_picture::Image;
use footlight_picture::tone;

/// Share of pixels darker than the one that counts.
const DARK: f64 = 0.01;
/// Sampled pixels of an image: few, because every moment is rendered.
const LOOKED_AT: usize = 3600;
/// Most numbers added up in all; with very many moments, fewer pixels are sampled.
const MOST: usize = 500_000_000;
/// Fewest samples for a percentile.
const LEAST: usize = 400;

/// Brightness statistics of a moment's image.
struct Look {
    /// Root mean square.
    light: f64,
    dark: f64,
    bright: f64,
}

impl Estimate<'_> {
    /// Converts moments from errors relative to their light to errors in displayed steps of 255.
    ///
    /// # Errors
    /// Cancel; [`Error::Plan`].
    pub(super) fn displayed(&self, pool: &Pool, moments: &mut [Moment]) -> Result<(), Error> {
        let looks = self.looks(pool, moments)?;
        let brightest = looks.iter().map(|l| l.bright).fold(0.0, f64::max);
        let preview = &self.document.show().preview;
        let automatic = || tone::exposure(brightest) + preview.bias;
        let tone = self
            .document
            .tone_at(preview.exposure.unwrap_or_else(automatic));
        let mut largest = 0.0_f64;
        for (moment, look) in moments.iter_mut().zip(&looks) {
            let little = 0.01 * look.light;
            let rise = tone.display(look.dark + little) - tone.display(look.dark);
            let steps = 255.0 * rise / 0.01;
            if moment.scale > 0.0 {
                largest = largest.max(steps);
            }
            moment.scale *= steps;
        }
        if pool.is_relative() && largest > 0.0 {
            // Errors are not spread evenly; this is the typical value at the worst moment.
            let by = OF_ALL_LIGHT / largest;
            moments.iter_mut().for_each(|m| m.scale *= by);
        }
        Ok(())
    }

    fn looks(&self, pool: &Pool, moments: &[Moment]) -> Result<Vec<Look>, Error> {
        let (width, height) = pool.size();
        let each = moments.len().max(1) * pool.coarse().len().max(1);
        let pixels = (MOST / each).clamp(LEAST, LOOKED_AT);
        let step = (width * height).div_ceil(pixels).isqrt().max(1);
        let thin = pool.thinned(step);
        let work = self.host.work();
        let of = |moment: &Moment| {
            work.check()?;
            Ok(look(&thin.preview(&moment.setting, work)?))
        };
        moments.iter().map(of).collect()
    }
}

fn look(image: &Image) -> Look {
    let (pixels, _) = image.data().as_chunks::<3>();
    let squares: f64 = image.data().iter().map(|v| f64::from(*v).powi(2)).sum();
    let least = |[r, g, b]: &[f32; 3]| r.min(*g).min(*b);
    let mut darkest: Vec<f32> = pixels.iter().map(least).collect();
    let rank = (DARK * darkest.len() as f64) as usize;
    let dark = if rank < darkest.len() {
        *darkest.select_nth_unstable_by(rank, f32::total_cmp).1
    } else {
        0.0
    };
    Look {
        light: (squares / image.data().len().max(1) as f64).sqrt(),
        dark: f64::from(dark.max(0.0)),
        bright: tone::bright_light(image),
    }
}
