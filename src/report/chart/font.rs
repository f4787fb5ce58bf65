//! Text: widths, shortening and glyph outlines, from a table of DejaVu Sans' glyphs.
//!
//! The table holds ASCII, Latin-1, Latin Extended-A and the mathematical signs that charts use;
//! other characters show as the font's empty box in PNG, and unchanged in SVG (in the reader's
//! fonts). There is neither shaping nor kerning: digits of DejaVu have equal widths, and SVG text
//! states its measured length so that another font fills the same space.
//!
//! The outlines were extracted from the font with skrifa; doing that at build time cost half a
//! minute.

use std::sync::LazyLock;
use tiny_skia::{Path, PathBuilder};

use super::frame::Point;

/// One glyph per line: the letter's code point (hexadecimal; first `notdef`, the empty box), its
/// advance, its outline as absolute M, L, Q and Z commands of SVG, y upward; in font units.
static TABLE: &str = include_str!("DejaVuSans-glyphs.txt");
/// Font units per em.
const UNITS: f32 = 2048.0;

/// Height of accented capitals over the baseline, in ems.
pub(super) const ASCENT: f32 = 0.94;
/// Depth of descenders below the baseline, in ems.
pub(super) const DESCENT: f32 = 0.24;
/// Half the height of a digit, in ems: from the baseline to the middle of a label.
pub(super) const MIDDLE: f32 = 0.365;

/// Outline and advance of a letter, in font units.
#[derive(Clone, Copy, Debug, Default)]
struct Glyph {
    advance: f32,
    outline: &'static str,
}

/// The glyphs by letter, and the empty box.
#[derive(Debug, Default)]
struct Face {
    /// Sorted by letter.
    glyphs: Vec<(char, Glyph)>,
    empty_box: Glyph,
}

static FACE: LazyLock<Face> = LazyLock::new(|| {
    let mut face = Face::default();
    for line in TABLE.lines() {
        let mut words = line.splitn(3, ' ');
        let name = words.next().unwrap_or_default();
        let advance = words.next().and_then(|word| word.parse().ok());
        let glyph = Glyph {
            advance: advance.unwrap_or_default(),
            outline: words.next().unwrap_or_default(),
        };
        let code = u32::from_str_radix(name, 16).ok();
        match code.and_then(char::from_u32) {
            Some(letter) => face.glyphs.push((letter, glyph)),
            None => face.empty_box = glyph,
        }
    }
    face
});

fn glyph(letter: char) -> Glyph {
    // A line break or tab in a name must not become a box.
    let letter = if letter.is_control() { ' ' } else { letter };
    let found = FACE
        .glyphs
        .binary_search_by_key(&letter, |(known, _)| *known);
    let found = found.ok().and_then(|at| FACE.glyphs.get(at));
    found.map_or(FACE.empty_box, |(_, glyph)| *glyph)
}

/// The advance of each letter of `text` at `size` pixels per em.
fn advances(text: &str, size: f32) -> Vec<f32> {
    let scale = size / UNITS;
    text.chars().map(|c| glyph(c).advance * scale).collect()
}

/// Width of `text` at `size` pixels per em.
pub(super) fn width(text: &str, size: f32) -> f32 {
    advances(text, size).iter().sum()
}

/// `text`, or its beginning and "…", no wider than `room`; empty when not even one letter fits.
pub(super) fn fit(text: &str, size: f32, room: f32) -> String {
    let advances = advances(text, size);
    if advances.iter().sum::<f32>() <= room {
        return text.to_owned();
    }
    let mut left = room - width("…", size);
    let kept: String = text
        .chars()
        .zip(advances)
        .take_while(|(_, advance)| {
            left -= advance;
            left >= 0.0
        })
        .map(|(letter, _)| letter)
        .collect();
    let kept = kept.trim_end();
    if kept.is_empty() {
        String::new()
    } else {
        format!("{kept}…")
    }
}

/// Wraps `text` to at most `most` lines no wider than `room`, broken at spaces, the last shortened.
pub(super) fn wrap(text: &str, size: f32, room: f32, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut words = text.split_whitespace().peekable();
    while words.peek().is_some() && lines.len() < most {
        let mut line = String::new();
        let last = lines.len() + 1 == most;
        while let Some(word) = words.peek() {
            let longer = if line.is_empty() {
                (*word).to_owned()
            } else {
                format!("{line} {word}")
            };
            // The last line takes the rest and is shortened below.
            if !last && !line.is_empty() && width(&longer, size) > room {
                break;
            }
            line = longer;
            words.next();
        }
        lines.push(fit(&line, size, room));
    }
    lines
}

