//! Which way an error is reached, what is said of it, and that every verb says the same.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::operator::Altered;
use crate::{Stopped, prompt};
use footlight::engine::{Ended, Goal, Host, Way};
use footlight::files::{Folder, MemoryStore};
use footlight::renderer::Cost;
use footlight::repl::Repl;

/// What each step is off by, as the operator of these tests states it.
const STATED: [f64; 5] = [0.08, 0.04, 0.02, 0.01, 0.002];

/// The first show, small, with an operator that states its errors; what it renders is counted.
fn open(cost: Option<Cost>, store: &MemoryStore) -> (Repl, Arc<AtomicUsize>) {
    let examples = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(examples.join("first.lxq")).unwrap();
    let text = text.replace("size 480x270", "size 32x18");
    let rendered = Arc::new(AtomicUsize::new(0));
    let host = Host {
        files: Box::new(Folder::new(&examples, 1 << 20)),
        store: Box::new(store.clone()),
        clock: Box::new(Stopped),
        renderer: Arc::new(Altered {
            cost,
            stated: STATED.to_vec(),
            is_stored: true,
            rendered: Arc::clone(&rendered),
            ..Altered::default()
        }),
        ..Host::default()
    };
    (
        prompt("first.lxq", text.as_bytes(), host).unwrap(),
        rendered,
    )
}

fn say(show: &mut Repl, line: &str) -> String {
    match show.execute(line) {
        Ok(reply) => reply.text.to_string(),
        Err(error) => format!("error: {error}"),
    }
}

/// Where preparing a step is what costs, every bank alone at the cheapest step that is good enough
/// beats any mixture.
#[test]
fn one_step_is_enough_where_pictures_share_their_work() {
    for (until, quality) in [(0.05, 2), (0.02, 3), (0.015, 4)] {
        let (mut show, rendered) = open(None, &MemoryStore::default());
        let done = show.engine_mut().refine(Goal::until(until)).unwrap();
        let engine = show.engine();
        assert_eq!((done.ended, engine.refined()), (Some(Ended::Reached), 0));
        assert_eq!(engine.coarse_steps().map(|q| q.0), [quality; 2]);
        assert_eq!(rendered.load(Ordering::Relaxed), 2, "each bank once");
        let error = engine.predicted_error().unwrap();
        assert!((error - STATED[usize::from(quality) - 1]).abs() < 1e-12);
    }
}

/// Where every picture costs the same, a mixture on top of what is there is one picture and not two.
#[test]
fn mixtures_win_where_a_picture_costs_what_a_picture_costs() {
    let each = Cost {
        per_image: 60.0,
        per_lone: 60.0,
        ..Cost::default()
    };
    let (mut show, rendered) = open(Some(each), &MemoryStore::default());
    show.engine_mut().coarse().unwrap();
    let before = rendered.load(Ordering::Relaxed);
    let until = 0.9 * show.engine().predicted_error().unwrap();
    assert!(until > STATED[4]);
    let ways = show.engine().ways(&Goal::until(until)).unwrap();
    let mixed = &ways[0];
    assert_eq!(mixed.way, Way::Paper, "{ways:?}");
    assert_eq!(mixed.seconds, 60.0 * mixed.mixed as f64);
    let next = ways.iter().find(|w| w.way == Way::Alone && w.reaches);
    assert_eq!(next.map(|w| w.seconds), Some(120.0), "{ways:?}");
    show.engine_mut().refine(Goal::until(until)).unwrap();
    assert!(rendered.load(Ordering::Relaxed) - before <= 2);
    // By name it is the other one.
    say(&mut show, "refine until 0.2% --way alone");
    assert_eq!(show.engine().coarse_steps().map(|q| q.0), [5; 2]);
    assert_eq!(show.engine().way(), Way::Auto);
}

#[test]
fn a_way_is_taken_by_name() {
    let (mut show, _) = open(None, &MemoryStore::default());
    let text = say(&mut show, "plan --tolerance 5% --way paper");
    assert!(text.contains("coarse pictures up to quality 2"), "{text}");
    let text = say(&mut show, "plan --tolerance 5%");
    assert!(text.contains("every bank alone at quality 2"), "{text}");
    say(&mut show, "refine until 0.1% --way paper");
    assert_eq!(show.engine().coarse_steps().map(|q| q.0), [1, 2]);
    assert!(show.engine().refined() > 0);
    let text = say(&mut show, "plan --way shortest");
    assert!(text.contains("it is auto, paper or alone"), "{text}");
}

/// Below what the finest step is itself off by nothing is left to do but to say so.
#[test]
fn more_than_the_finest_step_gives_is_not_promised() {
    let (mut show, rendered) = open(None, &MemoryStore::default());
    let text = say(&mut show, "refine until 0.1%");
    assert!(
        text.contains("the finest step of quality is itself off by"),
        "{text}"
    );
    assert_eq!(rendered.load(Ordering::Relaxed), 2);
    say(&mut show, "refine until 0.1%");
    assert_eq!(rendered.load(Ordering::Relaxed), 2, "nothing again");
}

/// What one way rendered serves another, later sessions and edits.
#[test]
fn what_is_rendered_serves_on() {
    let store = MemoryStore::default();
    let (mut show, rendered) = open(None, &store);
    show.engine_mut().refine(Goal::until(0.02)).unwrap();
    say(&mut show, "cue 2 { lamp 60 }");
    show.engine_mut().coarse().unwrap();
    assert_eq!(show.engine().coarse_steps().map(|q| q.0), [3; 2]);
    assert_eq!(
        rendered.load(Ordering::Relaxed),
        2,
        "an edit renders nothing"
    );
    // A finer error later takes one step more, and the pictures before it stay.
    show.engine_mut().refine(Goal::until(0.01)).unwrap();
    assert_eq!(rendered.load(Ordering::Relaxed), 4);
}

/// Plan, spectrum, error, status and run name one count, one error and one metric.
#[test]
fn every_verb_says_the_same_of_one_pool() {
    let (mut show, _) = open(None, &MemoryStore::default());
    let first = say(&mut show, "plan");
    assert!(first.contains("metric settings"), "{first}");
    assert!(first.contains("counted again"), "{first}");
    let ran = say(&mut show, "run -o out");
    assert!(ran.contains("error 2.00 % -> 2.00 %"), "{ran}");
    let plan = say(&mut show, "plan");
    assert!(plan.contains("0 refined pictures of 2"), "{plan}");
    assert!(plan.contains("metric norm"), "{plan}");
    assert!(plan.contains("what is there"), "{plan}");
    let spectrum = say(&mut show, "plot spectrum -o s.svg");
    assert!(
        spectrum.contains("0 refined pictures of 2 reach 2.00 % (metric norm)"),
        "{spectrum}"
    );
    let error = say(&mut show, "plot error -o e.svg");
    assert!(
        error.contains("0 refined pictures: predicted error 2.00 %"),
        "{error}"
    );
    let status = say(&mut show, "status");
    assert!(
        status.contains("0 refined pictures, error 2.00 %"),
        "{status}"
    );
}
