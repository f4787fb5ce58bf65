//! Live control: moves in time, trial levels, blind edits.

use clap::Args;

use super::picture::{self, PictureArgs};
use super::usage;
use crate::argument::{Moment, check_cue, fade_times, number, share};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine::{self as engine, Moves};
use footlight_report::document;
use footlight_show::lang;
use footlight_show::printable::Printable;
use footlight_show::units::{CueNumber, Time};

/// The moment to go to.
#[derive(Args, Clone, Debug)]
pub struct AtArgs {
    #[arg(value_name = "TIME | cue N [+ TIME]")]
    moment: Vec<String>,
}

/// The cue to go to.
#[derive(Args, Clone, Debug)]
pub struct GotoArgs {
    #[arg(value_name = "CUE [at PART%]", required = true)]
    words: Vec<String>,
}

/// The levels to try.
#[derive(Args, Clone, Debug)]
pub struct SetArgs {
    #[arg(value_name = "LEVEL…", allow_hyphen_values = true)]
    levels: Vec<String>,
}

/// The cue to write.
#[derive(Args, Clone, Debug)]
pub struct RecordArgs {
    #[arg(value_name = "NUMBER", value_parser = number)]
    number: Option<CueNumber>,
    #[arg(value_name = "LABEL", default_value = "", hide_default_value = true)]
    label: String,
    /// The new cue's time, such as 3 or 4/6
    #[arg(long, value_name = "TIME", value_parser = fade_times)]
    time: Option<(Time, Time)>,
}

/// The cue to write.
#[derive(Args, Clone, Debug)]
pub struct InsertArgs {
    #[arg(value_name = "LABEL", default_value = "", hide_default_value = true)]
    label: String,
    /// The new cue's time, such as 3 or 4/6
    #[arg(long, value_name = "TIME", value_parser = fade_times)]
    time: Option<(Time, Time)>,
}

/// Option to end blind editing.
#[derive(Args, Clone, Debug)]
pub struct BlindArgs {
    #[arg(value_parser = ["off"])]
    off: Option<String>,
}

pub fn at(repl: &mut Repl, asked: &AtArgs) -> Result<Reply, Error> {
    let released = match Moment::of(&asked.moment)? {
        None => Vec::new(),
        Some(Moment::Cue(number, None)) => {
            check_cue(&repl.engine, number)?;
            repl.live.goto(repl.engine.document(), number, None)?
        }
        Some(moment) => {
            let time = moment.time(&repl.engine)?;
            repl.live.move_to(repl.engine.document(), time)?
        }
    };
    report_release(repl, &released);
    Ok(moment(repl))
}

pub fn go(repl: &mut Repl) -> Result<Reply, Error> {
    let released = repl.live.go(repl.engine.document())?;
    moved(repl, &released)
}

pub fn back(repl: &mut Repl) -> Result<Reply, Error> {
    let released = repl.live.back(repl.engine.document())?;
    moved(repl, &released)
}

pub fn goto(repl: &mut Repl, asked: &GotoArgs) -> Result<Reply, Error> {
    let words: Vec<&str> = asked.words.iter().map(String::as_str).collect();
    let (cue, part) = match words[..] {
        [cue] => (cue, None),
        [cue, "at", part] => (cue, Some(share(part).map_err(Error::Usage)?)),
        _ => return usage("say which cue: goto 12, goto 12 at 50%"),
    };
    let cue = number(cue).map_err(Error::Usage)?;
    check_cue(&repl.engine, cue)?;
    let released = repl.live.goto(repl.engine.document(), cue, part)?;
    moved(repl, &released)
}

fn moved(repl: &mut Repl, released: &[String]) -> Result<Reply, Error> {
    report_release(repl, released);
    pictured_moment(repl)
}

/// Reports trial levels that a move in time released.
fn report_release(repl: &mut Repl, released: &[String]) {
    if !released.is_empty() {
        let said = format!(
            "let go of {}; `record NUMBER` before a move keeps what is tried",
            released.join("  ")
        );
        repl.unheard.push(said.into());
    }
}

/// The levels at the current moment.
fn moment(repl: &Repl) -> Reply {
    Reply::text(document::moment(repl.engine.document(), &repl.live))
}

/// The levels at the current moment, and an image if the pool has one at once.
fn pictured_moment(repl: &mut Repl) -> Result<Reply, Error> {
    let levels = moment(repl);
    if repl.engine.estimate().pool().is_none() {
        return Ok(levels);
    }
    let picture = picture::picture(repl, &PictureArgs::default())?;
    Ok(Reply {
        picture: picture.picture,
        ..levels
    })
}

/// Tries levels on top of the cues at the current time.
pub fn set(repl: &mut Repl, asked: &SetArgs) -> Result<Reply, Error> {
    if asked.levels.is_empty() {
        let text = if !repl.live.is_trying() {
            "nothing is being tried: `set lamps 40`".to_owned()
        } else {
            format!("trying {}", repl.live.tried().join("  "))
        };
        return Ok(Reply::text(text));
    }
    let document = repl.engine.document();
    let files = repl.engine.host().files.as_ref();
    let moves = Moves::read(document, &absolute(repl, &asked.levels), files)?;
    repl.live.set(document, moves)?;
    let mut reply = pictured_moment(repl)?;
    reply
        .text
        .push("`record NUMBER \"LABEL\"` keeps it, `release` lets go\n");
    Ok(reply)
}

