//! What `tune` says, held against what the interpreter then does.

use std::sync::Arc;

use crate::files::Memory;
use crate::interpreter::{Error, Goal, Host, Interpreter};
use crate::picture::Image;
use crate::plan;
use crate::pool::Pool;
use crate::radiosity::Radiosity;
use crate::renderer::{Cost, Prepared, Quality, Setup, Transport, TransportError};
use crate::study::random_show;
use crate::study::session::sequence_error;
use crate::study::tune::{Candidate, Tuner};
use crate::work::Work;

fn show(steps: Option<(u8, u8)>) -> Interpreter {
    let made = random_show(1);
    let files = Memory::default()
        .with("room.obj", made.stage)
        .with("room.mtl", made.materials);
    let host = Host {
        files: Box::new(files),
        threads: 2,
        ..Host::default()
    };
    let text = made.show.replace("size 96x54", "size 48x27");
    let mut show = Interpreter::from_text("random.lxq", text.as_bytes(), host).unwrap();
    if let Some((coarse, refined)) = steps {
        let statement = format!("preview {{ coarse {coarse}  refined {refined} }}");
        show.edit(&statement).unwrap();
    }
    show
}

/// The true error of the sequence as a fresh interpreter shows it after so many refined pictures.
fn shown(candidate: Candidate, reference: u8) -> f64 {
    let steps = (candidate.coarse, candidate.refined.unwrap_or(4));
    let mut show = show(Some(steps));
    show.coarse().unwrap();
    if candidate.pictures > 0 {
        let goal = Goal {
            count: Some(candidate.pictures),
            ..Goal::default()
        };
        show.refine(goal).unwrap();
    }
    assert_eq!(show.refined(), candidate.pictures);
    let units = Pool::unit_settings(show.keys().coordinates());
    let mut truth: Vec<Image> = Vec::new();
    for unit in &units {
        truth.push(show.render(unit, Quality(reference)).unwrap());
    }
    let pool = show.projected().unwrap();
    let work = show.host.work();
    let seen = |unit: &Vec<f64>| pool.preview(unit, work).unwrap();
    let seen: Vec<Image> = units.iter().map(seen).collect();
    sequence_error(&seen, &truth, &plan::second_moment(show.keys()), 2)
}

/// A share of what coarse pictures alone leave that this show reaches with others: its quality 4 is
/// off by 0.86 of that itself.
const TIGHT: f64 = 0.92;

#[test]
fn the_error_told_is_that_of_what_is_shown() {
    let mut tuning = show(None);
    let (pictures, steps) = tuning.measure_steps(5, None).unwrap();
    let keys = tuning.keys().clone();
    let tuner = Tuner::new(keys, &pictures, steps, Work::silent());
    let all = tuner.unwrap().unwrap().candidates(0.0).unwrap();
    let told = [
        (1, None, 0),
        (1, Some(3), 2),
        (1, Some(4), 1),
        (2, Some(4), 3),
    ]
    .map(|wanted| {
        let is = |c: &&Candidate| (c.coarse, c.refined, c.pictures) == wanted;
        *all.iter().find(is).unwrap()
    });
    for candidate in told {
        let found = shown(candidate, 5);
        // Refined pictures are stored in single precision here, summed in double there.
        let off = (found / candidate.error - 1.0).abs();
        assert!(off < 1e-3, "{candidate:?}: {found}");
    }
}

