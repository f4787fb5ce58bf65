//! Files that `run` writes to its folder.

use std::sync::Arc;

use super::curves::{curves, moving};
use super::format::header;
use super::manifest::{PAGE, Results, cue_name, key_name, sheet_name};
use super::rig::{self, RigOrder};
use super::words::{percent, setting};
use super::{Error, page, plan, sheet};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use footlight_engine::plan::PlanReport;
use footlight_engine::playback::Playback;
use footlight_engine::pool::Pool;
use footlight_engine::{self as engine, Engine, SpeedPoint};
use footlight_host::work::{Work, in_order};
use footlight_picture::exr::{self, Precision};
use footlight_picture::shrink::shrink;
use footlight_picture::tone::{self, Tone};
use footlight_picture::{Image, png, signed};
use footlight_show::model::Coordinate;
use footlight_show::timeline::CueTime;
use footlight_show::units::{ErrorUnit, Time, Tolerance};
use footlight_transport::TransportError;
use footlight_transport::contract::check_memory;

/// Errors below this are rounding and cannot be shown on a log axis.
pub const ROUNDING: f64 = 1e-7;

/// Most cues on a contact sheet; a larger show has several sheets.
const CUES: usize = 60;

/// Most columns of an image on a contact sheet.
const TILE: usize = 400;

/// Names of the cues' images, contact sheets and key images of a run.
pub fn names(engine: &Engine, with_keys: bool) -> Vec<String> {
    let cues = &engine.show().cues;
    let keys = if with_keys {
        engine.document().keys().keys().len()
    } else {
        0
    };
    let pictures = cues.iter().map(|cue| cue_name(cue.number));
    let sheets = (0..cues.len().div_ceil(CUES)).map(sheet_name);
    pictures
        .chain(sheets)
        .chain((0..keys).map(key_name))
        .collect()
}

/// Writes all results of a run except key images; returns a description of the page, or the reason
/// for its absence. Cue images and page that are already `written` stay, with their description;
/// otherwise they are made from the `playback`.
pub fn write(
    engine: &Engine,
    report: &PlanReport,
    (playback, tone): (Option<&Arc<Playback>>, Tone),
    written: Option<String>,
    to: &mut Results<'_>,
) -> Result<String, Error> {
    let document = engine.document();
    to.write(engine, "plan.json", plan::json(report)?.as_bytes())?;
    let files = CueFiles {
        pictures: written.is_none(),
        sheets: true,
    };
    write_cues(engine, (playback, tone), files, to)?;
    write_sheets(engine, to)?;
    let curves = curves(document, (&moving(document.show()), &[]), None, Theme::Dark);
    to.write(engine, "curves.png", &curves.png()?)?;
    let tolerance = Tolerance {
        error: report.tolerance,
        unit: report.unit,
    };
    let errors = error_chart(engine, tolerance, Theme::Light)?;
    to.write(engine, "error.png", &errors.png()?)?;
    let held = playback.map_or(0, |playback| playback.image_bytes());
    let channels = channel_sheet(engine, held, Theme::Dark)?;
    to.write(engine, "channels.png", &channels.png()?)?;
    let pool = engine.estimate().pool().ok_or(engine::Error::NotRendered)?;
    if !pool.refined().is_empty() {
        let basis = basis_sheet(engine, pool, Theme::Dark)?;
        to.write(engine, "basis.png", &basis.png()?)?;
    }
    match (written, playback) {
        (Some(page), _) => Ok(page),
        (None, Some(playback)) => write_page(engine, playback, tone, page::HEAD_FRAMES, to),
        (None, None) => Ok(format!("no {PAGE}")),
    }
}

