//! Measurements of a study's process, and output of its record.

#![allow(dead_code, clippy::print_stdout, reason = "used by several studies")]
#![allow(
    clippy::unwrap_used,
    reason = "a study stops where its record cannot be written"
)]

use footlight_host::files::{Disk, Store};
use footlight_report::chart::Drawing;
use footlight_studies::record::Record;
use std::path::Path;

/// Writes NAME.json, NAME.csv and, if there is a chart, NAME.svg and NAME.png.
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

/// Peak of resident memory in megabytes; `None` if the system does not tell.
pub fn peak_memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1024.0)
}

/// Processor seconds of the process so far; `None` if the system does not tell.
pub fn processor_seconds() -> Option<f64> {
    ticks(11)
}

/// Processor seconds of finished child processes and their children.
pub fn children_seconds() -> Option<f64> {
    ticks(13)
}

/// Two fields of `/proc/self/stat`, user and system, counted from after the name.
fn ticks(first: usize) -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // Skip the name, which may contain anything, in brackets; 100 ticks per second.
    let (_, rest) = text.rsplit_once(')')?;
    let mut ticks = rest.split_whitespace().skip(first);
    let [user, system] = [ticks.next()?, ticks.next()?].map(|t| t.parse::<f64>().ok());
    Some((user? + system?) / 100.0)
}

/// Prints the log-log slopes of each quantity against the first, along one direction of growth:
/// from end to end, and of the last step.
pub fn exponents(record: &Record, way: &str) {
    let Some(series) = record.series.iter().find(|s| s.name == way) else {
        return;
    };
    for quantity in record.quantities.iter().skip(1) {
        let points = record.curve(series, "amount", &quantity.name);
        let points: Vec<(f64, f64)> = points.into_iter().filter(|p| p.1 > 0.0).collect();
        if let [first, .., before, last] = points[..] {
            let slope = |a: (f64, f64), b: (f64, f64)| (b.1 / a.1).ln() / (b.0 / a.0).ln();
            println!(
                "  {}: {way}^{:.2} over all, ^{:.2} at the end",
                quantity.name,
                slope(first, last),
                slope(before, last)
            );
        }
    }
}
