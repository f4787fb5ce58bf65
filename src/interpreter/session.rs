//! `session`: a design session from a file, measured as it goes.
//!
//! The file holds what would be typed: declarations, which may take several lines, and `refine`.
//! Time is what coarse pictures, edits, plans and refined pictures take; measuring, and rendering
//! the truth to measure against, are not counted.

use std::path::Path;

use super::output::{ending, unknown_ending};
use super::refine::{Ended, no_stage};
use super::{Call, Error, Interpreter, LIMIT, Reply, Verb, answer, finished};
use crate::chart::Theme;
use crate::lang;
use crate::picture::Image;
use crate::plan;
use crate::pool::archive::Archive;
use crate::renderer::{Quality, Setup};
use crate::study::session::{self, Errors, Event, Moment};
use crate::work::Cancelled;

/// A command of the file.
struct Line {
    /// Where it begins, from 1.
    number: usize,
    text: String,
}

/// Every source alone at the refined quality, and what that was rendered of.
struct Truth {
    setup: Setup,
    quality: Quality,
    pictures: Vec<Image>,
}

/// What was measured so far.
struct Replay {
    wanted: bool,
    truth: Option<Truth>,
    moments: Vec<Moment>,
    /// Seconds that count.
    spent: f64,
    /// When counting began again.
    mark: f64,
}

impl Interpreter {
    pub(super) fn answer_session(&mut self, call: &Call) -> Result<Reply, Error> {
        let [path] = call.words.as_slice() else {
            return Err(Error::Usage(
                "say which file holds the commands: session FILE, with edits and `refine` lines"
                    .to_owned(),
            ));
        };
        let output = call.option("output").map(Path::new);
        let known = ["png", "svg", "csv", "json"];
        if let Some(p) = output.filter(|p| !known.contains(&ending(p).as_str())) {
            return Err(unknown_ending(p, ".png, .svg, .csv or .json"));
        }
        let truth = call.option("truth").is_some();
        self.replayed(Path::new(path), truth, output, Theme::Light)
    }

    /// Replays a file and hands over what was measured. What is finished is kept and written even
    /// where a later line is wrong.
    pub(super) fn replayed(
        &mut self,
        path: &Path,
        truth: bool,
        output: Option<&Path>,
        theme: Theme,
    ) -> Result<Reply, Error> {
        let (moments, mistake) = self.session(path, truth)?;
        let reply = self.session_reply(&moments, truth, output, theme)?;
        match mistake {
            None => Ok(reply),
            Some(Error::Session {
                path, line, cause, ..
            }) => Err(Error::Session {
                path,
                line,
                cause,
                before: reply.text,
            }),
            Some(other) => Err(other),
        }
    }

