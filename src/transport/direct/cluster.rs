//! Receivers of direct light, sorted facet by facet into trees of small flat clusters.
//!
//! A cluster has two bounding rectangles: one of its points (and of the outlines of fragments) in
//! the facet's plane, and one of the outlines in the image. Invariants: the trees depend on the
//! receivers alone; the two halves tile their cluster. This module does not depend on light.

#![allow(
    clippy::indexing_slicing,
    reason = "ranges and lists of members are made and kept by this module"
)]

use crate::surfaces::clipper::Rectangle;
use crate::surfaces::fragment::Fragments;
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::{Vec3, frame};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Points in the smallest cluster.
const LEAF: usize = 6;
/// Points in the largest cluster, the task of one thread.
const CHUNK: usize = 512;
/// Points in the largest cluster that may be interpolated.
pub const PATCH: usize = 256;
/// Points of a cluster that may be evaluated to interpolate the others.
pub const SAMPLES: usize = 9;
/// Samples near the corners and the centre; the others are near the midpoints of the sides.
pub const CORNERS: usize = 5;
/// Points from which a second thread pays off.
const SHARED: usize = 4096;

/// A point at which light is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// On the facet's plane, metres.
    pub point: Vec3,
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
}

/// A range of points of one facet, its bounding rectangles, and its halves.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// Indices in cluster order.
    pub range: std::ops::Range<usize>,
    /// Corners of the bounding rectangle in space.
    pub corners: [Vec3; 4],
    /// Bounding rectangle in the image, pixels; empty for points that belong to no image.
    pub picture: Rectangle,
    /// Bounding rectangle of the points alone, in the [`frame`] of their plane.
    inner: Rectangle,
    /// Computed on first use: most clusters need none.
    samples: OnceLock<[u32; SAMPLES]>,
    /// `None` for a handful of points.
    pub halves: Option<Box<[Cluster; 2]>>,
}

impl Cluster {
    /// Indices of the points nearest to the corners, to the centre, and to the midpoints of the
    /// sides of the bounding rectangle; `frame` is that of the plane of `points`.
    pub fn samples(&self, points: &[Vec3], frame: [Vec3; 2]) -> [usize; SAMPLES] {
        let found = self.samples.get_or_init(|| {
            let Rectangle([a, b, c, d]) = self.inner;
            let [x, y] = [0.5 * (a + b), 0.5 * (c + d)];
            let wanted = [
                [a, c],
                [b, c],
                [b, d],
                [a, d],
                [x, y],
                [x, c],
                [b, y],
                [x, d],
                [a, y],
            ];
            let mut best = [(f64::INFINITY, 0); SAMPLES];
            for i in self.range.clone() {
                let [u, v] = frame.map(|axis| axis.dot(points[i]));
                for (best, [x, y]) in best.iter_mut().zip(wanted) {
                    let square = (u - x) * (u - x) + (v - y) * (v - y);
                    if square < best.0 {
                        *best = (square, i as u32);
                    }
                }
            }
            best.map(|(_, at)| at)
        });
        found.map(|at| at as usize)
    }
}

/// Receivers in cluster order.
#[derive(Clone, Debug)]
pub struct Receivers {
    /// Points in cluster order.
    pub points: Vec<Vec3>,
    /// For each point its index in the original list.
    pub origin: Vec<usize>,
    /// Facet and root cluster of each chunk; together they hold all points.
    pub chunks: Vec<(usize, Cluster)>,
}

impl Receivers {
    /// Sorts points into clusters.
    pub fn new(surfaces: &Surfaces, receivers: &[Receiver]) -> Receivers {
        Receivers::sorted(surfaces, receivers, None)
    }

    /// Sorts the fragments of an image.
    pub fn of_fragments(surfaces: &Surfaces, fragments: &Fragments) -> Receivers {
        let receivers: Vec<Receiver> = fragments
            .all()
            .iter()
            .map(|f| Receiver {
                point: f.point,
                facet: f.facet,
            })
            .collect();
        Receivers::sorted(surfaces, &receivers, Some(fragments))
    }

