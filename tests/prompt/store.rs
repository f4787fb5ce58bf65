//! The pool in memory and on disk: images found again, images kept by an edit, and faults.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::operator::Altered;
use crate::{Ticking, prompt};
use footlight_engine::{Goal, Host, PoolPlace, Way, WayForecast};
use footlight_host::files::{Entry, FileError, Memory, MemoryStore, Store};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_prompt::Repl;

const SHOW: &str = r#"show "Store"
preview { tolerance 1%  coarse 1  refined 3  rate 5 }
stage "room.obj"
view house  from 0, -5, 1.6  to 0, 0, 1.2  fov 45  size 48x30

light left   spot  at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd  2700 K
light right  spot  at  2, -2, 3.5  aim  0.8, 0.5, 0.5  beam 30  field 50  900 cd  6500 K
light top    panel lamp  400 cd/m2
bank warm = left
bank cool = right
bank over = top

cue 1 at 0:00 { snap  warm 80  cool 10 }
cue 2 at 0:02 { time 6  warm 15  cool 90 }
cue 3 at 0:05 { time 3  curve ease  over 70 }
"#;

const ROOM: &str = "mtllib room.mtl
v -3 0 3\nv 3 0 3\nv 3 0 -2\nv -3 0 -2\nv 3 3.5 -2\nv -3 3.5 -2
v -0.4 3.4 0.4\nv 0.4 3.4 0.4\nv 0.4 3.4 -0.4\nv -0.4 3.4 -0.4
v -0.5 1 0.5\nv 0.5 1 0.5\nv 0.5 1 -0.5\nv -0.5 1 -0.5
usemtl floor\nf 1 2 3 4\nusemtl wall\nf 4 3 5 6\nusemtl lamp\nf 10 9 8 7
usemtl floor\nf 11 12 13 14
";

const MATERIALS: &str = "newmtl floor\nKd 0.4 0.35 0.3\nnewmtl wall\nKd 0.6 0.6 0.6\n\
    newmtl lamp\nKd 0 0 0\nKe 1 1 1\n";

const POOL: &str = "pool";

/// A show, and the number of images rendered for it.
struct Session {
    show: Repl,
    rendered: Arc<AtomicUsize>,
}

impl Session {
    fn open(text: &str, store: impl Store + 'static, limit: Option<u64>) -> Session {
        Session::timed(text, store, limit, 1e-3)
    }

    /// A session on a machine where every reading of the clock takes this many seconds.
    fn timed(text: &str, store: impl Store + 'static, limit: Option<u64>, seconds: f64) -> Session {
        let rendered = Arc::new(AtomicUsize::new(0));
        let files = Memory::default().with("room.obj", ROOM);
        let host = Host {
            files: Box::new(files.with("room.mtl", MATERIALS)),
            store: Box::new(store),
            clock: Box::new(Ticking::by(seconds)),
            renderer: Arc::new(Altered {
                rendered: Arc::clone(&rendered),
                ..Altered::unstated()
            }),
            pool: limit.map(|limit| PoolPlace {
                folder: PathBuf::from(POOL),
                limit,
            }),
            ..Host::default()
        };
        let show = prompt("s.lxq", text.as_bytes(), host).unwrap();
        Session { show, rendered }
    }

    fn refine(&mut self, count: usize) {
        let goal = Goal::count(count);
        self.show.engine_mut().refine(goal).unwrap();
    }

    /// Refines to a number of images, including stored ones; returns the messages.
    fn refine_to(&mut self, count: usize) -> Vec<footlight::Printable> {
        self.show.engine_mut().coarse().unwrap();
        let line = match count - self.show.engine().estimate().refined() {
            0 => "pool".to_owned(),
            missing => format!("refine {missing}"),
        };
        self.show.execute(&line).unwrap().notes
    }

    /// The forecast of mixtures for a goal.
    fn mixtures(&self, goal: &Goal) -> WayForecast {
        let ways = self.show.engine().estimate().ways(goal).unwrap();
        let paper = ways.into_iter().find(|way| way.way == Way::Paper);
        paper.unwrap()
    }

    /// Number of images rendered since the last call.
    fn rendered(&self) -> usize {
        self.rendered.swap(0, Ordering::Relaxed)
    }

