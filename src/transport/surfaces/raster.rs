//! The software rasteriser: convex polygons into item buffers.
//!
//! For every pixel an item buffer holds the nearest item along the ray through the pixel's centre,
//! and its inverse depth. Depths come from each polygon's own plane, not from interpolated
//! vertices, so they are exact wherever the polygon is drawn. Of two coplanar polygons the one
//! drawn later wins: callers draw large ones first. This module does not depend on materials or
//! light.

#![allow(
    clippy::indexing_slicing,
    reason = "scan conversion: every index is clamped to the buffer just before its use"
)]

use crate::surfaces::camera::Camera;
use footlight_show::geometry::Vec3;

/// No item: the ray leaves the scene.
pub const NOTHING: u32 = u32::MAX;

/// Relative difference of inverse depths below which two surfaces are coplanar. Vertices that
/// passed through single precision differ by about 1e-7.
const COPLANAR: f64 = 1e-6;

/// The nearest item and its inverse depth for every pixel.
#[derive(Clone, Debug)]
pub struct ItemBuffer {
    width: usize,
    height: usize,
    items: Vec<u32>,
    /// Inverse depth along the camera's `forward`; 0 where nothing was drawn.
    inverse_depths: Vec<f64>,
    /// Left and right ends of the polygon being drawn, one pair for each row.
    spans: Vec<(f64, f64)>,
    /// Vertices of the polygon being drawn: right, up, depth.
    eye: Vec<Vec3>,
    /// Vertices of its part in front of the eye, at last in pixels.
    clipped: Vec<Vec3>,
}

impl ItemBuffer {
    /// An empty buffer of `width` x `height` pixels.
    pub fn new(width: usize, height: usize) -> ItemBuffer {
        ItemBuffer {
            width,
            height,
            items: vec![NOTHING; width * height],
            inverse_depths: vec![0.0; width * height],
            spans: vec![(0.0, 0.0); height],
            eye: Vec::new(),
            clipped: Vec::new(),
        }
    }

    /// Clears the buffer.
    pub fn clear(&mut self) {
        self.items.fill(NOTHING);
        self.inverse_depths.fill(0.0);
    }

    /// Items row by row from the top; [`NOTHING`] where none was drawn.
    pub fn items(&self) -> &[u32] {
        &self.items
    }

    /// Draws a convex polygon of unit `normal`, in the pixels whose centres it covers; both sides
    /// are drawn. Returns the number of these pixels, visible or not.
    pub fn draw(&mut self, camera: &Camera, vertices: &[Vec3], normal: Vec3, item: u32) -> usize {
        self.clipped.clear();
        let Some(first) = vertices.first() else {
            return 0;
        };
        let distance = normal.dot(*first - camera.origin);
        if distance == 0.0 {
            return 0; // seen edge on
        }
        self.clip_to_front(camera, vertices);
        let Some((top, bottom)) = self.scan_edges(camera) else {
            return 0;
        };
        // 1 / depth = normal . ray / distance, linear in the pixel's position.
        let across = normal.dot(camera.right) * camera.step_x / distance;
        let down = -normal.dot(camera.up) * camera.step_y / distance;
        let corner = normal.dot(camera.ray(0.5, 0.5)) / distance;
        let mut covered = 0;
        for row in top..bottom {
            let (left, right) = self.spans[row];
            let from = (left - 0.5).ceil().max(0.0);
            let to = (right - 0.5).ceil().min(self.width as f64);
            if from >= to {
                continue;
            }
            let (from, to) = (from as usize, to as usize);
            covered += to - from;
            let base = corner + down * row as f64;
            let range = row * self.width + from..row * self.width + to;
            let pixels = self.items[range.clone()]
                .iter_mut()
                .zip(&mut self.inverse_depths[range]);
            for (x, (stored_item, stored)) in pixels.enumerate() {
                let inverse = base + across * (from + x) as f64;
                if inverse >= *stored * (1.0 - COPLANAR) && inverse > 0.0 {
                    *stored = inverse;
                    *stored_item = item;
                }
            }
        }
        covered
    }

    /// The outline of the polygon drawn last, in front of the eye: position in pixels, and depth.
    pub fn outline(&self) -> &[Vec3] {
        &self.clipped
    }

