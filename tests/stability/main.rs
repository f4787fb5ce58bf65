//! Where the usual methods fail, and what is done here instead: each test shows both.
//!
//! The naive methods are in `methods`, which `examples/stability` draws; the paper's ways to choose
//! and show refined pictures are in `examples/trial`. `data` holds what only other programs can
//! find: `svd_peers` (the one in `tests/peers/svd`).

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

#[path = "../../examples/trial/dice.rs"]
mod dice;
#[path = "../../examples/trial/evaluation.rs"]
#[allow(dead_code, reason = "not all of it is wanted here")]
mod evaluation;
#[path = "../../examples/trial/projection.rs"]
#[allow(dead_code, reason = "not all of it is wanted here")]
mod projection;
#[path = "../../examples/trial/random_show.rs"]
mod random_show;

mod contact;
mod decomposition;
mod hostile;
mod indirect;
#[allow(dead_code, reason = "not all of it is wanted here")]
mod methods;
mod refined_first;
mod sampling;
mod study;
