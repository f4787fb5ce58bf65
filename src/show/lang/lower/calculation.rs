//! Named values (`let`) and calculations: `(slow + 2)`.
//!
//! Quantities of one kind are added and subtracted; a quantity is multiplied or divided by a plain
//! number; two of a kind divide to a plain number. A number without a unit takes the kind that it
//! meets. Invariants: each value is computed once, in any order of declaration; a result is the
//! text that the author would have written for it.

use std::borrow::Cow;

use pest::iterators::Pair;

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::{Declaration, Span, Statement, Word};
use crate::lang::names::Kind;
use crate::lang::quantity::{self, Unit, Wanted};
use crate::lang::report::Place;
use crate::lang::syntax::{self, Rule};
use crate::lang::{codes, limits};
use crate::units::{Time, percent};

/// Result of a calculation.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    /// As written, `#ffb36b`.
    Colour(String),
    /// Seconds, metres, or whatever the unit says; lengths in metres.
    Amount(f64, Unit),
}

/// A declared value.
#[derive(Debug)]
pub struct Named<'a> {
    /// The text after the equals sign.
    word: Word<'a>,
    worth: Worth,
}

#[derive(Clone, Debug)]
enum Worth {
    Unknown,
    /// Being computed.
    Busy,
    /// `None` when it has an error, already reported.
    Known(Option<Value>),
}

/// A piece of a calculation whose text begins at `base`.
fn word_of<'t>(pair: &Pair<'t, Rule>, base: Span) -> Word<'t> {
    let (start, end) = (pair.as_span().start() as u32, pair.as_span().end() as u32);
    let span = Span {
        file: base.file,
        start: base.start + start,
        end: base.start + end,
    };
    Word {
        text: pair.as_str(),
        span,
    }
}

