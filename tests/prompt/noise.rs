//! A noisy renderer, like a path tracer: two images of a bank reveal its noise, all images are
//! weighted by precision, and goals are really met.

use std::sync::Arc;

use crate::dice::Dice;
use crate::{Stopped, prompt};
use footlight_engine::{Ended, Goal, Host, Refinement, Way};
use footlight_host::files::{Folder, MemoryStore};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::combine::{combine, dot};
use footlight_prompt::Repl;
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError, seed};

/// Noise of an image of one bank at one sample per pixel, relative to its light in each pixel.
const NOISE: f64 = 0.8;

/// Every source lights a spot; in an image of several, each has its share of the samples.
struct Noisy {
    salt: u64,
}

struct Ready {
    size: (usize, usize),
    sources: usize,
    quality: Quality,
    salt: u64,
}

/// The light of a source in each channel, without noise.
fn spot(source: usize, (width, height): (usize, usize)) -> Image {
    let mut dice = Dice::new(source as u64);
    let (x, y) = (dice.between(0.0, 1.0), dice.between(0.0, 1.0));
    let (wide, strength) = (dice.between(0.1, 0.5), dice.between(0.2, 1.0));
    let pixel = |i: usize| {
        let (column, row) = (i / 3 % width, i / 3 / width);
        let (dx, dy) = (
            column as f64 / width as f64 - x,
            row as f64 / height as f64 - y,
        );
        (strength * (-(dx * dx + dy * dy) / (wide * wide)).exp()) as f32
    };
    Image::from_data(width, height, (0..3 * width * height).map(pixel).collect()).unwrap()
}

/// The image of a setting without noise.
fn exact(setting: &[f64], size: (usize, usize)) -> Image {
    let spots: Vec<Image> = (0..setting.len())
        .map(|source| spot(source, size))
        .collect();
    let terms: Vec<(f64, &Image)> = setting.iter().copied().zip(&spots).collect();
    combine(size, &terms, 1)
}

fn samples(quality: Quality) -> f64 {
    4_f64.powi(i32::from(quality.0) - 1)
}

impl Transport for Noisy {
    fn name(&self) -> &str {
        "noisy"
    }

    fn results_version(&self) -> Option<String> {
        Some(format!("noisy {}", self.salt))
    }

    fn finest(&self) -> Quality {
        Quality(5)
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        _: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        Ok(Box::new(Ready {
            size: (setup.view.width, setup.view.height),
            sources: setup.rig.sources.len(),
            quality,
            salt: self.salt,
        }))
    }

    fn samples(&self, quality: Quality) -> Option<f64> {
        Some(samples(quality))
    }

    fn cost(&self, _: &Setup, quality: Quality) -> Cost {
        let picture = samples(quality);
        Cost {
            per_image: picture,
            per_lone: picture,
            ..Cost::default()
        }
    }
}

impl Prepared for Ready {
    fn render(&mut self, settings: &[Vec<f64>], _: Work<'_>) -> Result<Vec<Image>, TransportError> {
        let spots: Vec<Image> = (0..self.sources).map(|s| spot(s, self.size)).collect();
        let render = |setting: &Vec<f64>| {
            let mut image = exact(setting, self.size);
            let lit = || {
                setting
                    .iter()
                    .zip(&spots)
                    .filter(|(strength, _)| **strength != 0.0)
            };
            let each = samples(self.quality) / lit().count().max(1) as f64;
            let mut dice = Dice::new(u64::from(seed(setting, self.quality)) ^ self.salt << 32);
            for (strength, light) in lit() {
                let size = strength * NOISE * (3.0 / each).sqrt();
                for (value, light) in image.data_mut().iter_mut().zip(light.data()) {
                    *value += light * (size * dice.between(-1.0, 1.0)) as f32;
                }
            }
            image
        };
        Ok(settings.iter().map(render).collect())
    }
}

fn open(show: &str, salt: u64) -> Repl {
    let path = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(show);
    let text = std::fs::read_to_string(&path).unwrap();
    let text = text
        .replace("size 480x270", "size 32x18")
        .replace("size 640x360", "size 32x18")
        .replace("refined 2", "refined 4");
    let text = match text.contains("preview") {
        true => text,
        false => text + "preview { refined 4 }\n",
    };
    let host = Host {
        files: Box::new(Folder::new(path.parent().unwrap(), 1 << 20)),
        store: Box::new(MemoryStore::default()),
        clock: Box::new(Stopped),
        renderer: Arc::new(Noisy { salt }),
        ..Host::default()
    };
    prompt("noisy.lxq", text.as_bytes(), host).unwrap()
}

