//! A plan as it is written out: the show alone, no pool, clock or machine, so that every run gives
//! the same bytes.

use serde::Serialize;

use super::Plan;
use crate::linalg::{Matrix, svd};
use crate::show::Show;
use crate::timeline::KeySequence;

/// The whole plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanReport {
    /// Version of this form.
    pub schema: u32,
    /// The show's title.
    pub show: String,
    /// Banks, then fixed lights.
    pub banks: Vec<BankReport>,
    /// Names of a setting's numbers, in order.
    pub coordinates: Vec<String>,
    /// The segments in time.
    pub segments: Vec<SegmentReport>,
    /// The key settings.
    pub keys: Vec<Vec<f64>>,
    /// Name of the metric.
    pub metric: &'static str,
    /// Whether directions are weighted by how long they are lit.
    pub time_weighted: bool,
    /// The error of the sequence aimed for.
    pub tolerance: f64,
    /// Numerical rank.
    pub rank: usize,
    /// How many basis settings the tolerance needs.
    pub used: usize,
    /// One for each basis setting.
    pub singular_values: Vec<f64>,
    /// Basis settings.
    pub basis: Vec<Vec<f64>>,
    /// For each key, a number for each basis setting.
    pub weights: Vec<Vec<f64>>,
    /// Predicted errors.
    pub predicted: Vec<Predicted>,
    /// What needs no work, or none of its own, and why.
    pub left_out: Vec<LeftOut>,
}

/// A bank or fixed lights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BankReport {
    /// Its name.
    pub name: String,
    /// `bank` or `fixed`.
    pub kind: &'static str,
    /// Console channel.
    pub channel: Option<u32>,
}

/// A segment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SegmentReport {
    /// First instant, seconds.
    pub start: f64,
    /// Last instant, seconds.
    pub end: f64,
    /// Degree.
    pub degree: usize,
    /// Indices of its control points among the keys.
    pub keys: Vec<usize>,
}

/// An error after some refined images.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Predicted {
    /// How many refined images.
    pub refined: usize,
    /// Error of the sequence.
    pub error: f64,
}

/// Something that the plan does without.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOut {
    /// Kind of thing.
    pub what: &'static str,
    /// Its name, or how many.
    pub name: String,
    /// Why, in a designer's words.
    pub why: String,
}

impl Plan {
    /// The plan of `keys`, which were made from `show`, as data to be written.
    pub fn report(&self, show: &Show, keys: &KeySequence) -> PlanReport {
        let bank = |name: &str, kind, channel| BankReport {
            name: name.to_owned(),
            kind,
            channel,
        };
        let mut banks: Vec<BankReport> = Vec::new();
        banks.extend(show.banks.iter().map(|b| bank(&b.name, "bank", b.channel)));
        banks.extend(show.fixed.iter().map(|f| bank(&f.name, "fixed", None)));
        let coordinates: Vec<String> = show.coordinates().into_iter().map(|c| c.name).collect();
        let segment = |s: &crate::timeline::Segment| SegmentReport {
            start: s.start(),
            end: s.end(),
            degree: s.degree,
            keys: s.keys.clone(),
        };
        let predicted = self.predicted().iter().enumerate();
        PlanReport {
            schema: 0,
            show: show.title.clone(),
            banks,
            segments: keys.segments().iter().map(segment).collect(),
            keys: keys.keys().to_vec(),
            metric: self.metric().name(),
            time_weighted: self.time_weighted(),
            tolerance: self.tolerance(),
            rank: self.rank(),
            used: self.used(),
            singular_values: self.singular_values().to_vec(),
            basis: self.basis().to_vec(),
            weights: self.weights().to_vec(),
            predicted: predicted
                .map(|(refined, error)| Predicted {
                    refined,
                    error: *error,
                })
                .collect(),
            left_out: self.left_out(show, keys, &coordinates),
            coordinates,
        }
    }