    fn sorted(
        surfaces: &Surfaces,
        receivers: &[Receiver],
        fragments: Option<&Fragments>,
    ) -> Receivers {
        let mut starts = vec![0; surfaces.facets.len() + 1];
        for r in receivers {
            starts[r.facet + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut origin = vec![0; receivers.len()];
        for (i, r) in receivers.iter().enumerate() {
            origin[next[r.facet]] = i;
            next[r.facet] += 1;
        }
        let mut own = Vec::new();
        let mut rest = origin.as_mut_slice();
        for (facet, ends) in starts.windows(2).enumerate() {
            let (first, others) = rest.split_at_mut(ends[1] - ends[0]);
            rest = others;
            if !first.is_empty() {
                own.push((facet, ends[0], first));
            }
        }
        let sort = |(facet, from, own): (usize, usize, &mut [usize])| {
            let normal = surfaces.facets[facet].normal;
            let plane = Plane {
                receivers,
                fragments,
                normal,
                frame: frame(normal),
                facet,
            };
            let mut members: Vec<Member> = own.iter().map(|&i| plane.member(i)).collect();
            let chunks = plane.chunks(&mut members, from);
            for (slot, member) in own.iter_mut().zip(&members) {
                *slot = member.index;
            }
            chunks
        };
        let chunks = own.into_par_iter().flat_map_iter(sort).collect();
        Receivers {
            points: origin.iter().map(|&i| receivers[i].point).collect(),
            origin,
            chunks,
        }
    }
}

/// A receiver in its facet's plane.
#[derive(Clone, Copy)]
struct Member {
    index: usize,
    place: [f64; 2],
}

/// Bounding rectangles of outlines in the facet's plane and in the image.
#[derive(Clone, Copy)]
struct Extent {
    reach: Rectangle,
    picture: Rectangle,
}

impl Extent {
    fn with(self, o: Extent) -> Extent {
        Extent {
            reach: self.reach.with(o.reach),
            picture: self.picture.with(o.picture),
        }
    }
}

struct Plane<'a> {
    receivers: &'a [Receiver],
    fragments: Option<&'a Fragments>,
    normal: Vec3,
    frame: [Vec3; 2],
    facet: usize,
}

impl Plane<'_> {
    fn flat(&self, p: Vec3) -> [f64; 2] {
        self.frame.map(|axis| axis.dot(p))
    }

    fn member(&self, index: usize) -> Member {
        let place = self.flat(self.receivers[index].point);
        Member { index, place }
    }

    fn extent(&self, member: &Member) -> Extent {
        let mut extent = Extent {
            reach: Rectangle::at(member.place),
            picture: Rectangle::EMPTY,
        };
        if let Some(fragments) = self.fragments {
            let point = self.receivers[member.index].point;
            let height = self.normal.dot(point - fragments.camera.origin);
            fragments.outline(member.index, |part| {
                for &at in part {
                    extent.picture = extent.picture.with(Rectangle::at(at));
                    let ray = fragments.camera.ray(at[0], at[1]);
                    let slope = self.normal.dot(ray);
                    if slope < 0.0 {
                        let corner = fragments.camera.origin + ray * (height / slope);
                        extent.reach = extent.reach.with(Rectangle::at(self.flat(corner)));
                    }
                }
            });
        }
        extent
    }

    /// Partitions the members into halves along the longer side.
    fn halve(members: &mut [Member], Rectangle([a, b, c, d]): Rectangle) -> usize {
        let middle = members.len() / 2;
        let axis = usize::from(b - a < d - c);
        members.select_nth_unstable_by(middle, |i, j| {
            let order = i.place[axis].total_cmp(&j.place[axis]);
            order.then(i.index.cmp(&j.index))
        });
        middle
    }

    fn chunks(&self, members: &mut [Member], from: usize) -> Vec<(usize, Cluster)> {
        if members.len() <= CHUNK {
            return vec![(self.facet, self.cluster(members, from).0)];
        }
        let middle = Plane::halve(members, bounds(members));
        let shared = members.len() > SHARED;
        let (left, right) = members.split_at_mut(middle);
        let mut first = || self.chunks(left, from);
        let mut second = || self.chunks(right, from + middle);
        let (mut all, more) = if shared {
            rayon::join(first, second)
        } else {
            (first(), second())
        };
        all.extend(more);
        all
    }

    fn cluster(&self, members: &mut [Member], from: usize) -> (Cluster, Extent) {
        let inner = bounds(members);
        let range = from..from + members.len();
        let (halves, extent) = if members.len() > LEAF {
            let middle = Plane::halve(members, inner);
            let (left, right) = members.split_at_mut(middle);
            let (left, one) = self.cluster(left, from);
            let (right, two) = self.cluster(right, from + middle);
            (Some(Box::new([left, right])), one.with(two))
        } else {
            let none = Extent {
                reach: Rectangle::EMPTY,
                picture: Rectangle::EMPTY,
            };
            let all = members.iter().map(|m| self.extent(m));
            (None, all.fold(none, Extent::with))
        };
        let height = self.normal.dot(self.receivers[members[0].index].point);
        let corner = |u: f64, v: f64| self.frame[0] * u + self.frame[1] * v + self.normal * height;
        let Rectangle([a, b, c, d]) = extent.reach;
        let cluster = Cluster {
            range,
            corners: [corner(a, c), corner(b, c), corner(b, d), corner(a, d)],
            picture: extent.picture,
            inner,
            samples: OnceLock::new(),
            halves,
        };
        (cluster, extent)
    }
}

/// Bounding rectangle of the points alone.
fn bounds(members: &[Member]) -> Rectangle {
    let places = members.iter().map(|m| Rectangle::at(m.place));
    places.fold(Rectangle::EMPTY, Rectangle::with)
}
