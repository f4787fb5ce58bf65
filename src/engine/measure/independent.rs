//! Measures images of moments of a show against independent estimates, one image for a command or
//! up to three on the way to a goal.

use std::sync::Arc;

use crate::estimate::Estimate;
use crate::heads::{Unseen, frame};
use crate::measure::meter::{Effort, MeasuredError, Meter};
use crate::rendering::SetupImages;
use crate::{Document, Engine, Error};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::model::Pose;
use footlight_show::units::{ErrorUnit, Time};
use footlight_transport::{Quality, Setup, Transport, TransportError};

/// Effort for a moment of a show: about a twentieth of the time of its images.
const EFFORT: Effort = Effort {
    pixels: 512,
    paths: 32,
};

/// Most moments measured.
const MOMENTS: usize = 3;

/// Likeness of two moments' light, by sources, beyond which one of them is enough.
const ALIKE: f64 = 0.98;

/// A measured moment of a show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredMoment {
    /// Index into [`Show::cues`](footlight_show::model::Show::cues) of the cue that runs or is complete
    /// then.
    pub cue: usize,
    /// Its time.
    pub time: Time,
    /// The error of its image.
    pub measured: MeasuredError,
}

/// Measures an image of a setting in the current view. `None` when the renderer has no estimator,
/// or the image is dark.
///
/// # Errors
/// [`Error::NoSetup`], or an error of rendering.
pub fn measure(
    engine: &Engine,
    image: &Image,
    (setting, poses): (&[f64], &[Pose]),
    effort: Effort,
) -> Result<Option<MeasuredError>, Error> {
    let begin = engine.host.clock.seconds();
    let (estimate, work) = (engine.estimate(), engine.work());
    let moment = StandingMoment::new(&engine.document, estimate.rendering()?, setting, poses)?;
    let Some(meter) = Meter::new(engine.host.renderer.as_ref(), &moment.setup, work)? else {
        return Ok(None);
    };
    let found = meter.measure(image, &moment.setting, effort, work)?;
    Ok(found.map(|found| MeasuredError {
        seconds: engine.host.clock.seconds() - begin,
        ..found
    }))
}

/// Measures the moment with the largest predicted error, with the existing images. `None` when it
/// cannot be measured, or memory is not sufficient.
///
/// # Errors
/// [`Error::NotRendered`], or an error of rendering.
pub fn measure_worst(engine: &Engine) -> Result<Option<MeasuredMoment>, Error> {
    let estimate = engine.estimate();
    let Some(worst) = estimate.worst_moment(ErrorUnit::Light)? else {
        return Ok(None);
    };
    let Ok(heads) = estimate.heads_seen() else {
        return Ok(None);
    };
    let setting = engine.document.setting(worst.time);
    let poses = engine.document.timeline().poses(worst.time);
    let pool = (estimate.rendered()?, heads.as_ref());
    let image = frame(pool, &setting, &poses, engine.work())?;
    let found = match measure(engine, &image, (&setting, &poses), EFFORT) {
        // Images are usable without the measurement.
        Err(Error::Render(TransportError::Memory { .. })) => None,
        found => found?,
    };
    Ok(found.map(|measured| MeasuredMoment {
        cue: worst.cue,
        time: worst.time,
        measured,
    }))
}

/// A moment with its heads as fixed lights, for the estimator.
struct StandingMoment {
    setup: Setup,
    setting: Vec<f64>,
}

impl StandingMoment {
    fn new(
        document: &Document,
        rendering: &SetupImages,
        setting: &[f64],
        poses: &[Pose],
    ) -> Result<StandingMoment, Error> {
        let own = document.show().coordinates().len();
        Ok(StandingMoment {
            setup: document.standing(&rendering.setup, poses)?,
            setting: setting.iter().copied().take(own).collect(),
        })
    }
}

/// Moments of a show to measure, with all data needed, for any thread.
pub(crate) struct MeasureJob {
    pub setup: Setup,
    pub quality: Quality,
    /// Multiple of the usual effort.
    pub effort: usize,
    moments: Vec<(usize, Time, StandingMoment, Image)>,
}

impl MeasureJob {
    /// A few moments of the show with the current images (see [`moments`]). If these were measured,
    /// the one with the largest possible error, with four times the effort.
    pub fn new(estimate: &Estimate<'_>, work: Work<'_>) -> Result<MeasureJob, Error> {
        let pool = estimate.rendered()?;
        let (rendering, quality) = (estimate.rendering()?, estimate.coarse_steps()[1]);
        let document = estimate.document;
        let heads = match estimate.heads_seen() {
            Ok(heads) => heads,
            // The heads' light in this view is unknown.
            Err(Unseen) => return Ok(MeasureJob::of_nothing(rendering, quality)),
        };
        let with_picture = |(cue, time)| {
            let (setting, poses) = (document.setting(time), document.timeline().poses(time));
            let image = frame((pool, heads.as_ref()), &setting, &poses, work)?;
            let moment = StandingMoment::new(document, rendering, &setting, &poses)?;
            Ok::<_, Error>((cue, time, moment, image))
        };
        let before = rendering.measured_at(quality, estimate.document);
        let (moments, effort) = match before.and_then(|m| Some((m.doubtful()?, 4 * m.effort))) {
            Some((doubtful, effort)) => (vec![(doubtful.cue, doubtful.time)], effort),
            None => (moments(estimate)?, 1),
        };
        let moments = moments.into_iter().map(with_picture);
        Ok(MeasureJob {
            setup: rendering.setup.clone(),
            quality,
            effort,
            moments: moments.collect::<Result<_, _>>()?,
        })
    }