    fn left_out(&self, show: &Show, keys: &KeySequence, names: &[String]) -> Vec<LeftOut> {
        let mut out = Vec::new();
        let lit = show.coordinates();
        let rows: Vec<Vec<f64>> = (0..names.len())
            .map(|c| {
                keys.keys()
                    .iter()
                    .filter_map(|k| k.get(c).copied())
                    .collect()
            })
            .collect();
        let varying = |row: &[f64]| row.windows(2).any(|w| w.first() != w.last());
        let mut seen: Vec<(&String, &Vec<f64>)> = Vec::new();
        for ((coordinate, name), row) in lit.iter().zip(names).zip(&rows) {
            if coordinate.bank.is_none() {
                continue;
            }
            if !varying(row) {
                out.push(still(name, row.first().copied().unwrap_or(0.0)));
            } else if let Some((other, factor)) =
                seen.iter().find_map(|(n, r)| Some((*n, factor(r, row)?)))
            {
                out.push(LeftOut {
                    what: "bank",
                    name: name.clone(),
                    why: format!("always gives {} times the light of `{other}`: they share their refined images", number(factor)),
                });
            } else {
                seen.push((name, row));
            }
        }
        for name in self.unseen().iter().filter_map(|i| names.get(*i)) {
            out.push(LeftOut {
                what: "bank",
                name: name.clone(),
                why: "adds nothing to the error of this view: it comes last".to_owned(),
            });
        }
        self.counts(keys, &mut out);
        if lit.last().is_some_and(|c| c.bank.is_none()) && fixed_raises_rank(keys) {
            out.push(LeftOut {
                what: "fixed",
                name: "fixed".to_owned(),
                why:
                    "is part of every key, which costs playback nothing; it raises the rank by one"
                        .to_owned(),
            });
        }
        out
    }

    fn counts(&self, keys: &KeySequence, out: &mut Vec<LeftOut>) {
        let mut count = |what, n: usize, why: String| {
            if n > 0 {
                out.push(LeftOut {
                    what,
                    name: n.to_string(),
                    why,
                });
            }
        };
        let still = |s: &&crate::timeline::Segment| s.degree == 0 && s.duration() > 0.0;
        let held = keys.segments().iter().filter(still).count();
        let nothing = "nothing changes in them: one key each, no blends";
        count("segments", held, nothing.to_owned());
        let same = "where nothing bends: the neighbouring segments are one";
        count("knots", keys.joined(), same.to_owned());
        let equal = "control points equal another key: one image serves them all";
        count("keys", keys.merged(), equal.to_owned());
        let positive = "were added so that no key needs negative light; --signed-keys spares them";
        count("inserted knots", keys.inserted(), positive.to_owned());
        let rest = self.rank() - self.used();
        let error = self.predicted().get(self.used()).copied().unwrap_or(0.0);
        let why = format!(
            "basis settings need no refined image: {} leave a predicted error of {} %, and {} % is enough",
            self.used(),
            number(100.0 * error),
            number(100.0 * self.tolerance())
        );
        count("directions", rest, why);
    }
}

fn still(name: &str, setting: f64) -> LeftOut {
    let why = if setting == 0.0 {
        "stays out throughout: it needs no picture".to_owned()
    } else {
        format!(
            "stays at {} % of its light throughout",
            number(100.0 * setting)
        )
    };
    LeftOut {
        what: "bank",
        name: name.to_owned(),
        why,
    }
}

/// At most four digits, none of them a trailing zero.
fn number(x: f64) -> String {
    let digits = (3 - x.abs().log10().floor().clamp(-6.0, 3.0) as i32).clamp(0, 9) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// The number that makes one row the other, if there is one (to 1e-12 of the largest).
fn factor(from: &[f64], to: &[f64]) -> Option<f64> {
    let largest = |row: &[f64]| row.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let pairs = || from.iter().zip(to);
    let (a, b) = pairs().max_by(|x, y| x.0.abs().total_cmp(&y.0.abs()))?;
    let factor = b / a;
    let close = |(x, y): (&f64, &f64)| (x * factor - y).abs() <= 1e-12 * largest(to);
    (factor != 0.0 && factor.is_finite() && pairs().all(close)).then_some(factor)
}

/// Whether the keys without their last coordinate have a smaller rank.
fn fixed_raises_rank(keys: &KeySequence) -> bool {
    let (n, m) = (keys.coordinates(), keys.keys().len());
    let mut all = Matrix::zeros(n, m);
    for (mut column, key) in all.column_iter_mut().zip(keys.keys()) {
        column.iter_mut().zip(key).for_each(|(to, x)| *to = *x);
    }
    let rank = |a: &Matrix| svd(a).map(|s| s.rank(1e-12)).unwrap_or(0);
    n > 0 && rank(&all) > rank(&all.rows(0, n - 1).into_owned())
}
