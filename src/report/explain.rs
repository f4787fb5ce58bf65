//! The manual's page about a message's code.

use super::Error;
use footlight_show::lang;

/// The page on a code, with the smallest wrong cue sheet and its correction.
pub fn explain(code: &str) -> Result<String, Error> {
    let page = lang::explain(code).map_err(Error::NoSuchCode)?;
    let mut text = format!("{}: {}\n\n", page.code, page.title);
    let mut sheet = false;
    for line in page.text.lines() {
        if line.starts_with("```") {
            sheet = !sheet;
            continue;
        }
        let indent = if sheet { "    " } else { "" };
        text.push_str(format!("{indent}{line}").trim_end());
        text.push('\n');
    }
    Ok(text)
}
