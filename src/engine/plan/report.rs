//! A plan with its show, without pool, clock or machine, so that every run gives equal results.

use std::collections::BTreeSet;

use serde::Serialize;

use super::Plan;
use footlight_show::model::{Coordinate, Role, Show};
use footlight_show::timeline::KeySequence;
use footlight_show::units::ErrorUnit;

/// The whole plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanReport {
    /// The show's title.
    pub show: String,
    /// Banks, then fixed lights.
    pub banks: Vec<BankReport>,
    /// Names of a setting's numbers, in order.
    pub coordinates: Vec<String>,
    /// Number of further coordinates: poses of heads whose reflected light is rendered.
    #[serde(skip_serializing_if = "is_none")]
    pub head_poses: usize,
    /// The segments in time.
    pub segments: Vec<SegmentReport>,
    /// The key settings.
    pub keys: Vec<Vec<f64>>,
    /// True when directions are weighted by time.
    pub time_weighted: bool,
    /// The tolerance of the worst moment.
    pub tolerance: f64,
    /// Unit of errors.
    pub unit: ErrorUnit,
    /// Numerical rank.
    pub rank: usize,
    /// Number of basis settings needed for the tolerance.
    pub used: usize,
    /// One for each basis setting.
    pub singular_values: Vec<f64>,
    /// Basis settings.
    pub basis: Vec<Vec<f64>>,
    /// For each key, a weight for each basis setting.
    pub weights: Vec<Vec<f64>>,
    /// Predicted errors.
    pub predicted: Vec<Predicted>,
    /// Parts that need no images, or none for themselves, and why.
    #[serde(skip)]
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
    /// Number of refined images.
    pub refined: usize,
    /// Error of the sequence.
    pub error: f64,
}

/// Something that the plan leaves out, and why.
#[derive(Clone, Debug, PartialEq)]
pub enum LeftOut {
    /// A coordinate that gives no light in the sequence.
    StaysOut {
        /// Its name.
        name: String,
    },
    /// A coordinate whose light never changes.
    Constant {
        /// Its name.
        name: String,
        /// Its setting, 1 for full.
        setting: f64,
    },
    /// A coordinate that is always a multiple of another: they share refined images.
    MultipleOf {
        /// Its name.
        name: String,
        /// The other's name.
        other: String,
        /// Ratio to the other's light.
        factor: f64,
    },
    /// A coordinate that contributes no error to the view.
    Unseen {
        /// Its name.
        name: String,
    },
    /// Number of segments without change: they have one key each and no blends.
    HeldSegments(usize),
    /// Number of knots without a bend: the segments on both sides are one.
    JoinedKnots(usize),
    /// Number of control points that equal another key.
    MergedKeys(usize),
    /// Number of knots inserted so that no key is negative.
    InsertedKnots(usize),
    /// Basis settings not needed for the tolerance.
    SparedDirections {
        /// Their number.
        count: usize,
        /// Number of refined settings.
        used: usize,
        /// Predicted error of the sequence after those.
        error: f64,
        /// The tolerance.
        tolerance: f64,
    },
    /// The operator has one step of quality: the first images are final.
    OneQuality,
}

fn is_none(count: &usize) -> bool {
    *count == 0
}

