//! A stage's file to a [`Scene`] and its lights, whatever its format.
//!
//! The first bytes and the ending of the name distinguish OBJ from glTF. What both share stands
//! here: the limits, the errors, the merging of triangles, and the summary of what was done to the
//! file's polygons. Invariants: a file that is refused leaves nothing behind; memory and time are
//! bounded by the limits here, not by counts that a file claims. This module does not depend on
//! shows.

use std::ops::RangeInclusive;
use std::sync::Arc;

use super::gltf;
use super::obj;
use super::{Camera, Lamp, Polygon, Scene, merge};
use footlight_host::files::{FileError, Files};
use footlight_show::geometry::{Place, Vec3, diameter, vec3};

/// The most polygons a stage may have, after bent ones are cut.
pub const POLYGON_LIMIT: usize = 2_000_000;
/// The most vertices a file may define, and the most corners its faces may have together.
pub const VERTEX_LIMIT: usize = 8_000_000;
/// The largest coordinate, metres: products of such lengths stay far from overflow.
pub const FAR: f64 = 1e9;

/// How far above 1 a reflectance may be and still count as 1: rounding of the program that wrote it.
const REFLECTANCE_ROUNDING: f64 = 1e-3;

/// The reflectance that a file means by `value`; `None` outside 0 to 1.
pub(super) fn reflectance(value: f64) -> Option<f64> {
    let range = -REFLECTANCE_ROUNDING..=1.0 + REFLECTANCE_ROUNDING;
    range.contains(&value).then_some(value.clamp(0.0, 1.0))
}

/// Sizes of a stage that are not doubted, metres.
const STAGE_SIZES: RangeInclusive<f64> = 0.1..=1000.0;
/// Things left out that are told where nothing else is there.
const SAID: usize = 8;

/// Why a stage could not be imported.
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
        /// What is wrong with it.
        reason: String,
    },
    /// A part of a glTF file is wrong.
    #[error("`{path}` {place}: {reason}")]
    Part {
        /// The glTF file.
        path: String,
        /// Which part, as `mesh 3 "Chair" primitive 0`; counted from 0, as the file does.
        place: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A glTF file needs an extension that is not known.
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
        /// What it has and is left out, in words that go on from the path's.
        left_out: String,
    },
}

/// How a file is to be taken.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The file's own up axis is Z; without it Y, as glTF and most OBJ files have it.
    pub z_up: bool,
    /// Materials that glTF calls double-sided, or whose texture cuts them out, get a front only.
    pub one_sided: bool,
    /// Where it stands and how large it is.
    pub place: Place,
    /// Groups and objects of an OBJ file that become materials of their own, by name.
    pub parts: Vec<String>,
}

/// A file as imported.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// All that light meets.
    pub scene: Scene,
    /// Lights of the file, in its order. None shines until a show names it.
    pub lamps: Vec<Lamp>,
    /// Cameras of the file, in its order.
    pub cameras: Vec<Camera>,
    /// What was done to it.
    pub summary: Summary,
}

/// What an import did to a file's polygons.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Faces with an area, as the file has them.
    pub faces: usize,
    /// Faces without an area, left out.
    pub dropped: usize,
    /// Bent faces, cut into triangles.
    pub bent: usize,
    /// Coplanar triangles that lost their common edges.
    pub merged: usize,
    /// The polygons that they became.
    pub merged_to: usize,
    /// Backs added for double-sided materials and those that are cut out.
    pub backs: usize,
    /// What the file has and this program leaves out, a sentence each.
    pub left_out: Vec<String>,
}

/// Reads the stage `path` through `files`: glTF (`.gltf`, `.glb`, or anything that begins as a GLB
/// does) or else OBJ, images within `memory` bytes. Neighbouring triangles of one plane and one
/// material become polygons ([`merge`]).
///
/// # Errors
/// [`SceneError`], with the place in the file.
pub fn read(
    files: &dyn Files,
    path: &str,
    options: &Options,
    memory: usize,
) -> Result<Import, SceneError> {
    let bytes = files.read(path)?;
    let lower = path.to_ascii_lowercase();
    let is_gltf =
        bytes.starts_with(b"glTF") || [".gltf", ".glb"].iter().any(|e| lower.ends_with(e));
    let mut import = if is_gltf {
        let mut import = gltf::import(files, path, &bytes, &options.parts, memory)?;
        if options.z_up {
            import.turn(|v| vec3(v.x, v.z, -v.y));
        }
        import
    } else {
        obj::parse(files, path, &bytes, options, memory)?
    };
    if options.place != Place::default() {
        import.put(&options.place, path)?;
    }
    let corners = import.scene.polygons.iter().flat_map(|p| p.vertices.iter());
    let extent = diameter(corners);
    if extent > 0.0 && !STAGE_SIZES.contains(&extent) {
        let note = format!(
            "its size, {extent:.3} m from corner to corner: `scale` says what a unit of the file is, \
             such as `scale 1mm`"
        );
        import.summary.left_out.push(note);
    }
    let size = import.scene.polygons.len();
    let merged = merge::triangles(std::mem::take(&mut import.scene.polygons));
    import.summary.merged = merged.before;
    import.summary.merged_to = merged.before + merged.polygons.len() - size;
    import.scene.polygons = merged.polygons;
    import.scene.number_sheets();
    if !options.one_sided {
        import.summary.backs = add_backs(&mut import.scene, &import.double_sided);
    }
    limited(path, import)
}

impl gltf::Imported {
    /// Turns all of it.
    fn turn(&mut self, by: impl Fn(Vec3) -> Vec3) {
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

    /// Puts all of it where it belongs.
    fn put(&mut self, place: &Place, path: &str) -> Result<(), SceneError> {
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
                reason: gltf::FAR_AWAY.to_owned(),
            })
        } else {
            Ok(())
        }
    }
}

/// The import, unless it holds nothing or too much.
fn limited(path: &str, import: gltf::Imported) -> Result<Import, SceneError> {
    let path = path.to_owned();
    match import.scene.polygons.len() {
        0 => {
            let left_out = import.summary.left_out.iter().take(SAID);
            let left_out = left_out.map(|what| format!("; left out: {what}")).collect();
            Err(SceneError::Empty { path, left_out })
        }
        1..=POLYGON_LIMIT => Ok(Import {
            scene: import.scene,
            lamps: import.lamps,
            cameras: import.cameras,
            summary: import.summary,
        }),
        _ => Err(SceneError::Part {
            path,
            place: "in all".to_owned(),
            reason: gltf::limit("polygons", POLYGON_LIMIT),
        }),
    }
}

/// Gives polygons of the materials that are `double_sided` a back. How many there are.
fn add_backs(scene: &mut Scene, double_sided: &[bool]) -> usize {
    let two_sided = |(_, p): &(usize, &Polygon)| double_sided.get(p.material) == Some(&true);
    let polygons = scene.polygons.iter().enumerate();
    let fronts: Vec<usize> = polygons.filter(two_sided).map(|(i, _)| i).collect();
    scene.add_backs(&fronts);
    fronts.len()
}
