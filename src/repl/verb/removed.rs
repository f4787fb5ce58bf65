//! Verbs and options of earlier versions, each with its replacement. The next version drops the table.

/// Names as they were typed, and what to type now.
const REMOVED: &[(&str, &str)] = &[
    (
        "watch",
        "`footlight serve show.lxq` shows every save in a browser, an editor with `footlight lsp` its errors",
    ),
    (
        "--live",
        "`footlight serve show.lxq` shows the page while you edit the file",
    ),
    (
        "--wasm",
        "`footlight serve show.lxq` shows the page while you edit the file",
    ),
];

/// What replaces a verb or option that is no longer there, as a clause for a message.
pub fn removed(name: &str) -> Option<String> {
    let (_, instead) = REMOVED.iter().find(|(old, _)| *old == name)?;
    Some(format!("`{name}` was removed: {instead}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repl::{VERBS, find};

    #[test]
    fn what_was_removed_is_no_verb_or_option_and_names_its_replacement() {
        for (name, _) in REMOVED {
            match name.strip_prefix("--") {
                Some(option) => assert!(
                    !VERBS
                        .iter()
                        .any(|verb| verb.options.iter().any(|o| o.name == option)),
                    "{name}"
                ),
                None => {
                    let error = find(name).err().map(|error| error.to_string());
                    assert!(error.is_some_and(|e| e.contains("was removed: ")), "{name}");
                }
            }
        }
    }
}
