//! What the eye sees: fragments of facets and their share of each pixel.
//!
//! Every pixel is rasterized at several sub-pixels into an item buffer. A pixel (or a quarter of
//! it) that shows one facet, and the sub-pixels around it too, is one fragment, seen at its
//! middle; one with edges in it has a fragment for each facet, weighted by the exact area that
//! shows. What fits between the sub-pixels of two pixels is not found. Backs are black and opaque: they
//! take their place and leave no fragment. This room knows nothing of lights.

#![allow(
    clippy::indexing_slicing,
    reason = "sub-pixels are addressed within the band's buffer by construction"
)]

use crate::geometry::{Vec3, vec3};
use crate::raster::{Camera, ItemBuffer, NOTHING};
use crate::scene::View;
use crate::transport::TransportError;
use crate::transport::coverage::{Place, Square, shares};
use crate::transport::sample::kept_inside;
use crate::transport::surface::{Piece, Surfaces};
use crate::work::Work;
use rayon::prelude::*;

/// Pixel rows that are rasterized at once.
const BAND: usize = 16;

/// Shares of a pixel below this are dropped: rounding, not surfaces.
const LEAST: f64 = 1e-7;

/// Pictures beyond this many pixels are refused.
const MOST_PIXELS: usize = 1 << 27;

/// A part of a pixel that shows one facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
    /// On the facet.
    pub point: Vec3,
    /// Share of the pixel's square.
    pub weight: f32,
    /// What it covers of the picture.
    pub outline: Outline,
}

/// What a fragment covers of the picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// A square: its middle, and half its side.
    Square([f32; 2], f32),
    /// A range of the parts of [`Fragments`].
    Parts(u32, u32),
}

/// The fragments of all pixels.
#[derive(Clone, Debug)]
pub struct Fragments {
    /// Pixel by pixel, row by row from the top.
    pub all: Vec<Fragment>,
    /// Where each pixel's fragments start, and at last their number.
    pub offsets: Vec<usize>,
    /// Of the view, one unit a pixel.
    pub camera: Camera,
    /// Convex parts of outlines that are no squares: where in `places` each ends.
    parts: Vec<u32>,
    places: Vec<Place>,
}

impl Fragments {
    /// Calls back for each convex part of a fragment's outline.
    pub fn outline(&self, fragment: usize, mut each: impl FnMut(&[Place])) {
        match self.all[fragment].outline {
            Outline::Square(middle, half) => {
                let [x, y] = middle.map(f64::from);
                let h = f64::from(half);
                each(&[
                    [x - h, y - h],
                    [x + h, y - h],
                    [x + h, y + h],
                    [x - h, y + h],
                ]);
            }
            Outline::Parts(from, to) => {
                for i in from as usize..to as usize {
                    let start = i.checked_sub(1).map_or(0, |j| self.parts[j] as usize);
                    each(&self.places[start..self.parts[i] as usize]);
                }
            }
        }
    }

    /// Adds the next band of the picture.
    fn append(&mut self, band: Found) {
        let (parts, places) = (self.parts.len() as u32, self.places.len() as u32);
        let start = self.all.len();
        self.offsets.extend(band.ends.iter().map(|e| start + e));
        self.all.extend(band.all.into_iter().map(|mut f| {
            if let Outline::Parts(from, to) = &mut f.outline {
                *from += parts;
                *to += parts;
            }
            f
        }));
        self.parts.extend(band.parts.iter().map(|p| p + places));
        self.places.extend(band.places);
    }
}

/// The fragments of some rows.
#[derive(Default)]
struct Found {
    all: Vec<Fragment>,
    /// Number of fragments up to each pixel and with it.
    ends: Vec<usize>,
    parts: Vec<u32>,
    places: Vec<Place>,
}

/// Sub-pixels along a pixel's side in the item buffer that tells where edges are.
const SUBPIXELS: usize = 4;

/// Into how many parts a pixel's side is split; all of them divide the sub-pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// It stays whole.
    Whole = 1,
    /// Two parts.
    Halves = 2,
    /// Four parts, one for each sub-pixel.
    Quarters = 4,
}

