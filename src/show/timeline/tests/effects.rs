//! Effects: turns, ends, spreads and limits.

use super::*;

fn with_effect(kind: EffectKind, rate: f64, level: Move, cues: usize) -> Show {
    let mut show = empty(1);
    let (id, name, depth) = (NodeId(7), "e".to_owned(), 0.4);
    show.effects.push(Effect {
        id,
        name,
        kind,
        rate,
        depth,
    });
    for i in 0..cues {
        let moves = if i == 0 {
            vec![level.clone()]
        } else {
            Vec::new()
        };
        let mut next = cue(i as u32 + 1, go(10.0 * i as f64), 5.0, moves);
        let change = |effect| EffectChange {
            id: NodeId(9),
            bank: 0,
            effect,
            spread: None,
        };
        next.parts[0].effects.push(change((i == 0).then_some(0)));
        show.cues.push(next);
    }
    show
}

#[test]
fn a_pulse_on_a_level_that_stands_still_is_exact_and_repeats_its_keys() {
    let hold = moving(0, path(Interpolation::Steps, &[(0., 80.), (1., 80.)]));
    let show = with_effect(EffectKind::Pulse, 2.0, hold, 2);
    let timeline = Timeline::new(&show).unwrap();
    assert_eq!(timeline.end(), seconds(15.0));
    let ease = |u: f64| u * u * (3.0 - 2.0 * u);
    for (t, cycle) in [
        (0.0, 0.0),
        (0.1, 0.4),
        (0.25, 1.0),
        (0.375, 0.5),
        (0.5, 0.0),
        (9.7, 0.8),
    ] {
        let want = 0.8 * (1.0 - 0.4 * ease(cycle));
        let found = timeline.evaluate(seconds(t))[0];
        assert!((found - want).abs() < 1e-12, "{t}: {found} for {want}");
    }
    // Cue 2 ends it at the top of a cycle; then the light holds.
    assert_eq!(timeline.evaluate(seconds(12.0)), [0.8]);
    let keys = KeySequence::new(&timeline).unwrap();
    assert_eq!(keys.segments().len(), 41);
    assert_eq!(keys.keys().len(), 2);
}

#[test]
fn an_effect_ends_in_the_time_of_its_cue() {
    let hold = moving(0, path(Interpolation::Steps, &[(0., 80.), (1., 80.)]));
    // Three cycles and a half in 10 seconds: cue 2 ends it at the bottom of a cycle.
    let mut show = with_effect(EffectKind::Pulse, 0.35, hold, 2);
    let light = |show: &Show, t: f64| Timeline::new(show).unwrap().evaluate(seconds(t))[0];
    for (t, factor) in [(10.0, 0.6), (12.5, 0.8), (14.0, 0.92), (15.0, 1.0)] {
        assert!((light(&show, t) - 0.8 * factor).abs() < 1e-6, "{t}");
    }
    // The cue is complete when the effect has gone, though a move of 1 second is over.
    let (mut quick, moves) = (show.cues[1].parts[0].clone(), vec![to(0, 80.0)]);
    (quick.up, quick.down, quick.moves) = (seconds(1.0), seconds(1.0), moves);
    quick.effects.clear();
    show.cues[1].parts.push(quick);
    assert_eq!(Timeline::new(&show).unwrap().end(), seconds(15.0));
    // Half of one more step of 1.43 seconds.
    show.cues[1].parts[0].up = Time::ZERO;
    assert!((light(&show, 10.0 + 0.25 / 0.35) - 0.8 * 0.8).abs() < 1e-6);
}

/// Bank i of n is at the top i/n of a period after the first bank, and again a period later.
#[test]
fn a_spread_pulse_runs_through_its_group() {
    let count = 5;
    let mut show = empty(count);
    let (id, name) = (NodeId(7), "e".to_owned());
    show.effects.push(Effect {
        id,
        name,
        kind: EffectKind::Pulse,
        rate: 0.5,
        depth: 0.4,
    });
    let levels =
        (0..count).map(|bank| moving(bank, path(Interpolation::Steps, &[(0., 80.), (9., 80.)])));
    show.cues.push(cue(1, go(0.0), 5.0, levels.collect()));
    let change = |bank| EffectChange {
        id: NodeId(9),
        bank,
        effect: Some(0),
        spread: Some((bank as u32, count as u32)),
    };
    show.cues[0].parts[0].effects = (0..count).map(change).collect();
    let timeline = Timeline::new(&show).unwrap();
    let ease = |u: f64| u * u * (3.0 - 2.0 * u);
    for (bank, behind) in [0.0, 0.4, 0.8, 1.2, 1.6].into_iter().enumerate() {
        for k in 20..90 {
            let t = 0.1 * f64::from(k);
            let cycle = (t - behind) * 0.5;
            let down = ease(1.0 - (2.0 * cycle.rem_euclid(1.0) - 1.0).abs());
            let (want, found) = (
                0.8 * (1.0 - 0.4 * down),
                timeline.evaluate(seconds(t))[bank],
            );
            assert!(
                (found - want).abs() < 1e-12,
                "{bank} at {t}: {found} for {want}"
            );
        }
        // All start from the current light.
        assert_eq!(timeline.evaluate(Time::ZERO)[bank], 0.8);
    }
}

#[test]
fn a_flicker_is_the_same_in_every_run_and_within_its_depth() {
    let fade = to(0, 100.0);
    let light = |seed: u32| {
        let show = with_effect(EffectKind::Flicker(seed), 6.0, fade.clone(), 2);
        let timeline = Timeline::new(&show).unwrap();
        let times = (0..200).map(|i| 0.05 * f64::from(i));
        times
            .map(|t| timeline.evaluate(seconds(t))[0])
            .collect::<Vec<_>>()
    };
    let found = light(3);
    assert_eq!(found, light(3));
    assert_ne!(found, light(4));
    for (i, light) in found.iter().enumerate() {
        let level = (0.05 * i as f64 / 5.0).min(1.0);
        assert!(
            (0.6 * level - 1e-12..=level + 1e-12).contains(light),
            "{i}: {light}"
        );
    }
    let (least, most) = found[100..]
        .iter()
        .fold((1.0f64, 0.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    assert!(least < 0.65 && most > 0.9, "{least} {most}");
}

#[test]
fn endless_effects_are_refused() {
    let hold = moving(0, path(Interpolation::Steps, &[(0., 80.), (3600., 80.)]));
    let an_hour = with_effect(EffectKind::Pulse, 10.0, hold.clone(), 1);
    Timeline::new(&an_hour).unwrap();
    let endless = with_effect(EffectKind::Pulse, 100.0, hold, 1);
    let found = Timeline::new(&endless).unwrap_err();
    assert!(
        matches!(
            found[..],
            [TimelineError::TooManyEffects {
                limit: 500_000,
                bank: 0,
                ..
            }]
        ),
        "{found:?}"
    );
}
