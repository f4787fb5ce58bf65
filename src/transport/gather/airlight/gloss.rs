//! Airlight of beams in wide gloss, from the lamp's side.
//!
//! Few rays of a wide lobe meet a beam that is narrower, and one ray gives an image that is too
//! sharp. The light of the beam is gathered on few lines from the lamp instead; each is integrated
//! as the lobe sees it. On a line at the distance `h` of a point, `ds / r² = du / h` with `u` the
//! angle at the point; nodes are denser where the line comes nearest to the mirrored direction.

#![allow(clippy::indexing_slicing, reason = "lines of one beam")]

use super::{Airlight, LAMP_RADIUS, Sight, bilinear, phase};
use crate::gather::emitter::Emitter;
use crate::gather::ray_scene::{DARK, SurfacePoint};
use crate::surfaces::camera::Camera;
use crate::surfaces::lobe::Lobe;
use arrayvec::ArrayVec;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::{Vec3, frame};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_4, PI};
use std::sync::OnceLock;

/// Directions that sample a beam.
const SAMPLES: usize = 1024;
/// Least number of lines.
const LEAST_LINES: usize = 7;
/// Most lines; wider beams are seen by rays of the lobe.
const MOST_LINES: usize = 64;
/// Distance from the axis, relative to the beam's radius there, up to which rays of the lobe serve,
/// and from which the lines do: within a beam a narrow lobe sees them one by one.
const NEAR: [f64; 2] = [1.5, 3.0];
/// Half the beam's angle, relative to the lobe's spread, up to which lines serve everywhere.
const NARROW: f64 = 0.3;
/// Rays of the lobe.
const RAYS: usize = 4;
/// Most nodes along a line.
const MOST_NODES: usize = 16;
/// Parts of a line with a visibility each.
const PARTS: usize = 32;
/// Bisection steps for the end of a line.
const HALVINGS: u32 = 40;
/// Side of the blocks within which values are interpolated, pixels.
const SIDE: usize = 16;
/// Marks a pixel that shows no wide gloss.
const NONE: u32 = DARK - 1;
/// Allowed difference of interpolated values, relative to the highest corner.
const EVEN: f32 = 0.1;
/// Allowed difference relative to the brightest place.
const EVEN_FAINT: f32 = 0.005;
/// Share of the brightest node up to which a node counts as visible without a test.
const FAINT: f64 = 0.01;

/// A place that shows airlight in its gloss.
struct GlossyPlace<'a> {
    lobe: &'a Lobe,
    /// Raised by the offset of rays.
    point: Vec3,
    normal: Vec3,
    /// Unit direction towards the eye.
    eye: Vec3,
    /// Share of the pixel, times the transmittance of haze to the eye.
    share: f64,
    end: SurfacePoint,
    /// Rays of the lobe with their weights; made when needed.
    rays: OnceLock<ArrayVec<(f64, Sight), RAYS>>,
}

struct Line {
    way: Vec3,
    /// Intensity times solid angle.
    flux: f64,
    /// Metres to the first opaque surface.
    length: f64,
    /// Visible share of the lamp in equal parts of the line.
    seen: [f32; PARTS],
}

/// A beam as lines of light.
struct Lines {
    lamp: Vec3,
    axis: Vec3,
    /// Half the beam's angle, radians.
    reach: f64,
    lines: Vec<Line>,
    /// Angle between lines, radians.
    apart: f64,
}

/// Directions of equal solid angle in a cone, on a spiral.
fn cone(axis: Vec3, reach: f64, count: usize) -> impl Iterator<Item = Vec3> {
    let [x, y] = frame(axis);
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let depth = 1.0 - reach.cos();
    (0..count).map(move |k| {
        let height = 1.0 - depth * (k as f64 + 0.5) / count as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let wide = (1.0 - height * height).sqrt();
        axis * height + x * (wide * cos) + y * (wide * sin)
    })
}

