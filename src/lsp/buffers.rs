//! The open texts of the client, which take precedence over the disk.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lsp_types::{TextDocumentContentChangeEvent, Uri};

use super::text::{Encoding, Lines};
use footlight_engine::TEXT_LIMIT;
use footlight_host::files::{Disk, FileError, Files, Folder, Stamp, Store, normal};
use footlight_show::lang;

/// An open text.
#[derive(Clone, Debug)]
pub struct Buffer {
    pub text: Arc<String>,
    /// Version number of the client.
    pub version: i32,
    /// URI of the client.
    pub uri: Uri,
}

/// All open texts, by path.
#[derive(Clone, Debug, Default)]
pub struct Buffers {
    open: Arc<Mutex<BTreeMap<PathBuf, Buffer>>>,
}

impl Buffers {
    fn locked(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Buffer>> {
        // Each change is one call, so a panic elsewhere leaves the map consistent.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The open text of a path.
    pub fn get(&self, path: &Path) -> Option<Buffer> {
        self.locked().get(path).cloned()
    }

    /// Paths of all open texts.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.locked().keys().cloned().collect()
    }

    /// Adds an opened text.
    pub fn open(&self, path: PathBuf, buffer: Buffer) {
        self.locked().insert(path, buffer);
    }

    /// Removes a closed text.
    pub fn close(&self, path: &Path) {
        self.locked().remove(path);
    }

    /// Applies a change. Text beyond the largest show is refused, so that a client cannot make the
    /// server hold any amount.
    pub fn change(
        &self,
        path: &Path,
        version: i32,
        changes: Vec<TextDocumentContentChangeEvent>,
        encoding: Encoding,
    ) {
        let mut open = self.locked();
        let Some(buffer) = open.get_mut(path) else {
            return;
        };
        let text = Arc::make_mut(&mut buffer.text);
        for change in changes {
            if text.len() + change.text.len() > TEXT_LIMIT as usize {
                continue;
            }
            match change.range {
                Some(range) => {
                    let bytes = Lines::new(text, encoding).bytes(range);
                    text.replace_range(bytes, &change.text);
                }
                None => *text = change.text,
            }
        }
        buffer.version = version;
    }

    /// The text of a path, open or on disk.
    pub fn text(&self, path: &Path) -> Option<Arc<String>> {
        if let Some(buffer) = self.get(path) {
            return Some(buffer.text);
        }
        let bytes = Disk.read(path, TEXT_LIMIT).ok()?;
        let text = lang::decode(&path.display().to_string(), &bytes).ok()?;
        Some(Arc::new(text))
    }
}

/// The files of a show's folder, with open texts replacing those on disk.
#[derive(Clone, Debug)]
pub struct Overlay {
    buffers: Buffers,
    folder: PathBuf,
    disk: Folder,
}

impl Overlay {
    /// Files below a folder, of at most `limit` bytes.
    pub fn new(buffers: &Buffers, folder: &Path, limit: u64) -> Overlay {
        Overlay {
            buffers: buffers.clone(),
            folder: folder.to_owned(),
            disk: Folder::new(folder, limit),
        }
    }
}

impl Files for Overlay {
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError> {
        let full = normal(&self.folder.join(path));
        match self.buffers.get(&full) {
            Some(buffer) if full.starts_with(&self.folder) => Ok(buffer.text.as_bytes().to_owned()),
            _ => self.disk.read(path),
        }
    }

    fn has_read(&self, path: &Path) -> bool {
        self.disk.has_read(path)
    }

    fn as_read(&self) -> Vec<Stamp> {
        self.disk.as_read()
    }

    fn as_is(&self) -> Vec<Stamp> {
        self.disk.as_is()
    }
}

/// The path of a `file:` URI.
pub fn path_of(uri: &Uri) -> Option<PathBuf> {
    if !uri.scheme()?.as_str().eq_ignore_ascii_case("file") {
        return None;
    }
    let path = uri.path().as_estr().decode().into_string().ok()?;
    // A drive follows a slash: `/C:/shows`.
    let drive = path.as_bytes().get(2) == Some(&b':') && cfg!(windows);
    let path = if drive { path.get(1..)? } else { &path };
    Some(normal(Path::new(path)))
}

/// The `file:` URI of a path.
pub fn uri_of(path: &Path) -> Option<Uri> {
    let mut out = String::from("file://");
    let text = path.to_str()?.replace('\\', "/");
    if !text.starts_with('/') {
        out.push('/');
    }
    for byte in text.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
                out.push(char::from(byte));
            }
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    Uri::from_str(&out).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_and_addresses_are_the_same_both_ways() {
        for path in ["/a/b.lxq", "/a b/Él 100%/ü#?.lxq"] {
            let uri = uri_of(Path::new(path)).unwrap();
            assert_eq!(path_of(&uri).unwrap(), Path::new(path), "{uri:?}");
        }
        let other = Uri::from_str("untitled:Untitled-1").unwrap();
        assert_eq!(path_of(&other), None);
    }

    #[test]
    fn an_open_text_stands_for_the_file() {
        let (folder, buffers) = (tempfile::tempdir().unwrap(), Buffers::default());
        let path = normal(&folder.path().canonicalize().unwrap().join("rig.lxq"));
        std::fs::write(&path, "on disk").unwrap();
        let files = Overlay::new(&buffers, path.parent().unwrap(), TEXT_LIMIT);
        assert_eq!(files.read("rig.lxq").unwrap(), b"on disk");
        let buffer = Buffer {
            text: Arc::new("open".to_owned()),
            version: 1,
            uri: uri_of(&path).unwrap(),
        };
        buffers.open(path.clone(), buffer);
        assert_eq!(files.read("./sub/../rig.lxq").unwrap(), b"open");
        assert!(files.read("../rig.lxq").is_err());
        buffers.close(&path);
        assert_eq!(files.read("rig.lxq").unwrap(), b"on disk");
    }
}
