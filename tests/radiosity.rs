//! G against closed forms and reference pictures.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "test")]

mod reference;

use footlight::picture::Image;
use reference::{cornell, counted, errors, furnace, picture, render, stage};

#[test]
fn furnace_is_two_everywhere() {
    for quality in [1, 2, 3] {
        let image = &render(&furnace(), quality, &[vec![1.0; 6]], 2)[0];
        for value in image.data() {
            assert!((value - 2.0).abs() < 0.02, "quality {quality}: {value}");
        }
    }
}

/// Pixels without an edge between walls beside them: these references are values at the pixels'
/// centres, ours are means over the pixels.
fn smooth(image: &Image) -> Vec<bool> {
    let (w, h) = (image.width(), image.height());
    let at = |x: usize, y: usize| image.pixel(x.min(w - 1), y.min(h - 1)).unwrap()[0];
    let around = |x: usize, y: usize| {
        let (left, above) = (x.saturating_sub(1), y.saturating_sub(1));
        [
            at(x, y),
            at(left, y),
            at(x + 1, y),
            at(x, above),
            at(x, y + 1),
        ]
    };
    (0..w * h)
        .map(|i| around(i % w, i / w))
        .map(|v| {
            let (low, high) = v
                .iter()
                .fold((f32::MAX, 0.0_f32), |(l, h), x| (l.min(*x), h.max(*x)));
            high < 1.05 * low
        })
        .collect()
}

#[test]
fn single_walls_of_the_furnace() {
    let case = furnace();
    let on = |wall: usize| {
        (0..6)
            .map(|i| f64::from(u8::from(i == wall)))
            .collect::<Vec<f64>>()
    };
    for (quality, most) in [(1, 0.03), (4, 0.01)] {
        let images = render(&case, quality, &[on(0), on(4)], 2);
        for (image, file) in images.iter().zip(["det_xneg.exr", "det_zneg.exr"]) {
            let exact = picture("furnace", file);
            let (error, _) = errors(image, [&exact, &exact], &smooth(&exact));
            assert!(error < most, "quality {quality}, {file}: {error}");
        }
    }
}

#[test]
fn cornell_and_stage_meet_their_references_better_with_quality() {
    for (case, most) in [
        (cornell(), [0.05, 0.03, 0.016]),
        (stage(), [0.03, 0.02, 0.015]),
    ] {
        let halves = ["mix_A.exr", "mix_B.exr"].map(|f| picture(case.name, f));
        let counted = counted(&case, &halves[0]);
        let mut last = f64::INFINITY;
        for (quality, most) in (1..).zip(most) {
            let image = &render(&case, quality, std::slice::from_ref(&case.mix), 2)[0];
            let (plain, fair) = errors(image, [&halves[0], &halves[1]], &counted);
            assert!(
                plain < most,
                "{} at quality {quality}: {plain} ({fair})",
                case.name
            );
            assert!(
                fair <= last * 1.02,
                "{} at quality {quality}: {fair} after {last}",
                case.name
            );
            last = fair;
        }
    }
}