/// Mean light in the glossy places of each pixel of a block.
struct Block<'a, V> {
    value: V,
    /// The glossy facet of each pixel; [`DARK`] for several, [`NONE`] without one.
    facets: &'a [u32],
    width: usize,
    /// Difference that is allowed wherever it occurs.
    faint: f32,
    /// NaN where not known.
    found: Vec<f32>,
}

impl<V: Fn(usize) -> f32> Block<'_, V> {
    fn at(&mut self, [x, y]: [usize; 2]) -> f32 {
        let pixel = y * self.width + x;
        if self.found[pixel].is_nan() {
            self.found[pixel] = (self.value)(pixel);
        }
        self.found[pixel]
    }

    /// Fills the pixels from one corner to the opposite one: by the plane through the corners where
    /// one glossy facet is seen and four pixels within agree with it, by parts elsewhere.
    fn fill(&mut self, [left, top]: [usize; 2], [right, bottom]: [usize; 2]) {
        let [wide, tall] = [right - left, bottom - top];
        if wide < 2 || tall < 2 {
            return;
        }
        let pixels = || (top..=bottom).flat_map(|y| (left..=right).map(move |x| [x, y]));
        let (facets, width) = (self.facets, self.width);
        let facet_at = |[x, y]: [usize; 2]| facets[y * width + x];
        let facet = facet_at([left, top]);
        let corners = [[left, top], [right, top], [left, bottom], [right, bottom]];
        let is_one = pixels().all(|pixel| [facet, NONE].contains(&facet_at(pixel)))
            && corners.iter().all(|corner| facet_at(*corner) == facet);
        if ![DARK, NONE].contains(&facet) && is_one {
            let corners = corners.map(|corner| self.at(corner));
            let between = |[x, y]: [usize; 2]| {
                let way = [(x - left, wide), (y - top, tall)];
                bilinear(corners, way.map(|(at, side)| at as f32 / side as f32))
            };
            let most = corners.iter().copied().fold(0.0, f32::max);
            let inner = [[1, 1], [2, 2], [1, 2], [2, 1]];
            let inner = inner.map(|[i, j]| [left + i * wide / 3, top + j * tall / 3]);
            let allowed = self.faint.max(EVEN * most);
            let is_even = |at| facet_at(at) == NONE || (self.at(at) - between(at)).abs() <= allowed;
            if inner.into_iter().all(is_even) {
                for [x, y] in pixels() {
                    self.found[y * self.width + x] = between([x, y]);
                }
                return;
            }
        }
        let [x, y] = [left + wide / 2, top + tall / 2];
        self.fill([left, top], [x, y]);
        self.fill([x + 1, top], [right, y]);
        self.fill([left, y + 1], [x, bottom]);
        self.fill([x + 1, y + 1], [right, bottom]);
    }
}

/// Parts of a pixel with adjacent ones on the same facet as one, at their mean.
fn merged(ends: impl Iterator<Item = (f32, SurfacePoint)>) -> Vec<(f32, SurfacePoint)> {
    let mut out: Vec<(f32, SurfacePoint)> = Vec::new();
    for (share, end) in ends {
        match out.last_mut() {
            Some((sum, last)) if last.facet == end.facet => {
                *sum += share;
                let part = f64::from(share / *sum);
                last.point += (end.point - last.point) * part;
            }
            _ => out.push((share, end)),
        }
    }
    out
}

