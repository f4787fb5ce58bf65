//! Levels from a picture.
//!
//! Each channel of each pixel counts by its alpha, divided by the luminance there and the mean of the whole
//! together, so that bright spots do not decide alone. Where the display shows black or its most, light
//! counts only beyond that.

use std::path::Path;

use super::{Solution, SolveError, Solved, Squares, Unknown, solved, unknowns};
use crate::error::ReferenceError;
use crate::{Engine, Error, LiveControl};
use footlight_host::work::{Cancelled, Work, in_order};
use footlight_picture::Image;
use footlight_picture::combine::combine;
use footlight_picture::shrink::shrink;
use footlight_picture::sketch::{Known, Sketch};
use footlight_show::linalg::{Matrix, bounded_least_squares};
use footlight_show::units::Rgb;
use footlight_transport::contract::check_memory;

/// The largest file that is read, in bytes.
const LARGEST: u64 = 1 << 30;
/// Pixels that are looked at; larger pictures are averaged down.
const PIXELS: usize = 640 * 360;
/// How far the shape of a sketch may be from that of the view.
const SHAPE: f64 = 0.1;
/// Fewer pixels a row or a column tell nothing.
const LEAST: usize = 8;
/// Of the light of the bank that is seen best, what no display shows.
const UNSEEN: f64 = 1e-6;
/// Rounds in which channels that the display cuts are found to count or not.
const ROUNDS: usize = 20;
/// Doublings of light that a free exposure is looked for in, either way, and steps of the search.
const OCTAVES: f64 = 24.0;
const SEARCH: usize = 64;
/// Beyond this share of the light left, a sketch that one colour fits better is of something else.
const UNLIKE: f64 = 0.5;
/// How far off the light of a pixel is that counts as out of reach.
const OUT_OF_REACH: f64 = 0.1;

/// Levels from a picture, and how near they come.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketched {
    /// The levels.
    pub solved: Solved,
    /// The root mean square of what differs, as a share of the sketch's light, weighted as above: with the
    /// levels that stood, and with those solved for.
    pub difference: [f64; 2],
    /// The exposure, in stops, that was found; `None` where it was given.
    pub exposure: Option<f64>,
    /// Parts of the picture that are brighter than the banks at full, and that are darker than everything else
    /// alone.
    pub out_of_reach: [Option<Place>; 2],
    /// The sketch and the picture of the levels, of one size, in the show's light.
    pub images: [Image; 2],
}

/// A part of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its share of the pixels that count.
    pub share: f64,
    /// Its middle, from the left and from the top, 0 to 1.
    pub middle: [f64; 2],
}

