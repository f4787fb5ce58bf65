//! What leaves the interpreter as files: pictures, curves, keys, the sequence.

use std::path::Path;

use super::answer::{count, percent};
use super::{Call, Error, Interpreter, Reply, Shown, Step};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use crate::picture::apng::{self, Limits};
use crate::picture::exr::{self, Precision};
use crate::picture::tone::{self, Curve, Tone};
use crate::picture::{Image, png, signed};
use crate::plan::PlanReport;
use crate::playback::Playback;
use crate::show::Coordinate;
use crate::timeline::Timeline;
use crate::transport::Quality;
use crate::units::Time;

/// Points drawn of each second of a curve, beside its knots.
const POINTS_A_SECOND: f64 = 8.0;

/// Errors below this are rounding.
const ROUNDING: f64 = 1e-7;

/// Most points drawn of a curve.
const MOST_POINTS: f64 = 2000.0;

/// How the sequence was fitted into an animated picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// Frames in the file; a still stretch is one.
    pub frames: usize,
    /// Frames a second where something moves.
    pub rate: f64,
    /// Frames a second that the show asked for.
    pub asked: f64,
    /// Size of the file.
    pub bytes: usize,
}

impl Animation {
    /// In words.
    pub fn describe(&self) -> String {
        let size = self.bytes as f64 / 1e6;
        let frames = count(self.frames, "frame");
        if self.rate < self.asked {
            let (rate, asked) = (self.rate, self.asked);
            return format!("{frames}, {size:.1} MB, {rate:.2} frames/s to fit (asked: {asked})");
        }
        format!("{frames}, {size:.1} MB, {} frames/s", self.rate)
    }
}

impl Interpreter {
    /// Writes everything that `run` leaves behind, and measures playback on the way.
    pub(super) fn write_results(
        &self,
        plan: &PlanReport,
        playback: &Playback,
        folder: &Path,
    ) -> Result<(Animation, f64), Error> {
        let store = &self.host.store;
        store.write(
            &folder.join("plan.json"),
            super::answer::json(plan)?.as_bytes(),
        )?;
        self.write_keys(playback, &folder.join("keys"))?;
        store.write(&folder.join("curves.png"), &self.curves(None).png()?)?;
        store.write(
            &folder.join("error.png"),
            &self.error_chart(plan.tolerance).png()?,
        )?;
        if let Some(sheet) = self.basis_sheet(plan)? {
            store.write(&folder.join("basis.png"), &sheet.png()?)?;
        }
        let rate = self.frame_rate(playback);
        let tone = self.tone(playback.images());
        let (bytes, told) = self.animate(playback, tone)?;
        store.write(&folder.join("sequence.png"), &bytes)?;
        Ok((told, rate))
    }

    /// Key images as linear EXR, one file each, with the setting in the header; keys of an earlier
    /// run are removed first.
    fn write_keys(&self, playback: &Playback, folder: &Path) -> Result<(), Error> {
        self.host.store.clear(folder, ".exr")?;
        let names: Vec<String> = self
            .show()
            .coordinates()
            .into_iter()
            .map(|c| c.name)
            .collect();
        let total = playback.images().len();
        for (i, (image, key)) in playback.images().iter().zip(self.keys().keys()).enumerate() {
            self.host.work().check()?;
            let settings: Vec<String> = names
                .iter()
                .zip(key)
                .map(|(n, s)| format!("{n} {s}"))
                .collect();
            let header = [("settings".to_owned(), settings.join(", "))];
            let bytes = exr::encode(image, Precision::Half, &header)?;
            self.host
                .store
                .write(&folder.join(format!("key{:03}.exr", i + 1)), &bytes)?;
            self.host.progress.report("writing keys", i + 1, total);
        }
        Ok(())
    }

    /// One exposure for the whole sequence: the show's own, or from all key images.
    pub(super) fn tone(&self, images: &[Image]) -> Tone {
        let exposure = self.show().preview.exposure;
        Tone {
            exposure: exposure.unwrap_or_else(|| tone::auto_exposure(images.iter())),
            curve: Curve::Filmic,
        }
    }

