//! Bad input gets a quick answer without a panic: arbitrary text, real shows with random damage,
//! files that are large, deep, binary or empty.

use footlight_show::check::check;
use footlight_show::diagnostic::{Sources, Style, WARNINGS, render};
use footlight_show::lang;
use footlight_show::lang::edit::{self, Edit};
use proptest::prelude::*;

const SHOWS: [&str; 2] = [
    include_str!("../../examples/figure4/figure4.lxq"),
    include_str!("../../examples/first.lxq"),
];

/// Parses, checks the invariants of any result, and renders it in every style.
fn answered(text: &str) -> Vec<&'static str> {
    let mut sources = Sources::default();
    let parsed = lang::parse(&mut sources, "any.lxq", text);
    let codes: Vec<&'static str> = parsed.diagnostics.iter().map(|d| d.code).collect();
    let failed = codes.iter().any(|c| c.starts_with('E'));
    assert_eq!(parsed.show.is_none(), failed);
    for label in parsed.diagnostics.iter().flat_map(|d| &d.labels) {
        let (_, text) = sources.get(label.file).unwrap();
        assert!(
            text.get(label.span.clone()).is_some(),
            "{label:?} is no piece of the text"
        );
    }
    for style in [Style::Plain, Style::Colour, Style::Short, Style::Json] {
        let shown = render(&parsed.diagnostics, &sources, style);
        // No rule of the grammar has a name that a user should see.
        assert!(!shown.contains("kw_") && !shown.contains("_statement"));
    }
    codes
}

/// Tokens of the grammar, so that random text gets beyond the first word.
fn piece() -> impl Strategy<Value = String> {
    let words = prop::sample::select(vec![
        "show",
        "preview",
        "haze",
        "stage",
        "light",
        "bank",
        "look",
        "cue",
        "curve",
        "spot",
        "panel",
        "like",
        "at",
        "aim",
        "beam",
        "field",
        "spline",
        "bezier",
        "hermite",
        "via",
        "slope",
        "part",
        "time",
        "up",
        "delay",
        "follow",
        "hang",
        "blackout",
        "repeat",
        "lamps",
        "l1",
        "{",
        "}",
        "=",
        "+",
        ",",
        "\n",
        "\n  ",
        " ",
        "\"",
        "//",
        "/*",
        "*/",
        "#203060",
        "2700 K",
        "5",
        "0:04",
        "85%",
        "1e9",
        "-3",
        "1200 cd",
        "99999999999999999999",
        ".",
        "照",
        "\u{0}",
        "\t",
        "\r\n",
    ]);
    prop_oneof![8 => words.prop_map(str::to_owned), 1 => ".{0,3}"]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_text_is_answered(text in ".{0,200}") {
        answered(&text);
        let _ = lang::statement_complete(&text);
    }

    #[test]
    fn arbitrary_words_are_answered(words in prop::collection::vec(piece(), 0..60)) {
        let text = words.join(" ");
        answered(&text);
        // An accepted edit keeps every byte around it.
        if let Ok(edited) = edit::apply(SHOWS[1], &Edit::Declare(text)) {
            prop_assert!(edited.source.len() + 4096 > SHOWS[1].len());
        }
    }

    #[test]
    fn damaged_shows_are_answered(
        show in 0..SHOWS.len(),
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 0..12_usize, piece()), 1..5),
    ) {
        let mut chars: Vec<char> = SHOWS[show].chars().collect();
        for (at, remove, insert) in cuts {
            let at = at.index(chars.len());
            let end = (at + remove).min(chars.len());
            chars.splice(at..end, insert.chars());
        }
        answered(&chars.into_iter().collect::<String>());
    }

    /// Inserting a new cue and deleting it again restores the bytes; so does replacing a
    /// declaration by itself.
    #[test]
    fn edits_keep_every_other_byte(show in 0..SHOWS.len(), thousandths in 5_001..9_999_999_u32) {
        let source = SHOWS[show];
        let number = footlight_show::units::CueNumber::from_thousandths(thousandths).unwrap();
        let declared = |source, text: &str| edit::apply(source, &Edit::Declare(text.to_owned())).unwrap().source;
        let added = declared(source, &format!("cue {number} {{ blackout }}"));
        prop_assert_eq!(added.len(), source.len() + format!("cue {number} {{ blackout }}\n").len());
        let removed = edit::apply(&added, &Edit::Remove(format!("cue {number}"))).unwrap();
        prop_assert_eq!(removed.source, source);
        let one = &source[edit::locate(source, "cue 1").unwrap()];
        prop_assert_eq!(declared(source, one), source);
    }
}

