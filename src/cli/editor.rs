//! Completion, hints and colours of the line editor, from the prompt's vocabulary, and where its
//! history is kept.

use std::borrow::Cow;
use std::path::PathBuf;

use rustyline::completion::{Completer, FilenameCompleter, Pair};
use rustyline::highlight::{CmdKind, Highlighter};
use rustyline::hint::Hinter;
use rustyline::validate::{ValidationContext, ValidationResult, Validator};
use rustyline::{Context, Helper};

use footlight_prompt::{Vocabulary, finished};
use footlight_show::lang::{Token, tokens};
use footlight_show::printable::{is_hidden, visible};

/// Lines of history kept between sessions.
pub const REMEMBERED: usize = 2000;
/// Most characters of a hint.
const HINT: usize = 60;
/// Completion, hints and colours for the line editor.
pub struct Reader {
    /// The show's names, updated before each line.
    pub vocabulary: Vocabulary,
    coloured: bool,
    names: FilenameCompleter,
}

impl Reader {
    /// With colours or without.
    pub fn new(coloured: bool) -> Reader {
        Reader {
            vocabulary: Vocabulary::default(),
            coloured,
            names: FilenameCompleter::new(),
        }
    }
}

impl Helper for Reader {}

impl Validator for Reader {
    fn validate(&self, context: &mut ValidationContext<'_>) -> rustyline::Result<ValidationResult> {
        Ok(if finished(context.input()) {
            ValidationResult::Valid(None)
        } else {
            ValidationResult::Incomplete
        })
    }
}

impl Completer for Reader {
    type Candidate = Pair;

    fn complete(
        &self,
        line: &str,
        at: usize,
        context: &Context<'_>,
    ) -> rustyline::Result<(usize, Vec<Pair>)> {
        let offered = self.vocabulary.complete(line, at);
        if offered.files {
            let (start, mut names) = self.names.complete(line, at, context)?;
            // A name with control characters is neither shown nor inserted.
            names.retain(|name| !name.replacement.chars().any(is_hidden));
            return Ok((start, names));
        }
        // Add a blank, so that the next word can be typed at once.
        let words = offered.words.into_iter();
        let pair = |word: String| Pair {
            replacement: format!("{word} "),
            display: word,
        };
        let seen = words.filter(|word| !word.chars().any(is_hidden));
        Ok((offered.start, seen.map(pair).collect()))
    }
}

impl Hinter for Reader {
    type Hint = String;

    fn hint(&self, line: &str, at: usize, _: &Context<'_>) -> Option<String> {
        if at < line.len() {
            return None;
        }
        let hint = visible(&self.vocabulary.hint(line)?).into_owned();
        // A hint that would wrap is omitted.
        match hint.char_indices().nth(HINT) {
            None => Some(hint),
            Some((end, _)) => Some(format!("{}…", hint.get(..end)?)),
        }
    }
}

impl Highlighter for Reader {
    fn highlight<'l>(&self, line: &'l str, _: usize) -> Cow<'l, str> {
        if self.coloured {
            Cow::Owned(painted(line))
        } else {
            Cow::Borrowed(line)
        }
    }

    fn highlight_hint<'h>(&self, hint: &'h str) -> Cow<'h, str> {
        if self.coloured {
            Cow::Owned(format!("\x1b[2m{hint}\x1b[0m"))
        } else {
            Cow::Borrowed(hint)
        }
    }

    fn highlight_char(&self, _: &str, _: usize, kind: CmdKind) -> bool {
        self.coloured && kind != CmdKind::MoveCursor
    }
}

/// A line in the terminal's own colours, which are readable on any background.
fn painted(line: &str) -> String {
    let mut out = String::new();
    let mut at = 0;
    for (range, token) in tokens(line) {
        out.push_str(line.get(at..range.start).unwrap_or_default());
        let text = line.get(range.clone()).unwrap_or_default();
        at = range.end;
        let code = match token {
            Token::Statement => "1",
            Token::Word => "36",
            Token::Quantity => "33",
            Token::Colour => "35",
            Token::Text => "32",
            Token::Comment => "2",
            Token::Name | Token::Mark => {
                out.push_str(text);
                continue;
            }
        };
        out.push_str(&format!("\x1b[{code}m{text}\x1b[0m"));
    }
    out.push_str(line.get(at..).unwrap_or_default());
    out
}

/// The history's file: FOOTLIGHT_HISTORY (`off`: none), else in the system's state folder.
pub fn history_file() -> Option<PathBuf> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    if let Some(said) = set("FOOTLIGHT_HISTORY") {
        return (said != "off").then(|| PathBuf::from(said));
    }
    let state = set("XDG_STATE_HOME").map(PathBuf::from);
    let state = state.or_else(|| Some(PathBuf::from(set("HOME")?).join(".local/state")));
    state.map(|folder| folder.join("footlight").join("history"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_engine::{Engine, Host};
    use footlight_host::files::Memory;
    use rustyline::history::DefaultHistory;

    #[test]
    fn names_that_command_the_terminal_are_not_completed() {
        let folder = tempfile::tempdir().unwrap();
        for name in [
            "a.png",
            "a\u{1b}]0;x\u{7}.png",
            "a\u{202e}.png",
            "a\u{9b}.png",
        ] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let history = DefaultHistory::new();
        let line = format!("picture -o {}/a", folder.path().display());
        let reader = Reader::new(true);
        let offered = reader.complete(&line, line.len(), &Context::new(&history));
        let names: Vec<String> = offered.unwrap().1.into_iter().map(|p| p.display).collect();
        assert_eq!(names, ["a.png"]);
        let mut reader = Reader::new(true);
        let files = Memory::default()
            .with(
                "a.obj",
                "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl oak\nf 1 2 3\n",
            )
            .with(
                "a.mtl",
                ["oak", "oa\u{1b}[2J", "oa\u{202e}k"]
                    .map(|name| format!("newmtl {name}\nKd 1\n"))
                    .concat(),
            );
        let host = Host {
            files: Box::new(files),
            ..Host::default()
        };
        let engine = Engine::from_text(
            "a.lxq",
            b"stage \"a.obj\"\nview v from 0,0,9 to 0,0,0 fov 9",
            host,
        )
        .unwrap();
        reader.vocabulary = Vocabulary::of(engine.document());
        let line = "surface oa";
        let offered = reader.complete(line, line.len(), &Context::new(&history));
        let names: Vec<String> = offered.unwrap().1.into_iter().map(|p| p.display).collect();
        assert_eq!(names, ["oak"]);
    }

    #[test]
    fn colours_add_nothing_but_colours() {
        let line = "cue 2 \"x\" { lamps 5s #fb6 } // é";
        let mut plain = String::new();
        for (i, part) in painted(line).split("\x1b[").enumerate() {
            plain.push_str(if i == 0 {
                part
            } else {
                part.split_once('m').map_or("", |p| p.1)
            });
        }
        assert_eq!(plain, line);
        assert_eq!(painted("lamps"), "lamps");
    }
}
