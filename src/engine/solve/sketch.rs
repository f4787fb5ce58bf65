//! Levels for a target image.
//!
//! Each channel of each pixel is weighted by its alpha over the sum of the luminance there and the
//! overall mean, so that bright spots do not dominate. Where the display clips, only light below
//! the limit counts.

use std::path::Path;

use super::{Solution, SolveError, Solved, Squares, Unknown, lights, solved, unknowns};
use crate::{Engine, Error, LiveControl};
use footlight_host::work::{Cancelled, Work, in_order};
use footlight_picture::Image;
use footlight_picture::combine::combine;
use footlight_picture::shrink::shrink;
use footlight_picture::sketch::Sketch;
use footlight_show::linalg::Matrix;
use footlight_show::units::Rgb;
use footlight_transport::contract::check_memory;

/// Most bytes of a file.
const LARGEST: u64 = 1 << 30;
/// Most pixels compared; larger images are averaged down.
const PIXELS: usize = 640 * 360;
/// Largest relative difference of aspect ratio between sketch and view.
const SHAPE: f64 = 0.1;
/// Least number of rows and columns.
const LEAST: usize = 8;
/// Share of the most visible bank's light that is invisible on any display.
const UNSEEN: f32 = 1e-6;
/// Most iterations to find the clipped channels that count.
const ROUNDS: usize = 20;
/// Search range of a free exposure in octaves, either way, and steps of the search.
const OCTAVES: f64 = 32.0;
const SEARCH: usize = 80;
/// Relative variation of luminance above which a sketch must correlate with the best image; with
/// less correlation it is of another view.
const VARIES: f64 = 0.2;
const LIKE: f64 = 0.5;

/// Levels for a target image, and the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketched {
    /// The levels.
    pub solved: Solved,
    /// Weighted root mean square difference, relative to the sketch's light: before and after.
    pub difference: [f64; 2],
    /// The exposure found, in stops; `None` if it was given.
    pub exposure: Option<f64>,
    /// Share of the sketch's light that no levels can reach, channel by channel.
    pub out_of_reach: f64,
    /// The sketch, the image of the levels, and the unreachable part (brighter than the banks at
    /// full; negative: darker than all other light), of one size, in the show's light.
    pub images: [Image; 3],
}

/// The levels of the named banks and groups, or of all banks without names, whose image comes
/// nearest to that in the file at `path`. PNG, JPEG and WebP are inverted through the show's tone,
/// at its exposure or, with `any_exposure`, at the best one.
///
/// # Errors
/// [`Error::Sketch`] when it is not an image, [`Error::Solve`], [`Error::NoSuchBank`],
/// [`Error::NoBanks`], or an error of rendering.
pub fn sketched(
    engine: &mut Engine,
    live: &LiveControl,
    path: &Path,
    banks: &[&str],
    any_exposure: bool,
) -> Result<Sketched, Error> {
    let mut unknowns = unknowns((engine.document(), live), banks, false)?;
    let limit = engine.work().memory as u64;
    let bytes = engine.host.store.read(path, LARGEST.min(limit))?;
    engine.coarse()?;
    let tone = match any_exposure {
        true => engine.document().tone_at(0.0),
        false => engine.tone()?,
    };
    let memory = engine.work().holding(bytes.len()).memory;
    let read = Sketch::read(&bytes, tone, memory);
    let sketch = read.map_err(|source| Error::Sketch {
        path: path.to_owned(),
        source,
    })?;
    let size = common_size(sketch.light.size(), engine.estimate().rendered()?.size())?;
    let (fitting, stood) = Fitting::new(engine, live, sketch.shrunk(size))?;
    let seen = fitting.seen();
    unknowns
        .iter_mut()
        .for_each(|unknown| unknown.hold_unless(&seen));
    let work = engine.work();
    let (squares, gain, solution) = fitting.solve(&unknowns, &stood, any_exposure, work)?;
    let picture = |settings: &[f64]| combine(size, &fitting.terms(settings), work.threads);
    let difference = [&stood, &solution.settings].map(|s| fitting.difference(&picture(s), gain));
    let ends = [|u: &Unknown| u.bounds.0, |u: &Unknown| u.bounds.1].map(|end| {
        let mut settings = stood.clone();
        let own = unknowns
            .iter()
            .map(|unknown| (&unknown.parts, end(unknown)));
        own.for_each(|(parts, end)| parts.iter().for_each(|(i, _)| settings[*i] = end));
        picture(&settings)
    });
    let meant = combine(size, &[(1.0 / gain, &fitting.sketch.light)], work.threads);
    let beyond = |((meant, least), most): ((&f32, &f32), &f32)| {
        meant - meant.clamp(*least, most.max(*least))
    };
    let beyond = meant
        .data()
        .iter()
        .zip(ends[0].data())
        .zip(ends[1].data())
        .map(beyond);
    let beyond =
        Image::from_data(size.0, size.1, beyond.collect()).unwrap_or_else(|| meant.clone());
    let reached = combine(size, &[(1.0, &meant), (-1.0, &beyond)], work.threads);
    let sums = (&squares, gain, fitting.light);
    Ok(Sketched {
        solved: solved((engine.document(), live), &unknowns, &solution, sums, &seen),
        difference,
        exposure: any_exposure.then(|| gain.log2()),
        out_of_reach: fitting.difference(&reached, gain),
        images: [meant, picture(&solution.settings), beyond],
    })
}

