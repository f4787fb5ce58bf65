//! The page that plays a show in a browser.

use std::collections::BTreeSet;

use super::Error;
use super::words::{count, qualities};
use crate::sheet::{fades, link, time, up_down};
use footlight_engine::playback::Playback;
use footlight_engine::playback::page::{self, Contents, Fader, Law, Mixer, PageCue};
use footlight_engine::{self as engine, Document, Engine};
use footlight_picture::Image;
use footlight_picture::tone::Tone;
use footlight_show::model::{Bank, Coordinate, Dimmer, Show};
use footlight_show::printable::visible;
use footlight_show::timeline::{self, Timeline};
use footlight_show::units::Time;
use footlight_transport::contract::check_memory;

/// Samples of a user's dimmer curve in the page.
const LEVELS: usize = 257;

/// Samples per second of a move of level and colour in the page.
const STEPS_A_SECOND: f64 = 8.0;
const MOST_STEPS: usize = 400;
/// Frames per second in the page while heads move.
pub const HEAD_FRAMES: f64 = 10.0;
/// Frames per second while heads move in the first page of a run, which must come soon.
pub const FIRST_HEAD_FRAMES: f64 = 2.0;

/// A page, and what it contains.
pub struct PageFile {
    /// The file.
    pub html: String,
    /// Size of the images, where it is smaller than the view's.
    smaller: Option<(usize, usize)>,
    /// Numbers of images and bytes.
    contents: String,
}

impl PageFile {
    /// Says so where images were made smaller; otherwise empty.
    pub fn smaller(&self) -> String {
        self.smaller.map_or(String::new(), |(width, height)| {
            format!(
                ", with pictures of {width}x{height}: larger ones exceed {} MB",
                page::BUDGET / 1_000_000
            )
        })
    }

    /// The whole description.
    pub fn description(&self) -> String {
        format!("{}{}", self.contents, self.smaller())
    }
}

/// The page, with `rate` frames a second while heads move.
pub fn page(
    engine: &Engine,
    playback: &Playback,
    tone: Tone,
    rate: f64,
) -> Result<PageFile, Error> {
    let coordinates = engine.show().coordinates().len();
    let bank_bytes = coordinates * playback.size().0 * playback.size().1 * size_of::<[f32; 3]>();
    // Refuse before images are made in vain.
    let fits = |playback: &Playback| {
        let work = engine.work();
        let pictures = playback.images().len() + coordinates;
        let page = page::bytes(pictures, playback.size(), page::BUDGET, work.threads);
        let needed = playback.image_bytes() + bank_bytes + page;
        check_memory("the page", needed, work.memory).map_err(engine::Error::from)
    };
    fits(playback)?;
    let banks = engine.bank_images(playback.image_bytes())?;
    let work = engine.work().holding(playback.image_bytes());
    let stepped = engine::stepped(engine.document(), playback, rate, work)?;
    let playback = stepped.as_ref().unwrap_or(playback);
    let keys = playback.images();
    let contents = Contents {
        keys: playback.keys(),
        has_heads: stepped.is_some(),
        ..contents(engine, (keys, &banks), tone)
    };
    fits(playback)?;
    let held = playback.image_bytes() + bank_bytes;
    let work = engine.work().holding(held);
    let made = page::write(&contents, page::BUDGET, work)?;
    let (width, height) = made.size;
    let keys = if made.blends {
        format!("{} and ", count(keys.len(), "key image"))
    } else {
        String::new()
    };
    let contents = format!(
        "{keys}{} of {width}x{height}; {:.1} MB",
        count(banks.len(), "bank image"),
        made.html.len() as f64 / 1e6
    );
    Ok(PageFile {
        html: made.html,
        smaller: (made.size != playback.size()).then_some(made.size),
        contents,
    })
}

/// Data of a page, with images of the keys, if any, and of the banks.
pub fn contents<'a>(
    engine: &'a Engine,
    (keys, banks): (&'a [Image], &'a [Image]),
    tone: Tone,
) -> Contents<'a> {
    let (document, show) = (engine.document(), engine.show());
    let coordinates = show.coordinates();
    let faders = coordinates.iter().enumerate();
    Contents {
        title: visible(&show.title),
        quality: quality(engine),
        faders: faders.map(|(i, c)| fader(show, c, i)).collect(),
        mixers: mixers(document),
        cues: cues(document, coordinates.len()),
        keys: document.keys(),
        has_heads: false,
        pictures: keys.iter().collect(),
        banks: banks.iter().collect(),
        tone,
    }
}

