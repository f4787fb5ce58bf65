//! Services of the embedding program for the engine: files, clock, renderer, threads, progress,
//! memory limit, and image storage.

use std::path::PathBuf;
use std::sync::Arc;

use crate::pool::disk_cache::DiskCache;
use crate::pool::image_cache::ImageCache;
use footlight_host::files::{Clock, Disk, Files, Memory, Monotonic, Store};
use footlight_host::work::{Progress, Silent, Work};
use footlight_transport::Transport;
use footlight_transport::radiosity::Radiosity;

/// Services of the embedding program for an [`Engine`](super::Engine). All are [`Send`], so that an
/// engine can move to another thread.
///
/// ```
/// use footlight_engine::Host;
/// use footlight_host::files::Memory;
///
/// let host = Host {
///     files: Box::new(Memory::default().with("room.obj", "v 0 0 0")),
///     threads: 2,
///     memory: 1 << 30,
///     ..Host::default()
/// };
/// assert!(host.background.is_none());
/// ```
pub struct Host {
    /// Reads the files that the show names: stage, materials, images, included texts.
    pub files: Box<dyn Files>,
    /// Receives results and saved shows, and holds stored images.
    pub store: Box<dyn Store>,
    /// Measures the duration of each step.
    pub clock: Box<dyn Clock>,
    /// Receives progress, and cancels.
    pub progress: Box<dyn Progress>,
    /// The operator G.
    pub renderer: Arc<dyn Transport>,
    /// Rendering threads, started for one call of the operator and ended with it; on platforms
    /// without threads the caller's is used. Results do not depend on the number.
    pub threads: usize,
    /// Approximate memory limit of a show with its images, bytes; larger ones are refused.
    pub memory: usize,
    /// The processor's name, for records of measurements; `None` omits it.
    pub processor: Option<String>,
    /// Storage of images between sessions, if any.
    pub pool: Option<PoolPlace>,
    /// When true, calls that need images still being rendered in the background fail with
    /// [`Error::NotYet`](super::Error::NotYet) instead of waiting: for interactive programs.
    pub impatient: bool,
    /// Runs refinement in the background; without it, [`Engine::start`](super::Engine::start)
    /// fails.
    pub background: Option<Box<dyn Background>>,
}

/// A folder for images, reached through the host's store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoolPlace {
    /// The folder; created if missing.
    pub folder: PathBuf,
    /// Most bytes in the folder.
    pub limit: u64,
}

/// Default limit of images on disk, bytes.
pub const POOL_LIMIT: u64 = 2_000_000_000;

impl Default for Host {
    /// No files, the disk as store, the machine's clock, no progress, radiosity, one thread, four
    /// gigabytes, images only in memory, nothing in the background.
    fn default() -> Host {
        Host {
            files: Box::new(Memory::default()),
            store: Box::new(Disk),
            clock: Box::new(Monotonic::default()),
            progress: Box::new(Silent),
            renderer: Arc::new(Radiosity),
            threads: 1,
            memory: 4 << 30,
            processor: None,
            pool: None,
            impatient: false,
            background: None,
        }
    }
}

impl std::fmt::Debug for Host {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Host")
            .field("renderer", &self.renderer.name())
            .field("threads", &self.threads)
            .field("memory", &self.memory)
            .finish_non_exhaustive()
    }
}

impl Host {
    /// A cache of images in memory and in the host's folder.
    pub(super) fn image_cache(&self) -> ImageCache {
        let disk_cache = |place: &PoolPlace| DiskCache::new(&place.folder, place.limit);
        ImageCache::new(self.pool.as_ref().map(disk_cache))
    }

    /// Progress, cancellation, threads and memory for a call.
    pub fn work(&self) -> Work<'_> {
        Work {
            progress: self.progress.as_ref(),
            threads: self.threads,
            memory: self.memory,
        }
    }
}

/// Runs tasks in the background, for example on threads. Closures implement it:
///
/// ```
/// let host = footlight_engine::Host {
///     background: Some(Box::new(|task| drop(std::thread::spawn(task)))),
///     ..footlight_engine::Host::default()
/// };
/// ```
pub trait Background: Send {
    /// Starts a task and returns; call [`Engine::poll`](super::Engine::poll) when it is done.
    fn start(&self, task: Box<dyn FnOnce() + Send>);
}

impl<F: Fn(Box<dyn FnOnce() + Send>) + Send> Background for F {
    fn start(&self, task: Box<dyn FnOnce() + Send>) {
        self(task);
    }
}
