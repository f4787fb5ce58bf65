//! Comparisons with references, from the verb to the file.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]

use std::path::{Path, PathBuf};

use footlight::diagnostic::Style;
use footlight::files::{Clock, Folder, Shelf, Store};
use footlight::interpreter::{Call, Host, Interpreter, Verb};
use footlight::picture::Image;
use footlight::picture::exr::{self, Precision};
use footlight::study::{Kind, Record};
use footlight::transport::Quality;
use std::sync::atomic::{AtomicU32, Ordering};

/// Time that passes by a quarter of a second whenever someone looks.
#[derive(Default)]
struct Ticking(AtomicU32);

impl Clock for Ticking {
    fn seconds(&self) -> f64 {
        f64::from(self.0.fetch_add(1, Ordering::Relaxed)) * 0.25
    }
}

/// The furnace, small, with a store of its own.
fn furnace(shelf: &Shelf) -> Interpreter {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/reference/furnace");
    let text = std::fs::read_to_string(folder.join("furnace.lxq")).unwrap();
    let host = Host {
        files: Box::new(Folder::new(&folder, 1 << 20)),
        store: Box::new(shelf.clone()),
        clock: Box::new(Ticking::default()),
        ..Host::default()
    };
    let text = text.replace("size 128x128", "size 32x32");
    Interpreter::from_text("furnace.lxq", text.as_bytes(), host).unwrap()
}

const BANKS: [&str; 6] = ["xneg", "xpos", "yneg", "ypos", "zneg", "zpos"];

fn keep(shelf: &Shelf, name: &str, image: &Image) {
    let bytes = exr::encode(image, Precision::Float, &[]).unwrap();
    shelf.write(&Path::new("refs").join(name), &bytes).unwrap();
}

/// Each bank as the show itself renders it at a quality.
fn rendered(show: &mut Interpreter, quality: u8) -> Vec<Image> {
    let unit = |i: usize| (0..6).map(|j| f64::from(u8::from(i == j))).collect();
    let settings: Vec<Vec<f64>> = (0..6).map(unit).collect();
    let image = |s: &Vec<f64>| show.render(s, Quality(quality)).unwrap();
    settings.iter().map(image).collect()
}

fn scaled(image: &Image, factor: f32) -> Image {
    let data = image.data().iter().map(|v| v * factor).collect();
    Image::from_data(image.width(), image.height(), data).unwrap()
}

fn compare(show: &mut Interpreter) -> serde_json::Value {
    let call = Call::new(Verb::Compare).with("reference", "refs");
    let call = call.with("quality", "2").with("json", "");
    serde_json::from_str(&show.call(&call).unwrap().text).unwrap()
}

#[test]
fn a_picture_is_its_own_reference_and_a_brighter_one_is_not() {
    let shelf = Shelf::default();
    let mut show = furnace(&shelf);
    for (name, image) in BANKS.iter().zip(rendered(&mut show, 2)) {
        // The reference is 2 % darker for one bank, in halves for another.
        match *name {
            "xneg" => keep(&shelf, "xneg.exr", &scaled(&image, 1.0 / 1.02)),
            "zpos" => {
                keep(&shelf, "zpos_A.exr", &scaled(&image, 0.9));
                keep(&shelf, "zpos_B.exr", &scaled(&image, 1.1));
            }
            _ => keep(&shelf, &format!("{name}.exr"), &image),
        }
    }
    let found = compare(&mut show);
    assert_eq!(found["quality"], 2);
    assert_eq!(found["seconds"], 0.5);
    let banks = found["banks"].as_array().unwrap();
    let names: Vec<&str> = banks.iter().map(|b| b["name"].as_str().unwrap()).collect();
    assert_eq!(names, BANKS);
    let number = |bank: usize, what: &str| banks[bank][what].as_f64().unwrap();
    assert!((number(0, "rmse") - 0.02).abs() < 1e-6);
    assert!((number(0, "mean_ratio") - 1.02).abs() < 1e-6);
    assert!(banks[0]["rmse_noise_free"].is_null());
    // All walls are lamps: there is no pixel away from them.
    assert!(banks[0]["rmse_no_emitters"].is_null());
    assert_eq!(number(1, "rmse"), 0.0);
    // Between its halves: the estimate under the root is negative, which a signed zero tells.
    let fair = number(5, "rmse_noise_free");
    assert!(fair == 0.0 && fair.is_sign_negative(), "{fair}");

    let words = show.execute("compare --reference refs -o off.png").unwrap();
    assert!(words.text.contains("zpos") && words.text.contains("< noise"));
    let drawn = shelf.read(Path::new("off.png"), 1 << 24).unwrap();
    assert_eq!(&drawn[1..4], b"PNG");
}