    fn keys(&mut self) -> Vec<Image> {
        self.show.engine_mut().playback().unwrap().images().to_vec()
    }
}

fn stored(store: &MemoryStore) -> Vec<PathBuf> {
    let paths = store.paths().into_iter();
    paths
        .filter(|p| p.starts_with(Path::new(POOL).join("pictures")))
        .collect()
}

const PLENTY: Option<u64> = Some(1 << 30);

/// Largest difference of any number, relative to the largest number.
fn difference(a: &[Image], b: &[Image]) -> f32 {
    assert_eq!(a.len(), b.len());
    let numbers =
        |images: &[Image]| -> Vec<f32> { images.iter().flat_map(|i| i.data().to_vec()).collect() };
    let (a, b) = (numbers(a), numbers(b));
    let peak = a.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
    let off = a
        .iter()
        .zip(&b)
        .fold(0.0_f32, |m, (x, y)| m.max((x - y).abs()));
    off / peak
}

/// Cue images and page written from the first images stay if these are sufficient, and are written
/// again if a measured error requires finer ones, even when the images exist and are only measured
/// again.
#[test]
fn the_pictures_of_a_run_are_those_of_its_only_images() {
    the_pictures_are_those_of_the_last_images("50%", 1);
}

#[test]
#[ignore = "slow"]
fn the_pictures_of_a_run_are_those_of_its_finest_images() {
    the_pictures_are_those_of_the_last_images("0.1%", 3);
}

fn the_pictures_are_those_of_the_last_images(until: &str, quality: u8) {
    let store = MemoryStore::default();
    let run = |out: &str| {
        let files = Memory::default().with("room.obj", ROOM);
        let host = Host {
            files: Box::new(files.with("room.mtl", MATERIALS)),
            store: Box::new(store.clone()),
            clock: Box::new(Ticking::by(1e-3)),
            pool: Some(PoolPlace {
                folder: PathBuf::from(POOL),
                limit: 1 << 30,
            }),
            ..Host::default()
        };
        let mut show = prompt("s.lxq", SHOW.as_bytes(), host).unwrap();
        let line = format!("run --until {until} --way alone -o {out}");
        let text = show.execute(&line).unwrap().text.to_string();
        assert!(!text.contains("predicted"), "{text}");
        let is_finest = text.contains("no quality reaches that");
        assert!(!(is_finest && text.contains("half the error")), "{text}");
        let steps = show.engine().estimate().coarse_steps();
        assert_eq!(steps.map(|q| q.0), [quality; 2], "{text}");
        text
    };
    let (first, again) = (run("first"), run("again"));
    assert!(!first.contains("rendered: 0"), "{first}");
    assert!(again.contains("rendered: 0"), "{again}");
    for name in ["cues/0002.png", "contact-sheet.png", "show.html"] {
        let read = |out: &str| store.read(&Path::new(out).join(name), 1 << 30).unwrap();
        assert!(read("first") == read("again"), "{name} until {until}");
    }
}

/// The error of a sequence with refined mixtures is also measured, at its worst moment.
#[test]
fn the_error_after_mixtures_is_measured() {
    let files = Memory::default().with("room.obj", ROOM);
    let host = Host {
        files: Box::new(files.with("room.mtl", MATERIALS)),
        store: Box::new(MemoryStore::default()),
        clock: Box::new(Ticking::by(1e-3)),
        ..Host::default()
    };
    let mut show = prompt("s.lxq", SHOW.as_bytes(), host).unwrap();
    let text = show.execute("run --count 2 -o out").unwrap().text;
    assert_eq!(show.engine().estimate().refined(), 2);
    let error = text.lines().next().unwrap();
    assert!(error.contains(" at cue "), "{error}");
    assert!(error.contains(" to ") || error.contains("below"), "{error}");
    assert!(!error.contains("predicted;"), "{error}");
}

