//! A verb with what was said to it, and the parser of a typed line.

use std::collections::BTreeMap;
use std::path::Path;

use super::Error;
use super::error::usage;
use super::verb::{VerbSpec, find};
use crate::report::format::Formats;

/// A verb with what was said to it.
#[derive(Clone, Debug)]
pub struct Call {
    /// The verb.
    pub verb: &'static VerbSpec,
    /// Options by name; a switch has the empty value.
    pub options: BTreeMap<String, String>,
    /// What stood after it without dashes.
    pub words: Vec<String>,
}

impl Call {
    /// A verb with nothing said to it.
    pub fn new(verb: &'static VerbSpec) -> Call {
        Call {
            verb,
            options: BTreeMap::new(),
            words: Vec::new(),
        }
    }

    /// The same with an option set.
    #[must_use]
    pub fn with(mut self, option: &str, value: &str) -> Call {
        self.options.insert(option.to_owned(), value.to_owned());
        self
    }

    /// The same with a word.
    #[must_use]
    pub fn word(mut self, word: &str) -> Call {
        self.words.push(word.to_owned());
        self
    }

    /// The words, in order.
    pub fn words(&self) -> Vec<&str> {
        self.words.iter().map(String::as_str).collect()
    }

    /// True where an option was said.
    pub fn has(&self, name: &str) -> bool {
        self.options.contains_key(name)
    }

    /// An option's value.
    pub fn option(&self, name: &str) -> Option<&str> {
        self.options.get(name).map(String::as_str)
    }

    /// The file to write, whose ending must be one of `formats`.
    pub(super) fn output(&self, formats: &Formats) -> Result<Option<&Path>, Error> {
        let path = self.option("output").map(Path::new);
        path.map(|path| formats.check(path)).transpose()?;
        Ok(path)
    }

    /// Refuses words, with where what was meant belongs.
    pub(super) fn without_words(&self, meant: &str) -> Result<(), Error> {
        match self.words.first() {
            None => Ok(()),
            Some(word) => usage(format!("`{word}` is left over{meant}")),
        }
    }

    /// Reads a typed line.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown verb or option, a missing value or an open quote, with what
    /// could have been meant.
    pub fn parse(line: &str) -> Result<Call, Error> {
        let mut tokens = split(line)?.into_iter();
        let name = tokens.next().unwrap_or_default();
        let spec = find(&name)?;
        let mut call = Call::new(spec);
        while let Some(token) = tokens.next() {
            let Some(option) = spec.option(&token)? else {
                call.words.push(token);
                continue;
            };
            let inline = token.split_once('=').map(|(_, v)| v.to_owned());
            let value = match (option.value, inline) {
                (None, _) => String::new(),
                (Some(_), Some(value)) => value,
                (Some(what), None) => tokens.next().ok_or_else(|| {
                    Error::Usage(format!("`{token}` needs a value {what}: {}", spec.usage()))
                })?,
            };
            call.options.insert(option.name.to_owned(), value);
        }
        Ok(call)
    }
}

/// Cuts a line into words; double quotes keep spaces together, and hold `\"` and `\\` as a show's
/// texts do.
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
