//! Levels that best approximate a target image, or an illuminance.
//!
//! An image is linear in settings, so that this is least squares within bounds
//! ([`bounded_least_squares`]); of several equally good solutions the smallest change from the
//! current settings is used. Levels follow by inverting the dimmers' laws. Other banks, and fixed
//! lights, stay as they are. After Schoeneman, Dorsey, Smits, Arvo and Greenberg 1993, "Painting
//! with Light".

#![allow(
    clippy::indexing_slicing,
    reason = "one setting, column and row of the sums for each coordinate"
)]

mod lux;
mod sketch;

use std::fmt::Write as _;

use footlight_show::linalg::{Matrix, Vector, bounded_least_squares};
use footlight_show::model::{Bank, Show};
use footlight_show::timeline;
use footlight_transport::seen::Hidden;

use super::{Document, Engine, Error, LiveControl};
use footlight_picture::Image;

pub use self::lux::{Illuminance, illuminance, illuminance_of};
pub use self::sketch::{Sketched, sketched};

/// Differences of levels below this, a hundredth of a percent, are ignored; levels are written to
/// this precision.
const STEP: f64 = 1e-4;

/// Reason why no levels come near the target.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The sketch's aspect ratio differs from the view's.
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
    /// No pixel counts, or none is brighter than black.
    #[error("the sketch is black, or transparent all over: there is nothing to come near to")]
    Black,
    /// No mixture of lamps resembles the sketch.
    #[error(
        "the sketch is not of this view: whatever the levels, bright and dark are elsewhere (correlation {0:.2}); \
         paint over a picture of the view, such as `picture -o view.png` writes"
    )]
    Unlike(f64),
    /// The illuminance at a point is not visible.
    #[error("{point} {hidden}")]
    Hidden {
        /// The point as typed.
        point: String,
        /// The reason.
        hidden: Hidden,
    },
    /// Haze shines between the eye and the surface.
    #[error(
        "in haze a picture does not show how much light falls on a surface; try it without `haze`"
    )]
    Haze,
}

/// Solved levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// The requested banks, in the order of the show.
    pub banks: Vec<SolvedBank>,
    /// Banks whose light is indistinguishable from that of others here: only sums are determined.
    pub tied: Vec<String>,
    /// The changed levels, in the form for `set`; empty without changes.
    pub moves: String,
}

/// A bank's level.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedBank {
    /// Its name.
    pub name: String,
    /// Its level before and after.
    pub level: [f64; 2],
    /// The light of its emitters at full level afterwards, for an rgb bank.
    pub colour: Vec<f64>,
    /// Remaining difference if this bank alone keeps its level, relative to the target.
    pub without: f64,
    /// False when its light is nowhere in the view.
    pub is_seen: bool,
}

/// An unknown setting.
struct Unknown {
    bank: usize,
    /// The coordinates that it moves, with factors.
    parts: Vec<(usize, f64)>,
    /// The range of its values, and the current one.
    bounds: (f64, f64),
    stood: f64,
}

impl Unknown {
    /// Fixes it at its current value if its light is not seen.
    fn hold_unless(&mut self, seen: &[bool]) {
        if !self.parts.iter().any(|(coordinate, _)| seen[*coordinate]) {
            self.bounds = (self.stood, self.stood);
        }
    }
}