    /// Frames a second that playback alone reaches, measured over about a second.
    fn frame_rate(&self, playback: &Playback) -> f64 {
        let (start, end) = (self.timeline().start(), self.timeline().end());
        let mut frame = Image::new(0, 0);
        let begin = self.host.clock.seconds();
        let mut frames = 0;
        loop {
            // A stride that is no simple fraction visits all kinds of segments.
            let at = (f64::from(frames) * 0.618_033_988_75).fract();
            playback.frame(start + (end - start).scaled(at), &mut frame);
            frames += 1;
            let passed = self.host.clock.seconds() - begin;
            if passed > 0.5 || frames >= 500 {
                return f64::from(frames) / passed.max(1e-9);
            }
        }
    }

    /// The sequence as an animated PNG, and how it was fitted.
    fn animate(&self, playback: &Playback, tone: Tone) -> Result<(Vec<u8>, Animation), Error> {
        let (start, length) = (self.timeline().start(), self.keys().duration());
        let still: Vec<(f64, f64)> = self
            .keys()
            .segments()
            .iter()
            .filter(|s| s.degree == 0)
            .map(|s| (s.start() - start.seconds(), s.end() - start.seconds()))
            .collect();
        let mut image = Image::new(0, 0);
        let mut drawn = 0;
        let expected = Limits::default().frames;
        let mut frame = |seconds: f64| {
            let time = start + Time::from_seconds(seconds).unwrap_or_default();
            playback.frame(time, &mut image);
            drawn += 1;
            self.host
                .progress
                .report("sequence", drawn.min(expected), expected);
            tone.encode(&image)
        };
        let asked = self.show().preview.rate;
        let limits = Limits::default();
        let made = apng::animate(playback.size(), length, asked, &still, &mut frame, limits)?;
        let told = Animation {
            frames: made.frames,
            rate: made.rate,
            asked,
            bytes: made.bytes.len(),
        };
        Ok((made.bytes, told))
    }

