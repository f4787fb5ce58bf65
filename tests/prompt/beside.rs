//! `refine … &`: background rendering during edits and previews. The tests run the tasks one at a
//! time, so that every order of events is possible.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use crate::operator::Altered;
use crate::prompt;
use footlight_engine::{self as engine, Background, Ended, Goal, Host};
use footlight_host::work::Progress;
use footlight_prompt::Repl;
use footlight_transport::Quality;
use proptest::prelude::*;

/// Light from three panels with a box between, without files.
const SHOW: &str = r#"show "Beside"
preview { tolerance 1%  coarse 1  refined 3 }
view house  from 0, -5, 1.6  to 0, 0, 1.2  fov 45  size 48x30
view wing   from 3, -3, 1.6  to 0, 0, 1.2  fov 45  size 48x30

surface floor  reflectance 0.5  quad -3, -3, 0  3, -3, 0  3, 3, 0  -3, 3, 0
surface wall   reflectance 0.6  quad -3, 3, 0  3, 3, 0  3, 3, 3  -3, 3, 3
surface block  reflectance 0.4  box from -0.5, -0.5, 0  to 0.5, 0.5, 1

light left   spot  at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd  2700 K
light right  spot  at  2, -2, 3.5  aim  0.8, 0.5, 0.5  beam 30  field 50  900 cd  6500 K
light over   spot  at  0,  0, 4.5  aim 0, 0, 0  beam 40  field 70  700 cd
bank warm = left
bank cool = right
bank top  = over

cue 1 at 0:00 { snap  warm 80  cool 10 }
cue 2 at 0:02 { time 6  warm 15  cool 90 }
cue 3 at 0:05 { time 3  curve ease  top 70 }
"#;

type Task = Box<dyn FnOnce() + Send>;

/// Tasks that wait until the test runs them.
#[derive(Clone, Default)]
struct Queue(Arc<Mutex<VecDeque<Task>>>);

impl Background for Queue {
    fn start(&self, task: Task) {
        self.0.lock().unwrap().push_back(task);
    }
}

impl Queue {
    /// Runs a waiting task; false if there is none.
    fn run(&self) -> bool {
        let task = self.0.lock().unwrap().pop_front();
        task.map(|task| task()).is_some()
    }

    fn waiting(&self) -> usize {
        self.0.lock().unwrap().len()
    }
}

fn open() -> (Repl, Queue) {
    open_text(SHOW)
}

fn open_text(text: &str) -> (Repl, Queue) {
    let queue = Queue::default();
    let show = prompt("b.lxq", text.as_bytes(), host(&queue)).unwrap();
    (show, queue)
}

fn host(queue: &Queue) -> Host {
    Host {
        background: Some(Box::new(queue.clone())),
        renderer: Arc::new(Altered {
            finest: Some(Quality(4)),
            ..Altered::unstated()
        }),
        ..Host::default()
    }
}

fn say(show: &mut Repl, line: &str) -> String {
    match show.execute(line) {
        Ok(reply) => reply.notes.join("\n") + &reply.text,
        Err(error) => error
            .report(footlight_show::diagnostic::Style::Plain)
            .into(),
    }
}

fn settings(show: &Repl) -> Vec<Vec<f64>> {
    show.engine().estimate().pool().unwrap().settings()
}

fn picture(show: &mut Repl) -> Vec<u8> {
    show.execute("picture 0:04").unwrap().picture.unwrap().rgb
}

/// Runs all tasks; returns the messages.
fn finish(show: &mut Repl, queue: &Queue) -> Vec<footlight::Printable> {
    let mut notes = show.poll();
    while queue.run() {
        notes.extend(show.poll());
    }
    assert!(!show.engine().is_busy());
    notes
}

#[test]
fn beside_the_prompt_the_same_pictures_are_rendered_and_pictures_are_served_meanwhile() {
    let (mut show, queue) = open();
    let text = say(&mut show, "refine 2 &");
    assert!(text.contains("in the background"), "{text}");
    // Both coarse steps first, each in one call.
    assert!(say(&mut show, "status").contains("3 coarse pictures at quality 1"));
    assert!(queue.run());
    assert!(say(&mut show, "status").contains("3 coarse pictures at quality 2"));
    assert!(queue.run());
    let status = say(&mut show, "status");
    assert!(status.contains("a picture at quality 3"), "{status}");
    // The current pool has only coarse images.
    let (mut twin, _) = open();
    twin.engine_mut().coarse().unwrap();
    assert_eq!(picture(&mut show), picture(&mut twin));
    assert_eq!(queue.waiting(), 1);
    assert!(queue.run());
    let first = picture(&mut show);
    say(&mut twin, "refine 1");
    assert_eq!(first, picture(&mut twin));
    let notes = finish(&mut show, &queue);
    assert_eq!(notes.len(), 1);
    assert!(
        notes[0].starts_with("refine 2 &: predicted error "),
        "{notes:?}"
    );
    say(&mut twin, "refine 1");
    assert_eq!(settings(&show), settings(&twin));
    assert_eq!(picture(&mut show), picture(&mut twin));
    assert_eq!(
        show.engine().estimate().steps().len(),
        twin.engine().estimate().steps().len()
    );
}

