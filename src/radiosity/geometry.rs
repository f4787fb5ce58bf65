//! The scene as facets, their convex pieces and closed solids, and the clipping of convex polygons.
//!
//! Knows neither lights nor a mesh.

pub mod solid;
pub mod stencil;
pub mod surface;
