//! Direct light: one number for each receiving point and light, at unit radiance or intensity.
//!
//! Receivers are sorted facet by facet into trees of small flat clusters. Each cluster is tested
//! against the shaft between it and the emitter: nothing in the shaft leaves the closed form, one
//! occluder across all of it leaves nothing, and only what is mixed descends, with a shorter list,
//! to exact clipping. Where some error is allowed, a small cluster whose few samples lie on a linear
//! function takes that function. Invariant: results depend on the points alone, not on threads,
//! batches or settings. This room knows nothing of colour.

#![allow(
    clippy::indexing_slicing,
    reason = "ranges of receivers and pieces are made by this module and the surfaces"
)]

use crate::geometry::{Vec3, vec3};
use crate::scene::{Light, Rig};
use crate::transport::TransportError;
use crate::transport::beam::Beam;
use crate::transport::lambert::{Clipper, halved};
use crate::transport::surface::{Piece, Surfaces};
use crate::transport::visibility::{Hierarchy, Shaft, blocks};
use crate::work::{Cancelled, Work};
use rayon::prelude::*;
use std::borrow::Cow;

/// Points in the smallest cluster.
const LEAF: usize = 6;
/// Points in the largest: a task of one thread.
const CHUNK: usize = 512;

/// Points of the largest cluster that may be interpolated across.
const PATCH: usize = 64;
/// The same where the light is partly shadowed.
const SHADED_PATCH: usize = 32;
/// Points of a cluster that are evaluated to interpolate the others.
const SAMPLES: usize = 5;

/// Occluders that are cut one by one without dividing the emitter first.
const FEW: usize = 48;
/// How often an emitter is halved at most.
const HALVINGS: usize = 4;

/// Where light is to be known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// On the facet's plane.
    pub point: Vec3,
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
}

/// A range of points of one facet, their bounding rectangle, and its halves.
#[derive(Clone, Debug)]
struct Cluster {
    range: std::ops::Range<usize>,
    corners: [Vec3; 4],
    /// Points nearest to the corners and to the middle; only where there are halves.
    samples: [usize; SAMPLES],
    halves: Option<Box<[Cluster; 2]>>,
}

/// Receivers in the order of their clusters.
#[derive(Clone, Debug)]
pub struct Receivers {
    points: Vec<Vec3>,
    /// For each, its index in the list they were made from.
    origin: Vec<usize>,
    chunks: Vec<(usize, Cluster)>,
}

impl Receivers {
    /// Sorts them into clusters.
    pub fn new(surfaces: &Surfaces, receivers: &[Receiver]) -> Receivers {
        let mut origin: Vec<usize> = (0..receivers.len()).collect();
        origin.sort_by_key(|&i| receivers[i].facet);
        let mut chunks = Vec::new();
        let mut from = 0;
        while from < origin.len() {
            let facet = receivers[origin[from]].facet;
            let count = origin[from..]
                .iter()
                .take_while(|&&i| receivers[i].facet == facet)
                .count();
            let frame = frame(surfaces.facets[facet].normal);
            let plane = Plane {
                receivers,
                frame,
                height: 0.0,
            };
            plane.chunks(&mut origin[from..from + count], from, facet, &mut chunks);
            from += count;
        }
        Receivers {
            points: origin.iter().map(|&i| receivers[i].point).collect(),
            origin,
            chunks,
        }
    }
}

/// Two unit vectors that span the plane of `normal`.
pub fn frame(normal: Vec3) -> [Vec3; 2] {
    let aside = if normal.x.abs() < 0.6 {
        vec3(1.0, 0.0, 0.0)
    } else {
        vec3(0.0, 1.0, 0.0)
    };
    let u = normal.cross(aside).normalized();
    [u, normal.cross(u)]
}

struct Plane<'a> {
    receivers: &'a [Receiver],
    frame: [Vec3; 2],
    height: f64,
}

