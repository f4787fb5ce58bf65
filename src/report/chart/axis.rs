//! Scales, their ticks and labels.
//!
//! Linear steps are 1, 2 or 5 times a power of ten; steps of time are those of a clock; log ticks
//! are powers of ten, with 1, 2 and 5 times them if there is room.

/// Larger magnitudes are left out of charts: their span could overflow.
const LARGEST: f64 = 1e150;
/// Seconds between ticks of time, from a second up; smaller steps are decimal.
const CLOCK: [f64; 18] = [
    1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0,
    14400.0, 21600.0, 43200.0, 86400.0,
];
/// Most ticks of an axis.
const MOST_TICKS: usize = 64;

/// Mapping of values to an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps for equal differences.
    #[default]
    Linear,
    /// Equal steps for equal ratios; only positive values have a position.
    Log,
    /// Seconds, written m:ss.
    Time,
    /// Linear, for counts: no ticks between whole numbers.
    Whole,
}

/// The quantity along one side of a panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// The quantity and its unit, as "seconds" or "RMS error (%)".
    pub label: String,
    /// The scale of its values.
    pub scale: Scale,
}

impl Axis {
    /// An axis.
    pub fn new(label: &str, scale: Scale) -> Axis {
        Axis {
            label: label.to_owned(),
            scale,
        }
    }
}

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    /// Empty on minor ticks.
    pub(super) label: String,
}

/// An axis with its range and ticks.
#[derive(Clone, Debug)]
pub(super) struct Ruler {
    scale: Scale,
    low: f64,
    high: f64,
    /// Pixel positions of `low` and `high`.
    pixels: (f32, f32),
    pub(super) ticks: Vec<Tick>,
}

impl Scale {
    /// True when the scale can show the value.
    pub(super) fn takes(self, value: f64) -> bool {
        let magnitude = value.abs();
        magnitude <= LARGEST && (self != Scale::Log || value >= 1.0 / LARGEST)
    }
}

impl Ruler {
    /// An axis from `low` to `high` exactly, with about `wanted` ticks.
    pub(super) fn exact(
        scale: Scale,
        range: (f64, f64),
        pixels: (f32, f32),
        wanted: usize,
    ) -> Ruler {
        let (low, high) = opened(scale, range);
        Ruler {
            scale,
            low,
            high,
            pixels,
            ticks: ticks(scale, low, high, wanted.max(1)),
        }
    }

    /// An axis from the round value at or below the least of `values` to the one at or above the
    /// greatest; from zero when that is near. An empty axis is 0 to 1, or 1 to 10 for logs.
    pub(super) fn round(
        scale: Scale,
        values: impl Iterator<Item = f64>,
        pixels: (f32, f32),
        wanted: usize,
    ) -> Ruler {
        let taken = values.filter(|&value| scale.takes(value));
        let extent = taken
            .map(|value| (value, value))
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let range = match (extent, scale) {
            (Some((low, high)), Scale::Log) => rounded_log(opened(scale, (low, high))),
            (Some((low, high)), _) => rounded(scale, from_zero(low, high), wanted.max(1)),
            (None, Scale::Log) => (1.0, 10.0),
            (None, _) => (0.0, 1.0),
        };
        Ruler::exact(scale, range, pixels, wanted)
    }

    /// The pixel position of a value; `None` when the scale cannot show it.
    pub(super) fn place(&self, value: f64) -> Option<f32> {
        if !self.scale.takes(value) {
            return None;
        }
        let (low, high, value) = match self.scale {
            Scale::Log => (self.low.ln(), self.high.ln(), value.ln()),
            _ => (self.low, self.high, value),
        };
        let share = (value - low) / (high - low);
        let (first, last) = (f64::from(self.pixels.0), f64::from(self.pixels.1));
        Some((first + share * (last - first)) as f32)
    }

    /// The ticks with their pixels.
    pub(super) fn placed_ticks(&self) -> impl Iterator<Item = (f32, &Tick)> {
        let ticks = self.ticks.iter();
        ticks.filter_map(|tick| Some((self.place(tick.value)?, tick)))
    }
}

