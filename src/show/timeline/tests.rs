//! Curves against an independent evaluation of the cues; planted segments, degrees and keys; the
//! rules of timing one by one.

use proptest::prelude::*;

mod effects;
mod heads;
#[path = "../../../tests/kit/planted.rs"]
mod planted;
mod reference;

use super::*;
use crate::model::*;
use planted::*;
use reference::Reference;

fn at(show: &Show, seconds_: f64) -> Vec<f64> {
    Timeline::new(show).unwrap().evaluate(seconds(seconds_))
}

fn go(t: f64) -> Trigger {
    Trigger::At(seconds(t))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn keys_give_what_the_cues_say(seed in proptest::prop_oneof![20 => any::<u64>(), 1 => Just(11_749_224_593_225_325_925)]) {
        let mut random = Random::new(seed);
        let show = wild(&mut random);
        let reference = Reference::new(&show);
        let go = &reference.go;
        let level = |c: usize, t: i64| reference.level(c, show.cues.len(), t);
        let timeline = match Timeline::new(&show) {
            Ok(timeline) => timeline,
            Err(errors) => {
                for e in errors {
                    match e {
                        TimelineError::Level { parameter, time, level: found, .. } => {
                            prop_assert!(!(0.0..=1.0).contains(&found));
                            // Where the level jumps, the value from before counts.
                            let at = |t: i64| level(parameter, t);
                            let t = time.micros();
                            let before = 2.0 * at(t - 1) - at(t - 2);
                            prop_assert!((at(t) - found).abs() < 1e-5
                                || (before - found).abs() < 1e-5);
                        }
                        TimelineError::Backwards { .. } => {}
                        other => prop_assert!(false, "{other:?}"),
                    }
                }
                return Ok(());
            }
        };
        let (start, end) = (timeline.start().micros(), timeline.end().micros());
        prop_assert_eq!(start, go[0].0);
        prop_assert_eq!(end, go.iter().map(|g| g.1).max().unwrap());
        let keys = KeySequence::new(&timeline).unwrap();
        let knots = keys.segments().iter().map(|s| (s.start() * 1e6).round() as i64);
        let mut times: Vec<i64> = knots.collect();
        times.extend((0..40).map(|_| random.between(start, end)));
        times.push(end);
        for t in times {
            let blended = keys.evaluate(Time::from_micros(t));
            let curves = timeline.evaluate(Time::from_micros(t));
            for (c, coordinate) in show.coordinates().iter().enumerate() {
                let want = if coordinate.bank.is_some() { reference.light(c, t) } else { 1.0 };
                // A level and a colour that both move along a spline are fitted.
                let limit = if coordinate.emitter().is_some() { 5e-5 } else { 1e-12 };
                prop_assert!((blended[c] - want).abs() < limit, "{t} {c}: {} for {want}", blended[c]);
                prop_assert!((curves[c] - want).abs() < limit);
            }
        }
        prop_assert!(keys.keys().iter().flatten().all(|x| *x >= 0.0));
        for w in keys.segments().windows(2) {
            prop_assert_eq!(w[0].end(), w[1].start());
        }
    }

    #[test]
    fn exact_dimmers_give_what_the_law_says(seed in any::<u64>()) {
        // Straight levels under a square or a linear law: nothing is fitted.
        let mut random = Random::new(seed);
        let mut show = wild(&mut random);
        let straight = show.curves[0].interpolation == Interpolation::Linear;
        let law = if straight && random.chance(0.5) { Dimmer::Curve(0) } else { Dimmer::Square };
        for cue in &mut show.cues {
            for part in &mut cue.parts {
                part.curve = Fade::LINEAR;
                for m in &mut part.moves {
                    if let Motion::Path(path) = &mut m.motion {
                        path.interpolation = random.pick(&[Interpolation::Linear, Interpolation::Steps]);
                    }
                }
            }
        }
        for bank in &mut show.banks {
            bank.dimmer = law;
        }
        let Ok(timeline) = Timeline::new(&show) else { return Ok(()) };
        let keys = KeySequence::new(&timeline).unwrap();
        let reference = Reference::new(&show);
        let own = &show.curves[0].knots;
        for _ in 0..60 {
            let t = random.between(timeline.start().micros(), timeline.end().micros());
            let found = keys.evaluate(Time::from_micros(t));
            for (c, coordinate) in show.coordinates().iter().enumerate() {
                if coordinate.bank.is_none() {
                    continue;
                }
                let (level, share) = reference.level_and_share(c, t);
                let want = share * match law {
                    Dimmer::Square => level * level,
                    _ => {
                        let i = own.iter().rposition(|k| k.at <= level.max(0.0)).unwrap().min(own.len() - 2);
                        let (a, b) = (own[i], own[i + 1]);
                        a.value + (level - a.at) / (b.at - a.at) * (b.value - a.value)
                    }
                };
                // A law's knots fall on whole microseconds of the fade, so that a piece may be off
                // by the level's change in one.
                let moved = [t - 1, t + 1].map(|t| {
                    (reference.level_and_share(c, t).0 - level).abs()
                });
                let steepest = own.windows(2).map(|w| (w[1].value - w[0].value) / (w[1].at - w[0].at));
                let slack = match law {
                    Dimmer::Square => 0.0,
                    _ => steepest.fold(0.0, f64::max) * moved[0].max(moved[1]),
                };
                prop_assert!((found[c] - want).abs() < 1e-12 + slack, "{c} {t}: {} for {want}", found[c]);
            }
        }
    }

    #[test]
    fn planted_segments_degrees_and_keys_come_back(seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let rank = random.between(2, 5) as usize;
        let n = rank + random.between(0, 5) as usize;
        let mut degrees: Vec<usize> = Vec::new();
        for _ in 0..random.between(1, 7) {
            let d = random.between(0, 3) as usize;
            if d > 0 || degrees.last() != Some(&0) {
                degrees.push(d);
            }
        }
        let planted = planted(&mut random, n, rank, &degrees);
        let timeline = Timeline::new(&planted.show).unwrap();
        prop_assert!(timeline.warnings().is_empty());
        let keys = KeySequence::new(&timeline).unwrap();
        let found: Vec<(f64, f64, usize)> =
            keys.segments().iter().map(|s| (s.start(), s.end(), s.degree)).collect();
        // Two straight stretches may happen to be one line; no other may be lost.
        prop_assert_eq!(found, planted.segments);
        prop_assert_eq!(keys.keys().len(), planted.keys);
        prop_assert_eq!(keys.inserted(), 0);
    }

    #[test]
    fn dimmers_are_within_their_tolerance(seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let mut show = wild(&mut random);
        for bank in &mut show.banks {
            bank.dimmer = random.pick(&[Dimmer::Square, Dimmer::Square, Dimmer::Curve(0)]);
        }
        // A law, an effect and a colour on one bank: three fits in sequence.
        let (id, name) = (NodeId(1), "e".to_owned());
        let kind = random.pick(&[EffectKind::Pulse, EffectKind::Flicker(7)]);
        show.effects.push(Effect { id, name, kind, rate: 0.7, depth: 0.6 });
        let effect = Some(0);
        let banks = 0..show.banks.len();
        let begun = banks.map(|bank| EffectChange { id, bank, effect, spread: None });
        show.cues[0].parts[0].effects = begun.collect();
        let Ok(timeline) = Timeline::new(&show) else { return Ok(()) };
        let reference = Reference::new(&show);
        let own = &show.curves[0];
        let steps = own.interpolation == Interpolation::Steps;
        let law = dimmer::Law::new(Dimmer::Curve(0), &show.curves);
        for _ in 0..60 {
            let t = random.between(timeline.start().micros(), timeline.end().micros());
            let found = timeline.evaluate(Time::from_micros(t));
            for (c, coordinate) in show.coordinates().iter().enumerate() {
                let Some(bank) = coordinate.bank else { continue };
                let (level, share) = reference.level_and_share(c, t);
                let pieces = &timeline.factors[bank];
                let piece = pieces.iter().rfind(|p| p.start.micros() <= t);
                let factor = piece.map_or(1.0, |p| p.value(Time::from_micros(t)));
                let want = factor * share * match show.banks[bank].dimmer {
                    Dimmer::Square => level * level,
                    _ => law.value(level.clamp(0.0, 1.0)),
                };
                // A step of the law falls within a microsecond of where it should.
                let near_step = steps && own.knots.iter().any(|k| (k.at - level).abs() < 1e-3);
                prop_assert!(near_step || (found[c] - want).abs() < 5e-5, "{c} {t}: {} for {want}", found[c]);
                prop_assert!((0.0..=1.0).contains(&found[c]));
            }
        }
    }
}

