//! Position, focus and rotation of a luminaire.
//!
//! All luminaires without axial symmetry use this convention of axes. An observer at the
//! luminaire who looks along its axis, head up, has `right` to the right and `up` above. Where the
//! axis is vertical, `right` is +X (stage left), as if the luminaire had been lowered from looking
//! upstage. A turn goes anticlockwise for this observer, from right towards up.

use crate::geometry::{Vec3, vec3};

/// Position, focus and turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// Position, metres.
    pub position: Vec3,
    /// The point at which it is focused.
    pub aim: Vec3,
    /// Turn about the axis, degrees.
    pub turn: f64,
}

/// Three unit vectors at right angles; `right`, `up` and minus `axis` are right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Direction of the light.
    pub axis: Vec3,
    /// Right of an observer who looks along the axis.
    pub right: Vec3,
    /// Up for that observer.
    pub up: Vec3,
}

impl Mount {
    /// The axes of the mount; `None` when it is focused on its own position or a number is not
    /// finite.
    pub fn axes(&self) -> Option<Axes> {
        let axis = (self.aim - self.position).normalized();
        let fine = axis.is_finite() && axis != Vec3::ZERO && self.position.is_finite();
        if !fine || !self.turn.is_finite() {
            return None;
        }
        let right = if axis.x.hypot(axis.y) < 1e-9 {
            vec3(1.0, 0.0, 0.0)
        } else {
            axis.cross(vec3(0.0, 0.0, 1.0)).normalized()
        };
        let up = right.cross(axis);
        let (sine, cosine) = self.turn.to_radians().sin_cos();
        Some(Axes {
            axis,
            right: right * cosine + up * sine,
            up: up * cosine - right * sine,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn axes(aim: Vec3, turn: f64) -> Axes {
        let position = Vec3::ZERO;
        let mount = Mount {
            position,
            aim,
            turn,
        };
        mount.axes().unwrap()
    }

    fn close(a: Vec3, b: Vec3) -> bool {
        (a - b).length() < 1e-12
    }

    #[test]
    fn right_and_up_are_an_observers() {
        let upstage = axes(vec3(0.0, 2.0, 0.0), 0.0);
        assert!(close(upstage.right, vec3(1.0, 0.0, 0.0)));
        assert!(close(upstage.up, vec3(0.0, 0.0, 1.0)));
        let turned = axes(vec3(0.0, 2.0, 0.0), 90.0);
        assert!(close(turned.right, vec3(0.0, 0.0, 1.0)));
        assert!(close(turned.up, vec3(-1.0, 0.0, 0.0)));
        let down = axes(vec3(0.0, 0.0, -3.0), 0.0);
        assert!(close(down.right, vec3(1.0, 0.0, 0.0)));
        assert!(close(down.up, vec3(0.0, 1.0, 0.0)));
        // There is no jump when a lamp that looks upstage is lowered until it looks down.
        let almost = axes(vec3(0.0, 1e-6, -3.0), 0.0);
        assert!((almost.right - down.right).length() + (almost.up - down.up).length() < 1e-6);
    }

    #[test]
    fn nowhere_is_refused() {
        let position = vec3(1.0, 1.0, 1.0);
        let (aim, turn) = (position, 0.0);
        assert!(
            Mount {
                position,
                aim,
                turn
            }
            .axes()
            .is_none()
        );
        let (aim, turn) = (Vec3::ZERO, f64::NAN);
        assert!(
            Mount {
                position,
                aim,
                turn
            }
            .axes()
            .is_none()
        );
    }
}
