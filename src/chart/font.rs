//! Text: widths, shortening, glyph outlines, from the embedded subset of DejaVu Sans.
//!
//! The subset holds ASCII, Latin-1, Latin Extended-A and the mathematical signs that charts use;
//! anything else shows as the font's empty box in PNG, and as itself in SVG (where the reader's
//! fonts stand in). No shaping and no kerning: digits of DejaVu have one width, and SVG text
//! states the measured length so that another font fills the same place.

use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};
use tiny_skia::{Path, PathBuilder};

use super::drawing::Point;

static SUBSET: &[u8] = include_bytes!("DejaVuSans-subset.ttf");

/// Height of accented capitals over the baseline, in ems.
pub(super) const ASCENT: f32 = 0.94;
/// Depth of descenders below the baseline, in ems.
pub(super) const DESCENT: f32 = 0.24;
/// Half the height of a digit: from the baseline to the middle of a label, in ems.
pub(super) const MIDDLE: f32 = 0.365;
/// Advance where the font is silent, in ems.
const GUESS: f32 = 0.6;

fn face() -> Option<FontRef<'static>> {
    FontRef::new(SUBSET).ok()
}

fn glyph(face: &FontRef<'_>, letter: char) -> GlyphId {
    // A soft line break or tab in a name must not become a box.
    let letter = if letter.is_control() { ' ' } else { letter };
    face.charmap().map(letter).unwrap_or_default()
}

/// The advance of each letter of `text` at `size` pixels an em.
fn advances(text: &str, size: f32) -> Vec<f32> {
    let Some(face) = face() else {
        return text.chars().map(|_| GUESS * size).collect();
    };
    let metrics = face.glyph_metrics(Size::new(size), LocationRef::default());
    text.chars()
        .map(|letter| {
            let advance = metrics.advance_width(glyph(&face, letter));
            advance.unwrap_or(GUESS * size)
        })
        .collect()
}

/// How wide `text` is at `size` pixels an em.
pub(super) fn width(text: &str, size: f32) -> f32 {
    advances(text, size).iter().sum()
}

/// `text`, or its beginning and "…", no wider than `room`; empty where not even one letter fits.
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

/// `text` in at most `most` lines no wider than `room`, broken at spaces, the last shortened.
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
            // The last line takes all that is left and is shortened below.
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

/// The outlines of `text` from a point of its baseline on (pixels, y down); `None` where nothing
/// is drawn.
pub(super) fn outline(text: &str, size: f32, (x, y): Point) -> Option<Path> {
    let face = face()?;
    let outlines = face.outline_glyphs();
    let path = PathBuilder::new();
    let mut pen = Pen { x, y, path };
    for (letter, advance) in text.chars().zip(advances(text, size)) {
        if let Some(shape) = outlines.get(glyph(&face, letter)) {
            let settings = DrawSettings::unhinted(Size::new(size), LocationRef::default());
            // A glyph that cannot be drawn leaves its space empty.
            let _ = shape.draw(settings, &mut pen);
        }
        pen.x += advance;
    }
    pen.path.finish()
}

/// Turns the font's upward y about the baseline and moves each glyph to its place.
struct Pen {
    x: f32,
    y: f32,
    path: PathBuilder,
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.x + x, self.y - y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.x + x, self.y - y);
    }
    fn quad_to(&mut self, cx0: f32, cy0: f32, x: f32, y: f32) {
        let (ox, oy) = (self.x, self.y);
        self.path.quad_to(ox + cx0, oy - cy0, ox + x, oy - y);
    }
    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        let (ox, oy) = (self.x, self.y);
        self.path
            .cubic_to(ox + cx0, oy - cy0, ox + cx1, oy - cy1, ox + x, oy - y);
    }
    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_subset_parses_and_holds_what_charts_write() {
        let face = face().expect("the embedded font parses");
        let signs = "AZaz09 –—µ×÷±≤≥°%Σσρ∫→·…−⁻⁰¹²³⁴⁵⁶⁷⁸⁹éøßŁ<&>'\"";
        for sign in signs.chars() {
            assert!(face.charmap().map(sign).is_some(), "{sign} is missing");
        }
    }

    #[test]
    fn widths_are_the_fonts_and_scale_with_the_size() {
        // DejaVu Sans: digits are 1303 units of 2048 wide.
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
