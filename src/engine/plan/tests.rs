//! Planted ranks, brute-force quadrature of the weighted error, and the pool's loop.

use proptest::prelude::*;

use super::*;
use crate::planted::*;
use footlight_show::diagnostic::Sources;
use footlight_show::lang;
use footlight_show::model::{Show, Trigger};
use footlight_show::timeline::Timeline;

fn keys_of(show: &Show) -> Option<KeySequence> {
    let timeline = Timeline::new(show).ok()?;
    KeySequence::new(&timeline).ok()
}

fn degrees(random: &mut Random) -> Vec<usize> {
    let mut out: Vec<usize> = Vec::new();
    for _ in 0..random.between(1, 6) {
        let d = random.between(0, 3) as usize;
        if d > 0 || out.last() != Some(&0) {
            out.push(d);
        }
    }
    out
}

fn largest(rows: &[Vec<f64>]) -> f64 {
    rows.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()))
}

/// Largest difference of keys from weights · basis, relative to the largest key.
fn missed(keys: &KeySequence, plan: &Plan) -> f64 {
    let mut worst = 0.0f64;
    for (key, weights) in keys.keys().iter().zip(&plan.weights) {
        for (c, x) in key.iter().enumerate() {
            let sum: f64 = weights.iter().zip(&plan.basis).map(|(w, b)| w * b[c]).sum();
            worst = worst.max((sum - x).abs());
        }
    }
    worst / largest(keys.keys()).max(1e-300)
}

/// ∫ ‖W (L − S c)‖² dt by four-point Gauss-Legendre quadrature on each segment (exact to degree 7),
/// with c from the normal equations at each instant.
fn quadrature(keys: &KeySequence, pool: &[Vec<f64>], weighting: &Weighting) -> f64 {
    let nodes = [0.861_136_311_594_052_6, 0.339_981_043_584_856_26];
    let shares = [0.347_854_845_137_453_85, 0.652_145_154_862_546_1];
    let mut sum = 0.0;
    for s in keys.segments() {
        for (x, share) in nodes.iter().zip(shares) {
            for t in [0.5 - 0.5 * x, 0.5 + 0.5 * x] {
                let blend = footlight_show::timeline::blend(s.degree, t).weights();
                let mut l = vec![0.0; keys.coordinates()];
                for (w, k) in blend.iter().zip(&s.keys) {
                    l.iter_mut()
                        .zip(&keys.keys()[*k])
                        .for_each(|(x, v)| *x += w * v);
                }
                let c = projection(pool, weighting, std::slice::from_ref(&l)).unwrap();
                for (i, w) in weighting.lifted().iter().enumerate() {
                    let shown: f64 = c[0].iter().zip(pool).map(|(c, s)| c * s[i]).sum();
                    sum += s.duration() * 0.5 * share * (w * (l[i] - shown)).powi(2);
                }
            }
        }
    }
    sum.sqrt()
}

