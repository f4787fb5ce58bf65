#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test's own data"
)]

mod heads;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use proptest::prelude::*;

use super::model::{step, tenths};
use super::{import, write};
use crate::{Carried, ImportError};
use footlight_host::work::{Progress, Work};
use footlight_show::diagnostic::{Sources, Style, render};
use footlight_show::lang;
use footlight_show::model::{Link, Show};
use footlight_show::timeline::{Timeline, cue_moves};
use footlight_show::units::{Rgb, Time};

fn parsed(text: &str) -> Show {
    let mut sources = Sources::default();
    let parsed = lang::parse(&mut sources, "test.lxq", text);
    let errors = render(&parsed.diagnostics, &sources, Style::Plain);
    parsed.show.unwrap_or_else(|| panic!("{errors}\n{text}"))
}

fn exported(show: &Show) -> Carried {
    write(show, &Timeline::new(show).unwrap(), Work::silent()).unwrap()
}

fn imported(text: &str) -> Carried {
    import("test.asc", text.as_bytes(), None, Work::silent())
        .1
        .unwrap()
}

/// Per channel after a cue: the level, its colour, and the delay and time of its change.
type Done = BTreeMap<u32, (i64, Option<[u8; 3]>, Time, Time)>;

/// By cue: the state of each channel, in thousandths, with the time of its change; then the link.
fn states(show: &Show) -> Vec<(String, Done, Option<Link>)> {
    let parameters = show.parameters();
    let mut held = show.dark_levels();
    let first = show.first_parameters();
    let mut out = Vec::new();
    for (cue, moves) in show.cues.iter().zip(cue_moves(show).unwrap()) {
        let mut done = Done::new();
        for one in &moves {
            let (was, to) = (held[one.parameter], one.motion.target());
            let bank = parameters[one.parameter].bank.unwrap();
            let time = if to > was {
                one.timing.up
            } else {
                one.timing.down
            };
            held[one.parameter] = to;
            if was != to {
                let entry = done.entry(show.banks[bank].channel.unwrap()).or_default();
                (entry.2, entry.3) = (one.timing.delay, time);
            }
        }
        for (bank, first) in show.banks.iter().zip(&first) {
            let colour = || Rgb([held[first + 1], held[first + 2], held[first + 3]]).to_srgb8();
            let entry = done.entry(bank.channel.unwrap()).or_default();
            entry.0 = (held[*first] * 1000.0).round() as i64;
            entry.1 = bank.rgb.then(colour).filter(|colour| *colour != [255; 3]);
        }
        done.retain(|_, one| *one != Default::default());
        let label = format!("{} {}", cue.number, cue.label);
        out.push((label, done, cue.link.map(|(_, link)| link)));
    }
    out
}

#[track_caller]
fn comes_back(text: &str) -> String {
    let show = parsed(text);
    let back = imported(&exported(&show).text).text;
    assert_eq!(states(&parsed(&back)), states(&show), "{back}");
    assert_eq!(lang::format(&back).unwrap(), back);
    back
}

#[test]
fn steps_are_percents_as_desks_round_them() {
    assert_eq!([0, 128, 196, 255].map(tenths), [0, 500, 770, 1000]);
    for of in 0..=255 {
        assert_eq!(step(tenths(of)), of);
    }
    for percent in 0..=100 {
        assert_eq!(tenths(step(percent * 10)), percent * 10);
    }
}

const EOS: &str = "\
Ident 3:0
Manufacturer ETC
Console Eos
$$Title Trial
! a comment
Set $$TimeUp 4 0
Set $$TimeDown 4 0

$Personality 7
   $$PersChan     1     1     1     0     0
   $$PersChan    12     2     2     3 65535
   $$PersChan    13     2     4     5 65535
   $$PersChan    14     2     6     7 65535
$Patch 1 8 1 0 1
   Text Caf
   $$UText 4300 6100 6600 E900
$Patch 2 8 2
$Patch 3 8 3
$Patch 9 7 20
   Text Cyc
$Patch 50 8 50
$ColorPalette 3
   $$Param  9 12@65535 13@0 14@0
$Group 1
   Text Front
   $$ChanList 1 2 thru 3
$Curve 4
   Text Slow
   $$CurvePoint 0@0 50@20
   $$CurvePoint 100@100
$Effect 1
   Text Candle
