//! Verbs and options of earlier versions, each with its replacement. The next version drops the table.

/// Old names (an option that still exists elsewhere follows its verb), and the replacement to type.
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
    (&["--keys"], "key images are kept as exact as they are"),
    (
        &["--live", "--wasm"],
        "`footlight serve show.lxq` shows the page while you edit the file",
    ),
    (
        &["play --layers", "play --float"],
        "`frames -o banks.exr --layers banks` writes layers, `frames -o frame####.exr --float` frames",
    ),
    (
        &["play --chroma"],
        "`film -o show.y4m --chroma 444` writes a film",
    ),
    (
        &[
            "play --sacn",
            "play --artnet",
            "play --osc",
            "play --osc-to",
            "play --bind",
            "play --patch",
            "play --priority",
        ],
        "`footlight send` sends a show, such as `footlight send show.lxq --artnet 127.0.0.1`",
    ),
];

/// Replacement of a removed verb or option.
pub fn removed(verb: &str, option: &str) -> Option<String> {
    let of_verb = format!("{verb} {option}");
    let names = [of_verb.trim(), option].map(|name| (name, REMOVED));
    let (name, instead) = names.into_iter().find_map(|(name, table)| {
        let row = table.iter().find(|(names, _)| names.contains(&name))?;
        Some((name, row.1))
    })?;
    Some(format!("`{name}` was removed: {instead}"))
}
