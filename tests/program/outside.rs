//! An external renderer in the whole loop. The renderer is this test program itself: called with a
//! mode and two paths it renders one image, well or badly.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use assert_cmd::Command;
use footlight_engine::{Ended, Engine, Error, Goal, Host};
use footlight_host::files::process::{Done, Job};
use footlight_host::files::{Memory, MemoryStore};
use footlight_host::work::Progress;
use footlight_picture::Image;
use footlight_picture::exr::{self, Precision};
use footlight_prompt::{Console, Repl};
use footlight_transport::Quality;
use footlight_transport::outside::{Outside, RendererCall};

/// The image of one run of the renderer: each coordinate lights its own column, and quality step
/// `q` adds an error of 0.1/q of it to the next.
fn painted(request: &serde_json::Value) -> Image {
    let size = |name: &str| request["view"][name].as_u64().unwrap() as usize;
    let (width, height) = (size("width"), size("height"));
    let quality = request["quality"].as_f64().unwrap();
    let mut image = Image::new(width, height);
    let list = request["coordinates"].as_array().unwrap();
    for (i, coordinate) in list.iter().enumerate() {
        let value = coordinate["value"].as_f64().unwrap();
        assert!(value >= 0.0 && !coordinate["name"].as_str().unwrap().is_empty());
        for y in 0..height {
            for (x, share) in [(i, 1.0), (i + 1, 0.1 / quality)] {
                let at = (y * width + x % width) * 3;
                image.data_mut()[at] += (value * share) as f32;
            }
        }
    }
    image
}

/// The name of the test below, for `--exact`.
const RENDERER: &str = "outside::renderer";

/// Not a test: the others call it as the renderer. Without a mode it does nothing.
#[test]
fn renderer() {
    let words: Vec<String> = std::env::args().collect();
    let Some(mode) = words.iter().find_map(|w| w.strip_prefix("mode=")) else {
        return;
    };
    let [.., settings, output] = words.as_slice() else {
        panic!("two paths belong behind the mode");
    };
    let request = std::fs::read(settings).unwrap();
    let mut image = painted(&serde_json::from_slice(&request).unwrap());
    match mode {
        "exit" => {
            eprintln!("no licence for the renderer");
            std::process::exit(7);
        }
        "hang" => std::thread::sleep(std::time::Duration::from_secs(600)),
        "nothing" => return,
        "size" => image = Image::new(image.width() + 1, image.height()),
        "bias" => image.data_mut().iter_mut().for_each(|v| *v += 0.05),
        _ => {}
    }
    let mut bytes = exr::encode(&image, Precision::Float, &[]).unwrap();
    let end = bytes.len();
    match mode {
        "nan" => bytes[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes()),
        "garbage" => bytes = b"a picture, but of words".to_vec(),
        _ => {}
    }
    std::fs::write(output, bytes).unwrap();
}

fn call(mode: &str, steps: u8) -> RendererCall {
    let program = std::env::current_exe().unwrap();
    let mode = format!("mode={mode}");
    let words = [
        "--nocapture",
        "--exact",
        RENDERER,
        &mode,
        "{settings}",
        "{output}",
    ];
    RendererCall {
        program: program.to_str().unwrap().to_owned(),
        arguments: words.map(str::to_owned).to_vec(),
        timeout: 120.0,
        steps,
        show: None,
        script: None,
        version: None,
    }
}

const SHOW: &str = "stage \"floor.obj\"\nview house from 0, -4, 2 to 0, 0, 0 fov 40 size 4x2\n\
    light one spot at 0, 0, 3 aim 0, 0, 0 beam 40 field 60 100 cd\nlight two like one\n\
    bank a = one\nbank b = two\n\
    cue 1 at 0:00 { snap a 100 b 20 }\ncue 2 at 0:02 { a 10 b full time 2 }\n";

const FLOOR: &str =
    "mtllib floor.mtl\nusemtl wood\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nf 1 2 3 4\n";
const WOOD: &str = "newmtl wood\nKd 0.5 0.4 0.3\n";

fn host(renderer: Outside) -> Host {
    Host {
        files: Box::new(
            Memory::default()
                .with("floor.obj", FLOOR)
                .with("floor.mtl", WOOD),
        ),
        store: Box::new(MemoryStore::default()),
        renderer: Arc::new(renderer),
        ..Host::default()
    }
}

