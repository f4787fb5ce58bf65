//! Services that an embedding program provides to Footlight: files, programs, a clock, progress.
//!
//! All effects on the outside go through this crate. An embedding program implements its traits, or
//! takes the ready types.
//!
//! - [`Files`](files::Files) reads what a show refers to: [`Folder`](files::Folder) from a folder,
//!   [`Memory`](files::Memory) from memory.
//! - [`Store`](files::Store) writes results: [`Disk`](files::Disk) to files,
//!   [`MemoryStore`](files::MemoryStore) to memory.
//! - [`Clock`](files::Clock) tells the time; [`Processes`](files::process::Processes) starts other
//!   programs; [`claim`](files::claim) shares work among processes of several machines.
//! - [`Progress`](work::Progress) receives the progress of a call, and cancels it.
//!   [`Work`](work::Work) carries progress, threads and memory of one call down to every loop.
//!
//! Invariants:
//!
//! - A show reads only from its own folder downwards, whatever links or `..` a path holds.
//! - A file is never left half written: it is written next to its place, then renamed.
//! - Programs are started without a shell and are ended with the process that started them.
//!
//! No other crate of the library touches `std::fs`, a process or a clock. This crate does not know
//! shows, images or the stage.

pub mod files;
pub mod work;
