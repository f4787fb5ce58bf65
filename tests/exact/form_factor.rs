//! Every form factor of `viewfactors.json`, by direct light from an emitter and, where a light can
//! reach only one of the two, by reflection from a lit surface.

use crate::meter::{
    GREY, INWARD, Meter, Room, aside, assert_better, both_ends, contour, level, mean, qualities,
    upright, worst,
};
use footlight_show::geometry::{Vec3, newell, vec3};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

const UP: Vec3 = vec3(0.0, 0.0, 1.0);

/// The exact value of the case whose name starts with these words.
fn exact(case: &str) -> f64 {
    let list: Vec<BTreeMap<String, serde_json::Value>> =
        serde_json::from_str(include_str!("viewfactors.json")).unwrap();
    let found = list
        .iter()
        .find(|e| e["case"].as_str().unwrap().starts_with(case));
    found.unwrap_or_else(|| panic!("no case {case}"))["value"]
        .as_str()
        .unwrap()
        .parse()
        .unwrap()
}

/// A unit square that shares an edge with the floor's, at this angle to it.
fn hinged(degrees: f64) -> Vec<Vec3> {
    let (s, c) = degrees.to_radians().sin_cos();
    vec![
        vec3(0.0, 1.0, 0.0),
        vec3(c, 1.0, s),
        vec3(c, 0.0, s),
        vec3(0.0, 0.0, 0.0),
    ]
}

/// A regular polygon about the Z axis at height z, looking up or down.
fn regular(sides: usize, radius: f64, z: f64, up: bool) -> Vec<Vec3> {
    let angle = |i: usize| TAU * (i as f64 + 0.5) / sides as f64 * if up { 1.0 } else { -1.0 };
    (0..sides)
        .map(|i| vec3(radius * angle(i).cos(), radius * angle(i).sin(), z))
        .collect()
}

fn moved(vertices: &[Vec3], by: Vec3) -> Vec<Vec3> {
    vertices.iter().map(|v| *v + by).collect()
}

/// Form factor from the meter's area to an emitter.
fn to_emitter(emitter: &[Vec<Vec3>], receiver: &[Vec3], meter: &Meter, quality: u8) -> f64 {
    let mut room = Room::default();
    room.wall(receiver, 1.0);
    room.panel(emitter, 1.0 / PI);
    room.mean(meter, 1.0, quality)
}

/// A pair of polygons: from the first, measured by `meter`, to the second.
struct Pair {
    case: &'static str,
    receiver: Vec<Vec3>,
    emitter: Vec<Vec3>,
    meter: Meter,
    /// Direction of a distant light that reaches the whole emitter.
    light: Vec3,
}

/// All finite pairs of polygons; the receiver is the file's first.
fn pairs() -> Vec<Pair> {
    let unit = level([0.0, 1.0], [0.0, 1.0], 0.0, true);
    let square =
        |distance: f64| Meter::new(vec3(0.5, 0.5, 0.0), UP, 1.0 / 32.0, [32, 32], distance);
    let hinge = |case, degrees: f64| Pair {
        case,
        receiver: unit.clone(),
        emitter: hinged(degrees),
        meter: square(0.25),
        light: if degrees < 90.0 {
            // Along the bisector of the open side, towards the hinge.
            let half = (degrees * 0.5).to_radians();
            vec3(-half.cos(), 0.0, -half.sin())
        } else {
            vec3(-1.0, 0.0, -0.01)
        },
    };
    vec![
        Pair {
            case: "parallel unit squares",
            receiver: unit.clone(),
            emitter: level([0.0, 1.0], [0.0, 1.0], 1.0, false),
            meter: square(0.5),
            light: vec3(1.0, 0.0, 0.4),
        },
        Pair {
            case: "perpendicular unit squares",
            receiver: unit.clone(),
            emitter: aside(0.0, [0.0, 1.0], [0.0, 1.0], true),
            meter: square(0.5),
            light: vec3(-1.0, 0.0, -0.01),
        },
        Pair {
            case: "1 parallel opposed",
            receiver: level([0.0, 2.0], [0.0, 1.0], 0.0, true),
            emitter: level([0.0, 2.0], [0.0, 1.0], 0.5, false),
            meter: Meter::new(vec3(1.0, 0.5, 0.0), UP, 1.0 / 32.0, [64, 32], 0.25),
            light: vec3(0.0, 1.0, 0.4),
        },
        Pair {
            case: "2 perpendicular rectangles",
            receiver: level([0.0, 1.0], [0.0, 2.0], 0.0, true),
            emitter: aside(0.0, [0.0, 2.0], [0.0, 3.0], true),
            meter: Meter::new(vec3(0.5, 1.0, 0.0), UP, 1.0 / 32.0, [32, 64], 0.5),
            light: vec3(-1.0, 0.0, -0.01),
        },
        Pair {
            case: "4 unequal offset",
            receiver: level([0.0, 2.0], [0.0, 1.0], 0.0, true),
            emitter: level([1.0, 1.5], [0.5, 2.0], 1.5, false),
            meter: Meter::new(vec3(1.0, 0.5, 0.0), UP, 1.0 / 16.0, [32, 16], 0.5),
            light: vec3(0.0, -1.0, 0.4),
        },
        Pair {
            case: "5 perpendicular rectangles",
            receiver: level([1.0, 2.0], [0.0, 1.0], 0.0, true),
            emitter: aside(0.0, [0.5, 2.5], [0.5, 2.0], true),
            meter: Meter::new(vec3(1.5, 0.5, 0.0), UP, 1.0 / 16.0, [16, 16], 0.5),
            light: vec3(-1.0, 0.0, -0.01),
        },
        hinge("14 unit squares hinged at an edge, included angle 60", 60.0),
        hinge("14 unit squares hinged at an edge, included angle 45", 45.0),
        hinge(
            "14 unit squares hinged at an edge, included angle 135",
            135.0,
        ),
    ]
}

