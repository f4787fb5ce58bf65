//! What each step of quality sets and costs: predicted, and measured when asked.

use serde::Serialize;
use std::collections::BTreeMap;

use crate::renderer::Expense;
use crate::study::Machine;
use crate::study::comparison::figure;

/// Seconds of the three things that one waits for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seconds {
    /// Before the first picture.
    pub prepare: f64,
    /// Every bank alone, after that.
    pub banks: f64,
    /// One more picture of banks that were all lit before.
    pub picture: f64,
}

impl Seconds {
    /// What all banks take from nothing.
    pub fn total(&self) -> f64 {
        self.prepare + self.banks
    }
}

/// A step of quality for a show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Its number.
    pub quality: u8,
    /// What it sets.
    pub sets: BTreeMap<&'static str, f64>,
    /// As predicted.
    pub predicted: Seconds,
    /// As measured, if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<Seconds>,
}

/// Every step of the scale for a show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// The show's title.
    pub show: String,
    /// The operator.
    pub operator: String,
    /// Where.
    pub machine: Machine,
    /// Seconds of the operator's unit of cost here and now.
    pub pace: f64,
    /// Cheapest first.
    pub steps: Vec<Step>,
    /// In the order to be shown.
    #[serde(skip)]
    pub columns: Vec<&'static str>,
}

impl Forecast {
    /// Adds a step.
    pub fn add(&mut self, quality: u8, expenses: &[Expense], predicted: Seconds) {
        for expense in expenses {
            if !self.columns.contains(&expense.name) {
                self.columns.push(expense.name);
            }
        }
        self.steps.push(Step {
            quality,
            sets: expenses.iter().map(|e| (e.name, e.amount)).collect(),
            predicted,
            measured: None,
        });
    }

    /// As a table.
    pub fn describe(&self) -> String {
        let timed = self.steps.iter().any(|s| s.measured.is_some());
        let mut header = vec!["step"];
        header.extend(&self.columns);
        header.extend(["prepare s", "all banks s", "one more s"]);
        if timed {
            header.extend(["measured: prepare", "banks", "one more", "ratio"]);
        }
        let mut rows: Vec<Vec<String>> = vec![header.iter().map(|h| (*h).to_owned()).collect()];
        for step in &self.steps {
            let mut row = vec![step.quality.to_string()];
            let amounts = self.columns.iter().map(|c| step.sets.get(c));
            row.extend(amounts.zip(&self.columns).map(|(a, name)| amount(name, a)));
            let times = |s: &Seconds| [s.prepare, s.banks, s.picture].map(|s| format!("{s:.3}"));
            row.extend(times(&step.predicted));
            if let Some(measured) = &step.measured {
                row.extend(times(measured));
                let ratio = step.predicted.total() / measured.total();
                row.push(format!("{ratio:.2}"));
            }
            rows.push(row);
        }
        let machine = self.machine.describe();
        format!("{} on {machine}\n{}", self.operator, table(&rows))
    }
}

/// A setting as one reads it; a dash for what the step does without.
fn amount(name: &str, amount: Option<&f64>) -> String {
    match amount {
        None => "-".to_owned(),
        Some(0.0) => "-".to_owned(),
        Some(share) if name == "tolerance" => format!("{} %", figure(*share)),
        Some(number) => number.to_string(),
    }
}

/// Columns as wide as their widest cell, to the right.
fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row
            .iter()
            .zip(&widths)
            .map(|(cell, w)| format!("{cell:>w$}"));
        format!("  {}\n", cells.collect::<Vec<_>>().join("  "))
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_column_for_every_setting_and_a_ratio_when_measured() {
        let mut forecast = Forecast {
            show: "Test".to_owned(),
            operator: "radiosity".to_owned(),
            machine: Machine::here(2, None),
            pace: 0.5,
            steps: Vec::new(),
            columns: Vec::new(),
        };
        let expense = |name, amount| Expense { name, amount };
        let seconds = |total: f64| Seconds {
            prepare: 0.75 * total,
            banks: 0.25 * total,
            picture: 0.01,
        };
        forecast.add(
            1,
            &[expense("elements", 300.0), expense("nodes", 0.0)],
            seconds(1.0),
        );
        forecast.add(
            2,
            &[expense("elements", 900.0), expense("tolerance", 0.01)],
            seconds(3.0),
        );
        let plain = forecast.describe();
        assert!(plain.contains("elements  nodes  tolerance"), "{plain}");
        assert!(
            plain.contains("1.00 %") && !plain.contains("ratio"),
            "{plain}"
        );
        for step in &mut forecast.steps {
            step.measured = Some(seconds(2.0));
        }
        let measured = forecast.describe();
        assert!(
            measured.contains("0.50\n") && measured.contains("1.50\n"),
            "{measured}"
        );
    }
}
