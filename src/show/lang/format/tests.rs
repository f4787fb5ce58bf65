//! Expected layouts, and properties of every text.

mod random_shows;

use super::format;
use crate::diagnostic::Sources;
use crate::lang;
use crate::model::Show;

/// Checks that the text formats to itself.
#[track_caller]
fn canonical(text: &str) {
    let formatted = format(text).unwrap();
    assert_eq!(formatted, text, "it became:\n{formatted}");
}

#[track_caller]
fn becomes(text: &str, wanted: &str) {
    let formatted = format(text).unwrap();
    assert_eq!(formatted, wanted, "it became:\n{formatted}");
    canonical(wanted);
}

fn show(text: &str) -> Option<Show> {
    lang::parse(&mut Sources::default(), "a.lxq", text).show
}

/// Checks the properties of every text that parses.
#[track_caller]
pub fn holds(text: &str) {
    let once = format(text).unwrap();
    let twice = format(&once).unwrap();
    assert_eq!(once, twice, "not idempotent on:\n{text}");
    assert_eq!(
        show(text),
        show(&once),
        "another show:\n{text}\n---\n{once}"
    );
    let words = |text: &str| text.split_whitespace().collect::<String>().to_lowercase();
    let mut of = [words(text), words(&once)];
    assert_eq!(of[0].len(), of[1].len(), "words were lost:\n{once}");
    // Comments may move past a brace or a comma to the end of a line.
    of = of.map(|t| {
        let mut chars: Vec<char> = t.chars().collect();
        chars.sort_unstable();
        chars.into_iter().collect()
    });
    assert_eq!(of[0], of[1]);
}

#[test]
fn clauses_stand_under_each_other_where_their_roles_agree() {
    becomes(
        "light a spot at 0,0,3 aim 0 ,0,0 beam 20 field 30 1200   cd 2700 K\nlight bcd like a at 1,  0, 3 // low\nlight e panel glass\n\nbank x=a channel 1\nbank longer = bcd e dimmer square",
        "light a    spot    at 0, 0, 3  aim 0, 0, 0  beam 20  field 30  1200 cd  2700 K\nlight bcd  like a  at 1, 0, 3  // low\nlight e    panel glass\n\nbank x      = a  channel 1\nbank longer = bcd e  dimmer square\n",
    );
}

#[test]
fn a_cue_is_one_line_or_an_item_a_line() {
    becomes(
        "cue 1 \"Preset\" at 0:00 {snap lamps 30   windows 5}\ncue 2{\n\n\n  up 6   down 9\n lamps 85  windows 4 time 4/ 3\n\n\n part 2 \"slow\" { time 20 delay 2 curve dawn\n sky 40 }\n  hang 2\n\n}\n",
        "cue 1 \"Preset\"  at 0:00 { snap  lamps 30  windows 5 }\ncue 2 {\n  up 6  down 9\n  lamps 85\n  windows 4  time 4/3\n\n  part 2 \"slow\" {\n    time 20  delay 2  curve dawn\n    sky 40\n  }\n  hang 2\n}\n",
    );
    canonical("cue 1 { }\n");
    canonical("look night  { lamps 10  windows 4 }\nlook b = night + { lamps 20 }\n");
    canonical("look night {\n  lamps 10  windows 4\n  sky #203060\n}\n");
}

#[test]
fn timing_stays_with_its_move() {
    // On the move's line, timing is the move's; on another line, the cue's.
    canonical("cue 1 {\n  lamps 5  time 3\n}\n");
    canonical("cue 1 {\n  lamps 5\n  time 3\n}\n");
    becomes(
        "cue 1 {\n lamps 5 /* a\n b */ time 3 }\n",
        "cue 1 {\n  lamps 5 /* a\n b */\n  time 3\n}\n",
    );
    becomes(
        "cue 1 {\n lamps spline 0 5,\n 2 8 time 3 }\n",
        "cue 1 {\n  lamps spline 0 5,\n      2 8  time 3\n}\n",
    );
    becomes(
        "cue 1 {\n time 5 lamps 40 }\n",
        "cue 1 {\n  time 5\n  lamps 40\n}\n",
    );
}