    fn of_nothing(rendering: &SetupImages, quality: Quality) -> MeasureJob {
        MeasureJob {
            setup: rendering.setup.clone(),
            quality,
            effort: 1,
            moments: Vec::new(),
        }
    }

    /// Runs the measurement; empty when nothing can be measured.
    pub fn run(
        &self,
        renderer: &dyn Transport,
        work: Work<'_>,
    ) -> Result<Vec<MeasuredMoment>, TransportError> {
        // More pixels, and more paths for each.
        let by = self.effort.isqrt();
        let effort = Effort {
            pixels: EFFORT.pixels * by,
            paths: EFFORT.paths * by as u32,
        };
        let mut measured = Vec::new();
        let mut meter: Option<(&Setup, Meter)> = None;
        for (at, (cue, time, moment, image)) in self.moments.iter().enumerate() {
            work.progress.report("measuring", at, self.moments.len());
            // Heads have other poses at each moment.
            let known = meter.take().filter(|(setup, _)| **setup == moment.setup);
            let (_, meter) = match known {
                Some(known) => meter.insert(known),
                None => match Meter::new(renderer, &moment.setup, work) {
                    Ok(Some(new)) => meter.insert((&moment.setup, new)),
                    // Images are usable without the measurement.
                    Ok(None) | Err(TransportError::Memory { .. }) => return Ok(measured),
                    Err(error) => return Err(error),
                },
            };
            let found = meter.measure(image, &moment.setting, effort, work)?;
            measured.extend(found.map(|measured| MeasuredMoment {
                cue: *cue,
                time: *time,
                measured,
            }));
        }
        Ok(measured)
    }
}

/// The moments for [`MeasureJob`]: the one predicted worst, and others whose light comes from other
/// sources than that of those before, as each source has its own error.
fn moments(estimate: &Estimate<'_>) -> Result<Vec<(usize, Time)>, Error> {
    let document = estimate.document;
    let light_of = |image: &Arc<Image>| image.data().iter().map(|x| f64::from(*x)).sum::<f64>();
    let light: Vec<f64> = estimate.rendered()?.coarse().iter().map(light_of).collect();
    // Each source's share of the light, as a unit vector of square roots.
    let shares = |time: Time| {
        let setting = document.setting(time);
        let light = setting.iter().zip(&light).map(|(s, l)| (s * l).max(0.0));
        let all: f64 = light.clone().sum();
        (all > 0.0).then(|| light.map(|own| (own / all).sqrt()).collect::<Vec<f64>>())
    };
    let with_shares = |moment: (usize, Time)| Some((moment, shares(moment.1)?));
    let all = estimate.moments_of_cues().into_iter();
    let (lit, of_lit): (Vec<_>, Vec<_>) = all.filter_map(with_shares).unzip();
    let worst = estimate.worst_moment(ErrorUnit::Light)?;
    let worst = worst.map(|worst| (worst.cue, worst.time));
    let first = worst.and_then(|(_, time)| shares(time));
    let others = unlike(&of_lit, first, MOMENTS - worst.iter().len());
    let others = others.into_iter().filter_map(|at| lit.get(at).copied());
    Ok(worst.into_iter().chain(others).collect())
}

/// Indices of up to `count` unit vectors, each the one least like `first` and those before.
fn unlike(all: &[Vec<f64>], first: Option<Vec<f64>>, count: usize) -> Vec<usize> {
    let mut likeness = vec![0.0_f64; all.len()];
    let mut last = first;
    let mut found = Vec::new();
    while found.len() < count {
        for (likeness, own) in likeness.iter_mut().zip(all) {
            let product = |a: &[f64]| a.iter().zip(own).map(|(a, b)| a * b).sum();
            *likeness = likeness.max(last.as_deref().map_or(0.0, product));
        }
        let new = likeness.iter().enumerate().filter(|(_, l)| **l < ALIKE);
        let Some((at, _)) = new.min_by(|(_, a), (_, b)| a.total_cmp(b)) else {
            break;
        };
        found.push(at);
        last = all.get(at).cloned();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_to_measure_are_lit_by_different_sources() {
        let shares = |shares: [f64; 3]| shares.map(f64::sqrt).to_vec();
        let all = [
            shares([0.9, 0.1, 0.0]),
            shares([1.0, 0.0, 0.0]),
            shares([0.6, 0.4, 0.0]),
            shares([0.0, 0.2, 0.8]),
        ];
        let [first, ..] = &all;
        assert_eq!(unlike(&all, Some(first.clone()), 2), [3, 2]);
        assert_eq!(unlike(&all, None, 4), [0, 3, 2, 1]);
        // Nearly the same light is not measured twice.
        let same = [first.clone(), shares([0.9, 0.09, 0.01])];
        assert_eq!(unlike(&same, Some(first.clone()), 2), [0; 0]);
        assert_eq!(unlike(&[], None, 2), [0; 0]);
    }
}
