//! What an embedding program gives to the interpreter: files, a clock, the operator, threads,
//! progress, and where pictures and words go.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use super::Shown;
use super::beside::Background;
use super::stage::Means;
use crate::diagnostic::Style;
use crate::files::{Clock, Disk, Files, Memory, Monotonic, Store};
use crate::pool::archive::Archive;
use crate::pool::depot::Depot;
use crate::radiosity::Radiosity;
use crate::renderer::Transport;
use crate::work::{Progress, Silent, Work};

/// The means an embedding program gives.
pub struct Host {
    /// Reads the show's own files (stage, materials).
    pub files: Box<dyn Files>,
    /// Takes results and saved shows.
    pub store: Box<dyn Store>,
    /// Measures the seconds reported for each step.
    pub clock: Box<dyn Clock>,
    /// Takes progress, gives cancel.
    pub progress: Box<dyn Progress + Send + Sync>,
    /// The operator G.
    pub transport: Arc<dyn Transport>,
    /// Threads for rendering; results do not depend on it.
    pub threads: usize,
    /// Bytes that rendering may hold.
    pub memory: usize,
    /// The longest that a call may take: [`Interpreter::execute`](super::Interpreter::execute),
    /// [`call`](super::Interpreter::call), and what renders when called by itself (`coarse`,
    /// `refine`, `run`, `wait`). Then it ends as if cancelled twice, with
    /// [`Error::OutOfTime`](super::Error::OutOfTime); pictures that are finished are kept. `None`:
    /// as long as it takes. What goes on beside the prompt is no call.
    pub time: Option<Duration>,
    /// The processor's name, for the records of measurements; `None` leaves it out.
    pub processor: Option<String>,
    /// How diagnostics are written into replies.
    pub style: Style,
    /// Where pictures are stored from session to session, if anywhere.
    pub pool: Option<PoolPlace>,
    /// Opens what `-o -` writes to, such as standard output; without it that is refused.
    pub pipe: Option<Box<dyn Fn() -> Box<dyn Write>>>,
    /// Shows frames as `play` makes them; without it `play` only tells how fast it is.
    pub canvas: Option<Box<dyn Canvas>>,
    /// Runs what goes on beside the prompt (`refine … &`); without it that is refused.
    pub background: Option<Box<dyn Background>>,
}

/// Where a sequence is seen while it plays.
pub trait Canvas {
    /// Shows a frame in place of the one before, and takes as long as it wants to; false when
    /// nobody looks any more.
    fn frame(&self, picture: &Shown) -> bool;

    /// No more frames come.
    fn end(&self);
}

/// A folder for pictures, reached by the host's store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoolPlace {
    /// The folder; made when it is missing.
    pub folder: PathBuf,
    /// The most bytes that it may hold.
    pub limit: u64,
}

/// Bytes that pictures may take on disk unless something else is said.
pub const POOL_LIMIT: u64 = 2_000_000_000;

impl Default for Host {
    /// No files, the disk as store, the machine's clock, silence, radiosity, one thread, four
    /// gigabytes, no limit of time, plain text, pictures kept in memory only.
    fn default() -> Host {
        Host {
            files: Box::new(Memory::default()),
            store: Box::new(Disk),
            clock: Box::new(Monotonic::default()),
            progress: Box::new(Silent),
            transport: Arc::new(Radiosity),
            threads: 1,
            memory: 4 << 30,
            time: None,
            processor: None,
            style: Style::Plain,
            pool: None,
            pipe: None,
            canvas: None,
            background: None,
        }
    }
}

impl std::fmt::Debug for Host {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Host")
            .field("transport", &self.transport.name())
            .field("threads", &self.threads)
            .field("memory", &self.memory)
            .field("time", &self.time)
            .finish_non_exhaustive()
    }
}

impl Host {
    pub(super) fn means(&self) -> Means<'_> {
        Means {
            transport: self.transport.as_ref(),
            store: self.store.as_ref(),
            work: self.work(),
        }
    }

    pub(super) fn archive(&self) -> Archive {
        let operator = self.transport.results().unwrap_or_default();
        let depot = |place: &PoolPlace| Depot::new(&place.folder, place.limit, &operator);
        Archive::new(self.pool.as_ref().map(depot))
    }

    pub(super) fn work(&self) -> Work<'_> {
        Work {
            progress: self.progress.as_ref(),
            threads: self.threads,
            memory: self.memory,
        }
    }
}
