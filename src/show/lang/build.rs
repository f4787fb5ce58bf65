//! Builds the tree of [`super::ast`] from the pairs of the grammar.
//!
//! The grammar guarantees the shapes; if a piece is missing all the same, the builder returns
//! `None` and the caller reports the statement as not understood. Words are slices of the source,
//! not of the parsed copy, which may have lines blanked out.

use pest::iterators::{Pair, Pairs};

use super::ast::{
    Aim, Bank, Body, Clause, Cue, Declaration, EffectBegun, ImageWords, Knot, Level, Light, Mark,
    Motion, Move, Part, Path, Solid, Span, Statement, Target, Term, Timing, TimingKind, Word,
};
use super::syntax::Rule;
use crate::model::Interpolation;

/// Position of the parsed text.
#[derive(Clone, Copy)]
pub struct Builder<'a> {
    /// The whole file.
    pub source: &'a str,
    /// Index of the file.
    pub file: u32,
    /// Byte offset of the statement in it.
    pub base: usize,
}

impl<'a> Builder<'a> {
    /// Builds the statement of `pairs`, the pairs of one statement rule.
    pub fn statement(self, mut pairs: Pairs<'_, Rule>) -> Option<Statement<'a>> {
        let pair = pairs.next()?;
        let rule = pair.as_rule();
        let span = self.trimmed(&pair);
        let mut inner = pair.into_inner();
        let _keyword = inner.next()?;
        let item = match rule {
            Rule::show_statement => Declaration::Show(self.next(&mut inner)?),
            Rule::preview_statement => self.preview(inner)?,
            Rule::include_statement => Declaration::Include,
            Rule::gels_statement => Declaration::Gels,
            Rule::let_statement => {
                let name = self.next(&mut inner)?;
                let value = inner.find(|p| p.as_rule() == Rule::let_value)?;
                let span = self.trimmed(&value);
                let text = self.source.get(span.range())?;
                Declaration::Let {
                    name,
                    value: Word { text, span },
                }
            }
            Rule::stage_statement => self.stage(inner)?,
            Rule::surface_statement => self.surface(inner)?,
            Rule::figure_statement => Declaration::Figure(self.clauses(inner)?),
            Rule::haze_statement => Declaration::Haze {
                amount: self.next(&mut inner)?,
                clauses: self.clauses(inner)?,
            },
            Rule::view_statement => Declaration::View {
                name: self.next(&mut inner)?,
                clauses: self.clauses(inner)?,
            },
            Rule::light_statement => Declaration::Light(self.light(inner)?),
            Rule::bank_statement => Declaration::Bank(self.bank(inner)?),
            Rule::point_statement => {
                let name = self.next(&mut inner)?;
                let at = inner.find(|p| p.as_rule() == Rule::position)?;
                let at = self.words(at);
                Declaration::Point { name, at }
            }
            Rule::fixed_statement | Rule::group_statement => self.list(rule, inner)?,
            Rule::look_statement => self.look(inner)?,
            Rule::default_statement => Declaration::Default(self.timing(inner.next()?)?),
            Rule::curve_statement => self.curve(inner)?,
            Rule::effect_statement => self.effect(inner)?,
            Rule::cue_statement => Declaration::Cue(self.cue(inner)?),
            _ => return None,
        };
        Some(Statement { span, item })
    }

    /// The path of an `include` or of `gels`.
    pub fn included(self, mut pairs: Pairs<'_, Rule>) -> Option<Word<'a>> {
        let mut inner = pairs.next()?.into_inner();
        inner
            .find(|p| p.as_rule() == Rule::text)
            .map(|p| self.word(&p))
    }

    fn span(&self, pair: &Pair<'_, Rule>) -> Span {
        let span = pair.as_span();
        Span {
            file: self.file,
            start: (self.base + span.start()) as u32,
            end: (self.base + span.end()) as u32,
        }
    }

    /// Span of a pair without the blanks before an absent optional rest: it ends with its last
    /// piece.
    fn trimmed(&self, pair: &Pair<'_, Rule>) -> Span {
        let mut span = self.span(pair);
        let mut last = pair.clone();
        loop {
            let mut inner = last.clone().into_inner();
            match inner.rfind(|p| p.as_rule() != Rule::EOI) {
                Some(piece) => last = piece,
                None => break,
            }
        }
        span.end = self.span(&last).end.max(span.start);
        span
    }

    fn word(&self, pair: &Pair<'_, Rule>) -> Word<'a> {
        let span = self.span(pair);
        let text = self.source.get(span.range()).unwrap_or("");
        Word { text, span }
    }

    fn next<'p>(&self, pairs: &mut impl Iterator<Item = Pair<'p, Rule>>) -> Option<Word<'a>> {
        pairs.next().map(|p| self.word(&p))
    }

    fn words(&self, pair: Pair<'_, Rule>) -> Vec<Word<'a>> {
        let words = pair.into_inner().filter(is_word);
        words.map(|p| self.word(&p)).collect()
    }

    fn preview(&self, inner: Pairs<'_, Rule>) -> Option<Declaration<'a>> {
        let mut entries = Vec::new();
        for entry in inner.filter(|p| p.as_rule() == Rule::preview_entry) {
            let mut pieces = entry.into_inner();
            let (key, value) = (self.next(&mut pieces)?, self.next(&mut pieces)?);
            entries.push((key, value, self.next(&mut pieces)));
        }
        Some(Declaration::Preview(entries))
    }

    fn stage(&self, mut inner: Pairs<'_, Rule>) -> Option<Declaration<'a>> {
        let path = self.next(&mut inner)?;
        Some(Declaration::Stage {
            path,
            clauses: self.clauses(inner)?,
        })
    }

    fn surface(&self, mut inner: Pairs<'_, Rule>) -> Option<Declaration<'a>> {
        let material = self.next(&mut inner)?;
        let (mut reflectances, mut solids) = (Vec::new(), Vec::new());
        let clauses = self.clauses(inner.clone())?;
        for pair in inner {
            match pair.as_rule() {
                Rule::reflectance => reflectances.push(self.words(pair)),
                Rule::solid => solids.push(self.solid(pair)?),
                _ => {}
            }
        }
        Some(Declaration::Surface {
            material,
            reflectances,
            clauses,
            solids,
        })
    }

    fn solid(&self, pair: Pair<'_, Rule>) -> Option<Solid<'a>> {
        let span = self.trimmed(&pair);
        let mut inner = pair.into_inner().peekable();
        let kind = inner.next().map(|p| self.word(&p))?;
        let positions = inner.next_if(|p| p.as_rule() == Rule::corners);
        let positions = positions.into_iter().flat_map(Pair::into_inner);
        Some(Solid {
            kind,
            corners: positions.flat_map(|p| self.words(p)).collect(),
            clauses: self.clauses(inner)?,
            span,
        })
    }

    fn clauses<'p>(&self, inner: impl Iterator<Item = Pair<'p, Rule>>) -> Option<Vec<Clause<'a>>> {
        let mut out = Vec::new();
        for pair in inner {
            let clause = [
                Rule::stage_clause,
                Rule::haze_clause,
                Rule::surface_clause,
                Rule::figure_clause,
                Rule::view_clause,
                Rule::light_clause,
                Rule::solid_clause,
                Rule::effect_clause,
            ];
            if !clause.contains(&pair.as_rule()) {
                continue;
            }
            let span = self.trimmed(&pair);
            let mut pieces = pair.into_inner();
            let word = self.next(&mut pieces)?;
            let mut values = Vec::new();
            for piece in pieces {
                match piece.as_rule() {
                    Rule::position => values.extend(self.words(piece)),
                    Rule::kw_to => {}
                    _ => values.push(self.word(&piece)),
                }
            }
            out.push(Clause { word, values, span });
        }
        Some(out)
    }

    fn light(&self, mut inner: Pairs<'_, Rule>) -> Option<Light<'a>> {
        let name = self.next(&mut inner)?;
        let mut kind = inner.next()?.into_inner();
        let word = self.next(&mut kind)?;
        let of = self.next(&mut kind);
        Some(Light {
            name,
            kind: word,
            of,
            clauses: self.clauses(inner)?,
        })
    }

    fn bank(&self, mut inner: Pairs<'_, Rule>) -> Option<Bank<'a>> {
        let mut bank = Bank {
            name: self.next(&mut inner)?,
            lights: Vec::new(),
            image: None,
            channels: Vec::new(),
            dimmers: Vec::new(),
            rgb: false,
        };
        for pair in inner {
            match pair.as_rule() {
                Rule::names => bank.lights = self.words(pair),
                Rule::image => bank.image = Some(self.image(pair)?),
                Rule::bank_option => {
                    let mut pieces = pair.into_inner();
                    let keyword = pieces.next()?.as_rule();
                    match (keyword, self.next(&mut pieces)) {
                        (Rule::kw_channel, Some(value)) => bank.channels.push(value),
                        (Rule::kw_dimmer, Some(value)) => bank.dimmers.push(value),
                        _ => bank.rgb = true,
                    }
                }
                _ => {}
            }
        }
        Some(bank)
    }

    fn image(&self, pair: Pair<'_, Rule>) -> Option<ImageWords<'a>> {
        let mut texts = pair.into_inner().filter(|p| p.as_rule() == Rule::text);
        Some(ImageWords {
            path: self.word(&texts.next()?),
            layer: texts.next().map(|p| self.word(&p)),
        })
    }

    fn list(&self, rule: Rule, mut inner: Pairs<'_, Rule>) -> Option<Declaration<'a>> {
        let name = self.next(&mut inner)?;
        let (mut names, mut image, mut level) = (Vec::new(), None, None);
        for pair in inner {
            match pair.as_rule() {
                Rule::names => names = self.words(pair),
                Rule::image => image = Some(self.image(pair)?),
                Rule::value => level = Some(self.word(&pair)),
                _ => {}
            }
        }
        Some(match rule {
            Rule::group_statement => Declaration::Group { name, banks: names },
            _ => Declaration::Fixed {
                name,
                lights: names,
                image,
                level,
            },
        })
    }

    fn look(&self, mut inner: Pairs<'_, Rule>) -> Option<Declaration<'a>> {
        let name = self.next(&mut inner)?;
        let terms = self.terms(inner)?;
        Some(Declaration::Look { name, terms })
    }

    fn terms(&self, inner: Pairs<'_, Rule>) -> Option<Vec<Term<'a>>> {
        let terms = inner.filter(|p| matches!(p.as_rule(), Rule::look_term | Rule::look_block));
        terms.map(|p| self.term(p)).collect()
    }

    fn term(&self, pair: Pair<'_, Rule>) -> Option<Term<'a>> {
        let term = match pair.as_rule() {
            Rule::look_term => pair.into_inner().next()?,
            _ => pair,
        };
        Some(match term.as_rule() {
            Rule::look_block => Term::Levels(self.levels(term)?),
            _ => Term::Look(self.word(&term)),
        })
    }

    fn levels(&self, block: Pair<'_, Rule>) -> Option<Vec<Level<'a>>> {
        let levels = block
            .into_inner()
            .filter(|p| p.as_rule() == Rule::look_level);
        let level = |pair: Pair<'_, Rule>| {
            let mut pieces = pair.into_inner().filter(|p| p.as_rule() != Rule::kw_to);
            Some(Level {
                target: self.target(pieces.next()?)?,
                value: self.word(&pieces.next()?),
                second: self.next(&mut pieces),
            })
        };
        levels.map(level).collect()
    }

    fn target(&self, pair: Pair<'_, Rule>) -> Option<Target<'a>> {
        let span = self.span(&pair);
        let mut pieces = pair.into_inner();
        Some(Target {
            name: self.next(&mut pieces)?,
            channel: self.next(&mut pieces),
            span,
        })
    }

    fn curve(&self, mut inner: Pairs<'_, Rule>) -> Option<Declaration<'a>> {
        let name = self.next(&mut inner)?;
        let path = inner.find(|p| p.as_rule() == Rule::path)?;
        Some(Declaration::Curve {
            name,
            path: self.path(path)?,
        })
    }

    fn effect(&self, mut inner: Pairs<'_, Rule>) -> Option<Declaration<'a>> {
        Some(Declaration::Effect {
            name: self.next(&mut inner)?,
            kind: inner
                .find(|p| p.as_rule() == Rule::effect_kind)
                .map(|p| self.word(&p))?,
            clauses: self.clauses(inner)?,
        })
    }

    fn path(&self, pair: Pair<'_, Rule>) -> Option<Path<'a>> {
        let span = self.trimmed(&pair);
        let mut inner = pair.into_inner();
        let interpolation = interpolation(inner.next()?);
        let knots = inner.filter(|p| p.as_rule() == Rule::knot);
        Some(Path {
            interpolation,
            knots: knots.map(|p| self.knot(p)).collect::<Option<_>>()?,
            span,
        })
    }

    fn knot(&self, pair: Pair<'_, Rule>) -> Option<Knot<'a>> {
        let span = self.trimmed(&pair);
        let mut inner = pair.into_inner();
        let mut knot = Knot {
            at: self.next(&mut inner)?,
            value: self.next(&mut inner)?,
            slope: None,
            via: None,
            span,
        };
        if let Some(extra) = inner.next() {
            let via = extra.as_rule() == Rule::via;
            let mut values = extra.into_inner().skip(1);
            let first = self.word(&values.next()?);
            if via {
                knot.via = Some((first, self.word(&values.next()?)));
            } else {
                knot.slope = Some(first);
            }
        }
        Some(knot)
    }

    fn timing(&self, pair: Pair<'_, Rule>) -> Option<Timing<'a>> {
        let kind = match pair.as_rule() {
            Rule::time => TimingKind::Time,
            Rule::up => TimingKind::Up,
            Rule::down => TimingKind::Down,
            Rule::delay => TimingKind::Delay,
            Rule::snap => TimingKind::Snap,
            Rule::fade => TimingKind::Curve,
            Rule::repeat => TimingKind::Repeat,
            _ => return None,
        };
        let span = self.trimmed(&pair);
        let mut values = pair.into_inner().filter(is_word);
        Some(Timing {
            kind,
            value: values.next().map(|p| self.word(&p)),
            second: values.next().map(|p| self.word(&p)),
            span,
        })
    }

    fn cue(&self, inner: Pairs<'_, Rule>) -> Option<Cue<'a>> {
        let (mut number, mut label, mut at, mut body) = (None, None, None, None);
        for pair in inner {
            match pair.as_rule() {
                Rule::cue_number => number = Some(self.word(&pair)),
                Rule::text => label = Some(self.word(&pair)),
                Rule::at => at = pair.into_inner().nth(1).map(|p| self.word(&p)),
                Rule::body => body = Some(self.body(pair)?),
                _ => {}
            }
        }
        Some(Cue {
            number: number?,
            label,
            at,
            body: body?,
        })
    }

    fn body(&self, pair: Pair<'_, Rule>) -> Option<Body<'a>> {
        let mut body = Body::default();
        for item in pair.into_inner() {
            let span = self.trimmed(&item);
            match item.as_rule() {
                Rule::part => body.parts.push(self.part(item, span)?),
                Rule::movement | Rule::blackout => {
                    let mut made = match item.as_rule() {
                        Rule::movement => self.movement(item, span)?,
                        _ => Move {
                            target: None,
                            motion: Motion::Bare,
                            aim: None,
                            effect: None,
                            timing: Vec::new(),
                            span,
                            beside: None,
                        },
                    };
                    let before = body.moves.last().filter(|last| last.timing.is_empty());
                    let before = before.filter(|last| self.beside(last, &body.parts, span));
                    made.beside = before.map(|last| last.span);
                    body.moves.push(made);
                }
                Rule::flag | Rule::follow | Rule::hang | Rule::at => {
                    let mark = mark(&item);
                    let value = item.into_inner().nth(1).map(|p| self.word(&p));
                    body.marks.push((mark, value, span));
                }
                Rule::note => {
                    let text = item.into_inner().nth(1).map(|p| self.word(&p))?;
                    body.notes.push((text, span));
                }
                Rule::open_brace | Rule::close_brace => {}
                _ => {
                    let timing = self.timing(item)?;
                    match body.moves.last_mut() {
                        Some(last) if self.beside(last, &body.parts, span) => {
                            last.timing.push(timing)
                        }
                        _ => body.timing.push(timing),
                    }
                }
            }
        }
        Some(body)
    }

    /// True when `span` is on the line of the move before it; timing there belongs to that move.
    fn beside(&self, last: &Move<'a>, parts: &[Part<'a>], span: Span) -> bool {
        let from = last.timing.last().map_or(last.span, |t| t.span).end as usize;
        let between = self.source.get(from..span.start as usize);
        let part_between = parts.last().is_some_and(|p| p.span.start as usize >= from);
        !part_between && between.is_some_and(|text| !text.contains('\n'))
    }

    /// Adds the pieces of an `aim`, or one angle.
    fn aim(
        &self,
        pair: Pair<'_, Rule>,
        at: &mut Vec<Word<'a>>,
        angles: &mut Vec<(Word<'a>, Word<'a>)>,
    ) -> Option<()> {
        if pair.as_rule() == Rule::angle {
            let mut pieces = pair.into_inner();
            angles.push((self.next(&mut pieces)?, self.next(&mut pieces)?));
            return Some(());
        }
        for piece in pair.into_inner() {
            match piece.as_rule() {
                Rule::name => at.push(self.word(&piece)),
                Rule::position => at.extend(self.words(piece)),
                Rule::angle => self.aim(piece, at, angles)?,
                _ => {}
            }
        }
        Some(())
    }

    fn part(&self, pair: Pair<'_, Rule>, span: Span) -> Option<Part<'a>> {
        let (mut number, mut label, mut body) = (None, None, None);
        for piece in pair.into_inner() {
            match piece.as_rule() {
                Rule::count => number = Some(self.word(&piece)),
                Rule::text => label = Some(self.word(&piece)),
                Rule::body => body = Some(self.body(piece)?),
                _ => {}
            }
        }
        Some(Part {
            number: number?,
            label,
            body: body?,
            span,
        })
    }

    fn movement(&self, pair: Pair<'_, Rule>, span: Span) -> Option<Move<'a>> {
        let mut inner = pair.into_inner();
        let target = self.target(inner.next()?)?;
        let (mut effect, mut at, mut angles) = (None, Vec::new(), Vec::new());
        let mut aim: Option<Span> = None;
        let mut pieces = Vec::new();
        for piece in inner.filter(|p| p.as_rule() != Rule::kw_to) {
            match piece.as_rule() {
                Rule::effect => {
                    let mut words = piece.into_inner().skip(1);
                    let name = self.word(&words.next()?);
                    let spread = words.next().map(|p| self.trimmed(&p));
                    effect = Some(EffectBegun { name, spread });
                }
                Rule::aim | Rule::angle => {
                    let span = self.trimmed(&piece);
                    let start = aim.map_or(span.start, |first| first.start);
                    aim = Some(Span { start, ..span });
                    self.aim(piece, &mut at, &mut angles)?;
                }
                _ => pieces.push(piece),
            }
        }
        let aim = aim.map(|span| Aim { at, angles, span });
        let mut rest = pieces.into_iter().peekable();
        let motion = match rest.peek().map(Pair::as_rule) {
            None => Motion::Bare,
            Some(Rule::path) => Motion::Path(self.path(rest.next()?)?),
            Some(Rule::plus) => {
                let mut terms = Vec::new();
                for pair in rest.filter(|p| p.as_rule() == Rule::look_term) {
                    terms.push(self.term(pair)?);
                }
                Motion::Plus(terms)
            }
            Some(_) => {
                let first = self.word(&rest.next()?);
                Motion::To(first, self.next(&mut rest))
            }
        };
        Some(Move {
            target: Some(target),
            motion,
            aim,
            effect,
            timing: Vec::new(),
            span,
            beside: None,
        })
    }
}

fn is_word(pair: &Pair<'_, Rule>) -> bool {
    matches!(
        pair.as_rule(),
        Rule::name | Rule::quantity | Rule::amount | Rule::colour | Rule::count | Rule::text
    )
}

fn mark(pair: &Pair<'_, Rule>) -> Mark {
    match (pair.as_rule(), pair.as_str()) {
        (Rule::follow, _) => Mark::Follow,
        (Rule::hang, _) => Mark::Hang,
        (Rule::at, _) => Mark::At,
        (_, "block") => Mark::Block,
        (_, "assert") => Mark::Assert,
        _ => Mark::Cueonly,
    }
}

fn interpolation(pair: Pair<'_, Rule>) -> Interpolation {
    let kind = pair.into_inner().last();
    match kind.as_ref().map_or("", Pair::as_str) {
        "linear" => Interpolation::Linear,
        "steps" => Interpolation::Steps,
        "natural" => Interpolation::Natural,
        "clamped" => Interpolation::Clamped,
        "catmull-rom" => Interpolation::CatmullRom,
        "hermite" => Interpolation::Hermite,
        "bezier" => Interpolation::Bezier,
        _ => Interpolation::Monotone,
    }
}
