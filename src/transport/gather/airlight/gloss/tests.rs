#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use crate::direct::beam::Beam;
use crate::gather::airlight::tests::{haze, with_air};
use footlight_show::geometry::vec3;
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::Gloss;
use std::f64::consts::FRAC_PI_2;

/// Rays over the whole beam as the place sees it, weighted by the lobe: by the angle along the
/// axis and the angle across.
fn by_rays(air: &Airlight<'_>, beam: &Beam, place: &GlossyPlace<'_>) -> f64 {
    let emitter = Emitter::Point(beam, None);
    let to = beam.position - place.point;
    let middle = -to.dot(beam.axis);
    let across = to + beam.axis * middle;
    let h = across.length();
    let across = across * (1.0 / h);
    let aside = across.cross(beam.axis);
    let first = (-middle / h).atan();
    let [along, wide] = [400, 20];
    let step = (FRAC_PI_2 - first) / along as f64;
    let of = |k: usize| {
        let u = first + (k as f64 + 0.5) * step;
        let (s, distance) = (middle + h * u.tan(), h / u.cos());
        let reach = (1.1 * s * beam.reach().tan() / distance).min(1.0).asin();
        let width = 2.0 * reach / wide as f64;
        let ray = |j: usize| {
            let v = (j as f64 + 0.5) * width - reach;
            let inward = across * u.cos() + beam.axis * u.sin();
            let way = inward * v.cos() + aside * v.sin();
            let (eye, length, spread) = (place.point, f64::INFINITY, 1e-6);
            let sight = Sight {
                eye,
                way,
                length,
                spread,
            };
            let cosine = place.normal.dot(way).max(0.0);
            let seen = place.lobe.value(place.normal, place.eye, way) * cosine * v.cos();
            seen * air.radiance(&emitter, &sight, 0.5)
        };
        (0..wide).map(ray).sum::<f64>() * width * step
    };
    (0..along).map(of).sum()
}

/// Lines at right angles to the mirrored direction, which lies across them.
#[test]
fn light_is_finite_where_the_mirrored_direction_lies_across_a_line() {
    let gloss = Gloss {
        roughness: 0.5,
        normal: Rgb([0.04; 3]),
        is_metal: false,
    };
    let lobe = Lobe::new(&gloss, [0.1; 3]).unwrap();
    let normal = vec3(0.0, 0.0, 1.0);
    with_air(haze(1.0 / 20.0, 0.6), &[], |air| {
        for k in 0..200 {
            let [u, v] = crate::gather::sampling::point(k, 3);
            let eye = vec3(u - 0.5, v - 0.5, 0.2 + u).normalized();
            let (mirrored, _) = lobe.mirrored(normal, eye);
            let way = mirrored.cross(vec3(v, 1.0, u)).normalized();
            let aside = mirrored.cross(way).normalized() * (1.0 + 3.0 * v);
            let point = vec3(u, v, 0.0);
            let line = Line::new(&air, point + aside - way, way, 1.0);
            let lines = Lines {
                lamp: point + aside - way,
                axis: way,
                reach: 0.05,
                lines: vec![line],
                apart: 0.0,
            };
            let place = GlossyPlace {
                lobe: &lobe,
                point,
                normal,
                eye,
                share: 1.0,
                end: SurfacePoint { facet: 0, point },
                rays: OnceLock::new(),
            };
            assert!(lines.reflected(&air, &place).is_finite(), "{k}");
        }
    });
}

/// Beams that start above the floor and beams that end on it, seen in the floor's gloss from
/// the house.
#[test]
fn lines_meet_the_mean_over_the_lobe() {
    let beams = [
        (vec3(0.0, 5.2, 0.3), vec3(-1.2, 3.4, 8.5), 9.0),
        (vec3(2.0, 5.2, 0.3), vec3(1.2, 3.4, 8.5), 9.0),
        (vec3(0.0, 4.4, 5.3), vec3(-1.2, -2.0, 0.0), 7.0),
    ];
    let places = [[1.0, 0.0], [-0.4, 4.4], [0.3, 4.0], [-1.0, 4.0], [2.0, 3.0]];
    for roughness in [0.2, 0.5] {
        let gloss = Gloss {
            roughness,
            normal: Rgb([0.04; 3]),
            is_metal: false,
        };
        let lobe = Lobe::new(&gloss, [0.1; 3]).unwrap();
        for (position, aim, field) in beams {
            let beam = Beam::new(&Spot {
                position,
                aim,
                beam: 0.5 * field,
                field,
                intensity: Rgb::WHITE,
            });
            let beam = beam.unwrap();
            let emitter = Emitter::Point(&beam, None);
            let pairs: Vec<(f64, f64)> = with_air(haze(1.0 / 20.0, 0.6), &[], |air| {
                let lines = Lines::of(&air, &emitter, lobe.spread()).unwrap();
                let pair = |[x, y]: [f64; 2]| {
                    let point = vec3(x, y, 0.0);
                    let place = GlossyPlace {
                        lobe: &lobe,
                        point,
                        normal: vec3(0.0, 0.0, 1.0),
                        eye: (vec3(0.0, -11.5, 1.9) - point).normalized(),
                        share: 1.0,
                        end: SurfacePoint { facet: 0, point },
                        rays: OnceLock::new(),
                    };
                    assert_eq!(lines.far(&place), 1.0);
                    (lines.reflected(&air, &place), by_rays(&air, &beam, &place))
                };
                places.map(pair).into()
            });
            for ((own, truth), place) in pairs.into_iter().zip(places) {
                let is_near = (own - truth).abs() <= 0.015 * truth;
                assert!(
                    is_near,
                    "roughness {roughness}, lamp {position:?}, {place:?}: {own} for {truth}"
                );
            }
        }
    }
}