#[test]
fn a_second_session_renders_nothing_and_leaves_the_same_bytes() {
    let store = MemoryStore::default();
    let run = |limit, out: &str| {
        let mut session = Session::open(SHOW, store.clone(), limit);
        let reply = session
            .show
            .execute(&format!("run --count 2 --keys -o {out}"))
            .unwrap();
        (session.rendered(), reply)
    };
    assert_eq!(run(None, "without").0, 8);
    assert!(stored(&store).is_empty());
    assert_eq!(run(PLENTY, "first").0, 8);
    assert_eq!(stored(&store).len(), 8);
    let (rendered, reply) = run(PLENTY, "second");
    assert_eq!(rendered, 0);
    let words = "from the pool: 8, rendered: 0";
    assert!(reply.text.contains(words), "{}", reply.text);
    assert_eq!(reply.notes, [""; 0]);
    let read = |path: &Path| store.read(path, 1 << 30).unwrap();
    assert_eq!(read(Path::new("pool/.gitignore")), b"*\n");
    let mut compared = 0;
    for path in store.paths() {
        // A chart against seconds differs between runs, and so does its digest.
        let Ok(name) = path.strip_prefix("without") else {
            continue;
        };
        if ["error.png", "files.sha256"].map(Path::new).contains(&name) {
            continue;
        }
        for other in ["first", "second"] {
            assert!(
                read(&path) == read(&Path::new(other).join(name)),
                "{name:?} of {other}"
            );
        }
        compared += 1;
    }
    assert!(compared > 5, "{compared}");
}

/// Coarse images of the refined quality exist from another step, and the next refined ones are sums
/// of them.
#[test]
fn what_is_stored_has_no_price() {
    let store = MemoryStore::default();
    let other = SHOW.replace("coarse 1  refined 3", "coarse 2  refined 3");
    let mut first = Session::open(&other, store.clone(), PLENTY);
    first.show.engine_mut().coarse().unwrap();
    let mut session = Session::open(SHOW, store, PLENTY);
    session.show.engine_mut().coarse().unwrap();
    let everything = Goal::until(0.0);
    let free = session.mixtures(&everything);
    assert_eq!((free.mixed, free.seconds), (0, 0.0));
    session.rendered();
    session.show.engine_mut().refine(everything).unwrap();
    assert_eq!(session.rendered(), 0);
    let refined = session.show.engine().estimate().refined();
    let mut fresh = Session::open(SHOW, MemoryStore::default(), PLENTY);
    fresh.show.engine_mut().coarse().unwrap();
    let priced = fresh.mixtures(&everything);
    assert!(refined > 0 && priced.mixed == refined && priced.seconds > 0.0);
}

#[test]
fn grouping_banks_adds_up_what_is_there() {
    for disk in [None, PLENTY] {
        let store = MemoryStore::default();
        let mut session = Session::open(SHOW, store.clone(), disk);
        session.refine(2);
        assert_eq!(session.rendered(), 8);
        let grouped = "bank warm = left right\nbank cool = right";
        if disk.is_some() {
            // Another session, so that everything comes from the store.
            let text = SHOW.replace("bank warm = left", "bank warm = left right");
            session = Session::open(&text, store, disk);
        } else {
            session.show.execute(grouped).unwrap();
        }
        session.show.engine_mut().coarse().unwrap();
        assert_eq!(session.rendered(), 0);
        assert_eq!(
            session.show.engine().images().statistics().summed,
            2,
            "one at each coarse quality"
        );
        let text = session.show.engine().document().text().to_owned();
        let mut fresh = Session::open(&text, MemoryStore::default(), None);
        let unit = [1.0, 0.0, 0.0];
        fresh.show.engine_mut().coarse().unwrap();
        let own = session.show.engine().estimate().pool().unwrap().coarse()[0]
            .as_ref()
            .clone();
        let other = fresh.show.engine().estimate().pool().unwrap().coarse()[0]
            .as_ref()
            .clone();
        let off = difference(&[own], &[other]);
        assert!(off <= 3e-7, "{unit:?}: {off}");
    }
}

