//! Fragments: the parts of each pixel that show one facet, with their share of the pixel.
//!
//! Every pixel is rasterized at several sub-pixels into an item buffer. A pixel (or a quarter of it)
//! that shows one facet, as the sub-pixels around it do, is one fragment; one with edges has a
//! fragment for each facet, weighted by its exact visible area. What lies between the sub-pixels of
//! two pixels is missed. Backs are black and opaque: they occlude and leave no fragment. This module
//! does not depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "sub-pixels are addressed within the band's buffer by construction"
)]

use crate::TransportError;
use crate::surfaces::camera::{Camera, camera};
use crate::surfaces::clipper::PlanePoint;
use crate::surfaces::coverage::{Shares, Silhouettes, Square};
use crate::surfaces::facet::{Facet, Piece};
use crate::surfaces::lists::Lists;
use crate::surfaces::raster::{ItemBuffer, NOTHING};
use crate::surfaces::surface::{Surfaces, kept_inside};
use footlight_host::work::Work;
use footlight_show::geometry::Vec3;
use footlight_show::geometry::View;
use rayon::prelude::*;

/// Pixel rows that are rasterized at once.
const BAND: usize = 16;

/// Shares of a pixel below this are dropped: rounding, not surfaces.
const LEAST: f64 = 1e-7;

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
    /// Convex parts: a range of the lists of [`Fragments`].
    Parts(u32, u32),
}

/// The fragments of all pixels.
#[derive(Clone, Debug)]
pub struct Fragments {
    /// For each pixel, row by row from the top.
    pub pixels: Lists<Fragment>,
    /// Of the view, one unit a pixel.
    pub camera: Camera,
    /// Corners of the convex parts of outlines that are no squares.
    parts: Lists<PlanePoint>,
}

impl Fragments {
    /// All fragments, pixel by pixel.
    pub fn all(&self) -> &[Fragment] {
        self.pixels.items()
    }

    /// What the picture shows of each of `facets` facets, in pixels.
    pub fn visible_areas(&self, facets: usize) -> Vec<f64> {
        let mut areas = vec![0.0; facets];
        for f in self.all() {
            areas[f.facet] += f64::from(f.weight);
        }
        areas
    }

    /// Calls back for each convex part of a fragment's outline.
    pub fn outline(&self, fragment: usize, mut each: impl FnMut(&[PlanePoint])) {
        match self.all()[fragment].outline {
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
                (from..to).for_each(|part| each(self.parts.get(part as usize)));
            }
        }
    }
}

/// The fragments of some rows: for each pixel, and the parts of their outlines.
type BandFragments = (Lists<Fragment>, Lists<PlanePoint>);

/// Runs of bands for each thread: enough that no thread waits long for the last.
const RUNS: usize = 4;

/// Sub-pixels along a pixel's side in the item buffer that shows where edges are.
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

/// A pixel that is so many times as long on a facet as it is wide is stretched.
const STRETCHED: f64 = 5.0;

/// Into how many fragments a pixel is split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Fragments of a pixel that shows one facet.
    pub split: Split,
    /// The same where the pixel is stretched on the facet, so that the point in its middle is far
    /// from its ends.
    pub stretched_split: Split,
    /// The same where it shows several.
    pub edge_split: Split,
}

impl Sampling {
    /// Of a plain pixel, a stretched one, and one with edges.
    pub const fn new(split: Split, stretched_split: Split, edge_split: Split) -> Sampling {
        Sampling {
            split,
            stretched_split,
            edge_split,
        }
    }

    fn tells_stretched(&self) -> bool {
        self.stretched_split != self.split
    }
}

