//! Single edits, and properties of every edit of the shipped shows.
use proptest::prelude::*;

use super::*;
use crate::diagnostic::Sources;
use crate::lang::parse_with_files;
use crate::model::{Motion, Show};
use crate::units::Time;
use footlight_host::files::Memory;

const SHOW: &str = "// top\nshow \"A\"\n\nbank a = x  // one\nbank b = y /* two\n lines */\n\n// the cues\ncue 1 { a 5 }\n  cue 3 {\n    a 6 // six\n  } // three\n";

fn edited(source: &str, edit: Edit) -> EditedText {
    apply(source, &edit).unwrap()
}

fn message(source: &str, edit: Edit) -> String {
    let error = apply(source, &edit).unwrap_err().remove(0);
    assert!(error.labels.is_empty());
    format!(
        "{}: {}; {}",
        error.code,
        error.message,
        error.help.join("; ")
    )
}

fn number(text: &str) -> CueNumber {
    CueNumber::parse(text).unwrap()
}

fn applied(source: &str, statement: &str) -> String {
    edited(source, Edit::Declare(statement.to_owned())).source
}

#[test]
fn a_declaration_replaces_its_namesake_in_place() {
    assert_eq!(
        applied(SHOW, "bank a = z channel 4"),
        SHOW.replace("bank a = x", "bank a = z channel 4")
    );
    let two = declare(SHOW, " show \"B\"\ncue 3.0 {\n a 7\n}\n").unwrap();
    let expected = SHOW
        .replace("show \"A\"", "show \"B\"")
        .replace("cue 3 {\n    a 6 // six\n  }", "cue 3.0 {\n   a 7\n  }");
    assert_eq!(two.source, expected);
    assert!(two.changes.iter().all(|c| c.action == Action::Replaced));
    assert_eq!(two.changes[1].what(), "cue 3");
}

#[test]
fn a_new_declaration_goes_after_its_kind_and_a_cue_into_its_order() {
    let after = |line: &str, new: &str| SHOW.replace(line, &format!("{line}{new}"));
    assert_eq!(
        applied(SHOW, "bank c = z"),
        after(" lines */\n", "bank c = z\n")
    );
    assert_eq!(
        applied(SHOW, "cue 2 { }"),
        after("cue 1 { a 5 }\n", "cue 2 { }\n")
    );
    assert_eq!(
        applied(SHOW, "cue 9 { }"),
        after("// three\n", "cue 9 { }\n")
    );
    assert_eq!(
        applied(SHOW, "cue 0.5 { }"),
        after("// the cues\n", "cue 0.5 { }\n")
    );
    assert_eq!(
        applied(SHOW, "view v from 0,0,0"),
        after("show \"A\"\n", "view v from 0,0,0\n")
    );
    assert_eq!(applied("", "cue 1 { }"), "cue 1 { }\n");
    assert_eq!(applied("cue 1 { }", "cue 2 { }"), "cue 1 { }\ncue 2 { }");
    assert_eq!(
        applied("cue 1 { }\r\n", "cue 2 {\n}"),
        "cue 1 { }\r\ncue 2 {\r\n}\r\n"
    );
    assert_eq!(
        applied("bank a = b", "show \"A\""),
        "show \"A\"\nbank a = b"
    );
}

#[test]
fn removing_takes_the_line() {
    assert_eq!(
        remove(SHOW, "bank a").unwrap().source,
        SHOW.replace("bank a = x  // one\n", "")
    );
    assert_eq!(
        remove(SHOW, "cue 3").unwrap().source,
        SHOW.replace("  cue 3 {\n    a 6 // six\n  } // three\n", "")
    );
    let error = remove(SHOW, "bank c").unwrap_err();
    assert_eq!(error[0].help, ["did you mean `bank a`?"]);
    assert_eq!(&SHOW[locate(SHOW, "cue 1.0").unwrap()], "cue 1 { a 5 }");
}

#[test]
fn an_error_leaves_everything() {
    assert_eq!(
        declare(SHOW, "cue 2 { lamps }}").unwrap_err()[0].code,
        codes::STRAY_BRACE
    );
    assert_eq!(
        declare(SHOW, "bank = 3").unwrap_err()[0].code,
        codes::SYNTAX
    );
    assert_eq!(
        declare("cue 1 {", "cue 2 { }").unwrap_err()[0].code,
        codes::UNCLOSED
    );
    assert_eq!(
        declare(SHOW, "// nothing").unwrap_err()[0].code,
        codes::EMPTY
    );
}

