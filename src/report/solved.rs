//! Solved levels, in words and as images.

use std::fmt::Write as _;

use super::chart::{self, ChartError, Drawing, Sheet, Theme, Tile};
use super::sheet::hex;
use super::words::figure;
use footlight_engine::solve::{Illuminance, Sketched, Solved};
use footlight_picture::combine::combine;
use footlight_picture::signed;
use footlight_picture::tone::Tone;
use footlight_show::printable::left;

/// Error of the levels for a sketch, and the contribution of each bank.
pub fn of_sketch(name: &str, sketched: &Sketched) -> String {
    let [before, after] = sketched.difference.map(figure);
    let mut text = format!(
        "{name}: {after} % differs, {before} % as it stood; out of reach of these banks {} %",
        figure(sketched.out_of_reach)
    );
    if let Some(stops) = sketched.exposure {
        let _ = write!(text, "\nexposure {stops:.2} stops fits best");
    }
    text + &banks(&sketched.solved)
}

/// Error of the levels for an illuminance at some points, and its reason.
pub fn of_illuminance(lux: f64, points: &[&str], found: &Illuminance) -> String {
    let seen = || found.solved.banks.iter().filter(|bank| bank.is_seen);
    let missed = |after: f64| {
        if (after - lux).abs() < 0.005 * lux {
            return String::new();
        }
        let why = if after < lux && seen().all(|bank| bank.level[1] > 0.9999) {
            "these banks are at full"
        } else if after > lux && seen().all(|bank| bank.level[1] < 0.0001) {
            "these banks are out, and other light is left"
        } else {
            "no levels of these banks come nearer"
        };
        format!("; {lux} is not reached: {why}")
    };
    let lines = points
        .iter()
        .zip(&found.lux)
        .map(|(point, [before, after])| {
            format!(
                "{point}: {after:.1} lux, {before:.1} as it stood{}",
                missed(*after)
            )
        });
    lines.collect::<Vec<String>>().join("\n") + &banks(&found.solved)
}

/// A line for each bank, with indistinguishable and invisible ones.
fn banks(solved: &Solved) -> String {
    let (seen, unseen): (Vec<_>, Vec<_>) = solved.banks.iter().partition(|bank| bank.is_seen);
    let mut text = format!(
        "\n  {:14} {:>6} {:>6}   left as it stood\n",
        "", "level", "stood"
    );
    for bank in seen {
        let [stood, level] = bank.level.map(|level| 100.0 * level);
        let (name, without) = (left(&bank.name, 14), figure(bank.without));
        let colour = if bank.colour.is_empty() {
            String::new()
        } else {
            hex(&bank.colour)
        };
        let line = format!("  {name} {level:>6.1} {stood:>6.1} {without:>8} %  {colour}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    let unseen: Vec<String> = unseen.into_iter().map(|bank| bank.name.clone()).collect();
    let groups = [
        (
            &solved.tied,
            "only sums of these count here, and change least",
        ),
        (&unseen, "not seen, and left as they stand"),
    ];
    for (names, what) in groups.into_iter().filter(|(names, _)| !names.is_empty()) {
        let _ = writeln!(text, "{what}: {}", names.join(", "));
    }
    text
}

/// The sketch, the image of the levels, their difference, and the unreachable parts of the sketch.
pub fn drawing(title: &str, sketched: &Sketched, tone: Tone) -> Result<Drawing, ChartError> {
    let [sketch, picture, beyond] = &sketched.images;
    let off = combine(sketch.size(), &[(1.0, picture), (-1.0, sketch)], 1);
    let bright = signed::scale(sketch);
    let tile = |rgb: Vec<u8>, caption: String| Tile {
        size: sketch.size(),
        rgb,
        caption,
    };
    let [difference, out_of_reach] = [sketched.difference[1], sketched.out_of_reach].map(figure);
    let data = Sheet {
        title: title.to_owned(),
        tiles: vec![
            tile(tone.encode(sketch), "the sketch".to_owned()),
            tile(tone.encode(picture), format!("the banks: {difference} % differs")),
            tile(signed::encode(&off, bright), "the banks minus the sketch".to_owned()),
            tile(signed::encode(beyond, bright), format!("out of reach of these banks: {out_of_reach} %")),
        ],
        columns: Some(2),
        legend: "amber: more light, blue: less, full colour at the sketch's bright light; out of reach: amber \
                 is brighter than the banks at full, blue darker than all other light"
            .to_owned(),
    };
    chart::sheet(&data, Theme::Dark)
}
