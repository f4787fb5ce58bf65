//! Live control: moves in time, levels that are tried, blind edits.

use super::{picture, usage};
use crate::argument::{cue, duration, share, time_of};
use crate::{Call, Error, Repl, Reply, find};
use footlight_engine::{self as engine, Moves};
use footlight_report::document;
use footlight_show::lang;
use footlight_show::printable::Printable;
use footlight_show::units::{CueNumber, Time};

pub fn at(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let words = call.words();
    let released = match words.as_slice() {
        [] => Vec::new(),
        ["cue", number] => {
            let number = cue(&repl.engine, number)?;
            repl.live.goto(repl.engine.document(), number, None)?
        }
        words => {
            let time = time_of(&repl.engine, words)?;
            repl.live.move_to(repl.engine.document(), time)?
        }
    };
    report_release(repl, &released);
    Ok(moment(repl))
}

pub fn go(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    let released = repl.live.go(repl.engine.document())?;
    moved(repl, &released)
}

pub fn back(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    let released = repl.live.back(repl.engine.document())?;
    moved(repl, &released)
}

pub fn goto(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let (number, part) = match call.words()[..] {
        [number] => (number, None),
        [number, "at", part] => (number, Some(share(part)?)),
        _ => return usage("say which cue: goto 12, goto 12 at 50%"),
    };
    let number = cue(&repl.engine, number)?;
    let released = repl.live.goto(repl.engine.document(), number, part)?;
    moved(repl, &released)
}

fn moved(repl: &mut Repl, released: &[String]) -> Result<Reply, Error> {
    report_release(repl, released);
    pictured_moment(repl)
}

/// Says what a move in time let go of.
fn report_release(repl: &mut Repl, released: &[String]) {
    if !released.is_empty() {
        let said = format!(
            "let go of {}; `record NUMBER` before a move keeps what is tried",
            released.join("  ")
        );
        repl.unheard.push(said.into());
    }
}

/// Levels there.
fn moment(repl: &Repl) -> Reply {
    Reply::text(document::moment(repl.engine.document(), &repl.live))
}

/// Levels there, and a picture where the pool can give one at once.
fn pictured_moment(repl: &mut Repl) -> Result<Reply, Error> {
    let levels = moment(repl);
    if repl.engine.estimate().pool().is_none() {
        return Ok(levels);
    }
    let picture = picture::picture(repl, &Call::new(find("picture")?))?;
    Ok(Reply {
        picture: picture.picture,
        ..levels
    })
}

/// Tries levels on top of what the cues say at the current time.
pub fn set(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    if call.words.is_empty() {
        let text = if !repl.live.is_trying() {
            "nothing is being tried: `set lamps 40`".to_owned()
        } else {
            format!("trying {}", repl.live.tried().join("  "))
        };
        return Ok(Reply::text(text));
    }
    let document = repl.engine.document();
    let files = repl.engine.host().files.as_ref();
    let moves = Moves::read(document, &absolute(repl, &call.words()), files)?;
    repl.live.set(document, moves)?;
    let mut reply = pictured_moment(repl)?;
    reply
        .text
        .push("`record NUMBER \"LABEL\"` keeps it, `release` lets go\n");
    Ok(reply)
}

/// Words in which `warm +10` and `sky -5` are levels, from those at this moment.
fn absolute(repl: &Repl, words: &[&str]) -> String {
    let document = repl.engine.document();
    let show = document.show();
    let (levels, firsts) = (repl.live.levels(document), show.first_parameters());
    let mut out: Vec<String> = Vec::new();
    for word in words {
        let by = word.strip_prefix('+').map(str::to_owned);
        let by = by.or_else(|| word.starts_with('-').then(|| (*word).to_owned()));
        let by = by.and_then(|by| by.trim_end_matches('%').parse::<f64>().ok());
        let (Some(by), Some(name)) = (by, out.last()) else {
            out.push((*word).to_owned());
            continue;
        };
        let group = show.groups.iter().find(|group| group.name == *name);
        let bank = show.banks.iter().position(|bank| bank.name == *name);
        let banks = group.map_or_else(|| bank.into_iter().collect(), |group| group.banks.clone());
        if banks.is_empty() {
            out.push((*word).to_owned());
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

/// Writes what is tried into the cue that stands.
pub fn update(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    let before = repl.engine.estimate().refined();
    let edited = repl.live.update(&mut repl.engine)?;
    Ok(Reply::text(repl.describe_edit(&edited, before)))
}

/// Writes what is tried as a new cue behind the one that stands, under a number between.
pub fn insert(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
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
    let label = call.words().first().copied().unwrap_or("");
    let times = call.option("time").map(fade_times).transpose()?;
    recorded(repl, number, label, times)
}

/// The roundest number between two, in thousandths; behind the last cue the next whole one.
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

pub fn release(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    if repl.live.release() {
        pictured_moment(repl)
    } else {
        Ok(Reply::text("nothing is being tried"))
    }
}

/// Keeps blind edits, or what is being tried as a cue.
pub fn record(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let (number, label) = match call.words()[..] {
        [] => return keep_blind(repl),
        [number] => (number, ""),
        [number, label] => (number, label),
        _ => return usage("usage: record NUMBER \"LABEL\""),
    };
    if !repl.live.is_trying() {
        return Err(engine::Error::NothingTried.into());
    }
    let times = call.option("time").map(fade_times).transpose()?;
    let cue = CueNumber::parse(number).ok_or_else(|| {
        Error::Usage(format!(
            "`{number}` is not a cue number; write it as 12 or 2.5"
        ))
    })?;
    recorded(repl, cue, label, times)
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
        // What is recorded is kept, and it stands on the edits before it.
        repl.live.keep_blind()?;
        if !recorded.ends_with("\n") {
            recorded.push("\n");
        }
        recorded.push("the blind edits before it are recorded with it\n");
    }
    Ok(Reply::text(recorded))
}

/// `3`, or `4/6` for what goes up and what goes down.
fn fade_times(text: &str) -> Result<(Time, Time), Error> {
    match text.split_once('/') {
        Some((up, down)) => Ok((duration(up)?, duration(down)?)),
        None => duration(text).map(|time| (time, time)),
    }
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

pub fn blind(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    match call.words().as_slice() {
        [] => Ok(Reply::text(
            if repl.live.begin_blind(repl.engine.document()) {
                "blind: edits are shown, `record` keeps them, `blind off` drops them"
            } else {
                "blind already: `record` keeps the edits, `blind off` drops them"
            },
        )),
        ["off"] => {
            repl.live.drop_blind(&mut repl.engine)?;
            let headline = repl.headline();
            Ok(Reply::text(format!(
                "the blind edits are dropped\n{headline}"
            )))
        }
        _ => usage("usage: blind [off]"),
    }
}
