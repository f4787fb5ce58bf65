//! One picture.

use super::usage;
use crate::argument::{precision, quality, time, time_of};
use crate::{Call, Error, Repl, Reply};
use footlight_engine::UnlitBank;
use footlight_picture::Image;
use footlight_picture::tone::{self, Tone};
use footlight_report::film::Shown;
use footlight_report::format::{self, PICTURE, ending};
use footlight_report::words::count;

pub fn picture(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let said = [!call.words.is_empty(), call.has("at"), call.has("cue")];
    if said.iter().filter(|said| **said).count() > 1 {
        if let (Some(cue), false) = (call.option("cue"), call.words.is_empty()) {
            let behind = call.words().join(" ");
            return usage(format!(
                "a picture is of one moment: say it in quotes, `picture 'cue {cue} {behind}'`"
            ));
        }
        return usage("a picture is of one moment: say one time");
    }
    let now = repl.live.time();
    let moment = match (
        call.option("at"),
        call.option("cue"),
        call.words().as_slice(),
    ) {
        (Some(text), ..) => time(&repl.engine, text)?,
        (None, Some(number), _) => time_of(&repl.engine, &["cue", number])?,
        (None, None, []) => now,
        (None, None, words) => time_of(&repl.engine, words)?,
    };
    let setting = match call.option("bank") {
        Some(name) => repl.engine.document().alone(name)?,
        None if moment == now => repl.live.setting(repl.engine.document()),
        None => repl.engine.document().setting(moment),
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
    let path = call.path("output");
    // An .exr is light, which no exposure changes.
    let shown = path.is_none_or(|p| ending(p) != "exr");
    let tone = shown.then(|| exposed(repl, call, &image)).transpose()?;
    let exposure = match tone {
        _ if is_dark(repl, call, &image) => ", dark: no light in sight".to_owned(),
        Some(tone) => format!(", exposure {:.2}{}", tone.exposure, chosen(repl, call)),
        None => String::new(),
    };
    let text = format!("{what}: {}{exposure}{below}", made_of(repl, call));
    let tone = tone.unwrap_or_else(|| repl.engine.document().tone_at(0.0));
    if call.has("float") && path.is_none_or(|p| ending(p) != "exr") {
        return usage("`--float` is for an .exr");
    }
    match path {
        Some(p) => {
            PICTURE.check(p)?;
            let about = (precision(call), text.as_str());
            let bytes = format::picture(&image, || Ok(tone), about, p)?;
            repl.written(p, &bytes, &text)
        }
        None => {
            let size = (image.width(), image.height());
            let rgb = tone.encode(&image);
            Ok(Reply::pictured(Shown { size, rgb }, text))
        }
    }
}

/// What the picture was made of.
fn made_of(repl: &Repl, call: &Call) -> String {
    if let Some(text) = call.option("quality") {
        return format!("quality {text}");
    }
    if repl.engine.estimate().is_final() {
        return "the sum of the banks".to_owned();
    }
    match repl.engine.estimate().refined() {
        0 => "coarse alone, nothing refined yet".to_owned(),
        n => format!("coarse, and {}", count(n, "refined picture")),
    }
}

/// Whether nothing of a picture, or of a bank alone, can be seen.
fn is_dark(repl: &mut Repl, call: &Call, image: &Image) -> bool {
    let unlit = |name: &str| {
        UnlitBank::find(&mut repl.engine)
            .iter()
            .any(|b| b.name == name)
    };
    image.data().iter().all(|light| *light <= 0.0) || call.option("bank").is_some_and(unlit)
}

/// How the exposure came about, where it was not set.
fn chosen(repl: &Repl, call: &Call) -> &'static str {
    match call.has("exposure") || repl.engine.show().preview.exposure.is_some() {
        true => "",
        false if of_picture(repl, call) => " (auto, for this picture)",
        false => " (auto)",
    }
}

/// True for what is exposed by itself, as no sequence shows it.
fn of_picture(repl: &Repl, call: &Call) -> bool {
    call.has("bank") || repl.engine.show().cues.is_empty()
}

/// The exposure that is said, else that of the whole sequence, so that pictures of different moments
/// compare. A bank alone and a show without cues are exposed for the picture itself.
fn exposed(repl: &mut Repl, call: &Call, image: &Image) -> Result<Tone, Error> {
    if let Some(text) = call.option("exposure") {
        let stops = text.parse::<f64>().ok();
        let stops = stops.filter(|stops| (-30.0..=30.0).contains(stops));
        let stops = stops.ok_or_else(|| {
            Error::Usage(format!("`{text}` is no exposure: it is -30 to 30 stops"))
        })?;
        return Ok(repl.engine.document().tone_at(stops));
    }
    if of_picture(repl, call) {
        Ok(repl.engine.document().tone_of([image]))
    } else {
        Ok(repl.engine.tone()?)
    }
}
