//! Reflected light of moving heads, as a sum of few fixed poses.
//!
//! Reflected light changes slowly with the aim of a head. So it is rendered for some poses of each
//! head, its *basis*, and at every moment it is a combination of them. The factors are further
//! coordinates of the timeline, so that plan, refinement and playback treat them like those of
//! banks. Direct light is handled elsewhere, exactly at every moment.
//!
//! The light of a pose is modelled as a Gaussian over directions, a little wider than its field
//! because surfaces blur it. The inner product of two poses is then in closed form, and the best
//! combination for a pose is its projection onto the basis. The basis is chosen by a pivoted
//! Cholesky factorization (Fine and Scheinberg, *Efficient SVM Training Using Low-Rank Kernel
//! Representations*, 2001): each step adds the pose that the basis represents worst, until all are
//! within a tolerance.

#![allow(
    clippy::indexing_slicing,
    reason = "tables are made to the shape of the heads and of the basis"
)]

use std::ops::Range;

use super::Timeline;
use super::curve::CurvePiece;
use crate::geometry::Vec3;
use crate::linalg::Bernstein;
use crate::model::{Head, Pose, Show};
use crate::units::Time;

/// Standard deviation of the blur of reflected light, radians.
const BLUR: f64 = 0.12;
/// Standard deviation of a beam over its field angle.
const BEAM: f64 = 0.22;
/// Largest difference between a pose's blurred light and its combination, relative to the former.
const TOLERANCE: f64 = 0.03;
/// Largest turn between sampled moments, relative to the blurred beam's width.
const STEP: f64 = 0.6;
/// Most moments sampled in one move.
const MOST_STEPS: usize = 256;

/// A coordinate after those of the show: the reflected light of a head in one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounced {
    /// Index into [`Show::heads`].
    pub head: usize,
    /// Index of the pose in the head's basis.
    pub number: usize,
    /// The pose.
    pub pose: Pose,
    /// The coordinate of the head's bank whose light is reflected.
    pub coordinate: usize,
}

/// Blurred light of a pose.
#[derive(Clone, Copy)]
struct Lobe {
    direction: Vec3,
    /// Variance.
    width: f64,
}

impl Lobe {
    fn new(head: &Head, pose: Pose) -> Lobe {
        let spread = BEAM * pose.field.to_radians();
        Lobe {
            direction: head.direction(pose.pan, pose.tilt),
            width: BLUR * BLUR + spread * spread,
        }
    }

    /// Inner product of two Gaussians of equal flux, without its constant factor.
    fn times(&self, other: &Lobe) -> f64 {
        let width = self.width + other.width;
        let off = self.direction - other.direction;
        (-off.dot(off) / (2.0 * width)).exp() / width.powf(1.5)
    }

    /// Distance of two lobes in standard deviations.
    fn turns(&self, other: &Lobe) -> f64 {
        let off = (self.direction - other.direction).length();
        let wider = (self.width / other.width).ln().abs();
        off / self.width.min(other.width).sqrt() + wider
    }
}

/// The basis of a head.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Basis {
    poses: Vec<Pose>,
    /// Cholesky factor of the inner products, row by row.
    factor: Vec<Vec<f64>>,
}

