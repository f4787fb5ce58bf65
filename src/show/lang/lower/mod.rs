//! Lowers the tree to the model: names become indices, texts become quantities, and the invariants
//! of [`crate::model`] are established.
//!
//! Two passes: all names are declared first, so that order does not matter; then each family of
//! statements is lowered, and every error reported. A show results only when there is no error;
//! placeholders for broken pieces never leave this module.

mod calculation;
mod colour;
mod cues;
mod curves;
mod effects;
mod haze;
mod heads;
mod levels;
pub(super) mod light;
mod lint;
mod moves;
mod preview;
mod rig;
mod solid;
mod triggers;
mod values;

use std::collections::BTreeMap;

use self::calculation::Named;
pub(super) use self::colour::{hex, named};
use super::ast::{Declaration, Span, Statement, Word};
use super::names::{self, Kind, Names};
use super::quote::unquoted;
use super::read::Read;
use super::report::{Place, Report};
use super::spans::SpanMap;
use super::syntax::UNIT_WORDS;
use super::{codes, limits};
use crate::diagnostic::Diagnostic;
use crate::model::{HeadAxis, NodeId, Show};
use crate::units::Rgb;

/// Lowers the statements of a show. Returns the show, if there was no error, and the spans of its
/// nodes.
pub fn lower(read: &Read<'_>, report: &mut Report) -> (Option<Show>, SpanMap) {
    let statements = read.statements.as_slice();
    let mut lower = Lower {
        names: Names::default(),
        report,
        spans: SpanMap::default(),
        show: Show::default(),
        values: Vec::new(),
        first_parameters: Vec::new(),
        first_pose: 0,
        heads: Vec::new(),
        aims: heads::Aims::new(),
        budget: limits::LEVELS,
        names_lost: read.names_lost,
        gels: &read.gels,
        depth: 0,
    };
    lower.declare(statements);
    for (kind, name) in &read.broken {
        // A clash with a broken declaration is not reported: the first error is elsewhere.
        let _ = lower.names.declare(*name, *kind, None);
    }
    lower.values(statements);
    lower.preview(statements);
    lower.rig(statements);
    lower.curves(statements);
    lower.effects(statements);
    lower.lower_looks(statements);
    lower.cues(statements);
    if !read.cue_lost {
        lower.triggers();
    }
    let failed = lower.report.failed();
    if !failed {
        lower.lints();
    }
    ((!failed).then_some(lower.show), lower.spans)
}

struct Lower<'a, 'r> {
    names: Names<'a>,
    report: &'r mut Report,
    spans: SpanMap,
    show: Show,
    /// In the order of their statements.
    values: Vec<Named<'a>>,
    /// The first parameter of each bank; the last entry is their number.
    first_parameters: Vec<usize>,
    /// The first parameter of heads.
    first_pose: usize,
    /// In the order of [`Show::heads`].
    heads: Vec<heads::InBank>,
    aims: heads::Aims,
    /// Levels that may still be expanded.
    budget: usize,
    /// True when a file was not read, which was reported: it may declare any name.
    names_lost: bool,
    /// Colours of gels by number.
    gels: &'r BTreeMap<String, Rgb>,
    /// Nesting of values that depend on each other, during a calculation.
    depth: usize,
}

