//! Invariances: position of the scene, rotation, unit of length, division of a wall, surfaces that
//! show their back.

use crate::meter::{GREY, Room, cuboid, level, qualities};
use crate::reference::{Case, cornell, errors, render, stage};
use footlight_picture::Image;
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use std::sync::Arc;

fn small(mut case: Case) -> Case {
    (case.view.width, case.view.height) = (32, 24);
    case
}

/// The case with each of its points mapped.
fn mapped(mut case: Case, to: impl Fn(Vec3) -> Vec3) -> Case {
    for vertex in case
        .scene
        .polygons
        .iter_mut()
        .flat_map(|p| Arc::make_mut(&mut p.vertices))
    {
        *vertex = to(*vertex);
    }
    case.view.from = to(case.view.from);
    case.view.to = to(case.view.to);
    case
}

fn one(case: &Case, quality: u8) -> Image {
    render(case, quality, std::slice::from_ref(&case.mix), 2).remove(0)
}

/// Relative root mean square difference.
fn difference(a: &Image, b: &Image) -> f64 {
    errors(a, [b, b], &vec![true; b.data().len() / 3]).0
}

/// Images of a case and of its mapped copy, at some qualities: the relative root mean square
/// difference stays within a bound for each mapping.
fn assert_stays(make: fn() -> Case, qualities: &[u8]) {
    let (sine, cosine) = 33.0_f64.to_radians().sin_cos();
    let turn = |p: Vec3| vec3(cosine * p.x - sine * p.y, sine * p.x + cosine * p.y, p.z);
    let far = vec3(1000.25, -2000.5, 500.125);
    type Map<'a> = &'a dyn Fn(Vec3) -> Vec3;
    let ways: [(&str, Map<'_>, &[f64]); 4] = [
        // A unit 1024 times shorter changes only exponents.
        ("binary unit", &|p| p * 1024.0, &[0.0]),
        // Rounding moves hemicube pixels at edges, no more.
        ("millimetres", &|p| p * 1000.0, &[2e-3]),
        ("far away", &|p| p + far, &[2e-3]),
        // Hemicubes have random rotations, and a rotated scene draws others: equal within the noise
        // of the step.
        ("turned", &turn, &[0.01, 0.01, 2e-3]),
    ];
    let case = small(make());
    for &quality in qualities {
        let still = one(&case, quality);
        for (what, to, allowed) in &ways {
            let off = difference(&one(&mapped(small(make()), to), quality), &still);
            println!("{what}, {} at quality {quality}: {off:.2e}", case.name);
            let most = allowed[(usize::from(quality) - 1).min(allowed.len() - 1)];
            assert!(
                off <= most,
                "{what}, {} at quality {quality}: {off}",
                case.name
            );
        }
    }
}

// Each quality except the finest in one of the two scenes.

#[test]
fn cornell_is_the_same_elsewhere() {
    assert_stays(cornell, &[1]);
}

#[test]
#[ignore = "slow"]
fn stage_is_the_same_elsewhere() {
    assert_stays(stage, &[2]);
}

/// A table under a lamp in a room, with its floor in one, two or four pieces.
fn room(pieces: usize) -> Room {
    let mut room = Room::default();
    let faces = cuboid(Vec3::ZERO, vec3(4.0, 3.0, 2.5), true);
    for (i, face) in faces.iter().enumerate() {
        if i != 4 {
            room.wall(face, 0.6);
        }
    }
    for face in cuboid(vec3(1.6, 1.1, 0.7), vec3(2.6, 1.9, 0.75), false) {
        room.wall(&face, 0.4);
    }
    match pieces {
        1 => room.wall(&faces[4], 0.5),
        2 => {
            room.wall(&level([0.0, 1.9], [0.0, 3.0], 0.0, true), 0.5);
            room.wall(&level([1.9, 4.0], [0.0, 3.0], 0.0, true), 0.5);
        }
        _ => {
            for x in [[0.0, 1.9], [1.9, 4.0]] {
                for y in [[0.0, 1.3], [1.3, 3.0]] {
                    room.wall(&level(x, y, 0.0, true), 0.5);
                }
            }
        }
    }
    room.panel(&[level([1.9, 2.4], [1.2, 1.8], 2.45, false)], 100.0);
    room
}

fn inside() -> View {
    View {
        from: vec3(0.3, 0.3, 1.8),
        to: vec3(3.0, 2.4, 0.4),
        fov: 70.0,
        roll: 0.0,
        width: 32,
        height: 24,
    }
}

/// Also with interpolated direct light: no slope carries light into a shadow. The finest step has
/// the tightest bound.
#[test]
#[ignore = "slow"]
fn a_wall_in_pieces_is_the_same_wall() {
    for (quality, pieces) in [(1, 4), (2, 2), (*qualities().end(), 4)] {
        let most = if quality == *qualities().end() {
            3e-3
        } else {
            0.02
        };
        let whole = room(1).radiances(&inside(), quality);
        let parts = room(pieces).radiances(&inside(), quality);
        let square: f64 = whole.iter().zip(&parts).map(|(a, b)| (a - b).powi(2)).sum();
        let off = (square / whole.iter().map(|a| a * a).sum::<f64>()).sqrt();
        println!("{pieces} pieces at quality {quality}: {off:.2e}");
        assert!(off < most, "{pieces} pieces at quality {quality}: {off}");
    }
}

/// The shares of surfaces in a pixel add up to one, however they are cut: where everything emits
/// equally, so does every pixel.
#[test]
fn shares_of_a_pixel_add_up_to_one() {
    for pieces in [1, 2, 4] {
        let mut shining = Room::default();
        for polygon in room(pieces).scene.polygons {
            shining.panel(&[polygon.vertices.to_vec()], 1.0);
        }
        for quality in qualities() {
            let all = shining.radiances(&inside(), quality);
            let off = all.iter().map(|l| (l - 1.0).abs()).fold(0.0, f64::max);
            assert!(off < 1e-5, "{pieces} pieces at quality {quality}: {off}");
        }
    }
}

/// Backs are black: an inside-out scene shows nothing, and a lamp turned away lights nothing.
#[test]
fn backs_are_black() {
    let mut inside_out = room(1);
    for polygon in &mut inside_out.scene.polygons {
        Arc::make_mut(&mut polygon.vertices).reverse();
    }
    let mut away = Room::default();
    away.wall(&level([-1.0, 1.0], [-1.0, 1.0], 0.0, true), GREY);
    away.panel(&[level([-0.5, 0.5], [-0.5, 0.5], 1.0, true)], 100.0);
    let below = View {
        from: vec3(0.0, 0.0, 0.9),
        to: Vec3::ZERO,
        ..inside()
    };
    for quality in qualities() {
        // Then the table's faces look inward and the walls outward: nothing faces the eye.
        let all = inside_out.radiances(&inside(), quality);
        assert!(all.iter().all(|l| *l == 0.0), "quality {quality}");
        let all = away.radiances(&below, quality);
        assert!(all.iter().all(|l| *l == 0.0), "quality {quality}");
    }
}
