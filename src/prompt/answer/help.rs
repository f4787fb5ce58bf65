//! Help on verbs and declarations.

use std::fmt::Write as _;

use clap::{Args, Command};

use crate::error::Error;
use crate::refusal::find;
use crate::repl::Reply;
use crate::usage;
use footlight_show::lang;

/// The word to explain.
#[derive(Args, Clone, Debug)]
pub struct HelpArgs {
    #[arg(value_name = "VERB")]
    word: Option<String>,
}

pub fn help(verbs: &Command, asked: &HelpArgs) -> Result<Reply, Error> {
    Ok(Reply::text(match &asked.word {
        Some(word) => of(verbs, word)?,
        None => all(verbs),
    }))
}

/// Help on a verb or a declaration.
pub fn of(verbs: &Command, name: &str) -> Result<String, Error> {
    let declared = of_statement(name);
    let verb = match (find(verbs, name), declared.is_empty()) {
        (Err(_), false) => return Ok(declared),
        (found, _) => found?,
    };
    let has_options = verb
        .get_arguments()
        .any(|argument| !argument.is_positional());
    let options = if has_options { "{options}\n" } else { "" };
    let template = format!("{}\n  {{about}}\n{options}", usage::of(verb));
    let help = verb.clone().help_template(template).render_help();
    let mut text = format!("{help}example: {}", usage::example(verb));
    if !declared.is_empty() {
        let _ = write!(text, "\n\n{declared}");
    }
    Ok(text)
}

fn about(verb: &Command) -> String {
    verb.get_about()
        .map(ToString::to_string)
        .unwrap_or_default()
}

/// The manual of the language, whose tables explain its words.
const MANUAL: &str = include_str!("../../../grammar/README.md");

/// Rows of the manual's tables: the statement of the table, from its heading (``in `cue` ``), the
/// notation, and the other cells.
fn rows() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    let mut of_table = "";
    MANUAL.lines().filter_map(move |line| {
        of_table = match line.strip_prefix("| in `") {
            Some(heading) => heading.split('`').next().unwrap_or_default(),
            None if line.starts_with('|') => of_table,
            None => "",
        };
        let cells = line.strip_prefix("| `")?.strip_suffix(" |")?;
        let (usage, rest) = cells.split_once("` | ")?;
        Some((of_table, usage, rest))
    })
}

/// Notation of a statement, from the manual; empty if none.
fn of_statement(word: &str) -> String {
    let begins = |usage: &str| {
        let rest = usage.strip_prefix(word);
        rest.is_some_and(|rest| rest.starts_with(' '))
    };
    let own = rows().filter(|(of_table, usage, _)| of_table.is_empty() && begins(usage));
    let row = |(_, usage, meaning): (_, &str, &str)| {
        format!("{usage}\n  {}", wrapped(meaning.split(' '), 2))
    };
    own.map(row).collect::<Vec<_>>().join("\n")
}

/// Notation and meaning of a word within a statement, from the manual's tables; `None` if none has
/// it.
pub fn of_word(statement: &str, word: &str) -> Option<(String, String)> {
    let mut best: Option<(u8, &str, &str)> = None;
    for (of_table, usage, rest) in rows() {
        // Rank of a row for the word: the row is of the statement and contains the word, or begins
        // with it. A row of another statement may mean something else.
        let pieces = usage.split("`, `").map(|piece| {
            let mut words = piece.split([' ', '/']);
            let first = words.next().unwrap_or_default();
            let has = first == word || words.any(|other| other == word);
            match has {
                true if first == statement || of_table == statement => 2,
                true if first == word => 1,
                _ => 0,
            }
        });
        let rank = pieces.max().unwrap_or(0);
        if rank > best.map_or(0, |(best, ..)| best) {
            best = Some((rank, usage, rest));
        }
    }
    let (_, usage, rest) = best?;
    let meaning: Vec<&str> = rest
        .split(" | ")
        .map(str::trim)
        .filter(|cell| !cell.is_empty() && *cell != "|")
        .collect();
    Some((usage.replace("`, `", ", "), meaning.join("; ")))
}

fn all(verbs: &Command) -> String {
    let mut text = String::from("verbs\n");
    for verb in verbs.get_subcommands() {
        let _ = writeln!(text, "  {:<11} {}", verb.get_name(), about(verb));
    }
    let _ = write!(
        text,
        "\nDeclarations change the show: {}.\n\
         One replaces what has its kind and name, as a whole;\n\
         `show cue 2` prints the text to edit.\n\
         `help WORD` tells more of a verb or a declaration.",
        wrapped(lang::keywords().join(", ").split(' '), 31)
    );
    text
}

/// Wraps words to lines of at most 76 letters; the first line already has `length`.
pub(super) fn wrapped<'w>(words: impl Iterator<Item = &'w str>, mut length: usize) -> String {
    let mut out = String::new();
    for word in words {
        let width = word.chars().count() + 1;
        length += width;
        if length > 76 {
            out.push_str("\n  ");
            length = width + 2;
        } else if !out.is_empty() {
            out.push(' ');
        }
        out.push_str(word);
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn words_are_explained_by_the_row_that_is_nearest() {
        let of = |statement, word| super::of_word(statement, word).unwrap();
        assert_eq!(of("preview", "gap").1, "`5`; the assumed wait before a GO");
        assert_eq!(of("cue", "follow").0, "follow T");
        assert!(of("light", "spot").0.starts_with("light NAME spot"));
        assert!(of("view", "fov").0.starts_with("view NAME from"));
        assert!(of("cue", "snap").1.contains("`snap` is `time 0`"));
        assert!(of("cue", "effect").0.contains("LEVEL effect E"));
        assert!(of("effect", "rate").1.contains("times a second"));
        assert!(of("preview", "rate").1.contains("frames"));
        assert!(of("bank", "square").1.contains("25 %"));
        assert_eq!(super::of_word("cue", "no_word_of_it"), None);
    }

    #[test]
    fn every_word_of_the_language_is_explained() {
        let words = footlight_show::lang::words();
        let keywords = footlight_show::lang::keywords();
        let is_explained = |word: &&str| {
            let mut of = keywords.iter();
            of.any(|statement| super::of_word(statement, word).is_some())
        };
        // `dither` is parsed to report that it was removed.
        let removed = ["dither", "on", "off"];
        let words = words.iter().filter(|word| !removed.contains(word));
        let missing: Vec<_> = words.filter(|word| !is_explained(word)).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn every_statement_is_explained() {
        for word in footlight_show::lang::keywords() {
            assert!(!super::of_statement(word).is_empty(), "{word}");
        }
        let look = super::of(crate::verbs(), "look").unwrap();
        assert!(
            look.starts_with("look NAME { LEVELS }\n  levels with a name"),
            "{look}"
        );
    }

    #[test]
    fn the_list_of_verbs_fits_80_columns() {
        for line in super::all(crate::verbs()).lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }
}
