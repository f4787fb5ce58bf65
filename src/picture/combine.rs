//! Linear combinations and scalar products of images.
//!
//! Every sum runs in a fixed order, so results do not depend on the number of threads.

use super::Image;

/// Channels summed at a time, so that the running sum stays in the first-level cache.
const BLOCK: usize = 4096;

/// The sum of `weight * image` over `terms`, in the size `like` (width, height); terms of another
/// size or of weight zero are skipped. Uses up to `threads` threads.
pub fn combine(like: (usize, usize), terms: &[(f64, &Image)], threads: usize) -> Image {
    let mut out = Image::new(like.0, like.1);
    add(&mut out, terms, threads);
    out
}

/// Adds `weight * image` over `terms` to an image. The result equals [`combine`] of all terms in
/// sequence; terms are skipped as there.
pub fn add(sum: &mut Image, terms: &[(f64, &Image)], threads: usize) {
    let like = sum.size();
    let terms: Vec<(f32, &[f32])> = terms
        .iter()
        .filter(|(weight, image)| *weight != 0.0 && image.size() == like)
        .map(|(weight, image)| (*weight as f32, image.data()))
        .collect();
    let terms = &terms;
    in_parts(sum.data_mut(), BLOCK, threads, |sums, start| {
        sum_blocks(sums, start, terms);
    });
}

/// `fine + by * (fine - cheap)`: extrapolates from two qualities of one image. Channels missing in
/// `cheap` stay unchanged.
pub fn extrapolate(fine: &Image, cheap: &Image, by: f64, threads: usize) -> Image {
    let mut out = fine.clone();
    let (by, cheap) = (by as f32, cheap.data());
    in_parts(out.data_mut(), BLOCK, threads, |part, start| {
        let cheap = cheap.get(start..).unwrap_or_default();
        for (fine, cheap) in part.iter_mut().zip(cheap) {
            *fine += by * (*fine - cheap);
        }
    });
    out
}

/// Adds `weight * image` to `image`, with a weight for each channel; the terms are summed in double
/// precision, added and rounded once. Terms of another size are skipped. Uses up to `threads`
/// threads.
pub fn add_coloured(image: &mut Image, terms: &[([f64; 3], &Image)], threads: usize) {
    let like = image.size();
    let terms: Vec<&([f64; 3], &Image)> = terms
        .iter()
        .filter(|(w, term)| *w != [0.0; 3] && term.size() == like)
        .collect();
    if terms.is_empty() {
        return;
    }
    let terms = &terms;
    in_parts(image.data_mut(), BLOCK * 3, threads, |sums, start| {
        let mut exact = vec![0.0_f64; sums.len().min(BLOCK * 3)];
        for (block, sums) in sums.chunks_mut(BLOCK * 3).enumerate() {
            let start = start + block * BLOCK * 3;
            exact.fill(0.0);
            for (weight, term) in terms {
                let data = term
                    .data()
                    .get(start..start + sums.len())
                    .unwrap_or_default();
                for (to, from) in exact.chunks_exact_mut(3).zip(data.chunks_exact(3)) {
                    for ((to, from), w) in to.iter_mut().zip(from).zip(weight) {
                        *to += w * f64::from(*from);
                    }
                }
            }
            for (sum, exact) in sums.iter_mut().zip(&exact) {
                *sum = (f64::from(*sum) + exact) as f32;
            }
        }
    });
}

/// Divides `data` into parts, one per thread, each with its start; all but the last are multiples
/// of `unit`.
fn in_parts(
    data: &mut [f32],
    unit: usize,
    threads: usize,
    task: impl Fn(&mut [f32], usize) + Sync,
) {
    let share = data
        .len()
        .div_ceil(threads.max(1))
        .next_multiple_of(unit)
        .max(unit);
    std::thread::scope(|scope| {
        let task = &task;
        for (part, own) in data.chunks_mut(share).enumerate() {
            if threads > 1 {
                scope.spawn(move || task(own, part * share));
            } else {
                task(own, part * share);
            }
        }
    });
}

/// Adds the terms' channels from `start` on to `sums`, block by block.
fn sum_blocks<'a>(sums: &mut [f32], start: usize, terms: &[(f32, &'a [f32])]) {
    for (block, sums) in sums.chunks_mut(BLOCK).enumerate() {
        let start = start + block * BLOCK;
        let own = start..start + sums.len();
        let part = |data: &'a [f32]| data.get(own.clone()).unwrap_or_default();
        let (fours, rest) = terms.as_chunks();
        for [a, b, c, d] in fours {
            // Four terms in order, with one read and one write of the sum.
            let parts = part(a.1)
                .iter()
                .zip(part(b.1))
                .zip(part(c.1))
                .zip(part(d.1));
            for (sum, (((p, q), r), s)) in sums.iter_mut().zip(parts) {
                *sum = *sum + a.0 * p + b.0 * q + c.0 * r + d.0 * s;
            }
        }
        for (weight, data) in rest {
            for (sum, value) in sums.iter_mut().zip(part(data)) {
                *sum += weight * value;
            }
        }
    }
}

