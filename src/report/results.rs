//! What `run` leaves in its folder.

use std::sync::Arc;

use super::curves::{curves, moving};
use super::format::header;
use super::manifest::{Results, cue_name, key_name, sheet_name};
use super::words::{percent, setting};
use super::{Error, page, plan, sheet};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use footlight_engine::plan::PlanReport;
use footlight_engine::playback::Playback;
use footlight_engine::{self as engine, Engine, ManyKeys, Step};
use footlight_host::work::{Work, in_order};
use footlight_picture::exr::{self, Precision};
use footlight_picture::shrink::shrink;
use footlight_picture::tone::Tone;
use footlight_picture::{Image, png, signed};
use footlight_show::timeline::CueTime;
use footlight_show::units::{ErrorUnit, Time, Tolerance};
use footlight_transport::TransportError;
use footlight_transport::contract::check_memory;

/// Errors below this are rounding; they have no place on a log axis.
pub const ROUNDING: f64 = 1e-7;

/// What is ahead is drawn down to this share of the tolerance: further down is of no use.
const FAR: f64 = 0.01;

/// Cues of a contact sheet; a show of more has several.
const CUES: usize = 60;

/// Pixels a row of a picture on a contact sheet, at most.
const TILE: usize = 400;

/// What a run leaves beside its charts, sheets and page: their names.
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

/// Writes everything that a run leaves behind in a tone; what could not be made, and why. Without a
/// `playback` all is written that needs no key images.
pub fn write(
    engine: &Engine,
    report: &PlanReport,
    (playback, tone): (Option<&Arc<Playback>>, Tone),
    with_keys: bool,
    to: &mut Results<'_>,
) -> Result<Option<String>, Error> {
    let document = engine.document();
    to.write(engine, "plan.json", plan::json(report)?.as_bytes())?;
    write_cues(engine, (playback, tone), to)?;
    write_sheets(engine, to)?;
    if let Some(playback) = playback.filter(|_| with_keys) {
        write_keys(engine, playback, to)?;
    }
    let curves = curves(document, &moving(document.show()), None, Theme::Dark);
    to.write(engine, "curves.png", &curves.png()?)?;
    let tolerance = Tolerance {
        error: report.tolerance,
        unit: report.unit,
    };
    let errors = error_chart(engine, tolerance, Theme::Light)?;
    to.write(engine, "error.png", &errors.png()?)?;
    if let Some(sheet) = basis_sheet(engine, Theme::Dark)? {
        to.write(engine, "basis.png", &sheet.png()?)?;
    }
    let Some(playback) = playback else {
        let many =
            ManyKeys::of(engine.document(), engine.host().memory).map(engine::Error::KeyImages);
        return Ok(many.map(|error| format!("no show.html: {}", error)));
    };
    match page::page(engine, playback, tone) {
        Ok((page, _)) => to.write(engine, "show.html", page.as_bytes())?,
        // Its pictures can be too many for a page: all else is there.
        Err(Error::Engine(
            error @ (engine::Error::Picture(_)
            | engine::Error::Render(TransportError::Memory { .. })),
        )) => return Ok(Some(format!("no show.html: {error}"))),
        Err(error) => return Err(error),
    }
    Ok(None)
}