/// Converts relative levels such as `warm +10` and `sky -5` to absolute ones at the current moment.
fn absolute(repl: &Repl, words: &[String]) -> String {
    let document = repl.engine.document();
    let show = document.show();
    let (levels, firsts) = (repl.live.levels(document), show.first_parameters());
    let mut out: Vec<String> = Vec::new();
    for word in words {
        let by = word.strip_prefix('+').map(str::to_owned);
        let by = by.or_else(|| word.starts_with('-').then(|| word.clone()));
        let by = by.and_then(|by| by.trim_end_matches('%').parse::<f64>().ok());
        let (Some(by), Some(name)) = (by, out.last()) else {
            out.push(word.clone());
            continue;
        };
        let group = show.groups.iter().find(|group| group.name == *name);
        let bank = show.banks.iter().position(|bank| bank.name == *name);
        let banks = group.map_or_else(|| bank.into_iter().collect(), |group| group.banks.clone());
        if banks.is_empty() {
            out.push(word.clone());
            continue;
        }
        out.pop();
        for bank in banks {
            let level = firsts.get(bank).and_then(|first| levels.get(*first));
            let level = (100.0 * level.copied().unwrap_or(0.0) + by).clamp(0.0, 100.0);
            let name = show.banks.get(bank).map_or("", |b| b.name.as_str());
            out.push(format!("{name} {}", (level * 1e6).round() / 1e6));
        }
    }
    out.join(" ")
}

/// Writes the trial levels into the current cue.
pub fn update(repl: &mut Repl) -> Result<Reply, Error> {
    let before = repl.engine.estimate().refined();
    let edited = repl.live.update(&mut repl.engine)?;
    Ok(Reply::text(repl.describe_edit(&edited, before)))
}

/// Writes the trial levels as a new cue after the current one, with a number in between.
pub fn insert(repl: &mut Repl, asked: &InsertArgs) -> Result<Reply, Error> {
    let document = repl.engine.document();
    let cues = &document.show().cues;
    let index = repl.live.cue(document).ok_or(engine::Error::NoCues)?;
    let of = |i: usize| cues.get(i).map(|cue| cue.number.thousandths());
    let this = of(index).unwrap_or(0);
    let number = between(this, of(index + 1));
    let number = number
        .and_then(CueNumber::from_thousandths)
        .ok_or_else(|| {
            Error::Usage(
                "there is no number between this cue and the next: rename one of them".to_owned(),
            )
        })?;
    recorded(repl, number, &asked.label, asked.time)
}

/// The roundest number between two, in thousandths; after the last cue, the next whole one.
fn between(this: u32, next: Option<u32>) -> Option<u32> {
    let Some(next) = next else {
        return Some((this / 1000 + 1) * 1000);
    };
    [1000, 500, 100, 50, 10, 5, 1].into_iter().find_map(|step| {
        let middle = (this + next) / 2 / step * step;
        let up = middle + step;
        [middle, up].into_iter().find(|n| this < *n && *n < next)
    })
}

pub fn release(repl: &mut Repl) -> Result<Reply, Error> {
    if repl.live.release() {
        pictured_moment(repl)
    } else {
        Ok(Reply::text("nothing is being tried"))
    }
}

/// Keeps blind edits, or records the trial levels as a cue.
pub fn record(repl: &mut Repl, asked: &RecordArgs) -> Result<Reply, Error> {
    let Some(number) = asked.number else {
        return keep_blind(repl);
    };
    if !repl.live.is_trying() {
        return Err(engine::Error::NothingTried.into());
    }
    recorded(repl, number, &asked.label, asked.time)
}

fn recorded(
    repl: &mut Repl,
    cue: CueNumber,
    label: &str,
    times: Option<(Time, Time)>,
) -> Result<Reply, Error> {
    let before = repl.engine.estimate().refined();
    let edited = repl.live.record(&mut repl.engine, cue, label, times)?;
    let text = repl.engine.document().text();
    let place = lang::edit::locate(text, &format!("cue {cue}"));
    let recorded = place.and_then(|p| text.get(p));
    let mut recorded = Printable::from(recorded.ok_or(engine::Error::NoSuchCue(cue))?);
    recorded.push("\n");
    recorded.append(&repl.describe_edit(&edited, before));
    if repl.live.is_blind() {
        // The recorded cue builds on the blind edits, so keep them too.
        repl.live.keep_blind()?;
        if !recorded.ends_with("\n") {
            recorded.push("\n");
        }
        recorded.push("the blind edits before it are recorded with it\n");
    }
    Ok(Reply::text(recorded))
}

fn keep_blind(repl: &mut Repl) -> Result<Reply, Error> {
    match repl.live.keep_blind() {
        Ok(()) => Ok(Reply::text(
            "the blind edits are recorded; `save` writes them",
        )),
        Err(_) => {
            usage("there are no blind edits; `record NUMBER \"LABEL\"` keeps levels that are tried")
        }
    }
}

pub fn blind(repl: &mut Repl, asked: &BlindArgs) -> Result<Reply, Error> {
    if asked.off.is_some() {
        repl.live.drop_blind(&mut repl.engine)?;
        let headline = repl.headline();
        return Ok(Reply::text(format!(
            "the blind edits are dropped\n{headline}"
        )));
    }
    Ok(Reply::text(
        if repl.live.begin_blind(repl.engine.document()) {
            "blind: edits are shown, `record` keeps them, `blind off` drops them"
        } else {
            "blind already: `record` keeps the edits, `blind off` drops them"
        },
    ))
}
