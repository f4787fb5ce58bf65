//! Text safe for a person to read: nothing is hidden, nothing controls the terminal.
//!
//! A show's title may hold an escape sequence that renames the window, or a control that reverses
//! the direction of writing. Text leaves the program only as [`Printable`]; the conversion replaces
//! such characters, so that no new report can forget it. Only the renderer of diagnostics may use
//! colours.
//!
//! Invariant: each replacement is one character for one and a column wide, so that aligned text
//! stays aligned; [`columns`] measures text as displayed. This module does not know what the text
//! is about.

use std::borrow::{Borrow, Cow};
use std::fmt;
use std::ops::Deref;

use unicode_width::UnicodeWidthStr;

/// Decodes bytes as UTF-8, or else as Windows-1252, which older programs write.
pub fn of_bytes(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => bytes.iter().map(|b| windows_1252(*b)).collect(),
    }
}

/// The character of a byte in Windows-1252 (WHATWG Encoding Standard): Latin-1 except 0x80 to 0x9f,
/// of which five have no character and stay control characters.
fn windows_1252(byte: u8) -> char {
    const FROM_0X80: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž',
        '\u{8f}', '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}',
        'ž', 'Ÿ',
    ];
    let special = usize::from(byte).checked_sub(0x80);
    let special = special.and_then(|at| FROM_0X80.get(at));
    special.copied().unwrap_or(char::from(byte))
}

/// Escapes text for XML and HTML. Line ends and tabs become spaces; other control characters and
/// characters that XML cannot hold are dropped.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\r' | '\t' => out.push(' '),
            '\u{fffe}' | '\u{ffff}' => {}
            other if other.is_control() => {}
            other => out.push(other),
        }
    }
    out
}

/// The text of a number without zeros at the end of its decimals.
pub fn trimmed(text: &str) -> String {
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    };
    if text == "-0" { "0" } else { text }.to_owned()
}

