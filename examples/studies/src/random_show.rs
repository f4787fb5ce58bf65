//! Random shows: a room with boxes, spots, panels and cues, as text.
//!
//! A seed gives the same show on every machine: the generator is defined here, and its numbers are
//! printed with fixed digits. Shows are small but typical: banks of one to three lights with hard
//! or soft shadows, overlapping fades, splines.

use std::fmt::Write as _;

use footlight_engine::{Engine, Host};
use footlight_host::files::Memory;

use crate::dice::Dice;

/// A show and its stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RandomShow {
    /// The show, which reads `room.obj`.
    pub show: String,
    /// `room.obj`, Y up.
    pub stage: String,
    /// `room.mtl`
    pub materials: String,
}

/// Half the width, depth and height of a room, metres.
#[derive(Clone, Copy)]
struct Room {
    half: f64,
    depth: f64,
    height: f64,
}

/// Polygons as the lines of an OBJ file.
#[derive(Default)]
struct Stage {
    text: String,
    vertices: usize,
    materials: String,
}

impl Stage {
    /// A convex polygon, counter-clockwise seen from the front, Z up.
    fn polygon(&mut self, vertices: &[[f64; 3]]) {
        let mut face = "f".to_owned();
        for [x, y, z] in vertices {
            self.vertices += 1;
            let _ = writeln!(self.text, "v {x:.4} {z:.4} {:.4}", -y);
            let _ = write!(face, " {}", self.vertices);
        }
        let _ = writeln!(self.text, "{face}");
    }

    fn material(&mut self, name: &str, colour: [f64; 3]) {
        let [r, g, b] = colour;
        let _ = writeln!(self.materials, "newmtl {name}\nKd {r:.3} {g:.3} {b:.3}");
    }

    fn of(&mut self, material: &str) {
        let _ = writeln!(self.text, "usemtl {material}");
    }

    /// A box on the floor without its bottom.
    fn block(&mut self, from: [f64; 2], to: [f64; 2], height: f64) {
        let ([a, b], [c, d], h) = (from, to, height);
        self.polygon(&[[a, b, 0.0], [c, b, 0.0], [c, b, h], [a, b, h]]);
        self.polygon(&[[c, b, 0.0], [c, d, 0.0], [c, d, h], [c, b, h]]);
        self.polygon(&[[c, d, 0.0], [a, d, 0.0], [a, d, h], [c, d, h]]);
        self.polygon(&[[a, d, 0.0], [a, b, 0.0], [a, b, h], [a, d, h]]);
        self.polygon(&[[a, b, h], [c, b, h], [c, d, h], [a, d, h]]);
    }

    fn room(&mut self, dice: &mut Dice, room: Room) {
        let Room {
            half: a,
            depth: d,
            height: h,
        } = room;
        for name in ["floor", "back", "side", "box"] {
            let mut tone = || dice.between(0.15, 0.75);
            let colour = [tone(), tone(), tone()];
            self.material(name, colour);
        }
        self.of("floor");
        self.polygon(&[[-a, 0.0, 0.0], [a, 0.0, 0.0], [a, d, 0.0], [-a, d, 0.0]]);
        self.of("back");
        self.polygon(&[[-a, d, 0.0], [a, d, 0.0], [a, d, h], [-a, d, h]]);
        self.of("side");
        self.polygon(&[[-a, 0.0, 0.0], [-a, d, 0.0], [-a, d, h], [-a, 0.0, h]]);
        self.polygon(&[[a, d, 0.0], [a, 0.0, 0.0], [a, 0.0, h], [a, d, h]]);
        self.of("box");
        for _ in 0..dice.whole(2, 6) {
            let x = dice.between(-a + 0.3, a - 1.3);
            let y = dice.between(0.3, d - 1.3);
            let to = [x + dice.between(0.3, 1.0), y + dice.between(0.3, 1.0)];
            self.block([x, y], to, dice.between(0.4, 0.7 * h));
        }
    }

    /// A lamp with its own material: below the open ceiling, or on a side wall.
    fn panel(&mut self, dice: &mut Dice, room: Room, name: &str) {
        self.material(name, [0.2; 3]);
        self.of(name);
        let (s, y) = (dice.between(0.1, 0.5), dice.between(0.6, room.depth - 0.6));
        if dice.chance(0.6) {
            let (x, z) = (dice.between(-room.half + 0.6, room.half - 0.6), room.height);
            self.polygon(&[
                [x - s, y + s, z],
                [x + s, y + s, z],
                [x + s, y - s, z],
                [x - s, y - s, z],
            ]);
        } else {
            let (x, z) = (-room.half + 0.05, dice.between(0.8, room.height - 0.6));
            self.polygon(&[
                [x, y - s, z - s],
                [x, y + s, z - s],
                [x, y + s, z + s],
                [x, y - s, z + s],
            ]);
        }
    }
}

impl RandomShow {
    /// The files of the show.
    pub fn files(&self) -> Memory {
        Memory::default()
            .with("room.obj", self.stage.as_str())
            .with("room.mtl", self.materials.as_str())
    }

