//! Sheets of small shows, in full.

use super::{ShowDifference, cue_sheet, difference, track_sheet};
use footlight_engine::Version;
use footlight_host::files::Memory;
use footlight_host::work::Work;
use footlight_show::diagnostic::Sources;
use footlight_show::lang;
use footlight_show::model::Show;
use footlight_show::timeline::Timeline;

const RIG: &str = "show \"A\"\nlight a panel glass\nlight b panel brass\nlight c panel cloth\nbank lamps = a\nbank fire = b\nbank sky = c  rgb\n";

fn show(cues: &str) -> Show {
    let parsed = lang::parse(&mut Sources::default(), "a.lxq", &format!("{RIG}{cues}"));
    parsed
        .show
        .unwrap_or_else(|| panic!("{:?}", parsed.diagnostics))
}

fn version(text: &str) -> Version {
    Version::read("a.lxq", text.as_bytes(), &Memory::default()).unwrap()
}

fn compared(old: &str, new: &str) -> ShowDifference {
    difference(
        &version(&format!("{RIG}{old}")),
        &version(&format!("{RIG}{new}")),
    )
}

const CUES: &str = "\
cue 1 \"Preset\" at 0:00 { snap  lamps 30  sky #203060 }
cue 2 \"Evening\" { up 6  down 9  lamps 85
  part 2 \"embers\" { delay 2  fire spline 0s 0, 3s 18, 8s 14 } hang 2 }