#[test]
fn most_wild_shows_are_shows() {
    let good = |seed: &u64| Timeline::new(&wild(&mut Random::new(*seed))).is_ok();
    let count = (0..200u64).filter(good).count();
    assert!(count > 100, "{count}");
}

#[test]
fn a_line_continued_is_one_segment() {
    let mut show = empty(1);
    let line = path(Interpolation::Linear, &[(0., 0.), (1., 10.), (4., 40.)]);
    show.cues.push(cue(1, go(0.), 0., vec![moving(0, line)]));
    let timeline = Timeline::new(&show).unwrap();
    let keys = KeySequence::new(&timeline).unwrap();
    assert_eq!(
        (keys.segments().len(), keys.keys().len(), keys.joined()),
        (1, 2, 1)
    );
}

#[test]
fn go_follow_hang_gap_and_at() {
    let mut show = empty(1);
    let moves = |level| vec![to(0, level)];
    show.cues.push(cue(1, Trigger::Go, 4., moves(10.)));
    show.cues.push(cue(2, Trigger::Go, 4., moves(20.)));
    show.cues.push(cue(3, Trigger::Go, 3., moves(30.)));
    show.cues.push(cue(4, Trigger::Go, 1., moves(40.)));
    show.cues.push(cue(5, go(60.), 0., moves(50.)));
    show.cues[1].link = Some((NodeId(7), Link::Follow(seconds(6.))));
    show.cues[2].link = Some((NodeId(8), Link::Hang(seconds(-1.))));
    show.cues[2].parts[0].delay = seconds(2.);
    let timeline = Timeline::new(&show).unwrap();
    let found: Vec<(f64, f64, bool)> = timeline
        .cues()
        .iter()
        .map(|c| (c.go.seconds(), c.completion.seconds(), c.assumed))
        .collect();
    let want = [
        (0., 4., false),
        (9., 13., true),
        (15., 20., false),
        (19., 20., false),
        (60., 60., false),
    ];
    assert_eq!(found, want);
    assert_eq!(
        (timeline.start(), timeline.end()),
        (seconds(0.), seconds(60.))
    );
    // The jump at the very end has its key.
    let keys = KeySequence::new(&timeline).unwrap();
    assert_eq!(keys.evaluate(seconds(60.)), vec![0.5]);
    assert_eq!(keys.segments().last().unwrap().duration(), 0.0);
}

