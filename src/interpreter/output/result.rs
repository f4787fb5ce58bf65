//! What `run` leaves in its folder.

use std::path::Path;

use super::{Animation, described};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use crate::interpreter::answer::{json, percent};
use crate::interpreter::{Error, Interpreter, Step};
use crate::picture::exr::{self, Precision};
use crate::picture::signed;
use crate::plan::PlanReport;
use crate::playback::Playback;
use crate::playback::key::Format;

/// Errors below this are rounding.
const ROUNDING: f64 = 1e-7;

impl Interpreter {
    /// Writes everything that `run` leaves behind, and measures playback on the way.
    pub(in crate::interpreter) fn write_results(
        &self,
        plan: &PlanReport,
        playback: &Playback,
        folder: &Path,
    ) -> Result<(Animation, f64, Format), Error> {
        let store = &self.host.store;
        store.write(&folder.join("plan.json"), json(plan)?.as_bytes())?;
        self.write_keys(playback, &folder.join("keys"))?;
        store.write(&folder.join("curves.png"), &self.curves(None).png()?)?;
        store.write(
            &folder.join("error.png"),
            &self.error_chart(plan.tolerance).png()?,
        )?;
        if let Some(sheet) = self.basis_sheet(plan)? {
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

    /// Predicted error against refined pictures and against seconds.
    fn error_chart(&self, tolerance: f64) -> Drawing {
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
            ],
            reference: Some((
                tolerance * 100.0,
                format!("asked for: {} %", percent(tolerance)),
            )),
        };
        chart::panels(
            &format!("{}: error of the sequence", self.show().title),
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
            Theme::Light,
        )
    }

    /// The refined pictures, signed: light amber, negative light blue.
    fn basis_sheet(&self, plan: &PlanReport) -> Result<Option<Drawing>, Error> {
        let Some(pool) = self.pool() else {
            return Ok(None);
        };
        let mut tiles = Vec::new();
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
            for (i, image) in pool.coarse().iter().enumerate() {
                tiles.push(chart::Tile {
                    size: pool.size(),
                    rgb: signed::encode(image, signed::scale(image)),
                    caption: plan.coordinates.get(i).cloned().unwrap_or_default(),
                });
            }
        }
        let sheet = chart::Sheet {
            title: format!(
                "{}: basis pictures, and the error that each leaves",
                self.show().title
            ),
            tiles,
            columns: None,
            legend: "amber: light added; blue: negative light; each picture scaled by itself"
                .to_owned(),
        };
        Ok(Some(chart::sheet(&sheet, Theme::Dark)?))
    }
}
