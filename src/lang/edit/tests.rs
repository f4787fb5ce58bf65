//! Edits by hand, and what holds of every edit of the shipped shows.

const SHOW: &str = "// top\nshow \"A\"\n\nbank a = x  // one\nbank b = y /* two\n lines */\n\n// the cues\ncue 1 { a 5 }\n  cue 3 {\n    a 6 // six\n  } // three\n";

fn applied(source: &str, statement: &str) -> String {
    apply(source, statement).unwrap().source
}

#[test]
fn a_declaration_replaces_its_namesake_in_place() {
    assert_eq!(
        applied(SHOW, "bank a = z channel 4"),
        SHOW.replace("bank a = x", "bank a = z channel 4")
    );
    let two = apply(SHOW, " show \"B\"\ncue 3.0 {\n a 7\n}\n").unwrap();
    let expected = SHOW
        .replace("show \"A\"", "show \"B\"")
        .replace("cue 3 {\n    a 6 // six\n  }", "cue 3.0 {\n   a 7\n  }");
    assert_eq!(two.source, expected);
    assert!(two.changes.iter().all(|c| c.replaced));
    assert_eq!(two.changes[1].what, "cue 3");
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
fn a_mistake_leaves_everything() {
    assert_eq!(
        apply(SHOW, "cue 2 { lamps }}").unwrap_err()[0].code,
        codes::STRAY_BRACE
    );
    assert_eq!(apply(SHOW, "bank = 3").unwrap_err()[0].code, codes::SYNTAX);
    assert_eq!(
        apply("cue 1 {", "cue 2 { }").unwrap_err()[0].code,
        codes::UNCLOSED
    );
    assert_eq!(apply(SHOW, "// nothing").unwrap_err()[0].code, codes::EMPTY);
}
