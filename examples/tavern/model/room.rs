//! The shell: floor, walls, windows, door, hearth, beams, and the velvet around the picture.

use super::solid::{Frame, Point, Set, Side, clip, diamond, octagon};

/// Position of the back wall.
pub const BACK: f64 = 5.0;
/// Downstage end of the side walls.
pub const FRONT: f64 = -2.0;
/// Downstage edge of the ceiling, where the open roof ends.
pub const CEILING_FROM: f64 = 2.4;
/// Height of the ceiling.
pub const CEILING: f64 = 5.0;
/// Height of the gallery's floor.
pub const GALLERY: f64 = 2.7;
/// The gallery's left edge, where the stair arrives.
pub const GALLERY_LEFT: f64 = 2.7;
/// Underside of the gallery.
pub const UNDER_GALLERY: f64 = 2.55;
/// Middles of the three windows.
pub const WINDOWS: [f64; 3] = [-2.35, -0.55, 1.25];

const HEAD: f64 = 6.3; // top of the side walls where there is no ceiling
const WAINSCOT: f64 = 1.0;
const DADO: [f64; 2] = [0.0, WAINSCOT];
const SILL: f64 = 1.35;
const SPRING: f64 = 3.5;
const APEX: f64 = 4.3;
const HEARTH_LEFT: Point = [-5.325_714, 3.1, 0.0];
const HEARTH_RIGHT: f64 = -3.5;
const DOOR: [f64; 2] = [0.8, 1.8];
const DOOR_HEAD: f64 = 2.15;

/// Half the width of the room, which opens towards the house.
pub fn half_width(y: f64) -> f64 {
    5.0 + (BACK - y) * SPLAY
}

const SPLAY: f64 = 1.2 / 7.0;

/// Length on a side wall for a metre of depth.
fn stretch() -> f64 {
    (1.0 + SPLAY * SPLAY).sqrt()
}

/// The wall on the left-hand side: local X runs upstage from the proscenium, local Y out of the
/// room.
pub fn left_wall() -> Frame {
    Frame::facing([-half_width(FRONT), FRONT, 0.0], [SPLAY, 1.0])
}

/// Local X on the left wall at depth `y`.
pub fn along_left(y: f64) -> f64 {
    (y - FRONT) * stretch()
}

/// The wall on the right-hand side: local X runs downstage from the back, local Y out of the room.
pub fn right_wall() -> Frame {
    Frame::facing([half_width(BACK), BACK, 0.0], [SPLAY, -1.0])
}

/// Local X on the right wall at depth `y`.
pub fn along_right(y: f64) -> f64 {
    (BACK - y) * stretch()
}

/// The chimney breast across the left back corner: local Y out of the room, through the fire.
pub fn hearth() -> Frame {
    let [x, y, _] = HEARTH_LEFT;
    Frame::facing(HEARTH_LEFT, [HEARTH_RIGHT - x, BACK - y])
}

/// Builds the shell.
pub fn build(set: &mut Set) {
    floor(set);
    side_walls(set);
    back_wall(set);
    for x in WINDOWS {
        window(set, x);
    }
    outside(set);
    door(set);
    fireplace(set);
    roof(set);
    masking(set);
}

fn floor(set: &mut Set) {
    const TONES: [&str; 3] = ["boards_mid", "boards_light", "boards_dark"];
    // Joints of the boards; each starts in another tone than its neighbours.
    const JOINTS: [f64; 4] = [1.3, -0.4, 2.9, 0.5];
    let stage = Frame::at([0.0; 3]);
    set.object("floor");
    let tones = TONES.iter().cycle();
    for (board, joint) in JOINTS.iter().cycle().take(16).enumerate() {
        let x = [board, board + 1].map(|b| -6.2 + 0.775 * b as f64);
        let lengths = [[FRONT, *joint], [*joint, BACK]];
        for ([y0, y1], tone) in lengths.into_iter().zip(tones.clone().skip(board * 2)) {
            let piece = within_walls(&rectangle(x, [y0, y1]));
            if !piece.is_empty() {
                set.face(stage, tone, &piece);
            }
        }
    }
    set.object("forestage");
    let strips = [[-4.5, -3.7], [-3.7, -2.85], [-2.85, FRONT]];
    for (y, tone) in strips.into_iter().zip(TONES.iter().rev()) {
        for x in [[-5.6, -1.2], [-1.2, 5.6]] {
            set.face(stage, tone, &rectangle(x, y));
        }
    }
    set.upright(stage, "lip", -4.5, [-5.6, 5.6], [-1.0, 0.0]);
}

fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> [Point; 4] {
    [[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]]
}

/// Cuts a piece of floor or ceiling to the room: both side walls and the chimney breast.
fn within_walls(piece: &[Point]) -> Vec<Point> {
    let reach = half_width(0.0);
    let [hx, hy, _] = HEARTH_LEFT;
    let (dx, dy) = (HEARTH_RIGHT - hx, BACK - hy);
    let right = clip(piece, [-1.0, -SPLAY, 0.0, -reach]);
    let left = clip(&right, [1.0, -SPLAY, 0.0, -reach]);
    clip(&left, [dy, -dx, 0.0, dy * hx - dx * hy])
}

fn side_walls(set: &mut Set) {
    set.object("left_wall");
    let (left, x) = (left_wall(), along_left);
    for y in [[FRONT, DOOR[0]], [DOOR[1], CEILING_FROM]] {
        set.upright(left, "wainscot", 0.0, y.map(x), DADO);
        set.upright(left, "plaster", 0.0, y.map(x), [WAINSCOT, CEILING]);
    }
    set.upright(left, "plaster", 0.0, DOOR.map(x), [DOOR_HEAD, CEILING]);
    let above = [FRONT, CEILING_FROM].map(x);
    set.upright(left, "flies", 0.0, above, [CEILING, HEAD]);
    let upstage = [CEILING_FROM, HEARTH_LEFT[1]].map(x);
    set.upright(left, "wainscot", 0.0, upstage, DADO);
    set.upright(left, "plaster", 0.0, upstage, [WAINSCOT, CEILING]);

    set.object("right_wall");
    let (right, x) = (right_wall(), along_right);
    let downstage = [CEILING_FROM, FRONT].map(x);
    set.upright(right, "wainscot", 0.0, downstage, DADO);
    set.upright(right, "plaster", 0.0, downstage, [WAINSCOT, CEILING]);
    set.upright(right, "flies", 0.0, downstage, [CEILING, HEAD]);
    // Cut at the gallery, so that no element of a mesh lies half above, half below it.
    let bar = [BACK, CEILING_FROM].map(x);
    set.upright(right, "wainscot", 0.0, bar, DADO);
    set.upright(right, "plaster", 0.0, bar, [WAINSCOT, UNDER_GALLERY]);
    set.upright(right, "plaster", 0.0, bar, [GALLERY, CEILING]);
}

fn back_wall(set: &mut Set) {
    set.object("back_wall");
    let wall = Frame::at([0.0, BACK, 0.0]);
    let mut edge = HEARTH_RIGHT;
    for x in WINDOWS {
        let [x0, x1] = [x - 0.6, x + 0.6];
        above_stair(set, [edge, x0], DADO, "wainscot");
        above_stair(set, [edge, x0], [WAINSCOT, CEILING], "plaster");
        above_stair(set, [x0, x1], DADO, "wainscot");
        above_stair(set, [x0, x1], [WAINSCOT, SILL], "plaster");
        set.upright(wall, "plaster", 0.0, [x0, x1], [APEX, CEILING]);
        spandrels(set, x);
        edge = x1;
    }
    above_stair(set, [edge, GALLERY_LEFT], [WAINSCOT, CEILING], "plaster");
    let bar = [GALLERY_LEFT, half_width(BACK)];
    set.upright(wall, "wainscot", 0.0, bar, DADO);
    set.upright(wall, "plaster", 0.0, bar, [WAINSCOT, UNDER_GALLERY]);
    set.upright(wall, "plaster", 0.0, bar, [GALLERY, CEILING]);
}

/// A rectangle of the back wall without the part that the stair hides: the stair climbs at 45
/// degrees from x = 0, and its inner corners lie on z = x.
fn above_stair(set: &mut Set, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2], material: &'static str) {
    let whole = [[x0, 0.0, z0], [x1, 0.0, z0], [x1, 0.0, z1], [x0, 0.0, z1]];
    let rest = clip(&whole, [-1.0, 0.0, 1.0, 0.0]);
    if !rest.is_empty() {
        set.face(Frame::at([0.0, BACK, 0.0]), material, &rest);
    }
}

