//! A dim side light on a smooth wall, lit for a second, whose coarse images are stained: an average
//! over the sequence misses it, but the eye sees nothing else.

use std::sync::Arc;

use crate::{Stopped, prompt};
use footlight_engine::plan;
use footlight_engine::{Goal, Host};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::combine::{combine, dot};
use footlight_prompt::Repl;
use footlight_show::units::{ErrorUnit, Tolerance};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};

const SHOW: &str = r#"show "Stains"
surface wall reflectance 0.5  quad -5, 4, 0  5, 4, 0  5, 4, 5  -5, 4, 5
light f spot at 0, -4, 4  aim 0, 4, 2  beam 60  field 90  9000 cd
light s spot at -4.8, 2, 2.5  aim 4, 4, 2.5  beam 60  field 90  900 cd
view v from 0, -8, 2.5  to 0, 4, 2.5  fov 30  size 32x18
bank front = f
bank side = s
preview { exposure 0  refined 4 }
cue 1 at 0:00 { time 0  front 100 }
cue 2 at 5:00 { time 0  front out  side 60 }
cue 3 at 5:01 { time 0  side out  front 100 }
cue 4 at 10:00 { time 5  front 80 }
"#;

/// Relative errors of a step's images of each bank.
const OFF: [[f64; 2]; 5] = [
    [0.004, 0.16],
    [0.002, 0.08],
    [0.001, 0.04],
    [0.0, 0.0],
    [0.0, 0.0],
];

/// Radiosity with a wave over the whole width of the image, dark at one end and bright at the
/// other.
struct Stained;

struct Stain(Box<dyn Prepared>, [f64; 2]);

impl Transport for Stained {
    fn name(&self) -> &str {
        "stained"
    }

    fn results_version(&self) -> Option<String> {
        None
    }

    fn finest(&self) -> Quality {
        Quality(5)
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        let exact = Radiosity.prepare(setup, Quality(1), work)?;
        let off = OFF[usize::from(quality.0) - 1];
        Ok(Box::new(Stain(exact, off)))
    }

    fn cost(&self, _: &Setup, _: Quality) -> Cost {
        Cost {
            per_image: 60.0,
            per_lone: 60.0,
            ..Cost::default()
        }
    }
}

impl Prepared for Stain {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        let banks = self.0.render(&[vec![1.0, 0.0], vec![0.0, 1.0]], work)?;
        let stained: Vec<Image> = banks
            .iter()
            .zip(self.1)
            .map(|(b, off)| stain(b, off))
            .collect();
        let of = |setting: &Vec<f64>| {
            let terms: Vec<(f64, &Image)> = setting.iter().copied().zip(&stained).collect();
            combine(stained[0].size(), &terms, 1)
        };
        Ok(settings.iter().map(of).collect())
    }
}

fn stain(image: &Image, off: f64) -> Image {
    let (width, height) = image.size();
    let wave = |i: usize| (((i / 3) % width) as f64 / width as f64 * std::f64::consts::PI).cos();
    let data = image.data().iter().enumerate();
    let data = data.map(|(i, v)| v * (1.0 + off * wave(i)) as f32);
    Image::from_data(width, height, data.collect()).unwrap()
}

fn open() -> Repl {
    let host = Host {
        renderer: Arc::new(Stained),
        clock: Box::new(Stopped),
        ..Host::default()
    };
    prompt("stains.lxq", SHOW.as_bytes(), host).unwrap()
}

/// Error of the side cue's image, relative and as displayed.
fn side_cue(show: &mut Repl) -> [f64; 2] {
    let engine = show.engine_mut();
    let setting = vec![0.0, 0.6];
    let truth = engine.render(&setting, Quality(5)).unwrap();
    let seen = engine.picture_with(&setting, &[]).unwrap();
    let off = combine(truth.size(), &[(1.0, &seen), (-1.0, &truth)], 1);
    let tone = engine.tone().unwrap();
    let shown = |i: &Image| -> Vec<f64> {
        let light = i.data().iter().map(|v| f64::from(*v));
        light.map(|v| 255.0 * tone.display(v)).collect()
    };
    let (a, b) = (shown(&seen), shown(&truth));
    let pixel = |(a, b): (&[f64], &[f64])| {
        let channels = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        channels.fold(0.0, f64::max)
    };
    let mut steps: Vec<f64> = a.chunks(3).zip(b.chunks(3)).map(pixel).collect();
    steps.sort_by(f64::total_cmp);
    [
        (dot(&off, &off) / dot(&truth, &truth)).sqrt(),
        steps[(steps.len() - 1) * 99 / 100],
    ]
}

#[test]
fn a_stain_that_the_average_hides_is_refined_first() {
    let mut show = open();
    show.engine_mut().coarse().unwrap();
    let [before, steps] = side_cue(&mut show);
    assert!(before > 0.04 && steps > 3.0, "{before} {steps}");

    let engine = show.engine();
    // An average over time has another light first.
    let (pool, keys) = (engine.estimate().pool().unwrap(), engine.document().keys());
    let average = &plan::next(keys, &[], pool.weighting()).unwrap()[0];
    assert!(average[0].abs() > average[1].abs(), "hidden: {average:?}");
    let worst = engine
        .estimate()
        .worst_moment(ErrorUnit::Light)
        .unwrap()
        .unwrap();
    assert_eq!(engine.show().cues[worst.cue].number.to_string(), "2");

    show.engine_mut().refine(Goal::count(1)).unwrap();
    let first = &show.engine().estimate().pool().unwrap().settings()[0];
    assert!(first[1].abs() > 3.0 * first[0].abs(), "{first:?}");
    let [after, left] = side_cue(&mut show);
    assert!(after < 0.1 * before && left < 0.1 * steps, "{after} {left}");
}

#[test]
fn a_tolerance_as_displayed_holds_where_it_is_seen() {
    for until in [3.0, 1.0] {
        let mut show = open();
        let goal = Goal::until(Tolerance::steps(until));
        show.engine_mut().refine(goal).unwrap();
        let [_, steps] = side_cue(&mut show);
        let told = show
            .engine()
            .estimate()
            .predicted_in(ErrorUnit::Steps)
            .unwrap();
        assert!(told <= until && steps <= until, "{until}: {told} {steps}");
    }
}
