//! Measurements of the program's results and errors, as typed values.
//!
//! One measure of error ([`difference`](difference::difference)) and measurements based on it.
//! Invariants: an unknown figure is absent, never zero; a result names its show and machine
//! ([`Origin`]).

pub mod comparison;
pub mod difference;
pub mod independent;
pub mod machine;
pub mod quality;
pub mod reference;
pub mod tradeoff;

pub use comparison::{BankError, Comparison};
pub use independent::{Effort, MeasuredError, MeasuredMoment};
pub use machine::{Machine, Origin};
pub use reference::Reference;