#[test]
fn what_is_missing_or_does_not_fit_is_told_with_what_there_is() {
    let shelf = Shelf::default();
    let mut show = furnace(&shelf);
    let mut told = |line: &str| {
        let error = show.execute(line).unwrap_err();
        (error.exit_code(), error.report(Style::Plain))
    };
    let (code, said) = told("compare");
    assert_eq!(code, 2);
    assert!(said.contains("--reference DIR"), "{said}");
    keep(&shelf, "xneg.exr", &Image::new(32, 32));
    keep(&shelf, "xpos_A.exr", &Image::new(32, 32));
    let (code, said) = told("compare --reference refs");
    assert_eq!(code, 3);
    assert!(said.contains("no reference for xpos, yneg"), "{said}");
    assert!(said.contains("it has xneg.exr, xpos_A.exr"), "{said}");
    for name in BANKS {
        keep(&shelf, &format!("{name}.exr"), &Image::new(16, 32));
    }
    let (code, said) = told("compare --reference refs");
    assert_eq!(code, 3);
    assert!(
        said.contains("is 16x32, the show's view is 32x32"),
        "{said}"
    );
    let path = Path::new("refs/xneg.exr");
    shelf.write(path, b"no picture").unwrap();
    let (code, said) = told("compare --reference refs");
    assert!(code == 3 && said.contains("xneg.exr"), "{said}");
    let (code, said) = told("compare --reference refs -o off.gif");
    assert!(code == 2 && said.contains(".png or .svg"), "{said}");
    let (code, _) = told("compare --reference refs --quality 9");
    assert_eq!(code, 2);
}

#[test]
fn a_black_reference_gives_no_figure() {
    let shelf = Shelf::default();
    let mut show = furnace(&shelf);
    for name in BANKS {
        keep(&shelf, &format!("{name}.exr"), &Image::new(32, 32));
    }
    let found = compare(&mut show);
    assert!(found["banks"][0]["rmse"].is_null());
    assert!(found["banks"][0]["mean_ratio"].is_null());
}

#[test]
fn the_chart_of_the_scale_comes_as_a_record_and_as_a_drawing() {
    let shelf = Shelf::default();
    let mut show = furnace(&shelf);
    let said = show.execute("chart transport -o chart.json").unwrap().text;
    assert!(said.contains("against quality 5"), "{said}");
    let bytes = shelf.read(Path::new("chart.json"), 1 << 20).unwrap();
    let record: Record = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(
        (record.kind, record.subject.as_str()),
        (Kind::Transport, "Furnace")
    );
    let mean = &record.series[0];
    let curve = record.curve(mean, "quality", "error");
    let qualities: Vec<f64> = curve.iter().map(|p| p.0).collect();
    assert_eq!(qualities, [1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(curve[4].1, 0.0);
    assert!(curve[0].1 > 0.05 && curve[0].1 > curve[3].1, "{curve:?}");
    // The mean and the worst, then every bank.
    assert_eq!(record.series.len(), 2 + BANKS.len());
    assert!(mean.points[1].marks.contains(&"coarse".to_owned()));
    assert!(mean.points[2].marks.contains(&"refined".to_owned()));

    let error = show.execute("chart plans").unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("chart transport"));
    let error = show.execute("chart transport -o chart.pdf").unwrap_err();
    assert_eq!(error.exit_code(), 2);
}

#[test]
fn what_a_step_sets_rises_with_it_and_so_does_its_price() {
    let shelf = Shelf::default();
    let mut show = furnace(&shelf);
    let text = show.execute("quality --json").unwrap().text;
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(found["operator"], "radiosity");
    let steps = found["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 5);
    let total = |step: &serde_json::Value| {
        let of = |part: &str| step["predicted"][part].as_f64().unwrap();
        of("prepare") + of("banks")
    };
    for pair in steps.windows(2) {
        let elements = |step: &serde_json::Value| step["sets"]["elements"].as_f64().unwrap();
        assert!(elements(&pair[0]) <= elements(&pair[1]));
        assert!(total(&pair[0]) > 0.0 && total(&pair[0]) <= total(&pair[1]));
        assert!(pair[0]["measured"].is_null());
    }
    let words = show.execute("quality").unwrap().text;
    assert!(
        words.contains("elements") && words.contains("all banks s"),
        "{words}"
    );
}
