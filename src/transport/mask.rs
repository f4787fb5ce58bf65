//! Shadows on a panel as bits: what a point sees of it, by 256 samples.
//!
//! A polygon's shadow on a panel is where all its edges, seen from the point, are on the inner side;
//! what one straight line leaves of the samples stands in a table, so that a shadow is the
//! conjunction of a few table entries and an occluder costs some 80 ns, a quarter of what cutting the
//! panel exactly does (`lambert`). After Schwarz and Stamminger, "Bitmask Soft Shadows" (2007). The samples are a
//! rank-1 lattice: a line across the panel divides them to .37 % of the panel as root mean square,
//! .46 % with the rounding of the table (regular samples: 6 % along their rows). As the samples stay where
//! they are, neighbouring points err alike: of a little light that comes through a gap that makes
//! streaks, so callers ask how much is left before they believe it. This room knows one point and
//! one polygon.

#![allow(
    clippy::indexing_slicing,
    reason = "the table has an entry for each direction and offset; corners are numbered modulo"
)]

use crate::geometry::{Vec3, greater, part_above, smaller, vec3};
use crate::transport::stencil::{Place, Rectangle};
use crate::transport::surface::Piece;
use std::sync::LazyLock;

/// Samples of a panel.
const SAMPLES: usize = 256;

/// Sample `i` is at `(i, i * GENERATOR mod SAMPLES)`: of all odd ones that under which random
/// lines err least.
const GENERATOR: usize = 117;

/// Cells along a side of the panel, within which the light's strength is taken as even.
const CELLS: usize = 4;

/// Directions of a line in a quarter of a turn.
const LEVELS: usize = 32;

/// Places of a line of one direction.
const OFFSETS: usize = 128;

/// What the shadow of a random triangle is wrong by as root mean square, as a share of the panel:
/// more than a line's .46 %, as two or three edges lie on the panel.
const ROUGH: f64 = 0.007;

/// A corner that lies lower than this part of the panel's height, as the point sees both, is cut
/// away with what is beside it.
const LOW: f64 = 1e-6;

/// A set of samples: 16 of each cell side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bits([u64; SAMPLES / 64]);

impl Bits {
    const ALL: Bits = Bits([u64::MAX; SAMPLES / 64]);
    const NONE: Bits = Bits([0; SAMPLES / 64]);

    #[inline(always)]
    fn and(self, o: Bits) -> Bits {
        Bits([0, 1, 2, 3].map(|k| self.0[k] & o.0[k]))
    }

    #[inline(always)]
    fn without(self, o: Bits) -> Bits {
        Bits([0, 1, 2, 3].map(|k| self.0[k] & !o.0[k]))
    }

    /// Samples in each cell.
    fn counts(self) -> [u32; CELLS * CELLS] {
        std::array::from_fn(|cell| (self.0[cell / 4] >> (16 * (cell % 4)) & 0xffff).count_ones())
    }
}

/// Places of the samples, from -1 to 1 both ways: cell by cell, row by row of cells.
static PLACES: LazyLock<Vec<Place>> = LazyLock::new(|| {
    let place = |i: usize| (i as f64 + 0.5) * 2.0 / SAMPLES as f64 - 1.0;
    let mut all: Vec<[usize; 2]> = (0..SAMPLES).map(|i| [i, i * GENERATOR % SAMPLES]).collect();
    // As many in each cell: sorted into rows, and each row into cells.
    all.sort_unstable_by_key(|p| p[1]);
    for row in all.chunks_mut(SAMPLES / CELLS) {
        row.sort_unstable_by_key(|p| p[0]);
    }
    all.iter().map(|p| p.map(place)).collect()
});

