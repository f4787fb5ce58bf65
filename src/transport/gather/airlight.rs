//! Airlight: light of the lamps that haze scatters once, towards the eye.
//!
//! The radiance along a ray of sight is the integral of `albedo extinction p(angle) I V
//! exp(-extinction (t + r)) / r²` over `t`, with `r` the distance from the lamp, `I` its intensity,
//! `V` the visibility, and `p` the phase function of Henyey and Greenstein (1941). With the angle
//! `u` at which the lamp sees the ray, `dt / r² = du / h`, where `h` is the ray's distance from the
//! lamp, so that the integrand has no pole (Kulla and Fajardo, *Importance Sampling Techniques for
//! Path Tracing in Participating Media*, 2012). The ray is first cut by the lamp's cone. Shadow
//! edges between nodes are found by bisection. The result is linear in the lamps and free of noise.
//! Multiple scattering is omitted. Both renderers use this module.

mod bundle;
mod gloss;
mod panel;
mod tile;

use self::bundle::Bundle;
use self::tile::{TILE, Tile, bilinear, places};
use crate::direct::beam::Beam;
use crate::direct::projector::Projector;
use crate::gather::emitter::{AreaLight, Emitter};
use crate::gather::ray_scene::{DARK, RayScene, SurfacePoint};
use crate::gather::sampling::point;
use crate::surfaces::camera::Camera;
use crate::surfaces::lobe::Lobe;
use arrayvec::ArrayVec;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use footlight_show::model::Haze;
use rayon::prelude::*;
use std::cell::LazyCell;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Most nodes along a ray.
const MOST_NODES: usize = 64;
/// Metres within which a ray that hits nothing may cross a light's cone.
const FAR: f64 = 1e6;
/// Points that represent a panel, each with its share of the nodes.
const PANEL_POINTS: u32 = 4;
/// Shares of a pixel up to this are rounding errors.
const LEAST_SHARE: f32 = 1e-3;
/// Rays that sample backs and the void in a pixel.
const DARK_RAYS: u32 = 16;
/// Cosine of half angles up to which a cone is a half-space.
const FLAT: f64 = 1e-7;
/// Spans that subtend a smaller angle from the lamp, radians, have half of the nodes.
const NARROW: f64 = 0.7;
/// Bisection steps for a shadow edge between two nodes.
const HALVINGS: u32 = 3;
/// Optical depth beyond which nothing is visible.
const DEEPEST: f64 = 12.0;
/// Least radius of a lamp, metres, so that rays through one meet no pole.
const LAMP_RADIUS: f64 = 0.01;
/// Pixels between those that show how bright a light is, along a side.
const SPARSE: usize = 16;
/// Differences that are not refined, relative to the root mean square of those pixels.
const FAINT: f32 = 0.015;
/// Least number of rays of sight across the width of a beam.
const RAYS_ACROSS: f64 = 12.0;
/// Most rays of sight along the side of a pixel.
const MOST_RAYS: usize = 19;
/// Seed of the points of panels.
const SEED: u32 = 0xa1;

/// A ray of sight from the eye to the first surface.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    pub eye: Vec3,
    /// Unit direction.
    pub way: Vec3,
    /// Metres; infinite for a ray that hits nothing.
    pub length: f64,
    /// Width of the ray at a distance of 1 m.
    pub spread: f64,
}

struct Pixel {
    /// Column and row in the image.
    place: [usize; 2],
    /// Rays of sight from the eye with their shares.
    direct: Vec<(f32, Sight)>,
    /// Their reflections with their shares.
    mirrored: Vec<(f32, Sight)>,
}

/// Haze in a scene.
#[derive(Clone, Copy)]
pub struct Airlight<'a> {
    pub scene: RayScene<'a>,
    pub haze: Haze,
    /// Nodes along a ray.
    pub nodes: usize,
}

impl Sight {
    /// A ray from the eye, as wide as a pixel.
    fn from_eye(camera: &Camera, way: Vec3, length: f64) -> Sight {
        Sight {
            eye: camera.origin,
            way: way.normalized(),
            length,
            spread: camera.step_x,
        }
    }
}

/// A point of a light.
struct Lamp<'a> {
    position: Vec3,
    kind: LampKind<'a>,
}

enum LampKind<'a> {
    Beam(&'a Beam, Option<&'a Projector>),
    /// Unit normal and area, m², of a part of a panel.
    Panel(Vec3, f64),
}

