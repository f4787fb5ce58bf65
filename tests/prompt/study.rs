//! Comparisons with references, from the verb to the file.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::operator::Altered;
use crate::{Ticking, prompt};
use footlight_engine::{Ended, Goal, Host, Refinement, Way};
use footlight_host::files::{Disk, Folder, MemoryStore, Store};
use footlight_picture::Image;
use footlight_picture::exr::{self, Precision};
use footlight_prompt::{Repl, Verb};
use footlight_report::{Record, StudyKind};
use footlight_show::diagnostic::Style;
use footlight_transport::Quality;
use std::sync::Arc;

/// The furnace, small, with a separate store.
fn furnace(store: &MemoryStore) -> Repl {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/reference/furnace");
    let text = std::fs::read_to_string(folder.join("furnace.lxq")).unwrap();
    let host = Host {
        files: Box::new(Folder::new(&folder, 1 << 20)),
        store: Box::new(store.clone()),
        clock: Box::new(Ticking::by(0.25)),
        ..Host::default()
    };
    let text = text.replace("size 128x128", "size 32x32");
    prompt("furnace.lxq", text.as_bytes(), host).unwrap()
}

const BANKS: [&str; 6] = ["xneg", "xpos", "yneg", "ypos", "zneg", "zpos"];

fn keep(store: &MemoryStore, name: &str, image: &Image) {
    let bytes = exr::encode(image, Precision::Float, &[]).unwrap();
    store.write(&Path::new("refs").join(name), &bytes).unwrap();
}

/// Each bank rendered by the show at a quality.
fn rendered(show: &mut Repl, quality: u8) -> Vec<Image> {
    let unit = |i: usize| (0..6).map(|j| f64::from(u8::from(i == j))).collect();
    let settings: Vec<Vec<f64>> = (0..6).map(unit).collect();
    let image = |s: &Vec<f64>| show.engine_mut().render(s, Quality(quality)).unwrap();
    settings.iter().map(image).collect()
}

fn scaled(image: &Image, factor: f32) -> Image {
    let data = image.data().iter().map(|v| v * factor).collect();
    Image::from_data(image.width(), image.height(), data).unwrap()
}

fn compare(show: &mut Repl) -> serde_json::Value {
    let line = "compare --reference refs --quality 1 --json";
    serde_json::from_str(&show.execute(line).unwrap().text).unwrap()
}

#[test]
fn a_picture_is_its_own_reference_and_a_brighter_one_is_not() {
    let store = MemoryStore::default();
    let mut show = furnace(&store);
    for (name, image) in BANKS.iter().zip(rendered(&mut show, 1)) {
        // The reference is 2 % darker for one bank, in halves for another.
        match *name {
            "xneg" => keep(&store, "xneg.exr", &scaled(&image, 1.0 / 1.02)),
            "zpos" => {
                keep(&store, "zpos_A.exr", &scaled(&image, 0.9));
                keep(&store, "zpos_B.exr", &scaled(&image, 1.1));
            }
            _ => keep(&store, &format!("{name}.exr"), &image),
        }
    }
    let found = compare(&mut show);
    assert_eq!(found["quality"], 1);
    assert_eq!(found["seconds"], 0.5);
    let banks = found["banks"].as_array().unwrap();
    let names: Vec<&str> = banks.iter().map(|b| b["name"].as_str().unwrap()).collect();
    assert_eq!(names, BANKS);
    let number = |bank: usize, what: &str| banks[bank][what].as_f64().unwrap();
    assert!((number(0, "rmse") - 0.02).abs() < 1e-6);
    assert!((number(0, "mean_ratio") - 1.02).abs() < 1e-6);
    assert!(banks[0]["rmse_noise_free"].is_null());
    // All walls are lamps: no pixel is away from them.
    assert!(banks[0]["rmse_no_emitters"].is_null());
    assert_eq!(number(1, "rmse"), 0.0);
    // Between its halves: the estimate under the root is negative, shown by a signed zero.
    let fair = number(5, "rmse_noise_free");
    assert!(fair == 0.0 && fair.is_sign_negative(), "{fair}");

    let words = show.execute("compare --reference refs -o off.png").unwrap();
    assert!(words.text.contains("zpos") && words.text.contains("< noise"));
    let drawn = store.read(Path::new("off.png"), 1 << 24).unwrap();
    assert_eq!(&drawn[1..4], b"PNG");
}

