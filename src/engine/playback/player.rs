//! A sequence as display bytes.

use std::sync::Arc;

use super::Playback;
use super::kernel::BlendTarget;
use footlight_host::files::Clock;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::tone::{ByteTable, Tone};
use footlight_show::timeline::Timeline;
use footlight_show::units::Time;

/// A sequence with its exposure and curve: every frame is made in one pass over its keys. Later
/// edits and images do not change it.
#[derive(Debug)]
pub struct Player {
    playback: Arc<Playback>,
    table: ByteTable,
    threads: usize,
}

impl Player {
    /// A player of key images in a tone.
    pub fn new(playback: &Arc<Playback>, tone: Tone, work: Work<'_>) -> Player {
        Player {
            playback: Arc::clone(playback),
            table: tone.table(),
            threads: work.threads,
        }
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
            self.frame(start + (end - start).scaled(part), &mut bytes);
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

    /// Writes the frame at `time` to `out` as sRGB bytes, interleaved, row by row from the top;
    /// `out` is resized. Times outside the sequence show its first and last look.
    pub fn frame(&self, time: Time, out: &mut Vec<u8>) {
        let (width, height) = self.playback.size();
        out.resize(width * height * 3, 0);
        if self.playback.heads().is_some() {
            let mut light = Image::new(width, height);
            self.light(time, &mut light);
            return self.table.encode(light.data(), out);
        }
        let target = BlendTarget::Bytes(out, &self.table);
        self.playback.blend(time, target, self.threads);
    }

    /// Writes the linear light of the frame at `time`.
    pub fn light(&self, time: Time, out: &mut Image) {
        let size = self.playback.size();
        if out.size() != size {
            *out = Image::new(size.0, size.1);
        }
        let target = BlendTarget::Light(out.data_mut());
        self.playback.blend(time, target, self.threads);
        self.playback.add_heads(time, out);
    }
}