impl Airlight<'_> {
    /// Radiance that haze scatters to the eye in every pixel, row by row, for each light at unit
    /// strength. `ends` gives the parts of a pixel, their shares, and the ends of sight; glossy
    /// surfaces also reflect airlight.
    ///
    /// # Errors
    /// On cancel.
    pub fn picture<I: Iterator<Item = (f32, SurfacePoint)>>(
        &self,
        emitters: &[Emitter<'_>],
        (camera, [width, height]): (&Camera, [usize; 2]),
        ends: impl Fn(usize) -> I + Sync,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let lights = emitters.len();
        let view = (camera, [width, height]);
        let fields = self.fields(emitters, view, &ends, work)?;
        let faint = self.faint(emitters, view, &ends, work)?;
        let mut out = vec![0.0_f32; width * height * lights];
        let rows = out
            .par_chunks_mut((TILE * width * lights).max(1))
            .enumerate();
        rows.try_for_each(|(row, out)| {
            work.check()?;
            let top = row * TILE;
            let tall = TILE.min(height - top);
            for left in (0..width).step_by(TILE) {
                let size = [TILE.min(width - left), tall];
                let pixel = |place: [usize; 2]| {
                    let pixel = [left + place[0], top + place[1]];
                    self.pixel(camera, pixel, ends(pixel[1] * width + pixel[0]))
                };
                let pixels: Vec<Pixel> = places(size).map(pixel).collect();
                let bundles =
                    [true, false].map(|is_direct| Bundle::of(&pixels, is_direct, self.deepest()));
                let tile = LazyCell::new(|| Tile::of(pixels.iter().collect(), size));
                for (light, emitter) in emitters.iter().enumerate() {
                    let mut seen = bundles.iter().flatten();
                    if seen.all(|bundle| bundle.misses(emitter)) {
                        continue;
                    }
                    let values = match &fields[light] {
                        Some(field) => {
                            let of = |pixel| self.in_pixel(emitter, field, pixel);
                            pixels.iter().map(of).collect()
                        }
                        None => self.tile((emitter, faint[light]), camera, &tile),
                    };
                    for ([i, j], value) in places(size).zip(values) {
                        out[(j * width + left + i) * lights + light] = value;
                    }
                }
            }
            Ok(())
        })?;
        self.add_gloss(emitters, view, ends, &mut out, work)?;
        Ok(out)
    }

    /// Radiance of each light below which differences are not refined.
    ///
    /// # Errors
    /// On cancel.
    fn faint<I: Iterator<Item = (f32, SurfacePoint)>>(
        &self,
        emitters: &[Emitter<'_>],
        (camera, [width, height]): (&Camera, [usize; 2]),
        ends: impl Fn(usize) -> I + Sync,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let middles = |side: usize| (SPARSE / 2..side).step_by(SPARSE);
        let pixels = middles(height).flat_map(|y| middles(width).map(move |x| [x, y]));
        let pixels = pixels.map(|[x, y]| self.pixel(camera, [x, y], ends(y * width + x)));
        let pixels: Vec<Pixel> = pixels.collect();
        let of = |emitter: &Emitter<'_>| {
            if !matches!(emitter, Emitter::Point(..)) {
                return Ok(0.0);
            }
            let mut squares = 0.0;
            for pixel in &pixels {
                work.check()?;
                squares += self.sum(emitter, &pixel.direct).powi(2);
            }
            Ok(FAINT * (squares / pixels.len() as f32).sqrt())
        };
        emitters.par_iter().map(of).collect()
    }

    /// Radiance of a light along rays of sight, by their shares.
    fn sum(&self, emitter: &Emitter<'_>, sights: &[(f32, Sight)]) -> f32 {
        let of = |(share, sight): &(f32, Sight)| share * self.radiance(emitter, sight, 0.5) as f32;
        sights.iter().map(of).sum()
    }

    /// Rays along the side of a pixel: more than one where the pixel is not small relative to the
    /// width of the beam, as near the lamp.
    pub fn rays_along_side(&self, emitter: &Emitter<'_>, sight: &Sight) -> usize {
        let Emitter::Point(beam, _) = emitter else {
            return 1;
        };
        let to = beam.position - sight.eye;
        let nearest = sight.way.dot(to).clamp(0.0, sight.length);
        let distance = (to - sight.way * nearest).length();
        let (angle, needed) = (
            beam.reach().min(FRAC_PI_4),
            RAYS_ACROSS * sight.spread * nearest,
        );
        // Most rays end here: no angle is greater than its tangent.
        if needed <= 2.0 * distance * angle {
            return 1;
        }
        let side = (needed / (2.0 * distance * angle.tan())).ceil();
        (side as usize).clamp(1, MOST_RAYS)
    }

    /// A pixel with its rays of sight.
    fn pixel(
        &self,
        camera: &Camera,
        place: [usize; 2],
        ends: impl Iterator<Item = (f32, SurfacePoint)>,
    ) -> Pixel {
        let eye = camera.origin;
        let (mut direct, mut rest, mut mirrored) = (Vec::new(), 1.0, Vec::new());
        for (share, end) in ends {
            let way = end.point - eye;
            direct.push((share, Sight::from_eye(camera, way, way.length())));
            rest -= share;
            let lobe = self.scene.surfaces.lobe(end.facet);
            if let Some(lobe) = lobe.filter(|lobe| !lobe.is_wide()) {
                mirrored.extend(self.mirrored(camera, (share, end), lobe));
            }
        }
        // Backs and the void are not parts.
        let dark = |k: u32| {
            let [u, v] = point(k, SEED);
            let way = camera.ray(place[0] as f64 + u, place[1] as f64 + v);
            let (end, distance) = self.scene.look(eye, way);
            (end.facet == DARK).then(|| Sight::from_eye(camera, way, distance * way.length()))
        };
        if rest > LEAST_SHARE
            && let Some(sight) = (0..DARK_RAYS).find_map(dark)
        {
            direct.push((rest, sight));
        }
        Pixel {
            place,
            direct,
            mirrored,
        }
    }

    /// The ray that a mirror in place of the lobe would reflect to the eye, and its share: one
    /// direction serves for the whole lobe.
    fn mirrored(
        &self,
        camera: &Camera,
        (share, end): (f32, SurfacePoint),
        lobe: &Lobe,
    ) -> Option<(f32, Sight)> {
        let facet = &self.scene.surfaces.facets[end.facet as usize];
        let to = camera.origin - end.point;
        let (way, weight) = lobe.mirrored(facet.normal_at(end.point), to.normalized());
        let way = way.normalized();
        if way.dot(facet.normal) <= 0.0 {
            return None;
        }
        let (_, length) = self.scene.shoot(end, way);
        let clear = self.scene.clearness(to.length());
        let sight = Sight {
            eye: end.point,
            way,
            length,
            spread: camera.step_x.max(lobe.spread()),
        };
        Some((share * (weight * clear) as f32, sight))
    }

    /// Radiance that haze scatters to the eye along a ray, for a light at unit strength. `random`,
    /// 0 to 1, places the nodes; use 0.5 unless several results are averaged.
    pub fn radiance(&self, emitter: &Emitter<'_>, sight: &Sight, random: f64) -> f64 {
        match emitter {
            Emitter::Point(beam, projector) => {
                self.of_lamp(&Lamp::of_beam(beam, *projector), sight, random)
            }
            Emitter::Area(area) => {
                let few = Airlight {
                    nodes: self.nodes / PANEL_POINTS as usize,
                    ..*self
                };
                let of_point = |k: u32| {
                    let lamp = self.of_panel(area, point(k, SEED))?;
                    // The nodes of the points interleave.
                    let shift = (f64::from(k) + random) / f64::from(PANEL_POINTS);
                    Some(few.of_lamp(&lamp, sight, shift))
                };
                (0..PANEL_POINTS).filter_map(of_point).sum::<f64>() / f64::from(PANEL_POINTS)
            }
            Emitter::Patches(_) => 0.0,
        }
    }

    /// Unbiased estimate of [`Airlight::radiance`] from one node.
    pub fn sample(
        &self,
        emitter: &Emitter<'_>,
        sight: &Sight,
        [random, place]: [[f64; 2]; 2],
    ) -> f64 {
        let one = Airlight { nodes: 1, ..*self };
        match emitter {
            Emitter::Area(area) => self
                .of_panel(area, place)
                .map_or(0.0, |lamp| one.of_lamp(&lamp, sight, random[0])),
            Emitter::Point(..) | Emitter::Patches(_) => one.radiance(emitter, sight, random[0]),
        }
    }

    /// The point of a panel selected by random numbers.
    fn of_panel<'b>(&self, panel: &'b AreaLight, random: [f64; 2]) -> Option<Lamp<'b>> {
        let (position, normal, area) = self.lifted(panel, random)?;
        Some(Lamp {
            position,
            kind: LampKind::Panel(normal, area),
        })
    }

    /// A point of a panel, so far in front of it that the panel does not shade it, with unit normal
    /// and the panel's area, m².
    fn lifted(&self, panel: &AreaLight, random: [f64; 2]) -> Option<(Vec3, Vec3, f64)> {
        let (position, normal, area) = panel.point(random)?;
        Some((position + normal * (2.0 * self.scene.offset), normal, area))
    }

    /// Distance beyond which nothing is visible, metres.
    fn deepest(&self) -> f64 {
        DEEPEST / self.haze.extinction
    }

    fn of_lamp(&self, lamp: &Lamp<'_>, sight: &Sight, random: f64) -> f64 {
        let length = sight.length.min(self.deepest());
        let spans = lamp.spans(sight, length);
        spans
            .into_iter()
            .map(|span| self.along(lamp, sight, span, random))
            .sum()
    }

    /// The integral over a span of the ray, metres from the eye.
    fn along(&self, lamp: &Lamp<'_>, sight: &Sight, [start, end]: [f64; 2], random: f64) -> f64 {
        let to = lamp.position - sight.eye;
        let middle = sight.way.dot(to);
        let across = sight.way.cross(to).normalized();
        let least = LAMP_RADIUS.max(0.5 * sight.spread * middle);
        let h = (to - sight.way * middle).length().max(least);
        let angle = |t: f64| ((t - middle) / h).atan();
        let place = |u: f64| middle + h * u.tan();
        let (first, last) = (angle(start), angle(end));
        // In a narrow beam light changes evenly.
        let is_narrow = last - first < NARROW;
        let count = if is_narrow {
            self.nodes / 2
        } else {
            self.nodes
        };
        let count = count.clamp(1, MOST_NODES);
        let step = (last - first) / count as f64;
        let node = |i: usize| first + (i as f64 + random) * step;
        let visible = |t: f64| {
            let x = sight.eye + sight.way * t;
            self.scene.transmittance(x, lamp.position - x)
        };
        // A random node is one point of an image.
        let has_extent = count > 1 && lamp.has_image();
        // Unoccluded light and visibility at each node.
        let nodes = (0..count).map(|i| {
            let u = node(i);
            let t = place(u);
            let x = sight.eye + sight.way * t;
            let near = |u: f64| place(u).clamp(start, end);
            let extent = if has_extent {
                near(u + 0.5 * step) - near(u - 0.5 * step)
            } else {
                0.0
            };
            let footprint = [sight.way * extent, across * (sight.spread * t)];
            let d = x - lamp.position;
            let light = lamp.intensity(d, x, footprint);
            if light == 0.0 {
                return [0.0, 0.0];
            }
            let cosine = -d.dot(sight.way) / d.length().max(f64::MIN_POSITIVE);
            let seen = light * phase(self.haze.forward, cosine) * self.scene.clearness(t);
            [seen, visible(t)]
        });
        let nodes: ArrayVec<[f64; 2], MOST_NODES> = nodes.collect();
        let mut sum: f64 = nodes.iter().map(|[seen, visible]| seen * visible).sum();
        for (i, pair) in nodes.windows(2).enumerate() {
            let [a, b] = [pair[0], pair[1]];
            let is_edge = a[0] > 0.0 && b[0] > 0.0 && (a[1] > 0.0) != (b[1] > 0.0);
            if is_edge {
                let (lit, [mut near, mut far]) = if a[1] > 0.0 {
                    (a, [node(i), node(i + 1)])
                } else {
                    (b, [node(i + 1), node(i)])
                };
                let whole = far - near;
                let from = near;
                for _ in 0..HALVINGS {
                    let half = 0.5 * (near + far);
                    if visible(place(half)) > 0.0 {
                        near = half;
                    } else {
                        far = half;
                    }
                }
                let share = (0.5 * (near + far) - from) / whole;
                sum += (share - 0.5) * lit[0] * lit[1];
            }
        }
        self.haze.albedo * self.haze.extinction * sum * step / h
    }
}

