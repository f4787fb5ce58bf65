use super::*;
use crate::diagnostic::Sources;
use crate::model::Show;
use crate::model::{Dimmer, EffectKind, Fade, Interpolation, LightKind, Link, Motion, Trigger};
use crate::units::{CueNumber, Time, percent};

/// The cue sheet of the design, without the projection.
const SHEET: &str = r##"
// Luther's Tavern, Les Contes d'Hoffmann
show "Luther's Tavern"
preview { tolerance 2%  gap 5  rate 25  exposure auto  coarse 1  refined 2 }   // defaults

stage "tavern.obj"                          // geometry beside this file
surface boards  reflectance #6b4a2f
view stalls     from 0, -14, 1.7  to 0, 0, 2.2  fov 28  size 640x360

// --- rig -------------------------------------------------------------
light lamp1  spot   at -2.1, 1.0, 3.4  aim -2.1, 1.0, 0.9  beam 24  field 40  1200 cd  2700 K
light lamp2  like lamp1  at 0.0, 1.2, 3.4  aim 0.0, 1.2, 0.9
light moon   panel pane_left
light dusk   panel cloth  20 cd/m2
light sign_l panel "sign.l"
light sign_r panel sign_r

bank lamps    = lamp1 lamp2     channel 1
bank windows  = moon            channel 2   dimmer square
bank sky      = dusk            channel 3   rgb
fixed exits   = sign_l sign_r   level 10

group warm = lamps windows
look  night { lamps 10  windows 4 }
look  late = night + { windows 1 }

// --- cues ------------------------------------------------------------
default time 5
curve dawn = spline 0 0, 0.4 8, 0.7 55, 1 100

cue 1 "Preset"        at 0:00  { snap  lamps 30  windows 5 }
cue 2 "Evening"       at 0:04  {
  up 6  down 9
  lamps 85
  part 2 "slow sky" { time 20  delay 2  curve dawn
    sky 40
  }
  hang 2
}
cue 2.5 "Lamp turned up"  {
  lamps spline 0s 30, 3s 55, 4s 52, 9s 90
  sky to #203060 time 8
  follow 30
}
cue 3 "Blackout"          { blackout }
"##;

fn parsed(text: &str) -> Parsed {
    parse(&mut Sources::default(), "test.lxq", text)
}

#[test]
fn the_sheet_of_the_design_parses() {
    let parsed = parsed(SHEET);
    assert_eq!(parsed.diagnostics, []);
    let show = parsed.show.unwrap();
    assert_eq!(show.title, "Luther's Tavern");
    assert_eq!(show.preview, crate::model::Preview::default());
    let names: Vec<String> = show.coordinates().into_iter().map(|c| c.name).collect();
    assert_eq!(
        names,
        ["lamps", "windows", "sky.r", "sky.g", "sky.b", "fixed"]
    );
    assert_eq!(show.banks[1].dimmer, Dimmer::Square);
    assert_eq!(show.looks[1].levels, [(0, 0.1), (1, 0.01)]);
    let LightKind::Spot(lamp2) = &show.lights[1].kind else {
        panic!()
    };
    assert_eq!((lamp2.beam, lamp2.position.y), (24.0, 1.2));
    assert!((lamp2.intensity.luminance() - 1200.0).abs() < 1e-9);
    let [one, two, half, three] = show.cues.as_slice() else {
        panic!()
    };
    assert_eq!(one.trigger, Trigger::At(Time::ZERO));
    assert_eq!(one.parts[0].up, Time::ZERO);
    assert_eq!(
        two.link.unwrap().1,
        Link::Hang(Time::from_micros(2_000_000))
    );
    assert_eq!(
        (two.parts[0].up.seconds(), two.parts[0].down.seconds()),
        (6.0, 9.0)
    );
    assert_eq!(
        (two.parts[1].number, two.parts[1].curve),
        (2, Fade::Curve(0))
    );
    assert_eq!(two.parts[1].moves.len(), 1);
    assert_eq!(half.number, CueNumber::from_thousandths(2500).unwrap());
    let Motion::Path(path) = &half.parts[0].moves[0].motion else {
        panic!()
    };
    assert_eq!(path.interpolation, Interpolation::Monotone);
    assert_eq!(half.parts[1].up.seconds(), 8.0);
    assert!(matches!(half.parts[1].moves[2].motion, Motion::To(l) if (l - 0.116_97).abs() < 1e-5));
    assert_eq!(three.parts[0].moves.len(), 3);
}

