//! Heads: their aims over time, and warnings about them.

use super::planted::seconds;
use crate::model::*;
use crate::timeline::Timeline;

/// The show of two heads that hang 5 m up at the sides, with these cues.
fn heads(cues: &str) -> Show {
    let rig = "show \"Heads\"\n\
        light mh1 spot at -2, 0, 5  aim -2, 0, 0  beam 12  field 18  900 cd  moves  tilt -130 to 130\n\
        light mh2 like mh1  at 2, 0, 5  aim 2, 0, 0\n\
        light key spot at 0, -4, 5  aim 0, 0, 0  beam 12  field 18  900 cd\n\
        point band  = 0, 2, 1\npoint house = 0, -6, 1\n\
        bank keys = key\nbank heads = mh1 mh2\nfixed exit = sign\nlight sign like key\n";
    let mut sources = crate::diagnostic::Sources::default();
    let parsed = crate::lang::parse(&mut sources, "t.lxq", &format!("{rig}{cues}"));
    parsed
        .show
        .unwrap_or_else(|| panic!("{:?}", parsed.diagnostics))
}

/// Distance between `target` and the point of the beam at its distance.
fn points_at(show: &Show, timeline: &Timeline, head: usize, t: f64, target: [f64; 3]) -> f64 {
    let (light, ranges, _) = show.heads()[head];
    let place = show.lights[light].kind.place().unwrap();
    let pose = timeline.pose(head, seconds(t));
    let target = crate::geometry::vec3(target[0], target[1], target[2]);
    let along = ranges.direction(pose.pan, pose.tilt) * (target - place).length();
    (place + along - target).length()
}

const BAND: [f64; 3] = [0.0, 2.0, 1.0];
const HOUSE: [f64; 3] = [0.0, -6.0, 1.0];

#[test]
fn heads_aim_each_by_itself_and_turn_linearly() {
    let show = heads(
        "cue 1 at 0:00 { snap  heads 80 to band }\n\
         cue 2 at 0:10 { heads to house  delay 1  time 4/9 }\n\
         cue 3 at 0:20 { mh1 pan 30 tilt -20  beam 6 }\n",
    );
    let timeline = Timeline::new(&show).unwrap();
    for head in 0..2 {
        assert!(points_at(&show, &timeline, head, 5.0, BAND) < 1e-12);
        assert!(points_at(&show, &timeline, head, 19.0, HOUSE) < 1e-12);
        // The time is the up time, whichever way the head turns.
        let [from, half, to] = [11.0, 13.0, 15.0].map(|t| timeline.pose(head, seconds(t)));
        for axis in [HeadAxis::Pan, HeadAxis::Tilt] {
            let mean = 0.5 * (from.angle(axis) + to.angle(axis));
            assert!((half.angle(axis) - mean).abs() < 1e-12);
        }
        // Over the stage: the yoke turns by less than a quarter.
        assert!((to.pan - from.pan).abs() < 90.0 && from.tilt * to.tilt < 0.0);
        assert!(points_at(&show, &timeline, head, 15.0, HOUSE) < 1e-12);
    }
    let pose = timeline.pose(0, seconds(30.0));
    let all = [
        (pose.pan, 30.0),
        (pose.tilt, -20.0),
        (pose.beam, 6.0),
        (pose.field, 18.0),
    ];
    assert!(all.iter().all(|(is, wanted)| (is - wanted).abs() < 1e-12));
    let knots = timeline.pose_knots(0);
    assert!(knots.windows(2).all(|pair| pair[0] < pair[1]));
    let known = [11.0, 15.0, 20.0].map(seconds);
    assert!(known.iter().all(|knot| knots.contains(knot)), "{knots:?}");
    // The reflected light of heads follows the settings of banks and the fixed light.
    assert_eq!(timeline.coordinates(), 3 + timeline.bounced().len());
    assert_eq!(timeline.evaluate(seconds(5.0))[..3], [0.0, 0.8, 1.0]);
    let levels = timeline.levels(seconds(30.0));
    assert_eq!(levels.len(), 11);
    assert_eq!(show.pose_of(&levels, 0), pose);
}

#[test]
fn a_head_turns_in_the_dark_at_once() {
    let show = heads(
        "cue 1 at 0:00 { snap  keys 50 }\n\
         cue 2 at 0:10 { heads to band  time 3 }\n\
         cue 3 at 0:20 { heads 80 to house  time 3 }\n\
         cue 4 at 0:30 { cueonly  mh1 to band  time 2 }\n\
         cue 5 at 0:40 { assert  time 1  keys 20 }\n",
    );
    let timeline = Timeline::new(&show).unwrap();
    assert!(points_at(&show, &timeline, 0, 10.0, BAND) < 1e-12);
    assert!(points_at(&show, &timeline, 1, 20.0, HOUSE) < 1e-12);
    assert_eq!(timeline.warnings(), []);
    // In the light it takes its time, and returns after the cue.
    assert!(points_at(&show, &timeline, 0, 31.0, BAND) > 0.5);
    assert!(points_at(&show, &timeline, 0, 32.0, BAND) < 1e-12);
    assert!(points_at(&show, &timeline, 0, 40.5, HOUSE) > 0.5);
    assert!(points_at(&show, &timeline, 0, 41.0, HOUSE) < 1e-12);
}

