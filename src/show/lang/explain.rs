//! Pages about codes, taken from `grammar/errors.md`.
//!
//! The document is the only source, so that `explain` prints the text of the manual, which the
//! tests run.

use super::codes;
use super::names::nearest;

/// The manual's chapter on errors.
const CHAPTER: &str = include_str!("../../../grammar/errors.md");

/// The manual's page on a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Explanation<'a> {
    /// Such as `E012`.
    pub code: &'a str,
    /// The kind of error in a few words.
    pub title: &'a str,
    /// The page below its heading, in Markdown.
    pub text: &'a str,
}

impl Explanation<'_> {
    /// The smallest cue sheet that makes the error, and its correction, if the page has them.
    pub fn sheets(&self) -> Option<(&str, &str)> {
        let mut sheets = self.text.split("```lxq\n").skip(1);
        let mut next = || sheets.next()?.split_once("```").map(|(sheet, _)| sheet);
        Some((next()?, next()?))
    }
}

/// All pages, in order of their codes.
pub fn pages() -> impl Iterator<Item = Explanation<'static>> {
    let sections = CHAPTER.split("\n## ").skip(1);
    sections.filter_map(|section| {
        let (heading, text) = section.split_once('\n')?;
        let (code, title) = heading.split_once(": ")?;
        let text = text.trim();
        Some(Explanation { code, title, text })
    })
}

/// Looks up the page of a code, in capitals or not.
///
/// # Errors
/// A message that names the nearest code.
pub fn explain(code: &str) -> Result<Explanation<'static>, String> {
    let wanted = code.trim().to_ascii_uppercase();
    if let Some(page) = pages().find(|p| p.code == wanted) {
        return Ok(page);
    }
    let known = codes::TABLE.iter().map(|row| row.code);
    let help = match nearest(&wanted, known) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "a code stands in brackets at the head of a message, as in error[E012]".to_owned(),
    };
    let shown: String = code.trim().chars().take(40).collect();
    Err(format!("there is no code `{shown}`: {help}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_its_page_under_its_title() {
        let pages: Vec<_> = pages().map(|p| (p.code, p.title)).collect();
        let table: Vec<_> = codes::TABLE.iter().map(|r| (r.code, r.title)).collect();
        assert_eq!(pages, table);
        assert!(explain("e012").unwrap().sheets().is_some());
        let message = explain("EO12").unwrap_err();
        assert!(message.contains("did you mean `E012`?"), "{message}");
    }
}
