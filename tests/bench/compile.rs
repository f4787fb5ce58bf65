//! Time from text to plan, and after the edit of one cue: `cargo bench --bench compile`.
//!
//! Two large shows of 200 banks and 2,000 cues: `usual`, in which a cue moves 20 banks, and
//! `dense`, in which it moves all. Each stage is timed alone, then all in sequence; an edit
//! replaces one cue in the middle through the engine, as the prompt does. The cost of an edit
//! excludes the plan, which is made on demand. Last, texts of growing size.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a bench that reports to its reader"
)]

#[path = "cue_sheet.rs"]
mod cue_sheet;

use cue_sheet::{Size, cue_sheet};
use divan::{Bencher, black_box};
use footlight_engine::plan::{Plan, Weighting};
use footlight_engine::{Engine, Host};
use footlight_show::check::check;
use footlight_show::diagnostic::Sources;
use footlight_show::lang::edit::Edit;
use footlight_show::lang::{self, Parsed};
use footlight_show::timeline::{KeySequence, Timeline};

#[global_allocator]
static ALLOCATOR: divan::AllocProfiler = divan::AllocProfiler::system();

/// Banks that a cue of the usual and of the dense show moves.
const MOVED: [usize; 2] = [20, 200];

fn main() {
    divan::main();
}

fn text(moved: usize) -> String {
    cue_sheet(Size {
        banks: 200,
        cues: 2000,
        moved,
    })
}

fn parsed(text: &str) -> Parsed {
    lang::parse(&mut Sources::default(), "large.lxq", text)
}

fn timeline(parsed: &Parsed) -> Timeline {
    let show = parsed.show.as_ref().unwrap();
    check(show, &parsed.spans).timeline.unwrap()
}

fn keys(timeline: &Timeline) -> KeySequence {
    KeySequence::new(timeline).unwrap()
}

fn plan(keys: &KeySequence) -> Plan {
    let weighting = Weighting::settings(keys.coordinates());
    Plan::new(keys, &weighting, 0.02).unwrap()
}

#[divan::bench(args = MOVED, sample_count = 10)]
fn a_text_to_show(bencher: Bencher, moved: usize) {
    let text = text(moved);
    bencher.bench(|| parsed(black_box(&text)));
}

#[divan::bench(args = MOVED, sample_count = 10)]
fn b_show_to_curves(bencher: Bencher, moved: usize) {
    let parsed = parsed(&text(moved));
    bencher.bench(|| timeline(black_box(&parsed)));
}

#[divan::bench(args = MOVED, sample_count = 10)]
fn c_curves_to_keys(bencher: Bencher, moved: usize) {
    let timeline = timeline(&parsed(&text(moved)));
    bencher.bench(|| keys(black_box(&timeline)));
}

#[divan::bench(args = MOVED, sample_count = 5)]
fn d_keys_to_plan(bencher: Bencher, moved: usize) {
    let keys = keys(&timeline(&parsed(&text(moved))));
    bencher.bench(|| plan(black_box(&keys)));
}

#[divan::bench(args = MOVED, sample_count = 5)]
fn e_text_to_plan(bencher: Bencher, moved: usize) {
    let text = text(moved);
    bencher.bench(|| plan(&keys(&timeline(&parsed(black_box(&text))))));
}

/// Number of cues, and of banks that each moves: 0.5, 1, 2 and 4 MB, to check linear time, and
/// 5,000 cues of a typical kind.
const SHEETS: [(usize, usize); 5] = [(1900, 20), (3800, 20), (7600, 20), (8950, 40), (5000, 4)];

#[divan::bench(args = SHEETS, sample_count = 10)]
fn g_text_to_checked_show(bencher: Bencher, (cues, moved): (usize, usize)) {
    let text = cue_sheet(Size {
        banks: 200,
        cues,
        moved,
    });
    let bytes = divan::counter::BytesCount::of_str(&text);
    let bencher = bencher.counter(bytes);
    bencher.bench(|| timeline(&parsed(black_box(&text))));
}

#[divan::bench(args = MOVED, sample_count = 10)]
fn f_edit_of_one_cue(bencher: Bencher, moved: usize) {
    let text = text(moved);
    let host = Host::default();
    let mut engine = Engine::from_text("large.lxq", text.as_bytes(), host).unwrap();
    let mut level = 0;
    bencher.bench_local(|| {
        level = (level + 1) % 100;
        let cue = format!("cue 1000 \"Edited\" {{ time 3  b7 {level} }}");
        engine.edit(black_box(&Edit::Declare(cue))).unwrap()
    });
}
