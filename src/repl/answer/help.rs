//! What verbs and declarations are, in words.

use std::fmt::Write as _;

use crate::lang;
use crate::repl::{Call, DECLARATIONS, Declaration, Error, Repl, Reply, VERBS, find};

pub fn help(_: &mut Repl, call: &Call) -> Result<Reply, Error> {
    match call.words().into_iter().next() {
        Some(name) => Ok(Reply::text(of(name)?)),
        None => Ok(Reply::text(all())),
    }
}

/// What a verb or a declaration is, in words.
pub fn of(name: &str) -> Result<String, Error> {
    let declared = DECLARATIONS.iter().find(|d| d.word() == name);
    let spec = match (find(name), declared) {
        (Err(_), Some(declared)) => return Ok(of_declaration(declared)),
        (found, _) => found?,
    };
    let mut text = format!("{}\n  {}\n", spec.usage(), spec.about);
    for option in spec.options {
        let name = match option.letter {
            Some(letter) => format!("-{letter}, --{}", option.name),
            None => format!("--{}", option.name),
        };
        let name = format!("{name} {}", option.value.unwrap_or_default());
        let _ = writeln!(text, "  {name:<22} {}", option.about);
    }
    let _ = write!(text, "example: {}", spec.example);
    if let Some(declared) = declared {
        let _ = write!(text, "\n\n{}", of_declaration(declared));
    }
    Ok(text)
}

fn all() -> String {
    let mut text = String::from("verbs\n");
    for spec in VERBS {
        let _ = writeln!(text, "  {:<11} {}", spec.name, spec.about);
    }
    let _ = write!(
        text,
        "\nDeclarations change the show: {}.\n\
         One replaces what has its kind and name, as a whole;\n\
         `show cue 2` prints the text to edit.\n\
         `help WORD` tells more of a verb or a declaration.",
        wrapped(lang::keywords())
    );
    text
}

fn of_declaration(declared: &Declaration) -> String {
    let Declaration {
        usage,
        about,
        example,
        ..
    } = declared;
    format!("{usage}\n  {about}\nexample: {example}")
}

/// Words in lines of at most 72 letters.
fn wrapped(words: &[&str]) -> String {
    let mut out = String::new();
    let mut length = 31;
    for (i, word) in words.iter().enumerate() {
        if i > 0 {
            out.push(',');
            length += word.len() + 2;
            out.push_str(if length > 72 { "\n  " } else { " " });
            length = if length > 72 { word.len() + 2 } else { length };
        }
        out.push_str(word);
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_list_of_verbs_fits_80_columns() {
        for line in super::all().lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }
}
