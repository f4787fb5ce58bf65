//! Errors of key image formats, compared with the same blend in double precision.
//!
//! Errors are in 8-bit display steps of values before rounding, because rounding is the display's
//! own error, half a step at most for any keys.

use footlight_engine::playback::Playback;
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_picture::tone::{ByteTable, Tone};
use footlight_show::timeline::blend;
use footlight_show::units::Time;
use footlight_show::units::ToneCurve;

/// The invisible error: half a step of 8 bits.
pub const UNSEEN: f64 = 0.5;

/// Positions in a segment at which frames are judged; not only the ends, where a single key counts.
const MOMENTS: [f64; 4] = [0.0, 0.21, 0.5, 0.79];

/// A frame from some playback method.
#[derive(Clone, Debug)]
pub enum Frame {
    /// Light.
    Light(Image),
    /// Display bytes.
    Bytes(Vec<u8>),
}

/// Errors of a sequence's frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The largest error of a channel, steps.
    pub most: f64,
    /// Root mean square over channels and time, steps.
    pub rms: f64,
    /// Share of channels, over time, with an error above [`UNSEEN`].
    pub seen: f64,
    /// The largest error of each sampled channel, in the order of the image.
    pub worst: Vec<f32>,
}

/// Display values of light, in steps and not rounded: linear between the thresholds of neighbouring
/// bytes, which is accurate to 0.0071 steps (at code 11, just above the end of sRGB's straight toe,
/// where its curve is bent most). Differences of similar lights are accurate in proportion.
struct Steps {
    table: ByteTable,
    /// The light of code - 1/2 for the codes 0 to 255, then of 255.
    marks: [f64; 257],
}

impl Steps {
    fn new(tone: Tone) -> Steps {
        let mut marks = [0.0; 257];
        for (mark, threshold) in marks.iter_mut().skip(1).zip(tone.thresholds()) {
            *mark = f64::from(threshold);
        }
        if let Some(white) = marks.last_mut() {
            *white = tone.light(1.0);
        }
        Steps {
            table: tone.table(),
            marks,
        }
    }

    fn of(&self, light: f64) -> f64 {
        let byte = usize::from(self.table.byte(light as f32));
        let Some([below, above]) = self.marks.get(byte..byte + 2) else {
            return 0.0;
        };
        // Half a step wide at both ends.
        let (from, to) = ((byte as f64 - 0.5).max(0.0), (byte as f64 + 0.5).min(255.0));
        let along = ((light - below) / (above - below)).clamp(0.0, 1.0);
        from + along * (to - from)
    }
}

/// Judges the frames from `frame`: four moments of each segment, every `stride`-th channel.
pub fn judge(
    playback: &Playback,
    tone: Tone,
    stride: usize,
    frame: &mut dyn FnMut(Time) -> Frame,
    work: Work<'_>,
) -> Result<Judged, Cancelled> {
    let steps = Steps::new(tone);
    let stride = stride.max(1);
    let channels = playback.size().0 * playback.size().1 * 3;
    let mut worst = vec![0.0_f32; channels.div_ceil(stride)];
    let (mut square, mut seen, mut length) = (0.0, 0.0, 0.0);
    let total = playback.keys().segments().len();
    for (done, segment) in playback.keys().segments().iter().enumerate() {
        work.check()?;
        let moments: &[f64] = match segment.degree {
            0 => &[0.0],
            _ => &MOMENTS,
        };
        for moment in moments {
            let seconds = segment.start() + moment * segment.duration();
            let time = Time::nearest(seconds);
            let found = frame(time);
            let exact = Exact::new(playback, time);
            let (mut own_square, mut own_seen) = (0.0, 0.0);
            for (at, worst) in worst.iter_mut().enumerate() {
                let channel = at * stride;
                let shown = match &found {
                    Frame::Light(image) => steps.of(value(image, channel)),
                    Frame::Bytes(bytes) => bytes.get(channel).map_or(0.0, |b| f64::from(*b)),
                };
                let off = (shown - steps.of(exact.light(channel))).abs();
                *worst = worst.max(off as f32);
                own_square += off * off;
                own_seen += f64::from(u8::from(off > UNSEEN));
            }
            let weight = segment.duration() / moments.len() as f64;
            square += weight * own_square;
            seen += weight * own_seen;
            length += weight;
        }
        work.progress.report("judging frames", done + 1, total);
    }
    let all = (length * worst.len() as f64).max(f64::MIN_POSITIVE);
    Ok(Judged {
        most: f64::from(worst.iter().copied().fold(0.0, f32::max)),
        rms: (square / all).sqrt(),
        seen: seen / all,
        worst,
    })
}

fn value(image: &Image, channel: usize) -> f64 {
    image.data().get(channel).map_or(0.0, |v| f64::from(*v))
}

/// The frame of a moment in double precision.
struct Exact<'a> {
    terms: Vec<(f64, &'a Image)>,
}

impl<'a> Exact<'a> {
    fn new(playback: &'a Playback, time: Time) -> Exact<'a> {
        let (index, t) = playback.keys().segment_at(time);
        let terms = playback.keys().segments().get(index).map(|segment| {
            let weights = blend(segment.degree, t).weights().into_iter();
            let images = segment.keys.iter();
            let images = images.filter_map(|key| playback.images().get(*key));
            weights.zip(images).collect()
        });
        Exact {
            terms: terms.unwrap_or_default(),
        }
    }

    fn light(&self, channel: usize) -> f64 {
        let terms = self.terms.iter();
        terms.map(|(w, image)| w * value(image, channel)).sum()
    }
}

#[test]
fn steps_are_the_displays_values() {
    for curve in [ToneCurve::Filmic, ToneCurve::Plain] {
        let tone = Tone {
            exposure: 1.7,
            curve,
        };
        let steps = Steps::new(tone);
        for i in 0..40_000 {
            let light = f64::from(i) * 1e-4 * tone.light(1.0) / 3.9;
            let exact = 255.0 * tone.display(light);
            assert!(
                (steps.of(light) - exact).abs() < 0.0072,
                "{curve:?} {light}"
            );
        }
        assert_eq!([steps.of(-1.0), steps.of(1e9)], [0.0, 255.0]);
    }
}
