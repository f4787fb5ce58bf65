//! The grammars for editors know exactly the words and units of the grammar.

use std::collections::BTreeSet;
use std::fs;

use footlight_show::lang;

fn read(path: &str) -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    fs::read_to_string(format!("{root}/grammar/{path}")).unwrap()
}

/// Keywords of the grammar: in quotes before `!word_char`.
fn of_grammar() -> BTreeSet<String> {
    let text = read("lxq.pest");
    let rules = text
        .split("\n")
        .filter(|line| !line.trim_start().starts_with("//"));
    let rules: String = rules.collect::<Vec<_>>().join(" ");
    let mut words = BTreeSet::new();
    for before in rules.split("!word_char") {
        let from = before.rfind('=').map_or(0, |at| at);
        let quoted = before[from..].split('"').skip(1).step_by(2);
        let is_word = |w: &&str| {
            (w.len() > 1 || ["y", "z"].contains(w))
                && w.chars().all(|c| c.is_ascii_lowercase() || c == '-')
        };
        words.extend(quoted.filter(is_word).map(str::to_owned));
    }
    words
}

/// Words in single quotes in a part of a tree-sitter grammar.
fn of_tree_sitter(text: &str, quote: char) -> BTreeSet<String> {
    let code = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let code: String = code.collect::<Vec<_>>().join("\n");
    let quoted = code.split(quote).skip(1).step_by(2);
    let is_word = |w: &&str| {
        !w.is_empty() && w.chars().all(|c| c.is_ascii_lowercase() || c == '-') && *w != "-"
    };
    quoted.filter(is_word).map(str::to_owned).collect()
}

#[test]
fn the_tree_sitter_grammar_and_its_queries_have_the_words_of_the_grammar() {
    let own = of_tree_sitter(&read("editors/tree-sitter/grammar.js"), '\'');
    let mut wanted = of_grammar();
    wanted.extend(lang::keywords().iter().map(|w| (*w).to_owned()));
    // Part of a colour there.
    wanted.remove("gel");
    // The grammar's own name, and those of its fields.
    let extra: Vec<&String> = own.difference(&wanted).collect();
    assert_eq!(extra, ["label", "lxq", "name", "number"]);
    assert_eq!(wanted.difference(&own).next(), None);
    let photometric = read("lxq.pest");
    let photometric = photometric.split("photometric_unit = _{ (").nth(1).unwrap();
    let units = photometric
        .split(')')
        .next()
        .unwrap()
        .split('"')
        .skip(1)
        .step_by(2);
    let grammar = read("editors/tree-sitter/grammar.js");
    for unit in units.filter(|unit| *unit != "cd/m2") {
        assert!(grammar.contains(&format!("'{unit}'")), "{unit}");
    }
    assert!(grammar.contains("'cd', token.immediate('/m2')"));
    let coloured = of_tree_sitter(&read("editors/tree-sitter/queries/highlights.scm"), '"');
    let named = ["cd", "lm", "snap", "blackout", "block"].map(str::to_owned);
    let mut left: BTreeSet<&String> = wanted.difference(&coloured).collect();
    left.retain(|word| !named.contains(word));
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn the_textmate_grammar_has_the_words_of_the_grammar() {
    let text = read("editors/vscode/syntaxes/lxq.tmLanguage.json");
    let colours: serde_json::Value = serde_json::from_str(&text).unwrap();
    let patterns = colours["repository"]["all"]["patterns"].as_array().unwrap();
    let words = |name: &str| -> BTreeSet<String> {
        let own = patterns.iter().find(|p| p["name"] == name).unwrap();
        let own = own["match"].as_str().unwrap();
        let list = own.rsplit_once("(?!").unwrap().0;
        let list = list.rsplit_once('(').unwrap().1.trim_end_matches(')');
        list.split('|').map(str::to_owned).collect()
    };
    let statements: BTreeSet<String> = lang::keywords().iter().map(|w| (*w).to_owned()).collect();
    assert_eq!(words("keyword.control.lxq"), statements);
    let units = ["cd", "lm"].map(str::to_owned);
    let mut wanted = of_grammar();
    assert!(wanted.len() > 60, "{wanted:?}");
    wanted.retain(|word| !statements.contains(word) && !units.contains(word));
    assert_eq!(words("keyword.other.lxq"), wanted);
    let number = patterns
        .iter()
        .find(|p| p["name"] == "constant.numeric.lxq");
    let number = number.unwrap()["match"].as_str().unwrap();
    let photometric = read("lxq.pest");
    let photometric = photometric.split("photometric_unit = _{ (").nth(1).unwrap();
    let photometric = photometric.split(')').next().unwrap();
    for unit in photometric.split('"').skip(1).step_by(2) {
        assert!(number.contains(unit), "{unit}");
    }
}
