//! What a hand does at a desk: go, back, goto; trying levels and recording them; blind edits; undo.
//!
//! Invariants: levels that are tried live beside the text, which they change only when they are
//! recorded; blind edits and undo go by whole texts, so that nothing of them is ever half done.

use super::answer::{count, label};
use super::{Call, Error, Interpreter, Reply, Report, paper};
use crate::diagnostic::{Diagnostic, Sources};
use crate::lang::{self, edit::Edit};
use crate::sheet::{self, Difference, Version};
use crate::show::{Bank, Dimmer, Motion, Move};
use crate::timeline::{CueTime, Timeline};
use crate::units::{CueNumber, Time};

/// Bytes of earlier texts that `undo` may hold.
const PAST: usize = 64 << 20;

/// What taking another text came to.
#[derive(Debug)]
pub struct Reloaded {
    /// The changes in a designer's words.
    pub reply: Reply,
    /// What changed.
    pub difference: Difference,
}

/// A coordinate that is being tried.
#[derive(Clone, Copy, Debug)]
struct Tried {
    coordinate: usize,
    /// Relative to full, before the dimmer.
    level: f64,
    /// Relative to full.
    light: f64,
}

/// What happens beside the text.
#[derive(Debug, Default)]
pub(super) struct Desk {
    /// Levels being tried, as they were written, with what they set.
    tried: Vec<(String, Vec<Tried>)>,
    /// The text before the blind edits.
    blind: Option<String>,
    past: Vec<String>,
    future: Vec<String>,
}

impl Desk {
    /// Lets go of what is being tried.
    pub fn release(&mut self) {
        self.tried.clear();
    }

    /// Remembers a text that is about to change.
    fn remember(&mut self, text: &str) {
        self.past.push(text.to_owned());
        self.future.clear();
        let mut bytes: usize = self.past.iter().map(String::len).sum();
        while bytes > PAST && self.past.len() > 1 {
            bytes -= self.past.remove(0).len();
        }
    }
}

impl Interpreter {
    /// The text becomes another that was compiled already; `undo` has the old one.
    pub(super) fn change_text(&mut self, text: String) {
        self.desk.remember(&self.source);
        self.source = text;
    }

    /// Takes a text as a whole, with everything rendered that still means the same; `undo` has the
    /// old one. Both are held against each other as they were compiled, so that a text is read
    /// once.
    ///
    /// # Errors
    /// [`Error::Mistakes`]; the show is then as it was.
    pub fn reload(&mut self, text: &str) -> Result<Reloaded, Error> {
        let kept = self.refined();
        let (news, difference) = self.compile_compared(text)?;
        self.change_text(text.to_owned());
        let text = match paper::told(&difference, None) {
            told if told.is_empty() => self.describe_edit(&news, &[], kept),
            told => told,
        };
        let reply = Reply {
            notes: std::mem::take(&mut self.unheard),
            ..Reply::text(text)
        };
        Ok(Reloaded { reply, difference })
    }

    /// Takes over what a text comes to; what is to be warned of, and what changed.
    fn compile_compared(&mut self, text: &str) -> Result<(Report, Difference), Error> {
        let (show, timeline) = (self.show().clone(), self.timeline().clone());
        let before = self.compiled.text();
        let news = self.compile_text(text, self.looking.clone())?;
        let after = self.compiled.text();
        let version = |text, show, timeline| Version {
            text,
            show,
            timeline,
        };
        let difference = sheet::difference(
            version(&before, &show, &timeline),
            version(&after, self.show(), self.timeline()),
        );
        Ok((news, difference))
    }

    /// The setting at the current time, with the levels that are being tried.
    pub(super) fn present(&self) -> Vec<f64> {
        let mut setting = self.timeline().evaluate(self.now);
        for tried in self.trying() {
            if let Some(slot) = setting.get_mut(tried.coordinate) {
                *slot = tried.light;
            }
        }
        setting
    }

    fn trying(&self) -> impl Iterator<Item = &Tried> {
        self.desk.tried.iter().flat_map(|(_, tried)| tried)
    }

    /// The levels before the dimmers at the current time, relative to full, with those that are
    /// being tried. `None` where no dimmer makes other light of them.
    pub(super) fn present_levels(&self) -> Option<Vec<f64>> {
        let mut show = self.show().clone();
        let bent = |bank: &Bank| bank.dimmer != Dimmer::Linear;
        if !show.banks.iter().any(bent) {
            return None;
        }
        for bank in &mut show.banks {
            bank.dimmer = Dimmer::Linear;
        }
        // The curves of the same show with its dimmers taken off; what compiled does so again.
        let mut levels = Timeline::new(&show).ok()?.evaluate(self.now);
        for tried in self.trying() {
            if let Some(slot) = levels.get_mut(tried.coordinate) {
                *slot = tried.level;
            }
        }
        Some(levels)
    }

