//! The usage of a verb, `at [TIME | cue N [+ TIME]]`, from clap's command, and the words that may
//! follow those typed. Words in capitals are placeholders; a word with `…` may repeat.

use std::collections::BTreeSet;

use clap::{Arg, Command};

/// The usage of a verb in one line.
pub fn of(verb: &Command) -> String {
    let mut out = vec![verb.get_name().to_owned()];
    out.extend(
        verb.get_arguments()
            .filter(|a| a.is_positional())
            .map(words),
    );
    let options = verb.get_arguments().filter(|a| !a.is_positional());
    out.extend(options.map(|option| {
        let name = match option.get_short() {
            Some(letter) => format!("-{letter}"),
            None => format!("--{}", option.get_long().unwrap_or_default()),
        };
        let text = format!("{name} {}", value(option)).trim_end().to_owned();
        optional(option, text)
    }));
    out.join(" ")
}

/// Usage of a verb's positional words: `[TIME | cue N [+ TIME]]`.
pub fn words(argument: &Arg) -> String {
    let known = argument.get_possible_values();
    let known: Vec<&str> = known.iter().map(|known| known.get_name()).collect();
    if !known.is_empty() {
        return optional(argument, known.join(" | "));
    }
    let names = argument.get_value_names().unwrap_or_default().iter();
    let words: Vec<String> = names.map(|n| optional(argument, n.to_string())).collect();
    words.join(" ")
}

/// The name of an option's value; empty for a switch.
pub fn value(option: &Arg) -> String {
    let takes_values = option.get_action().takes_values();
    let names = option.get_value_names().filter(|_| takes_values);
    let may_stand_alone = option.get_num_args().is_some_and(|n| n.min_values() == 0);
    match names.unwrap_or_default().first() {
        Some(name) if may_stand_alone => format!("[{name}]"),
        Some(name) => name.to_string(),
        None => String::new(),
    }
}

fn optional(argument: &Arg, text: String) -> String {
    if argument.is_required_set() {
        text
    } else {
        format!("[{text}]")
    }
}

/// An example line for the prompt.
pub fn example(verb: &Command) -> String {
    verb.get_after_help()
        .map(ToString::to_string)
        .unwrap_or_default()
}

/// Words of `usage` that may follow `typed`.
pub fn next<'u>(usage: &'u str, typed: &[&str]) -> BTreeSet<&'u str> {
    let mut out = BTreeSet::new();
    for sequence in sequences(&mut pieces(usage).into_iter()) {
        if let Some(word) = behind(&sequence, typed) {
            out.insert(word.trim_end_matches('…'));
        }
    }
    out
}

/// Splits a usage into brackets, bars and words.
fn pieces(usage: &str) -> Vec<&str> {
    let words = usage.split_whitespace();
    let apart = words.flat_map(|word| word.split_inclusive('['));
    let mut out = Vec::new();
    for piece in apart {
        let word = piece.trim_end_matches(']');
        out.extend((!word.is_empty()).then_some(word));
        out.extend(
            piece
                .get(word.len()..)
                .unwrap_or_default()
                .split_inclusive(']'),
        );
    }
    out
}

/// All sequences that a usage allows, up to its closing bracket.
fn sequences<'u>(pieces: &mut impl Iterator<Item = &'u str>) -> Vec<Vec<&'u str>> {
    let mut done = Vec::new();
    let mut current = vec![Vec::new()];
    while let Some(piece) = pieces.next() {
        match piece {
            "]" => break,
            "|" => done.append(&mut std::mem::replace(&mut current, vec![Vec::new()])),
            "[" => {
                let inner = sequences(pieces);
                let with = |start: &Vec<&'u str>| -> Vec<Vec<&'u str>> {
                    let ends = inner.iter();
                    ends.map(|end| [start.as_slice(), end].concat()).collect()
                };
                let longer: Vec<_> = current.iter().flat_map(with).collect();
                current.extend(longer);
            }
            word => current.iter_mut().for_each(|sequence| sequence.push(word)),
        }
    }
    done.append(&mut current);
    done
}

/// The word of a sequence after `typed`, if that is its beginning.
fn behind<'u>(sequence: &[&'u str], typed: &[&str]) -> Option<&'u str> {
    let mut words = sequence.iter().copied();
    let mut word = words.next();
    for token in typed {
        let fits = word?.contains(char::is_uppercase) || word? == *token;
        if !fits {
            return None;
        }
        if !word?.ends_with('…') {
            word = words.next();
        }
    }
    word
}

#[cfg(test)]
mod tests {
    use super::next;

    #[test]
    fn a_usage_says_what_follows() {
        let follows = |usage, typed: &[&str], wanted: &[&str]| {
            let found: Vec<&str> = next(usage, typed).into_iter().collect();
            assert_eq!(found, wanted, "{usage}: {typed:?}");
        };
        let at = "[TIME | cue N [+ TIME]]";
        follows(at, &[], &["TIME", "cue"]);
        follows(at, &["cue"], &["N"]);
        follows(at, &["cue", "5"], &["+"]);
        follows(at, &["cue", "5", "+"], &["TIME"]);
        follows(at, &["0:05"], &[]);
        follows("[drop [unused | all]]", &["drop"], &["all", "unused"]);
        follows("[BANK… | rig]", &["lamps", "sky"], &["BANK"]);
        follows("[N | until X | for TIME] [&]", &["3"], &["&"]);
        follows(
            "[N | until X | for TIME] [&]",
            &[],
            &["&", "N", "for", "until"],
        );
        follows("", &[], &[]);
    }
}
