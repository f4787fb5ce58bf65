//! What `run` leaves in its folder.

use std::path::Path;

use super::{Animation, described};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use crate::interpreter::answer::percent;
use crate::interpreter::{Error, Interpreter, Step, json};
use crate::picture::exr::{self, Precision};
use crate::picture::signed;
use crate::plan::PlanReport;
use crate::playback::Playback;
use crate::playback::key::Format;
use crate::report;

/// Errors below this are rounding; they have no place on a log axis.
pub(super) const ROUNDING: f64 = 1e-7;

/// What is ahead is drawn down to this share of the tolerance: further down nobody goes.
const FAR: f64 = 0.01;

impl Interpreter {
    /// Writes everything that `run` leaves behind, and measures playback on the way.
    pub(in crate::interpreter) fn write_results(
        &self,
        plan: &PlanReport,
        playback: &Playback,
        folder: &Path,
    ) -> Result<(Animation, f64, Format), Error> {
        let store = &self.host.store;
        store.write(
            &folder.join("plan.json"),
            json(&report::plan::form(plan))?.as_bytes(),
        )?;
        self.write_keys(playback, &folder.join("keys"))?;
        store.write(
            &folder.join("curves.png"),
            &self.curves(&self.moving(), None, Theme::Dark).png()?,
        )?;
        store.write(
            &folder.join("error.png"),
            &self.error_chart(plan.tolerance, Theme::Light)?.png()?,
        )?;
        if let Some(sheet) = self.basis_sheet(Theme::Dark)? {
            store.write(&folder.join("basis.png"), &sheet.png()?)?;
        }
        let tone = self.tone(playback.images());
        let player = self.player(playback, tone, None)?;
        let rate = self.frame_rate(&player);
        let (bytes, told) = self.animate(&player)?;
        store.write(&folder.join("sequence.png"), &bytes)?;
        Ok((told, rate, player.format()))
    }

    /// Key images as linear EXR, one file each, with the setting in the header; keys of an earlier
    /// run are removed first.
    fn write_keys(&self, playback: &Playback, folder: &Path) -> Result<(), Error> {
        self.host.store.clear(folder, ".exr")?;
        let total = playback.images().len();
        for (i, (image, key)) in playback.images().iter().zip(self.keys().keys()).enumerate() {
            self.host.work().check()?;
            let header = [described("settings", &self.setting_in_words(key))];
            let bytes = exr::encode(image, Precision::Half, &header)?;
            self.host
                .store
                .write(&folder.join(format!("key{:03}.exr", i + 1)), &bytes)?;
            self.host.progress.report("writing keys", i + 1, total);
        }
        Ok(())
    }

    /// Predicted error against refined pictures and against seconds, so far and as it would go on.
    pub(super) fn error_chart(&self, tolerance: f64, theme: Theme) -> Result<Drawing, Error> {
        let ahead = self.onward()?;
        let steps = self.steps();
        let calibration = self.calibration();
        // What is left when everything is refined is rounding; it has no place on a log axis.
        let shown = |error: f64| {
            if error > ROUNDING {
                error * 100.0
            } else {
                f64::NAN
            }
        };
        let series =
            |name: &str, marker, x: &dyn Fn(&Step) -> f64, y: &dyn Fn(&Step) -> f64| Series {
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
            &format!("{}: error of the sequence, as predicted", self.show().title),
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
    fn onward(&self) -> Result<Vec<Step>, Error> {
        let outlook = self.outlook()?;
        let Some(now) = self.steps().last().filter(|_| !outlook.steps.is_empty()) else {
            return Ok(Vec::new());
        };
        let mut out = vec![Step {
            error: outlook.error,
            ..*now
        }];
        let (mut refined, mut seconds) = (now.refined, now.seconds);
        for ahead in outlook.steps {
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
    pub(super) fn basis_sheet(&self, theme: Theme) -> Result<Option<Drawing>, Error> {
        let Some(pool) = self.pool() else {
            return Ok(None);
        };
        let mut tiles = Vec::new();
        let mut title = "basis pictures, and the error that each leaves";
        for (i, refined) in pool.refined().iter().enumerate() {
            let error = self
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
            let names = self.show().coordinates().into_iter().map(|c| c.name);
            for (image, caption) in pool.coarse().iter().zip(names) {
                tiles.push(chart::Tile {
                    size: pool.size(),
                    rgb: signed::encode(image, signed::scale(image)),
                    caption,
                });
            }
        }
        let sheet = chart::Sheet {
            title: format!("{}: {title}", self.show().title),
            tiles,
            columns: None,
            legend: "amber: light added; blue: negative light; each picture scaled by itself"
                .to_owned(),
        };
        Ok(Some(chart::sheet(&sheet, theme)?))
    }
}
