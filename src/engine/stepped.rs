//! Frames of a show with moving heads as key images, for players without heads.

use std::collections::HashMap;

use super::Error;
use super::document::Document;
use super::heads::Heads;
use crate::playback::Playback;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::model::Pose;
use footlight_show::timeline::Segment;
use footlight_show::units::Time;
use footlight_transport::contract::check_memory;

/// Key images to be blended, made so far.
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

/// The sequence with its heads in key images alone: while a lit head moves, `rate` frames a
/// second are blended; otherwise the show's own keys. `None` without heads.
///
/// # Errors
/// When memory does not hold them; on cancel.
pub fn stepped(
    document: &Document,
    playback: &Playback,
    rate: f64,
    work: Work<'_>,
) -> Result<Option<Playback>, Error> {
    let Some(heads) = playback.heads().cloned() else {
        return Ok(None);
    };
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
