//! The shipped shows with sets of their own: each set is what its program makes and can be drawn.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]

mod gltf_stage;
mod set;
mod tavern;
mod turandot;
