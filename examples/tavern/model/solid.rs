//! Polygons and simple solids for building sets.
//!
//! Invariants: every face is planar, convex and counter-clockwise seen from its front; no
//! trigonometry, so that coordinates are equal on every machine. This module is independent of the
//! tavern.

use super::finish::unit;

/// A point in metres: X to stage left, Y upstage, Z up.
pub type Point = [f64; 3];

/// A planar convex polygon.
#[derive(Clone, Debug)]
pub struct Face {
    /// The object to which it belongs.
    pub object: &'static str,
    /// The name of its material.
    pub material: &'static str,
    /// Counter-clockwise seen from the front.
    pub vertices: Vec<Point>,
    /// Normals of its corners, for a face of a round object.
    pub normals: Vec<Point>,
}

/// A local coordinate frame: local X along `along`, local Y a quarter turn to its left, Z up.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    origin: Point,
    along: [f64; 2],
}

impl Frame {
    /// The stage's own axes, moved to `origin`.
    pub fn at(origin: Point) -> Frame {
        Frame {
            origin,
            along: [1.0, 0.0],
        }
    }

    /// A frame with local X in the direction of `along`, of any length.
    pub fn facing(origin: Point, along: [f64; 2]) -> Frame {
        let [x, y] = along;
        let length = (x * x + y * y).sqrt();
        Frame {
            origin,
            along: [x / length, y / length],
        }
    }

    /// A parallel frame with the origin at local `by`.
    pub fn moved(self, by: Point) -> Frame {
        Frame {
            origin: self.place(by),
            ..self
        }
    }

    /// A frame with the origin at local `by` and local X in the local direction `along`.
    pub fn turned(self, by: Point, [x, y]: [f64; 2]) -> Frame {
        let [c, s] = self.along;
        Frame::facing(self.place(by), [c * x - s * y, s * x + c * y])
    }

    /// Converts a local direction to the stage's, normalised.
    fn direction(self, [x, y, z]: Point) -> Point {
        let [c, s] = self.along;
        unit([c * x - s * y, s * x + c * y, z])
    }

    /// From local coordinates to the stage's.
    pub fn place(self, [x, y, z]: Point) -> Point {
        let ([ox, oy, oz], [c, s]) = (self.origin, self.along);
        [ox + c * x - s * y, oy + s * x + c * y, oz + z]
    }
}

/// Sides of a box that may be left open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards -X.
    Left,
    /// Towards +X.
    Right,
    /// Towards -Y, the house.
    Front,
    /// Towards +Y.
    Back,
    /// Towards +Z.
    Top,
    /// Towards -Z.
    Bottom,
}

/// The whole set, face after face.
#[derive(Clone, Debug, Default)]
pub struct Set {
    /// Faces in order of building.
    pub faces: Vec<Face>,
    object: &'static str,
}

impl Set {
    /// Begins the object `name`, to which all further faces belong.
    pub fn object(&mut self, name: &'static str) {
        self.object = name;
    }

    /// One polygon in local coordinates.
    pub fn face(&mut self, frame: Frame, material: &'static str, vertices: &[Point]) {
        self.round_face(frame, material, vertices, &[]);
    }

    /// A polygon of a round object, with the normals of its corners, of any length.
    pub fn round_face(
        &mut self,
        frame: Frame,
        material: &'static str,
        vertices: &[Point],
        normals: &[Point],
    ) {
        self.faces.push(Face {
            object: self.object,
            material,
            vertices: vertices.iter().map(|p| frame.place(*p)).collect(),
            normals: normals.iter().map(|n| frame.direction(*n)).collect(),
        });
    }

    /// Adds a finished face to the current object.
    pub fn add(&mut self, face: Face) {
        self.faces.push(Face {
            object: self.object,
            ..face
        });
    }

    /// An upright rectangle seen from -Y: from (x0, z0) to (x1, z1) at depth `y`.
    pub fn upright(
        &mut self,
        frame: Frame,
        material: &'static str,
        y: f64,
        [x0, x1]: [f64; 2],
        [z0, z1]: [f64; 2],
    ) {
        self.face(
            frame,
            material,
            &[[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]],
        );
    }

