//! Cuts a file into statements before parsing, so that an error ends with its statement and the
//! parser holds one statement at a time.
//!
//! A statement begins on a line outside all braces that begins with a statement word; it continues
//! over lines that are indented more, or that begin with punctuation. Inside braces, a line that
//! begins with a statement word, no deeper than the statement itself, shows that a brace is
//! missing. Invariants: one pass, no recursion; cuts are in order, disjoint and on character
//! boundaries; braces, quotes and comments are balanced in every cut that is not `broken`.

use std::ops::Range;

use super::limits;

/// The words that begin statements.
pub const STATEMENTS: [&str; 20] = [
    "show", "preview", "include", "gels", "let", "stage", "surface", "figure", "haze", "view",
    "light", "point", "bank", "fixed", "group", "look", "default", "curve", "effect", "cue",
];

/// One statement, without surrounding blanks and comments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cut<'a> {
    pub text: &'a str,
    /// Its bytes in the file.
    pub span: Range<usize>,
    /// True when a fault in it was reported already; parsing would only repeat it.
    pub broken: bool,
}

impl Cut<'_> {
    /// True for a cue.
    pub fn is_cue(&self) -> bool {
        first_word(self.text) == "cue"
    }
}

/// Faults of the cutting itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An opening brace without its closing one; the start of the next statement, if there is one.
    Unclosed(usize, Option<usize>),
    /// A closing brace without its opening one.
    Stray(usize),
    /// A text without its closing quote.
    Text(Range<usize>),
    /// A `/*` without its `*/`.
    Comment(usize),
    /// Brackets nested deeper than [`limits::DEPTH`]; the rest of the file is not read.
    Deep(usize),
    /// A statement longer than [`limits::STATEMENT`].
    Long(Range<usize>),
    /// More statements than [`limits::STATEMENTS`]; the rest of the file is not read.
    Many(usize),
}

/// The statements of a file, and the faults found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Scan<'a> {
    pub cuts: Vec<Cut<'a>>,
    pub faults: Vec<Fault>,
    /// The text ends inside a statement: a brace, quote or comment is open, or its last character
    /// requires more.
    pub open: bool,
}

/// Cuts `text` into statements.
pub fn scan(text: &str) -> Scan<'_> {
    let mut scanner = Scanner {
        text,
        bytes: text.as_bytes(),
        out: Scan::default(),
        current: None,
        opens: Vec::new(),
        rounds: 0,
        end: 0,
        stopped: false,
    };
    scanner.run();
    scanner.out
}

/// The first word of `text`; empty when it does not begin with a letter.
pub fn first_word(text: &str) -> &str {
    split_word(text).0
}

/// The first word of `text`, as in [`first_word`], and the rest.
pub fn split_word(text: &str) -> (&str, &str) {
    if !text.starts_with(|c: char| c.is_alphabetic() || c == '_') {
        return ("", text);
    }
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'));
    text.split_at(end.unwrap_or(text.len()))
}

/// Length of the comment that `text` begins with; the whole text when it is not closed.
pub fn comment_length(text: &str) -> Option<usize> {
    if text.starts_with("//") {
        return Some(text.find('\n').unwrap_or(text.len()));
    }
    let inner = text.strip_prefix("/*")?;
    Some(inner.find("*/").map_or(text.len(), |end| end + 4))
}

struct Open {
    start: usize,
    indent: usize,
    broken: bool,
}

struct Scanner<'a> {
    text: &'a str,
    bytes: &'a [u8],
    out: Scan<'a>,
    current: Option<Open>,
    opens: Vec<usize>,
    /// Round brackets open in the current statement.
    rounds: usize,
    /// One past the last byte of code.
    end: usize,
    stopped: bool,
}