/// The scalar product over all pixels and channels, in double precision; the shorter image ends it.
pub fn dot(a: &Image, b: &Image) -> f64 {
    let mut lanes = [0.0_f64; 8];
    let (a, b) = (a.data().chunks_exact(8), b.data().chunks_exact(8));
    let rest: f64 = (a.remainder().iter().zip(b.remainder()))
        .map(|(x, y)| f64::from(*x) * f64::from(*y))
        .sum();
    for (x, y) in a.zip(b) {
        for ((lane, x), y) in lanes.iter_mut().zip(x).zip(y) {
            *lane += f64::from(*x) * f64::from(*y);
        }
    }
    lanes.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(scale: f32) -> Image {
        let data = (0..97 * 61 * 3)
            .map(|i| scale * (i % 1013) as f32)
            .collect();
        Image::from_data(97, 61, data).unwrap()
    }

    #[test]
    fn a_combination_is_the_sum_with_any_number_of_threads() {
        let (a, b) = (ramp(1.0), ramp(-0.25));
        let one = combine((97, 61), &[(2.0, &a), (4.0, &b), (0.0, &a)], 1);
        for threads in [2, 3, 64] {
            assert_eq!(one, combine((97, 61), &[(2.0, &a), (4.0, &b)], threads));
        }
        for (sum, x) in one.data().iter().zip(a.data()) {
            assert_eq!(*sum, *x);
        }
    }

    /// Several terms at a time give the result of adding them one by one.
    #[test]
    fn sums_run_in_the_order_of_the_terms() {
        let images: Vec<Image> = (0..11).map(|i| ramp(0.1 + 0.37 * i as f32)).collect();
        let weight = |i: usize| f64::from(i as f32 * 0.713 - 3.1);
        for count in 1..=11 {
            let terms: Vec<(f64, &Image)> = (0..count).map(|i| (weight(i), &images[i])).collect();
            let mut slow = Image::new(97, 61);
            for (w, image) in &terms {
                for (sum, v) in slow.data_mut().iter_mut().zip(image.data()) {
                    *sum += *w as f32 * v;
                }
            }
            assert_eq!(combine((97, 61), &terms, 1), slow, "{count}");
        }
    }

    #[test]
    fn a_sum_goes_on_where_it_ended() {
        let images: Vec<Image> = (0..7).map(|i| ramp(0.1 + 0.37 * i as f32)).collect();
        let terms: Vec<(f64, &Image)> = images.iter().map(|i| (0.713, i)).collect();
        let whole = combine((97, 61), &terms, 1);
        for at in 0..=7 {
            let mut sum = combine((97, 61), &terms[..at], 2);
            add(&mut sum, &terms[at..], 3);
            assert_eq!(sum, whole, "{at}");
        }
    }

    #[test]
    fn two_qualities_point_beyond_the_finer_one() {
        let (fine, cheap) = (ramp(2.0), ramp(3.0));
        for threads in [1, 2, 64] {
            assert_eq!(extrapolate(&fine, &cheap, 0.5, threads), ramp(1.5));
            assert_eq!(extrapolate(&fine, &cheap, 0.0, threads), fine);
        }
        assert_eq!(extrapolate(&fine, &Image::new(1, 1), 0.0, 1), fine);
    }

    #[test]
    fn coloured_terms_are_added_channel_by_channel() {
        let (a, b) = (ramp(1.0), ramp(-0.25));
        let mut one = ramp(2.0);
        let terms = [
            ([1.0, 0.0, -1.0], &a),
            ([0.0, 4.0, 0.0], &b),
            ([0.0; 3], &a),
        ];
        add_coloured(&mut one, &terms, 1);
        for (i, (sum, x)) in one.data().iter().zip(a.data()).enumerate() {
            assert_eq!(*sum, [3.0, 1.0, 1.0][i % 3] * x);
        }
        for threads in [2, 3, 64] {
            let mut other = ramp(2.0);
            add_coloured(&mut other, &terms, threads);
            assert_eq!(one, other);
        }
        add_coloured(&mut one, &[([1.0; 3], &Image::new(1, 1))], 1);
        assert_eq!(one.pixel(1, 0), Some([9.0, 4.0, 5.0]));
    }

    #[test]
    fn dot_matches_the_closed_form() {
        let n = 97 * 61 * 3;
        let expected: f64 = (0..n).map(|i| f64::from(i % 1013).powi(2)).sum();
        assert_eq!(dot(&ramp(1.0), &ramp(1.0)), expected);
    }
}
