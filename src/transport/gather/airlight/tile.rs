//! Tiles of pixels whose airlight is interpolated from the corners.
//!
//! Where a tile shows several surfaces, one behind another, each of them is extended to the corners
//! as a plane: the inverse distance is linear in the place on the image. A tile within which the
//! light does not change evenly is divided, and at last each ray of sight is computed.

use super::{Airlight, Pixel, Sight, split};
use crate::gather::emitter::Emitter;
use crate::surfaces::camera::Camera;
use footlight_show::geometry::Vec3;
use std::array;
use std::cell::OnceCell;

/// Side of the tiles, pixels.
pub(super) const TILE: usize = 8;
/// Least side of a part of a tile.
const LEAST_TILE: usize = 4;
/// Allowed difference from the light interpolated, relative to the brightest pixel.
const EVEN: f32 = 0.005;
/// Allowed difference of a distance from that of the plane, relative to it.
const EVEN_ENDS: f64 = 0.02;
/// Least ratio of distances between two surfaces.
const GAP: f64 = 1.05;
/// Resistance to slopes that few pixels leave undetermined, pixels squared.
const STIFF: f64 = 1e-3;

/// A block of pixels.
pub(super) struct Tile<'a> {
    pixels: Vec<&'a Pixel>,
    size: [usize; 2],
    /// Distances of each surface along the rays through the corners, metres.
    surfaces: Vec<[f64; 4]>,
    /// The surface of each direct ray of sight, pixel by pixel; empty where the tile cannot be
    /// interpolated.
    surface: Vec<u32>,
    /// Its quarters, once they are needed.
    parts: OnceCell<Vec<Tile<'a>>>,
}

/// A ray of sight as a sample of a surface.
#[derive(Clone, Copy)]
struct End {
    /// Inverse of its length, 1/m.
    inverse: f64,
    /// Column and row in the tile.
    place: [f64; 2],
    /// Number of the ray in the tile.
    ray: usize,
}