const RIG: &str = "show \"t\"\nlight l spot at 0, 0, 4  aim 0, 0, 0  beam 20  field 40  100 cd\n\
    light m like l\nlight n like l\nbank a = l\nbank b = m  dimmer square\nbank c = n  rgb  dimmer square\n\
    group ab = a b\nlook low { a 40  b 20 }\n";

/// The show of the rig above with these cues.
fn with(cues: &str) -> Show {
    let parsed = parsed(&format!("{RIG}{cues}"));
    let errors = parsed
        .diagnostics
        .iter()
        .filter(|d| d.code.starts_with('E'));
    assert_eq!(errors.count(), 0, "{:?}", parsed.diagnostics);
    parsed.show.unwrap()
}

/// Parameters and their levels in percent.
fn levels(part: &crate::model::Part) -> Vec<(usize, f64)> {
    let level = |m: &crate::model::Move| match m.motion {
        Motion::To(level) => (m.parameter, percent(level)),
        Motion::Path(_) => panic!(),
    };
    part.moves.iter().map(level).collect()
}

#[test]
fn timing_belongs_to_the_move_before_it_on_its_line() {
    let show = with(
        "default time 4/3\ncue 1 {\n time 7\n a 5 time 2 delay 1\n b 6\n delay 9\n}\ncue 2 { a 6 }",
    );
    let [whole, alone] = show.cues[0].parts.as_slice() else {
        panic!()
    };
    assert_eq!(
        (levels(whole), whole.up.seconds(), whole.delay.seconds()),
        (vec![(1, 6.0)], 7.0, 9.0)
    );
    assert_eq!(
        (levels(alone), alone.up.seconds(), alone.delay.seconds()),
        (vec![(0, 5.0)], 2.0, 1.0)
    );
    assert_eq!((alone.number, alone.down.seconds()), (2, 2.0));
    let standard = &show.cues[1].parts[0];
    assert_eq!((standard.up.seconds(), standard.down.seconds()), (4.0, 3.0));
}

#[test]
fn parts_inherit_and_part_one_is_the_cue_itself() {
    let show = with("cue 1 { up 3  part 4 \"x\" { down 8  a 5 }  part 1 { b 5 } }");
    let [first, fourth] = show.cues[0].parts.as_slice() else {
        panic!()
    };
    assert_eq!((first.number, levels(first)), (1, vec![(1, 5.0)]));
    assert_eq!((fourth.number, fourth.label.as_str()), (4, "x"));
    assert_eq!((fourth.up.seconds(), fourth.down.seconds()), (3.0, 8.0));
}

#[test]
fn groups_looks_and_blackout_are_written_out() {
    let show = with(
        "cue 1 { ab 30 }\ncue 2 { low }\ncue 3 { low 50 }\ncue 4 { low + { c 10  a 1 } }\ncue 5 { blackout }",
    );
    let found: Vec<_> = show.cues.iter().map(|c| levels(&c.parts[0])).collect();
    assert_eq!(found[0], [(0, 30.0), (1, 30.0)]);
    assert_eq!(found[1], [(0, 40.0), (1, 20.0)]);
    assert_eq!(found[2], [(0, 20.0), (1, 10.0)]);
    assert_eq!(found[3], [(0, 1.0), (1, 20.0), (2, 10.0)]);
    assert_eq!(found[4], (0..3).map(|c| (c, 0.0)).collect::<Vec<_>>());
}

#[test]
fn a_colour_is_light_and_no_level() {
    let show = with(
        "cue 1 { c #ff0000  a 1 }\ncue 2 { c 60 #808080 }\ncue 3 { c 3200 K full }\ncue 4 { c.g 7 }\ncue 5 { c 20 }",
    );
    let found: Vec<_> = show.cues.iter().map(|c| levels(&c.parts[0])).collect();
    assert_eq!(found[0][1..], [(3, 100.0), (4, 0.0), (5, 0.0)]);
    // The linear value of sRGB 128 is 0.2158605, whatever the dimmer.
    assert_eq!(found[1][0], (2, 60.0));
    assert!((found[1][1].1 - 21.586_05).abs() < 1e-5);
    assert_eq!(found[2][..2], [(2, 100.0), (3, 100.0)]);
    assert!(found[2][3].1 < found[2][2].1);
    assert_eq!(found[3], [(4, 7.0)]);
    assert_eq!(found[4], [(2, 20.0)]);
}

