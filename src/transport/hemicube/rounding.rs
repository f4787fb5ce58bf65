//! Round surfaces made of facets: light varies smoothly across their common edges.
//!
//! Light at a fragment of such a facet is a mean of the facet's own and that of its neighbours,
//! each taken at the fragment's mirror image across the common edge: equal shares at the edge, the
//! facet's own alone at its centre (after H. Gouraud, "Continuous Shading of Curved Surfaces",
//! 1971). Shadows are preserved, and only places lit on a facet show light, so the terminator has
//! no leaks. Invariant: weights depend on the scene and the view alone. This module does not depend
//! on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "corners are numbered modulo their count, facets by the surfaces, places by their lists"
)]

use crate::direct::cluster::{Receiver, Receivers};
use crate::surfaces::facet::{Edge, Facet};
use crate::surfaces::fragment::{Fragment, Fragments};
use crate::surfaces::lists::Lists;
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::Vec3;
use std::collections::BTreeMap;

/// Least cosine between two facets' shading normals at a common corner for which they are equal.
const ONE_NORMAL: f64 = 0.98;

/// An edge across which a surface is round.
struct RoundEdge {
    own: Edge,
    /// Distance from the edge to the facet's centre, metres.
    depth: f64,
    /// The adjacent facet, the direction into it, and the distance from the edge to its centre.
    other: usize,
    inward: Vec3,
    other_depth: f64,
}

/// Places on adjacent facets whose light contributes to fragments.
#[derive(Debug)]
pub struct Rounding {
    receivers: Vec<Receiver>,
    /// The places as receivers of direct light.
    pub sorted: Receivers,
    /// Places of each fragment with their weights; the remainder to 1 is the fragment's own.
    of: Lists<(u32, f32)>,
}

impl Rounding {
    /// For the fragments of an image; `None` if it shows nothing round.
    pub fn new(surfaces: &Surfaces, fragments: &Fragments) -> Option<Rounding> {
        let edges = round_edges(surfaces);
        let mut receivers = Vec::new();
        let mut of = Lists::default();
        for fragment in fragments.all() {
            add(surfaces, &edges, fragment, &mut receivers, &mut of);
        }
        (!receivers.is_empty()).then(|| Rounding {
            sorted: Receivers::new(surfaces, &receivers),
            receivers,
            of,
        })
    }

    /// The places.
    pub fn receivers(&self) -> &[Receiver] {
        &self.receivers
    }

    /// Approximate bytes held.
    pub fn bytes(&self) -> usize {
        let each = 2 * size_of::<Receiver>() + size_of::<(u32, f32)>() + 2 * size_of::<usize>();
        self.receivers.len() * each + self.of.count() * size_of::<usize>()
    }

    /// Facets and points that contribute to a fragment's light, with their weights, which sum to 1.
    pub fn places(&self, number: usize, f: &Fragment) -> Vec<(usize, Vec3, f32)> {
        let others = self.of.get(number);
        let rest = 1.0 - others.iter().map(|(_, w)| w).sum::<f32>();
        let place = |(at, weight): &(u32, f32)| {
            let receiver = self.receivers[*at as usize];
            (receiver.facet, receiver.point, *weight)
        };
        let own = std::iter::once((f.facet, f.point, rest));
        own.chain(others.iter().map(place)).collect()
    }

    /// Mixes light on the fragments with light on the places.
    pub fn mix(&self, on_fragments: &mut [f32], on_places: &[f32]) {
        for (number, own) in on_fragments.iter_mut().enumerate() {
            let others = self.of.get(number);
            let rest = 1.0 - others.iter().map(|(_, w)| w).sum::<f32>();
            let sum: f32 = others
                .iter()
                .map(|(at, w)| w * on_places[*at as usize])
                .sum();
            *own = rest * *own + sum;
        }
    }
}

/// Adds the places of a fragment.
fn add(
    surfaces: &Surfaces,
    edges: &[Vec<RoundEdge>],
    fragment: &Fragment,
    receivers: &mut Vec<Receiver>,
    of: &mut Lists<(u32, f32)>,
) {
    let near = |edge: &RoundEdge| {
        let share = 0.5 * (1.0 - edge.distance(fragment.point) / edge.depth).clamp(0.0, 1.0);
        share / (1.0 - share)
    };
    let own = &edges[fragment.facet];
    let whole = 1.0 + own.iter().map(near).sum::<f64>();
    for (edge, share) in own.iter().map(|e| (e, near(e))).filter(|(_, s)| *s > 0.0) {
        of.add((receivers.len() as u32, (share / whole) as f32));
        receivers.push(Receiver {
            point: edge.mirrored(fragment.point, &surfaces.facets[edge.other]),
            facet: edge.other,
        });
    }
    of.end();
}