/// The wall around a pointed arch, in triangles because an arch is not convex from outside.
fn spandrels(set: &mut Set, x: f64) {
    let wall = Frame::at([x, BACK, 0.0]);
    let at = |x: f64, z: f64| [x, 0.0, z];
    let (haunch, rise) = (0.38, 4.02);
    let triangles = [
        [at(-0.6, SPRING), at(-haunch, rise), at(-0.6, APEX)],
        [at(-haunch, rise), at(0.0, APEX), at(-0.6, APEX)],
        [at(0.6, SPRING), at(0.6, APEX), at(haunch, rise)],
        [at(haunch, rise), at(0.6, APEX), at(0.0, APEX)],
    ];
    for triangle in triangles {
        set.face(wall, "plaster", &triangle);
    }
}

fn window(set: &mut Set, x: f64) {
    set.object("window");
    let wall = Frame::at([x, BACK, 0.0]);
    let outline = [
        [-0.6, SILL],
        [0.6, SILL],
        [0.6, SPRING],
        [0.38, 4.02],
        [0.0, APEX],
        [-0.38, 4.02],
        [-0.6, SPRING],
    ];
    set.reveal(wall, "stone", &outline, [0.0, 0.3], &[]);
    // Two uprights, and behind them three cross bars, so that nothing intersects.
    let ends = [Side::Back, Side::Top, Side::Bottom];
    for x in [-0.2, 0.2] {
        let (low, high) = ([x - 0.03, 0.12, SILL], [x + 0.03, 0.18, 4.13]);
        set.block(wall, "lead", low, high, &ends);
    }
    let ends = [Side::Back, Side::Left, Side::Right];
    for z in [2.05, 2.75, 3.45] {
        let (low, high) = ([-0.6, 0.19, z - 0.02], [0.6, 0.23, z + 0.02]);
        set.block(wall, "lead", low, high, &ends);
    }
}

/// The view through the windows: the roofs of Nuremberg, a spire, the moon, the sky.
fn outside(set: &mut Set) {
    set.object("outside");
    let town = Frame::at([0.0, 6.5, 0.0]);
    let z = |x: f64, z: f64| [x, 0.0, z];
    let gables: [&[Point]; 4] = [
        &[
            z(-4.0, 0.8),
            z(-2.2, 0.8),
            z(-2.2, 1.5),
            z(-2.9, 2.3),
            z(-4.0, 1.3),
        ],
        &[
            z(-2.2, 0.8),
            z(-0.7, 0.8),
            z(-0.7, 1.7),
            z(-1.3, 2.0),
            z(-2.2, 1.4),
        ],
        &[
            z(-0.7, 0.8),
            z(-0.35, 0.8),
            z(-0.35, 2.3),
            z(-0.525, 3.0),
            z(-0.7, 2.3),
        ],
        &[
            z(-0.35, 0.8),
            z(3.4, 0.8),
            z(3.4, 1.9),
            z(1.5, 2.6),
            z(-0.35, 1.6),
        ],
    ];
    for gable in gables {
        set.face(town, "roofs", gable);
    }
    let moon = Frame::at([-0.42, 7.3, 3.75]);
    let disc = octagon().map(|[x, z]| [0.17 * x, 0.0, 0.17 * z]);
    set.face(moon, "moon_disc", &disc);
    // One cloth behind each window, no wider than its visible part.
    for x in WINDOWS {
        let cloth = Frame::at([x * 1.132, 7.5, 0.0]);
        set.upright(cloth, "sky_cloth", 0.0, [-0.74, 0.74], [1.2, 4.75]);
    }
}

