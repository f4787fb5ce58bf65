//! Primaries of an OpenEXR file's red, green and blue (its attribute `chromaticities`).
//!
//! By the specification, a file without the attribute is linear Rec. 709. The conversion is
//! colorimetric, without adaptation to another white.

use exr::math::Vec2;
use exr::meta::attribute::Chromaticities;
use nalgebra::{Matrix3, Vector3};

use super::{PictureError, truncated};

/// The primaries and the white of Rec. 709.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.3, 0.6),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.329),
};
/// Rounding of chromaticities by the program that wrote the file.
const ROUNDING: f32 = 1e-3;

/// The matrix from the file's primaries to Rec. 709; `None` when they are equal.
///
/// # Errors
/// [`PictureError::Malformed`] when the attribute is not a valid set of primaries.
pub(super) fn to_rec_709(own: Chromaticities) -> Result<Option<Matrix3<f64>>, PictureError> {
    let ends = |c: Chromaticities| [c.red, c.green, c.blue, c.white];
    let pairs = ends(own).into_iter().zip(ends(REC_709));
    let differs = |(a, b): (Vec2<f32>, Vec2<f32>)| {
        !((a.0 - b.0).abs() <= ROUNDING && (a.1 - b.1).abs() <= ROUNDING)
    };
    if !pairs.into_iter().any(differs) {
        return Ok(None);
    }
    let inverse = to_xyz(REC_709).and_then(|to_xyz| to_xyz.try_inverse());
    let matrix = inverse
        .zip(to_xyz(own))
        .map(|(from_xyz, own)| from_xyz * own);
    let matrix = matrix.filter(|matrix| matrix.iter().all(|x| x.is_finite()));
    let refused = || truncated("its `chromaticities` describe no colours");
    matrix.map(Some).ok_or_else(refused)
}

/// The matrix from red, green and blue to CIE XYZ in which white has a luminance of 1 (Lindbloom,
/// "RGB/XYZ Matrices").
fn to_xyz(of: Chromaticities) -> Option<Matrix3<f64>> {
    let column = |Vec2(x, y): Vec2<f32>| {
        let (x, y) = (f64::from(x), f64::from(y));
        Vector3::new(x, y, 1.0 - x - y)
    };
    let primaries = Matrix3::from_columns(&[of.red, of.green, of.blue].map(column));
    let white = column(of.white) / f64::from(of.white.1);
    let scale = primaries.try_inverse()? * white;
    Some(primaries * Matrix3::from_diagonal(&scale))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn red_by_way_of_xyz_is_red() {
        let xyz = Chromaticities {
            red: Vec2(1.0, 0.0),
            green: Vec2(0.0, 1.0),
            blue: Vec2(0.0, 0.0),
            white: Vec2(1.0 / 3.0, 1.0 / 3.0),
        };
        let matrix = to_rec_709(xyz).unwrap().unwrap();
        // IEC 61966-2-1: red is 0.4124, 0.2126, 0.0193.
        let red = matrix * Vector3::new(0.4124, 0.2126, 0.0193);
        assert!((red - Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-3, "{red}");
        assert!(to_rec_709(REC_709).unwrap().is_none());
        let [mut flat, mut odd, mut dark] = [REC_709; 3];
        flat.red = flat.green;
        odd.blue = Vec2(f32::NAN, 0.06);
        dark.white.1 = 0.0;
        for none in [flat, odd, dark] {
            let error = to_rec_709(none).unwrap_err().to_string();
            assert!(error.contains("describe no colours"), "{error}");
        }
    }
}
