//! The method of the paper's hardware: key images are coded for the display and blended as codes.
//! It is wrong wherever keys differ, because codes are not linear in light.

use footlight_engine::playback::Playback;
use footlight_picture::tone::Tone;
use footlight_show::timeline::{Blend, KeySequence, blend};
use footlight_show::units::Time;

/// The paper's hardware: display-coded keys, blended as codes, each blend rounded to 8 bits.
#[derive(Debug)]
pub struct Displayed<'a> {
    keys: &'a KeySequence,
    codes: Vec<Vec<u8>>,
}

impl<'a> Displayed<'a> {
    /// Encodes every key.
    pub fn new(playback: &'a Playback, tone: Tone) -> Displayed<'a> {
        let code = |image| tone.encode(image);
        Displayed {
            keys: playback.keys(),
            codes: playback.images().iter().map(code).collect(),
        }
    }

    /// The frame at a time.
    pub fn show(&self, time: Time) -> Vec<u8> {
        let (index, t) = self.keys.segment_at(time);
        let segment = &self.keys.segments()[index];
        let key = |i: usize| &self.codes[segment.keys[i]];
        let mut out = key(0).clone();
        match blend(segment.degree, t) {
            Blend::Hold => {}
            Blend::Linear(a) => lerp(&mut out, key(1), a),
            Blend::Quadratic([a, b]) => {
                lerp(&mut out, key(1), a);
                lerp(&mut out, key(2), b);
            }
            Blend::Cubic([a, b, c]) => {
                lerp(&mut out, key(1), a);
                let mut other = key(2).clone();
                lerp(&mut other, key(3), b);
                lerp(&mut out, &other, c);
            }
        }
        out
    }
}

fn lerp(out: &mut [u8], other: &[u8], t: f64) {
    let t = t as f32;
    for (out, other) in out.iter_mut().zip(other) {
        let (a, b) = (f32::from(*out), f32::from(*other));
        *out = (a + t * (b - a) + 0.5) as u8;
    }
}
