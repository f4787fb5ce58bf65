//! The pool on disk: verified images by content address, in a dedicated folder.
//!
//! `FOLDER/pictures/SCENE/QUALITY-KEY.exr` holds one image in single precision, uncompressed, with
//! its description and a checksum of everything in its header. A file that is truncated, changed,
//! renamed, foreign or of another version is not used, and its image is rendered again. Checksums
//! detect faults, not forgery.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use footlight_host::files::{Entry, FileError, Store};
use footlight_picture::exr::{self, Precision};
use footlight_picture::{Image, PictureError};
use footlight_transport::Quality;

use super::address::{Address, Digest, Hasher, Lighting, Name, SceneKey};

/// Version of the file format.
const FORMAT: u32 = 2;
/// Most bytes of a file beyond its pixels: the header lists the lit lights.
const HEADER_LIMIT: u64 = 8 << 20;
/// Bytes that hold most headers.
const HEADER_START: u64 = 32 << 10;
/// Subfolders of the pool: images, claims and task lists.
const OWN_FOLDERS: [&str; 3] = ["claims", "pictures", "tasks"];

const ATTRIBUTE_LABEL: &str = "footlight.picture";
const ATTRIBUTE_CHECK: &str = "footlight.check";

/// Description of an image in its header, as JSON.
#[derive(Serialize, Deserialize)]
struct Label {
    format: u32,
    address: Address,
    /// The setting, for people; ASCII.
    setting: String,
    /// Place of a refined image: [`PlaceInPool`], its numbers as bits, which JSON preserves.
    refined: Option<(usize, Vec<u64>)>,
}

/// An image in the store, according to its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Operator, scene and view.
    pub scene_key: SceneKey,
    /// Quality step.
    pub quality: Quality,
    /// The image's key.
    pub key: Digest,
    /// Size of its file.
    pub bytes: u64,
    /// Time of last use.
    used: u64,
}

impl Stored {
    fn name(&self) -> Name {
        (self.scene_key, self.quality, self.key)
    }
}

/// Place of a refined image in its original pool.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaceInPool {
    /// Number of refined images before it.
    pub order: usize,
    /// Its setting, one number for each source. Strengths of lights would equal it only up to
    /// rounding.
    pub setting: Vec<f64>,
}

/// Warnings about a store.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Note {
    /// Stored images were unusable and removed.
    #[error(
        "a stored picture is of no use and was dropped; what is needed is rendered again: {}: \
         {reason}{}", path.display(), others(*pictures)
    )]
    Damaged {
        /// The first of them.
        path: PathBuf,
        /// Its fault.
        reason: String,
        /// Their number.
        pictures: usize,
    },
    /// Writing has stopped for this session.
    #[error("pictures are no longer stored, only kept until you leave: {reason}")]
    Stopped {
        /// The error.
        reason: String,
    },
}

fn others(pictures: usize) -> String {
    match pictures {
        0 | 1 => String::new(),
        n => format!(" ({} more like it)", n - 1),
    }
}

/// Name of the scene's folder and of the image's file, without extension.
pub fn names((scene_key, quality, key): Name) -> [String; 2] {
    [scene_key.0.to_string(), format!("{}-{key}", quality.0)]
}

/// Names of a scene's images, given its folder's name; empty without a folder.
///
/// # Errors
/// [`FileError`] when it cannot be listed.
pub fn pictures_of(
    store: &dyn Store,
    folder: &Path,
    scene: &str,
) -> Result<BTreeSet<String>, FileError> {
    let listed = store.list(&folder.join("pictures").join(scene), ".exr");
    let names = match listed {
        Err(FileError::Missing(_)) => Vec::new(),
        other => other?,
    };
    let stem = |name: &String| name.strip_suffix(".exr").map(str::to_owned);
    Ok(names.iter().filter_map(stem).collect())
}

/// The store of one folder.
#[derive(Debug)]
pub struct DiskCache {
    /// The folder.
    pub folder: PathBuf,
    /// The most bytes it may hold.
    pub limit: u64,
    /// True when other processes store images here too, and another one keeps the limit.
    is_shared: bool,
    /// Bytes in the store as far as known; `None` before the first query.
    bytes: Option<u64>,
    damaged: usize,
    /// The first damaged file, and its fault.
    first_damage: Option<(PathBuf, String)>,
    /// Reason why writing has stopped.
    stopped: Option<String>,
    told: [bool; 2],
}

