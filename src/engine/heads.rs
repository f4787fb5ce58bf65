//! Moving heads in frames: their direct light and their light in haze, which key images do not
//! contain.
//!
//! Settings of a show with heads have further coordinates for their reflected light
//! ([`Timeline::bounced`](footlight_show::timeline::Timeline::bounced)); a frame is the blended
//! image of its setting plus the result of [`Heads::add`].

use std::collections::HashMap;
use std::sync::Arc;

use super::compile::Compiled;
use super::document::Document;
use super::estimate::Estimate;
use super::images::Images;
use super::{Engine, Error};
use crate::playback::Playback;
use crate::pool::Pool;
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_show::model::{LightKind, Pose};
use footlight_show::timeline::Segment;
use footlight_show::units::Time;
use footlight_stage::rig;
use footlight_transport::Setup;
use footlight_transport::contract::check_memory;
use footlight_transport::moving::{HeadLight, Hung, MovingLights};

/// Direct light of heads in one view, computed once.
#[derive(Clone, Debug)]
pub(super) struct Lit {
    setup: Setup,
    hung: Vec<Hung>,
    lights: Arc<MovingLights>,
}

impl Lit {
    /// Approximate size in bytes.
    pub(super) fn bytes(&self) -> usize {
        self.lights.bytes()
    }
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

/// Frames of a show with heads as key images to be blended, for players without heads.
struct Stepped<'a> {
    document: &'a Document,
    heads: Heads,
    /// Number of the show's own coordinates.
    own: usize,
    keys: Vec<Vec<f64>>,
    images: Vec<Image>,
    /// Index of the key by the bits of setting and poses.
    known: HashMap<Vec<u64>, usize>,
}

impl Stepped<'_> {
    /// Index of the key for a setting and poses; `image` is its image without heads.
    fn key(
        &mut self,
        image: impl FnOnce() -> Image,
        setting: &[f64],
        poses: &[Pose],
        work: Work<'_>,
    ) -> Result<usize, Error> {
        let poses_of = poses.iter().flat_map(|p| [p.pan, p.tilt, p.beam, p.field]);
        let bits = setting.iter().copied().chain(poses_of).map(f64::to_bits);
        let bits: Vec<u64> = bits.collect();
        if let Some(key) = self.known.get(&bits) {
            return Ok(*key);
        }
        work.check()?;
        let mut image = image();
        let needed = (self.images.len() + 1) * size_of_val(image.data());
        check_memory("frames with moving lights", needed, work.memory)?;
        self.heads.add(setting, poses, &mut image, work)?;
        self.keys
            .push(setting.iter().copied().take(self.own).collect());
        self.images.push(image);
        self.known.insert(bits, self.images.len() - 1);
        Ok(self.images.len() - 1)
    }

    /// True where a lit head moves within a segment.
    fn moves(&self, segment: &Segment, poses: [&[Pose]; 2]) -> bool {
        let bounced = self.document.timeline().bounced();
        let keys = self.document.keys().keys();
        let is_lit = |head: usize| {
            let own = bounced.iter().filter(|one| one.head == head);
            let mut settings = segment.keys.iter().filter_map(|key| keys.get(*key));
            let own: Vec<usize> = own.map(|one| one.coordinate).collect();
            settings.any(|s| {
                own.iter()
                    .any(|c| s.get(*c).is_some_and(|light| *light != 0.0))
            })
        };
        let [from, to] = poses;
        let mut pairs = from.iter().zip(to).enumerate();
        pairs.any(|(head, (from, to))| from != to && is_lit(head))
    }
}

impl Engine {
    /// The sequence with its heads in key images alone: while a lit head moves, `rate` frames a
    /// second are blended; otherwise the show's own keys. `None` without heads.
    ///
    /// # Errors
    /// When memory does not hold them; on cancel.
    pub fn stepped(
        &self,
        playback: &Playback,
        rate: f64,
        work: Work<'_>,
    ) -> Result<Option<Playback>, Error> {
        let Some(heads) = playback.heads().cloned() else {
            return Ok(None);
        };
        let document = &self.document;
        let timeline = document.timeline();
        let mut stepped = Stepped {
            document,
            heads,
            own: document.show().coordinates().len(),
            keys: Vec::new(),
            images: Vec::new(),
            known: HashMap::new(),
        };
        let mut segments = Vec::new();
        let all = document.keys().segments();
        for (number, segment) in all.iter().enumerate() {
            work.progress
                .report("frames with moving heads", number, all.len());
            let (start, end) = (segment.start(), segment.end());
            let before = Time::nearest(end) - Time::from_micros(1);
            let [from, to] = [Time::nearest(start), before].map(|time| timeline.poses(time));
            if !stepped.moves(segment, [&from, &to]) {
                let settings = document.keys().keys();
                let own = segment.keys.iter();
                let own = own.filter_map(|key| Some((*key, settings.get(*key)?)));
                let keys = own.map(|(key, setting)| {
                    stepped.key(|| playback.key_image(key), setting, &from, work)
                });
                let keys: Vec<usize> = keys.collect::<Result<_, _>>()?;
                segments.push((start, end, keys));
                continue;
            }
            let steps = ((end - start) * rate).ceil().max(1.0) as usize;
            let at = |k: usize| start + (end - start) * k as f64 / steps as f64;
            let mut key = |k: usize| {
                let time = if k == steps {
                    before
                } else {
                    Time::nearest(at(k))
                };
                let setting = document.keys().evaluate(time);
                stepped.key(
                    || playback.blended(time),
                    &setting,
                    &timeline.poses(time),
                    work,
                )
            };
            let mut last = key(0)?;
            for k in 0..steps {
                let next = key(k + 1)?;
                segments.push((at(k), at(k + 1), vec![last, next]));
                last = next;
            }
        }
        let Stepped { keys, images, .. } = stepped;
        let keys = document.keys().replaced(keys, segments.into_iter());
        Ok(Playback::of(&keys, images))
    }
}
