//! Meshes: from primitives of all modes to triangles that stand where their nodes put them.

use std::collections::BTreeMap;
use std::rc::Rc;

use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;

use super::container::Document;
use super::node::Placed;
use super::{
    FAR, Fault, Imported, LeftOut, PartError, TRIANGLE_LIMIT, VERTEX_LIMIT, accessor, entry, place,
};
use crate::geometry::Vec3;
use crate::scene::{Polygon, polygon};

/// A primitive decoded.
struct Drawn {
    triangles: Vec<[Vec3; 3]>,
    material: usize,
}

/// Meshes of a document, each decoded once.
pub struct Meshes<'d> {
    document: &'d Document<'d>,
    decoded: BTreeMap<usize, Rc<Vec<Drawn>>>,
    positions: BTreeMap<usize, Rc<Vec<Vec3>>>,
    /// Vertices decoded.
    vertices: usize,
    /// Triangles drawn; a primitive counts as one at least, so that no number of instances of
    /// nothing takes time.
    triangles: usize,
}

impl<'d> Meshes<'d> {
    pub fn new(document: &'d Document<'d>) -> Meshes<'d> {
        Meshes {
            document,
            decoded: BTreeMap::new(),
            positions: BTreeMap::new(),
            vertices: 0,
            triangles: 0,
        }
    }

    /// Adds an instance of a mesh.
    pub fn place(
        &mut self,
        index: usize,
        placed: &Placed<'_>,
        to: &mut Imported,
        left_out: &mut LeftOut,
    ) -> Result<(), Fault> {
        let mesh = self.decode(index, placed, left_out)?;
        if placed.node.skin.is_some() {
            left_out.insert("skins: their meshes stand as modelled".to_owned());
        }
        let mirrors = placed.transform.mirrors();
        for drawn in mesh.iter() {
            self.spend(drawn.triangles.len().max(1), placed)?;
            for &[a, b, c] in &drawn.triangles {
                let corners = if mirrors { [a, c, b] } else { [a, b, c] };
                let vertices = corners.map(|v| placed.transform.point(v).y_up_to_z_up());
                let near = |v: &Vec3| v.x.abs().max(v.y.abs()).max(v.z.abs()) <= FAR;
                if !vertices.iter().all(|v| v.is_finite() && near(v)) {
                    return Err(Fault::new(placed.place(), PartError::Far));
                }
                if !polygon::has_area(&vertices) {
                    to.summary.dropped += 1;
                    continue;
                }
                to.summary.faces += 1;
                to.scene.polygons.push(Polygon {
                    vertices: vertices.to_vec(),
                    material: drawn.material,
                });
            }
        }
        Ok(())
    }

    fn spend(&mut self, triangles: usize, placed: &Placed<'_>) -> Result<(), Fault> {
        self.triangles = self.triangles.saturating_add(triangles);
        if self.triangles > TRIANGLE_LIMIT {
            let limit = PartError::Limit("triangles", TRIANGLE_LIMIT);
            return Err(Fault::new(placed.place(), limit));
        }
        Ok(())
    }

    fn decode(
        &mut self,
        index: usize,
        placed: &Placed<'_>,
        left_out: &mut LeftOut,
    ) -> Result<Rc<Vec<Drawn>>, Fault> {
        if let Some(known) = self.decoded.get(&index) {
            return Ok(Rc::clone(known));
        }
        let mesh = entry(&self.document.root.meshes, index, "mesh", || placed.place())?;
        let mut all = Vec::new();
        let mut decoded = 0;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let at = || format!("{} primitive {i}", place("mesh", index, mesh.name.as_ref()));
            if let Some(drawn) = self.primitive(primitive, at, left_out)? {
                decoded += drawn.triangles.len();
                if decoded > TRIANGLE_LIMIT {
                    let limit = PartError::Limit("triangles", TRIANGLE_LIMIT);
                    return Err(Fault::new(at(), limit));
                }
                all.push(drawn);
            }
        }
        let all = Rc::new(all);
        self.decoded.insert(index, Rc::clone(&all));
        Ok(all)
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        at: impl Fn() -> String,
        left_out: &mut LeftOut,
    ) -> Result<Option<Drawn>, Fault> {
        let fault = |e| Fault::new(at(), e);
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => {
                mode
            }
            Checked::Valid(_) => {
                left_out.insert("points and lines: they have no area".to_owned());
                return Ok(None);
            }
            Checked::Invalid => return Err(fault(PartError::Lacks("known mode"))),
        };
        if primitive.targets.iter().flatten().next().is_some() {
            left_out.insert("morph targets: meshes stand as modelled".to_owned());
        }
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic));
        if attribute(Semantic::Colors(0)).is_some() {
            left_out.insert("colours of vertices: their materials' count".to_owned());
        }
        let Some(positions) = attribute(Semantic::Positions) else {
            // A primitive without positions draws nothing, says the specification.
            left_out.insert("primitives without positions".to_owned());
            return Ok(None);
        };
        let positions = self.positions(positions.value())?;
        let count = positions.len();
        let corner = |index: u32| {
            let index = index as usize;
            let what = "vertex";
            let missing = || fault(PartError::Missing { what, index, count });
            positions.get(index).copied().ok_or_else(missing)
        };
        let corners = match primitive.indices {
            Some(index) => {
                let indices = accessor::indices(self.document, index.value())?.into_iter();
                indices.map(corner).collect::<Result<Vec<Vec3>, Fault>>()?
            }
            None => positions.to_vec(),
        };
        let materials = &self.document.root.materials;
        let material = match primitive.material {
            Some(material) => {
                entry(materials, material.value(), "material", at)?;
                material.value()
            }
            // The last one, which has no entry in the file.
            None => materials.len(),
        };
        Ok(Some(Drawn {
            triangles: triangles(mode, &corners),
            material,
        }))
    }

    fn positions(&mut self, index: usize) -> Result<Rc<Vec<Vec3>>, Fault> {
        if let Some(known) = self.positions.get(&index) {
            return Ok(Rc::clone(known));
        }
        let positions = accessor::positions(self.document, index)?;
        let at = || place("accessor", index, None);
        self.vertices += positions.len();
        if self.vertices > VERTEX_LIMIT {
            return Err(Fault::new(at(), PartError::Limit("vertices", VERTEX_LIMIT)));
        }
        if !positions.iter().all(|p| p.is_finite()) {
            return Err(Fault::new(at(), PartError::Far));
        }
        let positions = Rc::new(positions);
        self.positions.insert(index, Rc::clone(&positions));
        Ok(positions)
    }
}

/// The triangles of a primitive, each counter-clockwise as the mode has it. Corners too few for a
/// triangle are left over.
fn triangles(mode: Mode, corners: &[Vec3]) -> Vec<[Vec3; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let edges = corners.iter().zip(corners.iter().skip(1));
            let triangles = edges.zip(corners.iter().skip(2)).enumerate();
            let turned = |(i, ((a, b), c)): (usize, ((&Vec3, &Vec3), &Vec3))| match i % 2 {
                0 => [*a, *b, *c],
                _ => [*a, *c, *b],
            };
            triangles.map(turned).collect()
        }
        Mode::TriangleFan => {
            let Some((hub, rim)) = corners.split_first() else {
                return Vec::new();
            };
            let pairs = rim.iter().zip(rim.iter().skip(1));
            pairs.map(|(a, b)| [*a, *b, *hub]).collect()
        }
        _ => corners.as_chunks::<3>().0.to_vec(),
    }
}
