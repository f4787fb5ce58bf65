//! Knots that keep all key settings positive: the fewest, and those of bisection, on random shows.

use crate::dice::Dice;
use footlight_show::linalg::Bernstein;
use footlight_show::timeline::fewest_knots;

/// Numbers of banks that move at once.
pub const BANKS: [usize; 6] = [1, 2, 4, 8, 16, 24];
/// Number of random shows.
pub const SHOWS: usize = 500;
/// Most bisections of a stretch.
const DEPTH: usize = 40;
/// Control points above this are rounding.
const ROUNDING: f64 = -1e-15;
/// Seconds between two knots of a path.
const SPAN: f64 = 4.0;
/// Spans of a path.
const SPANS: usize = 3;

/// Levels and slopes (per second) of two knots 4 seconds apart between which the curve touches
/// zero: 100 (t - a)² with a fifth and two fifths for a, and both reversed.
const TOUCHING: [[(f64, f64); 2]; 4] = [
    [(4.0, -10.0), (64.0, 40.0)],
    [(16.0, -20.0), (36.0, 30.0)],
    [(36.0, -30.0), (16.0, 20.0)],
    [(64.0, -40.0), (4.0, 10.0)],
];

/// The curve of a bank, span by span.
type Path = [Bernstein; SPANS];

/// Number of knots of one show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// By the shipped method.
    pub fewest: usize,
    /// By bisection wherever a control point is negative.
    pub bisection: usize,
}

/// Means over shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knots {
    /// Number of shows.
    pub shows: usize,
    /// Banks that move at once.
    pub banks: usize,
    /// Knots per show by the shipped method.
    pub fewest: f64,
    /// Knots per show by bisection.
    pub bisection: f64,
    /// Most knots of bisection in any show.
    pub most: usize,
}

/// Counts of all shows, by the number of banks.
pub fn counted() -> Vec<(usize, Vec<Count>)> {
    let mut dice = Dice::new(11);
    let mut out = Vec::new();
    for (i, banks) in BANKS.into_iter().enumerate() {
        let shows = SHOWS * (i + 1) / BANKS.len() - SHOWS * i / BANKS.len();
        let all = (0..shows).map(|_| count(&show(&mut dice, banks)));
        out.push((banks, all.collect()));
    }
    out
}

/// Summary for a number of banks.
pub fn summary(banks: usize, counts: &[Count]) -> Knots {
    let mean = |of: fn(&Count) -> usize| {
        counts.iter().map(of).sum::<usize>() as f64 / counts.len().max(1) as f64
    };
    Knots {
        shows: counts.len(),
        banks,
        fewest: mean(|c| c.fewest),
        bisection: mean(|c| c.bisection),
        most: counts.iter().map(|c| c.bisection).max().unwrap_or(0),
    }
}

/// A show in which every bank follows its own Hermite spline; a spline that would leave 0 to 100 is
/// drawn again.
fn show(dice: &mut Dice, banks: usize) -> Vec<Path> {
    let mut out = Vec::new();
    while out.len() < banks {
        let path = path(dice);
        let within = |span: &Bernstein| {
            let ((_, low), (_, high)) = span.range();
            low >= -1e-9 && high <= 100.0 + 1e-9
        };
        if path.iter().all(within) {
            out.push(path);
        }
    }
    out
}

/// A spline of four knots, a third of them at zero; one in twenty also touches zero inside a span.
fn path(dice: &mut Dice) -> Path {
    let touching = dice.chance(0.05).then(|| dice.whole(0, TOUCHING.len() - 1));
    let touching = touching.and_then(|i| TOUCHING.get(i));
    let mut knots = [(0.0, 0.0); SPANS + 1];
    for (i, knot) in knots.iter_mut().enumerate() {
        *knot = match touching.and_then(|t| t.get(i)) {
            Some(known) => *known,
            None if dice.chance(0.3) => (0.0, 0.0),
            None => match dice.whole(0, 100) {
                0 => (0.0, 0.0),
                level => (level as f64, dice.whole(0, 120) as f64 - 60.0),
            },
        };
    }
    let [a, b, c, d] = knots;
    [(a, b), (b, c), (c, d)]
        .map(|(from, to)| Bernstein::hermite(from.0, to.0, SPAN * from.1, SPAN * to.1))
}

fn count(show: &[Path]) -> Count {
    let mut out = Count {
        fewest: 0,
        bisection: 0,
    };
    for span in 0..SPANS {
        let curves: Vec<Bernstein> = (show.iter().filter_map(|p| p.get(span)))
            .map(|curve| curve.mapped(|level| level / 100.0))
            .collect();
        out.fewest += fewest_knots(&curves).len();
        out.bisection += halve(&curves, DEPTH);
    }
    out
}

/// Knots by bisection wherever a control point is negative, to a depth; where a curve touches zero
/// only rounding ends it earlier.
fn halve(curves: &[Bernstein], depth: usize) -> usize {
    let bad = |p: &Bernstein| p.coefficients().iter().any(|c| *c < ROUNDING);
    if depth == 0 || !curves.iter().any(bad) {
        return 0;
    }
    let half = |s: f64, e: f64| -> Vec<Bernstein> { curves.iter().map(|p| p.part(s, e)).collect() };
    1 + halve(&half(0.0, 0.5), depth - 1) + halve(&half(0.5, 1.0), depth - 1)
}
