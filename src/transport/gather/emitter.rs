//! Direct light at one point: unoccluded light, and one shadow ray.
//!
//! Each light has unit radiance or intensity; colours and levels are applied later. This module
//! does not depend on images.

use crate::direct::PreparedLight;
use crate::direct::beam::Beam;
use crate::direct::lambert::closed_form;
use crate::direct::projector::Projector;
use crate::gather::globes::{Face, Globes, TowardsGlobe};
use crate::gather::lamp_patches::LampPatches;
use crate::gather::ray_scene::{MOST_LAYERS, RayScene, Receiver, SurfacePoint};
use crate::gather::sampling::{cosine_direction, shifted};
use crate::gather::triangle::{Part, Triangle, area_of, point_of};
use crate::surfaces::lobe::Lobe;
use crate::surfaces::surface::Surfaces;
use arrayvec::ArrayVec;
use footlight_show::geometry::Vec3;
use std::f64::consts::PI;

/// Most triangles of a panel whose unoccluded light is computed in closed form. A larger panel is
/// sampled by its area and by the receiver's cosine, combined by the balance heuristic (Veach and
/// Guibas 1995), so that no sample exceeds that of a full sky, however near the panel; globes are
/// sampled by their cones ([`globes`](super::globes)).
const CLOSED_FORM: usize = 16;

/// A light to be sampled.
pub enum Emitter<'a> {
    Area(AreaLight),
    /// A point source and its projected image, if any.
    Point(&'a Beam, Option<&'a Projector>),
    /// Places lit by a point source: its first bounce.
    Patches(&'a LampPatches),
}

/// Most separately sampled parts of a panel.
const PARTS: usize = 16;

/// Triangles of a panel or of a part of it.
pub struct AreaLight {
    material: usize,
    /// Their facets, ascending.
    facets: Vec<usize>,
    triangles: Vec<Triangle>,
    /// Cumulative areas of the triangles, m².
    areas: Vec<f64>,
    /// Centre by area, and the greatest distance from it, metres.
    ball: Option<(Vec3, f64)>,
    /// The globes of which a panel of many triangles consists.
    globes: Option<Globes>,
}

/// Direct light at a point from one sample of a light.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Unoccluded irradiance in closed form; for a panel of many triangles, of which only the
    /// sampled light is known, the visible irradiance.
    pub unoccluded: f64,
    /// Unoccluded irradiance of the sample, whose mean is that of `unoccluded`.
    pub sampled: f64,
    /// Visible irradiance of the sample.
    pub visible: f64,
    /// The sampled point of a panel.
    pub end: Option<PanelPoint>,
}

/// A point of a panel, seen from a receiver.
#[derive(Clone, Copy, Debug)]
pub struct PanelPoint {
    /// Unit direction.
    way: Vec3,
    /// Probability density of the direction, 1/sr.
    density: f64,
    /// Area from which points are chosen, m²; `None` when directions to globes are.
    area: Option<f64>,
    /// Visible share of its light.
    passed: f64,
}

/// A ray sampled from the lobe of a glossy place.
pub struct LobeRay {
    pub place: SurfacePoint,
    pub way: Vec3,
    pub weight: f64,
    /// Visible layers along the ray, with their shares.
    pub ends: ArrayVec<(SurfacePoint, f64), MOST_LAYERS>,
}

/// Sample sums of one light at several points, in single precision to save memory, as every pixel
/// has one.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleSum {
    unoccluded: f32,
    sampled: f32,
    visible: f32,
}

impl SampleSum {
    /// Adds a weighted sample.
    pub fn add(&mut self, sample: Sample, weight: f32) {
        self.unoccluded += weight * sample.unoccluded as f32;
        self.sampled += weight * sample.sampled as f32;
        self.visible += weight * sample.visible as f32;
    }

    /// Sum of irradiance: the closed form times the visible share of the samples.
    pub fn irradiance(&self) -> f32 {
        if self.sampled > 0.0 {
            self.unoccluded * (self.visible / self.sampled)
        } else {
            0.0
        }
    }
}

