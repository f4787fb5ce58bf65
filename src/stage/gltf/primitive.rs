//! Meshes: turns primitives of all modes into triangles placed by their nodes.

use std::collections::BTreeMap;
use std::rc::Rc;

use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;

use super::container::Document;
use super::material::Places;
use super::node::{Affine, Placed};
use super::vertices::Vertices;
use super::{Fault, LeftOut, TRIANGLE_LIMIT, accessor, draco, entry, lacks, missing, place};
use crate::Polygon;
use crate::shading::{Corner, Shading};
use crate::stage_file::{FAR, FAR_AWAY, Imported, VERTEX_LIMIT, limit};
use footlight_show::geometry::polygon;

/// A decoded primitive.
struct Drawn {
    vertices: Vertices,
    triangles: Vec<[u32; 3]>,
    material: usize,
}

/// Meshes of a document, each decoded once.
pub struct Meshes<'d> {
    document: &'d Document<'d>,
    /// Texture coordinates of each material.
    places: &'d [Option<Places>],
    faults: &'d BTreeMap<usize, Fault>,
    decoded: BTreeMap<usize, Rc<Vec<Drawn>>>,
    triples: BTreeMap<usize, Rc<Vec<[f64; 3]>>>,
    /// Vertices decoded.
    vertices: usize,
    /// Triangles drawn. Each primitive counts as at least one, so that instances of empty
    /// primitives are limited too.
    triangles: usize,
}

