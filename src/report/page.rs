//! The page that plays a show in a browser.

use super::Error;
use super::curves::hue;
use super::words::count;
use crate::engine::{self, Document, Engine};
use crate::picture::tone::Tone;
use crate::playback::Playback;
use crate::playback::page::{self, Contents, Cue, Fader, Law};
use crate::printable::visible;
use crate::renderer::contract::check_memory;
use crate::report::sheet::time;
use crate::show::{Coordinate, Dimmer, Link, Show};
use crate::timeline;
use crate::units::Time;

/// Levels at which the page gets a user's dimmer curve.
const LEVELS: usize = 257;

/// The page, and its description.
pub fn page(engine: &Engine, playback: &Playback, tone: Tone) -> Result<(String, String), Error> {
    let banks = engine.bank_images_beside(playback.image_bytes())?;
    let (document, show) = (engine.document(), engine.show());
    let coordinates = show.coordinates();
    let keys = playback.images();
    let faders = coordinates.iter().enumerate();
    let contents = Contents {
        title: &visible(&show.title),
        faders: faders
            .map(|(i, c)| fader(show, c, keys.len() + i))
            .collect(),
        cues: cues(document, coordinates.len()),
        keys: document.keys(),
        pictures: keys.iter().chain(&banks).collect(),
        tone,
    };
    let bank_bytes: usize = banks.iter().map(|image| size_of_val(image.data())).sum();
    let held = playback.image_bytes() + bank_bytes;
    let work = engine.work().holding(held);
    let needed = page::bytes(&contents, page::BUDGET, work.threads);
    check_memory("the page", needed, work.memory).map_err(engine::Error::from)?;
    let made = page::write(&contents, page::BUDGET, work)?;
    let (width, height) = made.size;
    let smaller = match made.size == playback.size() {
        true => "",
        false => ", made smaller to stay below 20 MB",
    };
    let text = format!(
        "{} and {} of {width}x{height}{smaller}; {:.1} MB",
        count(keys.len(), "key image"),
        count(banks.len(), "bank image"),
        made.html.len() as f64 / 1e6
    );
    Ok((made.html, text))
}

fn fader(show: &Show, coordinate: &Coordinate, picture: usize) -> Fader {
    let bank = coordinate.bank.and_then(|b| show.banks.get(b));
    let law = match bank.filter(|b| !b.rgb).map_or(Dimmer::Linear, |b| b.dimmer) {
        Dimmer::Linear => Law::Power(1),
        Dimmer::Square => Law::Power(2),
        curve @ Dimmer::Curve(_) => {
            let level = |i| i as f64 / (LEVELS - 1) as f64;
            let levels: Vec<f64> = (0..LEVELS).map(level).collect();
            Law::Table(timeline::settings(curve, &show.curves, &levels))
        }
    };
    Fader {
        name: coordinate.name.clone(),
        picture,
        varies: bank.is_some(),
        law,
        colour: hue(coordinate).map(|[r, g, b]| format!("rgb({r} {g} {b})")),
    }
}

fn cues(document: &Document, coordinates: usize) -> Vec<Cue> {
    let timeline = document.timeline();
    let cues = document.show().cues.iter().zip(timeline.cues());
    let cue = |(cue, time): (&crate::show::Cue, &timeline::CueTime)| Cue {
        number: cue.number.to_string(),
        label: visible(&cue.label).into_owned(),
        go: time.go.seconds(),
        complete: time.completion.seconds(),
        starts: cue.link.is_some(),
        timing: timing(cue),
        note: visible(&cue.note).into_owned(),
        moves: (0..coordinates)
            .filter_map(|c| Some((c, arrival(timeline.moves(c), time)?)))
            .collect(),
    };
    cues.map(cue).collect()
}

/// Seconds from a cue's GO until the last of these moves that begins in it has ended.
fn arrival(moves: &[(Time, Time)], cue: &timeline::CueTime) -> Option<f64> {
    let own = moves
        .iter()
        .filter(|(start, _)| (cue.go..=cue.completion).contains(start));
    own.map(|(_, end)| (*end - cue.go).seconds())
        .reduce(f64::max)
}

/// Up, down and delay of a cue's first part, and what the cue starts: `6/9, delay 2, hang 1`.
fn timing(cue: &crate::show::Cue) -> String {
    let mut words = Vec::new();
    if let Some(part) = cue.parts.first() {
        words.push(match part.up == part.down {
            true => time(part.up),
            false => format!("{}/{}", time(part.up), time(part.down)),
        });
        if part.delay > Time::ZERO {
            words.push(format!("delay {}", time(part.delay)));
        }
    }
    words.extend(cue.link.map(|(_, link)| match link {
        Link::Follow(after) => format!("follow {}", time(after)),
        Link::Hang(after) => format!("hang {}", time(after)),
    }));
    words.join(", ")
}