#[test]
fn errors_of_timing_are_all_reported() {
    let mut show = empty(1);
    show.cues.push(cue(1, go(10.), 1., vec![]));
    show.cues.push(cue(2, go(5.), 1., vec![]));
    show.cues.push(cue(3, go(50.), 1., vec![]));
    show.cues[1].link = Some((NodeId(7), Link::Follow(seconds(6.))));
    show.cues[2].link = Some((NodeId(8), Link::Hang(seconds(1.))));
    let errors = Timeline::new(&show).unwrap_err();
    assert!(matches!(
        errors[0],
        TimelineError::Backwards {
            cue: NodeId(2000),
            ..
        }
    ));
    assert!(matches!(
        errors[1],
        TimelineError::AtAndLink {
            link: NodeId(7),
            ..
        }
    ));
    assert!(matches!(
        errors[2],
        TimelineError::LinkOnLast {
            link: NodeId(8),
            ..
        }
    ));
    assert_eq!(errors.len(), 3);
    let mut show = empty(1);
    show.cues.push(cue(1, go(0.), 1., vec![]));
    show.cues.push(cue(2, Trigger::Go, 1., vec![]));
    show.cues[0].link = Some((NodeId(7), Link::Hang(seconds(-3.))));
    let errors = Timeline::new(&show).unwrap_err();
    assert!(matches!(
        errors[0],
        TimelineError::Backwards {
            link: Some(NodeId(7)),
            ..
        }
    ));
}

#[test]
fn a_move_interrupts_a_move_and_waits_out_its_delay() {
    let mut show = empty(1);
    show.cues.push(cue(1, go(0.), 10., vec![to(0, 100.)]));
    show.cues.push(cue(2, go(2.), 4., vec![to(0, 0.)]));
    show.cues[1].parts[0].delay = seconds(3.);
    for (t, want) in [
        (2., 0.2),
        (4.5, 0.45),
        (5., 0.5),
        (7., 0.25),
        (9., 0.0),
        (20., 0.0),
    ] {
        assert!((at(&show, t)[0] - want).abs() < 1e-15, "{t}");
    }
}

