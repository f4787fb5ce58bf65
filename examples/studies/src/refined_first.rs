//! The paper's order and its "refined first" against Footlight's, on two random shows with the real
//! G.

use crate::evaluation::{Rule, Verdict};
use crate::projection::Projection;
use crate::random_show::random_show;
use crate::trial::{self, Metric, Trial};
use footlight_engine::pool::Pool;
use footlight_engine::{Engine, Host};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::combine::{combine, dot};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};
use std::sync::Arc;

const SEEDS: [u64; 2] = [1, 7];
const SIZE: [usize; 2] = [48, 27];

/// Radiosity without stated errors: a pool then has two sets of coarse images.
struct Unstated;

impl Transport for Unstated {
    fn name(&self) -> &str {
        Radiosity.name()
    }

    fn finest(&self) -> Quality {
        Radiosity.finest()
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

fn engine(seed: u64) -> Engine {
    let host = Host {
        renderer: Arc::new(Unstated),
        ..Host::default()
    };
    random_show(seed, SIZE).open(host).unwrap()
}

fn trial(seed: u64) -> Trial {
    trial::trial(&engine(seed)).unwrap()
}

#[test]
fn a_seed_is_a_show_and_two_are_two() {
    assert_eq!(random_show(3, SIZE), random_show(3, SIZE));
    assert_ne!(random_show(3, SIZE).show, random_show(4, SIZE).show);
}

#[test]
fn refined_settings_are_exact() {
    for seed in SEEDS {
        let trial = trial(seed);
        let weighting = trial.weighting(Metric::Error).unwrap();
        let order = trial.order(&weighting).unwrap();
        let coarse = trial.shown(&[]).unwrap();
        for by in Projection::ALL {
            let shown = by.shown(&trial, &order[..4]).unwrap();
            let off = |s: &Vec<f64>| trial.look_error(&shown, s) / trial.look_error(&coarse, s);
            let worst = order[..4].iter().map(off).fold(0.0, f64::max);
            let exact = by != Projection::Corrections;
            assert_eq!(worst < 1e-6, exact, "{seed} {}: {worst:e}", by.name());
        }
    }
}

#[test]
fn refined_first_makes_looks_worse_than_coarse_alone_and_the_pools_way_does_not() {
    let verdict = Verdict::of("random 7", &trial(7), 7).unwrap();
    let of = |by: Projection| {
        verdict
            .previewed
            .iter()
            .find(|p| p.projection == by)
            .unwrap()
    };
    let (paper, ours) = (of(Projection::Settings), of(Projection::Extrapolated));
    assert!(paper.worst > 2.5 && paper.worse > 0.1, "{paper:?}");
    assert!(ours.worst < 0.5 * paper.worst, "{ours:?}");
    assert!(
        ours.worse < paper.worse && ours.look < paper.look,
        "{ours:?}"
    );
    let pictures = |rule: Rule| verdict.needed.iter().find(|n| n.rule == rule).unwrap();
    let (error, influence) = (pictures(Rule::SHIPPED), pictures(Rule::PAPER));
    assert!(error.own[0] < influence.own[0], "{error:?} {influence:?}");
}

/// Scalar products and images must agree.
#[test]
fn the_trial_foretells_what_the_pool_shows() {
    let mut engine = engine(1);
    let trial = trial::trial(&engine).unwrap();
    let order = trial
        .order(&trial.weighting(Metric::Error).unwrap())
        .unwrap();
    let settings = &order[..3];
    engine.coarse().unwrap();
    let refined = engine.estimate().refined_step();
    let mut render = |s: &[f64]| engine.render(s, refined).unwrap();
    let pictures: Vec<Image> = settings.iter().map(|s| render(s)).collect();
    let look: Vec<f64> = (0..order[0].len())
        .map(|i| f64::from(u8::from(i % 3 == 0)))
        .collect();
    let truth = render(&look);
    let mut pool: Pool = engine.estimate().pool().unwrap().clone();
    for (setting, image) in settings.iter().zip(&pictures) {
        assert!(pool.add(setting.clone(), image.clone(), refined, Work::silent()));
    }
    let fit = trial.fit(settings).unwrap();
    assert!((pool.calibration() / fit.calibration - 1.0).abs() < 1e-3);
    for by in Projection::ALL {
        let image = match by {
            Projection::Extrapolated => pool.preview(&look, Work::silent()).unwrap(),
            _ => {
                let looks = [look.clone()];
                let c = by.coefficients(&trial, settings, &looks).unwrap().concat();
                composed(&pool, &c, &look)
            }
        };
        let off = combine(pool.size(), &[(1.0, &image), (-1.0, &truth)], 1);
        let told = trial.look_error(&by.shown(&trial, settings).unwrap(), &look);
        let found = dot(&off, &off).sqrt();
        assert!(
            (found / told - 1.0).abs() < 1e-2,
            "{}: {found} {told}",
            by.name()
        );
    }
}

/// C·L + sum c_j (R_j - C·s_j) for the pool's refined images and a look L.
fn composed(pool: &Pool, c: &[f64], look: &[f64]) -> Image {
    let mut terms: Vec<(f64, &Image)> = Vec::new();
    let mut rest = look.to_vec();
    for (c, refined) in c.iter().zip(pool.refined()) {
        terms.push((*c, &refined.image));
        for (rest, s) in rest.iter_mut().zip(&refined.setting) {
            *rest -= c * s;
        }
    }
    let coarse = pool.coarse().iter().map(AsRef::as_ref);
    terms.extend(rest.into_iter().zip(coarse));
    combine(pool.size(), &terms, 1)
}