    /// Levels are being tried.
    pub(super) fn is_trying(&self) -> bool {
        !self.desk.tried.is_empty()
    }

    /// Moves in time, which lets go of what is being tried and says so.
    pub(super) fn move_to(&mut self, time: Time) {
        self.now = time;
        if self.is_trying() {
            let tried = self.tried_text();
            self.unheard.push(format!(
                "let go of {tried}; `record NUMBER` before a move keeps what is tried"
            ));
        }
        self.desk.release();
    }

    /// The cue that has started last.
    fn running(&self) -> Option<usize> {
        let cues = self.timeline().cues();
        cues.iter().rposition(|cue| cue.go <= self.now)
    }

    /// The moment at which a cue is complete, or at which the next one takes over.
    fn settled(&self, index: usize) -> Option<Time> {
        let cues = self.timeline().cues();
        let cue = cues.get(index)?;
        let next = cues.get(index + 1);
        // A microsecond before its GO the next cue has not begun.
        let until = next.map(|n| n.go - Time::from_micros(1));
        Some(
            until
                .map_or(cue.completion, |until| cue.completion.min(until))
                .max(cue.go),
        )
    }

    /// The last of the cues that follow this one by themselves; the cue itself where none does.
    fn chain_end(&self, index: usize) -> usize {
        let run = self.show().cues.iter().skip(index);
        index + run.take_while(|cue| cue.link.is_some()).count()
    }

    pub(super) fn answer_go(&mut self) -> Result<Reply, Error> {
        let next = self.running().map_or(0, |index| index + 1);
        let Some(time) = self.settled(self.chain_end(next)) else {
            let what = match next {
                0 => "the show has no cue",
                _ => "the last cue has run: `back`, or `goto` a cue",
            };
            return Err(Error::Usage(what.to_owned()));
        };
        self.move_to(time);
        self.tell_moment()
    }

    pub(super) fn answer_back(&mut self) -> Result<Reply, Error> {
        let before = self.running().and_then(|index| index.checked_sub(1));
        let Some(time) = before.and_then(|index| self.settled(index)) else {
            return Err(Error::Usage("there is no cue before this".to_owned()));
        };
        self.move_to(time);
        self.tell_moment()
    }

    pub(super) fn answer_goto(&mut self, call: &Call) -> Result<Reply, Error> {
        let (number, fraction) = match call.words.iter().map(String::as_str).collect::<Vec<_>>()[..]
        {
            [number] => (number, None),
            [number, "at", part] => (number, Some(share(part)?)),
            _ => {
                return Err(Error::Usage(
                    "say which cue: goto 12, goto 12 at 50%".to_owned(),
                ));
            }
        };
        let index = self.cue_index(number)?;
        let time = match (self.timeline().cues().get(index), fraction) {
            (Some(cue), Some(fraction)) => Some(part_of(cue, fraction)),
            _ => self.settled(index),
        };
        self.move_to(time.unwrap_or(self.now));
        self.tell_moment()
    }

    fn cue_index(&self, text: &str) -> Result<usize, Error> {
        let number = CueNumber::parse(text);
        let mut cues = self.show().cues.iter();
        let found = number.and_then(|n| cues.position(|cue| cue.number == n));
        found.ok_or_else(|| {
            let known = self.show().cues.iter().map(|cue| cue.number.to_string());
            let known: Vec<String> = known.take(12).collect();
            let more = if self.show().cues.len() > 12 {
                " …"
            } else {
                ""
            };
            Error::Usage(format!(
                "there is no cue `{text}`; there are {}{more}",
                known.join(", ")
            ))
        })
    }

    /// Levels there, and a picture where the pool can give one at once.
    fn tell_moment(&mut self) -> Result<Reply, Error> {
        let levels = self.answer_at(&Call::new(super::Verb::At))?;
        if self.pool().is_none() {
            return Ok(levels);
        }
        let picture = self.answer_picture(&Call::new(super::Verb::Picture))?;
        Ok(Reply {
            picture: picture.picture,
            ..levels
        })
    }

    /// Tries levels on top of what the cues say at the current time.
    pub(super) fn answer_set(&mut self, call: &Call) -> Result<Reply, Error> {
        if call.words.is_empty() {
            let text = match self.desk.tried.is_empty() {
                true => "nothing is being tried: `set lamps 40`".to_owned(),
                false => format!("trying {}", self.tried_text()),
            };
            return Ok(Reply::text(text));
        }
        let moves = call.words.join(" ");
        let set = self.set_by(&moves)?;
        // What is set anew takes the place of what was.
        let again = |(_, old): &(String, Vec<Tried>)| {
            old.iter()
                .all(|old| set.iter().any(|new| new.coordinate == old.coordinate))
        };
        self.desk.tried.retain(|tried| !again(tried));
        self.desk.tried.push((moves, set));
        let mut reply = self.tell_moment()?;
        reply
            .text
            .push_str("`record NUMBER \"LABEL\"` keeps it, `release` lets go\n");
        Ok(reply)
    }

