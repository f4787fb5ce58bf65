//! One answer to "do we have a picture of this?": what is kept in memory, the store on disk, and
//! sums of both.
//!
//! The order is: the same address in memory; the same address on disk; a sum of pictures of the
//! same ground and quality; rendering. The first two give the very bits that rendering gave; a sum
//! agrees to the rounding of single precision. Sums are neither kept nor stored under their
//! address, so that only rendered pictures ever stand for rendering. Pictures that no pool uses are
//! kept within a budget, the least recently used dropped first. This module does not depend on
//! shows.

use std::sync::Arc;

use crate::files::Store;
use crate::picture::Image;
use crate::renderer::Quality;

use super::address::{Address, Digest, Lighting, SceneKey};
use super::disk_cache::{DiskCache, Note, Place};
use super::linear_span;

/// How pictures were come by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CacheStatistics {
    /// Rendered by the operator.
    pub rendered: usize,
    /// Found in memory.
    pub kept: usize,
    /// Found in the store.
    pub stored: usize,
    /// Added up from others.
    pub summed: usize,
}

impl CacheStatistics {
    /// What came after `before`.
    #[must_use]
    pub fn since(self, before: CacheStatistics) -> CacheStatistics {
        CacheStatistics {
            rendered: self.rendered - before.rendered,
            kept: self.kept - before.kept,
            stored: self.stored - before.stored,
            summed: self.summed - before.summed,
        }
    }

    /// Pictures that needed no rendering.
    pub fn found(self) -> usize {
        self.kept + self.stored + self.summed
    }
}

/// A picture that is asked for.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// What it shows.
    pub address: Address,
    /// The same for people.
    pub words: String,
    /// Where it stands among the pool's refined pictures, to be used again as such with other
    /// sources; `None` for a coarse one.
    pub refined: Option<Place>,
}

/// A picture in memory.
#[derive(Clone, Debug)]
pub struct Kept {
    /// What it shows.
    pub address: Address,
    /// Where it stood among its pool's refined pictures; `None` for a coarse one.
    pub refined: Option<Place>,
    /// The picture.
    pub image: Arc<Image>,
}

/// All pictures at hand.
#[derive(Debug, Default)]
pub struct ImageCache {
    /// The most recently used last.
    kept: Vec<Kept>,
    disk_cache: Option<DiskCache>,
    statistics: CacheStatistics,
}

impl ImageCache {
    /// With a store on disk, or without.
    pub fn new(disk_cache: Option<DiskCache>) -> ImageCache {
        ImageCache {
            disk_cache,
            ..ImageCache::default()
        }
    }

    /// How pictures were come by so far.
    pub fn statistics(&self) -> CacheStatistics {
        self.statistics
    }

    /// The store on disk, if there is one.
    pub fn disk_cache(&self) -> Option<&DiskCache> {
        self.disk_cache.as_ref()
    }

    /// The same, to free room.
    pub fn disk_cache_mut(&mut self) -> Option<&mut DiskCache> {
        self.disk_cache.as_mut()
    }

    /// Takes the store away, so that nothing is found in it or stored until it is attached again.
    pub fn detach(&mut self) -> Option<DiskCache> {
        self.disk_cache.take()
    }

    /// Gives a detached store back.
    pub fn attach(&mut self, disk_cache: Option<DiskCache>) {
        self.disk_cache = disk_cache;
    }

    /// Pictures in memory.
    pub fn kept(&self) -> &[Kept] {
        &self.kept
    }

    /// Forgets the pictures in memory that `which` picks; how many.
    pub fn forget(&mut self, which: impl Fn(&Kept) -> bool) -> usize {
        let before = self.kept.len();
        self.kept.retain(|kept| !which(kept));
        before - self.kept.len()
    }

    /// Warnings for the user, each once.
    pub fn notes(&mut self) -> Vec<Note> {
        self.disk_cache
            .as_mut()
            .map(DiskCache::notes)
            .unwrap_or_default()
    }