fn random_weights(random: &mut Random, n: usize) -> Weighting {
    let weights = (0..n)
        .map(|_| random.between(1, 1000) as f64 / 300.0)
        .collect();
    Weighting::new(weights).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn planted_rank_comes_back_in_any_metric(seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let rank = random.between(1, 6) as usize;
        let n = rank + random.between(0, 6) as usize;
        let degrees = degrees(&mut random);
        let planted = planted(&mut random, n, rank, &degrees);
        let keys = keys_of(&planted.show).unwrap();
        for weighting in [Weighting::settings(n), random_weights(&mut random, n)] {
            let plan = Plan::new(&keys, &weighting, 0.0).unwrap();
            prop_assert_eq!(plan.rank(), planted.rank);
            prop_assert_eq!(plan.used, planted.rank);
            prop_assert!(missed(&keys, &plan) < 1e-9);
            prop_assert!(plan.singular_values.windows(2).all(|w| w[0] >= w[1]));
            prop_assert!(plan.predicted.windows(2).all(|w| w[0] >= w[1]));
        }
    }

    #[test]
    fn any_show_is_expressed_and_the_prediction_is_the_quadrature(seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let show = wild(&mut random);
        let Some(keys) = keys_of(&show) else { return Ok(()) };
        let weighting = random_weights(&mut random, keys.coordinates());
        let plan = Plan::new(&keys, &weighting, 0.02).unwrap();
        prop_assert!(missed(&keys, &plan) < 1e-9);
        prop_assert!(plan.basis.iter().all(|b| largest(std::slice::from_ref(b)) == 1.0));
        prop_assert!(plan.predicted[plan.used] <= 0.02);
        prop_assert!(plan.used == 0 || plan.predicted[plan.used - 1] > 0.02);
        if keys.duration() == 0.0 {
            return Ok(());
        }
        let norm = quadrature(&keys, &[], &weighting);
        if norm == 0.0 {
            return Ok(());
        }
        for used in 0..=plan.rank() {
            let pool = &plan.basis[..used];
            let brute = quadrature(&keys, pool, &weighting) / norm;
            prop_assert!((plan.predicted[used] - brute).abs() < 1e-9, "{used}: {} {brute}", plan.predicted[used]);
        }
    }

    #[test]
    fn the_pools_loop_removes_what_it_says(seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let rank = random.between(2, 6) as usize;
        let n = rank + random.between(0, 6) as usize;
        let planted = planted(&mut random, n, rank, &[3, 1, 3, 2, 3]);
        let keys = keys_of(&planted.show).unwrap();
        let old = random_weights(&mut random, n);
        let now = random_weights(&mut random, n);
        // A pool from another metric and another design.
        let mut pool: Vec<Vec<f64>> = Plan::new(&keys, &old, 0.0).unwrap().basis[..1].to_vec();
        pool.push((0..n).map(|i| (i as f64 * 0.7).sin()).collect());
        let all = quadrature(&keys, &[], &now);
        let mut error = quadrature(&keys, &pool, &now);
        let mut rounds = 0;
        loop {
            let steps = next(&keys, &pool, &now).unwrap();
            let Some(first) = steps.first() else { break };
            prop_assert_eq!(largest(std::slice::from_ref(first)), 1.0);
            pool.push(first.clone());
            let after = quadrature(&keys, &pool, &now);
            prop_assert!(after <= error + 1e-9 * all);
            error = after;
            rounds += 1;
            prop_assert!(rounds <= rank);
        }
        prop_assert!(error < 1e-9 * all);
    }
}

/// The paper's Figure 4: eight parts, three segments of which two are linear, six keys, rank four.
#[test]
fn figure_four() {
    let mut random = Random::new(4);
    let planted = planted(&mut random, 8, 4, &[1, 3, 1]);
    let keys = keys_of(&planted.show).unwrap();
    let plan = Plan::new(&keys, &Weighting::settings(8), 0.0).unwrap();
    let degrees: Vec<usize> = keys.segments().iter().map(|s| s.degree).collect();
    assert_eq!(
        (degrees, keys.keys().len(), plan.rank()),
        (vec![1, 3, 1], 6, 4)
    );
}

#[test]
fn a_last_look_without_length_is_expressed_all_the_same() {
    let mut show = empty(3);
    show.cues
        .push(cue(1, Trigger::At(seconds(0.0)), 5.0, vec![to(0, 100.0)]));
    show.cues
        .push(cue(2, Trigger::At(seconds(5.0)), 0.0, vec![to(1, 70.0)]));
    let keys = keys_of(&show).unwrap();
    let plan = Plan::new(&keys, &Weighting::settings(3), 0.0).unwrap();
    assert_eq!(plan.rank(), 2);
    assert!(missed(&keys, &plan) < 1e-15);
    assert_eq!(plan.singular_values[1], 0.0);
    assert_eq!(plan.predicted, [1.0, 0.0, 0.0]);
}

