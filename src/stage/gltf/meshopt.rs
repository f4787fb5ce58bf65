//! Buffer views compressed by EXT_meshopt_compression (its appendices A and B).
//!
//! Invariant: the output is no larger than the view claims, and at most 64 times the input.

use std::collections::BTreeMap;

use gltf_json::Buffer;

use serde::Deserialize;

use super::buffers::Buffers;
use super::description::Root;
use super::{Fault, not_gltf, place};
use crate::stage_file::limit;

const NAME: &str = "EXT_meshopt_compression";

/// Compression of a view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: usize,
    count: usize,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
}

/// True when a buffer without content stands for compressed data.
pub fn is_placeholder(root: &Root, buffer: &Buffer) -> bool {
    let marked = buffer
        .extensions
        .as_ref()
        .is_some_and(|e| e.others.contains_key(NAME));
    marked || root.extensions_required.iter().any(|name| name == NAME)
}

const PACKED: &str = "what it holds is not compressed as it says";

/// Decompresses every compressed view to its bytes and stride, at most `most` bytes in all.
pub fn unpack(
    root: &Root,
    buffers: &Buffers<'_>,
    most: usize,
) -> Result<BTreeMap<usize, (Vec<u8>, usize)>, Fault> {
    let mut out = BTreeMap::new();
    let mut left = most;
    for (index, view) in root.buffer_views.iter().enumerate() {
        let described = view.extensions.as_ref().and_then(|e| e.others.get(NAME));
        let Some(described) = described else {
            continue;
        };
        let at = || place("bufferView", index, view.name.as_ref());
        let fault = |reason| Fault::new(at(), reason);
        let how = Compressed::deserialize(described)
            .map_err(|e| fault(not_gltf(format!("{NAME}: {e}"))))?;
        let size = how.count.saturating_mul(how.byte_stride);
        left = left
            .checked_sub(size)
            .ok_or_else(|| fault(limit("bytes of buffers", most)))?;
        let bytes = buffers.part(how.buffer, (how.byte_offset, how.byte_length), at)?;
        let mut unpacked = decode(bytes, &how).ok_or_else(|| fault(PACKED.to_owned()))?;
        filter(&mut unpacked, &how).ok_or_else(|| fault(PACKED.to_owned()))?;
        out.insert(index, (unpacked, how.byte_stride));
    }
    Ok(out)
}

/// Decodes a stream; `None` when it is malformed.
fn decode(bytes: &[u8], how: &Compressed) -> Option<Vec<u8>> {
    match (how.mode, how.byte_stride) {
        (Mode::Attributes, 4..=256) if how.byte_stride.is_multiple_of(4) => {
            attributes(bytes, how.count, how.byte_stride)
        }
        (Mode::Triangles, size @ (2 | 4)) if how.count.is_multiple_of(3) => {
            let indices = triangles(bytes, how.count / 3)?;
            Some(narrowed(&indices, size))
        }
        (Mode::Indices, size @ (2 | 4)) => Some(narrowed(&indices(bytes, how.count)?, size)),
        _ => None,
    }
}

/// Splits off the first `count` bytes.
fn take<'b>(bytes: &mut &'b [u8], count: usize) -> Option<&'b [u8]> {
    bytes.split_off(..count)
}

fn narrowed(indices: &[u32], size: usize) -> Vec<u8> {
    let bytes = indices.iter().map(|i| i.to_le_bytes());
    bytes.flat_map(|b| b.into_iter().take(size)).collect()
}

/// Mode 0: deltas of each byte of consecutive elements, in blocks of groups of 16.
fn attributes(bytes: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let mut data = bytes.strip_prefix(&[0xa0])?;
    let tail = data.split_off(data.len().checked_sub(stride.max(32))?..)?;
    let mut last = tail.get(tail.len() - stride..)?.to_vec();
    let most = ((8192 / stride) & !15).min(256);
    let mut out = Vec::new();
    let mut left = count;
    while left > 0 {
        let block = left.min(most);
        left -= block;
        let groups = block.div_ceil(16);
        // Check that the claimed headers exist before allocating.
        if data.len() < stride * groups.div_ceil(4) {
            return None;
        }
        let start = out.len();
        out.resize(start + block * stride, 0);
        for (byte, value) in last.iter_mut().enumerate() {
            let headers = take(&mut data, groups.div_ceil(4))?;
            for group in 0..groups {
                let header = headers.get(group / 4)? >> (2 * (group % 4)) & 3;
                let deltas = deltas(&mut data, header)?;
                for (element, delta) in (16 * group..block).zip(deltas) {
                    *value = value.wrapping_add(delta >> 1 ^ (delta & 1).wrapping_neg());
                    *out.get_mut(start + element * stride + byte)? = *value;
                }
            }
        }
    }
    Some(out)
}

