//! Fixtures with moving heads, as lights that move.
//!
//! GDTF turns a head about the axes of the fixture's geometries, and a plan hangs the fixture
//! anywhere. A head of a show hangs level or stands: the turn of its base about the vertical shifts
//! the range of its pan.

use std::fmt::Write as _;

use super::frame::Frame;
use super::gdtf::{Fixture, Turn};
use super::{Hung, rounded};
use footlight_show::geometry::vec3;
use footlight_show::model::{Head, Pose};

/// Ranges of a head whose type gives none, degrees.
const PAN: [f64; 2] = [-270.0, 270.0];
const TILT: [f64; 2] = [-135.0, 135.0];
/// Zoom angles, degrees.
const ZOOM: [f64; 2] = [0.1, 179.0];

/// A mounted head.
pub struct Hanging<'f> {
    /// Intersection of the pan and tilt axes.
    pub frame: Frame,
    head: Head,
    /// The turn of its base about the vertical.
    turn: f64,
    channels: [&'f Turn; 2],
}

/// The moving head of a fixture, if it has one.
///
/// # Errors
/// The reason why the fixture cannot move in a show.
pub fn hanging<'f>(hung: &Hung, fixture: &'f Fixture) -> Result<Option<Hanging<'f>>, &'static str> {
    let is_sent = |turn: &&Turn| turn.offset.is_some();
    let channels = [&fixture.pan, &fixture.tilt].map(|turn| turn.as_ref().filter(is_sent));
    let channels = match channels {
        [None, None] => return Ok(None),
        [Some(pan), Some(tilt)] => [pan, tilt],
        _ => return Err("it turns about one axis only"),
    };
    let [pan, tilt] = channels;
    let pivot = fixture.pivot.or(fixture.beam).unwrap_or_default();
    let frame = hung.frame.then(pivot);
    let beam = fixture.beam.unwrap_or(pivot);
    let [a, b] = [pivot, beam].map(|frame| frame.direction([0.0, 0.0, -1.0]));
    if a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-3) {
        return Err("its beam is not in line with its head");
    }
    let Some((standing, turn)) = frame.mounted() else {
        return Err("its base is not level");
    };
    // Rounded to the precision of the text.
    let turn = (turn * 1e4).round() / 1e4;
    let sorted = |range: [f64; 2]| [range[0].min(range[1]), range[0].max(range[1])];
    let head = Head {
        home: Pose::default(),
        pan: sorted(pan.physical.unwrap_or(PAN)).map(|angle| angle + turn),
        tilt: sorted(tilt.physical.unwrap_or(TILT)),
        zoom: ZOOM,
        speed: 180.0,
        standing,
    };
    let hanging = Hanging {
        frame,
        head,
        turn,
        channels,
    };
    if hanging.reaches(frame.point(hung.direction())) {
        Ok(Some(hanging))
    } else {
        Err("the ranges of its pan and tilt do not reach how it hangs")
    }
}

impl Hanging<'_> {
    /// True when the head can point from its position to `place`.
    pub fn reaches(&self, place: [f64; 3]) -> bool {
        let [at, place] = [self.frame.origin, place].map(|[x, y, z]| vec3(x, y, z));
        self.head.aim(at, place, (0.0, 0.0)).is_ok()
    }

    /// Text of the head's ranges in a light's declaration; beam and field are full angles.
    pub fn words(&self, fixture: &Fixture, beam: f64, field: f64) -> String {
        let zoom = fixture.zoom.as_ref().and_then(|zoom| zoom.physical);
        let [low, high] = zoom.map_or([beam, field], |[from, to]| {
            let [low, high] = [from.min(to) * beam / field, from.max(to)];
            let [least, most] = ZOOM;
            [low.clamp(least, beam), high.clamp(field, most)]
        });
        let range = |[low, high]: [f64; 2]| format!("{} to {}", rounded(low), rounded(high));
        let mut out = format!(
            "moves  pan {}  tilt {}  zoom {}",
            range(self.head.pan),
            range(self.head.tilt),
            range([low, high])
        );
        if self.head.standing {
            out.push_str("  standing");
        }
        out
    }

    /// Line of a patch for the light of this head; `at` writes an address.
    pub fn patch(&self, fixture: &Fixture, light: &str, at: impl Fn(u16) -> String) -> String {
        let mut out = light.to_owned();
        let [pan, tilt] = self.channels;
        let axes = [
            ("pan", Some(pan)),
            ("tilt", Some(tilt)),
            ("field", fixture.zoom.as_ref()),
        ];
        for (axis, turn) in axes {
            let Some((turn, (coarse, fine))) = turn.and_then(|t| Some((t, t.offset?))) else {
                continue;
            };
            let _ = write!(out, " {axis} {}", at(coarse));
            if fine != coarse.checked_add(1) {
                out.push_str(" 8bit");
            }
            let by = if axis == "pan" { self.turn } else { 0.0 };
            // A light's range rises, and its zoom also applies to the beam.
            if let Some([from, to]) = turn.physical.filter(|[a, b]| a > b || axis == "field") {
                let _ = write!(out, " {} to {}", rounded(from + by), rounded(to + by));
            }
        }
        out
    }

    /// True when the type gives the ranges of pan and tilt.
    pub fn has_ranges(&self) -> bool {
        self.channels.iter().all(|turn| turn.physical.is_some())
    }
}
