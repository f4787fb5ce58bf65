//! The verbs: one table for the REPL, the command line and the manual, and the parser of a typed
//! line.

mod declaration;
mod table;

use std::collections::BTreeMap;

use super::Error;
use crate::lang::nearest;

pub use self::declaration::{DECLARATIONS, Declaration};
pub use self::table::VERBS;

/// What can be done with a show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verb {
    /// Look for mistakes.
    Check,
    /// List what the show declares.
    Show,
    /// Move to a time and tell the levels there.
    At,
    /// Key settings, basis and predicted error.
    Plan,
    /// One picture.
    Picture,
    /// Render more refined pictures.
    Refine,
    /// How far the refinement beside the prompt is.
    Status,
    /// Wait for it.
    Wait,
    /// End it.
    Stop,
    /// Play the sequence.
    Play,
    /// Draw the banks' curves.
    Plot,
    /// The whole loop, with its results in a folder.
    Run,
    /// Hold every bank against its reference picture.
    Compare,
    /// Tell what each step of quality sets and costs.
    Quality,
    /// Draw measurements.
    Chart,
    /// Choose what is good enough.
    Tune,
    /// Replay a design session and measure it.
    Session,
    /// What pictures there are, and freeing them.
    Pool,
    /// How refined pictures are chosen, and previews made of them.
    Method,
    /// Which view pictures are made from.
    View,
    /// Run the next cue.
    Go,
    /// Back to the cue before.
    Back,
    /// To a cue.
    Goto,
    /// Try levels.
    Set,
    /// Let go of levels that are tried.
    Release,
    /// Write what is tried as a cue.
    Record,
    /// Edits that are not kept yet.
    Blind,
    /// Take an edit back.
    Undo,
    /// Make it again.
    Redo,
    /// Cues by banks.
    Tracksheet,
    /// What each cue does.
    Cuesheet,
    /// The canonical layout.
    Fmt,
    /// What changed.
    Diff,
    /// What a code means.
    Explain,
    /// Write the show's text.
    Save,
    /// Explain the verbs.
    Help,
    /// Leave.
    Quit,
}

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

/// A verb as the manual shows it.
#[derive(Clone, Copy, Debug)]
pub struct VerbSpec {
    /// The verb.
    pub verb: Verb,
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
}

/// A verb with what was said to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// The verb.
    pub verb: Verb,
    /// Options by name; a switch has the empty value.
    pub options: BTreeMap<String, String>,
    /// What stood after it without dashes.
    pub words: Vec<String>,
}

impl Call {
    /// A verb with nothing said to it.
    pub fn new(verb: Verb) -> Call {
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

    /// An option's value.
    pub fn option(&self, name: &str) -> Option<&str> {
        self.options.get(name).map(String::as_str)
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
        let mut call = Call::new(spec.verb);
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

/// The specification of a verb by its name.
///
/// # Errors
/// [`Error::Usage`] with the nearest verb when there is none of that name.
pub fn find(name: &str) -> Result<&'static VerbSpec, Error> {
    VERBS.iter().find(|v| v.name == name).ok_or_else(|| {
        let near = nearest(name, VERBS.iter().map(|v| v.name));
        let hint = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`help` lists the verbs".to_owned(),
        };
        Error::Usage(format!("there is no verb or declaration `{name}`; {hint}"))
    })
}

impl VerbSpec {
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
    fn option(&self, token: &str) -> Result<Option<&OptionSpec>, Error> {
        let name = token.split('=').next().unwrap_or_default();
        let negative_number = name
            .strip_prefix('-')
            .is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        if !name.starts_with('-') || name == "-" || negative_number {
            return Ok(None);
        }
        let matches = |o: &&OptionSpec| {
            name.strip_prefix("--") == Some(o.name)
                || o.letter.is_some_and(|l| name == format!("-{l}"))
        };
        match self.options.iter().find(matches) {
            Some(option) => Ok(Some(option)),
            None => Err(Error::Usage(format!(
                "`{}` has no option `{name}`: {}",
                self.name,
                self.usage()
            ))),
        }
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
        return Err(Error::Usage("a quote is not closed".to_owned()));
    }
    words.extend(word);
    Ok(words)
}
