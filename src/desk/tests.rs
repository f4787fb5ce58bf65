#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]

use proptest::prelude::*;

use super::osc::{self, Argument};
use super::patch::Patch;
use super::performance::Performance;
use super::wire::{self, Sender};
use super::{Loss, qlc};
use footlight_host::work::Work;
use footlight_show::diagnostic::Sources;
use footlight_show::lang;
use footlight_show::model::Show;
use footlight_show::timeline::Timeline;
use footlight_show::units::{CueNumber, Time};

fn parsed(text: &str) -> Show {
    let mut sources = Sources::default();
    lang::parse(&mut sources, "test.lxq", text).show.unwrap()
}

fn seconds(seconds: f64) -> Time {
    Time::nearest(seconds)
}

#[test]
fn a_loss_says_its_place() {
    let loss = Loss::new("a curve").line(7).cue("2.5");
    assert_eq!(loss.to_string(), "line 7, cue 2.5: a curve");
}

/// Offsets and values of ANSI E1.31-2018, tables 4-1, 5-1 and 7-1.
#[test]
fn an_e131_packet_is_laid_out_as_the_standard_has_it() {
    let source = Sender {
        cid: [9; 16],
        name: "x".repeat(80),
        priority: 120,
    };
    let packet = wire::sacn(&source, 0x0203, 5, &[1, 2, 3], true);
    assert_eq!(packet.len(), 638);
    assert_eq!(&packet[..4], [0, 16, 0, 0]);
    assert_eq!(&packet[4..16], b"ASC-E1.17\0\0\0");
    for (at, length) in [(16, 638 - 16), (38, 638 - 38), (115, 638 - 115)] {
        assert_eq!(
            u16::from_be_bytes([packet[at], packet[at + 1]]),
            0x7000 | length
        );
    }
    assert_eq!(
        (&packet[18..22], &packet[22..38]),
        (&[0, 0, 0, 4][..], &[9; 16][..])
    );
    assert_eq!((packet[44], packet[106], packet[107]), (b'x', b'x', 0));
    assert_eq!((packet[108], packet[111], packet[112]), (120, 5, 0x40));
    assert_eq!(&packet[113..115], [2, 3]);
    assert_eq!(&packet[117..126], [2, 0xa1, 0, 0, 0, 1, 2, 1, 0]);
    assert_eq!(&packet[126..130], [1, 2, 3, 0]);
    assert_eq!(wire::sacn(&source, 1, 5, &[], false)[112], 0);
    assert_eq!(wire::sacn_group(0x0203), [239, 255, 2, 3]);
}

#[test]
fn an_artdmx_packet_is_laid_out_as_the_standard_has_it() {
    let packet = wire::artnet(0x0123, 0, &[4, 5]);
    assert_eq!(
        &packet[..18],
        b"Art-Net\0\x00\x50\x00\x0e\x01\x00\x23\x01\x02\x00"
    );
    assert_eq!(
        (packet.len(), packet[18], packet[19], packet[20]),
        (530, 4, 5, 0)
    );
}

#[test]
fn messages_come_back() {
    let arguments = [
        Argument::Int(-3),
        Argument::Float(0.5),
        Argument::Text("Été".to_owned()),
    ];
    let packet = osc::write("/footlight/cue", &arguments);
    let read = osc::read(&packet);
    assert_eq!(
        (read[0].address.as_str(), &read[0].arguments[..]),
        ("/footlight/cue", &arguments[..])
    );
    let mut bundle = b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec();
    for _ in 0..2 {
        bundle.extend((packet.len() as u32).to_be_bytes());
        bundle.extend(&packet);
    }
    assert_eq!(osc::read(&bundle).len(), 2);
    assert_eq!(osc::read(b"/go\0")[0].arguments, []);
    assert_eq!(osc::read(b"go\0\0"), []);
}

