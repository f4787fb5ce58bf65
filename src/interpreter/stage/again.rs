//! Refined pictures that are there already: those that an edit left in memory, and those that
//! earlier sessions stored. They serve whatever the cues say now, as corrections of the coarse
//! pictures, and so a session goes on where the last one ended.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::{Means, Stage};
use crate::files::Store;
use crate::linalg::Orthonormal;
use crate::picture::Image;
use crate::pool::Pool;
use crate::pool::address::{Address, Digest, Lighting};
use crate::pool::archive::Archive;
use crate::pool::depot::Place;
use crate::pool::span;
use crate::renderer::Quality;

/// The least share of a known setting, in the pool's metric, that must be outside the span of those
/// taken before it. Of two settings nearer than this the difference would count a thousandfold, and
/// with it the rounding of single precision: 6e-5 of a picture. Planned settings are orthogonal, so
/// this sorts out near-copies of other sessions alone.
const OUTSIDE: f64 = 1e-3;

/// A refined picture at hand.
struct Known {
    /// In terms of the sources as they are now.
    setting: Vec<f64>,
    address: Address,
    place: Place,
}

/// A picture to be added to the pool.
pub struct Again {
    pub setting: Vec<f64>,
    pub image: Arc<Image>,
    pub quality: Quality,
}

impl Again {
    /// Pictures of settings, as many of either.
    pub fn of(
        settings: impl IntoIterator<Item = Vec<f64>>,
        images: impl IntoIterator<Item = Arc<Image>>,
        quality: Quality,
    ) -> Vec<Again> {
        let pairs = settings.into_iter().zip(images);
        let again = pairs.map(|(setting, image)| Again {
            setting,
            image,
            quality,
        });
        again.collect()
    }
}

impl Stage {
    /// Refined pictures in memory, and with `store` also on disk, of at least this quality, that
    /// the sources can express: in the order in which they were refined, so that a pool made anew
    /// is the same to the last bit.
    fn known(&self, least: Quality, store: Option<&dyn Store>) -> Vec<Known> {
        self.known_in(&self.archive, least, store)
    }

    /// The names of the refined pictures in an archive, on disk too, that serve.
    pub fn serving(
        &self,
        archive: &Archive,
        least: Quality,
        store: &dyn Store,
    ) -> BTreeSet<Digest> {
        let known = self.known_in(archive, least, Some(store));
        known.into_iter().map(|k| k.address.key).collect()
    }

    fn known_in(&self, archive: &Archive, least: Quality, store: Option<&dyn Store>) -> Vec<Known> {
        let Some(ground) = self.ground else {
            return Vec::new();
        };
        let kept = archive.kept().iter();
        let fits = |a: &Address| a.ground == ground && a.quality >= least;
        let kept = kept.filter(|k| fits(&k.address));
        let mut all: Vec<(Place, Address)> = kept
            .filter_map(|k| Some((k.refined.clone()?, k.address.clone())))
            .collect();
        if let Some((depot, store)) = archive.depot().zip(store) {
            let stored = depot.refined(store, ground, least).into_iter();
            all.extend(stored.map(|r| {
                let address = Address {
                    ground,
                    quality: r.quality,
                    lighting: r.lighting,
                    key: r.key,
                };
                (r.place, address)
            }));
        }
        all.sort_by_key(|(place, address)| (place.order, address.key));
        let mut seen = BTreeSet::new();
        all.retain(|(_, address)| seen.insert(address.key));
        let lit: Vec<&Lighting> = all.iter().map(|(_, a)| &a.lighting).collect();
        let units = Pool::unit_settings(self.lights.sources());
        let sources: Vec<Lighting> = units.iter().map(|u| self.lights.lighting(u)).collect();
        let settings = span::settings(&sources, &lit);
        let known = settings.into_iter().zip(all);
        let known = known.filter_map(|(setting, (place, address))| {
            // With the sources that it was rendered for, the very numbers that it was rendered of.
            let own = self.lights.address(ground, address.quality, &place.setting);
            let same = place.setting.len() == units.len() && own.key == address.key;
            Some(Known {
                setting: if same {
                    place.setting.clone()
                } else {
                    setting?
                },
                address,
                place,
            })
        });
        known.collect()
    }

    /// The refined pictures that are known, with their settings, but for those that say next to
    /// nothing new; none without a pool.
    pub fn again(&mut self, least: Quality, means: Means<'_>) -> Vec<Again> {
        let Some((weighting, size)) = self.pool.as_ref().map(|p| (p.weighting(), p.size())) else {
            return Vec::new();
        };
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut span = Orthonormal::new();
        let mut out = Vec::new();
        self.near_copies = 0;
        for known in self.known(least, Some(means.store)) {
            let terms = known.setting.iter().zip(weighting.weights());
            let weighted: Vec<f64> = terms.map(|(s, w)| s * w).collect();
            let mut rest = weighted.clone();
            span.remove_from(&mut rest);
            if norm(&rest) <= OUTSIDE * norm(&weighted) {
                self.near_copies += 1;
                continue;
            }
            let quality = known.address.quality;
            let found = self
                .archive
                .recall(known.address, known.place, size, means.store);
            if let Some(image) = found {
                // What is this far outside is never refused.
                let _ = span.push(&weighted);
                out.push(Again {
                    setting: known.setting,
                    image,
                    quality,
                });
            }
        }
        out
    }

    /// Number of refined pictures that the pool has, or, until it is made, will have of those in
    /// memory.
    pub fn refined(&self, least: Quality) -> usize {
        match &self.pool {
            Some(pool) => pool.refined().len(),
            None => self.known(least, None).len(),
        }
    }
}