/// The outlines of `text` from a position on the baseline (pixels, y down); `None` when nothing is
/// drawn.
pub(super) fn outline(text: &str, size: f32, (x, y): Point) -> Option<Path> {
    let scale = size / UNITS;
    let mut path = PathBuilder::new();
    let mut left = x;
    for letter in text.chars() {
        let glyph = glyph(letter);
        for command in Commands(glyph.outline) {
            // The font's y is upward from the baseline.
            let at = |(dx, dy): Point| (left + dx * scale, y - dy * scale);
            match command {
                Command::Move(to) => {
                    let (x, y) = at(to);
                    path.move_to(x, y);
                }
                Command::Line(to) => {
                    let (x, y) = at(to);
                    path.line_to(x, y);
                }
                Command::Quadratic(control, to) => {
                    let ((cx, cy), (x, y)) = (at(control), at(to));
                    path.quad_to(cx, cy, x, y);
                }
                Command::Close => path.close(),
            }
        }
        left += glyph.advance * scale;
    }
    path.finish()
}

/// One command of an outline, in font units.
enum Command {
    Move(Point),
    Line(Point),
    Quadratic(Point, Point),
    Close,
}

/// The commands of an outline; ends at the first unreadable one.
struct Commands(&'static str);

impl Commands {
    fn number(&mut self) -> Option<f32> {
        let text = self.0.trim_start_matches(' ');
        let end = text.find(|c: char| c == ' ' || c.is_ascii_uppercase());
        let (word, rest) = text.split_at(end.unwrap_or(text.len()));
        self.0 = rest;
        word.parse().ok()
    }

    fn point(&mut self) -> Option<Point> {
        Some((self.number()?, self.number()?))
    }
}

impl Iterator for Commands {
    type Item = Command;

    fn next(&mut self) -> Option<Command> {
        let mut letters = self.0.chars();
        let name = letters.next()?;
        self.0 = letters.as_str();
        match name {
            'M' => self.point().map(Command::Move),
            'L' => self.point().map(Command::Line),
            'Q' => Some(Command::Quadratic(self.point()?, self.point()?)),
            'Z' => Some(Command::Close),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_parses_and_holds_what_charts_write() {
        assert!(FACE.glyphs.is_sorted_by(|a, b| a.0 < b.0));
        for (letter, glyph) in FACE.glyphs.iter().chain([&('□', FACE.empty_box)]) {
            assert!(glyph.advance > 0.0, "{letter}");
            let read = Commands(glyph.outline).count();
            let written = glyph.outline.matches(['M', 'L', 'Q', 'Z']).count();
            assert_eq!(read, written, "{letter}");
        }
        let signs = "AZaz09 –—µ×÷±≤≥°%Σσρ∫→·…−⁻⁰¹²³⁴⁵⁶⁷⁸⁹éøßŁ<&>'\"";
        for sign in signs.chars() {
            let found = FACE.glyphs.iter().any(|(letter, _)| *letter == sign);
            assert!(found, "{sign} is missing");
        }
    }

    #[test]
    fn widths_are_the_fonts_and_scale_with_the_size() {
        // In DejaVu Sans, digits are 1303 of 2048 units wide.
        let digit = 1303.0 / 2048.0;
        assert!((width("0", 100.0) - 100.0 * digit).abs() < 0.1);
        assert!((width("1234", 10.0) - 40.0 * digit).abs() < 0.05);
        assert_eq!(width("", 12.0), 0.0);
    }

    #[test]
    fn fitting_keeps_what_fits_and_shortens_the_rest() {
        assert_eq!(fit("Cyclorama", 12.0, 500.0), "Cyclorama");
        let short = fit("Cyclorama left, lower row", 12.0, 80.0);
        assert!(short.ends_with('…') && short.starts_with("Cyclo"));
        assert!(width(&short, 12.0) <= 80.0);
        assert_eq!(fit("Wide", 12.0, 5.0), "");
        assert_eq!(fit("Wide", 12.0, -1.0), "");
    }

    #[test]
    fn wrapping_breaks_at_spaces_and_shortens_the_last_line() {
        let room = width("one two three", 12.0) + 1.0;
        assert_eq!(
            wrap("one two three four", 12.0, room, 2),
            ["one two three", "four"]
        );
        let lines = wrap("one two three four five six seven eight", 12.0, room, 2);
        assert_eq!(lines.len(), 2);
        assert!(lines.iter().all(|line| width(line, 12.0) <= room));
        assert!(lines.last().is_some_and(|line| line.ends_with('…')));
        assert!(wrap("", 12.0, room, 2).is_empty());
        assert!(wrap("word", 12.0, room, 0).is_empty());
    }
}