/// The levels of the banks and groups of these names, of all banks without one, whose picture comes nearest
/// to the one in the file at `path`. What a PNG, JPEG or WebP shows is light through the show's tone, at its
/// exposure or, with `any_exposure`, at whichever fits best.
///
/// # Errors
/// [`Error::Reference`] where it cannot be read, [`Error::Solve`], [`Error::NoSuchBank`],
/// [`Error::NoBanks`], else what rendering says.
pub fn sketched(
    engine: &mut Engine,
    live: &LiveControl,
    path: &Path,
    banks: &[String],
    any_exposure: bool,
) -> Result<Sketched, Error> {
    let mut unknowns = unknowns(engine.document(), live, banks)?;
    let limit = engine.work().memory as u64;
    let bytes = engine.host.store.read(path, LARGEST.min(limit))?;
    engine.coarse()?;
    let tone = if any_exposure {
        engine.document().tone_at(0.0)
    } else {
        engine.tone()?
    };
    let memory = engine.work().holding(bytes.len()).memory;
    let read = Sketch::read(&bytes, tone, memory);
    let sketch = read.map_err(|source| ReferenceError::Picture {
        path: path.to_owned(),
        source,
    })?;
    let size = common_size(sketch.light.size(), engine.estimate().rendered()?.size())?;
    let fitting = Fitting::new(engine, sketch.shrunk(size))?;
    let seen = fitting.seen();
    unknowns
        .iter_mut()
        .for_each(|unknown| unknown.hold_unless(&seen));
    let work = engine.work();
    let exact = fitting.squares(None, work)?;
    fitting.check_likeness(&exact)?;
    let stood = live.setting(engine.document());
    let (squares, gain, solution) = fitting.solve((exact, stood), &unknowns, any_exposure, work)?;
    let picture = |settings: &[f64]| fitting.picture(settings, work);
    let difference =
        [&squares.stood, &solution.settings].map(|s| fitting.difference(&picture(s), gain));
    let left = |settings: &[f64]| (squares.left(settings, gain) / fitting.light).sqrt();
    let ends = [|u: &Unknown| u.bounds.1, |u: &Unknown| u.bounds.0].map(|end| {
        let mut settings = squares.stood.clone();
        unknowns
            .iter()
            .for_each(|unknown| settings[unknown.coordinate] = end(unknown));
        picture(&settings)
    });
    Ok(Sketched {
        solved: solved((engine.document(), live), &unknowns, &solution, &seen, left),
        difference,
        exposure: any_exposure.then(|| gain.log2()),
        out_of_reach: fitting.out_of_reach(ends, gain),
        images: [
            combine(size, &[(1.0 / gain, &fitting.sketch.light)], work.threads),
            picture(&solution.settings),
        ],
    })
}

/// The size at which a sketch and the view are compared: each averaged down to the smaller.
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

/// What is fitted, channel by channel.
struct Fitting {
    sketch: Sketch,
    /// Of each channel.
    weights: Vec<f32>,
    /// The light of each coordinate at full.
    columns: Vec<Image>,
    /// The sum of squares of the sketch.
    light: f64,
}

impl Fitting {
    fn new(engine: &Engine, sketch: Sketch) -> Result<Fitting, Error> {
        let size = sketch.light.size();
        let small = |image: Image| match image.size() == size {
            true => image,
            false => shrink(&image, size.0, size.1),
        };
        let images = engine.bank_images(2 * size_of_val(sketch.light.data()))?;
        let columns = images.into_iter().map(small).collect();
        let weights = weights(&sketch).ok_or(SolveError::Black)?;
        let squares = sketch
            .light
            .data()
            .iter()
            .zip(&weights)
            .map(|(v, w)| f64::from(v * w).powi(2));
        Ok(Fitting {
            light: squares.sum(),
            sketch,
            weights,
            columns,
        })
    }

    /// Which of the coordinates light anything that counts.
    fn seen(&self) -> Vec<bool> {
        let peak = |image: &Image| {
            let weighted = image
                .data()
                .iter()
                .zip(&self.weights)
                .map(|(v, w)| f64::from(v * w).abs());
            weighted.fold(0.0, f64::max)
        };
        let peaks: Vec<f64> = self.columns.iter().map(peak).collect();
        let most = peaks.iter().copied().fold(0.0, f64::max);
        peaks.iter().map(|peak| *peak > UNSEEN * most).collect()
    }

    /// The picture of settings.
    fn picture(&self, settings: &[f64], work: Work<'_>) -> Image {
        let terms: Vec<(f64, &Image)> = settings.iter().copied().zip(&self.columns).collect();
        combine(self.sketch.light.size(), &terms, work.threads)
    }

