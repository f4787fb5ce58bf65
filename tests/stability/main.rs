//! Where the usual methods fail, and what is done here instead: each test shows both.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "test")]

#[path = "../reference/mod.rs"]
mod reference;

mod indirect;