/// Is a pixel stretched on the plane of a facet, seen along the ray through its middle?
///
/// Its sides fall along u and v there; of an ellipse with these conjugate half axes the main ones,
/// a and b, have a^2 + b^2 = u^2 + v^2 and a b = |u x v|. A plane that faces the picture stretches
/// nothing, however far from the middle it is seen.
pub fn is_stretched(facet: &Facet, camera: &Camera, ray: Vec3) -> bool {
    let slope = facet.normal.dot(ray);
    let side = |along: Vec3| along * slope - ray * facet.normal.dot(along);
    let (u, v) = (side(camera.right), side(camera.up));
    let both = u.dot(u) + v.dot(v);
    both > (STRETCHED + 1.0 / STRETCHED) * u.cross(v).length()
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
    let rasterized = Rasterized {
        surfaces,
        camera,
        silhouettes: Silhouettes::new(surfaces, &camera),
        sampling,
        width: view.width,
        rows: BAND.min(view.height),
    };
    let count = view.height.div_ceil(BAND);
    // A few runs of bands for each thread, as every run takes memory of its own.
    let bands: Result<Vec<BandFragments>, TransportError> = (0..count)
        .into_par_iter()
        .with_min_len(count.div_ceil(RUNS * rayon::current_num_threads()))
        .map_init(
            || rasterized.band(),
            |band, at| {
                work.check()?;
                let from = at * BAND;
                band.draw(from);
                Ok(band.pixels(BAND.min(view.height - from)))
            },
        )
        .collect();
    let mut bands = bands?;
    let mut before = 0;
    for (pixels, parts) in &mut bands {
        for fragment in pixels.items_mut() {
            if let Outline::Parts(from, to) = &mut fragment.outline {
                *from += before;
                *to += before;
            }
        }
        before += parts.count() as u32;
    }
    let (pixels, parts): (Vec<_>, Vec<_>) = bands.into_iter().unzip();
    Ok(Fragments {
        pixels: Lists::concat(pixels),
        camera,
        parts: Lists::concat(parts),
    })
}

/// What all bands have in common.
struct Rasterized<'a> {
    surfaces: &'a Surfaces,
    /// Of the picture, one unit a pixel.
    camera: Camera,
    silhouettes: Silhouettes<'a>,
    sampling: Sampling,
    width: usize,
    /// Of a band.
    rows: usize,
}

/// Some rows of pixels, with the working memory to draw them.
struct Band<'a> {
    rasterized: &'a Rasterized<'a>,
    from: usize,
    buffer: ItemBuffer,
    shares: Shares,
    items: Vec<u32>,
}

