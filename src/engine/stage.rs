//! Inspection of a stage's file.

use super::Error;
use footlight_host::files::Files;
use footlight_show::units::Rgb;
use footlight_stage::import;
use footlight_stage::stage_file::{ImportSummary, Options};
use footlight_stage::texture::Alpha;
use footlight_stage::{LampShape, Scene};

/// A stage's file read with default options.
#[derive(Clone, Debug)]
pub struct StageFile {
    /// Least and greatest coordinates of its polygons, metres, Z up.
    pub extent: [[f64; 3]; 2],
    /// Statistics of the import.
    pub summary: ImportSummary,
    /// Number of polygons after import, including backs.
    pub polygons: usize,
    /// In the order of the file.
    pub materials: Vec<StageMaterial>,
    /// Lights by name.
    pub lights: Vec<(String, LampShape)>,
    /// Names of its cameras.
    pub cameras: Vec<String>,
}

/// A material of a stage's file.
#[derive(Clone, Debug)]
pub struct StageMaterial {
    /// Its name.
    pub name: String,
    /// Reflectance; the mean for a texture, and that of its gloss for a metal.
    pub reflectance: Rgb,
    /// Roughness of its gloss, 0 to 1, and true for a metal.
    pub gloss: Option<(f64, bool)>,
    /// Emitted luminance, cd/m2.
    pub luminance: f64,
    /// Total area of its polygons, m².
    pub area: f64,
    /// Columns and rows of its texture; `None` without an image.
    pub texture: Option<[usize; 2]>,
    /// Kind of transparency; [`Alpha::Opaque`] for an opaque one.
    pub alpha: Alpha,
}

impl StageFile {
    /// Reads the file at `path` in about `memory` bytes at most.
    ///
    /// # Errors
    /// [`Error::Stage`] when it cannot be read.
    pub fn read(files: &dyn Files, path: &str, memory: usize) -> Result<StageFile, Error> {
        let import::Import {
            scene,
            lamps,
            cameras,
            summary,
        } = import::read(files, path, &Options::default(), memory)?;
        let corners = || scene.polygons.iter().flat_map(|p| p.vertices.iter());
        let first = corners().next().copied().unwrap_or_default();
        let low = corners().fold(first, |low, v| low.min(*v));
        let high = corners().fold(first, |high, v| high.max(*v));
        Ok(StageFile {
            extent: [low, high].map(|v| [v.x, v.y, v.z]),
            polygons: scene.polygons.len(),
            materials: StageMaterial::all(&scene),
            lights: lamps.into_iter().map(|l| (l.name, l.shape)).collect(),
            cameras: cameras.into_iter().map(|c| c.name).collect(),
            summary,
        })
    }
}

impl StageMaterial {
    /// The materials of a scene, in its order.
    pub fn all(scene: &Scene) -> Vec<StageMaterial> {
        let areas = scene.areas();
        let materials = scene.materials.iter().zip(areas);
        let described = materials.map(|(material, area)| StageMaterial {
            name: material.name.clone(),
            reflectance: match &material.gloss {
                Some(gloss) if gloss.is_metal => gloss.normal,
                _ => material.reflectance,
            },
            gloss: material.gloss.as_ref().map(|g| (g.roughness, g.is_metal)),
            luminance: material.emission.luminance(),
            area,
            texture: material
                .texture
                .as_ref()
                .map(|texture| texture.pixels.size())
                .filter(|size| *size != [1, 1]),
            alpha: material.alpha(),
        });
        described.collect()
    }
}