impl Airlight<'_> {
    /// Adds the airlight that wide gloss reflects to a picture of all lights; see
    /// [`Airlight::picture`].
    pub(super) fn add_gloss<I: Iterator<Item = (f32, SurfacePoint)>>(
        &self,
        emitters: &[Emitter<'_>],
        (camera, [width, height]): (&Camera, [usize; 2]),
        ends: impl Fn(usize) -> I + Sync,
        out: &mut [f32],
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let Some(spread) = self.scene.surfaces.narrowest_wide_gloss() else {
            return Ok(());
        };
        let lines = emitters.par_iter().map(|e| Lines::of(self, e, spread));
        let lines: Vec<Option<Lines>> = lines.collect();
        // The brightest of few pixels shows what is faint.
        let lattice = (SIDE / 2..height).step_by(SIDE).flat_map(|y| {
            let row = (SIDE / 2..width).step_by(SIDE);
            row.map(move |x| y * width + x)
        });
        let places = lattice.flat_map(|pixel| ends(pixel).filter_map(|e| self.glossy(camera, e)));
        let places: Vec<GlossyPlace<'_>> = places.collect();
        let faint = lines.par_iter().map(|lines| {
            let mut most = 0.0_f64;
            for place in &places {
                work.check()?;
                let light = lines.as_ref().map(|lines| lines.reflected(self, place));
                most = most.max(light.unwrap_or(0.0));
            }
            Ok(EVEN_FAINT * most as f32)
        });
        let faint: Vec<f32> = faint.collect::<Result<_, Cancelled>>()?;
        let lights = emitters.len();
        let bands = out.par_chunks_mut((SIDE * width * lights).max(1));
        bands.enumerate().try_for_each(|(row, out)| {
            work.check()?;
            let tall = SIDE.min(height - row * SIDE);
            for left in (0..width).step_by(SIDE) {
                let wide = SIDE.min(width - left);
                let pixels =
                    || (0..tall).flat_map(|j| (0..wide).map(move |i| j * width + left + i));
                let places = pixels().map(|pixel| {
                    let ends = merged(ends(row * SIDE * width + pixel));
                    let glossy = ends.into_iter().filter_map(|end| self.glossy(camera, end));
                    glossy.collect()
                });
                let places: Vec<Vec<GlossyPlace<'_>>> = places.collect();
                if places.iter().all(Vec::is_empty) {
                    continue;
                }
                let facet = |own: &Vec<GlossyPlace<'_>>| match own.as_slice() {
                    [] => NONE,
                    [one] => one.end.facet,
                    _ => DARK,
                };
                let facets: Vec<u32> = places.iter().map(facet).collect();
                let share = |own: &Vec<GlossyPlace<'_>>| own.iter().map(|place| place.share).sum();
                let shares: Vec<f64> = places.iter().map(share).collect();
                for (light, (emitter, lines)) in emitters.iter().zip(&lines).enumerate() {
                    let value = |pixel: usize| {
                        let own = places[pixel].iter();
                        let light = own.map(|place| {
                            place.share * self.in_gloss(camera, (emitter, lines.as_ref()), place)
                        });
                        (light.sum::<f64>() / shares[pixel]) as f32
                    };
                    let mut block = Block {
                        value,
                        facets: &facets,
                        width: wide,
                        faint: faint[light],
                        found: vec![f32::NAN; wide * tall],
                    };
                    if lines.is_some() {
                        block.fill([0, 0], [wide - 1, tall - 1]);
                    }
                    for (k, pixel) in pixels().enumerate() {
                        if facets[k] != NONE {
                            let seen = block.at([k % wide, k / wide]);
                            out[pixel * lights + light] += shares[k] as f32 * seen;
                        }
                    }
                }
            }
            Ok(())
        })
    }

    /// A place of wide gloss, for a part of a pixel.
    fn glossy(
        &self,
        camera: &Camera,
        (share, end): (f32, SurfacePoint),
    ) -> Option<GlossyPlace<'_>> {
        let surfaces = self.scene.surfaces;
        let SurfacePoint { facet, point } = end;
        let lobe = surfaces.lobe(facet).filter(|lobe| lobe.is_wide())?;
        let facet = &surfaces.facets[facet as usize];
        let to = camera.origin - point;
        Some(GlossyPlace {
            lobe,
            point: point + facet.normal * self.scene.offset,
            normal: facet.normal_at(point),
            eye: to.normalized(),
            share: f64::from(share) * self.scene.clearness(to.length()),
            end,
            rays: OnceLock::new(),
        })
    }

    /// Rays of the lobe, in fixed places of it.
    fn lobe_rays(&self, camera: &Camera, place: &GlossyPlace<'_>) -> ArrayVec<(f64, Sight), RAYS> {
        let ray = |k: usize| {
            let random = [k % 2, k / 2].map(|at| 0.25 + 0.5 * at as f64);
            let (way, weight) = self.scene.reflected(place.end, camera.origin, random)?;
            let (_, length) = self.scene.shoot(place.end, way);
            let sight = Sight {
                eye: place.point,
                way,
                length,
                spread: camera.step_x.max(0.5 * place.lobe.spread()),
            };
            Some((weight / RAYS as f64, sight))
        };
        (0..RAYS).filter_map(ray).collect()
    }

    /// A light in a place: from its lines, or, within a beam and without lines, by rays.
    fn in_gloss(
        &self,
        camera: &Camera,
        (emitter, lines): (&Emitter<'_>, Option<&Lines>),
        place: &GlossyPlace<'_>,
    ) -> f64 {
        let far = lines.map_or(0.0, |lines| lines.far(place));
        let mut sum = 0.0;
        if let Some(lines) = lines.filter(|_| far > 0.0) {
            sum += far * lines.reflected(self, place);
        }
        if far < 1.0 {
            let rays = place
                .rays
                .get_or_init(|| self.lobe_rays(camera, place))
                .iter();
            let light = rays.map(|(weight, ray)| weight * self.radiance(emitter, ray, 0.5));
            sum += (1.0 - far) * light.sum::<f64>();
        }
        sum
    }
}

