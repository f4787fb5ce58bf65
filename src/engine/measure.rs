//! Measurements of the program's results and errors, as typed values.
//!
//! Invariant: an unknown figure is absent, never zero.

pub mod independent;
pub mod machine;
pub mod quality;

pub use independent::{Effort, MeasuredError, MeasuredMoment};
pub use machine::Machine;
