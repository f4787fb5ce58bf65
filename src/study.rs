//! Measurements: what the program does compared with what it should do, as typed results.
//!
//! One measure of error ([`mod@difference`]) and the studies themselves. Invariants: a figure that
//! cannot be known is absent, never zero; a result says of which show and on which machine it was
//! measured ([`Origin`]).
//!
//! This module must not depend on words, charts, files of results or prompts: `report` turns its
//! results into those. It has no clock: the caller gives the seconds.

pub mod comparison;
pub mod difference;
pub mod forecast;
pub mod machine;
pub mod playback;
pub mod reference;
pub mod refinement;
pub mod session;
pub mod tradeoff;
pub mod trial;
pub mod tune;

pub use comparison::{BankError, Comparison};
pub use difference::{Difference, difference};
pub use machine::{Machine, Origin};
pub use reference::{Reference, ReferenceError};
pub use trial::{Foretold, Order, Shown, Trial};
pub use tune::{Candidate, Tuner};
