//! Settings and cost of each quality step, as a table.

use super::table::set_right;
use super::words::{self, figure};
use footlight_engine::measure::quality::{QualityForecast, QualityStep, Seconds};

/// One line for each step, with a column for every setting.
pub fn describe(forecast: &QualityForecast) -> String {
    let timed = forecast.steps.iter().any(|s| s.measured.is_some());
    let columns = columns(&forecast.steps);
    let mut header = vec!["step"];
    header.extend(&columns);
    header.extend(["prepare s", "all banks s", "one more s"]);
    if timed {
        header.extend(["measured: prepare", "banks", "one more", "ratio"]);
    }
    let mut rows: Vec<Vec<String>> = vec![header.iter().map(|h| (*h).to_owned()).collect()];
    for step in &forecast.steps {
        let mut row = vec![step.quality.to_string()];
        row.extend(columns.iter().map(|name| amount(step, name)));
        let times = |s: &Seconds| [s.prepare, s.banks, s.picture].map(|s| format!("{s:.3}"));
        row.extend(times(&step.predicted));
        if let Some(measured) = &step.measured {
            row.extend(times(measured));
            let ratio = step.predicted.total() / measured.total();
            row.push(format!("{ratio:.2}"));
        }
        rows.push(row);
    }
    let machine = words::machine(&forecast.machine);
    let table = set_right(&rows);
    let legend = legend(&columns);
    format!(
        "{} on {machine}\n{}\n{legend}",
        forecast.operator,
        table.trim_end()
    )
}

/// Explains the columns.
fn legend(columns: &[&str]) -> String {
    const MEANINGS: &[(&str, &str)] = &[
        ("elements", "pieces of surface that exchange light"),
        ("hemicube", "pixels along the edge of what each piece sees"),
        (
            "gather points",
            "places where bounced light is computed once more",
        ),
        ("gather hemicube", "pixels along the edge there"),
        ("sub-pixels", "parts of a pixel in which light is computed"),
        ("tolerance", "of direct light between such parts"),
        ("rays", "of bounced light in a pixel of one surface"),
        ("samples at first", "of direct light in a pixel"),
        ("samples at most", "where a pixel is noisy"),
        ("noise", "aimed at, as a share of the light"),
    ];
    let known = MEANINGS.iter().filter(|(name, _)| columns.contains(name));
    let mut lines = vec![
        "prepare: once for a set and a rig; all banks: a picture of each; one more: a further picture"
            .to_owned(),
    ];
    lines.extend(known.map(|(name, meaning)| format!("{name}: {meaning}")));
    lines.join("\n")
}

/// Names of all settings, in order of first use.
fn columns(steps: &[QualityStep]) -> Vec<&'static str> {
    let mut out = Vec::new();
    for set in steps.iter().flat_map(|s| &s.sets) {
        if !out.contains(&set.name) {
            out.push(set.name);
        }
    }
    out
}

/// A step's value of a setting; a dash if it has none.
fn amount(step: &QualityStep, name: &str) -> String {
    let found = step.sets.iter().find(|e| e.name == name);
    match found.map(|e| e.amount) {
        None | Some(0.0) => "-".to_owned(),
        Some(share) if name == "tolerance" => format!("{} %", figure(share)),
        Some(number) => number.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_engine::measure::Machine;
    use footlight_transport::QualityParameter;

    #[test]
    fn a_table_has_a_column_for_every_setting_and_a_ratio_when_measured() {
        let mut forecast = QualityForecast {
            show: "Test".to_owned(),
            operator: "radiosity".to_owned(),
            machine: Machine::here(2, None),
            pace: 0.5,
            steps: Vec::new(),
        };
        let set = |name, amount| QualityParameter { name, amount };
        let seconds = |total: f64| Seconds {
            prepare: 0.75 * total,
            banks: 0.25 * total,
            picture: 0.01,
        };
        let sets = [
            vec![set("elements", 300.0), set("gather points", 0.0)],
            vec![set("elements", 900.0), set("tolerance", 0.01)],
        ];
        for ((quality, sets), total) in (1..).zip(sets).zip([1.0, 3.0]) {
            forecast.steps.push(QualityStep {
                quality,
                sets,
                predicted: seconds(total),
                measured: None,
            });
        }
        let plain = describe(&forecast);
        assert!(
            plain.contains("elements  gather points  tolerance"),
            "{plain}"
        );
        assert!(
            plain.contains("1.00 %") && !plain.contains("ratio"),
            "{plain}"
        );
        for step in &mut forecast.steps {
            step.measured = Some(seconds(2.0));
        }
        let measured = describe(&forecast);
        assert!(
            measured.contains("0.50\n") && measured.contains("1.50\n"),
            "{measured}"
        );
    }
}
