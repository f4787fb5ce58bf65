//! Seconds and images of a step of quality, measured.

use std::time::Instant;

use footlight_engine::{Engine, Error};
use footlight_picture::Image;
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Transport as _};

/// A step is measured repeatedly while its runs took less than this in total, seconds; the shortest
/// counts.
const ENOUGH: f64 = 0.5;

/// Measured durations, seconds.
#[derive(Clone, Copy, Debug)]
pub struct Seconds {
    /// Before the first image.
    pub prepare: f64,
    /// Every bank alone, after preparation.
    pub banks: f64,
    /// One more image of banks that were all lit before.
    pub picture: f64,
}

impl Seconds {
    /// Time of all banks including preparation.
    pub fn total(&self) -> f64 {
        self.prepare + self.banks
    }
}

/// Images of every bank alone at a step of quality, and the seconds of the fastest of at most `runs`
/// runs.
///
/// # Errors
/// [`Error::NoSetup`], or an error of rendering.
pub fn banks_alone(
    engine: &Engine,
    quality: Quality,
    runs: usize,
) -> Result<(Vec<Image>, Seconds), Error> {
    let mut best = once(engine, quality)?;
    let mut spent = best.1.total() + best.1.picture;
    for _ in 1..runs {
        if spent > ENOUGH {
            break;
        }
        let found = once(engine, quality)?;
        spent += found.1.total() + found.1.picture;
        if found.1.total() < best.1.total() {
            best = found;
        }
    }
    Ok(best)
}

fn once(engine: &Engine, quality: Quality) -> Result<(Vec<Image>, Seconds), Error> {
    let (document, work) = (engine.document(), engine.work());
    let setup = document.setup().ok_or(Error::NoSetup)?;
    let home = document.home();
    let banks = engine.show().banks.iter();
    let settings: Vec<Vec<f64>> = banks
        .map(|bank| document.alone(&bank.name, &home))
        .collect::<Result<_, _>>()?;
    let sum = |c: usize| settings.iter().filter_map(|s| s.get(c)).sum();
    let together = (0..settings.first().map_or(0, Vec::len)).map(sum).collect();
    let begin = Instant::now();
    let mut operator = Radiosity.prepare(setup, quality, work)?;
    let prepared = begin.elapsed().as_secs_f64();
    let images = operator.render(&settings, work)?;
    let done = begin.elapsed().as_secs_f64();
    operator.render(&[together], work)?;
    let seconds = Seconds {
        prepare: prepared,
        banks: done - prepared,
        picture: begin.elapsed().as_secs_f64() - done,
    };
    Ok((images, seconds))
}