#[test]
fn an_edit_plans_anew_what_is_still_to_come() {
    let edit = "cue 3 { time 3  top 5  warm 100 }";
    let (mut show, queue) = open();
    show.engine_mut().coarse().unwrap();
    say(&mut show, "refine 3 &");
    let text = say(&mut show, edit);
    assert!(text.contains("cue 3"), "{text}");
    finish(&mut show, &queue);
    // The first was in progress when the edit came; the others follow the new text.
    let (mut twin, _) = open();
    say(&mut twin, "refine 1");
    say(&mut twin, edit);
    say(&mut twin, "refine 2");
    assert_eq!(settings(&show), settings(&twin));
    // These differ from those of the old text.
    let (mut old, _) = open();
    say(&mut old, "refine 3");
    assert_ne!(settings(&show)[1], settings(&old)[1]);
}

#[test]
fn another_place_to_look_from_leaves_a_refinement_where_it_is() {
    let (mut show, queue) = open();
    show.engine_mut().coarse().unwrap();
    say(&mut show, "refine 2 &");
    say(&mut show, "view wing");
    let status = say(&mut show, "status");
    assert!(status.contains("a picture at quality 3"), "{status}");
    let notes = finish(&mut show, &queue);
    assert_eq!(notes.len(), 1, "{notes:?}");
    // Three coarse images at two steps and two refined ones, of the first view only.
    assert_eq!(show.engine().images().statistics().rendered, 6 + 2);
    assert_eq!(show.engine().estimate().refined(), 0);
    say(&mut show, "view house");
    show.engine_mut().coarse().unwrap();
    assert_eq!(show.engine().estimate().refined(), 2);
}

#[test]
fn a_refinement_owns_its_view() {
    let (mut show, queue) = open();
    say(&mut show, "refine 2 --view wing &");
    assert_eq!(show.engine().document().view(), Some("house"));
    let house = picture(&mut show);
    assert!(queue.run());
    // An edit during refinement takes effect.
    say(&mut show, "cue 3 { time 3  top 5  warm 100 }");
    let notes = finish(&mut show, &queue);
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert_eq!(show.engine().estimate().refined(), 0);
    say(&mut show, "undo");
    assert_eq!(picture(&mut show), house);
    say(&mut show, "view wing");
    let rendered = show.engine().images().statistics().rendered;
    picture(&mut show);
    assert_eq!(show.engine().estimate().refined(), 2);
    assert_eq!(show.engine().images().statistics().rendered, rendered);
}

#[test]
fn a_refinement_owns_its_way() {
    let host = |queue: &Queue| Host {
        background: Some(Box::new(queue.clone())),
        ..Host::default()
    };
    for way in ["paper", "alone", "auto"] {
        let queue = Queue::default();
        let mut show = prompt("b.lxq", SHOW.as_bytes(), host(&queue)).unwrap();
        say(&mut show, &format!("refine until 2% --way {way} &"));
        let status = say(&mut show, "status");
        let line = format!("refine until 2% --way {way} &:");
        assert!(status.contains(&line), "{status}");
        finish(&mut show, &queue);
        let mut twin = prompt("b.lxq", SHOW.as_bytes(), host(&queue)).unwrap();
        say(&mut twin, &format!("refine until 2% --way {way}"));
        let (own, other) = (settings(&show).concat(), settings(&twin).concat());
        assert_eq!(own.len(), other.len(), "{way}");
        let pairs = own.iter().zip(&other);
        assert!(
            pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-12),
            "{way}"
        );
        let quality = |show: &Repl| show.engine().estimate().pool().unwrap().coarse()[0].clone();
        assert_eq!(quality(&show), quality(&twin), "{way}");
    }
}

