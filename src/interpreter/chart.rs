//! `chart`: measurements as a chart or its data.

use std::path::{Path, PathBuf};

use super::output::{ending, unknown_ending};
use super::{Call, Error, Interpreter, Reply};
use crate::chart::Theme;
use crate::report::{refinement, stability, tradeoff};
use crate::study::stability::{Stability, study};

/// The file of commands that `chart session` replays unless it is told another, beside the show.
const COMMANDS: &str = "session.txt";

/// Options that belong to some kinds only, with those and what to say else.
const PARTIAL: [(&str, &[&str], &str); 4] = [
    (
        "reference",
        &["transport"],
        "playback is held against its own blends in double precision, all else against what the \
         show itself can render",
    ),
    ("where", &["playback"], "it shows where keys are off"),
    ("commands", &["session"], "it names the file to replay"),
    (
        "truth",
        &["session"],
        "every other chart has the truth in it where there is one",
    ),
];

impl Interpreter {
    pub(super) fn answer_chart(&mut self, call: &Call) -> Result<Reply, Error> {
        let kind = match call.words.as_slice() {
            [kind] => kind.as_str(),
            _ => "",
        };
        let path = call.option("output").map(Path::new);
        let known = ["png", "svg", "csv", "json"];
        if let Some(p) = path.filter(|p| !known.contains(&ending(p).as_str())) {
            return Err(unknown_ending(p, ".png, .svg, .csv or .json"));
        }
        for (option, kinds, why) in PARTIAL {
            if call.option(option).is_some() && !kinds.contains(&kind) {
                let kinds = kinds.join("`, `chart ");
                let message = format!("`--{option}` is for `chart {kinds}`: {why}");
                return Err(Error::Usage(message));
            }
        }
        let theme = match call.option("dark") {
            Some(_) => Theme::Dark,
            None => Theme::Light,
        };
        match kind {
            "transport" => {
                let found = self.chart_transport(call.option("reference").map(Path::new))?;
                let (text, record) = (tradeoff::describe(&found), || tradeoff::record(&found));
                let drawing = |theme| tradeoff::drawing(&found, theme);
                self.deliver(text, &record, &drawing, path, theme)
            }
            "playback" => self.answer_chart_playback(call, path, theme),
            "session" => {
                let commands = call
                    .option("commands")
                    .map_or_else(|| self.usual(), PathBuf::from);
                self.replayed(&commands, call.option("truth").is_some(), path, theme)
            }
            "plan" => {
                let found = self.chart_plan()?;
                let (text, record) = (refinement::describe(&found), || refinement::record(&found));
                let drawing = |theme| refinement::drawing(&found, theme);
                self.deliver(text, &record, &drawing, path, theme)
            }
            "stability" => {
                let found = self.chart_stability()?;
                let (text, record) = (stability::describe(&found), || stability::record(&found));
                let drawing = |theme| stability::drawing(&found, theme);
                self.deliver(text, &record, &drawing, path, theme)
            }
            _ => Err(Error::Usage(USAGE.to_owned())),
        }
    }

    /// Where methods fail and what is shipped instead. It says nothing of the show, and is the same
    /// for all.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; else none in practice.
    pub fn chart_stability(&self) -> Result<Stability, Error> {
        Ok(study(self.machine(), self.host.work())?)
    }

    /// The session beside the show's file.
    fn usual(&self) -> PathBuf {
        let folder = self.path.as_deref().and_then(Path::parent);
        folder.unwrap_or(Path::new("")).join(COMMANDS)
    }
}

const USAGE: &str = "say what to draw: `chart transport` draws error against time over the scale of \
    quality, `chart playback` over the formats of key images, `chart plan` over refined pictures, \
    `chart session` over a session of edits, `chart stability` where methods fail";