/// The character boundary at a byte, or before it.
pub fn boundary(text: &str, byte: usize) -> usize {
    let mut at = byte.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Text that is safe to print: no control character except the newline, no control of the direction
/// of writing, nothing invisible; colours only in coloured diagnostics.
///
/// Text is converted with [`From`], or written with [`fmt::Write`]; it is read as a `str`.
///
/// ```
/// let title = footlight_show::printable::Printable::from("\u{1b}]0;hostile\u{7}");
/// assert_eq!(&*title, "␛]0;hostile␇");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Printable(String);

impl Printable {
    /// Text with colours: sequences `ESC [ digits m` pass, everything else is converted. For text
    /// whose foreign parts were made visible before they were coloured.
    pub(crate) fn coloured(text: &str) -> Printable {
        let mut out = Printable::default();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once("\u{1b}[") {
            out.push(before);
            let end = after.find(|c: char| !(c.is_ascii_digit() || c == ';'));
            match end
                .and_then(|end| Some((after.get(..end)?, after.get(end..)?.strip_prefix('m')?)))
            {
                Some((code, behind)) => {
                    out.0.extend(["\u{1b}[", code, "m"]);
                    rest = behind;
                }
                None => {
                    out.push("\u{1b}[");
                    rest = after;
                }
            }
        }
        out.push(rest);
        out
    }

    /// Converts and appends text.
    pub fn push(&mut self, text: &str) {
        for (i, line) in text.split('\n').enumerate() {
            if i > 0 {
                self.0.push('\n');
            }
            self.0.push_str(&visible(line));
        }
    }

    /// Appends text converted before.
    pub fn append(&mut self, text: &Printable) {
        self.0.push_str(&text.0);
    }
}

impl Deref for Printable {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl Borrow<str> for Printable {
    fn borrow(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Printable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

impl fmt::Write for Printable {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.push(text);
        Ok(())
    }
}

impl From<&str> for Printable {
    fn from(text: &str) -> Printable {
        let mut out = Printable::default();
        out.push(text);
        out
    }
}

impl From<String> for Printable {
    fn from(text: String) -> Printable {
        Printable::from(text.as_str())
    }
}

impl From<&String> for Printable {
    fn from(text: &String) -> Printable {
        Printable::from(text.as_str())
    }
}

impl From<&Printable> for Printable {
    fn from(text: &Printable) -> Printable {
        text.clone()
    }
}

impl From<Printable> for String {
    fn from(text: Printable) -> String {
        text.0
    }
}

impl PartialEq<str> for Printable {
    fn eq(&self, other: &str) -> bool {
        self.0 == other
    }
}

impl PartialEq<&str> for Printable {
    fn eq(&self, other: &&str) -> bool {
        self.0 == *other
    }
}

impl PartialEq<String> for Printable {
    fn eq(&self, other: &String) -> bool {
        self.0 == *other
    }
}

/// A line with every character visible: controls as their pictures (`␛`), tabs as blanks, invisible
/// characters and controls of the direction of writing as `�`, like rustc.
pub fn visible(line: &str) -> Cow<'_, str> {
    if line.chars().any(is_hidden) {
        Cow::Owned(line.chars().map(shown).collect())
    } else {
        Cow::Borrowed(line)
    }
}

/// The character that [`visible`] shows for this one.
pub fn shown(c: char) -> char {
    match c {
        '\t' => ' ',
        '\u{7f}' => '␡',
        // Unicode has the pictures of these in their order.
        '\0'..=' ' => char::from_u32(0x2400 + u32::from(c))
            .filter(|_| c != ' ')
            .unwrap_or(c),
        c if is_hidden(c) => char::REPLACEMENT_CHARACTER,
        c => c,
    }
}

/// True for a character that controls a terminal, changes the reading order of others, or is
/// invisible. Joiners do not count: scripts and emoji need them.
pub fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c,
            // Marks, embeddings, overrides and isolates (the property Bidi_Control).
            '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
            // Separators of lines and paragraphs.
            | '\u{2028}' | '\u{2029}'
            // Characters without width or shape.
            | '\u{180e}' | '\u{200b}' | '\u{2060}'..='\u{2065}' | '\u{206a}'..='\u{206f}'
            | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// JSON with the characters of [`is_hidden`] escaped (`\u001b`), which keeps its values: except for
/// white space between tokens, only strings of a JSON text hold such characters.
pub fn json(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if is_hidden(c) && !matches!(c, '\n' | '\t' | '\r') {
            out.extend(
                c.encode_utf16(&mut [0; 2])
                    .iter()
                    .map(|u| format!("\\u{u:04x}")),
            )
        } else {
            out.push(c)
        }
    }
    out
}

/// Columns that a line takes in a terminal.
pub fn columns(line: &str) -> usize {
    visible(line).width()
}

/// Pads a line on the right to this number of columns.
pub fn left(line: &str, width: usize) -> String {
    line.to_owned() + &" ".repeat(width.saturating_sub(columns(line)))
}

/// Pads a line on the left to this number of columns.
pub fn right(line: &str, width: usize) -> String {
    " ".repeat(width.saturating_sub(columns(line))) + line
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// Every character that must not reach a terminal, each with its neighbours.
    fn hostile() -> String {
        let all = '\0'..=char::MAX;
        all.filter(|c| is_hidden(*c) && *c != '\n').collect()
    }

    #[test]
    fn nothing_hidden_is_printed_and_columns_stay() {
        let text = hostile();
        let printed = Printable::from(&text);
        assert!(!printed.chars().any(is_hidden));
        assert_eq!(printed.chars().count(), text.chars().count());
        assert_eq!(columns(&text), text.chars().count());
        assert_eq!(Printable::from(&*printed), printed);
    }

    #[test]
    fn controls_are_seen_and_words_of_any_script_stay() {
        assert_eq!(
            Printable::from("a\u{1b}[31m\r\u{7f}\u{9b}b\u{202e}c\td\u{2028}\ne\0"),
            "a␛[31m␍␡�b�c d�\ne␀"
        );
        for plain in ["Über 照明 نور אור 👩\u{200d}🎤", "\n\n", "", " "] {
            assert_eq!(Printable::from(plain), plain);
        }
    }

    #[test]
    fn colours_pass_and_nothing_else_does() {
        let ours = "\u{1b}[1;31merror\u{1b}[0m \u{1b}[m";
        assert_eq!(Printable::coloured(ours), ours);
        for (text, printed) in [
            ("\u{1b}]0;t\u{7}", "␛]0;t␇"),
            ("\u{1b}[2J", "␛[2J"),
            ("\u{1b}[31", "␛[31"),
            ("\u{1b}[\u{1b}[1m", "␛[\u{1b}[1m"),
            ("\u{9b}1m", "�1m"),
        ] {
            assert_eq!(Printable::coloured(text), printed);
        }
    }

    #[test]
    fn json_reads_as_the_same_and_shows_nothing_raw() {
        let text = hostile() + "\u{e0041}<\"\\é";
        let written = json(&serde_json::to_string_pretty(&[&text]).unwrap());
        assert!(!written.chars().any(|c| is_hidden(c) && c != '\n'));
        let read: Vec<String> = serde_json::from_str(&written).unwrap();
        assert_eq!(read, [text]);
    }

    #[test]
    fn columns_are_filled_by_width() {
        assert_eq!(left("照明", 6), "照明  ");
        assert_eq!(right("\u{202e}ab", 4), " \u{202e}ab");
        assert_eq!(left("long", 2), "long");
    }
}
