//! How refined pictures are chosen and how previews are made of them: the shipped way, and the
//! others that it was held against, for everyone to try.
//!
//! `--metric` and `--projection` hold for one call, the verb `method` for the rest of the session.

use super::{Call, Error, Interpreter, Reply};
use crate::lang::nearest;
use crate::plan::{self, Direction, Metric, Weighting};
use crate::pool::{Pool, Projected, Projection};
use crate::report::words;

/// What the user chose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Method {
    /// What makes a picture worth refining; `None`: the best that the pictures allow.
    pub metric: Option<Metric>,
    /// How a preview is made up of coarse and refined pictures.
    pub projection: Projection,
}

impl Method {
    /// The same with what a call's options say.
    pub(super) fn with_options(self, call: &Call) -> Result<Method, Error> {
        let mut out = self;
        for name in ["metric", "projection"] {
            if let Some(value) = call.option(name) {
                out.set(name, value)?;
            }
        }
        Ok(out)
    }

    fn set(&mut self, what: &str, name: &str) -> Result<(), Error> {
        match what {
            "metric" => self.metric = Some(metric(name)?),
            "projection" => self.projection = projection(name)?,
            _ => {
                return Err(Error::Usage(format!(
                    "`{what}` is neither `metric` nor `projection`: {USAGE}"
                )));
            }
        }
        Ok(())
    }

    /// What is not the shipped way, to stand behind other words; empty where all is.
    pub(super) fn aside(self) -> String {
        words::method(self.metric, self.projection)
    }
}

const USAGE: &str = "method [metric M | projection P | default]";

fn metric(name: &str) -> Result<Metric, Error> {
    let metrics = [Metric::Settings, Metric::Influence, Metric::Error];
    metrics
        .into_iter()
        .find(|m| m.name() == name)
        .ok_or_else(|| {
            Error::Usage(format!(
                "there is no metric `{name}`; it is settings, influence or error"
            ))
        })
}

fn projection(name: &str) -> Result<Projection, Error> {
    Projection::named(name).ok_or_else(|| {
        let names = Projection::ALL.map(Projection::name);
        let hint = match nearest(name, names.into_iter()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("it is one of {}", names.join(", ")),
        };
        Error::Usage(format!("there is no projection `{name}`; {hint}"))
    })
}

impl Interpreter {
    /// How pictures are chosen and previews made at present.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Chooses and makes them otherwise from now on; pictures that are there are kept.
    pub fn set_method(&mut self, method: Method) {
        self.method = method;
    }

    pub(super) fn answer_method(&mut self, call: &Call) -> Result<Reply, Error> {
        let words: Vec<&str> = call.words.iter().map(String::as_str).collect();
        let mut chosen = self.method;
        match words.as_slice() {
            [] => {}
            ["default"] => chosen = Method::default(),
            _ => {
                for pair in words.chunks(2) {
                    let [what, name] = pair else {
                        return Err(Error::Usage(format!("usage: {USAGE}")));
                    };
                    chosen.set(what, name)?;
                }
            }
        }
        self.method = chosen;
        let metric = chosen
            .metric
            .map_or("error, or influence where quality has one step", |m| {
                m.name()
            });
        Ok(Reply::text(format!(
            "pictures are refined by the metric: {metric}\npreviews are made by the projection: {}",
            chosen.projection.name()
        )))
    }

    /// The pool as the chosen projection sees it.
    pub(super) fn projected(&self) -> Result<Projected<'_>, Error> {
        let pool = self.rendered()?;
        Ok(pool.projected(self.method.projection, self.host.work()))
    }

    /// The weights that order what is to be refined.
    pub(super) fn plan_weighting(&self, pool: &Pool) -> Result<Weighting, Error> {
        let keys = &self.compiled.keys;
        Ok(match self.method.metric {
            None | Some(Metric::Error) => pool.weighting(),
            Some(Metric::Settings) => Weighting::settings(keys.coordinates()),
            Some(Metric::Influence) => Weighting::influence(&pool.norms(), keys)?,
        })
    }

    /// What is left to refine in the order of the chosen metric, with the errors, before
    /// calibration, that the shipped projection is predicted to leave.
    pub(super) fn directions(&self, pool: &Pool) -> Result<Vec<Direction>, Error> {
        let (keys, norm) = (&self.compiled.keys, Some(self.sequence_norm(pool)));
        let weighting = self.plan_weighting(pool)?;
        let mut known = pool.settings();
        let mut out = plan::next(keys, &known, &weighting, norm)?.directions;
        let own = pool.weighting();
        if weighting != own {
            // Singular values in another metric say nothing of errors.
            for direction in &mut out {
                known.push(direction.setting.clone());
                direction.error = plan::forecast(keys, &known, &own, norm)?;
            }
        }
        Ok(out)
    }
}
