//! Where the usual methods fail, and what is done here instead: each test shows both.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "test")]

#[path = "../reference/extended.rs"]
mod extended;
#[path = "../reference/failures.rs"]
mod failures;
#[path = "../reference/gram_schmidt.rs"]
mod gram_schmidt;
#[path = "../reference/hard.rs"]
mod hard;
#[path = "../reference/mod.rs"]
mod reference;

mod decomposition;
mod indirect;
