//! A measured error in words.

use crate::words::count;
use footlight_engine::measure::MeasuredError;

/// One paragraph: the error of an image, the interval, and the cost.
pub fn describe(what: &str, measured: Option<&MeasuredError>) -> String {
    let Some(measured) = measured else {
        return format!(
            "{what}: not measured: it is dark, a bank is an image, or its renderer has no independent \
             estimate"
        );
    };
    let MeasuredError {
        pixels,
        paths,
        seconds,
        mean_ratio,
        ..
    } = measured;
    format!(
        "{what}: error {}; mean light {:.3} of the estimate\n{}, twice {}, {seconds:.1} s",
        range(measured),
        mean_ratio,
        count(*pixels, "pixel"),
        count(*paths as usize, "path"),
    )
}

/// The error with its interval: `0.9 % (0.7 to 1.1 %)`.
pub fn range(measured: &MeasuredError) -> String {
    let figure = |error: f64| match error * 100.0 {
        e if e >= 10.0 => format!("{e:.0}"),
        e => format!("{e:.1}"),
    };
    let [least, most] = measured.interval.map(figure);
    format!("{} % ({least} to {most} %)", figure(measured.error))
}
