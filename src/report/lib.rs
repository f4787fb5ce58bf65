//! Typed results as text, tables, charts and data.
//!
//! Each module takes one result and writes it in up to three ways: `describe` in words for a
//! terminal, `drawing` as a chart, `record` as the one table ([`Record`]) that CSV and JSON are
//! made of. Invariants: the three show the same figures, each read from the typed result and never
//! from another report; one result gives the same bytes on every machine.
//!
//! This module must not depend on verbs, prompts or terminals, and computes no result of its own.

pub mod chart;
pub mod comparison;
pub mod curves;
pub mod document;
mod error;
pub mod exchange;
pub mod explain;
pub mod farm;
pub mod film;
pub mod format;
pub mod layers;
mod manifest;
pub mod numbered;
pub mod page;
pub mod plan;
pub mod plot;
pub mod pool;
pub mod quality;
pub mod record;
pub mod refine;
pub mod results;
pub mod run;
pub mod sheet;
pub mod stage;
pub mod table;
pub mod target;
pub mod tasks;
pub mod tradeoff;
pub mod versions;
pub mod ways;
pub mod words;

pub use error::Error;
pub use record::{Point, Quantity, Record, RecordSeries, StudyKind};
