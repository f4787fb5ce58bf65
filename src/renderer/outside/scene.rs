//! The scene as an outside renderer is given it: `scene.json`, which names the places of its numbers
//! in `scene.bin` (32-bit floats, little-endian). The manual's page `farm` has the form.

use serde::Serialize;

use crate::geometry::{Vec3, newell};
use crate::renderer::Setup;
use crate::scene::polygon::triangles;
use crate::scene::profile::Profile;
use crate::scene::{Light, Measured, Polygon, Scene};

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
    for (material, triangles) in by_material(scene)?.into_iter().enumerate() {
        if triangles.points.is_empty() {
            continue;
        }
        meshes.push(Mesh {
            material,
            triangles: triangles.points.len() / 3,
            offset: binary.len(),
        });
        for v in triangles.points.into_iter().chain(triangles.normals) {
            for x in [v.x, v.y, v.z] {
                binary.extend_from_slice(&(x as f32).to_le_bytes());
            }
        }
    }
    let lights = setup.rig.lights.iter().map(light);
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
        lights: lights.collect::<Result<_, _>>().map_err(unwritten)?,
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
    let json = serde_json::to_vec(&file).map_err(|error| error.to_string())?;
    Ok((json, binary))
}

fn unwritten(what: &str) -> String {
    format!("the scene has {what}, which is not written for outside renderers")
}

/// Three points a triangle, and the normal at each.
#[derive(Clone, Default)]
struct Triangles {
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
}

/// The triangles of each material.
fn by_material(scene: &Scene) -> Result<Vec<Triangles>, String> {
    let mut out = vec![Triangles::default(); scene.materials.len()];
    for polygon in &scene.polygons {
        let own = out.get_mut(polygon.material);
        own.and_then(|own| own.add(polygon))
            .ok_or("the scene has a face that cannot be cut")?;
    }
    Ok(out)
}

impl Triangles {
    /// The triangles of a polygon, with the normals to shade by; `None` where it cannot be cut.
    fn add(&mut self, polygon: &Polygon) -> Option<()> {
        let flat = newell(&polygon.vertices).normalized();
        let cut = match polygon.vertices.len() {
            3 => vec![polygon.vertices.to_vec()],
            _ => triangles(&polygon.vertices)?,
        };
        for corner in cut.into_iter().flatten() {
            self.points.push(corner);
            self.normals.push(match &polygon.shading {
                Some(shading) => shading.normal(corner, flat),
                None => flat,
            });
        }
        Some(())
    }
}

/// A light as the form has it, or what the form has no words for.
fn light(light: &Light) -> Result<LightRow, &'static str> {
    match light {
        Light::Panel { material, radiance } => Ok(LightRow::Panel {
            material: *material,
            radiance: radiance.0,
        }),
        Light::Spot(spot) => {
            let Some(profile) = Profile::new(spot.beam, spot.field) else {
                return Err("a beam without light");
            };
            let end = profile.end();
            let at = |step: u32| profile.share(end * f64::from(step) / f64::from(STEPS));
            Ok(LightRow::Spot {
                position: point(spot.position),
                aim: point(spot.aim),
                intensity: spot.intensity.0,
                end,
                shares: (0..=STEPS).map(at).collect(),
            })
        }
        Light::Measured(measured) => round(measured),
        Light::Projection(_) => Err("a projection"),
        Light::Image(_) => Err("a bank given as an image"),
    }
}

/// A photometric file that is the same all round its axis is a table as a spot's.
fn round(measured: &Measured) -> Result<LightRow, &'static str> {
    let parts = measured.distribution.parts();
    let end = parts.vertical.last().copied().unwrap_or(0.0);
    if parts.horizontal.len() > 1 {
        return Err("a photometric file that is not the same all round");
    }
    let end = end.to_radians();
    let at = |step: u32| {
        let angle = end * f64::from(step) / f64::from(STEPS);
        measured.distribution.intensity(angle, 0.0)
    };
    let mount = &measured.mount;
    Ok(LightRow::Spot {
        position: point(mount.position),
        aim: point(mount.aim),
        intensity: measured.factor.0,
        end,
        shares: (0..=STEPS).map(at).collect(),
    })
}

fn point(p: Vec3) -> [f64; 3] {
    [p.x, p.y, p.z]
}
