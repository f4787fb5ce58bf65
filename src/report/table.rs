//! Tables of text: aligned columns, Markdown, comma-separated values.

use std::collections::BTreeMap;
use std::fmt::Write;

use footlight_show::printable::{Printable, columns, left, right, visible};

/// A table; every row has as many cells as there are columns. Each distinct text is stored once,
/// because most cells of ten thousand cues on five hundred banks share a few texts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Headings of the columns.
    columns: Vec<String>,
    /// The cells row by row, as indices of texts.
    cells: Vec<u32>,
    texts: Vec<String>,
    /// Indices of the texts.
    known: BTreeMap<String, u32>,
    /// Explanation of the signs; may be empty.
    legend: String,
}

impl Table {
    /// A table without rows.
    pub fn new(columns: Vec<String>, legend: &str) -> Table {
        Table {
            columns,
            legend: legend.to_owned(),
            ..Table::default()
        }
    }

    /// Appends a row: one cell per column.
    pub fn push(&mut self, row: impl IntoIterator<Item = String>) {
        for text in row {
            let next = self.texts.len() as u32;
            let number = match self.known.get(&text) {
                Some(number) => *number,
                None => {
                    self.texts.push(text.clone());
                    self.known.insert(text, next);
                    next
                }
            };
            self.cells.push(number);
        }
    }

    /// The rows from top to bottom.
    fn rows(&self) -> impl Iterator<Item = Vec<&str>> {
        let text = |number: &u32| self.texts.get(*number as usize).map_or("", String::as_str);
        let rows = self.cells.chunks(self.columns.len().max(1));
        rows.map(move |row| row.iter().map(text).collect())
    }

    /// Text for a terminal of `width` characters: groups of columns under each other, each after
    /// the first `fixed` columns.
    pub fn text(&self, fixed: usize, width: usize) -> Printable {
        let widths = widths(self.lines());
        let size = |c: usize| widths.get(c).map_or(0, |w| w + 2);
        let head: usize = (0..fixed).map(size).sum();
        let mut out = String::new();
        let mut next = fixed.min(self.columns.len());
        loop {
            let from = next;
            let mut used = head;
            while next < self.columns.len() && (next == from || used + size(next) <= width + 2) {
                used += size(next);
                next += 1;
            }
            let shown: Vec<usize> = (0..fixed).chain(from..next).collect();
            if !out.is_empty() {
                out.push('\n');
            }
            for row in self.lines() {
                line(&row, &shown, &widths, &mut out);
            }
            if next >= self.columns.len() {
                break;
            }
        }
        if !self.legend.is_empty() {
            let _ = write!(out, "\n{}\n", self.legend);
        }
        out.into()
    }

    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let row = |cells: Vec<&str>| {
            let cells: Vec<String> = cells.iter().map(|cell| marked_down(cell)).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let mut out = row(self.head());
        let _ = writeln!(out, "|{}", " --- |".repeat(self.columns.len()));
        out.extend(self.rows().map(row));
        if !self.legend.is_empty() {
            let _ = write!(out, "\n{}\n", self.legend);
        }
        out
    }

    /// The table as comma-separated values ([`csv_line`]), without the legend.
    pub fn csv(&self) -> String {
        self.lines()
            .map(|cells| csv_line(&cells) + "\r\n")
            .collect()
    }

    fn head(&self) -> Vec<&str> {
        self.columns.iter().map(String::as_str).collect()
    }

    /// The headings, then the rows.
    fn lines(&self) -> impl Iterator<Item = Vec<&str>> {
        std::iter::once(self.head()).chain(self.rows())
    }
}

/// Rows as indented text, right-aligned, each column as wide as its widest cell.
pub fn set_right(rows: &[Vec<String>]) -> String {
    let cells = rows
        .iter()
        .map(|row| row.iter().map(String::as_str).collect());
    let widths = widths(cells);
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths);
        let cells: Vec<String> = cells.map(|(cell, w)| right(cell, *w)).collect();
        format!("  {}\n", cells.join("  "))
    };
    rows.iter().map(line).collect()
}

/// A line of comma-separated values (RFC 4180) without its end, with hidden characters made
/// visible. A cell that a spreadsheet would take for a formula gets an apostrophe.
pub fn csv_line<T: AsRef<str>>(cells: &[T]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| csv_cell(cell.as_ref())).collect();
    cells.join(",")
}

fn csv_cell(text: &str) -> String {
    let shown = visible(text);
    let apostrophe = if is_formula(text) { "'" } else { "" };
    // Quoting also keeps a cell together in programs that separate at semicolons.
    if !apostrophe.is_empty() || shown.contains([',', ';', '"']) {
        format!("\"{apostrophe}{}\"", shown.replace('"', "\"\""))
    } else {
        shown.into_owned()
    }
}

