//! Points and pixels with wrong samples: small lamps, slivers, joints, coincident planes, lamps
//! close to a wall.

use crate::indirect::{mesh, scene};
use crate::meter::{GREY, INWARD, Meter, Room, contour, cuboid, mean};
use crate::methods::lamp::Lamp;
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::Light;
use footlight_transport::direct::beam::Beam;
use footlight_transport::hemicube::indirect::hemicube::{FormFactorTable, Hemicube, hash_to_unit};
use footlight_transport::hemicube::raster::VertexBuffer;
use footlight_transport::surfaces::camera::camera;
use footlight_transport::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use footlight_transport::surfaces::surface::{Surfaces, kept_inside};
use std::f64::consts::PI;

/// A rectangle around (0, 0, z) that looks down.
fn lid(width: f64, depth: f64, z: f64) -> Vec<Vec3> {
    let (a, b) = (0.5 * width, 0.5 * depth);
    [(-a, b), (a, b), (a, -b), (-a, -b)]
        .map(|(x, y)| vec3(x, y, z))
        .to_vec()
}

/// Pseudo-random points of the floor.
fn points(count: u64) -> Vec<Vec3> {
    let at = |i: u64| 3.0 * (2.0 * hash_to_unit(i) - 1.0);
    (0..count).map(|i| vec3(at(i), at(i + 7919), 0.0)).collect()
}

/// The exact form factor from a point of the floor.
fn exact(above: &[Vec3], p: Vec3) -> f64 {
    contour(&above.iter().map(|v| *v - p).collect::<Vec<_>>())
}

/// Relative root mean square errors of form factors from 200 points of the floor to a lamp.
fn errors_of_a_lamp([width, depth, height]: [f64; 3], resolution: usize) -> [f64; 2] {
    let lamp = Lamp {
        width,
        depth,
        height,
    };
    let seen = lamp.seen(resolution, 3.0, 200).unwrap();
    [seen.hemicube, seen.ours]
}

#[test]
fn a_small_lamp_is_lost_between_pixels_and_exact_in_closed_form() {
    for (size, resolution, least) in [(0.4, 32, 0.2), (0.05, 64, 1.0)] {
        let [naive, ours] = errors_of_a_lamp([size, size, 5.0], resolution);
        println!("lamp of {size} m at 5 m: hemicube {resolution} {naive:.3}, ours {ours:.1e}");
        assert!(naive > least, "{size}: the naive way errs by {naive} only");
        assert!(ours < 1e-5, "{size}: {ours}");
    }
}

#[test]
fn a_sliver_is_noise_to_pixels_and_exact_if_it_shines() {
    let [naive, ours] = errors_of_a_lamp([1e-3, 1.0, 1.0], 32);
    println!("sliver: hemicube {naive:.3}, ours {ours:.1e}");
    assert!(naive > 1.0, "the naive way errs by {naive} only");
    assert!(ours < 1e-5, "{ours}");
}

/// A point in a joint sees the wall next to it edge on, and loses its light: half of the total.
#[test]
fn a_point_in_a_joint_loses_light_and_is_kept_off_it() {
    let room = cuboid(vec3(-1.0, -1.0, 0.0), vec3(1.0, 1.0, 2.0), true);
    let surfaces = Surfaces::new(&scene(&room)).unwrap();
    let mesh = mesh(&surfaces, 300);
    let (outline, table) = (VertexBuffer::new(&surfaces), FormFactorTable::new(16));
    let setting = SceneGeometry {
        surfaces: &surfaces,
        hierarchy: &Hierarchy::new(&surfaces),
    };
    let mut cube = Hemicube::new(setting, &outline, &mesh, &table);
    let floor = surfaces
        .facets
        .iter()
        .position(|f| f.normal.z > 0.9)
        .unwrap();
    let mut seen = |p: Vec3| -> f64 {
        let row = cube.row(floor, p, 0.3);
        row.iter().map(|r| f64::from(r.1)).sum()
    };
    for off in [0.0, 1e-10] {
        let joint = vec3(1.0 - off, 0.2, 0.0);
        let naive = seen(joint);
        let kept = seen(kept_inside(&surfaces, &surfaces.facets[floor], joint));
        println!("{off:e} from a joint: {naive:.3}, kept off it {kept:.6}");
        assert!(naive < 0.7, "the naive way sees {naive}");
        assert!((kept - 1.0).abs() < 1e-5, "{kept}");
    }
    for element in &mesh.elements {
        let own = &surfaces.facets[element.facet];
        for p in element
            .samples
            .iter()
            .map(|s| s.point)
            .chain([element.centre])
        {
            let heights = surfaces.facets.iter().map(|f| f.height(p).abs());
            let near = heights.filter(|h| *h < 1e-6 * surfaces.size).count();
            assert_eq!(near, 1, "{p:?} of {:?} is in a joint", own.normal);
        }
    }
}

