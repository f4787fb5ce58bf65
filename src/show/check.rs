//! Diagnostics that follow from the curves alone, in the designer's words.
//!
//! `timeline` finds faults without the text; this module turns its findings into diagnostics with
//! places, numbers and help. Invariants: every finding becomes exactly one diagnostic, except that
//! a move of several parameters gives one in all; findings keep their order. This module computes
//! no curves.

use std::collections::BTreeSet;

use crate::diagnostic::{Diagnostic, WARNINGS};
use crate::lang::{self, Place, SpanMap, codes, limits};
use crate::model::{Head, HeadAxis, Interpolation, Motion, Move, NodeId, Role, Show};
use crate::printable;
use crate::timeline::{Timeline, TimelineError, TimelineWarning};
use crate::units::{Time, percent};

/// A compiled and checked show.
#[derive(Clone, Debug)]
pub struct Checked {
    /// The curves; `None` when a diagnostic is an error.
    pub timeline: Option<Timeline>,
    /// The errors; when there are none, the warnings.
    pub diagnostics: Vec<Diagnostic>,
    /// Number of warnings beyond those kept.
    pub left_out: usize,
}

/// Compiles a show's curves and reports what is wrong with them.
pub fn check(show: &Show, spans: &SpanMap) -> Checked {
    let words = Words { show, spans };
    match Timeline::new(show) {
        Ok(timeline) => {
            let (diagnostics, left_out) = words.warnings(timeline.warnings());
            Checked {
                timeline: Some(timeline),
                diagnostics,
                left_out,
            }
        }
        Err(errors) => Checked {
            timeline: None,
            diagnostics: words.errors(&errors),
            left_out: 0,
        },
    }
}

/// Words for findings in the show's own names.
struct Words<'a> {
    show: &'a Show,
    spans: &'a SpanMap,
}

