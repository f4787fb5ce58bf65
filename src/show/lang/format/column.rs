//! Lines of cells, and their alignment in columns.
//!
//! Neighbouring lines of one kind align their cells from left to right as long as the cells play
//! the same role; where the roles differ, each group continues alone. Comments at line ends align
//! too. A column that would push some line further than [`FURTHEST`] is left ragged.

/// Most blanks that alignment may add to a line at one place.
const FURTHEST: usize = 24;

/// A piece of a line that may align with neighbouring lines.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// Role of the cell in its line.
    pub role: &'static str,
    /// Least number of blanks before it.
    pub gap: usize,
    pub text: String,
}

/// A line of the formatted text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// Blanks of indentation.
    pub indent: usize,
    /// True when an empty line precedes.
    pub apart: bool,
    /// Lines of one kind align; `None` for a line that aligns with no other.
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

/// A line, as far as it is written.
#[derive(Clone, Debug, Default)]
struct Written {
    text: String,
    /// Characters of its last line; a comment may span several.
    width: usize,
}

impl Written {
    fn blanks(&mut self, count: usize) {
        self.text.push_str(&" ".repeat(count));
        self.width += count;
    }

    fn push(&mut self, text: &str) {
        self.text.push_str(text);
        let before = if text.contains('\n') { 0 } else { self.width };
        self.width = before + width(text);
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
        write(run, &aligned(run), &mut out);
        rest = after;
    }
    out
}

/// Aligns the cells of a run of lines, column by column: neighbours whose cells play the same role
/// align. Iterative, because a line may have any number of columns.
fn aligned(lines: &[Line]) -> Vec<Written> {
    let all = lines.iter().map(|line| (line, Written::default()));
    let mut all: Vec<(&Line, Written)> = all.collect();
    let mut groups = vec![(all.as_mut_slice(), 0)];
    while let Some((group, column)) = groups.pop() {
        let role = |(line, _): &(&Line, Written)| line.cells.get(column).map(|c| c.role);
        for same in group.chunk_by_mut(|a, b| role(a) == role(b)) {
            if same.first().and_then(role).is_some() {
                write_column(same, column);
                groups.push((same, column + 1));
            }
        }
    }
    all.into_iter().map(|(_, written)| written).collect()
}

/// Writes one column of lines that all have it.
fn write_column(lines: &mut [(&Line, Written)], column: usize) {
    let starts = |(line, code): &(&Line, Written)| {
        let gap = line.cells.get(column).map_or(0, |c| c.gap);
        code.width + if code.text.is_empty() { 0 } else { gap }
    };
    let all = || lines.iter().map(starts);
    let (least, most) = (all().min().unwrap_or(0), all().max().unwrap_or(0));
    for pair in lines {
        let own = starts(pair);
        let (line, code) = pair;
        let start = if most - least > FURTHEST { own } else { most };
        code.blanks(start.saturating_sub(code.width));
        if let Some(cell) = line.cells.get(column) {
            code.push(&cell.text);
        }
    }
}

/// Writes a run of lines with their comments.
fn write(lines: &[Line], codes: &[Written], out: &mut String) {
    let commented = lines
        .iter()
        .zip(codes)
        .filter(|(l, _)| !l.comment.is_empty());
    let widths: Vec<usize> = commented.map(|(_, code)| code.width).collect();
    let most = widths.iter().copied().max().unwrap_or(0);
    let ragged = widths.iter().any(|w| most - w > FURTHEST);
    for (line, code) in lines.iter().zip(codes) {
        if line.apart && !out.is_empty() {
            out.push('\n');
        }
        let indent = " ".repeat(line.indent);
        let mut written = format!("{indent}{}", code.text);
        if !line.comment.is_empty() {
            let to = if ragged { code.width } else { most };
            let gap = if code.text.is_empty() {
                0
            } else {
                to + 2 - code.width
            };
            written.push_str(&" ".repeat(gap));
            written.push_str(&line.comment);
        }
        out.push_str(written.trim_end());
        out.push('\n');
    }
}

/// Characters of the last line of a text, without regard to wide characters.
fn width(text: &str) -> usize {
    let last = text.rsplit_once('\n').map_or(text, |(_, last)| last);
    last.chars().count()
}
