//! The texts that the client has open, and the shows that they belong to.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use lsp_types::Uri;

use super::buffers::{Buffers, path_of};
use super::open_show::OpenShow;
use super::text::Encoding;

/// Open texts and their shows.
pub struct Workspace {
    /// The encoding in which the client counts characters.
    pub encoding: Encoding,
    pub buffers: Buffers,
    /// By the file that includes all others.
    pub shows: BTreeMap<PathBuf, OpenShow>,
    /// The show that each open text belongs to.
    pub roots: BTreeMap<PathBuf, PathBuf>,
}

impl Workspace {
    /// Nothing is open yet.
    pub fn new(encoding: Encoding) -> Workspace {
        Workspace {
            encoding,
            buffers: Buffers::default(),
            shows: BTreeMap::new(),
            roots: BTreeMap::new(),
        }
    }

    /// The show and the text of an address.
    pub fn at(&self, uri: &Uri) -> Option<(&OpenShow, Arc<String>)> {
        let path = key(uri);
        let show = self.shows.get(self.roots.get(&path)?)?;
        Some((show, self.buffers.text(&path)?))
    }
}

/// The key of a text: its path, or its address where it has none.
pub fn key(uri: &Uri) -> PathBuf {
    path_of(uri).unwrap_or_else(|| PathBuf::from(uri.as_str()))
}
