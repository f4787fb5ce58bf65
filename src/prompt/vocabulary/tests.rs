use std::collections::BTreeMap;

use super::*;

fn vocabulary() -> Vocabulary {
    let own = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
    Vocabulary {
        declared: vec![
            ("bank", own(&["lamps", "late"])),
            ("group", own(&["warm"])),
            ("look", own(&["night"])),
            ("light", own(&["lamp1", "moon"])),
            ("curve", own(&["dawn"])),
            ("effect", own(&["candle"])),
            ("view", own(&["stalls"])),
            ("let", own(&["slow"])),
        ],
        cues: own(&["1", "12"]),
        next_cue: Some("13".to_owned()),
        gels: own(&["L201"]),
        materials: own(&["boards"]),
    }
}

const IN_A_CUE: &[&str] = &[
    "assert", "blackout", "block", "cueonly", "curve", "delay", "down", "follow", "hang", "lamps",
    "late", "night", "note", "part", "repeat", "snap", "time", "up", "warm",
];

#[track_caller]
fn offers(line: &str, words: &[&str]) {
    let found = vocabulary().complete(line, line.len());
    assert_eq!(found.words, words, "{line}");
}

#[test]
fn words_are_offered_where_they_may_stand() {
    offers("pla", &["plan", "play"]);
    offers("pict", &["picture"]);
    offers("vi", &["view"]);
    offers("view s", &["stalls"]);
    offers("goto 1", &["12"]);
    offers("cue 3 { time 5m", &["5ms"]);
    offers("help pi", &["picture"]);
    offers(
        "explain E01",
        &["E010", "E011", "E012", "E013", "E014", "E015", "E016"],
    );
    offers("picture --ba", &["--bank"]);
    offers("picture --bank la", &["lamps", "late"]);
    offers("cue 3 { la", &["lamps", "late"]);
    offers("cue 3 { lamps 85 cu", &["cueonly", "curve"]);
    offers("cue 3 { lamps be", &["bezier"]);
    offers("cue 3 { be", &[]);
    offers("cue 3 { lamps 60 effect ", &["candle", "none"]);
    offers("cue 3 { time 5 ", IN_A_CUE);
    offers("cue 3 \"Ev", &[]);
    offers("light k spot at 1", &["1cm", "1ft", "1in", "1m", "1mm"]);
    offers("light k spot at 1, 2, 3 b", &["beam"]);
    offers(
        "view stalls from 0, 0, 0 ",
        &["fov", "from", "lens", "roll", "size", "to"],
    );
    offers("haze 60", &["60/m", "60ft", "60m"]);
    offers("haze 60m ", &["albedo", "forward"]);
    offers("haze 60m albedo 0.9", &[]);
    offers("haze 0.05/m f", &["forward"]);
    offers("stage \"a.obj\" ma", &["matt"]);
    offers("surface boards g", &["gloss"]);
    offers("surface boards gloss 0.2", &[]);
    offers("preview { t", &["tolerance", "tone"]);
    offers("preview { tone ", &["filmic", "plain"]);
    offers("preview { gap ", &[]);
    offers("cue 2 { lamps gel ", &["L201"]);
    offers("look dusk { ", &["lamps", "late", "warm"]);
    offers("set n", &["night"]);
    offers("set lamps f", &["full"]);
    offers("set lamps 50 f", &[]);
    offers("set lamps 50% warm f", &["full"]);
    offers("cue 3 { lamps 3200K f", &["follow", "full"]);
    offers("goto 12 ", &["at"]);
    offers("view stalls ", &[]);
    offers("copy cue 1 ", &["to"]);
    offers("delete cue 1", &["12"]);
    offers("stop ", &["now"]);
    offers("pool drop ", &["all", "unused"]);
    offers("refine ", &["&", "for", "until"]);
    offers("cue 3 { lamps 5 curve d", &["dawn"]);
    offers("cue 3 { time (sl", &["slow"]);
    offers("bank x = m", &["moon"]);
    offers("light k like la", &["lamp1"]);
    offers("light k panel bo", &["boards"]);
    offers("set wa", &["warm"]);
    offers("plot la", &["lamps", "late"]);
    offers("plot sp", &["spectrum"]);
    offers("solve a.png la", &["lamps", "late"]);
    offers("solve a.png lamps --cu", &["--cue"]);
    assert!(vocabulary().complete("picture -o ", 11).files);
    assert!(vocabulary().complete("save ", 5).files);
    assert!(vocabulary().complete("solve sk", 8).files);
    assert_eq!(vocabulary().complete("bank é = m", 11).start, 10);
}

