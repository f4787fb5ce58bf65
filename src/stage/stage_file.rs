//! Shared by the readers of all formats: options, limits, errors, and the imported data.

use super::{Gloss, Lamp, Material, Scene, StageCamera};
use footlight_host::files::FileError;
use footlight_show::geometry::{Place, Vec3};
use footlight_show::units::Rgb;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most polygons of a stage, after bent ones are cut.
pub const POLYGON_LIMIT: usize = 2_000_000;
/// Most vertices of a file, and most corners of its faces together.
pub const VERTEX_LIMIT: usize = 8_000_000;
/// Largest coordinate, metres: products of such lengths stay far from overflow.
pub const FAR: f64 = 1e9;

/// Rounding by which a number may exceed its range and count as the end of the range.
const ROUNDING: f64 = 1e-3;

/// Highest roughness that becomes gloss. A rougher surface looks matt, which takes a fraction of
/// the time.
pub(crate) const ROUGHEST: f64 = 0.4;

/// The reflectance for `value`; `None` outside 0 to 1.
pub(crate) fn reflectance(value: f64) -> Option<f64> {
    let range = -ROUNDING..=1.0 + ROUNDING;
    range.contains(&value).then_some(value.clamp(0.0, 1.0))
}

/// Reflectance of surfaces without a material. glTF's default is one, at which a closed room never
/// gets dark.
pub(crate) const UNSTATED: f64 = 0.8;

/// Reason for refusing a vertex.
pub(crate) const FAR_AWAY: &str = "a coordinate is not finite, or beyond 1e9 metres";

/// Reason for refusing too much of something.
pub(crate) fn limit(what: &str, most: usize) -> String {
    format!("more than {most} {what}")
}

/// Options of an import.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// True when the file's up axis is Z; otherwise it is Y, as in glTF and most OBJ files.
    pub z_up: bool,
    /// True when double-sided and cut-out materials of glTF get a front only.
    pub one_sided: bool,
    /// True when no material is glossy, whatever the file says.
    pub matt: bool,
    /// Its scale and placement.
    pub place: Place,
    /// Groups and objects of an OBJ file that become separate materials, by name.
    pub parts: Vec<String>,
}

/// Error of importing a stage.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file itself could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line of an OBJ or MTL file is wrong.
    #[error("`{path}` line {line}: {reason}")]
    Line {
        /// The OBJ or MTL file.
        path: String,
        /// Counted from 1.
        line: usize,
        /// The fault.
        reason: String,
    },
    /// A part of a glTF file is wrong.
    #[error("`{path}` {place}: {reason}")]
    Part {
        /// The glTF file.
        path: String,
        /// The part, such as `mesh 3 "Chair" primitive 0`; counted from 0, as in the file.
        place: String,
        /// The fault.
        reason: String,
    },
    /// A glTF file requires an unknown extension.
    #[error("`{path}` JSON: it needs the extension `{name}`, which this program does not know")]
    Extension {
        /// The glTF file.
        path: String,
        /// The extension.
        name: String,
    },
    /// The file has no polygon with an area.
    #[error("`{path}` has no polygons{left_out}")]
    Empty {
        /// The file.
        path: String,
        /// Contents of the file that are not read, as a continuation of a sentence that begins with
        /// the path.
        left_out: String,
    },
}

/// Statistics of an import.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportSummary {
    /// Faces with an area in the file.
    pub faces: usize,
    /// Faces without an area, left out.
    pub dropped: usize,
    /// Bent faces, cut into triangles.
    pub bent: usize,
    /// Coplanar triangles that lost their common edges.
    pub merged: usize,
    /// The polygons that replaced them.
    pub merged_to: usize,
    /// Backs added for double-sided and cut-out materials.
    pub backs: usize,
    /// Contents of the file that are not read, one sentence each.
    pub left_out: Vec<String>,
}

/// Gloss of a file's material, in the terms of glTF.
pub(crate) struct Finish {
    /// 0 to 1.
    pub roughness: f64,
    /// Share that is metal, 0 to 1.
    pub metallic: f64,
    /// Reflectance at normal incidence of the rest.
    pub normal: [f64; 3],
}

