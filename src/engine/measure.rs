//! Measurements of the program's results and errors, as typed values.
//!
//! Invariant: an unknown figure is absent, never zero.

pub mod independent;
pub mod machine;
pub mod meter;
pub mod quality;

pub use independent::MeasuredMoment;
pub use machine::Machine;
pub use meter::{Effort, MeasuredError};
