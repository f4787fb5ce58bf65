//! Everything that is rendered of a show: images at hand, and of each view that is looked from or
//! refined its operators and its pool.

use std::collections::BTreeMap;

use super::Error;
use super::document::Document;
use super::goal::Step;
use super::heads::Lit;
use super::host::Host;
use super::pace::Pace;
use super::rendering::SetupImages;
use crate::pool::disk_cache::Note;
use crate::pool::image_cache::{CacheStatistics, ImageCache};
use footlight_host::work::Work;

/// A view by its name; `None` where the show has none.
pub(super) type ViewName = Option<String>;

/// What is rendered from one view.
pub(super) struct ViewImages {
    /// Operators and pool.
    pub rendering: SetupImages,
    /// The sequence after each refined image.
    pub steps: Vec<Step>,
}

/// All that is rendered of a document, and how long rendering takes here.
pub struct Images {
    /// Every image at hand, whether a pool uses it or not.
    pub(super) cache: ImageCache,
    /// Of each view that is in use; a view without a stage has none.
    views: BTreeMap<ViewName, ViewImages>,
    /// How long things take here against what the operator predicts.
    pub(super) pace: Pace,
    /// The light that heads can throw.
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
    /// Nothing but what the host has stored.
    pub(super) fn new(host: &Host) -> Images {
        Images {
            cache: host.image_cache(),
            views: BTreeMap::new(),
            pace: Pace::default(),
            lit: None,
        }
    }

    /// How the images of this session were obtained so far.
    pub fn statistics(&self) -> CacheStatistics {
        self.cache.statistics()
    }

    /// What went wrong with stored images since this was called last.
    pub(super) fn notes(&mut self) -> Vec<Note> {
        self.cache.notes()
    }

    /// What is rendered from a view.
    pub(super) fn of(&self, view: &ViewName) -> Option<&ViewImages> {
        self.views.get(view)
    }

    /// Operators and pool of a view.
    ///
    /// # Errors
    /// [`Error::NoSetup`] where it cannot be looked from.
    pub(super) fn rendering(&mut self, view: &ViewName) -> Result<&mut SetupImages, Error> {
        self.split(view).map(|(_, of_view)| &mut of_view.rendering)
    }

    /// The cache, and what is rendered from a view.
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

    /// Keeps of the views in use what the document's setup still means: of the view that it looks
    /// from, and of `others` that are refined. A view that is new is shown at the steps of quality
    /// of the one before.
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

    /// The host's means, with the memory that images and operators leave, and those images that
    /// are made of others for a while.
    pub(super) fn work<'h>(&self, host: &'h Host) -> Work<'h> {
        let renderings = self.views.values().map(|v| &v.rendering);
        let lit = self.lit.as_ref().map_or(0, Lit::bytes);
        let held = renderings.map(|r| r.operator_bytes() + r.image_bytes() + r.working_bytes());
        host.work()
            .holding(held.sum::<usize>() + self.cache.bytes() + lit)
    }
}
