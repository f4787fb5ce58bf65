//! Textures of surfaces: prefiltered, in linear light, with transparency.
//!
//! [`Pixels`] hold an image and smaller ones of half the size each, down to one texel, every texel
//! the mean of its area. A lookup averages over the footprint of a pixel ([`super::footprint`]).
//! Colours are weighted by alpha, so that transparent texels do not colour their neighbours. This
//! module does not depend on surfaces.

#![allow(
    clippy::indexing_slicing,
    reason = "arrays of two, three or four numbers, by constants"
)]

pub(crate) mod reader;

use std::fmt;
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::footprint::Taps;
use footlight_show::units::{Rgb, srgb_decode};

/// Most texels along a side: a larger image is halved until it fits.
const MOST_SIDE: usize = 2048;

/// Continuation of an image past its border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Repeats the image.
    Repeat,
    /// Mirrors the image.
    Mirror,
    /// Repeats the border.
    Clamp,
}

/// Meaning of a texture's alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Ignored.
    Opaque,
    /// Light passes where alpha is below this value.
    Mask(f64),
    /// Alpha is the share of light that is stopped.
    Blend,
}

/// Position-dependent colour of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The image; white when only alpha matters.
    pub pixels: Arc<Pixels>,
    /// Factor on its red, green, blue and alpha.
    pub factor: [f64; 4],
    /// Horizontal and vertical.
    pub wrap: [Wrap; 2],
    /// Meaning of alpha.
    pub alpha: Alpha,
    /// A colour that replaces the image's.
    pub paint: Option<[f64; 3]>,
}

impl Texture {
    /// A uniform texture.
    pub fn plain(factor: [f64; 4], alpha: Alpha) -> Texture {
        Texture {
            pixels: Arc::new(Pixels::new([1, 1], &[[255; 4]])),
            factor,
            wrap: [Wrap::Repeat; 2],
            alpha,
            paint: None,
        }
    }

    /// The texture in one colour, with its transparency.
    #[must_use]
    pub fn painted(self, colour: Rgb) -> Texture {
        Texture {
            paint: Some(colour.0),
            ..self
        }
    }

    /// True when light passes somewhere.
    pub fn is_cut(&self) -> bool {
        let [.., least] = self.factor;
        match self.alpha {
            Alpha::Opaque => false,
            Alpha::Mask(_) | Alpha::Blend => least < 1.0 || self.pixels.is_transparent,
        }
    }

    /// Mean reflectance over the parallelogram of `sides` around a position, both relative to the
    /// image's width and height.
    pub fn reflectance(&self, place: [f64; 2], sides: [[f64; 2]; 2]) -> [f64; 3] {
        self.paint.unwrap_or_else(|| {
            let [r, g, b, _] = self.mean(place, sides);
            [r, g, b]
        })
    }

    /// Alpha at a position.
    pub fn alpha(&self, place: [f64; 2]) -> f64 {
        self.mean(place, [[0.0; 2]; 2])[3]
    }

    /// Share of light stopped at a position, 0 to 1.
    pub fn opacity(&self, place: [f64; 2]) -> f64 {
        match self.alpha {
            Alpha::Opaque => 1.0,
            Alpha::Mask(least) => f64::from(u8::from(self.alpha(place) >= least)),
            Alpha::Blend => self.alpha(place),
        }
    }

    /// Mean colour of the opaque part, and alpha, over a parallelogram.
    fn mean(&self, place: [f64; 2], sides: [[f64; 2]; 2]) -> [f64; 4] {
        let texels = self.pixels.size().map(|n| n as f64);
        let scaled = sides.map(|[u, v]| [u * texels[0], v * texels[1]]);
        let taps = Taps::new(scaled.map(|side| side.map(bounded)));
        let share = 1.0 / taps.count() as f64;
        // So that most samples lie within the image.
        let place = [0, 1].map(|k| match self.wrap[k] {
            Wrap::Repeat => place[k] - place[k].floor(),
            Wrap::Clamp | Wrap::Mirror => place[k],
        });
        let mut sum = [0.0; 4];
        let levels = self.pixels.around(taps.size.log2());
        for offset in taps.offsets() {
            let at = [0, 1].map(|k| place[k] + offset[k] / texels[k]);
            let texel = levels.texel(at, self.wrap);
            sum.iter_mut().zip(texel).for_each(|(s, t)| *s += t * share);
        }
        self.coloured(sum)
    }