fn open(call: RendererCall) -> Repl {
    open_within(host(Outside::new(call)))
}

fn open_within(host: Host) -> Repl {
    let engine = Engine::from_text("show.lxq", SHOW.as_bytes(), host).unwrap();
    Repl::new(engine, Console::default())
}

#[test]
fn a_renderer_with_a_scale_goes_through_the_whole_loop() {
    let mut show = open(call("linear", 3));
    show.execute("preview { refined 4 }").unwrap();
    let before = show.execute("plan").unwrap();
    // Beyond the scale: reported once.
    assert!(
        before.notes.concat().contains("is 1 to 3"),
        "{:?}",
        before.notes
    );
    assert!(show.execute("plan").unwrap().notes.is_empty());

    let ran = show.execute("run --until 0.1% --way paper -o out").unwrap();
    assert!(ran.text.contains("at quality 3"), "{}", ran.text);
    assert!(ran.notes.is_empty(), "{:?}", ran.notes);
    let engine = show.engine_mut();
    assert!(engine.estimate().refined() > 0 && engine.estimate().predicted_error().unwrap() < 1e-3);

    // The pool's image of the first cue is the renderer's own at its finest step.
    let engine = show.engine_mut();
    let start = engine.document().timeline().start();
    let pool = engine.picture(start).unwrap();
    let setting = engine.document().setting(start);
    let own = engine.render(&setting, Quality(3)).unwrap();
    for (a, b) in pool.data().iter().zip(own.data()) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
    // Negative settings are two runs, subtracted.
    let signed = engine.render(&[1.0, -2.0], Quality(1)).unwrap();
    assert!((signed.data()[0] - 1.0).abs() < 1e-6);
    assert!((signed.data()[3] - (0.1 - 2.0)).abs() < 1e-6);
}

/// A renderer without stated errors: two coarse sets and mixtures, or on request each bank at the
/// refined step. Four images test its linearity.
#[test]
fn a_renderer_that_states_nothing_takes_mixtures_unless_the_other_way_is_named() {
    // Runs at each of three steps, and refined images.
    let ran = |line: &str| {
        let counts = Arc::new([const { AtomicUsize::new(0) }; 3]);
        let own = Arc::clone(&counts);
        let render = move |job: &Job<'_>| {
            let request: serde_json::Value = serde_json::from_slice(job.inputs[0].2).unwrap();
            let step = request["quality"].as_u64().unwrap() as usize - 1;
            own[step].fetch_add(1, Ordering::Relaxed);
            Ok(Done {
                output: exr::encode(&painted(&request), Precision::Float, &[]).unwrap(),
                seconds: 60.0,
            })
        };
        let outside = Outside::with(call("linear", 3), Box::new(render));
        let mut show = open_within(host(outside));
        let text = show.execute(line).unwrap().text;
        let counts = counts.each_ref().map(|n| n.load(Ordering::Relaxed));
        (counts, show.engine().estimate().refined(), text)
    };
    let (counts, refined, text) = ran("run --until 0.1% -o out --way alone");
    assert_eq!((counts, refined), ([0, 0, 6], 0), "{text}");
    assert!(
        text.contains("2 pictures at quality 3") && text.contains("rendered: 2"),
        "{text}"
    );
    let (counts, refined, text) = ran("run --until 0.1% -o out");
    // A mixture of both signs takes two runs.
    assert_eq!((counts, refined), ([6, 2, 3], 2), "{text}");
}

#[test]
fn a_renderer_without_a_scale_leaves_nothing_to_refine() {
    let mut show = open(call("linear", 1));
    let done = show.engine_mut().refine(Goal::default()).unwrap();
    assert_eq!(done.ended, Some(Ended::Complete));
    assert_eq!(show.engine().estimate().predicted_error().unwrap(), 0.0);
}

#[test]
fn a_bias_is_warned_about_once_with_its_size() {
    let mut show = open(call("bias", 1));
    let reply = show.execute("picture").unwrap();
    let warning = reply.notes.concat();
    assert!(
        warning.contains("not linear") && warning.contains('%'),
        "{warning}"
    );
    assert!(show.execute("picture").unwrap().notes.is_empty());
}

