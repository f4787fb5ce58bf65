//! Levels that were solved for, in words and as pictures.

use std::fmt::Write as _;

use super::chart::{self, ChartError, Drawing, Sheet, Theme, Tile};
use super::sheet::hex;
use super::words::figure;
use footlight_engine::solve::{Illuminance, Place, Sketched, Solved};
use footlight_picture::combine::combine;
use footlight_picture::signed;
use footlight_picture::tone::Tone;
use footlight_show::printable::{columns, left};

/// Parts of a picture smaller than this are not spoken of.
const LEAST: f64 = 0.005;

/// How near the levels come to a sketch, and what each bank does for it.
pub fn of_sketch(name: &str, sketched: &Sketched) -> String {
    let [before, after] = sketched.difference.map(figure);
    let mut text =
        format!("{name}: {after} % of its light differs; {before} % with the levels that stood\n");
    if let Some(stops) = sketched.exposure {
        let _ = writeln!(text, "exposure {stops:.2} stops fits best");
    }
    text.push_str(&banks(&sketched.solved, "without"));
    let parts = [
        "brighter than these banks at full",
        "darker than the other light alone",
    ];
    for (part, what) in sketched.out_of_reach.iter().zip(parts) {
        if let Some(part) = part.filter(|part| part.share >= LEAST) {
            let (share, place) = (figure(part.share), place(part));
            let _ = writeln!(
                text,
                "out of reach: {share} % of the sketch is {what}, around the {place}"
            );
        }
    }
    text
}

/// How near the levels come to an illuminance at some points.
pub fn of_illuminance(points: &[String], found: &Illuminance) -> String {
    let mut text = String::new();
    for (point, [before, after]) in points.iter().zip(&found.lux) {
        let _ = writeln!(
            text,
            "{after:.1} lux at {point}; {before:.1} with the levels that stood"
        );
    }
    text + &banks(&found.solved, "off")
}

/// A line for each bank, and which of them cannot be told apart or are not seen.
fn banks(solved: &Solved, without: &str) -> String {
    let width = solved
        .banks
        .iter()
        .map(|bank| columns(&bank.name))
        .max()
        .unwrap_or(0)
        .max(14);
    let mut text = format!(
        "  {:width$} {:>6} {:>6} {:>9}\n",
        "",
        "level",
        "stood",
        format!("{without} %")
    );
    for bank in solved.banks.iter().filter(|bank| bank.is_seen) {
        let [stood, level] = bank.level.map(|level| 100.0 * level);
        let (name, without) = (left(&bank.name, width), figure(bank.without));
        let colour = bank.colour.map_or_else(String::new, |colour| hex(&colour));
        let line = format!("  {name} {level:>6.1} {stood:>6.1} {without:>9}  {colour}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    for names in &solved.tied {
        let _ = writeln!(
            text,
            "{} give the same light here, of which only the sum counts: they change as little as they can",
            names.join(", ")
        );
    }
    let unseen = solved
        .banks
        .iter()
        .filter(|bank| !bank.is_seen)
        .map(|bank| bank.name.as_str());
    let unseen: Vec<&str> = unseen.collect();
    if !unseen.is_empty() {
        let _ = writeln!(
            text,
            "no light of theirs is seen, so they stay: {}",
            unseen.join(", ")
        );
    }
    text
}

/// Where in the picture something is, in thirds.
fn place(part: Place) -> String {
    let third = |at: f64, names: [&'static str; 3]| match at {
        at if at < 1.0 / 3.0 => names[0],
        at if at > 2.0 / 3.0 => names[2],
        _ => names[1],
    };
    let [x, y] = part.middle;
    let words = [
        third(y, ["top", "", "bottom"]),
        third(x, ["left", "", "right"]),
    ];
    let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
    if words.is_empty() {
        "middle".to_owned()
    } else {
        words.join(" ")
    }
}

/// The sketch, the picture of the levels, and what differs.
pub fn drawing(title: &str, sketched: &Sketched, tone: Tone) -> Result<Drawing, ChartError> {
    let [sketch, picture] = &sketched.images;
    let size = sketch.size();
    let off = combine(size, &[(1.0, picture), (-1.0, sketch)], 1);
    let scale = signed::scale(sketch);
    let tile = |rgb: Vec<u8>, caption: String| Tile { size, rgb, caption };
    let [before, after] = sketched.difference.map(figure);
    let data = Sheet {
        title: title.to_owned(),
        tiles: vec![
            tile(tone.encode(sketch), "the sketch".to_owned()),
            tile(tone.encode(picture), format!("the banks: {after} % differs, {before} % before")),
            tile(signed::encode(&off, scale), "the banks minus the sketch".to_owned()),
        ],
        columns: Some(3),
        legend: "amber: brighter than the sketch, blue: darker; full colour at the sketch's bright light".to_owned(),
    };
    chart::sheet(&data, Theme::Dark)
}
