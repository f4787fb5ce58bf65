//! Compares the tree-sitter parser of cue sheets with the language's own, and writes it to `../src` for
//! editors with `--write`: `cargo run --release`.
//!
//! Every sheet of this project that the language reads has a tree without errors: the examples, the
//! manual, the shows in the tests, and random shows made of their statements, with comments and line
//! ends between any two words. The queries fit the grammar. It needs Node and a C compiler.

use std::fs;
use std::path::{Path, PathBuf};

use footlight::diagnostic::Sources;
use footlight::files::Memory;
use footlight::lang::{self, LoweringCache};
use tree_sitter::{Language, Parser, Query};

unsafe extern "C" {
    fn tree_sitter_lxq() -> *const ();
}

/// Random shows.
const SHOWS: usize = 20_000;

fn main() {
    // The function is the generated parser's, of the version that the crate reads.
    let language = unsafe { tree_sitter_language::LanguageFn::from_raw(tree_sitter_lxq) };
    let language = Language::new(language);
    let mut parser = Parser::new();
    parser.set_language(&language).expect("the versions fit");
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    for query in ["highlights", "folds", "indents", "outline"] {
        let text = fs::read_to_string(here.join(format!("../queries/{query}.scm"))).expect(query);
        if let Err(error) = Query::new(&language, &text) {
            panic!("{query}: {error}");
        }
    }
    let valid = corpus(&here.join("../../../.."));
    for (name, text) in &valid {
        demand(&mut parser, name, text);
    }
    let statements: Vec<&str> = valid.iter().flat_map(|(_, text)| statements(text)).collect();
    let mut random = Random(7);
    let (mut refused, mut seen, mut both) = (0, 0, 0);
    for i in 0..SHOWS {
        let text = random.show(&statements);
        assert!(is_grammatical(&text), "random show {i} is none:\n{text}");
        demand(&mut parser, &format!("random show {i}"), &text);
        // One word less: a text with errors mostly has an erroneous tree too.
        let less = random.less(&text);
        let (own, tree) = (!is_grammatical(&less), has_error(&mut parser, &less));
        refused += usize::from(own);
        seen += usize::from(tree);
        both += usize::from(own && tree);
    }
    println!(
        "{} sheets, {} statements, {SHOWS} random shows: no errors\n\
         with a word less: {refused} have no sense to the language, {seen} no tree, {both} neither",
        valid.len(),
        statements.len()
    );
    if std::env::args().any(|word| word == "--write") {
        write(&here.join("../src"));
    }
}

/// The parser as editors compile it.
fn write(to: &Path) {
    let made = Path::new(env!("LXQ_PARSER"));
    let from = made.parent().expect("it is in a folder");
    fs::create_dir_all(to.join("tree_sitter")).expect("a folder");
    let headers = ["alloc.h", "array.h", "parser.h"].map(|name| format!("tree_sitter/{name}"));
    let files = ["parser.c", "grammar.json", "node-types.json"].map(str::to_owned);
    for name in files.iter().chain(&headers) {
        fs::copy(from.join(name), to.join(name)).expect(name);
    }
    println!("wrote {}", to.display());
}

fn has_error(parser: &mut Parser, text: &str) -> bool {
    let tree = parser.parse(text, None).expect("there is a language");
    tree.root_node().has_error()
}

fn demand(parser: &mut Parser, name: &str, text: &str) {
    if has_error(parser, text) {
        let tree = parser.parse(text, None).expect("there is a language");
        panic!("{name} has errors:\n{text}\n{}", tree.root_node().to_sexp());
    }
}

/// True when the language accepts a text, whatever its names mean.
fn is_grammatical(text: &str) -> bool {
    let (mut cache, mut sources) = (LoweringCache::default(), Sources::default());
    let files = Memory::default();
    let read = lang::parse_again(&mut cache, &files, &mut sources, "s.lxq", text);
    let mut codes = read.diagnostics.iter().map(|diagnostic| diagnostic.code);
    !codes.any(|code| ["E004", "E005", "E006", "E007"].contains(&code))
}

