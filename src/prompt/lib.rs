//! The prompt without a terminal: parses a line, runs it on the engine, and reports the result.
//!
//! A [`Repl`] holds an engine and the live control of its show. Declarations typed at the prompt
//! are edits of the show's text; the verbs are one enum ([`Verb`]), each with its function.
//! Messages go into a [`Reply`]; nothing is printed here.

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
