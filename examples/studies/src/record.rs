//! The common form of measurements: subject, method, machine, and figures.
//!
//! A record is a table: its columns are named quantities with units, its rows are points, grouped
//! into series. Every kind of study fills this table, so that JSON, CSV and charts are written
//! once. Invariant: every point has as many values as the record has quantities; the constructor
//! pads and cuts.

use std::fmt::Write as _;

use serde::Serialize;

use footlight_engine::measure::Machine;
use footlight_report::table::csv_line;
use footlight_report::words;
use footlight_show::printable::{self, visible};

/// Subject and machine of a record.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// The show's title, or the name of another subject.
    pub subject: String,
    /// The machine.
    pub machine: Machine,
}

/// Subject of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StudyKind {
    /// The operator G: error against time over its scale of quality.
    Transport,
    /// Time and memory against the size of the task.
    Scale,
    /// Metrics, previews and predictions against ground truth.
    Trial,
    /// Failures of methods: one against another on hard inputs.
    Stability,
}

/// A column.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// Its unit: `s`, `%`, `bytes`; empty for a number.
    pub unit: String,
}

impl Quantity {
    /// A column.
    pub fn new(name: &str, unit: &str) -> Quantity {
        Quantity {
            name: name.to_owned(),
            unit: unit.to_owned(),
        }
    }

    /// Its name with its unit.
    pub fn heading(&self) -> String {
        match self.unit.as_str() {
            "" => self.name.clone(),
            unit => format!("{}, {unit}", self.name),
        }
    }
}

/// A row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordRow {
    /// Its label, such as `quality 3`.
    pub label: String,
    /// Remarks, such as `coarse` or `pareto`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub marks: Vec<String>,
    /// One value for each quantity; `None` if unknown.
    pub values: Vec<Option<f64>>,
}

/// Rows that belong together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordSeries {
    /// Its name.
    pub name: String,
    /// Points in the order measured.
    pub points: Vec<RecordRow>,
}

/// A measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Record {
    /// Subject of the study.
    pub kind: StudyKind,
    /// The show's title.
    pub subject: String,
    /// Footlight's version.
    pub version: String,
    /// The machine.
    pub machine: Machine,
    /// The method in a sentence, with the reference.
    pub method: String,
    /// The columns.
    pub quantities: Vec<Quantity>,
    /// The rows.
    pub series: Vec<RecordSeries>,
}

impl Record {
    /// An empty table.
    pub fn new(
        kind: StudyKind,
        origin: &Origin,
        method: &str,
        quantities: Vec<Quantity>,
    ) -> Record {
        Record {
            kind,
            subject: origin.subject.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            machine: origin.machine.clone(),
            method: method.to_owned(),
            quantities,
            series: Vec::new(),
        }
    }

    /// Adds a row to the series of this name, created if missing. Values that are not finite count
    /// as unknown.
    pub fn add(&mut self, series: &str, label: &str, marks: &[&str], values: &[Option<f64>]) {
        let mut values: Vec<Option<f64>> =
            values.iter().map(|v| v.filter(|v| v.is_finite())).collect();
        values.resize(self.quantities.len(), None);
        let point = RecordRow {
            label: label.to_owned(),
            marks: marks.iter().map(|m| (*m).to_owned()).collect(),
            values,
        };
        match self.series.iter_mut().find(|s| s.name == series) {
            Some(found) => found.points.push(point),
            None => self.series.push(RecordSeries {
                name: series.to_owned(),
                points: vec![point],
            }),
        }
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.quantities.iter().position(|q| q.name == name)
    }

    /// Two columns of a series as points of a chart; NaN for an unknown value.
    pub fn curve(&self, series: &RecordSeries, x: &str, y: &str) -> Vec<(f64, f64)> {
        let (x, y) = (self.column(x), self.column(y));
        let value = |point: &RecordRow, column: Option<usize>| {
            let value = column.and_then(|c| point.values.get(c).copied().flatten());
            value.unwrap_or(f64::NAN)
        };
        let points = series.points.iter();
        points.map(|p| (value(p, x), value(p, y))).collect()
    }

    /// As JSON, indented.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        Ok(printable::json(&serde_json::to_string_pretty(self)?))
    }

    /// The record as CSV (RFC 4180): `#` lines with the metadata, a header, a row for each point.
    /// An unknown value is an empty field.
    pub fn csv(&self) -> String {
        let mut out = String::new();
        let kind = serde_json::to_string(&self.kind).unwrap_or_default();
        let about = [
            ("kind", kind.trim_matches('"').to_owned()),
            ("subject", self.subject.clone()),
            ("version", self.version.clone()),
            ("machine", words::machine(&self.machine)),
            ("method", self.method.clone()),
        ];
        for (name, text) in about {
            let _ = writeln!(out, "{}", visible(&format!("# {name}: {text}")));
        }
        let mut header = vec!["series".to_owned(), "label".to_owned(), "marks".to_owned()];
        header.extend(self.quantities.iter().map(Quantity::heading));
        let _ = writeln!(out, "{}", csv_line(&header));
        for series in &self.series {
            for point in &series.points {
                let mut fields = vec![
                    series.name.clone(),
                    point.label.clone(),
                    point.marks.join(" "),
                ];
                let shown = |v: &Option<f64>| v.map_or(String::new(), |v| v.to_string());
                fields.extend(point.values.iter().map(shown));
                let _ = writeln!(out, "{}", csv_line(&fields));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "tests")]

    use super::*;

    fn record() -> Record {
        let origin = Origin {
            subject: "A \"show\"".to_owned(),
            machine: Machine::here(2, Some("A chip, \"fast\"".to_owned())),
        };
        let columns = vec![Quantity::new("time", "s"), Quantity::new("error", "%")];
        let mut out = Record::new(StudyKind::Transport, &origin, "by hand", columns);
        out.add(
            "all, mean",
            "quality 1",
            &["coarse"],
            &[Some(0.25), Some(f64::NAN)],
        );
        out.add("worst", "quality 1", &[], &[Some(0.25)]);
        out.add(
            "all, mean",
            "quality 2",
            &[],
            &[Some(0.5), Some(1.5), Some(9.0)],
        );
        out
    }

    #[test]
    fn rows_have_the_tables_width_and_join_their_series() {
        let record = record();
        assert_eq!(record.series.len(), 2);
        let points = &record.series[0].points;
        assert_eq!(points[0].values, [Some(0.25), None]);
        assert_eq!(points[1].values, [Some(0.5), Some(1.5)]);
        let curve = record.curve(&record.series[0], "time", "error");
        assert!(curve[0].1.is_nan() && curve[1] == (0.5, 1.5));
    }

    #[test]
    fn csv_quotes_what_needs_it() {
        let csv = record().csv();
        let rows: Vec<&str> = csv.lines().filter(|l| !l.starts_with('#')).collect();
        assert_eq!(rows[0], "series,label,marks,\"time, s\",\"error, %\"");
        assert_eq!(rows[1], "\"all, mean\",quality 1,coarse,0.25,");
        assert_eq!(rows[3], "worst,quality 1,,0.25,");
    }
}