    /// The pictures of `wanted` that need no rendering.
    pub fn find(
        &mut self,
        wanted: &[Wanted],
        size: (usize, usize),
        store: &dyn Store,
    ) -> Vec<Option<Arc<Image>>> {
        let mut out: Vec<Option<Arc<Image>>> = Vec::with_capacity(wanted.len());
        for one in wanted {
            out.push(self.same(one, size, store));
        }
        self.add_up(wanted, &mut out, size, store);
        out
    }

    /// Which of `wanted` are at hand or are sums of what is, as far as names and headers show: no
    /// picture is read. One that turns out to be damaged is rendered after all.
    pub fn has(&self, wanted: &[Wanted], store: &dyn Store) -> Vec<bool> {
        let place = |one: &Wanted| (one.address.scene_key, one.address.quality);
        let Some(group) = wanted.first().map(place) else {
            return Vec::new();
        };
        let at_hand = self.at_hand(group.0, group.1, store);
        let pictures: Vec<&Lighting> = at_hand.iter().map(|(_, l)| l).collect();
        let targets: Vec<&Lighting> = wanted.iter().map(|w| &w.address.lighting).collect();
        let sums = linear_span::sums(&pictures, &targets);
        let known = |(one, sum): (&Wanted, Option<linear_span::Terms>)| {
            let same = at_hand.iter().any(|(key, _)| *key == one.address.key);
            place(one) == group && (same || sum.is_some())
        };
        wanted.iter().zip(sums).map(known).collect()
    }

    /// Keeps and stores a picture that was rendered.
    pub fn take_in(&mut self, wanted: &Wanted, image: Image, store: &dyn Store) -> Arc<Image> {
        self.statistics.rendered += 1;
        if let Some(disk_cache) = &mut self.disk_cache {
            let about = (wanted.words.as_str(), wanted.refined.as_ref());
            disk_cache.keep(store, &wanted.address, about, &image);
        }
        self.keep(wanted, Arc::new(image))
    }

    /// The picture of the very address.
    fn same(
        &mut self,
        wanted: &Wanted,
        size: (usize, usize),
        store: &dyn Store,
    ) -> Option<Arc<Image>> {
        let address = &wanted.address;
        let key = |kept: &Kept| kept.address.key == address.key;
        if let Some(at) = self.kept.iter().position(key) {
            let mut kept = self.kept.remove(at);
            kept.refined = kept.refined.or_else(|| wanted.refined.clone());
            let image = Arc::clone(&kept.image);
            self.kept.push(kept);
            self.statistics.kept += 1;
            return Some(image);
        }
        let name = (address.scene_key, address.quality, address.key);
        let (_, image) = self.disk_cache.as_mut()?.find(store, name, size)?;
        self.statistics.stored += 1;
        Some(self.keep(wanted, Arc::new(image)))
    }

    fn keep(&mut self, wanted: &Wanted, image: Arc<Image>) -> Arc<Image> {
        // Two sources may be lit alike; then both were asked for and one picture is enough.
        let key = |kept: &&Kept| kept.address.key == wanted.address.key;
        if let Some(kept) = self.kept.iter().find(key) {
            return Arc::clone(&kept.image);
        }
        self.kept.push(Kept {
            address: wanted.address.clone(),
            refined: wanted.refined.clone(),
            image: Arc::clone(&image),
        });
        image
    }