    /// A box between two corners, the low one first, without the sides in `open`.
    pub fn block(
        &mut self,
        frame: Frame,
        material: &'static str,
        [x0, y0, z0]: Point,
        [x1, y1, z1]: Point,
        open: &[Side],
    ) {
        let (a, b, c, d) = ([x0, y0], [x1, y0], [x1, y1], [x0, y1]);
        let foot = [a, b, c, d].map(|[x, y]| [x, y, z0]);
        let head = [a, b, c, d].map(|[x, y]| [x, y, z1]);
        self.hexahedron(frame, material, foot, head, open);
    }

    /// A six-sided solid between two quadrilaterals with corresponding corners: `foot` and `head`
    /// both run left front, right front, right back, left back.
    pub fn hexahedron(
        &mut self,
        frame: Frame,
        material: &'static str,
        foot: [Point; 4],
        head: [Point; 4],
        open: &[Side],
    ) {
        let ([a, b, c, d], [e, f, g, h]) = (foot, head);
        let sides = [
            (Side::Front, [a, b, f, e]),
            (Side::Right, [b, c, g, f]),
            (Side::Back, [c, d, h, g]),
            (Side::Left, [d, a, e, h]),
            (Side::Top, [e, f, g, h]),
            (Side::Bottom, [d, c, b, a]),
        ];
        for (side, vertices) in sides {
            if !open.contains(&side) {
                self.face(frame, material, &vertices);
            }
        }
    }

    /// A solid whose outline in (x, z), counter-clockwise seen from -Y, is extruded from `y0` to
    /// `y1`: its front and the sides of all edges except those in `open` (edge i starts at corner
    /// i).
    pub fn extrude(
        &mut self,
        frame: Frame,
        material: &'static str,
        outline: &[[f64; 2]],
        [y0, y1]: [f64; 2],
        open: &[usize],
    ) {
        let front: Vec<Point> = outline.iter().map(|[x, z]| [*x, y0, *z]).collect();
        self.face(frame, material, &front);
        for (i, [p, q]) in edges(outline).enumerate() {
            if !open.contains(&i) {
                self.face(frame, material, &band(q, p, [y0, y1]));
            }
        }
    }

    /// The sides of an opening with that outline, counter-clockwise seen from -Y, through a wall
    /// from `y0` to `y1`; they face inwards.
    pub fn reveal(
        &mut self,
        frame: Frame,
        material: &'static str,
        outline: &[[f64; 2]],
        [y0, y1]: [f64; 2],
        open: &[usize],
    ) {
        for (i, [p, q]) in edges(outline).enumerate() {
            if !open.contains(&i) {
                self.face(frame, material, &band(p, q, [y0, y1]));
            }
        }
    }

    /// The mantle of a prism, cone or barrel: rings of one polygon, given as (scale, height) from
    /// the foot upwards, joined by planar trapezoids; smooth from six corners on.
    pub fn mantle(
        &mut self,
        frame: Frame,
        material: &'static str,
        outline: &[[f64; 2]],
        rings: &[[f64; 2]],
    ) {
        let slopes = slopes(rings);
        for (i, ([r0, z0], [r1, z1])) in rings.iter().zip(rings.iter().skip(1)).enumerate() {
            for [[ax, ay], [bx, by]] in edges(outline) {
                let quad = [
                    [ax * r0, ay * r0, *z0],
                    [bx * r0, by * r0, *z0],
                    [bx * r1, by * r1, *z1],
                    [ax * r1, ay * r1, *z1],
                ];
                let normals = slopes.get(i).filter(|_| outline.len() >= 6);
                let normals = normals.map(|[[o0, u0], [o1, u1]]| {
                    [
                        [ax * o0, ay * o0, *u0],
                        [bx * o0, by * o0, *u0],
                        [bx * o1, by * o1, *u1],
                        [ax * o1, ay * o1, *u1],
                    ]
                });
                let normals = normals.as_ref().map_or(&[][..], |n| n.as_slice());
                self.round_face(frame, material, &quad, normals);
            }
        }
    }

    /// A horizontal polygon with that outline, facing up.
    pub fn lid(
        &mut self,
        frame: Frame,
        material: &'static str,
        outline: &[[f64; 2]],
        [scale, z]: [f64; 2],
    ) {
        let up: Vec<Point> = outline
            .iter()
            .map(|[x, y]| [x * scale, y * scale, z])
            .collect();
        self.face(frame, material, &up);
    }