#[test]
fn nothing_that_the_background_renders_is_rendered_in_front_of_the_prompt() {
    let queue = Queue::default();
    let host = Host {
        background: Some(Box::new(queue.clone())),
        impatient: true,
        ..Host::default()
    };
    let mut show = prompt("b.lxq", SHOW.as_bytes(), host).unwrap();
    let first = picture(&mut show);
    say(&mut show, "refine 2 &");
    let rendered = show.engine().images().statistics().rendered;
    assert_eq!(picture(&mut show), first);
    say(&mut show, "set warm 30");
    assert_eq!(show.engine().images().statistics().rendered, rendered);
    let notes = finish(&mut show, &queue);
    assert_eq!(show.engine().estimate().refined(), 2, "{notes:?}");

    // Before there are images, only requests that need them are refused.
    let queue = Queue::default();
    let host = Host {
        impatient: true,
        ..self::host(&queue)
    };
    let mut show = prompt("b.lxq", SHOW.as_bytes(), host).unwrap();
    say(&mut show, "refine 1 &");
    let refused = say(&mut show, "picture 0:04");
    assert!(refused.contains("`wait` waits for them"), "{refused}");
    assert!(say(&mut show, "set warm 30").contains("trying warm 30"));
    assert!(say(&mut show, "status").contains("coarse pictures"));
    assert_eq!(show.engine().images().statistics().rendered, 0);
    finish(&mut show, &queue);
    picture(&mut show);
}

#[test]
fn a_bank_more_keeps_the_picture_in_hand() {
    let (mut show, queue) = open();
    show.engine_mut().coarse().unwrap();
    say(&mut show, "refine 1 &");
    say(
        &mut show,
        "light side spot at 3, 0, 2 aim 0, 0, 1 beam 20 field 40 500 cd",
    );
    say(&mut show, "bank wash = side");
    let before = show.engine().images().statistics().rendered;
    let notes = finish(&mut show, &queue);
    assert!(notes[0].starts_with("refine 1 &"), "{notes:?}");
    // It serves the pool of the new rig, whose other coarse images exist.
    show.engine_mut().coarse().unwrap();
    assert_eq!(show.engine().estimate().refined(), 1);
    assert_eq!(show.engine().images().statistics().rendered - before, 1 + 2);
}

#[test]
fn stop_keeps_what_is_in_hand_and_stop_now_does_not() {
    for (word, refined) in [("stop", 1), ("stop now", 0)] {
        let (mut show, queue) = open();
        show.engine_mut().coarse().unwrap();
        say(&mut show, "refine until 0.001% &");
        say(&mut show, word);
        assert_eq!(queue.waiting(), 1);
        let notes = finish(&mut show, &queue);
        assert!(notes[0].ends_with("stopped; what is finished is kept"));
        assert_eq!(show.engine().estimate().refined(), refined, "{word}");
        assert!(say(&mut show, word).contains("nothing is running"));
        // The operator was returned: another refinement uses it.
        say(&mut show, "refine 1");
        assert_eq!(show.engine().estimate().refined(), refined + 1);
    }
}

#[test]
fn stop_ends_it_among_coarse_pictures_too() {
    for word in ["stop", "stop now"] {
        let (mut show, queue) = open();
        say(&mut show, "refine &");
        say(&mut show, word);
        assert!(queue.run());
        let notes = show.poll();
        assert!(
            notes[0].ends_with("stopped; what is finished is kept"),
            "{notes:?}"
        );
        assert!(!show.engine().is_busy() && queue.waiting() == 0, "{word}");
        // Nothing is lost with it.
        say(&mut show, "refine 1");
        assert_eq!(show.engine().estimate().refined(), 1);
    }
}

#[test]
fn an_edit_of_the_coarse_step_meanwhile_makes_the_pool_of_that_step() {
    for (before, after) in [(1, 2), (2, 1)] {
        let preview = |coarse| format!("preview {{ tolerance 1%  coarse {coarse}  refined 4 }}");
        let (mut show, queue) = open();
        say(&mut show, &preview(before));
        say(&mut show, "refine 1 &");
        assert!(queue.run());
        show.poll();
        say(&mut show, &preview(after));
        finish(&mut show, &queue);
        let (mut twin, _) = open();
        say(&mut twin, &preview(after));
        say(&mut twin, "refine 1");
        assert_eq!(settings(&show), settings(&twin), "{before} to {after}");
        assert_eq!(picture(&mut show), picture(&mut twin));
        let error = |show: &Repl| show.engine().estimate().predicted_error().unwrap();
        assert_eq!(error(&show), error(&twin));
    }
}