#[test]
fn a_bank_alone_overrides_what_takes_in_more() {
    let show = with(
        "cue 1 { blackout  ab 20  a full }\ncue 2 { low  part 2 { time 3 b 70 } }\ncue 3 { blackout  low  c.r 5 }",
    );
    let found = |cue: usize, part: usize| levels(&show.cues[cue].parts[part]);
    assert_eq!(found(0, 0), [(0, 100.0), (1, 20.0), (2, 0.0)]);
    assert_eq!(
        (found(1, 0), found(1, 1)),
        (vec![(0, 40.0)], vec![(1, 70.0)])
    );
    assert_eq!(found(2, 0), [(0, 40.0), (1, 20.0), (2, 0.0), (3, 5.0)]);
    for twice in [
        "a 5  ab 10",
        "ab 5  low",
        "a 5  a 6",
        "low  blackout",
        "c #f00  c.r 3",
        "c 5 #fff  c 6",
    ] {
        let found = parsed(&format!("{RIG}cue 1 {{ {twice} }}")).diagnostics;
        assert_eq!(found[0].code, codes::MOVED_TWICE, "{twice}");
    }
}

#[test]
fn timing_that_is_surely_not_meant_is_asked_about() {
    let found = |cue: &str| {
        let text = format!("{RIG}cue 1 {{ c 5  {cue} }}\n");
        let text = text.replace("c 5  ", "c 5\n");
        let found = parsed(&text).diagnostics.into_iter();
        found.map(|d| d.code).collect::<Vec<_>>()
    };
    for (cue, code) in [
        ("a 5  b 6  time 3", Some(codes::LAST_MOVE_TIMING)),
        ("ab 5  b 6  snap", Some(codes::LAST_MOVE_TIMING)),
        ("a 5\n b 6  time 3", None),
        ("a 5 time 2  b 6 time 3", None),
        ("time 3  a 5  b 6", None),
        ("a 5  b linear 0 5, 1 5  repeat 3", None),
        ("b 5\n a linear 0 0, 1 5  time 3", Some(codes::PATH_TIMING)),
        (
            "b 5\n a linear 0 0, 1 5  delay 1  curve ease",
            Some(codes::PATH_TIMING),
        ),
        ("b 5\n a linear 0 5, 1 5  delay 1  repeat 2", None),
    ] {
        assert_eq!(found(cue), code.into_iter().collect::<Vec<_>>(), "{cue}");
    }
}

#[test]
fn colours_by_name_may_not_rest_on_themselves() {
    let circle = parsed("let a = #b\nlet b = #a\nlight l panel m\n").diagnostics;
    assert_eq!(circle[0].code, codes::CYCLE);
    let deep: String = (0..400)
        .map(|i| format!("let a{i} = #a{}\n", i + 1))
        .collect();
    let found = parsed(&format!("{deep}let a400 = #fff\nlight l panel m\n")).diagnostics;
    assert_eq!(found[0].code, codes::TOO_LARGE);
}

#[test]
fn cues_are_sorted_and_keep_their_words() {
    let show = with(
        "cue 10 { a 1 repeat 4 }\ncue 9.5 \"say \\\"now\\\"\" at 1:00 { block assert cueonly a 2 follow 3 }",
    );
    let [first, second] = show.cues.as_slice() else {
        panic!()
    };
    assert_eq!(
        (first.number.to_string(), first.label.as_str()),
        ("9.5".to_owned(), "say \"now\"")
    );
    assert!(first.block && first.assert && first.cueonly);
    assert_eq!(first.trigger, Trigger::At(Time::from_micros(60_000_000)));
    assert_eq!(second.parts[0].moves[0].repeat, 4);
}

#[test]
fn declarations_are_told_from_verbs() {
    for yes in ["show \"A\"", "  cue 3 { }", "bank a = b", "let x = 3"] {
        assert!(is_declaration(yes), "{yes}");
    }
    for no in ["show", "show cue 3", "plan", "", "cues", "at 0:30"] {
        assert!(!is_declaration(no), "{no}");
    }
}

