//! The project's own G: radiosity with exact direct light, or final gathering by ray tracing for
//! many polygons ([`MANY_POLYGONS`], `gather`) and for pin spots in any scene.
//!
//! Every light is solved once at unit strength: settings, colours and filters only scale it, so
//! that G is linear by construction.

mod calibration;
mod pin_spots;

use crate::gather::{self, GatherStage, PathEstimator};
use crate::hemicube::HemicubeScene;
use crate::hemicube::cost::Counts;
use crate::hemicube::step::{HemicubeStep, STEPS};
use crate::radiosity::pin_spots::PinSpots;
use crate::surfaces::FACET_BYTES;
use crate::surfaces::lobe::is_sharp;
use crate::threads::Threads;
use crate::unit_lights::Composed;
use crate::{Cost, PixelEstimator, Prepared, Quality, Setup, Transport, TransportError};
use footlight_host::work::Work;
use footlight_stage::{Light, Polygon};

/// Radiosity with hemicubes, or final gathering; three quality steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radiosity;

impl Transport for Radiosity {
    fn name(&self) -> &str {
        "radiosity"
    }

    fn results_version(&self) -> Option<String> {
        // Digest of this crate and the crates below it, computed by the build script: any change of
        // the code is another version.
        Some(format!("{} {}", self.name(), env!("FOOTLIGHT_OPERATOR")))
    }

    fn finest(&self) -> Quality {
        Quality(STEPS.len() as u8)
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        Threads::new(work)?.install(|| -> Result<Box<dyn Prepared>, TransportError> {
            if is_final_gather(setup) {
                let stage = GatherStage::new(setup, quality, work)?;
                return Ok(Box::new(Composed::new(stage, &setup.rig, work)?));
            }
            if let Some(apart) = PinSpots::of(setup) {
                return Ok(Box::new(apart.prepare(quality, work)?));
            }
            let scene = HemicubeScene::new(setup, HemicubeStep::of(quality)?, work)?;
            Ok(Box::new(Composed::new(scene, &setup.rig, work)?))
        })
    }

    fn least_bytes(&self, setup: &Setup) -> usize {
        setup.scene.polygons.len() * FACET_BYTES
    }

    /// From counts of the work; zero if the scene is unusable.
    fn cost(&self, setup: &Setup, quality: Quality) -> Cost {
        if is_final_gather(setup) {
            return gather::cost(setup, quality).unwrap_or_default();
        }
        let by_hemicubes = |setup: &Setup| {
            let counts = HemicubeStep::of(quality).and_then(|step| Counts::of(setup, step));
            counts.map_or(Cost::default(), |counts| {
                counts.cost(setup.rig.sources.len())
            })
        };
        match PinSpots::of(setup) {
            None => by_hemicubes(setup),
            Some(apart) => {
                let pins = gather::cost(&apart.pins, quality).unwrap_or_default();
                by_hemicubes(&apart.others) + pins
            }
        }
    }

    fn usual_error(&self, setup: &Setup, quality: Quality) -> Option<f64> {
        let steps = if is_final_gather(setup) {
            GATHERED
        } else {
            BY_HEMICUBES
        };
        steps.get(usize::from(quality.0).checked_sub(1)?).copied()
    }

    fn is_measurable(&self, setup: &Setup) -> bool {
        // Path tracing does not support banks given as images.
        let mut lights = setup.rig.lights.iter();
        !lights.any(|light| matches!(light, Light::Image(_)))
    }

    fn estimator(
        &self,
        setup: &Setup,
        work: Work<'_>,
    ) -> Result<Option<Box<dyn PixelEstimator>>, TransportError> {
        if !self.is_measurable(setup) {
            return Ok(None);
        }
        Ok(Some(Box::new(PathEstimator::new(setup, work)?)))
    }

    fn cost_scale(&self, clock: &dyn Fn() -> f64, work: Work<'_>) -> Result<f64, TransportError> {
        calibration::cost_scale(self, clock, work)
    }
}

/// Polygons above which a scene is rendered by final gathering: it is then more accurate than
/// hemicubes in the same time, and its cost grows far more slowly than the number of polygons.
pub const MANY_POLYGONS: usize = 2500;

/// Polygons with varying shading normals above which final gathering renders a scene: rays use such
/// normals directly, while hemicubes mix the light of adjacent facets ([`crate::hemicube`]).
const MANY_ROUND: usize = 1000;

/// Usual error of images at each step, measured at moments of the shipped shows and in rooms.
const BY_HEMICUBES: [f64; 3] = [0.02, 0.013, 0.008];
const GATHERED: [f64; 3] = [0.05, 0.02, 0.01];

/// True when final gathering renders a scene, at every step: only rays support translucent
/// surfaces and sharp reflections.
fn is_final_gather(setup: &Setup) -> bool {
    let scene = &setup.scene;
    let is_round = |p: &&Polygon| p.shading.as_ref().is_some_and(|s| s.normal.is_some());
    scene.polygons.len() > MANY_POLYGONS
        || scene.is_cut()
        || scene.glosses().any(is_sharp)
        || scene.polygons.iter().filter(is_round).count() > MANY_ROUND
}
