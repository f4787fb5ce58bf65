//! Levels on banks and groups, and the looks made of them.

use std::collections::BTreeMap;

use super::Lower;
use super::values::Setting;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::{self, Declaration, Span, Statement, Target, Term, Word};
use crate::lang::codes;
use crate::lang::names::Kind;
use crate::lang::report::Place;
use crate::model::Look;

/// Levels of parameters (see [`crate::model::Show::parameters`]), with their positions in the text.
pub type Levels = BTreeMap<usize, (f64, Span)>;

/// Breadth of a target, the widest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Breadth {
    /// `blackout`
    Everything,
    /// A group or a look.
    Several,
    /// A bank, or one of its emitters.
    Bank,
    /// A head.
    Light,
}

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

    /// Lowers a look after the looks that it contains; without recursion, so that a long chain of
    /// looks costs no stack.
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
                    let levels = self.with_full(levels);
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

    /// The combined levels of terms; the later term wins.
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

    /// The levels of a look, where a colour without a level sets the level to full.
    pub fn with_full(&self, mut levels: Levels) -> Levels {
        let colours = levels
            .range(..)
            .filter(|(p, _)| self.emitter(**p) == Some(0));
        let mut full = Vec::new();
        for (red, (_, span)) in colours {
            let whole = levels.contains_key(&(red + 1)) && levels.contains_key(&(red + 2));
            if whole && !levels.contains_key(&(red - 1)) {
                full.push((red - 1, (1.0, *span)));
            }
        }
        levels.extend(full);
        levels
    }

    /// Emitter index of a parameter within its bank; `None` for a level.
    pub fn emitter(&self, parameter: usize) -> Option<usize> {
        let after = self
            .first_parameters
            .partition_point(|first| *first <= parameter);
        let first = after
            .checked_sub(1)
            .and_then(|i| self.first_parameters.get(i))?;
        (parameter - first).checked_sub(1)
    }

    fn block(&mut self, levels: &[ast::Level<'a>]) -> Levels {
        let mut out = Levels::new();
        let mut alone = std::collections::BTreeSet::new();
        for level in levels {
            let setting = self.settings(level.value, level.second);
            let banks = self.banks_of_target(level.target, &[Kind::Bank, Kind::Group], &[]);
            let Some(setting) = setting else { continue };
            let own = self.breadth(Some(level.target)) == Breadth::Bank;
            for (parameter, value) in self.resolved_levels(&banks, level.target, setting) {
                let earlier = out.insert(parameter, (value, level.target.span));
                let first = alone.insert(parameter) && own;
                if let Some((_, earlier)) = earlier.filter(|_| !first) {
                    self.report_set_twice(parameter, level.target.span, earlier, "look");
                    break;
                }
                if !own {
                    alone.remove(&parameter);
                }
            }
        }
        out
    }

    /// Breadth of a target: a narrower one overrides what comes before it.
    pub fn breadth(&self, target: Option<Target<'_>>) -> Breadth {
        let Some(target) = target else {
            return Breadth::Everything;
        };
        match self.names.get(target.name.text).map(|e| e.kind) {
            Some(Kind::Group | Kind::Look) => Breadth::Several,
            Some(Kind::Light) => Breadth::Light,
            _ => Breadth::Bank,
        }
    }

    /// Reports a parameter that is set twice where once is allowed.
    pub fn report_set_twice(&mut self, parameter: usize, span: Span, earlier: Span, scope: &str) {
        let mut at = self.first_parameters.iter().zip(&self.show.banks);
        let bank = at.rfind(|(first, _)| **first <= parameter);
        let name = bank.map_or("", |(_, bank)| bank.name.as_str());
        let mut message = format!("the bank `{name}` stands twice in one {scope}");
        if let Some(pose) = parameter.checked_sub(self.first_pose) {
            let head = self.show.heads().get(pose / 4).map(|(light, ..)| *light);
            let light = head.and_then(|light| self.show.lights.get(light));
            let name = light.map_or("", |l| l.name.as_str());
            message = format!("the head `{name}` is pointed twice in one {scope}");
        }
        let help = if scope == "look" {
            "keep one of the two; a bank alone may stand behind its group"
        } else {
            "keep one of the two, or move it again in a later cue; a bank alone may stand behind `blackout`, a group or a look"
        };
        self.report.add(
            Diagnostic::error(codes::MOVED_TWICE, message)
                .place(span, "again here")
                .place(earlier, "first here")
                .help(help),
        );
    }

    /// The banks of a target: the bank itself, or its group's.
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
                if self.spend(banks.len(), target.span) {
                    banks
                } else {
                    Vec::new()
                }
            }
            _ => vec![index],
        }
    }

    fn not_rgb(&mut self, bank: usize, span: Span, what: &str) {
        let name = self.show.banks.get(bank).map_or("", |b| b.name.as_str());
        let message = format!("the bank `{name}` is not rgb");
        let help = format!("give it a level, such as `{name} 85`, or add `rgb` to its declaration");
        self.report
            .error::<()>(codes::NOT_RGB, message, (span, what), help);
    }

    /// Parameters of some banks and the level that a setting gives each.
    pub fn resolved_levels(
        &mut self,
        banks: &[usize],
        target: Target<'a>,
        setting: Setting,
    ) -> Vec<(usize, f64)> {
        let mut out = Vec::new();
        for bank in banks {
            match self.levels_of(*bank, target, setting) {
                Some(levels) => out.extend(levels),
                None => return out,
            }
        }
        out
    }

    /// The parameters of a bank that a setting moves, with their levels. A colour is light: the
    /// dimmer acts on the level alone.
    pub fn levels_of(
        &mut self,
        bank: usize,
        target: Target<'a>,
        setting: Setting,
    ) -> Option<Vec<(usize, f64)>> {
        let first = self.first_parameters.get(bank).copied()?;
        let rgb = self.show.banks.get(bank)?.rgb;
        if let Some(channel) = target.channel {
            if !rgb {
                self.not_rgb(bank, channel.span, "has no emitters of its own");
                return None;
            }
            let emitter = self.emitter_called(channel)?;
            let of_colour = setting
                .colour
                .and_then(|(rgb, _)| rgb.0.get(emitter).copied());
            let light = of_colour.or(setting.level)?.clamp(0.0, 1.0);
            return Some(vec![(first + 1 + emitter, light)]);
        }
        let mut out: Vec<(usize, f64)> = setting.level.map(|l| (first, l)).into_iter().collect();
        if let Some((colour, span)) = setting.colour {
            if !rgb {
                self.not_rgb(bank, span, "a colour");
                return None;
            }
            let lights = colour.0.iter().map(|light| light.clamp(0.0, 1.0));
            out.extend((first + 1..).zip(lights));
        }
        Some(out)
    }

    fn emitter_called(&mut self, channel: Word<'a>) -> Option<usize> {
        let emitters = ["r", "g", "b"];
        let found = emitters.iter().position(|c| *c == channel.text);
        if found.is_none() {
            let message = format!("`{}` is not an emitter", channel.text);
            let help = "the emitters of an rgb bank are `r`, `g` and `b`";
            self.report
                .error::<()>(codes::NOT_RGB, message, (channel.span, "not here"), help);
        }
        found
    }
}
