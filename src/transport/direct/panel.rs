//! Direct light of a panel, that is of all polygons of one light together.
//!
//! For each cluster of receivers every polygon of the panel has a list of occluders; the cluster's
//! halves inherit the polygons that reach them, with shorter lists. The sum over all polygons
//! decides whether a cluster may be interpolated, as only the sum is visible. Invariant: a dropped
//! polygon sends no light to any point of the cluster.

#![allow(
    clippy::indexing_slicing,
    reason = "ranges of the emitters, pairs and lists that this module has stacked"
)]

use crate::direct::cluster::{Cluster, PATCH};
use crate::direct::irradiance_patch::{IrradiancePatch, SHADED};
use crate::direct::lambert::{LambertIntegrator, LightPolygon};
use crate::direct::near_field::Picture;
use crate::surfaces::hierarchy::SceneGeometry;
use crate::surfaces::hierarchy::Shaft;
use footlight_show::geometry::Vec3;
use std::ops::Range;

/// Number of occluders above which an emitter is halved.
const FEW: usize = 200;
/// Number of tests of a point against an occluder that cost less than a shaft.
const CHEAP: usize = 200;
/// Most halvings of an emitter.
const HALVINGS: usize = 4;

/// Distances of an emitter from a point, in footprints of the point's pixel, within which 4, 16 and
/// 64 points are evaluated.
const NEAR: [f64; 3] = [8.0, 2.0, 0.7];

/// A convex polygon of the light.
struct Emitter {
    light_polygon: LightPolygon,
    /// Bounding sphere.
    ball: (Vec3, f64),
    /// Halvings left.
    halvings: usize,
}

/// An emitter and its occluders for a cluster.
#[derive(Clone)]
struct Pair {
    emitter: usize,
    /// Range in the stack of lists.
    occluders: Range<usize>,
}

/// Working memory for lighting one chunk of a facet by a panel.
pub struct Panel<'a> {
    setting: SceneGeometry<'a>,
    normal: Vec3,
    facet: usize,
    integrator: LambertIntegrator,
    /// Factor on the distances of [`NEAR`].
    near: f64,
    // Stacks: a cluster's entries are removed when it is done.
    emitters: Vec<Emitter>,
    pairs: Vec<Pair>,
    lists: Vec<u32>,
    /// Capacity of the lists.
    most: usize,
    /// True when the capacity is exceeded; lists are then no longer narrowed.
    full: bool,
}

impl Emitter {
    fn new(light_polygon: LightPolygon, halvings: usize) -> Emitter {
        let corners = &light_polygon.corners;
        let count = corners.len() as f64;
        let middle = corners.iter().fold(Vec3::ZERO, |sum, c| sum + *c) * (1.0 / count);
        let radius = corners.iter().map(|c| (*c - middle).length());
        Emitter {
            ball: (middle, radius.fold(0.0, f64::max)),
            light_polygon,
            halvings,
        }
    }

    /// Lower bound of the distance from a point.
    fn distance(&self, point: Vec3) -> f64 {
        let (middle, radius) = self.ball;
        let way = point - middle;
        let height = self.light_polygon.normal.dot(way).abs();
        (way.length() - radius).max(height)
    }
}

