//! Effects, and the moves of a cue that begin or end them.

use super::Lower;
use crate::lang::ast::{self, Clause, Declaration, Statement, Word};
use crate::lang::codes;
use crate::lang::names::Kind;
use crate::lang::quantity::Wanted;
use crate::model::{Effect, EffectChange, EffectKind, NodeId};
use crate::units::fraction;

impl<'a> Lower<'a, '_> {
    /// Lowers the effects.
    pub fn effects(&mut self, statements: &[Statement<'a>]) {
        for statement in statements {
            let Declaration::Effect {
                name,
                kind,
                clauses,
            } = &statement.item
            else {
                continue;
            };
            let id = self.node(statement.span);
            self.repeated_clauses(clauses);
            let mut effect = Effect {
                id,
                name: name.text.to_owned(),
                kind: EffectKind::Pulse,
                rate: 1.0,
                depth: 0.5,
            };
            if kind.text == "flicker" {
                effect.kind = EffectKind::Flicker(1);
                effect.rate = 6.0;
            }
            for clause in clauses {
                // An error was reported; the clause then changes nothing.
                let _ = self.effect_clause(clause, &mut effect);
            }
            self.show.effects.push(effect);
        }
    }

    fn effect_clause(&mut self, clause: &Clause<'a>, effect: &mut Effect) -> Option<()> {
        let value = *clause.values.first()?;
        match (clause.word.text, effect.kind) {
            ("rate", _) => {
                let range = "a rate is 0.01 to 50 times a second";
                effect.rate = self.within(value, Wanted::Number, (0.01, 50.0), range)?;
            }
            ("depth", _) => {
                let range = "a depth is 0% to 100%";
                let percent = self.within(value, Wanted::Share, (0.0, 100.0), range)?;
                effect.depth = fraction(percent);
            }
            (_, EffectKind::Flicker(_)) => {
                effect.kind = EffectKind::Flicker(self.count(value, 999_999, "a seed")?);
            }
            _ => {
                let message = "a pulse has no `seed`: nothing of it is random";
                let at = (clause.span, "not here");
                self.report
                    .error::<()>(codes::DOES_NOT_FIT, message, at, "");
            }
        }
        Some(())
    }

    /// The effect that a move begins or ends on each of its banks. Spread over a group, each bank
    /// lags the one before it by an equal share of the period.
    pub fn effect_changes(&mut self, written: &ast::Move<'a>, id: NodeId) -> Vec<EffectChange> {
        let (Some(begun), Some(target)) = (written.effect, written.target) else {
            return Vec::new();
        };
        let word = begun.name;
        if let Some(channel) = target.channel {
            let message = "an effect runs on a bank, not on one of its emitters";
            let at = (channel.span, "one emitter");
            let help = format!("write `{} effect {}`", target.name.text, word.text);
            self.report
                .error::<()>(codes::DOES_NOT_FIT, message, at, help);
            return Vec::new();
        }
        let banks = self.banks_of_target(target, &[Kind::Bank, Kind::Group], &[]);
        let Some(effect) = self.effect_called(word) else {
            return Vec::new();
        };
        let number = banks.len();
        if let Some(span) = begun.spread.filter(|_| effect.is_none() || number < 2) {
            let message = "`spread` is for an effect that begins on several banks";
            let help =
                "spread it over a group: `group units = a b c`, `units 60 effect wave spread`";
            self.report
                .error::<()>(codes::DOES_NOT_FIT, message, (span, "not here"), help);
        }
        let change = |(i, bank)| EffectChange {
            id,
            bank,
            effect,
            spread: begun.spread.map(|_| (i as u32, number as u32)),
        };
        banks.into_iter().enumerate().map(change).collect()
    }

    /// `none`, or an effect of the show.
    fn effect_called(&mut self, word: Word<'a>) -> Option<Option<usize>> {
        if word.text == "none" && self.names.get("none").is_none() {
            return Some(None);
        }
        let (_, index) = self.find(word, &[Kind::Effect], &["none"])?;
        Some(Some(index))
    }
}
