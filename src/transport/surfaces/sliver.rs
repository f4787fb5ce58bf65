//! Slivers: pieces that are so thin in an image that they may pass between its sub-pixels, such as
//! a window sill or a table top at the height of the eye, or a wire.
//!
//! A sliver is listed for every pixel that its boundary passes through, unless what the item buffer
//! holds around it is nearer. This module does not depend on materials or light.

use std::ops::Range;

use crate::surfaces::raster::ItemBuffer;
use footlight_show::geometry::Vec3;

/// Mean width below which a piece counts as thin, sub-pixels: wider ones cover a sub-pixel's centre
/// nearly everywhere.
const THIN: f64 = 1.5;

/// The slivers of some rows of pixels.
#[derive(Clone, Debug, Default)]
pub struct Slivers {
    /// Items and the vertices of their outlines: ranges of `vertices`.
    outlines: Vec<(u32, Range<usize>)>,
    /// Position in sub-pixels and depth.
    vertices: Vec<Vec3>,
    /// Pixels and the items of slivers in them, sorted.
    found: Vec<(usize, u32)>,
}

impl Slivers {
    /// Removes all slivers.
    pub fn clear(&mut self) {
        self.outlines.clear();
        self.vertices.clear();
        self.found.clear();
    }

    /// Keeps the outline of the piece drawn last if it is thin where the buffer shows it; it covers
    /// this number of sub-pixels.
    pub fn add(&mut self, item: u32, covered: usize, buffer: &ItemBuffer) {
        let outline = buffer.outline();
        let sides = outline.iter().zip(outline.iter().cycle().skip(1));
        let around: f64 = sides.map(|(a, b)| buffer.length_inside(*a, *b)).sum();
        if 2.0 * (covered as f64) < THIN * around {
            let from = self.vertices.len();
            self.vertices.extend_from_slice(outline);
            self.outlines.push((item, from..self.vertices.len()));
        }
    }

    /// Finds the pixels of the slivers in a finished buffer; `pixel` gives that of a sub-pixel.
    pub fn find(&mut self, buffer: &ItemBuffer, pixel: impl Fn([usize; 2]) -> Option<usize>) {
        for (item, range) in &self.outlines {
            let outline = self.vertices.get(range.clone()).unwrap_or_default();
            for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                let seen = buffer.in_sight(*a, *b).filter_map(&pixel);
                self.found.extend(seen.map(|pixel| (pixel, *item)));
            }
        }
        self.found.sort_unstable();
        self.found.dedup();
    }

    /// Items of the slivers in a pixel.
    pub fn of(&self, pixel: usize) -> impl Iterator<Item = u32> {
        let from = self.found.partition_point(|(at, _)| *at < pixel);
        let rest = self.found.get(from..).unwrap_or_default().iter();
        rest.take_while(move |(at, _)| *at == pixel)
            .map(|(_, item)| *item)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use crate::surfaces::camera::Window;
    use crate::surfaces::fragment::{Fragments, Outline, Sampling, Split, fragments};
    use crate::surfaces::rectangle;
    use crate::surfaces::surface::Surfaces;
    use footlight_host::work::Work;
    use footlight_show::geometry::{Vec3, View, vec3};

    /// Fragments of 8 x 8 pixels, each 0.25 wide at distance 1, of a wall at distance 3 and another
    /// rectangle.
    fn seen(other: [Vec3; 4]) -> Fragments {
        let wall = rectangle((-9.0, 9.0), (-9.0, 9.0), -3.0);
        let surfaces = Surfaces::grey(vec![wall.to_vec(), other.to_vec()]);
        let view = View {
            from: Vec3::ZERO,
            to: vec3(0.0, 0.0, -1.0),
            fov: 90.0,
            width: 8,
            height: 8,
            roll: 0.0,
        };
        let sampling = Sampling::new(Split::Whole, Split::Whole, Split::Whole);
        let window = Window::new(&view).unwrap();
        fragments(&surfaces, &window, sampling, Work::silent()).unwrap()
    }

    /// Pixels covered by each of the two facets.
    fn areas(fragments: &Fragments) -> [f32; 2] {
        let all = fragments.pixels.items();
        [0, 1].map(|facet| {
            let own = all.iter().filter(|f| f.facet == facet);
            own.map(|f| f.weight).sum()
        })
    }

    #[test]
    fn a_wire_between_the_sub_pixels_covers_its_exact_share() {
        let wires = [
            rectangle((0.12, 0.122), (-0.5, 0.5), -1.0),
            rectangle((0.1249, 0.1269), (-0.5, 0.5), -1.0),
            rectangle((-0.5, 0.5), (0.249, 0.251), -1.0),
        ];
        for wire in wires {
            let [wall, own] = areas(&seen(wire));
            assert!((own - 4.0 * 0.008).abs() < 1e-5, "{own}");
            assert!((wall + own - 64.0).abs() < 1e-4, "{wall}");
        }
    }

    /// Its outline leaves the image, and in one case passes the eye.
    #[test]
    fn a_long_sliver_is_found_where_it_is_in_the_image() {
        let across = rectangle((-1e4, 1e4), (0.12, 0.122), -1.0);
        let wire = |x: f64, z: f64| vec3(x, -0.5, z);
        let past = [
            wire(0.1, 5.0),
            wire(0.1004, 5.0),
            wire(0.1004, -2.5),
            wire(0.1, -2.5),
        ];
        let [_, own] = areas(&seen(across));
        assert!((own - 8.0 * 0.008).abs() < 1e-5, "{own}");
        // 8e-4 s wide at the slope s, from 0.2 at its far end to 1 at the lower edge.
        let [_, own] = areas(&seen(past));
        let exact = 4e-4 * (1.0 - 0.04) / 0.0625;
        assert!((own / exact - 1.0).abs() < 0.01, "{own} {exact}");
    }

    #[test]
    fn a_hidden_sliver_costs_nothing() {
        let hidden = seen(rectangle((0.12, 0.122), (-0.5, 0.5), -4.0));
        let mut all = hidden.pixels.items().iter();
        assert!(all.all(|f| matches!(f.outline, Outline::Square(..)) && f.facet == 0));
    }
}