impl<'a> Panel<'a> {
    /// For a facet of unit `normal`, with lists of at most `memory` bytes.
    pub fn new(
        setting: SceneGeometry<'a>,
        normal: Vec3,
        facet: usize,
        (near, memory): (f64, usize),
    ) -> Panel<'a> {
        Panel {
            setting,
            normal,
            facet,
            integrator: LambertIntegrator::default(),
            near,
            emitters: Vec::new(),
            pairs: Vec::new(),
            lists: Vec::new(),
            most: memory / size_of::<u32>(),
            full: false,
        }
    }

    /// Adds the light of these pieces to a chunk; false when memory is too small.
    pub fn shine(
        &mut self,
        pieces: &[usize],
        picture: Option<&Picture<'_>>,
        chunk: &Cluster,
        patch: &mut IrradiancePatch<'_>,
    ) -> bool {
        let SceneGeometry {
            surfaces,
            hierarchy,
        } = self.setting;
        let mut found = Vec::new();
        for &i in pieces {
            let piece = &surfaces.pieces[i];
            if piece.facet == self.facet || self.is_below(&piece.vertices, chunk) {
                continue;
            }
            let emitter = Emitter::new(
                LightPolygon::new(piece.vertices.to_vec(), piece.normal),
                HALVINGS,
            );
            if is_behind(&emitter, chunk) {
                continue;
            }
            let shaft = self.shaft(&emitter, chunk);
            hierarchy.occluders(surfaces, &shaft, &mut found);
            let dark = |&i: &usize| shaft.is_blocked_by(&surfaces.pieces[i], surfaces.touching());
            if found.iter().any(dark) {
                continue;
            }
            let from = self.lists.len();
            if from + found.len() > self.most {
                return false;
            }
            self.lists.extend(found.iter().map(|i| *i as u32));
            self.emitters.push(emitter);
            self.pair(self.emitters.len() - 1, from..self.lists.len(), chunk);
        }
        self.light_cluster(picture, chunk, 0..self.pairs.len(), patch);
        !self.full
    }

    /// True when these points lie on the plane of a cluster or below it.
    fn is_below(&self, corners: &[Vec3], cluster: &Cluster) -> bool {
        let at = cluster.corners[0];
        let touching = self.setting.surfaces.touching();
        corners.iter().all(|v| self.normal.dot(*v - at) <= touching)
    }

    fn shaft<'b>(&self, emitter: &'b Emitter, cluster: &'b Cluster) -> Shaft<'b> {
        Shaft::new(
            &cluster.corners,
            self.normal,
            &emitter.light_polygon.corners,
            Some(emitter.light_polygon.normal),
            self.setting.surfaces.touching(),
        )
    }

    /// Pushes an emitter with its occluders, halved while they are too many.
    fn pair(&mut self, emitter: usize, occluders: Range<usize>, cluster: &Cluster) {
        let halvings = self.emitters[emitter].halvings;
        if occluders.len() <= FEW || halvings == 0 {
            self.pairs.push(Pair { emitter, occluders });
            return;
        }
        let halves: Vec<LightPolygon> = self.emitters[emitter].light_polygon.halves().collect();
        for half in halves {
            if !self.is_below(&half.corners, cluster) {
                self.emitters.push(Emitter::new(half, halvings - 1));
                self.narrow(self.emitters.len() - 1, occluders.clone(), cluster);
            }
        }
    }

    /// Pushes an emitter with those candidates that lie between it and a cluster.
    fn narrow(&mut self, emitter: usize, candidates: Range<usize>, cluster: &Cluster) {
        let own = &self.emitters[emitter];
        if is_behind(own, cluster) {
            return;
        }
        if candidates.len() * cluster.range.len() <= CHEAP {
            let occluders = candidates;
            self.pairs.push(Pair { emitter, occluders });
            return;
        }
        let surfaces = self.setting.surfaces;
        let shaft = self.shaft(own, cluster);
        let from = self.lists.len();
        self.full |= from + candidates.len() > self.most;
        if self.full {
            return;
        }
        for k in candidates {
            let i = self.lists[k];
            let piece = &surfaces.pieces[i as usize];
            if shaft.is_blocked_by(piece, surfaces.touching()) {
                return;
            }
            if !shaft.misses(piece) {
                self.lists.push(i);
            }
        }
        self.pair(emitter, from..self.lists.len(), cluster);
    }

    /// Interpolates where allowed, else evaluates the points of the smallest clusters.
    fn light_cluster(
        &mut self,
        picture: Option<&Picture<'_>>,
        cluster: &Cluster,
        pairs: Range<usize>,
        patch: &mut IrradiancePatch<'_>,
    ) {
        if pairs.is_empty() {
            return;
        }
        let clear = self.pairs[pairs.clone()]
            .iter()
            .all(|p| p.occluders.is_empty());
        let most = if clear { PATCH } else { SHADED };
        if patch.interpolated(cluster, most, |i, p| self.on(picture, pairs.clone(), i, p)) {
            return;
        }
        let Some(halves) = cluster.halves.as_deref() else {
            patch.evaluate(cluster, |i, p| self.on(picture, pairs.clone(), i, p));
            return;
        };
        if clear && patch.allowed <= 0.0 {
            patch.evaluate(cluster, |i, p| self.on(picture, pairs.clone(), i, p));
            return;
        }
        for half in halves {
            let marks = (self.emitters.len(), self.pairs.len(), self.lists.len());
            for i in pairs.clone() {
                let Pair { emitter, occluders } = self.pairs[i].clone();
                self.narrow(emitter, occluders, half);
            }
            let own = marks.1..self.pairs.len();
            self.light_cluster(picture, half, own, patch);
            self.emitters.truncate(marks.0);
            self.pairs.truncate(marks.1);
            self.lists.truncate(marks.2);
        }
    }

    /// Irradiance at a receiver from some pairs: at its point, or the mean over its outline in the
    /// image where one of them is near.
    fn on(
        &mut self,
        picture: Option<&Picture<'_>>,
        pairs: Range<usize>,
        receiver: usize,
        point: Vec3,
    ) -> f64 {
        let Some(picture) = picture else {
            return self.at(pairs, point);
        };
        let far = |pair: &Pair| self.emitters[pair.emitter].distance(point);
        let nearest = self.pairs[pairs.clone()].iter().map(far);
        let nearest = nearest.fold(f64::INFINITY, f64::min) / picture.footprint(point);
        let depth = NEAR.iter().filter(|n| nearest < self.near * **n).count() as u32;
        match depth.checked_sub(1) {
            None => self.at(pairs, point),
            Some(depth) => picture.mean(receiver, depth, |p| self.at(pairs.clone(), p)),
        }
    }

    /// Irradiance at a point from some pairs.
    fn at(&mut self, pairs: Range<usize>, point: Vec3) -> f64 {
        pairs.map(|pair| self.from(pair, point)).sum()
    }

    /// Irradiance at a point from one pair.
    fn from(&mut self, pair: usize, point: Vec3) -> f64 {
        let surfaces = self.setting.surfaces;
        let Pair { emitter, occluders } = &self.pairs[pair];
        let emitter = &self.emitters[*emitter];
        let light_polygon = &emitter.light_polygon;
        if !light_polygon.faces(point) {
            return 0.0;
        }
        let list = &self.lists[occluders.clone()];
        if list.is_empty() {
            return self
                .integrator
                .unoccluded(point, self.normal, light_polygon);
        }
        let occluders = list.iter().map(|&i| &surfaces.pieces[i as usize]);
        let touching = surfaces.touching();
        self.integrator
            .occluded(point, self.normal, light_polygon, occluders, touching)
    }
}

/// True when a cluster is behind the emitter.
fn is_behind(emitter: &Emitter, cluster: &Cluster) -> bool {
    !cluster
        .corners
        .iter()
        .any(|c| emitter.light_polygon.faces(*c))
}
