//! Objects in contact: light leaks under walls, and floors hidden under boxes.

use crate::meter::{Room, cuboid, level, mean, upright};
use footlight_host::work::Work;
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use footlight_transport::hemicube::indirect::hemicube::hash_to_unit;
use footlight_transport::hemicube::interior::is_interior;
use footlight_transport::hemicube::mesh::{CellRequest, Layout};
use footlight_transport::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use footlight_transport::surfaces::surface::Surfaces;

/// Two chambers under one roof, on one floor: the partition at y = 2.3 is `thick`, and only the
/// near chamber has a lamp.
fn chambers(thick: f64) -> Room {
    let mut room = Room::default();
    for face in cuboid(Vec3::ZERO, vec3(4.0, 5.0, 3.0), true) {
        room.wall(&face, 0.7);
    }
    room.wall(&upright([0.0, 4.0], 2.3, [0.0, 3.0], false), 0.7);
    room.wall(&upright([0.0, 4.0], 2.3 + thick, [0.0, 3.0], true), 0.7);
    room.panel(&[level([1.0, 3.0], [0.5, 1.5], 2.9, false)], 100.0);
    room
}

fn beyond() -> View {
    View {
        from: vec3(2.0, 4.9, 1.5),
        to: vec3(2.0, 2.3, 0.8),
        fov: 80.0,
        roll: 0.0,
        width: 24,
        height: 18,
    }
}

/// Floor and roof continue under the partition, so that cells of their grids lie on both sides of
/// it. Averaging over such a cell puts light where none can be.
#[test]
#[ignore = "slow"]
fn no_light_creeps_under_a_partition() {
    for thick in [0.0, 0.1] {
        let room = chambers(thick);
        let surfaces = Surfaces::new(&room.scene).unwrap();
        let layout = Layout::of_elements(&surfaces, 300);
        let floor = surfaces
            .facets
            .iter()
            .position(|f| f.normal.z > 0.9 && f.area > 15.0);
        let grid = layout.grid(floor.unwrap()).unwrap();
        // The share of the floor beyond the partition in cells that reach under it.
        let side = |y: f64| vec3(2.0, y, 0.0);
        let on_both = (0..270).map(|i| 2.305 + thick + 0.01 * f64::from(i));
        let reached = on_both
            .filter(|y| *y < 5.0 && grid.cell(side(*y)) == grid.cell(side(2.29)))
            .count();
        println!("{thick} m: the naive mesh lights {reached} of 270 strips beyond the partition");
        assert!(reached > 3, "{reached}");
        for quality in 1..=2 {
            let dark = room.radiances(&beyond(), quality);
            let near = View {
                from: vec3(2.0, 0.1, 1.5),
                to: vec3(2.0, 2.3, 0.8),
                ..beyond()
            };
            let lit = mean(&room.radiances(&near, quality));
            let most = dark.iter().copied().fold(0.0, f64::max);
            println!("quality {quality}: {most:.2e} beyond, {lit:.2} within");
            assert!(
                most < 1e-5 * lit,
                "{thick}, quality {quality}: {most} of {lit}"
            );
        }
    }
}

/// A wall of zero thickness is two faces back to back in one plane, each visible from its side.
#[test]
#[ignore = "slow"]
fn of_two_faces_back_to_back_each_is_seen_from_its_side() {
    let view = View {
        from: vec3(2.0, 0.1, 1.5),
        to: vec3(2.0, 2.3, 0.8),
        ..beyond()
    };
    for quality in [1, 2] {
        let [thin, thick] = [0.0, 0.1].map(|t| mean(&chambers(t).radiances(&view, quality)));
        println!("quality {quality}: {thin:.4} with a thin wall, {thick:.4} with a thick one");
        assert!(
            (thin / thick - 1.0).abs() < 0.01,
            "quality {quality}: {thin}, {thick}"
        );
    }
}

/// A crate on a floor under a lamp; the floor in one piece, or in four around the crate's foot.
fn storeroom(around: bool) -> Room {
    let mut room = Room::default();
    let (x, y) = ([1.13, 2.21], [0.94, 1.87]);
    for (i, face) in cuboid(Vec3::ZERO, vec3(4.0, 3.0, 2.5), true)
        .iter()
        .enumerate()
    {
        match i {
            4 if around => {
                room.wall(&level([0.0, x[0]], [0.0, 3.0], 0.0, true), 0.6);
                room.wall(&level([x[1], 4.0], [0.0, 3.0], 0.0, true), 0.6);
                room.wall(&level(x, [0.0, y[0]], 0.0, true), 0.6);
                room.wall(&level(x, [y[1], 3.0], 0.0, true), 0.6);
            }
            _ => room.wall(face, 0.6),
        }
    }
    let crate_faces = cuboid(vec3(x[0], y[0], 0.0), vec3(x[1], y[1], 0.8), false);
    // It has no bottom, as in most sets.
    for face in crate_faces.iter().filter(|f| f.iter().any(|v| v.z > 0.0)) {
        room.wall(face, 0.5);
    }
    room.panel(&[level([0.4, 3.6], [0.4, 2.6], 2.4, false)], 10.0);
    room
}

