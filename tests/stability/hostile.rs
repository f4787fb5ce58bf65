//! Stages made to break the operator: each gives images of finite numbers or a clear error.

use footlight_host::work::{Silent, Work};
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::{Emitter, Light, Material, Polygon, Rig, Scene, Source};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Setup, Transport, TransportError};
use std::sync::Arc;

/// A stage, its lights (one source each) and the camera.
struct Stage {
    scene: Scene,
    lights: Vec<Light>,
    view: View,
}

fn material(name: &str, reflectance: f64) -> Material {
    Material::diffuse(name, Rgb([reflectance; 3]))
}

fn quad(corners: [[f64; 3]; 4]) -> Polygon {
    Polygon::new(corners.map(|[x, y, z]| vec3(x, y, z)).to_vec(), 0)
}

fn spot(position: Vec3, aim: Vec3) -> Light {
    Light::Spot(Spot {
        position,
        aim,
        beam: 40.0,
        field: 60.0,
        intensity: Rgb([500.0; 3]),
    })
}

/// A floor with a crate on it under a lamp and a spot: the base of the hostile stages.
fn plain() -> Stage {
    let (a, b) = (-3.0, 3.0);
    let mut polygons = vec![quad([[a, a, 0.0], [b, a, 0.0], [b, b, 0.0], [a, b, 0.0]])];
    let corner = |i: usize| [(i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64];
    for side in [
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [1, 3, 7, 5],
        [3, 2, 6, 7],
        [2, 0, 4, 6],
    ] {
        polygons.push(quad(side.map(corner)));
    }
    let mut lamp = quad([
        [-1.0, 1.0, 3.0],
        [1.0, 1.0, 3.0],
        [1.0, -1.0, 3.0],
        [-1.0, -1.0, 3.0],
    ]);
    lamp.material = 1;
    polygons.push(lamp);
    Stage {
        scene: Scene {
            materials: vec![material("grey", 0.6), material("lamp", 0.0)],
            polygons,
            ..Scene::default()
        },
        lights: vec![
            Light::Panel {
                material: 1,
                radiance: Rgb([10.0; 3]),
            },
            spot(vec3(-2.0, -2.5, 2.5), vec3(0.5, 0.5, 0.5)),
        ],
        view: View {
            from: vec3(-2.0, -5.0, 2.0),
            to: vec3(0.5, 0.5, 0.5),
            fov: 50.0,
            roll: 0.0,
            width: 24,
            height: 16,
        },
    }
}

impl Stage {
    fn rig(&self) -> Rig {
        let source = |light: usize| Source {
            name: format!("s{light}"),
            emitters: vec![Emitter {
                light,
                filter: Rgb::WHITE,
            }],
        };
        Rig {
            lights: self.lights.clone(),
            sources: (0..self.lights.len()).map(source).collect(),
        }
    }

    /// Renders all lights at a quality; returns true if every number is finite, and the largest
    /// one.
    fn render(&self, quality: u8, memory: usize) -> Result<(bool, f32), TransportError> {
        let work = Work {
            progress: &Silent,
            threads: 2,
            memory,
        };
        let setup = Setup::new(self.scene.clone(), self.rig(), self.view.clone());
        let mut g = Radiosity.prepare(&setup, Quality(quality), work)?;
        let image = g
            .render(&[vec![1.0; setup.rig.sources.len()]], work)?
            .remove(0);
        let finite = image.data().iter().all(|x| x.is_finite() && *x >= 0.0);
        Ok((finite, image.data().iter().copied().fold(0.0, f32::max)))
    }

    fn assert_finite(&self, what: &str, lit: bool) {
        for quality in [1, 2] {
            let (finite, largest) = self.render(quality, 1 << 30).unwrap();
            assert!(finite, "{what} at quality {quality}");
            assert_eq!(
                largest > 1e-12,
                lit,
                "{what} at quality {quality}: {largest}"
            );
        }
    }
}

#[test]
fn polygons_that_are_none_change_nothing() {
    let mut stage = plain();
    stage.assert_finite("plain", true);
    let [o, x] = [vec3(0.3, -1.0, 1.0), vec3(1.0, 0.2, 0.0)];
    let hostile: [Vec<Vec3>; 7] = [
        Vec::new(),
        vec![o],
        vec![o, o + x],
        vec![o, o + x, o + x * 2.0],
        vec![o; 5],
        vec![o, o + x, o, o + x],
        vec![o, o + x, o + x * 0.5 + vec3(0.0, 0.0, 1e-13)],
    ];
    let before = stage.render(3, 1 << 30).unwrap();
    let none = hostile.map(|vertices| Polygon::new(vertices, 0));
    stage.scene.polygons.extend(none);
    let after = stage.render(3, 1 << 30).unwrap();
    assert_eq!(before, after);
}

#[test]
fn odd_polygons_do_no_harm() {
    let mut stage = plain();
    // A bow tie, a pentagram, a non-planar one, one that intersects all others, a huge one.
    let star = (0..5).map(|i| 2.0 * f64::from(2 * i) * std::f64::consts::PI / 5.0);
    let odd = [
        vec![
            vec3(1.5, 1.0, 1.0),
            vec3(2.5, 1.0, 2.0),
            vec3(2.5, 1.0, 1.0),
            vec3(1.5, 1.0, 2.0),
        ],
        star.map(|a| vec3(-1.5 + 0.5 * a.cos(), 1.0, 1.5 + 0.5 * a.sin()))
            .collect(),
        vec![
            vec3(-2.0, 1.0, 0.0),
            vec3(-1.0, 1.3, 0.0),
            vec3(-1.0, 0.8, 1.0),
            vec3(-2.0, 1.1, 1.0),
        ],
        vec![
            vec3(-9.0, -1.0, -9.0),
            vec3(9.0, 3.0, -9.0),
            vec3(9.0, 3.0, 9.0),
            vec3(-9.0, -1.0, 9.0),
        ],
        vec![
            vec3(-1e7, 50.0, -1e7),
            vec3(1e7, 50.0, -1e7),
            vec3(0.0, 50.0, 1e7),
        ],
    ];
    for vertices in odd {
        stage.scene.polygons.push(Polygon::new(vertices, 0));
        stage.assert_finite("odd polygons", true);
    }
}

#[test]
fn each_face_twice_and_each_face_from_both_sides() {
    let mut stage = plain();
    let twice = stage.scene.polygons.clone();
    stage.scene.polygons.extend(twice);
    stage.assert_finite("each face twice", true);
    let mut stage = plain();
    let mut turned = stage.scene.polygons.clone();
    turned
        .iter_mut()
        .for_each(|p| Arc::make_mut(&mut p.vertices).reverse());
    stage.scene.polygons.extend(turned);
    stage.assert_finite("each face from both sides", true);
}

#[test]
fn numbers_that_are_none_are_refused() {
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY] {
        let mut stage = plain();
        Arc::make_mut(&mut stage.scene.polygons[3].vertices)[1].y = bad;
        let refused = stage.render(1, 1 << 30).unwrap_err().to_string();
        assert!(refused.contains("polygon 3"), "{refused}");
        let mut stage = plain();
        stage.scene.materials[0].reflectance = Rgb([0.5, bad, 0.5]);
        let refused = stage.render(1, 1 << 30).unwrap_err().to_string();
        assert!(refused.contains("reflectance"), "{refused}");
        let mut stage = plain();
        stage.lights[1] = spot(vec3(bad, 0.0, 1.0), vec3(0.0, 0.0, 0.0));
        assert!(
            matches!(stage.render(1, 1 << 30), Err(TransportError::Scene(_))),
            "{bad}"
        );
        let mut stage = plain();
        stage.view.from.z = bad;
        assert!(
            matches!(stage.render(1, 1 << 30), Err(TransportError::Scene(_))),
            "{bad}"
        );
    }
    let mut stage = plain();
    Arc::make_mut(&mut stage.scene.polygons[3].vertices)[1].y = 1e10;
    let refused = stage.render(1, 1 << 30).unwrap_err().to_string();
    assert!(refused.contains("polygon 3"), "{refused}");
    let mut stage = plain();
    stage.scene.materials[0].reflectance = Rgb([1.1; 3]);
    assert!(matches!(
        stage.render(1, 1 << 30),
        Err(TransportError::Scene(_))
    ));
}