    /// The channels of a picture, each with what the sketch says of it.
    fn channels<'f>(
        &'f self,
        picture: &'f Image,
        gain: f64,
    ) -> impl Iterator<Item = (f64, f64, Known, f64)> + 'f {
        let sketch = self.sketch.light.data().iter().zip(&self.sketch.known);
        let rows = picture.data().iter().zip(sketch).zip(&self.weights);
        rows.map(move |((shown, (meant, known)), w)| {
            (
                gain * f64::from(*shown),
                f64::from(*meant),
                *known,
                f64::from(*w),
            )
        })
    }

    /// What a picture differs by from the sketch, as a share of its light.
    fn difference(&self, picture: &Image, gain: f64) -> f64 {
        let off = |(shown, meant, known, weight): (f64, f64, Known, f64)| {
            let off = weight * (shown - meant);
            if counts(shown, meant, known) {
                off * off
            } else {
                0.0
            }
        };
        (self.channels(picture, gain).map(off).sum::<f64>() / self.light).sqrt()
    }

    /// Refuses a sketch that one colour comes nearer to than any light of all the lamps, however bright.
    fn check_likeness(&self, exact: &Matrix) -> Result<(), SolveError> {
        let n = self.columns.len();
        let right: Vec<f64> = (0..n).map(|i| exact[(i, n)]).collect();
        let gram = exact.view((0, 0), (n, n)).into_owned();
        let bounds = vec![(0.0, f64::INFINITY); n];
        let settings = bounded_least_squares(&gram, &right, &bounds, &vec![0.0; n]).x;
        let left = Squares {
            sums: exact.clone(),
            stood: Vec::new(),
        }
        .left(&settings, 1.0);
        let mut flat = 0.0;
        for colour in 0..3 {
            let mut sums = [0.0; 3];
            let channels = self
                .channels(&self.sketch.light, 1.0)
                .skip(colour)
                .step_by(3);
            for (_, meant, _, weight) in channels.filter(|(.., known, _)| *known == Known::Exact) {
                let terms = [1.0, meant, meant * meant].map(|term| weight * weight * term);
                sums.iter_mut()
                    .zip(terms)
                    .for_each(|(sum, term)| *sum += term);
            }
            let [all, mean, square] = sums;
            flat += square - if all > 0.0 { mean * mean / all } else { 0.0 };
        }
        let [nearest, flat] = [left, flat].map(|left| (left.max(0.0) / self.light).sqrt());
        if nearest > UNLIKE && nearest >= flat {
            return Err(SolveError::Unlike { nearest, flat });
        }
        Ok(())
    }

    /// The channels that the display cuts and that count with some settings.
    fn cut(&self, picture: &Image, gain: f64) -> Vec<usize> {
        let channels = self.channels(picture, gain).enumerate();
        let counted = channels.filter(|(_, (shown, meant, known, weight))| {
            *known != Known::Exact && *weight > 0.0 && counts(*shown, *meant, *known)
        });
        counted.map(|(row, _)| row).collect()
    }

    /// Sums over some rows, or over all whose light is known exactly.
    fn squares(&self, rows: Option<&[usize]>, work: Work<'_>) -> Result<Matrix, Error> {
        let all = self
            .columns
            .iter()
            .chain([&self.sketch.light])
            .map(Image::data);
        let all: Vec<&[f32]> = all.collect();
        let Some(rows) = rows else {
            let known = self.weights.iter().zip(&self.sketch.known);
            let exact = known.map(|(w, known)| if *known == Known::Exact { *w } else { 0.0 });
            return Ok(products(&all, &exact.collect::<Vec<f32>>(), work)?);
        };
        let bytes = (all.len() + 1) * rows.len() * size_of::<f32>();
        check_memory("what the sketch leaves open", bytes, work.memory)?;
        let of = |column: &[f32]| -> Vec<f32> {
            rows.iter()
                .map(|row| column.get(*row).copied().unwrap_or_default())
                .collect()
        };
        let some: Vec<Vec<f32>> = all.into_iter().map(of).collect();
        let some: Vec<&[f32]> = some.iter().map(Vec::as_slice).collect();
        Ok(products(&some, &of(&self.weights), work)?)
    }

    /// The sums over all channels that count, the gain, and the best settings.
    fn solve(
        &self,
        (exact, stood): (Matrix, Vec<f64>),
        unknowns: &[Unknown],
        any_exposure: bool,
        work: Work<'_>,
    ) -> Result<(Squares, f64, Solution), Error> {
        // At first what is black counts, as if too bright, and what is white does not.
        let known = self.sketch.known.iter().enumerate();
        let black = known.filter(|(_, known)| **known == Known::AtMost);
        let mut cut: Vec<usize> = black.map(|(row, _)| row).collect();
        let mut rounds = 0..ROUNDS;
        loop {
            let sums = &exact + self.squares(Some(&cut), work)?;
            let squares = Squares {
                sums,
                stood: stood.clone(),
            };
            let gain = if any_exposure {
                squares.gain(unknowns)
            } else {
                1.0
            };
            let solution = squares.solve(unknowns, gain);
            let now = self.cut(&self.picture(&solution.settings, work), gain);
            if now == cut || rounds.next().is_none() {
                return Ok((squares, gain, solution));
            }
            cut = now;
        }
    }

    /// Where the sketch is brighter than all banks at full, and darker than everything else alone.
    fn out_of_reach(&self, [most, least]: [Image; 2], gain: f64) -> [Option<Place>; 2] {
        let mean = mean(&self.sketch);
        let beyond = |a: f64, b: f64| a > (1.0 + OUT_OF_REACH) * b + 0.1 * OUT_OF_REACH * mean;
        let of = |end: &Image, is_out: &dyn Fn(f64, f64) -> bool| {
            let (width, height) = end.size();
            let [mut all, mut share, mut x, mut y] = [0.0; 4];
            let lights = luminances(end).zip(luminances(&self.sketch.light));
            for (pixel, ((end, meant), mask)) in lights.zip(&self.sketch.mask).enumerate() {
                let mask = f64::from(*mask);
                all += mask;
                if is_out(gain * end, meant) {
                    share += mask;
                    x += mask * ((pixel % width) as f64 + 0.5) / width as f64;
                    y += mask * ((pixel / width) as f64 + 0.5) / height as f64;
                }
            }
            (share > 0.0).then(|| Place {
                share: share / all,
                middle: [x / share, y / share],
            })
        };
        [
            of(&most, &|most, meant| beyond(meant, most)),
            of(&least, &|least, meant| beyond(least, meant)),
        ]
    }
}

