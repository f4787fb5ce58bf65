//! Finds images that are sums of images, and equivalent settings of other sources.
//!
//! Light adds up, so an image whose lighting is a sum of existing lightings needs no rendering.
//! Only exact sums count: every light's strength agrees to rounding, and the sum must not rely on
//! cancellation, which would amplify the single-precision rounding of each image. This module
//! handles vectors and images and knows neither banks nor stores.

use std::collections::BTreeMap;

use footlight_picture::Image;
use footlight_show::linalg::{Matrix, Orthonormal, least_squares};

use super::address::{Digest, Lighting};

/// A vector by its nonzero entries.
type Sparse<K> = BTreeMap<K, f64>;

/// Least share of a column outside the span of those before it: a nearer one would need large
/// coefficients of either sign.
const MIN_RESIDUAL: f64 = 1e-6;

/// Largest sum of magnitudes for a result of magnitude 1.
const CANCELLATION: f64 = 8.0;

/// Tolerance of each entry, relative to the magnitudes added.
const EXACT: f64 = 64.0 * f64::EPSILON;

/// For each of `targets` the `columns` (index and nonzero factor) whose sum it is, exactly; `None`
/// if there are none. Columns with few entries are preferred.
fn solve<K: Ord + Copy>(
    columns: &[Sparse<K>],
    targets: &[Sparse<K>],
) -> Vec<Option<Vec<(usize, f64)>>> {
    let mut scales: Sparse<K> = BTreeMap::new();
    for (row, value) in columns.iter().chain(targets).flatten() {
        let scale = scales.entry(*row).or_default();
        *scale = scale.max(value.abs());
    }
    let dense = |sparse: &Sparse<K>| -> Vec<f64> {
        let entry = |(row, scale): (&K, &f64)| sparse.get(row).map_or(0.0, |x| x / scale);
        scales.iter().map(entry).collect()
    };
    let used = independent(columns, dense);
    let matrix = |vectors: Vec<Vec<f64>>| {
        let count = vectors.len();
        Matrix::from_iterator(scales.len(), count, vectors.into_iter().flatten())
    };
    let left = matrix(used.iter().map(|(_, column)| dense(column)).collect());
    let right = matrix(targets.iter().map(dense).collect());
    let Ok(found) = least_squares(&left, &right) else {
        return vec![None; targets.len()];
    };
    let mut out = Vec::with_capacity(targets.len());
    for (target, found) in targets.iter().zip(found.column_iter()) {
        let mut terms = Vec::new();
        let mut parts = Vec::new();
        for ((i, column), c) in used.iter().zip(&found) {
            let c = tidied(*c);
            if c != 0.0 {
                terms.push((*i, c));
                parts.push((c, *column));
            }
        }
        out.push(exact(&parts, target, &scales).then_some(terms));
    }
    out
}

/// Linearly independent columns with their indices, the sparsest first.
fn independent<K: Ord>(
    columns: &[Sparse<K>],
    dense: impl Fn(&Sparse<K>) -> Vec<f64>,
) -> Vec<(usize, &Sparse<K>)> {
    let mut order: Vec<(usize, &Sparse<K>)> = columns.iter().enumerate().collect();
    order.sort_by_key(|(_, column)| column.len());
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut span = Orthonormal::new();
    order.retain(|(_, column)| {
        let whole = dense(column);
        let mut rest = whole.clone();
        span.remove_from(&mut rest);
        norm(&rest) > MIN_RESIDUAL * norm(&whole) && span.push(&whole).is_ok()
    });
    order
}

/// Removes rounding from a coefficient: coefficients are mostly small whole numbers.
fn tidied(c: f64) -> f64 {
    let whole = c.round();
    if (c - whole).abs() < 1e-12 { whole } else { c }
}

/// True when the weighted sum of columns is the target.
fn exact<K: Ord + Copy>(
    terms: &[(f64, &Sparse<K>)],
    target: &Sparse<K>,
    scales: &Sparse<K>,
) -> bool {
    let (mut added, mut wanted) = (0.0, 0.0);
    for (row, scale) in scales {
        let aim = target.get(row).copied().unwrap_or_default();
        let terms = terms.iter();
        let parts = terms.filter_map(|(c, column)| Some(c * column.get(row)?));
        let (sum, magnitude) = parts.fold((0.0, 0.0), |(s, m): (f64, f64), x| (s + x, m + x.abs()));
        if (sum - aim).abs() > EXACT * (magnitude + aim.abs()) {
            return false;
        }
        added += magnitude / scale;
        wanted += aim.abs() / scale;
    }
    added <= CANCELLATION * wanted
}