/// The unknown settings of the named banks and groups, or of all banks without names: for an rgb
/// bank one for each emitter, or with `keep_colours` a single one.
fn unknowns(
    (document, live): (&Document, &LiveControl),
    names: &[&str],
    keep_colours: bool,
) -> Result<Vec<Unknown>, Error> {
    let show = document.show();
    let mut wanted = vec![names.is_empty(); show.banks.len()];
    for name in names {
        let group = show.groups.iter().find(|group| group.name == *name);
        let bank = show.banks.iter().position(|bank| bank.name == *name);
        let banks = group.map_or_else(|| bank.into_iter().collect(), |group| group.banks.clone());
        if banks.is_empty() {
            let (name, known) = ((*name).to_owned(), show.banks.iter());
            let known = known.map(|bank| bank.name.clone()).collect();
            return Err(Error::NoSuchBank {
                name,
                fixed: false,
                known,
            });
        }
        banks.into_iter().for_each(|bank| wanted[bank] = true);
    }
    let (standing, levels) = (live.setting(document), live.levels(document));
    let mut found = Vec::new();
    let banks = show.banks.iter().zip(show.first_parameters()).enumerate();
    for (index, (bank, first)) in banks.filter(|(index, _)| wanted[*index]) {
        let factor = live.factor(document, index);
        let (least, most) = timeline::range(bank.dimmer, &show.curves);
        let mut add = |parts, least: f64, stood: f64| {
            let bounds = ((factor * least).min(stood), (factor * most).max(stood));
            found.push(Unknown {
                bank: index,
                parts,
                bounds,
                stood,
            });
        };
        let own = show.coordinates_of(index);
        if bank.rgb && keep_colours {
            let parts = own
                .into_iter()
                .zip(levels[first + 1..first + 4].iter().copied());
            add(
                parts.collect(),
                least,
                factor * law(show, bank, levels[first]),
            );
        } else {
            let least = if bank.rgb { 0.0 } else { least };
            own.into_iter()
                .for_each(|i| add(vec![(i, 1.0)], least, standing[i]));
        }
    }
    if found.is_empty() {
        return Err(Error::NoBanks);
    }
    Ok(found)
}

/// The light of each coordinate of the show at full, with heads in their current poses, and the
/// current settings.
fn lights<T>(
    engine: &mut Engine,
    live: &LiveControl,
    each: impl Fn(Image) -> T,
) -> Result<(Vec<T>, Vec<f64>), Error> {
    engine.coarse()?;
    let document = engine.document();
    let mut stood = live.setting(document);
    stood.truncate(document.show().coordinates().len());
    let mut lights = Vec::with_capacity(stood.len());
    let poses = live.poses(document);
    engine.each_bank(
        |_| poses.clone(),
        engine.work(),
        |image| lights.push(each(image)),
    )?;
    Ok((lights, stood))
}

/// The light of a bank at a level.
fn law(show: &Show, bank: &Bank, level: f64) -> f64 {
    timeline::settings(bank.dimmer, &show.curves, &[level])[0]
}

/// Settings of all coordinates.
struct Solution {
    settings: Vec<f64>,
    /// Banks of which only sums are determined.
    tied: Vec<usize>,
}

/// Sums of squares and products over all rows: of the light of each coordinate at full, and, last,
/// of the target.
struct Squares {
    sums: Matrix,
    /// The current settings.
    stood: Vec<f64>,
}

impl Squares {
    /// The best values of the unknowns for a target of `gain` times the light.
    fn solve(&self, unknowns: &[Unknown], gain: f64) -> Solution {
        let n = self.stood.len();
        let mut parts = Matrix::zeros(n + 1, unknowns.len());
        let mut rest =
            Vector::from_iterator(n + 1, self.stood.iter().copied().chain([-1.0 / gain]));
        for (column, unknown) in unknowns.iter().enumerate() {
            for (coordinate, share) in &unknown.parts {
                parts[(*coordinate, column)] = *share;
                rest[*coordinate] = 0.0;
            }
        }
        let light = parts.transpose() * &self.sums;
        let right: Vec<f64> = (&light * -&rest).iter().copied().collect();
        let bounds: Vec<(f64, f64)> = unknowns.iter().map(|unknown| unknown.bounds).collect();
        let near: Vec<f64> = unknowns.iter().map(|unknown| unknown.stood).collect();
        let found = bounded_least_squares(&(light * &parts), &right, &bounds, &near);
        let settings = parts * Vector::from_vec(found.x) + rest;
        Solution {
            settings: settings.iter().copied().take(n).collect(),
            tied: found.tied.into_iter().map(|i| unknowns[i].bank).collect(),
        }
    }

