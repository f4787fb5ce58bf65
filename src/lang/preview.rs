//! The `preview` statement, written from values.

use crate::show::{Preview, ToneCurve};

/// The statement that sets a preview, as it stands in a show.
pub fn preview_statement(preview: &Preview) -> String {
    let tone = match preview.tone {
        ToneCurve::Filmic => "filmic",
        ToneCurve::Plain => "plain",
    };
    let dither = if preview.dither { "  dither on" } else { "" };
    let exposure = preview.exposure;
    format!(
        "preview {{ tolerance {}%  gap {}  rate {}  exposure {}  tone {tone}{dither}  coarse {}  refined {} }}",
        // Without the rounding of a division by a hundred.
        (preview.tolerance * 1e6).round() / 1e4,
        preview.gap.seconds(),
        preview.rate,
        exposure.map_or("auto".to_owned(), |stops| stops.to_string()),
        preview.coarse,
        preview.refined
    )
}
