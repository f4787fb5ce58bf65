//! Hover text: banks with their level over the show, cues with their moves, numbers with their
//! meaning.

use std::fmt::Write as _;
use std::ops::Range;

use super::open_show::{OpenShow, name_at, statement_at};
use footlight_engine::Document;
use footlight_prompt::{help_of, help_of_word};
use footlight_show::lang::{self, Token};
use footlight_show::model::{Haze, Motion, Role, Show};
use footlight_show::timeline::{CueTime, tracked};
use footlight_show::units::{CueNumber, Time, percent};

/// Columns of the chart of a level over the show.
const COLUMNS: i64 = 48;

/// Most names listed in one line.
const LISTED: usize = 12;

/// Markdown about the word at a place, and the word's bytes.
pub fn hover(show: &OpenShow, text: &str, at: usize) -> Option<(String, Range<usize>)> {
    if let Some(range) = name_at(text, at) {
        let name = text.get(range.clone())?;
        if let Some(words) = of_name(show, name) {
            return Some((words, range));
        }
    }
    let statement = statement_at(text, at)?;
    let (text, start) = (text.get(statement.clone())?, statement.start);
    let at = at - start;
    let tokens = lang::tokens(text);
    let i = tokens.partition_point(|(range, _)| range.end <= at);
    let (range, token) = tokens.get(i)?;
    let word = text.get(range.clone()).filter(|_| range.start <= at)?;
    let before = i.checked_sub(1).and_then(|i| tokens.get(i));
    let before = before.and_then(|(range, _)| text.get(range.clone()));
    let statement = text.split_whitespace().next().unwrap_or("");
    let words = match token {
        Token::Statement if i == 0 => {
            let number = tokens.get(i + 1).and_then(|(n, _)| text.get(n.clone()));
            let cue = number.filter(|_| word == "cue");
            let cue = cue.and_then(|number| of_cue(show.document()?, number));
            cue.or_else(|| Some(code(&help_of(word).ok()?)))?
        }
        Token::Quantity if before == Some("cue") => of_cue(show.document()?, word)?,
        Token::Quantity if before == Some("haze") => {
            format!("`{word}`: {}", of_haze(&show.document()?.show().haze?))
        }
        Token::Quantity => format!("`{word}`: {}", of_quantity(word, before, statement)?),
        Token::Colour => {
            let own = of_name(show, word.trim_start_matches('#'));
            own.or_else(|| of_colour(word))?
        }
        Token::Text if before == Some("lantern") => {
            let found = lang::lanterns().find(|lantern| lantern.name == word.trim_matches('"'))?;
            format!("{}\n\n{}", found.words(), found.source)
        }
        Token::Name | Token::Text => of_material(show, word.trim_matches('"'))?,
        Token::Word | Token::Statement => {
            let (usage, meaning) = help_of_word(statement, word)?;
            format!("`{usage}`\n\n{meaning}")
        }
        _ => return None,
    };
    Some((words, start + range.start..start + range.end))
}

fn code(text: &str) -> String {
    format!("```text\n{}\n```", text.trim_end())
}

/// Text about a name: its statement, and for a bank its level over the show.
fn of_name(show: &OpenShow, name: &str) -> Option<String> {
    let (text, place) = show.declaration_of(name)?;
    let own = text.get(statement_at(text, place.range.start)?)?;
    let mut out = format!("```lxq\n{own}\n```");
    let found = show.document().and_then(|document| {
        let mut banks = document.show().banks.iter();
        Some((document, banks.position(|b| b.name == name)?))
    });
    let Some((document, index)) = found else {
        return Some(out);
    };
    if let Some(channel) = document.show().banks.get(index).and_then(|b| b.channel) {
        let _ = write!(out, "\n\nchannel {channel}");
    }
    let _ = write!(out, "\n\n{}", level_over_the_show(document, index)?);
    Some(out)
}

/// Reflectance of a material of the stage.
fn of_material(show: &OpenShow, name: &str) -> Option<String> {
    let materials = &show.document()?.setup()?.scene.materials;
    let material = materials.iter().find(|material| material.name == name)?;
    let gloss = material.gloss.as_ref();
    let metal = gloss.filter(|gloss| gloss.is_metal);
    let reflectance = metal.map_or(material.reflectance, |metal| metal.normal);
    let [r, g, b] = reflectance.0.map(|c| percent(c).round());
    let gloss = gloss.map(|gloss| format!("; gloss of roughness {:.2}", gloss.roughness));
    let gloss = gloss.unwrap_or_default();
    Some(format!(
        "material of the stage: reflects {r} % of red, {g} % of green, {b} % of blue{gloss}"
    ))
}

/// The level of a bank from start to end, as a row of bars.
fn level_over_the_show(document: &Document, bank: usize) -> Option<String> {
    const BARS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let parameters = document.show().parameters();
    let own = parameters.iter().position(|p| p.bank == Some(bank))?;
    let timeline = document.timeline();
    let (start, end) = (timeline.start(), timeline.end());
    let length = end.micros() - start.micros();
    let mut bars = String::new();
    let mut highest = 0.0_f64;
    for column in 0..COLUMNS {
        let at = Time::from_micros(start.micros() + length * column / (COLUMNS - 1));
        let level = timeline.levels(at).get(own).copied()?;
        highest = highest.max(level);
        let bar = (level.clamp(0.0, 1.0) * 8.0).round() as usize;
        bars.push(BARS.get(bar).copied().unwrap_or(' '));
    }
    let highest = percent(highest).round();
    Some(format!(
        "```text\n{bars}\n```\nlevel from {start} to {end}, at most {highest} %"
    ))
}

