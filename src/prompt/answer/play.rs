//! The sequence on a canvas, as a page, as a film, as pictures.

use std::path::Path;

use clap::{Args, ValueHint};

use super::usage;
use crate::argument::{FromView, Moment, Output, check_cue, number, one_of};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_picture::exr::Precision;
use footlight_picture::y4m::Chroma;
use footlight_report::film::{self, PlayedSpan};
use footlight_report::layers::Layers;
use footlight_report::target::{Sequence, Target, TargetOptions};
use footlight_report::words::exposure;
use footlight_show::units::CueNumber;

/// A part of the show.
#[derive(Args, Clone, Debug)]
struct Part {
    /// The first moment, such as 1:30 or "cue 5"
    #[arg(long, value_name = "TIME", value_parser = Moment::parse)]
    from: Option<Moment>,
    /// The last moment
    #[arg(long, value_name = "TIME", value_parser = Moment::parse)]
    to: Option<Moment>,
    /// This cue alone, from its GO until it is complete
    #[arg(long, value_name = "N", value_parser = number, conflicts_with_all = ["from", "to"])]
    cue: Option<CueNumber>,
}

/// The part to play.
#[derive(Args, Clone, Debug)]
pub struct PlayArgs {
    #[command(flatten)]
    pub(crate) from: FromView,
    #[command(flatten)]
    part: Part,
    /// Write a .html, a page that plays in a browser
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    #[arg(conflicts_with = "Part")]
    output: Option<Output>,
}

/// The film to write.
#[derive(Args, Clone, Debug)]
pub struct FilmArgs {
    #[command(flatten)]
    pub(crate) from: FromView,
    #[command(flatten)]
    part: Part,
    /// Colour of a .y4m or of standard output: 420 (default) or 444, BT.709
    #[arg(long, value_name = "C", value_parser = one_of(CHROMA), hide_possible_values = true)]
    chroma: Option<Chroma>,
    /// Write a .mp4 or a .webm (by ffmpeg), a .y4m, or `-` (standard output)
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Output,
}

const CHROMA: [(&str, Chroma); 2] = [("420", Chroma::Quarter), ("444", Chroma::Full)];

/// The pictures to write.
#[derive(Args, Clone, Debug)]
pub struct FramesArgs {
    #[command(flatten)]
    pub(crate) from: FromView,
    #[command(flatten)]
    part: Part,
    /// Layers of one .exr: keys (default), banks (each alone at full) or basis (the refined pictures)
    #[arg(long, value_name = "WHAT", value_parser = one_of(LAYERS), hide_possible_values = true)]
    layers: Option<Layers>,
    /// An .exr in 32 bits a number (default: 16, the relative error 2^-11)
    #[arg(long)]
    float: bool,
    /// Write numbered pictures, such as frames/####.png, or an .exr of layers
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Output,
}

const LAYERS: [(&str, Layers); 3] = [
    ("keys", Layers::Keys),
    ("banks", Layers::Banks),
    ("basis", Layers::Basis),
];

impl FilmArgs {
    fn options(&self) -> TargetOptions {
        TargetOptions {
            chroma: self.chroma,
            ..TargetOptions::default()
        }
    }
}

impl FramesArgs {
    fn options(&self) -> TargetOptions {
        TargetOptions {
            layers: self.layers,
            precision: self.float.then_some(Precision::Float),
            ..TargetOptions::default()
        }
    }
}

pub fn play(repl: &mut Repl, asked: &PlayArgs) -> Result<Reply, Error> {
    let path = asked.output.as_ref().map(|output| repl.spared(output));
    let target = path
        .transpose()?
        .map(|path| target("play", path, TargetOptions::default()));
    sequence(repl, &asked.part, target.transpose()?)
}

pub fn film(repl: &mut Repl, asked: &FilmArgs) -> Result<Reply, Error> {
    let target = target("film", repl.spared(&asked.output)?, asked.options())?;
    sequence(repl, &asked.part, Some(target))
}

pub fn frames(repl: &mut Repl, asked: &FramesArgs) -> Result<Reply, Error> {
    let target = target("frames", repl.spared(&asked.output)?, asked.options())?;
    sequence(repl, &asked.part, Some(target))
}

