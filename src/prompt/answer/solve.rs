//! Levels from a picture or an illuminance.

use std::path::Path;

use clap::{Args, ValueHint};

use super::usage;
use crate::argument::{FromView, Output, check_cue, number};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine::solve::{self, Solved};
use footlight_engine::{LiveControl, Moves};
use footlight_report::format::DRAWING;
use footlight_report::{self as report, solved as words};
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::units::CueNumber;

/// What `solve` solves for.
#[derive(Args, Clone, Debug)]
pub struct Solve {
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

/// Finds levels and tries them, at the current moment or after going to a cue.
pub fn solve(repl: &mut Repl, asked: &Solve) -> Result<Reply, Error> {
    let path = repl.optional_output(asked.output.as_ref(), &DRAWING)?;
    let mut live = repl.live.clone();
    if let Some(cue) = asked.cue {
        check_cue(&repl.engine, cue)?;
        live.goto(repl.engine.document(), cue, None)?;
    }
    let words: Vec<&str> = asked.words.iter().map(String::as_str).collect();
    match words[..] {
        ["lux", ..] if asked.any_exposure || path.is_some() => {
            usage("`--any-exposure` and `-o` are for a picture")
        }
        ["lux", lux, "at", ..] => {
            let lux = lux
                .parse()
                .ok()
                .filter(|lux: &f64| lux.is_finite() && *lux > 0.0);
            let lux = lux.ok_or_else(|| Error::Usage(EXAMPLE.to_owned()))?;
            let (points, banks) = points(&words);
            if points.is_empty() {
                return usage(EXAMPLE);
            }
            let found = solve::illuminance(&mut repl.engine, &live, lux, &points, &banks)?;
            let names: Vec<String> = points.into_iter().map(|(name, _)| name).collect();
            let tried = tried(repl, live, &found.solved)?;
            Ok(Reply::text(words::of_illuminance(&names, &found) + &tried))
        }
        ["lux", ..] | [] => usage(EXAMPLE),
        [file, ref banks @ ..] => {
            let banks: Vec<String> = banks.iter().map(ToString::to_string).collect();
            let sketch = Path::new(file);
            if let Some(path) = path.filter(|path| footlight_host::files::is_same(sketch, path)) {
                return Err(report::Error::ShowsFile(path.to_owned()).into());
            }
            let any = asked.any_exposure;
            let found = solve::sketched(&mut repl.engine, &live, sketch, &banks, any)?;
            let tone = repl.engine.tone()?;
            let title = format!("{}: {file}", repl.engine.show().title);
            let drawing = words::drawing(&title, &found, tone).map_err(report::Error::from)?;
            let text = words::of_sketch(file, &found);
            // A file that cannot be written leaves all as it was.
            let written = repl.drawing(&drawing, path, text)?;
            let tried = tried(repl, live, &found.solved)?;
            let mut reply = written;
            reply.text.push(&tried);
            Ok(reply)
        }
    }
}

const EXAMPLE: &str = "say what to come near to: `solve sketch.png`, `solve sketch.png warm cyc`, \
    `solve lux 500 at 2,1,0`";

/// The points behind `lux 500 at`, and the names behind those.
fn points(words: &[&str]) -> (Vec<(String, Vec3)>, Vec<String>) {
    let point = |word: &&&str| {
        let parts: Vec<f64> = word
            .split(',')
            .map_while(|part| part.parse().ok())
            .collect();
        match parts[..] {
            [x, y, z] if word.matches(',').count() == 2 => Some((word.to_string(), vec3(x, y, z))),
            _ => None,
        }
    };
    let behind = words.get(3..).unwrap_or_default();
    let points: Vec<(String, Vec3)> = behind.iter().map_while(|word| point(&word)).collect();
    let names = behind.iter().skip(points.len()).map(ToString::to_string);
    (points, names.collect())
}

/// Tries the levels that change, in place of those that are tried; what there is to say of it.
fn tried(repl: &mut Repl, mut live: LiveControl, solved: &Solved) -> Result<String, Error> {
    let document = repl.engine.document();
    let text = if solved.moves.is_empty() {
        "no level changes: nothing comes nearer than what stands\n".to_owned()
    } else {
        let files = repl.engine.host().files.as_ref();
        live.set(document, Moves::read(document, &solved.moves, files)?)?;
        let moves = live.tried().join("  ");
        format!("trying {moves}\n`record NUMBER \"LABEL\"` keeps it, `release` lets go\n")
    };
    repl.live = live;
    Ok(text)
}
