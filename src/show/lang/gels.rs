//! Tables of gels: one line each with number, name and colour, `L201, "Full C.T. Blue", #9dc1ff`.
//!
//! Fields are separated by commas or semicolons; the first is the number, the last the colour. A
//! first line without a colour is a heading.

use std::collections::BTreeMap;

use super::ast::Span;
use super::lower::hex;
use super::report::{Place, Report};
use super::{codes, syntax};
use crate::diagnostic::Diagnostic;
use crate::units::Rgb;

/// Colours of a table by number. A bad line is reported, and the result is `None`.
pub fn table(text: &str, file: u32, report: &mut Report) -> Option<BTreeMap<String, Rgb>> {
    let mut out = BTreeMap::new();
    let mut start = 0;
    let mut sound = true;
    for (number, line) in text.split_inclusive('\n').enumerate() {
        let (from, trimmed) = (start, line.trim());
        start += line.len();
        if trimmed.is_empty() || report.full() {
            continue;
        }
        let span = Span {
            file,
            start: from as u32,
            end: (from + line.trim_end().len()) as u32,
        };
        match row(trimmed) {
            Ok((gel, colour)) => {
                if out.insert(gel.to_owned(), colour).is_some() {
                    let message = format!("the gel `{gel}` stands twice in this table");
                    refuse(
                        report,
                        codes::SAID_TWICE,
                        message,
                        span,
                        "keep one of the two",
                    );
                    sound = false;
                }
            }
            Err(_) if number == 0 => {}
            Err(why) => {
                let help = "a line is number, name, colour: `L201, Full C.T. Blue, #9dc1ff`";
                refuse(report, codes::BAD_COLOUR, why, span, help);
                sound = false;
            }
        }
    }
    sound.then_some(out)
}

/// Numbers of the gels in a table; empty for any other text.
pub fn gels_of_table(text: &str) -> Vec<String> {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    // A heading, or the first gel.
    let first = lines.next().map(row);
    let rest: Result<Vec<_>, _> = lines.map(row).collect();
    let first = first.and_then(Result::ok).into_iter();
    let all = first.chain(rest.unwrap_or_default());
    all.map(|(gel, _)| gel.to_owned()).collect()
}

fn refuse(report: &mut Report, code: &'static str, message: String, span: Span, help: &str) {
    report.add(
        Diagnostic::error(code, message)
            .place(span, "in this line")
            .help(help),
    );
}

fn row(line: &str) -> Result<(&str, Rgb), String> {
    let field = |text: &str| text.trim().trim_matches('"').to_owned();
    let (first, last) = match (line.split_once([',', ';']), line.rsplit_once([',', ';'])) {
        (Some((first, _)), Some((_, last))) => (first.trim().trim_matches('"'), field(last)),
        _ => return Err("this line is no gel".to_owned()),
    };
    let written = format!("gel {first}");
    if syntax::prefix(syntax::Rule::colour, &written) != Some(written.len()) {
        return Err(format!("`{first}` is not the number of a gel"));
    }
    let colour = last.strip_prefix('#').and_then(hex);
    match colour {
        Some(srgb) => Ok((first, Rgb::from_srgb8(srgb))),
        None => Err(format!("`{last}` is not a colour")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_either_separator_are_read_and_bad_lines_named() {
        let mut report = Report::default();
        let text = "number,name,colour\nL201, \"Blue, full\", #9dc1ff\n\n06;Straw;#fea\n";
        let found = table(text, 0, &mut report).unwrap();
        assert_eq!(found["L201"].to_srgb8(), [0x9d, 0xc1, 0xff]);
        assert_eq!(found["06"].to_srgb8(), [0xff, 0xee, 0xaa]);
        for bad in [
            "1,a,#fff\n2,b,#ff\n",
            "1,a,#fff\nx y,b,#fff\n",
            "1,a,#fff\n1,b,#000\n",
            "1,a,#fff\nno\n",
        ] {
            let mut report = Report::default();
            assert!(table(bad, 0, &mut report).is_none(), "{bad}");
            assert!(report.failed());
        }
    }
}
