//! Fragments: the parts of each pixel that show one facet, with their share of the pixel.
//!
//! Every pixel is rasterised at several sub-pixels into an item buffer. A pixel (or part of one) is
//! one fragment if it and the sub-pixels around it show one facet. A pixel with edges has a
//! fragment for each facet, weighted by its exact visible area; so has one that a sliver passes
//! through. A gap narrower than a sub-pixel is missed. Backs are black and opaque: they occlude and produce no fragment. This
//! module does not depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "sub-pixels are addressed within the band's buffer by construction"
)]

use crate::surfaces::camera::{Camera, Window};
use crate::surfaces::clipper::PlanePoint;
use crate::surfaces::coverage::{Shares, Silhouettes, Square};
use crate::surfaces::facet::{Facet, Piece};
use crate::surfaces::lists::Lists;
use crate::surfaces::raster::{ItemBuffer, NOTHING};
use crate::surfaces::sliver::Slivers;
use crate::surfaces::surface::{Surfaces, kept_inside};
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use rayon::prelude::*;

/// Pixel rows rasterised together.
const BAND: usize = 16;

/// Shares of a pixel below this are dropped as rounding errors.
const LEAST: f64 = 1e-7;

/// A part of a pixel that shows one facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
    /// On the facet's plane, metres.
    pub point: Vec3,
    /// Share of the pixel's square.
    pub weight: f32,
    /// Covered region of the image.
    pub outline: Outline,
}

/// Covered region of a fragment in the image, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// A square: its centre and half its side.
    Square([f32; 2], f32),
    /// Convex parts: a range in the lists of [`Fragments`].
    Parts(u32, u32),
}

/// The fragments of all pixels.
#[derive(Clone, Debug)]
pub struct Fragments {
    /// For each pixel, row by row from the top.
    pub pixels: Lists<Fragment>,
    /// Camera of the view, one unit a pixel.
    pub camera: Camera,
    /// Corners of the convex parts of outlines other than squares.
    parts: Lists<PlanePoint>,
}

impl Fragments {
    /// All fragments, pixel by pixel.
    pub fn all(&self) -> &[Fragment] {
        self.pixels.items()
    }

    /// Calls `each` for each convex part of a fragment's outline.
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

/// Fragments of some rows of pixels, and the parts of their outlines.
type BandFragments = (Lists<Fragment>, Lists<PlanePoint>);

/// Runs of bands for each thread: enough that no thread waits long for the last.
const RUNS: usize = 4;

/// Sub-pixels along a pixel's side in the item buffer that locates edges.
const SUBPIXELS: usize = 4;

/// Parts along a pixel's side; each number divides that of the sub-pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Undivided.
    Whole = 1,
    /// Two parts.
    Halves = 2,
    /// Four parts, one for each sub-pixel.
    Quarters = 4,
}

impl Split {
    /// Number of parts along a side.
    pub fn parts(self) -> usize {
        self as usize
    }
}

/// Ratio of a pixel's length on a facet to its width from which it counts as stretched.
const STRETCHED: f64 = 5.0;

/// Fragments of each kind of pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Fragments of a pixel that shows one facet.
    pub split: Split,
    /// For a pixel stretched on the facet, whose centre is far from its ends.
    pub stretched_split: Split,
    /// For a pixel that shows several facets.
    pub edge_split: Split,
}

