//! One picture.

use super::usage;
use crate::picture::Image;
use crate::picture::tone::{self, Tone};
use crate::repl::argument::{precision, quality, time};
use crate::repl::{Call, Error, Repl, Reply};
use crate::report::film::Shown;
use crate::report::format::{self, PICTURE, ending};
use crate::report::words::count;

pub fn picture(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    if call.words.len() + usize::from(call.has("at")) > 1 {
        return usage("a picture is of one moment: say one time");
    }
    let now = repl.live.time();
    let moment = match call.option("at").or(call.words().first().copied()) {
        Some(text) => time(&repl.engine, text)?,
        None => now,
    };
    let setting = match call.option("bank") {
        Some(name) => repl.engine.alone(name)?,
        None if moment == now => repl.live.setting(repl.engine.document()),
        None => repl.engine.setting(moment),
    };
    let image = match call.option("quality") {
        Some(text) => {
            let quality = quality(&repl.engine, text)?;
            repl.engine.render(&setting, quality)?
        }
        None => repl.engine.picture_of(&setting)?,
    };
    let what = match call.option("bank") {
        Some(name) => format!("{name} alone at full"),
        None => format!("{moment}"),
    };
    let below = match tone::negative(&image) {
        0 => String::new(),
        n => format!("; {} a little below zero, shown as 0", count(n, "value")),
    };
    let text = format!("{what}: {}{below}", made_of(repl, call));
    let path = call.path("output");
    if call.has("float") && path.is_none_or(|p| ending(p) != "exr") {
        return usage("`--float` is for an .exr");
    }
    match path {
        Some(p) => {
            PICTURE.check(p)?;
            let about = (precision(call), text.as_str());
            let bytes = format::picture(&image, || exposed(repl, &image), about, p)?;
            repl.written(p, &bytes, &text)
        }
        None => {
            let size = (image.width(), image.height());
            let rgb = exposed(repl, &image)?.encode(&image);
            Ok(Reply::pictured(Shown { size, rgb }, text))
        }
    }
}

/// What the picture was made of.
fn made_of(repl: &Repl, call: &Call) -> String {
    if let Some(text) = call.option("quality") {
        return format!("quality {text}");
    }
    if repl.engine.is_final() {
        return "the sum of the banks".to_owned();
    }
    match repl.engine.refined() {
        0 => "coarse alone, nothing refined yet".to_owned(),
        n => format!("coarse, and {}", count(n, "refined picture")),
    }
}

/// The exposure of the whole sequence, so that pictures of different moments compare; a show without
/// cues is exposed for the picture itself.
fn exposed(repl: &mut Repl, image: &Image) -> Result<Tone, crate::report::Error> {
    match repl.engine.show().cues.is_empty() {
        true => Ok(repl.engine.tone_of([image])),
        false => Ok(repl.engine.tone()?),
    }
}
