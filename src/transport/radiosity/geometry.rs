//! The scene as facets, their convex pieces and closed solids, and the clipping of convex polygons.
//!
//! Depends on neither lights nor a mesh.

pub mod clipper;
pub mod solid;
pub mod surface;

/// The least and the greatest of some numbers: infinity and minus infinity without any.
pub fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(none, |(low, high), x| (low.min(x), high.max(x)))
}

/// For tests: a rectangle at height `z`, counter-clockwise seen from above.
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
