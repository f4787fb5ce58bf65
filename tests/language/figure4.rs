//! The paper's Figure 4, from its text to its key settings: three segments of which two are linear,
//! six keys, rank four.

use footlight_engine::plan::{Plan, Weighting};
use footlight_report::plan::form;
use footlight_show::diagnostic::Sources;
use footlight_show::lang;
use footlight_show::timeline::{KeySequence, Timeline};

#[test]
fn the_simple_example_has_three_segments_and_six_keys() {
    let text = include_str!("../../examples/figure4/figure4.lxq");
    let parsed = lang::parse(&mut Sources::default(), "figure4.lxq", text);
    let show = parsed.show.unwrap();
    assert_eq!((show.banks.len(), show.fixed.len()), (8, 0));
    assert_eq!(show.cues[0].parts.len(), 8);
    let timeline = Timeline::new(&show).unwrap();
    let sequence = KeySequence::new(&timeline).unwrap();
    let degrees: Vec<usize> = sequence
        .segments()
        .iter()
        .map(|s| s.keys.len() - 1)
        .collect();
    assert_eq!(degrees, [1, 3, 1]);
    assert_eq!(sequence.keys().len(), 6);
    assert_eq!(sequence.inserted(), 0);
}

#[test]
fn the_simple_example_has_rank_four_and_its_plan_prints_the_same_bytes_twice() {
    let text = include_str!("../../examples/figure4/figure4.lxq");
    let print = || {
        let parsed = lang::parse(&mut Sources::default(), "figure4.lxq", text);
        let show = parsed.show.unwrap();
        let timeline = Timeline::new(&show).unwrap();
        let keys = KeySequence::new(&timeline).unwrap();
        let plan = Plan::new(&keys, &Weighting::settings(8), 0.0).unwrap();
        assert_eq!((plan.rank(), plan.used), (4, 4));
        for (key, weights) in keys.keys().iter().zip(&plan.weights) {
            for (c, x) in key.iter().enumerate() {
                let sum: f64 = (weights.iter().zip(&plan.basis))
                    .map(|(w, b)| w * b[c])
                    .sum();
                assert!((sum - x).abs() < 1e-9);
            }
        }
        serde_json::to_string(&form(&plan.report(&show, &keys))).unwrap()
    };
    let text = print();
    assert!(text.starts_with("{\"schema\":0,\"show\":\"Figure 4\",\"banks\":[{\"name\":\"b1\""));
    assert_eq!(text, print());
}
