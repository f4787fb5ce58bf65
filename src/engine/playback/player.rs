//! A sequence as display bytes, from key images in a chosen format.

use std::sync::Arc;

use super::Playback;
use super::kernel::{Factors, Keys, Target};
use super::key::{self, Format, KeyImage};
use footlight_host::files::Clock;
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_picture::tone::{ByteTable, Tone};
use footlight_show::timeline::{Segment, Timeline, blend};
use footlight_show::units::{Time, srgb_decode};

/// A sequence with its exposure and curve: every frame is made in one pass over its keys.
#[derive(Debug)]
pub struct Player {
    playback: Arc<Playback>,
    /// The converted key images; empty when the playback's own are used.
    kept: Vec<KeyImage>,
    format: Format,
    table: ByteTable,
    threads: usize,
}

impl Player {
    /// Converts every key image to `format`. In single precision nothing is copied.
    ///
    /// # Errors
    /// When the embedding program cancelled.
    pub fn new(
        playback: &Arc<Playback>,
        format: Format,
        tone: Tone,
        work: Work<'_>,
    ) -> Result<Player, Cancelled> {
        let mut kept = Vec::new();
        if format != Format::Float {
            for image in playback.images() {
                work.check()?;
                kept.push(KeyImage::new(image, format));
            }
        }
        Ok(Player {
            playback: Arc::clone(playback),
            kept,
            format,
            table: tone.table(),
            threads: work.threads,
        })
    }

    /// Converts every key image to half precision if the difference is invisible, otherwise keeps
    /// single precision.
    ///
    /// A half keeps light to a relative 2^-11, a twentieth of a display step, down to 2^-29 of the
    /// brightest light of its image. So halves are sufficient unless that is more than the light of
    /// half a step, for example when the sun is visible.
    ///
    /// # Errors
    /// As [`Player::new`].
    pub fn fitting(
        playback: &Arc<Playback>,
        tone: Tone,
        work: Work<'_>,
    ) -> Result<Player, Cancelled> {
        let brightest = playback.images().iter().map(key::peak).fold(0.0, f32::max);
        let format = if f64::from(brightest) * key::HALF_RANGE
            < tone.light(srgb_decode(0.5 / 255.0))
            && brightest < key::HALF_BRIGHTEST
        {
            Format::Half
        } else {
            Format::Float
        };
        Player::new(playback, format, tone, work)
    }

    /// Frames per second of playback over a timeline, measured for about half a second.
    pub fn frame_rate(&self, timeline: &Timeline, clock: &dyn Clock) -> f64 {
        let (start, end) = (timeline.start(), timeline.end());
        let mut bytes = Vec::new();
        let begin = clock.seconds();
        let mut frames = 0_usize;
        loop {
            // An irrational stride visits all kinds of segments.
            let part = (frames as f64 * 0.618_033_988_75).fract();
            self.show(start + (end - start).scaled(part), &mut bytes);
            frames += 1;
            let passed = clock.seconds() - begin;
            if passed > 0.5 || frames >= 500 {
                return frames as f64 / passed.max(1e-9);
            }
        }
    }

    /// Width and height of every frame.
    pub fn size(&self) -> (usize, usize) {
        self.playback.size()
    }

    /// Number of key images; 0 when frames are sums of the pool's images.
    pub fn keys(&self) -> usize {
        self.playback.images().len()
    }

    /// Storage format of the key images.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Bytes of the key images.
    pub fn bytes(&self) -> usize {
        let exact = |images: &[Image]| images.iter().map(|i| size_of_val(i.data())).sum();
        match self.format {
            Format::Float => exact(self.playback.images()),
            _ => self.kept.iter().map(KeyImage::bytes).sum(),
        }
    }

    /// Writes the frame at `time` to `out` as sRGB bytes, interleaved, row by row from the top;
    /// `out` is resized. Times outside the sequence show its first and last look.
    pub fn show(&self, time: Time, out: &mut Vec<u8>) {
        let (width, height) = self.playback.size();
        out.resize(width * height * 3, 0);
        if self.playback.heads().is_some() || self.playback.is_summed() {
            let mut light = Image::new(width, height);
            self.light(time, &mut light);
            return self.table.encode(light.data(), out);
        }
        self.blend(time, Target::Bytes(out, &self.table));
    }

    /// Writes the linear light of the frame at `time`.
    pub fn light(&self, time: Time, out: &mut Image) {
        if self.playback.is_summed() {
            *out = self.playback.frame(time);
            return;
        }
        let size = self.playback.size();
        if out.size() != size {
            *out = Image::new(size.0, size.1);
        }
        self.blend(time, Target::Light(out.data_mut()));
        self.playback.add_heads(time, out);
    }

    fn blend(&self, time: Time, target: Target<'_>) {
        let (index, t) = self.playback.keys().segment_at(time);
        let Some(segment) = self.playback.keys().segments().get(index) else {
            return;
        };
        let keys = match self.format {
            Format::Float => Some(self.playback.floats(segment)),
            _ => Keys::new(&self.kept(segment)),
        };
        if let Some(keys) = keys {
            keys.blend(Factors::new(blend(segment.degree, t)), target, self.threads);
        }
    }

    fn kept(&self, segment: &Segment) -> Vec<&KeyImage> {
        let keys = segment.keys.iter();
        keys.filter_map(|key| self.kept.get(*key)).collect()
    }
}