    /// Applies factor and paint to a premultiplied colour.
    fn coloured(&self, sum: [f64; 4]) -> [f64; 4] {
        let [.., weight] = sum;
        let over = if weight > 0.0 { 1.0 / weight } else { 0.0 };
        let [r, g, b, a] = [0, 1, 2, 3].map(|k| sum[k] * self.factor[k]);
        [r * over, g * over, b * over, a].map(|v| v.clamp(0.0, 1.0))
    }

    /// Its texels, row by row from the top: reflectance of each channel, and share of light
    /// stopped.
    pub fn texels(&self) -> impl Iterator<Item = [f64; 4]> {
        let [width, height] = self.pixels.size();
        let places = (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
        places.map(|(x, y)| {
            let texel = self.pixels.levels.first().map(|level| level.texel(x, y));
            let [r, g, b, a] = self.coloured(texel.unwrap_or_default());
            let [r, g, b] = self.paint.unwrap_or([r, g, b]);
            let stopped = match self.alpha {
                Alpha::Opaque => 1.0,
                Alpha::Mask(least) => f64::from(u8::from(a >= least)),
                Alpha::Blend => a,
            };
            [r, g, b, stopped]
        })
    }

    /// Mean reflectance of the whole image.
    pub fn mean_reflectance(&self) -> [f64; 3] {
        // Larger than any image.
        self.reflectance([0.5; 2], [[1e6, 0.0], [0.0, 1e6]])
    }
}

/// Bounds the length of a footprint that may reach the horizon.
fn bounded(length: f64) -> f64 {
    if length.is_finite() {
        length.clamp(-1e9, 1e9)
    } else {
        0.0
    }
}

/// An image with its smaller levels.
#[derive(Clone, PartialEq)]
pub struct Pixels {
    levels: Vec<Level>,
    is_transparent: bool,
    /// Hash of size and texels, which identifies the image.
    pub digest: [u8; 16],
}

impl fmt::Debug for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size();
        write!(f, "Pixels({width} x {height})")
    }
}

#[derive(Clone, PartialEq)]
struct Level {
    size: [usize; 2],
    /// Red, green and blue times alpha, and alpha. A number stores the square root of its linear
    /// value times 65535, which preserves dark tones.
    texels: Vec<[u16; 4]>,
}

impl Pixels {
    /// From an sRGB-coded image with alpha, row by row from the top. Missing texels are black.
    pub fn new(size: [usize; 2], rgba: &[[u8; 4]]) -> Pixels {
        let table: Vec<f64> = (0..=255_u8)
            .map(|code| srgb_decode(f64::from(code) / 255.0))
            .collect();
        let linear = |code: u8| table.get(usize::from(code)).copied().unwrap_or(0.0);
        let texel = |[r, g, b, a]: &[u8; 4]| {
            let alpha = f64::from(*a) / 255.0;
            let [r, g, b] = [r, g, b].map(|c| alpha * linear(*c));
            [r, g, b, alpha].map(coded)
        };
        let first = Level {
            size,
            texels: rgba.iter().map(texel).collect(),
        };
        let mut hasher = Sha256::new();
        size.iter()
            .for_each(|n| hasher.update((*n as u64).to_le_bytes()));
        hasher.update(rgba.as_flattened());
        let mut digest = [0; 16];
        digest
            .iter_mut()
            .zip(hasher.finalize())
            .for_each(|(to, from)| *to = from);
        let mut levels = vec![first];
        while let Some(last) = levels.last().filter(|l| l.size != [1, 1]) {
            let next = last.halved();
            if next.size.iter().any(|n| *n >= MOST_SIDE) {
                levels.clear();
            }
            levels.push(next);
        }
        if levels.len() > 1
            && levels
                .first()
                .is_some_and(|l| l.size.iter().any(|n| *n > MOST_SIDE))
        {
            levels.remove(0);
        }
        Pixels {
            levels,
            is_transparent: rgba.iter().any(|[.., a]| *a < 255),
            digest,
        }
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        self.levels.first().map_or([1, 1], |level| level.size)
    }

