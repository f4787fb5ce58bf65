//! Shared by the studies: random shows, and orders of refinement compared with ground truth.
//!
//! Each program is in `src/bin`: `cargo run --release -p footlight-studies --bin NAME`.

pub mod dice;
pub mod evaluation;
pub mod projection;
pub mod random_show;
pub mod record;
pub mod timed;
pub mod trial;

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]
mod refined_first;