impl Scanner<'_> {
    fn run(&mut self) {
        let (mut i, mut line, mut fresh) = (0, 0, true);
        while let Some(&byte) = self.bytes.get(i) {
            match byte {
                b'\n' => {
                    (line, fresh) = (i + 1, true);
                    i += 1;
                }
                b' ' | b'\t' | b'\r' => i += 1,
                b'/' if self.bytes.get(i + 1) == Some(&b'/') => i = self.line_end(i),
                b'/' if self.bytes.get(i + 1) == Some(&b'*') => i = self.comment(i),
                _ => {
                    if std::mem::take(&mut fresh) {
                        self.begin_line(i, i - line);
                    }
                    if !self.stopped {
                        i = self.code(i, byte);
                    }
                    if self.stopped {
                        return;
                    }
                    self.end = self.end.max(i);
                }
            }
        }
        self.finish();
    }

    fn finish(&mut self) {
        if let Some(open) = self.opens.last().copied() {
            self.fault(Fault::Unclosed(open, None));
            self.out.open = true;
        }
        let last = self.end.checked_sub(1).and_then(|i| self.bytes.get(i));
        if self.current.is_some() && matches!(last, Some(b'=' | b',' | b'+')) {
            self.out.open = true;
        }
        self.close();
    }

    fn line_end(&self, i: usize) -> usize {
        let rest = self.bytes.get(i..).unwrap_or_default();
        i + rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len())
    }

    fn comment(&mut self, i: usize) -> usize {
        let found = self.text.get(i + 2..).and_then(|rest| rest.find("*/"));
        found.map_or_else(
            || {
                self.fault(Fault::Comment(i));
                self.out.open = true;
                self.bytes.len()
            },
            |n| i + n + 4,
        )
    }

    /// Decides if the line whose code begins at `i` begins a statement.
    fn begin_line(&mut self, i: usize, indent: usize) {
        let word = first_word(self.text.get(i..).unwrap_or_default());
        let statement = STATEMENTS.contains(&word);
        let deeper = self.current.as_ref().is_some_and(|c| indent > c.indent);
        if let Some(open) = self.opens.last().copied() {
            // These statement words may begin a line of a cue.
            if statement && !deeper && !matches!(word, "curve" | "effect") {
                self.fault(Fault::Unclosed(open, Some(i)));
                self.opens.clear();
                self.begin(i, indent);
            }
        } else if self.current.is_none() || statement || !(deeper || word.is_empty()) {
            self.begin(i, indent);
        }
    }

    fn begin(&mut self, start: usize, indent: usize) {
        self.close();
        if self.out.cuts.len() >= limits::STATEMENTS {
            self.fault(Fault::Many(start));
            self.stopped = true;
            return;
        }
        self.rounds = 0;
        self.current = Some(Open {
            start,
            indent,
            broken: false,
        });
    }

    fn close(&mut self) {
        let Some(open) = self.current.take() else {
            return;
        };
        let span = open.start..self.end;
        let Some(text) = self.text.get(span.clone()).filter(|t| !t.is_empty()) else {
            return;
        };
        let long = span.len() > limits::STATEMENT;
        if long {
            self.out.faults.push(Fault::Long(span.clone()));
        }
        self.out.cuts.push(Cut {
            text,
            span,
            broken: open.broken || long,
        });
    }

    fn fault(&mut self, fault: Fault) {
        // Ten million faults are not worth ten million records.
        self.stopped |= self.out.faults.len() >= limits::ERRORS;
        self.out.faults.push(fault);
        if let Some(current) = &mut self.current {
            current.broken = true;
        }
    }

    /// Skips the token at `i` and returns the start of the next.
    fn code(&mut self, i: usize, byte: u8) -> usize {
        match byte {
            b'"' => return self.quoted(i),
            b'{' if self.opens.len() >= limits::DEPTH => self.too_deep(i),
            b'(' if self.rounds >= limits::DEPTH => self.too_deep(i),
            b'{' => self.opens.push(i),
            b'(' => self.rounds += 1,
            b')' => self.rounds = self.rounds.saturating_sub(1),
            b'}' if self.opens.pop().is_none() => self.fault(Fault::Stray(i)),
            _ => {}
        }
        i + 1
    }

    fn too_deep(&mut self, i: usize) {
        self.fault(Fault::Deep(i));
        self.stopped = true;
        self.end = i + 1;
        self.close();
    }

    fn quoted(&mut self, start: usize) -> usize {
        let mut i = start + 1;
        loop {
            match self.bytes.get(i) {
                Some(b'"') => return i + 1,
                // An escaped byte never ends the text; stepping into the middle of a character is
                // fine, because its other bytes are neither quotes nor newlines.
                Some(b'\\') if self.bytes.get(i + 1).is_some_and(|b| *b != b'\n') => i += 2,
                Some(b'\n') | None => break,
                Some(_) => i += 1,
            }
        }
        self.out.open |= i >= self.bytes.len();
        self.fault(Fault::Text(start..i));
        i
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cuts(text: &str) -> Vec<&str> {
        scan(text).cuts.iter().map(|c| c.text).collect()
    }

    #[test]
    fn statements_begin_with_their_words_and_go_on_indented() {
        let text =
            "show \"a // b\" // c\n\nbank x =\n  y /* bank */\n  z\n  cue 1 {\n up 2\n}\nfoo\n";
        assert_eq!(
            cuts(text),
            [
                "show \"a // b\"",
                "bank x =\n  y /* bank */\n  z",
                "cue 1 {\n up 2\n}",
                "foo"
            ]
        );
        assert_eq!(cuts("cue 1\n{ up 1 }\n"), ["cue 1\n{ up 1 }"]);
        assert_eq!(
            cuts("cue 1 {\ncurve dawn\n}\ncurve a = b"),
            ["cue 1 {\ncurve dawn\n}", "curve a = b"]
        );
        assert!(cuts(" // only\n/* c */ ").is_empty());
    }

    #[test]
    fn a_forgotten_brace_ends_with_the_next_statement() {
        let found = scan("cue 1 {\n  lamps 5\n\ncue 2 { }\n");
        assert_eq!(found.faults, [Fault::Unclosed(6, Some(19))]);
        assert_eq!(found.cuts.len(), 2);
        assert!(found.cuts[0].broken && !found.cuts[1].broken);
    }

    #[test]
    fn faults_are_found_and_the_rest_is_read() {
        let found = scan("show \"abc\n}\nbank a = b\n");
        assert_eq!(found.faults, [Fault::Text(5..9), Fault::Stray(10)]);
        assert_eq!(found.cuts.len(), 2);
        assert!(matches!(
            scan("show \"a\" /* x").faults[..],
            [Fault::Comment(9)]
        ));
        for bracket in ["{", "("] {
            let deep = bracket.repeat(limits::DEPTH + 1);
            assert!(matches!(scan(&deep).faults[..], [Fault::Deep(_)]));
        }
        // Round brackets that were closed, or belong to another statement, do not count.
        let flat = "let a = (b)\n".repeat(20) + &"(a) ".repeat(20);
        assert!(scan(&flat).faults.is_empty());
    }

    #[test]
    fn openness_tells_the_line_editor_to_wait() {
        for open in [
            "cue 1 {",
            "bank a =",
            "show \"x",
            "/* x",
            "cue 1 { part 2 { }",
        ] {
            assert!(scan(open).open, "{open}");
        }
        for done in ["cue 1 { }", "bank a = b", "", "// cue {"] {
            assert!(!scan(done).open, "{done}");
        }
    }
}