    /// Replays the commands in a file on the show as it stands and measures after each; with
    /// `truth` also against pictures of the refined quality throughout. Also the mistake that
    /// ended it, if one did. The store on disk is not asked meanwhile: what an earlier replay
    /// stored would take no time in this one.
    ///
    /// # Errors
    /// [`Error::File`] when the file cannot be read, [`Error::Usage`] when it is not text or the
    /// show has no stage, else what the coarse pictures say.
    pub fn session(
        &mut self,
        path: &Path,
        truth: bool,
    ) -> Result<(Vec<Moment>, Option<Error>), Error> {
        let bytes = self.host.store.read(path, LIMIT)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| Error::Usage(format!("{} is not text in UTF-8", path.display())))?;
        let depot = self.archive_mut().and_then(Archive::detach);
        let done = self.replay_all(path, &text, truth);
        if let Some(archive) = self.archive_mut() {
            archive.attach(depot);
        }
        done
    }

    fn replay_all(
        &mut self,
        path: &Path,
        text: &str,
        truth: bool,
    ) -> Result<(Vec<Moment>, Option<Error>), Error> {
        let mut replay = Replay {
            wanted: truth,
            truth: None,
            moments: Vec::new(),
            spent: 0.0,
            mark: self.host.clock.seconds(),
        };
        self.coarse()?;
        self.measure(&mut replay, Event::Coarse, "coarse pictures")?;
        for line in lines(text) {
            if let Err(cause) = self.replay(&line, &mut replay) {
                let mistake = Error::Session {
                    path: path.display().to_string(),
                    line: line.number,
                    cause: Box::new(cause),
                    before: String::new(),
                };
                return Ok((replay.moments, Some(mistake)));
            }
        }
        Ok((replay.moments, None))
    }

    fn replay(&mut self, line: &Line, replay: &mut Replay) -> Result<(), Error> {
        let first = line.text.lines().next().unwrap_or_default().trim();
        let label = format!("line {}: {first}", line.number);
        if lang::is_declaration(&line.text) {
            self.edit(&line.text)?;
            self.coarse()?;
            return self.measure(replay, Event::Edit, &label);
        }
        let call = Call::parse(without_comment(&line.text))?;
        if call.verb != Verb::Refine {
            return Err(Error::Usage(format!(
                "a session holds declarations and `refine`; `{first}` is neither"
            )));
        }
        let goal = answer::goal(&call)?;
        let done = self.refine_watched(goal, &mut |show| {
            show.measure(replay, Event::Refined, &label)
        })?;
        match done.ended {
            Ended::Stopped => Err(Cancelled.into()),
            _ => Ok(()),
        }
    }

    /// Adds a moment; the clock stands still meanwhile.
    fn measure(&mut self, replay: &mut Replay, event: Event, label: &str) -> Result<(), Error> {
        replay.spent += self.host.clock.seconds() - replay.mark;
        let predicted = self.predicted_errors()?;
        let truth = match replay.wanted {
            false => None,
            true => Some(self.true_errors(&mut replay.truth)?),
        };
        replay.moments.push(Moment {
            event,
            label: label.to_owned(),
            seconds: replay.spent,
            refined: self.refined(),
            predicted,
            truth,
        });
        replay.mark = self.host.clock.seconds();
        Ok(())
    }

    fn predicted_errors(&self) -> Result<Errors, Error> {
        let pool = self.rendered()?;
        let now = self.predicted_error()?;
        if self.is_final() || pool.flawless() {
            return Ok(Errors { now, coarse: 0.0 });
        }
        let norm = Some(self.sequence_norm(pool));
        let alone = plan::forecast(&self.compiled.keys, &[], &pool.weighting(), norm)?;
        let coarse = alone * self.calibration();
        Ok(Errors { now, coarse })
    }

    fn true_errors(&self, known: &mut Option<Truth>) -> Result<Errors, Error> {
        let stage = self.stage.as_ref().ok_or_else(no_stage)?;
        let pool = self.rendered()?;
        let units = units(stage.rig.sources.len());
        let quality = self.refined_step();
        let setup = stage.setup();
        let same = |t: &Truth| t.quality == quality && t.setup == setup;
        if !known.as_ref().is_some_and(same) {
            *known = Some(Truth {
                setup,
                quality,
                pictures: self.banks_anew(&units, quality)?.0,
            });
        }
        let truth = known.as_ref().map_or(&[][..], |t| t.pictures.as_slice());
        let shown = self.shown(&units)?;
        let moment = plan::second_moment(&self.compiled.keys);
        let threads = self.host.threads;
        Ok(Errors {
            now: session::sequence_error(&shown, truth, &moment, threads),
            coarse: session::sequence_error(pool.coarse(), truth, &moment, threads),
        })
    }

    /// What the pool shows for each source alone; the preview is linear, so these are all of it.
    fn shown(&self, units: &[Vec<f64>]) -> Result<Vec<Image>, Error> {
        let work = self.host.work();
        let pool = self.projected()?;
        let mut out = Vec::new();
        for unit in units {
            work.check()?;
            out.push(pool.preview(unit, work)?);
        }
        Ok(out)
    }

    fn session_reply(
        &self,
        moments: &[Moment],
        truth: bool,
        output: Option<&Path>,
        theme: Theme,
    ) -> Result<Reply, Error> {
        let step = self.refined_step().0;
        let method = match truth {
            true => format!("every source at quality {step} is the truth"),
            false => "predicted alone".to_owned(),
        };
        let method = method + &self.method().aside();
        let record = session::record(&self.show().title, self.machine(), &method, moments);
        let text = session::describe(moments);
        self.deliver(&record, &session::drawing, text, output, theme)
    }
}

/// The setting of each source alone.
fn units(sources: usize) -> Vec<Vec<f64>> {
    let unit = |i: usize| (0..sources).map(|j| f64::from(u8::from(i == j))).collect();
    (0..sources).map(unit).collect()
}

/// A verb's line without what stands behind `//`.
fn without_comment(text: &str) -> &str {
    text.split_once("//").map_or(text, |(words, _)| words)
}

/// The commands with the lines where they begin; declarations go on until they are finished, blank
/// lines and comments are left out.
fn lines(text: &str) -> Vec<Line> {
    let mut out: Vec<Line> = Vec::new();
    let mut open = false;
    for (i, line) in text.lines().enumerate() {
        match out.last_mut().filter(|_| open) {
            Some(last) => {
                last.text.push('\n');
                last.text.push_str(line);
            }
            None if line.trim().is_empty() || line.trim_start().starts_with("//") => continue,
            None => out.push(Line {
                number: i + 1,
                text: line.to_owned(),
            }),
        }
        open = out.last().is_some_and(|last| !finished(&last.text));
    }
    out
}
