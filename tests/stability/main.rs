//! Where the usual methods fail, and what is done here instead: each test shows both.
//!
//! `data` holds what the studies found: `svd_peers` (the program in `tests/peers/svd`),
//! `orthogonality` (`--example svd_study`) and `positivity` (`--example positivity`).

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "test; its figures are for whoever runs it with --nocapture"
)]

#[path = "../reference/extended.rs"]
mod extended;
#[path = "../reference/failures.rs"]
mod failures;
#[path = "../reference/gram_schmidt.rs"]
mod gram_schmidt;
#[path = "../reference/hard.rs"]
mod hard;
#[path = "../exact/meter.rs"]
#[allow(dead_code, reason = "not all of it is wanted here")]
mod meter;
#[path = "../reference/mod.rs"]
mod reference;

mod contact;
mod decomposition;
mod hostile;
mod indirect;
mod sampling;
