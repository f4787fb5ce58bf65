//! Evaluation of metrics, previews and predictions on a [`Trial`].

use crate::dice::Dice;
use crate::projection::{Projection, keys_alike};
use crate::trial::{Metric, Order, Shown, Trial};
use footlight_engine::plan::{PlanError, Weighting};

/// Number of refined images for trials of previews.
const REFINED: usize = 4;
/// Number of looks for trials of previews.
const LOOKS: usize = 200;
/// Number of banks lit in a look.
const LIT: usize = 3;
/// Errors below this share of the initial one are rounding.
const ROUNDING: f64 = 1e-4;

/// Rule for the order of refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// A rule of Footlight, or a reference for comparison.
    Order(Order),
    /// A metric that counts every key equally, whatever its duration.
    KeysAlike(Metric),
}

impl Rule {
    /// The paper's rule.
    pub const PAPER: Rule = Rule::KeysAlike(Metric::Influence);
    /// Footlight's rule.
    pub const SHIPPED: Rule = Rule::Order(Order::SHIPPED);

    /// Its name in tables: `error, time`.
    pub fn name(self) -> String {
        match self {
            Rule::Order(Order::Metric(metric)) => format!("{}, time", metric.name()),
            Rule::Order(Order::Oracle) => "true error, time".to_owned(),
            Rule::Order(Order::BankByBank) => "one bank each".to_owned(),
            Rule::KeysAlike(metric) => metric.name().to_owned(),
        }
    }

    /// The settings in the order of this rule.
    fn settings(self, trial: &Trial) -> Result<Vec<Vec<f64>>, PlanError> {
        match self {
            Rule::Order(order) => trial.ordered(order),
            Rule::KeysAlike(metric) => keys_alike(trial, &trial.weighting(metric)?),
        }
    }

    /// The metric of its projection.
    fn weighting(self, trial: &Trial) -> Result<Weighting, PlanError> {
        match self {
            Rule::Order(Order::Metric(metric)) | Rule::KeysAlike(metric) => trial.weighting(metric),
            Rule::Order(Order::Oracle) => trial.oracle(),
            Rule::Order(Order::BankByBank) => trial.weighting(Metric::Settings),
        }
    }
}

/// Number of refined images that a rule needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Needed {
    /// The rule.
    pub rule: Rule,
    /// Images until 5 % and 1 % of the initial error, shown by the projection in the rule's metric.
    pub own: [usize; 2],
    /// Images until 5 % and 1 %, shown by the pool's projection.
    pub pool: [usize; 2],
}

/// Results of a preview on looks outside the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Previewed {
    /// The projection.
    pub projection: Projection,
    /// Share of looks worse than with coarse images alone.
    pub worse: f64,
    /// Error of the worst look over that of coarse images alone.
    pub worst: f64,
    /// That ratio for the median look.
    pub look: f64,
    /// That ratio for the designed sequence.
    pub sequence: f64,
}

/// A step of refinement: predicted over true error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Number of refined images.
    pub refined: usize,
    /// Predicted over true error.
    pub ratio: f64,
    /// True error, relative.
    pub truth: f64,
}

/// All results for a show.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The show.
    pub name: String,
    /// One entry for each order.
    pub needed: Vec<Needed>,
    /// One entry for each projection.
    pub previewed: Vec<Previewed>,
    /// One entry for each number of refined images.
    pub steps: Vec<Step>,
}

impl Verdict {
    /// Evaluates everything on a show; `seed` draws the looks.
    ///
    /// # Errors
    /// [`PlanError`]
    pub fn of(name: &str, trial: &Trial, seed: u64) -> Result<Verdict, PlanError> {
        Ok(Verdict {
            name: name.to_owned(),
            needed: needed(trial)?,
            previewed: previewed(trial, seed)?,
            steps: steps(trial)?,
        })
    }
}