/// At least `side` times `side` rays through a pixel that end on the surface where a ray of sight
/// ends. They form a Fibonacci lattice, so that a thin beam along a row or a column of the image
/// meets its share of them.
fn split(
    sight: &Sight,
    camera: &Camera,
    [x, y]: [usize; 2],
    side: usize,
) -> impl ExactSizeIterator<Item = Sight> {
    let (mut before, mut count) = (1, 1);
    while count < side * side {
        (before, count) = (count, before + count);
    }
    let spread = sight.spread / (count as f64).sqrt();
    (0..count).map(move |k| {
        let [u, v] = [1, before].map(|by| (by as f64 * (k as f64 + 0.5) / count as f64).fract());
        Sight {
            way: camera.ray(x as f64 + u, y as f64 + v).normalized(),
            spread,
            ..*sight
        }
    })
}

impl Emitter<'_> {
    /// True when a ray of sight does not cross the light's cone.
    fn is_unseen(&self, sight: &Sight) -> bool {
        match self {
            Emitter::Point(beam, projector) => {
                let lamp = Lamp::of_beam(beam, *projector);
                lamp.spans(sight, sight.length.min(FAR)).is_empty()
            }
            Emitter::Area(_) => false,
            Emitter::Patches(_) => true,
        }
    }
}