impl RoundEdge {
    fn distance(&self, p: Vec3) -> f64 {
        self.own.inward.dot(p - self.own.start).max(0.0)
    }

    /// Mirror image of `p` across the edge, within the adjacent facet.
    fn mirrored(&self, p: Vec3, other: &Facet) -> Vec3 {
        let along = self.own.along.dot(p - self.own.start);
        let foot = self.own.start + self.own.along * along.clamp(0.0, self.own.length);
        let mut point = foot + self.inward * (self.distance(p) * self.other_depth / self.depth);
        for edge in other.rim() {
            let outside = edge.inward.dot(edge.start - point).max(0.0);
            point += edge.inward * outside;
        }
        point
    }
}

/// Edges of each facet across which it is round.
fn round_edges(surfaces: &Surfaces) -> Vec<Vec<RoundEdge>> {
    let bits = |p: Vec3| [p.x, p.y, p.z].map(|c| (c + 0.0).to_bits());
    let ends = |e: &Edge| [e.start, e.start + e.along * e.length];
    let smooth = || {
        surfaces
            .facets
            .iter()
            .enumerate()
            .filter(|(_, f)| f.is_smooth())
    };
    let mut known: BTreeMap<[[u64; 3]; 2], (usize, Edge)> = BTreeMap::new();
    for (number, facet) in smooth() {
        for (k, edge) in facet.rim().enumerate() {
            let [a, b] = corners(facet, k).map(bits);
            known.insert([a, b], (number, edge));
        }
    }
    let mut out: Vec<Vec<RoundEdge>> = surfaces.facets.iter().map(|_| Vec::new()).collect();
    for (number, facet) in smooth() {
        for (k, edge) in facet.rim().enumerate() {
            let [a, b] = corners(facet, k).map(bits);
            let Some((other, beyond)) = known.get(&[b, a]) else {
                continue;
            };
            let neighbour = &surfaces.facets[*other];
            let is_one = |p: &Vec3| facet.normal_at(*p).dot(neighbour.normal_at(*p)) >= ONE_NORMAL;
            if facet.material == neighbour.material && ends(&edge).iter().all(is_one) {
                out[number].push(RoundEdge {
                    depth: depth(facet, &edge),
                    other: *other,
                    inward: beyond.inward,
                    other_depth: depth(neighbour, beyond),
                    own: edge,
                });
            }
        }
    }
    out
}

/// Distance from an edge to the facet's centre, metres.
fn depth(facet: &Facet, edge: &Edge) -> f64 {
    let sum = facet.vertices.iter().fold(Vec3::ZERO, |sum, v| sum + *v);
    let middle = sum / facet.vertices.len() as f64;
    edge.inward.dot(middle - edge.start).max(1e-9)
}

fn corners(facet: &Facet, k: usize) -> [Vec3; 2] {
    let n = facet.vertices.len();
    [facet.vertices[k], facet.vertices[(k + 1) % n]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_show::geometry::solid::Solid;
    use footlight_show::geometry::vec3;
    use footlight_show::units::Rgb;
    use footlight_stage::Scene;

    #[test]
    fn a_cylinder_is_round_across_the_edges_of_its_mantle_alone() {
        let mut scene = Scene::default();
        let column = Solid::Cylinder {
            from: Vec3::ZERO,
            to: vec3(0.0, 0.0, 3.0),
            radius: 0.4,
            sides: 12,
        };
        scene.add_solid("column", Rgb([0.5; 3]), &column);
        let surfaces = Surfaces::new(&scene).unwrap_or_else(|e| unreachable!("{e}"));
        let edges = round_edges(&surfaces);
        for (facet, own) in surfaces.facets.iter().zip(&edges) {
            assert_eq!(own.len(), if facet.is_smooth() { 2 } else { 0 });
            for edge in own {
                // Any point of the facet: at equal distance from the edge on both sides, on the
                // neighbour's plane.
                let p = edge.own.start + edge.own.along * 1.1 + edge.own.inward * 0.07;
                let other = &surfaces.facets[edge.other];
                let there = edge.mirrored(p, other);
                assert!(other.height(there).abs() < 1e-12);
                assert!((edge.inward.dot(there - edge.own.start) - 0.07).abs() < 1e-12);
                assert!((there.z - p.z).abs() < 1e-12);
            }
        }
    }
}
