//! Positions of heads, exported and imported.

use super::*;

const HEADS: &str = "show \"Heads\"\n\
    light mh1 spot at -2, 0, 5 aim -2, 0, 0 beam 12 field 18 9000 cd  moves  pan -180 to 360  tilt -90 to 90\n\
    light mh2 like mh1 at 0, 0, 5 aim 0, 0, 0\n\
    light l spot at 0, 0, 3 aim 0, 3, 0 beam 20 field 30 900 cd  moves\n\
    light s spot at 0, 0, 3 aim 0, 0, 0 beam 20 field 30 900 cd\n\
    bank heads = mh1 mh2  channel 5\nbank sky = l  channel 9  rgb\nbank lamp = s  channel 7\n\
    point band = 0, 4, 1\n\
    cue 1 { snap  heads 30  lamp 20 }\n\
    cue 2 { up 4  down 9  delay 1  mh1 pan 123.45 tilt -67.8  sky 60 #ff8000  heads 10 }\n\
    cue 3 { heads to band  time 2  part 2 { time 6  sky full  l pan 20 } }\n\
    cue 4 { cueonly  l tilt 3  sky out }\ncue 5 { mh2 beam 5 field 9  curve ease  mh1 pan 0  time 3 }\n";

/// A head's name, its pan and tilt at a cue's completion, and the time of its move, if any.
type Posed = (String, f64, f64, Option<Time>);

/// The heads by cue.
fn poses(show: &Show) -> Vec<Vec<Posed>> {
    let mut held = show.dark_levels();
    let mut out = Vec::new();
    for moves in cue_moves(show).unwrap() {
        let mut times = BTreeMap::new();
        for one in &moves {
            let to = one.motion.target();
            let pose = one.parameter.checked_sub(show.first_pose());
            if let (Some(pose), true) = (pose.filter(|p| p % 4 < 2), held[one.parameter] != to) {
                times.insert(pose / 4, one.timing.up + one.timing.delay);
            }
            held[one.parameter] = to;
        }
        let pose = |(head, (light, _, bank)): (usize, &(usize, _, usize))| {
            let pose = show.pose_of(&held, head);
            let several = show.banks[*bank].lights.len() > 1;
            let name = if several {
                &show.lights[*light].name
            } else {
                &show.banks[*bank].name
            };
            (name.clone(), pose.pan, pose.tilt, times.get(&head).copied())
        };
        let mut all: Vec<_> = show.heads().iter().enumerate().map(pose).collect();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        out.push(all);
    }
    out
}

