//! The client's open texts and the shows to which they belong.

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
    /// Shows by root file.
    pub shows: BTreeMap<PathBuf, OpenShow>,
    /// The root file of each open text.
    pub roots: BTreeMap<PathBuf, PathBuf>,
}

impl Workspace {
    /// A workspace without open texts.
    pub fn new(encoding: Encoding) -> Workspace {
        Workspace {
            encoding,
            buffers: Buffers::default(),
            shows: BTreeMap::new(),
            roots: BTreeMap::new(),
        }
    }

    /// The show and the text at a URI.
    pub fn at(&self, uri: &Uri) -> Option<(&OpenShow, Arc<String>)> {
        let path = key(uri);
        let show = self.shows.get(self.roots.get(&path)?)?;
        Some((show, self.buffers.text(&path)?))
    }
}

/// The key of a text: its path, or its URI if it has no path.
pub fn key(uri: &Uri) -> PathBuf {
    path_of(uri).unwrap_or_else(|| PathBuf::from(uri.as_str()))
}