cue 3 { cueonly time 3 lamps 40 sky #4060c0 }
cue 4 { time 2 fire 14 }
cue 5 { block }
";

#[test]
fn a_track_sheet_tells_moved_tracked_and_blocked_apart() {
    assert_eq!(
        track_sheet(&show(CUES), Work::silent()).table().unwrap().text(2, 100),
        "\
cue  label    lamps  fire  sky
1    Preset   ↑30          ↑#203060
2    Evening  ↑85    ~14   ·#203060
3             ↓40    ·14   ↑#4060c0
4             ↺85    ■14   ↺#203060
5             ■85    ■14   ■#203060

↑ up  ↓ down  → another colour  ~ along a path  ↺ put back after a cueonly cue  ■ blocked: restated  · tracked
"
    );
    let show = show(CUES);
    let csv = track_sheet(&show, Work::silent()).words().unwrap().csv();
    assert!(
        csv.contains("4,,85 restored,14 blocked,#203060 restored\r\n"),
        "{csv}"
    );
}

#[test]
fn a_cue_sheet_has_a_row_for_each_cue_and_part() {
    let show = show(CUES);
    let table = cue_sheet(&show, &Timeline::new(&show).unwrap());
    assert_eq!(
        table.text(2, 200),
        "\
cue       label    starts          up/down  delay  curve  does                            then    complete
1         Preset   0:00            0                      lamps 30, sky #203060                   0:00
2         Evening  GO (0:05)       6/9                    lamps 85                        hang 2  0:15
2 part 2  embers                            2             fire along 3 knots in 8 to 14
3                  by itself 0:17  3                      cueonly, lamps 40, sky #4060c0          0:20
4                  GO (0:25)       2                      fire 14                                 0:27
5                  GO (0:32)       5                      block                                   0:37

Times before GO in brackets are assumed: the cue waits for the operator.
"
    );
}

#[test]
fn a_difference_speaks_of_levels_times_and_light() {
    let old = "cue 1 at 0:00 { snap lamps 30 }\ncue 2 at 0:30 { time 4 lamps 40\n  part 2 { delay 1 fire 20 } }\ncue 3 at 1:00 { lamps out }\n";
    let new = "cue 1 at 0:00 { snap lamps 30 }\ncue 2 \"Dusk\" at 0:31 { time 4 lamps 55\n  part 2 { delay 2.5 fire 20 } }\ncue 2.5 at 0:50 { sky #ffffff }\n";
    let found = compared(old, new);
    let lines: Vec<String> = found.changes.iter().map(ToString::to_string).collect();
    assert_eq!(
        lines,
        [
            "cue 2: at 0:30 -> 0:31 (1 s later)",
            "cue 2: label \"\" -> \"Dusk\"",
            "cue 2: lamps 40 -> 55 at 0:31",
            "cue 2: part 2 delay 1 -> 2.5",
            "cue 2.5: added at 0:50",
            "cue 3: removed",
        ]
    );
    assert!(!found.pictures);
    assert!(compared(old, old).is_empty());
}

#[test]
fn the_norm_of_a_change_is_exact() {
    // From 0 to 100 in 10 s against staying out: the square of t over [0, 1] has the integral 1/3.
    let found = compared(
        "cue 1 at 0:00 { snap lamps out }\ncue 2 at 0:00 { time 10 lamps out }\n",
        "cue 1 at 0:00 { snap lamps out }\ncue 2 at 0:00 { time 10 lamps full }\n",
    );
    let lamps = &found.curves[0];
    assert_eq!(lamps.name, "lamps");
    assert!(
        (lamps.norm - (1.0_f64 / 3.0).sqrt()).abs() < 1e-14,
        "{lamps:?}"
    );
    assert!((lamps.largest - 1.0).abs() < 1e-14);
    assert_eq!(lamps.at.micros(), 10_000_000);
}

#[test]
fn a_rig_that_changed_is_reported_with_both_texts() {
    let old = format!("{RIG}cue 1 {{ lamps 5 }}\n");
    let edited = old.replace("bank fire = b", "bank fire = b  channel 4");
    let found = difference(&version(&old), &version(&edited));
    assert_eq!(found.changes.len(), 1);
    assert_eq!(found.changes[0].what, "bank fire");
    assert_eq!(
        found.changes[0].how,
        "was: bank fire = b\n  now: bank fire = b  channel 4"
    );
}

#[test]
fn parts_that_were_not_written_are_not_named() {
    let cues = |time: u32| {
        format!(
            "cue 1 at 0:00 {{ snap  lamps 30\n  fire 20  time {time}\n  part 2 \"slow\" {{ time 9  sky 5 }} }}\n"
        )
    };
    let show = show(&cues(3));
    let sheet = cue_sheet(&show, &Timeline::new(&show).unwrap()).text(2, 200);
    let rows: Vec<&str> = sheet.lines().skip(1).take(3).map(str::trim).collect();
    assert!(
        rows[0].starts_with("1 ") && rows[0].contains("lamps 30"),
        "{sheet}"
    );
    assert!(
        rows[1].starts_with("1 part 2") && rows[1].contains("sky 5"),
        "{sheet}"
    );
    assert!(
        rows[2].starts_with('3') && rows[2].contains("fire 20"),
        "{sheet}"
    );
    let found = compared(&cues(3), &cues(4));
    let lines: Vec<String> = found.changes.iter().map(ToString::to_string).collect();
    assert_eq!(lines, ["cue 1: fire time 3 -> 4"]);
}

/// Changes of a cue that no other line reports.
#[test]
fn effects_and_notes_are_compared() {
    let rig = "effect candle = flicker\neffect storm = pulse\n";
    let cue = |rest: &str| format!("{rig}cue 1 at 0:00 {{ snap  lamps 30 {rest} }}\n");
    let how = |old: &str, new: &str| -> Vec<String> {
        let found = compared(&cue(old), &cue(new));
        found.changes.iter().map(ToString::to_string).collect()
    };
    assert_eq!(
        how("", "effect candle"),
        ["cue 1: lamps effect candle added"]
    );
    assert_eq!(
        how("effect candle", "effect storm"),
        ["cue 1: lamps effect candle -> storm"]
    );
    assert_eq!(
        how("effect candle", ""),
        ["cue 1: lamps effect candle removed"]
    );
    assert_eq!(
        how("", "note \"slowly\""),
        ["cue 1: note \"\" -> \"slowly\""]
    );
    let ended = |old: &str, new: &str| -> Vec<String> {
        let cues = |rest: &str| {
            format!(
                "{}cue 2 at 0:10 {{ fire 5 {rest} }}\n",
                cue("effect candle")
            )
        };
        let found = compared(&cues(old), &cues(new));
        found.changes.iter().map(ToString::to_string).collect()
    };
    assert_eq!(
        ended("", "lamps effect none"),
        ["cue 2: lamps effect none added"]
    );
}

#[test]
fn a_cue_between_moves_nothing_but_the_clock() {
    let cues = |more: &str| {
        format!(
            "cue 1 {{ time 3 lamps 30 }}\ncue 2 {{ time 4 lamps 80 }}\n{more}cue 3 {{ fire 20 }}\n\
             cue 4 {{ time 6 lamps out }}\ncue 5 {{ fire out }}\n"
        )
    };
    let found = compared(&cues(""), &cues("cue 2.5 { time 2  sky #102030 }\n"));
    let lines: Vec<String> = found.changes.iter().map(ToString::to_string).collect();
    assert_eq!(
        lines,
        ["cue 2.5: added at 0:17", "cues 3 to 5: GO 7 s later"]
    );
    // Only the sky stays lit in later cues.
    let names: Vec<&str> = found.curves.iter().map(|c| c.name.as_str()).collect();
    assert!(
        names.iter().all(|name| name.starts_with("sky")),
        "{names:?}"
    );
    let removed = compared(&cues("cue 2.5 { time 2  lamps 80 }\n"), &cues(""));
    assert!(removed.curves.is_empty(), "{:?}", removed.curves);
}

#[test]
fn one_change_of_times_is_one_line() {
    let lines = |old: &str, new: &str| -> Vec<String> {
        let found = compared(old, new);
        found.changes.iter().map(ToString::to_string).collect()
    };
    let at = |by: u32, last: u32| -> String {
        let cue = |n: u32| {
            let level = 10 * n;
            format!("cue {n} at 0:{} {{ lamps {level} }}\n", 10 * n + by)
        };
        let cues: String = (1..5).map(cue).collect();
        format!("{cues}cue 5 at 0:{last} {{ fire 5 }}\n")
    };
    assert_eq!(lines(&at(0, 55), &at(2, 55)), ["cues 1 to 4: at 2 s later"]);
    assert_eq!(
        lines(&at(0, 55), &at(2, 56)),
        [
            "cues 1 to 4: at 2 s later",
            "cue 5: at 0:55 -> 0:56 (1 s later)"
        ]
    );
    let cues = |default: &str, own: &str| {
        format!(
            "{default}cue 1 {{ lamps 10 }}\ncue 2 {{ {own} lamps 20 }}\ncue 3 {{ lamps 30 }}\n\
             cue 4 {{ lamps 40 }}\ncue 5 {{ up 2 lamps 50 }}\n"
        )
    };
    // A cue's own time is reported even if it equals the default.
    assert_eq!(
        lines(
            &cues("default time 4\n", "time 4"),
            &cues("default time 5\n", "time 5")
        ),
        [
            "default: was: default time 4\n  now: default time 5",
            "cues 2 to 5: GO 1 to 4 s later",
            "cue 2: time 4 -> 5"
        ]
    );
    assert_eq!(
        lines(
            &cues("default time 4\n", "time 4"),
            &cues("default time 4\n", "time 6/5")
        ),
        ["cue 2: time 4 -> 6/5", "cues 3 to 5: GO 2 s later"]
    );
}

const HEADS: &str = "show \"H\"\nlight mh1 spot at -2, 0, 5  aim -2, 0, 0  beam 12  field 18  900 cd  moves\n\
    light mh2 like mh1  at 2, 0, 5  aim 2, 0, 0\nlight mh3 like mh1  at 0, 0, 5  aim 0, 0, 0\n\
    point band = 0, 2, 1\npoint house = 0, -6, 1\nbank heads = mh1 mh2\nbank top = mh3\n\
    cue 1 at 0:00 { snap  heads 80 to band }\n\
    cue 2 at 0:10 { cueonly  mh1 to house  time 3 }\n\
    cue 3 at 0:20 { mh1 pan 30 tilt -20 beam 6  top full  time 2 }\n";

#[test]
fn sheets_say_where_heads_point() {
    let version = version(HEADS);
    let text = cue_sheet(&version.show, &version.timeline).text(2, 200);
    let does: Vec<&str> = text.lines().skip(1).take(3).collect();
    assert!(does[0].contains("heads 80, heads to band"), "{text}");
    assert!(does[1].contains("mh1 to house"), "{text}");
    assert!(text.contains("mh1 pan 30 tilt -20 beam 6"), "{text}");
    let table = track_sheet(&version.show, Work::silent()).table().unwrap();
    assert_eq!(
        table.text(2, 200),
        "\
cue  label  heads  top   mh1                      mh2
1           ↑80          →to band                 →to band
2           ·80          →to house                ·to band
3           ·80    ↑100  →pan 30 tilt -20 beam 6  ·to band

↑ up  ↓ down  → another colour or place  ~ along a path  ↺ put back after a cueonly cue  ■ blocked: restated  · tracked
"
    );
}

#[test]
fn sheets_name_groups_and_places_as_cues_do() {
    let text = HEADS.replace(
        "cue 3",
        "group all = top heads\ngroup one = top\ncue 2.5 { cueonly  all 60 to 0.5, -1, 0 }\ncue 3",
    ) + "effect wave = pulse\ncue 4 { heads 30  top 30  all effect wave spread }\ncue 5 { all out  top 5 }\ncue 6 { blackout }\n";
    let version = version(&text);
    let sheet = cue_sheet(&version.show, &version.timeline).csv();
    let does: Vec<&str> = sheet.lines().skip(3).collect();
    assert!(
        does[0].contains("\"cueonly, all 60, all to 0.5, -1, 0\""),
        "{sheet}"
    );
    assert!(
        does[3].contains("\"heads 30, top 30, all effect wave spread\""),
        "{sheet}"
    );
    assert!(does[4].contains("\"heads 0, top 5\""), "{sheet}");
    let table = track_sheet(&version.show, Work::silent()).table().unwrap();
    let text = table.text(2, 200);
    let rows = |cue: &str| text.lines().find(|row| row.starts_with(cue)).unwrap();
    assert_eq!(rows("2.5").matches("→to 0.5, -1, 0").count(), 3, "{text}");
}

#[test]
fn a_difference_says_how_far_a_head_is_aimed() {
    let found = |from: &str, to: &str| {
        let new = HEADS.replace(from, to);
        assert_ne!(new, HEADS);
        let found = difference(&version(HEADS), &version(&new));
        let lines = found.changes.iter().map(ToString::to_string);
        lines.collect::<Vec<_>>()
    };
    assert_eq!(
        found("mh1 to house", "mh1 to band"),
        ["cue 2: mh1 to house -> to band at 0:10, 8 m further upstage"]
    );
    // A moved point turns all heads that aim there, so that their reflected light changes.
    let moved = HEADS.replace("band = 0, 2, 1", "band = 1, 4, 1");
    assert_eq!(
        found("band = 0, 2, 1", "band = 1, 4, 1")[1..],
        ["cue 1: mh1, mh2 to band at 0:00: 1 m further left, 2 m further upstage"]
    );
    assert!(difference(&version(HEADS), &version(&moved)).poses > 0);
    let level = HEADS.replace("heads 80", "heads 70");
    assert_eq!(difference(&version(HEADS), &version(&level)).poses, 0);
    // From straight down, 5 m: the tangents of 20 and 25 degrees are 0.364 and 0.466.
    assert_eq!(
        found("pan 30 tilt -20 beam 6", "pan 0 tilt -25 beam 6"),
        [
            "cue 3: mh1 pan 30 tilt -20 beam 6 -> pan 0 tilt -25 beam 6 at 0:20, 0.9 m further right, 0.8 m further downstage"
        ]
    );
    // Two lines for one head, each with its times.
    let two = |aim: &str| {
        let lines = format!("mh1 to {aim}  time 2\n mh1 beam 5 field 8  time 1");
        HEADS.replace("mh1 to house  time 3", &lines)
    };
    let found_of_two = difference(&version(&two("house")), &version(&two("band")));
    let lines: Vec<String> = found_of_two
        .changes
        .iter()
        .map(ToString::to_string)
        .collect();
    assert!(
        lines.len() == 1 && lines[0].contains("-> to band"),
        "{lines:?}"
    );
    assert_eq!(
        found("mh1 to house  time 3", "mh1 to house  time 4"),
        ["cue 2: mh1 time 3 -> 4"]
    );
}