impl Plane<'_> {
    fn place(&self, i: usize) -> (f64, f64) {
        let p = self.receivers[i].point;
        (self.frame[0].dot(p), self.frame[1].dot(p))
    }

    fn rectangle(&self, members: &[usize]) -> (f64, f64, f64, f64) {
        let start = (
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
        );
        members
            .iter()
            .map(|&i| self.place(i))
            .fold(start, |(a, b, c, d), (u, v)| {
                (a.min(u), b.max(u), c.min(v), d.max(v))
            })
    }

    fn halve(&self, members: &mut [usize]) -> usize {
        let (a, b, c, d) = self.rectangle(members);
        let middle = members.len() / 2;
        let wide = b - a >= d - c;
        let key = |i: usize| {
            let (u, v) = self.place(i);
            if wide { u } else { v }
        };
        members.select_nth_unstable_by(middle, |&i, &j| key(i).total_cmp(&key(j)).then(i.cmp(&j)));
        middle
    }

    /// The member nearest to a place, by its position in the list.
    fn nearest(&self, members: &[usize], place: (f64, f64)) -> usize {
        let distance = |i: usize| {
            let (u, v) = self.place(members[i]);
            (u - place.0).hypot(v - place.1)
        };
        let closer = |&i: &usize, &j: &usize| distance(i).total_cmp(&distance(j));
        (0..members.len()).min_by(closer).unwrap_or(0)
    }

    fn chunks(
        &self,
        members: &mut [usize],
        from: usize,
        facet: usize,
        out: &mut Vec<(usize, Cluster)>,
    ) {
        if members.len() > CHUNK {
            let middle = self.halve(members);
            let (left, right) = members.split_at_mut(middle);
            self.chunks(left, from, facet, out);
            self.chunks(right, from + middle, facet, out);
            return;
        }
        let plane = Plane {
            height: members.first().map_or(0.0, |&i| {
                self.receivers[i]
                    .point
                    .dot(self.frame[0].cross(self.frame[1]))
            }),
            ..*self
        };
        out.push((facet, plane.cluster(members, from)));
    }

    fn cluster(&self, members: &mut [usize], from: usize) -> Cluster {
        let (a, b, c, d) = self.rectangle(members);
        let normal = self.frame[0].cross(self.frame[1]);
        let corner = |u: f64, v: f64| self.frame[0] * u + self.frame[1] * v + normal * self.height;
        let corners = [corner(a, c), corner(b, c), corner(b, d), corner(a, d)];
        let range = from..from + members.len();
        let halves = (members.len() > LEAF).then(|| {
            let middle = self.halve(members);
            let (left, right) = members.split_at_mut(middle);
            Box::new([self.cluster(left, from), self.cluster(right, from + middle)])
        });
        let samples = if halves.is_some() && members.len() <= PATCH {
            [
                (a, c),
                (b, c),
                (b, d),
                (a, d),
                (0.5 * (a + b), 0.5 * (c + d)),
            ]
            .map(|p| from + self.nearest(members, p))
        } else {
            [from; SAMPLES]
        };
        Cluster {
            range,
            corners,
            samples,
            halves,
        }
    }
}

/// A light made ready for direct illumination.
#[derive(Clone, Debug)]
pub enum Luminaire {
    /// Pieces (indices) that emit.
    Panel(Vec<usize>),
    /// A point source.
    Spot(Beam),
}

/// Makes the rig's lights ready.
///
/// # Errors
/// [`TransportError::Scene`] for a spot whose angles or aim are impossible.
pub fn luminaires(surfaces: &Surfaces, rig: &Rig) -> Result<Vec<Luminaire>, TransportError> {
    rig.lights
        .iter()
        .enumerate()
        .map(|(i, light)| match light {
            Light::Panel { material, .. } => {
                let lit = |p: &Piece| surfaces.facets[p.facet].material == *material;
                let pieces = (0..surfaces.pieces.len()).filter(|&p| lit(&surfaces.pieces[p]));
                Ok(Luminaire::Panel(pieces.collect()))
            }
            Light::Spot(spot) => Beam::new(spot).map(Luminaire::Spot).ok_or_else(|| {
                TransportError::Scene(format!(
                    "light {i}: a spot needs 0 < beam < field <= 360 degrees and an aim"
                ))
            }),
        })
        .collect()
}

/// Who stands where: what the direct light needs to know of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    /// The facets and pieces.
    pub surfaces: &'a Surfaces,
    /// The hierarchy over the same pieces.
    pub hierarchy: &'a Hierarchy,
}

/// Irradiance at every receiver (in the order they were given in) per unit radiance or peak
/// intensity of one light. `allowed` is how far reflectance times irradiance may be, at the
/// samples, from what is interpolated through them; 0 evaluates every receiver.
///
/// # Errors
/// On cancel.
pub fn irradiance(
    setting: Setting<'_>,
    light: &Luminaire,
    receivers: &Receivers,
    allowed: f64,
    work: Work<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let parts: Result<Vec<Vec<f32>>, Cancelled> = receivers
        .chunks
        .par_iter()
        .map(|(facet, cluster)| {
            work.check()?;
            let own = &setting.surfaces.facets[*facet];
            let reflectance = own.reflectance.iter().copied().fold(0.0, f64::max);
            let mut gather = Gather {
                setting,
                points: &receivers.points,
                normal: own.normal,
                frame: frame(own.normal),
                facet: *facet,
                allowed: if reflectance > 0.0 {
                    allowed / reflectance
                } else {
                    f64::INFINITY
                },
                start: cluster.range.start,
                sums: vec![0.0; cluster.range.len()],
                known: vec![f64::NAN; cluster.range.len()],
                clipper: Clipper::default(),
            };
            gather.light(light, cluster);
            Ok(gather.sums.iter().map(|s| *s as f32).collect())
        })
        .collect();
    let mut out = vec![0.0; receivers.points.len()];
    for (value, &at) in parts?.iter().flatten().zip(&receivers.origin) {
        out[at] = *value;
    }
    Ok(out)
}