impl<'a> Lower<'a, '_> {
    /// Collects the values and computes them.
    pub fn values(&mut self, statements: &[Statement<'a>]) {
        for statement in statements {
            if let Declaration::Let { value, .. } = &statement.item {
                self.values.push(Named {
                    word: *value,
                    worth: Worth::Unknown,
                });
            }
        }
        for index in 0..self.values.len() {
            let _ = self.named(index, 0);
        }
    }

    /// The text of a quantity or a colour; a calculation is replaced by the text of its result.
    /// `None` when it has an error, already reported.
    pub fn text<'w>(&mut self, word: Word<'w>) -> Option<Cow<'w, str>> {
        if !word.text.starts_with('(') {
            return Some(Cow::Borrowed(word.text));
        }
        let value = self.worked_out(word, Rule::calculation, 0)?;
        Some(Cow::Owned(written(&value)))
    }

    fn named(&mut self, index: usize, depth: usize) -> Option<Value> {
        let named = self.values.get_mut(index)?;
        let word = named.word;
        match &named.worth {
            Worth::Known(value) => return value.clone(),
            Worth::Busy => {
                let help = "a value is worked out from others, in the end from numbers";
                let at = (word.span, "in a circle");
                return self.report.error(
                    codes::CYCLE,
                    "this value is defined by itself",
                    at,
                    help,
                );
            }
            Worth::Unknown => named.worth = Worth::Busy,
        }
        let value = self.worked_out(word, Rule::let_value, depth);
        if let Some(named) = self.values.get_mut(index) {
            named.worth = Worth::Known(value.clone());
        }
        value
    }

    fn worked_out(&mut self, word: Word<'_>, rule: Rule, depth: usize) -> Option<Value> {
        if depth > limits::VALUES {
            let message = format!("a value rests on more than {} others", limits::VALUES);
            let help = "write one of them out";
            return self
                .report
                .error(codes::TOO_LARGE, message, (word.span, "too far"), help);
        }
        let pair = syntax::parse(rule, word.text).ok()?.next()?;
        // A named colour is a value that may depend on another.
        let outer = std::mem::replace(&mut self.depth, depth);
        let value = self.evaluated(pair, word.span, depth);
        self.depth = outer;
        value
    }

    /// The value of this name as a show would write it.
    pub fn value_called(&mut self, name: &str) -> Option<String> {
        let index = self.names.get(name)?.index?;
        let value = self.named(index, self.depth + 1)?;
        Some(written(&value))
    }

    fn evaluated(&mut self, pair: Pair<'_, Rule>, base: Span, depth: usize) -> Option<Value> {
        let word = word_of(&pair, base);
        match pair.as_rule() {
            Rule::colour => self
                .colour(word)
                .map(|_| Value::Colour(word.text.to_owned())),
            Rule::measure => self.measured(word),
            Rule::level_word => self
                .level(word)
                .map(|level| Value::Amount(percent(level), Unit::Percent)),
            Rule::name => {
                let (_, index) = self.find(word, &[Kind::Value], &[])?;
                self.named(index, depth + 1)
            }
            Rule::factor => {
                let mut inner = pair.into_inner();
                let value = self.evaluated(inner.next_back()?, base, depth)?;
                match (inner.next(), value) {
                    (None, value) => Some(value),
                    (Some(_), Value::Amount(x, unit)) => Some(Value::Amount(-x, unit)),
                    (Some(_), value) => {
                        self.refused(word.span, &format!("{} has no sign", kind(&value)))
                    }
                }
            }
            _ => {
                // Brackets are not operands.
                let mut operands = pair.into_inner().filter(|p| !is_bracket(p.as_rule()));
                let mut value = self.evaluated(operands.next()?, base, depth)?;
                while let (Some(operator), Some(operand)) = (operands.next(), operands.next()) {
                    let other = self.evaluated(operand, base, depth)?;
                    value = self.combined(operator.as_rule(), &value, &other, word.span)?;
                }
                Some(value)
            }
        }
    }

    fn measured(&mut self, word: Word<'_>) -> Option<Value> {
        let unit = quantity::unit(word.text);
        let read = unit.clone().and_then(|unit| match unit {
            Unit::Time => quantity::time(word.text).map(Time::seconds),
            _ => quantity::number(word.text),
        });
        match (unit, read) {
            (Ok(Unit::Length(_)), Ok(metres)) => Some(Value::Amount(metres, Unit::Length(1.0))),
            (Ok(unit), Ok(value)) => Some(Value::Amount(value, unit)),
            (Err(fault), _) | (_, Err(fault)) => self.fault(word, Wanted::Number, &fault),
        }
    }

    fn combined(&mut self, operator: Rule, a: &Value, b: &Value, span: Span) -> Option<Value> {
        let (Value::Amount(x, of), Value::Amount(y, by)) = (a, b) else {
            return self.refused(span, "colours cannot be calculated with");
        };
        let unit = match (operator, *of, *by) {
            (Rule::slash, _, _) if *y == 0.0 => return self.refused(span, "this divides by zero"),
            (Rule::slash, a, b) if a == b => Some(Unit::Bare),
            (Rule::times | Rule::slash, unit, Unit::Bare) => Some(unit),
            (Rule::times, Unit::Bare, unit) => Some(unit),
            (Rule::plus | Rule::minus, a, b) if a == b || b == Unit::Bare => Some(a),
            (Rule::plus | Rule::minus, Unit::Bare, b) => Some(b),
            _ => None,
        };
        let Some(unit) = unit else {
            let verb = match operator {
                Rule::plus => "added to",
                Rule::minus => "subtracted from",
                Rule::times => "multiplied by",
                _ => "divided by",
            };
            let (first, second) = match operator {
                Rule::plus | Rule::minus => (kind(b), kind(a)),
                _ => (kind(a), kind(b)),
            };
            return self.refused(span, &format!("{first} cannot be {verb} {second}"));
        };
        let value = match operator {
            Rule::plus => x + y,
            Rule::minus => x - y,
            Rule::times => x * y,
            _ => x / y,
        };
        if value.is_finite() && value.abs() <= LARGEST {
            return Some(Value::Amount(value, unit));
        }
        self.refused(span, "this comes to more than a million million")
    }

    fn refused<T>(&mut self, span: Span, message: &str) -> Option<T> {
        let help = "quantities of one kind are added; one is multiplied or divided by a plain number: `(2 * slow + 1)`";
        let diagnostic = Diagnostic::error(codes::CALCULATION, message);
        self.report.add(diagnostic.place(span, "here").help(help));
        None
    }
}

/// Greatest magnitude of a result; no quantity of a show is larger.
const LARGEST: f64 = 1e12;

fn is_bracket(rule: Rule) -> bool {
    matches!(rule, Rule::open_round | Rule::close_round | Rule::EOI)
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Colour(_) => "a colour",
        Value::Amount(_, unit) => unit.kind(),
    }
}

/// The value as a show would write it.
fn written(value: &Value) -> String {
    let (value, unit) = match value {
        Value::Colour(text) => return text.clone(),
        Value::Amount(value, unit) => (*value, *unit),
    };
    let suffix = match unit {
        Unit::Bare => "",
        Unit::Percent => "%",
        Unit::Length(_) => "m",
        Unit::Degree => "deg",
        Unit::Candela => " cd",
        Unit::Lumen => " lm",
        Unit::Luminance => " cd/m2",
        Unit::Kelvin => " K",
        // Rounded to the microsecond, which makes sums of times exact.
        Unit::Time => return format!("{value:.6}s"),
    };
    format!("{value}{suffix}")
}

/// Describes a calculated quantity for a message about it.
pub fn result(word: Word<'_>, text: &str) -> String {
    if word.text == text {
        return String::new();
    }
    let end = text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '-' | '.')));
    let (digits, unit) = text.split_at(end.unwrap_or(text.len()));
    let rounded = digits.parse::<f64>().map(|v| (v * 1e6).round() / 1e6);
    let shown = rounded.map_or_else(|_| text.to_owned(), |v| format!("{v}{unit}"));
    format!(", which is {shown},")
}

#[cfg(test)]
mod tests;