fn door(set: &mut Set) {
    set.object("door");
    let wall = left_wall();
    let [x0, x1] = DOOR.map(along_left);
    let outline = [[x0, 0.0], [x1, 0.0], [x1, DOOR_HEAD], [x0, DOOR_HEAD]];
    set.reveal(wall, "timber", &outline, [0.0, 0.25], &[0]);
    let street = |x: f64, y: f64| [x, y, 0.0];
    let (near, far) = (x0 - 0.5, x1 + 0.8);
    set.face(
        wall,
        "stone",
        &[
            street(x0, 0.0),
            street(x1, 0.0),
            street(x1, 0.25),
            street(x0, 0.25),
        ],
    );
    set.face(
        wall,
        "street",
        &[
            street(near, 0.25),
            street(far, 0.25),
            street(far, 2.6),
            street(near, 2.6),
        ],
    );
    // The house across the street, seen through the open door.
    set.face(
        wall,
        "street",
        &[
            [far, 0.25, 0.0],
            [far, 0.25, 3.0],
            [far, 2.6, 3.0],
            [far, 2.6, 0.0],
        ],
    );
    // The leaf stands open into the room, facing the house.
    let [hx, hy, _] = wall.place([x1, -0.09, 0.0]);
    let leaf = Frame::facing([hx, hy, 0.02], [0.45, 0.9]);
    set.block(leaf, "counter", [0.0, 0.0, 0.0], [0.98, 0.05, 2.08], &[]);
    for z in [0.25, 1.0, 1.75] {
        let (low, high) = ([0.06, -0.03, z], [0.92, 0.0, z + 0.12]);
        set.block(leaf, "timber", low, high, &[Side::Back]);
    }
}

fn fireplace(set: &mut Set) {
    set.object("hearth");
    let breast = hearth();
    let length = 2.635; // to the wall behind, which it meets within a millimetre
    let (x0, x1) = (0.66, 1.98);
    let (base, head, mantel) = (0.12, 1.12, 1.42);
    set.upright(breast, "brick", 0.0, [0.0, x0], [0.0, mantel]);
    set.upright(breast, "brick", 0.0, [x1, length], [0.0, mantel]);
    set.upright(breast, "brick", 0.0, [x0, x1], [head, mantel]);
    set.upright(breast, "plaster", 0.0, [0.0, length], [mantel, CEILING]);
    // Firebox: converging cheeks, a back, a floor at the hearthstone's height, a throat.
    let (near, far) = ([x0, x1], [x0 + 0.2, x1 - 0.2]);
    let ring = |[a, b]: [f64; 2], y: f64, z: f64| [[a, y, z], [b, y, z]];
    let ([a, b], [c, d]) = (ring(near, 0.0, base), ring(far, 0.5, base));
    let ([e, f], [g, h]) = (ring(near, 0.0, head), ring(far, 0.5, head));
    set.face(breast, "soot", &[a, c, g, e]);
    set.face(breast, "soot", &[d, b, f, h]);
    set.face(breast, "soot", &[c, d, h, g]);
    set.face(breast, "soot", &[a, b, d, c]);
    set.face(breast, "soot", &[g, h, f, e]);
    let stone = ([0.36, -0.5, 0.0], [2.28, 0.0, base]);
    set.block(
        breast,
        "stone",
        stone.0,
        stone.1,
        &[Side::Bottom, Side::Back],
    );
    let store = ([0.3, -0.22, mantel], [2.34, 0.0, mantel + 0.12]);
    set.block(breast, "timber", store.0, store.1, &[Side::Back]);
    for (y, along) in [(0.12, [1.0, 0.06]), (0.36, [1.0, -0.08])] {
        let log = breast.turned([1.32, y, base], along);
        let (low, high) = ([-0.38, -0.05, 0.0], [0.38, 0.05, 0.1]);
        set.block(log, "timber", low, high, &[Side::Bottom]);
    }
    // Jugs on the mantel.
    for x in [0.6, 1.9] {
        let jug = breast.moved([x, -0.11, mantel + 0.12]);
        set.mantle(jug, "pewter", &diamond(), &[[0.09, 0.0], [0.05, 0.24]]);
        set.lid(jug, "pewter", &diamond(), [0.05, 0.24]);
    }
}