impl Basis {
    /// Chooses from `poses` until all are represented.
    fn of(head: &Head, poses: &[Pose]) -> Basis {
        let lobes: Vec<Lobe> = poses.iter().map(|pose| Lobe::new(head, *pose)).collect();
        let own: Vec<f64> = lobes.iter().map(|lobe| lobe.times(lobe)).collect();
        let mut left = own.clone();
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); poses.len()];
        let mut basis = Basis::default();
        loop {
            let shares = left.iter().zip(&own).map(|(left, own)| left / own);
            let worst = shares.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b));
            let Some((pivot, share)) = worst else { break };
            if share <= TOLERANCE * TOLERANCE {
                break;
            }
            let root = left[pivot].sqrt();
            let pivot_row = rows[pivot].clone();
            for (i, row) in rows.iter_mut().enumerate() {
                let dot: f64 = row.iter().zip(&pivot_row).map(|(a, b)| a * b).sum();
                let next = if i == pivot {
                    root
                } else {
                    (lobes[i].times(&lobes[pivot]) - dot) / root
                };
                row.push(next);
                left[i] = (left[i] - next * next).max(0.0);
            }
            left[pivot] = 0.0;
            basis.poses.push(poses[pivot]);
            basis.factor.push(rows[pivot].clone());
        }
        basis
    }

    /// The combination of the basis nearest to a pose.
    pub fn factors(&self, head: &Head, pose: Pose) -> Vec<f64> {
        let lobe = Lobe::new(head, pose);
        let with = |own: &Pose| lobe.times(&Lobe::new(head, *own));
        let mut out: Vec<f64> = self.poses.iter().map(with).collect();
        // Solve with the factor, then with its transpose.
        for i in 0..out.len() {
            let row = &self.factor[i];
            let dot: f64 = row.iter().zip(&out[..i]).map(|(a, b)| a * b).sum();
            out[i] = (out[i] - dot) / row[i];
        }
        for i in (0..out.len()).rev() {
            let below = (i + 1..out.len()).map(|j| self.factor[j][i] * out[j]);
            out[i] = (out[i] - below.sum::<f64>()) / self.factor[i][i];
        }
        out
    }
}