impl Rasterized<'_> {
    fn band(&self) -> Band<'_> {
        let s = SUBPIXELS;
        Band {
            rasterized: self,
            from: 0,
            buffer: ItemBuffer::new(self.width * s + 2, self.rows * s + 2),
            shares: Shares::default(),
            items: Vec::new(),
        }
    }

    /// The front of a facet at a place; `None` for the void and for backs.
    fn fragment(
        &self,
        item: u32,
        [x, y]: PlanePoint,
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

impl Band<'_> {
    /// Rasterizes the rows from `from` on.
    fn draw(&mut self, from: usize) {
        let (s, whole) = (SUBPIXELS, &self.rasterized.camera);
        let (step_x, step_y) = (whole.step_x / s as f64, whole.step_y / s as f64);
        // One sub-pixel more on each side.
        let camera = Camera {
            left: whole.left - step_x,
            top: whole.top - whole.step_y * from as f64 + step_y,
            step_x,
            step_y,
            ..*whole
        };
        self.from = from;
        self.buffer.clear();
        // Of two in one plane the later wins: backs come first, so that a wall of two faces back to
        // back is seen on both sides.
        let pieces = &self.rasterized.surfaces.pieces;
        let is_back = |p: &&Piece| p.normal.dot(p.vertices[0] - camera.origin) > 0.0;
        let backs = pieces.iter().filter(is_back);
        let fronts = pieces.iter().filter(|p| !is_back(p));
        for piece in backs.chain(fronts) {
            self.buffer
                .draw(&camera, &piece.vertices, piece.normal, piece.facet as u32);
        }
    }

    fn pixels(&mut self, rows: usize) -> BandFragments {
        let s = SUBPIXELS;
        let mut out = BandFragments::default();
        for y in 0..rows {
            for x in 0..self.rasterized.width {
                let whole = self.uniform::<{ SUBPIXELS + 2 }>(x * s, y * s);
                let split = self.split(whole, [x, y]);
                let side = s / split;
                for (j, i) in (0..split).flat_map(|j| (0..split).map(move |i| (j, i))) {
                    let corner = [x * s + i * side, y * s + j * side];
                    match whole.or_else(|| self.uniform_of(corner, side)) {
                        Some(item) => self.plain(item, corner, side, &mut out),
                        None => self.cut(corner, side, &mut out),
                    }
                }
                out.0.end();
            }
        }
        out
    }

    /// Parts along the side of a pixel that shows one item or several.
    fn split(&self, item: Option<u32>, [x, y]: [usize; 2]) -> usize {
        let sampling = self.rasterized.sampling;
        let Some(item) = item else {
            return sampling.edge_split.parts();
        };
        let is_stretched = |facet| {
            let camera = &self.rasterized.camera;
            let ray = camera.ray(x as f64 + 0.5, (self.from + y) as f64 + 0.5);
            is_stretched(facet, camera, ray)
        };
        match self.rasterized.surfaces.facets.get(item as usize) {
            Some(facet) if sampling.tells_stretched() && is_stretched(facet) => {
                sampling.stretched_split.parts()
            }
            _ => sampling.split.parts(),
        }
    }

    /// The one item of a square of sub-pixels and those around it, if there is only one.
    fn uniform_of(&self, [x, y]: [usize; 2], side: usize) -> Option<u32> {
        match side {
            1 => self.uniform::<3>(x, y),
            2 => self.uniform::<4>(x, y),
            _ => self.uniform::<{ SUBPIXELS + 2 }>(x, y),
        }
    }

    /// The one item of `SIDE` x `SIDE` sub-pixels, if there is only one.
    fn uniform<const SIDE: usize>(&self, x: usize, y: usize) -> Option<u32> {
        let width = self.rasterized.width * SUBPIXELS + 2;
        let rows = self.buffer.items()[y * width + x..].chunks(width);
        let mut rows = rows.take(SIDE).filter_map(|row| row.first_chunk::<SIDE>());
        let first = *rows.clone().next()?.first()?;
        // Without a way out in the middle of a row: a few instructions for each.
        let same = |row: &[u32; SIDE]| row.iter().fold(0, |all, item| all | (item ^ first)) == 0;
        rows.all(same).then_some(first)
    }

    /// Adds the fragment of a square that shows one item.
    fn plain(&self, item: u32, corner: [usize; 2], side: usize, (pixels, _): &mut BandFragments) {
        let Square { corner, side } = self.square(corner, side);
        let half = 0.5 * side;
        let middle = corner.map(|c| c + half);
        let outline = Outline::Square(middle.map(|c| c as f32), half as f32);
        let fragment = self.rasterized.fragment(item, middle, side * side, outline);
        fragment.into_iter().for_each(|f| pixels.add(f));
    }

    /// Adds the fragments of a square with edges in it.
    fn cut(&mut self, corner: [usize; 2], side: usize, (pixels, parts): &mut BandFragments) {
        let width = self.rasterized.width * SUBPIXELS + 2;
        self.items.clear();
        for y in corner[1]..corner[1] + side + 2 {
            let from = y * width + corner[0];
            let row = &self.buffer.items()[from..from + side + 2];
            self.items
                .extend(row.iter().copied().filter(|i| *i != NOTHING));
        }
        self.items.sort_unstable();
        self.items.dedup();
        let square = self.square(corner, side);
        self.shares
            .find(&self.rasterized.silhouettes, square, &self.items);
        for share in self.shares.all() {
            if share.area <= LEAST {
                continue;
            }
            let from = parts.count() as u32;
            let outline = Outline::Parts(from, from + share.count() as u32);
            let item = share.facet as u32;
            if let Some(fragment) = self
                .rasterized
                .fragment(item, share.at, share.area, outline)
            {
                pixels.add(fragment);
                for part in self.shares.parts(share) {
                    parts.push(part.iter().copied());
                }
            }
        }
    }

    /// The square of so many sub-pixels, in pixels of the picture.
    fn square(&self, [x, y]: [usize; 2], side: usize) -> Square {
        let s = SUBPIXELS as f64;
        Square {
            corner: [x as f64 / s, self.from as f64 + y as f64 / s],
            side: side as f64 / s,
        }
    }
}