#[test]
fn declarations_of_one_edit_follow_each_other() {
    assert_eq!(applied(SHOW, "cue 1 { a 5 }"), SHOW);
    // Two of one kind, the second of which goes behind the first; then the first once more.
    let three = applied(SHOW, "cue 5 { }\ncue 4 { }\ncue 5 { a 6 }");
    assert_eq!(three, format!("{SHOW}cue 4 {{ }}\ncue 5 {{ a 6 }}\n"));
}

#[test]
fn a_cue_is_written_from_values() {
    let cue = CueText {
        number: number("3.5"),
        label: "He \"sees\" it".to_owned(),
        up: Some(Time::from_micros(2_000_000)),
        down: Some(Time::from_micros(2_000_000)),
        moves: vec!["day out".to_owned(), "a 29".to_owned()],
    };
    let text = "cue 3.5 \"He \\\"sees\\\" it\" { time 2  day out  a 29 }";
    assert_eq!(cue.statement().unwrap(), text);
    let set = edited(SHOW, Edit::SetCue(cue.clone()));
    assert_eq!(set.source, format!("{SHOW}{text}\n"));
    let down = CueText {
        up: None,
        down: Some(Time::from_micros(90_250_000)),
        label: String::new(),
        ..cue.clone()
    };
    assert!(
        down.statement()
            .unwrap()
            .starts_with("cue 3.5 { down 1:30.25  day")
    );
    for (bad, code) in [
        ("a , b", codes::SYNTAX),
        ("a }", codes::STRAY_BRACE),
        ("a 5 }\nbank z = {", codes::SYNTAX),
        ("a 5 }\ncue 8 {", codes::MISPLACED),
    ] {
        let moves = vec![bad.to_owned()];
        let error = Edit::SetCue(CueText {
            moves,
            ..cue.clone()
        });
        assert!(message(SHOW, error).starts_with(code), "{bad:?}");
    }
}

fn update(cue: &str, moves: &str) -> Edit {
    Edit::UpdateMoves {
        cue: number(cue),
        moves: moves.to_owned(),
    }
}

/// The text between the braces of cue 1 after an update.
fn updated(body: &str, moves: &str) -> String {
    let source = format!("let dim = 20\ncue 1 {{{body}}} // end\n");
    let after = edited(&source, update("1", moves));
    assert_eq!(after.changes[0].what(), "cue 1");
    let start = source.find('{').unwrap() + 1;
    after.source[start..]
        .strip_suffix("} // end\n")
        .unwrap()
        .to_owned()
}

#[test]
fn only_the_move_of_the_target_changes() {
    for (body, target, after) in [
        (" a 5 ", "a", " a 40 "),
        (" ab 5  a full time 3 ", "a", " ab 5  a 40 time 3 "),
        (" a to 85% // bright\n", "a", " a 40 // bright\n"),
        (" b 5\n part 2 { a out } ", "a", " b 5\n part 2 { a 40 } "),
        (" sky.g 5  sky.r 5 ", "sky.r", " sky.g 5  sky.r 40 "),
        (" a (dim) ", "a", " a 40 "),
        (" a spline 0 1, 2 3 ", "a", " a 40 "),
    ] {
        assert_eq!(updated(body, &format!("{target} 40")), after, "{body}");
    }
}

#[test]
fn a_move_that_is_missing_is_added_at_its_place() {
    for (body, after) in [
        ("", " a 40 "),
        (" ", " a 40 "),
        (" snap ", " snap  a 40 "),
        (" b 5 ", " b 5  a 40 "),
        (" b 5 time 3  follow 2 ", " b 5 time 3  a 40  follow 2 "),
        ("\n  time 3\n", "\n  time 3\n  a 40\n"),
        (
            "\n  b 5 // so\n  follow 3\n",
            "\n  b 5 // so\n  a 40\n  follow 3\n",
        ),
        (
            "\n  b 5 /* so */ follow 3\n",
            "\n  b 5  a 40 /* so */ follow 3\n",
        ),
        (
            "\n  b 5\n  part 2 { c 3 }\n",
            "\n  b 5\n  a 40\n  part 2 { c 3 }\n",
        ),
        ("\n  part 1 { c 3 }\n", "\n  part 1 { c 3  a 40 }\n"),
        ("\n  part 2 { c 3 }\n", "\n  part 2 { c 3 }\n  a 40\n"),
        (" part 2 { c 3 } ", " part 2 { c 3 }  a 40 "),
        (" sky.r 5 ", " sky.r 5  a 40 "),
    ] {
        assert_eq!(updated(body, "a 40"), after, "{body}");
    }
    let windows = "cue 1 {\r\n  b 5\r\n}\r\n";
    let after = edited(windows, update("1.0", "a 0")).source;
    assert_eq!(after, "cue 1 {\r\n  b 5\r\n  a 0\r\n}\r\n");
}

