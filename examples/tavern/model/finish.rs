//! Finishes of surfaces: small grey images that are multiplied by material colours, and their
//! placement.
//!
//! Values are display-coded. Only sums, products and square roots are used, and irregularities come
//! from hashed integers, so that every machine paints equal pixels. Every image tiles at its
//! borders.

use super::solid::{Face, Point};

/// Pixels on a side.
pub const SIDE: usize = 256;

/// Placement of an image on the faces of a material.
#[derive(Clone, Copy, Debug)]
pub struct Finish {
    /// The file's name without its extension.
    pub image: &'static str,
    /// Width and height of the image, metres.
    pub size: [f64; 2],
    /// True when its height follows a face's longer side, with another offset for each face;
    /// otherwise it is upright, on floors upstage.
    pub grain: bool,
}

/// An image that lies upright.
pub const fn upright(image: &'static str, size: [f64; 2]) -> Option<Finish> {
    Some(Finish {
        image,
        size,
        grain: false,
    })
}

/// An image that runs along its pieces.
pub const fn grain(image: &'static str, size: [f64; 2]) -> Option<Finish> {
    Some(Finish {
        image,
        size,
        grain: true,
    })
}

impl Finish {
    /// Positions of a face's corners in the image, from its left and its foot; `number` is the
    /// face's.
    pub fn places(&self, face: &Face, number: usize) -> Vec<[f64; 2]> {
        let [across, up] = axes(&face.vertices);
        let along = |axis: Point| {
            let lengths = face.vertices.iter().map(|p| dot(*p, axis));
            let low = lengths.clone().fold(f64::INFINITY, f64::min);
            lengths.fold(f64::NEG_INFINITY, f64::max) - low
        };
        let turned = self.grain && along(across) > along(up);
        let [u, v] = if turned { [up, across] } else { [across, up] };
        let shift = match self.grain {
            true => [hash(number as i64, 1), hash(number as i64, 2)],
            false => [0.0; 2],
        };
        let [wide, high] = self.size;
        let place = |p: &Point| [dot(*p, u) / wide + shift[0], dot(*p, v) / high + shift[1]];
        face.vertices.iter().map(place).collect()
    }
}

/// Horizontal and vertical direction on a face; X and Y for a horizontal one.
fn axes(vertices: &[Point]) -> [Point; 2] {
    let [x, y, z] = normal(vertices);
    let level = (x * x + y * y).sqrt();
    if level < 0.3 {
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    }
    let across = [-y / level, x / level, 0.0];
    let [ax, ay, _] = across;
    [across, [-z * ay, z * ax, x * ay - y * ax]]
}

/// The unit normal of a planar polygon (Newell).
pub fn normal(vertices: &[Point]) -> Point {
    let next = vertices.iter().cycle().skip(1);
    let mut sum = [0.0; 3];
    for ([px, py, pz], [qx, qy, qz]) in vertices.iter().zip(next) {
        sum[0] += (py - qy) * (pz + qz);
        sum[1] += (pz - qz) * (px + qx);
        sum[2] += (px - qx) * (py + qy);
    }
    unit(sum)
}

/// A vector at length 1.
pub fn unit([x, y, z]: Point) -> Point {
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

fn dot([ax, ay, az]: Point, [bx, by, bz]: Point) -> f64 {
    ax * bx + ay * by + az * bz
}

/// An image: a value from 0 to 1 at each position (both 0 to 1, from the left and from the top).
pub type Painter = fn(f64, f64) -> f64;

/// Grey, 8 bits, row by row from the top, in few steps so that the file is small.
pub fn paint(painter: Painter) -> Vec<u8> {
    const STEPS: f64 = 60.0;
    let place = |i: usize| (i as f64 + 0.5) / SIDE as f64;
    let mut out = Vec::with_capacity(SIDE * SIDE);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let value = painter(place(x), place(y)).clamp(0.0, 1.0);
            out.push((255.0 * (STEPS * value).round() / STEPS).round() as u8);
        }
    }
    out
}