    fn tried_text(&self) -> String {
        let texts: Vec<&str> = self.desk.tried.iter().map(|(t, _)| t.as_str()).collect();
        texts.join("  ")
    }

    /// Where each coordinate ends that moves like `lamps 40  sky #203060` set: what a cue at the
    /// end of the show would bring.
    fn set_by(&mut self, moves: &str) -> Result<Vec<Tried>, Error> {
        let number = self.free_number();
        let (opening, closing) = (format!("cue {number} {{ snap  "), " }");
        let statement = format!("{opening}{moves}{closing}");
        let edited = lang::edit::apply(&self.source, &Edit::Declare(statement))
            .map_err(|diagnostics| typed(diagnostics, moves, opening.len()))?;
        let mut sources = Sources::default();
        let files = self.host.files.as_ref();
        let (name, text) = (&self.name, &edited.source);
        let parsed = lang::parse_again(&mut self.known, files, &mut sources, name, text);
        let Some(show) = parsed.show else {
            let place = lang::edit::locate(text, &format!("cue {number}"));
            let start = place.map_or(0, |place| place.start) + opening.len();
            return Err(typed(parsed.diagnostics, moves, start));
        };
        let timeline = Timeline::new(&show).map_err(|errors| {
            let first = errors.first().map(ToString::to_string);
            Error::Usage(first.unwrap_or_else(|| "the levels make no curve".to_owned()))
        })?;
        let cue = show
            .cues
            .iter()
            .find(|cue| cue.number.to_string() == number);
        let moved = cue
            .into_iter()
            .flat_map(|cue| &cue.parts)
            .flat_map(|part| &part.moves);
        let tried = |m: &Move| {
            let Motion::To(level) = m.motion else {
                return None;
            };
            Some(Tried {
                coordinate: m.coordinate,
                level: level / 100.0,
                light: *timeline.last().get(m.coordinate)?,
            })
        };
        let set: Vec<Tried> = moved.filter_map(tried).collect();
        match set.is_empty() {
            true => Err(Error::Usage(
                "that sets no level: `set lamps 40`".to_owned(),
            )),
            false => Ok(set),
        }
    }

    /// The greatest cue number that no cue has.
    fn free_number(&self) -> String {
        let taken = |n: &String| {
            self.show()
                .cues
                .iter()
                .any(|cue| cue.number.to_string() == *n)
        };
        let mut numbers = (0..1000).rev().map(|i| format!("9999.{i:03}"));
        numbers.find(|n| !taken(n)).unwrap_or_default()
    }

    pub(super) fn answer_release(&mut self) -> Result<Reply, Error> {
        if !self.is_trying() {
            return Ok(Reply::text("nothing is being tried"));
        }
        self.desk.release();
        self.tell_moment()
    }

