//! The parser: turns one statement into pairs of the grammar or a [`Failure`] in our own words.
//!
//! The parser generator stays hidden in this module: its errors, the names of its rules and its
//! process-wide switches.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use pest::Parser as _;
use pest::error::{ErrorVariant, InputLocation};
use pest::iterators::Pairs;

use super::lower::light;
use super::scan::STATEMENTS;
use crate::model::FADES;

#[allow(
    missing_docs,
    reason = "generated from the grammar, which is documented"
)]
mod generated {
    #[derive(pest_derive::Parser)]
    #[grammar = "../../grammar/lxq.pest"]
    pub struct Grammar;
}

pub use generated::Rule;

/// The position where parsing stopped, and the expected tokens.
#[derive(Debug)]
pub struct Failure {
    /// Byte offset in the parsed text.
    pub at: usize,
    /// In our words, at most five.
    pub expected: Vec<&'static str>,
    /// True when a quantity was expected.
    pub wants_quantity: bool,
    /// True when a closing brace was expected, so that a new line may begin.
    pub between_items: bool,
}

/// The rule of a statement word: `cue_statement` for `cue`.
pub fn rule_of(word: &str) -> Option<Rule> {
    static RULES: LazyLock<[(&str, Option<Rule>); STATEMENTS.len()]> = LazyLock::new(|| {
        STATEMENTS.map(|word| {
            let mut rules = Rule::all_rules().iter();
            let rule = rules.find(|rule| format!("{rule:?}") == format!("{word}_statement"));
            (word, rule.copied())
        })
    });
    RULES.iter().find(|(own, _)| *own == word)?.1
}

/// Parses one statement.
///
/// # Errors
/// The [`Failure`] at the furthest place that parsing reached.
pub fn parse(rule: Rule, text: &str) -> Result<Pairs<'_, Rule>, Failure> {
    generated::Grammar::parse(rule, text).map_err(|error| {
        let at = match error.location {
            InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
        };
        let positives = match &error.variant {
            ErrorVariant::ParsingError { positives, .. } => positives.as_slice(),
            ErrorVariant::CustomError { .. } => &[],
        };
        Failure {
            at,
            expected: expected(positives),
            wants_quantity: [Rule::quantity, Rule::amount, Rule::value, Rule::open_round]
                .iter()
                .any(|rule| positives.contains(rule)),
            between_items: positives.contains(&Rule::close_brace),
        }
    })
}

/// Position where parsing a statement stops, and the rules expected there; `None` when it parses.
pub fn stop(rule: Rule, text: &str) -> Option<(usize, BTreeSet<Rule>)> {
    let error = generated::Grammar::parse(rule, text).err()?;
    let at = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
    };
    match error.variant {
        ErrorVariant::ParsingError { positives, .. } => Some((at, positives.into_iter().collect())),
        ErrorVariant::CustomError { .. } => None,
    }
}

/// Length of the token of this rule at the start of `text`.
pub fn prefix(rule: Rule, text: &str) -> Option<usize> {
    let pair = generated::Grammar::parse(rule, text).ok()?.next()?;
    Some(pair.as_span().end())
}

/// A quantity, in messages.
pub const NUMBER: &str = "a number (like 5)";

/// The end of a statement, in messages.
pub const END: &str = "the end of the statement";

/// The rules in a designer's words, each once, at most five.
fn expected(rules: &[Rule]) -> Vec<&'static str> {
    let mut out: Vec<&'static str> = Vec::new();
    // Where a move may stand, a dozen keywords may: name only the move.
    let body = rules.contains(&Rule::kw_part) && rules.contains(&Rule::kw_time);
    if body {
        out.push("a move (like `lamps 85`)");
        out.push("timing (like `time 5`)");
    }
    // Name only one operator, the product.
    let operators = rules.contains(&Rule::times);
    for rule in rules {
        if operators && matches!(rule, Rule::plus | Rule::slash) {
            continue;
        }
        let word = words(*rule);
        // A colour may follow any level; do not name it.
        let second = matches!(rule, Rule::value | Rule::kw_to) && !rules.contains(&Rule::plus);
        let spoken_for = body && (second || BODY.contains(&word));
        if !word.is_empty() && !spoken_for && !out.contains(&word) {
            out.push(word);
        }
    }
    // The end of the statement comes last.
    out.sort_by_key(|w| *w == END);
    let end = out.last() == Some(&END);
    out.truncate(if end { 4 } else { 5 });
    if end && !out.contains(&END) {
        out.push(END);
    }
    out
}

/// Words that a cue's body takes; the message names only the move.
const BODY: [&str; 8] = [
    "`part`", "`time`", "`up`", "`curve`", "`repeat`", "`at`", "`block`", "a name",
];

