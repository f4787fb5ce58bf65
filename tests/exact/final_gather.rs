//! Scenes of many polygons, rendered by final gathering: exact answers, independent of the number
//! of polygons.

use crate::meter::{INWARD, Meter, Room, cuboid, mean};
use footlight_host::work::{Silent, Work};
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::units::Rgb;
use footlight_stage::texture::{Alpha, Texture};
use footlight_stage::{Material, Polygon, Shading};
use footlight_transport::radiosity::{MANY_POLYGONS, Radiosity};
use footlight_transport::{Quality, Setup, Transport};
use std::f64::consts::PI;

/// Steps affordable in a test.
const STEPS: [u8; 2] = [1, 2];

/// A face cut into squares, `side` along each edge.
fn cut(face: &[Vec3], side: usize) -> Vec<Vec<Vec3>> {
    let n = side as f64;
    let at = |i: usize, j: usize| {
        let (u, v) = (i as f64 / n, j as f64 / n);
        face[0] + (face[1] - face[0]) * u + (face[3] - face[0]) * v
    };
    let square = |k: usize| {
        let (i, j) = (k % side, k / side);
        vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
    };
    (0..side * side).map(square).collect()
}

/// A hall with boxes of many sizes on its floor, five faces each.
fn cluttered(boxes: usize) -> Vec<Vec<Vec3>> {
    let mut faces: Vec<Vec<Vec3>> = cuboid(Vec3::ZERO, vec3(6.0, 5.0, 3.0), true).to_vec();
    let across = (boxes as f64).sqrt().ceil() as usize;
    for k in 0..boxes {
        let (i, j) = ((k % across) as f64, (k / across) as f64);
        let (pitch, depth) = (6.0 / across as f64, 5.0 / across as f64);
        let low = vec3((i + 0.2) * pitch, (j + 0.2) * depth, 0.0);
        let height = 0.1 + 0.13 * ((7 * k) % 11) as f64;
        let high = low + vec3(0.6 * pitch, 0.6 * depth, height);
        // All faces except the bottom.
        let sides = cuboid(low, high, false).into_iter().enumerate();
        faces.extend(sides.filter(|(i, _)| *i != 4).map(|(_, face)| face));
    }
    faces
}

fn view() -> View {
    View {
        from: vec3(0.3, 0.3, 2.2),
        to: vec3(4.0, 3.5, 0.4),
        fov: 70.0,
        roll: 0.0,
        width: 40,
        height: 30,
    }
}

/// If every surface emits and reflects equally, all show E / (1 - rho), whatever the geometry: no
/// light is lost between boxes, none is created.
#[test]
fn a_cluttered_furnace_is_even() {
    let mut room = Room::default();
    let faces = cluttered(600);
    assert!(faces.len() > MANY_POLYGONS);
    room.emitter(&faces, 1.0, 0.5);
    for quality in STEPS {
        let all = room.radiances(&view(), quality);
        let mean = mean(&all) * 0.5;
        let square = all.iter().map(|l| (l * 0.5 - 1.0).powi(2)).sum::<f64>();
        let spread = (square / all.len() as f64).sqrt();
        println!("quality {quality}: mean {mean:.5}, off {spread:.5}");
        assert!((mean - 1.0).abs() < 5e-3, "quality {quality}: {mean}");
        assert!(spread < 0.05, "quality {quality}: {spread}");
    }
}

/// CIE 171:2006, 5.8, with walls of many polygons: a cube of 4 m with 10,000 lm in its middle, the
/// mean of the reflected illuminance.
#[test]
#[ignore = "slow"]
fn reflections_in_a_cube_of_many_polygons() {
    let middle = vec3(2.0, 2.0, 2.0);
    let flux = 10_000.0;
    for rho in [0.5, 0.9, 0.995] {
        let mut room = Room::default();
        for face in cuboid(Vec3::ZERO, middle * 2.0, true) {
            for square in cut(&face, 21) {
                room.wall(&square, rho);
            }
        }
        assert!(room.scene.polygons.len() > MANY_POLYGONS);
        room.bulb(middle, flux / (4.0 * PI));
        for quality in STEPS {
            let normal = INWARD[4];
            let meter = Meter::new(middle - normal * 2.0, normal, 0.125, [32, 32], 2.0);
            let lit = room.illuminances(&meter, rho, quality);
            let direct = (0..32 * 32).map(|i| {
                let d = meter.at(i % 32, i / 32) - middle;
                flux / (4.0 * PI) * 2.0 / d.dot(d).powf(1.5)
            });
            let reflected = mean(&lit) - mean(&direct.collect::<Vec<_>>());
            let off = reflected / (flux / 96.0 * rho / (1.0 - rho)) - 1.0;
            println!("5.8 of many, {rho}, quality {quality}: {off:.5}");
            assert!(off.abs() < 0.01, "{rho}, quality {quality}: {off}");
        }
    }
}