impl<'a> Tile<'a> {
    /// A block of pixels, row by row.
    pub(super) fn of(pixels: Vec<&'a Pixel>, size: [usize; 2]) -> Tile<'a> {
        let [wide, tall] = size;
        let mut tile = Tile {
            pixels,
            size,
            surfaces: Vec::new(),
            surface: Vec::new(),
            parts: OnceCell::new(),
        };
        if wide.min(tall) >= LEAST_TILE {
            tile.find_surfaces();
        }
        tile
    }

    /// The quarters; none of a tile that is not divided.
    fn parts(&self) -> &[Tile<'a>] {
        self.parts.get_or_init(|| {
            if self.size != [TILE; 2] {
                return Vec::new();
            }
            let half = TILE / 2;
            let quarter = |[x, y]: [usize; 2]| {
                let own = places([half; 2]);
                let own = own.map(|[i, j]| self.pixels[(y * half + j) * TILE + x * half + i]);
                Tile::of(own.collect(), [half; 2])
            };
            places([2; 2]).map(quarter).collect()
        })
    }

    fn find_surfaces(&mut self) {
        let mut ends = Vec::new();
        for ([i, j], pixel) in places(self.size).zip(&self.pixels) {
            for (_, sight) in &pixel.direct {
                ends.push(End {
                    inverse: sight.length.recip(),
                    place: [i as f64, j as f64],
                    ray: ends.len(),
                });
            }
        }
        let mut of = vec![0; ends.len()];
        ends.sort_by(|a, b| a.inverse.total_cmp(&b.inverse));
        for surface in ends.chunk_by(|a, b| b.inverse <= a.inverse * GAP) {
            let Some(corners) = plane(surface, self.size) else {
                return;
            };
            surface
                .iter()
                .for_each(|end| of[end.ray] = self.surfaces.len() as u32);
            self.surfaces.push(corners);
        }
        // More rays through the corners than there are pixels serve nothing.
        if 4 * self.surfaces.len() + checks(self.size).len() < ends.len() {
            self.surface = of;
        }
    }
}

impl Airlight<'_> {
    /// A light in the pixels of a tile, row by row. Differences below `faint` are not refined.
    pub(super) fn tile(
        &self,
        (emitter, faint): (&Emitter<'_>, f32),
        camera: &Camera,
        tile: &Tile<'_>,
    ) -> Vec<f32> {
        let direct = || tile.pixels.iter().flat_map(|pixel| &pixel.direct);
        let mirrored = || tile.pixels.iter().flat_map(|pixel| &pixel.mirrored);
        // A beam near its lamp may lie between the rays of sight.
        let is_fine = direct().any(|(_, sight)| self.rays_along_side(emitter, sight) > 1);
        if !is_fine {
            let mut sights = direct().chain(mirrored());
            if sights.all(|(_, sight)| emitter.is_unseen(sight)) {
                return vec![0.0; tile.pixels.len()];
            }
            if let Some(values) = self.interpolated((emitter, faint), camera, tile) {
                let pixels = values.into_iter().zip(&tile.pixels);
                let whole = pixels.map(|(value, pixel)| value + self.sum(emitter, &pixel.mirrored));
                return whole.collect();
            }
        }
        if tile.parts().is_empty() {
            let pixels = tile.pixels.iter();
            return pixels
                .map(|pixel| self.whole(emitter, camera, pixel))
                .collect();
        }
        let mut out = vec![0.0; tile.pixels.len()];
        let half = TILE / 2;
        for ([x, y], part) in places([2; 2]).zip(tile.parts()) {
            let values = self.tile((emitter, faint), camera, part);
            for ([i, j], value) in places(part.size).zip(values) {
                out[(y * half + j) * TILE + x * half + i] = value;
            }
        }
        out
    }

    /// Light along the direct rays of sight, interpolated from the corners; `None` where it does not
    /// change evenly.
    pub(super) fn interpolated(
        &self,
        (emitter, faint): (&Emitter<'_>, f32),
        camera: &Camera,
        tile: &Tile<'_>,
    ) -> Option<Vec<f32>> {
        let first = tile.pixels.first().filter(|_| !tile.surface.is_empty())?;
        let [wide, tall] = tile.size.map(|side| side - 1);
        let corners = [[0, 0], [wide, 0], [0, tall], [wide, tall]];
        let ways = corners.map(|corner| {
            let [x, y] = [0, 1].map(|axis| (first.place[axis] + corner[axis]) as f64 + 0.5);
            camera.ray(x, y)
        });
        let at_corner = |way: Vec3, length: f64| {
            let sight = Sight::from_eye(camera, way, length);
            self.radiance(emitter, &sight, 0.5) as f32
        };
        let lengths = tile.surfaces.iter();
        let values = lengths.map(|own| array::from_fn(|k| at_corner(ways[k], own[k])));
        let values: Vec<[f32; 4]> = values.collect();
        let mut surfaces = tile.surface.iter();
        let pixels = places(tile.size).zip(&tile.pixels);
        let between = pixels.map(|([i, j], pixel)| {
            let at = [i as f32 / wide as f32, j as f32 / tall as f32];
            let sights = pixel.direct.iter().zip(surfaces.by_ref());
            let light = sights.map(|((share, _), k)| share * bilinear(values[*k as usize], at));
            light.sum()
        });
        let between: Vec<f32> = between.collect();
        let most = between.iter().copied().fold(0.0, f32::max);
        let is_even = checks(tile.size).into_iter().all(|[i, j]| {
            let k = j * tile.size[0] + i;
            let apart = self.sum(emitter, &tile.pixels[k].direct) - between[k];
            apart.abs() <= faint.max(EVEN * most)
        });
        is_even.then_some(between)
    }

    /// A light in a pixel; the direct rays of sight are divided near a lamp.
    pub(super) fn whole(&self, emitter: &Emitter<'_>, camera: &Camera, pixel: &Pixel) -> f32 {
        let direct = pixel.direct.iter();
        let sides = direct
            .clone()
            .map(|(_, sight)| self.rays_along_side(emitter, sight));
        let side = sides.max().unwrap_or(1);
        let mirrored = self.sum(emitter, &pixel.mirrored);
        if side == 1 {
            return mirrored + self.sum(emitter, &pixel.direct);
        }
        let divided = direct.map(|(share, sight)| {
            let rays = split(sight, camera, pixel.place, side);
            let count = rays.len() as f64;
            let sum: f64 = rays.map(|ray| self.radiance(emitter, &ray, 0.5)).sum();
            share * (sum / count) as f32
        });
        mirrored + divided.sum::<f32>()
    }
}

/// Columns and rows of the pixels at which an interpolated tile is checked.
fn checks([wide, tall]: [usize; 2]) -> Vec<[usize; 2]> {
    let near = |side: usize| side / 3;
    let far = |side: usize| side - 1 - side / 3;
    let mut out = vec![[near(wide), far(tall)], [far(wide), near(tall)]];
    if wide.max(tall) > LEAST_TILE {
        out.extend([[near(wide), near(tall)], [far(wide), far(tall)]]);
    }
    out
}

/// Distances along the rays through the corners of the plane that fits these ends of sight; `None`
/// where they do not lie on a plane.
fn plane(ends: &[End], size: [usize; 2]) -> Option<[f64; 4]> {
    let count = ends.len() as f64;
    let mean = |f: &dyn Fn(&End) -> f64| ends.iter().map(f).sum::<f64>() / count;
    let centre = [0, 1].map(|k| mean(&|end| end.place[k]));
    let inverse = mean(&|end| end.inverse);
    let from = |end: &End| [0, 1].map(|k| end.place[k] - centre[k]);
    let square = |a: usize, b: usize| mean(&|end| from(end)[a] * from(end)[b]);
    let (xx, xy, yy) = (square(0, 0) + STIFF, square(0, 1), square(1, 1) + STIFF);
    let [x, y] = [0, 1].map(|k| mean(&|end| from(end)[k] * (end.inverse - inverse)));
    let determinant = xx * yy - xy * xy;
    let slopes = [
        (yy * x - xy * y) / determinant,
        (xx * y - xy * x) / determinant,
    ];
    let at = |place: [f64; 2]| {
        inverse + slopes[0] * (place[0] - centre[0]) + slopes[1] * (place[1] - centre[1])
    };
    let fits = |end: &End| (at(end.place) - end.inverse).abs() <= EVEN_ENDS * end.inverse;
    let [wide, tall] = size.map(|side| (side - 1) as f64);
    let corners = [[0.0, 0.0], [wide, 0.0], [0.0, tall], [wide, tall]].map(at);
    let least = ends[0].inverse / 2.0;
    ends.iter()
        .all(fits)
        .then(|| corners.map(|inverse| inverse.max(least).recip()))
}

/// Columns and rows of a block, row by row.
pub(super) fn places([wide, tall]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    (0..tall).flat_map(move |j| (0..wide).map(move |i| [i, j]))
}

/// Value at these shares of the way across and down, given those at the corners, row by row.
pub(super) fn bilinear(corners: [f32; 4], [u, v]: [f32; 2]) -> f32 {
    let [upper, lower] = [0, 2].map(|k| corners[k] + u * (corners[k + 1] - corners[k]));
    upper + v * (lower - upper)
}