    /// A horizontal polygon with that outline, facing down.
    pub fn underside(
        &mut self,
        frame: Frame,
        material: &'static str,
        outline: &[[f64; 2]],
        [scale, z]: [f64; 2],
    ) {
        let down: Vec<Point> = outline
            .iter()
            .rev()
            .map(|[x, y]| [x * scale, y * scale, z])
            .collect();
        self.face(frame, material, &down);
    }
}

/// For each band between rings, the normals at its lower and its upper ring, as (out, up). Bands
/// that meet at less than 45 degrees share the mean of theirs.
fn slopes(rings: &[[f64; 2]]) -> Vec<[[f64; 2]; 2]> {
    let band = |([r0, z0], [r1, z1]): (&[f64; 2], &[f64; 2])| {
        let (out, up) = (z1 - z0, r0 - r1);
        let length = (out * out + up * up).sqrt();
        [out / length, up / length]
    };
    let own: Vec<[f64; 2]> = rings.iter().zip(rings.iter().skip(1)).map(band).collect();
    let joined = |a: [f64; 2], b: Option<&[f64; 2]>| match b {
        Some(b) if a[0] * b[0] + a[1] * b[1] > 0.5_f64.sqrt() => [a[0] + b[0], a[1] + b[1]],
        _ => a,
    };
    let below = |i: usize| i.checked_sub(1).and_then(|i| own.get(i));
    let both = |(i, a): (usize, &[f64; 2])| [joined(*a, below(i)), joined(*a, own.get(i + 1))];
    own.iter().enumerate().map(both).collect()
}

/// The edges of an outline, the last one back to the first corner.
fn edges(outline: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(p, q)| [*p, *q])
}

/// The rectangle that the edge from `p` to `q` (x, z) sweeps from `y0` to `y1`.
fn band([px, pz]: [f64; 2], [qx, qz]: [f64; 2], [y0, y1]: [f64; 2]) -> [Point; 4] {
    [[px, y0, pz], [qx, y0, qz], [qx, y1, qz], [px, y1, pz]]
}

/// A regular octagon of circumradius 1, counter-clockwise, with flat sides towards the axes.
pub fn octagon() -> [[f64; 2]; 8] {
    // cos and sin of 22.5 degrees by square roots, which IEEE 754 rounds equally everywhere.
    let half = 0.5_f64.sqrt();
    let (c, s) = (((1.0 + half) / 2.0).sqrt(), ((1.0 - half) / 2.0).sqrt());
    [
        [c, -s],
        [c, s],
        [s, c],
        [-s, c],
        [-c, s],
        [-c, -s],
        [-s, -c],
        [s, -c],
    ]
}

/// A regular hexagon of circumradius 1, counter-clockwise.
pub fn hexagon() -> [[f64; 2]; 6] {
    let s = 0.75_f64.sqrt();
    [
        [1.0, 0.0],
        [0.5, s],
        [-0.5, s],
        [-1.0, 0.0],
        [-0.5, -s],
        [0.5, -s],
    ]
}

/// A square of circumradius 1 that stands on its corner.
pub fn diamond() -> [[f64; 2]; 4] {
    [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]
}

/// The part of a convex polygon where a·x + b·y + c·z >= d (Sutherland and Hodgman); empty when no
/// area is left.
pub fn clip(polygon: &[Point], [a, b, c, d]: [f64; 4]) -> Vec<Point> {
    let height = |[x, y, z]: Point| a * x + b * y + c * z - d;
    let mut out: Vec<Point> = Vec::new();
    let next = polygon.iter().cycle().skip(1);
    for (p, q) in polygon.iter().zip(next) {
        let (hp, hq) = (height(*p), height(*q));
        if hp >= 0.0 {
            out.push(*p);
        }
        if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
            let t = hp / (hp - hq);
            let [px, py, pz] = *p;
            let [qx, qy, qz] = *q;
            out.push([px + t * (qx - px), py + t * (qy - py), pz + t * (qz - pz)]);
        }
    }
    if out.len() < 3 || out.iter().all(|p| height(*p) < 1e-9) {
        out.clear();
    }
    out
}