/// A linear combination of images: index and weight in each channel.
pub type Terms = Vec<(usize, [f64; 3])>;

/// For each of `targets` the linear combination of `pictures` with exactly its lighting; `None` if
/// there is none. Channels are solved separately: another colour is another factor.
pub fn combinations(pictures: &[&Lighting], targets: &[&Lighting]) -> Vec<Option<Terms>> {
    let mut out: Vec<Option<BTreeMap<usize, [f64; 3]>>> =
        vec![Some(BTreeMap::new()); targets.len()];
    for channel in 0..3 {
        let of = |all: &[&Lighting]| -> Vec<Sparse<Digest>> {
            all.iter().map(|l| in_channel(l, channel)).collect()
        };
        let solved = solve(&of(pictures), &of(targets));
        for (sum, terms) in out.iter_mut().zip(solved) {
            let (Some(known), Some(terms)) = (sum.as_mut(), terms) else {
                *sum = None;
                continue;
            };
            for (i, c) in terms {
                if let Some(weight) = known.entry(i).or_default().get_mut(channel) {
                    *weight = c;
                }
            }
        }
    }
    let listed = |sum: BTreeMap<usize, [f64; 3]>| sum.into_iter().collect();
    out.into_iter().map(|sum| sum.map(listed)).collect()
}

fn in_channel(lighting: &Lighting, channel: usize) -> Sparse<Digest> {
    let strength = |s: &[f64; 3]| s.get(channel).copied().filter(|x| *x != 0.0);
    let lit = lighting.lit().iter();
    lit.filter_map(|(shape, s)| Some((*shape, strength(s)?)))
        .collect()
}

/// The settings of `sources` (the lighting of each at unit setting) with exactly the lighting of
/// each of `targets`; `None` if there is none. Among equal sources one takes the whole light.
pub fn settings(sources: &[Lighting], targets: &[&Lighting]) -> Vec<Option<Vec<f64>>> {
    let flat = |lighting: &Lighting| -> Sparse<(Digest, usize)> {
        let entries = lighting.lit().iter();
        let channels = entries.flat_map(|(shape, s)| {
            let entry = |(c, x): (usize, &f64)| ((*shape, c), *x);
            s.iter().enumerate().map(entry)
        });
        channels.filter(|(_, x)| *x != 0.0).collect()
    };
    let columns: Vec<_> = sources.iter().map(flat).collect();
    let targets: Vec<_> = targets.iter().map(|l| flat(l)).collect();
    let setting = |terms: Vec<(usize, f64)>| {
        let mut out = vec![0.0; sources.len()];
        for (i, c) in terms {
            if let Some(x) = out.get_mut(i) {
                *x = c;
            }
        }
        out
    };
    let solved = solve(&columns, &targets).into_iter();
    solved.map(|terms| terms.map(setting)).collect()
}

/// The weighted sum of images of `size`, each channel added in double precision and rounded once;
/// `None` when an image has another size, or the sum relies on cancellation, so that the images'
/// rounding would be visible.
pub fn weighted_sum(size: (usize, usize), terms: &[([f64; 3], &Image)]) -> Option<Image> {
    let mut parts = Vec::with_capacity(terms.len());
    for (weights, image) in terms {
        if image.size() != size {
            return None;
        }
        let (pixels, _) = image.data().as_chunks::<3>();
        parts.push((weights, pixels.iter()));
    }
    let mut out = Image::new(size.0, size.1);
    let (mut power, mut parts_power) = (0.0, 0.0);
    let (pixels, _) = out.data_mut().as_chunks_mut::<3>();
    for to in pixels {
        let (mut sums, mut magnitudes) = ([0.0; 3], [0.0; 3]);
        for (weights, pixels) in &mut parts {
            let channels = sums.iter_mut().zip(&mut magnitudes).zip(**weights);
            for (((sum, magnitude), weight), x) in channels.zip(pixels.next()?) {
                let value = weight * f64::from(*x);
                *sum += value;
                *magnitude += value.abs();
            }
        }
        for ((to, sum), magnitude) in to.iter_mut().zip(sums).zip(magnitudes) {
            power += sum * sum;
            parts_power += magnitude * magnitude;
            *to = sum as f32;
        }
    }
    (parts_power <= CANCELLATION * CANCELLATION * power).then_some(out)
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]
mod tests {
    use super::*;