fn roof(set: &mut Set) {
    let stage = Frame::at([0.0; 3]);
    set.object("ceiling");
    let wide = half_width(CEILING_FROM);
    let mut boards = within_walls(&rectangle([-wide, wide], [CEILING_FROM, BACK]));
    boards.reverse();
    let boards: Vec<Point> = boards.iter().map(|[x, y, _]| [*x, *y, CEILING]).collect();
    set.face(stage, "ceiling", &boards);
    let across = [-wide, wide];
    set.upright(stage, "flies", CEILING_FROM, across, [CEILING, HEAD]);

    set.object("beams");
    for x in [-3.4, -1.8, -0.2, 1.4, 3.0, 4.4] {
        let (low, high) = ([x - 0.06, CEILING_FROM, 4.82], [x + 0.06, 4.94, CEILING]);
        let hidden = [Side::Top, Side::Front, Side::Back];
        set.block(stage, "timber", low, high, &hidden);
    }
    for (y, low, high) in [(-1.2, 4.35, 4.6), (0.35, 4.35, 4.6), (2.29, 4.62, 4.98)] {
        beam(set, [y - 0.1, y + 0.1], [low, high]);
    }
    for x in [-3.05, 2.6] {
        let (low, high) = ([x - 0.09, -1.9, 4.6], [x + 0.09, 2.19, 4.8]);
        set.block(stage, "timber", low, high, &[Side::Back]);
        let (low, high) = ([x - 0.09, 2.2, 0.0], [x + 0.09, 2.38, 4.62]);
        set.block(stage, "timber", low, high, &[Side::Top, Side::Bottom]);
        for side in [-1.0, 1.0] {
            brace(set, x, side);
        }
    }
    // The dado's cap between stair and hearth, and the wall plate above the windows.
    let rail = |z: f64, x: f64| ([HEARTH_RIGHT + 0.05, 4.95, z], [x, BACK, z + 0.06]);
    let (low, high) = rail(WAINSCOT, -0.06);
    set.block(stage, "timber", low, high, &[Side::Back]);
    let (low, high) = ([-3.4, 4.94, 4.42], [4.9, BACK, 4.6]);
    set.block(stage, "timber", low, high, &[Side::Back]);
}

/// A beam from wall to wall.
fn beam(set: &mut Set, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) {
    let ring = |z: f64| {
        let (near, far) = (half_width(y0), half_width(y1));
        [[-near, y0, z], [near, y0, z], [far, y1, z], [-far, y1, z]]
    };
    let open = [Side::Left, Side::Right];
    set.hexahedron(Frame::at([0.0; 3]), "timber", ring(z0), ring(z1), &open);
}

/// A brace from the post at `x` up to the beam over it, on one side.
fn brace(set: &mut Set, x: f64, side: f64) {
    let outline = [[0.09, 3.75], [0.09, 4.0], [0.5, 4.62], [0.72, 4.62]];
    let mut outline = outline.map(|[dx, z]| [x + side * dx, z]);
    // Seen from the front this runs clockwise on the right-hand side of the post.
    let mut open = [2, 0];
    if side > 0.0 {
        outline.reverse();
        open = [0, 2];
    }
    let stage = Frame::at([0.0; 3]);
    set.extrude(stage, "timber", &outline, [2.24, 2.34], &open);
}

/// The house curtain, visible around the picture.
fn masking(set: &mut Set) {
    set.object("valance");
    let stage = Frame::at([0.0; 3]);
    const FOLDS: u32 = 18;
    let depth = |fold: u32| if fold.is_multiple_of(2) { -2.42 } else { -2.28 };
    let hem = |fold: u32| {
        let t = f64::from(fold % 6) / 6.0; // three swags of six folds
        4.86 - 1.3 * t * (1.0 - t)
    };
    for fold in 0..FOLDS {
        let [a, b] = [fold, fold + 1].map(|f| (-5.4 + 0.6 * f64::from(f), depth(f), hem(f)));
        let quad = [
            [a.0, a.1, a.2],
            [b.0, b.1, b.2],
            [b.0, b.1, 6.5],
            [a.0, a.1, 6.5],
        ];
        set.face(stage, "velvet", &quad);
    }
    set.object("tormentors");
    for side in [-1.0, 1.0] {
        for fold in 0..4_u32 {
            let deep = |f: u32| if f.is_multiple_of(2) { -2.2 } else { -2.08 };
            let [a, b] = [fold, fold + 1].map(|f| (side * (4.93 + 0.22 * f64::from(f)), deep(f)));
            let (l, r) = if side > 0.0 { (a, b) } else { (b, a) };
            let quad = [
                [l.0, l.1, 0.0],
                [r.0, r.1, 0.0],
                [r.0, r.1, 5.2],
                [l.0, l.1, 5.2],
            ];
            set.face(stage, "velvet", &quad);
        }
    }
}
