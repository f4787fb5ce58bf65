//! The scene files of an external renderer: `scene.json`, which refers to numbers in `scene.bin`
//! (32-bit floats, little-endian). The manual's page `renderer` specifies the format.

use std::f64::consts::TAU;

use serde::Serialize;

use crate::Setup;
use footlight_show::geometry::mount::Mount;
use footlight_show::geometry::polygon::triangles;
use footlight_show::geometry::profile::Profile;
use footlight_show::geometry::{Vec3, newell};
use footlight_show::units::Rgb;
use footlight_stage::texture::{Texture, Wrap};
use footlight_stage::{Light, MeasuredLight, Polygon, Projection, Scene};

/// Version of the `scene.json` format.
pub const SCHEMA: u32 = 1;
/// Version with haze, which a program that supports only the first version must not ignore
/// silently.
const SCHEMA_OF_HAZE: u32 = 2;

const TEXEL_BYTES: usize = 4 * size_of::<f32>();

/// Steps of an intensity table from the axis to the end of the light.
const STEPS: u32 = 256;
/// Steps of an intensity table around the axis.
const TURN: u32 = 360;

#[derive(Serialize)]
struct SceneFile<'a> {
    schema: u32,
    materials: Vec<MaterialRow<'a>>,
    /// One for each material that has polygons.
    meshes: Vec<Mesh>,
    lights: Vec<LightRow>,
    sources: Vec<SourceRow<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    haze: Option<HazeRow>,
}

/// A medium that fills all space.
#[derive(Serialize)]
struct HazeRow {
    /// Scattering plus absorption, 1/m.
    extinction: f64,
    /// Share of the extinction that scatters.
    albedo: f64,
    /// Mean cosine of the phase function of Henyey and Greenstein.
    forward: f64,
}

#[derive(Serialize)]
struct MaterialRow<'a> {
    name: &'a str,
    reflectance: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    texture: Option<TextureRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gloss: Option<GlossRow>,
}

/// Specular reflection of a material.
#[derive(Serialize)]
struct GlossRow {
    roughness: f64,
    /// Reflectance at normal incidence.
    normal: [f64; 3],
    metal: bool,
}

/// An image with four floats per texel, row by row from the top: reflectance and opacity.
#[derive(Clone, Serialize)]
struct TextureRow {
    width: usize,
    height: usize,
    /// Offset in `scene.bin`, bytes.
    offset: usize,
    /// Horizontal and vertical extension: `repeat`, `mirror` or `clamp`.
    wrap: [&'static str; 2],
    /// True when some texel lets light pass.
    cut: bool,
}

/// Triangles, nine floats each, followed by nine floats each for the normals at their corners.
#[derive(Serialize)]
struct Mesh {
    material: usize,
    triangles: usize,
    /// Offset in `scene.bin`, bytes.
    offset: usize,
    /// Offset of the texture coordinates, six floats for each triangle.
    #[serde(skip_serializing_if = "Option::is_none")]
    places: Option<usize>,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum LightRow {
    /// An emitting material.
    Panel { material: usize, radiance: [f64; 3] },
    /// A point source with axial symmetry: candela in each channel, and relative intensities at
    /// equal steps of the angle from 0 to `end`, radians.
    Spot {
        position: [f64; 3],
        aim: [f64; 3],
        intensity: [f64; 3],
        end: f64,
        shares: Vec<f64>,
    },
    /// A point source with a table of relative intensities: rows from the axis to `end`, columns
    /// once around it, from the right through `up` back to the right.
    Measured {
        position: [f64; 3],
        aim: [f64; 3],
        up: [f64; 3],
        intensity: [f64; 3],
        end: f64,
        table: Grid,
    },
    /// A point source that projects an image: relative intensities in a frustum with these tangents
    /// to the right and upwards.
    Projection {
        position: [f64; 3],
        aim: [f64; 3],
        up: [f64; 3],
        intensity: [f64; 3],
        half: [f64; 2],
        image: Grid,
    },
}

/// Numbers row by row from the top.
#[derive(Serialize)]
struct Grid {
    width: usize,
    height: usize,
    /// Offset in `scene.bin`, bytes.
    offset: usize,
}

#[derive(Serialize)]
struct SourceRow<'a> {
    name: &'a str,
    /// Index of a light, and its factor in each channel.
    emitters: Vec<(usize, [f64; 3])>,
}

/// Both files of a setup.
///
/// # Errors
/// Describes the part of the setup that the format cannot express.
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
    let lights = setup.rig.lights.iter();
    let lights = lights.map(|light| binary.light(light));
    let lights: Vec<LightRow> = lights.collect::<Result<_, _>>().map_err(unwritten)?;
    let file = SceneFile {
        schema: scene.haze.map_or(SCHEMA, |_| SCHEMA_OF_HAZE),
        materials: scene
            .materials
            .iter()
            .zip(textures)
            .map(|(material, texture)| MaterialRow {
                name: &material.name,
                reflectance: material.reflectance.0,
                texture,
                gloss: material.gloss.as_ref().map(|gloss| GlossRow {
                    roughness: gloss.roughness,
                    normal: gloss.normal.0,
                    metal: gloss.is_metal,
                }),
            })
            .collect(),
        meshes,
        lights,
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
        haze: scene.haze.map(|haze| HazeRow {
            extinction: haze.extinction,
            albedo: haze.albedo,
            forward: haze.forward,
        }),
    };
    let json = serde_json::to_vec(&file).map_err(|error| error.to_string())?;
    Ok((json, binary.0))
}