/// The image of a sum is the sum of images, of any sign; a light's image has equal bits with any
/// other lights and any number of threads.
#[test]
fn many_polygons_are_lit_linearly() {
    let mut room = Room::default();
    for face in cluttered(520) {
        room.wall(&face, 0.6);
    }
    let lamp = |x: f64| {
        vec![
            vec3(x, 2.0, 2.9),
            vec3(x, 2.5, 2.9),
            vec3(x + 0.5, 2.5, 2.9),
            vec3(x + 0.5, 2.0, 2.9),
        ]
    };
    room.panel(&[lamp(1.0)], 300.0);
    room.panel(&[lamp(4.0)], 100.0);
    room.sun(vec3(3.0, 2.5, 0.0), vec3(0.3, 0.2, -1.0), 1000.0);
    assert!(room.scene.polygons.len() > MANY_POLYGONS);
    let setup = Setup::new(room.scene.clone(), room.rig(), view());
    let render = |settings: &[Vec<f64>], threads: usize| {
        let work = Work {
            progress: &Silent,
            threads,
            memory: 1 << 30,
        };
        let mut operator = Radiosity.prepare(&setup, Quality(1), work).unwrap();
        operator.render(settings, work).unwrap()
    };
    let unit = |l: usize| (0..3).map(|i| f64::from(u8::from(i == l))).collect();
    let units: Vec<Vec<f64>> = (0..3).map(unit).collect();
    let alone = render(&units, 2);
    let mix = vec![0.7, -1.3, 2.0];
    let together = &render(std::slice::from_ref(&mix), 1)[0];
    let most = alone
        .iter()
        .flat_map(|image| image.data())
        .fold(0.0_f32, |m, v| m.max(*v));
    for (at, value) in together.data().iter().enumerate() {
        let sum: f64 = mix
            .iter()
            .zip(&alone)
            .map(|(m, a)| m * f64::from(a.data()[at]))
            .sum();
        assert!(
            (sum - f64::from(*value)).abs() < 1e-6 * f64::from(most),
            "{at}"
        );
    }
    for (unit, image) in units.iter().zip(&alone) {
        let again = &render(std::slice::from_ref(unit), 3)[0];
        let same = |(a, b): (&f32, &f32)| a.to_bits() == b.to_bits();
        assert!(again.data().iter().zip(image.data()).all(same));
    }
}

/// A gauze before a wall, both under the sun: half of a pixel is the gauze, the other half the wall
/// in half of the light. No pixel deviates, because nothing is random.
#[test]
fn gauze_shows_itself_and_what_lies_behind() {
    let mut room = Room::default();
    let upright = |y: f64| {
        vec![
            vec3(-9.0, y, -9.0),
            vec3(9.0, y, -9.0),
            vec3(9.0, y, 9.0),
            vec3(-9.0, y, 9.0),
        ]
    };
    room.wall(&upright(4.0), 0.8);
    room.scene.materials.push(Material {
        texture: Some(Texture::plain([0.6, 0.6, 0.6, 0.5], Alpha::Blend)),
        ..Material::diffuse("gauze", Rgb([0.6; 3]))
    });
    let gauze = upright(3.0);
    room.scene.polygons.push(Polygon {
        shading: Some(Box::new(Shading::flat(gauze[0]))),
        ..Polygon::new(gauze, room.scene.materials.len() - 1)
    });
    room.scene.number_sheets();
    let towards = vec3(0.2, 0.9, -0.4);
    room.sun(vec3(0.0, 3.0, 0.0), towards, 1000.0);
    let arrives = 1000.0 * towards.normalized().y;
    let expected = arrives / PI * (0.5 * 0.6 + 0.5 * 0.5 * 0.8);
    let view = View {
        from: vec3(0.0, -3.0, 0.0),
        to: vec3(0.3, 4.0, 0.2),
        fov: 40.0,
        roll: 0.0,
        width: 24,
        height: 16,
    };
    for quality in STEPS {
        let off = |l: &f64| (l / expected - 1.0).abs();
        let most = room
            .radiances(&view, quality)
            .iter()
            .map(off)
            .fold(0.0, f64::max);
        assert!(most < 1e-3, "quality {quality}: {most}");
    }
}

/// The edge of two walls under the sun: a pixel on it is their mean by area.
#[test]
fn a_pixel_on_an_edge_is_the_mean_of_both_sides_by_area() {
    let mut room = Room::default();
    for (left, reflectance) in [(-9.0, 0.9), (0.31, 0.3)] {
        for square in cut(
            &[
                vec3(left, 4.0, -9.0),
                vec3(left + 9.31, 4.0, -9.0),
                vec3(left + 9.31, 4.0, 9.0),
                vec3(left, 4.0, 9.0),
            ],
            40,
        ) {
            room.wall(&square, reflectance);
        }
    }
    assert!(room.scene.polygons.len() > MANY_POLYGONS);
    room.sun(vec3(0.0, 3.0, 0.0), vec3(0.0, 1.0, 0.0), 1000.0);
    // The image is 4 m across at the walls: 16 pixels of 25 cm, so that the edge leaves 24 % of the
    // one from 0.25 to 0.5 m to the left side.
    let view = View {
        from: vec3(0.0, 0.0, 0.0),
        to: vec3(0.0, 4.0, 0.0),
        fov: 2.0 * 0.5_f64.atan().to_degrees(),
        roll: 0.0,
        width: 16,
        height: 16,
    };
    let expected = 1000.0 / PI * (0.24 * 0.9 + 0.76 * 0.3);
    for quality in STEPS {
        let all = room.radiances(&view, quality);
        let of_column =
            |x: usize| mean(&all.iter().skip(x).step_by(16).copied().collect::<Vec<_>>());
        let on_edge = of_column(9);
        assert!(
            (on_edge / expected - 1.0).abs() < 0.01,
            "quality {quality}: {on_edge} for {expected}"
        );
        for (x, reflectance) in [(8, 0.9), (10, 0.3)] {
            let off = of_column(x) / (1000.0 / PI * reflectance) - 1.0;
            assert!(off.abs() < 1e-3, "quality {quality}, column {x}: {off}");
        }
    }
}
