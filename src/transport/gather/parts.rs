//! The parts of each pixel: its samples grouped by surface.
//!
//! Light is gathered, sampled and filtered for each part, and the pixel is their sum weighted by
//! shares. A pixel on an edge is therefore as free of noise as its neighbours, and one on gauze
//! shows both the gauze and the surfaces behind it. This module depends on geometry alone.

use crate::gather::ray_scene::{RayView, SurfacePoint};
use crate::surfaces::facet::Facet;
use crate::surfaces::lists::Lists;
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::Vec3;
use std::ops::Range;

/// Least cosine between the normals of one surface.
pub const ALIKE: f64 = 0.9;
/// Least cosine between facets with shading normals.
const ROUND: f64 = 0.5;

/// The part of a pixel that shows one surface.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Share of the pixel, 0 to 1.
    pub share: f32,
    /// One of its facets; the only one if the part has no hits.
    pub facet: u32,
    /// Number of rays that gather its light.
    pub rays: u32,
    /// Index of its reflectance to the eye if that differs from its facet's; else [`NO_PAINT`].
    pub paint: u32,
    /// Mean of its points, and normalised mean of its normals.
    pub point: Vec3,
    pub normal: Vec3,
    /// Index of the material.
    pub material: u32,
    /// Radius of the filter, metres.
    pub radius: f32,
    /// Path length from the eye, metres.
    pub length: f32,
    /// The light that it shows.
    pub look: Look,
}

/// The light that a part of a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Diffusely reflected light.
    Matt,
    /// Seen in a glossy surface that is nearly a mirror.
    Mirrored,
    /// Light reflected by its own wide lobe, except that of panels and lamps.
    Gloss,
}

/// The part has neither texture nor gloss and is seen directly.
pub const NO_PAINT: u32 = u32::MAX;

/// A sample of a pixel that shows a part.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Its facet.
    pub facet: u32,
    /// The glossy facet in which it is seen; `DARK` when seen directly.
    pub mirror: u32,
    /// Index of the pixel's sample.
    pub sample: u16,
    /// Its share of the sample, relative to `u16::MAX`; lower for gauze and surfaces behind it.
    pub opacity: u16,
}

impl Hit {
    /// Its facet and the facet in which it is seen.
    pub fn facets(&self) -> [u32; 2] {
        [self.facet, self.mirror]
    }

    /// Share of the sample, 0 to 1.
    pub fn share(&self) -> f32 {
        f32::from(self.opacity) / f32::from(u16::MAX)
    }
}

/// The parts of all pixels.
#[derive(Default)]
pub struct Parts {
    /// Parts of each pixel, row by row from the top.
    pub pixels: Lists<Part>,
    /// Samples of each part; none if every sample of the pixel shows its one facet.
    pub hits: Lists<Hit>,
    /// Cells in which the rays of each part end, packed ([`crate::gather::lamp_patches::Met`]) and
    /// sorted.
    pub cells: Lists<u32>,
    /// Mean reflectances of parts to the eye.
    pub paints: Vec<[f32; 3]>,
}

impl Parts {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.pixels.bytes()
            + self.hits.bytes()
            + self.cells.bytes()
            + size_of_val(self.paints.as_slice())
    }

    /// All parts, pixel by pixel.
    pub fn all(&self) -> &[Part] {
        self.pixels.items()
    }

    /// Indices of the parts of consecutive pixels.
    fn of(&self, pixels: Range<usize>) -> Range<usize> {
        let start = |pixel: usize| pixel.checked_sub(1).map_or(0, |p| self.pixels.range(p).end);
        start(pixels.start)..start(pixels.end)
    }

    /// Reflectance of a part.
    pub fn reflectance(&self, part: &Part, surfaces: &Surfaces) -> [f32; 3] {
        let paint = self.paints.get(part.paint as usize).copied();
        let facet = || surfaces.facets.get(part.facet as usize);
        let own = || facet().map_or([0.0; 3], |facet| facet.reflectance.map(|r| r as f32));
        paint.unwrap_or_else(own)
    }

    /// Splits values of all parts, `width` for each, into rows of pixels of this many columns.
    pub fn rows<'a, T>(
        &self,
        columns: usize,
        width: usize,
        mut values: &'a mut [T],
    ) -> Vec<&'a mut [T]> {
        let rows = self.pixels.count() / columns.max(1);
        let row = |y: usize| {
            let own = self.of(y * columns..(y + 1) * columns);
            let (row, rest) = std::mem::take(&mut values).split_at_mut(width * own.len());
            values = rest;
            row
        };
        (0..rows).map(row).collect()
    }
}

/// True when two items of a view, each a facet or none, belong to different surfaces.
pub fn differ(surfaces: &Surfaces, [a, b]: [u32; 2]) -> bool {
    match [a, b].map(|item| surfaces.facets.get(item as usize)) {
        [Some(a), Some(b)] => !is_one_surface(a, b),
        [a, b] => a.is_some() != b.is_some(),
    }
}