impl<'a> Lower<'a, '_> {
    fn declare(&mut self, statements: &[Statement<'a>]) {
        let mut counts: BTreeMap<Kind, usize> = BTreeMap::new();
        for statement in statements {
            let (name, kind) = match &statement.item {
                Declaration::View { name, .. } => (name, Kind::View),
                Declaration::Light(light) => (&light.name, Kind::Light),
                Declaration::Point { name, .. } => (name, Kind::Point),
                Declaration::Bank(bank) => (&bank.name, Kind::Bank),
                Declaration::Fixed { name, .. } => (name, Kind::Fixed),
                Declaration::Group { name, .. } => (name, Kind::Group),
                Declaration::Look { name, .. } => (name, Kind::Look),
                Declaration::Curve { name, .. } => (name, Kind::Curve),
                Declaration::Effect { name, .. } => (name, Kind::Effect),
                Declaration::Let { name, .. } => (name, Kind::Value),
                _ => continue,
            };
            let count = counts.entry(kind).or_default();
            self.declare_one(*name, kind, *count);
            *count += 1;
        }
    }

    fn declare_one(&mut self, name: Word<'a>, kind: Kind, index: usize) {
        if names::is_reserved(name.text) {
            let reserved = names::reserved(name.text);
            self.report
                .add(reserved.place(name.span, "cannot be a name"));
        }
        let Some(earlier) = self.names.declare(name, kind, Some(index)) else {
            return;
        };
        let message = if earlier.kind == kind {
            format!("`{}` is declared twice", name.text)
        } else {
            format!("`{}` is {} already", name.text, earlier.kind.phrase())
        };
        self.report.add(
            Diagnostic::error(codes::DECLARED_TWICE, message)
                .place(name.span, "declared again here")
                .place(earlier.span, "first declared here")
                .help("a name stands for one thing in the whole show: give one of the two another name"),
        );
    }

    fn node(&mut self, span: Span) -> NodeId {
        self.spans.add(span)
    }

    /// Finds a name of one of `kinds`, or reports what is wrong. `words` are keywords that might
    /// have been meant. A declaration that is itself broken gives `None` without a report.
    fn find(&mut self, name: Word<'_>, kinds: &[Kind], words: &[&'a str]) -> Option<(Kind, usize)> {
        match self.names.get(name.text) {
            Some(entry) if kinds.contains(&entry.kind) => entry.index.map(|i| (entry.kind, i)),
            Some(_) if self.names.is_refused(name.text, kinds) => None,
            Some(entry) => {
                let message = format!(
                    "expected {}, but `{}` is {}",
                    one_of(kinds),
                    name.text,
                    entry.kind.phrase()
                );
                let diagnostic = Diagnostic::error(codes::WRONG_KIND_OF_NAME, message)
                    .place(name.span, format!("this is {}", entry.kind.phrase()))
                    .place(entry.span, "declared here");
                let head = entry.index.and_then(|i| self.show.lights.get(i)?.head);
                self.report.add(match entry.kind {
                    Kind::Light if head.is_some() && kinds.contains(&Kind::Bank) => {
                        diagnostic.help("the level of a head is that of the bank it stands in")
                    }
                    Kind::Value => diagnostic.help(format!(
                        "a value is used in round brackets: `({})`",
                        name.text
                    )),
                    _ => diagnostic,
                });
                None
            }
            None => self.unknown(name, kinds, words),
        }
    }

    fn unknown<T>(&mut self, name: Word<'_>, kinds: &[Kind], words: &[&'a str]) -> Option<T> {
        if self.report.full() || self.names_lost {
            return None;
        }
        let message = format!(
            "there is no {} called `{}`",
            bare(&one_of(kinds)),
            name.text
        );
        let candidates = self.names.of(kinds).chain(words.iter().copied());
        // Words of other desks matter only where keywords may stand.
        let foreign = names::foreign(name.text).filter(|_| !words.is_empty());
        let help = match (names::nearest(name.text, candidates), foreign) {
            (Some(near), _) => format!("did you mean `{near}`?"),
            (None, Some(help)) => help.to_owned(),
            (None, None)
                if kinds == [Kind::Effect] && ["flicker", "pulse"].contains(&name.text) =>
            {
                format!(
                    "an effect is declared first: `effect candle = {}`, then `effect candle`",
                    name.text
                )
            }
            (None, None) if HeadAxis::ALL.iter().any(|axis| axis.word() == name.text) => format!(
                "the angles of a head stand right behind its name: `mh1 {} 12`",
                name.text
            ),
            (None, None) if name.text == "zoom" => {
                "the zoom of a head is its `beam` and its `field`: `mh1 beam 12 field 18`"
                    .to_owned()
            }
            (None, None) if UNIT_WORDS.contains(&name.text) => {
                format!("a unit stands right behind its number: `5{}`", name.text)
            }
            (None, None) => {
                let known: Vec<&str> = self.names.of(kinds).take(6).collect();
                match known.as_slice() {
                    [] => format!("the show declares no {} yet", bare(&one_of(kinds))),
                    some => format!("there are: {}", some.join(", ")),
                }
            }
        };
        self.report.error(
            codes::UNKNOWN_NAME,
            message,
            (name.span, "not declared"),
            help,
        )
    }

    /// Takes `count` levels from the budget; false, with a report, when the show is too large.
    fn spend(&mut self, count: usize, span: Span) -> bool {
        if self.budget == 0 {
            return false;
        }
        self.budget = self.budget.saturating_sub(count);
        if self.budget == 0 {
            let message = format!("the show sets more than {} levels", limits::LEVELS);
            let help = "groups, looks and `blackout` count once for each of their banks";
            self.report.error::<()>(
                codes::TOO_LARGE,
                message,
                (span, "the limit is reached here"),
                help,
            );
        }
        self.budget > 0
    }
}

fn one_of(kinds: &[Kind]) -> String {
    let phrases: Vec<&str> = kinds.iter().map(|k| k.phrase()).collect();
    match phrases.as_slice() {
        [most @ .., before, last] if !most.is_empty() => {
            format!("{}, {before} or {last}", most.join(", "))
        }
        few => few.join(" or "),
    }
}

fn bare(phrase: &str) -> String {
    phrase
        .trim_start_matches("an ")
        .trim_start_matches("a ")
        .replace(", a ", ", ")
        .replace(" or a ", " or ")
}
