//! Output of `play`, `film`, `frames` and `picture`, by file extension; read back by our own
//! readers, and by oiiotool and ffmpeg if installed.

use std::io::{self, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use footlight_engine::{Engine, Host};
use footlight_host::files::{Clock, Memory, MemoryStore, Store};
use footlight_picture::exr::{self, Precision, layer};
use footlight_picture::{Image, decode};
use footlight_prompt::{Console, Repl};
use footlight_report::film::{Canvas, Outlets, Pipe, Shown};

const WIDTH: usize = 32;
const HEIGHT: usize = 18;

/// A bank's image: a soft pool of coloured light on a dim ground.
fn pool(centre: f32, colour: [f32; 3]) -> Image {
    let mut image = Image::new(WIDTH, HEIGHT);
    for (i, pixel) in image.data_mut().chunks_exact_mut(3).enumerate() {
        let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
        let away = (x - centre).hypot(y - 9.0) / 8.0;
        let light = 0.01 + (-away * away).exp();
        for (channel, c) in pixel.iter_mut().zip(colour) {
            *channel = 40.0 * c * light;
        }
    }
    image
}

const SHOW: &str = "show \"Stra\u{df}e\"
preview { rate 5 }
bank warm image \"warm.exr\"
bank k\u{fc}hl image \"cool.exr\"  dimmer square
bank wash image \"wash.exr\" rgb
cue 1 at 0:00 { snap  warm 80  k\u{fc}hl 10 }
cue 2 at 0:02 { time 3  curve ease  warm 15  k\u{fc}hl full }
cue 3 at 0:04 { time 2.1  wash #ff8000 }
";

fn pictures() -> [(&'static str, Vec<u8>); 3] {
    let coded = |image: &Image| exr::encode(image, Precision::Float, &[]).unwrap();
    [
        ("warm.exr", coded(&pool(8.0, [1.0, 0.6, 0.3]))),
        ("cool.exr", coded(&pool(22.0, [0.2, 0.5, 1.0]))),
        ("wash.exr", coded(&pool(16.0, [0.8, 0.8, 0.8]))),
    ]
}

fn open(pipe: Option<Pipe>) -> (Repl, MemoryStore) {
    open_within(4 << 30, pipe)
}

/// Opens the show with this much memory, in bytes.
fn open_within(memory: usize, pipe: Option<Pipe>) -> (Repl, MemoryStore) {
    let store = MemoryStore::default();
    let files = pictures()
        .into_iter()
        .fold(Memory::default(), |files, (name, bytes)| {
            files.with(name, bytes)
        });
    let host = Host {
        files: Box::new(files),
        store: Box::new(store.clone()),
        memory,
        ..Host::default()
    };
    let console = Console {
        outlets: Outlets {
            pipe,
            ..Outlets::default()
        },
        ..Console::default()
    };
    let engine = Engine::from_text("show.lxq", SHOW.as_bytes(), host).unwrap();
    (Repl::new(engine, console), store)
}

fn read(store: &MemoryStore, path: &str) -> Vec<u8> {
    store.read(Path::new(path), 1 << 24).unwrap()
}

fn names(store: &MemoryStore) -> Vec<String> {
    let paths = store.paths();
    paths.iter().map(|p| p.display().to_string()).collect()
}

#[test]
fn numbered_pictures_are_the_frames_and_the_frames_are_pictures() {
    let (mut show, store) = open(None);
    // 6.1 s at 5 per second: 31 whole frames, and one for the end.
    let told = show.execute("frames -o f/a##.png").unwrap().text;
    assert!(told.contains("32 frames of 32x18, 5 frames/s"), "{told}");
    assert!(told.contains("wrote f/a01.png to f/a32.png"), "{told}");
    assert_eq!(names(&store).len(), 32);
    show.execute("frames -o f/%03d.exr").unwrap();
    show.execute("frames -o g/%d.exr --float").unwrap();
    for (number, time) in [(1, "0:00"), (16, "0:03"), (32, "0:06.1")] {
        show.execute(&format!("picture {time} -o p.png")).unwrap();
        show.execute(&format!("picture {time} --float -o p.exr"))
            .unwrap();
        let decoded = |name: &str| decode::light(&read(&store, name), 1 << 20).unwrap();
        let (frame, picture) = (decoded(&format!("f/a{number:02}.png")), decoded("p.png"));
        // One display step is at most 0.9 % of white.
        let off = frame.data().iter().zip(picture.data());
        assert!(off.map(|(a, b)| (a - b).abs()).all(|d| d <= 0.01), "{time}");
        let linear = |name: &str| exr::decode(&read(&store, name), 1 << 20).unwrap();
        let picture = linear("p.exr");
        for (name, room) in [
            (format!("f/{number:03}.exr"), 1.0 / 2000.0),
            (format!("g/{number}.exr"), 1e-6),
        ] {
            for (a, b) in linear(&name).data().iter().zip(picture.data()) {
                assert!((a - b).abs() <= room * b.abs() + 1e-6, "{name}: {a} {b}");
            }
        }
    }
}

#[test]
fn a_picture_is_half_precision_unless_asked() {
    let (mut show, store) = open(None);
    show.execute("picture 0:03 -o half.exr").unwrap();
    show.execute("picture 0:03 -o float.exr --float").unwrap();
    let (half, float) = (read(&store, "half.exr"), read(&store, "float.exr"));
    let decoded = |bytes: &[u8]| exr::decode(bytes, 1 << 20).unwrap();
    let (a, b) = (decoded(&half), decoded(&float));
    assert!(a != b && half.len() < float.len());
    for (a, b) in a.data().iter().zip(b.data()) {
        assert!((a - b).abs() <= b.abs() / 2048.0, "{a} {b}");
    }
    // The bank's name is not ASCII, but a header must be.
    show.execute("picture --bank k\u{fc}hl -o bank.exr")
        .unwrap();
    let header = exr::attributes(&read(&store, "bank.exr")).unwrap();
    assert!(header[0].1.starts_with("k?hl alone at full"), "{header:?}");
    let error = show.execute("picture -o a.png --float").unwrap_err();
    assert!(error.to_string().contains("`--float`"), "{error}");
}

#[test]
fn layers_are_keys_banks_or_the_basis_with_their_settings() {
    let (mut show, store) = open(None);
    let told = show.execute("frames -o keys.exr").unwrap().text;
    let keys = show.engine().document().keys().keys().to_vec();
    assert!(
        told.contains(&format!("{} key images", keys.len())),
        "{told}"
    );
    show.execute("frames -o banks.exr --layers banks --float")
        .unwrap();
    show.execute("frames -o basis.exr --layers basis").unwrap();
    let file = read(&store, "keys.exr");
    assert_eq!(layer::names(&file).unwrap().len(), keys.len());
    let header = exr::attributes(&file).unwrap();
    let settings = &header.iter().find(|(n, _)| n == "settings").unwrap().1;
    assert!(
        settings.starts_with("key001: warm 0.8, k?hl 0.01"),
        "{settings}"
    );
    assert_eq!(settings.lines().count(), keys.len());

    let banks = read(&store, "banks.exr");
    // `layer::names` returns the file's own order, which is alphabetical.
    assert_eq!(
        layer::names(&banks).unwrap(),
        ["k_hl", "warm", "wash_b", "wash_g", "wash_r"]
    );
    assert_eq!(layer::names(&read(&store, "basis.exr")).unwrap().len(), 5);
    // Every key is the sum of the banks by its setting, to the rounding of halves.
    let in_order = ["warm", "k_hl", "wash_r", "wash_g", "wash_b"].map(Some);
    let found = layer::decode(&banks, &in_order, 1 << 24).unwrap();
    let banks: Vec<Image> = found.into_iter().map(Result::unwrap).collect();
    for (i, key) in keys.iter().enumerate() {
        let name = format!("key{:03}", i + 1);
        let mut found = layer::decode(&file, &[Some(&name)], 1 << 24).unwrap();
        let image = found.remove(0).unwrap();
        for (at, light) in image.data().iter().enumerate() {
            let sum: f64 = key
                .iter()
                .zip(&banks)
                .map(|(s, bank)| s * f64::from(bank.data()[at]))
                .sum();
            assert!((f64::from(*light) - sum).abs() <= 6e-4 * sum.abs() + 1e-6);
        }
    }
}

/// The least memory, bytes, with which a line succeeds.
fn least(line: &str) -> usize {
    // The banks' images need at least this.
    let (mut low, mut high) = (1 << 16, 64 << 20);
    while high - low > 64 {
        let middle = usize::midpoint(low, high);
        match open_within(middle, None).0.execute(line) {
            Ok(_) => high = middle,
            Err(_) => low = middle,
        }
    }
    high
}

#[test]
fn layers_that_do_not_fit_into_memory_are_refused_with_a_way_out() {
    let frames = least("frames -o frame####.exr");
    let line = "frames -o keys.exr --float";
    assert!(least(line) > frames);
    let (mut scarce, store) = open_within(frames, None);
    let error = scarce.execute(line).unwrap_err();
    let said = error.report(footlight_show::diagnostic::Style::Plain);
    assert!(said.contains("frame####.exr"), "{said}");
    assert!(names(&store).is_empty());
    scarce.execute("frames -o frame####.exr").unwrap();
}

/// A pipe whose reader takes some bytes and then closes it.
#[derive(Clone)]
struct Reader(Arc<Mutex<Vec<u8>>>, usize);

impl Write for Reader {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut held = self.0.lock().unwrap();
        if held.len() + bytes.len() > self.1 {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        held.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

const HEADER: &str = "YUV4MPEG2 W32 H18 F5:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";

#[test]
fn video_is_the_frames_in_a_file_and_down_a_pipe() {
    let held = Arc::new(Mutex::new(Vec::new()));
    let reader = Reader(Arc::clone(&held), usize::MAX);
    let (mut show, store) = open(Some(Box::new(move || Box::new(reader.clone()))));
    let reply = show.execute("film -o film.y4m --chroma 444").unwrap();
    assert!(
        !reply.beside && reply.text.contains("32 frames"),
        "{}",
        reply.text
    );
    let reply = show.execute("film -o - --chroma 444").unwrap();
    assert!(reply.beside, "words must not go into the film");
    let film = read(&store, "film.y4m");
    assert!(*held.lock().unwrap() == film);
    let frames = film.strip_prefix(HEADER.as_bytes()).unwrap();
    let bytes = 6 + 3 * WIDTH * HEIGHT;
    assert_eq!(frames.len(), 32 * bytes);
    show.execute("frames -o f%d.png").unwrap();
    for (i, frame) in frames.chunks(bytes).enumerate() {
        let picture = read(&store, &format!("f{}.png", i + 1));
        let picture = decode::light(&picture, 1 << 20).unwrap();
        let (luma, chroma) = frame[6..].split_at(WIDTH * HEIGHT);
        let (blue, red) = chroma.split_at(WIDTH * HEIGHT);
        for (at, pixel) in picture.data().chunks(3).enumerate() {
            let l = (f64::from(luma[at]) - 16.0) / 219.0;
            let code = [
                l + 1.5748 * (f64::from(red[at]) - 128.0) / 224.0,
                l + 1.8556 * (f64::from(blue[at]) - 128.0) / 224.0,
            ];
            for (code, light) in code.iter().zip([pixel[0], pixel[2]]) {
                let shown = encoded(f64::from(light));
                assert!(
                    (code - shown).abs() * 255.0 < 1.7,
                    "frame {i}: {code} {shown}"
                );
            }
        }
    }
}

fn encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[test]
fn a_reader_that_leaves_ends_the_film_and_that_is_well() {
    let held = Arc::new(Mutex::new(Vec::new()));
    let reader = Reader(Arc::clone(&held), 6000);
    let (mut show, _) = open(Some(Box::new(move || Box::new(reader.clone()))));
    let reply = show.execute("film -o - --chroma 444").unwrap();
    assert!(reply.text.contains("left after 3 frames"), "{}", reply.text);
    let (mut show, _) = open(None);
    let error = show.execute("film -o -").unwrap_err();
    assert!(error.to_string().contains("| ffmpeg"), "{error}");
    assert_eq!(error.exit_code(), 2);
}

/// A clock that advances by a quarter of a second at each reading.
struct Quarters(AtomicUsize);

impl Clock for Quarters {
    fn seconds(&self) -> f64 {
        self.0.fetch_add(1, Ordering::Relaxed) as f64 / 4.0
    }
}

/// A canvas that keeps its frames, and ends after some.
struct Seen(Arc<Mutex<Vec<Shown>>>, usize);

impl Canvas for Seen {
    fn frame(&self, picture: &Shown) -> bool {
        let mut seen = self.0.lock().unwrap();
        seen.push(picture.clone());
        seen.len() < self.1
    }

    fn end(&self) {}
}

#[test]
fn play_performs_in_real_time_where_there_is_a_canvas() {
    // The clock has advanced by a quarter when the first frame is made.
    for (patience, from, first, frames, words) in [
        (
            usize::MAX,
            "0:00",
            "0:00.25",
            25,
            "from 0s to 6.1s: 25 frames in 6.2 s",
        ),
        (
            usize::MAX,
            "0:04",
            "0:04.25",
            9,
            "from 4s to 6.1s: 9 frames",
        ),
        (3, "0:02", "0:02.25", 3, "from 2s to 2.75s: 3 frames"),
    ] {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let files = pictures().into_iter();
        let files = files.fold(Memory::default(), |f, (name, bytes)| f.with(name, bytes));
        let host = Host {
            files: Box::new(files),
            clock: Box::new(Quarters(AtomicUsize::new(0))),
            ..Host::default()
        };
        let console = Console {
            canvas: Some(Box::new(Seen(Arc::clone(&seen), patience))),
            ..Console::default()
        };
        let engine = Engine::from_text("show.lxq", SHOW.as_bytes(), host).unwrap();
        let mut show = Repl::new(engine, console);
        show.execute(&format!("at {from}")).unwrap();
        let reply = show.execute("play").unwrap();
        assert!(reply.text.contains(words), "{}", reply.text);
        let seen = seen.lock().unwrap();
        assert_eq!((seen.len(), seen[0].size), (frames, (WIDTH, HEIGHT)));
        let picture = show
            .execute(&format!("picture {first}"))
            .unwrap()
            .picture
            .unwrap();
        let off = seen[0]
            .rgb
            .iter()
            .zip(&picture.rgb)
            .map(|(a, b)| a.abs_diff(*b));
        assert!(off.max().unwrap() <= 1);
        assert!(seen.last().unwrap().rgb != picture.rgb);
    }
}

/// The show with its images in a folder.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("show.lxq"), SHOW).unwrap();
    for (name, bytes) in pictures() {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn footlight(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
    command
        .current_dir(folder)
        .args(["--pool", "off"])
        .args(words);
    command
}

/// Output of another program; `None` if it is not installed.
fn other(program: &str, folder: &Path, words: &[&str]) -> Option<String> {
    match Command::new(program)
        .current_dir(folder)
        .args(words)
        .output()
    {
        Ok(done) => {
            let text =
                String::from_utf8_lossy(&done.stdout) + String::from_utf8_lossy(&done.stderr);
            assert!(done.status.success(), "{program} {words:?}: {text}");
            Some(text.into_owned())
        }
        Err(error) => {
            eprintln!("skipped: {program} does not run here ({error})");
            None
        }
    }
}

#[test]
fn the_command_streams_to_standard_output_and_a_closed_one_is_success() {
    let folder = folder();
    let play = ["film", "show.lxq", "-o", "-"];
    let whole = footlight(folder.path(), &play).output().unwrap();
    assert!(whole.status.success());
    assert!(
        whole
            .stdout
            .starts_with(b"YUV4MPEG2 W32 H18 F5:1 Ip A1:1 C420jpeg ")
    );
    let words = String::from_utf8(whole.stderr).unwrap();
    assert!(words.contains("32 frames"), "{words}");
    let mut left = footlight(folder.path(), &play)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut out = left.stdout.take().unwrap();
    out.read_exact(&mut [0; 100]).unwrap();
    drop(out);
    assert!(left.wait().unwrap().success());
}

#[test]
fn other_programs_read_what_is_written() {
    let folder = folder();
    let at = folder.path();
    for words in [
        ["frames", "show.lxq", "-o", "keys.exr"].as_slice(),
        &[
            "frames",
            "show.lxq",
            "-o",
            "banks.exr",
            "--layers",
            "banks",
            "--float",
        ],
        &["film", "show.lxq", "-o", "film.y4m"],
        &["picture", "show.lxq", "0:03", "-o", "p.exr"],
    ] {
        assert!(
            footlight(at, words).status().unwrap().success(),
            "{words:?}"
        );
    }
    if let Some(told) = other(
        "oiiotool",
        at,
        &["--info", "-v", "keys.exr", "banks.exr", "p.exr"],
    ) {
        for said in [
            "32 x   18",
            "key001.R",
            "warm.B",
            "wash_r.G",
            "settings: \"key001: warm 0.8",
        ] {
            assert!(told.contains(said), "{said}: {told}");
        }
        // One layer extracted by oiiotool is the bank's image at full.
        let warm = [
            "banks.exr",
            "--ch",
            "R=warm.R,G=warm.G,B=warm.B",
            "warm.exr",
            "--diff",
        ];
        let told = other("oiiotool", at, &warm).unwrap();
        assert!(told.contains("PASS"), "{told}");
    }
    let probe = [
        "-v",
        "error",
        "-count_frames",
        "-show_entries",
        "stream=nb_read_frames,color_range",
        "film.y4m",
    ];
    if let Some(told) = other("ffprobe", at, &probe) {
        assert!(
            told.contains("nb_read_frames=32") && told.contains("color_range=tv"),
            "{told}"
        );
    }
    // The folder contains only the results, and nothing half written.
    let names = std::fs::read_dir(at)
        .unwrap()
        .map(|e| e.unwrap().file_name());
    assert!(
        !names
            .into_iter()
            .any(|n| n.to_string_lossy().ends_with(".part"))
    );
}