/// Widens an empty range on both sides, such as one value, or a width lost in rounding.
fn opened(scale: Scale, (low, high): (f64, f64)) -> (f64, f64) {
    let (low, high) = (low.min(high), low.max(high));
    match scale {
        Scale::Log if high / low < 1.0 + 1e-9 => (low / 2.0, high * 2.0),
        Scale::Log => (low, high),
        _ => {
            let magnitude = low.abs().max(high.abs());
            if magnitude < 1.0 / LARGEST {
                (0.0, 1.0)
            } else if high - low > magnitude * 1e-9 {
                (low, high)
            } else {
                (low - magnitude * 0.5, high + magnitude * 0.5)
            }
        }
    }
}

fn from_zero(low: f64, high: f64) -> (f64, f64) {
    if low >= 0.0 && low <= 0.5 * high {
        (0.0, high)
    } else if high <= 0.0 && high >= 0.5 * low {
        (low, 0.0)
    } else {
        (low, high)
    }
}

fn rounded(scale: Scale, range: (f64, f64), wanted: usize) -> (f64, f64) {
    let (low, high) = opened(scale, range);
    let step = step(scale, (high - low) / wanted as f64);
    // A value a rounding error beyond a tick must not add a whole step.
    let slack = 1e-9;
    (
        (low / step + slack).floor() * step,
        (high / step - slack).ceil() * step,
    )
}

fn rounded_log((low, high): (f64, f64)) -> (f64, f64) {
    let slack = 1.0 + 1e-9;
    let below = multiples(low).rev().find(|&value| value <= low * slack);
    let above = multiples(high).find(|&value| value >= high / slack);
    (below.unwrap_or(low), above.unwrap_or(high))
}

/// 1, 2 and 5 times the powers of ten around a value, ascending.
fn multiples(value: f64) -> impl DoubleEndedIterator<Item = f64> {
    let decade = value.log10().floor() as i32;
    (decade - 1..=decade + 1).flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| digit * power(decade)))
}

/// A power of ten with the bits of the literal, so that 0.001 is 1e-3 exactly.
fn power(decade: i32) -> f64 {
    if decade < 0 {
        1.0 / 10_f64.powi(-decade)
    } else {
        10_f64.powi(decade)
    }
}

/// The least round step that is at least `least`.
fn step(scale: Scale, least: f64) -> f64 {
    if scale == Scale::Time && least > 0.5 {
        let clock = CLOCK.iter().copied().find(|&step| step >= least);
        return clock.unwrap_or_else(|| step(Scale::Linear, least / 86400.0) * 86400.0);
    }
    let least = match scale {
        Scale::Whole => least.max(1.0),
        _ => least,
    };
    let decade = power(least.log10().floor() as i32);
    [1.0, 2.0, 5.0, 10.0]
        .map(|digit| digit * decade)
        .into_iter()
        .find(|&step| step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

fn ticks(scale: Scale, low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    if scale == Scale::Log {
        return log_ticks(low, high, wanted);
    }
    let step = step(scale, (high - low) / wanted as f64);
    let first = (low / step - 1e-9).ceil();
    let values = (0..MOST_TICKS).map(|index| (first + index as f64) * step);
    let inside = values.take_while(|&value| value <= high + step * 1e-9);
    let largest = low.abs().max(high.abs());
    let label = |value: f64| match scale {
        Scale::Time => clock(value, step),
        _ => decimal(value, step, largest),
    };
    let tick = |value| Tick {
        value,
        label: label(value),
    };
    inside.map(tick).collect()
}

fn log_ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    let slack = 1.0 + 1e-9;
    let inside = |value: &f64| *value >= low / slack && *value <= high * slack;
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let times = |digits: &'static [f64]| {
        let decades = decades.clone();
        decades.flat_map(move |decade| digits.iter().map(move |digit| digit * power(decade)))
    };
    let powers: Vec<f64> = times(&[1.0]).filter(inside).collect();
    let fine: Vec<f64> = times(&[1.0, 2.0, 5.0]).filter(inside).collect();
    if fine.len() < 2 {
        // Below a factor of two the scale is nearly linear.
        return ticks(Scale::Linear, low, high, wanted);
    }
    let stride = powers.len().div_ceil(wanted.max(2)).max(1);
    let major: Vec<f64> = if fine.len() <= wanted + 1 || powers.len() < 2 {
        fine
    } else {
        // Counted from 10^0, so that all charts label the same decades.
        let named = |value: &f64| (value.log10().round() as i64).rem_euclid(stride as i64) == 0;
        powers.iter().copied().filter(named).collect()
    };
    let label = |value: f64| {
        if low >= 0.999e-3 && high <= 1.001e5 {
            shortest(value)
        } else {
            scientific(value, 12)
        }
    };
    let tick = |value: f64, label: String| Tick { value, label };
    let mut all: Vec<Tick> = major.iter().map(|&v| tick(v, label(v))).collect();
    if powers.len() <= 8 {
        let between = times(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]).filter(inside);
        let minor = between.filter(|value| !major.contains(value));
        all.extend(minor.map(|value| tick(value, String::new())));
    }
    all
}

