//! The prompt without a terminal: parses a line, runs it on the engine, and reports the result.
//!
//! ```text
//! line --clap--> Verb --answer--> engine --> report --> Reply
//!   `---declaration--> edit of the show's text
//! ```
//!
//! A [`Repl`] holds an engine and the live control of its show. Declarations typed at the prompt
//! are edits of the show's text; the verbs are one enum ([`Verb`]), which the command line shares,
//! each with its function in `answer`. A [`Vocabulary`] completes what is typed, for the prompt and
//! for editors. [`saves`] watches the files of a show that is edited elsewhere.
//!
//! Invariants:
//!
//! - Every message is part of a [`Reply`] or an [`Error`]; nothing is printed here.
//! - A line that fails leaves the show as it was.
//! - Options belong to their line; none is kept for the next.
//!
//! This crate does not know terminals, line editors or processes, and words no results: that is
//! the report's part.

mod answer;
mod argument;
mod error;
mod line;
mod refusal;
mod repl;
pub mod saves;
mod usage;
pub mod verb;
mod vocabulary;

pub use self::answer::help::of_word as help_of_word;
pub use self::answer::solve::spared;
pub use self::error::Error;
pub use self::line::finished;
pub use self::repl::{Console, Reloaded, Repl, Reply};
pub use self::usage::example;
pub use self::verb::{Verb, verbs};
pub use self::vocabulary::{Completion, Vocabulary};

/// Explains a verb or a declaration in words.
///
/// # Errors
/// [`Error::Usage`] for an unknown word.
pub fn help_of(word: &str) -> Result<String, Error> {
    answer::help::of(verbs(), word)
}
