//! Irradiance of one chunk of receivers, evaluated at each point or fitted to a few samples.
//!
//! A patch is a cluster small enough for a fit; a large one takes more samples than the fit needs,
//! to check it. Invariant: the irradiance of a point depends only on the points and the values at
//! the samples. This module depends on neither lights nor occluders.

#![allow(
    clippy::indexing_slicing,
    reason = "clusters name points of the chunk that they belong to"
)]

use crate::direct::cluster::{CORNERS, Cluster, PATCH, SAMPLES};
use crate::direct::quadratic_fit::QuadraticFit;
use footlight_show::geometry::{Vec3, frame};

/// Points in the largest patch whose fit needs no check.
const UNCHECKED: usize = 32;

/// Points in the largest patch with occluders: a shadow six points wide must not fall between its
/// samples.
pub const SHADED: usize = 100;

/// Factor by which the error of the fitted plane may exceed the allowed error where the quadratic
/// fit is checked.
const BENT: f64 = 4.0;

/// The receivers of one chunk.
pub struct IrradiancePatch<'a> {
    points: &'a [Vec3],
    frame: [Vec3; 2],
    start: usize,
    /// Allowed difference between interpolated and evaluated values; 0 evaluates every point.
    pub allowed: f64,
    /// Accumulated irradiance of each point.
    pub sums: Vec<f64>,
    /// Evaluated values of the current light, else NaN.
    known: Vec<f64>,
}

impl<'a> IrradiancePatch<'a> {
    /// A chunk without light. `points` are those of all chunks; `normal` is the unit normal of this
    /// chunk's plane.
    pub fn new(
        points: &'a [Vec3],
        chunk: &Cluster,
        normal: Vec3,
        allowed: f64,
    ) -> IrradiancePatch<'a> {
        IrradiancePatch {
            points,
            frame: frame(normal),
            start: chunk.range.start,
            allowed,
            sums: vec![0.0; chunk.range.len()],
            known: vec![f64::NAN; chunk.range.len()],
        }
    }

    /// Evaluates the points of a cluster that are not known yet.
    pub fn evaluate(&mut self, cluster: &Cluster, mut at: impl FnMut(usize, Vec3) -> f64) {
        for i in cluster.range.clone() {
            self.sums[i - self.start] += self.known(i, &mut at);
        }
    }

    /// Evaluates a few points of a patch of at most `most` points. If a fit reproduces them within
    /// the allowed error, it gives the values at all points.
    pub fn interpolated(
        &mut self,
        cluster: &Cluster,
        most: usize,
        mut at: impl FnMut(usize, Vec3) -> f64,
    ) -> bool {
        let count = cluster.range.len();
        if cluster.halves.is_none() || self.allowed <= 0.0 || count > most.min(PATCH) {
            return false;
        }
        let samples = cluster.samples(self.points, self.frame);
        let patch = Patch::new(cluster, self.frame);
        let places = samples.map(|i| patch.place(self.points[i]));
        let mut values = [0.0; SAMPLES];
        let sampled = if count > UNCHECKED { SAMPLES } else { CORNERS };
        for (value, &i) in values.iter_mut().zip(&samples).take(CORNERS) {
            *value = self.known(i, &mut at);
        }
        let (corners, heights) = (first(&places), first(&values));
        let Some(fit) = QuadraticFit::through(&corners, &heights) else {
            return false;
        };
        let bent = if sampled > CORNERS { BENT } else { 1.0 };
        if fit.farthest > self.allowed * bent {
            return false;
        }
        for k in CORNERS..sampled {
            values[k] = self.known(samples[k], &mut at);
            if (fit.at(places[k]) - values[k]).abs() > self.allowed {
                return false;
            }
        }
        // No value may lie outside the range of the samples.
        let known = values.iter().take(sampled);
        let (low, high) = known.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
        let (low, high) = ((low - self.allowed).max(0.0), high + self.allowed);
        for i in cluster.range.clone() {
            let value = fit.at(patch.place(self.points[i])).clamp(low, high);
            self.sums[i - self.start] += value;
        }
        true
    }

    fn known(&mut self, i: usize, at: &mut impl FnMut(usize, Vec3) -> f64) -> f64 {
        let known = &mut self.known[i - self.start];
        if known.is_nan() {
            *known = at(i, self.points[i]);
        }
        *known
    }
}

/// Rectangle of a cluster.
struct Patch {
    axes: [Vec3; 2],
    middle: [f64; 2],
}

