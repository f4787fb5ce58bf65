//! Accessors: typed views of buffers, read with every bound checked before anything is allocated.

use gltf_json::Accessor;
use gltf_json::accessor::{ComponentType, Type};
use gltf_json::validation::Checked;

use super::buffers::range;
use super::container::Document;
use super::{Fault, TRIANGLE_LIMIT, entry, lacks, missing, place};
use crate::stage_file::{VERTEX_LIMIT, limit};

/// Reads vectors of `N` numbers, floats or integers: positions, normals, texture coordinates,
/// transforms.
pub fn vectors<const N: usize>(
    document: &Document<'_>,
    index: usize,
) -> Result<Vec<[f64; N]>, Fault> {
    let source = Source::new(document, index)?;
    let (shape, kind) = source.kind;
    let is_vector = matches!(shape, Type::Vec2 | Type::Vec3 | Type::Vec4);
    if !is_vector || shape.multiplicity() != N || kind == ComponentType::U32 {
        let wanted = match N {
            2 => "places of two numbers",
            3 => "positions of three numbers",
            _ => "vectors of four numbers",
        };
        return Err(source.kind_fault(wanted, source.kind));
    }
    let normalized = source.accessor.normalized;
    let read = |bytes: &[u8]| {
        let mut parts = bytes.chunks_exact(kind.size());
        [0.0; N].map(|_: f64| parts.next().map_or(0.0, |b| number(b, kind, normalized)))
    };
    source.elements(VERTEX_LIMIT, "vertices", [0.0; N], read)
}

/// Reads vertex indices of a primitive.
pub fn indices(document: &Document<'_>, index: usize) -> Result<Vec<u32>, Fault> {
    use ComponentType::{U8, U16, U32};
    let source = Source::new(document, index)?;
    let kind = match source.kind {
        (Type::Scalar, kind @ (U8 | U16 | U32)) => kind,
        other => return Err(source.kind_fault("unsigned whole numbers", other)),
    };
    let read = |bytes: &[u8]| whole(bytes, kind);
    source.elements(3 * TRIANGLE_LIMIT, "corners", 0, read)
}

/// Converts a component to a number; normalised integers range from -1 or 0 to 1.
fn number(bytes: &[u8], kind: ComponentType, normalized: bool) -> f64 {
    let (value, most) = match (kind, bytes) {
        (ComponentType::F32, &[a, b, c, d]) => {
            return f64::from(f32::from_le_bytes([a, b, c, d]));
        }
        (ComponentType::I8, &[a]) => (f64::from(i8::from_le_bytes([a])), 127.0),
        (ComponentType::I16, &[a, b]) => (f64::from(i16::from_le_bytes([a, b])), 32_767.0),
        (ComponentType::U16, _) => (f64::from(whole(bytes, kind)), 65_535.0),
        _ => (f64::from(whole(bytes, kind)), 255.0),
    };
    if normalized {
        (value / most).max(-1.0)
    } else {
        value
    }
}

fn whole(bytes: &[u8], kind: ComponentType) -> u32 {
    match (kind, bytes) {
        (ComponentType::U8, &[a]) => u32::from(a),
        (ComponentType::U16, &[a, b]) => u32::from(u16::from_le_bytes([a, b])),
        (ComponentType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        // Callers pass unsigned kinds with as many bytes as they have.
        _ => 0,
    }
}

/// An accessor of a document.
struct Source<'d> {
    document: &'d Document<'d>,
    accessor: &'d Accessor,
    index: usize,
    kind: (Type, ComponentType),
}

impl<'d> Source<'d> {
    fn new(document: &'d Document<'_>, index: usize) -> Result<Source<'d>, Fault> {
        let at = || "a primitive".to_owned();
        let accessor = entry(&document.root.accessors, index, "accessor", at)?;
        let lacks = |what| {
            let at = place("accessor", index, accessor.name.as_ref());
            Fault::new(at, lacks(what))
        };
        let Checked::Valid(shape) = accessor.type_ else {
            return Err(lacks("known type"));
        };
        let Checked::Valid(component) = accessor.component_type else {
            return Err(lacks("known component type"));
        };
        Ok(Source {
            document,
            accessor,
            index,
            kind: (shape, component.0),
        })
    }

    fn place(&self) -> String {
        place("accessor", self.index, self.accessor.name.as_ref())
    }

    fn fault(&self, reason: String) -> Fault {
        Fault::new(self.place(), reason)
    }

    fn kind_fault(&self, wanted: &'static str, found: (Type, ComponentType)) -> Fault {
        let (shape, kind) = found;
        self.fault(format!("it holds {shape:?} of {kind:?}, not {wanted}"))
    }

    /// All elements: those of the buffer view (`zero` without one), overwritten by the sparse ones.
    fn elements<T: Copy>(
        &self,
        most: usize,
        what: &'static str,
        zero: T,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Fault> {
        let size = self.kind.0.multiplicity() * self.kind.1.size();
        let count = usize::try_from(self.accessor.count.0).unwrap_or(usize::MAX);
        if count > most {
            return Err(self.fault(limit(what, most)));
        }
        let mut out = match self.accessor.buffer_view {
            Some(view) => {
                let offset = self.accessor.byte_offset.unwrap_or_default().0;
                let elements = self.view(view.value(), offset, count, size)?;
                elements.map(&read).collect()
            }
            None => vec![zero; count],
        };
        if let Some(sparse) = &self.accessor.sparse {
            let changed = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            if changed > count {
                return Err(self.fault(limit("sparse elements", count)));
            }
            let Checked::Valid(kind) = sparse.indices.component_type else {
                return Err(self.fault(lacks("known type of sparse indices")));
            };
            let (at, by) = (&sparse.indices, &sparse.values);
            let indices = self.view(
                at.buffer_view.value(),
                at.byte_offset.0,
                changed,
                kind.0.size(),
            )?;
            let values = self.view(by.buffer_view.value(), by.byte_offset.0, changed, size)?;
            for (index, value) in indices.zip(values) {
                let index = whole(index, kind.0) as usize;
                let missing = || self.fault(missing("element", index, count));
                *out.get_mut(index).ok_or_else(missing)? = read(value);
            }
        }
        Ok(out)
    }

    /// `count` elements of `size` bytes each, `offset` bytes into a buffer view.
    fn view(
        &self,
        view: usize,
        offset: u64,
        count: usize,
        size: usize,
    ) -> Result<impl Iterator<Item = &'d [u8]>, Fault> {
        let index = view;
        let (bytes, stride) = self.document.view(index, || self.place())?;
        let stride = stride.unwrap_or(size);
        let at = || place("bufferView", index, None);
        if stride < size {
            return Err(Fault::new(at(), lacks("stride that holds its elements")));
        }
        let last = (count as u64).saturating_sub(1);
        let needed = match count {
            0 => 0,
            _ => last
                .saturating_mul(stride as u64)
                .saturating_add(size as u64),
        };
        let bytes = range(bytes, offset, needed).map_err(|e| self.fault(e))?;
        // The last element may be shorter than the stride.
        Ok(bytes
            .chunks(stride.max(1))
            .filter_map(move |c| c.get(..size))
            .take(count))
    }
}
