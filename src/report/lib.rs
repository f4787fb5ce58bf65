//! Typed results as text, tables, charts and data.
//!
//! ```text
//! Engine, results --describe--> words    --drawing--> Drawing --> PNG, SVG
//! ```
//!
//! Each module takes one result and writes it in up to two ways: `describe` in words for a
//! terminal, `drawing` as a chart.
//!
//! - [`document`], [`sheet`], [`versions`] and [`curves`] report a show; [`stage`] its stage,
//!   [`rig`] its lights.
//! - [`plan`], [`refine`], [`ways`], [`tasks`], [`farm`] and [`pool`] report the refinement.
//! - [`quality`] and [`measured`] report measurements.
//! - [`run`] and [`results`] write a folder of results. [`target`] writes a sequence: [`film`],
//!   [`layers`], [`page`].
//! - [`chart`] lays plain data out as a drawing and paints it. [`table`] aligns text.
//!   [`mod@format`] knows the extensions of files. [`words`] holds numbers in words.
//!
//! Invariants:
//!
//! - All forms of a result show the same figures. Each reads them from the typed result, never from
//!   another report.
//! - One result gives the same bytes on every machine.
//! - Wording is decided once, here: errors of the crates below carry numbers and no advice.
//!
//! This crate does not know verbs, prompts or terminals, and computes no results.

pub mod chart;
pub mod curves;
pub mod document;
mod error;
pub mod exchange;
pub mod explain;
pub mod farm;
pub mod film;
pub mod format;
pub mod illuminance;
pub mod layers;
mod manifest;
pub mod measured;
pub mod numbered;
pub mod page;
pub mod plan;
pub mod plot;
pub mod pool;
pub mod quality;
pub mod refine;
pub mod results;
pub mod rig;
pub mod run;
pub mod sheet;
pub mod solved;
pub mod stage;
pub mod table;
pub mod target;
pub mod tasks;
pub mod versions;
pub mod ways;
pub mod words;

pub use error::Error;
pub use manifest::Results;
