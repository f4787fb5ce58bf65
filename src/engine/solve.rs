//! Levels that come nearest to a picture, or to an illuminance.
//!
//! An image is linear in settings, so that this is least squares within bounds
//! ([`bounded_least_squares`]); of several levels that come as near the smallest change from what stands is
//! taken, measured in light. Levels follow by the inverse of the dimmers' laws. Banks that are not asked for, and
//! fixed lights, stay as they stand. After Schoeneman, Dorsey, Smits, Arvo and Greenberg 1993, "Painting
//! with Light".

#![allow(
    clippy::indexing_slicing,
    reason = "one setting, column and row of the sums for each coordinate"
)]

mod lux;
mod sketch;

use std::fmt::Write as _;

use footlight_show::linalg::{BoundedSolution, Matrix, bounded_least_squares};
use footlight_show::model::Bank;
use footlight_show::timeline;
use footlight_transport::seen::Hidden;

use super::{Document, Error, LiveControl};

pub use self::lux::{Illuminance, illuminance};
pub use self::sketch::{Sketched, sketched};

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
    /// No mixture of lamps looks like it.
    #[error(
        "the sketch is not of this view: whatever the levels, bright and dark are elsewhere (correlation {0:.2}); \
         paint over a picture of the view, such as `picture -o view.png` writes"
    )]
    Unlike(f64),
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
    /// Banks whose light differs by nothing that shows from that of others here: only sums count.
    pub tied: Vec<String>,
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

impl Unknown {
    /// Keeps it as it stands where its light is not seen.
    fn hold_unless(&mut self, seen: &[bool]) {
        if !seen[self.coordinate] {
            self.bounds = (self.stood, self.stood);
        }
    }
}

/// The coordinates of the banks and groups of these names, of all banks without one.
fn unknowns(
    document: &Document,
    live: &LiveControl,
    names: &[&str],
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
                name: (*name).to_owned(),
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

/// Settings of all coordinates.
struct Solution {
    settings: Vec<f64>,
    /// Coordinates of which only sums are decided.
    tied: Vec<usize>,
}

/// Sums of squares and products over all rows: of the light of each coordinate at full, and, last, of what is
/// to be met.
struct Squares {
    sums: Matrix,
    /// The settings that stand.
    stood: Vec<f64>,
}

impl Squares {
    /// The best settings of the unknowns where what is to be met is `gain` times the light.
    fn solve(&self, unknowns: &[Unknown], gain: f64) -> Solution {
        let own: Vec<usize> = unknowns.iter().map(|unknown| unknown.coordinate).collect();
        let mut rest = self.stood.clone();
        own.iter().for_each(|i| rest[*i] = 0.0);
        let met = |i: &usize| {
            let others: f64 = rest
                .iter()
                .enumerate()
                .map(|(k, x)| x * self.sums[(*i, k)])
                .sum();
            self.sums[(*i, rest.len())] / gain - others
        };
        let gram = Matrix::from_fn(own.len(), own.len(), |i, j| self.sums[(own[i], own[j])]);
        let right: Vec<f64> = own.iter().map(met).collect();
        let bounds: Vec<(f64, f64)> = unknowns.iter().map(|unknown| unknown.bounds).collect();
        let near: Vec<f64> = own.iter().map(|i| self.stood[*i]).collect();
        let BoundedSolution { x, tied } = bounded_least_squares(&gram, &right, &bounds, &near);
        let mut settings = rest;
        own.iter().zip(x).for_each(|(i, x)| settings[*i] = x);
        let tied = tied.into_iter().map(|i| own[i]).collect();
        Solution { settings, tied }
    }

    /// The sum of squares that settings leave.
    fn left(&self, settings: &[f64], gain: f64) -> f64 {
        self.square(settings.iter().map(|x| gain * x).chain([-1.0]))
    }

    /// The sum of squares of columns with these weights.
    fn square(&self, weights: impl Iterator<Item = f64>) -> f64 {
        let weights = Matrix::from_iterator(1, self.sums.ncols(), weights);
        (&weights * &self.sums * weights.transpose()).sum().max(0.0)
    }
}

/// The levels of settings of the unknowns, and the moves to them. `left` is what settings leave of what is to
/// be met, as a share of it, and `seen` tells the coordinates whose light counts.
fn solved(
    (document, live): (&Document, &LiveControl),
    unknowns: &[Unknown],
    Solution { settings, tied }: &Solution,
    seen: &[bool],
    left: impl Fn(&[f64]) -> f64,
) -> Solved {
    let show = document.show();
    let standing = live.levels(document);
    let mut solved = Solved {
        banks: Vec::new(),
        tied: Vec::new(),
        moves: String::new(),
    };
    for (index, (bank, first)) in show.banks.iter().zip(show.first_parameters()).enumerate() {
        let own: Vec<&Unknown> = unknowns
            .iter()
            .filter(|unknown| unknown.bank == index)
            .collect();
        if own.is_empty() {
            continue;
        }
        let factor = live.factor(document, index);
        if own.iter().any(|unknown| tied.contains(&unknown.coordinate)) {
            solved.tied.push(bank.name.clone());
        }
        let is_seen = factor > 0.0 && own.iter().any(|unknown| seen[unknown.coordinate]);
        let stood = |i: usize| standing.get(first + i).copied().unwrap_or_default();
        let before = [1, 2, 3].map(stood);
        let light: Vec<f64> = own
            .iter()
            .map(|u| settings[u.coordinate] / factor)
            .collect();
        let (level, colour) = match is_seen {
            true => levels(show, bank, &light, (stood(0), before)),
            false => (stood(0), None),
        };
        let moves = |(a, b): (&f64, f64)| (a - b).abs() >= 0.5 * STEP;
        if moves((&level, stood(0))) || colour.is_some_and(|c| c.iter().zip(before).any(moves)) {
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
        let mut without = settings.clone();
        own.iter()
            .for_each(|unknown| without[unknown.coordinate] = unknown.stood);
        solved.banks.push(SolvedBank {
            name: bank.name.clone(),
            level: [stood(0), level],
            colour,
            without: left(&without),
            is_seen,
        });
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
