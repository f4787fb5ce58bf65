//! G is one linear operator at each quality: light adds and scales with any sign, the bits do not
//! depend on threads or other settings, and the order of sources does not matter.

use crate::reference::{Case, cornell, furnace, render, stage, tavern};
use footlight_picture::Image;
use footlight_show::geometry::mount::Mount;
use footlight_show::geometry::vec3;
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::gobo::Gobo;
use footlight_stage::{Emitter, Light, Projection, Source};
use std::sync::Arc;

/// The case at a size small enough to render fifteen times.
fn small(mut case: Case, [width, height]: [usize; 2]) -> Case {
    (case.view.width, case.view.height) = (width, height);
    case
}

/// The stage at a small size, with a spot in its second bank, through a coloured filter.
pub fn stage_with_spot(size: [usize; 2]) -> Case {
    let mut case = small(stage(), size);
    case.rig.lights.push(Light::Spot(Spot {
        position: vec3(-4.0, -6.0, 6.0),
        aim: vec3(1.0, 1.0, 0.0),
        beam: 18.0,
        field: 30.0,
        intensity: Rgb([900.0, 700.0, 400.0]),
    }));
    let light = case.rig.lights.len() - 1;
    let filter = Rgb([0.9, 0.2, 0.5]);
    case.rig.sources[1].emitters.push(Emitter { light, filter });
    case
}

/// That stage with a coloured slide on the floor; red, green and blue are sources.
fn stage_with_slide(size: [usize; 2]) -> Case {
    let mut case = stage_with_spot(size);
    let data = (0..64).flat_map(|i| [(i % 8) as f32 / 80.0, (i / 8) as f32 / 8.0, 1.0]);
    let image = Image::from_data(8, 8, data.collect()).unwrap();
    let slide = Arc::new(Gobo::new(image).unwrap());
    let first = case.rig.lights.len();
    for plane in 0..3 {
        let mut intensity = Rgb::default();
        intensity.0[plane] = 5000.0;
        case.rig.lights.push(Light::Projection(Projection {
            mount: Mount {
                position: vec3(-3.0, -7.0, 6.0),
                aim: vec3(0.0, 2.0, 0.5),
                turn: 10.0,
            },
            field: 40.0,
            gobo: slide.clone(),
            plane,
            intensity,
        }));
    }
    for plane in 0..3 {
        let mut filter = Rgb::default();
        filter.0[plane] = 1.0;
        let emitter = |light| Emitter { light, filter };
        case.rig.sources.push(Source {
            name: format!("slide.{plane}"),
            emitters: (first..first + 3).map(emitter).collect(),
        });
    }
    case
}

/// Numbers of both signs over five decades, some of them zero.
fn mixed(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    (0..n)
        .map(|_| {
            let (kind, size, sign) = (next(), next(), next());
            let size = 10.0_f64.powf(5.0 * size - 3.0);
            if kind < 0.1 {
                0.0
            } else {
                size.copysign(sign - 0.5)
            }
        })
        .collect()
}

fn bits(image: &Image) -> Vec<u32> {
    image.data().iter().map(|x| x.to_bits()).collect()
}

fn peak(image: &Image) -> f64 {
    image
        .data()
        .iter()
        .fold(0.0, |most: f64, x| most.max(f64::from(x.abs())))
}

/// max |G(sum c_i e_i) - sum c_i G e_i| relative to sum |c_i| max |G e_i|.
fn nonlinearity(mix: &[f64], together: &Image, alone: &[Image]) -> f64 {
    let allowed: f64 =
        mix.iter().map(|c| c.abs()).sum::<f64>() * alone.iter().map(peak).fold(0.0, f64::max);
    let off = together.data().iter().enumerate().map(|(at, x)| {
        let sum: f64 = mix
            .iter()
            .zip(alone)
            .map(|(c, i)| c * f64::from(i.data()[at]))
            .sum();
        (sum - f64::from(*x)).abs()
    });
    off.fold(0.0, f64::max) / allowed
}

fn assert_linear(case: &Case, steps: &[u8]) {
    let n = case.rig.sources.len();
    let mut settings: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect())
        .collect();
    settings.extend((1..=3).map(|seed| mixed(n, seed)));
    for &quality in steps {
        let images = render(case, quality, &settings, 2);
        let (alone, mixes) = images.split_at(n);
        for (mix, together) in settings[n..].iter().zip(mixes) {
            let off = nonlinearity(mix, together, alone);
            println!("{} at quality {quality}: {off:.1e}", case.name);
            assert!(off < 1e-6, "{} at quality {quality}: {off}", case.name);
        }
        // Another operator, another number of threads, one setting per call: equal bits.
        let threads = if quality % 2 == 0 { 1 } else { 3 };
        let last = render(case, quality, &settings[n + 2..], threads);
        let same = bits(&last[0]) == bits(&images[n + 2]);
        assert!(
            same,
            "{} at quality {quality} on {threads} threads",
            case.name
        );
    }
}

#[test]
fn cornell_is_linear() {
    assert_linear(&small(cornell(), [24, 24]), &[1]);
}

#[test]
#[ignore = "slow"]
fn stage_is_linear() {
    assert_linear(&stage_with_slide([32, 18]), &[2, 3]);
}

/// The accuracy of a slide's plane must not depend on which others are requested with it.
#[test]
fn a_slides_plane_is_the_same_in_any_company() {
    let case = stage_with_slide([96, 54]);
    let n = case.rig.sources.len();
    let unit = |i: usize| {
        (0..n)
            .map(|j| f64::from(u8::from(i == j)))
            .collect::<Vec<_>>()
    };
    let planes: Vec<Vec<f64>> = (n - 3..n).map(unit).collect();
    let together = render(&case, 1, &planes, 2);
    assert!(together.iter().all(|image| peak(image) > 0.0));
    for (plane, image) in planes.iter().zip(&together) {
        let alone = &render(&case, 1, std::slice::from_ref(plane), 2)[0];
        assert!(bits(alone) == bits(image));
    }
}

#[test]
fn furnace_is_linear() {
    assert_linear(&small(furnace(), [16, 16]), &[2]);
}

#[test]
#[ignore = "slow"]
fn tavern_is_linear() {
    assert_linear(&small(tavern(), [32, 18]), &[1]);
}

/// Sources in another order give equal bits; lights in another order are summed in another order,
/// so they are equal to rounding.
#[test]
#[ignore = "slow"]
fn order_does_not_matter() {
    let case = stage_with_spot([32, 18]);
    let n = case.rig.sources.len();
    let setting = mixed(n, 7);
    let mut turned = stage_with_spot([32, 18]);
    turned.rig.sources.reverse();
    let back: Vec<f64> = setting.iter().rev().copied().collect();
    let mut relit = stage_with_spot([32, 18]);
    let last = relit.rig.lights.len() - 1;
    relit.rig.lights.reverse();
    for emitter in relit.rig.sources.iter_mut().flat_map(|s| &mut s.emitters) {
        emitter.light = last - emitter.light;
    }
    for quality in [1, 2] {
        let one = &render(&case, quality, std::slice::from_ref(&setting), 2)[0];
        let other = &render(&turned, quality, std::slice::from_ref(&back), 2)[0];
        assert!(bits(one) == bits(other), "quality {quality}");
        let lights = &render(&relit, quality, std::slice::from_ref(&setting), 2)[0];
        let off = nonlinearity(&[1.0], lights, std::slice::from_ref(one));
        assert!(off < 1e-6, "quality {quality}: {off}");
    }
}