impl<'d> Meshes<'d> {
    pub fn new(
        document: &'d Document<'d>,
        places: &'d [Option<Places>],
        faults: &'d BTreeMap<usize, Fault>,
    ) -> Meshes<'d> {
        Meshes {
            document,
            places,
            faults,
            decoded: BTreeMap::new(),
            triples: BTreeMap::new(),
            vertices: 0,
            triangles: 0,
        }
    }

    /// Adds an instance of a mesh, moved by `transform`.
    pub fn place(
        &mut self,
        index: usize,
        (placed, transform): (&Placed<'_>, &Affine),
        parts: &[String],
        to: &mut Imported,
        left_out: &mut LeftOut,
    ) -> Result<(), Fault> {
        let mesh = self.decode(index, placed, left_out)?;
        if placed.node.skin.is_some() {
            left_out.insert("skins: their meshes stand as modelled".to_owned());
        }
        let mirrors = transform.mirrors();
        let meshes = &self.document.root.meshes;
        let names = [
            placed.node.name.as_ref(),
            meshes.get(index).and_then(|m| m.name.as_ref()),
        ];
        let part = names
            .into_iter()
            .flatten()
            .find(|name| parts.contains(name));
        for drawn in mesh.iter() {
            self.spend(drawn.triangles.len().max(1), placed)?;
            let material = to.part(part.map(String::as_str), drawn.material, parts);
            for &[a, b, c] in &drawn.triangles {
                let order = if mirrors { [a, c, b] } else { [a, b, c] };
                let corners = order.map(|i| {
                    let own = drawn.vertices.corner(i);
                    Corner {
                        point: transform.point(own.point).y_up_to_z_up(),
                        normal: own.normal.map(|n| transform.normal(n).y_up_to_z_up()),
                        ..own
                    }
                });
                let vertices = corners.map(|c| c.point).to_vec();
                let near = |v: f64| v.abs() <= FAR;
                if !vertices.iter().all(|v| near(v.x) && near(v.y) && near(v.z)) {
                    return Err(Fault::new(placed.place(), FAR_AWAY));
                }
                if !polygon::has_area(&vertices) {
                    to.summary.dropped += 1;
                    continue;
                }
                to.summary.faces += 1;
                // Values at the corners of a triangle are always linear over it.
                let shading = Shading::of_corners(&corners).ok().flatten().map(Box::new);
                to.scene.polygons.push(Polygon {
                    shading,
                    ..Polygon::new(vertices, material)
                });
            }
        }
        Ok(())
    }

    fn spend(&mut self, triangles: usize, placed: &Placed<'_>) -> Result<(), Fault> {
        self.triangles = self.triangles.saturating_add(triangles);
        if self.triangles > TRIANGLE_LIMIT {
            let limit = limit("triangles", TRIANGLE_LIMIT);
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
                    let limit = limit("triangles", TRIANGLE_LIMIT);
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
            Checked::Invalid => return Err(fault(lacks("known mode"))),
        };
        if primitive.targets.iter().flatten().next().is_some() {
            left_out.insert("morph targets: meshes stand as modelled".to_owned());
        }
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic));
        if attribute(Semantic::Colors(0)).is_some() {
            left_out.insert("colours of vertices: their materials' count".to_owned());
        }
        if attribute(Semantic::Positions).is_none() {
            // By the specification, a primitive without positions draws nothing.
            left_out.insert("primitives without positions".to_owned());
            return Ok(None);
        }
        let materials = &self.document.root.materials;
        let material = match primitive.material {
            Some(material) => {
                entry(materials, material.value(), "material", &at)?;
                if let Some(fault) = self.faults.get(&material.value()) {
                    return Err(fault.clone());
                }
                material.value()
            }
            // The last material, which has no entry in the file.
            None => materials.len(),
        };
        let places = self.places.get(material).copied().flatten();
        let mut vertices = match draco::decode(self.document, primitive, places, &at)? {
            Some(vertices) => self.counted(vertices, &at)?,
            None => self.vertices(primitive, places, left_out)?,
        };
        let count = vertices.points.len();
        let corners = match vertices.indices.take() {
            Some(indices) => {
                if let Some(bad) = indices.iter().find(|i| **i as usize >= count) {
                    return Err(fault(missing("vertex", *bad as usize, count)));
                }
                indices
            }
            None => (0..count as u32).collect(),
        };
        Ok(Some(Drawn {
            vertices,
            triangles: triangles(mode, &corners),
            material,
        }))
    }

    /// Reads the vertices of a primitive from its accessors.
    fn vertices(
        &mut self,
        primitive: &Primitive,
        places: Option<Places>,
        left_out: &mut LeftOut,
    ) -> Result<Vertices, Fault> {
        let attribute = |semantic| {
            let found = primitive.attributes.get(&Checked::Valid(semantic));
            found.map(|index| index.value())
        };
        let points = attribute(Semantic::Positions);
        let points = points
            .map(|i| self.triple(i))
            .transpose()?
            .unwrap_or_default();
        if !points.iter().flatten().all(|v| v.is_finite()) {
            let index = attribute(Semantic::Positions).unwrap_or(0);
            return Err(Fault::new(place("accessor", index, None), FAR_AWAY));
        }
        let normals = attribute(Semantic::Normals).filter(|index| {
            let is_there = *index < self.document.root.accessors.len();
            if !is_there {
                left_out.insert(format!("normals: accessor {index} does not exist"));
            }
            is_there
        });
        let normals = normals.map(|i| self.triple(i)).transpose()?;
        let placed = places.and_then(|p| Some((p, attribute(Semantic::TexCoords(p.set))?)));
        let places = placed.map(|(places, index)| {
            let read = accessor::vectors::<2>(self.document, index)?;
            Ok(Rc::new(read.into_iter().map(|p| places.moved(p)).collect()))
        });
        let indices = primitive.indices;
        let indices = indices.map(|i| accessor::indices(self.document, i.value()));
        let vertices = Vertices {
            points,
            normals,
            places: places.transpose()?,
            indices: indices.transpose()?,
        };
        Ok(vertices)
    }

    /// Counts decoded vertices against the limit.
    fn counted(&mut self, vertices: Vertices, at: impl Fn() -> String) -> Result<Vertices, Fault> {
        self.vertices += vertices.points.len();
        if self.vertices > VERTEX_LIMIT {
            Err(Fault::new(at(), limit("vertices", VERTEX_LIMIT)))
        } else {
            Ok(vertices)
        }
    }

    /// Reads positions or normals.
    fn triple(&mut self, index: usize) -> Result<Rc<Vec<[f64; 3]>>, Fault> {
        if let Some(known) = self.triples.get(&index) {
            return Ok(Rc::clone(known));
        }
        let read = Rc::new(accessor::vectors::<3>(self.document, index)?);
        let points = Rc::clone(&read);
        let all = Vertices {
            points,
            ..Vertices::default()
        };
        self.counted(all, || place("accessor", index, None))?;
        self.triples.insert(index, Rc::clone(&read));
        Ok(read)
    }
}

/// The triangles of a primitive in its mode, each counter-clockwise. Remaining corners are ignored.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let edges = corners.iter().zip(corners.iter().skip(1));
            let triangles = edges.zip(corners.iter().skip(2)).enumerate();
            let turned = |(i, ((a, b), c)): (usize, ((&u32, &u32), &u32))| match i % 2 {
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