impl<'a> Emitter<'a> {
    /// Emitter of a light of the rig.
    pub fn new(
        surfaces: &Surfaces,
        light: &'a PreparedLight,
        projector: Option<&'a Projector>,
    ) -> Emitter<'a> {
        match light {
            PreparedLight::Panel(pieces) => Emitter::Area(AreaLight::new(surfaces, pieces)),
            PreparedLight::Spot(beam) => Emitter::Point(beam, projector),
        }
    }

    /// Like [`Emitter::new`], split into compact parts if the light is a panel of many facets.
    pub fn in_parts(
        surfaces: &Surfaces,
        light: &'a PreparedLight,
        projector: Option<&'a Projector>,
    ) -> Vec<Emitter<'a>> {
        let PreparedLight::Panel(pieces) = light else {
            return vec![Emitter::new(surfaces, light, projector)];
        };
        let facet = |piece: &usize| surfaces.pieces[*piece].facet;
        let of_facets: Vec<&[usize]> = pieces.chunk_by(|a, b| facet(a) == facet(b)).collect();
        let together = of_facets.len().div_ceil(PARTS).max(1);
        let parts = of_facets.chunks(together).map(<[_]>::concat);
        parts
            .map(|pieces| Emitter::Area(AreaLight::new(surfaces, &pieces)))
            .collect()
    }

    /// Reflectance of a glossy place for this light, from that for uniform light: to an eye that
    /// sees the place, including the highlight of a point source, or to all sides.
    pub fn reflectance(
        &self,
        lobe: Option<&Lobe>,
        (at, eye): (Receiver, Option<Vec3>),
        reflectance: [f64; 3],
    ) -> [f64; 3] {
        let Some((lobe, middle)) = lobe.zip(self.middle(at.point)) else {
            return reflectance;
        };
        let way = |to: Vec3| (to - at.point).normalized();
        let light = way(middle);
        let Some(eye) = eye.map(way) else {
            let bounced = lobe.bounced(at.normal.dot(light));
            return reflectance.map(|r| r * bounced);
        };
        // Rays find all emitters except points.
        let is_point = matches!(self, Emitter::Point(..));
        lobe.seen_as(reflectance, at.normal, [eye, light], is_point)
    }

    /// Radiance of a panel reflected by the wide lobe of a place, from the sampled point of the panel
    /// and a ray of the lobe, combined by the balance heuristic.
    pub fn in_gloss(
        &self,
        scene: RayScene<'_>,
        (lobe, normal, eye): (&Lobe, Vec3, Vec3),
        end: &PanelPoint,
        ray: &LobeRay,
    ) -> f64 {
        let Emitter::Area(area) = self else {
            return 0.0;
        };
        let light = lobe.value(normal, eye, end.way) * normal.dot(end.way) * end.passed;
        let mut sum = light / (end.density + lobe.density(normal, eye, end.way));
        let at = (ray.place.point, normal);
        let by_globes = |end: &SurfacePoint| area.globes.as_ref()?.density(at, end.facet);
        let density = lobe.density(normal, eye, ray.way);
        for (place, share) in &ray.ends {
            if area.facets.binary_search(&(place.facet as usize)).is_err() {
                continue;
            }
            let facet = &scene.surfaces.facets[place.facet as usize];
            let way = place.point - ray.place.point;
            let length = way.length();
            let other = match end.area {
                Some(area) => length.powi(3) / (area * -way.dot(facet.normal)),
                None => by_globes(place).unwrap_or(0.0),
            };
            let passed = share * scene.clearness(length);
            sum += passed * ray.weight * density / (density + other);
        }
        sum
    }

    /// Position of the emitter seen from a point; `None` when its light comes from many directions.
    pub fn middle(&self, from: Vec3) -> Option<Vec3> {
        match self {
            Emitter::Point(beam, _) => Some(beam.position),
            Emitter::Area(AreaLight { ball, .. }) => {
                let (middle, radius) = (*ball)?;
                ((middle - from).length() > radius).then_some(middle)
            }
            Emitter::Patches(_) => None,
        }
    }

    /// True for a panel.
    pub fn is_panel(&self) -> bool {
        matches!(self, Emitter::Area(_))
    }

    /// True when this is the material of the emitting panel.
    pub fn is_of(&self, material: usize) -> bool {
        matches!(self, Emitter::Area(area) if area.material == material)
    }

    /// Colour factor of the sample selected by random numbers.
    pub fn colour(&self, random: [f64; 2]) -> [f32; 3] {
        match self {
            Emitter::Patches(lamp) => lamp.colour(random[0]),
            Emitter::Area(_) | Emitter::Point(..) => [1.0; 3],
        }
    }

    /// Approximate unoccluded irradiance at a point; above zero wherever light may arrive.
    pub fn expected(&self, at: Receiver) -> f64 {
        match self {
            Emitter::Point(beam, _) => beam.irradiance(at.point, at.normal),
            Emitter::Patches(lamp) => lamp.expected(at.point),
            Emitter::Area(area) => {
                let Some((whole, triangle)) = area.areas.last().zip(area.triangles.first()) else {
                    return 0.0;
                };
                let way = triangle.corners[0] - at.point;
                whole / (way.dot(way) + whole)
            }
        }
    }

    /// Irradiance at a point from one sample that is bounded, however near the panel.
    pub fn bounded_sample(
        &self,
        scene: RayScene<'_>,
        at: Receiver,
        footprint: impl FnOnce() -> [Vec3; 2],
        random: [f64; 2],
    ) -> f64 {
        let sample = match self {
            Emitter::Area(area) if area.globes.is_some() => area.sample(scene, at, random),
            Emitter::Area(area) => area.areas.last().map_or(Sample::default(), |whole| {
                area.by_both(scene, (at.point, at.normal), *whole, random)
            }),
            Emitter::Point(..) | Emitter::Patches(_) => self.sample(scene, at, footprint, random),
        };
        sample.visible
    }

    /// One sample of the light at a point of a surface; `footprint` returns the parallelogram over
    /// which a projected image is averaged.
    pub fn sample(
        &self,
        scene: RayScene<'_>,
        at: Receiver,
        footprint: impl FnOnce() -> [Vec3; 2],
        random: [f64; 2],
    ) -> Sample {
        match self {
            Emitter::Area(area) => area.sample(scene, at, random),
            Emitter::Patches(lamp) => {
                let light = lamp.irradiance(scene, at, random[0]);
                Sample {
                    unoccluded: light,
                    sampled: light,
                    visible: light,
                    end: None,
                }
            }
            Emitter::Point(beam, projector) => {
                let Receiver { point, normal, .. } = at;
                let mut light = beam.irradiance(point, normal);
                if light > 0.0
                    && let Some(projector) = projector
                {
                    light *= projector.share(point, footprint());
                }
                let from = point + normal * scene.offset;
                let visible = if light > 0.0 {
                    light * scene.transmittance(from, beam.position - from)
                } else {
                    0.0
                };
                Sample {
                    unoccluded: light,
                    sampled: light,
                    visible,
                    end: None,
                }
            }
        }
    }
}