#[test]
#[ignore = "slow"]
fn finite_to_finite_by_direct_light() {
    let steps = both_ends();
    let mut squares = [0.0; 2];
    let pairs = pairs();
    for pair in &pairs {
        let emitter = [pair.emitter.clone()];
        let error = |quality| {
            let got = to_emitter(&emitter, &pair.receiver, &pair.meter, quality);
            got / exact(pair.case) - 1.0
        };
        let errors = steps.map(error);
        println!("{}: {errors:.6?}", pair.case);
        assert!(errors[1].abs() < 1e-3, "{}", pair.case);
        for (sum, e) in squares.iter_mut().zip(&errors) {
            *sum += e * e / pairs.len() as f64;
        }
    }
    let root = squares.map(f64::sqrt);
    assert_better("direct, root mean square", &root, 1e-3);
}

/// The second surface is lit from afar, the first nearly black: the increase at the first over a
/// black second surface comes through form factors.
#[test]
#[ignore = "slow"]
fn finite_to_finite_by_reflected_light() {
    const RHO: f64 = 0.5;
    let steps = both_ends();
    let mut squares = [0.0; 2];
    let pairs = pairs();
    for pair in &pairs {
        let room = |reflectance| {
            let mut room = Room::default();
            room.wall(&pair.receiver, GREY);
            room.wall(&pair.emitter, reflectance);
            let middle = pair
                .emitter
                .iter()
                .fold(Vec3::ZERO, |sum, v| sum + *v * 0.25);
            room.sun(middle, pair.light, 1.0);
            room
        };
        let normal = newell(&pair.emitter).normalized();
        let level = -RHO * normal.dot(pair.light.normalized());
        assert!(level > 0.1, "{}", pair.case);
        // Distant light is uniform on the receiver, so any step is exact.
        let unlit = room(0.0).mean(&pair.meter, GREY, 1);
        let error = |quality| {
            let lit = room(RHO).mean(&pair.meter, GREY, quality);
            (lit - unlit) / level / exact(pair.case) - 1.0
        };
        let errors = steps.map(error);
        println!("{}, reflected: {errors:.5?}", pair.case);
        for (sum, e) in squares.iter_mut().zip(&errors) {
            *sum += e * e / pairs.len() as f64;
        }
    }
    let root = squares.map(f64::sqrt);
    assert_better("reflected, root mean square", &root, 5e-3);
}

