//! The text of a show and what it means.
//!
//! ```text
//! text --lang--> Show --timeline--> levels of every bank at every moment, key settings
//! ```
//!
//! - [`lang`] reads the text: grammar, names, includes, formatter, edits that keep what they do not
//!   touch. What is wrong becomes a [`Diagnostic`](diagnostic::Diagnostic) with its place.
//! - [`model`] is the show without syntax: banks, lights, looks, cues, parts, curves.
//! - [`timeline`] turns cues into polynomials in time, and finds the key settings.
//! - [`check`] looks for what follows from the curves alone: levels out of range, overtaken cues.
//! - [`units`], [`geometry`], [`linalg`], [`hash`] and [`printable`] are the ground on which the
//!   other crates stand too.
//!
//! This crate does not know the stage's files, light transport or images. It is enough for a
//! program that reads cue sheets and wants levels over time.

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