impl Words<'_> {
    fn errors(&self, errors: &[TimelineError]) -> Vec<Diagnostic> {
        let mut told = BTreeSet::new();
        let mut out = Vec::new();
        for error in errors {
            let again = matches!(error, TimelineError::Level { id, .. } if !told.insert(*id));
            if again {
                continue;
            }
            if out.len() == limits::ERRORS {
                out.push(lang::too_many());
                break;
            }
            out.push(self.error(error));
        }
        out
    }

    /// The first warnings, and the number left out.
    fn warnings(&self, warnings: &[TimelineWarning]) -> (Vec<Diagnostic>, usize) {
        let mut told = BTreeSet::new();
        let mut out = Vec::new();
        for warning in warnings {
            let key = match warning {
                TimelineWarning::Jump { id, .. } => (*id, None),
                TimelineWarning::Overtaken { id, by, .. }
                | TimelineWarning::CutOff { id, by, .. }
                | TimelineWarning::Dark { id, by, .. } => (*id, Some(*by)),
                TimelineWarning::Still { cue } => (*cue, None),
                TimelineWarning::Late { id, .. } | TimelineWarning::Seen { id, .. } => {
                    (*id, Some(*id))
                }
            };
            if told.insert(key) && out.len() < WARNINGS {
                out.push(self.warning(warning));
            }
        }
        let left_out = told.len() - out.len();
        (out, left_out)
    }

    fn error(&self, error: &TimelineError) -> Diagnostic {
        match *error {
            TimelineError::AtAndLink { cue, link } => {
                let name = self.cue(cue);
                let message = format!("{name} is started twice: by the cue before it, and by `at`");
                Diagnostic::error(codes::STARTED_TWICE, message)
                    .place_of(cue, self.spans, "has a time of its own")
                    .place_of(link, self.spans, "starts it too")
            }
            TimelineError::LinkOnLast { link, .. } => {
                let message = "`follow` and `hang` start the next cue, but this is the last";
                Diagnostic::error(codes::LAST_LINK, message).place_of(
                    link,
                    self.spans,
                    "starts nothing",
                )
            }
            TimelineError::Backwards {
                cue,
                go,
                link,
                previous,
                previous_go,
            } => {
                let (name, before) = (self.cue(cue), self.cue(previous));
                let message =
                    format!("{name} would start at {go}, before {before} at {previous_go}");
                Diagnostic::error(codes::ORDER, message)
                    .place_of(link.unwrap_or(cue), self.spans, "too early")
                    .place_of(previous, self.spans, "starts later")
                    .help(match link {
                        Some(_) => "a negative `hang` reaches back at most to its own cue's GO",
                        None => "change its `at`: cues run in the order of their numbers",
                    })
            }
            TimelineError::TooLong { cue } => {
                let message = format!("the show runs beyond {}", Time::MAX);
                Diagnostic::error(codes::TIMELINE, message).place_of(cue, self.spans, "here")
            }
            TimelineError::TooManyPieces { id, limit } => {
                let message = format!("the curves have more than {limit} pieces");
                Diagnostic::error(codes::TOO_LARGE, message)
                    .place_of(id, self.spans, "the limit is reached here")
                    .help(
                        "groups, looks, `blackout`, `assert` and each pass of a `repeat` count for \
                         every bank",
                    )
            }
            TimelineError::TooManyEffects {
                id,
                effect,
                bank,
                limit,
            } => {
                let effect = self.show.effects.get(effect).map_or("", |e| &e.name);
                let bank = self.show.banks.get(bank).map_or("", |b| &b.name);
                let message = format!("effects make more than {limit} steps");
                Diagnostic::error(codes::TOO_LARGE, message)
                    .place_of(
                        id,
                        self.spans,
                        format!("`{effect}` on `{bank}` reaches the limit"),
                    )
                    .help(format!(
                        "end effects where they are no longer seen, with `{bank} effect none` in a \
                         cue, or lower their `rate`"
                    ))
            }
            TimelineError::Level {
                id,
                parameter,
                time,
                level,
            } => self.level(id, parameter, time, level),
            TimelineError::Beam { id, head, time } => {
                let name = self.head(head);
                let message =
                    format!("the beam of `{name}` is not narrower than its field at {time}");
                Diagnostic::error(codes::BEAM, message)
                    .place_of(id, self.spans, "too wide")
                    .help(format!(
                        "move both at once, the field wider than the beam: `{name} beam 12 field 18`"
                    ))
            }
            TimelineError::Dimmer { id, at, value } => {
                let (at, light) = (rounded(at), rounded(value));
                let message = format!("this dimmer gives {light} % of the light at level {at}");
                Diagnostic::error(codes::CURVE_RANGE, message)
                    .place_of(id, self.spans, "leaves 0 to 100")
                    .help("a `monotone` curve stays between its knots")
            }
        }
    }

    fn level(&self, id: NodeId, parameter: usize, time: Time, level: f64) -> Diagnostic {
        let (name, reached) = (self.parameter(parameter), self.shown(parameter, level));
        let message = match self.axis(parameter) {
            Some((head, axis)) => {
                let [low, high] = head.range(axis);
                format!(
                    "`{name}` reaches {reached} degrees at {time}: its range is {low} to {high}"
                )
            }
            None => format!("`{name}` reaches {reached} at {time}: levels are 0 to 100"),
        };
        let help = match self.find(id, parameter).map(|m| &m.motion) {
            Some(Motion::Path(path)) => match path.interpolation {
                Interpolation::Hermite => {
                    "make a slope smaller, or take `monotone`, which stays between its knots"
                }
                Interpolation::Bezier => {
                    "bring the levels after `via` closer to those of the knots"
                }
                _ => "`spline monotone` stays between its knots; or move a knot",
            },
            _ => "the fade's curve overshoots: give it `monotone` knots, or another `curve`",
        };
        let what = if self.axis(parameter).is_some() {
            "out of range"
        } else if level > 1.0 {
            "too bright"
        } else {
            "darker than out"
        };
        Diagnostic::error(codes::CURVE_RANGE, message)
            .place_of(id, self.spans, what)
            .help(help)
    }

    fn warning(&self, warning: &TimelineWarning) -> Diagnostic {
        match *warning {
            TimelineWarning::Jump {
                id,
                parameter,
                time,
                from,
                to,
            } => {
                let name = self.parameter(parameter);
                let (from, to) = (self.shown(parameter, from), self.shown(parameter, to));
                let message = format!("`{name}` jumps from {from} to {to} at {time}");
                Diagnostic::warning(codes::JUMP, message)
                    .place_of(id, self.spans, "starts elsewhere")
                    .help(format!(
                        "a path gives absolute levels: begin it with `0s {from}`, or get there before"
                    ))
            }
            TimelineWarning::Overtaken {
                id,
                by,
                parameter,
                time,
            } => {
                let name = self.parameter(parameter);
                let message = format!(
                    "this move of `{name}` never happens: at {time} another has taken over"
                );
                Diagnostic::warning(codes::OVERTAKEN, message)
                    .place_of(id, self.spans, "never starts")
                    .place_of(by, self.spans, "comes first")
                    .help("a shorter `delay` here, or a later GO there")
            }
            TimelineWarning::CutOff {
                id,
                by,
                parameter,
                time,
                level,
                to,
            } => {
                let name = self.parameter(parameter);
                let (level, to) = (self.shown(parameter, level), self.shown(parameter, to));
                let message =
                    format!("`{name}` never gets to {to}: at {time} it is at {level} and turns");
                Diagnostic::warning(codes::CUT_OFF, message)
                    .place_of(id, self.spans, "takes longer")
                    .place_of(by, self.spans, "takes over")
                    .help("a shorter `time` here, or a later GO there")
            }
            TimelineWarning::Still { cue } => {
                let message = format!("{} changes nothing", self.cue(cue));
                Diagnostic::warning(codes::NO_CHANGE, message)
                    .place_of(cue, self.spans, "every bank it names is there already")
                    .help("give it other levels; `block` says that levels are restated on purpose")
            }
            TimelineWarning::Late {
                id,
                head,
                time,
                needs,
                has,
                dark,
            } => {
                let (name, tenths) = (self.head(head), needs.seconds());
                let tenths = (10.0 * tenths).ceil() / 10.0;
                let (message, help) = if dark {
                    (
                        format!(
                            "`{name}` is not in place when its light comes: it turns for {tenths} s, \
                             and the dark lasts {has}"
                        ),
                        "let the light come later, with a `delay`, or go out earlier".to_owned(),
                    )
                } else {
                    (
                        format!(
                            "`{name}` cannot turn so fast: at {time} it needs {tenths} s, not {has}"
                        ),
                        format!("give it `time {tenths}`, or turn it while its bank is out"),
                    )
                };
                Diagnostic::warning(codes::HEAD_LATE, message)
                    .place_of(id, self.spans, "too fast")
                    .help(help)
            }
            TimelineWarning::Seen {
                id,
                head,
                time,
                until,
            } => {
                let name = self.head(head);
                let message = format!(
                    "`{name}` is seen to turn from {time} to {until}, while its light goes out"
                );
                Diagnostic::warning(codes::HEAD_SEEN, message)
                    .place_of(id, self.spans, "turns in the light")
                    .help("turn it in a later cue, or after a `delay`: in the dark it turns unseen")
            }
            TimelineWarning::Dark {
                id,
                by,
                time,
                until,
            } => {
                let message = format!("every bank is out from {time} to {until}");
                Diagnostic::warning(codes::DARK_STRETCH, message)
                    .place_of(id, self.spans, "puts the last light out")
                    .place_of(by, self.spans, "brings light again")
                    .help(
                        "where darkness is meant write `blackout`; else let one fade begin before \
                         the other ends",
                    )
            }
        }
    }

    fn axis(&self, parameter: usize) -> Option<(Head, HeadAxis)> {
        match self.show.parameters().get(parameter)?.role {
            Role::Pose(head, axis) => Some((*self.show.heads().get(head)?.1, axis)),
            _ => None,
        }
    }

    /// Text of a parameter's value: a level in percent, or an angle in degrees.
    fn shown(&self, parameter: usize, value: f64) -> String {
        match self.axis(parameter) {
            Some((head, axis)) => rounded(head.degrees(axis, value) / 100.0),
            None => rounded(value),
        }
    }

    fn head(&self, index: usize) -> &str {
        let heads = self.show.heads();
        let light = heads.get(index).and_then(|h| self.show.lights.get(h.0));
        light.map_or("", |light| light.name.as_str())
    }

    fn cue(&self, id: NodeId) -> String {
        let cue = self.show.cues.iter().find(|c| c.id == id);
        cue.map_or_else(|| "a cue".to_owned(), |c| format!("cue {}", c.number))
    }

    fn parameter(&self, index: usize) -> String {
        let all = self.show.parameters();
        all.get(index).map_or_else(String::new, |c| c.name.clone())
    }

    /// The written move; `None` for moves that `assert` and `cueonly` imply.
    fn find(&self, id: NodeId, parameter: usize) -> Option<&Move> {
        let parts = self.show.cues.iter().flat_map(|c| &c.parts);
        let mut moves = parts.flat_map(|p| &p.moves);
        moves.find(|m| m.id == id && m.parameter == parameter)
    }
}

