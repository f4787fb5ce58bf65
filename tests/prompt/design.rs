//! Measured design sessions, and refinement that knows the cost of its calls.

use std::path::PathBuf;
use std::sync::Arc;

use crate::operator::Altered;
use crate::{Stopped, prompt};
use footlight_engine::{Goal, Host, Refinement, Way};
use footlight_host::files::{Folder, MemoryStore};
use footlight_prompt::Repl;
use footlight_transport::Cost;

const SHARED: Cost = Cost {
    prepare: 2.0,
    per_source: 0.25,
    per_image: 0.125,
    per_lone: 0.125,
};

const UNSHARED: Cost = Cost {
    prepare: 0.0,
    per_source: 0.0,
    per_image: 3.0,
    per_lone: 3.0,
};

/// The smallest show, smaller, with an operator that states these errors of its steps.
fn first(cost: Cost, stated: &[f64]) -> (Repl, MemoryStore) {
    let examples = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(examples.join("first.lxq")).unwrap();
    let text = text.replace("size 480x270", "size 32x18");
    let store = MemoryStore::default();
    let host = Host {
        files: Box::new(Folder::new(&examples, 1 << 20)),
        store: Box::new(store.clone()),
        clock: Box::new(Stopped),
        renderer: Arc::new(Altered {
            cost: Some(cost),
            stated: stated.to_vec(),
            is_smeared: true,
            ..Altered::default()
        }),
        ..Host::default()
    };
    let show = prompt("first.lxq", text.as_bytes(), host).unwrap();
    (show, store)
}

#[test]
fn the_next_steps_have_their_price() {
    let (mut show, _) = first(SHARED, &[]);
    let engine = show.engine_mut();
    engine.coarse().unwrap();
    let now = engine.estimate().predicted_error().unwrap();
    let mut priced = |count| {
        let wanted = Refinement::from(Goal::count(count)).by(Way::Paper);
        let ways = engine.ways(wanted).unwrap();
        (ways[0].mixed, ways[0].seconds, ways[0].error < now)
    };
    // Preparation and both lights, then one image.
    assert_eq!(priced(1), (1, 2.625, true));
    assert_eq!(priced(2), (2, 2.75, true));
    assert_eq!(priced(3), (2, 2.75, true));
    show.execute("refine").unwrap();
    let ways = show.engine().estimate().ways(&Goal::count(1)).unwrap();
    assert_eq!((ways[0].mixed, ways[0].seconds), (1, 0.125));
    for (line, words) in [
        ("plan 3", "`3` is left over: plan [--json] [--tolerance X]"),
        ("run --count 3 4", "`4` is left over"),
        ("run --count some", "not a whole number"),
        (
            "plan --json --tasks t.json",
            "`--json` does not go with `--tasks FILE`",
        ),
    ] {
        let error = show.execute(line).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn one_picture_is_always_rendered_and_another_where_it_fits() {
    let (mut show, _) = first(UNSHARED, &[]);
    let text = show.execute("refine for 2s").unwrap().text;
    assert_eq!(show.engine().estimate().refined(), 1);
    assert!(
        text.contains("would take 3.00 s, which does not fit"),
        "{text}"
    );
}