    /// Fills in what is a sum of pictures of the same ground and quality.
    fn add_up(
        &mut self,
        wanted: &[Wanted],
        out: &mut [Option<Arc<Image>>],
        size: (usize, usize),
        store: &dyn Store,
    ) {
        let open = |(one, place): (&Wanted, &Option<Arc<Image>>)| {
            let address = &one.address;
            place
                .is_none()
                .then_some((address.scene_key, address.quality))
        };
        let mut groups: Vec<_> = wanted.iter().zip(out.iter()).filter_map(open).collect();
        groups.dedup();
        for (scene_key, quality) in groups {
            let at_hand = self.at_hand(scene_key, quality, store);
            let indices: Vec<usize> = (0..wanted.len())
                .filter(|i| out.get(*i).is_some_and(Option::is_none))
                .collect();
            let targets: Vec<&Lighting> = indices
                .iter()
                .filter_map(|i| Some(&wanted.get(*i)?.address.lighting))
                .collect();
            let pictures: Vec<&Lighting> = at_hand.iter().map(|(_, l)| l).collect();
            let sums = linear_span::sums(&pictures, &targets);
            for (i, terms) in indices.into_iter().zip(sums) {
                let Some(terms) = terms else { continue };
                let place = (scene_key, quality);
                let image = self.sum(&terms, &at_hand, place, size, store);
                if let (Some(image), Some(to)) = (image, out.get_mut(i)) {
                    self.statistics.summed += 1;
                    *to = Some(Arc::new(image));
                }
            }
        }
    }

    /// What there are pictures of, in memory and on disk.
    fn at_hand(
        &self,
        scene_key: SceneKey,
        quality: Quality,
        store: &dyn Store,
    ) -> Vec<(Digest, Lighting)> {
        let fits =
            |kept: &&Kept| (kept.address.scene_key, kept.address.quality) == (scene_key, quality);
        let kept = self.kept.iter().filter(fits);
        let kept = kept.map(|k| (k.address.key, k.address.lighting.clone()));
        let mut all: Vec<(Digest, Lighting)> = kept.collect();
        if let Some(disk_cache) = &self.disk_cache {
            all.extend(disk_cache.lightings(store, scene_key, quality));
        }
        // Sums must not depend on what was used last.
        all.sort_by_key(|(key, _)| *key);
        all.dedup_by_key(|(key, _)| *key);
        all
    }

    /// The sum itself, from pictures that are what they say.
    fn sum(
        &mut self,
        terms: &linear_span::Terms,
        at_hand: &[(Digest, Lighting)],
        (scene_key, quality): (SceneKey, Quality),
        size: (usize, usize),
        store: &dyn Store,
    ) -> Option<Image> {
        let mut parts: Vec<([f64; 3], Arc<Image>)> = Vec::with_capacity(terms.len());
        for (i, weights) in terms {
            let (key, lighting) = at_hand.get(*i)?;
            let address = Address {
                scene_key,
                quality,
                lighting: lighting.clone(),
                key: *key,
            };
            parts.push((*weights, self.fetch(address, None, size, store)?));
        }
        let terms: Vec<([f64; 3], &Image)> = parts.iter().map(|(w, i)| (*w, i.as_ref())).collect();
        linear_span::added(size, &terms)
    }

    /// A picture that is known to be at hand, from memory or the store; `None` where it is not what
    /// its header said, or is gone. `refined` as in [`Kept`].
    pub fn fetch(
        &mut self,
        address: Address,
        refined: Option<Place>,
        size: (usize, usize),
        store: &dyn Store,
    ) -> Option<Arc<Image>> {
        if let Some(kept) = self.kept.iter().find(|k| k.address.key == address.key) {
            return Some(Arc::clone(&kept.image));
        }
        let name = (address.scene_key, address.quality, address.key);
        let (said, image) = self.disk_cache.as_mut()?.find(store, name, size)?;
        if said != address.lighting {
            return None;
        }
        let image = Arc::new(image);
        self.kept.push(Kept {
            address,
            refined,
            image: Arc::clone(&image),
        });
        Some(image)
    }

    /// As [`ImageCache::fetch`], counted as a picture that needed no rendering.
    pub fn recall(
        &mut self,
        address: Address,
        refined: Place,
        size: (usize, usize),
        store: &dyn Store,
    ) -> Option<Arc<Image>> {
        let known = self.kept.iter().any(|k| k.address.key == address.key);
        let image = self.fetch(address, Some(refined), size, store)?;
        match known {
            true => self.statistics.kept += 1,
            false => self.statistics.stored += 1,
        }
        Some(image)
    }

    /// Drops what was used least recently of what is not held elsewhere, until the budget in bytes
    /// is kept.
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