impl AreaLight {
    pub(super) fn new(surfaces: &Surfaces, pieces: &[usize]) -> AreaLight {
        let material = |&p: &usize| surfaces.facets[surfaces.pieces[p].facet].material;
        let mut facets: Vec<usize> = pieces.iter().map(|&p| surfaces.pieces[p].facet).collect();
        facets.sort_unstable();
        let mut out = AreaLight {
            // A panel without pieces has no visible material.
            material: pieces.first().map_or(usize::MAX, material),
            facets,
            triangles: Vec::new(),
            areas: Vec::new(),
            ball: None,
            globes: None,
        };
        let (mut area, mut weighted) = (0.0, Vec3::ZERO);
        for piece in pieces.iter().map(|&p| &surfaces.pieces[p]) {
            let first = piece.vertices[0];
            for pair in piece.vertices[1..].windows(2) {
                let corners = [first, pair[0], pair[1]];
                let (own, [a, b, c]) = (area_of(corners), corners);
                weighted += (a + b + c) * (own / 3.0);
                area += own;
                out.areas.push(area);
                out.triangles.push(Triangle {
                    corners,
                    normal: piece.normal,
                });
            }
        }
        let middle = weighted / area;
        let corners = out.triangles.iter().flat_map(|triangle| triangle.corners);
        let radius = corners.map(|corner| (corner - middle).length());
        let radius = radius.fold(0.0, f64::max);
        out.ball = (area > 0.0).then_some((middle, radius));
        if out.triangles.len() > CLOSED_FORM {
            let face = |&piece: &usize| {
                let piece = &surfaces.pieces[piece];
                Face::new(piece.facet, &piece.vertices)
            };
            out.globes = Globes::of(&pieces.iter().map(face).collect::<Vec<_>>());
        }
        out
    }

