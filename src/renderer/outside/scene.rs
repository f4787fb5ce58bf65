//! The scene as an outside renderer is given it: `scene.json`, which names the places of its numbers
//! in `scene.bin` (32-bit floats, little-endian). The manual's page `farm` has the form.

use serde::Serialize;

use crate::geometry::{Vec3, newell};
use crate::renderer::Setup;
use crate::scene::polygon::triangles;
use crate::scene::profile::Profile;
use crate::scene::texture::{Texture, Wrap};
use crate::scene::{Light, Measured, Polygon, Scene};

/// The form of `scene.json`.
pub const SCHEMA: u32 = 1;

/// Bytes of a texel.
const TEXEL_BYTES: usize = 4 * size_of::<f32>();

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
    #[serde(skip_serializing_if = "Option::is_none")]
    texture: Option<TextureRow>,
}

/// An image of four floats a texel, row by row from the top: reflectance, and the share of light that is
/// stopped.
#[derive(Clone, Serialize)]
struct TextureRow {
    width: usize,
    height: usize,
    /// Bytes into `scene.bin`.
    offset: usize,
    /// How it goes on across and down: `repeat`, `mirror` or `clamp`.
    wrap: [&'static str; 2],
    /// Does light pass somewhere?
    cut: bool,
}

/// Triangles, nine floats each; behind them the same number for the normals at their corners.
#[derive(Serialize)]
struct Mesh {
    material: usize,
    triangles: usize,
    /// Bytes into `scene.bin`.
    offset: usize,
    /// The same of six floats a triangle: the places of its corners in the texture.
    #[serde(skip_serializing_if = "Option::is_none")]
    places: Option<usize>,
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
    let mut binary = Binary::default();
    let mut meshes = Vec::new();
    let mut textures = vec![None; scene.materials.len()];
    for (material, triangles) in by_material(scene)?.into_iter().enumerate() {
        if triangles.points.is_empty() {
            continue;
        }
        let count = triangles.points.len() / 3;
        let vectors = triangles.points.iter().chain(&triangles.normals);
        let offset = binary.push(vectors.flat_map(|v| [v.x, v.y, v.z]));
        let texture = scene
            .materials
            .get(material)
            .and_then(|m| m.texture.as_ref());
        let places = texture.map(|_| binary.push(triangles.places.into_iter().flatten()));
        if let (Some(texture), Some(place)) = (texture, textures.get_mut(material)) {
            *place = Some(binary.texture(texture));
        }
        meshes.push(Mesh {
            material,
            triangles: count,
            offset,
            places,
        });
    }
    let lights = setup.rig.lights.iter().map(light);
    let file = SceneFile {
        schema: SCHEMA,
        materials: scene
            .materials
            .iter()
            .zip(textures)
            .map(|(material, texture)| MaterialRow {
                name: &material.name,
                reflectance: material.reflectance.0,
                texture,
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
    Ok((json, binary.0))
}

/// Bytes that a setup's textures take in `scene.bin`.
pub fn texture_bytes(setup: &Setup) -> usize {
    let textures = setup
        .scene
        .materials
        .iter()
        .filter_map(|m| m.texture.as_ref());
    let sizes = textures.map(|texture| texture.pixels.size());
    sizes
        .map(|[width, height]| TEXEL_BYTES * width * height)
        .sum()
}

/// The numbers of `scene.bin`.
#[derive(Default)]
struct Binary(Vec<u8>);

impl Binary {
    /// Numbers, and where they begin.
    fn push(&mut self, numbers: impl Iterator<Item = f64>) -> usize {
        let offset = self.0.len();
        for number in numbers {
            self.0.extend_from_slice(&(number as f32).to_le_bytes());
        }
        offset
    }

    fn texture(&mut self, texture: &Texture) -> TextureRow {
        let [width, height] = texture.pixels.size();
        TextureRow {
            width,
            height,
            offset: self.push(texture.texels().flatten()),
            wrap: texture.wrap.map(|wrap| match wrap {
                Wrap::Repeat => "repeat",
                Wrap::Mirror => "mirror",
                Wrap::Clamp => "clamp",
            }),
            cut: texture.is_cut(),
        }
    }
}

fn unwritten(what: &str) -> String {
    format!("the scene has {what}, which is not written for outside renderers")
}

/// Three points a triangle, and at each the normal and the place in the texture.
#[derive(Clone, Default)]
struct Triangles {
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    places: Vec<[f64; 2]>,
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
            let shading = polygon.shading.as_ref();
            self.normals
                .push(shading.map_or(flat, |shading| shading.normal(corner, flat)));
            self.places
                .push(shading.map_or([0.5; 2], |shading| shading.place(corner)));
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
