//! Point sources and their unoccluded irradiance.
//!
//! [`Beam::irradiance`] is the interface of every point source, whatever its distribution. This
//! module does not depend on surfaces or shadows.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use footlight_show::geometry::Vec3;
use footlight_show::geometry::mount::Axes;
use footlight_show::geometry::profile::Profile;
use footlight_show::model::Spot;
use footlight_stage::photometric::Distribution;
use footlight_stage::{Light, MeasuredLight, Projection};

/// A point source.
#[derive(Clone, Debug)]
pub struct Beam {
    /// Position, metres.
    pub position: Vec3,
    /// Unit direction of the aim.
    pub axis: Vec3,
    law: Law,
}

/// Dependence of the intensity on direction.
#[derive(Clone, Debug)]
enum Law {
    /// On the angle from the axis only.
    Round(Profile),
    /// By a photometric file, in candela.
    Measured(Arc<Distribution>, Axes),
    /// Constant in a half space; only the light within this angle from the axis is used. A
    /// [`super::projector::Projector`] multiplies it by its image.
    Even(f64),
}

impl Beam {
    /// The beam of a point source; `None` for other lights and where the constructor of its kind
    /// returns `None`.
    pub fn of(light: &Light) -> Option<Beam> {
        match light {
            Light::Spot(spot) => Beam::new(spot),
            Light::Measured(measured) => Beam::measured(measured),
            Light::Projection(projection) => Beam::even(projection),
            Light::Bounced(light) => Beam::of(light),
            Light::Panel { .. } | Light::Image(_) => None,
        }
    }

    /// Round beam; `None` unless 0 < beam < field <= 360 degrees and the aim differs from the
    /// position.
    pub fn new(spot: &Spot) -> Option<Beam> {
        let law = Law::Round(Profile::new(spot.beam, spot.field)?);
        Beam::towards(spot.position, spot.aim, law)
    }

    /// Measured beam; `None` unless the mount has axes.
    pub fn measured(light: &MeasuredLight) -> Option<Beam> {
        let axes = light.mount.axes()?;
        let law = Law::Measured(Arc::clone(&light.distribution), axes);
        Beam::towards(light.mount.position, light.mount.aim, law)
    }

    /// Uniform light of one candela, which a projection multiplies by its image; its reach is the
    /// cone around the frustum. The light itself does not stop at the cone, so that interpolation
    /// across the frustum's edge has no step. `None` unless the mount has axes and 0 < field < 180.
    pub fn even(light: &Projection) -> Option<Beam> {
        light.mount.axes()?;
        if !(light.field > 0.0 && light.field < 180.0) {
            return None;
        }
        let [a, b] = Projection::half_size(&light.gobo, light.field);
        let law = Law::Even(a.hypot(b).atan().min(FRAC_PI_2));
        Beam::towards(light.mount.position, light.mount.aim, law)
    }

    fn towards(position: Vec3, aim: Vec3, law: Law) -> Option<Beam> {
        let axis = (aim - position).normalized();
        (axis.is_finite() && axis != Vec3::ZERO && position.is_finite()).then_some(Beam {
            position,
            axis,
            law,
        })
    }

    /// Angle from the axis beyond which irradiance is zero or unused (see [`Beam::even`]), radians;
    /// pi for a source that shines in all directions.
    pub fn reach(&self) -> f64 {
        match &self.law {
            Law::Round(profile) => profile.end(),
            Law::Measured(distribution, _) => distribution.end(),
            Law::Even(angle) => *angle,
        }
    }

    /// True when no light reaches any point of a sphere.
    pub fn misses(&self, centre: Vec3, radius: f64) -> bool {
        let d = centre - self.position;
        let distance = d.length();
        if distance <= radius {
            return false;
        }
        let angle = self.axis.cross(d).length().atan2(self.axis.dot(d));
        angle - (radius / distance).asin() > self.reach()
    }

    /// Unoccluded irradiance on a surface of unit `normal` at `point` per unit of the light's own
    /// intensity: inverse square law and cosine.
    pub fn irradiance(&self, point: Vec3, normal: Vec3) -> f64 {
        let d = point - self.position;
        let square = d.dot(d);
        let cosine = -normal.dot(d);
        if cosine <= 0.0 || square == 0.0 {
            return 0.0;
        }
        self.share(d) * cosine / (square * square.sqrt())
    }

