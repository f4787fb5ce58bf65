//! `plan --measure`: what it says of its choice against what the engine then does, and why it has none.

use std::sync::Arc;

use crate::operator::Altered;
use crate::random_show::random_show;
use footlight::engine::measure::tuner::{Candidate, StepCost, Tuner};
use footlight::engine::{Engine, Error, Goal, Host};
use footlight::lang::edit::Edit;
use footlight::picture::Image;
use footlight::picture::combine::{combine, dot};
use footlight::pool::Pool;
use footlight::renderer::Quality;
use footlight::repl::{Console, Repl};
use footlight::work::Work;

/// A random show, small, with other means.
fn with(host: Host) -> Engine {
    random_show(1, [48, 27]).open(host).unwrap()
}

/// Radiosity with so many steps: the fifth takes as long as all others together.
fn scale(finest: u8) -> Host {
    Host {
        renderer: Arc::new(Altered {
            finest: Some(Quality(finest)),
            ..Altered::default()
        }),
        ..Host::default()
    }
}

fn random(host: Host) -> Repl {
    Repl::new(with(host), Console::default())
}

fn engine(steps: Option<(u8, u8)>) -> Engine {
    let mut engine = with(scale(4));
    if let Some((coarse, refined)) = steps {
        let statement = format!("preview {{ coarse {coarse}  refined {refined} }}");
        engine.edit(&Edit::Declare(statement)).unwrap();
    }
    engine
}

/// Quarters of every cue's fade.
fn moments(engine: &Engine) -> Vec<Vec<f64>> {
    let cues = engine.document().timeline().cues().iter();
    let quarters = cues.flat_map(|c| [0.25, 0.5, 0.75, 1.0].map(|p| (c, p)));
    let times = quarters.map(|(c, p)| c.go + (c.completion - c.go).scaled(p));
    times.map(|time| engine.setting(time)).collect()
}

/// The true error of the worst moment as a fresh engine shows it after so many refined pictures,
/// against the units' pictures at the finest step of the measurement.
fn shown(candidate: Candidate, truth: &[Image]) -> f64 {
    let steps = (candidate.coarse, candidate.refined.unwrap_or(4));
    let mut engine = engine(Some(steps));
    engine.coarse().unwrap();
    if candidate.pictures > 0 {
        engine.refine(Goal::count(candidate.pictures)).unwrap();
    }
    assert_eq!(engine.refined(), candidate.pictures);
    let (pool, moments) = (engine.pool().unwrap(), moments(&engine));
    let norm = |image: &Image| dot(image, image).sqrt();
    let exact = moments.iter().map(|setting| {
        let terms: Vec<(f64, &Image)> = setting.iter().copied().zip(truth).collect();
        combine(pool.size(), &terms, 2)
    });
    let exact: Vec<Image> = exact.collect();
    let brightest = exact.iter().map(norm).fold(0.0, f64::max);
    let mut worst = 0.0_f64;
    for (setting, exact) in moments.iter().zip(&exact) {
        let seen = pool.preview(setting, Work::silent()).unwrap();
        let off = norm(&combine(pool.size(), &[(1.0, &seen), (-1.0, exact)], 2));
        if norm(exact) > 0.02 * brightest {
            worst = worst.max(off / norm(exact));
        }
    }
    worst
}

/// A share of what coarse pictures alone leave that this show reaches with others: its step below
/// the finest is off by 0.61 of that itself.
const TIGHT: f64 = 0.92;