#[test]
fn refined_pictures_go_on_with_sources_that_can_express_them() {
    let mut session = Session::open(SHOW, MemoryStore::default(), None);
    session.refine(2);
    session.rendered();
    // The old banks, one of them under another name and in another order: equal light.
    let reply = session.show.execute("bank over = top right").unwrap();
    assert!(
        reply.text.contains("2 refined pictures kept"),
        "{}",
        reply.text
    );
    session.show.engine_mut().coarse().unwrap();
    assert_eq!(session.rendered(), 0);
    let pool = session.show.engine().estimate().pool().unwrap();
    assert_eq!(pool.refined().len(), 2);
    for refined in pool.refined() {
        let preview = pool.preview(&refined.setting, Work::silent()).unwrap();
        let off = difference(&[refined.image.as_ref().clone()], &[preview]);
        assert!(off <= 1e-6, "{off}");
    }
    // A joined bank cannot express them; after `undo`, they are back.
    session
        .show
        .execute("bank over = top left right\nbank warm = left right")
        .unwrap();
    session.show.execute("bank cool = top").unwrap();
    assert!(session.show.engine().estimate().refined() < 2);
    let undone = "bank warm = left\nbank cool = right\nbank over = top";
    session.show.execute(undone).unwrap();
    assert_eq!(session.show.engine().estimate().refined(), 2);
    session.show.engine_mut().coarse().unwrap();
    assert_eq!(session.rendered(), 0);
}

/// The text changed in an editor between two runs: every refined image still corrects the coarse
/// ones.
#[test]
fn another_session_goes_on_with_the_refined_pictures_whatever_the_cues_say() {
    let store = MemoryStore::default();
    let mut first = Session::open(SHOW, store.clone(), PLENTY);
    first.refine(2);
    let text = SHOW.replace("warm 15  cool 90", "warm 45  cool 20  over 10");
    let mut alone = Session::open(&text, MemoryStore::default(), None);
    alone.show.engine_mut().coarse().unwrap();
    let mut second = Session::open(&text, store.clone(), PLENTY);
    second.show.engine_mut().coarse().unwrap();
    assert_eq!(second.rendered(), 0);
    let pool = second.show.engine().estimate().pool().unwrap();
    let settings = |session: &Session| session.show.engine().estimate().pool().unwrap().settings();
    assert_eq!(settings(&second), settings(&first), "in their order");
    let forecast = |session: &Session| {
        session
            .show
            .engine()
            .estimate()
            .steps()
            .last()
            .unwrap()
            .forecast
    };
    assert!(
        forecast(&second) < 0.7 * forecast(&alone),
        "{} {}",
        forecast(&second),
        forecast(&alone)
    );
    for refined in pool.refined() {
        let preview = pool.preview(&refined.setting, Work::silent()).unwrap();
        let off = difference(&[refined.image.as_ref().clone()], &[preview]);
        assert!(off <= 1e-6, "{off}");
    }
    // Only new images are rendered, and the next session has all three.
    second.refine(1);
    assert_eq!(second.rendered(), 1);
    let mut third = Session::open(&text, store, PLENTY);
    third.show.engine_mut().coarse().unwrap();
    assert_eq!(settings(&third), settings(&second));
    assert!(third.keys() == second.keys(), "the same bits");
    assert_eq!(third.rendered(), 0);
}

/// Two independent sessions refined almost equal settings: their difference would be magnified, and
/// the rounding of single precision with it.
#[test]
fn near_copies_of_refined_pictures_are_left_out() {
    let one = MemoryStore::default();
    Session::open(SHOW, one.clone(), PLENTY).refine(2);
    let two = MemoryStore::default();
    let text = SHOW.replace("warm 80", "warm 80.01");
    Session::open(&text, two.clone(), PLENTY).refine(2);
    for path in stored(&two) {
        one.write(&path, &two.read(&path, 1 << 30).unwrap())
            .unwrap();
    }
    assert_eq!(
        stored(&one).len(),
        10,
        "the two sessions' refined pictures differ"
    );
    let mut both = Session::open(SHOW, one, PLENTY);
    both.show.engine_mut().coarse().unwrap();
    assert_eq!(both.show.engine().estimate().refined(), 2);
    assert_eq!(both.rendered(), 0);
}

#[test]
fn pictures_that_were_found_say_nothing_of_the_machines_speed() {
    let told = |seconds| {
        let store = MemoryStore::default();
        let mut before = Session::open(SHOW, store.clone(), PLENTY);
        before.show.engine_mut().coarse().unwrap();
        let mut session = Session::timed(SHOW, store, PLENTY, seconds);
        session.show.engine_mut().coarse().unwrap();
        let first = session.mixtures(&Goal::count(1)).seconds;
        session.refine(1);
        (first, session.mixtures(&Goal::count(1)).seconds)
    };
    let (fast, slow) = (told(1e-3), told(1e3));
    assert_eq!(fast.0, slow.0, "nothing was rendered yet");
    assert!(slow.1 > 1e4 * fast.1, "{fast:?} {slow:?}");
}

