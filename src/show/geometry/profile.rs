//! Intensity of a round beam against the angle from its axis.
//!
//! With a half the beam angle and b half the field angle, the share of the peak is `2^-((angle /
//! a)^p)` up to b: one on the axis, a half at a, and, by the choice of p, a tenth at b. Beyond b, a
//! parabola of the same value and slope falls to zero at its vertex, where the light ends. The
//! language uses this law to turn lumens into candela, and transport to shine.

use std::f64::consts::{LN_2, LN_10, PI, TAU};

/// Beam profile for given beam and field angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Half the beam angle, radians.
    half: f64,
    /// Half the field angle, radians.
    tenth: f64,
    /// Angle at which the light ends, radians.
    end: f64,
    power: f64,
}

impl Profile {
    /// Creates a profile from full angles in degrees; `None` unless 0 < beam < field <= 360.
    pub fn new(beam: f64, field: f64) -> Option<Profile> {
        if !(beam > 0.0 && field > beam && field <= 360.0) {
            return None;
        }
        let (half, tenth) = (beam.to_radians() * 0.5, field.to_radians() * 0.5);
        let power = 10.0_f64.log2().ln() / (field / beam).ln();
        // The slope at the tenth is -0.1 ln(10) power / tenth; the parabola's vertex lies twice the
        // height over that slope further out.
        let end = tenth * (1.0 + 2.0 / (LN_10 * power));
        Some(Profile {
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

    /// The angle from the axis at which the light ends, radians; at most pi.
    pub fn end(&self) -> f64 {
        self.end.min(PI)
    }

    /// Luminous flux (lm) of a beam of peak intensity 1 cd.
    ///
    /// The integral of the share over the sphere, summed by levels: for each share I, the cap of
    /// brighter directions has the solid angle `2 pi (1 - cos angle(I))`. Steep edges and beams
    /// wider than the sphere therefore need no special case. Simpson's rule; relative error below
    /// 1e-6 for every pair of angles of the language (tested).
    pub fn flux(&self) -> f64 {
        let cap = |angle: f64| {
            let s = (0.5 * angle.min(PI)).sin();
            2.0 * TAU * s * s
        };
        // Above a tenth the share is 2^-t, and t = log2(10) w^4 flattens the start of t^(1/p).
        let most = 10.0_f64.log2();
        let core = simpson(|w| {
            let t = most * w.powi(4);
            let slope = 4.0 * most * w.powi(3);
            cap(self.half * t.powf(1.0 / self.power)) * LN_2 * (-t).exp2() * slope
        });
        // Below it the share is 0.1 w^2.
        let skirt = simpson(|w| cap(self.end - (self.end - self.tenth) * w) * 0.2 * w);
        core + skirt
    }
}

/// Integral over 0 to 1 by Simpson's rule.
fn simpson(f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 1024;
    let width = 1.0 / f64::from(STEPS);
    let inner: f64 = (1..STEPS)
        .map(|i| f(f64::from(i) * width) * if i % 2 == 1 { 4.0 } else { 2.0 })
        .sum();
    (f(0.0) + inner + f(1.0)) * width / 3.0
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn half_and_tenth_are_where_the_data_sheet_says() {
        for (beam, field) in [(10.0, 20.0), (19.0, 26.0), (50.0, 120.0), (8.0, 8.5)] {
            let b = Profile::new(beam, field).unwrap();
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

    /// Three-point Gauss-Legendre quadrature on many short pieces that end at the joints of the
    /// law.
    fn by_angles(b: &Profile) -> f64 {
        let knots = [0.0, b.half, b.tenth, b.end].map(|a: f64| a.min(PI));
        let pieces = 20_000;
        let mut sum = 0.0;
        for pair in knots.windows(2) {
            let width = (pair[1] - pair[0]) / f64::from(pieces);
            for i in 0..pieces {
                let middle = pair[0] + (f64::from(i) + 0.5) * width;
                for (x, w) in [(-0.6_f64.sqrt(), 5.0), (0.0, 8.0), (0.6_f64.sqrt(), 5.0)] {
                    let angle = middle + 0.5 * width * x;
                    sum += w / 18.0 * width * b.share(angle) * angle.sin();
                }
            }
        }
        TAU * sum
    }

    #[test]
    fn flux_is_the_integral_over_the_sphere() {
        for (beam, field) in [
            (0.1, 0.2),
            (10.0, 20.0),
            (19.0, 26.0),
            (8.0, 8.001),
            (50.0, 120.0),
            (100.0, 179.0),
            (1.0, 179.0),
            (200.0, 360.0),
        ] {
            let b = Profile::new(beam, field).unwrap();
            let (found, expected) = (b.flux(), by_angles(&b));
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{beam}/{field}: {found} for {expected}"
            );
        }
    }

    #[test]
    fn flux_of_a_sharp_beam_is_that_of_its_cone() {
        let b = Profile::new(60.0, 60.0001).unwrap();
        let cone = TAU * (1.0 - 30.0_f64.to_radians().cos());
        assert!((b.flux() / cone - 1.0).abs() < 1e-5);
    }

    #[test]
    fn impossible_angles_are_refused() {
        for (beam, field) in [
            (0.0, 10.0),
            (20.0, 20.0),
            (20.0, 10.0),
            (f64::NAN, 10.0),
            (9.0, f64::NAN),
            (9.0, 400.0),
        ] {
            assert!(Profile::new(beam, field).is_none());
        }
    }
}