/// The work of one chunk of one facet.
struct Gather<'a> {
    setting: Setting<'a>,
    points: &'a [Vec3],
    normal: Vec3,
    frame: [Vec3; 2],
    facet: usize,
    /// How far interpolated irradiance may be from the samples it was fitted to; 0 for none.
    allowed: f64,
    start: usize,
    sums: Vec<f64>,
    /// Irradiance of the current source where it has been evaluated, else NaN.
    known: Vec<f64>,
    clipper: Clipper,
}

impl<'a> Gather<'a> {
    fn light(&mut self, light: &Luminaire, cluster: &Cluster) {
        match light {
            Luminaire::Panel(pieces) => {
                let surfaces = self.setting.surfaces;
                for &i in pieces {
                    let piece = &surfaces.pieces[i];
                    if piece.facet != self.facet {
                        let corners = Cow::Borrowed(piece.vertices.as_slice());
                        self.begin(&Source::Area(corners, piece.normal), cluster);
                    }
                }
            }
            Luminaire::Spot(beam) => self.begin(&Source::Point(beam, [beam.position]), cluster),
        }
    }

    /// Drops pairs that face away, finds the first list of occluders.
    fn begin(&mut self, source: &Source<'_>, cluster: &Cluster) {
        let touching = self.setting.surfaces.touching();
        let at = cluster.corners[0];
        let below = |v: &Vec3| self.normal.dot(*v - at) <= touching;
        let behind = |n: Vec3| {
            let o = source.corners().first().copied().unwrap_or_default();
            cluster.corners.iter().all(|c| n.dot(*c - o) <= 0.0)
        };
        if source.corners().iter().all(below) || source.normal().is_some_and(behind) {
            return;
        }
        self.known.fill(f64::NAN);
        let shaft = self.shaft(source, cluster);
        let mut list = Vec::new();
        self.setting
            .hierarchy
            .occluders(self.setting.surfaces, &shaft, &mut list);
        self.settle(source, cluster, &shaft, &list, HALVINGS);
    }

