//! Positions in a text as the protocol counts them: lines, and columns in UTF-8 bytes or UTF-16
//! units as negotiated.

use std::ops::Range;

use footlight_show::printable::boundary;
use lsp_types::{Position, PositionEncodingKind};

/// Unit of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Bytes.
    Utf8,
    /// UTF-16 units, which every client supports.
    Utf16,
}

impl Encoding {
    /// Bytes if the client offers them, else UTF-16 units.
    pub fn negotiated(offered: Option<&[PositionEncodingKind]>) -> Encoding {
        if offered.is_some_and(|kinds| kinds.contains(&PositionEncodingKind::UTF8)) {
            Encoding::Utf8
        } else {
            Encoding::Utf16
        }
    }

    /// The protocol's name.
    pub fn kind(self) -> PositionEncodingKind {
        match self {
            Encoding::Utf8 => PositionEncodingKind::UTF8,
            Encoding::Utf16 => PositionEncodingKind::UTF16,
        }
    }

    /// Columns of a piece of a line.
    pub fn width(self, text: &str) -> u32 {
        match self {
            Encoding::Utf8 => text.len() as u32,
            Encoding::Utf16 => text.encode_utf16().count() as u32,
        }
    }

    /// Bytes of the first `columns` columns of a line, at most the whole line; a column within a
    /// character counts as its beginning.
    fn bytes(self, line: &str, columns: u32) -> usize {
        let mut left = columns;
        for (at, c) in line.char_indices() {
            let width = match self {
                Encoding::Utf8 => c.len_utf8(),
                Encoding::Utf16 => c.len_utf16(),
            } as u32;
            if width > left {
                return at;
            }
            left -= width;
        }
        line.len()
    }
}

/// Line starts of a text.
#[derive(Clone, Debug)]
pub struct Lines<'t> {
    text: &'t str,
    starts: Vec<usize>,
    encoding: Encoding,
}

impl<'t> Lines<'t> {
    /// The lines of a text, which end in `\n`, `\r\n` or `\r`.
    pub fn new(text: &'t str, encoding: Encoding) -> Lines<'t> {
        let bytes = text.as_bytes();
        let ends = |(at, byte): &(usize, &u8)| match byte {
            b'\n' => true,
            b'\r' => bytes.get(at + 1) != Some(&b'\n'),
            _ => false,
        };
        let after = bytes.iter().enumerate().filter(ends).map(|(at, _)| at + 1);
        Lines {
            text,
            starts: std::iter::once(0).chain(after).collect(),
            encoding,
        }
    }

    /// A line without its end.
    fn line(&self, line: usize) -> &'t str {
        let start = self.starts.get(line).copied().unwrap_or(self.text.len());
        let end = self.starts.get(line + 1).copied();
        let line = self.text.get(start..end.unwrap_or(self.text.len()));
        line.unwrap_or("").trim_end_matches(['\r', '\n'])
    }

    /// The byte at a position; for an invalid one, the nearest before.
    pub fn byte(&self, position: Position) -> usize {
        let line = position.line as usize;
        match self.starts.get(line) {
            Some(start) => start + self.encoding.bytes(self.line(line), position.character),
            None => self.text.len(),
        }
    }

    /// The position of a byte.
    pub fn position(&self, byte: usize) -> Position {
        let byte = boundary(self.text, byte);
        let line = self.starts.partition_point(|start| *start <= byte) - 1;
        let start = self.starts.get(line).copied().unwrap_or(0);
        let before = self.text.get(start..byte).unwrap_or("");
        Position::new(line as u32, self.encoding.width(before))
    }

    /// The bytes of a range.
    pub fn bytes(&self, range: lsp_types::Range) -> Range<usize> {
        let (start, end) = (self.byte(range.start), self.byte(range.end));
        start..end.max(start)
    }

    /// The range of bytes.
    pub fn range(&self, bytes: &Range<usize>) -> lsp_types::Range {
        lsp_types::Range::new(self.position(bytes.start), self.position(bytes.end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn columns_are_counted_as_negotiated() {
        let text = "bank süd = x\r\n🎭 \"ü\"\rend";
        let utf16 = Lines::new(text, Encoding::Utf16);
        let utf8 = Lines::new(text, Encoding::Utf8);
        let mask = text.find(" \"").unwrap();
        assert_eq!(utf16.position(mask), Position::new(1, 2));
        assert_eq!(utf8.position(mask), Position::new(1, 4));
        let equals = text.find('=').unwrap();
        assert_eq!(utf16.position(equals), Position::new(0, 9));
        assert_eq!(utf8.position(equals), Position::new(0, 10));
        assert_eq!(utf16.byte(Position::new(2, 0)), text.len() - 3);
        // Within the mask, after the line's end, after the text.
        assert_eq!(utf16.byte(Position::new(1, 1)), mask - 4);
        assert_eq!(utf16.byte(Position::new(0, 99)), text.find('\r').unwrap());
        assert_eq!(utf16.byte(Position::new(9, 9)), text.len());
    }

    proptest! {
        #[test]
        fn a_place_there_and_back_is_the_same(text in "[a-zü🎭\r\n]{0,40}", at in 0_usize..90) {
            let at = boundary(&text, at);
            for encoding in [Encoding::Utf8, Encoding::Utf16] {
                let lines = Lines::new(&text, encoding);
                let back = lines.byte(lines.position(at));
                let between_end = text.get(back..at).is_some_and(|t| t == "\r");
                prop_assert!(back == at || between_end, "{at} {back} {text:?}");
            }
        }
    }
}
