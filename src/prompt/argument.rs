//! Words behind a verb as values.

use super::error::usage;
use super::{Call, Error};
use footlight_engine::{Engine, Goal, LiveControl, Way};
use footlight_picture::exr::Precision;
use footlight_picture::y4m::Chroma;
use footlight_report::layers::Layers;
use footlight_report::target::TargetOptions;
use footlight_show::lang;
use footlight_show::units::{CueNumber, Time, Tolerance};
use footlight_transport::Quality;

/// `2%` or `0.02`; between 0 and 1.
pub fn fraction(text: &str) -> Result<f64, Error> {
    let meant = match text.parse::<f64>() {
        Ok(percent) if percent > 1.0 && percent <= 100.0 => format!("`{percent}%`"),
        _ => "`2%` or `0.02`".to_owned(),
    };
    let value = match text.strip_suffix('%') {
        Some(number) => number.trim().parse::<f64>().map(|p| p / 100.0),
        None => text.parse::<f64>(),
    };
    value
        .ok()
        .filter(|v| (0.0..=1.0).contains(v))
        .ok_or_else(|| Error::Usage(format!("`{text}` is not an error; write {meant}")))
}

/// `2%` or `0.02` of the light, or `1.5 steps` as displayed.
pub fn error(text: &str) -> Result<Tolerance, Error> {
    match Tolerance::parse_steps(text) {
        Some(steps) => Ok(steps),
        None if text.ends_with("step") || text.ends_with("steps") => usage(format!(
            "`{text}` is not an error; write steps of 255 as 1.5steps"
        )),
        None => fraction(text).map(Tolerance::from),
    }
}

/// The error that an option allows; without it the show's own tolerance.
pub fn tolerance(engine: &Engine, call: &Call, option: &str) -> Result<Tolerance, Error> {
    let said = call.option(option).map(error).transpose()?;
    Ok(said.unwrap_or(engine.show().preview.tolerance))
}

/// `5`, `1.5s`, `1:30`, `250ms`.
pub fn duration(text: &str) -> Result<Time, Error> {
    lang::time(text).ok_or_else(|| {
        Error::Usage(format!(
            "`{text}` is not a time; write it as 5, 1.5s or 1:30"
        ))
    })
}

/// A whole number of images.
pub fn whole(text: &str) -> Result<usize, Error> {
    text.parse()
        .map_err(|_| Error::Usage(format!("`{text}` is not a whole number")))
}

/// A moment of the show: a time, or `cue 5` (complete), `cue 5 + 2s` (after its GO).
pub fn time_of(engine: &Engine, words: &[&str]) -> Result<Time, Error> {
    let joined = words.join(" ");
    let Some(rest) = joined.strip_prefix("cue ") else {
        return match words {
            [word] => time(engine, word),
            _ => usage("say one moment: 1:30, cue 5 or cue 5 + 2s"),
        };
    };
    let (number, after) = match rest.split_once('+') {
        Some((number, after)) => (number.trim(), Some(duration(after.trim())?)),
        None => (rest, None),
    };
    let number = cue(engine, number)?;
    Ok(LiveControl::moment_of(engine.document(), number, after)?)
}

/// A time within the show.
pub fn time(engine: &Engine, text: &str) -> Result<Time, Error> {
    let time = duration(text)?;
    engine.document().check_time(time)?;
    Ok(time)
}

/// A step of quality.
pub fn quality(engine: &Engine, text: &str) -> Result<Quality, Error> {
    let finest = engine.estimate().finest().0;
    let number = text.parse().ok().filter(|q| (1..=finest).contains(q));
    number.map(Quality).ok_or_else(|| {
        Error::Usage(format!(
            "`{text}` is not a quality; the scale is 1 to {finest}, {finest} is the finest"
        ))
    })
}

/// `50%`, as a share of 1.
pub fn share(text: &str) -> Result<f64, Error> {
    let percent = text.strip_suffix('%').and_then(|t| t.parse::<f64>().ok());
    let percent = percent.filter(|p| (0.0..=100.0).contains(p));
    percent
        .map(|p| p / 100.0)
        .ok_or_else(|| Error::Usage(format!("`{text}` is no part of a cue; write it as 50%")))
}

/// The number of a cue of the show.
pub fn cue(engine: &Engine, text: &str) -> Result<CueNumber, Error> {
    let cues = &engine.show().cues;
    let number = CueNumber::parse(text);
    let found = number.filter(|n| cues.iter().any(|cue| cue.number == *n));
    found.ok_or_else(|| {
        let known: Vec<String> = cues.iter().take(12).map(|c| c.number.to_string()).collect();
        let more = if cues.len() > 12 { " …" } else { "" };
        Error::Usage(format!(
            "there is no cue `{text}`; there are {}{more}",
            known.join(", ")
        ))
    })
}

/// What `refine` is asked for.
pub fn goal(call: &Call) -> Result<Goal, Error> {
    Ok(match call.words().as_slice() {
        [] => Goal::default(),
        ["until", text] => Goal::until(error(text)?),
        ["until", number, unit @ ("step" | "steps")] => {
            Goal::until(error(&format!("{number}{unit}"))?)
        }
        ["for", time] => Goal {
            budget: Some(duration(time)?.seconds()),
            ..Goal::default()
        },
        [number] => Goal::count(whole(number)?),
        _ => return usage("usage: refine [N | until X | for TIME] [&]"),
    })
}

/// The way to an error that a word names.
pub fn way(name: &str) -> Result<Way, Error> {
    let known = |w: &Way| w.name() == name;
    Way::ALL.into_iter().find(known).ok_or_else(|| {
        Error::Usage(format!(
            "there is no way `{name}`; it is auto, paper or alone"
        ))
    })
}

/// Half precision unless the call says otherwise.
pub fn precision(call: &Call) -> Precision {
    if call.has("float") {
        Precision::Float
    } else {
        Precision::Half
    }
}

/// What a call says of the file that a sequence is written to.
pub fn target(call: &Call) -> Result<TargetOptions, Error> {
    let chroma = match call.option("chroma") {
        None => None,
        Some("420") => Some(Chroma::Quarter),
        Some("444") => Some(Chroma::Full),
        Some(other) => {
            return usage(format!(
                "`{other}` is no chroma that is written here; use 420 or 444"
            ));
        }
    };
    let layers = match call.option("layers") {
        None => None,
        Some("keys") => Some(Layers::Keys),
        Some("banks") => Some(Layers::Banks),
        Some("basis") => Some(Layers::Basis),
        Some(other) => {
            return usage(format!(
                "there are no layers `{other}`; use keys, banks or basis"
            ));
        }
    };
    let precision = call.has("float").then_some(Precision::Float);
    Ok(TargetOptions {
        layers,
        chroma,
        precision,
    })
}