impl Split {
    /// Along a side.
    pub fn parts(self) -> usize {
        self as usize
    }
}

/// How finely a pixel is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Fragments of a pixel that shows one facet.
    pub split: Split,
    /// The same where it shows several.
    pub edge_split: Split,
}

/// The camera of a view, at one sample a pixel.
///
/// # Errors
/// [`TransportError::Scene`] when the view has no pixels or too many, looks nowhere, or its field
/// of view is not between 0 and 180 degrees.
pub fn camera(view: &View) -> Result<Camera, TransportError> {
    let bad = |what: &str| TransportError::Scene(format!("the view {what}"));
    let pixels = view.width.checked_mul(view.height);
    if pixels.is_none_or(|n| n == 0 || n > MOST_PIXELS) {
        return Err(bad("must have 1 to 2^27 pixels"));
    }
    if !(view.fov > 0.0 && view.fov < 180.0) {
        return Err(bad("must have a field between 0 and 180 degrees"));
    }
    let forward = (view.to - view.from).normalized();
    if !forward.is_finite() || !view.from.is_finite() || forward == Vec3::ZERO {
        return Err(bad("must look from one point to another"));
    }
    let vertical = forward.x.hypot(forward.y) < 1e-9;
    let up = if vertical {
        vec3(0.0, 1.0, 0.0)
    } else {
        vec3(0.0, 0.0, 1.0)
    };
    let right = forward.cross(up).normalized();
    let slope = (view.fov.to_radians() * 0.5).tan();
    let step = 2.0 * slope / view.height as f64;
    Ok(Camera {
        origin: view.from,
        right,
        up: right.cross(forward),
        forward,
        left: -0.5 * step * view.width as f64,
        top: slope,
        step_x: step,
        step_y: step,
    })
}

/// Finds the fragments of a view.
///
/// # Errors
/// Those of [`camera`], and cancel.
pub fn fragments(
    surfaces: &Surfaces,
    view: &View,
    sampling: Sampling,
    work: Work<'_>,
) -> Result<Fragments, TransportError> {
    let camera = camera(view)?;
    let bands: Result<Vec<Found>, TransportError> = (0..view.height.div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            work.check()?;
            let from = band * BAND;
            let rows = BAND.min(view.height - from);
            Ok(Band::draw(surfaces, &camera, view.width, from, rows, sampling).pixels())
        })
        .collect();
    let mut out = Fragments {
        all: Vec::new(),
        offsets: vec![0],
        camera,
        parts: Vec::new(),
        places: Vec::new(),
    };
    for band in bands? {
        out.append(band);
    }
    Ok(out)
}

struct Band<'a> {
    surfaces: &'a Surfaces,
    camera: Camera,
    sampling: Sampling,
    width: usize,
    from: usize,
    rows: usize,
    buffer: ItemBuffer,
}

