//! The container of the geometry: GLB chunks, the JSON, the buffers.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use base64::alphabet;
use base64::engine::{DecodePaddingMode, Engine as _, GeneralPurpose, GeneralPurposeConfig};

use serde::Deserialize;

use super::buffers::Buffers;
use super::description::Root;
use super::{Fault, entry, lacks, not_gltf, place, short};
use crate::stage_file::SceneError;
use crate::stage_file::limit;
use footlight_host::files::Files;

/// Most bytes of the JSON. Its text can take sixteen times as much memory.
const JSON_LIMIT: usize = 32 << 20;
/// Most objects and values of the JSON, whose cost in memory does not depend on their length.
const OBJECT_LIMIT: usize = 200_000;
const VALUE_LIMIT: usize = 4_000_000;
/// Most files that one file may name.
const MOST_FILES: usize = 1000;
/// Most bytes of all buffers together.
pub const BUFFER_LIMIT: usize = 256 << 20;

/// Padded or not; bits behind the last whole byte are ignored.
const LENIENT: GeneralPurposeConfig = GeneralPurposeConfig::new()
    .with_decode_padding_mode(DecodePaddingMode::Indifferent)
    .with_decode_allow_trailing_bits(true);

/// Extensions that a file may require: those that are read, and those that do not affect what is
/// read.
const KNOWN: [&str; 22] = [
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// The JSON of a file, with its buffers.
pub struct Document<'b> {
    /// The description.
    pub root: Root,
    buffers: Buffers<'b>,
    /// The file's folder, for other files and embedded data.
    folder: PathBuf,
}

impl<'b> Document<'b> {
    /// Parses a file and fetches its buffers.
    pub fn read(
        files: &dyn Files,
        path: &str,
        bytes: &'b [u8],
    ) -> Result<Document<'b>, SceneError> {
        let fault = |f: Fault| f.of_file(path);
        let (json, binary) = chunks(bytes).map_err(fault)?;
        let root = parse(json).map_err(fault)?;
        let unknown = |name: &&String| !KNOWN.contains(&name.as_str());
        if let Some(name) = root.extensions_required.iter().find(unknown) {
            return Err(SceneError::Extension {
                path: path.to_owned(),
                name: name.chars().take(60).collect(),
            });
        }
        let folder = Path::new(path).parent().unwrap_or(Path::new(""));
        let mut fetch = Fetch {
            files,
            folder,
            path,
            fetched: BTreeMap::new(),
            left: BUFFER_LIMIT,
        };
        let buffers = Buffers(fetch.all(&root, binary)?);
        Ok(Document {
            root,
            buffers,
            folder: folder.to_owned(),
        })
    }

    /// Bytes of a buffer view, and its stride if it has one.
    pub fn view(
        &self,
        index: usize,
        from: impl FnOnce() -> String,
    ) -> Result<(&[u8], Option<usize>), Fault> {
        let view = entry(&self.root.buffer_views, index, "bufferView", from)?;
        let at = || place("bufferView", index, view.name.as_ref());
        let start = view.byte_offset.unwrap_or_default().0;
        let bytes = self
            .buffers
            .part(view.buffer.value(), (start, view.byte_length.0), at)?;
        Ok((bytes, view.byte_stride.map(|s| s.0)))
    }

    /// Content of an image.
    pub fn image(&self, files: &dyn Files, image: &gltf_json::Image) -> Result<Vec<u8>, String> {
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => data(uri),
            (Some(uri), _) => {
                let name = decoded(uri).filter(|_| !uri.contains(':'));
                let name = name.ok_or_else(|| "it is not next to the stage".to_owned())?;
                let path = self.folder.join(name.replace('\\', "/"));
                files
                    .read(&path.to_string_lossy())
                    .map_err(|e| e.to_string())
            }
            (None, Some(view)) => {
                let found = self.view(view.value(), || "an image".to_owned());
                found
                    .map(|(bytes, _)| bytes.to_vec())
                    .map_err(|fault| fault.reason)
            }
            (None, None) => Err("it has no content".to_owned()),
        }
    }
}