impl DiskCache {
    /// A store in `folder`, of at most `limit` bytes.
    pub fn new(folder: impl Into<PathBuf>, limit: u64) -> DiskCache {
        DiskCache {
            folder: folder.into(),
            limit,
            is_shared: false,
            bytes: None,
            damaged: 0,
            first_damage: None,
            stopped: None,
            told: [false; 2],
        }
    }

    /// From now on only adds images: existing ones are neither counted, replaced nor trimmed.
    pub fn share(&mut self) {
        self.is_shared = true;
    }

    /// Reason why writing has stopped, if so.
    pub fn stopped(&self) -> Option<&str> {
        self.stopped.as_deref()
    }

    /// True when a file for an image exists; it is verified when used.
    pub fn has(&self, store: &dyn Store, name: Name) -> bool {
        store.read_start(&self.path(name), 1).is_ok()
    }

    fn path(&self, name: Name) -> PathBuf {
        let [scene, picture] = names(name);
        self.folder
            .join("pictures")
            .join(scene)
            .join(picture + ".exr")
    }

    /// Reads the verified image of an address, `size` pixels wide and high, and its lights; `None`
    /// when it is missing or damaged.
    pub fn find(
        &mut self,
        store: &dyn Store,
        name: Name,
        size: (usize, usize),
    ) -> Option<(Lighting, Image)> {
        if let Some(link) = self.link(store, &name.0.0.to_string()) {
            self.stop(&link);
            return None;
        }
        let path = self.path(name);
        let pixels = (size.0 as u64).saturating_mul(size.1 as u64);
        let limit = pixels.saturating_mul(12).saturating_add(HEADER_LIMIT);
        let read = if store.is_link(&path) {
            Err("it is a link".to_owned())
        } else {
            match store.read(&path, limit) {
                Ok(bytes) => verified(&bytes, name, size),
                Err(FileError::Missing(_)) => return None,
                Err(error @ (FileError::TooLarge { .. } | FileError::NotAFile { .. })) => {
                    Err(error.to_string())
                }
                Err(error) => {
                    self.stop(&error);
                    return None;
                }
            }
        };
        match read {
            Ok(found) => {
                // If the touch fails, the image merely looks older.
                let _ = store.touch(&path);
                Some(found)
            }
            Err(reason) => {
                self.drop_damaged(store, &path, reason);
                None
            }
        }
    }

    /// Removes an unusable image, which every command would report again.
    fn drop_damaged(&mut self, store: &dyn Store, path: &Path, reason: String) {
        if let Err(error) = store.remove(path) {
            self.stop(&error);
            return;
        }
        self.damaged += 1;
        self.first_damage
            .get_or_insert_with(|| (path.to_owned(), reason));
    }

    /// Stops writing for this session; the first reason is reported.
    fn stop(&mut self, reason: &dyn std::fmt::Display) {
        self.stopped.get_or_insert_with(|| reason.to_string());
    }

    /// Fault of a folder in the store that is a link: it may have come with a stranger's show and
    /// lead anywhere.
    fn link(&self, store: &dyn Store, scene_key: &str) -> Option<String> {
        let pictures = self.folder.join("pictures");
        let of_scene = pictures.join(scene_key);
        let link = [pictures, of_scene]
            .into_iter()
            .find(|path| store.is_link(path))?;
        Some(format!("`{}` is a link", link.display()))
    }

    /// Lights of a scene's images at a quality step, according to their headers;
    /// [`DiskCache::find`] verifies them before use.
    pub fn addresses(
        &self,
        store: &dyn Store,
        scene_key: SceneKey,
        quality: Quality,
    ) -> Vec<Address> {
        let of_scene = self.of_scene(store, &scene_key.0.to_string()).into_iter();
        let wanted = of_scene.filter(|stored| stored.quality == quality);
        let labels = wanted.filter_map(|stored| self.label(store, stored));
        labels.map(|label| label.address).collect()
    }

    /// Refined images of a scene at this quality or a better one, according to their headers;
    /// [`DiskCache::find`] verifies them.
    pub fn refined(
        &self,
        store: &dyn Store,
        scene_key: SceneKey,
        least: Quality,
    ) -> Vec<(PlaceInPool, Address)> {
        let of_scene = self.of_scene(store, &scene_key.0.to_string()).into_iter();
        let good = of_scene.filter(|stored| stored.quality >= least);
        let read = |stored: Stored| {
            let label = self.label(store, stored)?;
            let (order, setting) = label.refined?;
            let setting = setting.into_iter().map(f64::from_bits).collect();
            Some((PlaceInPool { order, setting }, label.address))
        };
        good.filter_map(read).collect()
    }