/// Writes the page with `rate` frames a second while heads move; returns its description, or the
/// reason for its absence if its images are too many.
fn write_page(
    engine: &Engine,
    playback: &Arc<Playback>,
    tone: Tone,
    rate: f64,
    to: &mut Results<'_>,
) -> Result<String, Error> {
    let made = match page::page(engine, playback, tone, rate) {
        Ok(made) => made,
        Err(Error::Engine(
            error @ (engine::Error::Picture(_)
            | engine::Error::Render(TransportError::Memory { .. })),
        )) => return Ok(format!("no {PAGE}: {error}")),
        Err(error) => return Err(error),
    };
    to.write(engine, PAGE, made.html.as_bytes())?;
    let smaller = made.smaller();
    Ok(format!("{PAGE} plays the show in a browser{smaller}"))
}

/// Writes cue images and page from the current images, and returns their tone and the description
/// of the page; `None` without a page, which later steps report, and with heads, whose first page has
/// few frames a second.
pub fn write_first(
    engine: &mut Engine,
    to: &mut Results<'_>,
) -> Result<Option<(Tone, String)>, Error> {
    let playback = engine.playback()?;
    let tone = engine.tone()?;
    let files = CueFiles {
        pictures: true,
        sheets: false,
    };
    write_cues(engine, (Some(&playback), tone), files, to)?;
    let page = write_page(engine, &playback, tone, page::FIRST_HEAD_FRAMES, to)?;
    let is_final = to.has(PAGE) && playback.heads().is_none();
    Ok(is_final.then_some((tone, page)))
}

/// Files to write for each cue.
#[derive(Clone, Copy)]
struct CueFiles {
    /// One image each.
    pictures: bool,
    /// Contact sheets.
    sheets: bool,
}

/// Writes every cue at its completion.
fn write_cues(
    engine: &Engine,
    (playback, tone): (Option<&Arc<Playback>>, Tone),
    files: CueFiles,
    to: &mut Results<'_>,
) -> Result<(), Error> {
    let host = engine.host();
    let (show, timeline) = (engine.show(), engine.document().timeline());
    let pool = engine.estimate().pool().ok_or(engine::Error::NotRendered)?;
    let (width, height) = pool.size();
    let heads = engine.heads();
    let light_at = |time: Time| -> Result<Image, engine::Error> {
        let Some(playback) = playback else {
            let (setting, poses) = (timeline.evaluate(time), timeline.poses(time));
            return engine::frame((pool, heads.as_ref()), &setting, &poses, Work::silent());
        };
        Ok(playback.frame(time))
    };
    let small = if width > TILE {
        (TILE, (height * TILE).div_ceil(width))
    } else {
        (width, height)
    };
    let made = |time: &&CueTime| -> Result<_, engine::Error> {
        let light = light_at(time.completion)?;
        let tile = || tone.encode(&shrink(&light, small.0, small.1));
        let file = || png::encode(width, height, &tone.encode(&light));
        let file = files.pictures.then(file).transpose()?;
        Ok((file, files.sheets.then(tile)))
    };
    let mut tiles = Vec::new();
    let (mut done, total) = (0, show.cues.len());
    let times: Vec<&CueTime> = timeline.cues().iter().collect();
    let threads = engine.work().threads.max(1);
    let made = times
        .chunks(threads)
        .flat_map(|together| in_order(together, threads, made));
    for ((cue, time), made) in show.cues.iter().zip(&times).zip(made) {
        host.work().check()?;
        let (file, tile) = made?;
        if let Some(bytes) = file {
            to.write(engine, &cue_name(cue.number), &bytes)?;
        }
        tiles.extend(tile.map(|rgb| chart::Tile {
            size: small,
            rgb,
            caption: format!(
                "{} {} {}",
                cue.number,
                sheet::clock(time.completion.rounded()),
                cue.label
            ),
        }));
        done += 1;
        if tiles.len() == CUES || files.sheets && done == total {
            let name = sheet_name((done - 1) / CUES);
            let sheet = contact_sheet(engine, std::mem::take(&mut tiles))?;
            to.write(engine, &name, &sheet.magnified(2.0).png()?)?;
        }
        host.progress.report("writing cues", done, total);
    }
    Ok(())
}