    /// True when a texel is not opaque.
    pub fn is_transparent(&self) -> bool {
        self.is_transparent
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        self.levels
            .iter()
            .map(|l| size_of_val(l.texels.as_slice()))
            .sum()
    }

    /// The two levels around a fractional one.
    fn around(&self, level: f64) -> Between<'_> {
        let last = self.levels.len().saturating_sub(1);
        let level = level.max(0.0).min(last as f64);
        let low = level as usize;
        Between {
            levels: [low, low + 1].map(|index| self.levels.get(index)),
            share: level - low as f64,
        }
    }
}

/// Two levels, and the share of the second.
struct Between<'a> {
    levels: [Option<&'a Level>; 2],
    share: f64,
}

impl Between<'_> {
    /// Premultiplied colour and alpha, linear between texels and between levels.
    fn texel(&self, place: [f64; 2], wrap: [Wrap; 2]) -> [f64; 4] {
        let [near, far] = self.levels;
        let at = |level: &Level| level.bilinear(place, wrap);
        let near = near.map_or([0.0; 4], at);
        match far.filter(|_| self.share > 0.0).map(at) {
            Some(far) => [0, 1, 2, 3].map(|k| near[k] + (far[k] - near[k]) * self.share),
            None => near,
        }
    }
}

impl Level {
    fn texel(&self, x: usize, y: usize) -> [f64; 4] {
        let texel = self.texels.get(y * self.size[0] + x);
        const UNIT: f64 = 1.0 / 65535.0;
        let value = |code: &u16| (f64::from(*code) * UNIT).powi(2);
        texel.map_or([0.0; 4], |texel| [0, 1, 2, 3].map(|k| value(&texel[k])))
    }

    fn bilinear(&self, place: [f64; 2], wrap: [Wrap; 2]) -> [f64; 4] {
        let axis = |k: usize| {
            let at = place[k] * self.size[k] as f64 - 0.5;
            // Most samples lie within the image.
            let within = at as usize;
            if at >= 0.0 && within + 1 < self.size[k] {
                return (within, within + 1, at - within as f64);
            }
            let low = at.floor();
            let index = |i: f64| wrapped(i, self.size[k], wrap[k]);
            (index(low), index(low + 1.0), at - low)
        };
        let ((x0, x1, s), (y0, y1, t)) = (axis(0), axis(1));
        let mix = |a: [f64; 4], b: [f64; 4], s: f64| [0, 1, 2, 3].map(|k| a[k] + (b[k] - a[k]) * s);
        let top = mix(self.texel(x0, y0), self.texel(x1, y0), s);
        let bottom = mix(self.texel(x0, y1), self.texel(x1, y1), s);
        mix(top, bottom, t)
    }

    /// The next level: half as many texels on each side, rounded up; each the mean of its area.
    fn halved(&self) -> Level {
        let [width, height] = self.size.map(|n| n.div_ceil(2));
        let columns = footlight_picture::shrink::overlaps(self.size[0], width);
        let rows = footlight_picture::shrink::overlaps(self.size[1], height);
        let mut texels = Vec::with_capacity(width * height);
        for rows in rows {
            for columns in &columns {
                let mut sum = [0.0; 4];
                for (y, a) in &rows {
                    for (x, b) in columns {
                        let texel = self.texel(*x, *y);
                        sum.iter_mut().zip(texel).for_each(|(s, t)| *s += a * b * t);
                    }
                }
                texels.push(sum.map(coded));
            }
        }
        Level {
            size: [width, height],
            texels,
        }
    }
}

fn coded(value: f64) -> u16 {
    (value.max(0.0).sqrt() * 65535.0).round() as u16
}

/// Texel index for one that may be past the border.
fn wrapped(index: f64, count: usize, wrap: Wrap) -> usize {
    let most = count.saturating_sub(1);
    if !index.is_finite() {
        return 0;
    }
    let n = count as f64;
    // Much faster than the remainder of a division, and exact for whole numbers.
    let modulo = |n: f64| index - n * (index / n).floor();
    let within = match wrap {
        Wrap::Clamp => index.clamp(0.0, most as f64),
        Wrap::Repeat => modulo(n),
        Wrap::Mirror => {
            let at = modulo(2.0 * n);
            if at < n { at } else { 2.0 * n - 1.0 - at }
        }
    };
    (within as usize).min(most)
}

#[cfg(test)]
mod tests;