    /// The remaining sum of squares for these settings.
    fn left(&self, settings: &[f64], gain: f64) -> f64 {
        self.square(settings.iter().map(|x| gain * x).chain([-1.0]))
    }

    /// The sum of squares of columns with these weights.
    fn square(&self, weights: impl Iterator<Item = f64>) -> f64 {
        let weights = Matrix::from_iterator(1, self.sums.ncols(), weights);
        (&weights * &self.sums * weights.transpose()).sum().max(0.0)
    }
}

/// The levels for solved settings, and the moves to them. `met` is the sum of squares of the
/// target, and `seen` is true for coordinates whose light counts.
fn solved(
    (document, live): (&Document, &LiveControl),
    unknowns: &[Unknown],
    Solution { settings, tied }: &Solution,
    (squares, gain, met): (&Squares, f64, f64),
    seen: &[bool],
) -> Solved {
    let (show, standing) = (document.show(), live.levels(document));
    let asked = |index: usize| unknowns.iter().any(|unknown| unknown.bank == index);
    let mut solved = Solved {
        banks: Vec::new(),
        tied: Vec::new(),
        moves: String::new(),
    };
    let banks = show.banks.iter().zip(show.first_parameters()).enumerate();
    for (index, (bank, first)) in banks.filter(|(index, _)| asked(*index)) {
        let (own, factor) = (show.coordinates_of(index), live.factor(document, index));
        let is_seen = factor > 0.0 && own.clone().any(|i| seen[i]);
        let light: Vec<f64> = own.clone().map(|i| settings[i] / factor).collect();
        let stood = &standing[first..first + if bank.rgb { 4 } else { 1 }];
        let level = match is_seen {
            true => levels(show, bank, &light, stood),
            false => stood.to_vec(),
        };
        if level
            .iter()
            .zip(stood)
            .any(|(a, b)| (a - b).abs() >= 0.5 * STEP)
        {
            for (suffix, level) in ["", ".r", ".g", ".b"].iter().zip(&level) {
                let percent = (level / STEP).round() / (0.01 / STEP);
                let _ = write!(solved.moves, "{}{suffix} {percent}  ", bank.name);
            }
        }
        let mut without = settings.clone();
        own.for_each(|i| without[i] = squares.stood[i]);
        if tied.contains(&index) {
            solved.tied.push(bank.name.clone());
        }
        solved.banks.push(SolvedBank {
            name: bank.name.clone(),
            level: [stood[0], level[0]],
            colour: level[1..].to_vec(),
            without: (squares.left(&without, gain) / met).sqrt(),
            is_seen,
        });
    }
    solved.moves.truncate(solved.moves.trim_end().len());
    solved
}

/// The level, and for an rgb bank its emitters, that give a light; current ones are kept if they
/// already do.
fn levels(show: &Show, bank: &Bank, light: &[f64], stood: &[f64]) -> Vec<f64> {
    let full = light.iter().copied().fold(0.0, f64::max);
    let colour = if bank.rgb { &stood[1..] } else { &[1.0] };
    let behind = law(show, bank, stood[0]);
    let same = |(light, emitter): (&f64, &f64)| (behind * emitter - light).abs() < 0.5 * STEP;
    if light.iter().zip(colour).all(same) {
        return stood.to_vec();
    }
    // The level carries the brightness, the colour the hue: the brightest emitter stays as long as
    // the level can follow.
    let brightest = colour.iter().copied().fold(0.0, f64::max);
    let (_, most) = timeline::range(bank.dimmer, &show.curves);
    let setting = if brightest > STEP {
        (full / brightest).min(most)
    } else {
        full
    };
    let level = timeline::level(bank.dimmer, &show.curves, setting, stood[0]);
    if !bank.rgb {
        return vec![level];
    }
    // A bank that goes out keeps its colour.
    let colour = match full < 0.5 * STEP {
        true => colour.to_vec(),
        false => light
            .iter()
            .map(|light| light / law(show, bank, level).max(full))
            .collect(),
    };
    [vec![level], colour].concat()
}
