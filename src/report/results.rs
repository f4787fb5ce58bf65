//! What `run` leaves in its folder.

use super::curves::{curves, moving};
use super::film::{Animation, animate};
use super::format::header;
use super::manifest::{Results, key_name};
use super::words::{percent, setting};
use super::{Error, plan};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use crate::engine::{Engine, Step};
use crate::picture::exr::{self, Precision};
use crate::picture::signed;
use crate::plan::PlanReport;
use crate::playback::Playback;
use crate::playback::key::Format;

/// Errors below this are rounding; they have no place on a log axis.
pub const ROUNDING: f64 = 1e-7;

/// What is ahead is drawn down to this share of the tolerance: further down is of no use.
const FAR: f64 = 0.01;

/// How playback did: how the animation was fitted, frames a second, and the format of keys.
pub type Played = (Animation, f64, Format);

/// Writes everything that a run leaves behind, and measures playback on the way.
pub fn write(
    engine: &Engine,
    report: &PlanReport,
    playback: &std::sync::Arc<Playback>,
    to: &mut Results<'_>,
) -> Result<Played, Error> {
    let document = engine.document();
    to.write(engine, "plan.json", plan::json(report)?.as_bytes())?;
    write_keys(engine, playback, to)?;
    let curves = curves(document, &moving(document.show()), None, Theme::Dark);
    to.write(engine, "curves.png", &curves.png()?)?;
    let errors = error_chart(engine, report.tolerance, Theme::Light)?;
    to.write(engine, "error.png", &errors.png()?)?;
    if let Some(sheet) = basis_sheet(engine, Theme::Dark)? {
        to.write(engine, "basis.png", &sheet.png()?)?;
    }
    let tone = engine.tone_of(playback.images());
    let player = engine.player_of(playback, tone, None)?;
    let rate = engine.frame_rate(&player);
    let (bytes, animation) = animate(engine, &player)?;
    to.write(engine, "sequence.png", &bytes)?;
    Ok((animation, rate, player.format()))
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
pub fn error_chart(engine: &Engine, tolerance: f64, theme: Theme) -> Result<Drawing, Error> {
    let ahead = onward(engine)?;
    let steps = engine.steps();
    let calibration = engine.calibration();
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
            series("as known at the end", Marker::Square, of, &|s| {
                s.forecast * calibration
            }),
            Series {
                name: "if it went on".to_owned(),
                points: (ahead.iter().filter(|s| s.error > FAR * tolerance))
                    .map(|s| (of(s), shown(s.error)))
                    .collect(),
                marker: Marker::Triangle,
                labels: Vec::new(),
            },
        ],
        reference: Some((
            tolerance * 100.0,
            format!("asked for: {} %", percent(tolerance)),
        )),
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
    let forecast = engine.forecast()?;
    let Some(now) = engine.steps().last().filter(|_| !forecast.steps.is_empty()) else {
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
    let Some(pool) = engine.pool() else {
        return Ok(None);
    };
    let mut tiles = Vec::new();
    let mut title = "basis pictures, and the error that each leaves";
    for (i, refined) in pool.refined().iter().enumerate() {
        let error = engine
            .steps()
            .get(i + 1)
            .map_or(String::new(), |s| format!(", then {} %", percent(s.error)));
        tiles.push(chart::Tile {
            size: pool.size(),
            rgb: signed::encode(&refined.image, signed::scale(&refined.image)),
            caption: format!("{}{error}", i + 1),
        });
    }
    if tiles.is_empty() {
        title = "each bank alone, coarse: nothing is refined yet";
        let names = engine.show().coordinates().into_iter().map(|c| c.name);
        for (image, caption) in pool.coarse().iter().zip(names) {
            tiles.push(chart::Tile {
                size: pool.size(),
                rgb: signed::encode(image, signed::scale(image)),
                caption,
            });
        }
    }
    let sheet = chart::Sheet {
        title: format!("{}: {title}", engine.show().title),
        tiles,
        columns: None,
        legend: "amber: light added; blue: negative light; each picture scaled by itself"
            .to_owned(),
    };
    Ok(Some(chart::sheet(&sheet, theme)?))
}
