//! Existing refined images: those that an edit left in memory, and those stored by earlier
//! sessions. As corrections of coarse images they stay valid when cues change, so that a session
//! continues where the last one ended.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::SetupImages;
use crate::pool::Pool;
use crate::pool::address::{Address, Lighting};
use crate::pool::disk_cache::PlaceInPool;
use crate::pool::image_cache::ImageCache;
use crate::pool::linear_span;
use footlight_host::files::Store;
use footlight_picture::Image;
use footlight_show::linalg::Orthonormal;
use footlight_transport::Quality;

/// Least share of a known setting, in the pool's metric, outside the span of those before it.
/// Between nearer settings the difference would count a thousandfold, and with it the rounding of
/// single precision: 6e-5 of an image. Planned settings are orthogonal, so this excludes only
/// near-copies of other sessions.
const OUTSIDE: f64 = 1e-3;

/// An existing refined image.
pub(super) struct Known {
    /// Its setting in terms of the current sources.
    setting: Vec<f64>,
    pub address: Address,
    place: PlaceInPool,
}

/// A refined image to be added to the pool.
pub(crate) struct Reused {
    pub setting: Vec<f64>,
    pub image: Arc<Image>,
    pub quality: Quality,
}

impl SetupImages {
    /// Refined images in memory, and with `store` also on disk, of at least this quality, that the
    /// current sources can express: in the order of their refinement, so that a recreated pool is
    /// equal to the last bit.
    pub(super) fn known(
        &self,
        image_cache: &ImageCache,
        least: Quality,
        store: Option<&dyn Store>,
    ) -> Vec<Known> {
        let Some(key) = self.scene_key else {
            return Vec::new();
        };
        let fits = |a: &Address| a.scene_key == key && a.quality >= least;
        let kept = image_cache.kept().iter().filter(|k| fits(&k.address));
        let mut all: Vec<(PlaceInPool, Address)> = kept
            .filter_map(|k| Some((k.refined.clone()?, k.address.clone())))
            .collect();
        if let (Some(disk_cache), Some(store)) = (&image_cache.disk_cache, store) {
            all.extend(disk_cache.refined(store, key, least));
        }
        all.sort_by_key(|(place, address)| (place.order, address.key));
        let mut seen = BTreeSet::new();
        all.retain(|(_, address)| seen.insert(address.key));
        let lit: Vec<&Lighting> = all.iter().map(|(_, a)| &a.lighting).collect();
        let units = Pool::unit_settings(self.lights.sources());
        let sources: Vec<Lighting> = units.iter().map(|u| self.lights.lighting(u)).collect();
        let settings = linear_span::settings(&sources, &lit);
        let known = settings.into_iter().zip(all);
        let known = known.filter_map(|(setting, (place, address))| {
            // For the original sources, use the original numbers.
            let own = self.lights.address(key, address.quality, &place.setting);
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

    /// Known refined images not yet in the pool, with their settings, except those that add almost
    /// nothing; empty without a pool.
    pub fn reusable(
        &self,
        image_cache: &mut ImageCache,
        least: Quality,
        store: &dyn Store,
    ) -> Vec<Reused> {
        let Some((weighting, size, have)) = self
            .pool
            .as_ref()
            .map(|p| (p.weighting().clone(), p.size(), p.settings()))
        else {
            return Vec::new();
        };
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let weighted = |setting: &[f64]| -> Vec<f64> {
            let terms = setting.iter().zip(weighting.weights());
            terms.map(|(s, w)| s * w).collect()
        };
        let mut span = Orthonormal::new();
        for setting in &have {
            // Settings in the pool are never refused.
            let _ = span.push(&weighted(setting));
        }
        let mut out = Vec::new();
        for known in self.known(image_cache, least, Some(store)) {
            if have.contains(&known.setting) {
                continue;
            }
            let weighted = weighted(&known.setting);
            let mut rest = weighted.clone();
            span.remove_from(&mut rest);
            if norm(&rest) <= OUTSIDE * norm(&weighted) {
                continue;
            }
            let quality = known.address.quality;
            if let Some(image) = image_cache.recall(&known.address, Some(&known.place), size, store)
            {
                // A setting this far outside is never refused.
                let _ = span.push(&weighted);
                out.push(Reused {
                    setting: known.setting,
                    image,
                    quality,
                });
            }
        }
        out
    }
}
