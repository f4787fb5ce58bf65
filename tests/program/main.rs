//! The program as a process among others: its help and the README in a shell, a terminal, a called
//! renderer, a shared store, files of every kind.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::print_stderr,
    reason = "a test stops at its first surprise, and says what it skips"
)]

mod editor;
mod farm;
mod files;
mod film;
mod help;
mod hints;
mod lost;
mod memory;
mod moments;
mod outside;
mod readme;
mod roads;
mod serve;
mod stage;
mod stop;
mod store_process;
mod terminal;
mod words;