impl Patch {
    fn new(cluster: &Cluster, frame: [Vec3; 2]) -> Patch {
        let (low, high) = (cluster.corners[0], cluster.corners[2]);
        let axes = frame.map(|axis| {
            let side = axis.dot(high - low);
            axis * if side > 0.0 { 2.0 / side } else { 0.0 }
        });
        let middle = axes.map(|axis| axis.dot((low + high) * 0.5));
        Patch { axes, middle }
    }

    /// Position of a point, -1 to 1 along both sides.
    fn place(&self, point: Vec3) -> [f64; 2] {
        [0, 1].map(|k| self.axes[k].dot(point) - self.middle[k])
    }
}

/// Values of the corners and the centre.
fn first<T: Copy>(all: &[T; SAMPLES]) -> [T; CORNERS] {
    std::array::from_fn(|k| all[k])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "test")]
mod tests {
    use super::*;
    use crate::direct::cluster::{Receiver, Receivers};
    use crate::surfaces::rectangle;
    use crate::surfaces::surface::Surfaces;
    use footlight_show::geometry::vec3;

    const UP: Vec3 = vec3(0.0, 0.0, 1.0);

    /// A floor of `n` by `n` receivers, at unit spacing.
    fn floor(n: u8) -> Receivers {
        let side = f64::from(n);
        let square = rectangle((0.0, side), (0.0, side), 0.0);
        let surfaces = Surfaces::grey(vec![square.to_vec()]);
        let points = (0..n).flat_map(|j| (0..n).map(move |i| (f64::from(i), f64::from(j))));
        let receivers: Vec<Receiver> = points
            .map(|(x, y)| Receiver {
                point: vec3(x + 0.5, y + 0.5, 0.0),
                facet: 0,
            })
            .collect();
        Receivers::new(&surfaces, &receivers)
    }

    /// True when a chunk interpolates the light as a whole, and the resulting values.
    fn seen(n: u8, allowed: f64, light: impl Fn(Vec3) -> f64) -> (bool, Vec<(Vec3, f64)>) {
        let receivers = floor(n);
        let [(_, chunk)] = receivers.chunks.as_slice() else {
            unreachable!("a small floor is one chunk")
        };
        let mut patch = IrradiancePatch::new(&receivers.points, chunk, UP, allowed);
        let whole = patch.interpolated(chunk, PATCH, |_, p| light(p));
        let values = receivers.points.iter().copied().zip(patch.sums).collect();
        (whole, values)
    }

    #[test]
    fn what_bends_evenly_is_met_by_nine_samples_of_256() {
        let hill = |p: Vec3| 2.0 + 0.1 * p.x - 2e-3 * ((p.x - 8.0).powi(2) + (p.y - 8.0).powi(2));
        let (whole, values) = seen(16, 0.05, hill);
        assert!(whole);
        for (p, v) in values {
            assert!((v - hill(p)).abs() < 0.05, "{p:?}: {v} for {}", hill(p));
        }
    }

    /// The corners and the centre agree although a band across the patch is dark.
    #[test]
    fn a_band_between_the_corners_and_the_middle_is_not_passed_over() {
        let band = |p: Vec3| f64::from(u8::from((p.x - p.y - 8.0).abs() > 1.5));
        assert!(!seen(16, 0.05, band).0);
        // A spot of six points lies between the samples of 256 points, and is found by those
        // of 100.
        let spot = |p: Vec3| f64::from(u8::from((p.x - 12.0).abs().max((p.y - 4.0).abs()) > 3.0));
        assert!(seen(16, 0.05, spot).0);
        let small = |p: Vec3| f64::from(u8::from((p.x - 7.5).abs().max((p.y - 2.5).abs()) > 3.0));
        assert!(!seen(10, 0.05, small).0 && 10 * 10 <= SHADED);
        // A patch of a few points is not checked: nothing fits between its samples.
        assert!(seen(5, 0.05, |_| 1.0).0);
    }

    /// A quadratic fit to light that ends in the middle of a patch would give -0.375 at a side.
    #[test]
    fn no_light_is_less_than_none() {
        let steep = |p: Vec3| (p.x - 3.0).max(0.0);
        let (whole, values) = seen(5, 0.7, steep);
        assert!(whole);
        assert!(values.iter().all(|(_, v)| (0.0..=1.5 + 0.7).contains(v)));
    }
}
