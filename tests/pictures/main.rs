//! Visible results: image files, frames, playback, the page in a browser, plots.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::print_stderr,
    reason = "a test stops at its first surprise, and says what it skips"
)]

mod browser;
mod displayed;
mod judge;
mod output;
mod page;
mod playback;
mod plot;
mod served;
