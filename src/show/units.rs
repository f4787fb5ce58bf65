//! Quantities of the trade: times, cue numbers, levels, colours.
//!
//! Invariants: a [`Time`] is an integer number of microseconds, so that equal decimal instants are
//! equal; a [`CueNumber`] is an exact decimal, never a float; a level is a fraction of full, and
//! percent is its notation in text. This module does not depend on shows, syntax or images.

mod tolerance;
mod tone_curve;

pub use tolerance::{ErrorUnit, Tolerance};
pub use tone_curve::ToneCurve;

use std::fmt;
use std::ops::{Add, AddAssign, Neg, Sub};

/// An instant or a duration in whole microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(i64);

impl Time {
    /// Zero.
    pub const ZERO: Time = Time(0);
    /// The longest time in a show: 1000 hours. Sums of many such times stay far from the limits of
    /// `i64`.
    pub const MAX: Time = Time(3_600_000_000_000);

    /// A time of `us` microseconds.
    pub const fn from_micros(us: i64) -> Time {
        Time(us)
    }

    /// The nearest time to `s` seconds; `None` when not finite or beyond [`Time::MAX`].
    pub fn from_seconds(s: f64) -> Option<Time> {
        let us = (s * 1e6).round();
        (us.is_finite() && us.abs() <= Time::MAX.0 as f64).then_some(Time(us as i64))
    }

    /// The time nearest to `s` seconds, clamped to [`Time::MAX`] on either side of zero; zero for
    /// NaN.
    pub fn nearest(s: f64) -> Time {
        let most = Time::MAX.0 as f64;
        Time((s * 1e6).round().clamp(-most, most) as i64)
    }

    /// Whole microseconds.
    pub const fn micros(self) -> i64 {
        self.0
    }

    /// Seconds, for reports and charts: the double nearest to the decimal instant.
    pub fn seconds(self) -> f64 {
        self.0 as f64 / 1e6
    }

    /// The instant at `fraction` of this duration, to the nearest microsecond.
    pub fn scaled(self, fraction: f64) -> Time {
        Time((self.0 as f64 * fraction).round() as i64)
    }

    /// Sum, or `None` on overflow.
    pub fn checked_add(self, other: Time) -> Option<Time> {
        self.0.checked_add(other.0).map(Time)
    }
}

impl Add for Time {
    type Output = Time;
    fn add(self, other: Time) -> Time {
        Time(self.0.saturating_add(other.0))
    }
}

impl AddAssign for Time {
    fn add_assign(&mut self, other: Time) {
        *self = *self + other;
    }
}

impl Sub for Time {
    type Output = Time;
    fn sub(self, other: Time) -> Time {
        Time(self.0.saturating_sub(other.0))
    }
}

impl Neg for Time {
    type Output = Time;
    fn neg(self) -> Time {
        Time(self.0.saturating_neg())
    }
}

impl Time {
    /// Rounded to hundredths of a second, for people to read.
    #[must_use]
    pub fn rounded(self) -> Time {
        Time(self.0.saturating_add(5_000 * self.0.signum()) / 10_000 * 10_000)
    }
}

impl fmt::Display for Time {
    /// Writes it like a cue sheet: `4s`, `0.25s`, and from a minute on `1:30` or `1:02:03.5`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let us = self.0.unsigned_abs();
        let (whole, rest) = (us / 1_000_000, us % 1_000_000);
        let fraction = if rest == 0 {
            String::new()
        } else {
            format!(".{rest:06}").trim_end_matches('0').to_owned()
        };
        let (h, m, s) = (whole / 3600, whole / 60 % 60, whole % 60);
        match (h, m) {
            (0, 0) => write!(f, "{sign}{s}{fraction}s"),
            (0, _) => write!(f, "{sign}{m}:{s:02}{fraction}"),
            _ => write!(f, "{sign}{h}:{m:02}:{s:02}{fraction}"),
        }
    }
}

/// A cue's number: an exact decimal from 0.001 to 9999.999, in thousandths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CueNumber(u32);

impl CueNumber {
    /// The lowest cue number.
    pub const FIRST: CueNumber = CueNumber(1);

    /// The number of `thousandths`; `None` outside 1 to 9,999,999.
    pub fn from_thousandths(thousandths: u32) -> Option<CueNumber> {
        (1..=9_999_999)
            .contains(&thousandths)
            .then_some(CueNumber(thousandths))
    }

    /// Reads `2`, `2.5` or `0.001`; `None` for anything else, a fourth decimal included.
    pub fn parse(text: &str) -> Option<CueNumber> {
        let (whole, fraction) = text.split_once('.').unwrap_or((text, "0"));
        let digits = |s: &str, most: usize| {
            !s.is_empty() && s.len() <= most && s.bytes().all(|b| b.is_ascii_digit())
        };
        if !digits(whole, 4) || !digits(fraction, 3) {
            return None;
        }
        let fraction: u32 = format!("{fraction:0<3}").parse().ok()?;
        CueNumber::from_thousandths(whole.parse::<u32>().ok()? * 1000 + fraction)
    }

