//! Differences of two versions' curves, over the cues that both have.

use super::{CurveChange, go};
use footlight_engine::Version;
use footlight_show::linalg::{Bernstein, mass};
use footlight_show::model::Show;
use footlight_show::timeline::{CurvePiece, Timeline};
use footlight_show::units::Time;

/// A stretch of both versions to compare: its start in each, and its length.
#[derive(Clone, Copy)]
struct Stretch {
    old: Time,
    new: Time,
    length: Time,
}

/// Each cue of both versions, from GO to the next GO or the end, in the shorter of the two lengths.
fn stretches(old: &Version, new: &Version) -> Vec<Stretch> {
    let lasts = |timeline: &Timeline, cue: usize| {
        let next = timeline.cues().get(cue + 1).map(|next| next.go);
        next.unwrap_or(timeline.end()).max(go(timeline, cue)) - go(timeline, cue)
    };
    let both = new.show.cues.iter().enumerate().filter_map(|(i, cue)| {
        let found = old
            .show
            .cues
            .binary_search_by_key(&cue.number, |c| c.number);
        let k = found.ok()?;
        Some(Stretch {
            old: go(&old.timeline, k),
            new: go(&new.timeline, i),
            length: lasts(&old.timeline, k).min(lasts(&new.timeline, i)),
        })
    });
    both.collect()
}

/// Banks of both versions whose curves differ within common cues.
pub(super) fn curves(old: &Version, new: &Version) -> Vec<CurveChange> {
    let names = |show: &Show| -> Vec<String> {
        show.coordinates()
            .into_iter()
            .filter(|c| c.bank.is_some())
            .map(|c| c.name)
            .collect()
    };
    let before = names(&old.show);
    let stretches = stretches(old, new);
    let in_place = stretches.iter().all(|s| s.old == s.new);
    let mut out = Vec::new();
    for (i, name) in names(&new.show).into_iter().enumerate() {
        let Some(k) = before.iter().position(|n| *n == name) else {
            continue;
        };
        let (a, b) = (old.timeline.curve(k), new.timeline.curve(i));
        if in_place && a == b {
            continue;
        }
        out.extend(
            apart(a, b, &stretches).map(|(norm, largest, at)| CurveChange {
                name,
                norm,
                largest,
                at,
            }),
        );
    }
    out.sort_by(|a, b| b.norm.total_cmp(&a.norm));
    out
}

/// Norm and largest value of the difference of two curves over some stretches, exact, because it is
/// a polynomial between knots. `None` when they are equal.
fn apart(a: &[CurvePiece], b: &[CurvePiece], stretches: &[Stretch]) -> Option<(f64, f64, Time)> {
    let (mut square, mut largest, mut length) = (0.0, 0.0_f64, 0.0);
    let mut at = Time::ZERO;
    for stretch in stretches {
        let mut knots = vec![Time::ZERO, stretch.length];
        for (pieces, start) in [(a, stretch.old), (b, stretch.new)] {
            let first = pieces.partition_point(|p| p.end < start);
            let within = pieces.iter().skip(first);
            let within = within.take_while(|p| p.start <= start + stretch.length);
            knots.extend(within.flat_map(|p| [p.start - start, p.end - start]));
        }
        knots.retain(|t| (Time::ZERO..=stretch.length).contains(t));
        knots.sort_unstable();
        knots.dedup();
        length += stretch.length.seconds();
        for span in knots.windows(2) {
            let &[s, e] = span else { continue };
            let x = over(a, stretch.old + s, stretch.old + e).elevated(3);
            let y = over(b, stretch.new + s, stretch.new + e).elevated(3);
            let pairs = x.coefficients().iter().zip(y.coefficients());
            let apart: Vec<f64> = pairs.map(|(x, y)| y - x).collect();
            let Some(polynomial) = Bernstein::new(&apart) else {
                continue;
            };
            for (p, row) in apart.iter().zip(mass(3).row_iter()) {
                for (q, weight) in apart.iter().zip(row.iter()) {
                    square += p * q * weight * (e - s).seconds();
                }
            }
            let ((low_at, low), (high_at, high)) = polynomial.range();
            for (value, t) in [(low, low_at), (high, high_at)] {
                if value.abs() > largest {
                    largest = value.abs();
                    at = stretch.new + s + (e - s).scaled(t);
                }
            }
        }
    }
    (largest > 1e-12).then(|| ((square.max(0.0) / length).sqrt(), largest, at))
}

/// A curve between two times without a knot between them; constant before its start and after its
/// end.
fn over(pieces: &[CurvePiece], start: Time, end: Time) -> Bernstein {
    let after = pieces.partition_point(|p| p.start <= start);
    match after.checked_sub(1).and_then(|i| pieces.get(i)) {
        Some(piece) if piece.end >= end => piece.between(start, end),
        Some(piece) => Bernstein::constant(piece.polynomial.last()),
        None => Bernstein::constant(pieces.first().map_or(0.0, |p| p.polynomial.first())),
    }
}