/// Quality of the images: `Pictures at quality 2 and 3 refined pictures; the finest quality is 3`.
/// Empty when the renderer has one quality. A measured error would differ from run to run.
fn quality(engine: &Engine) -> String {
    let estimate = engine.estimate();
    if estimate.is_final() {
        return String::new();
    }
    let refined = match estimate.refined() {
        0 => String::new(),
        n => format!(" and {}", count(n, "refined picture")),
    };
    let (at, finest) = (qualities(engine), estimate.finest().0);
    format!("Pictures {at}{refined}; the finest quality is {finest}")
}

fn fader(show: &Show, coordinate: &Coordinate, picture: usize) -> Fader {
    let bank = coordinate.bank.and_then(|b| show.banks.get(b));
    Fader {
        name: coordinate.name.clone(),
        channel: bank.and_then(|bank| bank.channel),
        picture,
        varies: bank.is_some(),
        law: bank
            .filter(|b| !b.rgb)
            .map_or(Law::Power(1), |b| law(show, b)),
    }
}

fn law(show: &Show, bank: &Bank) -> Law {
    match bank.dimmer {
        Dimmer::Linear => Law::Power(1),
        Dimmer::Square => Law::Power(2),
        curve @ Dimmer::Curve(_) => {
            let level = |i| i as f64 / (LEVELS - 1) as f64;
            let levels: Vec<f64> = (0..LEVELS).map(level).collect();
            Law::Table(timeline::settings(curve, &show.curves, &levels))
        }
    }
}

fn mixers(document: &Document) -> Vec<Mixer> {
    let show = document.show();
    let reds = show.coordinates().into_iter().enumerate();
    let reds = reds.filter(|(_, c)| c.emitter() == Some(0));
    let parameters = show.first_parameters();
    let mixer = |(first, red): (usize, Coordinate)| {
        let index = red.bank?;
        let bank = show.banks.get(index)?;
        Some(Mixer {
            name: bank.name.clone(),
            first,
            law: law(show, bank),
            track: track(document.timeline(), first, *parameters.get(index)?),
        })
    };
    reds.filter_map(mixer).collect()
}

/// Level and colour of an rgb bank over its moves, without points on straight lines between others.
fn track(timeline: &Timeline, red: usize, parameter: usize) -> Vec<[f64; 5]> {
    let mut times = BTreeSet::from([timeline.start(), timeline.end()]);
    for (start, end) in (red..red + 3).flat_map(|c| timeline.moves(c)) {
        let length = *end - *start;
        let steps = ((length.seconds() * STEPS_A_SECOND) as usize).clamp(8, MOST_STEPS);
        times.extend((0..=steps).map(|k| *start + length.scaled(k as f64 / steps as f64)));
        times.extend([*start, *end].map(|at| at - Time::from_micros(1)));
    }
    let mut out: Vec<[f64; 5]> = Vec::new();
    for time in times.range(timeline.start()..=timeline.end()) {
        let levels = timeline.levels(*time);
        let mut point = [time.seconds(); 5];
        for (to, level) in point.iter_mut().skip(1).zip(levels.iter().skip(parameter)) {
            *to = (level * 1e4).round() / 1e4;
        }
        if let [.., a, b] = out.as_slice()
            && straight(a, b, &point)
        {
            out.pop();
        }
        out.push(point);
    }
    out
}

/// True when `b` lies on the line from `a` to `c`.
fn straight(a: &[f64; 5], b: &[f64; 5], c: &[f64; 5]) -> bool {
    let ([from, a @ ..], [at, b @ ..], [to, c @ ..]) = (a, b, c);
    let share = (at - from) / (to - from);
    let mut values = a.iter().zip(b).zip(c);
    values.all(|((a, b), c)| (a + share * (c - a) - b).abs() < 2e-4)
}

fn cues(document: &Document, coordinates: usize) -> Vec<PageCue> {
    let timeline = document.timeline();
    let cues = document.show().cues.iter().zip(timeline.cues());
    let cue = |(cue, time): (&footlight_show::model::Cue, &timeline::CueTime)| PageCue {
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

/// Seconds from a cue's GO to the end of the last of these moves that begins in it.
fn arrival(moves: &[(Time, Time)], cue: &timeline::CueTime) -> Option<f64> {
    let own = moves
        .iter()
        .filter(|(start, _)| (cue.go..=cue.completion).contains(start));
    own.map(|(_, end)| (*end - cue.go).seconds())
        .reduce(f64::max)
}

/// Time and delay of a cue's first fades, and its link, as written: `time 6/9, delay 2, hang 1`.
fn timing(cue: &footlight_show::model::Cue) -> String {
    let mut words = Vec::new();
    if let Some(part) = cue.parts.iter().find(|part| fades(part)) {
        words.push(match up_down(part) {
            snap if snap == "0" => "snap".to_owned(),
            times => format!("time {times}"),
        });
        if part.delay > Time::ZERO {
            words.push(format!("delay {}", time(part.delay)));
        }
    }
    words.extend(cue.link.map(|(_, how)| link(how)));
    words.join(", ")
}