/// A rule in a designer's words; empty when it is not worth naming.
fn words(rule: Rule) -> &'static str {
    match rule {
        Rule::EOI => END,
        Rule::name | Rule::names | Rule::target => "a name",
        Rule::text => "a text in quotes (like \"Evening\")",
        Rule::quantity | Rule::shown_steps | Rule::amount | Rule::measure | Rule::open_round => {
            NUMBER
        }
        Rule::let_value | Rule::sum | Rule::product | Rule::factor => "a value (like 5s)",
        Rule::times => "an operator (`+`, `-`, `*`, `/`)",
        Rule::close_round => "`)`",
        Rule::colour => "a colour (like #ffb36b)",
        Rule::value => "a level (like 85)",
        Rule::level_word => "a level (like 85)",
        Rule::cue_number => "a cue number (like 2.5)",
        Rule::count => "a whole number (like 2)",
        Rule::open_brace | Rule::body | Rule::look_block => "`{`",
        Rule::close_brace => "`}`",
        Rule::equals => "`=`",
        Rule::comma => "`,`",
        Rule::plus => "`+`",
        Rule::slash => "`/`",
        Rule::tone_curve => "`filmic` or `plain`",
        Rule::switch => "`on` or `off`",
        Rule::stops => "stops (like `+1`)",
        Rule::preview_entry | Rule::preview_key => "a setting (like `tolerance 2%`)",
        Rule::material => "the name of a material",
        Rule::reflectance => "a reflectance (like #6b4a2f or 0.4)",
        Rule::position => "a position (like `0, -2.5, 3`)",
        Rule::solid | Rule::solid_kind => "a solid (`quad`, `box`, `disc`, `cylinder`, `sphere`)",
        Rule::solid_clause => "a clause (like `radius 20cm`)",
        Rule::corners => "four positions (like `-1, 0, 0`)",
        Rule::size => "a size (like 640x360 or 1080p)",
        Rule::light_kind => light::EXPECTED,
        Rule::path | Rule::interpolation => "a path (like `spline 0 30, 4 80`)",
        Rule::spline_kind => "a kind of spline (like `natural`)",
        Rule::knot => "a knot (like `3s 55`)",
        Rule::part | Rule::kw_part => "`part`",
        Rule::flag => "`block`",
        Rule::look_level => "a level (like `lamps 40`)",
        Rule::look_term => "a look, or levels in braces",
        Rule::channel => "`r`, `g` or `b`",
        Rule::effect_kind => "`flicker` or `pulse`",
        Rule::effect_clause => "a clause (like `rate 6` or `depth 35%`)",
        Rule::stage_clause => "an option (like `z up` or `scale 1mm`)",
        Rule::haze_amount | Rule::extinction => {
            "a visibility (like 60m) or an extinction (like 0.05/m)"
        }
        Rule::surface_clause => "a clause (like `gloss 0.2`)",
        Rule::figure_clause => "a clause (like `at 1, 2, 0` or `facing 30`)",
        Rule::haze_clause => "a clause (like `forward 0.6`)",
        Rule::aim | Rule::angle => "an aim (like `to 2, 1, 0` or `pan 30`)",
        Rule::view_clause => "a clause (like `fov 28`)",
        Rule::light_clause => "a clause (like `beam 24` or `1200 cd`)",
        Rule::kw_y => "`y up`",
        Rule::kw_z => "`z up`",
        Rule::kw_channel | Rule::bank_option => "an option (`channel`, `dimmer`, `rgb`)",
        _ => keyword(rule),
    }
}

/// Keywords that messages name.
const KEYWORDS: &str = "\
    `aim` `at` `auto` `beam` `curve` `field` `fov` `from` `gloss` `image` `layer` `lens` `level` `matt` `one-sided` \
    `radius` `reflectance` `repeat` `roll` `scale` `size` `slope` `time` `to` `turn` `up` `via`";

/// The keyword of a rule such as `kw_aim` or `slope`; empty when messages do not name it.
fn keyword(rule: Rule) -> &'static str {
    let name = format!("{rule:?}").replace('_', "-");
    let name = name.strip_prefix("kw-").unwrap_or(&name);
    let mut words = KEYWORDS.split_whitespace();
    let found = words.find(|word| word.trim_matches('`') == name);
    found.unwrap_or_default()
}

/// Units written right after their numbers.
pub const UNIT_WORDS: [&str; 8] = ["s", "ms", "m", "cm", "mm", "ft", "in", "deg"];

/// Words that may stand inside statements, by the alphabet; every word of a text is looked up here.
static ALL_INNER_WORDS: LazyLock<BTreeSet<&str>> = LazyLock::new(|| {
    let of_tables = light::words().chain(FADES.iter().map(|curve| curve.name));
    INNER_WORDS.split_whitespace().chain(of_tables).collect()
});

/// Words that may stand inside statements, for suggestions.
pub fn inner_words() -> impl Iterator<Item = &'static str> {
    ALL_INNER_WORDS.iter().copied()
}

/// True when `word` may stand inside statements.
pub fn is_inner_word(word: &str) -> bool {
    ALL_INNER_WORDS.contains(word)
}

/// The words of [`inner_words`] that no other table has.
const INNER_WORDS: &str = "\
    aim albedo assert at auto beam bezier blackout box block catmull-rom channel clamped coarse \
    cueonly cylinder curve delay depth dimmer disc dither down effect exposure facing field filmic flicker \
    follow forward fov from full gap gel gloss hang height hermite image inside lantern layer lens level like linear matt monotone moves natural \
    note off on one-sided out pan part plain pulse quad radius rate refined reflectance repeat rgb roll scale \
    seed sides size slope snap speed spline spread square standing steps tilt time to tolerance tone turn two-sided up via white \
    y z zoom";
