//! Measurements: what the program does compared with what it should do, as typed results.
//!
//! One measure of error ([`difference`](difference::difference)) and what is measured with it.
//! Invariants: a figure that cannot be known is absent, never zero; a result says of which show and
//! on which machine it was measured ([`Origin`]).

pub mod comparison;
pub mod difference;
pub mod independent;
pub mod machine;
pub mod quality;
pub mod reference;
pub mod tradeoff;
pub mod wait;

pub use comparison::{BankError, Comparison};
pub use independent::{Effort, MeasuredError, MeasuredMoment};
pub use machine::{Machine, Origin};
pub use reference::Reference;
pub use wait::LongRun;
