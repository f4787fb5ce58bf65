//! Footlight inside another program: a show from a string, files in memory, edits as values, errors
//! as data, trial levels, refinement in the background, frames as bytes. Run it with `cargo run
//! --release -p footlight-studies --bin embed`.

use footlight::*;
use std::{error, path::Path, thread, time::Duration};

const SHOW: &str = r#"
show "Embedded"
stage "room.obj"
view house  from 0, -6, 1.6  to 0, 0, 1.4  fov 40  size 320x200
light left   spot  at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd  2700 K
light right  spot  at  2, -2, 3.5  aim  0.8, 0.5, 0.5  beam 30  field 50  900 cd  6500 K
bank warm = left
bank cool = right
cue 1 at 0:00 { snap  warm 80  cool 10 }
cue 2 at 0:02 { time 6  warm 15  cool 90 }
"#;

/// A floor and a back wall, Y up as in OBJ.
const ROOM: &str = "mtllib room.mtl\nv -3 0 3\nv 3 0 3\nv 3 0 -2\nv -3 0 -2\nv 3 3.5 -2\nv -3 3.5 -2\n\
    usemtl floor\nf 1 2 3 4\nusemtl wall\nf 4 3 5 6\n";
const MATERIALS: &str = "newmtl floor\nKd 0.4 0.35 0.3\nnewmtl wall\nKd 0.6 0.6 0.6\n";

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> Result<(), Box<dyn error::Error>> {
    let store = MemoryStore::default();
    let files = Memory::default()
        .with("room.obj", ROOM)
        .with("room.mtl", MATERIALS);
    let mut engine = Engine::from_text(
        "embedded.lxq",
        SHOW.as_bytes(),
        Host {
            files: Box::new(files),
            store: Box::new(store.clone()),
            background: Some(Box::new(|task| drop(thread::spawn(task)))),
            threads: 2,
            memory: 1 << 30,
            ..Host::default()
        },
    )?;
    let middle = Time::from_micros(5_000_000);
    println!(
        "5 s into the show: {:.2?}",
        engine.document().levels(middle)
    );

    // An edit is the smallest change of the text; an error leaves the show unchanged.
    engine.edit(&Edit::UpdateMoves {
        cue: CueNumber::parse("2").ok_or("a number")?,
        moves: "cool 40".to_owned(),
    })?;
    println!(
        "after the edit:    {:.2?}",
        engine.document().levels(middle)
    );
    if let Err(Error::Show(diagnostics)) = engine.edit(&Edit::Declare("cue 3 { wram 50 }".into())) {
        print!("{}", diagnostics.render(Style::Plain));
    }

    // Trial levels do not change the text.
    let mut live = LiveControl::new(engine.document());
    live.go(engine.document())?;
    let moves = Moves::read(engine.document(), "warm full", engine.host().files.as_ref())?;
    live.set(engine.document(), moves)?;
    let setting = live.setting(engine.document());
    let poses = live.poses(engine.document());
    let tried = engine.picture_with(&setting, &poses)?;
    let brightest = tried.data().iter().copied().fold(0.0, f32::max);
    println!("with warm at full the brightest channel is {brightest:.1} cd/m2");

    // The program continues while images are refined.
    engine.start(Goal::count(2))?;
    while engine.is_busy() {
        thread::sleep(Duration::from_millis(5));
        engine.poll();
    }
    println!("{} refined images", engine.estimate().refined());

    // The sequence as display bytes, with at most three blends per frame.
    let player = engine.player()?;
    let mut frame = Vec::new();
    for tenth in 0..80 {
        player.frame(Time::from_micros(tenth * 100_000), &mut frame);
    }
    let (width, height) = player.size();
    let png = encode_png(width, height, &frame)?;
    store.write(Path::new("last.png"), &png)?;
    engine.save(Path::new("embedded.lxq"))?;
    println!("kept: {:?}", store.paths());
    Ok(())
}
