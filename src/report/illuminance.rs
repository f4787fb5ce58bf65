//! The light that falls on the surfaces of a picture, in false colours and in words.

use super::chart::{self, ChartError, Drawing, FalseColour, Theme};

/// Share of the pixels that the colours tell apart; brighter ones are few, next to lamps.
const SHOWN: f64 = 0.995;

/// The picture of illuminances in lux, a value for each pixel, row by row from the top, NaN where it is unknown;
/// and a summary.
///
/// # Errors
/// Like [`chart::false_colour`].
pub fn drawing(
    title: &str,
    width: usize,
    values: Vec<f64>,
) -> Result<(Drawing, String), ChartError> {
    let mut known: Vec<f64> = values
        .iter()
        .copied()
        .filter(|lux| lux.is_finite())
        .collect();
    known.sort_by(f64::total_cmp);
    let most = known.get((known.len() as f64 * SHOWN) as usize);
    let most = most.copied().unwrap_or(0.0);
    let sum: f64 = known.iter().sum();
    let text = match known.as_slice() {
        [least, .., greatest] => format!(
            "illuminance {:.1} to {greatest:.1} lux, mean {:.1}",
            least.max(0.0),
            sum / known.len() as f64
        ),
        _ => "the view shows no matt surface, whose illuminance could be seen".to_owned(),
    };
    let data = FalseColour {
        title: title.to_owned(),
        width,
        values,
        most: if most > 0.0 { most } else { 1.0 },
        unit: "illuminance (lux)".to_owned(),
        unknown: "unknown: no surface, lamps, gloss, glass, black, edges".to_owned(),
    };
    Ok((chart::false_colour(&data, Theme::Dark)?, text))
}
