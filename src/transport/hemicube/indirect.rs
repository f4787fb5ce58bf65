//! Reflected light: form factors by hemicubes, the iteration over them, and its interpolation.

pub mod form;
pub(crate) mod gather_points;
pub mod hemicube;
mod interpolation;
mod smoothing;
