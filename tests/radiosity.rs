//! G against closed forms and reference pictures.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "test")]

mod reference;

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

#[test]
fn single_walls_of_the_furnace() {
    let case = furnace();
    let on = |wall: usize| {
        (0..6)
            .map(|i| f64::from(u8::from(i == wall)))
            .collect::<Vec<f64>>()
    };
    for (quality, most) in [(1, 0.02), (3, 0.01)] {
        let images = render(&case, quality, &[on(0), on(4)], 2);
        for (image, file) in images.iter().zip(["det_xneg.exr", "det_zneg.exr"]) {
            let exact = picture("furnace", file);
            let (error, _) = errors(image, [&exact, &exact], &vec![true; 128 * 128]);
            assert!(error < most, "quality {quality}, {file}: {error}");
        }
    }
}

#[test]
fn cornell_and_stage_meet_their_references_better_with_quality() {
    for (case, most) in [
        (cornell(), [0.05, 0.03, 0.015, 0.012]),
        (stage(), [0.03, 0.02, 0.015, 0.012]),
    ] {
        let halves = ["mix_A.exr", "mix_B.exr"].map(|f| picture(case.name, f));
        let counted = counted(&case, &halves[0]);
        let mut last = f64::INFINITY;
        for (quality, most) in (1..).zip(most) {
            let image = &render(&case, quality, &[case.mix.clone()], 2)[0];
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
