//! Cue sheets with values against the same cue sheets written out, and calculations with errors.

use crate::diagnostic::Sources;
use crate::lang::{Parsed, codes, parse};

fn parsed(text: &str) -> Parsed {
    parse(&mut Sources::default(), "values.lxq", text)
}

const VALUES: &str = r##"
show "Values"
let half  = quick / slow                     // above what it rests on
let slow  = 12s
let quick = slow/4
let dim   = 2*20 + -(5)
let amber = #ffb36b
let tall  = 7ft + 30cm
let warm  = 2000K + 700
let law   = 60%
light l1 spot  at 0, -2, (tall)  aim 0, 0, (tall - 1)  beam 24  field (24+16)  (1200 cd*2)  (amber)
light l2 like l1  (warm)
bank lamps = l1
bank sky   = l2  rgb
fixed exit = l2  level (law / 6)
curve s = spline 0 0, (half) (law), 1 100
look night { lamps (dim) }
cue 1 { night }
cue 2 { time ( slow/2 ) / (quick)  delay (0.1+0.2)
  lamps (full - dim)
  sky   (amber)
}
cue 3 { lamps spline 0s (dim*2), (quick) 30, (slow) (dim) }
cue 4 { sky (warm)  curve s }
"##;

const WRITTEN_OUT: &str = r##"
show "Values"
light l1 spot  at 0, -2, 2.4336  aim 0, 0, 1.4336  beam 24  field 40  2400 cd  #ffb36b
light l2 like l1  2700 K
bank lamps = l1
bank sky   = l2  rgb
fixed exit = l2  level 10
curve s = spline 0 0, 0.25 60, 1 100
look night { lamps 35 }
cue 1 { night }
cue 2 { time 6/3  delay 300ms
  lamps 65
  sky   #ffb36b
}
cue 3 { lamps spline 0s 70, 3s 30, 12s 35 }
cue 4 { sky 2700 K  curve s }
"##;

#[test]
fn a_value_is_what_would_have_been_written() {
    let with = parsed(VALUES);
    assert!(with.show.is_some(), "{:#?}", with.diagnostics);
    let mut written = parsed(WRITTEN_OUT).show.unwrap();
    let mut show = with.show.unwrap();
    // 7ft + 30cm rounds differently.
    for show in [&mut show, &mut written] {
        for light in &mut show.lights {
            if let crate::model::LightKind::Spot(spot) = &mut light.kind {
                for z in [&mut spot.position.z, &mut spot.aim.z] {
                    *z = (*z * 1e12).round() * 1e-12;
                }
            }
        }
    }
    assert_eq!(show, written);
}

#[test]
fn what_cannot_be_worked_out_is_said_once() {
    for (value, code, message) in [
        (
            "5s + 20%",
            codes::CALCULATION,
            "a level cannot be added to a time",
        ),
        (
            "3m - 2s",
            codes::CALCULATION,
            "a time cannot be subtracted from a length",
        ),
        (
            "3m * 2m",
            codes::CALCULATION,
            "a length cannot be multiplied by a length",
        ),
        (
            "5 / 2s",
            codes::CALCULATION,
            "a number cannot be divided by a time",
        ),
        ("5s / (2 - 2)", codes::CALCULATION, "this divides by zero"),
        ("-#fb6", codes::SYNTAX, ""),
        (
            "other + 1",
            codes::CALCULATION,
            "colours cannot be calculated with",
        ),
        ("-other", codes::CALCULATION, "a colour has no sign"),
        (
            "999999999999 * 10",
            codes::CALCULATION,
            "this comes to more than a million million",
        ),
        (
            "missing",
            codes::UNKNOWN_NAME,
            "there is no value called `missing`",
        ),
        ("a + 1", codes::CYCLE, "this value is defined by itself"),
        (
            "lamps",
            codes::WRONG_KIND_OF_NAME,
            "expected a value, but `lamps` is a bank",
        ),
        ("5 parsecs", codes::SYNTAX, ""),
        ("5parsec", codes::BAD_NUMBER, "there is no unit `parsec`"),
    ] {
        let text = format!(
            "let other = #123456\nlet a = {value}\nlight l panel cloth\nbank lamps = l\n\
             cue 1 {{ lamps (a) }}\ncue 2 {{ lamps (a) }}\n"
        );
        let parsed = parsed(&text);
        let errors: Vec<_> = parsed.diagnostics.iter().map(|d| d.code).collect();
        assert_eq!(errors, [code], "{value}: {:#?}", parsed.diagnostics);
        let said = &parsed.diagnostics[0].message;
        assert!(message.is_empty() || said == message, "{said}");
    }
}

#[test]
fn a_result_of_the_wrong_kind_or_range_is_said_with_its_worth() {
    let rig = "let slow = 12s\nlight l panel cloth\nbank lamps = l\n";
    for (cue, message) in [
        ("lamps (slow)", "expected a level, but `(slow)` is a time"),
        (
            "lamps (100 + 1)",
            "the level `(100 + 1)`, which is 101, is outside 0 to 100",
        ),
        ("time (2 - 3)", "`(2 - 3)` is negative: only `hang` may be"),
        (
            "lamps 5  time (#fb6)",
            "expected a time, but `(#fb6)` is a colour",
        ),
    ] {
        let parsed = parsed(&format!("{rig}cue 1 {{ {cue} }}\n"));
        assert_eq!(parsed.diagnostics[0].message, message);
    }
}

#[test]
fn values_may_rest_on_each_other_but_not_without_end() {
    let chain = |n: usize| -> String {
        let links = (0..n).map(|i| format!("let v{i} = v{} + 1\n", i + 1));
        let end = format!("let v{n} = 0\nlight l panel cloth\nbank b = l\ncue 1 {{ b (v0) }}\n");
        links.collect::<String>() + &end
    };
    let found = parsed(&chain(50)).show;
    assert!(found.is_some());
    let deep = parsed(&chain(300)).diagnostics;
    assert_eq!(deep[0].code, codes::TOO_LARGE, "{deep:#?}");
}