fn is_valid(text: &str) -> bool {
    let (mut cache, mut sources) = (LoweringCache::default(), Sources::default());
    let files = Memory::default();
    let read = lang::parse_again(&mut cache, &files, &mut sources, "s.lxq", text);
    read.show.is_some() && !text.trim().is_empty()
}

/// Sheets that the language reads: files, blocks of the manual, texts in Rust.
fn corpus(root: &Path) -> Vec<(String, String)> {
    let mut files = Vec::new();
    for folder in ["examples", "tests", "grammar", "src"] {
        walk(&root.join(folder), &mut files);
    }
    let mut out = Vec::new();
    for file in files {
        let name = file.display().to_string();
        let text = fs::read_to_string(&file).unwrap_or_default();
        let texts: Vec<String> = match file.extension().and_then(|e| e.to_str()) {
            Some("lxq") => vec![text],
            Some("md") => {
                let blocks = text.split("```lxq").skip(1);
                let block = |block: &str| block.split("```").next().unwrap_or("").to_owned();
                blocks.map(|b| block(b.split_once('\n').unwrap_or_default().1)).collect()
            }
            Some("rs") => literals(&text),
            _ => continue,
        };
        out.extend(texts.into_iter().filter(|text| is_valid(text)).map(|text| (name.clone(), text)));
    }
    assert!(out.len() > 100, "{} sheets were found", out.len());
    out
}

fn walk(folder: &Path, out: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        match path.is_dir() {
            true if !path.ends_with("target") => walk(&path, out),
            true => {}
            false => out.push(path),
        }
    }
}

/// Texts of a Rust file that are long enough to be sheets.
fn literals(code: &str) -> Vec<String> {
    let mut out = Vec::new();
    let mut rest = code;
    while let Some(at) = rest.find('"') {
        let mut text = String::new();
        let mut chars = rest[at + 1..].char_indices();
        let end = loop {
            let Some((i, c)) = chars.next() else {
                return out;
            };
            match c {
                '"' => break i,
                '\\' => match chars.next() {
                    Some((_, 'n')) => text.push('\n'),
                    Some((_, 't')) => text.push('\t'),
                    Some((_, '\n')) => {
                        let mut ahead = chars.clone();
                        while ahead.next().is_some_and(|(_, c)| c.is_whitespace()) {
                            chars.next();
                        }
                    }
                    Some((_, c)) => text.push(c),
                    None => return out,
                },
                c => text.push(c),
            }
        };
        rest = &rest[at + 1 + end + 1..];
        if text.len() > 12 {
            out.push(text);
        }
    }
    out
}

fn statements(text: &str) -> Vec<&str> {
    let all = lang::outline(text).into_iter();
    all.filter_map(|statement| text.get(statement.range)).collect()
}

/// Numbers that look random, the same at every run (Lehmer's generator).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        (self.0 % n.max(1) as u64) as usize
    }

    /// Some statements, with other blanks and comments between their words.
    fn show(&mut self, statements: &[&str]) -> String {
        let mut out = String::new();
        for _ in 0..1 + self.below(6) {
            let statement = statements[self.below(statements.len())];
            let mut at = 0;
            for (range, _) in lang::tokens(statement) {
                let gap = &statement[at..range.start];
                out += gap;
                // Without a blank two words may be one; `steps` may be the unit of a number.
                if !gap.is_empty() && &statement[range.clone()] != "steps" {
                    out += ["", " ", "\n  ", " /* a { \" */ ", " // b }\n  ", "\t"][self.below(6)];
                }
                out += &statement[range.clone()];
                at = range.end;
            }
            out += "\n";
        }
        out
    }

    /// A text without one of its words.
    fn less(&mut self, text: &str) -> String {
        let tokens = lang::tokens(text);
        let (range, _) = &tokens[self.below(tokens.len())];
        format!("{} {}", &text[..range.start], &text[range.end..])
    }
}