#[test]
fn elements_to_polygons() {
    let spot = level([-0.01, 0.01], [-0.01, 0.01], 0.0, true);
    let meter = Meter::new(Vec3::ZERO, UP, 1e-4, [1, 1], 1e-3);
    let triangle = vec![
        vec3(1.0, -0.5, 0.5),
        vec3(0.5, 1.5, 1.0),
        vec3(-0.75, 0.25, 2.0),
    ];
    let mut back = triangle.clone();
    back.reverse();
    let parallel = level([0.0, 1.0], [0.0, 2.0], 1.5, false);
    // c = 1.5 away along x, a = 1 high, b = 2 wide with a corner on the x axis.
    let across = aside(-1.5, [0.0, 2.0], [0.0, 1.0], true);
    for (case, emitter) in [
        ("6 ", parallel),
        ("7 ", across),
        ("10 ", triangle),
        ("10 ", back),
    ] {
        let faces = newell(&emitter).dot(-emitter[0]) > 0.0;
        for quality in both_ends() {
            let got = to_emitter(std::slice::from_ref(&emitter), &spot, &meter, quality);
            let expected = if faces { exact(case) } else { 0.0 };
            assert!(
                (got - expected).abs() < 1e-5 * exact(case),
                "{case}: {got} {expected}"
            );
        }
    }
}

/// Discs as regular polygons: separates the operator's error from that of the polygon, which falls
/// with the square of the number of sides.
#[test]
fn discs_by_polygons() {
    let spot = level([-0.01, 0.01], [-0.01, 0.01], 0.0, true);
    let meter = Meter::new(Vec3::ZERO, UP, 1e-4, [1, 1], 1e-3);
    for (case, radius, aside) in [("8 ", 1.0, 1.5), ("9 ", 0.5, 0.0)] {
        let mut last = f64::INFINITY;
        for sides in [16, 32, 64] {
            let disc = moved(&regular(sides, radius, 1.0, false), vec3(aside, 0.0, 0.0));
            let inner = contour(&disc);
            let polygon = (inner / exact(case) - 1.0).abs();
            assert!(polygon < 0.3 * last, "{case}: {polygon} after {last}");
            last = polygon;
            for quality in both_ends() {
                let got = to_emitter(std::slice::from_ref(&disc), &spot, &meter, quality);
                assert!(
                    (got / inner - 1.0).abs() < 1e-5,
                    "{case}, {sides}: {got} {inner}"
                );
            }
        }
        assert!(last < 2.5e-3, "{case}: 64 sides leave {last}");
    }
}

/// From disc to disc: from the polygon of the smaller to that of the larger.
#[test]
#[ignore = "slow"]
fn disc_to_disc() {
    let ratio = 0.25; // of the areas: F12 = F21 A2 / A1
    let error = |sides: usize, quality| {
        let small = regular(sides, 0.5, 0.0, true);
        let large = regular(sides, 1.0, 2.0, false);
        let meter = Meter::new(Vec3::ZERO, UP, 1.0 / 32.0, [32, 32], 1.0);
        let mut room = Room::default();
        room.wall(&small, 1.0);
        room.panel(&[large], 1.0 / PI);
        let all = room.illuminances(&meter, 1.0, quality);
        // The void around the disc shows nothing; means are over the disc.
        let area = 0.125 * sides as f64 * (TAU / sides as f64).sin();
        let f21 = all.iter().sum::<f64>() / (32.0 * 32.0) / area;
        (f21 * ratio / exact("3 ") - 1.0).abs()
    };
    let finest = *qualities().end();
    let errors = [16, 32, 64].map(|sides| error(sides, finest));
    println!("disc to disc by 16, 32, 64 sides: {errors:.6?}");
    assert!(
        errors[1] < 0.3 * errors[0] && errors[2] < 2e-3,
        "{errors:?}"
    );
}

/// A sphere of triangles: a subdivided octahedron, its points on the sphere.
pub fn sphere(centre: Vec3, radius: f64, divisions: usize) -> Vec<Vec<Vec3>> {
    let signs = [1.0, -1.0];
    let mut out = Vec::new();
    let n = divisions as f64;
    for (sx, sy, sz) in signs
        .iter()
        .flat_map(|x| signs.iter().map(move |y| (*x, *y)))
        .flat_map(|(x, y)| signs.iter().map(move |z| (x, y, *z)))
    {
        let at = |i: usize, j: usize| {
            let (a, b) = (i as f64 / n, j as f64 / n);
            centre + vec3(sx * a, sy * b, sz * (1.0 - a - b)).normalized() * radius
        };
        let mut add = |a: Vec3, b: Vec3, c: Vec3| {
            let outward = sx * sy * sz > 0.0;
            out.push(if outward {
                vec![a, b, c]
            } else {
                vec![a, c, b]
            });
        };
        for i in 0..divisions {
            for j in 0..divisions - i {
                add(at(i, j), at(i + 1, j), at(i, j + 1));
                if i + j + 2 <= divisions {
                    add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                }
            }
        }
    }
    out
}