/// The reference images shipped with Cornell: error without noise and without pixels next to a
/// lamp, averaged over the banks; the worst bank (the floor, at the first step) has 1.3 times that.
#[test]
fn cornell_meets_the_pictures_beside_it() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/reference/cornell");
    let text = std::fs::read_to_string(folder.join("cornell.lxq")).unwrap();
    let host = Host {
        files: Box::new(Folder::new(&folder, 1 << 20)),
        store: Box::new(Disk),
        threads: 2,
        ..Host::default()
    };
    let mut show = prompt("cornell.lxq", text.as_bytes(), host).unwrap();
    for (quality, most) in [("1", 0.011), ("2", 0.006)] {
        let words = "compare --json --quality".split(' ').map(OsStr::new);
        let folder = [quality.as_ref(), "--reference".as_ref(), folder.as_os_str()];
        let verb = Verb::of(words.chain(folder)).unwrap();
        let found: serde_json::Value =
            serde_json::from_str(&show.call(&verb).unwrap().text).unwrap();
        let banks = found["banks"].as_array().unwrap();
        let error = |bank: &serde_json::Value| bank["rmse_noise_free_no_emitters"].as_f64();
        let errors: Vec<f64> = banks.iter().map(|bank| error(bank).unwrap()).collect();
        let mean = errors.iter().sum::<f64>() / 3.0;
        assert_eq!(errors.len(), 3);
        assert!(mean < most, "quality {quality}: {errors:?}");
        assert!(
            errors.iter().all(|e| *e < 1.35 * mean),
            "quality {quality}: {errors:?}"
        );
    }
}

#[test]
fn what_is_missing_or_does_not_fit_is_told_with_what_there_is() {
    let store = MemoryStore::default();
    let mut show = furnace(&store);
    let mut told = |line: &str| {
        let error = show.execute(line).unwrap_err();
        (error.exit_code(), error.report(Style::Plain))
    };
    let (code, said) = told("compare");
    assert_eq!(code, 2);
    assert!(said.contains("--reference DIR"), "{said}");
    keep(&store, "xneg.exr", &Image::new(32, 32));
    keep(&store, "xpos_A.exr", &Image::new(32, 32));
    let (code, said) = told("compare --reference refs");
    assert_eq!(code, 3);
    assert!(said.contains("no reference for xpos, yneg"), "{said}");
    assert!(said.contains("it has xneg.exr, xpos_A.exr"), "{said}");
    for name in BANKS {
        keep(&store, &format!("{name}.exr"), &Image::new(16, 32));
    }
    let (code, said) = told("compare --reference refs");
    assert_eq!(code, 3);
    assert!(
        said.contains("is 16x32, the show's view is 32x32"),
        "{said}"
    );
    let path = Path::new("refs/xneg.exr");
    store.write(path, b"no picture").unwrap();
    let (code, said) = told("compare --reference refs");
    assert!(code == 3 && said.contains("xneg.exr"), "{said}");
    let (code, said) = told("compare --reference refs -o off.gif");
    assert!(code == 2 && said.contains(".png or .svg"), "{said}");
    let (code, _) = told("compare --reference refs --quality 9");
    assert_eq!(code, 2);
}

#[test]
fn a_black_reference_gives_no_figure() {
    let store = MemoryStore::default();
    let mut show = furnace(&store);
    for name in BANKS {
        keep(&store, &format!("{name}.exr"), &Image::new(32, 32));
    }
    let found = compare(&mut show);
    assert!(found["banks"][0]["rmse"].is_null());
    assert!(found["banks"][0]["mean_ratio"].is_null());
}

