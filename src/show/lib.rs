//! The text of a show and its meaning.
//!
//! ```text
//! text --lang--> Show --timeline--> levels of every bank at every moment, key settings
//! ```
//!
//! - [`lang`] reads the text ([`lang::parse`]), formats it and edits it. An edit keeps what it does
//!   not touch. Every mistake becomes a [`Diagnostic`](diagnostic::Diagnostic) with its place.
//! - [`model`] holds the [`Show`](model::Show) without syntax: banks, lights, looks, cues, parts
//!   and curves. Names are indices there.
//! - [`timeline`] compiles the cues to a [`Timeline`](timeline::Timeline) of polynomials in time,
//!   and cuts that into a [`KeySequence`](timeline::KeySequence).
//! - [`check`] finds what only the curves show: levels out of range, overtaken cues.
//! - [`units`], [`geometry`], [`linalg`], [`hash`] and [`printable`] are shared with the crates
//!   above.
//!
//! Invariants:
//!
//! - A show exists exactly when its text has no error. It then keeps the invariants of [`model`].
//! - Time and memory are linear in the text, within the limits of the language.
//! - Knots are whole microseconds. A knot's value is computed once, so that equal looks are equal
//!   to the bit.
//!
//! This crate does not know the stage's files, light transport or images. It reads files only
//! through [`Files`](footlight_host::files::Files). A program that reads cue sheets and wants
//! levels over time needs no other crate.

// Generators of shows for tests name this crate as others do.
#[cfg(test)]
extern crate self as footlight_show;

pub mod check;
pub mod diagnostic;
pub mod geometry;
pub mod hash;
pub mod lang;
pub mod linalg;
pub mod model;
pub mod printable;
pub mod timeline;
pub mod units;