    /// Keeps blind edits, or what is being tried as a cue.
    pub(super) fn answer_record(&mut self, call: &Call) -> Result<Reply, Error> {
        let (number, label) = match call.words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            [] => return self.keep_blind(),
            [number] => (number, None),
            [number, label] => (number, Some(label)),
            _ => return Err(Error::Usage("usage: record NUMBER \"LABEL\"".to_owned())),
        };
        if !self.is_trying() {
            let message =
                "nothing is being tried; `set lamps 40` first, then `record 2.5 \"Label\"`";
            return Err(Error::Usage(message.to_owned()));
        }
        let known = CueNumber::parse(number);
        if self.show().cues.iter().any(|cue| Some(cue.number) == known) {
            return Err(Error::Usage(format!(
                "there is a cue {number} already; take a free number, or type the cue anew \
                 (`show cue {number}` prints it)"
            )));
        }
        let quoted = |label: &str| label.replace('\\', "\\\\").replace('"', "\\\"");
        let label = label.map_or_else(String::new, |l| format!("\"{}\" ", quoted(l)));
        let time = call
            .option("time")
            .map_or_else(String::new, |t| format!("time {t}  "));
        let moves = self.tried_text();
        let cue = format!("cue {number} {label}{{ {time}{moves} }}");
        let cue = lang::format(&cue).map_or(cue, |laid_out| laid_out.trim_end().to_owned());
        let mut reply = self.edit(&cue)?;
        let index = self.cue_index(number)?;
        self.desk.release();
        if let Some(time) = self.settled(index) {
            self.move_to(time);
        }
        reply.text = format!("{cue}\n{}", reply.text);
        Ok(reply)
    }

    fn keep_blind(&mut self) -> Result<Reply, Error> {
        match self.desk.blind.take() {
            Some(_) => Ok(Reply::text(
                "the blind edits are recorded; `save` writes them",
            )),
            None => Err(Error::Usage(
                "there are no blind edits; `record NUMBER \"LABEL\"` keeps levels that are tried"
                    .to_owned(),
            )),
        }
    }

    pub(super) fn answer_blind(&mut self, call: &Call) -> Result<Reply, Error> {
        match (
            call.words
                .iter()
                .map(String::as_str)
                .collect::<Vec<_>>()
                .as_slice(),
            &self.desk.blind,
        ) {
            ([], Some(_)) => Ok(Reply::text(
                "blind already: `record` keeps the edits, `blind off` drops them",
            )),
            ([], None) => {
                self.desk.blind = Some(self.source.clone());
                Ok(Reply::text(
                    "blind: edits are shown, `record` keeps them, `blind off` drops them",
                ))
            }
            (["off"], Some(text)) => {
                let text = text.clone();
                self.compile_text(&text, self.looking.clone())?;
                if text != self.source {
                    self.change_text(text);
                }
                self.desk.blind = None;
                Ok(Reply::text(format!(
                    "the blind edits are dropped\n{}",
                    self.headline()
                )))
            }
            (["off"], None) => Err(Error::Usage("there are no blind edits".to_owned())),
            _ => Err(Error::Usage("usage: blind [off]".to_owned())),
        }
    }

    /// True while edits are shown that `record` has yet to keep.
    pub fn is_blind(&self) -> bool {
        self.desk.blind.is_some()
    }

    pub(super) fn answer_undo(&mut self, back: bool) -> Result<Reply, Error> {
        let from = if back {
            &mut self.desk.past
        } else {
            &mut self.desk.future
        };
        let Some(text) = from.pop() else {
            let what = if back { "undo" } else { "redo" };
            return Err(Error::Usage(format!("there is nothing to {what}")));
        };
        let difference = match self.compile_compared(&text) {
            Ok((_, difference)) => difference,
            Err(error) => {
                let from = if back {
                    &mut self.desk.past
                } else {
                    &mut self.desk.future
                };
                from.push(text);
                return Err(error);
            }
        };
        let old = std::mem::replace(&mut self.source, text);
        let to = if back {
            &mut self.desk.future
        } else {
            &mut self.desk.past
        };
        to.push(old);
        let changes = difference.changes.iter();
        let mut told: String = changes.map(|change| format!("{change}\n")).collect();
        told.push_str(&self.headline());
        let left = count(self.desk.past.len(), "edit");
        Ok(Reply::text(format!("{told}\n{left} to undo")))
    }

    /// What is running: the cue, and what is not in the text yet.
    pub(super) fn remarks(&self) -> String {
        let mut out = String::new();
        if self.is_blind() {
            out.push_str("blind edits: `record` keeps them, `blind off` drops them\n");
        }
        if self.is_trying() {
            out.push_str(&format!("trying {}\n", self.tried_text()));
        }
        out
    }

    /// Where the show is, for a prompt: the cue's number and label; empty before the first.
    pub fn place(&self) -> String {
        let cue = self.running().and_then(|index| self.show().cues.get(index));
        cue.map_or_else(String::new, |cue| {
            format!("{} {}", cue.number, label(cue))
                .trim_end()
                .to_owned()
        })
    }
}

/// Mistakes in words that stand at `start` of a longer text, as if the words stood alone.
fn typed(diagnostics: Vec<Diagnostic>, words: &str, start: usize) -> Error {
    let mut sources = Sources::default();
    sources.add("typed", words);
    let own = |mut diagnostic: Diagnostic| {
        diagnostic.labels.retain_mut(|label| {
            let within = label.file == 0 && label.span.start >= start;
            let moved = |at: usize| at.saturating_sub(start).min(words.len());
            label.span = moved(label.span.start)..moved(label.span.end);
            within
        });
        diagnostic
    };
    Error::Mistakes(Report {
        diagnostics: diagnostics.into_iter().map(own).collect(),
        sources,
    })
}

/// `50%`, as a share of 1.
fn share(text: &str) -> Result<f64, Error> {
    let percent = text.strip_suffix('%').and_then(|t| t.parse::<f64>().ok());
    let percent = percent.filter(|p| (0.0..=100.0).contains(p));
    percent
        .map(|p| p / 100.0)
        .ok_or_else(|| Error::Usage(format!("`{text}` is no part of a cue; write it as 50%")))
}

/// The moment at which a part of a cue's time has gone by.
fn part_of(cue: &CueTime, fraction: f64) -> Time {
    let whole = (cue.completion - cue.go).micros() as f64;
    cue.go + Time::from_micros((whole * fraction).round() as i64)
}
