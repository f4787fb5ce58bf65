//! Shapes of fades: the built-in ones and the show's own curves.

use super::Show;

/// A built-in shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FadeCurve {
    /// Its name in the language.
    pub name: &'static str,
    /// Completion over the fraction of the fade's time: Bernstein coefficients of a polynomial of
    /// degree 1 to 3 on [0, 1]. The first is 0, the last 1, and none is outside 0 to 1, so that no
    /// fade overshoots.
    pub coefficients: &'static [f64],
}

const LINEAR: FadeCurve = FadeCurve {
    name: "linear",
    coefficients: &[0.0, 1.0],
};

/// The built-in shapes. The language, the curves and the reports read this table, so that a new
/// shape is one row. With u the fraction of the time:
pub const FADES: &[FadeCurve] = &[
    // u
    LINEAR,
    // u²(3-2u)
    FadeCurve {
        name: "ease",
        coefficients: &[0.0, 0.0, 1.0, 1.0],
    },
    // u²
    FadeCurve {
        name: "square",
        coefficients: &[0.0, 0.0, 1.0],
    },
    // 1-(1-u)³: arrives slowly
    FadeCurve {
        name: "slow-top",
        coefficients: &[0.0, 1.0, 1.0, 1.0],
    },
    // u³: leaves slowly
    FadeCurve {
        name: "slow-bottom",
        coefficients: &[0.0, 0.0, 0.0, 1.0],
    },
];

/// Shape of a fade: fraction of its time to completion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fade {
    /// A row of [`FADES`].
    BuiltIn(&'static FadeCurve),
    /// A named curve of [`Show::curves`].
    Curve(usize),
}

impl Fade {
    /// The straight line, the default of fades.
    pub const LINEAR: Fade = Fade::BuiltIn(&LINEAR);

    /// The built-in shape of this name.
    pub fn built_in(name: &str) -> Option<Fade> {
        let found = FADES.iter().find(|curve| curve.name == name);
        found.map(Fade::BuiltIn)
    }

    /// Its name in the text.
    pub fn name(self, show: &Show) -> &str {
        match self {
            Fade::BuiltIn(curve) => curve.name,
            Fade::Curve(i) => show.curves.get(i).map_or("", |c| c.name.as_str()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fade_goes_from_0_to_1_without_passing_either() {
        for curve in FADES {
            let coefficients = curve.coefficients;
            assert!((2..=4).contains(&coefficients.len()), "{}", curve.name);
            assert_eq!(coefficients.first(), Some(&0.0), "{}", curve.name);
            assert_eq!(coefficients.last(), Some(&1.0), "{}", curve.name);
            let inside = coefficients.iter().all(|c| (0.0..=1.0).contains(c));
            assert!(inside, "{}", curve.name);
        }
    }

    #[test]
    fn the_manual_names_every_fade() {
        let manual = include_str!("../../../grammar/README.md");
        for curve in FADES {
            assert!(
                manual.contains(&format!("`{}`", curve.name)),
                "{}",
                curve.name
            );
        }
    }
}
