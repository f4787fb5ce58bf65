//! What `tune` says, held against what the engine then does.

use std::sync::Arc;

use crate::engine::{Engine, Error, Goal, Host};
use crate::files::Memory;
use crate::lang::edit::Edit;
use crate::picture::Image;
use crate::plan;
use crate::pool::Pool;
use crate::radiosity::Radiosity;
use crate::renderer::{Cost, Prepared, Quality, Setup, Transport, TransportError};
use crate::study::random_show;
use crate::study::session::sequence_error;
use crate::study::tune::{Candidate, Expense, Tuner};
use crate::work::Work;

fn engine(steps: Option<(u8, u8)>) -> Engine {
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
    let mut engine = Engine::from_text("random.lxq", text.as_bytes(), host).unwrap();
    if let Some((coarse, refined)) = steps {
        let statement = format!("preview {{ coarse {coarse}  refined {refined} }}");
        engine.edit(&Edit::Declare(statement)).unwrap();
    }
    engine
}

/// The true error of the sequence as a fresh engine shows it after so many refined pictures.
fn shown(candidate: Candidate, reference: u8) -> f64 {
    let steps = (candidate.coarse, candidate.refined.unwrap_or(4));
    let mut engine = engine(Some(steps));
    engine.coarse().unwrap();
    if candidate.pictures > 0 {
        engine.refine(Goal::count(candidate.pictures)).unwrap();
    }
    assert_eq!(engine.refined(), candidate.pictures);
    let keys = engine.document().keys().clone();
    let units = Pool::unit_settings(keys.coordinates());
    let mut truth: Vec<Image> = Vec::new();
    for unit in &units {
        truth.push(engine.render(unit, Quality(reference)).unwrap());
    }
    let pool = engine.projected().unwrap();
    let work = engine.host.work();
    let seen = |unit: &Vec<f64>| pool.preview(unit, work).unwrap();
    let seen: Vec<Image> = units.iter().map(seen).collect();
    sequence_error(&seen, &truth, &plan::second_moment(&keys), 2)
}

/// A share of what coarse pictures alone leave that this show reaches with others: its quality 4 is
/// off by 0.86 of that itself.
const TIGHT: f64 = 0.92;

#[test]
fn the_error_told_is_that_of_what_is_shown() {
    let mut tuning = engine(None);
    let (pictures, steps) = tuning.measure_steps(5, None).unwrap();
    let keys = tuning.document().keys().clone();
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
    let mut engine = engine(None);
    // From then on seconds are predicted, and do not depend on what else the machine has to do.
    engine.tune(0.5, None).unwrap();
    let loose = engine.tune(0.5, None).unwrap();
    assert_eq!((loose.choice.coarse, loose.choice.pictures), (1, 0));
    let tight = engine.tune(loose.choice.error * TIGHT, None).unwrap();
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
    engine.edit(&Edit::Declare(tight.preview)).unwrap();
    let preview = &engine.show().preview;
    assert!((preview.tolerance - tight.until).abs() < 1e-6);
    assert_eq!(preview.coarse, tight.choice.coarse);
    assert_eq!(preview.refined, tight.choice.refined.unwrap_or(4));
}

#[test]
fn pictures_at_hand_are_not_rendered_again_and_their_seconds_are_said_to_be_predicted() {
    let mut engine = engine(None);
    let first = engine.tune(0.02, None).unwrap();
    // What a small scene takes beyond its pictures may be lost in the clock's noise.
    let seconds = |s: &Expense| s.fixed >= 0.0 && s.picture > 0.0;
    assert!(first.steps.iter().all(|s| s.measured && seconds(s)));
    let errors: Vec<f64> = first.steps.iter().map(|s| s.error).collect();
    assert!(errors.iter().is_sorted_by(|a, b| a > b), "{errors:?}");
    let before = engine.tally();
    let second = engine.tune(0.02, None).unwrap();
    assert_eq!(engine.tally().since(before).rendered, 0);
    assert!(second.steps.iter().all(|s| !s.measured && s.fixed > 0.0));
    let again: Vec<f64> = second.steps.iter().map(|s| s.error).collect();
    assert_eq!(errors, again);
}

#[test]
fn without_time_the_third_step_is_the_truth() {
    let tuned = engine(None).tune(0.2, Some(0.0)).unwrap();
    assert_eq!((tuned.reference, tuned.steps.len()), (3, 3));
    // There is one coarse pair below it, and no refined step.
    assert_eq!((tuned.choice.coarse, tuned.choice.pictures), (1, 0));
    // The show's refined step was not measured.
    assert_eq!(tuned.as_it_stands, None);
}

#[test]
fn what_is_out_of_reach_says_what_is_not() {
    let mut engine = engine(None);
    let error = engine.tune(1e-6, None).unwrap_err();
    let Error::OutOfReach {
        until,
        reference,
        best: Some(best),
    } = error
    else {
        panic!("{error:?}");
    };
    assert_eq!((until, reference), (1e-6, engine.finest().0));
    assert!(best.error > until, "{best:?}");
    let tuned = engine.tune(best.error, None).unwrap();
    assert!(tuned.choice.error <= best.error, "{tuned:?}");
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
    let empty = Engine::from_text("untitled.lxq", b"show \"Untitled\"\n", Host::default());
    let error = empty.unwrap().tune(0.02, None).unwrap_err();
    assert!(matches!(error, Error::NoSetup), "{error:?}");
    let mut engine = engine(None);
    engine.host.renderer = Arc::new(Short);
    let error = engine.tune(0.02, None).unwrap_err();
    let few = matches!(
        error,
        Error::TooFewSteps {
            found: 2,
            needed: 3
        }
    );
    assert!(few, "{error:?}");
    engine.host.renderer = Arc::new(Radiosity);
    engine.host.memory = 1 << 16;
    let error = engine.tune(0.02, None).unwrap_err();
    let memory = matches!(error, Error::MeasureMemory { needed, budget } if needed > budget);
    assert!(memory, "{error:?}");
}
