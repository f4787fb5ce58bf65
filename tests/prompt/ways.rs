//! The method chosen for an error, its description, and its consistency over all verbs.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::operator::Altered;
use crate::{Stopped, prompt};
use footlight_engine::{Ended, Goal, Host, Way};
use footlight_host::files::{Folder, MemoryStore};
use footlight_picture::Image;
use footlight_picture::combine::{combine, dot};
use footlight_prompt::Repl;
use footlight_show::units::ErrorUnit;
use footlight_transport::{Cost, Quality};

/// Errors of each step, as stated by the operator of these tests.
const STATED: [f64; 3] = [0.04, 0.02, 0.0005];

/// The first show, small, with an operator that states its errors; counts its images.
fn open(cost: Option<Cost>, store: &MemoryStore) -> (Repl, Arc<AtomicUsize>) {
    open_show("first.lxq", cost, store)
}

fn open_show(name: &str, cost: Option<Cost>, store: &MemoryStore) -> (Repl, Arc<AtomicUsize>) {
    let rendered = Arc::new(AtomicUsize::new(0));
    let renderer = Altered {
        cost,
        stated: STATED.to_vec(),
        is_stored: true,
        rendered: Arc::clone(&rendered),
        ..Altered::default()
    };
    (open_with(name, renderer, store), rendered)
}

fn open_with(name: &str, renderer: Altered, store: &MemoryStore) -> Repl {
    let examples = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let path = examples.join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let text = text.replace("size 480x270", "size 32x18");
    let text = text.replace("size 640x360", "size 32x18");
    let host = Host {
        files: Box::new(Folder::new(path.parent().unwrap(), 1 << 20)),
        store: Box::new(store.clone()),
        clock: Box::new(Stopped),
        renderer: Arc::new(renderer),
        ..Host::default()
    };
    prompt("first.lxq", text.as_bytes(), host).unwrap()
}

fn say(show: &mut Repl, line: &str) -> String {
    match show.execute(line) {
        Ok(reply) => reply.text.to_string(),
        Err(error) => format!("error: {error}"),
    }
}

/// When the cost is in preparing a step, every bank alone at the cheapest sufficient step beats any
/// mixture.
#[test]
fn one_step_is_enough_where_pictures_share_their_work() {
    for (until, quality) in [(0.05, 1), (0.02, 2), (0.015, 3)] {
        let (mut show, rendered) = open(None, &MemoryStore::default());
        let done = show.engine_mut().refine(Goal::until(until)).unwrap();
        let engine = show.engine();
        assert_eq!(
            (done.ended, engine.estimate().refined()),
            (Some(Ended::Reached), 0)
        );
        assert_eq!(engine.estimate().coarse_steps().map(|q| q.0), [quality; 2]);
        assert_eq!(rendered.load(Ordering::Relaxed), 2, "each bank once");
        let error = engine.estimate().predicted_error().unwrap();
        assert!((error - STATED[usize::from(quality) - 1]).abs() < 1e-12);
    }
}

/// A displayed error uses the step stated to reach it, and every verb names it so.
#[test]
fn steps_of_the_display_are_an_error_too() {
    let (mut show, _) = open(None, &MemoryStore::default());
    let text = say(&mut show, "plan --tolerance 12steps");
    assert!(text.contains("for an error of 12.0 steps"), "{text}");
    assert!(text.contains("ways to an error of 12.0 steps"), "{text}");
    assert!(text.contains("every bank alone at quality 2"), "{text}");
    say(&mut show, "refine until 12 steps");
    let engine = show.engine();
    assert_eq!(engine.estimate().coarse_steps().map(|q| q.0), [2; 2]);
    let error = engine.estimate().predicted_in(ErrorUnit::Steps).unwrap();
    assert!((error - 10.0).abs() < 1e-9, "as stated: {error}");
    let ran = say(&mut show, "run --until 12steps -o out");
    assert!(ran.contains("10.0 steps at cue 3, 0:14"), "{ran}");
    assert!(ran.contains("asked for 12.0 steps"), "{ran}");
    let spectrum = say(&mut show, "plot spectrum --tolerance 12steps -o s.svg");
    assert!(spectrum.contains("reach 12.0 steps"), "{spectrum}");
    say(&mut show, "preview { tolerance 12 steps }");
    let text = say(&mut show, "plan");
    assert!(text.contains("ways to an error of 12.0 steps"), "{text}");
    let held = say(&mut show, "status");
    assert!(held.contains("preview { tolerance 12 steps "), "{held}");
    for wrong in ["refine until 300 steps", "run --until xsteps"] {
        let text = say(&mut show, wrong);
        assert!(text.contains("write steps of 255 as 1.5steps"), "{text}");
    }
}

