//! Roofs with upturned eaves, and other shapes of the palace.
//!
//! A side of a roof is a steep trapezoid above and a flat strip below, whose middle is a trapezoid
//! too; its ends bend up to the corners and are cut into triangles. Below are a fascia and a soffit
//! that rises to the wall. The upstage side is left out, like everything invisible to the house and
//! out of reach of light.

use super::solid::{Frame, Point, Set, Side, diamond, hexagon};

/// Measures of a roof over a rectangle; half widths are along local X and Y.
#[derive(Clone, Copy, Debug)]
pub struct Roof {
    /// Material of the tiles.
    pub tile: &'static str,
    /// Half widths and height of the middle of the eaves.
    pub eave: Point,
    /// Half widths and height of the top.
    pub top: Point,
    /// Half widths of the wall below.
    pub wall: [f64; 2],
    /// Height of the corners above the middle of the eaves.
    pub lift: f64,
}

/// Start of the bend, as a share of the half width.
const BEND: f64 = 0.55;
/// End of the flat strip: shares of the way in, and of the way up.
const KNEE: [f64; 2] = [0.5, 0.3];
/// The fascia's height.
const EDGE: f64 = 0.14;
/// Local X of each side, whose outside is local -Y.
const SIDES: [[f64; 2]; 3] = [[1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];

/// Puts a roof over `at`.
pub fn roof(set: &mut Set, at: Frame, roof: Roof) {
    for along in SIDES {
        let frame = at.turned([0.0; 3], along);
        let [straight, _] = along;
        let swapped = straight == 0.0;
        let ring = |[a, b, z]: Point, lift: f64| {
            let (a, b) = if swapped { (b, a) } else { (a, b) };
            [
                [-a, -b, z + lift],
                [-a * BEND, -b, z],
                [a * BEND, -b, z],
                [a, -b, z + lift],
            ]
        };
        let eave = ring(roof.eave, roof.lift);
        let knee = ring(knee(roof), 0.0);
        strip(set, frame, roof.tile, knee, eave);
        let ([a, .., b], [d, .., c]) = (knee, ring(roof.top, 0.0));
        set.face(frame, roof.tile, &[a, b, c, d]);
        let under = eave.map(|[x, y, z]| [x, y, z - EDGE]);
        for ([a, b], [c, d]) in pairs(under).zip(pairs(eave)) {
            set.face(frame, "gilt", &[a, b, d, c]);
        }
        let [wx, wy] = roof.wall;
        let [_, _, z] = roof.eave;
        strip(set, frame, "soffit", under, ring([wx, wy, z + 0.12], 0.0));
    }
    let [x, y, z] = roof.top;
    if x > 0.02 {
        let ridge = [[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]];
        set.face(at, roof.tile, &ridge);
    }
    horns(set, at, roof);
}

fn knee(roof: Roof) -> Point {
    let [inwards, up] = KNEE;
    let ([ax, ay, az], [bx, by, bz]) = (roof.eave, roof.top);
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    [mix(ax, bx, inwards), mix(ay, by, inwards), mix(az, bz, up)]
}

fn pairs(line: [Point; 4]) -> impl Iterator<Item = [Point; 2]> {
    let [a, b, c, d] = line;
    [[a, b], [b, c], [c, d]].into_iter()
}

/// Faces between an upper and a lower line of one side, both from left to right.
fn strip(set: &mut Set, at: Frame, material: &'static str, upper: [Point; 4], lower: [Point; 4]) {
    let ([u0, u1, u2, u3], [l0, l1, l2, l3]) = (upper, lower);
    let mut face = |vertices: &[Point]| set.face(at, material, vertices);
    face(&[l0, l1, u1]);
    face(&[l0, u1, u0]);
    face(&[l1, l2, u2, u1]);
    face(&[l2, l3, u3]);
    face(&[l2, u3, u2]);
}

/// The horns at the corners, which continue the curve upwards.
fn horns(set: &mut Set, at: Frame, roof: Roof) {
    let ([ex, ey, ez], [kx, ky, kz]) = (roof.eave, knee(roof));
    let (lift, share) = (roof.lift, 0.16);
    for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0)] {
        let at_corner = |x: f64, y: f64, z: f64| [sx * x, sy * y, z];
        // On both eaves' bends, and up the hip.
        let drop = lift * share / (1.0 - BEND);
        let one = at_corner(ex * (1.0 - share), ey, ez + lift - drop);
        let two = at_corner(ex, ey * (1.0 - share), ez + lift - drop);
        let hip = at_corner(
            ex + share * (kx - ex),
            ey + share * (ky - ey),
            ez + lift + share * (kz - ez - lift),
        );
        let reach = 0.16 * (ex + ey) / 2.0;
        let tip = at_corner(ex + 0.35 * reach, ey + 0.35 * reach, ez + lift + reach);
        tetrahedron(set, at, "gilt", [one, two, hip, tip]);
    }
}

/// The three outward faces at the last corner of a tetrahedron.
pub fn tetrahedron(set: &mut Set, at: Frame, material: &'static str, corners: [Point; 4]) {
    let [a, b, c, tip] = corners;
    let minus = |[x, y, z]: Point, [u, v, w]: Point| [x - u, y - v, z - w];
    let cross = |[a, b, c]: Point, [x, y, z]: Point| [b * z - c * y, c * x - a * z, a * y - b * x];
    let dot = |[a, b, c]: Point, [x, y, z]: Point| a * x + b * y + c * z;
    for (p, q, inside) in [(a, b, c), (b, c, a), (c, a, b)] {
        let normal = cross(minus(q, p), minus(tip, p));
        let out = dot(normal, minus(inside, p)) < 0.0;
        let (p, q) = if out { (p, q) } else { (q, p) };
        set.face(at, material, &[p, q, tip]);
    }
}

/// A gilt spire.
pub fn finial(set: &mut Set, at: Frame, size: f64) {
    let rings = [
        [0.12, -0.1],
        [0.2, 0.22],
        [0.06, 0.42],
        [0.13, 0.6],
        [0.02, 1.3],
    ];
    let rings = rings.map(|[r, z]| [r * size, z * size]);
    set.mantle(at, "gilt", &diamond(), &rings);
    set.lid(at, "gilt", &diamond(), [0.02 * size, 1.3 * size]);
}

/// The visible half of a column: rings as (radius, height) from the foot upwards.
pub fn column(set: &mut Set, at: Frame, material: &'static str, rings: &[[f64; 2]]) {
    let mut whole = Set::default();
    whole.mantle(at, material, &hexagon(), rings);
    // Three of six sides face the house.
    let sides = whole.faces.into_iter().enumerate();
    let seen = sides.filter(|(i, _)| i % 6 >= 3).map(|(_, face)| face);
    seen.for_each(|face| set.add(face));
}

/// A thin upright bar, of which only the front is visible.
pub fn bar(set: &mut Set, at: Frame, material: &'static str, [x0, x1]: [f64; 2], z: [f64; 2]) {
    let ends = [Side::Top, Side::Bottom, Side::Back];
    let ([low, high], y) = (z, (x1 - x0) / 2.0);
    set.block(at, material, [x0, -y, low], [x1, y, high], &ends);
}