/// A number with the decimals of its step.
fn decimal(value: f64, step: f64, largest: f64) -> String {
    if largest >= 1e6 || step < 0.999e-4 {
        return scientific(value, digits(largest / step));
    }
    let decimals = (-(step * 1.001).log10().floor()).max(0.0) as usize;
    signed(&format!("{value:.decimals$}"))
}

/// Significant digits, after the first, that distinguish steps.
fn digits(ratio: f64) -> usize {
    ratio.log10().ceil().clamp(0.0, 12.0) as usize
}

fn shortest(value: f64) -> String {
    // Twelve digits hide the rounding of 3 * 0.1.
    let text = format!("{value:.12}");
    signed(text.trim_end_matches('0').trim_end_matches('.'))
}

/// Uses the typographic minus, and no minus for zero.
fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|letter| "0.".contains(letter)) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text.to_owned(),
    }
}

/// Scientific notation: 10⁻³ or 2.5×10⁷.
fn scientific(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let text = format!("{value:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let mantissa = if mantissa.contains('.') {
        mantissa.trim_end_matches('0').trim_end_matches('.')
    } else {
        mantissa
    };
    let power: String = exponent.chars().map(raised).collect();
    match mantissa {
        "1" => format!("10{power}"),
        "-1" => format!("−10{power}"),
        other => format!("{}×10{power}", signed(other)),
    }
}

/// A superscript digit or minus.
fn raised(sign: char) -> char {
    let pairs = "-0123456789".chars().zip("⁻⁰¹²³⁴⁵⁶⁷⁸⁹".chars());
    let found = pairs.into_iter().find(|(plain, _)| *plain == sign);
    found.map_or(sign, |(_, raised)| raised)
}

