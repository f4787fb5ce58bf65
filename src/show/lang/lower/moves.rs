//! Moves of a cue: the motion of each parameter.

use std::collections::BTreeMap;

use super::{Lower, colour};
use crate::lang::ast::{self, Motion as Written, Target, Word};
use crate::lang::codes;
use crate::lang::names::{self, Kind, nearest};
use crate::model::{Knot, Motion, Path};
use crate::units::{fraction, percent};

/// Keywords of a cue that a mistyped name may stand for.
const BODY_WORDS: [&str; 16] = [
    "assert", "at", "blackout", "block", "cueonly", "curve", "delay", "down", "follow", "hang",
    "part", "repeat", "snap", "time", "up", "out",
];

impl<'a> Lower<'a, '_> {
    pub(super) fn motions(&mut self, written: &ast::Move<'a>) -> Vec<(usize, Motion)> {
        let Some(target) = written.target else {
            let banks = self.show.banks.len();
            if !self.spend(banks, written.span) {
                return Vec::new();
            }
            let levels = self.first_parameters.iter().take(banks);
            return levels.map(|level| (*level, Motion::To(0.0))).collect();
        };
        let kind = self.names.get(target.name.text).map(|e| e.kind);
        match (&written.motion, kind) {
            (Written::Plus(terms), _) => {
                let mut levels = self.look(target.name);
                levels.extend(self.combined_levels(terms));
                let levels = self.with_full(levels);
                levels
                    .into_iter()
                    .map(|(c, (l, _))| (c, Motion::To(l)))
                    .collect()
            }
            (Written::Bare, Some(Kind::Look)) => self.scaled_look(target, 1.0),
            (Written::To(word, second), Some(Kind::Look)) => {
                if let Some(second) = second {
                    let message = "a look has colours of its own";
                    let help = format!("change one: `{} + {{ sky #203060 }}`", target.name.text);
                    let at = (second.span, "not here");
                    self.report
                        .error::<()>(codes::DOES_NOT_FIT, message, at, help);
                }
                let share = self.level(*word).unwrap_or_default();
                self.scaled_look(target, share)
            }
            (Written::Bare, _) => {
                if written.effect.is_none() && written.aim.is_none() {
                    self.no_level(target);
                }
                Vec::new()
            }
            (Written::To(word, _), None) if is_channel(target.name.text) => {
                self.channel_moved(target, *word);
                Vec::new()
            }
            (Written::To(word, second), _) => {
                let setting = self.settings(*word, *second);
                let banks = self.moving(target);
                let Some(setting) = setting else {
                    return Vec::new();
                };
                let levels = self.resolved_levels(&banks, target, setting);
                levels
                    .into_iter()
                    .map(|(c, l)| (c, Motion::To(l)))
                    .collect()
            }
            (Written::Path(path), _) => self.path_motions(target, path),
        }
    }

    /// Banks that may take a level or a path; the message names looks when they cannot.
    fn moving(&mut self, target: Target<'a>) -> Vec<usize> {
        match self.names.get(target.name.text) {
            None => {
                self.banks_of_target(target, &[Kind::Bank, Kind::Group, Kind::Look], &BODY_WORDS)
            }
            Some(_) => self.banks_of_target(target, &[Kind::Bank, Kind::Group], &[]),
        }
    }

    fn scaled_look(&mut self, target: Target<'a>, share: f64) -> Vec<(usize, Motion)> {
        if let Some(channel) = target.channel {
            let message = format!("`{}` is a look: it has no emitters", target.name.text);
            let at = (channel.span, "not here");
            self.report
                .error::<()>(codes::DOES_NOT_FIT, message, at, "");
            return Vec::new();
        }
        let levels = self.look(target.name);
        let mut out = Vec::with_capacity(levels.len());
        for (parameter, (level, _)) in &levels {
            let emitter = self.emitter(*parameter);
            let own = emitter.is_some_and(|e| levels.contains_key(&(parameter - e - 1)));
            // A colour is not scaled with its level.
            let level = if own { *level } else { scaled(*level, share) };
            out.push((*parameter, Motion::To(level)));
        }
        out
    }

    /// Reports `channel 1 at 50`, naming the bank on the channel.
    fn channel_moved(&mut self, target: Target<'a>, number: Word<'a>) {
        let channel = number.text.parse::<u32>().ok();
        let bank = self.show.banks.iter();
        let bank = bank
            .filter(|_| channel.is_some())
            .find(|b| b.channel == channel);
        let help = match bank {
            Some(bank) => format!(
                "channel {} is the bank `{}`: write `{1} 50`",
                number.text, bank.name
            ),
            None => {
                "a channel is given to a bank: `bank lamps = lamp1  channel 1`, then `lamps 50`"
                    .to_owned()
            }
        };
        let message = "a cue moves banks by their names, not channels";
        let at = (target.span, "not a bank");
        self.report
            .error::<()>(codes::UNKNOWN_NAME, message, at, help);
    }

    fn no_level(&mut self, target: Target<'a>) {
        if self.moving(target).is_empty() {
            return;
        }
        let name = target.name.text;
        let message = format!("`{name}` has no level");
        let help = format!("write `{name} 85`, `{name} full` or `{name} out`");
        let at = (target.span, "to which level?");
        self.report.error::<()>(codes::NO_LEVEL, message, at, help);
    }

    /// True, with a report, when `next` was meant as the level of `written`: `lamps slow`.
    pub(super) fn no_level_word(&mut self, written: &ast::Move<'a>, next: &ast::Move<'a>) -> bool {
        let (Some(target), Some(level)) = (written.target, next.target) else {
            return false;
        };
        let bare = |one: &ast::Move<'a>| matches!(one.motion, Written::Bare) && one.aim.is_none();
        // A fast path: most moves have a level.
        if !(bare(written) && bare(next) && written.timing.is_empty() && written.effect.is_none())
            || self.names_lost
        {
            return false;
        }
        let entry = self.names.get(target.name.text);
        let kind = |target: Target<'a>| self.names.get(target.name.text).map(|e| e.kind);
        let moved = [Kind::Bank, Kind::Group, Kind::Look];
        let meant = matches!(kind(target), Some(Kind::Bank | Kind::Group))
            && kind(level).is_none_or(|k| !moved.contains(&k))
            && nearest(level.name.text, self.names.of(&moved)).is_none();
        if !meant {
            return false;
        }
        let bank = entry.filter(|e| e.kind == Kind::Bank).and_then(|e| e.index);
        let rgb = bank
            .and_then(|i| self.show.banks.get(i))
            .is_some_and(|b| b.rgb);
        let (bank, word) = (target.name.text, level.name.text);
        let help = match kind(level) {
            None if names::foreign(word).is_some() => {
                names::foreign(word).unwrap_or_default().to_owned()
            }
            None if names::is_gel(word) => {
                format!("a gel is written `gel {word}`: `{bank} gel {word}`")
            }
            Some(Kind::Value) => format!("a value is used in round brackets: `{bank} ({word})`"),
            Some(Kind::Curve) => format!("a curve stands behind a level: `{bank} 85 curve {word}`"),
            _ => match nearest(word, ["full", "out"].into_iter()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if rgb => colour_help(bank, word),
                None if colour::named(word).is_some() => format!(
                    "colours are written `#{word}`, and only an rgb bank has one: put `rgb` behind the lights of `{bank}`"
                ),
                None => format!("write `{bank} 85`, `{bank} full` or `{bank} out`"),
            },
        };
        let message = format!("`{word}` is not a level");
        self.report
            .error::<()>(codes::NO_LEVEL, message, (level.span, "not a level"), help);
        true
    }

    fn path_motions(
        &mut self,
        target: Target<'a>,
        written: &ast::Path<'a>,
    ) -> Vec<(usize, Motion)> {
        let knots = self.path(written);
        let banks = self.moving(target);
        let Some(knots) = knots else {
            return Vec::new();
        };
        let mut out = Vec::new();
        for bank in banks {
            // A path of levels moves one parameter, a path of colours three.
            let mut paths: BTreeMap<usize, Vec<Knot>> = BTreeMap::new();
            for (knot, source) in knots.iter().zip(&written.knots) {
                let Some(levels) = self.levels_of(bank, target, knot.setting) else {
                    return out;
                };
                if !self.spend(levels.len(), written.span) {
                    return out;
                }
                for (parameter, level) in levels {
                    paths.entry(parameter).or_default().push(Knot {
                        level,
                        handles: knot.via.unwrap_or([level; 2]),
                        ..knot.knot
                    });
                }
                if paths.len() > 3 {
                    let message = "a path goes through levels or through colours, not both";
                    let help = "move the other with a fade: `sky 60 time 4`";
                    let at = (source.value.span, "another kind than before");
                    self.report
                        .error::<()>(codes::DOES_NOT_FIT, message, at, help);
                    return out;
                }
            }
            let interpolation = written.interpolation;
            out.extend(paths.into_iter().map(|(parameter, knots)| {
                let path = Path {
                    interpolation,
                    knots,
                };
                (parameter, Motion::Path(path))
            }));
        }
        out
    }
}

fn is_channel(word: &str) -> bool {
    matches!(word, "channel" | "chan" | "ch")
}

/// A line to type when `word` follows an rgb bank.
fn colour_help(bank: &str, word: &str) -> String {
    match colour::named(word) {
        Some(_) => format!("a colour has a `#`: `{bank} #{word}`"),
        None => format!("write `{bank} 85`, or a colour as `{bank} #ffb36b`"),
    }
}

/// Scales a level. Levels from the text are multiplied as decimals, because looks share a key only
/// when they are equal to the bit: 85 at 30 is `25.5`.
fn scaled(level: f64, share: f64) -> f64 {
    let written = percent(level);
    let exact = if fraction(written) == level {
        written
    } else {
        100.0 * level
    };
    fraction(exact * share)
}
