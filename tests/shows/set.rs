//! Invariants of every generated set: valid faces, fronts to the house.

use std::path::Path;

use footlight_picture::{decode, png};
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, newell, vec3};

/// A face: a description, and its corners.
pub type VertexBuffer = (String, Vec<Vec3>);

/// A model's face as an outline.
pub fn outline(material: &str, object: &str, vertices: &[[f64; 3]]) -> VertexBuffer {
    let corners = vertices.iter().map(|&[x, y, z]| vec3(x, y, z));
    (format!("{material} of {object}"), corners.collect())
}

/// The grey images of a set's surfaces are their program's output, pixel by pixel, and small in
/// total.
pub fn has_its_images<'a>(
    folder: &Path,
    side: usize,
    painted: impl Iterator<Item = (&'a str, Vec<u8>)>,
) {
    let mut bytes = 0;
    for (name, grey) in painted {
        let rgb: Vec<u8> = grey.iter().flat_map(|g| [*g; 3]).collect();
        let made = png::encode(side, side, &rgb).unwrap();
        let found = std::fs::read(folder.join(format!("{name}.png"))).unwrap();
        let read = |bytes: &[u8]| decode::light(bytes, 1 << 24).unwrap();
        assert!(read(&found) == read(&made), "{name}: run the example");
        bytes += found.len();
    }
    assert!(bytes < 100_000, "{bytes} bytes of images");
}

/// Every face is planar and convex, runs counter-clockwise and has an area.
pub fn is_worth_drawing(outlines: &[VertexBuffer]) {
    for (name, outline) in outlines {
        let normal = newell(outline);
        assert!(normal.length() > 1e-4, "{name}: {outline:?} has no area");
        let normal = normal / normal.length();
        let corners = outline.len();
        for i in 0..corners {
            let [a, b, c] = [0, 1, 2].map(|k| outline[(i + k) % corners]);
            let off = (b - outline[0]).dot(normal).abs();
            assert!(off < 1e-6, "{name}: {b:?} is {off} m off the plane");
            let turn = (b - a).cross(c - b).dot(normal);
            assert!(turn > 0.0, "{name}: does not turn left at {b:?}");
        }
    }
}

/// The audience sees only fronts: on a grid of rays through the image, the nearest face never shows
/// its black back, and every ray hits something.
pub fn shows_fronts(outlines: &[VertexBuffer], view: &View) {
    let forward = view.to - view.from;
    let right = forward.cross(vec3(0.0, 0.0, 1.0));
    let up = right.cross(forward);
    let (right, up) = (right / right.length(), up / up.length());
    let half = (view.fov.to_radians() / 2.0).tan() * forward.length();
    let wide = half * view.width as f64 / view.height as f64;
    let normals: Vec<Vec3> = outlines.iter().map(|(_, o)| newell(o)).collect();
    for row in 0..90 {
        for column in 0..160 {
            let x = (f64::from(column) + 0.5) / 80.0 - 1.0;
            let y = (f64::from(row) + 0.5) / 45.0 - 1.0;
            let ray = forward + right * (x * wide) + up * (y * half);
            let hits = outlines
                .iter()
                .zip(&normals)
                .filter_map(|((name, o), n)| Some((hit(o, *n, view.from, ray)?, name)));
            let nearest = hits.min_by(|a, b| a.0.0.total_cmp(&b.0.0));
            let Some(((_, front), name)) = nearest else {
                unreachable!("nothing is seen at column {column}, row {row}")
            };
            assert!(
                front,
                "the back of {name} is seen at column {column}, row {row}"
            );
        }
    }
}

/// Distance along the ray to a convex outline, and true if its front is hit.
fn hit(outline: &[Vec3], normal: Vec3, from: Vec3, ray: Vec3) -> Option<(f64, bool)> {
    let toward = ray.dot(normal);
    let t = (outline[0] - from).dot(normal) / toward;
    let at = from + ray * t;
    let next = outline.iter().cycle().skip(1);
    let inside = |(a, b): (&Vec3, &Vec3)| (*b - *a).cross(at - *a).dot(normal) >= 0.0;
    (t > 0.0 && outline.iter().zip(next).all(inside)).then_some((t, toward < 0.0))
}
