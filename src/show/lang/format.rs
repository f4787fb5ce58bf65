//! The canonical layout of a show's text.
//!
//! One declaration, move or part per line; two blanks of indentation per brace; one blank between
//! words, two between clauses; clauses of neighbouring lines aligned; at most one empty line.
//! Comments, groups of lines and line breaks inside a declaration stay. Invariants: the words and
//! their order stay (colours become lower case); the show stays; formatting is idempotent.

mod column;
mod gap;
mod layout;
mod piece;

use super::read;
use super::report::{Report, slice};
use super::scan;
use super::{codes, limits};
use crate::diagnostic::Diagnostic;

/// Formats a text in the canonical layout; line ends stay as they are.
///
/// # Errors
/// The diagnostics of a text that does not parse, with places in it as file 0.
pub fn format(text: &str) -> Result<String, Vec<Diagnostic>> {
    let mut report = Report::default();
    if text.len() > limits::FILE {
        let message = format!("a show has {} bytes at most", limits::FILE);
        return Err(vec![Diagnostic::error(codes::TOO_LARGE, message)]);
    }
    let unix = text.replace("\r\n", "\n");
    let scan = scan::scan(&unix);
    read::read(&unix, 0, &scan, &mut report);
    if report.failed() {
        return Err(report.finish().0);
    }
    let mut layout = layout::Layout::default();
    let mut from = 0;
    for cut in scan.cuts {
        let pieces = piece::pieces(cut.text);
        for (i, piece) in pieces.iter().enumerate() {
            let start = cut.span.start + piece.span.start;
            let gap = slice(&unix, from..start)?;
            layout.piece(piece, gap, || rest_of_block(&pieces, i, cut.text));
            from = cut.span.start + piece.span.end;
        }
    }
    let lines = layout.finish(slice(&unix, from..unix.len())?);
    let formatted = column::text(&lines);
    let windows = text.find('\n').is_some_and(|i| text[..i].ends_with('\r'));
    Ok(if windows {
        formatted.replace('\n', "\r\n")
    } else {
        formatted
    })
}

/// The pieces from the opening brace `i` to its closing one, and true when they stand on one line.
fn rest_of_block<'p, 'a>(
    pieces: &'p [piece::Piece<'a>],
    i: usize,
    statement: &str,
) -> (&'p [piece::Piece<'a>], bool) {
    let mut depth = 0_usize;
    for (k, piece) in pieces.iter().enumerate().skip(i) {
        match piece.join {
            piece::Join::Open { .. } => depth += 1,
            piece::Join::Close => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            let block = pieces.get(i..=k).unwrap_or_default();
            let from = block.first().map_or(0, |p| p.span.start);
            let text = statement.get(from..piece.span.end).unwrap_or("");
            return (block, !text.contains('\n'));
        }
    }
    (&[], false)
}

#[cfg(test)]
mod tests;