fn contact_sheet(engine: &Engine, tiles: Vec<chart::Tile>) -> Result<Drawing, Error> {
    let sheet = chart::Sheet {
        title: format!("{}: each cue when it is complete", engine.show().title),
        tiles,
        columns: None,
        legend: String::new(),
    };
    Ok(chart::sheet(&sheet, Theme::Dark)?)
}

/// Writes cue sheet, track sheet, and the rig's tables and plot.
fn write_sheets(engine: &Engine, to: &mut Results<'_>) -> Result<(), Error> {
    let document = engine.document();
    let cues = sheet::cue_sheet(document.show(), document.timeline());
    to.write(engine, "cue-sheet.csv", cues.csv().as_bytes())?;
    let tracks = sheet::track_sheet(document.show(), engine.host().work());
    check_memory("the track sheet", tracks.bytes(), engine.work().memory)
        .map_err(engine::Error::from)?;
    let tracks = tracks.words().map_err(engine::Error::from)?;
    to.write(engine, "track-sheet.csv", tracks.csv().as_bytes())?;
    for (name, order) in [
        ("hookup.csv", RigOrder::Channel),
        ("schedule.csv", RigOrder::Place),
    ] {
        let lights = rig::table(document, order);
        to.write(engine, name, lights.csv().as_bytes())?;
    }
    let (plot, _) = rig::plot(document, Theme::Light);
    to.write(engine, "rig.svg", plot.svg().as_bytes())
}

/// Writes key images as linear EXR, one file each, with the setting in the header.
pub fn write_keys(engine: &Engine, playback: &Playback, to: &mut Results<'_>) -> Result<(), Error> {
    let host = engine.host();
    let keys = engine.document().keys().keys();
    let total = keys.len();
    for (i, key) in keys.iter().enumerate() {
        host.work().check()?;
        let about = [header("settings", &setting(engine.show(), key))];
        let bytes = exr::encode(&playback.key_image(i), Precision::Half, &about)?;
        to.write(engine, &key_name(i), &bytes)?;
        host.progress.report("writing keys", i + 1, total);
    }
    Ok(())
}

/// Chart of error against seconds, with a forecast for more seconds. Logarithmic on both axes.
pub fn error_chart(engine: &Engine, tolerance: Tolerance, theme: Theme) -> Result<Drawing, Error> {
    let found = engine.estimate().speed_accuracy()?;
    let place = |point: &SpeedPoint| (point.seconds, shown(point.error));
    let series = |name: &str, marker, points: &[SpeedPoint], labels: Vec<String>| Series {
        name: name.to_owned(),
        points: points.iter().map(place).collect(),
        marker,
        labels,
    };
    let mut all = Vec::new();
    if found.mixtures.len() > 1 {
        let name = "coarse pictures, then mixtures in the order of the plan: predicted";
        all.push(series(name, Marker::None, &found.mixtures, Vec::new()));
    }
    let quality = |point: &SpeedPoint| format!("quality {}", point.quality);
    let (measured, predicted): (Vec<SpeedPoint>, Vec<SpeedPoint>) = found
        .alone
        .iter()
        .partition(|point| point.measured.is_some());
    // One series each, so that no line joins them.
    for point in &measured {
        let name = "every bank at one quality: measured, with what it lies between";
        let [least, most] = point.measured.unwrap_or_default();
        // A lower end near 0 would stretch the axis.
        let ends = [least.max(most / 30.0), most].map(|error| SpeedPoint { error, ..*point });
        all.push(series(name, Marker::None, &ends, Vec::new()));
        let labels = vec![quality(point)];
        all.push(series(name, Marker::Circle, &[*point], labels));
    }
    if !predicted.is_empty() {
        let names = predicted.iter().map(quality).collect();
        let name = "every bank at one quality: predicted";
        all.push(series(name, Marker::Ring, &predicted, names));
    }
    // A tolerance in displayed steps does not fit errors of light.
    let wanted = (tolerance.unit == ErrorUnit::Light).then_some(tolerance.error);
    let panel = Panel {
        title: String::new(),
        x: Axis::new("seconds of rendering", Scale::Log),
        y: Axis::new("error at the worst moment, % of its light", Scale::Log),
        series: all,
        reference: wanted.map(|error| {
            let words = format!("asked for: {} %", percent(error));
            (error * 100.0, words)
        }),
    };
    let title = format!("{}: what more seconds would buy", engine.show().title);
    Ok(chart::panels(&title, &[panel], theme))
}