#[test]
fn weights_of_zero_come_last_and_bad_ones_are_refused() {
    let mut show = empty(2);
    show.cues
        .push(cue(1, Trigger::At(seconds(0.0)), 5.0, vec![to(0, 100.0)]));
    show.cues
        .push(cue(2, Trigger::At(seconds(5.0)), 5.0, vec![to(1, 100.0)]));
    let keys = keys_of(&show).unwrap();
    let weighting = Weighting::new(vec![0.0, 3.0]).unwrap();
    let plan = Plan::new(&keys, &weighting, 0.01).unwrap();
    assert_eq!(
        (plan.rank(), plan.used, plan.unseen.as_slice()),
        (2, 1, [0].as_slice())
    );
    assert!(missed(&keys, &plan) < 1e-9);
    let first = &plan.basis[0];
    assert!(first[1].abs() > 1e-4 && plan.predicted[1] < 1e-5);
    assert_eq!(Weighting::new(vec![0.0; 2]), Err(PlanError::NoWeight));
    assert!(Weighting::new(vec![1.0, f64::NAN]).is_err());
    assert!(Weighting::new(vec![1.0, -1.0]).is_err());
    let three = Weighting::settings(3);
    assert_eq!(
        Plan::new(&keys, &three, 0.0),
        Err(PlanError::Shape {
            found: 3,
            wanted: 2
        })
    );
}

/// A bank that always gives half of another's light: one image serves both, and the error counts
/// the light of both.
#[test]
fn a_proportional_bank_saves_its_picture_and_counts_in_the_error() {
    let mut show = empty(2);
    let moves = vec![to(0, 100.0), to(1, 50.0)];
    show.cues
        .push(cue(1, Trigger::At(seconds(0.0)), 3.0, moves));
    let keys = keys_of(&show).unwrap();
    // ∫ (t/3)² dt = 1: the errors at full are 3, and 8 times one half.
    let weighting = Weighting::new(vec![3.0, 8.0]).unwrap();
    let plan = Plan::new(&keys, &weighting, 0.01).unwrap();
    assert_eq!((plan.rank(), plan.used), (1, 1));
    assert!((plan.basis[0][1] / plan.basis[0][0] - 0.5).abs() < 1e-15);
    assert!((plan.predicted[0] - 1.0).abs() < 1e-15 && plan.predicted[1] == 0.0);
    assert!((plan.singular_values[0] - 5.0).abs() < 1e-14);
    // The first bank alone leaves the part of the second outside its direction: nothing is shared.
    let left = next(&keys, &[vec![1.0, 0.0]], &weighting).unwrap();
    assert_eq!(left, [[0.0, 1.0]]);
}

#[test]
fn segments_in_which_nothing_changes_cost_one_key() {
    let mut show = empty(1);
    for (number, at, level) in [(1, 0.0, 30.0), (2, 10.0, 80.0), (3, 30.0, 0.0)] {
        let moves = vec![to(0, level)];
        show.cues
            .push(cue(number, Trigger::At(seconds(at)), 5.0, moves));
    }
    let keys = keys_of(&show).unwrap();
    assert_eq!((keys.segments().len(), keys.keys().len()), (5, 3));
    let plan = Plan::new(&keys, &Weighting::settings(1), 0.1).unwrap();
    let report = plan.report(&show, &keys);
    assert!(report.left_out.contains(&LeftOut::HeldSegments(2)));
}

/// Rounding of other banks' light must not be taken for light of a bank without weight, which
/// counts a millionth; nor must real light of it be lost.
#[test]
fn a_bank_without_weight_adds_no_direction_of_rounding() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let (n, rank) = (60, 12);
        let planted = planted(&mut random, n, rank, &[3, 1, 3, 2, 3, 3, 3, 1, 3, 3, 3, 3]);
        let keys = keys_of(&planted.show).unwrap();
        let mut weights = vec![1.0; n];
        weights[n - 1] = 0.0;
        let weighting = Weighting::new(weights).unwrap();
        let plan = Plan::new(&keys, &weighting, 0.0).unwrap();
        assert_eq!(plan.rank(), planted.rank, "seed {seed}");
        assert!(missed(&keys, &plan) < 1e-8);
    }
}

#[test]
fn near_copies_in_the_pool_are_refused_and_get_no_share() {
    let mut show = empty(3);
    let moves = vec![to(0, 100.0), to(1, 50.0), to(2, 25.0)];
    show.cues
        .push(cue(1, Trigger::At(seconds(0.0)), 5.0, moves));
    let keys = keys_of(&show).unwrap();
    let pool = vec![
        vec![1.0, 0.0, 0.3],
        vec![2.0, 0.0, 0.6],
        vec![0.0, 1.0, 0.0],
    ];
    let w = Weighting::settings(3);
    assert_eq!(next(&keys, &pool, &w).unwrap().len(), 1);
    let c = projection(&pool, &w, &[vec![1.0, 0.0, 0.3], vec![0.0; 3]]).unwrap();
    assert!((c[0][0] - 1.0).abs() < 1e-15 && c[0][1] == 0.0 && c[0][2].abs() < 1e-15);
    assert_eq!(c[1], vec![0.0; 3]);
}