impl Material {
    /// Gives a material the gloss of its file. A metal reflects its colour in its gloss and nothing
    /// diffusely. A material stays matt when gloss would not be visible: it is rough, emits, or is
    /// clear.
    pub(crate) fn polish(&mut self, finish: Finish) {
        let metallic = finish.metallic.clamp(0.0, 1.0);
        let mut normal = finish.normal.map(|n| n.clamp(0.0, 1.0));
        for (normal, base) in normal.iter_mut().zip(self.reflectance.0) {
            *normal += metallic * (base - *normal);
        }
        let texture = self.texture.as_mut();
        let is_clear = texture
            .as_ref()
            .is_some_and(|t| t.factor.last() == Some(&0.0));
        let is_lit = self.emission != Rgb::default();
        if finish.roughness > ROUGHEST + ROUNDING || normal == [0.0; 3] || is_lit || is_clear {
            return;
        }
        self.reflectance = Rgb(self.reflectance.0.map(|c| c * (1.0 - metallic)));
        if let Some(texture) = texture {
            let colour = texture.factor.iter_mut().take(3);
            colour.for_each(|c| *c *= 1.0 - metallic);
        }
        self.gloss = Some(Gloss {
            roughness: finish.roughness.max(0.0),
            normal: Rgb(normal),
            is_metal: metallic >= 0.5,
        });
    }
}

/// Content of a file before triangles are merged and backs added.
#[derive(Debug, Default)]
pub(crate) struct Imported {
    pub scene: Scene,
    pub lamps: Vec<Lamp>,
    pub summary: ImportSummary,
    pub cameras: Vec<StageCamera>,
    /// One entry for each material.
    pub double_sided: Vec<bool>,
    /// Materials of parts that the show names.
    pub parts: BTreeMap<String, usize>,
}

impl Imported {
    /// The material for a part of the file: a copy of `material` when the show names the part and
    /// no material has that name, else `material`.
    pub(crate) fn part(&mut self, name: Option<&str>, material: usize, named: &[String]) -> usize {
        let is_named = |name: &&str| named.iter().any(|n| n == name);
        let Some(name) = name.filter(is_named) else {
            return material;
        };
        if let Some(own) = self.parts.get(name) {
            return *own;
        }
        if self.scene.materials.iter().any(|m| m.name == name) {
            return material;
        }
        let own = self.scene.materials.len();
        self.parts.insert(name.to_owned(), own);
        let like = self.scene.materials.get(material).cloned();
        let like = like.unwrap_or_else(|| Material::diffuse(name, Rgb([UNSTATED; 3])));
        let double_sided = self.double_sided.get(material).copied().unwrap_or(false);
        self.scene.materials.push(Material {
            name: name.to_owned(),
            ..like
        });
        self.double_sided.resize(own + 1, double_sided);
        own
    }

    /// Rotates everything.
    pub(crate) fn turn(&mut self, by: impl Fn(Vec3) -> Vec3) {
        for polygon in &mut self.scene.polygons {
            let vertices = Arc::make_mut(&mut polygon.vertices);
            vertices.iter_mut().for_each(|v| *v = by(*v));
            if let Some(shading) = &mut polygon.shading {
                shading.turn(&by);
            }
        }
        for lamp in &mut self.lamps {
            (lamp.position, lamp.direction) = (by(lamp.position), by(lamp.direction));
        }
        for camera in &mut self.cameras {
            camera.position = by(camera.position);
            (camera.direction, camera.up) = (by(camera.direction), by(camera.up));
        }
    }

    /// Scales and places everything.
    pub(crate) fn put(&mut self, place: &Place, path: &str) -> Result<(), SceneError> {
        self.turn(|v| place.direction(v));
        let (scale, at) = (place.scale, place.at);
        for polygon in &mut self.scene.polygons {
            let vertices = Arc::make_mut(&mut polygon.vertices);
            vertices.iter_mut().for_each(|v| *v = *v * scale + at);
            if let Some(shading) = &mut polygon.shading {
                shading.stretch(scale, at);
            }
        }
        let lamps = self.lamps.iter_mut().map(|lamp| &mut lamp.position);
        let cameras = self.cameras.iter_mut().map(|camera| &mut camera.position);
        lamps.chain(cameras).for_each(|p| *p = *p * scale + at);
        let far = |v: &Vec3| !v.is_finite() || v.x.abs().max(v.y.abs()).max(v.z.abs()) > FAR;
        let mut vertices = self.scene.polygons.iter().flat_map(|p| p.vertices.iter());
        if vertices.any(far) {
            Err(SceneError::Part {
                path: path.to_owned(),
                place: "as placed".to_owned(),
                reason: FAR_AWAY.to_owned(),
            })
        } else {
            Ok(())
        }
    }
}