    /// Lights of a stored image from its header alone; `None` when that is unreadable.
    pub fn lighting(&self, store: &dyn Store, stored: Stored) -> Option<Lighting> {
        Some(self.label(store, stored)?.address.lighting)
    }

    /// The label of a stored image from its header alone, if it agrees with the file's name.
    fn label(&self, store: &dyn Store, stored: Stored) -> Option<Label> {
        let path = self.path(stored.name());
        [HEADER_START, HEADER_LIMIT].into_iter().find_map(|limit| {
            let start = store.read_start(&path, limit).ok()?;
            label(&exr::attributes(&start).ok()?, stored.name()).ok()
        })
    }

    /// Stores an image; `setting` describes it, `place` is set for a refined one. After the first
    /// failure nothing more is written in this session.
    pub fn keep(
        &mut self,
        store: &dyn Store,
        address: &Address,
        (setting, place): (&str, Option<&PlaceInPool>),
        image: &Image,
    ) {
        if self.stopped.is_some() {
            return;
        }
        let label = Label {
            format: FORMAT,
            address: address.clone(),
            setting: setting.escape_default().to_string(),
            refined: place.map(|p| (p.order, p.setting.iter().map(|x| x.to_bits()).collect())),
        };
        let link = self.link(store, &address.scene_key.0.to_string());
        let written = match (link, encoded(&label, image)) {
            (Some(link), _) => Err(link),
            (None, Ok(content)) => {
                let written = self.write(store, address, &content);
                written.map_err(|error| error.to_string())
            }
            (None, Err(error)) => Err(error.to_string()),
        };
        self.stopped = written.err();
    }

    fn write(
        &mut self,
        store: &dyn Store,
        address: &Address,
        content: &[u8],
    ) -> Result<(), FileError> {
        let size = content.len() as u64;
        if self.is_shared {
            self.claim(store)?;
            return store.add(&self.path(address.name()), content);
        }
        if size > self.limit {
            return Ok(());
        }
        let before = match self.bytes {
            Some(bytes) => bytes,
            None => {
                self.claim(store)?;
                let pictures = self.folder.join("pictures");
                store.sweep(&pictures.join(address.scene_key.0.to_string()));
                self.stored(store).iter().map(|s| s.bytes).sum()
            }
        };
        self.bytes = Some(before);
        store.write(&self.path(address.name()), content)?;
        let bytes = before.saturating_add(size);
        self.bytes = Some(bytes);
        if bytes > self.limit {
            self.trim(store, self.limit)
        } else {
            Ok(())
        }
    }

    /// Removes the least recently used images, so that `bytes` more are within the limit.
    ///
    /// # Errors
    /// [`FileError`] when removal fails.
    pub fn make_room(&mut self, store: &dyn Store, bytes: u64) -> Result<(), FileError> {
        self.trim(store, self.limit.saturating_sub(bytes))
    }

    /// Excludes the folder from version control by a file in it, unless the folder holds other
    /// files: a user's folder must not be hidden.
    fn claim(&self, store: &dyn Store) -> Result<(), FileError> {
        let ours = |entry: &Entry| OWN_FOLDERS.contains(&entry.name.as_str());
        if store.entries(&self.folder)?.iter().all(ours) {
            store.write(&self.folder.join(".gitignore"), b"*\n")?;
        }
        Ok(())
    }

    /// Every image in the store; empty when it cannot be listed.
    pub fn stored(&self, store: &dyn Store) -> Vec<Stored> {
        let scene_keys = store.entries(&self.folder.join("pictures"));
        let scene_keys = scene_keys.unwrap_or_default().into_iter();
        scene_keys
            .flat_map(|scene_key| self.of_scene(store, &scene_key.name))
            .collect()
    }

    fn of_scene(&self, store: &dyn Store, scene_key: &str) -> Vec<Stored> {
        let Some(digest) = Digest::parse(scene_key) else {
            return Vec::new();
        };
        if self.link(store, scene_key).is_some() {
            return Vec::new();
        }
        let folder = self.folder.join("pictures").join(scene_key);
        let entries = store.entries(&folder).unwrap_or_default().into_iter();
        let stored = |entry: Entry| {
            let (quality, key) = entry.name.strip_suffix(".exr")?.split_once('-')?;
            Some(Stored {
                scene_key: SceneKey(digest),
                quality: Quality(quality.parse().ok()?),
                key: Digest::parse(key)?,
                bytes: entry.bytes,
                used: entry.used,
            })
        };
        entries.filter_map(stored).collect()
    }