/// Every cue as it is complete: a picture each, and all on contact sheets.
fn write_cues(
    engine: &Engine,
    (playback, tone): (Option<&Arc<Playback>>, Tone),
    to: &mut Results<'_>,
) -> Result<(), Error> {
    let host = engine.host();
    let (show, timeline) = (engine.show(), engine.document().timeline());
    let pool = engine.estimate().pool().ok_or(engine::Error::NotRendered)?;
    let (width, height) = pool.size();
    // Each key is shown once at most: coding them for playback would cost more than it saves.
    let player = playback.map(|playback| super::film::exact(engine, playback, tone));
    let player = player.transpose()?;
    let light_at = |time: Time| -> Result<Image, engine::Error> {
        let Some(player) = &player else {
            return Ok(pool.preview(&timeline.evaluate(time), Work::silent())?);
        };
        let mut light = Image::new(width, height);
        player.light(time, &mut light);
        Ok(light)
    };
    let small = if width > TILE {
        (TILE, (height * TILE).div_ceil(width))
    } else {
        (width, height)
    };
    let made = |time: &&CueTime| -> Result<_, engine::Error> {
        let light = light_at(time.completion)?;
        let tile = tone.encode(&shrink(&light, small.0, small.1));
        Ok((png::encode(width, height, &tone.encode(&light))?, tile))
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
        let (bytes, rgb) = made?;
        to.write(engine, &cue_name(cue.number), &bytes)?;
        tiles.push(chart::Tile {
            size: small,
            rgb,
            caption: format!(
                "{} {} {}",
                cue.number,
                sheet::clock(time.completion.rounded()),
                cue.label
            ),
        });
        done += 1;
        if tiles.len() == CUES || done == total {
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

/// Cue sheet and track sheet.
fn write_sheets(engine: &Engine, to: &mut Results<'_>) -> Result<(), Error> {
    let document = engine.document();
    let cues = sheet::cue_sheet(document.show(), document.timeline());
    to.write(engine, "cue-sheet.csv", cues.csv().as_bytes())?;
    let tracks = sheet::track_sheet(document.show(), engine.host().work());
    check_memory("the track sheet", tracks.bytes(), engine.work().memory)
        .map_err(engine::Error::from)?;
    let tracks = tracks.words().map_err(engine::Error::from)?;
    to.write(engine, "track-sheet.csv", tracks.csv().as_bytes())
}

/// Key images as linear EXR, one file each, with the setting in the header.
fn write_keys(engine: &Engine, playback: &Playback, to: &mut Results<'_>) -> Result<(), Error> {
    let host = engine.host();
    let total = playback.images().len();
    let keys = engine.document().keys().keys();
    for (i, (image, key)) in playback.images().iter().zip(keys).enumerate() {
        host.work().check()?;
        let about = [header("settings", &setting(engine.show(), key))];
        let bytes = exr::encode(image, Precision::Half, &about)?;
        to.write(engine, &key_name(i), &bytes)?;
        host.progress.report("writing keys", i + 1, total);
    }
    Ok(())
}

/// Predicted error against refined pictures and against seconds, so far and as it would go on.
pub fn error_chart(engine: &Engine, tolerance: Tolerance, theme: Theme) -> Result<Drawing, Error> {
    // A tolerance as displayed has no place among errors of light.
    let wanted = (tolerance.unit == ErrorUnit::Light).then_some(tolerance.error);
    let ahead = onward(engine)?;
    let steps = engine.estimate().steps();
    let mut known = Vec::with_capacity(steps.len());
    for step in steps {
        known.push((step, engine.estimate().error_of(step.forecast)?));
    }
    // What is left when everything is refined is rounding; it has no place on a log axis.
    let shown = |error: f64| {
        if error > ROUNDING {
            error * 100.0
        } else {
            f64::NAN
        }
    };
    let series = |name: &str, marker, x: &dyn Fn(&Step) -> f64, y: &dyn Fn(&Step) -> f64| Series {
        name: name.to_owned(),
        points: steps.iter().map(|s| (x(s), shown(y(s)))).collect(),
        marker,
        labels: Vec::new(),
    };
    let panel = |title: &str, x: &str, scale, of: &dyn Fn(&Step) -> f64| Panel {
        title: title.to_owned(),
        x: Axis::new(x, scale),
        y: Axis::new("error of the sequence, %", Scale::Log),
        series: vec![
            series("predicted at the time", Marker::Circle, of, &|s| s.error),
            Series {
                name: "as known at the end".to_owned(),
                points: known
                    .iter()
                    .map(|(s, error)| (of(s), shown(*error)))
                    .collect(),
                marker: Marker::Square,
                labels: Vec::new(),
            },
            Series {
                name: "if it went on".to_owned(),
                points: (ahead
                    .iter()
                    .filter(|s| s.error > FAR * wanted.unwrap_or(0.0)))
                .map(|s| (of(s), shown(s.error)))
                .collect(),
                marker: Marker::Triangle,
                labels: Vec::new(),
            },
        ],
        reference: wanted.map(|error| {
            let words = format!("asked for: {} %", percent(error));
            (error * 100.0, words)
        }),
    };
    Ok(chart::panels(
        &format!(
            "{}: error of the sequence, as predicted",
            engine.show().title
        ),
        &[
            panel(
                "by refined pictures",
                "refined pictures",
                Scale::Whole,
                &|s| s.refined as f64,
            ),
            panel("by computing time", "seconds", Scale::Linear, &|s| {
                s.seconds
            }),
        ],
        theme,
    ))
}

/// The sequence as it stands and after each picture that is left to refine, predicted; nothing
/// where none is left.
fn onward(engine: &Engine) -> Result<Vec<Step>, Error> {
    let forecast = engine.estimate().forecast()?;
    let Some(now) = engine
        .estimate()
        .steps()
        .last()
        .filter(|_| !forecast.steps.is_empty())
    else {
        return Ok(Vec::new());
    };
    let mut out = vec![Step {
        error: forecast.error,
        ..*now
    }];
    let (mut refined, mut seconds) = (now.refined, now.seconds);
    for ahead in forecast.steps {
        refined += 1;
        seconds += ahead.seconds;
        out.push(Step {
            refined,
            seconds,
            error: ahead.error,
            forecast: ahead.error,
        });
    }
    Ok(out)
}

/// The refined pictures, signed: light amber, negative light blue.
pub fn basis_sheet(engine: &Engine, theme: Theme) -> Result<Option<Drawing>, Error> {
    let Some(pool) = engine.estimate().pool() else {
        return Ok(None);
    };
    let mut title = "basis pictures, and the error that each leaves";
    let mut images: Vec<&Image> = pool.refined().iter().map(|r| r.image.as_ref()).collect();
    let mut captions = Vec::new();
    for i in 1..=images.len() {
        let step = engine.estimate().steps().get(i);
        let error = step.map(|s| format!(", then {} %", percent(s.error)));
        captions.push(format!("{i}{}", error.unwrap_or_default()));
    }
    if images.is_empty() {
        title = "each bank alone, coarse: nothing is refined yet";
        images = pool.coarse().iter().map(AsRef::as_ref).collect();
        captions = (engine.show().coordinates().into_iter())
            .map(|c| c.name)
            .collect();
    }
    let shown = in_order(&images, engine.work().threads, |image| {
        signed::encode(image, signed::scale(image))
    });
    let tile = |(rgb, caption)| chart::Tile {
        size: pool.size(),
        rgb,
        caption,
    };
    let tiles = shown.into_iter().zip(captions).map(tile).collect();
    let sheet = chart::Sheet {
        title: format!("{}: {title}", engine.show().title),
        tiles,
        columns: None,
        legend: "amber: light added; blue: negative light; each picture scaled by itself"
            .to_owned(),
    };
    Ok(Some(chart::sheet(&sheet, theme)?))
}