impl<'a> Lamp<'a> {
    fn of_beam(beam: &'a Beam, projector: Option<&'a Projector>) -> Lamp<'a> {
        Lamp {
            position: beam.position,
            kind: LampKind::Beam(beam, projector),
        }
    }

    /// True for a projection.
    fn has_image(&self) -> bool {
        matches!(self.kind, LampKind::Beam(_, Some(_)))
    }

    /// Intensity in direction `d` at the point `x`; for a projection the mean over a footprint.
    fn intensity(&self, d: Vec3, x: Vec3, footprint: [Vec3; 2]) -> f64 {
        match &self.kind {
            LampKind::Beam(beam, projector) => {
                let share = beam.share(d);
                match projector {
                    Some(projector) if share > 0.0 => share * projector.share(x, footprint),
                    _ => share,
                }
            }
            LampKind::Panel(normal, area) => area * (normal.dot(d) / d.length()).max(0.0),
        }
    }

    /// Spans of a ray within the light's cone, metres from the eye.
    fn spans(&self, sight: &Sight, length: f64) -> ArrayVec<[f64; 2], 3> {
        let (axis, reach) = match &self.kind {
            LampKind::Beam(beam, _) => (beam.axis, beam.reach()),
            LampKind::Panel(normal, _) => (*normal, FRAC_PI_2),
        };
        spans(sight, length, (self.position, axis, reach))
    }
}