#[test]
#[ignore = "slow"]
pub fn spheres_by_triangles() {
    let spot = level([-0.01, 0.01], [-0.01, 0.01], 0.0, true);
    let point = Meter::new(Vec3::ZERO, UP, 1e-4, [1, 1], 1e-3);
    let (s, c) = 40.0_f64.to_radians().sin_cos();
    let finest = *qualities().end();
    let rectangle = level([0.0, 1.0], [0.0, 2.0], 0.0, true);
    let over = Meter::new(vec3(0.5, 1.0, 0.0), UP, 1.0 / 4.0, [4, 8], 0.5);
    let disc = regular(64, 1.0, 0.0, true);
    let round = Meter::new(Vec3::ZERO, UP, 1.0 / 4.0, [8, 8], 0.5);
    let errors = [3, 6].map(|n| {
        let one = sphere(vec3(2.5 * s, 0.0, 2.5 * c), 1.0, n);
        let element = to_emitter(&one, &spot, &point, finest) / exact("13 ");
        // F from sphere to surface = mean F back x area / (4 pi r2).
        let small = sphere(vec3(0.0, 0.0, 1.5), 0.5, n);
        let back = to_emitter(&small, &rectangle, &over, finest);
        let onto = back * 2.0 / PI / exact("11 ");
        let back = to_emitter(&small, &disc, &round, finest) * 4.0;
        let coaxial = back / PI / exact("12 ");
        [element, onto, coaxial].map(|x| 1.0 - x)
    });
    println!("spheres of 72 and 288 triangles fall short by {errors:.5?}");
    for (coarse, fine) in errors[0].iter().zip(&errors[1]) {
        // An inscribed polyhedron is smaller; the area of its shadow is too small by the square.
        assert!(
            *coarse > 0.0 && *fine > 0.0 && *fine < 0.3 * coarse,
            "{errors:?}"
        );
        assert!(*fine < 0.03, "{errors:?}");
    }
}

/// Reciprocity A_i F_ij = A_j F_ji of direct light.
#[test]
fn reciprocity() {
    let small = level([0.3, 0.7], [0.2, 0.9], 0.0, true);
    let large = aside(-0.5, [-1.0, 2.0], [0.0, 2.0], true);
    let over_small = Meter::new(vec3(0.5, 0.55, 0.0), UP, 0.05, [8, 14], 0.5);
    let over_large = Meter::new(vec3(-0.5, 0.5, 1.0), INWARD[0], 0.0625, [48, 32], 0.5);
    let finest = *qualities().end();
    let there = 0.28 * to_emitter(std::slice::from_ref(&large), &small, &over_small, finest);
    let back = 6.0 * to_emitter(&[small], &large, &over_large, finest);
    assert!((there / back - 1.0).abs() < 1e-3, "{there} {back}");
}

/// Rows of a closed room sum to one: a point gets as much from all walls as from a full hemisphere.
#[test]
fn closure() {
    let walls = crate::meter::cuboid(Vec3::ZERO, vec3(3.0, 2.0, 1.0), true);
    for (x, y) in [(0.1, 0.1), (1.5, 1.0), (2.9, 0.4)] {
        let mut room = Room::default();
        room.wall(&walls[4], GREY);
        for i in [0, 1, 2, 3, 5] {
            room.panel(std::slice::from_ref(&walls[i]), 1.0 / PI);
        }
        for quality in both_ends() {
            let sum = room.mean(&Meter::point(vec3(x, y, 0.0), UP), GREY, quality);
            assert!((sum - 1.0).abs() < 1e-5, "{x} {y}: {sum}");
        }
    }
}

/// The test helpers agree with each other.
#[test]
fn the_meter_measures_where_it_says() {
    let emitter = upright([-0.4, 0.3], -0.7, [0.5, 0.9], true);
    let floor = level([-1.0, 1.0], [-1.0, 1.0], 0.0, true);
    let meter = Meter::new(vec3(0.1, 0.2, 0.0), UP, 0.01, [2, 3], 0.3);
    let mut room = Room::default();
    room.wall(&floor, 1.0);
    room.panel(std::slice::from_ref(&emitter), 1.0 / PI);
    let got = room.illuminances(&meter, 1.0, 1);
    let expected: Vec<f64> = (0..6)
        .map(|i| contour(&moved(&emitter, -meter.at(i % 2, i / 2))))
        .collect();
    assert!(
        worst(&got, &expected) < 1e-3 && mean(&got) > 0.01,
        "{got:?} {expected:?}"
    );
}
