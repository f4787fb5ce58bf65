#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;

fn corner(x: f64, y: f64, normal: [f64; 3], place: [f64; 2]) -> Corner {
    let [a, b, c] = normal;
    Corner {
        point: vec3(x, y, 0.0),
        normal: Some(vec3(a, b, c)),
        place: Some(place),
    }
}

const UP: Vec3 = vec3(0.0, 0.0, 1.0);

#[test]
fn corners_have_what_the_file_says() {
    let corners = [
        corner(1.0, 1.0, [0.0, 0.0, 2.0], [0.25, 0.5]),
        corner(3.0, 1.0, [0.5, 0.0, 1.0], [0.75, 0.5]),
        corner(1.0, 5.0, [0.0, 0.5, 1.0], [0.25, 2.5]),
    ];
    let shading = Shading::of_corners(&corners).unwrap().unwrap();
    for c in &corners {
        let normal = c.normal.unwrap().normalized();
        assert!((shading.normal(c.point, UP) - normal).length() < 1e-12);
        let place = shading.place(c.point);
        assert!(
            (place[0] - c.place.unwrap()[0]).abs() + (place[1] - c.place.unwrap()[1]).abs() < 1e-12
        );
    }
    let sides = shading.sides([vec3(2.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)]);
    assert!((sides[0][0] - 0.5).abs() < 1e-12 && (sides[1][1] - 0.5).abs() < 1e-12);
    // After a quarter turn and a scale it has the same value at the same corner.
    let mut moved = shading.clone();
    let by = |v: Vec3| vec3(v.x, -v.z, v.y);
    moved.turn(by);
    moved.stretch(10.0, vec3(1.0, 2.0, 3.0));
    let at = by(corners[1].point) * 10.0 + vec3(1.0, 2.0, 3.0);
    let expected = by(corners[1].normal.unwrap()).normalized();
    assert!((moved.normal(at, by(UP)) - expected).length() < 1e-12);
    assert!((moved.place(at)[0] - 0.75).abs() < 1e-12);
    assert!(
        (shading.of_back().normal(corners[1].point, -UP) + corners[1].normal.unwrap().normalized())
            .length()
            < 1e-12
    );
}

#[test]
fn what_does_not_vary_has_none_and_what_is_not_linear_is_bent() {
    let square = |last: [f64; 2]| {
        let up = [0.0, 0.0, 1.0];
        [
            corner(0.0, 0.0, up, [0.0, 0.0]),
            corner(1.0, 0.0, up, [1.0, 0.0]),
            corner(1.0, 1.0, up, [1.0, 1.0]),
            corner(0.0, 1.0, up, last),
        ]
    };
    let linear = Shading::of_corners(&square([0.0, 1.0])).unwrap().unwrap();
    assert!(linear.normal.is_none());
    assert_eq!(Shading::of_corners(&square([0.2, 1.0])), Err(Bent));
    let plain = square([0.0, 1.0]).map(|c| Corner { place: None, ..c });
    assert_eq!(Shading::of_corners(&plain), Ok(None));
    // A normal from behind is unusable.
    let behind = plain.map(|c| Corner {
        normal: Some(-UP),
        ..c
    });
    assert_eq!(Shading::of_corners(&behind), Ok(None));
}

#[test]
fn normals_never_lean_over_the_horizon() {
    let shading = Shading::round_centre(vec3(0.0, 0.0, -0.1));
    for x in [0.0, 0.5, 5.0, 500.0] {
        let normal = shading.normal(vec3(x, 0.0, 0.0), UP);
        assert!(
            (normal.length() - 1.0).abs() < 1e-12 && normal.dot(UP) > 0.05,
            "{x} {normal:?}"
        );
    }
    let round = Shading::round_axis(Vec3::ZERO, vec3(0.0, 0.0, 3.0));
    let normal = round.normal(vec3(0.3, 0.4, 7.0), vec3(1.0, 0.0, 0.0));
    assert!((normal - vec3(0.6, 0.8, 0.0)).length() < 1e-12);
}
