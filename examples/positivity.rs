//! Knots that make all key settings positive: the fewest against bisection, on random shows:
//! `cargo run --release --example positivity -- [FOLDER]`.
//!
//! 500 shows of 1 to 24 banks that run along Hermite splines between 0 and 100, many of them down to
//! nothing and up again, one in twenty touching nothing between two knots. For each the knots that are inserted are counted, and those that halving
//! every segment with a negative control point needs (to a depth of 40). Into the folder goes
//! `positivity` as .json, .csv, .png and .svg.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../tests/reference/results.rs"]
mod results;

use footlight::chart::{self, Axis, Marker, Panel, Scale, Theme};
use footlight::diagnostic::Sources;
use footlight::lang;
use footlight::study::{Dice, Kind, Machine, Quantity, Record};
use footlight::timeline::{KeyOptions, KeySequence, Timeline};
use std::fmt::Write as _;
use std::path::Path;

const BANKS: [usize; 6] = [1, 2, 4, 8, 16, 24];
const SHOWS: usize = 500;
/// Halvings of a segment before bisection is given up there.
const DEPTH: usize = 40;
/// Control points above this are rounding.
const ROUNDING: f64 = -1e-15;

fn main() {
    let quantities = [
        "banks",
        "fewest knots",
        "bisection",
        "most by bisection",
        "endless",
    ];
    let quantities = quantities.map(|name| Quantity::new(name, "")).into();
    let machine = Machine::here(1, None);
    let method = "means over random shows of Hermite splines; bisection to a depth of 40";
    let mut record = Record::new(
        Kind::Stability,
        "Positive keys",
        machine,
        method,
        quantities,
    );
    let mut dice = Dice::new(11);
    let mut all = Vec::new();
    println!("banks  fewest knots  bisection  most by bisection  bisection without end");
    for (i, banks) in BANKS.into_iter().enumerate() {
        let shows = SHOWS * (i + 1) / BANKS.len() - SHOWS * i / BANKS.len();
        let counted: Vec<Count> = (0..shows).map(|_| count(&show(&mut dice, banks))).collect();
        let row = summary(&counted);
        println!(
            "{banks:>5}  {:>12.2}  {:>9.2}  {:>17}  {:>21}",
            row[0], row[1], row[2], row[3]
        );
        let values = [banks as f64, row[0], row[1], row[2], row[3]].map(Some);
        record.add("random shows", &format!("{banks} banks"), &[], &values);
        all.extend(counted);
    }
    let [fewest, halved, most, endless] = summary(&all);
    println!(
        "all {}: {fewest:.2} against {halved:.2}; most {most}; {endless} without end",
        all.len()
    );
    assert!(
        all.iter().all(|c| c.fewest <= c.bisection),
        "bisection needs fewer"
    );
    if let Some(folder) = std::env::args().nth(1) {
        let chart = chart::panels("Knots for positive keys", &[panel(&record)], Theme::Light);
        results::write(Path::new(&folder), "positivity", &record, Some(&chart));
    }
}

/// Knots of one show.
struct Count {
    fewest: usize,
    bisection: usize,
    /// Bisection met its depth.
    endless: bool,
}

/// Means of both, most by bisection, and shows on which it did not end.
fn summary(counted: &[Count]) -> [f64; 4] {
    let mean = |of: &dyn Fn(&Count) -> usize| {
        counted.iter().map(of).sum::<usize>() as f64 / counted.len() as f64
    };
    let most = counted.iter().map(|c| c.bisection).max().unwrap_or(0);
    let endless = counted.iter().filter(|c| c.endless).count();
    [
        mean(&|c| c.fewest),
        mean(&|c| c.bisection),
        most as f64,
        endless as f64,
    ]
}

/// A show in which every bank runs along a spline of its own; banks that would leave 0 to 100 are
/// drawn anew.
fn show(dice: &mut Dice, banks: usize) -> Timeline {
    let mut moves = Vec::new();
    while moves.len() < banks {
        let path = spline(dice);
        if timeline(std::slice::from_ref(&path)).is_some() {
            moves.push(path);
        }
    }
    timeline(&moves).unwrap()
}