/// True when two facets have one material and approximately one direction.
fn is_one_surface(a: &Facet, b: &Facet) -> bool {
    let least = if a.is_smooth() && b.is_smooth() {
        ROUND
    } else {
        ALIKE
    };
    a.material == b.material && a.normal.dot(b.normal) >= least
}

/// A place that a sample of a pixel shows.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub view: RayView,
    pub hit: Hit,
}

/// Groups samples of a pixel by surface: one material, approximately one direction, within
/// `thickness` metres of one plane, and in one mirror or none.
pub fn by_surface(
    surfaces: &Surfaces,
    samples: impl Iterator<Item = Sample>,
    thickness: impl Fn(&Sample) -> f64,
) -> Vec<Vec<Sample>> {
    let mut groups: Vec<Vec<Sample>> = Vec::new();
    let facet = |place: SurfacePoint| &surfaces.facets[place.facet as usize];
    // Material of the mirror in which it is seen.
    let mirror = |hit: Hit| surfaces.facets.get(hit.mirror as usize).map(|f| f.material);
    for sample in samples {
        let own = facet(sample.view.place);
        let is_same = |group: &&mut Vec<Sample>| {
            let first = group[0].view.place;
            if mirror(group[0].hit) != mirror(sample.hit) {
                return false;
            }
            let other = facet(first);
            let heights = [
                own.height(first.point),
                other.height(sample.view.place.point),
            ];
            let height = heights[0].abs().min(heights[1].abs());
            first.facet == sample.view.place.facet
                || is_one_surface(own, other) && height <= thickness(&group[0])
        };
        match groups.iter_mut().find(is_same) {
            Some(group) => group.push(sample),
            None => groups.push(vec![sample]),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::ray_scene::DARK;
    use crate::surfaces::rectangle;
    use footlight_show::geometry::vec3;

    fn sample(surfaces: &Surfaces, facet: usize, point: Vec3) -> Sample {
        assert!(surfaces.facets[facet].height(point).abs() < 1e-9);
        let facet = facet as u32;
        Sample {
            view: RayView {
                place: SurfacePoint { facet, point },
                mirror: DARK,
                share: 1.0,
                length: 1.0,
            },
            hit: Hit {
                facet,
                mirror: DARK,
                sample: 0,
                opacity: u16::MAX,
            },
        }
    }

    /// Two halves of a floor are one surface; a step a hand higher and a wall are separate.
    #[test]
    fn samples_are_grouped_by_plane_and_direction() {
        let floor = rectangle((-4.0, 0.0), (-4.0, 4.0), 0.0);
        let other = rectangle((0.0, 3.0), (-4.0, 4.0), 0.0);
        let step = rectangle((3.0, 4.0), (-3.0, 3.0), 0.1);
        let wall = [
            vec3(4.0, -1.0, 0.0),
            vec3(4.0, -1.0, 1.0),
            vec3(4.0, 1.0, 1.0),
            vec3(4.0, 1.0, 0.0),
        ];
        let quads = [floor, other, step, wall];
        let surfaces = Surfaces::grey(quads.iter().map(|q| q.to_vec()).collect());
        // Facets are sorted by area, which decreases from one to the next.
        let places = [
            (0, vec3(-1.0, 0.0, 0.0)),
            (2, vec3(3.5, 0.0, 0.1)),
            (1, vec3(2.0, 0.0, 0.0)),
            (3, vec3(4.0, 0.0, 0.5)),
            (2, vec3(3.2, 1.0, 0.1)),
        ];
        let samples = places.map(|(facet, point)| sample(&surfaces, facet, point));
        let groups = by_surface(&surfaces, samples.into_iter(), |_| 0.01);
        let facets = |group: &Vec<Sample>| group.iter().map(|s| s.hit.facet).collect::<Vec<_>>();
        let found: Vec<Vec<u32>> = groups.iter().map(facets).collect();
        assert_eq!(found, [vec![0, 1], vec![2, 2], vec![3]]);
        // From a distance, step and floor are one surface.
        let groups = by_surface(&surfaces, samples.into_iter(), |_| 0.2);
        assert_eq!(groups.len(), 2);
    }

    #[test]
    fn parts_belong_to_their_pixels() {
        let mut parts = Parts::default();
        let part = Part {
            share: 0.5,
            facet: 0,
            rays: 1,
            paint: NO_PAINT,
            point: Vec3::ZERO,
            normal: Vec3::ZERO,
            material: 0,
            radius: 1.0,
            length: 1.0,
            look: Look::Matt,
        };
        for count in [1, 0, 2, 3] {
            parts.pixels.push((0..count).map(|_| part));
        }
        assert_eq!(parts.of(0..1), 0..1);
        assert_eq!(parts.of(1..2), 1..1);
        assert_eq!(parts.of(1..4), 1..6);
        let mut values = [0, 10, 20, 30, 40, 50];
        let rows = parts.rows(2, 1, &mut values);
        assert_eq!(rows, [&[0][..], &[10, 20, 30, 40, 50][..]]);
    }
}
