//! Quoted texts.

use super::ast::Word;

/// The text of a quoted word.
pub(super) fn unquoted(word: Word<'_>) -> String {
    unquote(word.text)
}

/// Removes the quotes, and the backslashes before quotes and backslashes. Any other backslash
/// stays, as in a Windows path.
pub fn unquote(text: &str) -> String {
    let inner = text.strip_prefix('"').and_then(|t| t.strip_suffix('"'));
    let mut out = String::new();
    let mut chars = inner.unwrap_or(text).chars().peekable();
    while let Some(c) = chars.next() {
        match (c, chars.peek()) {
            ('\\', Some('"' | '\\')) => out.extend(chars.next()),
            _ => out.push(c),
        }
    }
    out
}

/// Quotes a text as the language writes it.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
