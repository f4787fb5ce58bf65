//! Reflected light: form factors by hemicubes, the iteration over them, and its interpolation.

pub mod flux;
pub mod form;
pub mod gather;
pub mod hemicube;
mod interpolation;
mod smoothing;
pub mod solution;