/// The size at which a sketch and the view are compared: the smaller of the two.
fn common_size(found: (usize, usize), view: (usize, usize)) -> Result<(usize, usize), SolveError> {
    let [own, wanted] = [found, view].map(|(width, height)| width as f64 / height as f64);
    let (width, height) = (found.0.min(view.0), found.1.min(view.1));
    if (own / wanted).ln().abs() > SHAPE || width.min(height) < LEAST {
        return Err(SolveError::Shape { found, view });
    }
    let by = (PIXELS as f64 / (width * height) as f64).sqrt().min(1.0);
    Ok([width, height]
        .map(|length| ((length as f64 * by).round() as usize).max(1))
        .into())
}

/// A sketch and the light to approximate it, channel by channel.
struct Fitting {
    sketch: Sketch,
    /// Weight of each channel.
    weights: Vec<f32>,
    /// The light of each coordinate at full.
    columns: Vec<Image>,
    /// Sum of squares of the sketch.
    light: f64,
}

impl Fitting {
    /// Prepares the fit at the current settings.
    fn new(
        engine: &mut Engine,
        live: &LiveControl,
        sketch: Sketch,
    ) -> Result<(Fitting, Vec<f64>), Error> {
        let size = sketch.light.size();
        let small = |image: Image| match image.size() == size {
            true => image,
            false => shrink(&image, size.0, size.1),
        };
        let masked = || luminances(&sketch.light).zip(&sketch.mask);
        let sum =
            |of: fn(f64, f64) -> f64| masked().map(|(y, m)| of(y, f64::from(*m))).sum::<f64>();
        let mean = sum(|y, m| y * m) / sum(|_, m| m);
        let of = |(light, mask): (f64, &f32)| [(f64::from(*mask) / (light + mean)) as f32; 3];
        let weights: Vec<f32> = masked().flat_map(of).collect();
        let channels = sketch.light.data().iter().zip(&weights);
        let light: f64 = channels.map(|(v, w)| f64::from(v * w).powi(2)).sum();
        // Not finite when no pixel counts, or none has light.
        if !light.is_finite() || light <= 0.0 {
            return Err(SolveError::Black.into());
        }
        let bytes = engine.show().coordinates().len() * size_of_val(sketch.light.data());
        check_memory("a picture of each bank", bytes, engine.work().memory)?;
        let (columns, stood) = lights(engine, live, small)?;
        let fitting = Fitting {
            sketch,
            weights,
            columns,
            light,
        };
        Ok((fitting, stood))
    }

    /// For each coordinate, true when it contributes visible light.
    fn seen(&self) -> Vec<bool> {
        let peak = |image: &Image| {
            let weighted = image
                .data()
                .iter()
                .zip(&self.weights)
                .map(|(v, w)| (v * w).abs());
            weighted.fold(0.0, f32::max)
        };
        let peaks: Vec<f32> = self.columns.iter().map(peak).collect();
        let most = peaks.iter().copied().fold(0.0, f32::max);
        peaks.iter().map(|peak| *peak > UNSEEN * most).collect()
    }