#[test]
#[ignore = "slow"]
fn the_chart_of_the_scale_comes_as_a_record_and_as_a_drawing() {
    let store = MemoryStore::default();
    let mut show = furnace(&store);
    let said = show.execute("chart transport -o chart.json").unwrap().text;
    assert!(said.contains("against quality 3"), "{said}");
    let bytes = store.read(Path::new("chart.json"), 1 << 20).unwrap();
    let record: Record = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(
        (record.kind, record.subject.as_str()),
        (StudyKind::Transport, "Furnace")
    );
    let mean = &record.series[0];
    let curve = record.curve(mean, "quality", "error");
    let qualities: Vec<f64> = curve.iter().map(|p| p.0).collect();
    assert_eq!(qualities, [1.0, 2.0, 3.0]);
    assert_eq!(curve[2].1, 0.0);
    assert!(curve[0].1 > 0.01 && curve[0].1 > curve[1].1, "{curve:?}");
    // The mean and the worst, then every bank.
    assert_eq!(record.series.len(), 2 + BANKS.len());
    assert!(mean.points[0].marks.contains(&"coarse".to_owned()));
    assert!(mean.points[1].marks.contains(&"refined".to_owned()));

    let error = show.execute("chart plans").unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("chart transport"));
    let error = show.execute("chart transport -o chart.pdf").unwrap_err();
    assert_eq!(error.exit_code(), 2);
}

#[test]
fn the_price_of_a_step_rises_with_it() {
    let store = MemoryStore::default();
    let mut show = furnace(&store);
    let text = show.execute("quality --json").unwrap().text;
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(found["operator"], "radiosity");
    let steps = found["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 3);
    let total = |step: &serde_json::Value| {
        let of = |part: &str| step["predicted"][part].as_f64().unwrap();
        of("prepare") + of("banks")
    };
    for pair in steps.windows(2) {
        assert!(total(&pair[0]) > 0.0 && total(&pair[0]) <= total(&pair[1]));
    }
    let words = show.execute("quality").unwrap().text;
    assert!(words.contains("all banks s"), "{words}");
}

/// A random show with images of a size, and another host.
fn random_of(size: [usize; 2], store: &MemoryStore, host: Host) -> Repl {
    let made = crate::random_show::random_show(7, size);
    let path = Path::new("set/random.lxq");
    store.write(path, made.show.as_bytes()).unwrap();
    let host = Host {
        files: Box::new(made.files()),
        store: Box::new(store.clone()),
        ..host
    };
    crate::open(path, host)
}

/// A show with a renderer that ignores quality.
fn stubborn() -> Repl {
    let host = Host {
        renderer: Arc::new(Altered {
            finest: Some(Quality(4)),
            quality: Some(Quality(1)),
            ..Altered::default()
        }),
        ..Host::default()
    };
    random_of([16, 9], &MemoryStore::default(), host)
}

#[test]
fn a_renderer_that_ignores_quality_leaves_no_error_and_nothing_to_refine() {
    for way in [Way::Paper, Way::Auto] {
        let mut show = stubborn();
        let wanted = Refinement::from(Goal::until(0.01)).by(way);
        let ended = show.engine_mut().refine(wanted).unwrap().ended;
        assert_eq!(ended, Some(Ended::Complete), "{way:?}");
        assert_eq!(show.engine().estimate().refined(), 0);
        assert_eq!(show.engine().estimate().predicted_error().unwrap(), 0.0);
        let pool = show.engine().estimate().pool().unwrap();
        assert!(pool.has_no_estimated_error(), "{way:?}");
    }
}

#[test]
fn what_is_no_chart_is_refused() {
    let store = MemoryStore::default();
    let mut show = furnace(&store);
    for (line, said) in [
        ("chart", "`chart transport -o"),
        ("chart scale", "chart transport"),
        (
            "chart transport -o chart.gif",
            "use .png, .svg, .csv or .json",
        ),
    ] {
        let error = show.execute(line).unwrap_err();
        assert!(error.to_string().contains(said), "{line}: {error}");
        assert_eq!(error.exit_code(), 2);
    }
}
