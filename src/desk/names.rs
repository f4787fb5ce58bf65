//! Names in the language from labels of other programs.

use std::collections::BTreeMap;

use footlight_show::lang;

/// Longest name made from a label.
const LONGEST: usize = 32;

/// Names given so far.
#[derive(Debug, Default)]
pub struct Names {
    /// Next number for each repeated label.
    given: BTreeMap<String, usize>,
}

impl Names {
    /// A unique name for `label`, or for `fallback` when the label has no letters.
    pub fn give(&mut self, label: &str, fallback: &str) -> String {
        let mut name = word(label);
        if name.is_empty() || lang::is_reserved(&name) {
            name = fallback.to_owned();
        }
        let mut next = name.clone();
        let mut count = self.given.get(&name).copied().unwrap_or(2);
        while self.given.contains_key(&next) || lang::is_reserved(&next) {
            next = format!("{name}_{count}");
            count += 1;
        }
        self.given.insert(name, count);
        self.given.entry(next.clone()).or_insert(2);
        next
    }
}

/// The label in small letters, with `_` for characters not allowed in names; empty when it begins
/// with no letter.
fn word(label: &str) -> String {
    let mut out = String::new();
    for c in label.chars().flat_map(char::to_lowercase) {
        let fits = c.is_alphabetic() || c.is_ascii_digit();
        match fits {
            true => out.push(c),
            false if out.ends_with('_') || out.is_empty() => {}
            false => out.push('_'),
        }
    }
    let short: String = out.chars().take(LONGEST).collect();
    let name = short.trim_matches('_');
    if name.starts_with(char::is_alphabetic) {
        name.to_owned()
    } else {
        String::new()
    }
}
