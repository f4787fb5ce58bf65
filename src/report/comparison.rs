//! Comparison of every bank with its reference: a table of errors, a contact sheet of differences.

use super::words::{count, figure, seconds};
use crate::chart::{self, ChartError, Drawing, Sheet, Theme, Tile};
use footlight_engine::measure::Reference;
use footlight_engine::measure::comparison::{BankError, Compared, Comparison};
use footlight_picture::combine::{combine, dot};
use footlight_picture::{Image, signed};
use footlight_show::printable::{columns, left};

/// One line for each bank.
pub fn describe(comparison: &Comparison) -> String {
    let width = comparison.banks.iter().map(|b| columns(&b.name));
    let width = width.max().unwrap_or(0).max(4);
    let shown = |v: Option<f64>| match v {
        None => "-".to_owned(),
        Some(v) if v == 0.0 && v.is_sign_negative() => "< noise".to_owned(),
        Some(v) => figure(v),
    };
    let mut rows = vec![format!(
        "quality {}: prepared and rendered {} in {}\n  {:width$} {:>8} {:>10} {:>12} {:>10} {:>7}\n",
        comparison.quality,
        count(comparison.banks.len(), "bank"),
        seconds(comparison.seconds),
        "bank",
        "rmse %",
        "no noise %",
        "no emitter %",
        "neither %",
        "mean",
    )];
    rows.extend(comparison.banks.iter().map(|b| {
        format!(
            "  {} {:>8} {:>10} {:>12} {:>10} {:>7}\n",
            left(&b.name, width),
            shown(b.rmse),
            shown(b.rmse_noise_free),
            shown(b.rmse_no_emitters),
            shown(b.rmse_noise_free_no_emitters),
            b.mean_ratio.map_or("-".to_owned(), |r| format!("{r:.4}")),
        )
    }));
    rows.concat()
}

/// The differences as a contact sheet: amber where the image is brighter than its reference, blue
/// where it is darker, on one scale, relative to each reference's root mean square.
pub fn drawing(show: &str, compared: &Compared) -> Result<Drawing, ChartError> {
    let pictures = || compared.images.iter().zip(&compared.references);
    let parts: Vec<Image> = pictures().map(|(i, r)| relative(i, r)).collect();
    let scale = parts.iter().map(signed::scale).fold(0.0, f32::max);
    let tile = |(bank, image): (&BankError, &Image)| Tile {
        size: (image.width(), image.height()),
        rgb: signed::encode(image, scale),
        caption: caption(bank),
    };
    let data = Sheet {
        title: format!(
            "{show}: difference from the reference at quality {}",
            compared.comparison.quality
        ),
        tiles: compared
            .comparison
            .banks
            .iter()
            .zip(&parts)
            .map(tile)
            .collect(),
        columns: None,
        legend: format!(
            "picture minus reference: amber brighter, blue darker, full colour at {} % of the \
             reference's RMS; the figures are relative RMSE in %",
            figure(f64::from(scale))
        ),
    };
    chart::sheet(&data, Theme::Dark)
}

/// The difference divided by the reference's root mean square.
fn relative(image: &Image, reference: &Reference) -> Image {
    let mean = &reference.mean;
    let size = (mean.width(), mean.height());
    let rms = (dot(mean, mean) / mean.data().len().max(1) as f64).sqrt();
    let gain = if rms > 0.0 { 1.0 / rms } else { 0.0 };
    combine(size, &[(gain, image), (-gain, mean)], 1)
}

fn caption(bank: &BankError) -> String {
    let shown = |v: Option<f64>| v.map_or("-".to_owned(), |v| figure(v.abs()));
    let mut text = format!("{}: {} %", bank.name, shown(bank.rmse));
    if bank.rmse_noise_free.is_some() {
        text = format!("{text}, {} % without noise", shown(bank.rmse_noise_free));
    }
    if bank.rmse_no_emitters != bank.rmse {
        let best = bank.rmse_noise_free_no_emitters.or(bank.rmse_no_emitters);
        text = format!("{text}, {} % off emitters", shown(best));
    }
    text
}
