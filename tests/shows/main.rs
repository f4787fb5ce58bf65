//! The shipped shows with generated sets: each set is its program's output and can be drawn.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]
#![allow(
    clippy::duplicate_mod,
    reason = "the programs that make sets are crates of their own and share their parts by path"
)]

mod beams;
mod desk;
mod gltf_stage;
mod set;
mod tavern;
mod turandot;