/// The files that a `.gltf` or `.glb` file names, textures and buffers, each once, as written;
/// empty when the content is not glTF.
pub fn named_files(bytes: &[u8]) -> Vec<String> {
    #[derive(Default, Deserialize)]
    struct Named {
        #[serde(default)]
        images: Vec<File>,
        #[serde(default)]
        buffers: Vec<File>,
    }
    #[derive(Deserialize)]
    struct File {
        uri: Option<String>,
    }
    // Faults of the file are reported when it is read.
    let json = chunks(bytes).map_or(&[][..], |(json, _)| json);
    let json = json.get(..JSON_LIMIT.min(json.len())).unwrap_or_default();
    let named: Named = serde_json::from_slice(json).unwrap_or_default();
    let files = named.images.into_iter().chain(named.buffers);
    let name = |file: File| {
        let uri = file.uri.filter(|uri| !uri.starts_with("data:"))?;
        Some(decoded(&uri)?.replace('\\', "/"))
    };
    let names: BTreeSet<String> = files.filter_map(name).take(MOST_FILES).collect();
    names.into_iter().collect()
}

/// The JSON of a file, and its binary chunk when it is a GLB.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let fault = |reason| Fault::new("header", reason);
    let Some(rest) = bytes.strip_prefix(b"glTF") else {
        return Ok((bytes, None));
    };
    let (version, rest) = word(rest).ok_or_else(|| fault("the file ends within it"))?;
    if version != 2 {
        return Err(Fault::new("header", unread(&version.to_string())));
    }
    let (length, rest) = word(rest).ok_or_else(|| fault("the file ends within it"))?;
    let found = bytes.len() as u64;
    let needed = u64::from(length);
    if needed > found {
        return Err(Fault::new("header", short(needed, found)));
    }
    // Bytes after the stated length are not part of the file.
    let rest = (length as usize)
        .checked_sub(12)
        .and_then(|n| rest.get(..n));
    let rest = rest.ok_or_else(|| fault("its length is less than its own"))?;
    let (json, rest) = chunk(rest, "chunk 0")?;
    let (b"JSON", json) = json else {
        return Err(Fault::new("chunk 0", "it is not JSON"));
    };
    if rest.is_empty() {
        return Ok((json, None));
    }
    let ((kind, data), _) = chunk(rest, "chunk 1")?;
    // The specification requires ignoring other kinds of chunk.
    Ok((json, (kind == b"BIN\0").then_some(data)))
}

/// A chunk's kind and data, and what follows.
#[expect(
    clippy::type_complexity,
    reason = "a pair and a rest, used twice above"
)]
fn chunk<'b>(bytes: &'b [u8], name: &str) -> Result<((&'b [u8; 4], &'b [u8]), &'b [u8]), Fault> {
    let ends = || Fault::new(name, "the file ends within its header");
    let (length, rest) = word(bytes).ok_or_else(ends)?;
    let (kind, rest) = rest.split_first_chunk::<4>().ok_or_else(ends)?;
    let split = rest.split_at_checked(length as usize).ok_or_else(|| {
        let (needed, found) = (u64::from(length), rest.len() as u64);
        Fault::new(name, short(needed, found))
    });
    split.map(|(data, rest)| ((kind, data), rest))
}

fn word(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (word, rest) = bytes.split_first_chunk::<4>()?;
    Some((u32::from_le_bytes(*word), rest))
}

/// Parses the description, if it can be read.
fn parse(json: &[u8]) -> Result<Root, Fault> {
    let json = json.strip_prefix("\u{feff}".as_bytes()).unwrap_or(json);
    let fault = |reason| Fault::new("JSON", reason);
    let count = |what: u8| json.iter().filter(|b| **b == what).count();
    for (found, most, what) in [
        (json.len(), JSON_LIMIT, "bytes of JSON"),
        (count(b'{'), OBJECT_LIMIT, "objects"),
        (count(b',') + count(b'['), VALUE_LIMIT, "values"),
    ] {
        if found > most {
            return Err(fault(limit(what, most)));
        }
    }
    let root: Root = gltf_json::deserialize::from_slice(json).map_err(|e| fault(not_gltf(e)))?;
    if root.asset.version.split('.').next() != Some("2") {
        let version: String = root.asset.version.chars().take(20).collect();
        return Err(fault(unread(&version)));
    }
    Ok(root)
}

fn unread(version: &str) -> String {
    format!("glTF version `{version}`; this program reads 2")
}