/// Two surfaces in one plane: by depth alone rounding decides between them pixel by pixel; here the
/// smaller one is on top, in any order.
#[test]
fn of_two_surfaces_in_one_plane_rounding_shows_either_and_we_the_smaller() {
    let (large, small) = (lid(4.0, 4.0, 2.0), lid(1.0, 1.0, 2.0));
    let turned = |q: &[Vec3]| -> Vec<Vec3> {
        // A plane on which no coordinate is constant.
        q.iter()
            .map(|v| vec3(v.x, v.y, 2.0 + 0.3 * v.x - 0.17 * v.y))
            .collect()
    };
    let (large, small) = (turned(&large), turned(&small));
    // One over the depth, interpolated from the first three corners in single precision.
    let plane = |q: &[Vec3]| {
        let [a, b, c] = [0, 1, 2].map(|i| {
            let [x, y, w] = [q[i].x / q[i].z, q[i].y / q[i].z, 1.0 / q[i].z];
            [x as f32, y as f32, w as f32]
        });
        let [d, e] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        let twice = d[0] * e[1] - d[1] * e[0];
        let slope = [d[2] * e[1] - d[1] * e[2], d[0] * e[2] - d[2] * e[0]].map(|s| s / twice);
        move |x: f32, y: f32| a[2] + slope[0] * (x - a[0]) + slope[1] * (y - a[1])
    };
    let (behind, on_top) = (plane(&large), plane(&small));
    let places = (0..900).map(|i| [(i % 30) as f32 / 157.0, (i / 30) as f32 / 163.0]);
    let wins = places
        .filter(|[x, y]| on_top(*x, *y) > behind(*x, *y))
        .count();
    println!("of 900 rays {wins} see the smaller one by depth");
    assert!((20..880).contains(&wins), "{wins}");

    let h = 4.0;
    let floor = [(-h, -h), (h, -h), (h, h), (-h, h)]
        .map(|(x, y)| vec3(x, y, 0.0))
        .to_vec();
    for order in [[&large, &small], [&small, &large]] {
        let polygons = [floor.clone(), order[0].clone(), order[1].clone()];
        let surfaces = Surfaces::new(&scene(&polygons)).unwrap();
        let mesh = mesh(&surfaces, 60);
        let (outline, table) = (VertexBuffer::new(&surfaces), FormFactorTable::new(64));
        let setting = SceneGeometry {
            surfaces: &surfaces,
            hierarchy: &Hierarchy::new(&surfaces),
        };
        let mut cube = Hemicube::new(setting, &outline, &mesh, &table);
        let by_area = |i: usize| surfaces.facets[i].area;
        let (floor, top) = (0, 2);
        assert!(by_area(floor) > by_area(1) && by_area(1) > by_area(top));
        let points = points(20);
        let (mut seen, mut truth) = (0.0, 0.0);
        for (i, p) in points.iter().enumerate() {
            let row = cube.row(floor, *p, hash_to_unit(i as u64));
            let own = row
                .iter()
                .filter(|r| mesh.elements[r.0 as usize].facet == top);
            seen += own.map(|r| f64::from(r.1)).sum::<f64>();
            truth += exact(&small, *p);
        }
        println!(
            "the smaller one is seen with {:.4} of its form factor",
            seen / truth
        );
        assert!((seen / truth - 1.0).abs() < 0.02, "{seen} {truth}");
    }
}

/// A lamp a hand's breadth from a wall: four samples per element miss much of its flux or find too
/// much. The total reflected in a room of equal walls is flux rho / (1 - rho), however it is
/// distributed.
#[test]
fn four_samples_beside_a_lamp_miss_its_flux_and_more_find_it() {
    let (rho, flux) = (0.5, 1000.0);
    let walls = cuboid(Vec3::ZERO, vec3(4.0, 4.0, 4.0), true);
    let lamp = vec3(1.3, 0.1, 2.2);
    let room = |reflectance: f64| {
        let mut room = Room::default();
        for wall in &walls {
            room.wall(wall, reflectance);
        }
        room.bulb(lamp, flux / (4.0 * PI));
        room
    };
    let surfaces = Surfaces::new(&room(rho).scene).unwrap();
    let naive: f64 = mesh(&surfaces, 300)
        .elements
        .iter()
        .flat_map(|e| e.samples.iter().map(move |s| (e.facet, s)))
        .map(|(facet, s)| {
            let d = lamp - s.point;
            let cosine = surfaces.facets[facet].normal.dot(d) / d.length();
            s.area * flux / (4.0 * PI) * cosine / d.dot(d)
        })
        .sum();
    println!("four samples find {:.3} of the flux", naive / flux);
    assert!((naive / flux - 1.0).abs() > 0.05, "{naive}");
    assert!(matches!(room(rho).lights[0], Light::Spot(_)));
    let reflected = INWARD.iter().map(|&normal| {
        let middle = vec3(2.0, 2.0, 2.0) - normal * 2.0;
        let meter = Meter::new(middle, normal, 0.125, [32, 32], 2.0);
        let both = [rho, GREY].map(|r| room(r).mean(&meter, r, 1));
        both[0] - both[1]
    });
    let ours = mean(&reflected.collect::<Vec<_>>()) / (flux / 96.0 * rho / (1.0 - rho));
    println!("quality 1 reflects {ours:.4} of what it should");
    assert!((ours - 1.0).abs() < 0.015, "{ours}");
}

