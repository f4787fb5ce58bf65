//! The beam of a spot: intensity against the angle from its axis.
//!
//! Up to half the field angle b the law is `2^-((angle / a)^p)` with a half the beam angle and p
//! such that it is a tenth at b: one at the axis, a half at a, a tenth at b, smooth between.
//! Beyond b a parabola goes on with the same value and slope and meets zero at its vertex; the
//! light ends there. This room knows one lamp, nothing of surfaces.

use crate::geometry::Vec3;
use crate::scene::Spot;

/// A point source made ready.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Where it hangs.
    pub position: Vec3,
    axis: Vec3,
    /// Half the beam angle, radians.
    half: f64,
    /// Half the field angle, radians.
    tenth: f64,
    /// Where the light ends, radians.
    end: f64,
    power: f64,
}

impl Beam {
    /// `None` unless 0 < beam < field <= 360 degrees and the aim differs from the position.
    pub fn new(spot: &Spot) -> Option<Beam> {
        let axis = (spot.aim - spot.position).normalized();
        let angles = spot.beam > 0.0 && spot.field > spot.beam && spot.field <= 360.0;
        if !angles || !axis.is_finite() || axis == Vec3::ZERO || !spot.position.is_finite() {
            return None;
        }
        let (half, tenth) = (spot.beam.to_radians() * 0.5, spot.field.to_radians() * 0.5);
        let power = 10.0_f64.log2().ln() / (tenth / half).ln();
        // The slope at the tenth is -0.1 ln(10) power / tenth; the parabola's vertex is where
        // twice the height over that slope leads.
        let end = tenth * (1.0 + 2.0 / (std::f64::consts::LN_10 * power));
        Some(Beam {
            position: spot.position,
            axis,
            half,
            tenth,
            end,
            power,
        })
    }

    /// Intensity at `angle` radians from the axis, as a share of the peak.
    pub fn share(&self, angle: f64) -> f64 {
        if angle <= self.tenth {
            (-(angle / self.half).powf(self.power)).exp2()
        } else if angle < self.end {
            0.1 * ((self.end - angle) / (self.end - self.tenth)).powi(2)
        } else {
            0.0
        }
    }

    /// True when no light reaches any point of a ball.
    pub fn misses(&self, centre: Vec3, radius: f64) -> bool {
        let d = centre - self.position;
        let distance = d.length();
        if distance <= radius {
            return false;
        }
        let angle = self.axis.cross(d).length().atan2(self.axis.dot(d));
        angle - (radius / distance).asin() > self.end
    }

    /// Irradiance on a surface of unit `normal` at `point` per unit of peak intensity: the law of
    /// the inverse square and the cosine; nothing is in the way.
    pub fn irradiance(&self, point: Vec3, normal: Vec3) -> f64 {
        let d = point - self.position;
        let square = d.dot(d);
        let cosine = -normal.dot(d);
        if cosine <= 0.0 || square == 0.0 {
            return 0.0;
        }
        let angle = self.axis.cross(d).length().atan2(self.axis.dot(d));
        self.share(angle) * cosine / (square * square.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::vec3;
    use crate::units::Rgb;

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
    fn half_and_tenth_are_where_the_data_sheet_says() {
        for (beam, field) in [(10.0, 20.0), (19.0, 26.0), (50.0, 120.0), (8.0, 8.5)] {
            let b = Beam::new(&spot(beam, field)).unwrap();
            assert_eq!(b.share(0.0), 1.0);
            assert!((b.share(beam.to_radians() / 2.0) - 0.5).abs() < 1e-12);
            assert!((b.share(field.to_radians() / 2.0) - 0.1).abs() < 1e-12);
            assert_eq!(b.share(b.end), 0.0);
            let h = 1e-7;
            let slope = |x: f64| (b.share(x + h) - b.share(x)) / h;
            let (before, after) = (slope(b.tenth - 2.0 * h), slope(b.tenth + h));
            assert!((before / after - 1.0).abs() < 1e-3, "{before} {after}");
            let angles: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3 * b.end).collect();
            assert!(angles.windows(2).all(|w| b.share(w[0]) >= b.share(w[1])));
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

    #[test]
    fn impossible_beams_are_refused() {
        for (beam, field) in [
            (0.0, 10.0),
            (20.0, 20.0),
            (20.0, 10.0),
            (f64::NAN, 10.0),
            (9.0, 400.0),
        ] {
            assert!(Beam::new(&spot(beam, field)).is_none());
        }
        let mut nowhere = spot(10.0, 20.0);
        nowhere.aim = nowhere.position;
        assert!(Beam::new(&nowhere).is_none());
    }
}