/// The mean of an image in light, to three digits.
pub fn mean(painter: Painter) -> f64 {
    let image = paint(painter);
    let light = image.iter().map(|code| {
        let coded = f64::from(*code) / 255.0;
        footlight_show::units::srgb_decode(coded)
    });
    let mean = light.sum::<f64>() / (SIDE * SIDE) as f64;
    (mean * 1000.0).round() / 1000.0
}

/// Five boards side by side, each jointed elsewhere.
pub fn boards(u: f64, v: f64) -> f64 {
    let (board, across) = cell(5.0 * u);
    let (plank, along) = cell(2.0 * v + hash(board, 71) * 2.0);
    let piece = board + 5 * plank.rem_euclid(2);
    let tone = 0.72 + 0.2 * hash(piece, 3);
    let wood = wood(across * 0.2 + 0.21 * piece as f64, v, 8) - 0.5;
    let gap = near(across, 0.035).max(near(along, 0.006));
    (tone + 0.34 * wood) * (1.0 - 0.62 * gap)
}

/// Wood of one piece.
pub fn timber(u: f64, v: f64) -> f64 {
    0.82 + 0.5 * (wood(u, v, 8) - 0.5)
}

/// Fibres that run along v, with growth rings that wander.
fn wood(u: f64, v: f64, fibres: i64) -> f64 {
    let bend = noise([u * 4.0, v * 3.0], [4, 3]);
    let ring = (u * 16.0 + 3.0 * bend).rem_euclid(1.0);
    let ring = 1.0 - (2.0 * ring - 1.0) * (2.0 * ring - 1.0);
    let fibre = fractal([u * 8.0 * fibres as f64, v * 6.0], [8 * fibres, 6], 3);
    0.35 * ring + 0.65 * fibre
}

/// Lime plaster, worn in clouds, with hair cracks.
pub fn plaster(u: f64, v: f64) -> f64 {
    let cloud = fractal([u * 5.0, v * 5.0], [5, 5], 4);
    let crack = fractal([u * 4.0 + 9.0, v * 4.0 + 5.0], [4, 4], 4) - 0.5;
    let crack = (1.0 - 90.0 * crack.abs()).max(0.0) * (3.0 * cloud - 1.2).clamp(0.0, 1.0);
    0.70 + 0.34 * cloud - 0.06 * crack
}

/// Eight courses of bricks in running bond.
pub fn brick(u: f64, v: f64) -> f64 {
    courses(u, v, [4.0, 8.0], [0.05, 0.1])
}

/// Four courses of dressed stone.
pub fn masonry(u: f64, v: f64) -> f64 {
    courses(u, v, [2.0, 4.0], [0.015, 0.03])
}

fn courses(u: f64, v: f64, [across, high]: [f64; 2], joint: [f64; 2]) -> f64 {
    let (course, y) = cell(high * v);
    let (stone, x) = cell(across * u + 0.5 * (course.rem_euclid(2)) as f64);
    let stone = stone.rem_euclid(across as i64) + 16 * course;
    let rough = fractal([u * 16.0, v * 16.0], [16, 16], 2) - 0.5;
    let rim = near(x, joint[0]).max(near(y, joint[1]));
    let bevel = 0.4 * near(x, 3.0 * joint[0]).max(near(y, 3.0 * joint[1]));
    let tone = 0.72 + 0.24 * hash(stone, 5) + 0.36 * rough;
    tone * (1.0 - 0.42 * rim.max(bevel))
}

/// Paving worn smooth: four slabs, their joints and stains.
pub fn paving(u: f64, v: f64) -> f64 {
    let ((i, x), (j, y)) = (cell(2.0 * u), cell(2.0 * v));
    let stain = fractal([u * 6.0, v * 6.0], [6, 6], 5);
    let joint = near(x, 0.018).max(near(y, 0.018));
    (0.66 + 0.1 * hash(i, j + 40) + 0.38 * stain) * (1.0 - 0.5 * joint)
}