/// Times of a cue, its moves, and the parameters that track through it.
fn of_cue(document: &Document, number: &str) -> Option<String> {
    let number = CueNumber::parse(number)?;
    let show = document.show();
    let index = show.cues.iter().position(|cue| cue.number == number)?;
    let (cue, time) = (
        show.cues.get(index)?,
        document.timeline().cues().get(index)?,
    );
    let mut out = format!("**cue {number}**");
    if !cue.label.is_empty() {
        let _ = write!(out, " {}", escaped(&cue.label));
    }
    let _ = write!(
        out,
        "\n\nGO {}{}, complete {}",
        time.go,
        assumed(time),
        time.completion
    );
    let (moved, tracked) = moved_and_tracked(show, index);
    let list = |out: &mut String, what: &str, names: &[String]| {
        if !names.is_empty() {
            let more = names.len().saturating_sub(LISTED);
            let some = names.get(..names.len() - more).unwrap_or(names).join(", ");
            let more = if more > 0 {
                format!(" and {more} more")
            } else {
                String::new()
            };
            let _ = write!(out, "\n\n{what} {some}{more}");
        }
    };
    list(&mut out, "moves", &moved);
    list(&mut out, "tracks through", &tracked);
    if !cue.note.is_empty() {
        let _ = write!(out, "\n\n{}", escaped(&cue.note));
    }
    Some(out)
}

fn assumed(time: &CueTime) -> &'static str {
    if time.assumed { " (assumed)" } else { "" }
}

/// The parameters that a cue moves, and the lit ones that track. Fixed lights are neither.
fn moved_and_tracked(show: &Show, cue: usize) -> (Vec<String>, Vec<String>) {
    let levels = tracked(show).ok().and_then(|mut levels| levels.nth(cue));
    let levels = levels.unwrap_or_default();
    let moves = show.cues.get(cue).into_iter().flat_map(|cue| &cue.parts);
    let moves: Vec<_> = moves.flat_map(|part| &part.moves).collect();
    let heads = show.heads();
    let (mut moved, mut tracked) = (Vec::new(), Vec::new());
    for (i, (parameter, level)) in show.parameters().iter().zip(&levels).enumerate() {
        let own = moves.iter().find(|m| m.parameter == i);
        let name = escaped(&parameter.name);
        let level = match parameter.role {
            Role::Pose(head, axis) => heads.get(head).map_or(0.0, |(_, head, _)| {
                (10.0 * head.degrees(axis, *level)).round() / 10.0
            }),
            _ => percent(*level).round(),
        };
        match own.map(|own| &own.motion) {
            Some(Motion::Path(_)) => moved.push(format!("{name} along a path")),
            Some(_) => moved.push(format!("{name} {level}")),
            None if level > 0.0 && parameter.role == Role::Level => {
                tracked.push(format!("{name} {level}"));
            }
            None => {}
        }
    }
    (moved, tracked)
}

/// Escapes a label for Markdown.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if c.is_ascii_punctuation() {
            out.push('\\');
        }
        out.push(if c.is_control() { ' ' } else { c });
    }
    out
}

/// Meaning of a number by its unit, or by the word before it and the statement.
pub fn of_quantity(word: &str, before: Option<&str>, statement: &str) -> Option<&'static str> {
    let unit = word.trim_start_matches(|c: char| c.is_ascii_digit() || ".-+:".contains(c));
    let is_level = |before: &str| {
        let is_name = before.starts_with(char::is_alphabetic) && !lang::words().contains(&before);
        before == "level" || (["cue", "look"].contains(&statement) && (before == "to" || is_name))
    };
    Some(match unit.trim() {
        "s" => "seconds",
        "ms" => "milliseconds",
        "m" => "metres",
        "cm" => "centimetres",
        "mm" => "millimetres",
        "ft" => "feet, 0.3048 m each",
        "in" => "inches, 25.4 mm each",
        "deg" => "degrees",
        "cd" => "candela: luminous intensity along the axis",
        "cd/m2" => "candela a square metre: luminance",
        "lm" => "lumen: luminous flux in all directions",
        "K" => "kelvin: the colour of a black body so hot",
        "%" => "percent",
        "" if word.contains(':') => "minutes and seconds",
        "" => match before? {
            "at" if statement != "cue" => "metres",
            "time" | "up" | "down" | "delay" | "follow" | "hang" | "at" => "seconds",
            "beam" | "field" | "fov" | "turn" | "pan" | "tilt" | "zoom" => "degrees",
            "speed" => "degrees a second",
            "channel" => "a desk's channel",
            "repeat" => "times",
            before if is_level(before) => "percent",
            before if before.ends_with('x') => "pixels high",
            _ => return None,
        },
        "x" => "pixels wide",
        "p" => "pixels high, 16 wide for 9 high",
        "k" => "3840 pixels wide, 2160 high",
        _ => return None,
    })
}

/// Least visibilities, metres, that count as a touch of haze, and as haze of a concert.
const HAZES: [(f64, &str); 2] = [(140.0, "a touch of haze"), (35.0, "haze as on a concert")];

/// Visibility, extinction and density of haze.
fn of_haze(haze: &Haze) -> String {
    let visibility = haze.visibility();
    let mut hazes = HAZES.into_iter();
    let word = hazes.find(|(least, _)| visibility >= *least);
    let word = word.map_or("fog", |(_, word)| word);
    let metres = significant(visibility);
    let extinction = significant(haze.extinction);
    format!("visibility {metres} m = extinction {extinction}/m, {word}")
}

/// A number with three significant digits.
fn significant(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

/// A colour in linear light.
fn of_colour(word: &str) -> Option<String> {
    let colour = lang::colour(word)?;
    let [r, g, b] = colour.0.map(|c| (c * 1000.0).round() / 10.0);
    Some(format!(
        "`{word}`: sRGB; in linear light {r} % red, {g} % green, {b} % blue"
    ))
}