#[test]
fn the_pan_goes_on_round_from_where_it_is() {
    // Round the stage by quarters at the height of the head, and on: the range ends at 270.
    let around = "cue 1 at 0:00 { snap  heads 80  mh1 to -2, 9, 5 }\n\
        cue 2 { mh1 to -11, 0, 5 }\ncue 3 { mh1 to -2.5, -9, 5 }\ncue 4 { mh1 to 7, -0.5, 5 }\n";
    let show = heads(around);
    let timeline = Timeline::new(&show).unwrap();
    let pans: Vec<f64> = timeline
        .cues()
        .iter()
        .map(|cue| timeline.pose(0, cue.completion).pan)
        .collect();
    let rounded: Vec<f64> = pans.iter().map(|pan| pan.round()).collect();
    assert_eq!(rounded, [0.0, 90.0, 177.0, 267.0]);
    // A cue inserted between delays the turn.
    let show = heads(&format!("{around}cue 1.5 {{ mh1 to 7, -0.5, 5 }}\n"));
    let pans: Vec<f64> = {
        let timeline = Timeline::new(&show).unwrap();
        timeline
            .cues()
            .iter()
            .map(|cue| timeline.pose(0, cue.completion).pan)
            .collect()
    };
    assert_eq!(pans[1].round(), -93.0, "{pans:?}");
}

#[test]
fn what_heads_cannot_do_is_found() {
    let found = |cues: &str| match Timeline::new(&heads(cues)) {
        Ok(timeline) => format!("{:?}", timeline.warnings()),
        Err(errors) => format!("{errors:?}"),
    };
    let late =
        found("cue 1 at 0:00 { snap  heads 80 }\ncue 2 at 0:10 { heads to house  time 250ms }\n");
    assert!(
        late.contains("Late") && late.contains("dark: false"),
        "{late}"
    );
    let dark = found(
        "cue 1 at 0:00 { snap  heads 80 }\ncue 2 at 0:10 { snap  heads out }\n\
         cue 3 at 0:10.2 { snap  heads 50 to house }\n",
    );
    assert!(
        dark.contains("Late") && dark.contains("dark: true"),
        "{dark}"
    );
    let seen = found(
        "cue 1 at 0:00 { snap  heads 80  keys 50 }\ncue 2 at 0:10 { time 4  heads out to band }\n",
    );
    assert!(seen.contains("Seen"), "{seen}");
    let wide = found(
        "cue 1 at 0:00 { snap  heads 80 }\ncue 2 at 0:10 { mh2 beam 20 field 30  time 2 }\ncue 3 at 0:20 { mh2 field 10  time 2 }\n",
    );
    assert!(
        wide.contains("Beam { id") && wide.contains("head: 1"),
        "{wide}"
    );
    // The field passes the beam halfway from 30 to 10.
    assert!(wide.contains(&format!("{:?}", seconds(22.0))), "{wide}");
    assert_eq!(
        found("cue 1 at 0:00 { snap  heads 80 }\ncue 2 at 0:10 { mh2 beam 20 field 30  time 2 }\n"),
        "[]"
    );
}

#[test]
fn names_that_are_axes_begin_moves() {
    let rig = "light l spot at 0, 0, 5  aim 0, 0, 0  beam 12  field 18  900 cd\nlight m like l\n\
        bank beam = l\nbank pan = m\nlook night { beam 10 }\n";
    let show = |cues: &str| {
        let mut sources = crate::diagnostic::Sources::default();
        let parsed = crate::lang::parse(&mut sources, "t.lxq", &format!("{rig}{cues}"));
        parsed
            .show
            .unwrap_or_else(|| panic!("{:?}", parsed.diagnostics))
    };
    let one = show("cue 1 { night\n pan 30 }\ncue 2 { night  pan 40  beam 20  time 3 }\n");
    let moves = |cue: usize| {
        let parts = one.cues[cue].parts.iter();
        let moves = parts.flat_map(|p| {
            p.moves
                .iter()
                .map(|m| (m.parameter, m.motion.target(), p.up))
        });
        moves.collect::<Vec<_>>()
    };
    let five = seconds(5.0);
    assert_eq!(moves(0), [(0, 0.1, five), (1, 0.3, five)]);
    assert_eq!(moves(1), [(1, 0.4, five), (0, 0.2, seconds(3.0))]);
}