/// Seconds as m:ss or h:mm:ss, with the decimals for steps of `step` seconds.
pub(super) fn clock(seconds: f64, step: f64) -> String {
    let decimals = if step >= 0.999 {
        0
    } else {
        (-(step * 1.001).log10().floor()).clamp(1.0, 6.0) as usize
    };
    let unit = power(decimals as i32);
    // Round once, in the smallest unit shown, so that 59.99 is 1:00 and never 0:60.
    let ticks = (seconds.abs() * unit).round();
    let whole = (ticks / unit).floor();
    let part = ticks - whole * unit;
    let (hours, minutes) = ((whole / 3600.0).floor(), (whole / 60.0).floor() % 60.0);
    let sign = if seconds < 0.0 && ticks > 0.0 {
        "−"
    } else {
        ""
    };
    let mut text = if hours > 0.0 {
        format!("{sign}{hours:.0}:{minutes:02.0}:{:02.0}", whole % 60.0)
    } else {
        format!("{sign}{minutes:.0}:{:02.0}", whole % 60.0)
    };
    if decimals > 0 {
        text += &format!(".{part:0decimals$.0}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, range: (f64, f64), wanted: usize) -> Vec<String> {
        let ruler = Ruler::exact(scale, range, (0.0, 100.0), wanted);
        let labels = ruler.ticks.into_iter().map(|tick| tick.label);
        labels.filter(|label| !label.is_empty()).collect()
    }

    #[test]
    fn linear_ticks_are_round_numbers() {
        assert_eq!(
            labels(Scale::Linear, (0.0, 1.0), 5),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]
        );
        assert_eq!(labels(Scale::Whole, (0.0, 1.0), 5), ["0", "1"]);
        assert_eq!(
            labels(Scale::Linear, (0.0, 23.0), 5),
            ["0", "5", "10", "15", "20"]
        );
        assert_eq!(
            labels(Scale::Linear, (-1.0, 1.0), 4),
            ["−1.0", "−0.5", "0.0", "0.5", "1.0"]
        );
        assert_eq!(
            labels(Scale::Linear, (0.0, 3e6), 3),
            ["0", "10⁶", "2×10⁶", "3×10⁶"]
        );
    }

    #[test]
    fn log_ticks_name_decades_or_their_parts() {
        assert_eq!(
            labels(Scale::Log, (1.0, 30.0), 5),
            ["1", "2", "5", "10", "20"]
        );
        assert_eq!(
            labels(Scale::Log, (1e-4, 1.0), 5),
            ["10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]
        );
        assert_eq!(
            labels(Scale::Log, (1e-12, 1.0), 5),
            ["10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]
        );
        assert!(labels(Scale::Log, (3.1, 3.3), 5).len() >= 3);
    }

    #[test]
    fn time_ticks_are_those_of_a_clock() {
        assert_eq!(
            labels(Scale::Time, (0.0, 90.0), 6),
            ["0:00", "0:15", "0:30", "0:45", "1:00", "1:15", "1:30"]
        );
        assert_eq!(
            labels(Scale::Time, (0.0, 1.0), 2),
            ["0:00.0", "0:00.5", "0:01.0"]
        );
        assert_eq!(labels(Scale::Time, (3500.0, 3700.0), 3), ["1:00:00"]);
        assert_eq!(clock(59.99, 1.0), "1:00");
        assert_eq!(clock(-61.0, 1.0), "−1:01");
        assert_eq!(clock(83.46, 0.1), "1:23.5");
    }

    #[test]
    fn round_ranges_hold_their_values_and_end_on_ticks() {
        for (scale, values) in [
            (Scale::Linear, vec![3.2, 17.9]),
            (Scale::Linear, vec![0.3, 0.1 + 0.2]),
            (Scale::Linear, vec![-4e-7, 3e-7]),
            (Scale::Log, vec![3e-5, 0.7]),
            (Scale::Time, vec![12.0, 412.0]),
        ] {
            let ruler = Ruler::round(scale, values.iter().copied(), (10.0, 210.0), 5);
            let (low, high) = (ruler.low, ruler.high);
            for value in values {
                assert!(low <= value + 1e-6 * (high - low) && value <= high + 1e-6 * (high - low));
            }
            let (first, last) = (ruler.place(low), ruler.place(high));
            assert_eq!((first, last), (Some(10.0), Some(210.0)));
            let near = |value: f64| {
                let at = |tick: &Tick| (tick.value - value).abs() <= 1e-6 * (high - low);
                ruler.ticks.iter().any(at)
            };
            assert!(near(low) && near(high), "{ruler:?}");
        }
    }

    #[test]
    fn degenerate_ranges_still_make_a_ruler() {
        for scale in [Scale::Linear, Scale::Log, Scale::Time, Scale::Whole] {
            for values in [
                vec![],
                vec![0.0],
                vec![7.0, 7.0],
                vec![-3.0],
                vec![1e15, 1e15 + 0.1],
                vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY],
                vec![1e-140, 1e140],
                vec![-1e149, 1e149],
                vec![f64::MAX, f64::MIN, f64::MIN_POSITIVE],
            ] {
                let ruler = Ruler::round(scale, values.iter().copied(), (0.0, 100.0), 5);
                let (low, high) = (ruler.low, ruler.high);
                assert!(low < high, "{scale:?} {values:?}");
                assert!(!ruler.ticks.is_empty(), "{scale:?} {values:?}");
                assert!(ruler.ticks.len() <= MOST_TICKS + 80);
                for value in values {
                    let place = ruler.place(value);
                    assert_eq!(place.is_some(), scale.takes(value));
                    assert!(place.is_none_or(|place| (-0.1..=100.1).contains(&place)));
                }
            }
        }
    }

    #[test]
    fn equal_ratios_are_equal_lengths_on_a_log_scale() {
        let ruler = Ruler::exact(Scale::Log, (0.01, 100.0), (400.0, 0.0), 5);
        let place = |value| ruler.place(value).unwrap();
        assert!((place(0.1) - 300.0).abs() < 1e-3 && (place(10.0) - 100.0).abs() < 1e-3);
        assert_eq!(ruler.place(0.0), None);
        assert_eq!(ruler.place(-1.0), None);
    }
}