#[test]
fn an_eye_or_a_light_where_none_can_be() {
    let mut stage = plain();
    // Inside the crate: backs are black.
    stage.view.from = vec3(0.5, 0.5, 0.5);
    stage.view.to = vec3(3.0, 3.0, 0.7);
    stage.assert_finite("an eye in a crate", false);
    let mut stage = plain();
    stage.lights = vec![spot(vec3(0.5, 0.5, 0.5), vec3(2.0, 2.0, 0.5))];
    stage.assert_finite("a spot in a crate", false);
    // In the plane of the floor, and on it, aimed at itself from within the crate's side.
    for at in [
        vec3(2.0, 2.0, 0.0),
        vec3(1.0, 0.5, 0.5),
        vec3(1.0, 1.0, 1.0),
    ] {
        let mut stage = plain();
        stage.lights.push(spot(at, vec3(-2.0, -2.0, 0.0)));
        stage.assert_finite("a spot in a wall", true);
    }
    let mut stage = plain();
    stage.lights[1] = spot(vec3(1.0, 1.0, 2.0), vec3(1.0, 1.0, 2.0));
    assert!(matches!(
        stage.render(1, 1 << 30),
        Err(TransportError::Scene(_))
    ));
}

#[test]
fn one_polygon_and_none() {
    let mut stage = plain();
    stage.scene.polygons.truncate(1);
    stage.assert_finite("one polygon", true);
    stage.scene.polygons.clear();
    stage.assert_finite("no polygon", false);
}

/// Eight thousand pixels square exceed the budget, even in bands, and are refused before allocation.
#[test]
fn a_picture_beyond_the_budget_is_not_begun() {
    let mut stage = plain();
    (stage.view.width, stage.view.height) = (8192, 8192);
    match stage.render(1, 1 << 30) {
        Err(TransportError::Memory { what, needed, .. }) => {
            assert_eq!(what, "the picture");
            assert!(needed > 1 << 30);
        }
        other => unreachable!("{other:?}"),
    }
}

/// Two hundred lamps, and the memory of each step.
#[test]
#[ignore = "slow"]
fn two_hundred_banks_and_little_memory() {
    let mut stage = plain();
    let place = |i: i32| {
        vec3(
            f64::from(i % 20) * 0.2 - 2.0,
            f64::from(i / 20) * 0.3 - 2.0,
            2.5,
        )
    };
    stage.lights = (0..200)
        .map(|i| spot(place(i), vec3(0.0, 0.0, 0.0)))
        .collect();
    stage.assert_finite("two hundred banks", true);
    let (mut refused, mut done) = (0, 0);
    for bits in (10..30).step_by(2) {
        match stage.render(1, 1 << bits) {
            Err(TransportError::Memory { needed, budget, .. }) => {
                assert!(needed > budget);
                refused += 1;
            }
            other => {
                assert!(other.unwrap().0);
                done += 1;
            }
        }
    }
    assert!(refused > 2 && done > 2, "{refused} refused, {done} done");
}
