//! A pinhole camera, and the placement of a file's content.

use super::{Vec3, vec3};

/// A pinhole camera. Its up is Z, or Y when it looks straight along Z; `roll` turns it from there.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The eye.
    pub from: Vec3,
    /// The point in the middle of the image.
    pub to: Vec3,
    /// Vertical field of view, full angle, degrees.
    pub fov: f64,
    /// Clockwise for the observer, degrees; the image turns the other way.
    pub roll: f64,
    /// Image width in pixels.
    pub width: usize,
    /// Image height in pixels.
    pub height: usize,
}

impl View {
    /// Unit vectors to the right, to the top and into the image; not finite when `from` equals
    /// `to`.
    pub fn axes(&self) -> [Vec3; 3] {
        let forward = (self.to - self.from).normalized();
        let [right, up] = upright(forward);
        let (sine, cosine) = self.roll.to_radians().sin_cos();
        [
            right * cosine - up * sine,
            up * cosine + right * sine,
            forward,
        ]
    }
}

/// Right and top of an image that looks `forward`, without roll.
pub fn upright(forward: Vec3) -> [Vec3; 2] {
    let vertical = forward.x.hypot(forward.y) < 1e-9;
    let above = if vertical {
        vec3(0.0, 1.0, 0.0)
    } else {
        vec3(0.0, 0.0, 1.0)
    };
    let right = forward.cross(above).normalized();
    [right, right.cross(forward)]
}

/// Placement of a file's content: scaled, then turned about the vertical through its origin, then
/// moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Metres per unit of the file.
    pub scale: f64,
    /// Anticlockwise seen from above, degrees.
    pub turn: f64,
    /// New position of the file's origin.
    pub at: Vec3,
}

impl Default for Place {
    fn default() -> Place {
        Place {
            scale: 1.0,
            turn: 0.0,
            at: Vec3::ZERO,
        }
    }
}

impl Place {
    /// Transforms a direction of the file to the world.
    pub fn direction(&self, d: Vec3) -> Vec3 {
        let (sine, cosine) = self.turn.to_radians().sin_cos();
        vec3(cosine * d.x - sine * d.y, sine * d.x + cosine * d.y, d.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rolled_view_sees_its_right_low() {
        let view = View {
            from: Vec3::ZERO,
            to: vec3(0.0, 1.0, 0.0),
            fov: 40.0,
            roll: 90.0,
            width: 4,
            height: 3,
        };
        let [right, up, _] = view.axes();
        assert!((right - vec3(0.0, 0.0, -1.0)).length() < 1e-12);
        assert!((up - vec3(1.0, 0.0, 0.0)).length() < 1e-12);
    }
}
