//! Verbs and options of earlier versions, each with its replacement. The next version drops the table.

/// Names as they were typed, and what to type now.
const REMOVED: &[(&[&str], &str)] = &[
    (
        &["watch"],
        "`footlight serve show.lxq` shows every save in a browser, an editor with `footlight lsp` its errors",
    ),
    (
        &["session", "--truth", "--commands"],
        "the study `figure7` of the sources replays a session",
    ),
    (
        &["chart plan", "chart session", "chart ways"],
        "`plan` lists errors and ways, `plot spectrum` and `plot error` draw errors",
    ),
    (&["--measure"], "`quality --measure` measures every step"),
    (
        &["--metric"],
        "pictures are refined in the order of what they improve most; `refine until 1.5 steps` \
         asks for an error as displayed",
    ),
    (&["--signed-keys"], "keys are never negative"),
    (
        &["--keys"],
        "key images are half floats where that shows no difference",
    ),
    (
        &["--live", "--wasm"],
        "`footlight serve show.lxq` shows the page while you edit the file",
    ),
];

/// What replaces a verb or option that is no longer there, as a clause for a message.
pub fn removed(name: &str) -> Option<String> {
    let (_, instead) = REMOVED.iter().find(|(names, _)| names.contains(&name))?;
    Some(format!("`{name}` was removed: {instead}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find;

    #[test]
    fn a_removed_verb_names_its_replacement() {
        for name in REMOVED.iter().flat_map(|(names, _)| *names) {
            if !name.starts_with("--") {
                let error = find(name).err().map(|error| error.to_string());
                assert!(error.is_some_and(|e| e.contains("was removed: ")), "{name}");
            }
        }
    }
}
