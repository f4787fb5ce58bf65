//! Levels that come nearest to a picture, or to an illuminance.
//!
//! An image is linear in settings, so that this is least squares within bounds
//! ([`bounded_least_squares`]); of several levels that come as near the smallest change from what stands is
//! taken, in settings. Levels follow by the inverse of the dimmers' laws. Banks that are not asked for, and
//! fixed lights, stay as they stand. After Schoeneman, Dorsey, Smits, Arvo and Greenberg 1993, "Painting
//! with Light".

mod lux;
mod sketch;

use std::fmt::Write as _;

use footlight_show::linalg::{BoundedSolution, Matrix, bounded_least_squares};
use footlight_show::model::Bank;
use footlight_show::timeline;
use footlight_transport::seen::Hidden;

use super::{Document, Error, LiveControl};

pub use self::lux::{Illuminance, illuminance};
pub use self::sketch::{Place, Sketched, sketched};

/// Levels that differ by less are the same, and so are written: a hundredth of a percent.
const STEP: f64 = 1e-4;

/// Why there are no levels that come near.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The sketch has another shape than the view.
    #[error(
        "the sketch is {}x{} and the view {}x{}: paint over a picture of this view, such as `picture -o \
         view.png` writes", found.0, found.1, view.0, view.1
    )]
    Shape {
        /// Its width and height.
        found: (usize, usize),
        /// The view's.
        view: (usize, usize),
    },
    /// No pixel of it counts, or none is brighter than black.
    #[error("the sketch is black, or transparent all over: there is nothing to come near to")]
    Black,
    /// No mixture of the banks looks more like it than one colour does.
    #[error(
        "the sketch is not of this view: the banks come no nearer to it than {:.0} % of its light, and one \
         flat colour comes to {:.0} %; paint over a picture of the view, such as `picture -o view.png` writes",
        100.0 * nearest, 100.0 * flat
    )]
    Unlike {
        /// How near the banks come.
        nearest: f64,
        /// How near one colour comes.
        flat: f64,
    },
    /// A point's illuminance does not show.
    #[error("{point} {hidden}")]
    Hidden {
        /// As it was typed.
        point: String,
        /// Why.
        hidden: Hidden,
    },
    /// Haze shines between the eye and the surface.
    #[error(
        "in haze a picture does not show how much light falls on a surface; try it without `haze`"
    )]
    Haze,
}

/// Levels that were solved for.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// The banks that were asked for, in the order of the show.
    pub banks: Vec<SolvedBank>,
    /// Banks whose light differs by nothing that shows, so that only their sum counts.
    pub tied: Vec<Vec<String>>,
    /// The levels that change, as `set` reads them; empty where none does.
    pub moves: String,
}

/// A bank's level.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedBank {
    /// Its name.
    pub name: String,
    /// Its level before and after.
    pub level: [f64; 2],
    /// The light of its emitters at full level after, if it is an rgb bank.
    pub colour: Option<[f64; 3]>,
    /// How near the others come while this bank stays as it stood: [`Sketched::nearest`] without it.
    pub without: f64,
    /// False where its light is nowhere in the view.
    pub is_seen: bool,
}

/// A coordinate to be solved for.
struct Unknown {
    coordinate: usize,
    bank: usize,
    /// The settings that it can have, and the one that stands.
    bounds: (f64, f64),
    stood: f64,
}

/// The coordinates of the banks and groups of these names, of all banks without one.
fn unknowns(
    document: &Document,
    live: &LiveControl,
    names: &[String],
) -> Result<Vec<Unknown>, Error> {
    let show = document.show();
    let mut wanted = vec![names.is_empty(); show.banks.len()];
    for name in names {
        let group = show.groups.iter().find(|group| group.name == *name);
        let bank = show.banks.iter().position(|bank| bank.name == *name);
        let banks = group.map_or_else(|| bank.into_iter().collect(), |group| group.banks.clone());
        if banks.is_empty() {
            let known = show.banks.iter().map(|bank| bank.name.clone()).collect();
            return Err(Error::NoSuchBank {
                name: name.clone(),
                fixed: false,
                known,
            });
        }
        wanted
            .iter_mut()
            .enumerate()
            .for_each(|(i, wanted)| *wanted |= banks.contains(&i));
    }
    let standing = live.setting(document);
    let unknown = |(coordinate, stood): (usize, f64), bank: usize| {
        let own = show.banks.get(bank)?;
        let (least, most) = timeline::range(own.dimmer, &show.curves);
        let factor = live.factor(document, bank);
        let least = if own.rgb { 0.0 } else { least * factor };
        let bounds = (least.min(stood), (most * factor).max(stood));
        wanted.get(bank)?.then_some(Unknown {
            coordinate,
            bank,
            bounds,
            stood,
        })
    };
    let all = show
        .coordinates()
        .into_iter()
        .zip(standing.into_iter().enumerate());
    let found: Vec<Unknown> = all.filter_map(|(c, at)| unknown(at, c.bank?)).collect();
    if found.is_empty() {
        return Err(Error::NoBanks);
    }
    Ok(found)
}

/// Sums of squares and products over all rows: those of the unknowns, then of the light of everything else,
/// then of what is to be met.
struct Squares(Matrix);

