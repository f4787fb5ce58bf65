//! Moves of a cue: what each coordinate is to do.

use super::Lower;
use super::values::Setting;
use crate::lang::ast::{self, Motion as Written, Target};
use crate::lang::codes;
use crate::lang::names::{Kind, nearest};
use crate::show::{Knot, Motion, Path};
use crate::units::{fraction, percent};

/// The words of a cue that a mistyped name may have meant.
const BODY_WORDS: [&str; 16] = [
    "assert", "at", "blackout", "block", "cueonly", "curve", "delay", "down", "follow", "hang",
    "part", "repeat", "snap", "time", "up", "out",
];

impl<'a> Lower<'a, '_> {
    pub(super) fn motions(&mut self, written: &ast::Move<'a>) -> Vec<(usize, Motion)> {
        let Some(target) = written.target else {
            let all = self.first_coordinates.last().copied().unwrap_or(0);
            let all = if self.spend(all, written.span) {
                all
            } else {
                0
            };
            return (0..all).map(|c| (c, Motion::To(0.0))).collect();
        };
        let kind = self.names.get(target.name.text).map(|e| e.kind);
        match (&written.motion, kind) {
            (Written::Plus(terms), _) => {
                let mut levels = self.look(target.name);
                levels.extend(self.combined_levels(terms));
                levels
                    .into_iter()
                    .map(|(c, (l, _))| (c, Motion::To(l)))
                    .collect()
            }
            (Written::Bare, Some(Kind::Look)) => self.scaled_look(target, 1.0),
            (Written::To(word), Some(Kind::Look)) => {
                let share = self.level(*word).unwrap_or_default();
                self.scaled_look(target, share)
            }
            (Written::Bare, _) => {
                self.no_level(target);
                Vec::new()
            }
            (Written::To(word), _) => {
                let setting = self.setting(*word);
                let banks = self.moving(target);
                let Some(setting) = setting else {
                    return Vec::new();
                };
                let levels = self.resolved_levels(&banks, target, setting, word.span);
                levels
                    .into_iter()
                    .map(|(c, l)| (c, Motion::To(l)))
                    .collect()
            }
            (Written::Path(path), _) => self.path_motions(target, path),
        }
    }

    /// Banks that a level or a path may stand on; looks are named in the message when they cannot.
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
        levels
            .into_iter()
            .map(|(c, (level, _))| (c, Motion::To(scaled(level, share))))
            .collect()
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

    /// True, once said, where `next` is no move of its own but what was to be the level of
    /// `written`: `lamps slow`.
    pub(super) fn no_level_word(&mut self, written: &ast::Move<'a>, next: &ast::Move<'a>) -> bool {
        let (Some(target), Some(level)) = (written.target, next.target) else {
            return false;
        };
        let bare = |one: &ast::Move<'a>| matches!(one.motion, Written::Bare);
        // Most moves have a level, and are through here.
        if !(bare(written) && bare(next) && written.timing.is_empty()) || self.names_lost {
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
            Some(Kind::Value) => format!("a value is used in round brackets: `{bank} ({word})`"),
            Some(Kind::Curve) => format!("a curve stands behind a level: `{bank} 85 curve {word}`"),
            _ => match nearest(word, ["full", "out"].into_iter()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if rgb => format!("write `{bank} 85`, or a colour as `{bank} #ffb36b`"),
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
            for (coordinate, channel) in self.coordinates(bank, target) {
                if !self.spend(knots.len(), written.span) {
                    return out;
                }
                let mut path = Vec::with_capacity(knots.len());
                for (knot, source) in knots.iter().zip(&written.knots) {
                    let setting: Setting = knot.setting;
                    let Some(level) = self.level_of(bank, channel, setting, source.value.span)
                    else {
                        return out;
                    };
                    path.push(Knot {
                        level,
                        handles: knot.via.unwrap_or([level; 2]),
                        ..knot.knot
                    });
                }
                let interpolation = written.interpolation;
                out.push((
                    coordinate,
                    Motion::Path(Path {
                        interpolation,
                        knots: path,
                    }),
                ));
            }
        }
        out
    }
}

/// A share of a level. What text wrote is multiplied as it was written, since equal looks make one
/// key only where they are equal to the bit: 85 at 30 is `25.5`. A colour's level has too many
/// decimals for that.
fn scaled(level: f64, share: f64) -> f64 {
    let written = percent(level);
    let exact = match fraction(written) == level {
        true => written,
        false => 100.0 * level,
    };
    fraction(exact * share)
}