    fn sample(&self, scene: RayScene<'_>, at: Receiver, [u, v]: [f64; 2]) -> Sample {
        let Some(&area) = self.areas.last() else {
            return Sample::default();
        };
        if let Some(globes) = &self.globes
            && let Some(towards) = globes.direction((at.point, at.normal), [u, v])
        {
            return by_cone(scene, at, globes, &towards);
        }
        if self.triangles.len() > CLOSED_FORM {
            return self.by_both(scene, (at.point, at.normal), area, [u, v]);
        }
        let mut out = Sample::default();
        let mut parts = ArrayVec::<(&Triangle, Part, f64), CLOSED_FORM>::new();
        let mut area = 0.0;
        for triangle in &self.triangles {
            let part = triangle.part_above(at.point, [at.facet, at.normal]);
            let own = part.area();
            if own > 0.0 {
                out.unoccluded += closed_form(part.corners(), at.normal);
                area += own;
                parts.push((triangle, part, own));
            }
        }
        if out.unoccluded <= 0.0 {
            return out;
        }
        // The part that contains this share of the area; the remainder of `u` places the point.
        let mut left = u * area;
        for (triangle, part, own) in &parts {
            if left > *own {
                left -= own;
                continue;
            }
            let way = part.at(left, v);
            let square = way.dot(way);
            let (cosine, away) = (way.dot(at.normal), -way.dot(triangle.normal));
            if cosine > 0.0 && away > 0.0 && square > 0.0 {
                out.sampled = area * cosine * away / (square * square);
                let end = (at.point + way, triangle.normal);
                let passed = scene.visibility((at.point, at.normal), end);
                out.visible = out.sampled * passed;
                out.end = Some(PanelPoint {
                    way: way / square.sqrt(),
                    density: square * square.sqrt() / (area * away),
                    area: Some(area),
                    passed,
                });
            }
            return out;
        }
        out
    }

    /// Combines a sample of the area and one of the cosine.
    fn by_both(
        &self,
        scene: RayScene<'_>,
        (point, normal): (Vec3, Vec3),
        area: f64,
        [u, v]: [f64; 2],
    ) -> Sample {
        let mut sum = 0.0;
        // Densities over the solid angle.
        let by_area = |way: Vec3, away: f64| {
            let square = way.dot(way);
            square * square.sqrt() / (area * away)
        };
        let (triangle, end) = self.place(area, [u, v]);
        let way = end - point;
        let length = way.length();
        let (cosine, away) = (way.dot(normal) / length, -way.dot(triangle.normal));
        let mut sampled = PanelPoint {
            way: way / length,
            density: 1.0,
            area: Some(area),
            passed: 0.0,
        };
        if cosine > 0.0 && away > 0.0 {
            let visible = scene.visibility((point, normal), (end, triangle.normal));
            sampled.density = by_area(way, away);
            sampled.passed = visible;
            sum += visible * cosine / (by_area(way, away) + cosine / PI);
        }
        let way = cosine_direction(normal, shifted([u, v]));
        let from = point + normal * scene.offset;
        for (place, visible) in scene.layers(from, way) {
            if self.facets.binary_search(&(place.facet as usize)).is_ok() {
                let facet = &scene.surfaces.facets[place.facet as usize];
                let distance = (place.point - from).length();
                let (cosine, away) = (way.dot(normal), -way.dot(facet.normal));
                let density = by_area(way * distance, away * distance);
                sum += visible * scene.clearness(distance) * cosine / (density + cosine / PI);
            }
        }
        Sample {
            unoccluded: sum,
            sampled: sum,
            visible: sum,
            end: Some(sampled),
        }
    }

    /// A point of the panel, uniform over its area, with unit normal and the panel's area, m².
    pub fn point(&self, random: [f64; 2]) -> Option<(Vec3, Vec3, f64)> {
        let area = *self.areas.last()?;
        let (triangle, point) = self.place(area, random);
        Some((point, triangle.normal, area))
    }