/// Does a channel count that shows this where the sketch says that?
fn counts(shown: f64, meant: f64, known: Known) -> bool {
    match known {
        Known::Exact => true,
        Known::AtMost => shown > meant,
        Known::AtLeast => shown < meant,
    }
}

fn luminances(image: &Image) -> impl Iterator<Item = f64> {
    let (pixels, _) = image.data().as_chunks::<3>();
    pixels
        .iter()
        .map(|pixel| Rgb(pixel.map(f64::from)).luminance().max(0.0))
}

/// Mean luminance of what counts.
fn mean(sketch: &Sketch) -> f64 {
    let pairs = luminances(&sketch.light).zip(&sketch.mask);
    let (sum, all) = pairs.fold((0.0, 0.0), |(sum, all), (light, mask)| {
        (sum + light * f64::from(*mask), all + f64::from(*mask))
    });
    if all > 0.0 { sum / all } else { 0.0 }
}

/// The weight of each channel; `None` where nothing that counts is known to have light.
fn weights(sketch: &Sketch) -> Option<Vec<f32>> {
    let mean = mean(sketch);
    let lit = sketch
        .light
        .data()
        .iter()
        .zip(&sketch.known)
        .zip(sketch.mask.iter().flat_map(|m| [*m; 3]));
    let is_lit = lit
        .into_iter()
        .any(|((v, known), m)| *v > 0.0 && m > 0.0 && *known != Known::AtMost);
    let of = |(light, mask): (f64, &f32)| [(f64::from(*mask) / (light + mean)) as f32; 3];
    let pairs = luminances(&sketch.light).zip(&sketch.mask);
    (is_lit && mean > 0.0).then(|| pairs.flat_map(of).collect())
}