    fn terms(&self, settings: &[f64]) -> Vec<(f64, &Image)> {
        settings.iter().copied().zip(&self.columns).collect()
    }

    /// Weighted difference of each channel from the sketch; 0 where the sketch is clipped and the
    /// image brighter.
    fn off<'f>(&'f self, picture: &'f Image, gain: f64) -> impl Iterator<Item = f64> + 'f {
        let meant = self.sketch.light.data().iter().zip(&self.sketch.cut);
        let rows = picture.data().iter().zip(meant).zip(&self.weights);
        rows.map(move |((shown, (meant, cut)), weight)| {
            let off = gain * f64::from(*shown) - f64::from(*meant);
            if *cut && off >= 0.0 {
                0.0
            } else {
                f64::from(*weight) * off
            }
        })
    }

    /// Difference of an image from the sketch, relative to the sketch's light.
    fn difference(&self, picture: &Image, gain: f64) -> f64 {
        (self.off(picture, gain).map(|off| off * off).sum::<f64>() / self.light).sqrt()
    }

    /// The sums over all channels that count, the gain, and the best settings.
    fn solve(
        &self,
        unknowns: &[Unknown],
        stood: &[f64],
        any_exposure: bool,
        work: Work<'_>,
    ) -> Result<(Squares, f64, Solution), Error> {
        let columns = self
            .columns
            .iter()
            .chain([&self.sketch.light])
            .map(Image::data);
        let columns: Vec<&[f32]> = columns.collect();
        // At first, no clipped channel counts.
        let mut counted: Vec<bool> = self.sketch.cut.iter().map(|cut| !cut).collect();
        let mut rounds = 0..ROUNDS;
        loop {
            let weights = self.weights.iter().zip(&counted);
            let weights: Vec<f32> = weights
                .map(|(w, counts)| if *counts { *w } else { 0.0 })
                .collect();
            let squares = Squares {
                sums: products(&columns, &weights, work)?,
                stood: stood.to_vec(),
            };
            if rounds.start == 0 {
                self.check_likeness(&squares, work)?;
            }
            let gain = match any_exposure {
                true => squares.gain(unknowns, work)?,
                false => 1.0,
            };
            let solution = squares.solve(unknowns, gain);
            let picture = combine(
                self.sketch.light.size(),
                &self.terms(&solution.settings),
                work.threads,
            );
            let off = self.off(&picture, gain).zip(&self.sketch.cut);
            let now: Vec<bool> = off.map(|(off, cut)| !cut || off < 0.0).collect();
            if now == counted || rounds.next().is_none() {
                return Ok((squares, gain, solution));
            }
            counted = now;
        }
    }

    /// Refuses a sketch whose bright and dark areas do not match those of the nearest image with
    /// all lamps at any brightness.
    fn check_likeness(&self, squares: &Squares, work: Work<'_>) -> Result<(), SolveError> {
        let any = |i| Unknown {
            bank: 0,
            parts: vec![(i, 1.0)],
            bounds: (0.0, f64::INFINITY),
            stood: 0.0,
        };
        let any: Vec<Unknown> = (0..self.columns.len()).map(any).collect();
        let settings = squares.solve(&any, 1.0).settings;
        let mut best = combine(
            self.sketch.light.size(),
            &self.terms(&settings),
            work.threads,
        );
        // White is all that a sketch shows of a lamp.
        let meant = self.sketch.light.data().iter().zip(&self.sketch.cut);
        let shown = best.data_mut().iter_mut().zip(meant);
        for (value, (white, _)) in shown.filter(|(_, (_, cut))| **cut) {
            *value = value.min(*white);
        }
        let pairs = luminances(&best).zip(luminances(&self.sketch.light));
        let mut sums = [0.0; 6];
        for ((a, b), weight) in pairs.zip(self.weights.iter().step_by(3)) {
            let terms =
                [1.0, a, b, a * a, b * b, a * b].map(|term| term * f64::from(*weight).powi(2));
            sums.iter_mut()
                .zip(terms)
                .for_each(|(sum, term)| *sum += term);
        }
        let [all, a, b, aa, bb, ab] = sums;
        let [own, varies, both] = [aa - a * a / all, bb - b * b / all, ab - a * b / all];
        let correlation = both / (own * varies).sqrt().max(f64::MIN_POSITIVE);
        if varies > VARIES * VARIES * bb && correlation < LIKE {
            return Err(SolveError::Unlike(correlation));
        }
        Ok(())
    }
}

