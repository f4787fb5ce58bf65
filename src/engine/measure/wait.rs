//! Predicted duration of a whole run, for a warning before anything is rendered.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::{Document, Engine, Error};
use footlight_show::model::LightKind;
use footlight_transport::{Cost, Quality};

/// Duration from which a run is worth a warning, seconds.
pub const LONG: f64 = 60.0;

/// Cost below which every machine takes less than [`LONG`], so that the speed need not be measured:
/// a unit of our operator's cost takes a fifth of a second on two cores.
const SURELY_SHORT: f64 = 60.0;

/// A run longer than [`LONG`].
#[derive(Clone, Debug, PartialEq)]
pub struct LongRun {
    /// Predicted seconds from an empty store to the first refined image.
    pub seconds: f64,
    /// The finest quality steps of coarse and refined images within [`LONG`], with their seconds;
    /// `None` if there are none.
    pub instead: Option<(u8, u8, f64)>,
    /// A panel of many polygons, each of which is a lamp: its name and their number.
    pub many_lamps: Option<(String, usize)>,
}

/// Polygons of one panel from which a show is slow to compute; few sets have more.
const MANY_LAMPS: usize = 200;

/// Prediction of a long run of this show on this machine; `None` for a short one, or without
/// anything to render.
///
/// # Errors
/// An error of rendering; on cancel.
pub fn long_run(engine: &Engine) -> Result<Option<LongRun>, Error> {
    let estimate = engine.estimate();
    let Ok(rendering) = estimate.rendering() else {
        return Ok(None);
    };
    let sources = rendering.sources() as f64;
    let mut costs = BTreeMap::new();
    let mut units = |coarse, refined| -> Result<f64, Error> {
        let [cheap, fine] = estimate.coarse_pair_at(coarse);
        let steps = [cheap, fine, estimate.refined_step_at(coarse, refined)].map(|q| q.0);
        for step in steps {
            if let Entry::Vacant(vacant) = costs.entry(step) {
                vacant.insert(estimate.cost(Quality(step))?);
            }
        }
        Ok(run_cost(&costs, steps, sources))
    };
    let preview = &engine.show().preview;
    let whole = units(preview.coarse, preview.refined)?;
    if whole < SURELY_SHORT {
        return Ok(None);
    }
    let pace = estimate.measure_pace()?;
    if whole * pace < LONG {
        return Ok(None);
    }
    let mut instead = None;
    for refined in (1..=preview.refined).rev() {
        let coarse = preview.coarse.min(refined.saturating_sub(1).max(1));
        let seconds = units(coarse, refined)? * pace;
        if seconds < LONG {
            instead = Some((coarse, refined, seconds));
            break;
        }
    }
    Ok(Some(LongRun {
        seconds: whole * pace,
        instead,
        many_lamps: many_lamps(&engine.document),
    }))
}

fn many_lamps(document: &Document) -> Option<(String, usize)> {
    let scene = &document.setup()?.scene;
    let panels = document.show().lights.iter().filter_map(|light| {
        let LightKind::Panel { material, .. } = &light.kind else {
            return None;
        };
        let number = scene.materials.iter().position(|m| m.name == *material)?;
        let lamps = scene.polygons.iter().filter(|p| p.material == number);
        Some((light.name.clone(), lamps.count()))
    });
    let most = panels.max_by_key(|(_, lamps)| *lamps);
    most.filter(|(_, lamps)| *lamps > MANY_LAMPS)
}

/// Cost of all sources alone at both coarse steps and one image of all at the refined one,
/// including preparation; a step used twice is prepared once.
fn run_cost(costs: &BTreeMap<u8, Cost>, [cheap, fine, refined]: [u8; 3], sources: f64) -> f64 {
    let of = |step: u8| costs.get(&step).copied().unwrap_or_default();
    let mut units = of(cheap).alone(sources);
    if fine != cheap {
        units += of(fine).alone(sources);
    }
    if refined != cheap && refined != fine {
        units += of(refined).prepare + sources * of(refined).per_source + of(refined).per_image;
    }
    units
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_serves_twice_is_prepared_once() {
        let cost = |prepare| Cost {
            prepare,
            per_source: 2.0,
            per_image: 0.5,
            per_lone: 0.25,
        };
        let costs = BTreeMap::from([(1, cost(10.0)), (2, cost(20.0)), (3, cost(40.0))]);
        let coarse = (10.0 + 3.0 * 2.25) + (20.0 + 3.0 * 2.25);
        assert_eq!(run_cost(&costs, [1, 2, 3], 3.0), coarse + 40.0 + 6.5);
        assert_eq!(run_cost(&costs, [1, 2, 2], 3.0), coarse);
        assert_eq!(run_cost(&costs, [1, 1, 1], 3.0), 16.75);
    }
}