/// The cubic with these values at 0, 1/3, 2/3 and 1.
fn through([a, b, c, d]: [f64; 4]) -> Bernstein {
    if b == a && c == a && d == a {
        return Bernstein::constant(a);
    }
    let inner = |a: f64, b: f64, c: f64, d: f64| (-5.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / 6.0;
    Bernstein::cubic([a, inner(a, b, c, d), inner(d, c, b, a), d])
}

/// A curve times a factor that is known at four moments of each span; no knot of the curve lies
/// within a span. Where both change, the product is a cubic through its values at the four moments:
/// fitting it more closely would cost keys that the few poses of the basis do not deserve.
fn scaled(curve: &[CurvePiece], spans: &[(Time, Time)], factors: &[[f64; 4]]) -> Vec<CurvePiece> {
    let mut pieces = curve.iter().peekable();
    let mut out = Vec::with_capacity(spans.len());
    for (&(start, end), factors) in spans.iter().zip(factors) {
        while pieces.next_if(|piece| piece.end <= start).is_some() {}
        let Some(piece) = pieces.peek() else { break };
        let light = piece.between(start, end);
        let polynomial = if light.is_constant() {
            through(factors.map(|factor| factor * light.first()))
        } else if factors.iter().all(|factor| *factor == factors[0]) {
            light.mapped(|light| factors[0] * light)
        } else {
            let values = [0, 1, 2, 3].map(|k: usize| factors[k] * light.value(k as f64 / 3.0));
            through(values)
        };
        out.push(CurvePiece {
            start,
            end,
            polynomial,
        });
    }
    out
}

impl Timeline {
    /// The coordinates after those of [`Show::coordinates`], in order.
    pub fn bounced(&self) -> &[Bounced] {
        &self.bounced
    }

    /// A setting of the show's own coordinates, extended by those of [`Bounced`] light for heads in
    /// these poses.
    pub fn with_bounced(&self, own: &[f64], poses: &[Pose]) -> Vec<f64> {
        let heads = self.heads.iter().zip(&self.bases).zip(poses);
        let factors: Vec<Vec<f64>> = heads
            .map(|((head, basis), pose)| basis.factors(head, *pose))
            .collect();
        let further = self.bounced.iter().map(|bounced| {
            let factor = factors
                .get(bounced.head)
                .and_then(|f| f.get(bounced.number));
            let light = own.get(bounced.coordinate);
            factor.copied().unwrap_or(0.0) * light.copied().unwrap_or(0.0)
        });
        own.iter().copied().chain(further).collect()
    }

    /// Chooses the basis of each head and adds its coordinates.
    pub(super) fn add_bounced(&mut self, show: &Show) {
        let heads: Vec<Range<usize>> = show
            .heads()
            .into_iter()
            .map(|(_, _, bank)| show.coordinates_of(bank))
            .collect();
        let spans = self.spans(&heads);
        for (number, own) in heads.iter().enumerate() {
            let head = self.heads[number];
            let lit = spans.iter().filter(|span| self.is_lit(own, span));
            let mut poses: Vec<Pose> = lit
                .flat_map(|span| [self.pose(number, span.0), self.pose_before(number, span.1)])
                .collect();
            let shines = |coordinate: usize| self.last[coordinate] != 0.0;
            if own.clone().any(shines) {
                poses.push(self.pose(number, self.end));
            }
            let basis = Basis::of(&head, &poses);
            let at = |pose: Pose| basis.factors(&head, pose);
            let factors: Vec<[Vec<f64>; 4]> = spans
                .iter()
                .map(|(from, to)| {
                    let inner = |k| *from + (*to - *from).scaled(f64::from(k) / 3.0);
                    let poses = [*from, inner(1), inner(2)].map(|time| self.pose(number, time));
                    let [a, b, c] = poses;
                    [a, b, c, self.pose_before(number, *to)].map(at)
                })
                .collect();
            let last = at(self.pose(number, self.end));
            for (i, pose) in basis.poses.iter().enumerate() {
                let factors: Vec<[f64; 4]> = factors
                    .iter()
                    .map(|factors| [0, 1, 2, 3].map(|k: usize| factors[k][i]))
                    .collect();
                for coordinate in own.clone() {
                    let light = scaled(&self.curves[coordinate], &spans, &factors);
                    let moves = self.moves[coordinate].clone();
                    self.add_coordinate(&light, self.last[coordinate] * last[i], moves);
                    self.bounced.push(Bounced {
                        head: number,
                        number: i,
                        pose: *pose,
                        coordinate,
                    });
                }
            }
            self.bases.push(basis);
        }
    }

    /// True when one of a head's coordinates is lit within a span.
    fn is_lit(&self, coordinates: &Range<usize>, &(start, end): &(Time, Time)) -> bool {
        coordinates.clone().any(|coordinate| {
            let pieces = self.curves[coordinate].iter();
            let mut within = pieces.filter(|p| p.start < end && p.end > start);
            within.any(|p| p.polynomial.coefficients().iter().any(|c| *c != 0.0))
        })
    }

    /// The pose just before a time.
    fn pose_before(&self, head: usize, time: Time) -> Pose {
        let (at, before) = (
            self.pose(head, time),
            self.pose(head, time - Time::from_micros(1)),
        );
        let [a, b] = [at, before].map(|pose| Lobe::new(&self.heads[head], pose));
        // Return one value at a knot that is no jump.
        if a.turns(&b) < 1e-3 { at } else { before }
    }

    /// Spans of the show in which no lit head turns far, with no knot of a head's light within one.
    /// All heads share them, so that they share key settings.
    fn spans(&self, heads: &[Range<usize>]) -> Vec<(Time, Time)> {
        let turns = (0..heads.len()).flat_map(|head| self.pose_knots(head));
        let own = heads.iter().flat_map(Clone::clone);
        let levels = own.flat_map(|coordinate| &self.curves[coordinate]);
        let levels = levels.map(|piece| piece.start);
        let mut knots: Vec<Time> = turns.chain(levels).chain([self.start, self.end]).collect();
        knots.retain(|time| (self.start..=self.end).contains(time));
        knots.sort_unstable();
        knots.dedup();
        let mut spans = Vec::new();
        for pair in knots.windows(2) {
            let &[from, to] = pair else { continue };
            let place = |k: usize, of: usize| from + (to - from).scaled(k as f64 / of as f64);
            let turned = |(number, own): (usize, &Range<usize>)| {
                const LOOKS: usize = 16;
                if !self.is_lit(own, &(from, to)) {
                    return 0.0;
                }
                let lobe = |k| {
                    let pose = match k {
                        LOOKS => self.pose_before(number, to),
                        k => self.pose(number, place(k, LOOKS)),
                    };
                    Lobe::new(&self.heads[number], pose)
                };
                let lobes: Vec<Lobe> = (0..=LOOKS).map(lobe).collect();
                lobes.windows(2).map(|pair| pair[0].turns(&pair[1])).sum()
            };
            let turned = heads.iter().enumerate().map(turned).fold(0.0, f64::max);
            let count = ((turned / STEP).ceil() as usize).clamp(1, MOST_STEPS);
            spans.extend((0..count).map(|k| (place(k, count), place(k + 1, count))));
        }
        spans.retain(|(from, to)| from < to);
        spans
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Sources;
    use crate::lang::parse;
    use crate::timeline::KeySequence;

    fn timeline(cues: &str) -> (Show, Timeline) {
        let text = format!(
            "show \"S\"\nlight mh spot at 0,0,6 aim 0,4,0 beam 12 field 20 900 cd moves\nbank heads = mh\n{cues}"
        );
        let parsed = parse(&mut Sources::default(), "s.lxq", &text);
        let show = parsed
            .show
            .unwrap_or_else(|| panic!("{:?}", parsed.diagnostics));
        let timeline = Timeline::new(&show).unwrap();
        (show, timeline)
    }

    const SWEEP: &str = "cue 1 at 0:00 { snap  heads 50 }\n\
        cue 2 at 0:02 { time 3  mh to 3, -4, 0 }\ncue 3 at 0:08 { time 2  heads out }\n";

    #[test]
    fn a_pose_of_the_basis_is_itself_and_all_others_are_near() {
        let (_, timeline) = timeline(SWEEP);
        let (head, basis) = (timeline.heads[0], &timeline.bases[0]);
        assert!(
            (3..=16).contains(&basis.poses.len()),
            "{}",
            basis.poses.len()
        );
        for (i, pose) in basis.poses.iter().enumerate() {
            let factors = basis.factors(&head, *pose);
            for (j, factor) in factors.iter().enumerate() {
                let exact = f64::from(u8::from(i == j));
                assert!((factor - exact).abs() < 1e-6, "{i} {j}: {factor}");
            }
        }
        for k in 0..100 {
            let pose = timeline.pose(0, Time::from_micros(2_000_000 + 30_000 * k));
            let factors = basis.factors(&head, pose);
            let lobe = Lobe::new(&head, pose);
            let lobes: Vec<Lobe> = basis.poses.iter().map(|p| Lobe::new(&head, *p)).collect();
            let mut square = lobe.times(&lobe);
            for (a, x) in lobes.iter().zip(&factors) {
                square -= 2.0 * x * lobe.times(a);
                square += lobes
                    .iter()
                    .zip(&factors)
                    .map(|(b, y)| x * y * a.times(b))
                    .sum::<f64>();
            }
            let off = (square.max(0.0) / lobe.times(&lobe)).sqrt();
            assert!(off < 1.5 * TOLERANCE, "{k}: {off}");
        }
    }

    /// A head that comes up while it moves, by curves that no segment of a sum can repeat.
    const RISING: &str = "cue 1 at 0:00 { snap }\n\
        cue 2 at 0:02 { time 5  curve ease  heads 70  mh to 3, -4, 0 }\n\
        cue 3 at 0:08 { time 2  heads out  mh to -2, 3, 0 }\n";

    #[test]
    fn further_coordinates_follow_level_and_pose() {
        for (cues, segments) in [(SWEEP, 20), (RISING, 30)] {
            let (show, timeline) = timeline(cues);
            let own = show.coordinates().len();
            assert_eq!(timeline.coordinates(), own + timeline.bounced().len());
            for k in 0..=200 {
                let time = Time::from_micros(50_000 * k);
                let setting = timeline.evaluate(time);
                let exact = timeline.with_bounced(&setting[..own], &[timeline.pose(0, time)]);
                for (found, exact) in setting.iter().zip(&exact) {
                    assert!(
                        (found - exact).abs() < 0.005,
                        "{time:?}: {found} for {exact}"
                    );
                }
            }
            // Each key is a picture.
            let keys = KeySequence::new(&timeline).unwrap();
            let made = keys.segments().len();
            assert!(made <= segments, "{made} segments");
        }
    }

    #[test]
    fn a_head_that_turns_in_the_dark_needs_few_poses() {
        let (_, timeline) = timeline(
            "cue 1 at 0:00 { snap  heads 50 }\ncue 2 at 0:02 { snap  heads out }\n\
             cue 3 at 0:04 { mh to 3, -4, 0 }\ncue 4 at 0:08 { snap  heads 50 }\n",
        );
        assert_eq!(timeline.bounced().len(), 2);
    }
}