impl<'a> Band<'a> {
    fn draw(
        surfaces: &'a Surfaces,
        whole: &Camera,
        width: usize,
        from: usize,
        rows: usize,
        sampling: Sampling,
    ) -> Band<'a> {
        let s = SUBPIXELS;
        let (step_x, step_y) = (whole.step_x / s as f64, whole.step_y / s as f64);
        // One sub-pixel more on each side.
        let camera = Camera {
            left: whole.left - step_x,
            top: whole.top - whole.step_y * from as f64 + step_y,
            step_x,
            step_y,
            ..*whole
        };
        let mut buffer = ItemBuffer::new(width * s + 2, rows * s + 2);
        // Of two in one plane the later wins: backs come first, so that a wall of two faces back to
        // back is seen on both sides.
        let is_back = |p: &&Piece| p.normal.dot(p.vertices[0] - camera.origin) > 0.0;
        let backs = surfaces.pieces.iter().filter(is_back);
        let fronts = surfaces.pieces.iter().filter(|p| !is_back(p));
        for piece in backs.chain(fronts) {
            buffer.draw(&camera, &piece.vertices, piece.normal, piece.facet as u32);
        }
        Band {
            surfaces,
            camera,
            sampling,
            width,
            from,
            rows,
            buffer,
        }
    }

    fn pixels(&self) -> Found {
        let s = SUBPIXELS;
        let mut out = Found::default();
        for y in 0..self.rows {
            for x in 0..self.width {
                let whole = self.uniform(x * s, y * s, s);
                let split = if whole.is_some() {
                    self.sampling.split.parts()
                } else {
                    self.sampling.edge_split.parts()
                };
                let part = s / split;
                for j in 0..split {
                    for i in 0..split {
                        self.part(x * s + i * part, y * s + j * part, part, &mut out);
                    }
                }
                out.ends.push(out.all.len());
            }
        }
        out
    }

    /// Rows of the items of a square of sub-pixels and of those around it.
    fn window(&self, x: usize, y: usize, side: usize) -> impl Iterator<Item = &[u32]> {
        let width = self.width * SUBPIXELS + 2;
        let row = move |j: usize| (y + j) * width + x;
        (0..side + 2).map(move |j| &self.buffer.items()[row(j)..row(j) + side + 2])
    }

    /// The one item of a square of sub-pixels and those around it, if there is only one.
    fn uniform(&self, x: usize, y: usize, side: usize) -> Option<u32> {
        let mut all = self.window(x, y, side).flatten();
        let first = *all.next()?;
        all.all(|i| *i == first).then_some(first)
    }

    /// Adds the fragments of a square of sub-pixels.
    fn part(&self, x: usize, y: usize, side: usize, out: &mut Found) {
        let scale = (SUBPIXELS as f64).powi(-2);
        // The camera's first sub-pixel is the margin.
        let corner = [x as f64 + 1.0, y as f64 + 1.0];
        let side_length = side as f64;
        if let Some(item) = self.uniform(x, y, side) {
            let at = corner.map(|c| c + side_length * 0.5);
            let half = 0.5 * side_length / SUBPIXELS as f64;
            let outline = Outline::Square(self.whole(at).map(|c| c as f32), half as f32);
            let weight = side_length.powi(2) * scale;
            out.all.extend(self.fragment(item, at, weight, outline));
            return;
        }
        let mut items: Vec<u32> = self.window(x, y, side).flatten().copied().collect();
        items.retain(|i| *i != NOTHING);
        items.sort_unstable();
        items.dedup();
        let square = Square {
            corner,
            side: side_length,
        };
        for share in shares(self.surfaces, &self.camera, square, &items) {
            let weight = share.area * scale;
            if weight > LEAST {
                let parts = out.parts.len() as u32;
                let outline = Outline::Parts(parts, parts + share.parts.len() as u32);
                let found = self.fragment(share.facet as u32, share.at, weight, outline);
                if let Some(fragment) = found {
                    out.all.push(fragment);
                    for part in &share.parts {
                        out.places.extend(part.iter().map(|at| self.whole(*at)));
                        out.parts.push(out.places.len() as u32);
                    }
                }
            }
        }
    }

    /// A position in sub-pixels of the band as one in pixels of the picture.
    fn whole(&self, [x, y]: Place) -> Place {
        let s = SUBPIXELS as f64;
        [(x - 1.0) / s, self.from as f64 + (y - 1.0) / s]
    }

    /// The front of a facet at a position in sub-pixels; `None` for the void and for backs.
    fn fragment(
        &self,
        item: u32,
        [x, y]: Place,
        weight: f64,
        outline: Outline,
    ) -> Option<Fragment> {
        if item == NOTHING {
            return None;
        }
        let facet = &self.surfaces.facets[item as usize];
        let ray = self.camera.ray(x, y);
        let slope = facet.normal.dot(ray);
        let distance = facet.normal.dot(facet.vertices[0] - self.camera.origin);
        if slope >= 0.0 || distance >= 0.0 {
            return None;
        }
        let point = self.camera.origin + ray * (distance / slope);
        Some(Fragment {
            facet: item as usize,
            point: kept_inside(self.surfaces, facet, point),
            weight: weight as f32,
            outline,
        })
    }
}
