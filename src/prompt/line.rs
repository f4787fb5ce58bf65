//! Typed lines: verbs, and declarations that change the show.

use std::ffi::OsString;

use clap::FromArgMatches as _;

use super::answer::solve::spared;
use super::error::usage;
use super::refusal::{find, refused};
use super::repl::Repl;
use super::verb::{Verb, verbs};
use super::{Error, Reply};
use footlight_show::lang;

impl Verb {
    /// Parses a typed line.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown verb or option, a missing value or an open quote, with a
    /// suggestion.
    pub fn parse(line: &str) -> Result<Verb, Error> {
        Verb::of(split(line)?)
    }

    /// Parses a verb from its words; file names need not be UTF-8.
    ///
    /// # Errors
    /// As [`Verb::parse`].
    pub fn of<W: Into<OsString> + Clone>(
        words: impl IntoIterator<Item = W>,
    ) -> Result<Verb, Error> {
        let words: Vec<OsString> = words.into_iter().map(Into::into).map(spared).collect();
        let name = words.first().map(|word| word.to_string_lossy());
        let verb = find(verbs(), &name.unwrap_or_default())?;
        let matches = verbs().clone().try_get_matches_from(&words);
        let read = matches.and_then(|matches| Verb::from_arg_matches(&matches));
        read.map_err(|error| refused(verb, &error))
    }
}

impl Repl {
    /// Runs a line as if typed at the prompt: a verb, or declarations that change the show.
    ///
    /// # Errors
    /// [`Error`]; the show is then unchanged.
    pub fn execute(&mut self, line: &str) -> Result<Reply, Error> {
        let line = line.trim();
        if line.is_empty() || line.starts_with("//") {
            return Ok(Reply::default());
        }
        if lang::is_declaration(line) {
            return self.serve(|repl| repl.declare(line));
        }
        let verb = Verb::parse(line).map_err(|error| self.level_meant(line).unwrap_or(error))?;
        self.call(&verb)
    }

    /// Advice when a level is typed as at a desk: `lamps 50`.
    fn level_meant(&self, line: &str) -> Option<Error> {
        let name = line.split_whitespace().next()?;
        let show = self.engine().show();
        let is_bank = show.banks.iter().any(|b| b.name == name);
        let is_group = show.groups.iter().any(|g| g.name == name);
        let heads = show.lights.iter().filter(|light| light.head.is_some());
        let is_head = heads.into_iter().any(|light| light.name == name);
        ((is_bank || is_group || is_head) && find(verbs(), name).is_err()).then(|| {
            Error::Usage(format!(
                "`{name}` is set in cues; `set {line}` tries it on top of the moment"
            ))
        })
    }

    /// Runs a verb.
    ///
    /// # Errors
    /// [`Error`]; the state is then unchanged, except that finished images are kept.
    pub fn call(&mut self, verb: &Verb) -> Result<Reply, Error> {
        self.serve(|repl| {
            let warned = repl.warned;
            let reply = verb.answer(repl);
            // A warning applies only to the next verb.
            repl.warned &= !warned;
            let mut reply = reply?;
            reply.notes = repl.warnings();
            Ok(reply)
        })
    }
}

/// True when a typed line is complete: a declaration with open braces or quotes continues.
pub fn finished(line: &str) -> bool {
    !lang::is_declaration(line) || lang::statement_complete(line)
}
/// Splits a line into words; double quotes keep spaces together, and hold `\"` and `\\` like a
/// show's texts.
fn split(line: &str) -> Result<Vec<String>, Error> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quoted = false;
    let mut chars = line.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '\\' if quoted && matches!(chars.peek(), Some('"' | '\\')) => {
                word.get_or_insert_default().extend(chars.next());
            }
            '"' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            c if c.is_whitespace() && !quoted => words.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    if quoted {
        return usage("a quote is not closed");
    }
    words.extend(word);
    Ok(words)
}
