//! Primitives compressed by KHR_draco_mesh_compression.

use std::collections::BTreeMap;
use std::rc::Rc;

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf_json::mesh::Primitive;
use serde::Deserialize;

use super::container::{BUFFER_LIMIT, Document};
use super::material::Places;
use super::vertices::Vertices;
use super::{Fault, TRIANGLE_LIMIT, lacks, not_gltf};
use crate::stage_file::{FAR_AWAY, VERTEX_LIMIT};

const NAME: &str = "KHR_draco_mesh_compression";

/// Compression of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer_view: usize,
    /// Draco attribute ids by glTF name.
    attributes: BTreeMap<String, u32>,
}

/// Decodes the vertices of a primitive; `None` when it is not compressed.
pub fn decode(
    document: &Document<'_>,
    primitive: &Primitive,
    places: Option<Places>,
    at: impl Fn() -> String,
) -> Result<Option<Vertices>, Fault> {
    let described = primitive
        .extensions
        .as_ref()
        .and_then(|e| e.others.get(NAME));
    let Some(described) = described else {
        return Ok(None);
    };
    let fault = |reason| Fault::new(at(), reason);
    let how =
        Compressed::deserialize(described).map_err(|e| fault(not_gltf(format!("{NAME}: {e}"))))?;
    let (bytes, _) = document.view(how.buffer_view, &at)?;
    let limits = DecodeLimits::default()
        .with_max_faces(TRIANGLE_LIMIT as u64)
        .with_max_points(VERTEX_LIMIT as u64)
        .with_max_decoded_bytes(BUFFER_LIMIT as u64);
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
    MeshDecoder::new()
        .decode(&mut buffer, &mut mesh)
        .map_err(|e| fault(not_gltf(format!("{NAME}: {e}"))))?;
    let numbers = |name: &str, width: usize| {
        let id = *how.attributes.get(name)?;
        let attribute = mesh.attribute_by_unique_id(id)?;
        Some(attribute.read_f32s(mesh.num_points(), width))
    };
    let triples = |name: &str| numbers(name, 3).map(|all| Rc::new(grouped::<3>(&all)));
    let points = triples("POSITION").ok_or_else(|| fault(lacks("positions")))?;
    if !points.iter().flatten().all(|v| v.is_finite()) {
        return Err(fault(FAR_AWAY.to_owned()));
    }
    let places = places.and_then(|places| {
        let read = grouped::<2>(&numbers(&format!("TEXCOORD_{}", places.set), 2)?);
        Some(Rc::new(read.into_iter().map(|p| places.moved(p)).collect()))
    });
    let indices = mesh
        .faces()
        .iter()
        .flat_map(|face| face.map(|point| point.0));
    Ok(Some(Vertices {
        normals: triples("NORMAL"),
        indices: Some(indices.collect()),
        points,
        places,
    }))
}

fn grouped<const N: usize>(numbers: &[f32]) -> Vec<[f64; N]> {
    let (groups, _) = numbers.as_chunks::<N>();
    groups.iter().map(|g| g.map(f64::from)).collect()
}
