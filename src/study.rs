//! Measurements: what the program does held against what it should do, and the records of it.
//!
//! One measure of error ([`mod@difference`]), one kind of record ([`Record`]) that every chart and
//! every table is made of, and the studies themselves. Invariants: a figure that cannot be known
//! is absent, never zero; a record says on which machine and by which version it was measured;
//! what is drawn is what the record holds.
//!
//! This room must not know of text, prompts or verbs. It has no clock: who measures gives one.

pub mod comparison;
pub mod difference;
pub mod forecast;
pub mod playback;
pub mod random;
pub mod record;
pub mod reference;
pub mod refinement;
pub mod session;
pub mod stability;
pub mod tradeoff;
pub mod trial;
pub mod tune;
pub mod verdict;

pub use comparison::{BankError, Comparison};
pub use difference::{Difference, difference};
pub use random::{Dice, RandomShow, random_show};
pub use record::{Kind, Machine, Point, Quantity, Record, Series};
pub use reference::{Reference, ReferenceError};
pub use trial::{Foretold, Shown, Trial};
pub use tune::{Candidate, Tuner};