    /// Length of the part of a segment that is in the image, pixels.
    pub fn length_inside(&self, a: Vec3, b: Vec3) -> f64 {
        let part = self.inside(a, b).map_or(0.0, |[from, to]| to - from);
        part * (b.x - a.x).hypot(b.y - a.y)
    }

    /// Pixels along a segment at which it is no farther than an item of the pixel or one around it.
    pub fn in_sight(&self, a: Vec3, b: Vec3) -> impl Iterator<Item = [usize; 2]> {
        let steps = (2.0 * self.length_inside(a, b)).ceil().max(1.0);
        let part = self.inside(a, b).into_iter();
        let along = part.flat_map(move |[from, to]| {
            let place = move |k: usize| from + (to - from) * (k as f64 / steps);
            (0..=steps as usize).map(place)
        });
        along.filter_map(move |t| {
            let [x, y] = [a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t].map(|at| at as usize);
            let inverse = (1.0 - t) / a.z + t / b.z;
            let is_behind = |nearest: &f64| inverse < nearest * (1.0 - COPLANAR);
            let mut around = (y.saturating_sub(1)..(y + 2).min(self.height)).flat_map(|y| {
                let columns = x.saturating_sub(1)..(x + 2).min(self.width);
                &self.inverse_depths[y * self.width + columns.start..y * self.width + columns.end]
            });
            let is_inside = x < self.width && y < self.height;
            (is_inside && !around.all(is_behind)).then_some([x, y])
        })
    }

    /// The part of a segment that is in the image, as a range from 0 to 1.
    fn inside(&self, a: Vec3, b: Vec3) -> Option<[f64; 2]> {
        let mut range = [0.0_f64, 1.0];
        for (a, b, size) in [(a.x, b.x, self.width), (a.y, b.y, self.height)] {
            let size = size as f64;
            if a == b && !(0.0..=size).contains(&a) {
                return None;
            }
            if a != b {
                let ends = [-a / (b - a), (size - a) / (b - a)];
                range[0] = range[0].max(ends[0].min(ends[1]));
                range[1] = range[1].min(ends[0].max(ends[1]));
            }
        }
        (range[0] <= range[1]).then_some(range)
    }

    /// Eye coordinates of the part in front of the eye, into `clipped`.
    fn clip_to_front(&mut self, camera: &Camera, vertices: &[Vec3]) {
        self.eye.clear();
        let mut farthest = 0.0_f64;
        for v in vertices {
            let d = *v - camera.origin;
            let e = Vec3 {
                x: d.dot(camera.right),
                y: d.dot(camera.up),
                z: d.dot(camera.forward),
            };
            farthest = farthest.max(e.z);
            self.eye.push(e);
        }
        let near = farthest * 1e-9;
        if near <= 0.0 {
            return;
        }
        for (i, &a) in self.eye.iter().enumerate() {
            let b = self.eye[(i + 1) % self.eye.len()];
            if a.z > near {
                self.clipped.push(a);
            }
            if (a.z > near) != (b.z > near) {
                // From the same end for either direction of the edge, so that neighbours agree.
                let (p, q) = if a.z < b.z { (a, b) } else { (b, a) };
                let mut cut = p + (q - p) * ((near - p.z) / (q.z - p.z));
                cut.z = near;
                self.clipped.push(cut);
            }
        }
    }

