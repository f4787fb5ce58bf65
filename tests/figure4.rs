//! The paper's Figure 4, from its text to its key settings: three segments of which two are linear,
//! six keys. (Its rank is the plan's to tell.)
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "test")]

use footlight::diagnostic::Sources;
use footlight::lang;
use footlight::timeline::{KeyOptions, KeySequence, Timeline};

#[test]
fn the_simple_example_has_three_segments_and_six_keys() {
    let text = include_str!("../examples/figure4/figure4.lxq");
    let parsed = lang::parse(&mut Sources::default(), "figure4.lxq", text);
    let show = parsed.show.unwrap();
    assert_eq!((show.banks.len(), show.fixed.len()), (8, 0));
    assert_eq!(show.cues[0].parts.len(), 8);
    let timeline = Timeline::new(&show).unwrap();
    let sequence = KeySequence::new(&timeline, KeyOptions::default()).unwrap();
    let degrees: Vec<usize> = sequence
        .segments()
        .iter()
        .map(|s| s.keys.len() - 1)
        .collect();
    assert_eq!(degrees, [1, 3, 1]);
    assert_eq!(sequence.keys().len(), 6);
    assert_eq!(sequence.inserted(), 0);
}
