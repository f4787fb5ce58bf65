//! Poses of heads over time.

pub use crate::model::Pose;

use super::{Levels, Timeline};
use crate::model::Axis;
use crate::units::Time;

impl Timeline {
    /// The pose of a head of [`crate::model::Show::heads`] at a time; times as in
    /// [`Timeline::evaluate`].
    pub fn pose(&self, head: usize, time: Time) -> Pose {
        let Some(ranges) = self.heads.get(head) else {
            return Pose::default();
        };
        let value = |axis| {
            let levels = self.pose_levels(head, axis);
            levels.map_or(0.0, |l| self.value(&l.pieces, l.last, time))
        };
        ranges.pose(Axis::ALL.map(value))
    }

    /// The poses of all heads at a time.
    pub fn poses(&self, time: Time) -> Vec<Pose> {
        (0..self.heads.len())
            .map(|head| self.pose(head, time))
            .collect()
    }

    /// Knots of a head's pose, in order, each once: between two of them pan, tilt, beam and field are
    /// polynomials in time of degree 3 at most.
    pub fn pose_knots(&self, head: usize) -> Vec<Time> {
        let levels = Axis::ALL.map(|axis| self.pose_levels(head, axis));
        let pieces = levels.into_iter().flatten().flat_map(|l| &l.pieces);
        let mut knots: Vec<Time> = pieces.flat_map(|p| [p.start, p.end]).collect();
        knots.sort_unstable();
        knots.dedup();
        knots
    }

    fn pose_levels(&self, head: usize, axis: Axis) -> Option<&Levels> {
        let first = self.own.len() - 4 * self.heads.len();
        self.parameters.get(&(first + 4 * head + axis as usize))
    }
}