    fn shaft<'b>(&self, source: &'b Source<'_>, cluster: &'b Cluster) -> Shaft<'b> {
        let touching = self.setting.surfaces.touching();
        Shaft::new(
            &cluster.corners,
            self.normal,
            source.corners(),
            source.normal(),
            touching,
        )
    }

    /// Evaluates what is clear, drops what is dark, and divides the rest: the cluster first,
    /// then the emitter while too many occluders are left between them.
    fn settle(
        &mut self,
        source: &Source<'_>,
        cluster: &Cluster,
        shaft: &Shaft<'_>,
        list: &[usize],
        halvings: usize,
    ) {
        let surfaces = self.setting.surfaces;
        let touching = surfaces.touching();
        let dark = |i: &usize| shaft.is_blocked_by(&surfaces.pieces[*i], touching);
        if list.iter().any(dark) {
            return;
        }
        if self.interpolated(source, cluster, list) {
            return;
        }
        let crowded = list.len() > FEW && halvings > 0;
        if crowded
            && cluster.halves.is_none()
            && let Source::Area(emitter, normal) = source
        {
            let local = cluster.range.start - self.start..cluster.range.end - self.start;
            self.known[local].fill(f64::NAN);
            for half in halved(emitter).into_iter().filter(|h| h.len() >= 3) {
                let half = Source::Area(Cow::Owned(half), *normal);
                self.descend(&half, cluster, list, halvings - 1);
            }
            return;
        }
        let Some(halves) = cluster.halves.as_deref().filter(|_| !list.is_empty()) else {
            for i in cluster.range.clone() {
                let known = self.known[i - self.start];
                let value = if known.is_nan() {
                    self.at(source, self.points[i], list)
                } else {
                    known
                };
                self.sums[i - self.start] += value;
            }
            return;
        };
        for half in halves {
            self.descend(source, half, list, halvings);
        }
    }

    /// Evaluates a few points of a small cluster; if a linear function meets them as well as
    /// allowed it serves for all. Not across the sharp shadows of a point.
    fn interpolated(&mut self, source: &Source<'_>, cluster: &Cluster, list: &[usize]) -> bool {
        let most = match (list.is_empty(), source) {
            (true, _) => PATCH,
            (false, Source::Area(..)) => SHADED_PATCH,
            (false, Source::Point(..)) => 0,
        };
        if cluster.halves.is_none() || self.allowed <= 0.0 || cluster.range.len() > most {
            return false;
        }
        let mut values = [0.0; SAMPLES];
        for (value, &i) in values.iter_mut().zip(&cluster.samples) {
            if self.known[i - self.start].is_nan() {
                self.known[i - self.start] = self.at(source, self.points[i], list);
            }
            *value = self.known[i - self.start];
        }
        let places = cluster.samples.map(|i| self.place(cluster, i));
        let plane = fitted(&places, &values);
        let height = |p: &[f64; 2]| plane[0] + plane[1] * p[0] + plane[2] * p[1];
        let close = |(p, v): (&[f64; 2], &f64)| (height(p) - v).abs() <= self.allowed;
        if !places.iter().zip(&values).all(close) {
            return false;
        }
        for i in cluster.range.clone() {
            let value = height(&self.place(cluster, i)).max(0.0);
            self.sums[i - self.start] += value;
        }
        true
    }

    /// Position of a point in its cluster's rectangle, -1 to 1 along both sides.
    fn place(&self, cluster: &Cluster, i: usize) -> [f64; 2] {
        let (low, high) = (cluster.corners[0], cluster.corners[2]);
        self.frame.map(|axis| {
            let side = axis.dot(high - low);
            let along = axis.dot(self.points[i] - low);
            if side > 0.0 {
                2.0 * along / side - 1.0
            } else {
                0.0
            }
        })
    }

    /// Settles a half with those of the occluders that reach into its shaft.
    fn descend(&mut self, source: &Source<'_>, cluster: &Cluster, list: &[usize], halvings: usize) {
        let shaft = self.shaft(source, cluster);
        let pieces = &self.setting.surfaces.pieces;
        let kept = list.iter().copied().filter(|&i| !shaft.misses(&pieces[i]));
        let shorter: Vec<usize> = kept.collect();
        self.settle(source, cluster, &shaft, &shorter, halvings);
    }

    fn at(&mut self, source: &Source<'_>, point: Vec3, list: &[usize]) -> f64 {
        let surfaces = self.setting.surfaces;
        let touching = surfaces.touching();
        let occluders = list.iter().map(|&i| &surfaces.pieces[i]);
        match source {
            Source::Area(corners, normal) => {
                if normal.dot(point - corners[0]) <= 0.0 {
                    0.0
                } else if list.is_empty() {
                    self.clipper.unoccluded(point, self.normal, corners)
                } else {
                    self.clipper
                        .occluded(point, self.normal, corners, occluders, touching)
                }
            }
            Source::Point(beam, _) => {
                let open = beam.irradiance(point, self.normal);
                let dark = open > 0.0
                    && occluders
                        .into_iter()
                        .any(|p| blocks(p, point, beam.position, touching));
                if dark { 0.0 } else { open }
            }
        }
    }
}

/// Least-squares linear function through values at places: its constant and two slopes. A slope
/// that the places do not tell is zero.
fn fitted(places: &[[f64; 2]; SAMPLES], values: &[f64; SAMPLES]) -> [f64; 3] {
    let n = SAMPLES as f64;
    let mean = |k: usize| places.iter().map(|p| p[k]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let level = values.iter().sum::<f64>() / n;
    let [mut xx, mut xy, mut yy, mut xv, mut yv] = [0.0; 5];
    for (p, v) in places.iter().zip(values) {
        let (a, b, c) = (p[0] - x, p[1] - y, v - level);
        xx += a * a;
        xy += a * b;
        yy += b * b;
        xv += a * c;
        yv += b * c;
    }
    let area = xx * yy - xy * xy;
    let slopes = if area > 1e-6 * (xx + yy).powi(2) {
        [(yy * xv - xy * yv) / area, (xx * yv - xy * xv) / area]
    } else if xx > yy {
        [xv / xx, 0.0]
    } else if yy > 0.0 {
        [0.0, yv / yy]
    } else {
        [0.0; 2]
    };
    [level - slopes[0] * x - slopes[1] * y, slopes[0], slopes[1]]
}

/// A part of an emitting piece, or a point.
enum Source<'a> {
    Area(Cow<'a, [Vec3]>, Vec3),
    Point(&'a Beam, [Vec3; 1]),
}

impl Source<'_> {
    fn corners(&self) -> &[Vec3] {
        match self {
            Source::Area(corners, _) => corners,
            Source::Point(_, position) => position,
        }
    }

    fn normal(&self) -> Option<Vec3> {
        match self {
            Source::Area(_, normal) => Some(*normal),
            Source::Point(..) => None,
        }
    }
}