impl Squares {
    /// The least gain for the best fit: without other light, the gain at which the brightest
    /// unknown is at full.
    fn gain(&self, unknowns: &[Unknown], work: Work<'_>) -> Result<f64, Cancelled> {
        let n = self.stood.len();
        let (all, met) = (self.sums.trace() - self.sums[(n, n)], self.sums[(n, n)]);
        let middle = 0.5 * (met / all.max(f64::MIN_POSITIVE)).log2();
        let (mut low, mut high) = (middle - OCTAVES, middle + OCTAVES);
        let left = |at: f64| self.left(&self.solve(unknowns, at.exp2()).settings, at.exp2());
        // The remainder is convex in gain and settings together, so it falls and then rises.
        for _ in 0..SEARCH {
            work.check()?;
            let third = (high - low) / 3.0;
            if left(low + third) <= left(high - third) + 1e-14 * met {
                high -= third;
            } else {
                low += third;
            }
        }
        Ok(high.exp2())
    }
}

fn luminances(image: &Image) -> impl Iterator<Item = f64> {
    let (pixels, _) = image.data().as_chunks::<3>();
    pixels
        .iter()
        .map(|pixel| Rgb(pixel.map(f64::from)).luminance().max(0.0))
}

/// Rows summed as one part, independent of the threads.
const PART: usize = 1 << 11;

/// The sums over all rows of `weight^2 a b` for every pair of columns.
fn products(columns: &[&[f32]], weights: &[f32], work: Work<'_>) -> Result<Matrix, Cancelled> {
    let parts: Vec<(usize, &[f32])> = weights.chunks(PART).enumerate().collect();
    let of_part = |(part, weights): &(usize, &[f32])| {
        work.check()?;
        let weighted = |row: usize, column: usize| {
            f64::from(columns[column][part * PART + row]) * f64::from(weights[row])
        };
        let rows = Matrix::from_fn(weights.len(), columns.len(), weighted);
        Ok(rows.transpose() * rows)
    };
    let parts = in_order(&parts, work.threads, of_part).into_iter();
    let mut all = parts.sum::<Result<Matrix, Cancelled>>()?;
    all.fill_upper_triangle_with_lower_triangle();
    Ok(all)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// More rows than a part has, and not a multiple.
    #[test]
    fn products_are_the_weighted_sums_of_every_pair() {
        let rows = 2 * PART + 311;
        let column = |seed: usize| -> Vec<f32> {
            (0..rows)
                .map(|i| (i * (seed + 7) % 101) as f32 / 50.0 - 0.7)
                .collect()
        };
        let columns = [column(1), column(2), column(3)];
        let weights: Vec<f32> = (0..rows).map(|i| (i % 5) as f32 * 0.25).collect();
        let slices: Vec<&[f32]> = columns.iter().map(Vec::as_slice).collect();
        let one = products(&slices, &weights, Work::silent()).unwrap();
        let three = Work {
            threads: 3,
            ..Work::silent()
        };
        assert_eq!(products(&slices, &weights, three).unwrap(), one);
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                let terms = a.iter().zip(b).zip(&weights);
                let exact =
                    terms.map(|((a, b), w)| f64::from(*a) * f64::from(*b) * f64::from(*w).powi(2));
                let exact: f64 = exact.sum();
                assert!((one[(i, j)] - exact).abs() < 1e-11 * rows as f64, "{i} {j}");
            }
        }
    }

    #[test]
    fn sizes_that_differ_in_shape_or_are_tiny_have_none_in_common() {
        assert_eq!(common_size((960, 540), (640, 360)), Ok((640, 360)));
        assert_eq!(common_size((100, 60), (640, 360)), Ok((100, 60)));
        assert_eq!(common_size((1920, 1080), (1280, 720)), Ok((640, 360)));
        for found in [(640, 480), (7, 4), (1, 1), (30_000, 1)] {
            assert!(common_size(found, (640, 360)).is_err(), "{found:?}");
        }
    }
}