const SHOW: &str = "show \"S\"\nbank a channel 1\nbank b channel 2  dimmer square\nbank c channel 511  rgb\n\
    cue 1 { snap  a 30  c full #ff0000 }\ncue 2 { time 2  a full  b 50  follow 3 }\n\
    cue 3 { time 1  c out }\ncue 4 { time 4  blackout }\n";

#[test]
fn banks_are_at_their_channels() {
    let show = parsed(SHOW);
    let (patch, losses) = Patch::of_channels(&show);
    // The three addresses of `c` would exceed the universe.
    assert_eq!(losses[0].to_string(), "bank `c` is at address 1/3");
    let mut frames = patch.dark();
    patch.fill(&[1.0, 0.25, 0.0, 0.5, 2.0], &mut frames);
    assert_eq!(&frames[&1][..6], [255, 64, 0, 128, 255, 0]);
}

#[test]
fn a_patch_file_says_where_banks_are() {
    let show = parsed(SHOW);
    let text = "a 1/1 // the rail\na 2/10\nb 2/511 16bit\nc 3/1 16bit\n";
    let patch = Patch::parse(&show, text).unwrap();
    let mut frames = patch.dark();
    patch.fill(&[1.0, 0.5, 0.0, 1.0 / 65535.0, 1.0], &mut frames);
    assert_eq!((frames[&1][0], frames[&2][9]), (255, 255));
    assert_eq!(&frames[&2][510..], [128, 0]);
    assert_eq!(&frames[&3][..6], [0, 0, 0, 1, 255, 255]);
    for (text, said) in [
        ("d 1/1", "line 1: there is no bank called `d`"),
        (
            "\na 1",
            "line 2: `1` is no address: universe and number, such as `2/101`",
        ),
        (
            "a 1/1\nb 1/1",
            "line 2: `b` takes address 1, which line 1 has",
        ),
        (
            "c 1/511",
            "line 1: `c` takes 3 addresses and goes beyond 512",
        ),
        (
            "a 1/1 9bit",
            "line 1: write a bank, its address, and `16bit` where it has two bytes: `lamps 1/101 16bit`",
        ),
    ] {
        assert_eq!(Patch::parse(&show, text).unwrap_err().to_string(), said);
    }
}

/// A head that hangs at the origin, 5 m up, and points straight down at home.
const HEADS: &str = "show \"H\"\n\
    light mh spot at 0, 0, 5  aim 0, 0, 0  beam 10  field 16  9000 cd  moves pan -180 to 360  tilt -90 to 90\n\
    light m2 like mh  at 2, 0, 5  aim 2, 0, 0\nbank a = mh m2  channel 1\n\
    cue 1 { snap  mh pan 90 tilt 45  a full }\n\
    cue 2 { mh beam 30 field 40 time 4 }\ncue 3 { mh beam 20 time 1 }\ncue 4 { mh pan 0 time 2 }\n";