/// Found by mutation: a unit after a tab used to be parsed as a separate word.
#[test]
fn a_unit_stands_off_by_blanks_of_any_kind() {
    becomes("cue 1 { z 2700\t K }\n", "cue 1 { z 2700 K }\n");
}

#[test]
fn comments_stay_where_they_are() {
    canonical(
        "// top\n\n// one\nshow \"A\"  // title\n\n/* two\n   lines */\nbank a = b\n// end\n",
    );
    canonical("cue 1 {  // why\n  // before\n  lamps 5  // beside\n\n  // last\n}\n// after\n");
    canonical("cue 1 { /* in */ lamps 5 }\n");
    canonical("bank a = b /*/ c */\n");
    becomes("bank a = // one\n  b c\n", "bank a =  // one\n    b c\n");
    becomes("", "");
    becomes("// only\n\n\n", "// only\n");
    becomes("show \"A\"\r\nbank a  = b", "show \"A\"\r\nbank a = b\r\n");
}

#[test]
fn examples_keep_their_meaning() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/");
    for name in [
        "first.lxq",
        "tavern/tavern.lxq",
        "figure4/figure4.lxq",
        "luminaires/luminaires.lxq",
    ] {
        let text = std::fs::read_to_string(format!("{root}{name}")).unwrap_or_default();
        assert!(!text.is_empty(), "{name}");
        holds(&text);
    }
}

#[test]
fn what_does_not_parse_is_not_touched() {
    let found = format("show \"A\"\nbank = 3\n").unwrap_err();
    assert_eq!(found[0].code, lang::codes::SYNTAX);
}

#[test]
fn solids_stand_on_lines_of_their_own_where_they_were() {
    becomes(
        "surface table reflectance .5\n"
            .replace(".5", "0.5")
            .trim_end(),
        "surface table  reflectance 0.5\n",
    );
    becomes(
        "stage \"hall.glb\" matt scale 1mm\nsurface floor gloss 0.2 reflectance #fff box from 0,0,0 to 1,1,1",
        "stage \"hall.glb\"  matt  scale 1mm\nsurface floor  gloss 0.2  reflectance #fff  box  from 0, 0, 0  to 1, 1, 1\n",
    );
    becomes(
        "surface t reflectance 0.5\n quad 0,0,0 1,0,0 1,1,0 0,1,0 two-sided\n box from 0,0,0 to 1,1,1 inside",
        "surface t  reflectance 0.5\n    quad 0, 0, 0  1, 0, 0  1, 1, 0  0, 1, 0  two-sided\n    box  from 0, 0, 0  to 1, 1, 1  inside\n",
    );
}

#[test]
fn calculations_breathe() {
    becomes(
        "let  a=2*20+ -( 5 )\nlet b  = #fff\nlight l spot at 0 ,(a),( a/2 ) aim 0,0,0 beam 4 field 9 5 cd\n",
        "let a = 2 * 20 + -(5)\nlet b = #fff\nlight l  spot  at 0, (a), (a / 2)  aim 0, 0, 0  beam 4  field 9  5 cd\n",
    );
    canonical("cue 1 {\n  time (a)/(b)\n  x (full - a)\n}\n");
}

/// A line of ten thousand columns uses no stack per column and takes linear time.
#[test]
fn long_lines_cost_no_stack() {
    let entries = "a 10 ".repeat(10_000);
    let formatted = format(&format!(
        "look x {{\n{entries}\n}}\nlook y {{\n{entries}\n}}\n"
    ));
    assert_eq!(formatted.unwrap().lines().count(), 6);
    let panels: String = (0..3_000).map(|i| format!("light l{i} like a\n")).collect();
    assert_eq!(format(&panels).unwrap().lines().count(), 3_000);
}
