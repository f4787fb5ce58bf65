//! Pictures of what the renderers do not do well: `cargo run --release -p footlight-studies --bin
//! limits -- PICTURE.png`.
//!
//! One row for each case: the picture at step 1 and at step 3, and the light of the first less that
//! of the second, four times as strong (amber: too much, blue: too little).

use std::error::Error;
use std::path::Path;

use footlight_engine::{Engine, Host};
use footlight_host::files::Folder;
use footlight_picture::tone::auto_exposure;
use footlight_picture::{Image, signed};
use footlight_report::chart::{self, Sheet, Theme, Tile};
use footlight_show::units::Time;
use footlight_transport::Quality;

/// Size of a tile, pixels.
const SIZE: [usize; 2] = [320, 180];
/// Factor of the differences.
const STRONGER: f32 = 4.0;
/// Most bytes of a file.
const LIMIT: u64 = 1 << 28;

struct Case {
    name: &'static str,
    text: String,
    seconds: i64,
    /// Column and row at which the tile begins.
    from: [usize; 2],
}

fn cases() -> [Case; 4] {
    let room = |lines: &str| {
        format!(
            "show \"Limits\"\nsurface wall reflectance 0.6 quad -3, 2, 0  3, 2, 0  3, 2, 3  -3, 2, 3\n\
             surface floor reflectance 0.4 quad -3, -3, 0  3, -3, 0  3, 2, 0  -3, 2, 0\n\
             bank a = lamp\ncue 1 at 0:00 {{ snap a full }}\n{lines}"
        )
    };
    let ceiling = "show \"Ceiling\"\nsurface white reflectance 0.7 box from 0, 0, 0 to 5, 5, 5 inside\n\
               light lamp spot at 2.5, 2.5, 0.5 aim 2.5, 2.5, 5 beam 4 field 7 20000 cd\n\
               view v from 2.5, 0.3, 2.5 to 2.5, 5, 2.5 fov 90 size 320x180\n\
               bank a = lamp\ncue 1 at 0:00 { snap a full }\n";
    let mirror = room(
        "surface mirror reflectance 0.02 gloss 0 quad -0.8, -0.2, 0.01  0.8, -0.2, 0.01  0.8, 0.8, 0.01  \
         -0.8, 0.8, 0.01\nlight lamp spot at 0, -2.5, 2.8 aim 0, 0.3, 0 beam 12 field 20 9000 cd\n\
         view v from 1.5, -5, 1.8 to 0, 1, 0.9 fov 40 size 320x180\n",
    );
    let case = |name, text, seconds, from| Case {
        name,
        text,
        seconds,
        from,
    };
    [
        case(
            "narrow corners",
            include_str!("../../../tavern/tavern.lxq").to_owned(),
            74,
            [40, 160],
        ),
        case(
            "a spot of 4 degrees on the ceiling",
            ceiling.to_owned(),
            0,
            [0, 0],
        ),
        case("a ring of 48 triangles", room(&ring()), 0, [0, 0]),
        case("no patch of light from a mirror", mirror, 0, [0, 0]),
    ]
}

/// A glowing ring before the wall, and balls on the floor, so that the set is rendered by rays.
fn ring() -> String {
    let mut text = "view v from 0.8, -3.5, 1.5 to 0, 1.5, 1 fov 35 size 320x180\nlight lamp panel ring 300 cd/m2\n\
                    surface ring reflectance 0.3"
        .to_owned();
    for i in 0..24 {
        let corner = |k: i32, radius: f64| {
            let angle = f64::from(k) * std::f64::consts::TAU / 24.0;
            let (x, z) = (radius * angle.cos(), 1.4 + radius * angle.sin());
            format!("{x:.4}, 1.6, {z:.4}  ")
        };
        let [a, b, c, d] = [(i, 0.55), (i + 1, 0.55), (i + 1, 0.6), (i, 0.6)];
        text += " quad ";
        text.extend([a, b, c, d].map(|(k, radius)| corner(k, radius)));
    }
    text += "\nsurface ball reflectance 0.4";
    for i in 0..60 {
        let (x, y) = (
            -2.7 + 0.6 * f64::from(i % 10),
            -1.5 + 0.55 * f64::from(i / 10),
        );
        text += &format!(" sphere at {x:.2}, {y:.2}, 0.12 radius 12cm");
    }
    text.push('\n');
    text
}

/// The part of an image that a tile shows.
fn part(image: &Image, [left, top]: [usize; 2]) -> Option<Image> {
    let [width, height] = SIZE;
    let mut data = Vec::new();
    for y in top..top + height {
        for x in left..left + width {
            data.extend(image.pixel(x, y)?);
        }
    }
    Image::from_data(width, height, data)
}

fn tiles(case: &Case) -> Result<[Tile; 3], Box<dyn Error>> {
    let tavern = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tavern");
    let host = Host {
        files: Box::new(Folder::new(&tavern, LIMIT)),
        ..Host::default()
    };
    let mut engine = Engine::from_text("limits.lxq", case.text.as_bytes(), host)?;
    let time = Time::from_micros(1_000_000 * case.seconds);
    let setting = engine.document().setting(time);
    let mut at = |step| -> Result<Image, Box<dyn Error>> {
        let image = engine.render(&setting, Quality(step))?;
        part(&image, case.from).ok_or_else(|| "the picture is too small".into())
    };
    let (first, finest) = (at(1)?, at(3)?);
    let pairs = first.data().iter().zip(finest.data());
    let apart = pairs.map(|(a, b)| STRONGER * (a - b)).collect();
    let apart = Image::from_data(SIZE[0], SIZE[1], apart).ok_or("sizes differ")?;
    let tone = engine
        .document()
        .tone_at(auto_exposure(std::iter::once(&finest)));
    let tile = |rgb: Vec<u8>, caption: String| Tile {
        size: (SIZE[0], SIZE[1]),
        rgb,
        caption,
    };
    Ok([
        tile(tone.encode(&first), format!("{}: step 1", case.name)),
        tile(tone.encode(&finest), "step 3".to_owned()),
        tile(
            signed::encode(&apart, signed::scale(&finest)),
            "the difference, four times".to_owned(),
        ),
    ])
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("which picture?")?;
    let mut all = Vec::new();
    for case in cases() {
        all.extend(tiles(&case)?);
    }
    let sheet = Sheet {
        title: "What a finer step makes smaller, and what it does not".to_owned(),
        tiles: all,
        columns: Some(3),
        legend: "amber: too much light at step 1; blue: too little".to_owned(),
    };
    let drawing = chart::sheet(&sheet, Theme::Light)?;
    std::fs::write(&path, drawing.png()?)?;
    Ok(())
}
