//! The verbs: one table for the prompt, the command line and the manual.
//!
//! A new verb is its function and its row.

mod removed;
mod table;

use super::error::usage;
use super::{Call, Error, Repl, Reply};
use footlight_show::lang::nearest;

pub use self::removed::removed;
pub use self::table::VERBS;

/// An option of a verb.
#[derive(Clone, Copy, Debug)]
pub struct OptionSpec {
    /// Its name after two dashes.
    pub name: &'static str,
    /// Its letter after one dash.
    pub letter: Option<char>,
    /// The name of its value; `None` for a switch.
    pub value: Option<&'static str>,
    /// What it does.
    pub about: &'static str,
}

impl OptionSpec {
    /// True where a token, without a value behind `=`, names this option.
    pub(super) fn is_named_by(&self, token: &str) -> bool {
        let short = token.strip_prefix('-').and_then(|rest| rest.parse().ok());
        token.strip_prefix("--") == Some(self.name) || short.is_some() && short == self.letter
    }
}

/// What may be typed behind a verb.
#[derive(Clone, Copy, Debug)]
pub enum Complete {
    /// Nothing that is known.
    Nothing,
    /// Every name of the show, and numbers of cues.
    Names,
    /// Levels, as in a look.
    Levels,
    /// Banks and groups.
    Banks,
    /// Numbers of cues.
    Cues,
    /// Names of views.
    Views,
    /// Verbs.
    Verbs,
    /// Codes of messages.
    Codes,
    /// Files.
    Files,
}

/// A verb as the manual shows it, with its function.
#[derive(Clone, Copy)]
pub struct VerbSpec {
    /// Its name.
    pub name: &'static str,
    /// What may stand first after it, on the command line before the show: one of these, unless
    /// there are none.
    pub kinds: &'static [&'static str],
    /// What stands after it without dashes; empty when nothing does.
    pub words: &'static str,
    /// Its options.
    pub options: &'static [OptionSpec],
    /// What it does, in a line.
    pub about: &'static str,
    /// A line that can be typed at the prompt.
    pub example: &'static str,
    /// Whether it is a command of its own on the command line.
    pub command: bool,
    pub(super) complete: Complete,
    pub(super) run: fn(&mut Repl, &Call) -> Result<Reply, Error>,
}

impl std::fmt::Debug for VerbSpec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// The specification of a verb by its name.
pub fn find(name: &str) -> Result<&'static VerbSpec, Error> {
    let name = if name == "exit" { "quit" } else { name };
    VERBS.iter().find(|v| v.name == name).ok_or_else(|| {
        if let Some(message) = removed(name) {
            return Error::Usage(message);
        }
        let near = nearest(name, VERBS.iter().map(|v| v.name));
        let hint = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`help` lists the verbs".to_owned(),
        };
        Error::Usage(format!("there is no verb or declaration `{name}`; {hint}"))
    })
}

impl VerbSpec {
    /// True where the words after it are names of files.
    pub fn takes_files(&self) -> bool {
        matches!(self.complete, Complete::Files)
    }

    /// The one-line usage.
    pub fn usage(&self) -> String {
        let mut out = self.name.to_owned();
        if !self.kinds.is_empty() {
            out = format!("{out} {}", self.kinds.join("|"));
        }
        if !self.words.is_empty() {
            out = format!("{out} {}", self.words);
        }
        for option in self.options {
            let name = match option.letter {
                Some(letter) => format!("-{letter}"),
                None => format!("--{}", option.name),
            };
            let value = option.value.map(|v| format!(" {v}")).unwrap_or_default();
            out = format!("{out} [{name}{value}]");
        }
        out
    }

    /// The option that a token names; `None` for a token that is no option.
    pub(super) fn option(&self, token: &str) -> Result<Option<&OptionSpec>, Error> {
        let name = token.split('=').next().unwrap_or_default();
        let negative_number = name
            .strip_prefix('-')
            .is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        if !name.starts_with('-') || name == "-" || negative_number {
            return Ok(None);
        }
        match self.options.iter().find(|o| o.is_named_by(name)) {
            Some(option) => Ok(Some(option)),
            None if let Some(message) = removed(name) => usage(message),
            None => usage(format!(
                "`{}` has no option `{name}`: {}",
                self.name,
                self.usage()
            )),
        }
    }
}