#[test]
#[ignore = "slow"]
fn large_and_deep_files_are_answered() {
    let megabytes = 10 << 20;
    for (text, code) in [
        ("[".repeat(megabytes), "E002"),
        ("{".repeat(megabytes), "E002"),
        ("cue 1 { part 2 ".repeat(megabytes / 15), "E002"),
        ("}".repeat(megabytes), "E005"),
        ("x\n".repeat(megabytes / 2), "E006"),
        ("cue\n".repeat(megabytes / 4), "E007"),
        ("\"".repeat(megabytes), "E002"),
        ("\"a\n".repeat(megabytes / 3), "E004"),
        ("/* ".repeat(megabytes / 3), "E004"),
        (format!("cue 1 {{ {} }}", "a ".repeat(300_000)), "E010"),
        (
            format!("curve c = linear {}", "0 0, ".repeat(150_000)),
            "E007",
        ),
        ("a".repeat(17 << 20), "E002"),
    ] {
        let codes = answered(&text);
        assert!(codes.contains(&code), "{:?}: {codes:?}", &text[..20]);
    }
}

#[test]
fn what_a_group_multiplies_is_bounded() {
    use std::fmt::Write;
    let mut text = String::from("light l panel m\n");
    let names: Vec<String> = (0..5_000).map(|i| format!("b{i}")).collect();
    for name in &names {
        writeln!(text, "bank {name} = l").unwrap();
    }
    for cue in 1..=2_000 {
        writeln!(text, "cue {cue} {{ blackout }}").unwrap();
    }
    assert_eq!(answered(&text), ["E002"]);
}

#[test]
fn a_long_chain_costs_no_stack() {
    use std::fmt::Write;
    let mut text = String::from("show \"chain\"\nbank b = l50000\n");
    for i in (1..=50_000).rev() {
        writeln!(text, "light l{i} like l{}\nlook k{i} = k{}", i - 1, i - 1).unwrap();
    }
    text += "light l0 panel m\nlook k0 { b 5 }\ncue 1 { k50000 }\n";
    let parsed = lang::parse(&mut Sources::default(), "chain.lxq", &text);
    assert_eq!(parsed.show.unwrap().looks[0].levels, [(0, 0.05)]);
}

#[test]
fn what_is_not_text_is_said_to_be_so() {
    for (bytes, what) in [
        (&b"show \"a\"\n\0\0"[..], "line 2"),
        (b"\xff\xfe", "line 1"),
        (b"show \"\n\n\xe9t\xe9\"", "line 3"),
    ] {
        let error = lang::decode("a.lxq", bytes).unwrap_err();
        assert_eq!(error.code, "E001");
        assert!(error.help[0].contains(what), "{:?}", error.help);
    }
    let text = lang::decode("a.lxq", b"\xef\xbb\xbfshow \"a\"").unwrap();
    assert_eq!(text, "show \"a\"");
}

/// A flood of warnings is counted, and the first are kept.
#[test]
fn of_many_warnings_the_first_are_kept_and_the_rest_counted() {
    let light = |i| format!("light l{i} spot at 0,0,3 aim 0,0,0 beam 20 field 30 900 cd\n");
    let text: String = (0..3 * WARNINGS).map(light).collect();
    let parsed = lang::parse(&mut Sources::default(), "many.lxq", &text);
    assert_eq!(parsed.diagnostics.len(), WARNINGS);
    assert_eq!(parsed.left_out, 2 * WARNINGS);
    let starts = parsed.diagnostics.iter().map(|d| d.labels[0].span.start);
    let last = text.find(&format!("light l{WARNINGS} ")).unwrap();
    assert!(starts.clone().is_sorted() && starts.max() < Some(last));

    // Warnings from curves: each of these cues except the first changes nothing.
    let cue = |i| format!("cue {i} {{ b 50 }}\n");
    let cues: String = (1..=2 * WARNINGS).map(cue).collect();
    let text = format!("{}bank b = l0\n{cues}", light(0));
    let parsed = lang::parse(&mut Sources::default(), "still.lxq", &text);
    let checked = check(&parsed.show.unwrap(), &parsed.spans);
    assert_eq!(checked.diagnostics.len(), WARNINGS);
    assert_eq!(checked.left_out, WARNINGS - 1);
}
