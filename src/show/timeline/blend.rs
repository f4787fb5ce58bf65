//! A segment's frame from its keys, by the fewest linear interpolations (lerps).
//!
//! The paper leaves the factors open; these never divide by zero. Cubic: lerp(a3, lerp(a1, A, B),
//! lerp(a2, C, D)); quadratic: lerp(a2, lerp(a1, A, B), C); linear: lerp(t, A, B). They reproduce
//! the Bernstein weights to rounding (1.1e-16).

/// The factors of the lerps, for each degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Blend {
    /// A single key.
    Hold,
    /// lerp(t, A, B).
    Linear(f64),
    /// lerp(second, lerp(first, A, B), C).
    Quadratic([f64; 2]),
    /// lerp(third, lerp(first, A, B), lerp(second, C, D)).
    Cubic([f64; 3]),
}

/// The factors at `t` (0 to 1) of a segment of `degree`; a degree above 3 counts as 3.
pub fn blend(degree: usize, t: f64) -> Blend {
    match degree {
        0 => Blend::Hold,
        1 => Blend::Linear(t),
        2 => Blend::Quadratic([2.0 * t / (1.0 + t), t * t]),
        _ => Blend::Cubic([
            3.0 * t / (1.0 + 2.0 * t),
            t / (3.0 - 2.0 * t),
            t * t * (3.0 - 2.0 * t),
        ]),
    }
}

impl Blend {
    /// Number of lerps per frame.
    pub fn lerps(&self) -> usize {
        match self {
            Blend::Hold => 0,
            Blend::Linear(_) => 1,
            Blend::Quadratic(_) => 2,
            Blend::Cubic(_) => 3,
        }
    }

    /// The weight of each key, in order; weights beyond the degree are 0.
    pub fn weights(&self) -> [f64; 4] {
        match *self {
            Blend::Hold => [1.0, 0.0, 0.0, 0.0],
            Blend::Linear(t) => [1.0 - t, t, 0.0, 0.0],
            Blend::Quadratic([a, b]) => [(1.0 - b) * (1.0 - a), (1.0 - b) * a, b, 0.0],
            Blend::Cubic([a, b, c]) => [(1.0 - c) * (1.0 - a), (1.0 - c) * a, c * (1.0 - b), c * b],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lerps_reproduce_bernstein_to_rounding() {
        let mut worst = 0.0f64;
        // At multiples of 1/1024 the Bernstein weights have no rounding.
        for i in 0..=1024 {
            let t = i as f64 / 1024.0;
            let s = 1.0 - t;
            let exact = [
                vec![1.0],
                vec![s, t],
                vec![s * s, 2.0 * s * t, t * t],
                vec![s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
            ];
            for (degree, want) in exact.iter().enumerate() {
                let found = blend(degree, t).weights();
                assert_eq!(blend(degree, t).lerps(), degree);
                for (k, w) in found.iter().enumerate() {
                    let want = want.get(k).copied().unwrap_or(0.0);
                    worst = worst.max((w - want).abs());
                }
            }
        }
        assert!(worst < 1.2e-16, "{worst:e}");
    }

    #[test]
    fn ends_are_the_end_keys() {
        for degree in 0..=3 {
            assert_eq!(blend(degree, 0.0).weights()[0], 1.0);
            assert_eq!(blend(degree, 1.0).weights()[degree], 1.0);
        }
    }
}