/// Treating hidden floor like visible floor darkens its elements.
#[test]
fn floor_beneath_a_crate_does_not_darken_what_is_beside_it() {
    let room = storeroom(false);
    let surfaces = Surfaces::new(&room.scene).unwrap();
    let hierarchy = Hierarchy::new(&surfaces);
    let setting = SceneGeometry {
        surfaces: &surfaces,
        hierarchy: &hierarchy,
    };
    let layout = Layout::of_elements(&surfaces, 300);
    let floor = surfaces
        .facets
        .iter()
        .position(|f| f.normal.z > 0.9 && f.area > 11.0);
    let floor = floor.unwrap();
    // Among cells with open floor near the crate, the share beneath it: by that much the naive mean
    // of a cell is too dark.
    let grid = layout.grid(floor).unwrap();
    let beneath = |p: Vec3| p.x > 1.13 && p.x < 2.21 && p.y > 0.94 && p.y < 1.87;
    let random = |i: u64| vec3(4.0 * hash_to_unit(i), 3.0 * hash_to_unit(i + 7919), 0.0);
    let points: Vec<Vec3> = (0..20_000).map(random).collect();
    let mut cells = vec![[0_u32; 2]; layout.cells()];
    for p in &points {
        cells[grid.cell(*p)][usize::from(beneath(*p))] += 1;
    }
    let mixed = cells.iter().filter(|c| c[0] > 0 && c[1] > 0);
    let dark = mixed.map(|c| f64::from(c[1]) / f64::from(c[0] + c[1]));
    let dark = mean(&dark.collect::<Vec<_>>());
    println!("naive cells beside the crate lose {dark:.2} of their light");
    assert!(dark > 0.2, "{dark}");

    let all = vec![CellRequest::WANTED; layout.cells()];
    let eye = [vec3(0.3, 0.3, 1.8)];
    let mesh = layout.mesh(setting, &eye, &all, Work::silent()).unwrap();
    let on_floor = mesh.elements.iter().filter(|e| e.facet == floor);
    for p in on_floor.flat_map(|e| e.samples.iter().map(|s| s.point).chain([e.centre])) {
        assert!(
            !beneath(p) && !is_interior(setting, &eye, floor, p),
            "{p:?}"
        );
    }
    let view = View {
        from: eye[0],
        to: vec3(2.6, 2.0, 0.3),
        fov: 75.0,
        roll: 0.0,
        width: 32,
        height: 24,
    };
    for (quality, most) in [(1, 0.008), (2, 0.004)] {
        let [whole, parts] = [false, true].map(|a| storeroom(a).radiances(&view, quality));
        let square: f64 = whole.iter().zip(&parts).map(|(a, b)| (a - b).powi(2)).sum();
        let off = (square / parts.iter().map(|b| b * b).sum::<f64>()).sqrt();
        println!("quality {quality}: {off:.5} from a floor that ends at the crate");
        assert!(off < most, "quality {quality}: {off}");
    }
}

/// A board hidden behind three raised panels except for a narrow frame, in a room lit only from its
/// ceiling. It has more edges than its cells are cut along, and all its samples are behind the
/// panels: without an element the frame is black.
#[test]
fn what_shows_of_a_nearly_hidden_board_is_not_black() {
    let mut room = Room::default();
    for face in cuboid(vec3(-3.0, -2.0, 0.0), vec3(7.0, 6.0, 4.0), true) {
        room.wall(&face, 0.6);
    }
    room.panel(&[level([1.0, 3.0], [0.5, 1.5], 1.5, true)], 10.0);
    for face in cuboid(vec3(1.0, 3.0, 0.5), vec3(3.0, 3.2, 1.4), false) {
        room.wall(&face, 0.6);
    }
    for x in [1.05, 1.7, 2.35] {
        for face in cuboid(vec3(x, 2.98, 0.55), vec3(x + 0.6, 3.0, 1.35), false) {
            room.wall(&face, 0.6);
        }
    }
    let view = View {
        from: vec3(2.0, 2.0, 0.95),
        to: vec3(2.0, 3.0, 0.95),
        fov: 46.0,
        roll: 0.0,
        width: 80,
        height: 40,
    };
    let darkest = |quality| {
        let seen = room.radiances(&view, quality);
        seen.into_iter().fold(f64::INFINITY, f64::min)
    };
    let exact = darkest(3);
    for quality in 1..=2 {
        let found = darkest(quality);
        println!("quality {quality}: {found:.4}, at the finest {exact:.4}");
        assert!(found > 0.5 * exact, "quality {quality}: {found}, {exact}");
    }
}