/// When every image has equal cost, two mixtures on top of existing images beat five banks.
#[test]
#[ignore = "slow"]
fn mixtures_win_where_a_picture_costs_what_a_picture_costs() {
    let each = Cost {
        per_image: 60.0,
        per_lone: 60.0,
        ..Cost::default()
    };
    let store = MemoryStore::default();
    let (mut show, rendered) = open_show("sketch/sketch.lxq", Some(each), &store);
    show.engine_mut().coarse().unwrap();
    let before = rendered.load(Ordering::Relaxed);
    let until = 0.9 * show.engine().estimate().predicted_error().unwrap();
    assert!(until > STATED[2]);
    let ways = show.engine().estimate().ways(&Goal::until(until)).unwrap();
    let mixed = &ways[0];
    assert_eq!(mixed.way, Way::Paper, "{ways:?}");
    assert_eq!(mixed.seconds, 60.0 * mixed.mixed as f64);
    assert!(mixed.reaches && mixed.mixed < 5);
    let next = ways.iter().find(|w| w.way == Way::Alone && w.reaches);
    assert_eq!(next.map(|w| w.seconds), Some(300.0), "{ways:?}");
    show.engine_mut().refine(Goal::until(until)).unwrap();
    assert!(rendered.load(Ordering::Relaxed) - before < 5);
    // On request it is the other method.
    say(&mut show, "refine until 0.2% --way alone");
    assert_eq!(show.engine().estimate().coarse_steps().map(|q| q.0), [3; 2]);
}

#[test]
fn a_way_is_taken_by_name() {
    let (mut show, _) = open(None, &MemoryStore::default());
    let text = say(&mut show, "plan --tolerance 5% --way paper");
    assert!(text.contains("coarse pictures up to quality 1"), "{text}");
    let text = say(&mut show, "plan --tolerance 5%");
    assert!(text.contains("every bank alone at quality 1"), "{text}");
    say(&mut show, "refine until 0.1% --way paper");
    assert_eq!(show.engine().estimate().coarse_steps().map(|q| q.0), [1, 1]);
    assert!(show.engine().estimate().refined() > 0);
    let text = say(&mut show, "plan --way shortest");
    assert!(text.contains("takes auto, paper, alone"), "{text}");
}

/// Below the error of the finest step, the program only says so.
#[test]
fn more_than_the_finest_step_gives_is_not_promised() {
    let (mut show, rendered) = open(None, &MemoryStore::default());
    let text = say(&mut show, "refine until 0.01%");
    assert!(
        text.contains("the finest step of quality is itself off by"),
        "{text}"
    );
    assert_eq!(rendered.load(Ordering::Relaxed), 2);
    say(&mut show, "refine until 0.01%");
    assert_eq!(rendered.load(Ordering::Relaxed), 2, "nothing again");
}

/// The summary of a run begins with the error and the time, and no line is wider than 100 columns.
#[test]
fn the_summary_of_a_run_is_six_lines() {
    let (mut show, _) = open(None, &MemoryStore::default());
    let text = say(&mut show, "run --until 2% -o out");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 6, "{text}");
    assert!(lines[0].starts_with("error    2.00 % at"), "{text}");
    assert!(lines[1].starts_with("took     0 ms: "), "{text}");
    assert!(lines[1].contains("; half the error takes some"), "{text}");
    let text = say(
        &mut show,
        "run -o out/of-a-folder-whose-name-alone-is-long/and-long",
    );
    assert_eq!(text.lines().count(), 7, "{text}");
    assert!(
        text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );
    assert!(text.contains(" in a\n         browser;"), "{text}");
}

/// When a step exceeds the memory, the finest one below it is used, and the option that allows more
/// is named; the default is 4096.
#[test]
fn a_step_that_memory_does_not_hold_is_settled_without() {
    let open = |step| {
        let too_large = Altered {
            stated: STATED.to_vec(),
            too_large: Some(Quality(step)),
            ..Altered::default()
        };
        open_with("first.lxq", too_large, &MemoryStore::default())
    };
    let mut show = open(3);
    // No usable image is rendered yet.
    let text = say(&mut show, "refine until 0.1%");
    let words = "as exact as the memory allows: quality 3 needs `--memory 4105` or more";
    assert!(text.contains(words), "{text}");
    let steps = |show: &Repl| show.engine().estimate().coarse_steps().map(|q| q.0);
    assert_eq!(steps(&show), [2; 2]);
    let ran = say(&mut show, "run --until 0.1% -o out");
    let error =
        "error    2.00 % at cue 1, 0:00, predicted; asked for 0.100 %; memory allows no less";
    assert!(ran.contains(error), "{ran}");
    assert!(
        ran.contains("; quality 3 needs `--memory 4105` or more"),
        "{ran}"
    );
    let text = say(&mut show, "refine until 2%");
    assert!(text.contains("the error asked for is reached"), "{text}");
    // Stored images are used where a finer step or mixtures would follow.
    for line in ["refine until 0.1%", "refine 1"] {
        let mut show = open(2);
        show.engine_mut().coarse().unwrap();
        let text = say(&mut show, line);
        assert!(text.contains("quality 2 needs `--memory 4105`"), "{text}");
        assert_eq!(steps(&show), [1; 2]);
    }
    // Without any image there is no fallback.
    let text = say(&mut open(1), "refine until 0.1%");
    assert!(text.contains("error: the stage"), "{text}");
}