CueList 1
Cue 1 1
   Text Preset
   Up 0
   Down 0
   $$ChanMove 1@H80 2@H80 3@H80 9@H33
   Chan 1@H80 2@H80 3@H80 9@H33
   $$Param  9 12@CP3 13@CP3 14@CP3 48@255
Cue 2.5 1
   Up 6 1
   Down 9 2
   $$Curve 4
   $$ChanMove 1@H00 2@Hff
   Chan 2@Hff 3@H80 9@H33
   $$ParamTimes 2 1 3 -
   $$Param  9 12@0 13@0 14@65535
   FollowOn 12
   $$Hang 3
Cue 7 1
   Text Out
   $$Block
   $$TimePosition 3 0 1 1
   $$ChanMove 2@H00 3@H00 9@H00
Cue 8 2
   Chan 1@H80
EndData
Cue what is behind the end is not read
";

#[test]
fn an_eos_file_becomes_a_designers_text() {
    let carried = imported(EOS);
    insta::assert_snapshot!(carried.text, @r#"
        // From test.asc, ETC Eos. A bank without lights is a channel of the desk.

        show "Trial"
        default time 4

        bank café  channel 1
        bank ch2   channel 2
        bank ch3   channel 3
        bank cyc   channel 9  rgb

        group front = café ch2 ch3
        curve slow = linear 0 0, 0.5 20, 1 100

        cue 1 "Preset" { snap  front 50  cyc 20 #ff0000 }
        cue 2.5 {
          time 9  delay 2  curve slow
          café out
          ch2 full     time 3  delay 0
          cyc #0000ff  time 6  delay 1
          hang 3
        }
        cue 7 "Out" { block  blackout }
        "#);
    let losses: String = carried.losses.iter().fold(String::new(), |mut out, loss| {
        let _ = writeln!(out, "{loss}");
        out
    });
    insta::assert_snapshot!(losses, @r#"
        channels 50 have no bank: nothing lights them, and no group or look has them
        line 31: `$effect` is not read (3 records, the first here): effects are written by hand: `effect NAME = …`
        line 40, cue 1: channel 9: parameters 48@255 (more emitters, positions, shapes)
        line 54: `cue $$timeposition` is not read (1 record): positions take the up time
        line 56: list 2 (1 cue) is left out: `--list 2` reads it in place of this one
        line 59: cues behind `EndData`, where the file ends, are not read
        "#);
}

#[test]
fn what_a_file_says_twice_or_too_late_is_told() {
    let text = "Ident 3:0\nCue 1\nUp 3\nDown 3\nUp 4\nChan 1@50 2@10 1@60 2@10\nPart 2\nUp 5\n\
                Chan 3@10\nEndData\nCue 2\n Chan 1@10\n";
    let carried = imported(text);
    let told: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "line 5, cue 1: `up` stands twice: the last counts",
            "line 6, cue 1: channel 1 has two levels: the last counts",
            "line 11: cues behind `EndData`, where the file ends, are not read",
        ]
    );
    let states = states(&parsed(&carried.text));
    assert_eq!(states.len(), 1);
    assert_eq!(states[0].1[&1].0, 600);
}

#[test]
fn a_file_may_be_in_utf_16() {
    let text = "\u{feff}Ident 3:0\r\nCue 1\r\nText B\u{fc}hne\r\nChan 1@50\r\n";
    let read = |units: fn(u16) -> [u8; 2]| {
        let bytes: Vec<u8> = text.encode_utf16().flat_map(units).collect();
        let carried = import("test.asc", &bytes, None, Work::silent()).1;
        carried.unwrap().text
    };
    assert!(read(u16::to_le_bytes).contains("B\u{fc}hne"));
    assert_eq!(read(u16::to_le_bytes), read(u16::to_be_bytes));
}

/// An unknown record after any line is listed among the losses, except in a cue list that is
/// skipped as a whole.
#[test]
fn no_record_goes_unreported() {
    let whats = |text: &str| -> Vec<String> {
        let losses = imported(text).losses;
        losses.into_iter().map(|loss| loss.what).collect()
    };
    let known = whats(EOS);
    let lines: Vec<&str> = EOS.lines().collect();
    let end = lines.iter().position(|line| *line == "Cue 8 2").unwrap();
    for at in 1..end {
        let mut more = lines.clone();
        more.insert(at, "   $$Unknown 1");
        assert_ne!(whats(&more.join("\n")), known, "behind `{}`", lines[at - 1]);
    }
}

#[test]
fn a_plain_file_says_what_is_lit() {
    let carried = imported(
        "IDENT 3:0\npatch 1 1<1@100 2<2@50\nCue 1\nchan 1=40,2@30\nCue 2\nPart 1\nUp 3\nChan 2@60\n\
         Part 2\nText Slow\nUp 1:20 5\nChan 3@HFF\nCue 3\nUp 0\nLink 1\n",
    );
    insta::assert_snapshot!(carried.text, @r#"
        // From test.asc. A bank without lights is a channel of the desk.

        show "test"

        bank ch1  channel 1
        bank ch2  channel 2
        bank ch3  channel 3

        cue 1 { ch1 40  ch2 30 }
        cue 2 {
          time 3
          ch1 out
          ch2 60
          part 2 "Slow" { time 1:20  delay 5  ch3 full }
        }
        cue 3 { snap  blackout }
        "#);
    assert_eq!(carried.losses.len(), 2);
}

#[test]
fn a_show_comes_back() {
    let back = comes_back(
        r#"show "Back"
bank lamps channel 1
bank wash  channel 2
bank sky   channel 3  rgb
group warm = lamps wash
look  night { lamps 10  wash 4 }
cue 1 "Preset" { snap  night  sky 60 #203060 }
cue 2 "Été" { up 6  down 9  delay 1.5  lamps 85  part 2 "the sky" { time 30  delay 4  sky 40 } hang 2 }
cue 2.5 { warm 20  time 3  follow 10 }
cue 3 { cueonly  snap  warm full }
cue 4 { time 2  sky #ff8000 }
cue 5 { assert  time 1  lamps 1 }
cue 6 { blackout  note "Là-bas!" }
"#,
    );
    assert!(
        back.contains("cue 6   { blackout  note \"Là-bas!\" }"),
        "{back}"
    );
    assert!(back.contains("{ snap  night "), "{back}");
}

#[test]
fn what_a_file_cannot_hold_is_listed() {
    let show = parsed(
        "show \"S\"\nlight l spot at 0, 0, 3 aim 0, 0, 0 beam 20 field 30 900 cd\nlight m like l\n\
         bank a = l  dimmer square\nfixed e = m level 10\neffect f = pulse depth 80%\n\
         cue 1 at 0:00 { snap  a 33.3 effect f }\ncue 2 { time 4  curve square  a 73.3 }\n\
         cue 3 { a steps 0 20, 2s 40  note \"now\" }\n",
    );
    let losses: Vec<String> = exported(&show)
        .losses
        .iter()
        .map(ToString::to_string)
        .collect();
    insta::assert_snapshot!(losses.join("\n"), @r#"
        bank `a` has no channel: it is 1 in the file
        cue 2: `a`: its curve is a straight fade to its last level
        cue 3: `a`: its curve is a straight fade to its last level
        fixed `e` is no channel of the desk
        bank `a`: its dimmer is to be set at the desk
        cue 1: effect `f`
        clock times (`at`) of cues 1: they wait for GO
        "#);
}

#[test]
fn a_wrong_file_is_refused_with_its_line() {
    let mut all = String::new();
    for text in [
        "",
        "show \"S\"\n",
        "Cue 1\n  Chan 1@101\n",
        "Cue 1\n  Chan 1@Hgg\n",
        "Cue 1\n  Chan 1\n",
        "Cue 1\n  Chan 0@50\n",
        "Cue 1\n  Up fast\n",
        "Cue 10000\n",
        "Cue 1\nCue 2\nCue 1\n",
        "Group 1\n  1 thru 999999\n",
        "$Curve one\n",
    ] {
        let (text, refused) = import("bad.asc", text.as_bytes(), None, Work::silent());
        let mut sources = Sources::default();
        sources.add("bad.asc", text);
        let Err(ImportError::Refused(refused)) = refused else {
            panic!("{refused:?}");
        };
        let _ = write!(all, "{}", render(&[*refused], &sources, Style::Short));
    }
    insta::assert_snapshot!(all, @r#"
        error: `bad.asc` is no USITT ASCII file: no line begins with a word of it
        error: `bad.asc` is no USITT ASCII file: no line begins with a word of it
        bad.asc:2:3: error: `101` is no level
        bad.asc:2:3: error: `Hgg` is no level
        bad.asc:2:3: error: `1` has no level
        bad.asc:2:3: error: `0` is no channel
        bad.asc:2:3: error: `fast` is no time
        bad.asc:1:1: error: `10000` is no cue number
        bad.asc:3:1: error: cue 1 stands in line 1 already
        bad.asc:2:3: error: more than 10000 channels in a row
        bad.asc:1:1: error: `$curve` needs a number
        "#);
}

/// Output of a current Eos beyond the standard's records.
const RECORDS: &str = "\
Ident 3:0
Manufacturer ETC
Console Eos
$Personality 7
   $$PersChan 1 1 1 0 0
   $$PersChan 12 1 2 0 255
   $$PersChan 13 1 3 0 255
   $$PersChan 14 1 4 0 255
$Patch 1 7 1 0 1
$Curve 902
   Text Slow Bottom
   $$CurveData 0@0 128@51 255@255
$IntensPalette 2
   Chan 2@Hff
Cue 1 1
   Text Go
   $$CueNotes Watch the tenor!
   $$UText 4C00 6900 6500 6400
   $$SceneText Act one
   $$UText 4100
   $$Curve 902
   $$TimeUp 3 0 M 1
   Up 3
   $$ChanMove 1@H80 2@IP2
   Chan 1@H80 2@Hff
   $$Param 1 1@b128 12@b255 13@k0 14@a0
   $$Param 1 12@r0 79@b3
   $$ParamTimes 1 1 M -
$Cue 1.25 1
   $$Text Between
   $$ChanMove 2@H00
   Chan 1@H80
$Cue 5 2
   $$ChanMove 1@Hff
$Cue 6 2
   $$ChanMove 1@H00
";

#[test]
fn records_of_an_eos_are_read() {
    let carried = imported(RECORDS);
    insta::assert_snapshot!(carried.text, @r#"
        // From test.asc, ETC Eos. A bank without lights is a channel of the desk.

        show "test"

        bank ch1  channel 1  rgb
        bank ch2  channel 2

        curve slow_bottom = linear 0 0, 0.502 20, 1 100

        cue 1    "Go"      { time 3  curve slow_bottom  ch1 50 #ff00ff  ch2 full  note "Lied" }
        cue 1.25 "Between" { ch2 out }
        "#);
    let losses: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(losses.join("\n"), @r#"
        line 19: `cue $$scenetext` is not read (1 record)
        line 22, cue 1: `$$timeup 3 0 M 1`: a time by hand is a time of its own here
        line 27, cue 1: channel 1: parameters 12@r0 79@3 (more emitters, positions, shapes)
        line 28: `cue $$paramtimes M` is not read (1 record): a time by hand is the cue's here
        line 33: list 2 (2 cues) is left out: `--list 2` reads it in place of this one
        "#);
}

#[test]
fn one_list_of_several_is_read() {
    let of = |list| import("test.asc", RECORDS.as_bytes(), Some(list), Work::silent()).1;
    let second = of(2).unwrap();
    let at = second.text.find("cue ").unwrap();
    insta::assert_snapshot!(&second.text[at..], @r#"
        cue 5 { ch1 full }
        cue 6 { ch1 out }
        "#);
    let told = second.losses.iter().map(ToString::to_string);
    assert!(
        told.into_iter()
            .any(|loss| loss.contains("list 1 (2 cues) is left out: `--list 1`"))
    );
    let Err(ImportError::Refused(refused)) = of(3) else {
        panic!("there is none");
    };
    assert_eq!(refused.message, "`test.asc` has no cue of list 3");
    assert!(format!("{:?}", refused.help).contains("1 (2 cues), 2 (2 cues)"));
}

/// Cancels after a number of polls.
struct Patience(AtomicUsize);

impl Progress for Patience {
    fn cancelled(&self) -> bool {
        self.0.fetch_sub(1, Ordering::Relaxed) == 0
    }
}

#[test]
fn a_cancel_reaches_the_reader() {
    let text = "Clear All\nCue 1\n  Chan 1@50\nCue 2\n  Chan 1@60\n";
    for looks in 0.. {
        let progress = Patience(AtomicUsize::new(looks));
        let work = Work {
            progress: &progress,
            ..Work::silent()
        };
        match import("test.asc", text.as_bytes(), None, work).1 {
            Err(ImportError::Cancelled(_)) => {}
            other => {
                // Five records and two cues, in two passes each.
                assert!(other.is_ok() && looks == 14, "{looks}: {other:?}");
                break;
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Random moves of plain and rgb banks, in random times, parts and links, survive a round trip.
    #[test]
    fn random_shows_come_back(
        cues in prop::collection::vec(
            (prop::collection::vec((0_usize..5, 0_u32..=100, any::<[u8; 3]>()), 0..5),
             0_u32..4, 0_u32..9, 0_u32..9, 0_u32..3, any::<bool>()),
            1..9,
        ),
    ) {
        let mut text = "show \"R\"\n".to_owned();
        for bank in 0..5 {
            let rgb = if bank > 2 { "rgb" } else { "" };
            let _ = writeln!(text, "bank b{bank} channel {} {rgb}", 10 * bank + 3);
        }
        let last = cues.len();
        for (number, (moves, delay, up, down, link, cueonly)) in cues.iter().enumerate() {
            let _ = write!(text, "cue {} \"c\" {{ time {up}/{down}  delay {delay}", number + 1);
            let mut seen = Vec::new();
            for (bank, level, [r, g, b]) in moves {
                if seen.contains(bank) { continue; }
                seen.push(*bank);
                let colour = format!("#{r:02x}{g:02x}{b:02x}  time {up}");
                let colour = if *bank > 2 { colour } else { String::new() };
                let _ = write!(text, "\n  b{bank} {level} {colour}");
            }
            match link {
                1 if number + 1 < last => text.push_str("\n follow 3.25"),
                2 if number + 1 < last => text.push_str("\n hang 0.125"),
                _ => {}
            }
            // A restored colour with split times would have two times, which no desk supports.
            let cueonly = *cueonly && seen.iter().all(|bank| *bank < 3);
            text.push_str(if cueonly { "\n cueonly }\n" } else { " }\n" });
        }
        comes_back(&text);
    }

    /// Damaged files are read or refused.
    #[test]
    fn damage_is_no_fault(at in 0..EOS.len(), byte in any::<u8>(), cut in 0..EOS.len()) {
        let mut bytes = EOS.as_bytes().to_vec();
        bytes[at] = byte;
        bytes.truncate(cut.max(at));
        if let (_, Ok(carried)) = import("test.asc", &bytes, None, Work::silent()) {
            parsed(&carried.text);
        }
    }
}

#[test]
fn hang_may_be_negative_and_lines_may_end_in_any_way() {
    let file = "Ident 3:0\nManufacturer ETC\nConsole Eos\nCue 1 1\n$$ChanMove 1@Hff\n$$Hang -1\nCue/2\n\
                Text caf\u{e9}\nUp 2\n$$ChanMove 1@H00\nEndData\n";
    let text = |bytes: &[u8]| import("a.asc", bytes, None, Work::silent()).1.unwrap().text;
    let wanted = text(file.as_bytes());
    assert!(wanted.contains("hang -1"), "{wanted}");
    assert!(
        wanted.contains("cue 2 \"café\" { time 2  ch1 out }"),
        "{wanted}"
    );
    assert_eq!(text(file.replace('\n', "\r").as_bytes()), wanted);
    assert_eq!(text(file.replace('\n', "\r\n").as_bytes()), wanted);
    let mut windows: Vec<u8> = file.chars().map(|c| c as u8).collect();
    assert_eq!(text(&windows), wanted);
    let at = windows.iter().position(|b| *b == 0xe9).unwrap();
    windows[at] = 0x96;
    assert!(text(&windows).contains("\"caf\u{2013}\""));
}

#[test]
fn a_channel_in_a_cue_and_in_its_part_moves_in_the_part() {
    let file = "Ident 3:0\nCue 2\nUp 4\nChan 1@30 2@60\nPart 1\nUp 3\nChan 1@75\nEndData\n";
    let carried = import("a.asc", file.as_bytes(), None, Work::silent())
        .1
        .unwrap();
    assert!(
        carried.text.contains("part 2 { time 3  ch1 75 }"),
        "{}",
        carried.text
    );
    assert!(!carried.text.contains("ch1 30"), "{}", carried.text);
    assert_eq!(
        carried.losses[0].to_string(),
        "line 5, cue 2: channel 1 stands in two parts: the later one counts"
    );
    assert_eq!(parsed(&carried.text).cues.len(), 1);
}
