//! Formats of key images: error against frames a second, by number of threads.

use super::words::{count, drawn};
use super::{Kind, Quantity, Record};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use crate::study::playback::{FormatTradeoff, Judged, Timed, UNSEEN};

const MARKERS: [Marker; 4] = [
    Marker::Circle,
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
];

/// The table: a series for each way, a point for each number of threads.
pub fn record(formats: &FormatTradeoff) -> Record {
    let quantities = vec![
        Quantity::new("time a frame", "ms"),
        Quantity::new("frames a second", ""),
        Quantity::new("largest error", "steps of 8 bits"),
        Quantity::new("RMS error", "steps of 8 bits"),
        Quantity::new("channels off by more than half a step", "%"),
        Quantity::new("key images", "MB"),
        Quantity::new("threads", ""),
    ];
    let method = method(formats);
    let mut out = Record::new(Kind::Playback, &formats.origin, &method, quantities);
    for way in &formats.ways {
        for (threads, seconds) in &way.seconds {
            let marks = match is_default(formats, way, *threads) {
                true => &["default"][..],
                false => &[],
            };
            let values = figures(way, *threads, *seconds);
            out.add(
                name(way),
                &count(*threads, "thread"),
                marks,
                &values.map(Some),
            );
        }
    }
    out
}

fn method(formats: &FormatTradeoff) -> String {
    let (width, height) = formats.size;
    format!("{width}x{height}, against double precision")
}

fn name(way: &Timed) -> &'static str {
    way.format
        .map_or("8-bit, blended as displayed", |format| format.name())
}

fn is_default(formats: &FormatTradeoff, way: &Timed, threads: usize) -> bool {
    way.format == Some(formats.chosen) && threads == formats.origin.machine.threads
}

/// The values of a row: ms and frames a second, largest and RMS error, percent of channels off,
/// megabytes, threads.
fn figures(way: &Timed, threads: usize, seconds: f64) -> [f64; 7] {
    [
        seconds * 1e3,
        1.0 / seconds,
        way.judged.most,
        way.judged.rms,
        way.judged.seen * 100.0,
        way.bytes as f64 / 1e6,
        threads as f64,
    ]
}

/// The chart: log of the error over log of the frames a second. More threads move a format to the
/// right, along a line of its own: the error is the same.
pub fn drawing(formats: &FormatTradeoff, theme: Theme) -> Drawing {
    let chip = formats.origin.machine.processor.as_deref();
    let chip = chip.map_or(String::new(), |chip| format!("; {chip}"));
    let panel = |title: &str, error: fn(&Judged) -> f64| Panel {
        title: title.to_owned(),
        x: Axis::new("frames a second, by number of threads", Scale::Log),
        y: Axis::new("steps of 8 bits", Scale::Log),
        series: formats
            .ways
            .iter()
            .zip(MARKERS.into_iter().cycle())
            .map(|(way, marker)| series(way, marker, error))
            .collect(),
        reference: Some((UNSEEN, "half a step".to_owned())),
    };
    let panels = [
        panel(&format!("largest error; {}", method(formats)), |j| j.most),
        panel(&format!("RMS error{chip}"), |j| j.rms),
    ];
    let title = format!(
        "{}: error against frames a second, by keys and threads",
        formats.origin.subject
    );
    chart::panels(&title, &panels, theme)
}

fn series(way: &Timed, marker: Marker, error: fn(&Judged) -> f64) -> chart::Series {
    let error = drawn(Some(error(&way.judged)));
    let point = |(_, seconds): &(usize, f64)| (drawn(Some(1.0 / seconds)), error);
    chart::Series {
        name: name(way).to_owned(),
        points: way.seconds.iter().map(point).collect(),
        marker,
        labels: way.seconds.iter().map(|(n, _)| n.to_string()).collect(),
    }
}

/// A line for each way and number of threads.
pub fn describe(formats: &FormatTradeoff) -> String {
    let mut out = format!(
        "{:<26} {:>7} {:>9} {:>9} {:>10} {:>8} {:>11} {:>8}\n",
        "keys", "threads", "ms/frame", "frames/s", "max steps", "RMS", "beyond 1/2", "MB"
    );
    for way in &formats.ways {
        for (threads, seconds) in &way.seconds {
            let is = match is_default(formats, way, *threads) {
                true => "  (default)",
                false => "",
            };
            let [ms, rate, most, rms, seen, size, _] =
                figures(way, *threads, *seconds).map(|v| drawn(Some(v)));
            out += &format!(
                "{:<26} {threads:>7} {ms:>9.2} {rate:>9.0} {most:>10.2e} {rms:>8.1e} {seen:>10.3}% {size:>8.1}{is}\n",
                name(way),
            );
        }
    }
    out
}