#[test]
fn an_edit_renders_only_what_depends_on_it() {
    let mut session = Session::open(SHOW, MemoryStore::default(), None);
    session.refine(1);
    assert_eq!(session.rendered(), 7);
    let mut after = |edit: &str| {
        session.show.execute(edit).unwrap();
        session.show.engine_mut().coarse().unwrap();
        session.rendered()
    };
    assert_eq!(after("cue 2 at 0:02 { time 4  warm 25  cool 80 }"), 0);
    let moved = "light left spot at -2, -2, 3 aim -0.8, 0.5, 0.5 beam 30 field 50 900 cd 2700 K";
    assert_eq!(
        after(moved),
        2,
        "the moved light's bank at both coarse qualities"
    );
    let back = moved.replace("-2, -2, 3 ", "-2, -2, 3.5 ");
    assert_eq!(after(&back), 0, "as it was");
    assert_eq!(after(&back.replace("900 cd", "300 cd")), 0, "a third of it");
    assert_eq!(after(&back.replace("2700", "4000")), 0, "another colour");
    assert_eq!(after("preview { coarse 1  refined 2 }"), 0);
    assert_eq!(
        after("preview { coarse 2  refined 3 }"),
        3,
        "quality 2 is there"
    );
    assert_eq!(after("preview { coarse 1  refined 3 }"), 0);
    assert_eq!(after("haze 60m"), 6, "everything");
    assert_eq!(after("haze 0.05/m  forward 0"), 0, "the same haze");
    assert_eq!(after("haze 0.05/m  forward 0.5"), 6, "everything");
    assert_eq!(after("delete haze"), 0, "clear air, as it was");
    assert_eq!(after("surface floor reflectance 0.5"), 6, "everything");
    let view = "view house from 0, -5, 1.6 to 0, 0, 1 fov 45 size 48x30";
    assert_eq!(after(view), 6, "everything");
}

/// A store with a fault: what happens to images from the n-th write on.
#[derive(Clone)]
struct Faulty {
    inner: MemoryStore,
    fault: Fault,
    from: usize,
    written: Arc<AtomicUsize>,
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    Full,
    Truncated,
    Flipped,
    Swapped,
}

impl Store for Faulty {
    fn write(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        if path.extension().is_none_or(|e| e != "exr") || path.starts_with("out") {
            return self.inner.write(path, content);
        }
        let count = self.written.fetch_add(1, Ordering::Relaxed);
        if count < self.from {
            return self.inner.write(path, content);
        }
        let mut content = content.to_vec();
        match self.fault {
            Fault::Full => {
                return Err(FileError::Io {
                    path: path.display().to_string(),
                    source: std::io::Error::from(std::io::ErrorKind::StorageFull),
                });
            }
            Fault::Truncated => content.truncate(content.len() * (count + 1) / 9),
            Fault::Flipped => {
                let at = content.len() * (count + 1) / 9;
                content[at] ^= 1 << (count % 8);
            }
            Fault::Swapped => {
                let mut others = stored(&self.inner).into_iter().rev();
                content = match others.next() {
                    Some(other) => self.inner.read(&other, 1 << 30)?,
                    None => b"not a picture".to_vec(),
                };
            }
        }
        self.inner.write(path, &content)
    }

    fn list(&self, folder: &Path, ending: &str) -> Result<Vec<String>, FileError> {
        self.inner.list(folder, ending)
    }

    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, FileError> {
        self.inner.read(path, limit)
    }

    fn read_start(&self, path: &Path, bytes: u64) -> Result<Vec<u8>, FileError> {
        self.inner.read_start(path, bytes)
    }

    fn entries(&self, folder: &Path) -> Result<Vec<Entry>, FileError> {
        self.inner.entries(folder)
    }

    fn touch(&self, path: &Path) -> Result<(), FileError> {
        self.inner.touch(path)
    }

    fn remove(&self, path: &Path) -> Result<(), FileError> {
        self.inner.remove(path)
    }
}