/// The samples on the positive side of `a x + b y + c` for `a >= 0` and `|a| + |b| = 1`.
static TABLE: LazyLock<Vec<Bits>> = LazyLock::new(|| {
    let mut all = Vec::with_capacity(2 * LEVELS * OFFSETS);
    for sign in [1.0, -1.0] {
        for level in 0..LEVELS {
            let a = level as f64 / (LEVELS - 1) as f64;
            let b = sign * (1.0 - a);
            let heights: Vec<f64> = PLACES.iter().map(|p| a * p[0] + b * p[1]).collect();
            let mut order: Vec<usize> = (0..SAMPLES).collect();
            order.sort_unstable_by(|i, j| heights[*j].total_cmp(&heights[*i]));
            let (mut bits, mut rest) = (Bits::NONE, order.iter().peekable());
            for offset in 0..OFFSETS {
                let c = (offset as f64 + 0.5) * 2.0 / OFFSETS as f64 - 1.0;
                while let Some(&i) = rest.next_if(|i| heights[**i] + c > 0.0) {
                    bits.0[i / 64] |= 1 << (i % 64);
                }
                all.push(bits);
            }
        }
    }
    all
});

/// The samples on the positive side of `c + a x + b y`.
#[inline(always)]
fn side(table: &[Bits], c: f64, a: f64, b: f64) -> Bits {
    let reach = a.abs() + b.abs();
    if c >= reach {
        return Bits::ALL;
    }
    if c <= -reach || reach.is_nan() {
        return Bits::NONE;
    }
    let flip = if a < 0.0 { -1.0 } else { 1.0 };
    let scale = flip / reach;
    let level = (a * scale * (LEVELS - 1) as f64 + 0.5) as usize;
    let offset = ((c * scale + 1.0) * (OFFSETS / 2) as f64) as usize;
    let turned = if b * flip < 0.0 { LEVELS } else { 0 };
    let bits = table[(turned + level) * OFFSETS + offset.min(OFFSETS - 1)];
    if flip < 0.0 {
        Bits::ALL.without(bits)
    } else {
        bits
    }
}

/// The samples in a convex polygon.
fn within(corners: &[Place]) -> Bits {
    let mut bits = Bits::NONE;
    for (i, p) in PLACES.iter().enumerate() {
        let inside = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0
        };
        if (0..corners.len()).all(inside) {
            bits.0[i / 64] |= 1 << (i % 64);
        }
    }
    bits
}

/// A convex polygon that shines, in the square of its samples.
#[derive(Clone, Debug)]
pub struct Screen {
    middle: Vec3,
    normal: Vec3,
    /// From the middle to the sides of the square.
    axes: [Vec3; 2],
    /// Those over their squares.
    scales: [Vec3; 2],
    /// The samples on the polygon.
    own: Bits,
}

/// How a point sees a screen.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    point: Vec3,
    /// Of the point before the screen, metres.
    height: f64,
    /// The point's place on the screen.
    foot: Place,
    /// Light of each cell's samples, in a measure of its own.
    strengths: [f64; CELLS * CELLS],
    /// The samples above the point's horizon.
    above: Bits,
    whole: f64,
    /// How wrong what it sees past occluders may be, as a share of all its light.
    pub rough: f64,
}

impl Screen {
    /// Of a polygon with this unit normal; `None` for one without extent.
    pub fn new(corners: &[Vec3], normal: Vec3) -> Option<Screen> {
        let next = |i: usize| corners[(i + 1) % corners.len()];
        let sides = corners.iter().enumerate().map(|(i, c)| next(i) - *c);
        let longest = sides.max_by(|a, b| a.dot(*a).total_cmp(&b.dot(*b)))?;
        let along = longest.normalized();
        let frame = [along, normal.cross(along)];
        let places: Vec<Place> = corners.iter().map(|c| frame.map(|a| a.dot(*c))).collect();
        let Rectangle([left, right, low, high]) = Rectangle::of(&places);
        let halves = [0.5 * (right - left), 0.5 * (high - low)];
        if !halves.iter().all(|h| *h > 0.0) {
            return None;
        }
        let centre = [0.5 * (right + left), 0.5 * (high + low)];
        let height = normal.dot(corners[0]);
        let middle = frame[0] * centre[0] + frame[1] * centre[1] + normal * height;
        let axes = [frame[0] * halves[0], frame[1] * halves[1]];
        let scales = [frame[0] * (1.0 / halves[0]), frame[1] * (1.0 / halves[1])];
        let flat: Vec<Place> = corners
            .iter()
            .map(|c| scales.map(|s| s.dot(*c - middle)))
            .collect();
        // Corners in corners of the square: a rectangle.
        let is_corner = |p: &Place| p.iter().all(|x| x.abs() > 1.0 - 1e-9);
        let own = if flat.iter().all(is_corner) {
            Bits::ALL
        } else {
            within(&flat)
        };
        Some(Screen {
            middle,
            normal,
            axes,
            scales,
            own,
        })
    }