/// The parser recurses with the brackets and does not watch the stack: the deepest statement that
/// the scanner accepts takes a fraction of a thread's stack, even when lines with errors are left
/// out.
#[test]
fn the_deepest_statement_needs_little_stack() {
    let count = |text: String| move || parsed(&format!("{RIG}{text}\n")).diagnostics.len();
    let small = |text: String| {
        let thread = std::thread::Builder::new().stack_size(768 << 10);
        thread.spawn(count(text)).unwrap().join().unwrap()
    };
    let (depth, [open, close]) = (limits::DEPTH, ["part 2 {\n", "}"]);
    let parts = [open.repeat(depth - 1), close.repeat(depth)].concat();
    // Anything nested deeper than a part in a part is skipped.
    assert_eq!(small(format!("cue 1 {{ {parts}")), 1);
    let rounds = ["(".repeat(depth), "1".into(), ")".repeat(depth)].concat();
    let lines = format!("{}\n{} x\n", "(".repeat(depth), ")".repeat(depth)).repeat(12);
    assert!(small(format!("cue 1 {{\na {rounds}\na {lines}}}")) > 0);
    assert_eq!(small(format!("cue 1 {{ a {rounds}\n b 5 }}")), 1);
}

#[test]
fn texts_in_windows_line_ends_mean_the_same() {
    let unix = parsed(SHEET).show;
    assert_eq!(parsed(&SHEET.replace('\n', "\r\n")).show, unix);
}

#[test]
fn the_advice_on_gobos_is_a_light_that_moves() {
    let help = names::foreign("gobo").unwrap();
    let light = help
        .split('`')
        .rfind(|part| part.starts_with("light "))
        .unwrap();
    let text = format!("show \"A\"\n{light}\nbank x = leaves\ncue 1 {{ x 50 }}\n");
    let show = parsed(&text).show.unwrap();
    assert!(show.lights[0].head.is_some());
}

#[test]
fn effects_are_begun_and_ended_by_moves() {
    let show = with(
        "effect e = flicker  rate 4  depth 20%  seed 9\neffect f = pulse\n\
         cue 1 { a 50 effect e  note \"softly\" }\ncue 2 { ab effect f delay 2 }\ncue 3 { c #f00 effect none }",
    );
    let [e, f] = show.effects.as_slice() else {
        panic!()
    };
    assert_eq!(
        (e.kind, e.rate, e.depth),
        (EffectKind::Flicker(9), 4.0, 0.2)
    );
    assert_eq!((f.kind, f.rate, f.depth), (EffectKind::Pulse, 1.0, 0.5));
    assert_eq!(show.cues[0].note, "softly");
    let changes = |cue: usize, part: usize| {
        let found = show.cues[cue].parts[part].effects.iter();
        found.map(|e| (e.bank, e.effect)).collect::<Vec<_>>()
    };
    assert_eq!(changes(0, 0), [(0, Some(0))]);
    assert_eq!(changes(1, 1), [(0, Some(1)), (1, Some(1))]);
    assert_eq!(show.cues[1].parts[1].delay.seconds(), 2.0);
    assert_eq!(changes(2, 0), [(2, None)]);
    for (text, code) in [
        ("cue 1 { a effect none  b effect x }", codes::UNKNOWN_NAME),
        ("cue 1 { c.r 5 effect none }", codes::DOES_NOT_FIT),
        ("effect e = pulse seed 3\n", codes::DOES_NOT_FIT),
        ("effect e = flicker rate 100\n", codes::RANGE),
        ("cue 1 { note \"a\" note \"b\" a 5 }", codes::SAID_TWICE),
    ] {
        let found = parsed(&format!("{RIG}{text}")).diagnostics;
        assert_eq!(found[0].code, code, "{text}");
    }
}

#[test]
fn previews_have_a_white_and_stops_beyond_automatic() {
    let preview = |entries: &str| {
        let parsed = parsed(&format!("{RIG}preview {{ {entries} }}"));
        parsed
            .show
            .map(|show| show.preview)
            .ok_or_else(|| parsed.diagnostics[0].code)
    };
    let found = preview("exposure auto +1.5  white 3200 K").unwrap();
    assert_eq!(
        (found.exposure, found.bias, found.white),
        (None, 1.5, Some(3200.0))
    );
    assert_eq!(preview("exposure auto -1").unwrap().bias, -1.0);
    let again = preview_statement(&found);
    assert_eq!(
        parsed(&format!("{RIG}{again}")).show.unwrap().preview,
        found
    );
    assert_eq!(preview("white 3"), Err(codes::DOES_NOT_FIT));
    assert_eq!(preview("white 1000 K"), Err(codes::RANGE));
}