#[test]
fn a_cue_with_errors_or_that_is_missing_takes_no_moves() {
    let show = "cue 1 { a 3 }\ncue 2 { , }\n";
    for (cue, moves, code) in [
        ("2", "a 50", "E007"),
        ("3", "a 50", "E010"),
        ("1", "a b c ,", "E007"),
    ] {
        let error = apply(show, &update(cue, moves)).unwrap_err();
        assert_eq!(error[0].code, code);
    }
}

#[test]
fn a_copy_has_the_text_of_its_cue() {
    let copy = |source: &str, from: &str, to: &str| {
        let (from, to) = (number(from), number(to));
        edited(source, Edit::CopyCue { from, to }).source
    };
    let lines = "  } // three\n";
    let copied = "  cue 4 {\n    a 6 // six\n  }\n";
    assert_eq!(
        copy(SHOW, "3", "4"),
        SHOW.replace(lines, &format!("{lines}{copied}"))
    );
    let label = "cue /* n */ 1.50 \"1.50\" at 0:01 { a 1.50 }";
    let after = "cue /* n */ 7 \"1.50\" { a 1.50 }";
    assert_eq!(copy(label, "1.5", "7"), format!("{label}\n{after}"));
    let copy = |from: &str, to: &str| Edit::CopyCue {
        from: number(from),
        to: number(to),
    };
    let missing = "E010: there is no `cue 2` in the show; did you mean `cue 1`?";
    assert_eq!(message(SHOW, copy("2", "4")), missing);
    let taken = "E031: there is a cue 3 already; copy to a number that no cue has";
    assert_eq!(message(SHOW, copy("1", "3")), taken);
    assert_eq!(message(SHOW, copy("3", "3")), taken);
    let include = format!("include \"x.lxq\"\n{SHOW}");
    let said = message(&include, Edit::Remove("cue 1234".to_owned()));
    assert!(said.ends_with("; what an included file declares is edited in that file"));
}

#[test]
fn a_name_is_renamed_where_it_means_the_same() {
    let show = "show \"lamps\" // lamps\nstage \"lamps\"\nsurface lamps reflectance 0.5\n\
                let dim = 20\nlet two = 2 * dim\nview v from (dim), 0, 0 to 0, 0, 0 fov 20\n\
                light l panel lamps\nlight m like l at 0, 0, (two)\n\
                bank lamps = l dimmer lin\nbank sky = m rgb\nfixed f = l level (dim)\n\
                group all = lamps sky\nlook night { lamps (dim)  sky.r 3 }\n\
                look late = night + { all (two) }\ncurve lin = linear 0 0, 1 100\n\
                cue 1 \"lamps\" { /* lamps */ lamps (dim * 2)  curve lin  time (dim)  sky.g 4\n\
                part 2 \"lamps\" { late + night + { lamps (dim) }  lamps spline 0 (dim), 3 4 } }\n";
    for (from, count) in [
        ("lamps", 6), // its bank, a group, a look, and three uses in the cue
        ("dim", 9),
        ("two", 3),
        ("l", 4),
        ("m", 2),
        ("v", 1),
        ("sky", 4),
        ("f", 1),
        ("all", 2),
        ("night", 3),
        ("late", 2),
        ("lin", 3),
    ] {
        let rename = |from: &str, to: &str| Edit::Rename {
            from: from.to_owned(),
            to: to.to_owned(),
        };
        let after = edited(show, rename(from, "zzzz"));
        assert_eq!(after.source.matches("zzzz").count(), count, "{from}");
        let renamed = Action::Renamed("zzzz".to_owned());
        let of = |c: &&Change| c.action == renamed && c.name == from;
        assert_eq!(after.changes.iter().filter(of).count(), 1);
        assert_eq!(edited(&after.source, rename("zzzz", from)).source, show);
    }
}

