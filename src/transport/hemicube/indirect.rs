//! Reflected light: form factors by hemicubes, the iteration over them, and its interpolation.

pub mod form;
pub mod gather_points;
pub mod hemicube;
mod interpolation;
mod smoothing;