/// Roof tiles: rows of hollow ones under round ones.
pub fn tiles(u: f64, v: f64) -> f64 {
    let ((column, x), (row, y)) = (cell(8.0 * u), cell(6.0 * v));
    let round = (1.0 - (2.0 * x - 1.0) * (2.0 * x - 1.0)).sqrt();
    let lip = near(y, 0.12) * 0.45;
    let tone = 0.14 * hash(column, row + 9) + 0.12 * fractal([u * 16.0, v * 16.0], [16, 16], 2);
    (0.42 + 0.42 * round + tone) * (1.0 - lip)
}

/// Brocade: a lattice of lozenges, in each a flower of four petals, woven.
pub fn brocade(u: f64, v: f64) -> f64 {
    let (p, q) = (4.0 * (u + v), 4.0 * (u - v));
    let ((_, x), (_, y)) = (cell(p), cell(q));
    let (x, y) = (2.0 * x - 1.0, 2.0 * y - 1.0);
    let line = (1.0 - 9.0 * (1.0 - x.abs().max(y.abs()))).max(0.0);
    let far = (x * x + y * y).sqrt();
    let petal = 4.0 * (x * y).abs() / (far * far + 0.02);
    let flower = if far < 0.25 + 0.42 * petal.min(1.0) {
        1.0
    } else {
        0.0
    };
    let worn = fractal([u * 8.0, v * 8.0], [8, 8], 2) - 0.5;
    0.81 + 0.18 * f64::max(line, 0.8 * flower) + 0.1 * worn
}

/// Studded doors: four rows of nails on lacquered planks.
pub fn studs(u: f64, v: f64) -> f64 {
    let ((_, x), (_, y)) = (cell(4.0 * u), cell(4.0 * v));
    let (x, y) = (x - 0.5, y - 0.5);
    let far = (x * x + y * y).sqrt();
    let stud = if far < 0.2 {
        1.0 - 0.9 * (x - y + 0.2)
    } else {
        0.0
    };
    let plank = near(cell(2.0 * u).1, 0.03);
    (0.66 + 0.16 * wood(u, v, 8) + 0.3 * stud) * (1.0 - 0.5 * plank)
}

/// Index of a row's cell, and the position in it.
fn cell(x: f64) -> (i64, f64) {
    (x.floor() as i64, x - x.floor())
}

/// 1 at both ends of a cell, 0 from `width` on.
fn near(x: f64, width: f64) -> f64 {
    (1.0 - x.min(1.0 - x) / width).clamp(0.0, 1.0)
}

/// A hash from 0 to 1 for each pair of integers.
fn hash(x: i64, y: i64) -> f64 {
    let mut n = (x.wrapping_mul(374_761_393) ^ y.wrapping_mul(668_265_263)) as u64;
    n = (n ^ (n >> 13)).wrapping_mul(1_274_126_177);
    n = (n ^ (n >> 16)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (n >> 40) as f64 / (1_u64 << 24) as f64
}

/// Smooth noise between the hashes of a grid's corners, with this period.
fn noise([x, y]: [f64; 2], [across, down]: [i64; 2]) -> f64 {
    let ((i, s), (j, t)) = (cell(x), cell(y));
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (s, t) = (ease(s), ease(t));
    let at = |dx: i64, dy: i64| hash((i + dx).rem_euclid(across), (j + dy).rem_euclid(down) + 31);
    let low = at(0, 0) + s * (at(1, 0) - at(0, 0));
    let high = at(0, 1) + s * (at(1, 1) - at(0, 1));
    low + t * (high - low)
}

/// Octaves of noise, each half as strong.
fn fractal([x, y]: [f64; 2], period: [i64; 2], octaves: u32) -> f64 {
    let (mut sum, mut all, mut weight, mut scale) = (0.0, 0.0, 1.0, 1_i64);
    for _ in 0..octaves {
        let finer = scale as f64;
        sum += weight * noise([x * finer, y * finer], period.map(|p| p * scale));
        all += weight;
        weight *= 0.5;
        scale *= 2;
    }
    sum / all
}
