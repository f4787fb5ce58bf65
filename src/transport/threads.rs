//! The threads of one call of an operator.

use crate::TransportError;
use footlight_host::work::Work;
use rayon::ThreadPool;

/// Threads of one call of the operator; `None` on platforms without threads, where loops run on the
/// caller's.
pub struct Threads(Option<ThreadPool>);

impl Threads {
    /// Starts as many threads as the task allows.
    ///
    /// # Errors
    /// [`TransportError::Scene`] when the platform refuses them.
    pub fn new(work: Work<'_>) -> Result<Threads, TransportError> {
        if cfg!(target_family = "wasm") {
            return Ok(Threads(None));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(work.threads.max(1));
        let pool = pool.build();
        let pool = pool.map_err(|e| TransportError::Scene(format!("no threads: {e}")))?;
        Ok(Threads(Some(pool)))
    }

    /// Runs `task` on these threads.
    pub fn install<R: Send>(&self, task: impl FnOnce() -> R + Send) -> R {
        match &self.0 {
            Some(pool) => pool.install(task),
            None => task(),
        }
    }
}
