//! Content of a desk's file.

use std::collections::BTreeMap;

use footlight_show::units::{CueNumber, Time};

/// A level in tenths of a percent.
pub type Tenths = u16;

/// Full.
pub const FULL: Tenths = 1000;

/// The level of one of 256 steps: the whole percentage that desks round to this step, else the
/// nearest tenth of a percent.
pub fn tenths(step: u8) -> Tenths {
    let exact = f64::from(step) * 100.0 / 255.0;
    let whole = exact.round();
    if (whole * 255.0 / 100.0).round() == f64::from(step) {
        whole as Tenths * 10
    } else {
        (exact * 10.0).round() as Tenths
    }
}

/// The nearest of 256 steps.
pub fn step(tenths: Tenths) -> u8 {
    (f64::from(tenths.min(FULL)) * 255.0 / 1000.0).round() as u8
}

/// A desk's show.
#[derive(Debug, Default)]
pub struct Desk {
    pub title: String,
    /// Program that wrote the file.
    pub console: String,
    /// Default up and down time of a cue.
    pub time: Option<(Time, Time)>,
    pub channels: BTreeMap<u32, Channel>,
    pub groups: Vec<Group>,
    /// Submasters and presets.
    pub looks: Vec<Look>,
    /// Shapes of fades, by number: pairs of time and completion fractions.
    pub curves: BTreeMap<u32, Curve>,
    pub cues: Vec<Cue>,
    /// True when cues give moves (`$$ChanMove`).
    pub tracks: bool,
    /// True when cues give the lit channels (`Chan`).
    pub states: bool,
}

#[derive(Debug, Default)]
pub struct Channel {
    pub label: String,
    /// Number of its fixture type.
    pub personality: Option<u32>,
    /// True when it mixes red, green and blue.
    pub rgb: bool,
    /// Ranges of pan and tilt in degrees, if its type gives them.
    pub head: Option<[[f64; 2]; 2]>,
}

#[derive(Debug, Default)]
pub struct Group {
    pub number: String,
    pub label: String,
    pub channels: Vec<u32>,
}

#[derive(Debug, Default)]
pub struct Look {
    pub line: usize,
    pub word: &'static str,
    pub number: String,
    pub label: String,
    pub levels: BTreeMap<u32, Tenths>,
}

#[derive(Debug, Default)]
pub struct Curve {
    pub label: String,
    pub points: Vec<(f64, f64)>,
    /// The points rounded to 255 steps, which Eos 2 writes instead.
    pub steps: Vec<(f64, f64)>,
}

#[derive(Debug)]
pub struct Cue {
    pub line: usize,
    pub number: CueNumber,
    pub follow: Option<Time>,
    pub hang: Option<Time>,
    pub block: bool,
    pub assert: bool,
    pub note: String,
    /// The first part is the cue itself.
    pub parts: Vec<Part>,
}

/// A fade time with its delay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fade {
    pub time: Time,
    pub delay: Time,
}

#[derive(Debug, Default)]
pub struct Part {
    pub line: usize,
    pub label: String,
    pub up: Option<Fade>,
    pub down: Option<Fade>,
    pub colour: Option<Fade>,
    /// Number of the curve of its fades.
    pub curve: Option<u32>,
    /// `$$ChanMove`.
    pub moves: BTreeMap<u32, Tenths>,
    /// `Chan`: channels lit when the cue is complete.
    pub lit: Option<BTreeMap<u32, Tenths>>,
    /// `$$Param`: red, green, blue, 0 to 1.
    pub colours: BTreeMap<u32, [Option<f64>; 3]>,
    /// `$$Param`: pan and tilt, degrees.
    pub poses: BTreeMap<u32, [Option<f64>; 2]>,
    /// Times of channels that differ from the cue's.
    pub times: BTreeMap<u32, Fade>,
}
