//! Looks up images: in memory, in the store on disk, and as sums of both.
//!
//! The order is: the address in memory; the address on disk; a sum of images of the same scene and
//! quality; rendering. The first two give the bits of the original rendering; a sum agrees to the
//! rounding of single precision and is neither kept nor stored. Images that no pool uses are kept
//! within a budget.

use std::sync::Arc;

use footlight_host::files::Store;
use footlight_picture::Image;

use super::address::{Address, Digest, Lighting};
use super::disk_cache::{DiskCache, Note, PlaceInPool};
use super::linear_span::{self, Terms};

/// Statistics on the sources of images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CacheStatistics {
    /// Rendered by the operator.
    pub rendered: usize,
    /// Found in memory.
    pub kept: usize,
    /// Found in the store.
    pub stored: usize,
    /// Computed as a sum of others.
    pub summed: usize,
}

impl CacheStatistics {
    /// The difference to `before`.
    #[must_use]
    pub fn since(self, before: CacheStatistics) -> CacheStatistics {
        CacheStatistics {
            rendered: self.rendered - before.rendered,
            kept: self.kept - before.kept,
            stored: self.stored - before.stored,
            summed: self.summed - before.summed,
        }
    }

    /// Number of images that needed no rendering.
    pub fn found(self) -> usize {
        self.kept + self.stored + self.summed
    }
}

/// A requested image.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// Its address.
    pub address: Address,
    /// Its description for people.
    pub words: String,
    /// Its place among the pool's refined images, for reuse with other sources; `None` for a coarse
    /// one.
    pub refined: Option<PlaceInPool>,
}

/// An image in memory.
#[derive(Clone, Debug)]
pub struct Kept {
    /// Its address.
    pub address: Address,
    /// Its place among its pool's refined images; `None` for a coarse one.
    pub refined: Option<PlaceInPool>,
    /// The image.
    pub image: Arc<Image>,
}

/// The image cache.
#[derive(Debug, Default)]
pub struct ImageCache {
    /// Images by time of use, the latest last.
    kept: Vec<Kept>,
    /// The store on disk, if any; without it nothing is found there or stored.
    pub disk_cache: Option<DiskCache>,
    statistics: CacheStatistics,
}

impl ImageCache {
    /// A cache with or without a store on disk.
    pub fn new(disk_cache: Option<DiskCache>) -> ImageCache {
        ImageCache {
            disk_cache,
            ..ImageCache::default()
        }
    }

    /// Statistics so far.
    pub fn statistics(&self) -> CacheStatistics {
        self.statistics
    }

    /// Counts rendered images that are not kept.
    pub fn count_rendered(&mut self, pictures: usize) {
        self.statistics.rendered += pictures;
    }

    /// Images in memory.
    pub fn kept(&self) -> &[Kept] {
        &self.kept
    }

    /// Bytes of the images in memory.
    pub fn bytes(&self) -> usize {
        let of = |kept: &Kept| size_of_val(kept.image.data());
        self.kept.iter().map(of).sum()
    }

    /// Drops the images in memory selected by `which`; returns their number.
    pub fn forget(&mut self, which: impl Fn(&Kept) -> bool) -> usize {
        let before = self.kept.len();
        self.kept.retain(|kept| !which(kept));
        before - self.kept.len()
    }

    /// Warnings for the user, each once.
    pub fn notes(&mut self) -> Vec<Note> {
        let disk_cache = self.disk_cache.as_mut();
        disk_cache.map_or_else(Vec::new, DiskCache::notes)
    }

    /// Returns those images of `wanted`, all of one scene and quality, that need no rendering.
    pub fn find(
        &mut self,
        wanted: &[Wanted],
        size: (usize, usize),
        store: &dyn Store,
    ) -> Vec<Option<Arc<Image>>> {
        let mut out = Vec::with_capacity(wanted.len());
        let mut open = Vec::new();
        for one in wanted {
            let same = self.recall(&one.address, one.refined.as_ref(), size, store);
            open.extend(same.is_none().then_some(one));
            out.push(same);
        }
        let (at_hand, combinations) = self.combinations(&open, store);
        let gaps = out.iter_mut().filter(|image| image.is_none());
        for (gap, terms) in gaps.zip(combinations) {
            let image = terms.and_then(|terms| self.sum(&terms, &at_hand, size, store));
            self.statistics.summed += usize::from(image.is_some());
            *gap = image.map(Arc::new);
        }
        out
    }

    /// For each image of `wanted`, all of one scene and quality, true when it exists or is a sum of
    /// existing images, according to names and headers. A damaged image is still rendered.
    pub fn has(&self, wanted: &[Wanted], store: &dyn Store) -> Vec<bool> {
        let (at_hand, combinations) = self.combinations(&wanted.iter().collect::<Vec<_>>(), store);
        let known = |(one, sum): (&Wanted, Option<Terms>)| {
            sum.is_some() || at_hand.iter().any(|there| there.key == one.address.key)
        };
        wanted.iter().zip(combinations).map(known).collect()
    }

