//! Paints the sketch of the manual's page "solve": `cargo run -p footlight-studies --bin
//! painted_sketch` writes `sketch.png` next to this file, over the shapes in the image of
//! `painted.lxq`.
//!
//! The mood of an evening: a sky from blue to orange after sunset at the right, cold light on the
//! stone, a warm pool on the table, broad strokes. It is no rendering, and some of it is out of
//! reach of the lamps.

use std::path::Path;

use footlight_picture::png;

/// Pixels of the view.
pub const SIZE: (usize, usize) = (480, 270);

type Colour = [f64; 3];

/// Display codes.
const NIGHT: Colour = [34.0, 42.0, 96.0];
const DUSK: Colour = [128.0, 84.0, 128.0];
const GLOW: Colour = [246.0, 172.0, 92.0];
const BOARDS: Colour = [46.0, 32.0, 30.0];
const LAMPLIGHT: Colour = [214.0, 158.0, 104.0];
const COLD: Colour = [132.0, 146.0, 176.0];
const SHADE: Colour = [44.0, 44.0, 62.0];

fn mix(a: Colour, b: Colour, share: f64) -> Colour {
    let share = share.clamp(0.0, 1.0);
    [0, 1, 2].map(|i| a[i] + share * (b[i] - a[i]))
}

/// 1 in the middle of an ellipse, falling to 0 at its edge.
fn pool((x, y): (f64, f64), (cx, cy): (f64, f64), (rx, ry): (f64, f64)) -> f64 {
    let away = ((x - cx) / rx).hypot((y - cy) / ry);
    (1.0 - away * away).max(0.0)
}

/// The colour at a position in pixels, without strokes.
fn colour(x: f64, y: f64) -> Colour {
    let inside = |left: f64, top: f64, right: f64, bottom: f64| {
        (left..right).contains(&x) && (top..bottom).contains(&y)
    };
    let warm = pool((x, y), (352.0, 212.0), (110.0, 46.0));
    match () {
        // The slab, its side, and the block below it.
        () if inside(73.0, 111.0, 149.0, 198.0) => mix(COLD, NIGHT, (y - 111.0) / 260.0),
        () if inside(149.0, 111.0, 153.0, 198.0) => mix(SHADE, GLOW, 0.3),
        () if inside(50.0, 198.0, 172.0, 223.0) => mix(SHADE, COLD, 0.55),
        () if inside(172.0, 191.0, 181.0, 216.0) => SHADE,
        // The table and the tall box.
        () if inside(327.0, 195.0, 378.0, 234.0) => mix(SHADE, LAMPLIGHT, 0.35 + 0.7 * warm),
        () if inside(376.0, 128.0, 429.0, 221.0) => mix(SHADE, LAMPLIGHT, 0.1 + 0.6 * warm),
        () if y >= 201.0 => mix(BOARDS, LAMPLIGHT, 0.8 * warm),
        () => {
            let height = 1.0 - (y - 14.0) / 187.0;
            let low = mix(GLOW, DUSK, height * 2.2);
            let sky = mix(low, NIGHT, height * 1.5 - 0.4);
            mix(
                sky,
                GLOW,
                0.7 * pool((x, y), (420.0, 190.0), (240.0, 110.0)),
            )
        }
    }
}

/// The sketch as RGB bytes, row by row from the top.
pub fn paint() -> Vec<u8> {
    let mut bytes = Vec::with_capacity(SIZE.0 * SIZE.1 * 3);
    for row in 0..SIZE.1 {
        for column in 0..SIZE.0 {
            // Slanting strokes about twelve pixels wide, each a little lighter or darker.
            let (x, y) = (column as f64, row as f64);
            let stroke = ((x + 2.0 * y) / 12.0).floor();
            let touch = 1.0 + 0.05 * (stroke * 2.7).sin() * (y / 31.0 + stroke).cos();
            let seen = row >= 14 && (2..478).contains(&column);
            let painted = if seen { colour(x, y) } else { [0.0; 3] };
            bytes.extend(painted.map(|code| (code * touch).round().clamp(0.0, 255.0) as u8));
        }
    }
    bytes
}

#[allow(dead_code, reason = "a test takes the painting alone")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../painted/sketch.png");
    std::fs::write(path, png::encode(SIZE.0, SIZE.1, &paint())?)?;
    Ok(())
}
