//! Where the usual methods fail, and what is done here instead: each test shows both.
//!
//! The naive methods stand in `footlight::study::stability`, from where `chart stability` draws
//! them. `data` holds what only other programs can find: `svd_peers` (the one in
//! `tests/peers/svd`).

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "test; its figures are for whoever runs it with --nocapture"
)]

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
mod study;
