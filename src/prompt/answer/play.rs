//! The sequence, on a canvas or into files.

use std::path::Path;

use super::usage;
use crate::argument::{cue, target, time_of};
use crate::{Call, Error, Repl, Reply};
use footlight_report::film::{self, PlayedSpan};
use footlight_report::target::{Sequence, Target};
use footlight_report::words::exposure;

pub fn play(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let options = [
        "sacn", "priority", "artnet", "bind", "patch", "osc", "osc-to",
    ];
    if let Some(option) = options.into_iter().find(|option| call.has(option)) {
        return usage(format!(
            "`--{option}` is for sending, which is a command: footlight play show.lxq --artnet \
             127.0.0.1"
        ));
    }
    let target = call.path("output").map(|path| checked(path, call));
    let target = target.transpose()?;
    let said = said_span(repl, call)?;
    let span = said.unwrap_or(PlayedSpan::whole(&repl.engine));
    if let Some(target) = &target {
        if said.is_some() && !target.has_frames() {
            return usage("`--from`, `--to` and `--cue` are for frames: this file has the keys");
        }
        target.check(&repl.engine, span, &repl.console.outlets)?;
    }
    let playback = repl.engine.playback()?;
    let (engine, console) = (&repl.engine, &repl.console);
    let sequence = Sequence {
        engine,
        tone: engine.document().tone_of(playback.images()),
        playback,
        span,
    };
    let exposure = exposure(engine.show(), sequence.tone.exposure);
    if let Some(target) = target {
        let (mut text, piped) = target.write(&sequence, &console.outlets)?;
        if target.is_exposed() {
            text = format!("{text}\n{exposure}");
        }
        return Ok(Reply {
            beside: piped,
            ..Reply::text(text)
        });
    }
    let (player, now) = (sequence.player()?, repl.live.time());
    // From here on, or all of it where this is the end.
    let span = said.unwrap_or(if now < span.to {
        PlayedSpan { from: now, ..span }
    } else {
        span
    });
    Ok(match &console.canvas {
        None => {
            let at = if said.is_some() { span.from } else { now };
            let (picture, text) = film::still(engine, &player, at);
            Reply::pictured(picture, format!("{text}\n{exposure}"))
        }
        Some(canvas) => {
            let text = film::perform(engine, &player, span, canvas.as_ref());
            Reply::text(format!("{text}\n{exposure}"))
        }
    })
}

/// The part of the show that a call asks for, if it does: from a moment, to one, or a cue from its
/// GO until it is complete.
fn said_span(repl: &Repl, call: &Call) -> Result<Option<PlayedSpan>, Error> {
    let engine = &repl.engine;
    let moment = |option: &str| {
        let words = call
            .option(option)
            .map(|text| text.split_whitespace().collect());
        words
            .map(|words: Vec<&str>| time_of(engine, &words))
            .transpose()
    };
    let (from, to) = (moment("from")?, moment("to")?);
    let mut span = PlayedSpan::whole(engine);
    if let Some(text) = call.option("cue") {
        if from.is_some() || to.is_some() {
            return usage("say a cue, or from where to where");
        }
        let number = cue(engine, text)?;
        let place = engine.show().cues.iter().position(|c| c.number == number);
        let times = place.and_then(|at| engine.document().timeline().cues().get(at));
        span = times.map_or(span, |cue| PlayedSpan {
            from: cue.go,
            to: cue.completion,
        });
        return Ok(Some(span));
    }
    span.from = from.unwrap_or(span.from);
    span.to = to.unwrap_or(span.to);
    if span.to < span.from {
        return usage(format!(
            "{} is before {}: nothing is between them",
            span.to, span.from
        ));
    }
    Ok((from.is_some() || to.is_some()).then_some(span))
}

/// What to write to `path`; options that this kind of file would silently ignore are refused.
fn checked(path: &Path, call: &Call) -> Result<Target, Error> {
    let options = target(call)?;
    let target = Target::of(path, options)?;
    match target.idle(options) {
        Some((option, file)) => usage(format!("`--{option}` is for {file}")),
        None => Ok(target),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use footlight_picture::exr::Precision;
    use footlight_picture::y4m::Chroma;
    use footlight_report::layers::Layers;
    use footlight_report::numbered::FrameFormat;

    fn of(words: &str) -> Result<Target, Error> {
        let call = Call::parse(&format!("play {words}"))?;
        checked(call.path("output").unwrap(), &call)
    }

    #[test]
    fn endings_and_options_choose() {
        assert!(matches!(of("-o a.webm"), Ok(Target::Film(_))));
        assert!(matches!(
            of("-o -"),
            Ok(Target::Video(None, Chroma::Quarter))
        ));
        assert!(matches!(
            of("-o a.y4m --chroma 444"),
            Ok(Target::Video(Some(_), Chroma::Full))
        ));
        assert!(matches!(
            of("-o a##.exr --float"),
            Ok(Target::Numbered(_, FrameFormat::Exr(Precision::Float)))
        ));
        assert!(matches!(
            of("-o a.exr --layers banks"),
            Ok(Target::Layers(_, Layers::Banks, Precision::Half))
        ));
        for (words, said) in [
            ("-o a.avi", "use a .mp4 or .webm (film), a .y4m"),
            ("-o a", "numbered pictures"),
            ("-o a.html --layers keys", "`--layers` is for an .exr"),
            ("-o a.exr --chroma 444", "`--chroma` is for a .y4m"),
            ("-o a.y4m --float", "`--float` is for an .exr"),
            ("-o a.exr --layers lamps", "keys, banks or basis"),
            ("-o a.y4m --chroma 422", "420 or 444"),
        ] {
            let error = of(words).unwrap_err().to_string();
            assert!(error.contains(said), "{words}: {error}");
        }
    }
}
