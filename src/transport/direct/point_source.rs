//! Direct light of a point source: exact shadows on the fragments of an image, or at points.
//!
//! A cluster's halves inherit the shadows that may fall on them; outlines of fragments are clipped
//! by the shadows that cross them. Nothing is interpolated across the edge of a shadow.

#![allow(
    clippy::indexing_slicing,
    reason = "receivers are named by their clusters, pieces by the hierarchy"
)]

use crate::direct::beam::Beam;
use crate::direct::cluster::{Cluster, PATCH, Receivers};
use crate::direct::irradiance_patch::IrradiancePatch;
use crate::direct::near_field::{self, Picture, is_near};
use crate::direct::shadow::{Lit, Meeting, Shadows, shade};
use crate::surfaces::clipper::{PlanePoint, PolygonClipper, Rectangle, measured};
use crate::surfaces::fragment::Fragments;
use crate::surfaces::hierarchy::SceneGeometry;
use crate::surfaces::hierarchy::{Shaft, blocks};
use footlight_show::geometry::Vec3;

/// Working memory for lighting one chunk of a facet by a point source.
pub struct PointSourceIntegrator<'a> {
    setting: SceneGeometry<'a>,
    beam: &'a Beam,
    normal: Vec3,
    shadows: Shadows,
    clipper: PolygonClipper,
}

