//! Seconds per unit of cost on this machine, measured on a small room.

use crate::{Quality, Setup, Transport, TransportError};
use footlight_host::work::Work;
use footlight_show::geometry::{View, vec3};
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::{Emitter, Light, Material, Polygon, Rig, Scene, Source};

/// Most runs of the fixed task; the shortest time counts, as delays only add.
const REPEATS: usize = 3;
/// Relative difference within which two times count as undelayed.
const ALIKE: f64 = 0.1;

/// Seconds per unit of cost, measured by preparing and rendering a small room.
///
/// # Errors
/// Errors of the operator; on cancel.
pub fn cost_scale(
    operator: &dyn Transport,
    clock: &dyn Fn() -> f64,
    work: Work<'_>,
) -> Result<f64, TransportError> {
    let setup = calibration_setup();
    let settings: Vec<Vec<f64>> = vec![vec![1.0, 0.0], vec![0.0, 1.0]];
    let mut best = f64::INFINITY;
    for _ in 0..REPEATS {
        let begin = clock();
        let mut prepared = operator.prepare(&setup, Quality(1), work)?;
        prepared.render(&settings, work)?;
        let seconds = clock() - begin;
        let is_confirmed = (seconds - best).abs() < ALIKE * seconds;
        best = best.min(seconds);
        if is_confirmed {
            break;
        }
    }
    Ok(best)
}

/// A closed room of 4 x 4 x 3 m with nine boxes, a panel and a spot.
fn calibration_setup() -> Setup {
    let walls = [vec3(-2.0, -2.0, 0.0), vec3(2.0, 2.0, 3.0)];
    let mut polygons: Vec<Polygon> = Polygon::block(walls, true, 0).collect();
    for i in 0..9 {
        let (x, y) = (f64::from(i % 3) - 1.0, f64::from(i / 3) - 1.0);
        let half = vec3(0.2, 0.2, 0.0);
        let at = vec3(x, y, 0.0);
        let top = vec3(0.0, 0.0, 0.4 + 0.1 * f64::from(i));
        polygons.extend(Polygon::block([at - half, at + half + top], false, 0));
    }
    let lamp = [(-0.3, 0.3), (0.3, 0.3), (0.3, -0.3), (-0.3, -0.3)];
    polygons.push(Polygon::new(
        lamp.iter().map(|&(x, y)| vec3(x, y, 2.9)).collect(),
        1,
    ));
    let material = |reflectance, emission| Material {
        name: String::new(),
        reflectance: Rgb([reflectance; 3]),
        emission: Rgb([emission; 3]),
        texture: None,
        gloss: None,
    };
    let lights = vec![
        Light::Panel {
            material: 1,
            radiance: Rgb([10.0; 3]),
        },
        Light::Spot(Spot {
            position: vec3(1.8, -1.8, 2.8),
            aim: vec3(0.0, 0.0, 0.5),
            beam: 40.0,
            field: 60.0,
            intensity: Rgb([100.0; 3]),
        }),
    ];
    let source = |light| Source {
        name: String::new(),
        emitters: vec![Emitter {
            light,
            filter: Rgb::WHITE,
        }],
    };
    let scene = Scene {
        materials: vec![material(0.5, 0.0), material(0.0, 10.0)],
        polygons,
        ..Scene::default()
    };
    let rig = Rig {
        lights,
        sources: vec![source(0), source(1)],
    };
    let view = View {
        from: vec3(-1.7, -1.9, 1.8),
        to: vec3(0.2, 0.3, 0.6),
        fov: 60.0,
        roll: 0.0,
        width: 96,
        height: 64,
    };
    Setup::new(scene, rig, view)
}
