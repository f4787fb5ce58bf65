//! Drawings of the light of banks over time.

use crate::chart::{self, Drawing, Theme};
use crate::sheet::heads;
use footlight_engine::Document;
use footlight_show::model::{Coordinate, HeadAxis, Show};
use footlight_show::timeline::{CurvePiece, Timeline};
use footlight_show::units::Time;

/// Points per second of a curve, besides its knots.
const POINTS_A_SECOND: f64 = 8.0;

/// Most points of a curve.
const MOST_POINTS: f64 = 2000.0;

/// Draws the light of the `wanted` coordinates over time, in their order, with cues, moves and
/// the current moment if given. Then follow the moving axes of the heads in their banks, and
/// pan, tilt and other moving axes of the `named` heads (indices).
pub fn curves(
    document: &Document,
    (wanted, named): (&[usize], &[usize]),
    playhead: Option<Time>,
    theme: Theme,
) -> Drawing {
    let (show, timeline) = (document.show(), document.timeline());
    let coordinates = show.coordinates();
    let seconds = |(a, b): &(Time, Time)| (a.seconds(), b.seconds());
    let row = |i: &usize| {
        let coordinate = coordinates.get(*i)?;
        Some(chart::CurveRow {
            points: points(timeline, *i),
            moves: timeline.moves(*i).iter().map(seconds).collect(),
            colour: hue(coordinate),
            name: coordinate.name.clone(),
            ..chart::CurveRow::default()
        })
    };
    let is_wanted = |bank: usize| {
        let banks = wanted.iter().filter_map(|i| coordinates.get(*i)?.bank);
        banks.into_iter().any(|own| own == bank)
    };
    let heads = heads(show).into_iter().enumerate();
    let axes = heads.filter(|(i, moving)| named.contains(i) || is_wanted(moving.bank));
    let axes = axes.flat_map(|(index, moving)| {
        HeadAxis::ALL.map(|axis| {
            let (pieces, last) = timeline.pose_curve(index, axis);
            let [low, high] = moving.head.range(axis);
            let moves = pieces.iter().any(|p| !p.polynomial.is_constant()) || pieces.len() > 1;
            let turns = matches!(axis, HeadAxis::Pan | HeadAxis::Tilt);
            (moves || named.contains(&index) && turns).then(|| chart::CurveRow {
                points: drawn(timeline, pieces, Some(last)),
                name: format!("{} {}", moving.light.name, axis.word()),
                ends: Some([low, high].map(|angle| format!("{angle}°"))),
                ..chart::CurveRow::default()
            })
        })
    });
    let axes: Vec<chart::CurveRow> = axes.flatten().collect();
    let subject = if wanted.is_empty() {
        "angles of the heads over time"
    } else {
        "light of the banks over time, % of full"
    };
    let curves = chart::CurveChart {
        title: format!("{}: {subject}", show.title),
        start: timeline.start().seconds(),
        end: timeline.end().seconds(),
        rows: wanted.iter().filter_map(row).chain(axes).collect(),
        cues: cues_in_time(show, timeline),
        playhead: playhead.map(Time::seconds),
    };
    chart::curves(&curves, theme)
}

/// The coordinates of all banks.
pub fn moving(show: &Show) -> Vec<usize> {
    let coordinates = show.coordinates().into_iter().enumerate();
    let banks = coordinates.filter(|(_, c)| c.bank.is_some());
    banks.map(|(i, _)| i).collect()
}

/// Seconds and number of each cue.
pub fn cues_in_time(show: &Show, timeline: &Timeline) -> Vec<(f64, String)> {
    let cues = show.cues.iter().zip(timeline.cues());
    cues.map(|(cue, time)| (time.go.seconds(), cue.number.to_string()))
        .collect()
}

/// A coordinate's setting over time, dense enough to draw; two points at a jump.
pub fn points(timeline: &Timeline, coordinate: usize) -> Vec<(f64, f64)> {
    let last = timeline.last().get(coordinate).copied();
    drawn(timeline, timeline.curve(coordinate), last)
}

/// Points of a curve's pieces, dense enough to draw, and its final value.
fn drawn(timeline: &Timeline, pieces: &[CurvePiece], last: Option<f64>) -> Vec<(f64, f64)> {
    let (start, end) = (timeline.start(), timeline.end());
    let length = (end - start).seconds().max(1e-6);
    let density = POINTS_A_SECOND.min(MOST_POINTS / length);
    let mut out = Vec::new();
    for piece in pieces.iter().filter(|p| p.end >= start && p.start <= end) {
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
    out.extend(last.map(|level| (end.seconds(), level)));
    out
}

/// The colour of a coordinate's curve: its own for an rgb bank, else the theme's.
pub fn hue(coordinate: &Coordinate) -> Option<[u8; 3]> {
    coordinate.emitter().map(|channel| match channel {
        0 => [230, 70, 60],
        1 => [70, 180, 80],
        _ => [80, 120, 240],
    })
}
