//! Cues: numbers, triggers, parts, timing, moves.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::Lower;
use super::levels::Breadth;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::{self, Body, Declaration, Mark, Span, Statement, Timing, TimingKind, Word};
use crate::lang::quote::unquoted;
use crate::lang::report::Place;
use crate::lang::{codes, limits};
use crate::model::{Cue, Fade, Link, Move, NodeId, Part, Trigger};
use crate::units::{CueNumber, Time};

/// The timing in force.
#[derive(Clone, Copy, Debug)]
struct Times {
    delay: Time,
    up: Time,
    down: Time,
    /// True for a time, up or down, that is the show's default.
    by_default: [bool; 2],
    curve: Fade,
    repeat: u32,
}

/// A move of a parameter in a cue.
#[derive(Clone, Copy)]
struct Claim {
    id: NodeId,
    span: Span,
    breadth: Breadth,
}

/// Parameters that a cue moves.
type Moved = BTreeMap<usize, Claim>;

impl<'a> Lower<'a, '_> {
    /// Lowers `default` and the cues.
    pub fn cues(&mut self, statements: &[Statement<'a>]) {
        let standard = Times {
            delay: Time::ZERO,
            up: Time::from_micros(5_000_000),
            down: Time::from_micros(5_000_000),
            by_default: [true; 2],
            curve: Fade::LINEAR,
            repeat: 1,
        };
        let (mut times, mut first) = (standard, None);
        for statement in statements {
            if let Declaration::Default(timing) = &statement.item {
                self.once(&mut first, "default time", statement.span);
                times = self.times(&[*timing], standard);
                times.by_default = [true; 2];
            }
        }
        let mut numbers: BTreeMap<CueNumber, Span> = BTreeMap::new();
        for statement in statements {
            if self.report.full() {
                return;
            }
            let Declaration::Cue(cue) = &statement.item else {
                continue;
            };
            let (place, number) = (cue.number.span, self.cue_number(cue.number));
            let header = headed(statement.span, cue.number);
            let Some(cue) = self.cue(cue, header, number, times) else {
                continue;
            };
            if let Some(earlier) = numbers.insert(cue.number, place) {
                self.same_number(cue.number, place, earlier);
            }
            self.show.cues.push(cue);
        }
        self.show.cues.sort_by_key(|c| c.number);
        self.aim_heads();
    }

    fn cue_number(&mut self, word: Word<'a>) -> Option<CueNumber> {
        let number = CueNumber::parse(word.text);
        if number.is_none() {
            let message = format!("`{}` is not a cue number", word.text);
            let help = "cue numbers are 0.001 to 9999.999, with three decimals at most: `cue 2.5`";
            self.report.error::<()>(
                codes::CUE_NUMBER,
                message,
                (word.span, "not a cue number"),
                help,
            );
        }
        number
    }

    fn same_number(&mut self, number: CueNumber, again: Span, earlier: Span) {
        self.report.add(
            Diagnostic::error(codes::CUE_TWICE, format!("there are two cues {number}"))
            .place(again, "again here")
            .place(earlier, "first here")
                .help("give one of them another number; between two cues there is room, as 2.5 between 2 and 3"),
        );
    }

    fn cue(
        &mut self,
        cue: &ast::Cue<'a>,
        span: Span,
        number: Option<CueNumber>,
        times: Times,
    ) -> Option<Cue> {
        let id = self.node(span);
        let trigger = match cue.at {
            Some(word) => Trigger::At(self.duration(word).unwrap_or_default()),
            None => Trigger::Go,
        };
        let link = self.link(&cue.body);
        let parts = self.parts(cue, id, times);
        let has = |mark: Mark| cue.body.marks.iter().any(|(m, ..)| *m == mark);
        Some(Cue {
            id,
            number: number?,
            label: cue.label.map(unquoted).unwrap_or_default(),
            note: self.note(&cue.body),
            trigger,
            link,
            block: has(Mark::Block),
            assert: has(Mark::Assert),
            cueonly: has(Mark::Cueonly),
            parts,
        })
    }

    /// Joins the notes for the operator.
    fn note(&mut self, body: &Body<'a>) -> String {
        if let [(_, first), (_, second), ..] = body.notes.as_slice() {
            self.once(&mut Some(*first), "note", *second);
        }
        let first = body.notes.first();
        first.map(|(text, _)| unquoted(*text)).unwrap_or_default()
    }

    /// Returns `follow` or `hang`, after a check of all marks of the body.
    fn link(&mut self, body: &Body<'a>) -> Option<(NodeId, Link)> {
        let mut link: Option<(NodeId, Link)> = None;
        let mut first: Option<(Mark, Span)> = None;
        for (i, (mark, value, span)) in body.marks.iter().enumerate() {
            if let Some((.., earlier)) = body.marks.iter().take(i).find(|(m, ..)| m == mark) {
                self.once(&mut Some(*earlier), word_of(*mark), *span);
                return link;
            }
            if *mark == Mark::At {
                let message = "`at` stands before the brace";
                let is_level = |text: &&str| text.trim_end_matches('%').parse::<f64>().is_ok();
                let level = value
                    .map(|value| value.text)
                    .filter(is_level)
                    .unwrap_or("50");
                let help = format!(
                    "a level has no `at`: `lamps {level}`; when a cue starts stands before its brace: \
                     `cue 2 \"Evening\" at 0:04 {{ … }}`"
                );
                self.report
                    .error::<()>(codes::MISPLACED, message, (*span, "not here"), help);
            }
            let (Mark::Follow | Mark::Hang, Some(value)) = (mark, value) else {
                continue;
            };
            if let Some((_, earlier)) = first.replace((*mark, *span)) {
                self.report.add(
                    Diagnostic::error(
                        codes::FOLLOW_AND_HANG,
                        "a cue has `follow` or `hang`, not both",
                    )
                    .place(*span, "and here")
                    .place(earlier, "here")
                    .help("`follow` counts from this cue's GO, `hang` from its completion"),
                );
                return link;
            }
            let time = match mark {
                Mark::Follow => self.duration(*value).map(Link::Follow),
                _ => self.time(*value).map(Link::Hang),
            };
            let id = self.node(*span);
            link = time.map(|link| (id, link));
        }
        link
    }

    // ---- parts ------------------------------------------------------------------------------

    fn parts(&mut self, cue: &ast::Cue<'a>, id: NodeId, standard: Times) -> Vec<Part> {
        let mut moved = Moved::new();
        let times = self.times(&cue.body.timing, standard);
        let mut alone = Vec::new();
        let mut first = self.new_part(id, 1, String::new(), times);
        self.moves(&cue.body, (times, &mut first), &mut moved, &mut alone);
        let mut parts = vec![first];
        let mut seen: BTreeMap<u32, Span> = BTreeMap::new();
        for written in &cue.body.parts {
            let number = self.count(written.number, 99_999, "a part's number");
            if let Some(earlier) = number.and_then(|n| seen.insert(n, written.number.span)) {
                let places = [written.number.span, earlier];
                self.same_part(places, "is used twice in this cue", &cue.body.parts);
            }
            let made = self.part(written, number.unwrap_or(1), times, &mut moved, &mut alone);
            let direct = cue.body.moves.first();
            match (number, parts.first_mut(), direct) {
                (Some(1), _, Some(first)) => {
                    let why = "is what stands directly in the cue";
                    self.same_part([written.number.span, first.span], why, &cue.body.parts);
                }
                (Some(1), Some(slot), None) => *slot = made,
                _ => parts.push(made),
            }
        }
        let mut next = parts.iter().map(|p| p.number).max().unwrap_or(1);
        for mut part in alone {
            next += 1;
            part.number = next;
            parts.push(part);
        }
        for part in &mut parts {
            // A move that a narrower word has overridden is no move of this cue.
            part.moves.retain(|m| {
                moved
                    .get(&m.parameter)
                    .is_some_and(|claim| claim.id == m.id)
            });
            // A list that grows begins with four; most cues of a large show move one bank.
            part.moves.shrink_to_fit();
            part.effects.shrink_to_fit();
        }
        parts
    }

    fn same_part(&mut self, [span, earlier]: [Span; 2], why: &str, parts: &[ast::Part<'a>]) {
        let is_free = |n: &u32| parts.iter().all(|part| part.number.text != n.to_string());
        let free = (2..).find(is_free).unwrap_or(2);
        self.report.add(
            Diagnostic::error(codes::PART_NUMBER, format!("this part's number {why}"))
                .place(span, "again here")
                .place(earlier, "first here")
                .help(format!("did you mean `{free}`, which is free?")),
        );
    }

    fn part(
        &mut self,
        written: &ast::Part<'a>,
        number: u32,
        standard: Times,
        moved: &mut Moved,
        alone: &mut Vec<Part>,
    ) -> Part {
        let id = self.node(headed(written.span, written.number));
        let times = self.times(&written.body.timing, standard);
        let label = written.label.map(unquoted).unwrap_or_default();
        let mut made = self.new_part(id, number, label, times);
        self.moves(&written.body, (times, &mut made), moved, alone);
        for (_, span) in &written.body.notes {
            let message = "`note` stands in the cue, not in a part";
            let help = "put it after the part's closing brace";
            self.report
                .error::<()>(codes::MISPLACED, message, (*span, "not here"), help);
        }
        for (mark, _, span) in &written.body.marks {
            let word = word_of(*mark);
            let message = format!("`{word}` stands in the cue, not in a part");
            let help = "put it after the part's closing brace";
            self.report
                .error::<()>(codes::MISPLACED, message, (*span, "not here"), help);
        }
        for inner in &written.body.parts {
            let message = "a part has no parts of its own";
            let at = (inner.number.span, "a part in a part");
            self.report.error::<()>(
                codes::MISPLACED,
                message,
                at,
                "close the first part before this one",
            );
        }
        made
    }

    /// Applies the timing words of `list` to `standard`.
    fn times(&mut self, list: &[Timing<'a>], standard: Times) -> Times {
        let mut times = standard;
        for (i, timing) in list.iter().enumerate() {
            let clash = list
                .iter()
                .take(i)
                .find(|earlier| clash(earlier.kind, timing.kind));
            if let Some(earlier) = clash {
                self.timed_twice(earlier.span, timing.span);
                return times;
            }
            // An error was reported; the time in force stays.
            let _ = self.timing(timing, &mut times);
        }
        times
    }

    fn timed_twice(&mut self, earlier: Span, span: Span) {
        self.report.add(
            Diagnostic::error(codes::SAID_TWICE, "the same timing is said twice")
                .place(span, "again here")
                .place(earlier, "first here")
                .help("`time` and `snap` set both directions; to tell them apart write `up 6  down 9`"),
        );
    }

    fn timing(&mut self, timing: &Timing<'a>, times: &mut Times) -> Option<()> {
        let [up_by_default, down_by_default] = &mut times.by_default;
        match timing.kind {
            TimingKind::Time | TimingKind::Snap => times.by_default = [false; 2],
            TimingKind::Up => *up_by_default = false,
            TimingKind::Down => *down_by_default = false,
            _ => {}
        }
        if timing.kind == TimingKind::Snap {
            (times.up, times.down) = (Time::ZERO, Time::ZERO);
            return Some(());
        }
        let value = timing.value?;
        match timing.kind {
            TimingKind::Time => {
                times.up = self.duration(value)?;
                times.down = match timing.second {
                    Some(second) => self.duration(second)?,
                    None => times.up,
                };
            }
            TimingKind::Up => times.up = self.duration(value)?,
            TimingKind::Down => times.down = self.duration(value)?,
            TimingKind::Delay => times.delay = self.duration(value)?,
            TimingKind::Curve => times.curve = self.fade(value)?,
            TimingKind::Repeat => times.repeat = self.count(value, limits::REPEAT, "a repeat")?,
            TimingKind::Snap => {}
        }
        Some(())
    }

    // ---- moves ------------------------------------------------------------------------------

    /// Adds the moves of a body to its part; moves with timing become parts.
    fn moves(
        &mut self,
        body: &Body<'a>,
        (times, part_of): (Times, &mut Part),
        moved: &mut Moved,
        alone: &mut Vec<Part>,
    ) {
        if let Some(timing) = body.timing.iter().find(|t| t.kind == TimingKind::Repeat) {
            let help = "write it after what is repeated, on the same line: `lamps linear 0 0, 1 50 repeat 3`";
            let at = (timing.span, "of what?");
            let message = "`repeat` stands after a move, on its line";
            self.report.error::<()>(codes::MISPLACED, message, at, help);
        }
        let mut rest = body.moves.iter().peekable();
        while let Some(written) = rest.next() {
            if rest
                .next_if(|next| self.no_level_word(written, next))
                .is_some()
            {
                continue;
            }
            let mut written = Cow::Borrowed(written);
            while let Some([first, second]) = self.told_apart(&written) {
                self.movement(&first, (times, part_of), moved, alone);
                if self.report.full() {
                    return;
                }
                written = Cow::Owned(second);
            }
            self.movement(&written, (times, part_of), moved, alone);
        }
        part_of.moves.sort_by_key(|m| m.parameter);
    }

    fn movement(
        &mut self,
        written: &ast::Move<'a>,
        (times, part_of): (Times, &mut Part),
        moved: &mut Moved,
        alone: &mut Vec<Part>,
    ) {
        let own = self.times(&written.timing, times);
        self.timing_lints(written);
        let id = self.node(written.span);
        let mut motions = self.motions(written);
        motions.extend(self.aims(written, id));
        let mut moves: Vec<Move> = motions
            .into_iter()
            .map(|(parameter, motion)| Move {
                id,
                parameter,
                motion,
                repeat: own.repeat,
            })
            .collect();
        let breadth = self.breadth(written.target);
        let taken = moves.iter().find_map(|m| {
            let claim = moved.get(&m.parameter)?;
            (claim.breadth >= breadth).then_some((m.parameter, claim.span))
        });
        if let Some((parameter, earlier)) = taken {
            self.report_set_twice(parameter, written.span, earlier, "cue");
            return;
        }
        let span = written.span;
        let claim = Claim { id, span, breadth };
        moved.extend(moves.iter().map(|m| (m.parameter, claim)));
        let effects = self.effect_changes(written, id);
        if written.timing.iter().any(|t| t.kind != TimingKind::Repeat) {
            let mut single = self.new_part(id, 0, String::new(), own);
            moves.sort_by_key(|m| m.parameter);
            single.moves = moves;
            single.effects = effects;
            alone.push(single);
        } else {
            part_of.moves.extend(moves);
            part_of.effects.extend(effects);
        }
    }
}

impl<'a> Lower<'a, '_> {
    /// A part without moves.
    fn new_part(&mut self, id: NodeId, number: u32, label: String, times: Times) -> Part {
        Part {
            id,
            number,
            written: number > 0,
            label,
            delay: times.delay,
            up: times.up,
            down: times.down,
            by_default: times.by_default,
            curve: times.curve,
            moves: Vec::new(),
            effects: Vec::new(),
        }
    }

    /// Warns about timing after a move that was probably meant otherwise.
    fn timing_lints(&mut self, written: &ast::Move<'a>) {
        let timing = written.timing.iter();
        let mut timing = timing.filter(|t| t.kind != TimingKind::Repeat);
        let Some(first) = timing.next().copied() else {
            return;
        };
        let fades = |t: &&Timing<'a>| t.kind != TimingKind::Delay;
        let vain = std::iter::once(&first).chain(timing).find(fades).copied();
        if let (ast::Motion::Path(_), Some(vain)) = (&written.motion, vain) {
            let message = "a path has times of its own: this does nothing";
            self.report.add(
                Diagnostic::warning(codes::PATH_TIMING, message)
                    .place(vain.span, "without effect")
                    .place(written.span, "this path")
                    .help("change the times of its knots; `delay 2` and `repeat 3` act on a path"),
            );
        } else if let Some(before) = written.beside {
            self.shared_line(written, first, before);
        }
    }

    fn shared_line(&mut self, written: &ast::Move<'a>, timing: Timing<'a>, before: Span) {
        let name = written.target.map_or("blackout", |t| t.name.text);
        let word = timing.kind.word();
        let example = match timing.kind {
            TimingKind::Snap => word.to_owned(),
            _ => format!("{word} {}", timing.value.map_or("", |v| v.text)),
        };
        let message = format!("`{word}` behind several moves is that of `{name}` alone");
        self.report.add(
            Diagnostic::warning(codes::LAST_MOVE_TIMING, message)
                .place(timing.span, format!("of `{name}` alone"))
                .place(before, "not of this")
                .help(format!(
                    "for the whole cue write it first: `{{ {example}  … }}`; for `{name}` alone \
                     give `{name}` a line of its own"
                )),
        );
    }
}

/// Span of a cue or a part up to its number: its body would hide the fault.
fn headed(span: Span, number: Word<'_>) -> Span {
    Span {
        end: number.span.end,
        ..span
    }
}

/// True when both words set the same thing.
fn clash(a: TimingKind, b: TimingKind) -> bool {
    use TimingKind::{Down, Snap, Time, Up};
    let durations = [a, b].iter().all(|k| matches!(k, Time | Up | Down | Snap));
    let one_each = matches!((a, b), (Up, Down) | (Down, Up));
    a == b || (durations && !one_each)
}

fn word_of(mark: Mark) -> &'static str {
    match mark {
        Mark::Follow => "follow",
        Mark::Hang => "hang",
        Mark::At => "at",
        Mark::Block => "block",
        Mark::Assert => "assert",
        Mark::Cueonly => "cueonly",
    }
}