#[test]
#[ignore = "slow"]
fn faults_cost_rendering_and_a_note_but_never_a_wrong_number() {
    let mut clean = Session::open(SHOW, MemoryStore::default(), None);
    clean.refine(2);
    let truth = clean.keys();
    for fault in [
        Fault::Full,
        Fault::Truncated,
        Fault::Flipped,
        Fault::Swapped,
    ] {
        for from in [0, 1, 5, 7] {
            let what = format!("{fault:?} from {from}");
            let inner = MemoryStore::default();
            let faulty = Faulty {
                inner: inner.clone(),
                fault,
                from,
                written: Arc::default(),
            };
            let mut first = Session::open(SHOW, faulty, PLENTY);
            let notes = first.refine_to(2);
            assert!(first.keys() == truth, "{what}");
            let full = matches!(fault, Fault::Full);
            assert_eq!(notes.len(), usize::from(full), "{what}: {notes:?}");
            assert!(
                first.show.execute("at 0:01").unwrap().notes.is_empty(),
                "{what}: told once"
            );

            let mut second = Session::open(SHOW, inner.clone(), PLENTY);
            let notes = second.refine_to(2);
            assert_eq!(
                second.rendered(),
                8 - from.min(8),
                "{what}: all that is whole"
            );
            assert_eq!(
                notes.len(),
                usize::from(!full && from < 8),
                "{what}: {notes:?}"
            );
            assert!(second.keys() == truth, "{what}");

            // The damaged images have been replaced.
            let mut third = Session::open(SHOW, inner, PLENTY);
            third.refine_to(2);
            assert_eq!(third.rendered(), 0, "{what}");
            assert!(third.keys() == truth, "{what}");
        }
    }
}

#[test]
fn the_limit_drops_what_was_used_least_recently() {
    let store = MemoryStore::default();
    let mut session = Session::open(SHOW, store.clone(), PLENTY);
    session.refine(1);
    let all = stored(&store);
    let bytes = |paths: &[PathBuf]| -> u64 {
        let length = |p: &PathBuf| store.read(p, 1 << 30).unwrap().len() as u64;
        paths.iter().map(length).sum()
    };
    let total = bytes(&all);
    // Another view, in a store with room for little more than one show.
    let other = SHOW.replace("fov 45", "fov 40");
    let limit = total + total / 5;
    let mut second = Session::open(&other, store.clone(), Some(limit));
    second.refine(1);
    assert!(bytes(&stored(&store)) <= limit);
    let mut again = Session::open(&other, store.clone(), Some(limit));
    again.refine_to(1);
    assert_eq!(again.rendered(), 0, "what was used last is there");
    let left = all.iter().filter(|p| stored(&store).contains(p)).count();
    assert_eq!(left, 1, "of the first show the last picture used");
    // With a limit below a single image nothing is stored, and no error reported.
    let tiny = MemoryStore::default();
    Session::open(SHOW, tiny.clone(), Some(1000)).refine(1);
    assert!(stored(&tiny).is_empty());
}

#[test]
fn the_verb_tells_and_frees() {
    let store = MemoryStore::default();
    let mut session = Session::open(SHOW, store.clone(), PLENTY);
    assert!(
        session
            .show
            .execute("pool")
            .unwrap()
            .text
            .contains("no coarse pictures")
    );
    session.refine(2);
    let text = session.show.execute("pool").unwrap().text;
    for words in [
        "3 coarse pictures at quality 1 and 2",
        "2 refined pictures",
        "8 pictures",
    ] {
        assert!(text.contains(words), "`{words}` is missing from:\n{text}");
    }
    session
        .show
        .execute("view house from 0, -5, 1.6 to 0, 0, 1 fov 45 size 48x30")
        .unwrap();
    let text = session.show.execute("pool").unwrap().text;
    assert!(
        text.contains("0 pictures (0 kB) can serve this show"),
        "{text}"
    );
    assert!(text.contains("8 pictures"), "{text}");
    session.show.engine_mut().coarse().unwrap();
    let text = session.show.execute("pool drop unused").unwrap().text;
    assert!(
        text.starts_with("8 pictures dropped from memory, 8 pictures"),
        "{text}"
    );
    assert_eq!(stored(&store).len(), 6);
    session.show.execute("pool drop all").unwrap();
    assert!(stored(&store).is_empty());
    assert!(session.show.engine().estimate().pool().is_none());
    assert!(session.show.execute("pool drop everything").is_err());
}