/// Fetches buffers, each file once, up to a total limit.
struct Fetch<'f> {
    files: &'f dyn Files,
    folder: &'f Path,
    path: &'f str,
    fetched: BTreeMap<String, Vec<u8>>,
    left: usize,
}

impl Fetch<'_> {
    fn all<'b>(
        &mut self,
        root: &Root,
        binary: Option<&'b [u8]>,
    ) -> Result<Vec<Cow<'b, [u8]>>, SceneError> {
        let mut buffers: Vec<Cow<'b, [u8]>> = Vec::with_capacity(root.buffers.len());
        let path = self.path;
        for (i, buffer) in root.buffers.iter().enumerate() {
            let fault = |reason| {
                let at = place("buffer", i, buffer.name.as_ref());
                Fault::new(at, reason).of_file(path)
            };
            let mut views = root.buffer_views.iter();
            if !views.any(|view| view.buffer.value() == i) {
                // The buffer is unused.
                buffers.push(Cow::Borrowed([].as_slice()));
                continue;
            }
            let content = match (&buffer.uri, binary) {
                (Some(uri), _) if uri.starts_with("data:") => Cow::Owned(data(uri).map_err(fault)?),
                (Some(uri), _) => Cow::Owned(self.file(uri, fault)?),
                (None, Some(binary)) if i == 0 => Cow::Borrowed(binary),
                (None, _) => return Err(fault(lacks("content"))),
            };
            self.left = self
                .left
                .checked_sub(content.len())
                .ok_or_else(|| fault(limit("bytes of buffers", BUFFER_LIMIT)))?;
            buffers.push(content);
        }
        Ok(buffers)
    }

    fn file(
        &mut self,
        uri: &str,
        fault: impl Fn(String) -> SceneError,
    ) -> Result<Vec<u8>, SceneError> {
        if let Some(known) = self.fetched.get(uri) {
            return Ok(known.clone());
        }
        let refused = || fault(strange(uri));
        let name = decoded(uri).filter(|_| !uri.contains(':'));
        let path = self.folder.join(name.ok_or_else(refused)?);
        let content = self.files.read(&path.to_string_lossy())?;
        self.fetched.insert(uri.to_owned(), content.clone());
        Ok(content)
    }
}

/// Decodes the percent escapes (`%20`) of a relative reference.
fn decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let mut digit = || char::from(rest.next()?).to_digit(16);
        let (high, low) = (digit()?, digit()?);
        bytes.push(u8::try_from(high * 16 + low).ok()?);
    }
    String::from_utf8(bytes).ok()
}

/// The bytes of a `data:…;base64,…` URI, in either alphabet of RFC 4648.
fn data(uri: &str) -> Result<Vec<u8>, String> {
    let (head, text) = uri.split_once(',').ok_or_else(|| strange(uri))?;
    if !head.ends_with(";base64") {
        return Err(strange(uri));
    }
    let engines =
        [alphabet::STANDARD, alphabet::URL_SAFE].map(|a| GeneralPurpose::new(&a, LENIENT));
    let bytes = engines.iter().find_map(|engine| engine.decode(text).ok());
    bytes.ok_or_else(|| "its data is not base64".to_owned())
}

fn strange(uri: &str) -> String {
    let uri: String = uri.chars().take(60).collect();
    format!("`{uri}` is neither a file next to the stage nor base64 data")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn base64_of_either_alphabet_with_or_without_padding() {
        let read = |text: &str| data(&format!("data:;base64,{text}"));
        for (text, bytes) in [
            ("", &b""[..]),
            ("Zg==", b"f"),
            ("Zm9vYmE", b"fooba"),
            ("Zm9vYmFy", b"foobar"),
            ("++//", &[0xfb, 0xef, 0xff]),
            ("--__", &[0xfb, 0xef, 0xff]),
        ] {
            assert_eq!(read(text).unwrap(), bytes);
        }
        for bad in ["Z", "Zm 9", "===="] {
            assert_eq!(read(bad).unwrap_err(), "its data is not base64");
        }
    }

    #[test]
    fn references_are_decoded() {
        assert_eq!(decoded("a%20b.bin").unwrap(), "a b.bin");
        assert_eq!(decoded("%C3%A4").unwrap(), "ä");
        assert_eq!(decoded("%4"), None);
        assert_eq!(decoded("%ff"), None);
    }
}