impl Lines {
    /// The lines of a beam that is narrow relative to lobes of this spread, radians.
    fn of(air: &Airlight<'_>, emitter: &Emitter<'_>, spread: f64) -> Option<Lines> {
        let Emitter::Point(beam, projector) = emitter else {
            return None;
        };
        let reach = beam.reach();
        let count = (3.0 * reach / spread).powi(2).ceil();
        if count > MOST_LINES as f64 {
            return None;
        }
        let count = (count as usize).max(LEAST_LINES);
        let ways: Vec<Vec3> = cone(beam.axis, reach, count).collect();
        let mut sums = vec![(Vec3::ZERO, 0.0); count];
        let part = 2.0 * PI * (1.0 - reach.cos()) / SAMPLES as f64;
        let side = part.sqrt();
        for way in cone(beam.axis, reach, SAMPLES) {
            let sides = frame(way).map(|e| e * side);
            let image = projector.map_or(1.0, |p| p.share(beam.position + way, sides));
            let flux = beam.share(way) * image * part;
            let near = |k: &usize| way.dot(ways[*k]);
            let nearest = (0..count).max_by(|a, b| near(a).total_cmp(&near(b)));
            let sum = &mut sums[nearest.unwrap_or(0)];
            *sum = (sum.0 + way * flux, sum.1 + flux);
        }
        let lines = sums.into_iter().filter(|(_, flux)| *flux > 0.0);
        let lines = lines.map(|(way, flux)| Line::new(air, beam.position, way.normalized(), flux));
        Some(Lines {
            lamp: beam.position,
            axis: beam.axis,
            reach,
            lines: lines.collect(),
            apart: 2.0 * reach / (count as f64).sqrt(),
        })
    }

    /// Share of the lines in the light at a place, 0 to 1; rays of the lobe have the rest.
    fn far(&self, place: &GlossyPlace<'_>) -> f64 {
        let from = place.point - self.lamp;
        let along = from.dot(self.axis);
        if along <= 0.0 || self.reach < NARROW * place.lobe.spread() {
            return 1.0;
        }
        let radius = along * self.reach.min(FRAC_PI_4).tan();
        let aside = (from - self.axis * along).length() / radius;
        ((aside - NEAR[0]) / (NEAR[1] - NEAR[0])).clamp(0.0, 1.0)
    }

