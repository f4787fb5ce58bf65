//! Sources: the elements as the final gather and gloss see them, each divided into four.
//!
//! A point of the image may lie closer to an element than the element is wide, as in a corner; it
//! must not see the element's mean light only. Direct light of the sources is that of the parts of
//! elements that were divided for accuracy. Elsewhere it is interpolated between the elements, as
//! reflected light is everywhere, so that neither samples nor bounces cost more. This module does
//! not depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each source, made together"
)]

use crate::hemicube::mesh::Mesh;
use crate::surfaces::surface::Surfaces;

/// Sources of all facets.
pub struct Sources {
    /// The finer mesh.
    pub mesh: Mesh,
    /// Reflectance of each source.
    pub reflectance: Vec<[f32; 3]>,
    /// Elements around each source, with weights that sum to 1, or 0 where there is none.
    around: Vec<[(u32, f32); 4]>,
}

impl Sources {
    /// The sources of a `mesh` whose cells are those of the `elements`, divided into four.
    pub fn new(mesh: Mesh, elements: &Mesh, surfaces: &Surfaces) -> Sources {
        let made = mesh.elements.iter();
        let around = made.clone().map(|e| elements.stencil(e.facet, e.centre));
        let around = around.collect();
        let reflectance = made.map(|e| e.reflectance(surfaces).map(|r| r as f32));
        Sources {
            reflectance: reflectance.collect(),
            around,
            mesh,
        }
    }

    /// A value of the elements, interpolated at a source.
    pub fn interpolated(&self, source: usize, of: impl Fn(usize) -> f32) -> f32 {
        let around = self.around[source].iter().filter(|(_, w)| *w > 0.0);
        around.map(|(e, w)| w * of(*e as usize)).sum()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use crate::gather::PathEstimator;
    use crate::hemicube::HemicubeScene;
    use crate::hemicube::step::HemicubeStep;
    use crate::unit_lights::{BandedScene, UnitLights};
    use crate::{PixelEstimator, Quality, Setup};
    use footlight_host::work::Work;
    use footlight_show::geometry::{View, vec3};
    use footlight_show::model::Spot;
    use footlight_show::units::Rgb;
    use footlight_stage::{Emitter, Light, Material, Polygon, Rig, Scene, Source};
    use std::sync::Arc;

    /// A spot lights the foot of a white wall from above, within centimetres of the dark floor that
    /// the camera sees.
    pub fn corner() -> Setup {
        let quad = |material, corners: [[f64; 3]; 4]| {
            let corners = corners.map(|[x, y, z]| vec3(x, y, z));
            Polygon::new(corners.to_vec(), material)
        };
        let scene = Scene {
            materials: vec![
                Material::diffuse("white", Rgb([0.8; 3])),
                Material::diffuse("dark", Rgb([0.01; 3])),
            ],
            polygons: vec![
                quad(0, [[0., 4., 0.], [4., 4., 0.], [4., 4., 4.], [0., 4., 4.]]),
                quad(1, [[0., 0., 0.], [4., 0., 0.], [4., 4., 0.], [0., 4., 0.]]),
            ],
            ..Scene::default()
        };
        let spot = Light::Spot(Spot {
            position: vec3(2.0, 1.0, 0.2),
            aim: vec3(2.0, 4.0, 0.15),
            beam: 2.0,
            field: 3.0,
            intensity: Rgb::WHITE,
        });
        let lamp = Emitter {
            light: 0,
            filter: Rgb::WHITE,
        };
        let rig = Rig {
            lights: vec![spot],
            sources: vec![Source {
                name: "foot".into(),
                emitters: vec![lamp],
            }],
        };
        let view = View {
            from: vec3(2.0, 3.6, 0.5),
            to: vec3(2.0, 3.85, 0.0),
            fov: 30.0,
            width: 144,
            height: 144,
            roll: 0.0,
        };
        Setup::new(scene, rig, view)
    }

    #[test]
    fn a_corner_sees_where_its_wall_is_lit() {
        let setup = corner();
        // Near enough to each other to show what the sources do.
        let step = HemicubeStep {
            gather_points: 40_000,
            ..HemicubeStep::of(Quality(1)).unwrap()
        };
        let scene = HemicubeScene::new(&setup, step, Work::silent()).unwrap();
        let mut operator = Arc::new(scene).whole(Work::silent()).unwrap();
        operator.solve(&[0], Work::silent()).unwrap();
        let picture = operator.picture(&[[1.0; 3]]);
        let estimator = PathEstimator::new(&setup, Work::silent()).unwrap();
        let pixels: Vec<usize> = (0..144 * 144).step_by(37).collect();
        let paths = estimator.estimate(&[1.0], &pixels, 0..256, Work::silent());
        let (mut wrong, mut all) = (0.0, 0.0);
        for (pixel, [a, b]) in pixels.iter().zip(paths.unwrap()) {
            let pixel = f64::from(picture.data()[3 * pixel]);
            let [a, b] = [a, b].map(|rgb| rgb[0]);
            wrong += (pixel - a) * (pixel - b);
            all += a * b;
        }
        let error = (wrong / all).sqrt();
        // 0.35 with elements that are evenly bright.
        assert!(error < 0.12, "{error}");
    }
}
