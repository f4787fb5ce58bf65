//! Footlight inside another program: a show from a string, files from memory, progress and cancel
//! of one's own. Run it with `cargo run --release --example embed`.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use footlight::files::Memory;
use footlight::interpreter::{Host, Interpreter};
use footlight::plan::Metric;
use footlight::units::Time;
use footlight::work::Progress;

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

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> Result<(), Box<dyn Error>> {
    let reports = Arc::new(AtomicUsize::new(0));
    let host = Host {
        files: Box::new(
            Memory::default()
                .with("room.obj", ROOM)
                .with("room.mtl", MATERIALS),
        ),
        progress: Box::new(Counter(Arc::clone(&reports))),
        threads: 2,
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

    show.refine(footlight::interpreter::Goal {
        count: Some(1),
        ..Default::default()
    })?;
    println!(
        "one refined picture later the predicted error is {:.2} %; {} progress reports",
        100.0 * show.predicted_error()?,
        reports.load(Ordering::Relaxed)
    );
    Ok(())
}

fn brightest(channels: &[f32]) -> f32 {
    channels.iter().copied().fold(0.0, f32::max)
}