    /// Radiance that a place reflects to the eye. Nodes of the same number on all lines share a ray
    /// of visibility, to their mean.
    fn reflected(&self, air: &Airlight<'_>, place: &GlossyPlace<'_>) -> f64 {
        let mut groups = [(0.0, Vec3::ZERO); MOST_NODES];
        let groups = &mut groups[..air.nodes.min(MOST_NODES)];
        for line in &self.lines {
            self.add(air, place, line, groups);
        }
        let most = groups
            .iter()
            .fold(0.0, |most: f64, group| most.max(group.0));
        let visible = |(value, sum): &(f64, Vec3)| {
            if *value <= FAINT * most {
                return *value;
            }
            let end = *sum / *value;
            value * air.scene.past_surfaces(place.point, end - place.point)
        };
        air.haze.albedo * air.haze.extinction * groups.iter().map(visible).sum::<f64>()
    }

    /// Adds the light of each node of a line, and its place weighted by it.
    fn add(
        &self,
        air: &Airlight<'_>,
        place: &GlossyPlace<'_>,
        line: &Line,
        groups: &mut [(f64, Vec3)],
    ) {
        let (normal, lobe) = (place.normal, place.lobe);
        let to = self.lamp - place.point;
        let middle = -to.dot(line.way);
        let across = to + line.way * middle;
        let least = LAMP_RADIUS.max(0.25 * self.apart * middle);
        let h = across.length().hypot(least);
        let across = across.normalized();
        let angle = |s: f64| ((s - middle) / h).atan();
        // The lobe in the plane of place and line.
        let (mirrored, _) = lobe.mirrored(normal, place.eye);
        let peak = mirrored.dot(line.way).atan2(mirrored.dot(across));
        let aside = mirrored.dot(line.way.cross(across)).clamp(-1.0, 1.0).asin();
        let wide = lobe.spread().hypot(aside);
        let stretched = |u: f64| ((u - peak) / wide).atan();
        let (start, end) = (stretched(angle(0.0)), stretched(angle(line.length)));
        let step = (end - start) / groups.len() as f64;
        for (k, group) in groups.iter_mut().enumerate() {
            let from_peak = wide * (start + (k as f64 + 0.5) * step).tan();
            let u = peak + from_peak;
            let way = across * u.cos() + line.way * u.sin();
            let cosine = normal.dot(way);
            if cosine <= 0.0 {
                continue;
            }
            let s = (middle + h * u.tan()).clamp(0.0, line.length);
            let density = (wide * wide + from_peak * from_peak) / wide * step / h;
            let seen = lobe.value(normal, place.eye, way) * cosine * density;
            let scattered = phase(air.haze.forward, -line.way.dot(way)) * line.flux;
            let clear = air.scene.clearness(s + h / u.cos());
            let value = seen * scattered * clear * line.seen(s);
            group.0 += value;
            group.1 += (self.lamp + line.way * s) * value;
        }
    }
}

impl Line {
    fn new(air: &Airlight<'_>, lamp: Vec3, way: Vec3, flux: f64) -> Line {
        let passed = |s: f64| air.scene.past_surfaces(lamp + way * s, way * -s);
        let (mut length, mut dark) = (0.0, air.deepest());
        for _ in 0..HALVINGS {
            let half = 0.5 * (length + dark);
            if passed(half) > 0.0 {
                length = half;
            } else {
                dark = half;
            }
        }
        let middle = |k: usize| (k as f64 + 0.5) / PARTS as f64 * length;
        Line {
            way,
            flux,
            length,
            seen: std::array::from_fn(|k| passed(middle(k)) as f32),
        }
    }

    fn seen(&self, s: f64) -> f64 {
        let part = (s / self.length * PARTS as f64) as usize;
        f64::from(self.seen[part.min(PARTS - 1)])
    }
}

#[cfg(test)]
mod tests;
