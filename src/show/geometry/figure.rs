//! A standing person of cylinders and balls, some 240 faces: enough to see how light falls on
//! somebody.

use super::solid::Solid;
use super::{Vec3, vec3};

/// A standing person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Between the feet, metres.
    pub at: Vec3,
    /// From the floor to the crown, metres.
    pub height: f64,
    /// Degrees from facing the house (-y), anticlockwise seen from above.
    pub facing: f64,
}

/// Height of the person measured below, metres.
const HEIGHT: f64 = 1.75;

impl Figure {
    /// A point `left` of the middle, `front` of it and `up` from the floor, for a person of
    /// [`HEIGHT`].
    fn point(&self, left: f64, front: f64, up: f64) -> Vec3 {
        let (sine, cosine) = self.facing.to_radians().sin_cos();
        let across = vec3(cosine, sine, 0.0) * left + vec3(sine, -cosine, 0.0) * front;
        self.at + (across + vec3(0.0, 0.0, up)) * (self.height / HEIGHT)
    }

    fn ball(&self, (left, front, up): (f64, f64, f64), radius: f64, sides: usize) -> Solid {
        Solid::Sphere {
            centre: self.point(left, front, up),
            radius: radius * self.height / HEIGHT,
            sides,
        }
    }

    fn limb(&self, from: (f64, f64, f64), to: (f64, f64, f64), radius: f64) -> Solid {
        Solid::Cylinder {
            from: self.point(from.0, from.1, from.2),
            to: self.point(to.0, to.1, to.2),
            radius: radius * self.height / HEIGHT,
            sides: 7,
        }
    }

    /// Head, neck and hands.
    pub fn skin(&self) -> Vec<Solid> {
        let hand = |side: f64| self.ball((0.28 * side, 0.04, 0.77), 0.05, 5);
        vec![
            self.ball((0.0, 0.015, 1.635), 0.115, 15),
            self.limb((0.0, 0.0, 1.42), (0.0, 0.005, 1.56), 0.06),
            hand(-1.0),
            hand(1.0),
        ]
    }

    /// Trunk, arms, legs and shoes.
    pub fn cloth(&self) -> Vec<Solid> {
        let mut out = vec![self.limb((-0.19, 0.0, 1.39), (0.19, 0.0, 1.39), 0.065)];
        for side in [-1.0, 1.0] {
            let part = |from: [f64; 3], to: [f64; 3], radius| {
                let of = |[left, front, up]: [f64; 3]| (side * left, front, up);
                self.limb(of(from), of(to), radius)
            };
            out.extend([
                part([0.07, 0.0, 0.82], [0.085, 0.0, 1.42], 0.12),
                part([0.21, 0.0, 1.40], [0.26, -0.01, 1.09], 0.05),
                part([0.26, -0.01, 1.09], [0.28, 0.03, 0.80], 0.042),
                part([0.09, 0.0, 0.86], [0.10, 0.01, 0.47], 0.08),
                part([0.10, 0.01, 0.47], [0.10, -0.01, 0.05], 0.068),
                part([0.10, -0.07, 0.045], [0.12, 0.17, 0.045], 0.045),
            ]);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(figure: &Figure) -> (Vec3, Vec3, usize) {
        let solids = figure.skin().into_iter().chain(figure.cloth());
        let faces: Vec<Vec<Vec3>> = solids.flat_map(|s| s.polygons().unwrap()).collect();
        let mut ends = (vec3(9.0, 9.0, 9.0), vec3(-9.0, -9.0, -9.0));
        for v in faces.iter().flatten() {
            ends.0 = vec3(ends.0.x.min(v.x), ends.0.y.min(v.y), ends.0.z.min(v.z));
            ends.1 = vec3(ends.1.x.max(v.x), ends.1.y.max(v.y), ends.1.z.max(v.z));
        }
        (ends.0, ends.1, faces.len())
    }

    #[test]
    fn a_figure_stands_on_the_floor_and_faces_where_it_looks() {
        let at = vec3(1.0, 2.0, 0.5);
        let figure = |facing| Figure {
            at,
            height: 1.6,
            facing,
        };
        let (low, high, faces) = extent(&figure(0.0));
        assert!(
            (low.z - 0.5).abs() < 0.02 && (high.z - 2.1).abs() < 0.02,
            "{low:?} {high:?}"
        );
        assert!((200..260).contains(&faces), "{faces}");
        // The toes are in front: downstage, or to stage left.
        assert!(2.0 - low.y > high.y - 2.0);
        let (low, high, _) = extent(&figure(90.0));
        assert!(high.x - 1.0 > 1.0 - low.x);
        let width = |figure| {
            let (low, high, _) = extent(&figure);
            high.x - low.x
        };
        assert!(width(figure(0.0)) > 1.3 * width(figure(90.0)));
    }
}
