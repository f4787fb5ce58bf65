//! Live control: moves in time, levels that are tried, blind edits.

use super::{picture, usage};
use crate::engine::{self, Moves};
use crate::lang;
use crate::printable::Printable;
use crate::repl::argument::{cue, duration, share, time};
use crate::repl::{Call, Error, Repl, Reply, find};
use crate::report::document;
use crate::units::{CueNumber, Time};

pub fn at(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    if let Some(word) = call.words().first() {
        let time = time(&repl.engine, word)?;
        let released = repl.live.move_to(repl.engine.document(), time)?;
        report_release(repl, &released);
    }
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
    if repl.engine.pool().is_none() {
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
        let text = match repl.live.is_trying() {
            false => "nothing is being tried: `set lamps 40`".to_owned(),
            true => format!("trying {}", repl.live.tried().join("  ")),
        };
        return Ok(Reply::text(text));
    }
    let document = repl.engine.document();
    let files = repl.engine.host().files.as_ref();
    let moves = Moves::read(document, &call.words().join(" "), files)?;
    repl.live.set(document, moves)?;
    let mut reply = pictured_moment(repl)?;
    reply
        .text
        .push("`record NUMBER \"LABEL\"` keeps it, `release` lets go\n");
    Ok(reply)
}

pub fn release(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    match repl.live.release() {
        true => pictured_moment(repl),
        false => Ok(Reply::text("nothing is being tried")),
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
    let before = repl.engine.refined();
    let cue = CueNumber::parse(number).ok_or_else(|| {
        Error::Usage(format!(
            "`{number}` is not a cue number; write it as 12 or 2.5"
        ))
    })?;
    let edited = repl.live.record(&mut repl.engine, cue, label, times)?;
    let text = repl.engine.document().text();
    let place = lang::edit::locate(text, &format!("cue {cue}"));
    let recorded = place.and_then(|p| text.get(p));
    let mut recorded = Printable::from(recorded.ok_or(engine::Error::NoSuchCue(cue))?);
    recorded.push("\n");
    recorded.append(&repl.describe_edit(&edited, before));
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
            match repl.live.begin_blind(repl.engine.document()) {
                true => "blind: edits are shown, `record` keeps them, `blind off` drops them",
                false => "blind already: `record` keeps the edits, `blind off` drops them",
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
