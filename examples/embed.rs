//! Footlight inside another program: a show from a string, files from memory and into memory,
//! progress, cancel and limits of one's own, mistakes as data, refinement beside everything else,
//! and frames as bytes. Run it with `cargo run --release --example embed`.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use footlight::diagnostic::Style;
use footlight::files::{Memory, Shelf, Store};
use footlight::interpreter::{self, Background, Goal, Host, Interpreter, LIMIT};
use footlight::picture::tone::{self, Tone};
use footlight::plan::Metric;
use footlight::playback::Player;
use footlight::playback::key::Format;
use footlight::units::Time;
use footlight::work::{Progress, Work};

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

/// A floor, a back wall and a box, Y up as in every OBJ file.
const ROOM: &str = "
mtllib room.mtl
v -3 0 3
v 3 0 3
v 3 0 -2
v -3 0 -2
v 3 3.5 -2
v -3 3.5 -2
v -0.5 0 0.5
v 0.5 0 0.5
v 0.5 0 -0.5
v -0.5 0 -0.5
v -0.5 1 0.5
v 0.5 1 0.5
v 0.5 1 -0.5
v -0.5 1 -0.5
usemtl floor
f 1 2 3 4
usemtl wall
f 4 3 5 6
usemtl box
f 7 8 12 11
f 8 9 13 12
f 9 10 14 13
f 10 7 11 14
f 11 12 13 14
";

const MATERIALS: &str = "
newmtl floor
Kd 0.4 0.35 0.3
newmtl wall
Kd 0.6 0.6 0.6
newmtl box
Kd 0.5 0.2 0.1
";

/// Counts what it is told, and would cancel after a million reports.
struct Counter(Arc<AtomicUsize>);

impl Progress for Counter {
    fn report(&self, _task: &str, _done: usize, _total: usize) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 1_000_000
    }
}

/// Work beside the program's own, on threads of the standard library.
struct Threads;

impl Background for Threads {
    fn start(&self, task: Box<dyn FnOnce() + Send>) {
        thread::spawn(task);
    }
}

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> Result<(), Box<dyn Error>> {
    let reports = Arc::new(AtomicUsize::new(0));
    let shelf = Shelf::default();
    let host = Host {
        files: Box::new(
            Memory::default()
                .with("room.obj", ROOM)
                .with("room.mtl", MATERIALS),
        ),
        store: Box::new(shelf.clone()),
        progress: Box::new(Counter(Arc::clone(&reports))),
        background: Some(Box::new(Threads)),
        threads: 2,
        memory: 1 << 30,
        time: Some(Duration::from_secs(60)),
        ..Host::default()
    };
    let mut show = Interpreter::from_text("embedded.lxq", SHOW.as_bytes(), host)?;

    let plan = show.plan(Metric::Error, 0.02)?;
    println!(
        "{} keys, rank {}, {} refined pictures for 2 %",
        plan.keys.len(),
        plan.rank,
        plan.used
    );

    let middle = Time::from_micros(5_000_000);
    let before = show.preview(middle)?;
    println!(
        "5 s into the show the brightest channel is {:.1} cd/m2",
        brightest(before.data())
    );
    show.edit("cue 2 at 0:02 { time 6  warm 15  cool 40 }")?;
    let after = show.preview(middle)?;
    println!("after the edit it is {:.1} cd/m2", brightest(after.data()));

    // A mistake is data; the show is as it was.
    if let Err(interpreter::Error::Mistakes(report)) = show.edit("cue 3 { wram 50 }") {
        print!("{}", report.render(Style::Plain));
    }

    beside(&mut show)?;
    println!("{} progress reports", reports.load(Ordering::Relaxed));
    frames(&mut show)?;

    // Every verb of the prompt; files go where the host says.
    let reply = show.execute("picture 0:05 -o five.png")?;
    print!("{}", reply.text);
    show.execute("save embedded.lxq")?;
    for path in shelf.paths() {
        let bytes = shelf.read(&path, LIMIT)?.len();
        println!("  {} holds {bytes} bytes", path.display());
    }
    assert!(shelf.read(Path::new("five.png"), LIMIT).is_ok());
    Ok(())
}

/// Refines while the program goes on looking at pictures, each better than the one before.
#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn beside(show: &mut Interpreter) -> Result<(), Box<dyn Error>> {
    let goal = Goal {
        count: Some(2),
        ..Goal::default()
    };
    show.refine_beside(goal, "two pictures more")?;
    while show.is_busy() {
        // Whatever the program does meanwhile; this could be an edit.
        show.preview(Time::ZERO)?;
        thread::sleep(Duration::from_millis(5));
        for note in show.attend() {
            println!("{note}");
        }
    }
    Ok(())
}

/// The sequence as display bytes, at most three blends a frame.
#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn frames(show: &mut Interpreter) -> Result<(), Box<dyn Error>> {
    let playback = show.playback()?;
    let tone = Tone {
        exposure: tone::auto_exposure(playback.images().iter()),
        ..Tone::default()
    };
    let player = Player::new(&playback, Format::Half, tone, Work::silent())?;
    let mut frame = Vec::new();
    let mut shown = 0;
    for tenth in 0..80 {
        player.show(Time::from_micros(tenth * 100_000), &mut frame);
        shown += frame.len();
    }
    let (width, height) = player.size();
    println!(
        "80 frames of {width}x{height} from {} keys, {shown} bytes",
        player.keys()
    );
    Ok(())
}

fn brightest(channels: &[f32]) -> f32 {
    channels.iter().copied().fold(0.0, f32::max)
}