#[test]
fn an_overtaken_move_never_happens_and_is_told() {
    let mut show = empty(1);
    show.cues.push(cue(1, go(0.), 10., vec![to(0, 100.)]));
    show.cues[0].parts[0].delay = seconds(20.);
    show.cues.push(cue(2, go(5.), 5., vec![to(0, 50.)]));
    let timeline = Timeline::new(&show).unwrap();
    assert!(matches!(
        timeline.warnings(),
        [TimelineWarning::Overtaken { parameter: 0, .. }]
    ));
    assert_eq!(timeline.evaluate(seconds(25.)), vec![0.5]);
}

#[test]
fn up_and_down_assert_and_cueonly() {
    let mut show = empty(3);
    show.cues
        .push(cue(1, go(0.), 0., vec![to(0, 50.), to(1, 50.), to(2, 20.)]));
    show.cues
        .push(cue(2, go(10.), 0., vec![to(0, 100.), to(1, 0.)]));
    (show.cues[1].parts[0].up, show.cues[1].parts[0].down) = (seconds(4.), seconds(8.));
    show.cues[1].cueonly = true;
    show.cues.push(cue(3, go(14.), 2., vec![to(2, 60.)]));
    assert_eq!(at(&show, 12.), vec![0.75, 0.375, 0.2]);
    // Cue 3 restores what cue 2 moved, from the current levels, in its own time.
    assert_eq!(at(&show, 15.), vec![0.75, 0.375, 0.4]);
    assert_eq!(at(&show, 16.), vec![0.5, 0.5, 0.6]);
    show.cues[1].cueonly = false;
    assert_eq!(at(&show, 18.), vec![1.0, 0.0, 0.6]);
    assert_eq!(at(&show, 16.), vec![1.0, 0.125, 0.6]);
    // Asserting ends the fade of bank 1 with cue 3's time.
    show.cues[2].assert = true;
    assert_eq!(at(&show, 16.), vec![1.0, 0.0, 0.6]);
}

#[test]
fn a_spline_that_starts_elsewhere_jumps_with_a_warning() {
    let mut show = empty(1);
    show.cues.push(cue(1, go(0.), 0., vec![to(0, 85.)]));
    let spline = path(
        Interpolation::Monotone,
        &[(0., 30.), (3., 55.), (4., 52.), (9., 90.)],
    );
    show.cues.push(cue(2, go(5.), 0., vec![moving(0, spline)]));
    let timeline = Timeline::new(&show).unwrap();
    let [TimelineWarning::Jump { from, to, time, .. }] = timeline.warnings() else {
        panic!("{:?}", timeline.warnings())
    };
    assert_eq!((*from, *to, time.seconds()), (0.85, 0.3, 5.0));
    let keys = KeySequence::new(&timeline).unwrap();
    assert_eq!(keys.evaluate(seconds(5.)), vec![0.3]);
    let before = &keys.segments()[0];
    assert_eq!((keys.keys()[before.keys[0]][0], before.end()), (0.85, 5.0));
}

#[test]
fn levels_outside_are_an_error_with_time_and_value() {
    let mut show = empty(2);
    let spline = path(
        Interpolation::Natural,
        &[(0., 0.), (1., 100.), (2., 100.), (3., 0.)],
    );
    show.cues.push(cue(1, go(10.), 0., vec![moving(1, spline)]));
    let errors = Timeline::new(&show).unwrap_err();
    let [
        TimelineError::Level {
            parameter,
            time,
            level,
            ..
        },
    ] = errors.as_slice()
    else {
        panic!("{errors:?}")
    };
    // The natural spline through these is 115 % at the middle (by symmetry, slopes 1/2 and -3/2…).
    assert_eq!((*parameter, time.seconds()), (1, 11.5));
    assert!((level - 1.15).abs() < 1e-14, "{level}");
}

#[test]
fn the_square_of_a_linear_fade_is_an_exact_quadratic() {
    let mut show = empty(1);
    show.banks[0].dimmer = Dimmer::Square;
    show.cues.push(cue(1, go(0.), 0., vec![to(0, 20.)]));
    show.cues.push(cue(2, go(0.), 8., vec![to(0, 80.)]));
    let timeline = Timeline::new(&show).unwrap();
    let [piece] = timeline.curve(0) else { panic!() };
    assert_eq!(piece.polynomial.degree(), 2);
    for i in 0..=80 {
        let t = i as f64 / 10.0;
        let level: f64 = 0.2 + 0.6 * t / 8.0;
        assert!((timeline.evaluate(seconds(t))[0] - level * level).abs() < 1e-15);
    }
}