    /// Keeps and stores a rendered image.
    pub fn take_in(&mut self, wanted: &Wanted, image: Image, store: &dyn Store) -> Arc<Image> {
        self.statistics.rendered += 1;
        if let Some(disk_cache) = &mut self.disk_cache {
            let about = (wanted.words.as_str(), wanted.refined.as_ref());
            disk_cache.keep(store, &wanted.address, about, &image);
        }
        // Two sources may be lit alike; one image is enough for both.
        if let Some(kept) = self.in_memory(wanted.address.key) {
            return Arc::clone(&kept.image);
        }
        self.keep(wanted.address.clone(), wanted.refined.clone(), image)
    }

    fn in_memory(&self, key: Digest) -> Option<&Kept> {
        self.kept.iter().find(|kept| kept.address.key == key)
    }

    fn keep(&mut self, address: Address, refined: Option<PlaceInPool>, image: Image) -> Arc<Image> {
        let image = Arc::new(image);
        self.kept.push(Kept {
            address,
            refined,
            image: Arc::clone(&image),
        });
        image
    }

    /// Existing images, in memory and on disk, of the scene and quality of `wanted`, and the sums
    /// of them that give `wanted`.
    fn combinations(
        &self,
        wanted: &[&Wanted],
        store: &dyn Store,
    ) -> (Vec<Address>, Vec<Option<Terms>>) {
        let Some(Wanted { address, .. }) = wanted.first() else {
            return (Vec::new(), Vec::new());
        };
        let (scene_key, quality) = (address.scene_key, address.quality);
        let kept = self.kept.iter().map(|kept| &kept.address);
        let fitting = kept.filter(|a| a.scene_key == scene_key && a.quality == quality);
        let mut at_hand: Vec<Address> = fitting.cloned().collect();
        if let Some(disk_cache) = &self.disk_cache {
            at_hand.extend(disk_cache.addresses(store, scene_key, quality));
        }
        // Sums must not depend on the order of use.
        at_hand.sort_by_key(|address| address.key);
        at_hand.dedup_by_key(|address| address.key);
        let pictures: Vec<&Lighting> = at_hand.iter().map(|a| &a.lighting).collect();
        let targets: Vec<&Lighting> = wanted.iter().map(|w| &w.address.lighting).collect();
        let combinations = linear_span::combinations(&pictures, &targets);
        (at_hand, combinations)
    }

    /// Computes the sum from verified images.
    fn sum(
        &mut self,
        terms: &Terms,
        at_hand: &[Address],
        size: (usize, usize),
        store: &dyn Store,
    ) -> Option<Image> {
        let mut parts: Vec<([f64; 3], Arc<Image>)> = Vec::with_capacity(terms.len());
        for (i, weights) in terms {
            let (image, _) = self.fetch(at_hand.get(*i)?, None, size, store)?;
            parts.push((*weights, image));
        }
        let terms: Vec<([f64; 3], &Image)> = parts.iter().map(|(w, i)| (*w, i.as_ref())).collect();
        linear_span::weighted_sum(size, &terms)
    }

    /// The image of an address, from memory (`true`) or the store; `None` when there is none, or it
    /// disagrees with its header. `refined` as in [`Kept`].
    fn fetch(
        &mut self,
        address: &Address,
        refined: Option<&PlaceInPool>,
        size: (usize, usize),
        store: &dyn Store,
    ) -> Option<(Arc<Image>, bool)> {
        let key = |kept: &Kept| kept.address.key == address.key;
        if let Some(at) = self.kept.iter().position(key) {
            let mut kept = self.kept.remove(at);
            kept.refined = kept.refined.or_else(|| refined.cloned());
            let image = Arc::clone(&kept.image);
            self.kept.push(kept);
            return Some((image, true));
        }
        let disk_cache = self.disk_cache.as_mut()?;
        let (said, image) = disk_cache.find(store, address.name(), size)?;
        let is_right = said == address.lighting;
        is_right.then(|| (self.keep(address.clone(), refined.cloned(), image), false))
    }

    /// Like `fetch`, counted as an image that needed no rendering.
    pub fn recall(
        &mut self,
        address: &Address,
        refined: Option<&PlaceInPool>,
        size: (usize, usize),
        store: &dyn Store,
    ) -> Option<Arc<Image>> {
        let (image, is_kept) = self.fetch(address, refined, size, store)?;
        if is_kept {
            self.statistics.kept += 1;
        } else {
            self.statistics.stored += 1;
        }
        Some(image)
    }

    /// Drops the least recently used images that nothing else holds, down to a budget in bytes.
    pub fn trim(&mut self, budget: usize) {
        let idle = |kept: &Kept| match Arc::strong_count(&kept.image) {
            1 => size_of_val(kept.image.data()),
            _ => 0,
        };
        let mut bytes: usize = self.kept.iter().map(idle).sum();
        self.kept.retain(|kept| {
            let own = idle(kept);
            let drop = own > 0 && bytes > budget;
            if drop {
                bytes -= own;
            }
            !drop
        });
    }
}
