//! A statement as a row of words, each with its separation from the word before.

use std::ops::Range;

use pest::iterators::Pair;

use crate::lang::scan::first_word;
use crate::lang::syntax::{self, Rule};

/// Separation of a word from the word before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Join {
    /// Begins a statement.
    Start,
    /// No blank, as for a comma or a slash.
    Tight,
    /// One blank.
    Word,
    /// Begins a clause: a new column after at least `gap` blanks.
    Clause { gap: usize },
    /// Begins an item that has its own line in a block.
    Item,
    /// Begins timing, which stays on the line of the move before it if written there.
    Timing,
    /// Begins an entry that shares a line with its neighbours as the writer likes.
    Entry,
    /// An opening brace; `clause` gives the blanks before it when it starts a column.
    Open { clause: Option<usize> },
    /// A closing brace.
    Close,
}

/// A word and its separation.
#[derive(Clone, Debug)]
pub struct Piece<'a> {
    pub text: &'a str,
    pub span: Range<usize>,
    pub join: Join,
    /// Kind of clause that it begins; lines align only where these agree.
    pub role: &'static str,
    /// True when it begins a move, to which timing on the same line belongs.
    pub moves: bool,
}

/// The pieces of a statement; empty when it does not parse.
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

/// Role of the next leaf.
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
    /// Set for the next leaf.
    next: Begin,
    /// True inside a calculation, where a slash divides.
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

/// The role that a rule begins, if any; `first` is true for the first rule in its parent.
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