#[test]
fn a_tighter_tolerance_costs_more_and_the_statement_can_be_typed() {
    let mut show = show(None);
    // From then on seconds are predicted, and do not depend on what else the machine has to do.
    show.tune(0.5, None).unwrap();
    let loose = show.tune(0.5, None).unwrap();
    assert_eq!((loose.choice.coarse, loose.choice.pictures), (1, 0));
    let tight = show.tune(loose.choice.error * TIGHT, None).unwrap();
    assert!(tight.choice.seconds > loose.choice.seconds);
    assert!(tight.choice.error <= TIGHT * loose.choice.error);
    // Nothing quicker is as good: that is what the cheaper choices would lose.
    let cheaper = tight.choices.iter().take_while(|c| **c != tight.choice);
    assert!(cheaper.clone().count() > 0);
    assert!(
        cheaper
            .clone()
            .all(|c| c.error > TIGHT * loose.choice.error)
    );
    show.edit(&tight.preview).unwrap();
    let preview = &show.show().preview;
    assert!((preview.tolerance - tight.until).abs() < 1e-6);
    assert_eq!(preview.coarse, tight.choice.coarse);
    assert_eq!(preview.refined, tight.choice.refined.unwrap_or(4));
}

#[test]
fn pictures_at_hand_are_not_rendered_again_and_their_seconds_are_said_to_be_predicted() {
    let mut show = show(None);
    let first = show.tune(0.02, None).unwrap();
    assert!(first.steps.iter().all(|s| s.measured && s.fixed > 0.0));
    let errors: Vec<f64> = first.steps.iter().map(|s| s.error).collect();
    assert!(errors.iter().is_sorted_by(|a, b| a > b), "{errors:?}");
    let before = show.tally();
    let second = show.tune(0.02, None).unwrap();
    assert_eq!(show.tally().since(before).rendered, 0);
    assert!(second.steps.iter().all(|s| !s.measured && s.fixed > 0.0));
    let again: Vec<f64> = second.steps.iter().map(|s| s.error).collect();
    assert_eq!(errors, again);
    let text = show.execute("tune --until 2%").unwrap().text;
    assert!(text.contains("seconds predicted"), "{text}");
}

#[test]
fn without_time_the_third_step_is_the_truth() {
    let tuned = show(None).tune(0.2, Some(0.0)).unwrap();
    assert_eq!((tuned.reference, tuned.steps.len()), (3, 3));
    // There is one coarse pair below it, and no refined step.
    assert_eq!((tuned.choice.coarse, tuned.choice.pictures), (1, 0));
    // The show's refined step was not measured.
    assert_eq!(tuned.as_it_stands, None);
}

#[test]
fn what_is_out_of_reach_says_what_is_not() {
    let mut show = show(None);
    let error = show.execute("tune --until 0.0001%").unwrap_err();
    assert!(matches!(error, Error::Usage(_)));
    let said = error.to_string();
    assert!(said.contains("out of reach"), "{said}");
    let (_, asked) = said.rsplit_once("ask for ").unwrap();
    let text = show.execute(&format!("tune {asked}")).unwrap().text;
    assert!(text.contains("<- chosen"), "{text}");
}

/// Radiosity with a scale of two steps.
struct Short;

impl Transport for Short {
    fn name(&self) -> &str {
        "short"
    }

    fn finest(&self) -> Quality {
        Quality(2)
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        Radiosity.prepare(setup, quality, work)
    }

    fn cost(&self, setup: &Setup, quality: Quality) -> Cost {
        Radiosity.cost(setup, quality)
    }
}

#[test]
fn a_show_that_cannot_be_tuned_says_why() {
    let mut empty = Interpreter::empty(Host::default()).unwrap();
    let said = empty.execute("tune").unwrap_err().to_string();
    assert!(said.contains("no stage"), "{said}");
    let mut show = show(None);
    let said = show.execute("tune 2%").unwrap_err().to_string();
    assert!(said.contains("tune --until 2%"), "{said}");
    show.host.transport = Arc::new(Short);
    let said = show.execute("tune").unwrap_err().to_string();
    assert!(said.contains("2 steps of quality: tune needs 3"), "{said}");
    show.host.transport = Arc::new(Radiosity);
    show.host.memory = 1 << 16;
    let said = show.execute("tune").unwrap_err().to_string();
    assert!(said.contains("MB"), "{said}");
}
