//! Versions of a show, and the refined images that serve two of them.

use std::collections::BTreeSet;

use super::compile::{self, Source, Version};
use super::rendering::SetupImages;
use super::setup::{self, Loaded};
use super::{Engine, Error, Host, decode};
use crate::files::Files;
use crate::pool::address::Digest;
use crate::pool::image_cache::ImageCache;
use crate::renderer::Quality;

impl Version {
    /// Reads a version by its name, its bytes and the files that it may include.
    ///
    /// # Errors
    /// [`Error::Show`] with the errors of the text and its curves.
    pub fn read(name: &str, bytes: &[u8], files: &dyn Files) -> Result<Version, Error> {
        let text = decode(name, bytes)?;
        let source = Source {
            name,
            text: &text,
            view: None,
            files,
            memory: 0,
        };
        compile::parse(source)
    }

    /// The names of the refined images in `image_cache` that serve this version; none where it has
    /// no stage, or one that cannot be read. The scene of `known` is taken where it is the same.
    fn serving(
        &self,
        host: &Host,
        image_cache: &ImageCache,
        known: Option<&Loaded>,
    ) -> BTreeSet<Digest> {
        let Version { show, spans, .. } = self;
        let source = Source {
            name: "",
            text: "",
            view: None,
            files: host.files.as_ref(),
            memory: host.memory,
        };
        let Ok((Some(loaded), _)) = setup::load(show, spans, source, known) else {
            return BTreeSet::new();
        };
        let version = host.renderer.results_version();
        let rendering = SetupImages::renew(None, &loaded.setup, &show.preview, version.as_deref());
        let finest = rendering.finest(host.renderer.as_ref());
        let least = Quality(show.preview.refined.clamp(1, finest.0));
        rendering.serving(image_cache, least, host.store.as_ref())
    }
}

/// Refined images that serve an older version of a show, and those of them that serve a newer one
/// too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Serving {
    /// Those that serve the older version.
    pub old: usize,
    /// Those of them that serve the newer version.
    pub both: usize,
}

impl Serving {
    /// Counts the images in the host's store.
    pub fn in_store(old: &Version, new: &Version, host: &Host) -> Serving {
        Serving::count(old, new, (host, &host.image_cache(), None))
    }

    fn count(
        old: &Version,
        new: &Version,
        (host, image_cache, known): (&Host, &ImageCache, Option<&Loaded>),
    ) -> Serving {
        let old = old.serving(host, image_cache, known);
        let new = new.serving(host, image_cache, known);
        Serving {
            old: old.len(),
            both: old.intersection(&new).count(),
        }
    }
}

impl Engine {
    /// Counts the images at hand that serve two versions of the show.
    pub fn serving(&self, old: &Version, new: &Version) -> Serving {
        let compiled = self.document.compiled();
        let known = compiled.loaded.as_ref();
        Serving::count(old, new, (&self.host, &self.image_cache, known))
    }
}