    /// From a point before it on a surface of unit `normal`; `None` where no sample is seen.
    pub fn seen_from(&self, point: Vec3, normal: Vec3) -> Option<Sight> {
        let way = self.middle - point;
        let line = [
            normal.dot(way),
            normal.dot(self.axes[0]),
            normal.dot(self.axes[1]),
        ];
        let above = self.own.and(side(&TABLE, line[0], line[1], line[2]));
        let mut strengths = [0.0; CELLS * CELLS];
        for (i, s) in strengths.iter_mut().enumerate() {
            let place = |k: usize| (2 * k + 1) as f64 / CELLS as f64 - 1.0;
            let (x, y) = (place(i % CELLS), place(i / CELLS));
            let to = way + self.axes[0] * x + self.axes[1] * y;
            let square = to.dot(to);
            *s = greater(line[0] + line[1] * x + line[2] * y, 0.0) / (square * square);
        }
        let (mut whole, mut most) = (0.0, 0.0);
        let mut samples = 0;
        for (s, n) in strengths.iter().zip(above.counts()) {
            whole += s * f64::from(n);
            samples += n;
            most = greater(most, *s);
        }
        (whole > 0.0).then(|| Sight {
            point,
            height: -self.normal.dot(way),
            foot: self.scales.map(|s| -s.dot(way)),
            strengths,
            above,
            whole,
            // A panel that fills a part of its square has as few samples more wrong.
            rough: ROUGH * most * SAMPLES as f64 / whole
                * (f64::from(samples) / SAMPLES as f64).sqrt(),
        })
    }
}

/// Working memory for one thread.
#[derive(Debug, Default)]
pub struct Masker {
    /// Corners of the occluder at hand: along the screen's sides from the point, in the square's
    /// units, and towards the screen.
    corners: Vec<Vec3>,
    flat: Vec<Place>,
}

