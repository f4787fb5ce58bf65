//! Triangles of panels, cut by the horizons of the points that they light.

use footlight_show::geometry::Vec3;

/// A triangle of a panel.
pub struct Triangle {
    pub corners: [Vec3; 3],
    /// Unit normal.
    pub normal: Vec3,
}

impl Triangle {
    /// Part of the triangle above the planes of these normals through a point, relative to the point; empty
    /// when the triangle faces away.
    pub fn part_above(&self, point: Vec3, [facet, normal]: [Vec3; 2]) -> Part {
        let mut part = Part::default();
        let ways = self.corners.map(|c| c - point);
        if ways[0].dot(self.normal) < 0.0 {
            part.corners[..3].copy_from_slice(&ways);
            part.count = 3;
            part.clip(facet);
            if normal != facet {
                part.clip(normal);
            }
        }
        part
    }
}

/// A triangle cut by at most two planes through the point to which its corners are relative.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    corners: [Vec3; 5],
    count: usize,
}

impl Part {
    pub fn corners(&self) -> &[Vec3] {
        &self.corners[..self.count]
    }

    /// Keeps the part above the plane of this normal.
    fn clip(&mut self, normal: Vec3) {
        if self.corners().iter().all(|c| c.dot(normal) > 0.0) {
            return;
        }
        let whole = std::mem::take(self);
        for (i, a) in whole.corners().iter().enumerate() {
            let b = whole.corners[(i + 1) % whole.count];
            let (high, next) = (a.dot(normal), b.dot(normal));
            if high > 0.0 {
                self.add(*a);
            }
            if (high > 0.0) != (next > 0.0) {
                self.add(*a + (b - *a) * (high / (high - next)));
            }
        }
    }

    fn add(&mut self, corner: Vec3) {
        if let Some(free) = self.corners.get_mut(self.count) {
            *free = corner;
            self.count += 1;
        }
    }

    /// Triangles of a fan.
    fn fan(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let first = self.corners[0];
        let pairs = self.corners().get(1..).unwrap_or_default().windows(2);
        pairs.map(move |pair| [first, pair[0], pair[1]])
    }

    pub fn area(&self) -> f64 {
        self.fan().map(area_of).sum()
    }

    /// A point uniform over the area, for `left` uniform from 0 to the area.
    pub fn at(&self, mut left: f64, v: f64) -> Vec3 {
        let mut last = self.corners[0];
        for corners in self.fan() {
            let own = area_of(corners);
            last = point_of(corners, (left / own.max(f64::MIN_POSITIVE)).min(1.0), v);
            if left <= own {
                break;
            }
            left -= own;
        }
        last
    }
}

/// Area of a triangle, m².
pub fn area_of([a, b, c]: [Vec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// A point of a triangle, uniform over its area, for uniform `u` and `v`.
pub fn point_of([a, b, c]: [Vec3; 3], u: f64, v: f64) -> Vec3 {
    let root = u.clamp(0.0, 1.0).sqrt();
    a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v)
}