/// Bytes of a setup's images and tables in `scene.bin`.
pub fn image_bytes(setup: &Setup) -> usize {
    let textures = setup.scene.materials.iter().filter_map(|material| {
        let [width, height] = material.texture.as_ref()?.pixels.size();
        Some(TEXEL_BYTES * width * height)
    });
    let lights = setup.rig.lights.iter().filter_map(|light| match light {
        Light::Projection(projection) => {
            let (width, height) = projection.gobo.size();
            Some(size_of::<f32>() * width * height)
        }
        _ => None,
    });
    textures.chain(lights).sum()
}

/// Contents of `scene.bin`.
#[derive(Default)]
struct Binary(Vec<u8>);

impl Binary {
    /// Appends numbers; returns their offset.
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

/// Three points per triangle, with normals and texture coordinates.
#[derive(Clone, Default)]
struct Triangles {
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    places: Vec<[f64; 2]>,
}

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
    /// Adds the triangles of a polygon, with shading normals; `None` if it cannot be triangulated.
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

/// A point source with axial symmetry.
fn spot(
    position: Vec3,
    aim: Vec3,
    intensity: Rgb,
    end: f64,
    share: impl Fn(f64) -> f64,
) -> LightRow {
    let at = |step| share(end * f64::from(step) / f64::from(STEPS));
    LightRow::Spot {
        position: point(position),
        aim: point(aim),
        intensity: intensity.0,
        end,
        shares: (0..=STEPS).map(at).collect(),
    }
}

/// Unit up vector of a light that looks along its axis.
fn up(mount: &Mount) -> Result<[f64; 3], &'static str> {
    let axes = mount.axes().ok_or("a light that is aimed at itself")?;
    Ok(point(axes.up))
}

impl Binary {
    /// A light in the file's format, or the feature that the format cannot express.
    fn light(&mut self, light: &Light) -> Result<LightRow, &'static str> {
        match light {
            Light::Panel { material, radiance } => Ok(LightRow::Panel {
                material: *material,
                radiance: radiance.0,
            }),
            Light::Spot(light) => {
                let Some(profile) = Profile::new(light.beam, light.field) else {
                    return Err("a beam without light");
                };
                let (position, aim, peak) = (light.position, light.aim, light.intensity);
                let share = |angle| profile.share(angle);
                Ok(spot(position, aim, peak, profile.end(), share))
            }
            Light::Measured(measured) => self.measured(measured),
            Light::Projection(projection) => self.projection(projection),
            Light::Image(_) => Err("a bank given as an image"),
            Light::Bounced(_) => Err("the reflected light of a moving head"),
        }
    }

    /// A photometric file with axial symmetry becomes a table like a spot's.
    fn measured(&mut self, measured: &MeasuredLight) -> Result<LightRow, &'static str> {
        let MeasuredLight {
            mount,
            distribution,
            factor,
        } = measured;
        let parts = distribution.parts();
        let end = parts.vertical.last().copied().unwrap_or(0.0).to_radians();
        if parts.horizontal.len() <= 1 {
            let share = |angle| distribution.intensity(angle, 0.0);
            return Ok(spot(mount.position, mount.aim, *factor, end, share));
        }
        let rows = (0..=STEPS).map(|row| end * f64::from(row) / f64::from(STEPS));
        let offset = self.push(rows.flat_map(|angle| {
            let around = |column| f64::from(column) * TAU / f64::from(TURN);
            (0..=TURN).map(move |column| distribution.intensity(angle, around(column)))
        }));
        Ok(LightRow::Measured {
            position: point(mount.position),
            aim: point(mount.aim),
            up: up(mount)?,
            intensity: factor.0,
            end,
            table: Grid {
                width: TURN as usize + 1,
                height: STEPS as usize + 1,
                offset,
            },
        })
    }

    fn projection(&mut self, projection: &Projection) -> Result<LightRow, &'static str> {
        let image = projection
            .gobo
            .image()
            .ok_or("a projection without an image")?;
        let (width, height) = image.size();
        let plane = image.data().iter().skip(projection.plane).step_by(3);
        Ok(LightRow::Projection {
            position: point(projection.mount.position),
            aim: point(projection.mount.aim),
            up: up(&projection.mount)?,
            intensity: projection.intensity.0,
            half: Projection::half_size(&projection.gobo, projection.field),
            image: Grid {
                width,
                height,
                offset: self.push(plane.map(|share| f64::from(*share))),
            },
        })
    }
}

fn point(p: Vec3) -> [f64; 3] {
    [p.x, p.y, p.z]
}
