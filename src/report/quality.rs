//! Cost of each quality step, as a table.

use super::table::set_right;
use super::words;
use footlight_engine::measure::quality::QualityForecast;

/// One line for each step.
pub fn describe(forecast: &QualityForecast) -> String {
    let header = ["step", "prepare s", "all banks s", "one more s"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for step in &forecast.steps {
        let seconds = step.predicted;
        let times = [seconds.prepare, seconds.banks, seconds.picture];
        let mut row = vec![step.quality.to_string()];
        row.extend(times.map(|s| format!("{s:.3}")));
        rows.push(row);
    }
    let machine = words::machine(&forecast.machine);
    let table = set_right(&rows);
    format!(
        "{} on {machine}\n{}\nprepare: once for a set and a rig; all banks: a picture of each; one \
         more: a further picture",
        forecast.operator,
        table.trim_end()
    )
}