impl Squares {
    /// The best settings where what is to be met is `gain` times their light, and the sum of squares that
    /// they leave.
    fn solve(&self, unknowns: &[Unknown], gain: f64) -> (BoundedSolution, f64) {
        let n = unknowns.len();
        let right = |i: usize| self.at(i, n + 1) / gain - self.at(i, n);
        let right: Vec<f64> = (0..n).map(right).collect();
        let gram = self.0.view((0, 0), (n, n)).into_owned();
        let bounds: Vec<(f64, f64)> = unknowns.iter().map(|unknown| unknown.bounds).collect();
        let stood: Vec<f64> = unknowns.iter().map(|unknown| unknown.stood).collect();
        let solution = bounded_least_squares(&gram, &right, &bounds, &stood);
        let left = self.left(&solution.x, gain);
        (solution, left)
    }

    /// The sum of squares that settings leave.
    fn left(&self, settings: &[f64], gain: f64) -> f64 {
        let terms = settings.iter().map(|x| gain * x).chain([gain, -1.0]);
        let terms = Matrix::from_iterator(1, settings.len() + 2, terms);
        (&terms * &self.0 * terms.transpose()).sum().max(0.0)
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.0.get((i, j)).copied().unwrap_or_default()
    }
}

/// The levels of settings, and the moves to them. `left` is what settings leave of what is to be met, as a
/// share of it, and `seen` whether the unknowns' light is.
fn solved(
    (document, live): (&Document, &LiveControl),
    unknowns: &[Unknown],
    solution: &BoundedSolution,
    seen: &[bool],
    left: impl Fn(&[f64]) -> f64,
) -> Solved {
    let show = document.show();
    let standing = live.levels(document);
    let firsts = show.first_parameters();
    let mut solved = Solved {
        banks: Vec::new(),
        tied: Vec::new(),
        moves: String::new(),
    };
    for (index, (bank, first)) in show.banks.iter().zip(firsts).enumerate() {
        let own: Vec<usize> = (0..unknowns.len())
            .filter(|i| {
                unknowns
                    .get(*i)
                    .is_some_and(|unknown| unknown.bank == index)
            })
            .collect();
        if own.is_empty() {
            continue;
        }
        let of = |values: &[f64]| own.iter().filter_map(|i| values.get(*i)).copied().collect();
        let light: Vec<f64> = of(&solution.x);
        let mut without = solution.x.clone();
        for (i, x) in without
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| own.contains(i))
        {
            *x = unknowns.get(i).map_or(*x, |unknown| unknown.stood);
        }
        let stands = |i: usize| standing.get(first + i).copied().unwrap_or_default();
        let factor = live.factor(document, index);
        let light: Vec<f64> = light
            .iter()
            .map(|x| if factor > 0.0 { x / factor } else { 0.0 })
            .collect();
        let before = [1, 2, 3].map(&stands);
        let (level, colour) = levels(show, bank, &light, (stands(0), before));
        let is_seen = factor > 0.0 && own.iter().any(|i| seen.get(*i) == Some(&true));
        let moved = |a: f64, b: f64| is_seen && (a - b).abs() >= 0.5 * STEP;
        if moved(level, stands(0))
            || colour.is_some_and(|c| c.iter().zip(before).any(|(c, b)| moved(*c, b)))
        {
            let _ = write!(solved.moves, "{} {}  ", bank.name, percent(level));
            for (emitter, light) in ["r", "g", "b"].iter().zip(colour.iter().flatten()) {
                let _ = write!(
                    solved.moves,
                    "{}.{emitter} {}  ",
                    bank.name,
                    percent(*light)
                );
            }
        }
        solved.banks.push(SolvedBank {
            name: bank.name.clone(),
            level: [stands(0), if is_seen { level } else { stands(0) }],
            colour: colour.filter(|_| is_seen),
            without: left(&without),
            is_seen,
        });
    }
    let name = |i: &usize| {
        unknowns
            .get(*i)
            .and_then(|unknown| show.banks.get(unknown.bank))
    };
    for group in &solution.tied {
        let mut names: Vec<String> = group
            .iter()
            .filter_map(name)
            .map(|b| b.name.clone())
            .collect();
        names.sort();
        names.dedup();
        if !solved.tied.contains(&names) {
            solved.tied.push(names);
        }
    }
    solved.moves.truncate(solved.moves.trim_end().len());
    solved
}

/// The level, and of an rgb bank its emitters, that give a light; those that stand where they do.
fn levels(
    show: &footlight_show::model::Show,
    bank: &Bank,
    light: &[f64],
    (level, colour): (f64, [f64; 3]),
) -> (f64, Option<[f64; 3]>) {
    let inverse = |setting: f64| timeline::level(bank.dimmer, &show.curves, setting, level);
    let &[r, g, b] = light else {
        return (inverse(light.first().copied().unwrap_or_default()), None);
    };
    let law = |level| {
        timeline::settings(bank.dimmer, &show.curves, &[level])
            .iter()
            .sum::<f64>()
    };
    let behind = law(level);
    let same = |(light, emitter): (f64, f64)| (behind * emitter - light).abs() < 0.5 * STEP;
    if [r, g, b].into_iter().zip(colour).all(same) {
        return (level, Some(colour));
    }
    let most = r.max(g).max(b);
    if most < 0.5 * STEP {
        return (inverse(0.0), Some(colour));
    }
    let level = inverse(most);
    let full = law(level).max(most);
    (level, Some([r, g, b].map(|light| light / full)))
}

/// A level in percent, with two digits behind the point where they say something.
fn percent(level: f64) -> f64 {
    (level / STEP).round() / (0.01 / STEP)
}