impl Squares {
    /// The gain with which the unknowns come nearest.
    fn gain(&self, unknowns: &[Unknown]) -> f64 {
        let met = self.sums[(self.stood.len(), self.stood.len())];
        let mut rest = self.stood.clone();
        unknowns
            .iter()
            .for_each(|unknown| rest[unknown.coordinate] = 0.0);
        let others = self.square(rest.into_iter().chain([0.0]));
        if others <= 1e-12 * met {
            return self.gain_alone(unknowns);
        }
        // What is left rises to both sides of the best gain, as it is convex in gain and settings together.
        let middle = 0.5 * (met / others).log2();
        let (mut low, mut high) = (middle - OCTAVES, middle + OCTAVES);
        let left = |at: f64| self.left(&self.solve(unknowns, at.exp2()).settings, at.exp2());
        for _ in 0..SEARCH {
            let third = (high - low) / 3.0;
            if left(low + third) <= left(high - third) {
                high -= third;
            } else {
                low += third;
            }
        }
        (0.5 * (low + high)).exp2()
    }

    /// Where nothing else shines, any gain from some value on will do: that of the smallest change, or with
    /// the brightest bank at full where all are out.
    fn gain_alone(&self, unknowns: &[Unknown]) -> f64 {
        let free = |unknown: &Unknown| Unknown {
            bounds: (0.0, f64::INFINITY),
            ..*unknown
        };
        let free: Vec<Unknown> = unknowns.iter().map(free).collect();
        let light = self.solve(&free, 1.0).settings;
        let products = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let rooms = unknowns
            .iter()
            .map(|unknown| unknown.bounds.1 / light[unknown.coordinate]);
        let most = rooms
            .filter(|room| *room > 0.0)
            .fold(f64::INFINITY, f64::min);
        let nearest = products(&light, &self.stood) / products(&light, &light);
        let scale = if nearest > 0.0 {
            nearest.min(most)
        } else {
            most
        };
        if scale.is_finite() && scale > 0.0 {
            1.0 / scale
        } else {
            1.0
        }
    }
}

/// Rows whose products are summed as one, whatever the threads, and of these as many as the cache holds.
const PART: usize = 1 << 13;
const ROWS: usize = 1 << 9;

/// The sums over all rows of `weight^2 a b` for every pair of columns.
fn products(columns: &[&[f32]], weights: &[f32], work: Work<'_>) -> Result<Matrix, Cancelled> {
    let parts: Vec<(usize, &[f32])> = weights.chunks(PART).enumerate().collect();
    let n = columns.len();
    let of_part = |(part, weights): &(usize, &[f32])| {
        work.check()?;
        let mut sums = Matrix::zeros(n, n);
        let mut block = vec![[0.0_f64; ROWS]; n];
        for (rows, weights) in weights.chunks(ROWS).enumerate() {
            let start = part * PART + rows * ROWS;
            for (to, column) in block.iter_mut().zip(columns) {
                let own = column.get(start..start + weights.len()).unwrap_or_default();
                to.fill(0.0);
                let values = own.iter().zip(weights);
                to.iter_mut()
                    .zip(values)
                    .for_each(|(to, (v, w))| *to = f64::from(*v) * f64::from(*w));
            }
            for (i, a) in block.iter().enumerate() {
                for (sum, b) in sums.column_mut(i).iter_mut().zip(&block).take(i + 1) {
                    let mut lanes = [0.0_f64; 8];
                    for (a, b) in a.as_chunks::<8>().0.iter().zip(b.as_chunks::<8>().0) {
                        lanes
                            .iter_mut()
                            .zip(a.iter().zip(b))
                            .for_each(|(lane, (a, b))| *lane += a * b);
                    }
                    *sum += lanes.iter().sum::<f64>();
                }
            }
        }
        Ok(sums)
    };
    let mut all = Matrix::zeros(n, n);
    for sums in in_order(&parts, work.threads, of_part) {
        all += sums?;
    }
    all.fill_lower_triangle_with_upper_triangle();
    Ok(all)
}