/// Images of one method serve another, later sessions and edits.
#[test]
fn what_is_rendered_serves_on() {
    let store = MemoryStore::default();
    let (mut show, rendered) = open(None, &store);
    show.engine_mut().refine(Goal::until(0.02)).unwrap();
    say(&mut show, "cue 2 { lamp 60 }");
    show.engine_mut().coarse().unwrap();
    assert_eq!(show.engine().estimate().coarse_steps().map(|q| q.0), [2; 2]);
    assert_eq!(
        rendered.load(Ordering::Relaxed),
        2,
        "an edit renders nothing"
    );
    // A smaller error later takes one step more, and the earlier images stay.
    show.engine_mut().refine(Goal::until(0.01)).unwrap();
    assert_eq!(rendered.load(Ordering::Relaxed), 4);
}

/// Plan, spectrum, error, status and run name one count and one error.
#[test]
fn every_verb_says_the_same_of_one_pool() {
    let (mut show, _) = open(None, &MemoryStore::default());
    let first = say(&mut show, "plan");
    assert!(first.contains("counted again"), "{first}");
    let ran = say(&mut show, "run -o out");
    assert!(ran.contains("error    2.00 % at cue"), "{ran}");
    let plan = say(&mut show, "plan");
    assert!(plan.contains("0 refined pictures of 2"), "{plan}");
    assert!(plan.contains("stored pictures are enough"), "{plan}");
    let spectrum = say(&mut show, "plot spectrum -o s.svg");
    assert!(
        spectrum.contains("0 refined pictures of 2 reach 2.00 %"),
        "{spectrum}"
    );
    let error = say(&mut show, "plot error -o e.svg");
    assert!(
        error.contains("0 refined pictures: predicted error 2.00 %"),
        "{error}"
    );
    let status = say(&mut show, "status");
    assert!(
        status.contains("0 refined pictures, predicted error 2.00 %"),
        "{status}"
    );
}

/// The measured error of coarse images agrees with the finest step at every moment; an unreachable
/// goal is reported.
#[test]
#[ignore = "slow"]
fn what_is_measured_of_a_room_is_true() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/hall");
    let text = std::fs::read_to_string(folder.join("hall.lxq")).unwrap();
    let text = text.replace("size 480x300", "size 64x40");
    assert!(text.contains("size 64x40"));
    let open = || {
        let host = Host {
            files: Box::new(Folder::new(&folder, 1 << 20)),
            threads: 2,
            ..Host::default()
        };
        prompt("hall.lxq", text.as_bytes(), host).unwrap()
    };
    // The finest step is prepared separately, so that it is not cheap for the choice.
    let (mut show, mut apart) = (open(), open());
    let engine = show.engine_mut();
    let cues = engine.document().timeline().cues().to_vec();
    let both = |c: &footlight_show::timeline::CueTime| {
        [c.go + (c.completion - c.go).scaled(0.5), c.completion]
    };
    let settings: Vec<Vec<f64>> = cues
        .iter()
        .flat_map(both)
        .map(|time| engine.document().setting(time))
        .collect();
    let finest = engine.estimate().finest();
    let truth: Vec<Image> = settings
        .iter()
        .map(|s| apart.engine_mut().render(s, finest).unwrap())
        .collect();
    let ended = engine.refine(Goal::until(0.03)).unwrap().ended;
    assert_eq!(ended, Some(Ended::Reached));
    let estimate = engine.estimate();
    let (moments, _) = estimate.measured().unwrap();
    assert!(moments.iter().all(|m| m.measured.interval[0] <= 0.03));
    for (setting, truth) in settings.iter().zip(&truth) {
        let shown = engine.picture_with(setting, &[]).unwrap();
        let off = combine(truth.size(), &[(1.0, &shown), (-1.0, truth)], 1);
        let error = (dot(&off, &off) / dot(truth, truth).max(1e-30)).sqrt();
        assert!(error <= 0.03, "{error}");
    }
    assert_eq!(
        engine.estimate().coarse_steps()[1].0,
        1,
        "no finer than it must be"
    );
    let ended = engine.refine(Goal::until(1e-5)).unwrap().ended;
    assert_eq!(ended, Some(Ended::Finest));
    assert_eq!(engine.estimate().coarse_steps()[1].0, 3);
}