/// Every word of these shows is offered in its place once its first letter is typed; and the
/// grammar accepts every word offered.
#[test]
fn every_word_of_a_show_is_offered_in_its_place_and_none_that_cannot_stand() {
    let tavern = include_str!("../../../examples/tavern/tavern.lxq");
    let first = include_str!("../../../examples/first.lxq");
    for text in [tavern, first] {
        let mut sources = footlight_show::diagnostic::Sources::default();
        let show = lang::parse(&mut sources, "show.lxq", text).show.unwrap();
        let values = lang::values(text);
        let words: Vec<&str> = text.split_whitespace().collect();
        let named = words
            .windows(2)
            .filter(|w| ["panel", "surface"].contains(&w[0]));
        let materials = named.map(|w| w[1].to_owned()).collect();
        let vocabulary = Vocabulary::named(&show, values, materials);
        let known: Vec<&str> = lang::words()
            .into_iter()
            .chain(vocabulary.names())
            .collect();
        // Eight of a kind.
        let mut seen = BTreeMap::new();
        for statement in statements(text) {
            let kind = statement.split_whitespace().next().unwrap().to_owned();
            let count: &mut usize = seen.entry(kind).or_default();
            *count += 1;
            if *count <= 8 {
                goes_on(&vocabulary, &known, &statement);
            }
        }
    }
}

/// The statements of a text without its comments.
fn statements(text: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for line in text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
    {
        match (
            line.starts_with(|c: char| c.is_ascii_lowercase()),
            out.last_mut(),
        ) {
            (false, Some(last)) => *last = format!("{last}\n{line}"),
            _ => out.push(line.to_owned()),
        }
    }
    out.retain(|statement| !statement.trim().is_empty());
    out
}

fn goes_on(vocabulary: &Vocabulary, known: &[&str], statement: &str) {
    let is_start = |(at, _): &(usize, char)| {
        let before = &statement[..*at];
        before.ends_with(|c: char| c.is_whitespace() || "(){},=+".contains(c))
            && before.trim().contains(char::is_whitespace)
            && before.matches('"').count().is_multiple_of(2)
    };
    for (at, letter) in statement.char_indices().filter(is_start) {
        let rest = &statement[at..];
        let end = rest.find(|c: char| c.is_whitespace() || "(){},=+".contains(c));
        let word = &rest[..end.unwrap_or(rest.len())];
        let before = &statement[..at];
        if known.contains(&word) && word.len() > 1 {
            let line = format!("{before}{letter}");
            let found = vocabulary.complete(&line, line.len()).words;
            assert!(
                found.iter().any(|f| f == word),
                "{line}: {word} is not in {found:?}"
            );
        }
        let beginning = lang::Beginning::of(before).unwrap();
        for offered in vocabulary.complete(before, before.len()).words {
            assert!(beginning.takes(&offered), "{before}{offered}");
        }
    }
}

#[test]
fn a_verb_hints_at_its_usage() {
    let found = vocabulary();
    assert_eq!(found.hint("goto ").as_deref(), Some("CUE [at PART%]"));
    assert_eq!(found.hint("goto"), None);
    assert_eq!(found.hint("go "), None);
}
