//! Sessions with the interpreter, without a terminal: verbs, edits, refinement, the pool, studies.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]

mod beside;
mod design;
mod files;
mod image_banks;
mod session;
mod store;
mod study;
mod transcripts;

/// A clock that stands still: predicted seconds are then the operator's own, and transcripts do not
/// depend on the machine.
struct Stopped;

impl footlight::files::Clock for Stopped {
    fn seconds(&self) -> f64 {
        0.0
    }
}
