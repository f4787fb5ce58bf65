//! Direct light: one number for each receiving point and light, at unit radiance or intensity.
//!
//! Receivers are sorted facet by facet into trees of small flat clusters. Each cluster is tested
//! against the shaft between it and the emitter: nothing in the shaft leaves the closed form, one
//! occluder across all of it leaves nothing, and only what is mixed descends, with a shorter list,
//! to exact clipping. Where some error is allowed, a small cluster whose few samples lie near a plane
//! takes what is fitted to them. Invariant: results depend on the points alone, not on threads,
//! batches or settings. This room knows nothing of colour.

#![allow(
    clippy::indexing_slicing,
    reason = "ranges of receivers and pieces are made by this module and the surfaces"
)]

use crate::geometry::Vec3;
use crate::scene::{Light, Rig};
use crate::transport::TransportError;
use crate::transport::beam::Beam;
pub use crate::transport::cluster::frame;
use crate::transport::cluster::{Cluster, PATCH, Receivers, SAMPLES};
use crate::transport::eye::Fragments;
use crate::transport::fit::Fit;
use crate::transport::lambert::{Clipper, halved};
use crate::transport::shadow::{Canvas, Lit, Meeting, Shadows, Stencil};
use crate::transport::surface::{Piece, Surfaces};
use crate::transport::visibility::{Hierarchy, Shaft, blocks};
use crate::work::{Cancelled, Work};
use rayon::prelude::*;
use std::borrow::Cow;

/// The same where the light is partly shadowed.
const SHADED_PATCH: usize = 32;
/// Occluders that are cut one by one without dividing the emitter first.
const FEW: usize = 48;
/// How often an emitter is halved at most.
const HALVINGS: usize = 4;

/// A light made ready for direct illumination.
#[derive(Clone, Debug)]
pub enum Luminaire {
    /// Pieces (indices) that emit.
    Panel(Vec<usize>),
    /// A point source; of a projection the even light that its image is cut out of.
    Spot(Beam),
}

/// Makes the rig's lights ready.
///
/// # Errors
/// [`TransportError::Scene`] for a spot whose angles or aim are impossible, and for an image, which
/// shines on nothing ([`crate::transport::layered`] adds it to the picture).
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
            Light::Image(_) => Err(TransportError::Scene(format!(
                "light {i} is an image: it cannot shine on the stage"
            ))),
            Light::Measured(measured) => Beam::measured(measured)
                .map(Luminaire::Spot)
                .ok_or_else(|| unhung(i)),
            Light::Projection(projection) => Beam::even(projection)
                .map(Luminaire::Spot)
                .ok_or_else(|| unhung(i)),
        })
        .collect()
}

fn unhung(light: usize) -> TransportError {
    let needs = "needs a place, another one to aim at, and an angle below 180 degrees";
    TransportError::Scene(format!("light {light} {needs}"))
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
/// intensity of one light. Given the fragments that the receivers are, a spot's is the mean over
/// each fragment's outline; else, and for panels, that at the point. `allowed` is how far reflectance times irradiance may be, at the
/// samples, from what is interpolated through them; 0 evaluates every receiver.
///
/// # Errors
/// On cancel.
pub fn irradiance(
    setting: Setting<'_>,
    light: &Luminaire,
    receivers: &Receivers,
    fragments: Option<&Fragments>,
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
                receivers,
                fragments,
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
                shadows: Shadows::default(),
                stencil: Stencil::default(),
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
    receivers: &'a Receivers,
    fragments: Option<&'a Fragments>,
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
    shadows: Shadows,
    stencil: Stencil,
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
            Luminaire::Spot(beam) => {
                let middle = (cluster.corners[0] + cluster.corners[2]) * 0.5;
                if !beam.misses(middle, (cluster.corners[0] - middle).length()) {
                    self.begin(&Source::Point(beam, [beam.position]), cluster);
                }
            }
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
        match (source, self.fragments) {
            (Source::Point(beam, _), Some(fragments)) => {
                let canvas = self.canvas(fragments, cluster);
                self.shadows.clear();
                let cast = |&i: &usize| {
                    let piece = &self.setting.surfaces.pieces[i];
                    self.shadows.cast(&canvas, beam.position, piece, touching)
                };
                let shadows: Vec<usize> = list.iter().filter_map(cast).collect();
                self.spot(source, beam, &canvas, cluster, &shadows);
            }
            _ => self.settle(source, cluster, &shaft, &list, HALVINGS),
        }
    }

    fn canvas<'b>(&self, fragments: &'b Fragments, cluster: &Cluster) -> Canvas<'b> {
        let camera = &fragments.camera;
        Canvas {
            camera,
            normal: self.normal,
            height: self.normal.dot(cluster.corners[0] - camera.origin),
        }
    }

    /// A spot's light on the outlines of a picture's fragments, given the shadows (numbers) that
    /// may fall on the cluster.
    fn spot(
        &mut self,
        source: &Source<'_>,
        beam: &Beam,
        canvas: &Canvas<'_>,
        cluster: &Cluster,
        shadows: &[usize],
    ) {
        let mut kept = Vec::with_capacity(shadows.len());
        for &shadow in shadows {
            match self.shadows.meets(shadow, &cluster.picture) {
                Meeting::Misses => {}
                Meeting::Covers => return,
                Meeting::Crosses => kept.push(shadow),
            }
        }
        let clear = kept.is_empty();
        if clear && self.interpolated(source, cluster, &[]) {
            return;
        }
        if clear && (self.allowed <= 0.0 || cluster.halves.is_none()) {
            for i in cluster.range.clone() {
                self.sums[i - self.start] += beam.irradiance(self.points[i], self.normal);
            }
        } else if let Some(halves) = cluster.halves.as_deref() {
            for half in halves {
                self.spot(source, beam, canvas, half, &kept);
            }
        } else {
            for i in cluster.range.clone() {
                self.sums[i - self.start] += self.cut(beam, canvas, i, &kept);
            }
        }
    }

    /// Mean irradiance of a spot on one fragment's outline.
    fn cut(&mut self, beam: &Beam, canvas: &Canvas<'_>, i: usize, shadows: &[usize]) -> f64 {
        let open = beam.irradiance(self.points[i], self.normal);
        let Some(fragments) = self.fragments.filter(|_| open > 0.0) else {
            return open;
        };
        self.stencil.clear();
        fragments.outline(self.receivers.origin[i], |part| self.stencil.add(part));
        match self.stencil.shade(&self.shadows, shadows) {
            Lit::Wholly => open,
            Lit::Not => 0.0,
            Lit::Partly => {
                let at = |place| beam.irradiance(canvas.point(place), self.normal);
                let lit: f64 = self.stencil.lit().map(|(a, c)| a * at(c)).sum();
                lit / self.stencil.whole
            }
        }
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
        let clear = list.is_empty();
        if clear
            && self.allowed > 0.0
            && let Some(halves) = cluster.halves.as_deref()
        {
            for half in halves {
                self.settle(source, half, shaft, list, halvings);
            }
            return;
        }
        let Some(halves) = cluster.halves.as_deref().filter(|_| !clear) else {
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

    /// Evaluates a few points of a small cluster; if a plane meets them as well as allowed, what is
    /// fitted to them serves for all. Not across the sharp shadows of a point.
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
        let Some(fit) = Fit::through(&places, &values).filter(|f| f.farthest <= self.allowed)
        else {
            return false;
        };
        for i in cluster.range.clone() {
            let value = fit.at(self.place(cluster, i)).max(0.0);
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