impl Masker {
    /// How much of a screen's light passes the `occluders`, 0 to 1; those whose plane holds the
    /// point (within `touching`) do not block.
    pub fn passes<'a>(
        &mut self,
        screen: &Screen,
        sight: &Sight,
        occluders: impl Iterator<Item = &'a Piece>,
        touching: f64,
    ) -> f64 {
        let table = TABLE.as_slice();
        let mut open = sight.above;
        for piece in occluders {
            open = open.without(self.shadow(table, screen, sight, piece, touching));
            if open == Bits::NONE {
                return 0.0;
            }
        }
        if open == sight.above {
            return 1.0;
        }
        let lights = sight.strengths.iter().zip(open.counts());
        let sum: f64 = lights.map(|(s, n)| s * f64::from(n)).sum();
        sum / sight.whole
    }

    fn shadow(
        &mut self,
        table: &[Bits],
        screen: &Screen,
        sight: &Sight,
        piece: &Piece,
        touching: f64,
    ) -> Bits {
        let own = piece.normal.dot(piece.vertices[0] - sight.point);
        if own.abs() <= touching {
            return Bits::NONE;
        }
        let low = LOW * sight.height;
        self.corners.resize(piece.vertices.len(), Vec3::ZERO);
        let (mut nearest, mut farthest) = (f64::INFINITY, f64::NEG_INFINITY);
        for (corner, v) in self.corners.iter_mut().zip(&piece.vertices) {
            let way = *v - sight.point;
            let z = -screen.normal.dot(way);
            (nearest, farthest) = (smaller(nearest, z), greater(farthest, z));
            *corner = vec3(screen.scales[0].dot(way), screen.scales[1].dot(way), z);
        }
        if farthest <= low || nearest >= sight.height - touching {
            return Bits::NONE;
        }
        if nearest < low {
            self.corners = part_above(&self.corners, |c| c.z - low);
        }
        if farthest > sight.height {
            self.corners = part_above(&self.corners, |c| sight.height - c.z);
        }
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        self.flat.resize(self.corners.len(), [0.0; 2]);
        for (place, c) in self.flat.iter_mut().zip(&self.corners) {
            let scale = sight.height / c.z;
            *place = [sight.foot[0] + c.x * scale, sight.foot[1] + c.y * scale];
            for k in 0..2 {
                least[k] = smaller(least[k], place[k]);
                most[k] = greater(most[k], place[k]);
            }
        }
        if least[0] >= 1.0 || most[0] <= -1.0 || least[1] >= 1.0 || most[1] <= -1.0 {
            return Bits::NONE;
        }
        let Some(&last) = self.flat.last() else {
            return Bits::NONE;
        };
        // Seen from its front a piece goes round anticlockwise, and so does the screen.
        let turn = -own.signum();
        let mut bits = Bits::ALL;
        let mut a = last;
        for &b in &self.flat {
            let (x, y) = ((a[1] - b[1]) * turn, (b[0] - a[0]) * turn);
            bits = bits.and(side(table, -(x * a[0] + y * a[1]), x, y));
            if bits == Bits::NONE {
                return bits;
            }
            a = b;
        }
        bits
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::geometry::{newell, vec3};
    use crate::transport::hemicube::scatter;
    use crate::transport::lambert::{Clipper, Pane};
    use std::slice::from_ref;

    const UP: Vec3 = vec3(0.0, 0.0, 1.0);

    /// Looks down from 2 m above a floor.
    fn lamp() -> Vec<Vec3> {
        let corners = [(-1.0, -0.5), (-1.0, 0.5), (1.0, 0.5), (1.0, -0.5)];
        corners.map(|(x, y)| vec3(x, y, 2.0)).to_vec()
    }

    fn piece(vertices: Vec<Vec3>) -> Piece {
        Piece {
            normal: newell(&vertices).normalized(),
            vertices,
            facet: 0,
        }
    }

    fn level(x: (f64, f64), y: (f64, f64), z: f64) -> Piece {
        let corners = [(x.0, y.0), (x.1, y.0), (x.1, y.1), (x.0, y.1)];
        piece(corners.map(|(x, y)| vec3(x, y, z)).to_vec())
    }

    /// Share of the lamp's light at a point of the floor, by masks and exactly, and how wrong the
    /// first may be.
    fn shares(corners: &[Vec3], point: Vec3, occluders: &[Piece]) -> ([f64; 2], f64) {
        let normal = newell(corners).normalized();
        let screen = Screen::new(corners, normal).unwrap();
        let sight = screen.seen_from(point, UP).unwrap();
        let found = Masker::default().passes(&screen, &sight, occluders.iter(), 1e-9);
        let (mut clipper, pane) = (Clipper::default(), Pane::new(corners.to_vec(), normal));
        let left = clipper.occluded(point, UP, &pane, occluders.iter(), 1e-9);
        let exact = left / clipper.unoccluded(point, UP, &pane);
        ([found, exact], sight.rough)
    }

    /// Random triangles, some of them through the plane of the lamp or of the floor, before lamps
    /// with four corners and with three.
    #[test]
    fn shadows_err_as_little_as_is_said() {
        let mut random = (0..).map(scatter);
        let mut next = |low: f64, high: f64| low + (high - low) * random.next().unwrap();
        for corners in [lamp(), lamp()[..3].to_vec()] {
            let (mut square, mut worst, mut shaded, mut crossed) = (0.0, 0.0_f64, 0.0, 0);
            for _ in 0..4000 {
                let mut corner = || vec3(next(-1.5, 1.5), next(-1.5, 1.5), next(-0.3, 2.3));
                let occluder = piece([(); 3].map(|()| corner()).to_vec());
                let point = vec3(next(-1.5, 1.5), next(-1.5, 1.5), 0.0);
                let ([found, exact], rough) = shares(&corners, point, from_ref(&occluder));
                let apart = (found - exact).abs() / rough;
                worst = worst.max(apart);
                if exact > 1e-9 && exact < 1.0 - 1e-9 {
                    square += apart * apart;
                    shaded += 1.0;
                    let mut heights = occluder.vertices.iter().map(|v| v.z);
                    crossed += usize::from(heights.any(|z| !(0.0..=2.0).contains(&z)));
                }
            }
            let error = f64::sqrt(square / shaded);
            println!("{shaded} shadows, {crossed} of them cut: {error:.3}, worst {worst:.2}");
            assert!(shaded > 500.0 && crossed > 100, "{shaded} {crossed}");
            assert!(
                error < 1.05 && error > 0.5 && worst < 6.0,
                "{error} {worst}"
            );
        }
    }

    /// Samples in rows take a line along a row for a whole row: a sixteenth of the lamp.
    #[test]
    fn samples_do_not_stand_in_rows() {
        let exact = |x: f64| 0.5 * (x + 1.0);
        let (mut naive, mut own) = (0.0_f64, 0.0_f64);
        for i in 0..100 {
            let x = f64::from(i) * 0.02 - 0.99;
            let row = |k: i32| (f64::from(k) + 0.5) / 8.0 - 1.0;
            let rows = (0..16).filter(|k| row(*k) < x).count() as f64 / 16.0;
            naive = naive.max((rows - exact(x)).abs());
            let counts = side(&TABLE, x, -1.0, 0.0).counts();
            let share = f64::from(counts.iter().sum::<u32>()) / SAMPLES as f64;
            own = own.max((share - exact(x)).abs());
        }
        assert!(naive > 0.025 && own < 0.007, "{naive} {own}");
    }

    #[test]
    fn what_covers_all_or_nothing_does_so_exactly() {
        let point = vec3(0.1, 0.2, 0.0);
        let far = (-9.0, 9.0);
        let share = |occluders: &[Piece]| shares(&lamp(), point, occluders).0;
        assert_eq!(share(&[level(far, far, 1.0)]), [0.0, 0.0]);
        assert_eq!(share(&[level(far, far, 2.5)]), [1.0, 1.0]);
        assert_eq!(share(&[level(far, far, 2.0)]), [1.0, 1.0]);
        assert_eq!(share(&[level(far, far, -0.5)]), [1.0, 1.0]);
        assert_eq!(share(&[level(far, far, 0.0)]), [1.0, 1.0]);
        assert_eq!(share(&[level((3.0, 4.0), (3.0, 4.0), 1.0)]), [1.0, 1.0]);
        // Two halves that meet leave nothing between them, at any height.
        let halves = [level((-9.0, 0.0), far, 1.0), level((0.0, 9.0), far, 1.0)];
        assert_eq!(share(&halves)[0], 0.0);
    }

    /// Close to the lamp its cells differ too much for their samples to count alike.
    #[test]
    fn a_near_lamp_is_told() {
        let screen = Screen::new(&lamp(), -UP).unwrap();
        let rough = |height: f64| {
            let point = vec3(0.9, 0.4, 2.0 - height);
            screen.seen_from(point, UP).unwrap().rough
        };
        assert!(rough(4.0) < 1.2 * ROUGH, "{}", rough(4.0));
        assert!(rough(0.2) > 10.0 * ROUGH, "{}", rough(0.2));
    }
}