    /// A point of the panel, uniform over its area.
    fn place(&self, area: f64, [u, v]: [f64; 2]) -> (&Triangle, Vec3) {
        // The triangle that contains this share of the area; the remainder of `u` places the point.
        let wanted = u * area;
        let at = self.areas.partition_point(|sum| *sum <= wanted);
        let at = at.min(self.triangles.len() - 1);
        let before = if at == 0 { 0.0 } else { self.areas[at - 1] };
        let own = (wanted - before) / (self.areas[at] - before);
        let triangle = &self.triangles[at];
        (triangle, point_of(triangle.corners, own, v))
    }
}

/// The light of a globe in a direction of its cone.
fn by_cone(scene: RayScene<'_>, at: Receiver, globes: &Globes, towards: &TowardsGlobe) -> Sample {
    let from = at.point + at.facet * scene.offset;
    let cosine = towards.way.dot(at.normal).max(0.0);
    let passed = if cosine > 0.0 && towards.way.dot(at.facet) > 0.0 {
        globes.visible(scene, from, towards)
    } else {
        0.0
    };
    let light = passed * cosine / towards.density;
    Sample {
        unoccluded: light,
        sampled: light,
        visible: light,
        end: Some(PanelPoint {
            way: towards.way,
            density: towards.density,
            area: None,
            passed,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::bvh::Bvh;
    use footlight_host::work::Work;
    use footlight_show::geometry::vec3;

    /// An unoccluded unit square a metre above a floor: closed form and samples.
    #[test]
    fn samples_meet_the_closed_form() {
        let above = vec![
            vec3(0.0, 0.0, 1.0),
            vec3(0.0, 1.0, 1.0),
            vec3(1.0, 1.0, 1.0),
            vec3(1.0, 0.0, 1.0),
        ];
        let surfaces = Surfaces::grey(vec![above]);
        let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
        let light = AreaLight::new(&surfaces, &[0]);
        let scene = RayScene {
            surfaces: &surfaces,
            bvh: &bvh,
            offset: 1e-6,
        };
        let up = vec3(0.0, 0.0, 1.0);
        // Below a corner: half the sum of two arctangents of rectangles.
        let exact = 1.0 / 2.0_f64.sqrt() * (1.0 / 2.0_f64.sqrt()).atan();
        let at = Receiver {
            point: Vec3::ZERO,
            normal: up,
            facet: up,
        };
        let mut sum = 0.0;
        for i in 0..4096 {
            let random = crate::gather::sampling::point(i, 3);
            let sample = light.sample(scene, at, random);
            assert!((sample.unoccluded - exact).abs() < 1e-12, "{sample:?}");
            assert_eq!(sample.visible, sample.sampled);
            sum += sample.sampled;
        }
        assert!((sum / 4096.0 / exact - 1.0).abs() < 1e-3);
    }

    /// A vertical facet under the centre of the square with a shading normal that leans back: half
    /// of the square is below the facet's plane, and every sample lies in the other half.
    #[test]
    fn light_below_the_facet_is_neither_counted_nor_sampled() {
        let square = |from: f64| {
            vec![
                vec3(from, -0.5, 1.0),
                vec3(from, 0.5, 1.0),
                vec3(0.5, 0.5, 1.0),
                vec3(0.5, -0.5, 1.0),
            ]
        };
        let at = Receiver {
            point: Vec3::ZERO,
            normal: vec3(0.6, 0.0, 0.8),
            facet: vec3(1.0, 0.0, 0.0),
        };
        let found = [-0.5, 0.0].map(|from| {
            let surfaces = Surfaces::grey(vec![square(from)]);
            let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
            let light = AreaLight::new(&surfaces, &[0]);
            let scene = RayScene {
                surfaces: &surfaces,
                bvh: &bvh,
                offset: 1e-6,
            };
            let samples = (0..4096).map(|i| {
                let random = crate::gather::sampling::point(i, 3);
                light.sample(scene, at, random)
            });
            let samples: Vec<Sample> = samples.collect();
            assert!(samples.iter().all(|s| s.visible > 0.0));
            let mean = samples.iter().map(|s| s.visible).sum::<f64>() / 4096.0;
            assert!((mean / samples[0].unoccluded - 1.0).abs() < 1e-3, "{mean}");
            samples[0].unoccluded
        });
        assert!((found[0] / found[1] - 1.0).abs() < 1e-12, "{found:?}");
    }
}
