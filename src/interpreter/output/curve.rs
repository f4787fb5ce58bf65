//! Curves: the light of banks over time, as a drawing.

use crate::chart::{self, Drawing, Knot, Theme};
use crate::interpreter::Interpreter;
use crate::show::Coordinate;
use crate::timeline::Timeline;
use crate::units::Time;

/// Points drawn of each second of a curve, beside its knots.
const POINTS_A_SECOND: f64 = 8.0;

/// Most points drawn of a curve.
const MOST_POINTS: f64 = 2000.0;

impl Interpreter {
    /// Light over time of the coordinates that are `wanted`, in their order: cues, moves and knots
    /// marked.
    pub(in crate::interpreter) fn curves(
        &self,
        wanted: &[usize],
        playhead: Option<Time>,
        theme: Theme,
    ) -> Drawing {
        let coordinates = self.show().coordinates();
        let seconds = |(a, b): &(Time, Time)| (a.seconds(), b.seconds());
        let row = |i: &usize| {
            let coordinate = coordinates.get(*i)?;
            Some(chart::Row {
                points: points(self.timeline(), *i),
                moves: self.timeline().moves(*i).iter().map(seconds).collect(),
                colour: hue(coordinate),
                name: coordinate.name.clone(),
                ..chart::Row::default()
            })
        };
        let curves = chart::Curves {
            title: format!(
                "{}: light of the banks over time, % of full",
                self.show().title
            ),
            start: self.timeline().start().seconds(),
            end: self.timeline().end().seconds(),
            rows: wanted.iter().filter_map(row).collect(),
            cues: self.cues_in_time(),
            playhead: playhead.map(Time::seconds),
            knots: self.knots(),
        };
        chart::curves(&curves, theme)
    }

    /// The coordinates of all banks.
    pub(super) fn moving(&self) -> Vec<usize> {
        let coordinates = self.show().coordinates().into_iter().enumerate();
        let banks = coordinates.filter(|(_, c)| c.bank.is_some());
        banks.map(|(i, _)| i).collect()
    }

    /// Seconds and number of each cue.
    pub(super) fn cues_in_time(&self) -> Vec<(f64, String)> {
        let cues = self.show().cues.iter().zip(self.timeline().cues());
        cues.map(|(cue, time)| (time.go.seconds(), cue.number.to_string()))
            .collect()
    }

    /// Where the key sequence's segments meet, its ends among them.
    fn knots(&self) -> Vec<Knot> {
        let segments = self.keys().segments();
        let last = segments.last().map(|s| Knot {
            time: s.end(),
            inserted: false,
        });
        let of = |s: &crate::timeline::Segment| Knot {
            time: s.start(),
            inserted: s.is_inserted(),
        };
        segments.iter().map(of).chain(last).collect()
    }
}

/// A coordinate's setting over time, dense enough to draw; two points at a jump.
pub(in crate::interpreter) fn points(timeline: &Timeline, coordinate: usize) -> Vec<(f64, f64)> {
    let (start, end) = (timeline.start(), timeline.end());
    let length = (end - start).seconds().max(1e-6);
    let density = POINTS_A_SECOND.min(MOST_POINTS / length);
    let mut out = Vec::new();
    let pieces = timeline.curve(coordinate).iter();
    for piece in pieces.filter(|p| p.end >= start && p.start <= end) {
        let seconds = (piece.end - piece.start).seconds();
        let steps = match piece.polynomial.degree() {
            0 | 1 => 1,
            _ => ((seconds * density).ceil() as usize).clamp(8, 400),
        };
        for k in 0..=steps {
            let time = piece.start + (piece.end - piece.start).scaled(k as f64 / steps as f64);
            out.push((time.seconds(), piece.value(time)));
        }
    }
    let last = timeline.last().get(coordinate).copied().unwrap_or(0.0);
    out.push((end.seconds(), last));
    out
}

/// The colour in which a coordinate is drawn: of an rgb bank its own, else the theme's.
pub(in crate::interpreter) fn hue(coordinate: &Coordinate) -> Option<[u8; 3]> {
    coordinate.channel.map(|channel| match channel {
        0 => [230, 70, 60],
        1 => [70, 180, 80],
        _ => [80, 120, 240],
    })
}