/// The 16 deltas of a group.
fn deltas(data: &mut &[u8], header: u8) -> Option<[u8; 16]> {
    let mut out = [0; 16];
    let bits = match header {
        0 => return Some(out),
        3 => return take(data, 16)?.try_into().ok(),
        header => 2 * usize::from(header),
    };
    let (packed, each) = (take(data, 2 * bits)?, 8 / bits);
    let all = (1_u8 << bits) - 1;
    for (i, delta) in out.iter_mut().enumerate() {
        let own = packed.get(i / each)? >> (8 - bits * (i % each + 1)) & all;
        // All bits set: the delta is larger and follows.
        *delta = if own == all {
            *take(data, 1)?.first()?
        } else {
            own
        };
    }
    Some(out)
}

/// Reads a number of seven bits per byte.
fn varint(data: &mut &[u8]) -> Option<u32> {
    let mut out = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = *take(data, 1)?.first()?;
        out |= u32::from(byte & 127) << shift;
        if byte < 128 {
            return Some(out);
        }
    }
    None
}

fn zigzag(v: u32) -> u32 {
    v >> 1 ^ (v & 1).wrapping_neg()
}

/// The last 16 values pushed.
struct Recent<T> {
    all: [T; 16],
    next: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Recent<T> {
        Recent {
            all: [T::default(); 16],
            next: 0,
        }
    }

    fn push(&mut self, value: T) {
        if let Some(place) = self.all.get_mut(self.next % 16) {
            *place = value;
        }
        self.next += 1;
    }

    /// Index 0 is the last value.
    fn get(&self, back: u8) -> T {
        let at = (self.next + 31 - usize::from(back)) % 16;
        self.all.get(at).copied().unwrap_or_default()
    }
}

/// State of the triangle decoder.
struct Triangles<'b> {
    data: &'b [u8],
    next: u32,
    last: u32,
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
}

/// Mode 1: a list of triangles, each by an edge of an earlier one if possible.
fn triangles(bytes: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut data = bytes.strip_prefix(&[0xe1])?;
    let table = data.split_off(data.len().checked_sub(16)?..)?;
    let codes = take(&mut data, count)?;
    let mut state = Triangles {
        data,
        next: 0,
        last: 0,
        edges: Recent::new(),
        vertices: Recent::new(),
    };
    let mut out = Vec::with_capacity(3 * codes.len());
    for code in codes {
        out.extend(state.triangle(*code, table)?);
    }
    Some(out)
}

impl Triangles<'_> {
    fn unseen(&mut self) -> u32 {
        let new = self.next;
        self.next = new.wrapping_add(1);
        new
    }

    fn explicit(&mut self) -> Option<u32> {
        self.last = self.last.wrapping_add(zigzag(varint(&mut self.data)?));
        Some(self.last)
    }

    fn triangle(&mut self, code: u8, table: &[u8]) -> Option<[u32; 3]> {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            return self.beside_edge(high, low);
        }
        let (pair, first) = match low {
            14 | 15 => {
                let pair = *take(&mut self.data, 1)?.first()?;
                if pair == 0 {
                    self.next = 0;
                }
                let first = if low == 14 {
                    self.unseen()
                } else {
                    self.explicit()?
                };
                (pair, first)
            }
            _ => (*table.get(usize::from(low))?, self.unseen()),
        };
        let is_listed = low < 14;
        let second = self.corner(pair >> 4, is_listed)?;
        let third = self.corner(pair & 15, is_listed)?;
        for edge in [[second, first], [third, second], [first, third]] {
            self.edges.push(edge);
        }
        self.vertices.push(first);
        for (value, from) in [(second, pair >> 4), (third, pair & 15)] {
            if from == 0 || from == 15 {
                self.vertices.push(value);
            }
        }
        Some([first, second, third])
    }

    /// Decodes a corner from four bits.
    fn corner(&mut self, bits: u8, is_listed: bool) -> Option<u32> {
        match bits {
            0 => Some(self.unseen()),
            15 if is_listed => None,
            15 => self.explicit(),
            back => Some(self.vertices.get(back - 1)),
        }
    }

    fn beside_edge(&mut self, edge: u8, low: u8) -> Option<[u32; 3]> {
        let [a, b] = self.edges.get(edge);
        let c = match low {
            0 => self.unseen(),
            15 => self.explicit()?,
            13 | 14 => {
                let step = if low == 13 { u32::MAX } else { 1 };
                self.last = self.last.wrapping_add(step);
                self.last
            }
            back => self.vertices.get(back),
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        if !(1..13).contains(&low) {
            self.vertices.push(c);
        }
        Some([a, b, c])
    }
}

