//! Failures of common methods, and Footlight's alternatives: each test shows both.
//!
//! The naive methods are in `methods`, which `examples/stability` draws; the paper's methods of
//! choosing and showing refined images are in `examples/studies`. `data` holds results of other
//! programs: `svd_peers` (from `tests/peers/svd`).

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
#[path = "../../examples/studies/src/dice.rs"]
mod dice;
mod hostile;
mod indirect;
#[allow(dead_code, reason = "not all of it is wanted here")]
mod methods;
mod sampling;
mod study;