#[test]
fn every_failure_is_an_error_that_says_what_happened() {
    let wanted = [
        ("exit", "code 7; it said last:"),
        ("exit", "no licence for the renderer"),
        ("nothing", "wrote no file"),
        ("size", "5x2 pixels, the view has 4x2"),
        ("nan", "NaN"),
        ("garbage", "not a readable OpenEXR file"),
    ];
    for (mode, words) in wanted {
        let error = open(call(mode, 1)).execute("picture").unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains(words), "{mode}: {error}");
    }
    let mut hanging = call("hang", 1);
    hanging.timeout = 0.5;
    let error = open(hanging).execute("picture").unwrap_err();
    assert!(error.to_string().contains("stopped after 0.5 s"), "{error}");
    let mut missing = call("linear", 1);
    missing.program = "/none/such".to_owned();
    let error = open(missing).execute("picture").unwrap_err();
    assert!(error.to_string().contains("cannot be started"), "{error}");
}

#[test]
fn a_cancel_ends_a_hanging_renderer() {
    struct Soon(std::time::Instant);
    impl Progress for Soon {
        fn cancelled(&self) -> bool {
            self.0.elapsed().as_millis() > 300
        }
    }
    let host = Host {
        progress: Box::new(Soon(std::time::Instant::now())),
        ..host(Outside::new(call("hang", 1)))
    };
    let mut show = open_within(host);
    let error = show.execute("picture").unwrap_err();
    assert!(
        matches!(error.engine(), Some(Error::Cancelled(_))) && error.exit_code() == 130,
        "{error}"
    );
}

fn footlight(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let mut command = Command::cargo_bin("footlight").unwrap();
    command
        .current_dir(folder)
        .args(arguments)
        .env("NO_COLOR", "1");
    let output = command.output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (
        output.status.code().unwrap_or(-1),
        String::from_utf8(said).unwrap(),
    )
}

#[test]
fn the_command_line_takes_a_renderer() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("show.lxq", SHOW),
        ("floor.obj", FLOOR),
        ("floor.mtl", WOOD),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let program = std::env::current_exe().unwrap();
    let line = |mode: &str| {
        let program = program.display();
        format!("'{program}' --nocapture --exact {RENDERER} mode={mode} {{settings}} {{output}}")
    };
    let run = ["run", "show.lxq", "-o", "out", "--renderer"];
    let (code, said) = footlight(folder.path(), &[&run[..], &[&line("bias")]].concat());
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("nothing left to refine") && said.contains("note: the outside renderer"));
    assert!(folder.path().join("out/show.html").exists());
    let (code, said) = footlight(folder.path(), &[&run[..], &[&line("exit")]].concat());
    assert!(code == 3 && said.contains("no licence"), "{code} {said}");
    let (code, said) = footlight(folder.path(), &[&run[..], &["render {settings}"]].concat());
    assert!(code == 2 && said.contains("no `{output}`"), "{code} {said}");
}

/// The example's renderer, if Python is installed.
#[cfg(unix)]
#[test]
fn the_example_renders() {
    let python = std::process::Command::new("python3")
        .arg("-c")
        .arg("0")
        .output();
    if !python.is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: there is no python3");
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/outside");
    let picture = out.path().join("picture.png");
    let (code, said) = footlight(
        &folder,
        &[
            "picture",
            "outside.lxq",
            "0:06",
            "--renderer",
            "python3 render.py {settings} {output}",
            "-o",
            picture.to_str().unwrap(),
        ],
    );
    assert!(code == 0 && !said.contains("not linear"), "{code} {said}");
    assert!(picture.exists());
}

/// How the renderer of spots begins in the manual.
#[cfg(unix)]
pub const SPOTS: &str = "python\n\"\"\"Direct light";

/// Text of the first block of the manual's page on renderers that begins so, without its language.
#[cfg(unix)]
pub fn shown_in_the_manual(begin: &str) -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/manual/renderer.md");
    let page = std::fs::read_to_string(page).unwrap();
    let found = page.split("```").find(|block| block.starts_with(begin));
    let (_, text) = found.unwrap().split_once('\n').unwrap();
    text.to_owned()
}

