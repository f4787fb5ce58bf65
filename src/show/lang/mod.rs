//! The language of cue sheets: parses text to a [`Show`](crate::model::Show) with spans and
//! diagnostics.
//!
//! `scan` cuts a text into statements, `syntax` parses each by the grammar (`grammar/lxq.pest`),
//! `build` makes the tree of `ast`, `lower` resolves names and quantities and writes the model.
//! Invariants: every error of a file is reported in one run; time and memory are linear in the text
//! (within `limits`); a show comes out exactly when there is no error, and then keeps every
//! invariant of [`crate::model`].

mod ast;
mod beginning;
mod build;
pub mod codes;
mod decode;
pub mod edit;
mod explain;
mod format;
mod gels;
mod include;
mod lanterns;
mod levels;
pub(crate) mod limits;
mod lower;
mod names;
mod outline;
mod parse;
mod preview;
mod quantity;
mod quote;
mod read;
mod report;
mod scan;
mod spans;
mod syntax;
mod token;

pub use ast::Span;
pub use beginning::Beginning;
pub use decode::decode;
pub use edit::NamePlace;
pub use explain::{Explanation, explain, pages};
pub use format::format;
pub use gels::gels_of_table;
pub use lanterns::{Lantern, lanterns};
pub use levels::{SetLevel, levels};
pub use names::{Kind, is_reserved, nearest};
pub use outline::{
    Outlined, declarations, is_declaration, keywords, outline, statement_complete, statement_start,
    values, words,
};
pub use parse::{Parsed, parse, parse_with_files};
pub use preview::preview_statement;
pub use quote::{quoted, unquote};
pub(crate) use report::Place;
pub use report::too_many;
pub use spans::SpanMap;
pub use token::{Token, pieces, tokens};

use crate::units::{Rgb, Time};

/// Reads a time as a show writes it: `5`, `1.5s`, `1:30`, `250ms`.
pub fn time(text: &str) -> Option<Time> {
    quantity::time(text).ok()
}

/// Reads a colour such as `#ffb36b`, `#fb6` or `#orange`.
pub fn colour(text: &str) -> Option<Rgb> {
    let written = text.strip_prefix('#')?;
    let coded = lower::hex(written).or_else(|| lower::named(written))?;
    Some(Rgb::from_srgb8(coded))
}

#[cfg(test)]
mod tests;