#[test]
fn positions_come_back() {
    let show = parsed(HEADS);
    let carried = exported(&show);
    insta::assert_snapshot!(&carried.text[carried.text.find("$ParamType").unwrap()..], @r#"
        $ParamType 1 1 Intens
        $ParamType 2 2 Pan
        $ParamType 3 2 Tilt
        $ParamType 12 3 Red
        $ParamType 13 3 Green
        $ParamType 14 3 Blue

        $Personality 90001
           $$Manuf Generic
           $$Model Head
           $$Footprint 5
           $$PersChan 1 1 1 0 0
           $$PersChan 2 2 2 3 32768
           $$PersSlot 0 65535 32768 -180 360
           $$PersChan 3 2 4 5 32768
           $$PersSlot 0 65535 32768 -90 90

        $Personality 90002
           $$Manuf Generic
           $$Model Head_RGB
           $$Footprint 12
           $$PersChan 1 2 1 2 0
           $$PersChan 2 2 3 4 32768
           $$PersSlot 0 65535 32768 -270 270
           $$PersChan 3 2 5 6 32768
           $$PersSlot 0 65535 32768 -135 135
           $$PersChan 12 2 7 8 65535
           $$PersChan 13 2 9 10 65535
           $$PersChan 14 2 11 12 65535

        $Personality 90003
           $$Manuf Generic
           $$Model Dimmer
           $$Footprint 1
           $$PersChan 1 1 1 0 0

        $Patch 5 90001 0 0 1
           Text mh1
        $Patch 10 90001 0 0 1
           Text mh2
        $Patch 9 90002 0 0 1
           Text sky
        $Patch 7 90003 0 0 1
           Text lamp


        Cue 1 1
           Up 0
           Down 0
           $$ChanMove  5@H4d 7@H33 10@H4d
           Chan  5@H4d 7@H33 10@H4d
           $$Param 5 2@21845 3@32768
           $$Param 10 2@21845 3@32768
           $$Param 9 2@32768 3@43690

        Cue 2 1
           Part 1
           Up 4 1
           Down 9 1
           $$TimeColor 9 1
           $$ChanMove  5@H1a 9@H99 10@H1a
           Chan  5@H1a 7@H33 9@H99 10@H1a
           $$Param 9 12@65535 13@14146 14@0
           Part 2
           Up 4 1
           Down 4 1
           $$Param 5 2@36827 3@8083

        Cue 3 1
           Part 1
           Up 6
           Down 6
           $$ChanMove  9@Hff
           Chan  5@H1a 7@H33 9@Hff 10@H1a
           $$Param 9 2@35195 3@43690
           Part 2
           Up 2
           Down 2
           $$Param 5 2@40466 3@15222
           $$Param 10 2@21845 3@49151

        Cue 4 1
           Up 5
           Down 5
           $$ChanMove  9@H00
           Chan  5@H1a 7@H33 10@H1a
           $$Param 9 2@35195 3@33496

        Cue 5 1
           Part 1
           Up 5
           Down 5
           $$ChanMove  9@Hff
           Chan  5@H1a 7@H33 9@Hff 10@H1a
           $$Param 9 2@35195 3@43690
           Part 2
           Up 3
           Down 3
           $$Param 5 2@21845 3@15222

        EndData
        "#);
    let losses = |losses: &[crate::Loss]| {
        let losses = losses.iter().map(ToString::to_string);
        losses.collect::<Vec<_>>().join("\n")
    };
    insta::assert_snapshot!(losses(&carried.losses), @r#"
        zoom of moving heads
        cue 2: `sky.g`: its curve is a straight fade to its last level
        cue 2: `sky.b`: its curve is a straight fade to its last level
        "#);
    let back = imported(&carried.text);
    insta::assert_snapshot!(losses(&back.losses), @r#"
        where heads hang: mh1_head sky_head mh2_head at 0, 0, 5 here; their angles are the desk's
        line 18: `$personality` is not read (9 records, the first here): of a type of fixture its colours, and degrees of pan and tilt, are read
        "#);
    insta::assert_snapshot!(back.text, @r#"
        // From test.asc, ETC Eos. A bank without lights is a channel of the desk.

        show "Heads"

        light mh1_head  spot  at 0, 0, 5  aim 0, 0, 0  beam 12  field 18  10000 lm  moves  pan -180 to 360  tilt -90 to 90
        light sky_head  spot  at 0, 0, 5  aim 0, 0, 0  beam 12  field 18  10000 lm  moves  pan -270 to 270  tilt -135 to 135
        light mh2_head  spot  at 0, 0, 5  aim 0, 0, 0  beam 12  field 18  10000 lm  moves  pan -180 to 360  tilt -90 to 90

        bank mh1 = mh1_head  channel 5
        bank lamp  channel 7
        bank sky = sky_head  channel 9  rgb
        bank mh2 = mh2_head  channel 10

        cue 1 {
          snap
          mh1_head pan 0 tilt 0
          mh1 30
          lamp 20
          sky_head pan 0 tilt 45
          mh2_head pan 0 tilt 0
          mh2 30
        }
        cue 2 {
          time 4/9  delay 1
          mh1 10
          sky 60
          mh2 10
          sky #ff8000  time 9
          part 2 { time 4  mh1_head pan 123.45 tilt -67.8 }
        }
        cue 3 {
          time 6
          sky_head pan 20
          sky full
          part 2 { time 2  mh1_head pan 153.43 tilt -48.19  mh2_head tilt 45 }
        }
        cue 4 { sky_head tilt 3  sky out }
        cue 5 {
          sky_head tilt 45
          sky full
          part 2 { time 3  mh1_head pan 0 }
        }
        "#);
    // Half a step of 540 degrees, and half a hundredth.
    for (cue, (was, is)) in poses(&show)
        .iter()
        .zip(poses(&parsed(&back.text)))
        .enumerate()
    {
        assert_eq!(was.len(), is.len());
        for (was, is) in was.iter().zip(is) {
            let off = (was.1 - is.1).abs().max((was.2 - is.2).abs());
            assert!(was.0 == is.0 && off < 0.0092, "{was:?} {is:?}");
            // Heads not yet moved are written in the first cue.
            assert!(cue == 0 || was.3 == is.3, "{was:?} {is:?}");
        }
    }
}

/// A fixture type defined at the desk: 8 bits, and inverted tilt. Palettes and percentages are not
/// degrees.
#[test]
fn degrees_are_those_of_the_type() {
    let text = |slot: &str| {
        format!(
            "Ident 3:0\nManufacturer ETC\nConsole Eos\n$Personality 7\n   $$PersChan 1 1 1 0 0\n   \
             $$PersChan 2 2 2 3 32768\n   $$PersSlot 0 65535 32768 -270.000000 270.000000\n   \
             $$PersChan 3 1 4 0 128\n   {slot}\n$Patch 1 7 1 0 1\n   Text Spot\nCue 1 1\n   Up 3\n   \
             Down 3\n   $$ChanMove 1@Hff\n   Chan 1@Hff\n   $$Param 1 2@49151 3@b0\nCue 2 1\n   Up 4\n   \
             $$Param 1 2@FP3 3@a255\nCue 3 1\n   Up 5\n   $$Param 1 3@255\n"
        )
    };
    let carried = imported(&text("$$PersSlot 0 255 128 120.000000 -120.000000"));
    let at = carried.text.find("light").unwrap();
    insta::assert_snapshot!(&carried.text[at..], @r#"
        lights is a channel of the desk.

        show "test"

        light spot_head  spot  at 0, 0, 5  aim 0, 0, 0  beam 12  field 18  10000 lm  moves  pan -270 to 270  tilt -120 to 120

        bank spot = spot_head  channel 1

        cue 1 { time 3  spot_head pan 135 tilt 120  spot full }
        cue 2 { time 4  spot out }
        cue 3 { spot_head tilt -120 }
        "#);
    assert_eq!(parsed(&carried.text).heads().len(), 1);
    let told: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(told.join("\n"), @r#"
        where heads hang: spot_head at 0, 0, 5 here; their angles are the desk's
        line 18, cue 2: channels 1 go out: the cue's `Chan` has them not, and no `$$ChanMove` says so
        line 20, cue 2: channel 1: parameters 2@FP3 (more emitters, positions, shapes)
        "#);
    for slot in [
        "$$PersSlot 0 255 128 0.000000 100.000000 %",
        "$$PersSlot 0 255 128 0 0",
        "$$PersSlot 0 0 0 -1 1",
        "$$PersSlot 0 255",
        "",
    ] {
        let carried = imported(&text(slot));
        assert!(!carried.text.contains("light "), "{}", carried.text);
        let told = |loss: &crate::Loss| loss.what.starts_with("channel 1: parameters 2@49151 3@0");
        assert!(carried.losses.iter().any(told), "{:?}", carried.losses);
    }
}

/// A bank's colour and a head's axis move in one part of a cue, and may span several records.
#[test]
fn what_stands_in_two_parts_moves_in_the_later_one() {
    let text = "Ident 3:0\nManufacturer ETC\nConsole Eos\n$Personality 7\n  $$PersChan 1 1 1 0 0\n  \
        $$PersChan 2 1 2 0 0\n  $$PersSlot 0 255 0 -255 255\n  $$PersChan 3 1 3 0 0\n  \
        $$PersSlot 0 255 0 -102 102\n$Patch 1 7 1\nCue 1 1\n  Part 1\n  Up 3\n  $$ChanMove 1@Hff\n  \
        $$Param 1 2@255\n  $$Param 1 3@255 12@255\n  Part 2\n  Up 5\n  $$Param 1 13@0 14@0\n  \
        $$Param 1 3@0\n";
    let carried = imported(text);
    let at = carried.text.find("cue").unwrap();
    insta::assert_snapshot!(&carried.text[at..], @r#"
        cue 1 {
          time 3
          ch1_head pan 255
          ch1 full
          part 2 { time 5  ch1_head tilt -102  ch1 #ff0000 }
        }
        "#);
    let told: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(told.join("\n"), @r#"
        where heads hang: ch1_head at 0, 0, 5 here; their angles are the desk's
        line 19, cue 1: channel 1 stands in two parts: the later one counts
        line 20, cue 1: channel 1 stands in two parts: the later one counts
        "#);
    parsed(&carried.text);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Damaged positions and ranges are read or listed.
    #[test]
    fn damaged_positions_are_no_fault(at in 0.0..1.0_f64, text in "[-0-9.@ nainfFP\n]{1,4}") {
        let mut file = exported(&parsed(HEADS)).text.into_bytes();
        let at = (at * file.len() as f64) as usize;
        for (place, byte) in file.iter_mut().skip(at).zip(text.bytes()) {
            *place = byte;
        }
        if let (_, Ok(carried)) = import("test.asc", &file, None, Work::silent()) {
            parsed(&carried.text);
        }
    }
}
