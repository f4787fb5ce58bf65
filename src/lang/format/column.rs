//! Lines of cells, and their alignment under each other.
//!
//! Neighbouring lines of one kind align their cells from left to right as long as the cells play
//! the same role; where the roles part, each group goes on alone. Comments behind lines align too.
//! A column that would push some line further than [`FURTHEST`] is left ragged.

/// Blanks that alignment may add to a line at one place.
const FURTHEST: usize = 24;

/// A piece of a line that may align with the lines around it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// What it is to its line.
    pub role: &'static str,
    /// Blanks before it, at least.
    pub gap: usize,
    /// Its words.
    pub text: String,
}

/// A line of the formatted text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// Blanks before it.
    pub indent: usize,
    /// An empty line stands before it.
    pub apart: bool,
    /// Lines of one kind align; none when the line stands for itself.
    pub kind: Option<&'static str>,
    /// From left to right.
    pub cells: Vec<Cell>,
    /// A comment at its end.
    pub comment: String,
}

impl Line {
    fn joins(&self, before: &Line) -> bool {
        !self.apart
            && self.kind.is_some()
            && self.kind == before.kind
            && self.indent == before.indent
    }
}

/// The whole text.
pub fn text(lines: &[Line]) -> String {
    let mut out = String::new();
    let mut rest = lines;
    while !rest.is_empty() {
        let joined = rest
            .windows(2)
            .take_while(|w| matches!(w, [a, b] if b.joins(a)));
        let (run, after) = rest.split_at(joined.count() + 1);
        let mut codes: Vec<String> = vec![String::new(); run.len()];
        align(run, &mut codes, 0);
        write(run, &codes, &mut out);
        rest = after;
    }
    out
}

/// Writes the cells from `column` on behind what `codes` hold already.
fn align(lines: &[Line], codes: &mut [String], column: usize) {
    let role = |line: &Line| line.cells.get(column).map(|c| c.role);
    let (mut lines, mut codes) = (lines, codes);
    while let Some(first) = lines.first() {
        let same = lines.iter().take_while(|l| role(l) == role(first)).count();
        let (group, after) = lines.split_at(same);
        let (written, others) = codes.split_at_mut(same);
        if role(first).is_some() {
            place(group, written, column);
            align(group, written, column + 1);
        }
        (lines, codes) = (after, others);
    }
}

/// Writes one column of lines that all have it.
fn place(lines: &[Line], codes: &mut [String], column: usize) {
    let starts = |(line, code): (&Line, &String)| {
        let gap = line.cells.get(column).map_or(0, |c| c.gap);
        width(code) + if code.is_empty() { 0 } else { gap }
    };
    let least = lines
        .iter()
        .zip(codes.iter())
        .map(starts)
        .min()
        .unwrap_or(0);
    let most = lines
        .iter()
        .zip(codes.iter())
        .map(starts)
        .max()
        .unwrap_or(0);
    for (line, code) in lines.iter().zip(codes) {
        let own = starts((line, code));
        let start = if most - least > FURTHEST { own } else { most };
        code.push_str(&" ".repeat(start.saturating_sub(width(code))));
        if let Some(cell) = line.cells.get(column) {
            code.push_str(&cell.text);
        }
    }
}

/// Writes a run of lines with their comments.
fn write(lines: &[Line], codes: &[String], out: &mut String) {
    let commented = lines
        .iter()
        .zip(codes)
        .filter(|(l, _)| !l.comment.is_empty());
    let widths: Vec<usize> = commented.map(|(_, code)| width(code)).collect();
    let most = widths.iter().copied().max().unwrap_or(0);
    let ragged = widths.iter().any(|w| most - w > FURTHEST);
    for (line, code) in lines.iter().zip(codes) {
        if line.apart && !out.is_empty() {
            out.push('\n');
        }
        let indent = " ".repeat(line.indent);
        let mut written = format!("{indent}{code}");
        if !line.comment.is_empty() {
            let to = if ragged { width(code) } else { most };
            let gap = if code.is_empty() {
                0
            } else {
                to + 2 - width(code)
            };
            written.push_str(&" ".repeat(gap));
            written.push_str(&line.comment);
        }
        out.push_str(written.trim_end());
        out.push('\n');
    }
}

/// Characters of the last line of a text; what terminals make wide is not known here.
fn width(text: &str) -> usize {
    text.rsplit('\n').next().unwrap_or("").chars().count()
}
