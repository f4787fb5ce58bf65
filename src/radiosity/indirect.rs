//! Reflected light: form factors by hemicubes, the iteration over them, and its interpolation.

mod between;
pub mod flux;
pub mod form;
pub mod gather;
pub mod hemicube;
mod links;
pub mod solution;