impl Plan {
    /// The plan of `keys`, which were made from `show`, as data.
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
        let segment = |s: &footlight_show::timeline::Segment| SegmentReport {
            start: s.start(),
            end: s.end(),
            degree: s.degree,
            keys: s.keys.clone(),
        };
        let predicted = self.predicted.iter().enumerate();
        PlanReport {
            head_poses: keys.coordinates().saturating_sub(coordinates.len()),
            show: show.title.clone(),
            banks,
            segments: keys.segments().iter().map(segment).collect(),
            keys: keys.keys().to_vec(),
            time_weighted: self.time_weighted,
            tolerance: self.tolerance,
            unit: ErrorUnit::Light,
            rank: self.rank(),
            used: self.used,
            singular_values: self.singular_values.clone(),
            basis: self.basis.clone(),
            weights: self.weights.clone(),
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
        // A bank whose heads turn is neither constant nor a multiple, whatever its level.
        let parameters = show.parameters();
        let moves = show
            .cues
            .iter()
            .flat_map(|cue| &cue.parts)
            .flat_map(|part| &part.moves);
        let turned = moves.filter_map(|one| match parameters.get(one.parameter)? {
            Coordinate {
                role: Role::Pose(..),
                bank,
                ..
            } => *bank,
            _ => None,
        });
        let turned: BTreeSet<usize> = turned.collect();
        let rows: Vec<Vec<f64>> = (0..names.len())
            .map(|c| {
                keys.keys()
                    .iter()
                    .filter_map(|k| k.get(c).copied())
                    .collect()
            })
            .collect();
        let mut seen: Vec<(&String, &Vec<f64>)> = Vec::new();
        for ((coordinate, name), row) in lit.iter().zip(names).zip(&rows) {
            let Some(bank) = coordinate.bank else {
                continue;
            };
            if turned.contains(&bank) && row.iter().any(|light| *light != 0.0) {
                continue;
            }
            let mut earlier = seen.iter();
            let multiple = earlier.find_map(|(other, r)| Some((*other, factor(r, row)?)));
            let name = name.clone();
            let constant = match row.as_slice() {
                [] => Some(0.0),
                [first, rest @ ..] => rest.iter().all(|x| x == first).then_some(*first),
            };
            out.push(if let Some(setting) = constant {
                match setting {
                    0.0 => LeftOut::StaysOut { name },
                    setting => LeftOut::Constant { name, setting },
                }
            } else if let Some((other, factor)) = multiple {
                LeftOut::MultipleOf {
                    name,
                    other: other.clone(),
                    factor,
                }
            } else {
                seen.push((&coordinate.name, row));
                continue;
            });
        }
        for i in &self.unseen {
            let bank = lit.get(*i).and_then(|coordinate| coordinate.bank);
            let Some(name) = names
                .get(*i)
                .filter(|_| bank.is_none_or(|b| !turned.contains(&b)))
            else {
                continue;
            };
            let is_out = |l: &LeftOut| matches!(l, LeftOut::StaysOut { name: out } if out == name);
            if !out.iter().any(is_out) {
                out.push(LeftOut::Unseen { name: name.clone() });
            }
        }
        self.counts(keys, &mut out);
        out
    }

    fn counts(&self, keys: &KeySequence, out: &mut Vec<LeftOut>) {
        let still = |s: &&footlight_show::timeline::Segment| s.degree == 0 && s.duration() > 0.0;
        let held = keys.segments().iter().filter(still).count();
        let counted = [
            (held, LeftOut::HeldSegments as fn(usize) -> LeftOut),
            (keys.joined(), LeftOut::JoinedKnots),
            (keys.merged(), LeftOut::MergedKeys),
            (keys.inserted(), LeftOut::InsertedKnots),
        ];
        let some = counted.into_iter().filter(|(n, _)| *n > 0);
        out.extend(some.map(|(n, of)| of(n)));
        // One error for each number of refined images; after the last, none is left out.
        if let Some([error, spared @ ..]) = self.predicted.get(self.used..)
            && !spared.is_empty()
        {
            out.push(LeftOut::SparedDirections {
                count: spared.len(),
                used: self.used,
                error: *error,
                tolerance: self.tolerance,
            });
        }
    }
}

/// The factor between two rows, if there is one (to 1e-12 of the largest).
fn factor(from: &[f64], to: &[f64]) -> Option<f64> {
    let largest = |row: &[f64]| row.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let pairs = || from.iter().zip(to);
    let (a, b) = pairs().max_by(|x, y| x.0.abs().total_cmp(&y.0.abs()))?;
    let factor = b / a;
    let allowed = 1e-12 * largest(to);
    let close = |(x, y): (&f64, &f64)| (x * factor - y).abs() <= allowed;
    (factor != 0.0 && factor.is_finite() && pairs().all(close)).then_some(factor)
}