/// Mode 2: deltas from one of two earlier indices.
fn indices(bytes: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut data = bytes.strip_prefix(&[0xd1])?;
    data.split_off(data.len().checked_sub(4)?..)?;
    // Each index takes at least one byte.
    let mut out = Vec::with_capacity(count.min(data.len()));
    let mut last = [0_u32; 2];
    for _ in 0..count {
        let v = varint(&mut data)?;
        let base = last.get_mut((v & 1) as usize)?;
        *base = base.wrapping_add(zigzag(v >> 1));
        out.push(*base);
    }
    Some(out)
}

/// Applies the view's filter to decompressed data.
fn filter(bytes: &mut [u8], how: &Compressed) -> Option<()> {
    let stride = how.byte_stride;
    match (how.filter, stride) {
        (Filter::None, _) => {}
        (Filter::Octahedral, 4) => {
            for element in bytes.as_chunks_mut::<4>().0 {
                let [x, y, one, _] = element.map(|b| f32::from(b.cast_signed()));
                let unit = octahedral(x / one, y / one).map(|v| (v * 127.0).round() as i8);
                element
                    .iter_mut()
                    .zip(unit)
                    .for_each(|(to, from)| *to = from.cast_unsigned());
            }
        }
        (Filter::Octahedral, 8) => shorts(bytes, |[x, y, one, rest]| {
            let (x, y, one) = (f32::from(x), f32::from(y), f32::from(one));
            let [x, y, z] = octahedral(x / one, y / one).map(|v| (v * 32767.0).round() as i16);
            [x, y, z, rest]
        }),
        (Filter::Quaternion, 8) => shorts(bytes, quaternion),
        (Filter::Exponential, stride) if stride.is_multiple_of(4) => {
            for value in bytes.as_chunks_mut::<4>().0 {
                let word = i32::from_le_bytes(*value);
                let (exponent, mantissa) = (word >> 24, word << 8 >> 8);
                let number = 2.0_f64.powi(exponent) * f64::from(mantissa);
                *value = (number as f32).to_le_bytes();
            }
        }
        _ => return None,
    }
    Some(())
}

fn shorts(bytes: &mut [u8], of: impl Fn([i16; 4]) -> [i16; 4]) {
    for element in bytes.as_chunks_mut::<8>().0 {
        let [a, b, c, d, e, f, g, h] = *element;
        let read = [[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes);
        let written = of(read).map(i16::to_le_bytes);
        element
            .iter_mut()
            .zip(written.as_flattened())
            .for_each(|(to, from)| *to = *from);
    }
}

/// A unit vector from octahedral encoding.
fn octahedral(x: f32, y: f32) -> [f32; 3] {
    let z = 1.0 - x.abs() - y.abs();
    let below = z.min(0.0);
    let (x, y) = (x - below.copysign(x), y - below.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| v / length)
}

/// A unit quaternion from its three smaller components; the last number selects the omitted one.
fn quaternion([x, y, z, last]: [i16; 4]) -> [i16; 4] {
    let one = f32::from(last | 3);
    let [x, y, z] = [x, y, z].map(|v| f32::from(v) / one * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut out = [w, x, y, z].map(|v| (v * 32767.0).round() as i16);
    out.rotate_right((last & 3) as usize);
    out
}

#[cfg(test)]
mod tests;
