//! Parsing of option values and words, and their meaning in a show.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::Error;
use footlight_engine::{Engine, Goal, LiveControl, Refinement, Way};
use footlight_show::lang;
use footlight_show::units::{CueNumber, Time, Tolerance};
use footlight_transport::Quality;

/// A file or folder to write. Only [`crate::Repl`] gives its path, so that no verb overwrites the
/// show's own files.
#[derive(Clone, Debug)]
pub struct Output(pub(super) PathBuf);

impl From<OsString> for Output {
    fn from(path: OsString) -> Output {
        Output(path.into())
    }
}

/// The option of verbs that make pictures.
#[derive(Args, Clone, Debug, Default)]
pub struct FromView {
    /// The view to look from (default: the first)
    #[arg(long, value_name = "VIEW")]
    pub view: Option<String>,
}

/// The option of verbs that plan pictures.
#[derive(Args, Clone, Debug, Default)]
pub struct ByWay {
    /// How an error is reached: coarse pictures and mixtures (paper), or every bank at one step of
    /// quality (alone) (default: auto)
    #[arg(long, value_name = "WAY", value_parser = one_of(Way::ALL.map(|way| (way.name(), way))))]
    pub way: Option<Way>,
}

impl ByWay {
    /// Combines a goal with the chosen method.
    pub fn refinement(&self, goal: Goal) -> Refinement {
        Refinement::from(goal).by(self.way.unwrap_or_default())
    }
}

/// A parser of fixed words with values.
pub fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    words: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(words.map(|(word, _)| word)).try_map(move |word: String| {
        let mut known = words.iter();
        let found = known.find(|(name, _)| *name == word);
        found.map(|(_, value)| *value).ok_or("an unknown word")
    })
}

/// Parses `2%` or `0.02`; between 0 and 1.
fn fraction(text: &str) -> Result<f64, String> {
    let meant = match text.parse::<f64>() {
        Ok(percent) if percent > 1.0 && percent <= 100.0 => format!("`{percent}%`"),
        _ => "`2%` or `0.02`".to_owned(),
    };
    let value = match text.strip_suffix('%') {
        Some(number) => number.trim().parse::<f64>().map(|p| p / 100.0),
        None => text.parse::<f64>(),
    };
    let value = value.ok().filter(|v| (0.0..=1.0).contains(v));
    value.ok_or_else(|| format!("`{text}` is not an error; write {meant}"))
}

/// Parses `2%` or `0.02` of the light, or `1.5 steps` as displayed.
pub fn error(text: &str) -> Result<Tolerance, String> {
    match Tolerance::parse_steps(text) {
        Some(steps) => Ok(steps),
        None if text.ends_with("step") || text.ends_with("steps") => Err(format!(
            "`{text}` is not an error; write steps of 255 as 1.5steps"
        )),
        None => fraction(text).map(Tolerance::from),
    }
}

/// Parses `5`, `1.5s`, `1:30`, `250ms`.
pub fn duration(text: &str) -> Result<Time, String> {
    let time = lang::time(text);
    time.ok_or_else(|| format!("`{text}` is not a time; write it as 5, 1.5s or 1:30"))
}

/// Parses `3`, or `4/6`: the up and down times.
pub fn fade_times(text: &str) -> Result<(Time, Time), String> {
    match text.split_once('/') {
        Some((up, down)) => Ok((duration(up)?, duration(down)?)),
        None => duration(text).map(|time| (time, time)),
    }
}

/// Parses a whole number of images.
pub fn whole(text: &str) -> Result<usize, String> {
    let number = text.parse().ok();
    number.ok_or_else(|| format!("`{text}` is not a whole number"))
}

/// Parses `50%` as a fraction.
pub fn share(text: &str) -> Result<f64, String> {
    let percent = text.strip_suffix('%').and_then(|t| t.parse::<f64>().ok());
    let percent = percent.filter(|p| (0.0..=100.0).contains(p));
    percent
        .map(|p| p / 100.0)
        .ok_or_else(|| format!("`{text}` is no part of a cue; write it as 50%"))
}

/// Parses `-1.5`, in stops.
pub fn exposure(text: &str) -> Result<f64, String> {
    let stops = text.parse::<f64>().ok();
    let stops = stops.filter(|stops| (-30.0..=30.0).contains(stops));
    stops.ok_or_else(|| format!("`{text}` is no exposure: it is -30 to 30 stops"))
}

/// Parses `12` or `2.5`.
pub fn number(text: &str) -> Result<CueNumber, String> {
    let number = CueNumber::parse(text);
    number.ok_or_else(|| format!("`{text}` is not a cue number; write it as 12 or 2.5"))
}

/// Parses a quality step, without an upper limit.
pub fn step(text: &str) -> Result<Quality, String> {
    let step = text.parse().ok().filter(|step| *step > 0);
    step.map(Quality)
        .ok_or_else(|| format!("`{text}` is not a quality; the steps are 1, 2, 3"))
}

/// A moment of a show.
#[derive(Clone, Copy, Debug)]
pub enum Moment {
    /// A time.
    Time(Time),
    /// A cue: its completion, or a time after its GO.
    Cue(CueNumber, Option<Time>),
}

impl Moment {
    /// Parses `1:30`, `cue 5` or `cue 5 + 2s`.
    pub fn parse(text: &str) -> Result<Moment, String> {
        let Some(rest) = text.strip_prefix("cue ") else {
            if text.contains(' ') {
                return Err("say one moment: 1:30, cue 5 or cue 5 + 2s".to_owned());
            }
            return duration(text).map(Moment::Time);
        };
        let (cue, after) = match rest.split_once('+') {
            Some((cue, after)) => (cue.trim(), Some(duration(after.trim())?)),
            None => (rest.trim(), None),
        };
        Ok(Moment::Cue(number(cue)?, after))
    }

    /// Parses the words of a moment; `None` without words.
    pub fn of(words: &[String]) -> Result<Option<Moment>, Error> {
        let parse = || Moment::parse(&words.join(" ")).map_err(Error::Usage);
        (!words.is_empty()).then(parse).transpose()
    }

    /// The time of the moment, within the show.
    pub fn time(self, engine: &Engine) -> Result<Time, Error> {
        match self {
            Moment::Time(time) => {
                engine.document().check_time(time)?;
                Ok(time)
            }
            Moment::Cue(cue, after) => {
                check_cue(engine, cue)?;
                Ok(LiveControl::moment_of(engine.document(), cue, after)?)
            }
        }
    }
}

/// Refuses a cue not in the show.
pub fn check_cue(engine: &Engine, number: CueNumber) -> Result<(), Error> {
    let cues = &engine.show().cues;
    if cues.iter().any(|cue| cue.number == number) {
        return Ok(());
    }
    let known: Vec<String> = cues.iter().take(12).map(|c| c.number.to_string()).collect();
    let more = if cues.len() > 12 { " …" } else { "" };
    Err(Error::Usage(format!(
        "there is no cue `{number}`; there are {}{more}",
        known.join(", ")
    )))
}

/// Refuses a quality step that the renderer does not have.
pub fn check_quality(engine: &Engine, quality: Quality) -> Result<(), Error> {
    let (Quality(step), Quality(finest)) = (quality, engine.estimate().finest());
    if step <= finest {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "`{step}` is not a quality; the scale is 1 to {finest}, {finest} is the finest"
    )))
}

/// The given tolerance, else the show's.
pub fn tolerance(engine: &Engine, said: Option<Tolerance>) -> Tolerance {
    said.unwrap_or(engine.show().preview.tolerance)
}
