//! Comments of the sources and pages of the manual are plain English.

use std::fs;
use std::path::{Path, PathBuf};

/// Openings of a sentence without a subject. A reader must then guess the noun from the code.
const OPENINGS: [&str; 5] = ["What ", "Of ", "The same ", "Whether ", "Those "];

/// Phrases with an unnamed subject, or that plain English says otherwise: "the existing cues",
/// "again", "`n` bytes", "except", "next to". Each is wrong wherever it occurs; "of those" is not
/// in the list because "of those before it" is plain.
const PHRASES: [&str; 12] = [
    "what is there",
    "anew",
    "so many",
    "but for",
    "is told",
    "are told",
    "was told",
    "of its own",
    "all of it",
    "one who",
    "nobody",
    "beside",
];

/// The Rust files in a folder and below it, except build output.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            sources(&path, found);
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
}

/// A comment's kind (`///`, `//!` or `//`) and its line number, with its lines joined.
struct Comment {
    kind: &'static str,
    line: usize,
    text: String,
}

/// Comments that stand alone on their lines.
fn comments(source: &str) -> Vec<Comment> {
    let mut found: Vec<Comment> = Vec::new();
    let mut before = "";
    for (i, line) in source.lines().enumerate() {
        let line = line.trim_start();
        let kind = ["///", "//!", "//"]
            .into_iter()
            .find(|k| line.starts_with(k));
        let kind = kind.unwrap_or("");
        let text = line[kind.len()..].trim();
        match found.last_mut() {
            _ if kind.is_empty() => {}
            Some(comment) if kind == before => {
                comment.text.push(' ');
                comment.text.push_str(text);
            }
            _ => found.push(Comment {
                kind,
                line: i + 1,
                text: text.to_owned(),
            }),
        }
        before = kind;
    }
    found
}

/// Faults of a comment. A doc comment without a full stop is help of the command line.
fn faults(comment: &Comment) -> Vec<&'static str> {
    let is_doc = comment.kind != "//" && comment.text.ends_with('.');
    let openings = OPENINGS.into_iter();
    let openings = openings.filter(|o| is_doc && comment.text.starts_with(o));
    let lower = comment.text.to_lowercase();
    let words: Vec<&str> = lower
        .split(|c: char| !c.is_alphanumeric() && c != '_' && c != '`')
        .filter(|word| !word.is_empty())
        .collect();
    let is_in = |phrase: &&str| {
        let phrase: Vec<&str> = phrase.split(' ').collect();
        words.windows(phrase.len()).any(|w| w == phrase)
    };
    openings.chain(PHRASES.into_iter().filter(is_in)).collect()
}

#[test]
fn comments_are_plain_english() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(root, &mut files);
    assert!(files.len() > 300, "{}", files.len());
    let mut found = Vec::new();
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let path = path.strip_prefix(root).unwrap().display();
        for comment in comments(&text) {
            for fault in faults(&comment) {
                found.push(format!("{path}:{}: {}", comment.line, fault.trim_end()));
            }
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// README, manual and language hold to the same list of phrases, outside code.
#[test]
fn pages_are_plain_english() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manual = fs::read_dir(root.join("src/manual")).unwrap();
    let mut pages: Vec<PathBuf> = manual.map(|entry| entry.unwrap().path()).collect();
    pages.extend(["README.md", "grammar/README.md"].map(|name| root.join(name)));
    let mut found = Vec::new();
    for path in pages {
        let text = fs::read_to_string(&path).unwrap();
        for paragraph in text.split("```").step_by(2).flat_map(|t| t.split("\n\n")) {
            let words = paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
            let comment = Comment {
                kind: "//",
                line: 0,
                text: words,
            };
            for fault in faults(&comment) {
                found.push(format!("{}: {fault}: {}", path.display(), comment.text));
            }
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn faults_are_found() {
    let source = "/// The same for\n/// a panel.\nfn f() {\n    // Lists of so\n    // many items.\n    \
                  /// Whether to draw\n    let a = 1;\n}\n//! Area of the all of its parts.\n";
    let found: Vec<_> = comments(source)
        .iter()
        .map(|c| (c.line, faults(c)))
        .collect();
    let wanted = [
        (1, vec!["The same "]),
        (4, vec!["so many"]),
        (6, vec![]),
        (9, vec![]),
    ];
    assert_eq!(found, wanted);
}