/// Spans of a ray within a cone with this apex, unit axis and half angle, metres from the eye.
fn spans(
    sight: &Sight,
    length: f64,
    (apex, axis, reach): (Vec3, Vec3, f64),
) -> ArrayVec<[f64; 2], 3> {
    let from = sight.eye - apex;
    let (a, b) = (sight.way.dot(axis), from.dot(axis));
    let cosine = reach.cos();
    // The equation below cancels for a half-space.
    if cosine.abs() < FLAT {
        let part = in_front(axis, (apex - sight.eye, sight.way), length);
        return part.into_iter().collect();
    }
    let is_inside = |t: f64| {
        let d = from + sight.way * t;
        d.dot(axis) >= cosine * d.length()
    };
    // Intersections with the double cone: `(d axis)² = cosine² d²`.
    let square = cosine * cosine;
    let [a2, b2, c2] = [
        a * a - square,
        a * b - square * from.dot(sight.way),
        b * b - square * from.dot(from),
    ];
    let mut cuts = ArrayVec::<f64, 4>::new();
    cuts.push(0.0);
    let root = b2 * b2 - a2 * c2;
    if a2 != 0.0 && root >= 0.0 {
        let roots = [-b2 - root.sqrt(), -b2 + root.sqrt()].map(|r| r / a2);
        cuts.extend(roots.into_iter().filter(|t| *t > 0.0 && *t < length));
    }
    cuts.push(length);
    cuts.sort_by(f64::total_cmp);
    let spans = cuts.windows(2).map(|pair| [pair[0], pair[1]]);
    spans
        .filter(|[from, to]| from < to && is_inside(0.5 * (from + to)))
        .collect()
}

/// The part of a ray in front of a panel's point, metres from the eye; `to` leads from the eye to
/// the point.
fn in_front(normal: Vec3, (to, way): (Vec3, Vec3), length: f64) -> Option<[f64; 2]> {
    let (height, slope) = (-normal.dot(to), normal.dot(way));
    let crossing = -height / slope;
    let [start, end] = if slope > 0.0 {
        [crossing.max(0.0), length]
    } else if slope < 0.0 {
        [0.0, crossing.min(length)]
    } else {
        [0.0, if height > 0.0 { length } else { 0.0 }]
    };
    (start < end).then_some([start, end])
}

/// Phase function of Henyey and Greenstein, 1/sr; `cosine` is that of the scattering angle.
fn phase(forward: f64, cosine: f64) -> f64 {
    let square = forward * forward;
    let far = 1.0 + square - 2.0 * forward * cosine;
    (1.0 - square) / (4.0 * PI * far * far.sqrt())
}

#[cfg(test)]
mod tests;
