//! All rendered images of a show: the cache, and operators and pool of each view in use.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Error;
use super::document::Document;
use super::goal::SequenceState;
use super::host::Host;
use super::pace::Pace;
use super::rendering::SetupImages;
use crate::pool::disk_cache::Note;
use crate::pool::image_cache::{CacheStatistics, ImageCache};
use footlight_host::work::Work;
use footlight_transport::Setup;
use footlight_transport::moving::{Hung, MovingLights};

/// Name of a view; `None` if the show has none.
pub(super) type ViewName = Option<String>;

/// Operators and images of one view.
pub(super) struct ViewImages {
    /// Operators and pool.
    pub rendering: SetupImages,
    /// The sequence after each refined image.
    pub steps: Vec<SequenceState>,
}

/// Direct light of heads in one view, computed once.
#[derive(Clone, Debug)]
pub(super) struct Lit {
    pub setup: Setup,
    pub hung: Vec<Hung>,
    pub lights: Arc<MovingLights>,
}

impl Lit {
    /// Approximate size in bytes.
    fn bytes(&self) -> usize {
        self.lights.bytes()
    }
}

/// Rendered images of a document, and the speed of rendering.
pub struct Images {
    /// Every image in memory, used by a pool or not.
    pub(super) cache: ImageCache,
    /// By view in use; a view without a stage has no entry.
    views: BTreeMap<ViewName, ViewImages>,
    /// Ratio of measured to predicted time.
    pub(super) pace: Pace,
    /// Direct light of heads.
    pub(super) lit: Option<Lit>,
}

impl std::fmt::Debug for Images {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Images")
            .field("statistics", &self.statistics())
            .field("views", &self.views.keys())
            .finish_non_exhaustive()
    }
}

impl Images {
    /// Images of a new document: only those in the host's store.
    pub(super) fn new(host: &Host) -> Images {
        Images {
            cache: host.image_cache(),
            views: BTreeMap::new(),
            pace: Pace::default(),
            lit: None,
        }
    }

    /// Statistics on the sources of this session's images.
    pub fn statistics(&self) -> CacheStatistics {
        self.cache.statistics()
    }

    /// Faults of stored images since the last call.
    pub(super) fn notes(&mut self) -> Vec<Note> {
        self.cache.notes()
    }

    /// Operators and images of a view.
    pub(super) fn of(&self, view: &ViewName) -> Option<&ViewImages> {
        self.views.get(view)
    }

    /// Operators and pool of a view.
    ///
    /// # Errors
    /// [`Error::NoSetup`] when the view is not usable.
    pub(super) fn rendering(&mut self, view: &ViewName) -> Result<&mut SetupImages, Error> {
        self.split(view).map(|(_, of_view)| &mut of_view.rendering)
    }

    /// The cache, and operators and images of a view.
    ///
    /// # Errors
    /// As [`Images::rendering`].
    pub(super) fn split(
        &mut self,
        view: &ViewName,
    ) -> Result<(&mut ImageCache, &mut ViewImages), Error> {
        let of_view = self.views.get_mut(view).ok_or(Error::NoSetup)?;
        Ok((&mut self.cache, of_view))
    }

    /// Keeps images that are still valid for the document's views in use: its current one and the
    /// `others` being refined. A new view starts with the quality steps of the previous one.
    pub(super) fn renew<'v>(
        &mut self,
        document: &Document,
        host: &Host,
        others: impl Iterator<Item = &'v ViewName>,
    ) {
        let version = host.renderer.results_version();
        let preview = &document.show().preview;
        let looked_from: ViewName = document.view().map(str::to_owned);
        let mut old = std::mem::take(&mut self.views);
        let shown = old.values().next().map(|v| v.rendering.shown());
        for view in others.cloned().chain([looked_from.clone()]) {
            if self.views.contains_key(&view) {
                continue;
            }
            let setup = if view == looked_from {
                document.setup().cloned()
            } else {
                view.as_deref().and_then(|view| document.setup_from(view))
            };
            let Some(setup) = setup else { continue };
            let version = version.as_deref();
            let of_view = match old.remove(&view) {
                Some(ViewImages { rendering, steps }) => ViewImages {
                    rendering: rendering.renew(setup, preview, version),
                    steps,
                },
                None => ViewImages {
                    rendering: SetupImages::new(setup, preview, version, shown),
                    steps: Vec::new(),
                },
            };
            self.views.insert(view, of_view);
        }
    }

    /// The host's resources, minus the memory of images and operators, except images that can be
    /// derived from others.
    pub(super) fn work<'h>(&self, host: &'h Host) -> Work<'h> {
        let renderings = self.views.values().map(|v| &v.rendering);
        let lit = self.lit.as_ref().map_or(0, Lit::bytes);
        let held = renderings.map(|r| r.operator_bytes() + r.image_bytes() + r.working_bytes());
        host.work()
            .holding(held.sum::<usize>() + self.cache.bytes() + lit)
    }
}