    /// The number in thousandths.
    pub fn thousandths(self) -> u32 {
        self.0
    }
}

impl fmt::Display for CueNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (whole, rest) = (self.0 / 1000, self.0 % 1000);
        if rest == 0 {
            write!(f, "{whole}")
        } else {
            let text = format!("{whole}.{rest:03}");
            f.write_str(text.trim_end_matches('0'))
        }
    }
}

/// The fraction of full of a percentage: 55 is 0.55. It also turns slopes in percent into slopes of
/// fractions.
pub fn fraction(percent: f64) -> f64 {
    percent / 100.0
}

/// The percentage of a fraction of full, rounded to ten decimals so that percentages from text come
/// back unchanged: 0.55 is 55, not 55.00000000000001.
pub fn percent(fraction: f64) -> f64 {
    const TEN_DECIMALS: f64 = 1e10;
    (fraction * (100.0 * TEN_DECIMALS)).round() / TEN_DECIMALS
}

/// The sRGB code, 0 to 1, of a linear value (IEC 61966-2-1).
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The linear value of an sRGB code, 0 to 1.
pub fn srgb_decode(code: f64) -> f64 {
    if code <= 0.040_45 {
        code / 12.92
    } else {
        ((code + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear light in three channels (transport assumes no primaries; display uses Rec. 709).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Rgb(pub [f64; 3]);

impl Rgb {
    /// All three channels one.
    pub const WHITE: Rgb = Rgb([1.0, 1.0, 1.0]);

    /// The linear colour of an sRGB-coded `#rrggbb` (IEC 61966-2-1).
    pub fn from_srgb8(coded: [u8; 3]) -> Rgb {
        Rgb::from_srgb(coded.map(|c| f64::from(c) / 255.0))
    }

    /// The linear light of sRGB-coded channels, each 0 to 1 (IEC 61966-2-1).
    pub fn from_srgb(coded: [f64; 3]) -> Rgb {
        Rgb(coded.map(srgb_decode))
    }

    /// The nearest sRGB-coded `#rrggbb` (IEC 61966-2-1); channels are clamped to 0 to 1.
    pub fn to_srgb8(self) -> [u8; 3] {
        self.0
            .map(|v| (255.0 * srgb_encode(v.clamp(0.0, 1.0))).round() as u8)
    }

    /// Colour of a black body of `kelvin`, scaled to luminance 1 (Rec. 709 weights), so that a
    /// luminous quantity times this colour keeps its luminance. `None` outside 1000 to 25000 K.
    /// Chromaticity after Krystek, "An algorithm to calculate correlated colour temperature"
    /// (1985), within 1.1e-4 of the Planckian locus in CIE 1960 uv; channels outside Rec. 709 (blue
    /// below about 1900 K) are clipped to zero before scaling.
    pub fn from_kelvin(kelvin: f64) -> Option<Rgb> {
        if !(1000.0..=25_000.0).contains(&kelvin) {
            return None;
        }
        let t = kelvin;
        let u = (0.860_117_757 + 1.541_182_54e-4 * t + 1.286_412_12e-7 * t * t)
            / (1.0 + 8.424_202_35e-4 * t + 7.081_451_63e-7 * t * t);
        let v = (0.317_398_726 + 4.228_062_45e-5 * t + 4.204_816_91e-8 * t * t)
            / (1.0 - 2.897_418_16e-5 * t + 1.614_560_53e-7 * t * t);
        let d = 2.0 * u - 8.0 * v + 4.0;
        let (x, y) = (3.0 * u / d, 2.0 * v / d);
        let colour = Rgb::from_chromaticity(x, y);
        let luminance = colour.luminance();
        Some(Rgb(colour.0.map(|c| c / luminance)))
    }

    /// Linear Rec. 709 (IEC 61966-2-1) of the CIE 1931 chromaticity `x`, `y` at Y = 1; channels
    /// outside the gamut are clipped to zero. `y` is above zero.
    pub fn from_chromaticity(x: f64, y: f64) -> Rgb {
        let (big_x, big_z) = (x / y, (1.0 - x - y) / y);
        let linear = [
            3.240_454_2 * big_x - 1.537_138_5 - 0.498_531_4 * big_z,
            -0.969_266_0 * big_x + 1.876_010_8 + 0.041_556_0 * big_z,
            0.055_643_4 * big_x - 0.204_025_9 + 1.057_225_2 * big_z,
        ];
        Rgb(linear.map(|c: f64| c.max(0.0)))
    }

    /// Luminance with Rec. 709 weights.
    pub fn luminance(self) -> f64 {
        let [r, g, b] = self.0;
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    /// Each channel times `factor`.
    pub fn scaled(self, factor: f64) -> Rgb {
        Rgb(self.0.map(|c| c * factor))
    }

    /// Channel by channel product.
    pub fn filtered(self, by: Rgb) -> Rgb {
        let ([r, g, b], [x, y, z]) = (self.0, by.0);
        Rgb([r * x, g * y, b * z])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coded_colours_come_back() {
        for code in 0..=255u8 {
            let coded = [code, 255 - code, code / 2];
            assert_eq!(Rgb::from_srgb8(coded).to_srgb8(), coded);
        }
    }

    #[test]
    fn moments_are_read_to_the_hundredth() {
        for (exact, read) in [
            (19_804_143, "19.8s"),
            (3_725_302, "3.73s"),
            (-1_005_000, "-1.01s"),
            (4_999, "0s"),
            (59_996_000, "1:00"),
        ] {
            assert_eq!(Time(exact).rounded().to_string(), read);
        }
    }

    #[test]
    fn percent_comes_back_as_it_was_written() {
        for thousandths in 0..=100_000 {
            let written = f64::from(thousandths) / 1000.0;
            assert_eq!(percent(fraction(written)), written);
        }
        for written in [33.333_333_333_3, -0.000_2, 104.25, 1e-10, 1000.0] {
            assert_eq!(percent(fraction(written)), written);
        }
        assert_eq!(percent(1.0 / 3.0).to_string(), "33.3333333333");
    }

    #[test]
    fn cue_numbers_are_exact_decimals() {
        for (text, thousandths) in [
            ("2", 2000),
            ("2.5", 2500),
            ("0.001", 1),
            ("9999.999", 9_999_999),
        ] {
            let number = CueNumber::parse(text).unwrap();
            assert_eq!(number.thousandths(), thousandths);
            assert_eq!(number.to_string(), text);
        }
        for bad in ["0", "", "1.", ".5", "10000", "1.0001", "1e3", "-1"] {
            assert_eq!(CueNumber::parse(bad), None, "{bad}");
        }
    }

    #[test]
    fn times_print_as_a_cue_sheet_writes_them() {
        for (us, text) in [
            (4_000_000, "4s"),
            (250_000, "0.25s"),
            (90_000_000, "1:30"),
            (3_723_500_000, "1:02:03.5"),
            (-1_500_000, "-1.5s"),
        ] {
            assert_eq!(Time::from_micros(us).to_string(), text);
        }
    }

    #[test]
    fn kelvin_keeps_luminance_and_its_white_is_near_d65() {
        for k in [1000.0, 1900.0, 2700.0, 6504.0, 25_000.0] {
            let colour = Rgb::from_kelvin(k).unwrap();
            assert!((colour.luminance() - 1.0).abs() < 1e-12);
            assert!(colour.0.iter().all(|c| *c >= 0.0));
        }
        // The black body of 6504 K has chromaticity (0.3135, 0.3236), a little to the magenta side
        // of D65: X = 0.9688 and Z = 1.1214 give this in Rec. 709.
        let expected = [1.0431, 0.9836, 1.0355];
        for (found, expected) in Rgb::from_kelvin(6504.0).unwrap().0.iter().zip(expected) {
            assert!((found - expected).abs() < 0.01, "{found} for {expected}");
        }
        assert_eq!(Rgb::from_kelvin(900.0), None);
    }

    #[test]
    fn kelvin_is_on_the_planckian_locus() {
        // Chromaticities x, y of black bodies (CIE 1931, 2 degrees), from tables.
        for (k, x, y) in [
            (2000.0, 0.5267, 0.4133),
            (3000.0, 0.4369, 0.4041),
            (4000.0, 0.3805, 0.3768),
            (5000.0, 0.3451, 0.3516),
            (6500.0, 0.3135, 0.3237),
            (10_000.0, 0.2807, 0.2884),
        ] {
            let [r, g, b] = Rgb::from_kelvin(k).unwrap().0;
            // Rec. 709 to XYZ.
            let xyz = [
                0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b,
                0.212_672_9 * r + 0.715_152_2 * g + 0.072_175_0 * b,
                0.019_333_9 * r + 0.119_192_0 * g + 0.950_304_1 * b,
            ];
            let uv = |[x, y, z]: [f64; 3]| {
                let d = x + 15.0 * y + 3.0 * z;
                [4.0 * x / d, 6.0 * y / d]
            };
            let (found, table) = (uv(xyz), uv([x, y, 1.0 - x - y]));
            let distance = (found[0] - table[0]).hypot(found[1] - table[1]);
            assert!(distance < 2e-4, "{k}: {distance}");
        }
    }
}
