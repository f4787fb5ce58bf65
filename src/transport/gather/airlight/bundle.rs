//! Tiles of pixels that a beam misses: one test for all their rays of sight.

use super::{Pixel, Sight, spans};
use crate::gather::emitter::Emitter;
use std::f64::consts::FRAC_PI_4;

/// Rays of sight of a tile: one of them, and the others' distance from it.
pub(super) struct Bundle {
    first: Sight,
    /// Greatest length, metres.
    length: f64,
    /// Greatest distance of another from the first, metres.
    apart: f64,
}

impl Bundle {
    /// The rays from the eye, or those of its reflections, up to `most` metres; `None` if there are
    /// none.
    pub(super) fn of(tile: &[Pixel], is_direct: bool, most: f64) -> Option<Bundle> {
        let sights = || {
            let all = tile.iter().flat_map(|pixel| {
                if is_direct {
                    &pixel.direct
                } else {
                    &pixel.mirrored
                }
            });
            all.map(|(_, sight)| sight)
        };
        let first = *sights().next()?;
        let length = sights().map(|sight| sight.length.min(most));
        let length = length.fold(0.0, f64::max);
        // A ray from the eye is split over its pixel.
        let own = if is_direct { first.spread } else { 0.0 };
        let apart = sights().map(|sight| {
            (sight.eye - first.eye).length() + ((sight.way - first.way).length() + own) * length
        });
        let apart = apart.fold(0.0, f64::max);
        Some(Bundle {
            first,
            length,
            apart,
        })
    }

    /// True when no ray can cross the light's cone: the first one does not cross the cone widened by
    /// the distance of the others.
    pub(super) fn misses(&self, emitter: &Emitter<'_>) -> bool {
        let Emitter::Point(beam, _) = emitter else {
            return false;
        };
        let reach = beam.reach();
        let apex = beam.position - beam.axis * (self.apart / reach.sin());
        let cone = (apex, beam.axis, reach);
        reach < FRAC_PI_4 && spans(&self.first, self.length, cone).is_empty()
    }
}