    fn shape(n: u8) -> Digest {
        Digest::parse(&format!("{n:032x}")).unwrap()
    }

    fn lit(lights: &[(u8, [f64; 3])]) -> Lighting {
        Lighting::new(lights.iter().map(|(n, s)| (shape(*n), *s)))
    }

    fn white(lights: &[(u8, f64)]) -> Lighting {
        lit(&lights
            .iter()
            .map(|(n, s)| (*n, [*s; 3]))
            .collect::<Vec<_>>())
    }

    fn sum(pictures: &[Lighting], target: &Lighting) -> Option<Terms> {
        let pictures: Vec<&Lighting> = pictures.iter().collect();
        combinations(&pictures, &[target]).remove(0)
    }

    #[test]
    fn groups_and_their_parts_are_sums() {
        let (a, b) = (white(&[(1, 900.0)]), white(&[(2, 0.07)]));
        let both = white(&[(1, 900.0), (2, 0.07)]);
        let plus = [(0, [1.0; 3]), (1, [1.0; 3])];
        assert_eq!(sum(&[a.clone(), b.clone()], &both).unwrap(), plus);
        let minus = [(0, [1.0; 3]), (1, [-1.0; 3])];
        assert_eq!(sum(&[both.clone(), b.clone()], &a).unwrap(), minus);
        assert_eq!(sum(std::slice::from_ref(&both), &a), None);
        assert_eq!(sum(&[a], &white(&[(3, 1.0)])), None);
        assert_eq!(sum(&[both], &white(&[])).unwrap(), []);
    }

    #[test]
    fn another_colour_is_a_factor_in_each_channel() {
        let warm = lit(&[(1, [900.0, 600.0, 300.0])]);
        let red = lit(&[(1, [450.0, 0.0, 0.0])]);
        let found = sum(std::slice::from_ref(&warm), &red).unwrap();
        assert_eq!(found, [(0, [0.5, 0.0, 0.0])]);
        // The reverse is impossible, because there is no green.
        assert_eq!(sum(&[red], &warm), None);
    }

    #[test]
    fn a_sum_that_lives_on_cancellation_is_refused() {
        let near = |d: f64| white(&[(1, 1.0), (2, 1.0 + d)]);
        let target = white(&[(2, 1.0)]);
        for d in [1e-2, 1e-4, 1e-7, 1e-12] {
            assert_eq!(sum(&[near(0.0), near(d)], &target), None, "{d}");
        }
        // Images can cancel where strengths do not: light 2 is hardly visible next to light 1.
        let image = |x: f32| Image::from_data(1, 1, vec![x, x, x]).unwrap();
        let (both, one) = (image(1.000_001), image(1.0));
        assert_eq!(
            weighted_sum((1, 1), &[([1.0; 3], &both), ([-1.0; 3], &one)]),
            None
        );
        assert_eq!(weighted_sum((1, 1), &[([2.0; 3], &one)]), Some(image(2.0)));
        assert_eq!(weighted_sum((1, 2), &[([2.0; 3], &one)]), None);
        assert_eq!(weighted_sum((1, 1), &[]), Some(image(0.0)));
    }

    #[test]
    fn a_setting_is_found_in_other_sources() {
        let (a, b) = (white(&[(1, 2.0)]), white(&[(2, 3.0)]));
        let red = lit(&[(3, [5.0, 0.0, 0.0])]);
        let sources = [a, b, red];
        let target = lit(&[(1, [1.0; 3]), (2, [-3.0; 3]), (3, [1.25, 0.0, 0.0])]);
        let pink = lit(&[(3, [1.0, 0.5, 0.5])]);
        let found = settings(&sources, &[&target, &pink]);
        // Matrix kernels differ in the last bit by processor and build.
        let near = |found: &Option<Vec<f64>>, wanted: &[f64]| {
            let found = found.as_ref().unwrap();
            let off = found.iter().zip(wanted).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 4.0 * f64::EPSILON, "{found:?}");
        };
        near(&found[0], &[0.5, -1.0, 0.25]);
        assert_eq!(found[1], None);
        let joined = [white(&[(1, 2.0), (2, 3.0)])];
        let uneven = white(&[(1, 2.0), (2, 2.0)]);
        let even = white(&[(1, 0.2), (2, 0.3)]);
        let found = settings(&joined, &[&even, &uneven]);
        near(&found[0], &[0.1]);
        assert_eq!(found[1], None);
    }
}