    /// Intensity in direction `d`, of any length.
    pub fn share(&self, d: Vec3) -> f64 {
        match &self.law {
            Law::Round(profile) => {
                profile.share(self.axis.cross(d).length().atan2(self.axis.dot(d)))
            }
            Law::Measured(distribution, axes) => {
                let (x, y, z) = (axes.right.dot(d), axes.up.dot(d), axes.axis.dot(d));
                let horizontal = if x == 0.0 && y == 0.0 {
                    0.0
                } else {
                    y.atan2(x)
                };
                distribution.intensity(x.hypot(y).atan2(z).min(PI), horizontal)
            }
            Law::Even(_) => f64::from(u8::from(self.axis.dot(d) > 0.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use footlight_show::geometry::vec3;
    use footlight_show::units::Rgb;

    fn spot(beam: f64, field: f64) -> Spot {
        Spot {
            position: vec3(0.0, 0.0, 5.0),
            aim: Vec3::ZERO,
            beam,
            field,
            intensity: Rgb::WHITE,
        }
    }

    #[test]
    fn inverse_square_and_cosine() {
        let b = Beam::new(&spot(60.0, 90.0)).unwrap();
        let up = vec3(0.0, 0.0, 1.0);
        assert!((b.irradiance(Vec3::ZERO, up) - 1.0 / 25.0).abs() < 1e-15);
        let tilted = vec3(0.0, 0.6, 0.8);
        assert!((b.irradiance(vec3(0.0, 0.0, 2.5), tilted) - 0.8 / 6.25).abs() < 1e-15);
        assert_eq!(b.irradiance(Vec3::ZERO, -up), 0.0);
    }

    /// A sphere around a lit point is not missed; one far outside the beam is.
    #[test]
    fn a_lit_ball_is_not_missed() {
        for (beam, field) in [(10.0, 20.0), (50.0, 120.0), (100.0, 300.0)] {
            let b = Beam::new(&spot(beam, field)).unwrap();
            for i in 0..4000 {
                let angle = f64::from(i) * (std::f64::consts::PI / 4000.0);
                let lit = vec3(3.0 * angle.sin(), 0.0, 5.0 - 3.0 * angle.cos());
                let aside = lit + vec3(0.0, 0.3, 0.4);
                let shines = b.share(lit - b.position) > 0.0;
                assert!(!shines || !b.misses(aside, 0.5 + 1e-9), "{field} {angle}");
                assert!(
                    shines || b.misses(lit, 0.0) || angle <= b.reach(),
                    "{field} {angle}"
                );
            }
            assert!(!b.misses(b.position, 0.1));
        }
    }

    #[test]
    fn no_light_outside_the_reach_and_some_just_inside() {
        let b = Beam::new(&spot(24.0, 40.0)).unwrap();
        let reach = b.reach();
        assert_eq!(b.axis, vec3(0.0, 0.0, -1.0));
        let at = |angle: f64| {
            let point = b.position + vec3(angle.sin(), 0.0, -angle.cos()) * 3.0;
            b.irradiance(point, vec3(0.0, 0.0, 1.0))
        };
        assert_eq!(at(reach + 1e-9), 0.0);
        assert!(at(reach - 1e-3) > 0.0);
    }

    #[test]
    fn a_measured_luminaire_shines_as_its_file_says() {
        // Brightest at horizontal 90, the mount's up direction, which is upstage for a lamp that
        // looks down.
        let text = "TILT=NONE\n1 -1 1 3 5 1 2 0 0 0 1 1 0\n0 45 90\n0 90 180 270 360\n\
            500 100 0\n500 400 0\n500 100 0\n500 50 0\n500 100 0";
        let light = |turn: f64| MeasuredLight {
            mount: footlight_show::geometry::mount::Mount {
                position: vec3(1.0, 2.0, 3.0),
                aim: vec3(1.0, 2.0, 0.0),
                turn,
            },
            distribution: Arc::new(Distribution::parse(text.as_bytes()).unwrap()),
            factor: Rgb::WHITE,
        };
        let up = vec3(0.0, 0.0, 1.0);
        // On the floor at 45 degrees: distance squared 18, cosine 0.7071.
        let floor = |beam: &Beam, x: f64, y: f64| {
            beam.irradiance(vec3(1.0 + x, 2.0 + y, 0.0), up) * 18.0 / 0.5_f64.sqrt()
        };
        let beam = Beam::measured(&light(0.0)).unwrap();
        assert!((beam.irradiance(vec3(1.0, 2.0, 0.0), up) - 500.0 / 9.0).abs() < 1e-9);
        for (x, y, candela) in [
            (3.0, 0.0, 100.0),
            (0.0, 3.0, 400.0),
            (-3.0, 0.0, 100.0),
            (0.0, -3.0, 50.0),
        ] {
            assert!((floor(&beam, x, y) - candela).abs() < 1e-9, "{x} {y}");
        }
        // Rotated by 90 degrees, anticlockwise seen from behind the lamp, that is from above.
        let turned = Beam::measured(&light(90.0)).unwrap();
        assert!((floor(&turned, -3.0, 0.0) - 400.0).abs() < 1e-9);
        assert!((beam.reach() - FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn impossible_beams_are_refused() {
        assert!(Beam::new(&spot(20.0, 10.0)).is_none());
        let mut nowhere = spot(10.0, 20.0);
        nowhere.aim = nowhere.position;
        assert!(Beam::new(&nowhere).is_none());
    }
}