#[test]
fn nothing_lit_and_no_coordinates() {
    let mut show = empty(2);
    show.cues
        .push(cue(1, Trigger::At(seconds(0.0)), 5.0, vec![]));
    for show in [&show, &empty(0)] {
        let keys = keys_of(show).unwrap();
        let weighting = Weighting::settings(keys.coordinates());
        let plan = Plan::new(&keys, &weighting, 0.02).unwrap();
        assert_eq!(
            (plan.rank(), plan.used, plan.predicted.as_slice()),
            (0, 0, [0.0].as_slice())
        );
        assert!(next(&keys, &[], &weighting).unwrap().is_empty());
        assert_eq!(plan.report(show, &keys).rank, 0);
    }
}

#[test]
fn the_report_says_what_is_left_out() {
    let mut show = empty(5);
    fixed_light(&mut show);
    let moves = vec![to(0, 100.0), to(1, 50.0), to(2, 40.0), to(3, 10.0)];
    show.cues.push(cue(
        1,
        Trigger::At(seconds(0.0)),
        0.0,
        vec![to(2, 40.0), to(3, 0.0)],
    ));
    show.cues
        .push(cue(2, Trigger::At(seconds(0.0)), 5.0, moves));
    show.cues
        .push(cue(3, Trigger::At(seconds(5.0)), 5.0, vec![to(3, 90.0)]));
    let keys = keys_of(&show).unwrap();
    let plan = Plan::new(&keys, &Weighting::settings(6), 0.1).unwrap();
    let report = plan.report(&show, &keys);
    let name = |bank: &str| bank.to_owned();
    let expected = [
        LeftOut::MultipleOf {
            name: name("b1"),
            other: name("b0"),
            factor: 0.5,
        },
        LeftOut::Constant {
            name: name("b2"),
            setting: 0.4,
        },
        LeftOut::StaysOut { name: name("b4") },
    ];
    assert_eq!(report.left_out.get(..3), Some(&expected[..]));
    assert!(report.left_out.contains(&LeftOut::MergedKeys(1)));
    assert_eq!(report.coordinates.last().map(String::as_str), Some("fixed"));
    assert_eq!(
        report.banks.last().map(|b| (b.name.as_str(), b.kind)),
        Some(("exits", "fixed"))
    );
    // Zeros have no sign, so that the printed form is equal everywhere.
    let numbers = report
        .basis
        .iter()
        .chain(&report.weights)
        .chain(&report.keys)
        .flatten();
    assert!(
        numbers
            .into_iter()
            .all(|x| *x != 0.0 || x.is_sign_positive())
    );
    assert_eq!(report, plan.report(&show, &keys));
}

/// A bank whose heads turn is reported neither as constant nor, for its direct light, as unseen.
#[test]
fn a_bank_whose_heads_turn_is_not_left_out() {
    let text = "show \"S\"\nlight mh spot at 0,0,6 aim 0,4,0 beam 12 field 20 900 cd moves\n\
        light key spot at 0,-4,6 aim 0,0,0 beam 12 field 20 900 cd\nbank heads = mh\nbank keys = key\n\
        cue 1 at 0:00 { snap  heads 80  keys 40 }\ncue 2 at 0:02 { mh to 0,-2,0 }\n";
    let parsed = lang::parse(&mut Sources::default(), "s.lxq", text);
    let show = parsed.show.unwrap();
    let keys = keys_of(&show).unwrap();
    let mut weights = vec![1.0; keys.coordinates()];
    weights[0] = 0.0;
    let weighting = Weighting::new(weights).unwrap();
    let plan = Plan::new(&keys, &weighting, 0.1).unwrap();
    let report = plan.report(&show, &keys);
    let keys = LeftOut::Constant {
        name: "keys".to_owned(),
        setting: 0.4,
    };
    assert_eq!(report.left_out.first(), Some(&keys));
    assert!(!report.left_out.contains(&LeftOut::Unseen {
        name: "heads".to_owned()
    }));
}
