//! Moving heads in frames: their direct light and their light in haze, which key images do not
//! contain.
//!
//! Settings of a show with heads have further coordinates for their reflected light
//! ([`Timeline::bounced`](footlight_show::timeline::Timeline::bounced)); a frame is the blended
//! image of its setting plus the result of [`Heads::add`].

use std::sync::Arc;

use super::Error;
use super::compile::Compiled;
use super::document::Document;
use super::estimate::Estimate;
use super::images::{Images, Lit};
use crate::pool::Pool;
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_show::model::{LightKind, Pose};
use footlight_show::units::Time;
use footlight_stage::rig;
use footlight_transport::Setup;
use footlight_transport::moving::{HeadLight, Hung, MovingLights};

/// The heads of a show as seen from one view.
#[derive(Clone, Debug)]
pub struct Heads {
    compiled: Arc<Compiled>,
    lights: Arc<MovingLights>,
}

impl Heads {
    /// Adds the heads' light at a time of the show.
    ///
    /// # Errors
    /// On cancel.
    pub fn add_at(&self, time: Time, image: &mut Image, work: Work<'_>) -> Result<(), Cancelled> {
        let timeline = &self.compiled.version.timeline;
        let poses = timeline.poses(time);
        self.add(&timeline.evaluate(time), &poses, image, work)
    }

    /// Adds the heads' light in a setting and these poses.
    ///
    /// # Errors
    /// On cancel.
    pub fn add(
        &self,
        setting: &[f64],
        poses: &[Pose],
        image: &mut Image,
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        self.lights.add(&self.shining(setting, poses), image, work)
    }

    fn shining(&self, setting: &[f64], poses: &[Pose]) -> Vec<HeadLight> {
        let Some(loaded) = &self.compiled.loaded else {
            return Vec::new();
        };
        let show = &self.compiled.version.show;
        let mut out = Vec::new();
        for (head, ((light, _, bank), pose)) in show.heads().into_iter().zip(poses).enumerate() {
            let strength = rig::strength(show, bank, setting);
            let Some(light) = show.lights.get(light).filter(|_| strength != [0.0; 3]) else {
                continue;
            };
            let lights = loaded.posed(light, *pose).into_iter();
            out.extend(lights.map(|light| HeadLight {
                head,
                light,
                strength,
            }));
        }
        out
    }
}

/// The image of a setting from the current pool, with the light of heads in these poses.
///
/// # Errors
/// [`Error::Plan`] for a wrong number of coordinates; on cancel.
pub fn frame(
    (pool, heads): (&Pool, Option<&Heads>),
    setting: &[f64],
    poses: &[Pose],
    work: Work<'_>,
) -> Result<Image, Error> {
    let mut image = pool.preview(setting, work)?;
    if let Some(heads) = heads {
        heads.add(setting, poses, &mut image, work)?;
    }
    Ok(image)
}

/// Positions of the show's heads, and their narrowest beams in it.
fn hung(document: &Document) -> Vec<Hung> {
    let (show, timeline) = (document.show(), document.timeline());
    let position = |light: usize| match show.lights.get(light).map(|light| &light.kind) {
        Some(LightKind::Spot(spot)) => spot.position,
        Some(LightKind::Projection { mount, .. }) => mount.position,
        _ => Vec3::ZERO,
    };
    let heads = show.heads().into_iter().enumerate();
    heads
        .map(|(number, (light, head, _))| {
            let own = timeline.bounced().iter().filter(|one| one.head == number);
            let fields = own.map(|one| one.pose.field);
            Hung {
                position: position(light),
                field: fields.fold(head.home.field, f64::min).to_radians(),
            }
        })
        .collect()
}

/// The light of heads is not known for a view.
pub(super) struct Unseen;

impl Estimate<'_> {
    /// The heads in the view of these images; `None` in a show without heads.
    pub(super) fn heads_seen(&self) -> Result<Option<Heads>, Unseen> {
        if self.document.show().heads().is_empty() {
            return Ok(None);
        }
        let view = |setup: &Setup| setup.view.clone();
        let own = self
            .rendering()
            .ok()
            .map(|rendering| view(&rendering.setup));
        if own != self.document.setup().map(view) {
            return Err(Unseen);
        }
        self.images.heads(self.document).map(Some).ok_or(Unseen)
    }
}

impl Images {
    /// The heads of a document in its current view, if computed.
    pub(super) fn heads(&self, document: &Document) -> Option<Heads> {
        let setup = document.setup()?;
        let hung = hung(document);
        let is_it = |lit: &&Lit| lit.setup.has_same_scene(setup) && lit.hung == hung;
        let lit = self.lit.as_ref().filter(is_it)?;
        Some(Heads {
            compiled: document.compiled(),
            lights: Arc::clone(&lit.lights),
        })
    }

    /// Computes the light of a document's heads, unless known.
    pub(super) fn find_heads(&mut self, document: &Document, work: Work<'_>) -> Result<(), Error> {
        let hung = hung(document);
        let Some(setup) = document.setup().filter(|_| !hung.is_empty()) else {
            return Ok(());
        };
        if self.heads(document).is_none() {
            work.progress.report("moving lights", 0, 1);
            let lights = MovingLights::new(setup, &hung, work)?;
            self.lit = Some(Lit {
                setup: setup.clone(),
                hung,
                lights: Arc::new(lights),
            });
        }
        Ok(())
    }
}