    /// Fills `spans` for the rows that `clipped` covers. Returns their range, or `None` if it is
    /// off the image.
    fn scan_edges(&mut self, camera: &Camera) -> Option<(usize, usize)> {
        if self.clipped.len() < 3 {
            self.clipped.clear();
            return None;
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut leftmost, mut rightmost) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in &mut self.clipped {
            let x = (v.x / v.z - camera.left) / camera.step_x;
            let y = (camera.top - v.y / v.z) / camera.step_y;
            *v = Vec3 { x, y, z: v.z };
            (low, high) = (low.min(y), high.max(y));
            (leftmost, rightmost) = (leftmost.min(x), rightmost.max(x));
        }
        let rows = |y: f64| (y - 0.5).ceil().clamp(0.0, self.height as f64) as usize;
        let (top, bottom) = (rows(low), rows(high));
        if top >= bottom || rightmost <= 0.5 || leftmost > self.width as f64 - 0.5 {
            return None;
        }
        self.spans[top..bottom].fill((f64::INFINITY, f64::NEG_INFINITY));
        for (i, &a) in self.clipped.iter().enumerate() {
            let b = self.clipped[(i + 1) % self.clipped.len()];
            let (a, b) = if a.y < b.y { (a, b) } else { (b, a) };
            let slope = (b.x - a.x) / (b.y - a.y);
            for row in rows(a.y)..rows(b.y) {
                let x = a.x + slope * (row as f64 + 0.5 - a.y);
                let span = &mut self.spans[row];
                *span = (span.0.min(x), span.1.max(x));
            }
        }
        Some((top, bottom))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::rectangle;
    use footlight_show::geometry::vec3;

    const TOWARDS: Vec3 = vec3(0.0, 0.0, 1.0);

    #[test]
    fn covers_exactly_the_centres_inside() {
        let mut buffer = ItemBuffer::new(8, 8);
        // Slopes -0.5 to 0.5 and 0 to 1: columns 2 to 5, rows 0 to 3.
        buffer.draw(
            &Camera::of_square(8.0),
            &rectangle((-1.0, 1.0), (0.0, 2.0), -2.0),
            TOWARDS,
            7,
        );
        for (at, item) in buffer.items().iter().enumerate() {
            let inside = (2..6).contains(&(at % 8)) && at / 8 < 4;
            assert_eq!(*item == 7, inside, "pixel {at}");
        }
        assert!((buffer.inverse_depths[3] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn nearer_wins_and_coplanar_goes_to_the_later() {
        let mut buffer = ItemBuffer::new(4, 4);
        let c = Camera::of_square(4.0);
        buffer.draw(&c, &rectangle((-9.0, 9.0), (-9.0, 9.0), -1.0), TOWARDS, 0);
        buffer.draw(&c, &rectangle((-9.0, 9.0), (-9.0, 9.0), -2.0), TOWARDS, 1);
        assert!(buffer.items().iter().all(|i| *i == 0));
        buffer.draw(
            &c,
            &rectangle((-9.0, 9.0), (-9.0, 9.0), -(1.0 + 1e-8)),
            TOWARDS,
            2,
        );
        assert!(buffer.items().iter().all(|i| *i == 2));
        buffer.clear();
        assert!(buffer.items().iter().all(|i| *i == NOTHING));
    }

    #[test]
    fn a_floor_under_the_eye_is_clipped_and_its_depth_exact() {
        let mut buffer = ItemBuffer::new(16, 16);
        let c = Camera::of_square(16.0);
        let floor = [
            vec3(-50.0, -1.0, 50.0),
            vec3(50.0, -1.0, 50.0),
            vec3(50.0, -1.0, -50.0),
            vec3(-50.0, -1.0, -50.0),
        ];
        buffer.draw(&c, &floor, vec3(0.0, 1.0, 0.0), 3);
        for y in 0..16 {
            for x in 0..16 {
                let at = y * 16 + x;
                let slope = c.ray(x as f64 + 0.5, y as f64 + 0.5).y;
                assert_eq!(buffer.items()[at] == 3, slope < 0.0, "{x} {y}");
                if slope < 0.0 {
                    assert!((buffer.inverse_depths[at] + slope).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn neighbours_leave_no_gap() {
        // A fan of thin triangles around a point: every pixel of the disc is covered.
        let mut buffer = ItemBuffer::new(64, 64);
        let rim = |i: usize| {
            let a = i as f64 * std::f64::consts::TAU / 37.0;
            vec3(3.0 * a.cos(), 3.0 * a.sin(), -1.0)
        };
        for i in 0..37 {
            let triangle = [vec3(0.013, 0.021, -1.0), rim(i), rim((i + 1) % 37)];
            buffer.draw(&Camera::of_square(64.0), &triangle, TOWARDS, i as u32);
        }
        assert!(buffer.items().iter().all(|i| *i != NOTHING));
    }

    #[test]
    fn degenerate_polygons_draw_nothing() {
        let mut buffer = ItemBuffer::new(4, 4);
        let c = Camera::of_square(4.0);
        buffer.draw(&c, &[], TOWARDS, 0);
        buffer.draw(&c, &[vec3(0.0, 0.0, -1.0); 3], TOWARDS, 0);
        buffer.draw(&c, &rectangle((-1.0, 1.0), (-1.0, 1.0), 1.0), TOWARDS, 0);
        assert!(buffer.items().iter().all(|i| *i == NOTHING));
    }
}
