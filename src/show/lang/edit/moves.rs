//! Moves of one cue.

use std::ops::Range;

use super::change::{Action, Change, EditedText, Splice, step};
use super::place;
use super::sound;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::{Aim, Body, Cue, Declaration, Motion, Move, Span, Statement, Target, Word};
use crate::lang::codes;
use crate::lang::read::{self, Read};
use crate::lang::report::Report;
use crate::lang::scan::{Cut, Scan};
use crate::lang::token::{Token, tokens};
use crate::units::CueNumber;

/// Returns the text in which these moves replace the cue's moves of the same targets.
pub fn update_moves(
    source: &str,
    number: CueNumber,
    moves: &str,
) -> Result<EditedText, Vec<Diagnostic>> {
    let text = format!("cue {number} {{ {moves} }}");
    let (_, typed, report) = read::typed(&text)?;
    let (typed, _) = cue_of(&typed, &report).ok_or_else(|| vec![unread(number)])?;
    let mut now = source.to_owned();
    let mut change = None;
    for wanted in &typed.body.moves {
        let target = wanted
            .target
            .as_ref()
            .map_or("", |t| text.get(t.span.range()).unwrap_or(t.name.text));
        let level_end = wanted.aim.as_ref().map(|aim| aim.span.start);
        if level_end.is_none() || !matches!(wanted.motion, Motion::Bare) {
            let end = level_end.unwrap_or(wanted.span.end) as usize;
            let level = text.get(wanted.span.start as usize..end).unwrap_or("");
            let level = level.trim_end();
            let edited = |cue: &Cue<'_>| {
                let old = moved(cue, target)?;
                let until = old.aim.as_ref().map_or(old.span.end, |aim| aim.span.start);
                Some((old.span.start..until, level.to_owned()))
            };
            change = Some(step_in(&mut now, number, edited, level)?);
        }
        let Some(aim) = &wanted.aim else { continue };
        let edited = |cue: &Cue<'_>| {
            let old = all_moves(cue, target).find(|old| old.aim.is_some())?;
            let before = old.aim.as_ref()?;
            let merged = merged(before, aim);
            // Angles cannot follow a level.
            let is_alone = matches!(old.motion, Motion::Bare) || merged.starts_with("to ");
            let text = if is_alone {
                merged
            } else {
                format!(" {target} {merged}")
            };
            Some((before.span.start..before.span.end, text))
        };
        let whole = format!("{target} {}", text.get(aim.span.range()).unwrap_or(""));
        change = Some(step_in(&mut now, number, edited, &whole)?);
    }
    Ok(EditedText {
        source: now,
        changes: change.into_iter().collect(),
    })
}

/// Makes one move of a cue: replaces the text at the place that `edited` gives, or adds `written`.
fn step_in(
    now: &mut String,
    number: CueNumber,
    edited: impl Fn(&Cue<'_>) -> Option<(Range<u32>, String)>,
    written: &str,
) -> Result<Change, Vec<Diagnostic>> {
    let scan = sound(now)?;
    let (found, key) = place::resolve(&scan.cuts, &format!("cue {number}"))?;
    let mut report = Report::default();
    let read = only(now, scan.clone(), &mut report, |cut| cut == found);
    let cue = cue_of(&read, &report).ok_or_else(|| vec![unread(number)])?;
    let splice = match edited(cue.0) {
        Some((range, text)) => {
            let range = range.start as usize..range.end as usize;
            let old = now.get(range.clone()).unwrap_or("");
            Splice {
                range: range.start..range.start + old.trim_end().len(),
                text,
            }
        }
        None => added(now, cue, written),
    };
    let change = key.change(Action::Updated);
    step(now, splice)?;
    Ok(change)
}

/// Combines the aim `old` with `new`, which wins.
fn merged(old: &Aim<'_>, new: &Aim<'_>) -> String {
    let turns = |(word, _): &&(Word<'_>, Word<'_>)| matches!(word.text, "pan" | "tilt");
    let at = if new.at.is_empty() && !new.angles.iter().any(|angle| turns(&angle)) {
        &old.at
    } else {
        &new.at
    };
    let at: Vec<&str> = at.iter().map(|word| word.text).collect();
    let mut out = Vec::new();
    if !at.is_empty() {
        out.push(format!("to {}", at.join(", ")));
    }
    let is_said = |word: &str| new.angles.iter().any(|(new, _)| new.text == word);
    let kept = old.angles.iter();
    let kept = kept.filter(|old| !is_said(old.0.text) && (new.at.is_empty() || !turns(old)));
    let angles = kept.chain(&new.angles);
    out.extend(angles.map(|(axis, angle)| format!("{} {}", axis.text, angle.text)));
    out.join(" ")
}

/// The one cue read, and its span.
fn cue_of<'r, 'a>(read: &'r Read<'a>, report: &Report) -> Option<(&'r Cue<'a>, Span)> {
    match read.statements.as_slice() {
        [
            Statement {
                item: Declaration::Cue(cue),
                span,
                ..
            },
        ] if !report.failed() => Some((cue, *span)),
        _ => None,
    }
}

/// Reads some of the statements.
fn only<'a>(
    source: &'a str,
    mut scan: Scan<'a>,
    report: &mut Report,
    wanted: impl Fn(&Cut<'_>) -> bool,
) -> Read<'a> {
    scan.cuts.retain(|cut| wanted(cut));
    read::read(source, 0, &scan, report)
}

