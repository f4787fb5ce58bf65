//! What an embedding program gives to the engine: files, a clock, the renderer, threads, progress,
//! limits of memory and time, and where images are stored.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::pool::disk_cache::DiskCache;
use crate::pool::image_cache::ImageCache;
use footlight_host::files::{Clock, Disk, Files, Memory, Monotonic, Store};
use footlight_host::work::{Progress, Silent, Work};
use footlight_transport::Transport;
use footlight_transport::radiosity::Radiosity;

/// The means an embedding program gives to an [`Engine`](super::Engine). All of them are [`Send`],
/// so that an engine can be moved to another thread.
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
    /// Takes results and saved shows, and holds stored images.
    pub store: Box<dyn Store>,
    /// Measures the seconds of each step.
    pub clock: Box<dyn Clock>,
    /// Takes progress, gives cancel.
    pub progress: Box<dyn Progress>,
    /// The operator G.
    pub renderer: Arc<dyn Transport>,
    /// Threads for rendering, started for one call of the operator and ended with it; on platforms
    /// without threads it runs on the caller's. Results do not depend on it.
    pub threads: usize,
    /// Bytes that a show may take with all that is rendered of it, about; what does not fit is
    /// refused.
    pub memory: usize,
    /// The longest that a call may take: [`Engine::coarse`](super::Engine::coarse) and what needs
    /// coarse images, [`refine`](super::Engine::refine), [`wait`](super::Engine::wait), and any
    /// line of a prompt; opening the show counts as a part of the first. Then it ends as if cancelled, with
    /// [`Error::OutOfTime`](super::Error::OutOfTime); images that are finished are kept. `None`: no
    /// limit. A refinement in the background is not limited by it.
    pub time: Option<Duration>,
    /// The processor's name, for the records of measurements; `None` leaves it out.
    pub processor: Option<String>,
    /// Where images are stored from session to session, if anywhere.
    pub pool: Option<PoolPlace>,
    /// Calls that need images which the background is still rendering fail with
    /// [`Error::NotYet`](super::Error::NotYet), in place of waiting for them: for a program in which
    /// somebody types.
    pub impatient: bool,
    /// Runs refinement in the background; without it [`Engine::start`](super::Engine::start) is
    /// refused.
    pub background: Option<Box<dyn Background>>,
}

/// A folder for images, reached through the host's store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoolPlace {
    /// The folder; made when it is missing.
    pub folder: PathBuf,
    /// The most bytes that it may hold.
    pub limit: u64,
}

/// Bytes that images may take on disk unless something else is said.
pub const POOL_LIMIT: u64 = 2_000_000_000;

impl Default for Host {
    /// No files, the disk as store, the machine's clock, no progress, radiosity, one thread, four
    /// gigabytes, no limit of time, images kept in memory only, nothing in the background.
    fn default() -> Host {
        Host {
            files: Box::new(Memory::default()),
            store: Box::new(Disk),
            clock: Box::new(Monotonic::default()),
            progress: Box::new(Silent),
            renderer: Arc::new(Radiosity),
            threads: 1,
            memory: 4 << 30,
            time: None,
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
            .field("time", &self.time)
            .finish_non_exhaustive()
    }
}

impl Host {
    /// Images in memory and in the host's folder, none of them read yet.
    pub(super) fn image_cache(&self) -> ImageCache {
        let disk_cache = |place: &PoolPlace| DiskCache::new(&place.folder, place.limit);
        ImageCache::new(self.pool.as_ref().map(disk_cache))
    }

    /// Progress, cancel, threads and memory for a call.
    pub fn work(&self) -> Work<'_> {
        Work {
            progress: self.progress.as_ref(),
            threads: self.threads,
            memory: self.memory,
        }
    }
}

/// Runs tasks in the background, such as on threads. A closure is one:
///
/// ```
/// let host = footlight_engine::Host {
///     background: Some(Box::new(|task| drop(std::thread::spawn(task)))),
///     ..footlight_engine::Host::default()
/// };
/// ```
pub trait Background: Send {
    /// Starts a task and comes back; [`Engine::poll`](super::Engine::poll) should be called once it is done.
    fn start(&self, task: Box<dyn FnOnce() + Send>);
}

impl<F: Fn(Box<dyn FnOnce() + Send>) + Send> Background for F {
    fn start(&self, task: Box<dyn FnOnce() + Send>) {
        self(task);
    }
}
