//! The scene as facets, their convex pieces and closed solids, and the clipping of convex polygons.
//!
//! Depends on neither lights nor a mesh.

pub mod clipper;
pub mod solid;
pub mod surface;
