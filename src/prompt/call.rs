//! A verb with what was said to it, and the parser of a typed line.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

use super::Error;
use super::error::usage;
use super::verb::{VerbSpec, find};
use footlight_report::format::Formats;

/// A verb with what was said to it.
#[derive(Clone, Debug)]
pub struct Call {
    /// The verb.
    pub verb: &'static VerbSpec,
    /// Options by name; a switch has the empty value. Names of files need not be UTF-8.
    pub options: BTreeMap<String, OsString>,
    /// What stood after it without dashes.
    pub words: Vec<OsString>,
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
    pub fn with(mut self, option: &str, value: impl Into<OsString>) -> Call {
        self.options.insert(option.to_owned(), value.into());
        self
    }

    /// The same with a word.
    #[must_use]
    pub fn word(mut self, word: impl Into<OsString>) -> Call {
        self.words.push(word.into());
        self
    }

    /// The words, in order; `?` stands for one that is not UTF-8, which only a file's name can be.
    pub fn words(&self) -> Vec<&str> {
        let words = self.words.iter();
        words.map(|word| word.to_str().unwrap_or("?")).collect()
    }

    /// True where an option was said.
    pub fn has(&self, name: &str) -> bool {
        self.options.contains_key(name)
    }

    /// An option's value; nothing for a file's name that is not UTF-8.
    pub fn option(&self, name: &str) -> Option<&str> {
        self.options.get(name)?.to_str()
    }

    /// An option's value as the path of a file or folder.
    pub fn path(&self, name: &str) -> Option<&Path> {
        self.options.get(name).map(Path::new)
    }

    /// The file to write, whose ending must be one of `formats`.
    pub(super) fn output(&self, formats: &Formats) -> Result<Option<&Path>, Error> {
        let path = self.path("output");
        path.map(|path| formats.check(path)).transpose()?;
        Ok(path)
    }

    /// Refuses words, with where what was meant belongs.
    pub(super) fn without_words(&self, meant: &str) -> Result<(), Error> {
        match self.words.first() {
            None => Ok(()),
            Some(word) => usage(format!("`{}` is left over{meant}", word.display())),
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
                call.words.push(token.into());
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
            call.options.insert(option.name.to_owned(), value.into());
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