#[test]
fn names_that_cannot_be_are_refused() {
    let show = "include \"rig.lxq\"\nbank lamps = l\ncue 1 { lamps 5  day 3 }\n";
    let said = |from: &str, to: &str| {
        let (from, to) = (from.to_owned(), to.to_owned());
        message(show, Edit::Rename { from, to })
    };
    let own = "a name stands for one thing in the whole show: choose another";
    let elsewhere = "what an included file declares is edited in that file";
    assert_eq!(
        said("lamps", "lamps"),
        format!("E012: `lamps` is a bank already; {own}")
    );
    let used = "`day` is used already, for something of an included file";
    assert_eq!(said("lamps", "day"), format!("E012: {used}; {own}"));
    let nothing = "E010: nothing is called";
    let text = "in the show's own text";
    assert_eq!(
        said("day", "x"),
        format!("{nothing} `day` {text}; {elsewhere}")
    );
    assert_eq!(said("q", "x"), format!("{nothing} `q` {text}; {elsewhere}"));
    let near = format!("{nothing} `lmaps` {text}; did you mean `lamps`?");
    assert_eq!(said("lmaps", "x"), near);
    for bad in ["", "a b", "1a", "a.r", "a\"", "-a", "a\n"] {
        assert!(said("lamps", bad).starts_with("E007: "), "{bad}");
    }
    for bad in ["cue", "full", "K", "linear"] {
        assert!(said("lamps", bad).starts_with("E013: "), "{bad}");
    }
    let broken = format!("{show}cue 2 {{ , }}\n");
    let edit = Edit::Rename {
        from: "lamps".to_owned(),
        to: "x".to_owned(),
    };
    assert!(message(&broken, edit).starts_with("E007: the show's own text has errors"));
}

const SHOWS: [&str; 8] = [
    include_str!("../../../../examples/tavern/tavern.lxq"),
    include_str!("../../../../examples/turandot/turandot.lxq"),
    include_str!("../../../../examples/figure4/figure4.lxq"),
    include_str!("../../../../examples/sketch/sketch.lxq"),
    include_str!("../../../../examples/luminaires/luminaires.lxq"),
    include_str!("../../../../examples/images/images.lxq"),
    include_str!("../../../../examples/reference/stage/stage.lxq"),
    include_str!("../../../../examples/first.lxq"),
];

/// Parses a text that has no error.
fn show(text: &str) -> Show {
    let rig = include_str!("../../../../examples/sketch/parts/rig.lxq");
    let set = include_str!("../../../../examples/sketch/parts/set.lxq");
    let files = Memory::default()
        .with("parts/rig.lxq", rig)
        .with("parts/set.lxq", set);
    let parsed = parse_with_files(&files, &mut Sources::default(), "a.lxq", text);
    parsed
        .show
        .unwrap_or_else(|| panic!("{text}\n{:#?}", parsed.diagnostics))
}

/// A shipped show with LF or CRLF line ends, with and without a final line end.
fn source() -> impl Strategy<Value = String> {
    let text = prop::sample::select(SHOWS.to_vec());
    (text, any::<bool>(), any::<bool>()).prop_map(|(text, windows, ends)| {
        let text = if ends { text } else { text.trim_end() };
        if windows {
            text.replace('\n', "\r\n")
        } else {
            text.to_owned()
        }
    })
}

