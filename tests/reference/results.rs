//! What a study leaves in a folder: its record and its chart.

use footlight::chart::Drawing;
use footlight::files::{Disk, Store};
use footlight::study::Record;
use std::path::Path;

/// Writes NAME.json, NAME.csv and, where there is a chart, NAME.svg and NAME.png.
pub fn write(folder: &Path, name: &str, record: &Record, chart: Option<&Drawing>) {
    let put = |ending: &str, bytes: &[u8]| {
        Disk.write(&folder.join(format!("{name}.{ending}")), bytes)
            .unwrap();
    };
    put("json", record.json().unwrap().as_bytes());
    put("csv", record.csv().as_bytes());
    if let Some(chart) = chart {
        put("svg", chart.svg().as_bytes());
        put("png", &chart.clone().magnified(2.0).png().unwrap());
    }
}
