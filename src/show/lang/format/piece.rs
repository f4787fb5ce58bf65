//! A statement as a row of words, each with how it joins the one before.

use std::ops::Range;

use pest::iterators::Pair;

use crate::lang::scan::first_word;
use crate::lang::syntax::{self, Rule};

/// How a word joins the word before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Join {
    /// It begins a statement.
    Start,
    /// No blank: a comma, a slash.
    Tight,
    /// One blank.
    Word,
    /// It begins a clause: a column of its own, `gap` blanks at least.
    Clause { gap: usize },
    /// It begins a thing that has a line of its own in a block.
    Item,
    /// It begins timing: on the line of the move before it, if it stands there.
    Timing,
    /// It begins an entry that shares a line with its neighbours as the writer likes.
    Entry,
    /// An opening brace; with blanks before it, when it is a column of its own.
    Open { clause: Option<usize> },
    /// A closing brace.
    Close,
}

/// A word with its place in the statement.
#[derive(Clone, Debug)]
pub struct Piece<'a> {
    pub text: &'a str,
    pub span: Range<usize>,
    pub join: Join,
    /// What kind of clause it begins: lines align only where these agree.
    pub role: &'static str,
    /// It begins (or is all of) a move, to which timing behind it on the line belongs.
    pub moves: bool,
}

/// The pieces of a statement, which must parse; empty if it does not.
pub fn pieces(text: &str) -> Vec<Piece<'_>> {
    let Some(rule) = syntax::rule_of(first_word(text)) else {
        return Vec::new();
    };
    let Ok(pairs) = syntax::parse(rule, text) else {
        return Vec::new();
    };
    let mut walk = Walk {
        out: Vec::new(),
        next: Begin::plain(Join::Start, "statement"),
        calculating: false,
    };
    for pair in pairs {
        walk.children(pair);
    }
    walk.out
}

/// What the next leaf begins.
#[derive(Clone, Copy)]
struct Begin {
    join: Join,
    role: &'static str,
    moves: bool,
}

impl Begin {
    fn plain(join: Join, role: &'static str) -> Begin {
        Begin {
            join,
            role,
            moves: false,
        }
    }
}

struct Walk<'a> {
    out: Vec<Piece<'a>>,
    /// For the next leaf.
    next: Begin,
    /// Inside a calculation, where a slash divides.
    calculating: bool,
}

impl<'a> Walk<'a> {
    fn children(&mut self, pair: Pair<'a, Rule>) {
        let within = pair.as_rule();
        let outside = self.calculating;
        self.calculating |= within == Rule::product;
        let mut first = true;
        for child in pair.into_inner() {
            if let Some(begin) = begins(child.as_rule(), within, std::mem::take(&mut first)) {
                self.next = begin;
            }
            self.visit(child);
        }
        self.calculating = outside;
    }

    fn visit(&mut self, pair: Pair<'a, Rule>) {
        let leaf = pair.as_rule() == Rule::target || pair.clone().into_inner().next().is_none();
        if leaf {
            self.leaf(&pair);
        } else {
            self.children(pair);
        }
    }

    fn leaf(&mut self, pair: &Pair<'a, Rule>) {
        let span = pair.as_span().start()..pair.as_span().end();
        if pair.as_rule() == Rule::EOI || span.is_empty() {
            return;
        }
        let (join, role) = match pair.as_rule() {
            Rule::close_round | Rule::comma => (Join::Tight, ""),
            Rule::slash if !self.calculating => (Join::Tight, ""),
            Rule::close_brace => (Join::Close, ""),
            Rule::open_brace => {
                let clause = match self.next.join {
                    Join::Clause { gap } => Some(gap),
                    _ => None,
                };
                (Join::Open { clause }, "{")
            }
            _ => (self.next.join, self.next.role),
        };
        self.out.push(Piece {
            text: pair.as_str(),
            span,
            join,
            role,
            moves: self.next.moves,
        });
        let after = match pair.as_rule() {
            Rule::open_round | Rule::negative => Join::Tight,
            Rule::slash if !self.calculating => Join::Tight,
            _ => Join::Word,
        };
        self.next = Begin::plain(after, "");
    }
}

/// What a rule begins, if it begins anything; `first` when it is the first in its parent.
fn begins(rule: Rule, within: Rule, first: bool) -> Option<Begin> {
    let clause = |role| Some(Begin::plain(Join::Clause { gap: 2 }, role));
    match (rule, within) {
        (Rule::movement | Rule::blackout, _) => Some(Begin {
            join: Join::Item,
            role: "item",
            moves: true,
        }),
        (Rule::part | Rule::note | Rule::follow | Rule::hang | Rule::flag, _)
        | (Rule::at, Rule::body) => Some(Begin::plain(Join::Item, "item")),
        (
            Rule::time
            | Rule::up
            | Rule::down
            | Rule::delay
            | Rule::snap
            | Rule::fade
            | Rule::repeat,
            Rule::body,
        ) => Some(Begin::plain(Join::Timing, "timing")),
        (Rule::look_level | Rule::preview_entry, _) => Some(Begin::plain(Join::Entry, "entry")),
        (Rule::text, Rule::cue_statement | Rule::part) => {
            Some(Begin::plain(Join::Clause { gap: 1 }, "label"))
        }
        (Rule::equals, _) => Some(Begin::plain(Join::Clause { gap: 1 }, "=")),
        (Rule::image, _) => Some(Begin::plain(Join::Clause { gap: 1 }, "image")),
        (Rule::body, _) => Some(Begin::plain(Join::Clause { gap: 1 }, "{")),
        (Rule::look_block, Rule::look_statement) => clause("{"),
        (Rule::at, _) => clause("at"),
        (Rule::light_kind, _) => clause("kind"),
        (Rule::kw_level, Rule::fixed_statement) => clause("level"),
        (Rule::kw_reflectance, _) => clause("reflectance"),
        (Rule::solid, _) => clause("solid"),
        (Rule::position, Rule::corners) if !first => clause("corner"),
        (
            word,
            Rule::stage_clause
            | Rule::haze_clause
            | Rule::surface_clause
            | Rule::figure_clause
            | Rule::view_clause
            | Rule::light_clause
            | Rule::bank_option
            | Rule::solid_clause
            | Rule::effect_clause,
        ) if first => clause(role(word)),
        _ => None,
    }
}

/// The role of a clause by the rule of its first word.
fn role(rule: Rule) -> &'static str {
    match rule {
        Rule::kw_from => "from",
        Rule::kw_to => "to",
        Rule::kw_fov | Rule::kw_lens => "fov",
        Rule::kw_roll => "roll",
        Rule::kw_size => "size",
        Rule::kw_at => "at",
        Rule::kw_aim => "aim",
        Rule::kw_beam => "beam",
        Rule::kw_field => "field",
        Rule::kw_radius => "radius",
        Rule::kw_turn => "turn",
        Rule::kw_scale => "scale",
        Rule::kw_forward => "forward",
        Rule::kw_albedo => "albedo",
        Rule::kw_gloss => "gloss",
        Rule::kw_y | Rule::kw_z | Rule::kw_one_sided | Rule::kw_matt => "option",
        Rule::kw_channel => "channel",
        Rule::kw_dimmer => "dimmer",
        Rule::kw_rgb => "rgb",
        Rule::kw_rate => "rate",
        Rule::kw_depth => "depth",
        Rule::kw_seed => "seed",
        _ => "value",
    }
}
