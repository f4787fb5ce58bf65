//! Damaged files for every reader: cue sheet, OBJ, MTL, glTF, GLB, IES, PNG, OpenEXR, and the
//! store's entries. Every reader must give a show or an error in bounded time; with a damaged store
//! the image must equal that without a store.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use footlight::{Engine, Host, Image, Time};
use footlight_desk::{mvr, usitt};
use footlight_engine::PoolPlace;
use footlight_host::files::{Memory, MemoryStore, Store};
use footlight_host::work::Work;
use footlight_picture::exr::{self, Precision};
use footlight_show::diagnostic::Sources;
use footlight_show::lang;

use crate::dice::Dice;

/// Time limit for files of these sizes, seconds.
const LONGEST: f64 = 10.0;

const IMAGES: &str = "show \"Images\"
view v from 0,-5,2 to 0,0,0 fov 40 size 32x18
bank a image \"a.exr\"
cue 1 at 0:00 { snap  a 50 }
";

const STORED: &str = "show \"Stored\"
surface floor reflectance 0.5 box from -3,-3,-1 to 3,3,0
view house from 0,-5,2 to 0,0,0.5 fov 40 size 16x9
light left spot at -2,-2,3 aim 0,0,0 beam 30 field 60 900 cd
bank a = left
cue 1 at 0:00 { snap  a 80 }
";

/// A show's text and the files that it names; the text is the first.
type Case = Vec<(&'static str, Vec<u8>)>;

fn cases() -> Vec<Case> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |name: &str| std::fs::read(examples.join(name)).unwrap();
    let luminaires = [
        "luminaires.lxq",
        "room.obj",
        "room.mtl",
        "batwing.ies",
        "window.png",
    ];
    let luminaires = luminaires.map(|name| (name, read(&format!("luminaires/{name}"))));
    let (hall, gltf) = (read("hall/hall.lxq"), read("hall/hall.gltf"));
    let packed = glb(&gltf);
    let mut image = Image::new(32, 18);
    image
        .data_mut()
        .iter_mut()
        .enumerate()
        .for_each(|(i, x)| *x = (i % 7) as f32);
    let exr = exr::encode(&image, Precision::Float, &[]).unwrap();
    vec![
        luminaires.to_vec(),
        vec![("hall.lxq", hall.clone()), ("hall.gltf", gltf)],
        vec![("hall.lxq", hall), ("hall.gltf", packed)],
        vec![("images.lxq", IMAGES.into()), ("a.exr", exr)],
        vec![("stored.lxq", STORED.into())],
        vec![("house.asc", read("desk/house.asc"))],
        vec![("plan.mvr", read("desk/plan.mvr"))],
    ]
}

/// A glTF text as the only chunk of a GLB.
fn glb(gltf: &[u8]) -> Vec<u8> {
    let mut json = gltf.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let sizes = [json.len() + 20, json.len()].map(|n| (n as u32).to_le_bytes());
    let head: [&[u8]; 5] = [b"glTF", &2u32.to_le_bytes(), &sizes[0], &sizes[1], b"JSON"];
    [head.concat(), json].concat()
}

/// Damages some bytes, as storage and people do.
fn damage(bytes: &mut Vec<u8>, dice: &mut Dice) {
    const ODD: [&[u8]; 8] = [
        b"\0",
        b"\xff",
        b"-",
        b"1e999",
        b"99999999",
        b"nan",
        b"{",
        b"\n",
    ];
    for _ in 0..=dice.below(6) {
        let at = dice.below(bytes.len() + 1);
        let end = (at + dice.below(40)).min(bytes.len());
        match dice.below(6) {
            0 if at < bytes.len() => bytes[at] ^= 1 << dice.below(8),
            1 if at < bytes.len() => bytes[at] = dice.below(256) as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let copy = bytes[at..end].to_vec();
                let to = dice.below(bytes.len() + 1);
                bytes.splice(to..to, copy);
            }
            4 => drop(bytes.splice(at..end, ODD[dice.below(ODD.len())].iter().copied())),
            _ if dice.below(8) == 0 => bytes.truncate(at),
            _ => {}
        }
    }
}

/// Opens a show, or imports a foreign file; true without errors.
fn opens(case: &Case) -> bool {
    let (name, bytes) = &case[0];
    let imported = match name.rsplit_once('.') {
        Some((_, "asc")) => usitt::import(name, bytes, None, Work::silent())
            .1
            .map(|carried| carried.text),
        Some((_, "mvr")) => {
            mvr::import(name, bytes, "set", Work::silent()).map(|carried| carried.text)
        }
        _ => return opens_show(case),
    };
    imported.is_ok_and(|text| {
        lang::parse(&mut Sources::default(), name, &text)
            .show
            .is_some()
    })
}

fn opens_show(case: &Case) -> bool {
    let mut files = Memory::default();
    for (name, content) in &case[1..] {
        files = files.with(name, content.clone());
    }
    let host = Host {
        files: Box::new(files),
        memory: 1 << 28,
        ..Host::default()
    };
    Engine::from_text("fuzz.lxq", &case[0].1, host).is_ok()
}

/// The image of [`STORED`] with this store.
fn picture(store: &MemoryStore) -> Image {
    let host = Host {
        store: Box::new(store.clone()),
        pool: Some(PoolPlace {
            folder: PathBuf::from("pool"),
            limit: 1 << 30,
        }),
        ..Host::default()
    };
    let mut engine = Engine::from_text("stored.lxq", STORED.as_bytes(), host).unwrap();
    engine.picture(Time::ZERO).unwrap()
}

/// Damages one file after the other for some seconds; false after a wrong answer.
pub fn all(seed: u64, seconds: u64) -> bool {
    let (cases, store) = (cases(), MemoryStore::default());
    for case in &cases {
        assert!(opens(case), "{} has errors before any damage", case[0].0);
    }
    let whole = picture(&store);
    let mut dice = Dice(seed);
    let (begin, mut rounds, mut shows, mut longest) = (Instant::now(), 0u64, 0u64, 0.0f64);
    while begin.elapsed() < Duration::from_secs(seconds) {
        let state = dice.0;
        let since = Instant::now();
        let answered = catch_unwind(AssertUnwindSafe(|| match dice.below(cases.len() + 1) {
            at if at < cases.len() => {
                let mut case = cases[at].clone();
                let file = dice.below(case.len());
                damage(&mut case[file].1, &mut dice);
                shows += u64::from(opens(&case));
                true
            }
            _ => {
                let paths = store.paths();
                let path = &paths[dice.below(paths.len())];
                let mut content = store.read(path, u64::MAX).unwrap();
                damage(&mut content, &mut dice);
                store.write(path, &content).unwrap();
                picture(&store) == whole
            }
        }));
        let took = since.elapsed().as_secs_f64();
        longest = longest.max(took);
        rounds += 1;
        if answered.ok() != Some(true) || took > LONGEST {
            println!("fuzz: round {rounds} failed after {took:.1} s: fuzz --seed {state}");
            return false;
        }
    }
    println!("fuzz: {rounds} damaged files, {shows} of them still shows, {longest:.2} s at most");
    true
}
