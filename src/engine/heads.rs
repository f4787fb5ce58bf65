//! Moving heads in frames: their direct light and their light in haze, which no image at hand has.
//!
//! The settings of a show with heads have further coordinates for the light of heads that surfaces
//! reflect ([`Timeline::bounced`](footlight_show::timeline::Timeline::bounced)); a frame is the image of
//! its setting, blended as always, plus what [`Heads::add`] adds.

use std::sync::Arc;

use super::Error;
use super::compile::Compiled;
use super::document::Document;
use super::images::Images;
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_show::model::{LightKind, Pose};
use footlight_show::units::Time;
use footlight_stage::rig;
use footlight_transport::Setup;
use footlight_transport::moving::{HeadLight, Hung, MovingLights};

/// What the heads of a show light from one view, found once.
#[derive(Clone, Debug)]
pub(super) struct Lit {
    setup: Setup,
    hung: Vec<Hung>,
    lights: Arc<MovingLights>,
}

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

    /// Bytes, about.
    pub fn bytes(&self) -> usize {
        self.lights.bytes()
    }

    fn shining(&self, setting: &[f64], poses: &[Pose]) -> Vec<HeadLight> {
        let Some(loaded) = &self.compiled.loaded else {
            return Vec::new();
        };
        let show = &self.compiled.version.show;
        let mut out = Vec::new();
        for (head, ((.., bank), pose)) in show.heads().into_iter().zip(poses).enumerate() {
            let strength = rig::strength(show, bank, setting);
            if strength == [0.0; 3] {
                continue;
            }
            let lights = loaded.head_lights(show, head, *pose);
            out.extend(lights.into_iter().map(|light| HeadLight {
                head,
                light,
                strength,
            }));
        }
        out
    }
}

/// Where the heads of a show hang, and how narrow they get in it.
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

impl Images {
    /// The heads of a document from the view that it looks from, if they are found already.
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

    /// Finds what the heads of a document light, where that is not known yet.
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
