//! The scene and its view, as both renderers use them: facets, their convex pieces, the hierarchy
//! over the pieces, the camera, and the fragments of facets in the image.
//!
//! This module depends on neither meshes nor rays; its only knowledge of lights is the set of
//! emitting materials.

pub mod camera;
pub mod clipper;
mod coverage;
pub mod emitter_mask;
pub mod facet;
pub mod fragment;
pub mod hierarchy;
pub mod lists;
pub mod lobe;
pub(crate) mod raster;
mod sliver;
pub mod surface;

/// Approximate bytes of a polygon as facet and pieces, in the hierarchy and in both grids.
pub const FACET_BYTES: usize = 1800;

/// Minimum and maximum of some numbers; infinity and minus infinity if there are none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(none, |(low, high), x| (low.min(x), high.max(x)))
}

/// For tests: a rectangle at height `z`, anticlockwise seen from above.
#[cfg(test)]
pub fn rectangle(x: (f64, f64), y: (f64, f64), z: f64) -> [footlight_show::geometry::Vec3; 4] {
    let corner = |x, y| footlight_show::geometry::vec3(x, y, z);
    [
        corner(x.0, y.0),
        corner(x.1, y.0),
        corner(x.1, y.1),
        corner(x.0, y.1),
    ]
}