    /// Opens the show with the services of a host, its files in memory.
    ///
    /// # Errors
    /// As [`Engine::from_text`].
    pub fn open(&self, host: Host) -> Result<Engine, footlight::Error> {
        let host = Host {
            files: Box::new(self.files()),
            threads: 2,
            ..host
        };
        Engine::from_text("random.lxq", self.show.as_bytes(), host)
    }
}

/// The show of a seed: 12 to 24 banks, 5 to 12 cues, an image of this size.
pub fn random_show(seed: u64, [width, height]: [usize; 2]) -> RandomShow {
    let dice = &mut Dice::new(seed);
    let room = Room {
        half: dice.between(2.5, 5.0),
        depth: dice.between(3.5, 7.0),
        height: dice.between(3.0, 5.0),
    };
    let mut stage = Stage {
        text: "mtllib room.mtl\n".to_owned(),
        ..Stage::default()
    };
    stage.room(dice, room);
    let mut show = format!(
        "show \"Random {seed}\"\npreview {{ gap 2 }}\nstage \"room.obj\"\nview house  from 0, \
         -{:.2}, 1.7  to 0, {:.2}, {:.2}  fov 32  size {width}x{height}\n\n",
        2.2 * room.half,
        room.depth / 2.0,
        room.height / 2.3
    );
    let banks = dice.whole(12, 24);
    for bank in 0..banks {
        show += &lamps(dice, room, &mut stage, bank);
    }
    let mut at = 0.0;
    for number in 0..dice.whole(5, 12) {
        show += &cue(dice, banks, number, at);
        at += dice.between(2.0, 9.0);
    }
    RandomShow {
        show,
        stage: stage.text,
        materials: stage.materials,
    }
}

/// A bank of a panel, or of one to three spots.
fn lamps(dice: &mut Dice, room: Room, stage: &mut Stage, bank: usize) -> String {
    let mut text = String::new();
    let mut names = String::new();
    let panel = dice.chance(0.35);
    for lamp in 0..if panel { 1 } else { dice.whole(1, 3) } {
        let name = format!("l{bank}_{lamp}");
        let _ = write!(names, " {name}");
        let kelvin = dice.whole(22, 70) * 100;
        if panel {
            stage.panel(dice, room, &name);
            let radiance = dice.between(50.0, 1000.0);
            let _ = writeln!(text, "light {name} panel {name} {radiance:.1} cd/m2");
            continue;
        }
        let (x, y) = (
            dice.between(-room.half, room.half) * 0.9,
            dice.between(-3.0, room.depth * 0.8),
        );
        let z = room.height * dice.between(0.8, 1.3);
        let aim = [
            dice.between(-room.half, room.half) * 0.7,
            dice.between(0.3, room.depth),
            dice.between(0.0, room.height * 0.5),
        ];
        let beam = dice.between(12.0, 45.0);
        let _ = writeln!(
            text,
            "light {name} spot  at {x:.3}, {y:.3}, {z:.3}  aim {:.3}, {:.3}, {:.3}  beam {beam:.1}  \
             field {:.1}  {:.0} cd  {kelvin} K",
            aim[0],
            aim[1],
            aim[2],
            beam * dice.between(1.2, 2.0),
            dice.between(300.0, 6000.0)
        );
    }
    let law = if dice.chance(0.3) {
        "dimmer square"
    } else {
        ""
    };
    let _ = writeln!(text, "bank b{bank} ={names}  channel {}  {law}", bank + 1);
    text
}

/// A cue: fades for a third of the banks, and sometimes paths.
fn cue(dice: &mut Dice, banks: usize, number: usize, at: f64) -> String {
    let shapes = ["linear", "ease", "square", "slow-top", "slow-bottom"];
    let shape = shapes.get(dice.whole(0, 4)).copied().unwrap_or("linear");
    let mut text = format!(
        "cue {} at {}:{:06.3} {{ time {:.2}/{:.2}  curve {shape}\n",
        number + 1,
        (at / 60.0).floor(),
        at % 60.0,
        dice.between(0.5, 7.0),
        dice.between(0.5, 7.0)
    );
    let share = if number == 0 { 0.6 } else { 0.3 };
    for bank in 0..banks {
        if !dice.chance(share) {
            continue;
        }
        let mut level = || dice.whole(0, 100);
        let levels = [level(), level(), level(), level()];
        let [a, b, c, d] = levels;
        let kinds = ["monotone", "linear", "steps"];
        let _ = match kinds.get(dice.whole(0, 9)) {
            Some(kind) => {
                let [p, q] = [dice.between(0.4, 2.0), dice.between(2.1, 5.0)];
                writeln!(text, "  b{bank} {kind} 0s {a}, {p:.2}s {b}, {q:.2}s {c}")
            }
            None if d < 25 => writeln!(text, "  b{bank} out"),
            None => writeln!(text, "  b{bank} {d}"),
        };
    }
    text + "}\n"
}