impl Sampling {
    /// From the splits of a plain pixel, a stretched one, and one with edges.
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

/// True when a pixel is stretched on the plane of a facet, seen along the ray through its centre.
///
/// Its sides project to u and v there. The ellipse with these conjugate half axes has principal
/// half axes a and b with a^2 + b^2 = u^2 + v^2 and a b = |u x v|. A plane parallel to the image
/// stretches nothing, however far from the centre it is seen.
pub fn is_stretched(facet: &Facet, camera: &Camera, ray: Vec3) -> bool {
    let slope = facet.normal.dot(ray);
    let side = |along: Vec3| along * slope - ray * facet.normal.dot(along);
    let (u, v) = (side(camera.right), side(camera.up));
    let both = u.dot(u) + v.dot(v);
    both > (STRETCHED + 1.0 / STRETCHED) * u.cross(v).length()
}

/// Computes the fragments of a window.
///
/// # Errors
/// On cancel.
pub fn fragments(
    surfaces: &Surfaces,
    window: &Window,
    sampling: Sampling,
    work: Work<'_>,
) -> Result<Fragments, Cancelled> {
    let &Window {
        camera,
        width,
        height,
    } = window;
    let rasterized = Rasterized {
        surfaces,
        camera,
        silhouettes: Silhouettes::new(surfaces, &camera),
        sampling,
        width,
        rows: BAND.min(height),
    };
    let count = height.div_ceil(BAND);
    // A few runs of bands for each thread, as every run allocates its own memory.
    let bands: Result<Vec<BandFragments>, Cancelled> = (0..count)
        .into_par_iter()
        .with_min_len(count.div_ceil(RUNS * rayon::current_num_threads()))
        .map_init(
            || rasterized.band(),
            |band, at| {
                work.check()?;
                let from = at * BAND;
                band.draw(from);
                Ok(band.pixels(BAND.min(height - from)))
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

/// Data shared by all bands.
struct Rasterized<'a> {
    surfaces: &'a Surfaces,
    /// Camera of the image, one unit a pixel.
    camera: Camera,
    silhouettes: Silhouettes<'a>,
    sampling: Sampling,
    width: usize,
    /// Rows of a band.
    rows: usize,
}

/// Some rows of pixels, with working memory for drawing them.
struct Band<'a> {
    rasterized: &'a Rasterized<'a>,
    from: usize,
    buffer: ItemBuffer,
    slivers: Slivers,
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
            slivers: Slivers::default(),
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
        // One more sub-pixel on each side.
        let camera = Camera {
            left: whole.left - step_x,
            top: whole.top - whole.step_y * from as f64 + step_y,
            step_x,
            step_y,
            ..*whole
        };
        self.from = from;
        self.buffer.clear();
        // The later of two coplanar pieces wins: backs come first, so that two coincident faces
        // back to back are visible from both sides.
        let pieces = &self.rasterized.surfaces.pieces;
        let is_back = |p: &&Piece| p.normal.dot(p.vertices[0] - camera.origin) > 0.0;
        let backs = pieces.iter().filter(is_back);
        let fronts = pieces.iter().filter(|p| !is_back(p));
        self.slivers.clear();
        for piece in backs.chain(fronts) {
            let item = piece.facet as u32;
            let covered = self
                .buffer
                .draw(&camera, &piece.vertices, piece.normal, item);
            self.slivers.add(item, covered, &self.buffer);
        }
        let width = self.rasterized.width;
        // Without the sub-pixels around the band.
        let pixel = |at: usize| Some(at.checked_sub(1)? / s);
        self.slivers.find(&self.buffer, |[x, y]| {
            let x = pixel(x).filter(|x| *x < width)?;
            Some(pixel(y)? * width + x)
        });
    }

    fn pixels(&mut self, rows: usize) -> BandFragments {
        let s = SUBPIXELS;
        let mut out = BandFragments::default();
        for y in 0..rows {
            for x in 0..self.rasterized.width {
                let pixel = y * self.rasterized.width + x;
                let has_sliver = self.slivers.of(pixel).next().is_some();
                let whole = self
                    .uniform::<{ SUBPIXELS + 2 }>(x * s, y * s)
                    .filter(|_| !has_sliver);
                let split = self.split(whole, [x, y]);
                let side = s / split;
                for (j, i) in (0..split).flat_map(|j| (0..split).map(move |i| (j, i))) {
                    let corner = [x * s + i * side, y * s + j * side];
                    let one = || self.uniform_of(corner, side).filter(|_| !has_sliver);
                    match whole.or_else(one) {
                        Some(item) => self.plain(item, corner, side, &mut out),
                        None => self.cut(corner, side, &mut out),
                    }
                }
                out.0.end();
            }
        }
        out
    }

    /// Number of parts along the side of a pixel that shows one item or several.
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

    /// The item of a square of sub-pixels and those around it, if there is only one.
    fn uniform_of(&self, [x, y]: [usize; 2], side: usize) -> Option<u32> {
        match side {
            1 => self.uniform::<3>(x, y),
            2 => self.uniform::<4>(x, y),
            _ => self.uniform::<{ SUBPIXELS + 2 }>(x, y),
        }
    }

    /// The item of `SIDE` x `SIDE` sub-pixels, if there is only one.
    fn uniform<const SIDE: usize>(&self, x: usize, y: usize) -> Option<u32> {
        let width = self.rasterized.width * SUBPIXELS + 2;
        let rows = self.buffer.items()[y * width + x..].chunks(width);
        let mut rows = rows.take(SIDE).filter_map(|row| row.first_chunk::<SIDE>());
        let first = *rows.clone().next()?.first()?;
        // Without an early exit within a row: only a few instructions for each.
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

    /// Adds the fragments of a square that contains edges.
    fn cut(&mut self, corner: [usize; 2], side: usize, (pixels, parts): &mut BandFragments) {
        let width = self.rasterized.width * SUBPIXELS + 2;
        self.items.clear();
        for y in corner[1]..corner[1] + side + 2 {
            let from = y * width + corner[0];
            let row = &self.buffer.items()[from..from + side + 2];
            self.items
                .extend(row.iter().copied().filter(|i| *i != NOTHING));
        }
        let [x, y] = corner.map(|at| at / SUBPIXELS);
        let slivers = self.slivers.of(y * self.rasterized.width + x);
        self.items.extend(slivers);
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

    /// The square of `side` sub-pixels, in pixels of the image.
    fn square(&self, [x, y]: [usize; 2], side: usize) -> Square {
        let s = SUBPIXELS as f64;
        Square {
            corner: [x as f64 / s, self.from as f64 + y as f64 / s],
            side: side as f64 / s,
        }
    }
}