fn unread(number: CueNumber) -> Diagnostic {
    let message = format!("cue {number} has errors of its own");
    Diagnostic::error(codes::SYNTAX, message).help("mend it first; `check` shows where")
}

/// The move that sets the level or the colour of the target written so.
fn moved<'m, 'a>(cue: &'m Cue<'a>, target: &str) -> Option<&'m Move<'a>> {
    let has_level = |m: &&Move<'_>| m.aim.is_none() || !matches!(m.motion, Motion::Bare);
    all_moves(cue, target).find(has_level)
}

/// All moves of the target written so.
fn all_moves<'m, 'a>(cue: &'m Cue<'a>, target: &str) -> impl Iterator<Item = &'m Move<'a>> {
    let parts = cue.body.parts.iter().flat_map(|part| &part.body.moves);
    let same = move |written: &Target<'_>| match written.channel {
        None => written.name.text == target,
        Some(channel) => target.split_once('.') == Some((written.name.text, channel.text)),
    };
    let found = cue.body.moves.iter().chain(parts);
    found.filter(move |m| m.target.as_ref().is_some_and(same))
}

/// Adds a move: on a new line after the last move that has its own line, otherwise on the line of
/// the last move.
fn added(source: &str, (cue, span): (&Cue<'_>, Span), written: &str) -> Splice {
    // Moves directly in a cue are its part 1, which may also be written as a part.
    let first = cue.body.parts.iter().find(|p| p.number.text == "1");
    let (body, span) = match first.filter(|_| cue.body.moves.is_empty()) {
        Some(part) => (&part.body, part.span),
        None => (&cue.body, span),
    };
    let (end_of_line, brace) = (place::end_of_line(source), span.end as usize - 1);
    let inserted = |at: usize, text: String| Splice {
        range: at..at,
        text,
    };
    if let Some(last) = body.moves.last() {
        let end = end_of(last);
        let line = place::after_line(source, end);
        let rest = tokens(source.get(end..line).unwrap_or(""));
        let alone = rest.iter().all(|(_, token)| *token == Token::Comment);
        let indent = place::indent(source, last.span.start as usize);
        if let Some(indent) = indent.filter(|_| alone) {
            return inserted(line, format!("{indent}{written}{end_of_line}"));
        }
        return inserted(end, format!("  {written}"));
    }
    match place::indent(source, brace) {
        Some(indent) => {
            let at = place::line_start(source, brace);
            inserted(at, format!("{indent}  {written}{end_of_line}"))
        }
        None => beside_brace(source, body, brace, written),
    }
}

/// Adds a move before a closing brace that shares its line with other text.
fn beside_brace(source: &str, body: &Body<'_>, brace: usize, written: &str) -> Splice {
    let before = source.get(..brace).unwrap_or("");
    let end = before.trim_end().len();
    let empty = body.timing.is_empty() && body.marks.is_empty() && body.parts.is_empty();
    let gap = if empty { " " } else { "  " };
    Splice {
        range: end..brace,
        text: format!("{gap}{written} "),
    }
}

/// End of a move, including its timing.
fn end_of(last: &Move<'_>) -> usize {
    last.timing.last().map_or(last.span, |t| t.span).end as usize
}

#[cfg(test)]
mod tests {
    use crate::lang::edit::{Edit, apply};
    use crate::units::CueNumber;

    #[test]
    fn an_update_keeps_what_it_does_not_say_of_a_head() {
        let updated = |body: &str, moves: &str| {
            let source = format!("cue 1 {{ {body} }}\n");
            let edit = Edit::UpdateMoves {
                cue: CueNumber::parse("1").unwrap(),
                moves: moves.to_owned(),
            };
            let text = apply(&source, &edit).unwrap().source;
            let text = text.trim_end().trim_end_matches('}').trim_end();
            text.trim_start_matches("cue 1 {").trim_start().to_owned()
        };
        for (body, moves, wanted) in [
            (
                "heads 80 to band  time 3",
                "heads to house",
                "heads 80 to house  time 3",
            ),
            (
                "heads 80 to band  time 3",
                "heads 60",
                "heads 60 to band  time 3",
            ),
            (
                "heads 80 to band",
                "heads out to 1, 2, 0",
                "heads out to 1, 2, 0",
            ),
            ("heads 80", "heads to band", "heads 80  heads to band"),
            ("heads to band", "heads 80", "heads to band  heads 80"),
            (
                "mh1 to band beam 6",
                "mh1 field 9 beam 5",
                "mh1 to band field 9 beam 5",
            ),
            (
                "mh1 pan 30 tilt -20 beam 6",
                "mh1 to band",
                "mh1 to band beam 6",
            ),
            (
                "mh1 to band beam 6",
                "mh1 pan 30 tilt -20",
                "mh1 beam 6 pan 30 tilt -20",
            ),
            (
                "heads 80 to band",
                "heads pan 3 tilt 4",
                "heads 80  heads pan 3 tilt 4",
            ),
        ] {
            assert_eq!(updated(body, moves), wanted);
        }
    }
}
