//! Receivers of direct light, sorted facet by facet into trees of small flat clusters.
//!
//! A cluster knows the rectangle of the facet's plane that holds its points and, where they are
//! fragments of a picture, all their outlines; and the rectangle of the picture that holds those.
//! Invariants: the trees depend on the receivers alone; halves tile their cluster. This room
//! knows nothing of light.

#![allow(
    clippy::indexing_slicing,
    reason = "ranges and lists of members are made and kept by this module"
)]

use crate::geometry::{Vec3, vec3};
use crate::transport::eye::Fragments;
use crate::transport::surface::Surfaces;

/// Points in the smallest cluster.
const LEAF: usize = 6;
/// Points in the largest: a task of one thread.
const CHUNK: usize = 512;
/// Points of the largest cluster that may be interpolated across.
pub const PATCH: usize = 256;
/// Points of a cluster that may be evaluated to interpolate the others.
pub const SAMPLES: usize = 9;
/// Those of them near the corners and the middle; the others are near the middles of the sides.
pub const CORNERS: usize = 5;
/// Points that are worth a second thread.
const SHARED: usize = 4096;

/// Where light is to be known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// On the facet's plane.
    pub point: Vec3,
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
}

/// Bounds of two coordinates: least and greatest of the first, then of the second.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle(pub [f64; 4]);

impl Rectangle {
    /// Holds nothing.
    pub const EMPTY: Rectangle = Rectangle([
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ]);

    /// The least that holds both.
    pub fn with(self, o: Rectangle) -> Rectangle {
        let [a, b, c, d] = self.0;
        let [e, f, g, h] = o.0;
        Rectangle([a.min(e), b.max(f), c.min(g), d.max(h)])
    }

    /// Of a point.
    pub fn at([x, y]: [f64; 2]) -> Rectangle {
        Rectangle([x, x, y, y])
    }
}

/// A range of points of one facet, their bounding rectangle, and its halves.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// Positions in the order of the clusters.
    pub range: std::ops::Range<usize>,
    /// Of the rectangle in space.
    pub corners: [Vec3; 4],
    /// In the picture's pixels; empty where the points belong to no picture.
    pub picture: Rectangle,
    /// Points nearest to the corners, to the middle, and to the middles of the sides; only where
    /// there are halves.
    pub samples: [usize; SAMPLES],
    /// None below a handful of points.
    pub halves: Option<Box<[Cluster; 2]>>,
}

/// Receivers in the order of their clusters.
#[derive(Clone, Debug)]
pub struct Receivers {
    /// In that order.
    pub points: Vec<Vec3>,
    /// For each, its index in the list they were made from.
    pub origin: Vec<usize>,
    /// Each with its facet; together all points.
    pub chunks: Vec<(usize, Cluster)>,
}

impl Receivers {
    /// Sorts points into clusters.
    pub fn new(surfaces: &Surfaces, receivers: &[Receiver]) -> Receivers {
        Receivers::sorted(surfaces, receivers, None)
    }

    /// Sorts the fragments of a picture.
    pub fn of_fragments(surfaces: &Surfaces, fragments: &Fragments) -> Receivers {
        let receivers: Vec<Receiver> = fragments
            .all
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
        let mut chunks = Vec::new();
        for facet in 0..surfaces.facets.len() {
            let (from, to) = (starts[facet], starts[facet + 1]);
            if from < to {
                let normal = surfaces.facets[facet].normal;
                let own = &mut origin[from..to];
                let plane = Plane {
                    receivers,
                    fragments,
                    normal,
                    frame: frame(normal),
                    facet,
                };
                let mut members: Vec<Member> = own.iter().map(|&i| plane.member(i)).collect();
                chunks.extend(plane.chunks(&mut members, from));
                for (slot, member) in own.iter_mut().zip(&members) {
                    *slot = member.index;
                }
            }
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

/// A receiver in its facet's plane.
#[derive(Clone, Copy)]
struct Member {
    index: usize,
    place: [f64; 2],
    reach: Rectangle,
    picture: Rectangle,
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
        let point = self.receivers[index].point;
        let place = self.flat(point);
        let mut member = Member {
            index,
            place,
            reach: Rectangle::at(place),
            picture: Rectangle::EMPTY,
        };
        if let Some(fragments) = self.fragments {
            let height = self.normal.dot(point - fragments.camera.origin);
            fragments.outline(index, |part| {
                for &at in part {
                    member.picture = member.picture.with(Rectangle::at(at));
                    let ray = fragments.camera.ray(at[0], at[1]);
                    let slope = self.normal.dot(ray);
                    if slope < 0.0 {
                        let corner = fragments.camera.origin + ray * (height / slope);
                        member.reach = member.reach.with(Rectangle::at(self.flat(corner)));
                    }
                }
            });
        }
        member
    }

    /// Puts the members into the order of their halves along the longer side.
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
            return vec![(self.facet, self.cluster(members, from))];
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

    fn cluster(&self, members: &mut [Member], from: usize) -> Cluster {
        let inner = bounds(members);
        let (reach, picture) = members.iter().fold(
            (Rectangle::EMPTY, Rectangle::EMPTY),
            |(reach, picture), m| (reach.with(m.reach), picture.with(m.picture)),
        );
        let height = members
            .first()
            .map_or(0.0, |m| self.normal.dot(self.receivers[m.index].point));
        let corner = |u: f64, v: f64| self.frame[0] * u + self.frame[1] * v + self.normal * height;
        let Rectangle([a, b, c, d]) = reach;
        let corners = [corner(a, c), corner(b, c), corner(b, d), corner(a, d)];
        let range = from..from + members.len();
        let halves = (members.len() > LEAF).then(|| {
            let middle = Plane::halve(members, inner);
            let (left, right) = members.split_at_mut(middle);
            Box::new([self.cluster(left, from), self.cluster(right, from + middle)])
        });
        let samples = if halves.is_some() && members.len() <= PATCH {
            let Rectangle([a, b, c, d]) = inner;
            let [x, y] = [0.5 * (a + b), 0.5 * (c + d)];
            let [nw, ne, se, sw] = [[a, c], [b, c], [b, d], [a, d]];
            let [north, east, south, west] = [[x, c], [b, y], [x, d], [a, y]];
            [nw, ne, se, sw, [x, y], north, east, south, west].map(|p| from + nearest(members, p))
        } else {
            [from; SAMPLES]
        };
        Cluster {
            range,
            corners,
            picture,
            samples,
            halves,
        }
    }
}

/// Of the points themselves.
fn bounds(members: &[Member]) -> Rectangle {
    let places = members.iter().map(|m| Rectangle::at(m.place));
    places.fold(Rectangle::EMPTY, Rectangle::with)
}

/// The member nearest to a place, by its position in the list.
fn nearest(members: &[Member], place: [f64; 2]) -> usize {
    let mut best = (f64::INFINITY, 0);
    for (i, m) in members.iter().enumerate() {
        let [x, y] = [m.place[0] - place[0], m.place[1] - place[1]];
        let square = x * x + y * y;
        if square < best.0 {
            best = (square, i);
        }
    }
    best.1
}