    /// Removes the least recently used images down to a limit, and leftover parts.
    fn trim(&mut self, store: &dyn Store, limit: u64) -> Result<(), FileError> {
        let mut all = self.stored(store);
        all.sort_by_key(|s| s.used);
        self.sweep(store)?;
        let mut bytes: u64 = all.iter().map(|s| s.bytes).sum();
        for stored in all {
            if bytes <= limit {
                break;
            }
            store.remove(&self.path(stored.name()))?;
            bytes = bytes.saturating_sub(stored.bytes);
        }
        self.bytes = Some(bytes);
        Ok(())
    }

    /// Removes leftovers of killed processes.
    fn sweep(&self, store: &dyn Store) -> Result<(), FileError> {
        let pictures = self.folder.join("pictures");
        for Entry { name, .. } in store.entries(&pictures)? {
            if Digest::parse(&name).is_some() && self.link(store, &name).is_none() {
                store.sweep(&pictures.join(&name));
            }
        }
        Ok(())
    }

    /// Removes the images selected by `which`, and leftovers of killed processes; returns the
    /// number and bytes.
    ///
    /// # Errors
    /// [`FileError`] when removal fails; earlier removals stay.
    pub fn free(
        &mut self,
        store: &dyn Store,
        which: impl Fn(&Stored) -> bool,
    ) -> Result<(usize, u64), FileError> {
        let (mut count, mut bytes) = (0, 0);
        self.bytes = None;
        let all = self.stored(store);
        self.sweep(store)?;
        for stored in all.into_iter().filter(which) {
            let path = self.path(stored.name());
            store.remove(&path)?;
            count += 1;
            bytes += stored.bytes;
            // Remove the folder after its last image; it may hold others.
            let _ = path.parent().map(|folder| store.remove(folder));
        }
        Ok((count, bytes))
    }

    /// Warnings for the user, each kind once in a session.
    pub fn notes(&mut self) -> Vec<Note> {
        let mut notes = Vec::new();
        if let (Some((path, reason)), false) = (&self.first_damage, self.told[0]) {
            self.told[0] = true;
            notes.push(Note::Damaged {
                path: path.clone(),
                reason: reason.clone(),
                pictures: self.damaged,
            });
        }
        if let (Some(reason), false) = (&self.stopped, self.told[1]) {
            self.told[1] = true;
            notes.push(Note::Stopped {
                reason: reason.clone(),
            });
        }
        notes
    }
}

/// Encodes the file of an image.
fn encoded(label: &Label, image: &Image) -> Result<Vec<u8>, PictureError> {
    let text = serde_json::to_string(label).map_err(|e| PictureError::Size(e.to_string()))?;
    let attributes = [
        (ATTRIBUTE_CHECK, checksum(&text, image)),
        (ATTRIBUTE_LABEL, text),
    ];
    let attributes = attributes.map(|(name, value)| (name.to_owned(), value));
    exr::encode(image, Precision::Float, &attributes)
}

/// Checksum of everything in the file that has a meaning.
fn checksum(label: &str, image: &Image) -> String {
    let mut hasher = Hasher::new("check");
    hasher.text(label);
    hasher.image(image);
    hasher.finish().to_string()
}

/// The label in a header, if it is of the image with this name.
fn label(header: &[(String, String)], name: Name) -> Result<Label, &'static str> {
    let label: Label = serde_json::from_str(value(header, ATTRIBUTE_LABEL))
        .ok()
        .filter(|label: &Label| label.format == FORMAT)
        .ok_or("it is not a picture of this version's store")?;
    if label.address.name() == name {
        Ok(label)
    } else {
        Err("it is a picture of something else under this name")
    }
}

/// Verifies a file against its name and checksum.
fn verified(bytes: &[u8], name: Name, size: (usize, usize)) -> Result<(Lighting, Image), String> {
    let words = |error: PictureError| error.to_string();
    let attributes = exr::attributes(bytes).map_err(words)?;
    let label = label(&attributes, name)?;
    let image = exr::decode(bytes, size.0 * size.1 * 64 + (1 << 20)).map_err(words)?;
    if image.size() != size {
        return Err("it has another size".to_owned());
    }
    if checksum(value(&attributes, ATTRIBUTE_LABEL), &image) != value(&attributes, ATTRIBUTE_CHECK)
    {
        return Err("its checksum does not fit: it was changed or damaged".to_owned());
    }
    Ok((label.address.lighting, image))
}

/// A header attribute; empty if missing.
fn value<'a>(header: &'a [(String, String)], wanted: &str) -> &'a str {
    let found = header.iter().find(|(name, _)| name == wanted);
    found.map_or("", |(_, value)| value.as_str())
}

#[cfg(test)]
#[path = "disk_cache_test.rs"]
mod tests;
