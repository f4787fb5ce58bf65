//! The operator against exact answers: closed forms, laws of conservation and symmetry, and scenes
//! made to break it. All tests use the public operator, like a user.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "test; its figures are for whoever runs it with --nocapture"
)]

mod cie;
mod final_gather;
mod form_factor;
mod furnace;
mod gloss;
mod haze;
mod heads;
mod invariance;
mod luminaires;
mod meter;
mod radiosity;
#[path = "../reference/mod.rs"]
mod reference;
mod superposition;