/// True when a spreadsheet would evaluate a cell (OWASP, "CSV Injection"), some of which skip
/// leading blanks. A plain number or clock is no formula.
fn is_formula(cell: &str) -> bool {
    let numeric = |c: char| c.is_ascii_digit() || matches!(c, '.' | ':');
    let words = cell.trim_start();
    match words.strip_prefix('-') {
        Some(rest) => rest.is_empty() || !rest.chars().all(numeric),
        None => {
            words.starts_with(['=', '+', '@', '＝', '＋', '－', '＠'])
                || cell.starts_with(['\t', '\r', '\n'])
        }
    }
}

/// Escapes text for a cell of a Markdown table, including markup, HTML and links.
fn marked_down(text: &str) -> String {
    let mut out = String::new();
    for c in visible(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '~' | '$' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    // A bare URL would become a link.
    let links = [("://", "&#58;//"), ("www.", "www&#46;"), ("@", "&#64;")];
    let plain = |text: String, (mark, code): &(&str, &str)| text.replace(mark, code);
    links.iter().fold(out, plain)
}

/// Width of the widest cell of each column.
fn widths<'r>(rows: impl Iterator<Item = Vec<&'r str>>) -> Vec<usize> {
    let mut widths: Vec<usize> = Vec::new();
    for row in rows {
        widths.resize(widths.len().max(row.len()), 0);
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = columns(cell).max(*width);
        }
    }
    widths
}

fn line(row: &[&str], shown: &[usize], widths: &[usize], out: &mut String) {
    let mut written = String::new();
    for column in shown {
        let (Some(cell), Some(width)) = (row.get(*column), widths.get(*column)) else {
            continue;
        };
        written.extend([&left(cell, *width), "  "]);
    }
    out.push_str(written.trim_end());
    out.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let mut table = Table::new(row(["cue", "lamps", "a,b"]), "· held");
        table.push(row(["1", "85", "say \"x\""]));
        table.push(row(["2.5", "", "=1+1"]));
        table
    }

    #[test]
    fn no_cell_is_a_formula_and_numbers_stay_numbers() {
        for (cell, written) in [
            ("=1+1", "\"'=1+1\""),
            ("+1", "\"'+1\""),
            ("-2+3|cmd", "\"'-2+3|cmd\""),
            ("-lamps", "\"'-lamps\""),
            ("-", "\"'-\""),
            ("@sum(a)", "\"'@sum(a)\""),
            ("\t=1", "\"' =1\""),
            (" =1", "\"' =1\""),
            ("\rx", "\"'␍x\""),
            ("＝1", "\"'＝1\""),
            ("a;=1", "\"a;=1\""),
            ("a\u{1b}[2J\u{202e}", "a␛[2J�"),
            ("-2.5", "-2.5"),
            ("-0:04", "-0:04"),
            ("1e-5", "1e-5"),
            ("a-b", "a-b"),
            ("", ""),
        ] {
            assert_eq!(csv_line(&[cell.to_owned()]), written);
        }
    }

    #[test]
    fn markdown_shows_what_is_written_and_runs_nothing() {
        for (text, written) in [
            ("<script>&", "&lt;script&gt;&amp;"),
            ("![x](http://a)", "!\\[x\\](http&#58;//a)"),
            ("a|`b`*c*\\", "a\\|\\`b\\`\\*c\\*\\\\"),
            ("www.a me@b", "www&#46;a me&#64;b"),
            ("a\nb\u{9b}", "a␊b�"),
            ("1:30 → 85 %", "1:30 → 85 %"),
        ] {
            assert_eq!(marked_down(text), written);
        }
    }

    #[test]
    fn a_table_is_written_three_ways() {
        let table = table();
        assert_eq!(
            table.text(1, 80),
            "cue  lamps  a,b\n1    85     say \"x\"\n2.5         =1+1\n\n· held\n"
        );
        assert_eq!(
            table.text(1, 12),
            "cue  lamps\n1    85\n2.5\n\ncue  a,b\n1    say \"x\"\n2.5  =1+1\n\n· held\n"
        );
        assert_eq!(
            table.markdown(),
            "| cue | lamps | a,b |\n| --- | --- | --- |\n| 1 | 85 | say \"x\" |\n| 2.5 |  | =1+1 |\n\n· held\n"
        );
        assert_eq!(
            table.csv(),
            "cue,lamps,\"a,b\"\r\n1,85,\"say \"\"x\"\"\"\r\n2.5,,\"'=1+1\"\r\n"
        );
    }
}