/// An error in percent; the remainder after everything is refined is rounding and not shown.
fn shown(error: f64) -> f64 {
    if error > ROUNDING {
        error * 100.0
    } else {
        f64::NAN
    }
}

/// The refined mixtures, signed: light amber, negative light blue.
pub fn basis_sheet(engine: &Engine, pool: &Pool, theme: Theme) -> Result<Drawing, Error> {
    let images: Vec<&Image> = pool.refined().iter().map(|r| r.image.as_ref()).collect();
    let caption = |i: usize| {
        let step = engine.estimate().steps().get(i);
        let error = step.map(|s| format!(", then {} %", percent(s.error)));
        format!("{i}{}", error.unwrap_or_default())
    };
    let captions = (1..=images.len()).map(caption).collect();
    let words = (
        "basis pictures, and the error that each leaves",
        "amber: light added; blue: negative light; each picture scaled by itself",
    );
    let encode = |image: &Image| signed::encode(image, signed::scale(image));
    image_sheet(engine, words, (&images, captions), encode, theme)
}

/// Each bank alone, at full, with its channel; `held` bytes of the caller count against the memory.
pub fn channel_sheet(engine: &Engine, held: usize, theme: Theme) -> Result<Drawing, Error> {
    let pool = engine.estimate().pool().ok_or(engine::Error::NotRendered)?;
    // Images of the pool lack the direct light of heads.
    let made = match engine.heads() {
        Some(_) => engine.bank_images(held)?,
        None => Vec::new(),
    };
    let images: Vec<&Image> = match made.as_slice() {
        [] => pool.coarse().iter().map(AsRef::as_ref).collect(),
        made => made.iter().collect(),
    };
    let show = engine.show();
    let caption = |coordinate: Coordinate| {
        let bank = coordinate.bank.and_then(|bank| show.banks.get(bank));
        let channel = bank.and_then(|bank| bank.channel);
        let channel = channel.map_or(String::new(), |channel| format!("{channel}  "));
        format!("{channel}{}", coordinate.name)
    };
    let captions = show.coordinates().into_iter().map(caption).collect();
    let words = (
        "each bank alone",
        "each picture at an exposure that suits it",
    );
    let document = engine.document();
    let encode = |image: &Image| {
        let exposure = tone::auto_exposure(std::iter::once(image));
        document.tone_at(exposure).encode(image)
    };
    image_sheet(engine, words, (&images, captions), encode, theme)
}

fn image_sheet(
    engine: &Engine,
    (title, legend): (&str, &str),
    (images, captions): (&[&Image], Vec<String>),
    encode: impl Fn(&Image) -> Vec<u8> + Sync,
    theme: Theme,
) -> Result<Drawing, Error> {
    let shown = in_order(images, engine.work().threads, |image| {
        (encode(image), image.size())
    });
    let tile = |((rgb, size), caption)| chart::Tile { size, rgb, caption };
    let sheet = chart::Sheet {
        title: format!("{}: {title}", engine.show().title),
        tiles: shown.into_iter().zip(captions).map(tile).collect(),
        columns: None,
        legend: legend.to_owned(),
    };
    Ok(chart::sheet(&sheet, theme)?)
}