#[test]
fn heads_are_sent_over_their_ranges() {
    let show = parsed(HEADS);
    let text =
        "a 1/1\na 1/11\nmh pan 1/2 tilt 1/4 8bit field 1/5 60 to 4\nm2 tilt 2/1 8bit 90 to -90";
    let patch = Patch::parse(&show, text).unwrap();
    let timeline = Timeline::new(&show).unwrap();
    let at = |time: f64| {
        let mut frames = patch.dark();
        patch.fill(
            &super::patch::values(&show, &timeline, seconds(time)),
            &mut frames,
        );
        let word = |at: usize| u16::from_be_bytes([frames[&1][at], frames[&1][at + 1]]);
        (
            frames[&1][0],
            word(1),
            frames[&1][3],
            word(4),
            frames[&2][0],
        )
    };
    // Pan 90 of -180 to 360, tilt 45 of -90 to 90, and a field of 16 from 60 down to 4.
    let field = (65535.0 * 44.0 / 56.0_f64).round() as u16;
    assert_eq!(at(0.0), (255, 32768, 191, field, 128));
    let last = timeline.end().seconds();
    assert_eq!(at(last).1, (65535.0_f64 / 3.0) as u16);
    // Halfway through the last cue.
    assert_eq!(
        at(last - 1.0).1,
        (65535.0 * 225.0 / 540.0_f64).round() as u16
    );
    // The head's range exceeds the fixture's.
    let wide = Patch::parse(&show, "mh pan 1/1 0 to 80 tilt 1/3 -45 to 135").unwrap();
    let mut frames = wide.dark();
    wide.fill(
        &super::patch::values(&show, &timeline, seconds(0.0)),
        &mut frames,
    );
    assert_eq!(frames[&1][..4], [255, 255, 128, 0]);
    let losses = |patch: &Patch| {
        let losses = patch.heads_without_address(&show);
        losses.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(
        losses(&patch),
        ["no address for pan and tilt of m2: write it into the patch, `m2 pan 1/101 tilt 1/103`"]
    );
    assert_eq!(
        losses(&Patch::of_channels(&show).0),
        [
            "no address for pan and tilt of mh m2: write it into the patch, `mh pan 1/101 tilt 1/103`",
            "no address for zoom of mh: write it into the patch, `mh field 1/105`"
        ]
    );
    let usage = "`mh` is a head: write its axes with their addresses, `mh pan 1/101 tilt 1/103`; behind an \
                 address may stand `8bit`, and the angles of 0 and full, `-270 to 270`";
    for (text, said) in [
        ("mh 1/1", usage),
        ("mh pan", usage),
        ("mh pan 1/1 16bit", usage),
        ("mh pan 1/1 90", usage),
        ("mh pan 1/1 90 to 90", usage),
        (
            "a pan 1/1",
            "there is no head called `a`: a head is a light that moves",
        ),
        ("mh pan 1/512", "`mh` takes 2 addresses and goes beyond 512"),
        (
            "mh pan 1/1 tilt 1/2",
            "`mh` takes address 2, which line 1 has",
        ),
    ] {
        assert_eq!(
            Patch::parse(&show, text).unwrap_err(),
            format!("line 1: {said}")
        );
    }
}

#[test]
fn a_head_goes_where_the_operator_is() {
    let show = parsed(HEADS);
    let mut run = Performance::new(&show).unwrap();
    // Pan is the first value after that of the bank.
    assert!(
        (run.values(seconds(1.0))[1] - 1.0 / 3.0).abs() < 1e-12,
        "at home"
    );
    for time in [10.0, 20.0, 20.5] {
        assert!(run.go(seconds(time)).unwrap());
    }
    // Cue 3 comes while the field is still narrow: beam and field go straight to its end.
    let zoom = |time: f64| [3, 4].map(|i| 4.0 + 56.0 * run.values(seconds(time))[i]);
    let [beam, field] = zoom(21.5);
    assert!(
        (beam - 20.0).abs() < 1e-9 && (field - 40.0).abs() < 1e-9,
        "{beam} {field}"
    );
    let [beam, field] = zoom(21.0);
    assert!(beam < field, "{beam} {field}");
    assert!(
        run.goto(CueNumber::parse("1").unwrap(), seconds(30.0))
            .unwrap()
    );
    let home = show.heads()[0].1.home;
    assert!((run.values(seconds(30.0))[1] - 0.5).abs() < 1e-12);
    assert!((4.0 + 56.0 * run.values(seconds(30.0))[3] - home.beam).abs() < 1e-9);
}

#[test]
fn cues_start_when_somebody_says_so() {
    let show = parsed(SHOW);
    let mut run = Performance::new(&show).unwrap();
    let at = |run: &Performance<'_>, time: f64| run.values(seconds(time));
    assert_eq!((run.cue(seconds(5.0)), at(&run, 5.0)), (None, vec![0.0; 5]));
    assert!(run.go(seconds(10.0)).unwrap());
    assert_eq!(at(&run, 10.0), [0.3, 0.0, 1.0, 0.0, 0.0]);
    assert!(run.go(seconds(20.0)).unwrap());
    assert!((at(&run, 21.0)[0] - 0.65).abs() < 1e-9, "halfway up");
    assert!(
        (at(&run, 22.5)[1] - 0.25).abs() < 1e-9,
        "through its dimmer"
    );
    // Cue 3 follows three seconds after the GO of cue 2.
    assert_eq!(
        (run.cue(seconds(22.9)), run.cue(seconds(23.1))),
        (Some(1), Some(2))
    );
    assert!((at(&run, 23.5)[2] - 0.5).abs() < 1e-9);
    // An earlier GO starts it at once.
    run.back(seconds(30.0)).unwrap();
    assert_eq!(run.cue(seconds(30.0)), Some(1));
    run.go(seconds(40.0)).unwrap();
    assert_eq!((run.cue(seconds(40.0)), at(&run, 41.0)[2]), (Some(2), 0.0));
    // Going to another cue restores its whole state.
    assert!(
        run.goto(CueNumber::parse("1").unwrap(), seconds(50.0))
            .unwrap()
    );
    assert_eq!(at(&run, 50.0), [0.3, 0.0, 1.0, 0.0, 0.0]);
    assert!(
        !run.goto(CueNumber::parse("9").unwrap(), seconds(51.0))
            .unwrap()
    );
    assert!(run.hold("b", 1.0) && !run.hold("nothing", 1.0));
    assert_eq!(at(&run, 52.0)[1], 1.0);
    run.release();
    assert_eq!(at(&run, 52.0)[1], 0.0);
    run.goto(CueNumber::parse("4").unwrap(), seconds(60.0))
        .unwrap();
    assert_eq!(at(&run, 64.0), vec![0.0; 5]);
    assert!(!run.go(seconds(70.0)).unwrap(), "the last");
}

#[test]
fn a_workspace_has_every_cue() {
    let show = parsed(SHOW);
    let carried = qlc::write(&show, &Timeline::new(&show).unwrap(), Work::silent()).unwrap();
    assert!(carried.text.contains(
        "<Step Number=\"1\" FadeIn=\"2000\" Hold=\"1000\" FadeOut=\"0\" Note=\"\">2</Step>"
    ));
    assert!(
        carried
            .text
            .contains("<FixtureVal ID=\"1\">0,64</FixtureVal>")
    );
    assert!(
        carried
            .text
            .contains("<FixtureVal ID=\"2\">0,255,1,0,2,0</FixtureVal>")
    );
    assert!(
        roxmltree::Document::parse_with_options(
            &carried.text,
            roxmltree::ParsingOptions {
                allow_dtd: true,
                ..Default::default()
            },
        )
        .is_ok()
    );
    let losses: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    assert_eq!(losses.len(), 3, "{losses:?}");
    assert_eq!(losses[0], "bank `c` is at address 1/3");
    let heads = parsed(HEADS);
    let carried = qlc::write(&heads, &Timeline::new(&heads).unwrap(), Work::silent()).unwrap();
    let plain = "pan, tilt and zoom of moving heads";
    assert_eq!(carried.losses, [Loss::new(plain)]);
    // The square of a straight fade is not the straight fade of its square.
    let bent = "its times, curves and effects are one crossfade";
    assert_eq!(
        losses[1..],
        ["cue 2", "cue 4"].map(|cue| format!("{cue}: {bent}"))
    );
}

proptest! {
    /// Any packet is read without a panic, into at most as many messages as it has bytes for.
    #[test]
    fn any_packet_is_read(packet in prop::collection::vec(prop::sample::select(&b"#bundle\0/,ifs\x04\x10"[..]), 0..80)) {
        prop_assert!(osc::read(&packet).len() <= packet.len());
    }
}