impl<'a> PointSourceIntegrator<'a> {
    /// For a facet of unit `normal`.
    pub fn new(
        setting: SceneGeometry<'a>,
        beam: &'a Beam,
        normal: Vec3,
    ) -> PointSourceIntegrator<'a> {
        PointSourceIntegrator {
            setting,
            beam,
            normal,
            shadows: Shadows::default(),
            clipper: PolygonClipper::default(),
        }
    }

    /// Adds the source's light to a chunk: the mean over each outline if the receivers are
    /// fragments of an image, else the value at each point.
    pub fn shine(
        &mut self,
        receivers: &Receivers,
        fragments: Option<&Fragments>,
        chunk: &Cluster,
        patch: &mut IrradiancePatch<'_>,
    ) {
        let middle = (chunk.corners[0] + chunk.corners[2]) * 0.5;
        let radius = (chunk.corners[0] - middle).length();
        let height = self.normal.dot(self.beam.position - middle);
        if height <= self.setting.surfaces.touching() || self.beam.misses(middle, radius) {
            return;
        }
        let SceneGeometry {
            surfaces,
            hierarchy,
        } = self.setting;
        let position = [self.beam.position];
        let mut list = Vec::new();
        let shaft = self.shaft(&position, chunk);
        hierarchy.occluders(surfaces, &shaft, &mut list);
        let Some(fragments) = fragments else {
            self.points(chunk, &shaft, &list, patch);
            return;
        };
        let picture = Picture::new(receivers, fragments, self.normal, chunk);
        self.shadows.clear();
        let cast = |&i: &usize| {
            let piece = &surfaces.pieces[i];
            self.shadows.cast(
                &picture.canvas,
                self.beam.position,
                piece,
                surfaces.touching(),
            )
        };
        let shadows: Vec<usize> = list.iter().filter_map(cast).collect();
        self.outlines(&picture, chunk, &shadows, patch);
    }

    fn shaft<'b>(&self, position: &'b [Vec3; 1], cluster: &'b Cluster) -> Shaft<'b> {
        let touching = self.setting.surfaces.touching();
        Shaft::new(&cluster.corners, self.normal, position, None, touching)
    }

    /// Light at points, given the possible occluders of a cluster.
    fn points(
        &mut self,
        cluster: &Cluster,
        shaft: &Shaft<'_>,
        list: &[usize],
        patch: &mut IrradiancePatch<'_>,
    ) {
        let surfaces = self.setting.surfaces;
        let touching = surfaces.touching();
        let dark = |i: &usize| shaft.is_blocked_by(&surfaces.pieces[*i], touching);
        if list.iter().any(dark) {
            return;
        }
        let Some(halves) = cluster.halves.as_deref().filter(|_| !list.is_empty()) else {
            patch.evaluate(cluster, |_, p| self.at(p, list));
            return;
        };
        let position = [self.beam.position];
        for half in halves {
            let shaft = self.shaft(&position, half);
            let kept = list.iter().copied();
            let kept: Vec<usize> = kept
                .filter(|&i| !shaft.misses(&surfaces.pieces[i]))
                .collect();
            self.points(half, &shaft, &kept, patch);
        }
    }

    fn at(&self, point: Vec3, list: &[usize]) -> f64 {
        let surfaces = self.setting.surfaces;
        let unoccluded = self.beam.irradiance(point, self.normal);
        let before = |&i: &usize| {
            let piece = &surfaces.pieces[i];
            blocks(piece, point, self.beam.position, surfaces.touching())
        };
        if unoccluded > 0.0 && list.iter().any(before) {
            0.0
        } else {
            unoccluded
        }
    }

    /// Light on the outlines of fragments, given the indices of the shadows that may fall on the
    /// cluster.
    fn outlines(
        &mut self,
        picture: &Picture<'_>,
        cluster: &Cluster,
        shadows: &[usize],
        patch: &mut IrradiancePatch<'_>,
    ) {
        let mut kept = Vec::with_capacity(shadows.len());
        for &shadow in shadows {
            match self.shadows.meets(shadow, &cluster.picture) {
                Meeting::Misses => {}
                Meeting::Covers => return,
                Meeting::Crosses => kept.push(shadow),
            }
        }
        let unoccluded = |i, p| self.unoccluded(picture, i, p);
        let clear = kept.is_empty();
        if clear && patch.interpolated(cluster, PATCH, unoccluded) {
            return;
        }
        if clear && (patch.allowed <= 0.0 || cluster.halves.is_none()) {
            patch.evaluate(cluster, unoccluded);
        } else if let Some(halves) = cluster.halves.as_deref() {
            for half in halves {
                self.outlines(picture, half, &kept, patch);
            }
        } else {
            patch.evaluate(cluster, |i, p| self.shadowed(picture, i, p, &kept));
        }
    }

    /// Mean unoccluded irradiance on a fragment's outline: the value at its point, unless the
    /// source is near.
    fn unoccluded(&self, picture: &Picture<'_>, i: usize, point: Vec3) -> f64 {
        if !is_near(self.beam, picture, point) {
            return self.beam.irradiance(point, self.normal);
        }
        let (mut sum, mut whole) = (0.0, 0.0);
        picture.outline(i, |part| {
            let (light, area) = near_field::light(self.beam, &picture.canvas, part);
            sum += light;
            whole += area;
        });
        if whole > 0.0 { sum / whole } else { 0.0 }
    }

    /// Mean irradiance over a fragment's outline, zero within the shadows.
    fn shadowed(&mut self, picture: &Picture<'_>, i: usize, point: Vec3, shadows: &[usize]) -> f64 {
        let unoccluded = self.unoccluded(picture, i, point);
        if unoccluded <= 0.0 {
            return unoccluded;
        }
        self.clipper.clear();
        let (mut whole, mut bounds) = (0.0, Rectangle::EMPTY);
        picture.outline(i, |part| {
            self.clipper.add(part);
            whole += measured(part).0;
            bounds = part.iter().fold(bounds, |b, &at| b.with(Rectangle::at(at)));
        });
        match shade(&mut self.clipper, &bounds, &self.shadows, shadows) {
            Lit::Wholly => unoccluded,
            Lit::Not => 0.0,
            Lit::Partly => {
                let near = is_near(self.beam, picture, point);
                let light = |part: &[PlanePoint]| {
                    if near {
                        return near_field::light(self.beam, &picture.canvas, part).0;
                    }
                    let (area, centre) = measured(part);
                    let centre = picture.canvas.point(centre);
                    area * self.beam.irradiance(centre, self.normal)
                };
                let lit: f64 = self.clipper.parts().map(light).sum();
                lit / whole
            }
        }
    }
}