    /// Every bank's level over time, cues marked.
    pub(super) fn curves(&self, playhead: Option<Time>) -> Drawing {
        let (start, end) = (self.timeline().start(), self.timeline().end());
        let banks = self.show().coordinates().into_iter().enumerate();
        let rows = banks
            .filter(|(_, c)| c.bank.is_some())
            .map(|(i, coordinate)| chart::Row {
                points: points(self.timeline(), i),
                before: Vec::new(),
                colour: hue(&coordinate),
                name: coordinate.name,
            });
        let cues = self.show().cues.iter().zip(self.timeline().cues());
        let curves = chart::Curves {
            title: self.show().title.clone(),
            start: start.seconds(),
            end: end.seconds(),
            rows: rows.collect(),
            cues: cues
                .map(|(cue, time)| (time.go.seconds(), cue.number.to_string()))
                .collect(),
            playhead: playhead.map(Time::seconds),
        };
        chart::curves(&curves, Theme::Dark)
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

    pub(super) fn answer_picture(&mut self, call: &Call) -> Result<Reply, Error> {
        if call.words.len() + usize::from(call.option("at").is_some()) > 1 {
            return Err(Error::Usage(
                "a picture is of one moment: say one time".to_owned(),
            ));
        }
        let time = match call.option("at").or(call.words.first().map(String::as_str)) {
            Some(text) => self.time(text)?,
            None => self.now,
        };
        let setting = match call.option("bank") {
            Some(name) => self.alone(name)?,
            None => self.timeline().evaluate(time),
        };
        let image = match call.option("quality") {
            Some(text) => self.render(&setting, self.quality(text)?)?,
            None => {
                self.coarse()?;
                self.projected()?.preview(&setting, self.host.work())?
            }
        };
        let what = match call.option("bank") {
            Some(name) => format!("{name} alone at full"),
            None => format!("{time}"),
        };
        let quality = match call.option("quality") {
            Some(text) => format!("quality {text}"),
            None if self.is_final() => "the sum of the banks".to_owned(),
            None => {
                let refined = count(self.refined(), "refined picture");
                format!("coarse, and {refined}{}", self.method().aside())
            }
        };
        let negative = tone::negative(&image);
        let below = match negative {
            0 => String::new(),
            n => format!("; {} slightly below zero", count(n, "number")),
        };
        let path = call.option("output").map(Path::new);
        let text = format!("{what}: {quality}{below}");
        if path.is_some_and(|p| ending(p) == "exr") {
            let bytes = exr::encode(
                &image,
                Precision::Float,
                &[("picture".to_owned(), text.clone())],
            )?;
            return self.write_reply(path, &bytes, text);
        }
        let tone = self.picture_tone(&image)?;
        let rgb = tone.encode(&image);
        let size = (image.width(), image.height());
        match path {
            Some(p) if ending(p) == "png" => {
                let bytes = png::encode(size.0, size.1, &rgb)?;
                self.write_reply(path, &bytes, text)
            }
            Some(p) => Err(unknown_ending(p, ".png (as displayed) or .exr (linear)")),
            None => Ok(Reply {
                picture: Some(Shown { size, rgb }),
                ..Reply::text(text)
            }),
        }
    }

    /// The exposure of the whole sequence, so that pictures of different moments compare; a show
    /// without cues is exposed for the picture itself.
    fn picture_tone(&mut self, image: &Image) -> Result<Tone, Error> {
        if self.show().preview.exposure.is_some() || self.show().cues.is_empty() {
            return Ok(self.tone(std::slice::from_ref(image)));
        }
        let made_by = (self.refined(), self.method().projection);
        if let Some((exposure, at)) = self.exposure
            && at == made_by
        {
            return Ok(Tone {
                exposure,
                curve: Curve::Filmic,
            });
        }
        let playback = self.playback()?;
        let tone = self.tone(playback.images());
        self.exposure = Some((tone.exposure, made_by));
        Ok(tone)
    }

    /// A bank alone at full: 1 in its coordinates.
    pub(super) fn alone(&self, name: &str) -> Result<Vec<f64>, Error> {
        let coordinates = self.show().coordinates();
        let banks = &self.show().banks;
        let of = |c: &crate::show::Coordinate| {
            let bank = c
                .bank
                .and_then(|b| banks.get(b))
                .is_some_and(|b| b.name == name);
            bank || c.name == name
        };
        if !coordinates.iter().any(of) {
            let names: Vec<&str> = banks.iter().map(|b| b.name.as_str()).collect();
            let near = crate::lang::nearest(name, names.iter().copied());
            let hint = near.map_or(names.join(", "), |n| format!("did you mean `{n}`?"));
            return Err(Error::Usage(format!("there is no bank `{name}`: {hint}")));
        }
        Ok(coordinates
            .iter()
            .map(|c| f64::from(u8::from(of(c))))
            .collect())
    }

    pub(super) fn quality(&self, text: &str) -> Result<Quality, Error> {
        let finest = self.finest().0;
        let number = text.parse().ok().filter(|q| (1..=finest).contains(q));
        number.map(Quality).ok_or_else(|| {
            Error::Usage(format!(
                "`{text}` is not a quality; the scale is 1 to {finest}"
            ))
        })
    }

    /// Renders a setting anew at a quality of one's own choice, without the pool.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, else what rendering says.
    pub fn render(&mut self, setting: &[f64], quality: Quality) -> Result<Image, Error> {
        let work = self.host.work();
        let stage = self.stage.as_mut().ok_or_else(super::refine::no_stage)?;
        let operator = stage.operator(self.host.transport.as_ref(), quality, work)?;
        let mut images = operator.render(&[setting.to_vec()], work)?;
        images.pop().ok_or_else(super::refine::no_stage)
    }

    pub(super) fn answer_play(&mut self, call: &Call) -> Result<Reply, Error> {
        let path = call.option("output").map(Path::new);
        if let Some(p) = path.filter(|p| !matches!(ending(p).as_str(), "png" | "apng")) {
            return Err(unknown_ending(p, "an animated .png"));
        }
        let playback = self.playback()?;
        let tone = self.tone(playback.images());
        let Some(path) = path else {
            let rate = self.frame_rate(&playback);
            let mut image = Image::new(0, 0);
            playback.frame(self.now, &mut image);
            let shown = Shown {
                size: playback.size(),
                rgb: tone.encode(&image),
            };
            let keys = count(playback.images().len(), "key image");
            let text = format!(
                "{keys}; playback reaches {rate:.0} frames/s at {}x{}. `play -o show.png` writes the sequence",
                playback.size().0,
                playback.size().1
            );
            return Ok(Reply {
                picture: Some(shown),
                ..Reply::text(text)
            });
        };
        let (bytes, told) = self.animate(&playback, tone)?;
        self.write_reply(Some(path), &bytes, told.describe())
    }

    pub(super) fn answer_plot(&mut self, call: &Call) -> Result<Reply, Error> {
        let drawing = self.curves(Some(self.now));
        let text = format!(
            "{} of {}",
            count(self.show().banks.len(), "bank"),
            self.show().title
        );
        let Some(path) = call.option("output").map(Path::new) else {
            let (width, height, rgb) = drawing.rgb8()?;
            return Ok(Reply {
                picture: Some(Shown {
                    size: (width, height),
                    rgb,
                }),
                ..Reply::text(text)
            });
        };
        match ending(path).as_str() {
            "png" => self.write_reply(Some(path), &drawing.png()?, text),
            "svg" => self.write_reply(Some(path), drawing.svg().as_bytes(), text),
            _ => Err(unknown_ending(path, ".png or .svg")),
        }
    }

    fn write_reply(&self, path: Option<&Path>, bytes: &[u8], text: String) -> Result<Reply, Error> {
        let Some(path) = path else {
            return Ok(Reply::text(text));
        };
        self.host.store.write(path, bytes)?;
        Ok(Reply::text(format!("{text}\nwrote {}", path.display())))
    }
}

/// A coordinate's setting over time, dense enough to draw; two points at a jump.
pub(super) fn points(timeline: &Timeline, coordinate: usize) -> Vec<(f64, f64)> {
    let (start, end) = (timeline.start(), timeline.end());
    let length = (end - start).seconds().max(1e-6);
    let density = POINTS_A_SECOND.min(MOST_POINTS / length);
    let mut out = Vec::new();
    let pieces = timeline.curve(coordinate).iter();
    for piece in pieces.filter(|p| p.end >= start && p.start <= end) {
        let seconds = (piece.end - piece.start).seconds();
        let steps = match piece.polynomial.degree() {
            0 | 1 => 1,
            _ => ((seconds * density).ceil() as usize).clamp(8, 400),
        };
        for k in 0..=steps {
            let time = piece.start + (piece.end - piece.start).scaled(k as f64 / steps as f64);
            out.push((time.seconds(), piece.value(time)));
        }
    }
    let last = timeline.last().get(coordinate).copied().unwrap_or(0.0);
    out.push((end.seconds(), last));
    out
}

/// The colour in which a coordinate is drawn: of an rgb bank its own, else the theme's.
pub(super) fn hue(coordinate: &Coordinate) -> Option<[u8; 3]> {
    coordinate.channel.map(|channel| match channel {
        0 => [230, 70, 60],
        1 => [70, 180, 80],
        _ => [80, 120, 240],
    })
}

pub(super) fn ending(path: &Path) -> String {
    path.extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase()
}

pub(super) fn unknown_ending(path: &Path, known: &str) -> Error {
    Error::Usage(format!(
        "`{}` has an ending that cannot be written here; use {known}",
        path.display()
    ))
}
