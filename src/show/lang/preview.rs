//! The `preview` statement, written from values.

use crate::model::Preview;
use crate::units::ToneCurve;

/// The `preview` statement for these settings.
pub fn preview_statement(preview: &Preview) -> String {
    let tone = match preview.tone {
        ToneCurve::Filmic => "filmic",
        ToneCurve::Plain => "plain",
    };
    let exposure = match (preview.exposure, preview.bias) {
        (Some(stops), _) => stops.to_string(),
        (None, 0.0) => "auto".to_owned(),
        (None, bias) => format!("auto {bias:+}"),
    };
    let white = preview
        .white
        .map_or_else(String::new, |kelvin| format!("  white {kelvin} K"));
    format!(
        "preview {{ tolerance {}  gap {}  rate {}  exposure {}{white}  tone {tone}  coarse {}  refined {} }}",
        preview.tolerance,
        preview.gap.seconds(),
        preview.rate,
        exposure,
        preview.coarse,
        preview.refined
    )
}
