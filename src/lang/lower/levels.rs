//! Levels on banks and groups, and the looks made of them.

use std::collections::BTreeMap;

use super::Lower;
use super::values::Setting;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::{self, Declaration, Span, Statement, Target, Term, Word};
use crate::lang::codes;
use crate::lang::names::Kind;
use crate::lang::report::Place;
use crate::show::{Dimmer, Look};

/// Levels of coordinates, with the places that say so.
pub type Levels = BTreeMap<usize, (f64, Span)>;

#[derive(Clone, Copy, PartialEq)]
enum State {
    New,
    Visiting,
    Done,
}

impl<'a> Lower<'a, '_> {
    /// Lowers the looks.
    pub fn lower_looks(&mut self, statements: &[Statement<'a>]) {
        let looks: Vec<(Word<'a>, &[Term<'a>], Span)> = statements
            .iter()
            .filter_map(|s| match &s.item {
                Declaration::Look { name, terms } => Some((*name, terms.as_slice(), s.span)),
                _ => None,
            })
            .collect();
        for (name, _, span) in &looks {
            let id = self.node(*span);
            let name = name.text.to_owned();
            let levels = Vec::new();
            self.show.looks.push(Look { id, name, levels });
        }
        let mut states = vec![State::New; looks.len()];
        for start in 0..looks.len() {
            self.lower_look_in_postorder(start, &looks, &mut states);
        }
    }

    /// Lowers a look after those that it is made of; without recursion, so that a long chain of looks
    /// costs no stack.
    fn lower_look_in_postorder(
        &mut self,
        start: usize,
        looks: &[(Word<'a>, &[Term<'a>], Span)],
        states: &mut [State],
    ) {
        let mut stack = vec![start];
        while let Some(&index) = stack.last() {
            let (Some((name, terms, _)), Some(state)) =
                (looks.get(index), states.get(index).copied())
            else {
                return;
            };
            let mark = |states: &mut [State], value| {
                if let Some(slot) = states.get_mut(index) {
                    *slot = value;
                }
            };
            match state {
                State::Done => {
                    stack.pop();
                }
                State::New => {
                    mark(states, State::Visiting);
                    for term in terms.iter() {
                        let Term::Look(word) = term else { continue };
                        let entry = self.names.get(word.text).filter(|e| e.kind == Kind::Look);
                        let Some(other) = entry.and_then(|e| e.index) else {
                            continue;
                        };
                        match states.get(other) {
                            Some(State::New) => stack.push(other),
                            Some(State::Visiting) => self.report_cycle(*name, *word),
                            _ => {}
                        }
                    }
                }
                State::Visiting => {
                    let levels = self.combined_levels(terms);
                    if let Some(look) = self.show.looks.get_mut(index) {
                        look.levels = levels.into_iter().map(|(c, (l, _))| (c, l)).collect();
                    }
                    mark(states, State::Done);
                    stack.pop();
                }
            }
        }
    }

    fn report_cycle(&mut self, name: Word<'a>, word: Word<'a>) {
        let message = format!("the look `{}` is made of itself", name.text);
        let help = "a look is made of other looks and of levels in braces";
        self.report
            .error::<()>(codes::CYCLE, message, (word.span, "leads back here"), help);
    }

    /// The levels of terms together; of two levels of one coordinate the later term's wins.
    pub fn combined_levels(&mut self, terms: &[Term<'a>]) -> Levels {
        let mut out = Levels::new();
        for term in terms {
            let levels = match term {
                Term::Look(word) => self.look(*word),
                Term::Levels(levels) => self.block(levels),
            };
            out.extend(levels);
        }
        out
    }

    /// The levels of a look by name.
    pub fn look(&mut self, word: Word<'a>) -> Levels {
        let Some((_, index)) = self.find(word, &[Kind::Look], &[]) else {
            return Levels::new();
        };
        let count = self.show.looks.get(index).map_or(0, |l| l.levels.len());
        if !self.spend(count, word.span) {
            return Levels::new();
        }
        let look = self.show.looks.get(index).into_iter();
        let levels = look.flat_map(|l| &l.levels);
        levels.map(|(c, level)| (*c, (*level, word.span))).collect()
    }

    fn block(&mut self, levels: &[ast::Level<'a>]) -> Levels {
        let mut out = Levels::new();
        for level in levels {
            let setting = self.setting(level.value);
            let banks = self.banks_of_target(level.target, &[Kind::Bank, Kind::Group], &[]);
            let Some(setting) = setting else { continue };
            for coordinate in self.resolved_levels(&banks, level.target, setting, level.value.span)
            {
                let (coordinate, value) = coordinate;
                if let Some((_, earlier)) = out.insert(coordinate, (value, level.target.span)) {
                    self.report_set_twice(coordinate, level.target.span, earlier, "look");
                    break;
                }
            }
        }
        out
    }

    /// Reports a coordinate that is set twice where once is allowed.
    pub fn report_set_twice(&mut self, coordinate: usize, span: Span, earlier: Span, scope: &str) {
        let mut at = self.first_coordinates.iter().zip(&self.show.banks);
        let bank = at.rfind(|(first, _)| **first <= coordinate);
        let name = bank.map_or("", |(_, bank)| bank.name.as_str());
        let message = format!("the bank `{name}` stands twice in one {scope}");
        let help = if scope == "look" {
            "keep one of the two; to change another look, write `look b = a + { lamps 20 }`"
        } else {
            "keep one of the two, or move it again in a later cue; to change a look, write `night + { lamps 20 }`"
        };
        self.report.add(
            Diagnostic::error(codes::MOVED_TWICE, message)
                .place(span, "again here")
                .place(earlier, "first here")
                .help(help),
        );
    }

    /// The banks of a target: itself, or its group's.
    pub fn banks_of_target(
        &mut self,
        target: Target<'a>,
        kinds: &[Kind],
        words: &[&'a str],
    ) -> Vec<usize> {
        let Some((kind, index)) = self.find(target.name, kinds, words) else {
            return Vec::new();
        };
        match kind {
            Kind::Group => {
                let group = self.show.groups.get(index);
                let banks = group.map_or_else(Vec::new, |g| g.banks.clone());
                match self.spend(banks.len(), target.span) {
                    true => banks,
                    false => Vec::new(),
                }
            }
            _ => vec![index],
        }
    }

    /// The coordinates of a bank that `target` means, with which of its emitters each is.
    pub fn coordinates(&mut self, bank: usize, target: Target<'a>) -> Vec<(usize, usize)> {
        let (Some(first), Some(rgb)) = (
            self.first_coordinates.get(bank).copied(),
            self.show.banks.get(bank).map(|b| b.rgb),
        ) else {
            return Vec::new();
        };
        let Some(channel) = target.channel else {
            return (0..if rgb { 3 } else { 1 })
                .map(|c| (first + c, c))
                .collect();
        };
        if !rgb {
            self.not_rgb(bank, channel.span, "has no emitters of its own");
            return Vec::new();
        }
        let emitters = ["r", "g", "b"];
        let Some(which) = emitters.iter().position(|c| *c == channel.text) else {
            let message = format!("`{}` is not an emitter", channel.text);
            let help = "the emitters of an rgb bank are `r`, `g` and `b`";
            self.report
                .error::<()>(codes::NOT_RGB, message, (channel.span, "not here"), help);
            return Vec::new();
        };
        vec![(first + which, which)]
    }

    fn not_rgb(&mut self, bank: usize, span: Span, what: &str) {
        let name = self.show.banks.get(bank).map_or("", |b| b.name.as_str());
        let message = format!("the bank `{name}` is not rgb");
        let help = format!("give it a level, such as `{name} 85`, or add `rgb` to its declaration");
        self.report
            .error::<()>(codes::NOT_RGB, message, (span, what), help);
    }

    /// Coordinates of some banks and the level that a setting gives each.
    pub fn resolved_levels(
        &mut self,
        banks: &[usize],
        target: Target<'a>,
        setting: Setting,
        span: Span,
    ) -> Vec<(usize, f64)> {
        let mut out = Vec::new();
        for bank in banks {
            for (coordinate, channel) in self.coordinates(*bank, target) {
                match self.level_of(*bank, channel, setting, span) {
                    Some(level) => out.push((coordinate, level)),
                    None => return out,
                }
            }
        }
        out
    }

    /// The level of one emitter for a setting; a colour is light, so that the dimmer is undone.
    pub fn level_of(
        &mut self,
        bank: usize,
        channel: usize,
        setting: Setting,
        span: Span,
    ) -> Option<f64> {
        let colour = match setting {
            Setting::Level(level) => return Some(level),
            Setting::Colour(colour) => colour,
        };
        let (rgb, dimmer) = self.show.banks.get(bank).map(|b| (b.rgb, b.dimmer))?;
        if !rgb {
            self.not_rgb(bank, span, "a colour");
            return None;
        }
        let light = colour.0.get(channel)?.clamp(0.0, 1.0);
        match dimmer {
            Dimmer::Linear => Some(light),
            Dimmer::Square => Some(light.sqrt()),
            Dimmer::Curve(_) => {
                let message = "a colour needs a `linear` or a `square` dimmer";
                let help = "set the three emitters: `sky.r 40  sky.g 20  sky.b 60`";
                self.report
                    .error(codes::DOES_NOT_FIT, message, (span, "a colour"), help)
            }
        }
    }
}