/// Text of a level in percent, with as few decimals as show on which side of out and full it lies.
fn rounded(level: f64) -> String {
    let level = percent(level);
    let hides = |text: &str| {
        let shown: f64 = text.parse().unwrap_or(level);
        (level > 100.0 && shown <= 100.0) || (level < 0.0 && shown >= 0.0)
    };
    let texts = [1, 3, 6].map(|decimals| format!("{level:.decimals$}"));
    let [.., last] = &texts;
    let text = texts.iter().find(|t| !hides(t)).unwrap_or(last);
    printable::trimmed(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Sources;
    use crate::lang;

    const RIG: &str = "light l panel m\nlight n panel o\nbank a = l\nbank b = n\n";

    fn checked(cues: &str) -> Checked {
        let mut sources = Sources::default();
        let parsed = lang::parse(&mut sources, "t.lxq", &format!("{RIG}{cues}"));
        check(&parsed.show.unwrap(), &parsed.spans)
    }

    #[test]
    fn an_overshoot_names_its_time_and_level() {
        // Catmull-Rom through 0, 100, 100, 0: the slope at 1 s is 50, so that the middle span is
        // 100 + 50 u (1-u)^2 + 50 u^2 (1-u) = 100 + 50 u (1-u), farthest at its middle.
        let found = checked("cue 1 { a catmull-rom 0 0, 1 100, 2 100, 3 0 }");
        assert!(found.timeline.is_none());
        let [only] = found.diagnostics.as_slice() else {
            panic!("{:?}", found.diagnostics)
        };
        assert_eq!(only.code, codes::CURVE_RANGE);
        assert_eq!(
            only.message,
            "`a` reaches 112.5 at 1.5s: levels are 0 to 100"
        );
        assert!(only.help[0].contains("spline monotone"));
        let mended = checked("cue 1 { a spline 0 0, 1 100, 2 100, 3 0 }");
        assert!(mended.timeline.is_some() && mended.diagnostics.is_empty());
    }

    #[test]
    fn a_jump_and_an_overtaken_move_are_warned_of() {
        let found = checked(
            "cue 1 { time 2  a 30  b 5  delay 50 }\ncue 2 at 0:10 { a linear 0 40, 2 50\n b 60 time 1 }",
        );
        let codes: Vec<_> = found.diagnostics.iter().map(|d| d.code).collect();
        assert!(found.timeline.is_some());
        assert!(
            codes.contains(&codes::JUMP) && codes.contains(&codes::OVERTAKEN),
            "{codes:?}"
        );
        let jump = found
            .diagnostics
            .iter()
            .find(|d| d.code == codes::JUMP)
            .unwrap();
        assert_eq!(jump.message, "`a` jumps from 30 to 40 at 10s");
    }

    #[test]
    fn a_hang_that_reaches_too_far_back_is_refused() {
        let found = checked("cue 1 { time 3  a 30  hang -4 }\ncue 2 { b 5 }");
        assert_eq!(found.diagnostics[0].code, codes::ORDER);
        assert_eq!(
            found.diagnostics[0].message,
            "cue 2 would start at -1s, before cue 1 at 0s"
        );
        assert_eq!(found.diagnostics[0].labels.len(), 2);
    }

    #[test]
    fn more_moves_than_a_show_may_have_are_refused() {
        let mut rig = String::new();
        for i in 0..1000 {
            rig.push_str(&format!("light l{i} panel m{i}\nbank b{i} = l{i}\n"));
        }
        for does in ["blackout", "assert  b0 50"] {
            let cue = |i: i32| format!("cue {} {{ {does} }}\n", i + 1);
            let text = rig.clone() + &(0..501).map(cue).collect::<String>();
            let parsed = lang::parse(&mut Sources::default(), "t.lxq", &text);
            let mut found = parsed.diagnostics;
            if let Some(show) = parsed.show {
                found.extend(check(&show, &parsed.spans).diagnostics);
            }
            let is_refused = found.iter().any(|one| one.code == codes::TOO_LARGE);
            assert!(is_refused, "{does}: {found:#?}");
        }
    }

    #[test]
    fn levels_are_shown_on_their_side_of_the_limit() {
        for (level, text) in [
            (1.0425, "104.2"),
            (1.000_04, "100.004"),
            (-0.000_002, "-0.0002"),
            (0.3, "30"),
            (0.0, "0"),
        ] {
            assert_eq!(rounded(level), text);
        }
    }
}
