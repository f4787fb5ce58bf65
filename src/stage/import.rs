//! Imports a stage's file of any format to a [`Scene`] and its lights.
//!
//! The first bytes and the extension distinguish OBJ from glTF. Invariants: a refused file has no
//! effect; memory and time are bounded by the limits of [`stage_file`](crate::stage_file), not by
//! counts that a file claims. This module does not depend on shows.

use std::ops::RangeInclusive;

use super::stage_file::{ImportSummary, Imported, Options, POLYGON_LIMIT, SceneError, limit};
use super::{Lamp, Polygon, Scene, StageCamera, gltf, merge, obj};
use footlight_host::files::Files;
use footlight_show::geometry::{Place, diameter, vec3};

/// Extensions of the files that [`read`] reads.
pub const ENDINGS: &[&str] = &["obj", "gltf", "glb"];
/// Plausible sizes of a stage, metres.
const STAGE_SIZES: RangeInclusive<f64> = 0.1..=1000.0;
/// Most omissions listed for a file without polygons.
const SAID: usize = 8;

/// An imported file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// All surfaces.
    pub scene: Scene,
    /// Lights of the file, in its order. They shine only when a show names them.
    pub lamps: Vec<Lamp>,
    /// Cameras of the file, in its order.
    pub cameras: Vec<StageCamera>,
    /// Statistics of the import.
    pub summary: ImportSummary,
}

/// Reads the stage `path` through `files`: glTF (`.gltf`, `.glb`, or a content that begins like a
/// GLB), else OBJ; images within `memory` bytes. Neighbouring coplanar triangles of one material
/// are merged to polygons.
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
        let mut import = gltf::import(files, path, &bytes, options, memory)?;
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

/// The import, unless it is empty or too large.
fn limited(path: &str, import: Imported) -> Result<Import, SceneError> {
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
            reason: limit("polygons", POLYGON_LIMIT),
        }),
    }
}

/// Gives polygons of `double_sided` materials a back, and returns their number.
fn add_backs(scene: &mut Scene, double_sided: &[bool]) -> usize {
    let two_sided = |(_, p): &(usize, &Polygon)| double_sided.get(p.material) == Some(&true);
    let polygons = scene.polygons.iter().enumerate();
    let fronts: Vec<usize> = polygons.filter(two_sided).map(|(i, _)| i).collect();
    scene.add_backs(&fronts);
    fronts.len()
}