/// Numbers of the cues in the text.
fn cues(source: &str) -> Vec<CueNumber> {
    let cuts = scan::scan(source).cuts;
    let names = cuts.into_iter().filter_map(|cut| name(cut.text));
    names
        .filter_map(|name| CueNumber::parse(name.strip_prefix("cue ")?))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    /// Deleting a copied cue restores the text.
    #[test]
    fn a_copy_that_is_deleted_leaves_nothing(
        source in source(),
        cue in any::<prop::sample::Index>(),
        thousandths in 1..9_999_999_u32,
    ) {
        let cues = cues(&source);
        let (from, to) = (*cue.get(&cues), CueNumber::from_thousandths(thousandths).unwrap());
        prop_assume!(!cues.contains(&to));
        let copied = edited(&source, Edit::CopyCue { from, to });
        let places = |source: &str| {
            let at = |n: &CueNumber| locate(source, &format!("cue {n}"));
            cues.iter().filter_map(|n| at(n).map(|place| source[place].to_owned())).collect::<Vec<_>>()
        };
        prop_assert_eq!(places(&copied.source), places(&source));
        let deleted = edited(&copied.source, Edit::Remove(format!("cue {to}")));
        prop_assert_eq!(&deleted.source, &source);
    }

    /// Renaming there and back gives the same bytes, and in between the show differs only in the
    /// name.
    #[test]
    fn a_name_goes_there_and_back(source in source(), at in any::<prop::sample::Index>()) {
        let cuts = scan::scan(&source).cuts;
        let names = cuts.into_iter().filter_map(|cut| name(cut.text));
        let kinds = ["view ", "light ", "bank ", "fixed ", "group ", "look ", "curve ", "let "];
        let declared = names.filter_map(|n| kinds.iter().find_map(|k| n.strip_prefix(k).map(str::to_owned)));
        let from = at.get(&declared.collect::<Vec<_>>()).clone();
        let rename = |from: &str, to: &str| Edit::Rename { from: from.to_owned(), to: to.to_owned() };
        let there = edited(&source, rename(&from, "a_name-that-is-new"));
        let (before, after) = (format!("{:?}", show(&source)), format!("{:?}", show(&there.source)));
        let renamed = after.replace("a_name-that-is-new", &from);
        prop_assert_eq!(renamed, before);
        let back = edited(&there.source, rename("a_name-that-is-new", &from));
        prop_assert_eq!(back.source, source);
    }

    /// Updating a level of a cue changes that level and no other.
    #[test]
    fn a_level_that_is_updated_is_the_only_change(
        source in source(),
        cue in any::<prop::sample::Index>(),
        bank in any::<prop::sample::Index>(),
        thousandths in 0..=1000_u32,
    ) {
        let level = f64::from(thousandths) / 1000.0;
        let before = show(&source);
        let (cue, bank) = (*cue.get(&cues(&source)), bank.get(&before.banks));
        let edit = Edit::UpdateMoves { cue, moves: format!("{} {}", bank.name, level * 100.0) };
        let Ok(after) = apply(&source, &edit) else { return Ok(()) };
        prop_assert!(after.source.len() < source.len() + bank.name.len() + 40);
        let mut sources = Sources::default();
        let parsed = crate::lang::parse(&mut sources, "a", &after.source);
        // Where a group or a look moves the bank too, the show says so.
        let twice = parsed.diagnostics.iter().any(|d| d.code == codes::MOVED_TWICE);
        prop_assume!(!twice && !source.contains("include"));
        let coordinates = before.banks.iter().take_while(|b| b.name != bank.name);
        let first: usize = coordinates.map(|b| if b.rgb { 4 } else { 1 }).sum();
        let after = show(&after.source);
        let changed = after.cues.iter().find(|c| c.number == cue).unwrap();
        let mut moves = changed.parts.iter().flat_map(|p| &p.moves);
        let moved = moves.find(|m| m.parameter == first).unwrap();
        let Motion::To(set) = moved.motion else { panic!("{moved:?}") };
        prop_assert!((set - level).abs() < 1e-12);
        for (old, new) in before.cues.iter().zip(&after.cues).filter(|(old, _)| old.number != cue) {
            let plain = |c: &crate::model::Cue| format!("{:?}", c.parts.iter().map(|p| {
                p.moves.iter().map(|m| (m.parameter, m.motion.clone())).collect::<Vec<_>>()
            }).collect::<Vec<_>>());
            prop_assert_eq!(plain(old), plain(new));
        }
    }

    /// Declarations of one show can be put into another, whatever they replace there.
    #[test]
    fn declarations_are_spliced(source in source(), other in source(), picks in prop::collection::vec(any::<prop::sample::Index>(), 1..6)) {
        let cuts = scan::scan(&other).cuts;
        let texts = picks.iter().map(|pick| pick.get(&cuts).text);
        let statements = texts.collect::<Vec<_>>().join("\n");
        let once = edited(&source, Edit::Declare(statements.clone()));
        // Applying the declarations a second time changes nothing.
        let again = edited(&once.source, Edit::Declare(statements));
        prop_assert_eq!(&again.source, &once.source);
    }

    #[test]
    fn a_difference_makes_the_new_text(old in "[abü🎭\n]{0,12}", new in "[abü🎭\n]{0,12}") {
        let (range, text) = difference(&old, &new);
        let mut made = old.clone();
        made.replace_range(range, text);
        prop_assert_eq!(made, new);
    }
}
