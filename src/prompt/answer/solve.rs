//! Levels for a sketch or an illuminance.

use std::ffi::OsString;
use std::path::Path;

use clap::{Args, ValueHint};

use super::help::wrapped;
use super::usage;
use crate::argument::{FromView, Output, check_cue, number};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine::Moves;
use footlight_engine::solve;
use footlight_host::files::is_same;
use footlight_report::format::DRAWING;
use footlight_report::{self as report, solved as words};
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::units::CueNumber;

/// The target to solve for.
#[derive(Args, Clone, Debug)]
pub struct SolveArgs {
    #[arg(value_name = "FILE [BANK…] | lux N at X,Y,Z [BANK…]")]
    words: Vec<String>,
    /// At the end of this cue (default: at the current moment)
    #[arg(long, value_name = "N", value_parser = number)]
    cue: Option<CueNumber>,
    /// Take a PNG or JPEG at whichever exposure fits best
    #[arg(long)]
    any_exposure: bool,
    #[command(flatten)]
    pub(crate) from: FromView,
    /// Write sketch, picture and difference as a .png or an .svg
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<Output>,
}

const EXAMPLE: &str = "say what to come near to: `solve sketch.png`, `solve sketch.png warm cyc`, \
    `solve lux 500 at 2,1,0`";

/// Finds levels and tries them, at the current moment or after going to a cue.
pub fn solve(repl: &mut Repl, asked: &SolveArgs) -> Result<Reply, Error> {
    let path = repl.optional_output(asked.output.as_ref(), &DRAWING)?;
    let mut live = repl.live.clone();
    if let Some(cue) = asked.cue {
        check_cue(&repl.engine, cue)?;
        live.goto(repl.engine.document(), cue, None)?;
    }
    let words: Vec<&str> = asked.words.iter().map(|word| word.trim()).collect();
    let (mut reply, solved) = match words[..] {
        ["lux", lux, "at", ref behind @ ..] if !asked.any_exposure && path.is_none() => {
            let lux = lux
                .parse()
                .ok()
                .filter(|lux: &f64| lux.is_finite() && *lux > 0.0);
            let points: Vec<Vec3> = behind.iter().map_while(|word| point(word)).collect();
            let (Some(lux), false) = (lux, points.is_empty()) else {
                return usage(EXAMPLE);
            };
            let (named, banks) = behind.split_at(points.len());
            let points: Vec<(&str, Vec3)> = named.iter().copied().zip(points).collect();
            let found = solve::illuminance(&mut repl.engine, &live, lux, &points, banks)?;
            (
                Reply::text(words::of_illuminance(lux, named, &found)),
                found.solved,
            )
        }
        ["lux", ..] | [] => return usage(EXAMPLE),
        [file, ref banks @ ..] => {
            if let Some(path) = path.filter(|path| is_same(Path::new(file), path)) {
                return Err(report::Error::ShowsFile(path.to_owned()).into());
            }
            let sketch = Path::new(file);
            let found =
                solve::sketched(&mut repl.engine, &live, sketch, banks, asked.any_exposure)?;
            let title = format!("{}: {file}", repl.engine.show().title);
            let drawing = words::drawing(&title, &found, repl.engine.tone()?);
            let drawing = drawing.map_err(report::Error::from)?;
            (
                repl.drawing(&drawing, path, words::of_sketch(file, &found))?,
                found.solved,
            )
        }
    };
    // From here on nothing fails that could leave the moment changed.
    let document = repl.engine.document();
    if solved.moves.is_empty() {
        reply
            .text
            .push("nothing changes: no level comes nearer than what stands\n");
    } else {
        let files = repl.engine.host().files.as_ref();
        live.set(document, Moves::read(document, &solved.moves, files)?)?;
        let tried = wrapped(live.tried().join("  ").split("  "), 7);
        let said =
            format!("trying {tried}\n`record NUMBER \"LABEL\"` keeps it, `release` lets go\n");
        reply.text.push(&said);
    }
    repl.live = live;
    Ok(reply)
}

/// Parses `2,1,0`.
pub(super) fn point(word: &str) -> Option<Vec3> {
    let parts: Vec<Option<f64>> = word.split(',').map(|part| part.parse().ok()).collect();
    match parts[..] {
        [Some(x), Some(y), Some(z)] => Some(vec3(x, y, z)),
        _ => None,
    }
}

/// Protects a word of a line: a point that begins with a minus would be taken for an option, and
/// gets a blank before it.
pub fn spared(word: OsString) -> OsString {
    match word.to_str() {
        Some(text) if text.starts_with('-') && point(text).is_some() => format!(" {text}").into(),
        _ => word,
    }
}