/// True error of the worst moment, relative to its light, among moments above a fiftieth of the
/// brightest.
fn true_error(show: &mut Repl) -> f64 {
    let engine = show.engine_mut();
    let timeline = engine.document().timeline();
    let mut looks = Vec::new();
    for cue in timeline.cues() {
        for part in [0.25, 0.5, 0.75, 1.0] {
            let time = cue.go + (cue.completion - cue.go).scaled(part);
            looks.push(timeline.evaluate(time));
        }
    }
    let size = engine.estimate().pool().unwrap().size();
    let truths: Vec<Image> = looks.iter().map(|look| exact(look, size)).collect();
    let norm = |image: &Image| dot(image, image).sqrt();
    let brightest = truths.iter().map(norm).fold(0.0, f64::max);
    let mut worst = 0.0_f64;
    for (look, truth) in looks.iter().zip(&truths) {
        let seen = engine.picture_with(look, &[]).unwrap();
        let off = combine(truth.size(), &[(1.0, &seen), (-1.0, truth)], 1);
        if norm(truth) > 0.02 * brightest {
            worst = worst.max(norm(&off) / norm(truth));
        }
    }
    worst
}

/// When errors are noise alone, 19 of 20 promises are kept, none is missed by much, and none costs
/// as much as a much smaller error.
#[test]
fn what_is_asked_for_is_met_in_truth() {
    let mut shares = Vec::new();
    for (show, salt) in [("first.lxq", 0), ("sketch/sketch.lxq", 100)] {
        for salt in salt..salt + 6 {
            for (until, way) in [
                (0.2, Way::Auto),
                (0.2, Way::Paper),
                (0.1, Way::Auto),
                (0.05, Way::Auto),
            ] {
                let mut repl = open(show, salt);
                let wanted = Refinement::from(Goal::until(until)).by(way);
                let done = repl.engine_mut().refine(wanted).unwrap();
                let truth = true_error(&mut repl);
                let predicted = repl.engine().estimate().predicted_error().unwrap();
                assert!(
                    predicted < 1.6 * truth && truth < 1.2 * predicted,
                    "{show} {salt} {until}: {predicted} for {truth}"
                );
                if done.ended == Some(Ended::Reached) {
                    shares.push(truth / until);
                }
            }
        }
    }
    let kept = shares.iter().filter(|share| **share <= 1.0).count();
    assert!(shares.len() > 25, "{shares:?}");
    assert!(20 * kept >= 19 * shares.len(), "{shares:?}");
    assert!(shares.iter().all(|share| *share < 1.1), "{shares:?}");
}

/// All images of a bank count: combining two steps gives the noise of their samples together.
#[test]
fn pictures_of_a_bank_are_averaged_by_their_precision() {
    let mut repl = open("first.lxq", 7);
    let engine = repl.engine_mut();
    engine.coarse().unwrap();
    let looks = [[1.0, 0.0], [0.0, 1.0]];
    for look in looks {
        let size = engine.estimate().pool().unwrap().size();
        let truth = exact(&look, size);
        let noise = |image: &Image| {
            let off = combine(size, &[(1.0, image), (-1.0, &truth)], 1);
            (dot(&off, &off) / dot(&truth, &truth)).sqrt()
        };
        let finer = noise(&engine.render(&look, Quality(2)).unwrap());
        let both = noise(&engine.picture_with(&look, &[]).unwrap());
        let wanted = (samples(Quality(2)) / (samples(Quality(1)) + samples(Quality(2)))).sqrt();
        assert!((both / finer / wanted - 1.0).abs() < 0.05, "{both} {finer}");
    }
}

/// Every bank alone starts with two coarse steps, whose noise tells which step is fine enough.
#[test]
fn banks_alone_are_rendered_no_finer_than_their_noise_asks_for() {
    let mut repl = open("first.lxq", 3);
    for (until, rendered) in [(0.9, 4), (0.2, 8)] {
        let wanted = Refinement::from(Goal::until(until)).by(Way::Alone);
        let done = repl.engine_mut().refine(wanted).unwrap();
        assert_eq!(done.ended, Some(Ended::Reached), "{until}");
        assert!(true_error(&mut repl) < 1.1 * until, "{until}");
        let found = repl.engine().images().statistics().rendered;
        assert!(found <= rendered, "{until}: {found} pictures");
    }
}
