//! Verified linear algebra, and polynomials in Bernstein form.
//!
//! Invariants: a decomposition is verified before it is returned (see [`svd`]); a direction that
//! lies in the span of others is refused, never normalised ([`Orthonormal`]); a polynomial's end
//! values are exact under every operation that keeps them ([`Bernstein`]). Sums run in a fixed
//! order on one thread. This module does not know lights, cues or images.

mod bernstein;
mod bounded;
mod orthogonal;
mod svd;
mod triangle;

pub use bernstein::{Bernstein, mass, mass_factor};
pub(crate) use bernstein::{binomial, quadratic_roots};
pub use bounded::{BoundedSolution, bounded_least_squares};
pub use orthogonal::{Dependent, Orthonormal, least_squares};
pub use svd::{Svd, SvdError, svd};
pub use triangle::Triangle;

/// A dense matrix of doubles, column by column.
pub type Matrix = nalgebra::DMatrix<f64>;

/// A column of doubles.
pub type Vector = nalgebra::DVector<f64>;