/// The settings in the manual can be rendered, and have the fields that a renderer reads.
#[cfg(unix)]
#[test]
fn the_manual_shows_the_settings() {
    let shown = shown_in_the_manual("json\n");
    let shown: serde_json::Value = serde_json::from_str(&shown).unwrap();
    let image = painted(&shown);
    assert_eq!((image.width(), image.height()), (160, 90));
    let sample = shown_in_the_manual("lxq\nshow \"Sample\"");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.lxq"), sample).unwrap();
    let copied = "sh -c 'cp \"$0\" settings.json' {settings} {output}";
    footlight(
        folder.path(),
        &["picture", "s.lxq", "0:00", "--renderer", copied],
    );
    let request = std::fs::read_to_string(folder.path().join("settings.json")).unwrap();
    let request: serde_json::Value = serde_json::from_str(&request).unwrap();
    let fields = |value: &serde_json::Value| -> Vec<String> {
        value.as_object().unwrap().keys().cloned().collect()
    };
    assert_eq!(shown["schema"], request["schema"]);
    for part in ["", "/view", "/coordinates/0"] {
        let of = |value: &serde_json::Value| fields(value.pointer(part).unwrap());
        assert_eq!(of(&shown), of(&request), "{part}");
    }
}

/// The manual's sample scene equals the program's output, and its renderer gives the closed form of
/// a spot's light on a floor.
#[cfg(unix)]
#[test]
fn the_manual_shows_a_scene_and_a_renderer_of_it() {
    let block = shown_in_the_manual;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("s.lxq"), block("lxq\nshow \"Sample\"")).unwrap();
    std::fs::write(at("spots.py"), block(SPOTS)).unwrap();
    let copied = "sh -c 'cp \"$0\" scene.json' {scene} {settings} {output}";
    footlight(
        folder.path(),
        &["picture", "s.lxq", "0:00", "--renderer", copied],
    );
    let read = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let mut scene = read(&std::fs::read_to_string(at("scene.json")).unwrap());
    let shares = scene["lights"][0]["shares"].as_array_mut().unwrap();
    assert!(shares.len() > 100);
    shares.truncate(3);
    assert_eq!(
        read(&block("json\n{ \"schema\": 1,\n  \"materials\"")),
        scene
    );
    let python = std::process::Command::new("python3")
        .args(["-c", "0"])
        .output();
    if !python.is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: there is no python3");
        return;
    }
    let renderer = "python3 spots.py {scene} {settings} {output}";
    let words = [
        "picture",
        "s.lxq",
        "0:00",
        "--float",
        "-o",
        "p.exr",
        "--renderer",
        renderer,
    ];
    let (code, said) = footlight(folder.path(), &words);
    assert!(code == 0 && !said.contains("not linear"), "{code} {said}");
    let image = exr::decode(&std::fs::read(at("p.exr")).unwrap(), 1 << 20).unwrap();
    // The pixel right of and below the middle, by hand: the lamp is at (0, -2, 3).
    let half = 20_f64.to_radians().tan();
    let (across, down) = (half / 18.0, -half / 18.0);
    let eye = [0.0, -4.0, 2.0];
    let (ahead, up) = (
        [0.0, 2.0 / 5_f64.sqrt(), -1.0 / 5_f64.sqrt()],
        [0.0, 1.0 / 5_f64.sqrt(), 2.0 / 5_f64.sqrt()],
    );
    let way = [across, ahead[1] + down * up[1], ahead[2] + down * up[2]];
    let far = eye[2] / -way[2];
    let (x, y) = (far * way[0], eye[1] + far * way[1]);
    let square = x * x + (y + 2.0).powi(2) + 9.0;
    let to_axis = ((y + 2.0) * 2.0 + 9.0) / (square.sqrt() * 13_f64.sqrt());
    let profile = footlight_show::geometry::profile::Profile::new(30.0, 60.0).unwrap();
    let share = profile.share(to_axis.acos());
    let wanted = 0.5 / std::f64::consts::PI * 900.0 * share * (3.0 / square.sqrt()) / square;
    let found = f64::from(image.pixel(16, 9).unwrap()[0]);
    assert!((found / wanted - 1.0).abs() < 1e-3, "{found} {wanted}");
}