#[test]
fn the_error_told_is_that_of_what_is_shown() {
    let mut tuning = engine(None);
    let keys = tuning.document().keys().clone();
    let units = Pool::unit_settings(keys.coordinates());
    let (mut pictures, mut steps) = (Vec::new(), Vec::new());
    for quality in 1..=4 {
        let mut render = |unit| tuning.render(unit, Quality(quality)).unwrap();
        pictures.push(units.iter().map(|u| render(u)).collect::<Vec<Image>>());
        steps.push(StepCost {
            quality,
            fixed: 1.0,
            picture: 1.0,
            measured: true,
            error: 0.0,
        });
    }
    let sequence = (keys, moments(&tuning));
    let tuner = Tuner::new(sequence, &pictures, steps, Work::silent());
    let all = tuner
        .unwrap()
        .unwrap()
        .candidates(0.0, Work::silent())
        .unwrap();
    let told = [
        (1, None, 0),
        (1, Some(3), 2),
        (1, Some(3), 1),
        (1, Some(3), 4),
    ]
    .map(|wanted| {
        let is = |c: &&Candidate| (c.coarse, c.refined, c.pictures) == wanted;
        *all.iter()
            .find(is)
            .unwrap_or_else(|| panic!("no {wanted:?}: {all:?}"))
    });
    for candidate in told {
        let found = shown(candidate, &pictures[3]);
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
    assert!((preview.tolerance.error - tight.until).abs() < 1e-6);
    assert_eq!(preview.coarse, tight.choice.coarse);
    assert_eq!(preview.refined, tight.choice.refined.unwrap_or(4));
}

#[test]
fn pictures_at_hand_are_not_rendered_again_and_their_seconds_are_said_to_be_predicted() {
    let mut engine = with(Host::default());
    let first = engine.tune(0.02, None).unwrap();
    // What a small scene takes beyond its pictures may be lost in the clock's noise.
    let seconds = |s: &StepCost| s.fixed >= 0.0 && s.picture > 0.0;
    assert!(first.steps.iter().all(|s| s.measured && seconds(s)));
    let errors: Vec<f64> = first.steps.iter().map(|s| s.error).collect();
    assert!(errors.iter().is_sorted_by(|a, b| a > b), "{errors:?}");
    let before = engine.statistics();
    let second = engine.tune(0.02, None).unwrap();
    assert_eq!(engine.statistics().since(before).rendered, 0);
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

fn narrow() -> Host {
    Host {
        memory: 1 << 16,
        ..Host::default()
    }
}

#[test]
fn a_show_that_cannot_be_tuned_is_refused() {
    let error = with(scale(2)).tune(0.02, None).unwrap_err();
    let few = matches!(
        error,
        Error::TooFewSteps {
            found: 2,
            needed: 3
        }
    );
    assert!(few, "{error:?}");
    let error = with(narrow()).tune(0.02, None).unwrap_err();
    let memory = matches!(error, Error::MeasureMemory { needed, budget } if needed > budget);
    assert!(memory, "{error:?}");
    let error = crate::empty(Host::default()).engine_mut().tune(0.02, None);
    assert!(matches!(error, Err(Error::NoSetup)), "{error:?}");
}

fn refused(show: &mut Repl, line: &str) -> String {
    let error = show.execute(line).unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    error.to_string()
}

#[test]
fn what_is_out_of_reach_says_what_to_ask_for() {
    let mut show = random(scale(4));
    let said = refused(&mut show, "plan --measure --tolerance 0.0001%");
    assert!(said.contains("out of reach"), "{said}");
    let (_, asked) = said.rsplit_once("ask for ").unwrap();
    let text = show
        .execute(&format!("plan --measure {asked}"))
        .unwrap()
        .text;
    assert!(text.contains("<- chosen"), "{text}");
    // All pictures were there already.
    assert!(text.contains("seconds predicted"), "{text}");
}

#[test]
fn a_show_that_cannot_be_tuned_says_why() {
    let mut empty = crate::empty(Host::default());
    let said = refused(&mut empty, "plan --measure");
    assert!(said.contains("no stage"), "{said}");
    let said = refused(&mut random(scale(4)), "plan --measure 2%");
    assert!(said.contains("`2%` is left over"), "{said}");
    let said = refused(&mut random(scale(2)), "plan --measure");
    assert!(
        said.contains("2 steps of quality: `plan --measure` needs 3"),
        "{said}"
    );
    let said = refused(&mut random(narrow()), "plan --measure");
    assert!(said.contains("MB"), "{said}");
}