/// The level found gives the setting again, stays if it gives it already, and is the nearest one
/// under a law that rises and falls.
#[test]
fn levels_are_found_from_settings() {
    let knot = |at: f64, value: f64| CurveKnot {
        at,
        value,
        slope: 0.0,
        handles: [value; 2],
    };
    let curve = |interpolation, knots: &[(f64, f64)]| NamedCurve {
        id: NodeId(0),
        name: "law".to_owned(),
        interpolation,
        knots: knots.iter().map(|(at, value)| knot(*at, *value)).collect(),
    };
    let curves = [
        curve(
            Interpolation::Monotone,
            &[(0.0, 0.1), (0.3, 0.2), (0.8, 0.7), (1.0, 0.9)],
        ),
        curve(Interpolation::Linear, &[(0.0, 0.0), (0.5, 1.0), (1.0, 0.2)]),
        curve(Interpolation::Steps, &[(0.0, 0.0), (0.5, 0.4), (1.0, 1.0)]),
    ];
    let laws = [
        Dimmer::Linear,
        Dimmer::Square,
        Dimmer::Curve(0),
        Dimmer::Curve(1),
        Dimmer::Curve(2),
    ];
    for dimmer in laws {
        for i in 0..=100 {
            let level = f64::from(i) / 100.0;
            let setting = settings(dimmer, &curves, &[level])[0];
            for near in [level, 0.0, 0.4, 1.0] {
                let found = super::level(dimmer, &curves, setting, near);
                let back = settings(dimmer, &curves, &[found])[0];
                assert!((back - setting).abs() < 1e-9, "{dimmer:?} {level} {near}");
                // Where a law jumps, any of the levels will do.
                let jumps = dimmer == Dimmer::Curve(2);
                assert!(
                    jumps || (found - near).abs() <= (level - near).abs() + 1e-9,
                    "{dimmer:?} {found}"
                );
            }
        }
    }
    let level = |curve, setting, near| super::level(Dimmer::Curve(curve), &curves, setting, near);
    assert!((level(1, 0.6, 0.9) - 0.75).abs() < 1e-12 && (level(1, 0.6, 0.1) - 0.3).abs() < 1e-12);
    // No level gives these settings.
    assert_eq!((level(0, 0.0, 0.7), level(0, 1.0, 0.7)), (0.0, 1.0));
    assert_eq!(
        settings(Dimmer::Curve(2), &curves, &[level(2, 0.5, 0.0)]),
        [0.4]
    );
    let ranges = laws.map(|dimmer| range(dimmer, &curves));
    assert_eq!(
        ranges,
        [(0.0, 1.0), (0.0, 1.0), (0.1, 0.9), (0.0, 1.0), (0.0, 1.0)]
    );
}

#[test]
fn nothing_and_fixed_lights_alone() {
    let timeline = Timeline::new(&empty(0)).unwrap();
    let keys = KeySequence::new(&timeline).unwrap();
    assert_eq!((keys.segments().len(), keys.duration()), (1, 0.0));
    let mut show = empty(1);
    fixed_light(&mut show);
    assert_eq!(at(&show, 3.), vec![0.0, 1.0]);
    show.cues.push(cue(1, go(3.), 5., vec![to(0, 100.)]));
    let timeline = Timeline::new(&show).unwrap();
    let keys = KeySequence::new(&timeline).unwrap();
    assert_eq!(keys.keys(), [vec![0.0, 1.0], vec![1.0, 1.0]]);
    assert_eq!(
        (keys.segments()[0].start(), keys.segments()[0].end()),
        (3.0, 8.0)
    );
}

#[test]
fn endless_repeats_are_refused() {
    let mut show = empty(1);
    let spline = path(Interpolation::Linear, &[(0., 0.), (0.000_001, 100.)]);
    show.cues.push(cue(1, go(0.), 0., vec![moving(0, spline)]));
    show.cues[0].parts[0].moves[0].repeat = u32::MAX;
    let errors = Timeline::new(&show).unwrap_err();
    assert!(matches!(errors[0], TimelineError::TooManyPieces { .. }));
    show.cues[0].parts[0].moves[0].motion = path(Interpolation::Linear, &[(0., 0.), (1000., 100.)]);
    let errors = Timeline::new(&show).unwrap_err();
    assert!(matches!(errors[0], TimelineError::TooLong { .. }));
}