/// Radiance of each of 9 x 9 pixels that show a floor from 4 m in the light of the room, at a
/// quality; and by brute force from the irradiance at this many points per pixel (1: its middle).
fn pixels(
    room: &mut Room,
    view: &View,
    quality: u8,
    irradiance: impl Fn(Vec3) -> f64,
) -> (Vec<f64>, impl Fn(usize) -> Vec<f64>) {
    room.scene.materials[0].reflectance = Rgb([0.5; 3]);
    let ours = room.radiances(view, quality);
    let camera = camera(view).unwrap();
    let at = move |x: f64, y: f64| {
        let ray = camera.ray(x, y);
        0.5 / PI * irradiance(camera.origin + ray * (camera.origin.z / -ray.z))
    };
    let pixel = move |i: usize, n: usize| {
        let (x, y, step) = ((i % 9) as f64, (i / 9) as f64, 1.0 / n as f64);
        let point = |k: usize| {
            let (a, b) = ((k % n) as f64 + 0.5, (k / n) as f64 + 0.5);
            at(x + a * step, y + b * step)
        };
        (0..n * n).map(point).sum::<f64>() * step * step
    };
    (ours, move |n: usize| (0..81).map(|i| pixel(i, n)).collect())
}

fn floor_of_8_metres() -> Vec<Vec3> {
    let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    floor.map(|(x, y)| vec3(x, y, 0.0)).to_vec()
}

/// Root mean square error, relative to that of the truth.
fn relative(of: &[f64], truth: &[f64]) -> f64 {
    let squares = of.iter().zip(truth).map(|(a, t)| (a - t) * (a - t));
    (squares.sum::<f64>() / truth.iter().map(|t| t * t).sum::<f64>()).sqrt()
}

fn from_above(x: f64) -> View {
    View {
        from: vec3(x, 0.0, 4.0),
        to: vec3(0.0, 0.0, 0.0),
        fov: 20.0,
        roll: 0.0,
        width: 9,
        height: 9,
    }
}

/// Step 3 interpolates nothing, so that the remaining error is that of the means themselves;
/// earlier steps add their tolerance.
#[test]
fn one_point_a_pixel_beside_a_spot_is_wrong_and_its_solid_angle_is_not() {
    for (height, quality, most) in [
        (0.2, 1, 0.02),
        (0.05, 1, 0.02),
        (0.05, 3, 0.002),
        (0.01, 3, 0.002),
    ] {
        let spot = Spot {
            position: vec3(0.013, -0.021, height),
            aim: vec3(0.4, 0.1, 0.0),
            intensity: Rgb([1.0; 3]),
            beam: 90.0,
            field: 170.0,
        };
        let beam = Beam::new(&spot).unwrap();
        let mut room = Room {
            scene: scene(&[floor_of_8_metres()]),
            lights: vec![Light::Spot(spot)],
        };
        let up = vec3(0.0, 0.0, 1.0);
        let view = from_above(-0.5);
        let (ours, brute) = pixels(&mut room, &view, quality, |p| beam.irradiance(p, up));
        let truth = brute(300);
        let (naive, ours) = (relative(&brute(1), &truth), relative(&ours, &truth));
        println!("{height} m, step {quality}: one point {naive:.4}, ours {ours:.5}");
        assert!(naive > 0.05 && ours < most);
    }
}

/// A panel that stands on the floor, seen edge on: next to it the floor's light falls from half its
/// radiosity to little within a pixel of 16 cm.
#[test]
fn one_point_a_pixel_beside_a_panel_is_wrong_and_many_are_not() {
    for (height, quality) in [(0.3, 1), (0.1, 1), (0.1, 3), (0.02, 3)] {
        let panel: Vec<Vec3> = [(-0.3, 0.0), (-0.3, height), (0.3, height), (0.3, 0.0)]
            .map(|(x, z)| vec3(x, 0.013, z))
            .to_vec();
        let mut room = Room {
            scene: scene(&[floor_of_8_metres()]),
            lights: Vec::new(),
        };
        room.wall(&panel, 0.0);
        room.lights.push(Light::Panel {
            material: 1,
            radiance: Rgb([1.0; 3]),
        });
        // Not the floor, which is material 0, and black from behind.
        let seen = |p: Vec3| match p.y > 0.013 {
            true => PI * exact(&panel, p),
            false => 0.0,
        };
        let view = from_above(-0.5);
        let (ours, brute) = pixels(&mut room, &view, quality, seen);
        let truth = brute(100);
        let (naive, ours) = (relative(&brute(1), &truth), relative(&ours, &truth));
        println!("panel of {height} m, step {quality}: one point {naive:.4}, ours {ours:.5}");
        assert!(naive > 0.1 && ours < 0.1 * naive);
    }
}