#[test]
fn a_view_that_is_looked_from_already_changes_nothing() {
    let (mut show, _) = open();
    show.engine_mut().coarse().unwrap();
    let steps = show.engine().estimate().steps().to_vec();
    say(&mut show, "view house");
    assert_eq!(show.engine().estimate().steps(), steps);
}

#[test]
fn two_at_once_and_a_host_without_threads_are_refused() {
    let (mut show, queue) = open();
    say(&mut show, "refine &");
    for line in ["refine", "refine 2 &", "run"] {
        let text = say(&mut show, line);
        assert!(text.contains("`refine &` is at work"), "{line}: {text}");
    }
    finish(&mut show, &queue);
    let mut alone = prompt("b.lxq", SHOW.as_bytes(), Host::default()).unwrap();
    assert!(say(&mut alone, "refine &").contains("without `&`"));
    let mut empty = crate::empty(Host {
        background: Some(Box::new(queue)),
        ..Host::default()
    });
    assert!(say(&mut empty, "refine &").contains("no stage"));
    assert!(!empty.engine().is_busy());
}

#[test]
fn a_task_that_breaks_off_ends_the_refinement_and_nothing_else() {
    let (mut show, queue) = open();
    show.engine_mut().coarse().unwrap();
    say(&mut show, "refine 5 &");
    queue.0.lock().unwrap().clear();
    let notes = show.poll();
    assert!(notes[0].contains("broke off"), "{notes:?}");
    assert!(!show.engine().is_busy());
    say(&mut show, "refine 1");
    assert_eq!(show.engine().estimate().refined(), 1);
}

#[test]
fn leaving_gives_up_what_is_in_hand() {
    let (mut show, queue) = open();
    show.engine_mut().coarse().unwrap();
    say(&mut show, "refine 5 &");
    assert!(show.execute("quit").unwrap().quit);
    let before = show.engine().images().statistics().rendered;
    assert!(queue.run());
    assert!(show.poll().concat().contains("stopped"));
    assert_eq!(show.engine().images().statistics().rendered, before);
}

/// Cancels once the first image is finished.
struct Impatient {
    pictures: AtomicUsize,
}

impl Progress for Impatient {
    fn report(&self, task: &str, _: usize, _: usize) {
        if task == "refined pictures" {
            self.pictures.fetch_add(1, Ordering::SeqCst);
        }
    }

    fn cancelled(&self) -> bool {
        self.pictures.load(Ordering::SeqCst) > 0
    }
}

#[test]
fn a_cancel_keeps_the_pictures_that_are_finished() {
    let host = Host {
        progress: Box::new(Impatient {
            pictures: AtomicUsize::new(0),
        }),
        ..Host::default()
    };
    let goal = Goal::count(5);
    let mut show = prompt("b.lxq", SHOW.as_bytes(), host).unwrap();
    assert_eq!(
        show.engine_mut().refine(goal).unwrap().ended,
        Some(Ended::Stopped)
    );
    assert_eq!(show.engine().estimate().refined(), 1);
    let error = show.execute("refine 5").unwrap_err();
    assert!(
        matches!(error.engine(), Some(engine::Error::Cancelled(_))),
        "{error:?}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// For any order of events, the prompt answers, the refinement ends, and the image equals that
    /// of a session with only the last text.
    #[test]
    #[ignore = "slow"]
    fn any_order_of_events_ends_well(events in prop::collection::vec(0..8_u8, 1..14)) {
        let (mut show, queue) = open();
        for event in events {
            match event {
                0 => drop(say(&mut show, "refine until 0.5% &")),
                1 | 2 => drop(queue.run()),
                3 => drop(say(&mut show, "cue 2 { time 4  warm 70  cool 20 }")),
                4 => drop(say(&mut show, "undo")),
                5 => drop(say(&mut show, "light right spot at 2, -2, 3.5 aim 0.8, 0.5, 0.5 beam 20 field 40 700 cd")),
                6 => drop(say(&mut show, "stop")),
                _ => prop_assert!(!say(&mut show, "status").is_empty()),
            }
        }
        finish(&mut show, &queue);
        show.engine_mut().coarse().unwrap();
        let (mut twin, _) = open_text(show.engine().document().text());
        twin.engine_mut().coarse().unwrap();
        if show.engine().estimate().refined() == 0 {
            prop_assert_eq!(picture(&mut show), picture(&mut twin));
        }
        say(&mut show, "refine until 0.5%");
        prop_assert!(show.engine().estimate().refined() >= 2);
        prop_assert!(show.engine().estimate().predicted_error().unwrap() <= 0.005);
    }
}