/// The target of `verb` at `path`. A file for another verb is refused, and so is an option without
/// effect on this kind of file.
fn target(verb: &str, path: &Path, options: TargetOptions) -> Result<Target, Error> {
    let target = Target::of(path, options)?;
    let own = match target {
        Target::Page(_) => "play",
        Target::Film(_) | Target::Video(..) => "film",
        Target::Numbered(..) | Target::Layers(..) => "frames",
    };
    if own != verb {
        let path = path.display();
        return usage(format!(
            "`{verb}` does not write `{path}`: `{own} -o {path}` does"
        ));
    }
    match target.idle(options) {
        Some((option, file)) => usage(format!("`--{option}` is for {file}")),
        None => Ok(target),
    }
}

/// Plays the sequence, or writes it to a target.
fn sequence(repl: &mut Repl, part: &Part, target: Option<Target>) -> Result<Reply, Error> {
    let said = said_span(repl, part)?;
    let span = said.unwrap_or(PlayedSpan::whole(&repl.engine));
    if let Some(target) = &target {
        if said.is_some() && !target.has_frames() {
            return usage("`--from`, `--to` and `--cue` are for frames: this file has the keys");
        }
        target.check(&repl.engine, span, &repl.console.outlets)?;
    }
    let playback = repl.engine.playback()?;
    let tone = repl.engine.tone()?;
    let (engine, console) = (&repl.engine, &repl.console);
    let sequence = Sequence {
        engine,
        tone,
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
    let (player, now) = (sequence.player(), repl.live.time());
    // From the current moment on, or everything when that is the end.
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

/// The given span of the show: from a moment, to one, or a cue from its GO to its completion.
fn said_span(repl: &Repl, part: &Part) -> Result<Option<PlayedSpan>, Error> {
    let engine = &repl.engine;
    let mut span = PlayedSpan::whole(engine);
    if let Some(number) = part.cue {
        check_cue(engine, number)?;
        let place = engine.show().cues.iter().position(|c| c.number == number);
        let times = place.and_then(|at| engine.document().timeline().cues().get(at));
        return Ok(Some(times.map_or(span, |cue| PlayedSpan {
            from: cue.go,
            to: cue.completion,
        })));
    }
    if let Some(from) = part.from {
        span.from = from.time(engine)?;
    }
    if let Some(to) = part.to {
        span.to = to.time(engine)?;
    }
    if span.to < span.from {
        return usage(format!(
            "{} is before {}: nothing is between them",
            span.to, span.from
        ));
    }
    Ok((part.from.is_some() || part.to.is_some()).then_some(span))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

    use super::*;
    use crate::Verb;
    use footlight_report::numbered::FrameFormat;

    fn of(line: &str) -> Result<Target, Error> {
        match Verb::parse(line)? {
            Verb::Play(asked) => target("play", &asked.output.unwrap().0, TargetOptions::default()),
            Verb::Film(asked) => target("film", &asked.output.0, asked.options()),
            Verb::Frames(asked) => target("frames", &asked.output.0, asked.options()),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn endings_and_options_choose() {
        assert!(matches!(of("film -o a.webm"), Ok(Target::Film(_))));
        assert!(matches!(
            of("film -o -"),
            Ok(Target::Video(None, Chroma::Quarter))
        ));
        assert!(matches!(
            of("film -o a.y4m --chroma 444"),
            Ok(Target::Video(Some(_), Chroma::Full))
        ));
        assert!(matches!(
            of("frames -o a##.exr --float"),
            Ok(Target::Numbered(_, FrameFormat::Exr(Precision::Float)))
        ));
        assert!(matches!(
            of("frames -o a.exr --layers banks"),
            Ok(Target::Layers(_, Layers::Banks, Precision::Half))
        ));
        for (line, said) in [
            ("play -o a.avi", "use a .mp4 or .webm (film), a .y4m"),
            ("film -o a", "numbered pictures"),
            ("film", "`film` needs `--output FILE`"),
            ("play -o a.mp4", "`film -o a.mp4`"),
            ("play -o -", "`film -o -`"),
            ("play -o f/####.png", "`frames -o f/####.png`"),
            ("film -o a.html", "`play -o a.html`"),
            ("film -o a.mp4 --chroma 444", "`--chroma` is for a .y4m"),
            ("frames -o a##.png --float", "`--float` is for an .exr"),
            ("frames -o a.exr --layers lamps", "keys, banks, basis"),
            ("film -o a.y4m --chroma 422", "420, 444"),
        ] {
            let error = of(line).unwrap_err().to_string();
            assert!(error.contains(said), "{line}: {error}");
        }
    }
}