/// Levels and slopes of two knots 4 seconds apart between which the curve touches zero: 100 (t - a)²
/// with a fifth and two fifths for a, and the same from behind.
const TOUCHING: [[(i32, i32); 2]; 4] = [
    [(4, -10), (64, 40)],
    [(16, -20), (36, 30)],
    [(36, -30), (16, 20)],
    [(64, -40), (4, 10)],
];

/// A Hermite spline of four knots within 12 seconds, a third of them at zero; one in twenty also
/// touches zero inside a span.
fn spline(dice: &mut Dice) -> String {
    let mut path = "hermite".to_owned();
    let touching = dice.chance(0.05).then(|| TOUCHING[dice.whole(0, 3)]);
    for i in 0..4 {
        if let Some((level, slope)) = touching.and_then(|t| t.get(i).copied()) {
            let comma = if i == 0 { "" } else { "," };
            let _ = write!(path, "{comma} {} {level} slope {slope}", 4 * i);
            continue;
        }
        let level = if dice.chance(0.3) {
            0
        } else {
            dice.whole(0, 100)
        };
        let slope = if level == 0 {
            0
        } else {
            dice.whole(0, 120) as i32 - 60
        };
        let comma = if i == 0 { "" } else { "," };
        let _ = write!(path, "{comma} {} {level} slope {slope}", 4 * i);
    }
    path
}

fn timeline(moves: &[String]) -> Option<Timeline> {
    let mut text = "show \"s\"\n".to_owned();
    for i in 0..moves.len() {
        let _ = writeln!(text, "light l{i} panel m\nbank b{i} = l{i}");
    }
    text.push_str("cue 1 {\n");
    for (i, path) in moves.iter().enumerate() {
        let _ = writeln!(text, "  b{i} {path}");
    }
    text.push_str("}\n");
    let parsed = lang::parse(&mut Sources::default(), "s.lxq", &text);
    Timeline::new(&parsed.show?).ok()
}

fn count(timeline: &Timeline) -> Count {
    let positive = KeySequence::new(timeline, KeyOptions::default()).unwrap();
    let signed = KeySequence::new(timeline, KeyOptions { signed_keys: true }).unwrap();
    let lowest = positive
        .keys()
        .iter()
        .flatten()
        .fold(0.0f64, |m, x| m.min(*x));
    assert!(lowest >= ROUNDING, "{lowest:e}");
    let mut endless = false;
    let mut bisection = 0;
    for segment in signed.segments() {
        let points = segment.keys.iter().map(|k| signed.keys()[*k].clone());
        bisection += halve(&points.collect::<Vec<_>>(), DEPTH, &mut endless);
    }
    Count {
        fewest: positive.inserted(),
        bisection,
        endless,
    }
}

/// Knots by halving wherever a control point is negative.
fn halve(points: &[Vec<f64>], depth: usize, endless: &mut bool) -> usize {
    if points.iter().flatten().all(|x| *x >= ROUNDING) {
        return 0;
    }
    if depth == 0 {
        *endless = true;
        return 0;
    }
    // De Casteljau's scheme at one half; its first points make the left part, its last the right.
    let (mut left, mut right) = (Vec::new(), Vec::new());
    let mut level = points.to_vec();
    while let (Some(first), Some(last)) = (level.first(), level.last()) {
        left.push(first.clone());
        right.push(last.clone());
        let middle = |w: &[Vec<f64>]| -> Vec<f64> {
            w[0].iter().zip(&w[1]).map(|(a, b)| 0.5 * (a + b)).collect()
        };
        level = level.windows(2).map(middle).collect();
    }
    right.reverse();
    1 + halve(&left, depth - 1, endless) + halve(&right, depth - 1, endless)
}

fn panel(record: &Record) -> Panel {
    let curve = |name: &str, marker| chart::Series {
        name: name.to_owned(),
        points: record.curve(&record.series[0], "banks", name),
        marker,
        labels: Vec::new(),
    };
    Panel {
        title: format!("{SHOWS} random shows"),
        x: Axis::new("banks that move at once", Scale::Log),
        y: Axis::new("knots a show", Scale::Log),
        series: vec![
            curve("fewest knots", Marker::Circle),
            curve("bisection", Marker::Square),
            curve("most by bisection", Marker::Triangle),
        ],
        reference: None,
    }
}