/// The least number of images with an error within each share of the initial one.
fn count(
    trial: &Trial,
    order: &[Vec<f64>],
    show: impl Fn(&[Vec<f64>]) -> Result<Shown, PlanError>,
) -> Result<[usize; 2], PlanError> {
    let start = trial.error(&show(&[])?);
    let mut found = [order.len(); 2];
    for m in (0..=order.len()).rev() {
        let error = trial.error(&show(order.get(..m).unwrap_or(order))?);
        for (found, share) in found.iter_mut().zip([0.05, 0.01]) {
            if error <= share * start && *found == m + usize::from(m < order.len()) {
                *found = m;
            }
        }
    }
    Ok(found)
}

fn needed(trial: &Trial) -> Result<Vec<Needed>, PlanError> {
    let mut rules = Vec::new();
    for metric in Metric::ALL {
        rules.push(Rule::KeysAlike(metric));
        rules.push(Rule::Order(Order::Metric(metric)));
    }
    rules.extend([Order::Oracle, Order::BankByBank].map(Rule::Order));
    let mut out = Vec::new();
    for rule in rules {
        let (settings, weighting) = (rule.settings(trial)?, rule.weighting(trial)?);
        out.push(Needed {
            rule,
            own: count(trial, &settings, |s| trial.shown_in(&weighting, s))?,
            pool: count(trial, &settings, |s| trial.shown(s))?,
        });
    }
    Ok(out)
}

/// Three random coordinates, or fewer if they coincide, each between a fifth and full.
fn look(dice: &mut Dice, coordinates: usize) -> Vec<f64> {
    let mut out = vec![0.0; coordinates];
    for _ in 0..LIT {
        if let Some(x) = out.get_mut(dice.whole(0, coordinates.saturating_sub(1))) {
            *x = dice.between(0.2, 1.0);
        }
    }
    out
}

/// Every preview with [`REFINED`] images in the shipped order, on random looks.
fn previewed(trial: &Trial, seed: u64) -> Result<Vec<Previewed>, PlanError> {
    let order = trial.order(&trial.weighting(Metric::Error)?)?;
    let settings = order.get(..REFINED).unwrap_or(&order);
    let dice = &mut Dice::new(seed);
    let n = trial.keys().coordinates();
    let looks: Vec<Vec<f64>> = (0..LOOKS).map(|_| look(dice, n)).collect();
    let coarse = trial.shown(&[])?;
    let of = |projection: Projection| {
        let shown = projection.shown(trial, settings)?;
        let factor = |l: &Vec<f64>| trial.look_error(&shown, l) / trial.look_error(&coarse, l);
        // A look of unseen banks has no error to compare.
        let factors: Vec<f64> = looks.iter().map(factor).filter(|f| f.is_finite()).collect();
        let worse = factors.iter().filter(|f| **f > 1.0).count();
        Ok(Previewed {
            projection,
            worse: worse as f64 / factors.len().max(1) as f64,
            worst: factors.iter().copied().fold(0.0, f64::max),
            look: median(factors),
            sequence: trial.error(&shown) / trial.error(&coarse),
        })
    };
    Projection::ALL.into_iter().map(of).collect()
}

fn steps(trial: &Trial) -> Result<Vec<Step>, PlanError> {
    let order = trial.order(&trial.weighting(Metric::Error)?)?;
    let start = trial.predicted(&[])?.truth;
    let mut out = Vec::new();
    for refined in 0..order.len() {
        let told = trial.predicted(order.get(..refined).unwrap_or(&order))?;
        if told.truth > ROUNDING * start {
            out.push(Step {
                refined,
                ratio: told.predicted / told.truth,
                truth: told.truth,
            });
        }
    }
    Ok(out)
}

/// The median, with the mean of the middle two; NaN for an empty list.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    let at = |i: usize| values.get(i).copied().unwrap_or(f64::NAN);
    match values.len() % 2 {
        0 if half > 0 => 0.5 * (at(half - 1) + at(half)),
        _ => at(half),
    }
}
