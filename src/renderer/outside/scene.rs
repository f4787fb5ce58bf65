//! The scene as an outside renderer is given it: `scene.json`, which names the places of its numbers
//! in `scene.bin` (32-bit floats, little-endian). The manual's page `farm` has the form.

use serde::Serialize;

use crate::geometry::{Vec3, newell};
use crate::renderer::Setup;
use crate::scene::polygon::triangles;
use crate::scene::profile::Profile;
use crate::scene::{Light, Measured, Polygon};

/// The form of `scene.json`.
pub const SCHEMA: u32 = 1;

/// Steps of a table of intensities from the axis to where the light ends.
const STEPS: u32 = 256;

#[derive(Serialize)]
struct SceneFile<'a> {
    schema: u32,
    materials: Vec<MaterialRow<'a>>,
    /// One for each material that has polygons.
    meshes: Vec<Mesh>,
    lights: Vec<LightRow>,
    sources: Vec<SourceRow<'a>>,
}

#[derive(Serialize)]
struct MaterialRow<'a> {
    name: &'a str,
    reflectance: [f64; 3],
}

/// Triangles, nine floats each; behind them the same number for the normals at their corners.
#[derive(Serialize)]
struct Mesh {
    material: usize,
    triangles: usize,
    /// Bytes into `scene.bin`.
    offset: usize,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum LightRow {
    /// A material that emits.
    Panel { material: usize, radiance: [f64; 3] },
    /// A point that shines round an axis: candela of each channel, and shares of it at equal steps
    /// of the angle from 0 to `end`, radians.
    Spot {
        position: [f64; 3],
        aim: [f64; 3],
        intensity: [f64; 3],
        end: f64,
        shares: Vec<f64>,
    },
    /// What this form has no words for yet.
    Other { what: &'static str },
}

#[derive(Serialize)]
struct SourceRow<'a> {
    name: &'a str,
    /// Number of a light, and what each channel of it is multiplied by.
    emitters: Vec<(usize, [f64; 3])>,
}

/// Both files of a setup.
///
/// # Errors
/// What of it the form cannot say.
pub fn files(setup: &Setup) -> Result<(Vec<u8>, Vec<u8>), String> {
    let scene = &setup.scene;
    let mut binary = Vec::new();
    let mut meshes = Vec::new();
    for material in 0..scene.materials.len() {
        let own = scene.polygons.iter().filter(|p| p.material == material);
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        for polygon in own {
            add(polygon, &mut points, &mut normals)
                .ok_or("the scene has a face that cannot be cut")?;
        }
        if points.is_empty() {
            continue;
        }
        meshes.push(Mesh {
            material,
            triangles: points.len() / 3,
            offset: binary.len(),
        });
        for v in points.into_iter().chain(normals) {
            for x in [v.x, v.y, v.z] {
                binary.extend_from_slice(&(x as f32).to_le_bytes());
            }
        }
    }
    let file = SceneFile {
        schema: SCHEMA,
        materials: scene
            .materials
            .iter()
            .map(|material| MaterialRow {
                name: &material.name,
                reflectance: material.reflectance.0,
            })
            .collect(),
        meshes,
        lights: setup.rig.lights.iter().map(light).collect(),
        sources: setup
            .rig
            .sources
            .iter()
            .map(|source| SourceRow {
                name: &source.name,
                emitters: source
                    .emitters
                    .iter()
                    .map(|emitter| (emitter.light, emitter.filter.0))
                    .collect(),
            })
            .collect(),
    };
    for light in &file.lights {
        if let LightRow::Other { what } = light {
            return Err(format!(
                "the scene has {what}, which is not written for outside renderers"
            ));
        }
    }
    let json = serde_json::to_vec(&file).map_err(|error| error.to_string())?;
    Ok((json, binary))
}

/// The triangles of a polygon, with the normals to shade by.
fn add(polygon: &Polygon, points: &mut Vec<Vec3>, normals: &mut Vec<Vec3>) -> Option<()> {
    let flat = newell(&polygon.vertices).normalized();
    let cut = match polygon.vertices.len() {
        3 => vec![polygon.vertices.clone()],
        _ => triangles(&polygon.vertices)?,
    };
    for corner in cut.into_iter().flatten() {
        points.push(corner);
        normals.push(match &polygon.shading {
            Some(shading) => shading.normal(corner, flat),
            None => flat,
        });
    }
    Some(())
}

fn light(light: &Light) -> LightRow {
    let point = |p: Vec3| [p.x, p.y, p.z];
    match light {
        Light::Panel { material, radiance } => LightRow::Panel {
            material: *material,
            radiance: radiance.0,
        },
        Light::Spot(spot) => {
            let Some(profile) = Profile::new(spot.beam, spot.field) else {
                return LightRow::Other {
                    what: "a beam without light",
                };
            };
            let end = profile.end();
            let at = |step: u32| profile.share(end * f64::from(step) / f64::from(STEPS));
            LightRow::Spot {
                position: point(spot.position),
                aim: point(spot.aim),
                intensity: spot.intensity.0,
                end,
                shares: (0..=STEPS).map(at).collect(),
            }
        }
        Light::Measured(measured) => round(measured),
        Light::Projection(_) => LightRow::Other {
            what: "a projection",
        },
        Light::Image(_) => LightRow::Other {
            what: "a bank given as an image",
        },
    }
}

/// A photometric file that is the same all round its axis is a table as a spot's.
fn round(measured: &Measured) -> LightRow {
    let parts = measured.distribution.parts();
    let end = parts.vertical.last().copied().unwrap_or(0.0);
    if parts.horizontal.len() > 1 {
        return LightRow::Other {
            what: "a photometric file that is not the same all round",
        };
    }
    let end = end.to_radians();
    let at = |step: u32| {
        let angle = end * f64::from(step) / f64::from(STEPS);
        measured.distribution.intensity(angle, 0.0)
    };
    let mount = &measured.mount;
    LightRow::Spot {
        position: [mount.position.x, mount.position.y, mount.position.z],
        aim: [mount.aim.x, mount.aim.y, mount.aim.z],
        intensity: measured.factor.0,
        end,
        shares: (0..=STEPS).map(at).collect(),
    }
}
