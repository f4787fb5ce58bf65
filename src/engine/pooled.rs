//! Existing images, which of them the show can use, and freeing the others.

use std::sync::Arc;

use super::estimate::Estimate;
use super::{Engine, Error};
use crate::pool::Pool;
use crate::pool::disk_cache::Stored;
use footlight_picture::Image;
use footlight_show::diagnostic::Label;
use footlight_show::model::Bank;
use footlight_transport::Quality;

/// Images in memory and in the store.
#[derive(Clone, Debug, PartialEq)]
pub struct PoolSummary {
    /// Number of images in the pool, each counted once.
    pub held: usize,
    /// Number of images in memory that an edit made unused.
    pub idle: usize,
    /// The store; `None` when images are kept only in memory.
    pub store: Option<StoreSummary>,
}

/// Images in the store.
#[derive(Clone, Debug, PartialEq)]
pub struct StoreSummary {
    /// Its folder.
    pub folder: std::path::PathBuf,
    /// The most bytes that it may hold.
    pub limit: u64,
    /// Quality steps and bytes of the images that can serve this show.
    pub own: Vec<(Quality, u64)>,
    /// Bytes of each other image: of other scenes, lights, views or versions.
    pub other: Vec<u64>,
}

/// Result of freeing images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Freed {
    /// Number of images dropped from memory.
    pub memory: usize,
    /// Number and bytes of images freed in the store, and its folder, if there is one.
    pub store: Option<(usize, u64, std::path::PathBuf)>,
}

/// A bank whose light is nowhere in the view.
#[derive(Clone, Debug, PartialEq)]
pub struct UnlitBank {
    /// Its name.
    pub name: String,
    /// Its declaration.
    pub place: Option<Label>,
}

/// Share of the brightest light in the images of all banks that is invisible on any display.
const UNSEEN: f32 = 1e-6;

impl UnlitBank {
    /// Banks whose light, alone at full, is nowhere in the view. Because light bounces, only images
    /// can tell: none is rendered for this, and unless all coarse ones exist the list is empty.
    pub fn find(engine: &mut Engine) -> Vec<UnlitBank> {
        let peaks: Vec<f32> = coarse_at_hand(engine).iter().map(|i| peak(i)).collect();
        let brightest = peaks.iter().copied().fold(0.0, f32::max);
        let document = &engine.document;
        let show = document.show();
        let coordinates = show.coordinates();
        let mut lit = vec![peaks.is_empty(); show.banks.len()];
        // Images do not contain the direct light of heads.
        for (_, _, bank) in show.heads() {
            if let Some(lit) = lit.get_mut(bank) {
                *lit = true;
            }
        }
        for (coordinate, peak) in coordinates.iter().zip(&peaks) {
            if let Some(lit) = coordinate.bank.and_then(|bank| lit.get_mut(bank)) {
                *lit |= *peak > UNSEEN * brightest;
            }
        }
        let unlit = show.banks.iter().zip(lit).filter(|(_, lit)| !lit);
        let of = |(bank, _): (&Bank, bool)| UnlitBank {
            name: bank.name.clone(),
            place: document.place(bank.id),
        };
        unlit.map(of).collect()
    }
}

/// The coarse image of each coordinate alone at full; empty if one would have to be rendered.
fn coarse_at_hand(engine: &mut Engine) -> Vec<Arc<Image>> {
    let estimate = engine.estimate();
    if let Some(pool) = estimate.pool() {
        return pool.coarse().to_vec();
    }
    let [quality, _] = estimate.coarse_steps();
    let view = engine.looked_from().view;
    let store = engine.host.store.as_ref();
    let Ok((cache, of_view)) = engine.images.split(&view) else {
        return Vec::new();
    };
    let units = of_view.rendering.units();
    let at_hand = of_view.rendering.at_hand(cache, quality, &units, store);
    if at_hand.contains(&false) {
        return Vec::new();
    }
    let (found, _) = of_view.rendering.find(cache, quality, &units, None, store);
    let all: Option<Vec<_>> = found.into_iter().collect();
    all.unwrap_or_default()
}

impl PoolSummary {
    /// Lists images beyond the pool's own, and the stored ones that serve the show; `None` when the
    /// show has no stage or view.
    pub fn of(engine: &Engine) -> Option<PoolSummary> {
        let estimate = engine.estimate();
        estimate.rendering().ok()?;
        let held = estimate.pool().map_or(0, |p| images_of(p).len());
        Some(PoolSummary {
            held,
            idle: engine.images.cache.kept().len().saturating_sub(held),
            store: store_summary(estimate),
        })
    }
}

fn store_summary(estimate: Estimate<'_>) -> Option<StoreSummary> {
    let disk_cache = estimate.images.cache.disk_cache.as_ref()?;
    let stored = disk_cache.stored(estimate.host.store.as_ref());
    let (own, other): (Vec<Stored>, Vec<Stored>) =
        stored.into_iter().partition(|s| serves(estimate, s));
    Some(StoreSummary {
        folder: disk_cache.folder.clone(),
        limit: disk_cache.limit,
        own: own.iter().map(|s| (s.quality, s.bytes)).collect(),
        other: other.iter().map(|s| s.bytes).collect(),
    })
}

/// True when a stored image can serve the show: its scene and all its lights fit.
fn serves(estimate: Estimate<'_>, stored: &Stored) -> bool {
    let disk_cache = estimate.images.cache.disk_cache.as_ref();
    let (Ok(rendering), Some(disk_cache)) = (estimate.rendering(), disk_cache) else {
        return false;
    };
    rendering.is_of_scene(stored.scene_key)
        && disk_cache
            .lighting(estimate.host.store.as_ref(), *stored)
            .is_some_and(|lighting| rendering.can_use(stored.scene_key, &lighting))
}

impl Engine {
    /// Frees images, in memory and in the store: unusable ones, or all.
    ///
    /// # Errors
    /// [`Error::NoSetup`], [`Error::File`] when the store is not writable.
    pub fn drop_images(&mut self, all: bool) -> Result<Freed, Error> {
        let mut gone = Vec::new();
        let estimate = self.estimate();
        let store = self.host.store.as_ref();
        if let Some(disk_cache) = &self.images.cache.disk_cache {
            let stored = disk_cache.stored(store).into_iter();
            gone = stored.filter(|s| all || !serves(estimate, s)).collect();
        }
        let view = self.looked_from().view;
        let (cache, of_view) = self.images.split(&view)?;
        if all {
            of_view.rendering.pool = None;
            of_view.steps.clear();
            self.exposure = super::exposure::Exposure::default();
        }
        let pool = of_view.rendering.pool.as_ref();
        let held = pool.map(images_of).unwrap_or_default();
        let used = |image: &Arc<_>| held.contains(&Arc::as_ptr(image));
        let memory = cache.forget(|kept| !used(&kept.image));
        let mut freed = None;
        if let Some(disk_cache) = &mut cache.disk_cache {
            let (images, bytes) = disk_cache.free(store, |s| gone.contains(s))?;
            freed = Some((images, bytes, disk_cache.folder.clone()));
        }
        Ok(Freed {
            memory,
            store: freed,
        })
    }
}

/// The largest channel of an image.
fn peak(image: &Image) -> f32 {
    image.data().iter().copied().fold(0.0, f32::max)
}

/// Every image of a pool, each once.
fn images_of(pool: &Pool) -> Vec<*const Image> {
    let mut all: Vec<_> = pool.pictures().map(Arc::as_ptr).collect();
    all.sort();
    all.dedup();
    all
}
