//! Time from a retyped cue to the bytes of the image at the current time.

use std::sync::Arc;
use std::time::Instant;

use footlight_engine::{Engine, Goal, Host};
use footlight_host::files::Memory;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_prompt::{Console, Repl};
use footlight_show::geometry::View;
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};

/// Number of coarse images, each of two qualities.
const BANKS: usize = 24;
/// Number of refined images.
const REFINED: usize = 10;

/// An operator with synthetic images: only linearity in the setting and improvement with quality
/// matter here.
struct Painter;

struct Painted(View, Quality);

impl Transport for Painter {
    fn name(&self) -> &str {
        "painter"
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
        Ok(Box::new(Painted(setup.view.clone(), quality)))
    }

    fn cost(&self, _: &Setup, _: Quality) -> Cost {
        Cost {
            prepare: 1.0,
            per_source: 0.1,
            per_image: 0.1,
            per_lone: 0.1,
        }
    }
}

impl Prepared for Painted {
    fn render(&mut self, settings: &[Vec<f64>], _: Work<'_>) -> Result<Vec<Image>, TransportError> {
        let Painted(view, quality) = self;
        let draw = |setting: &Vec<f64>| {
            let mut image = Image::new(view.width, view.height);
            for (source, level) in setting.iter().enumerate().filter(|(_, l)| **l != 0.0) {
                let off = 0.2 / f64::from(quality.0);
                for (i, channel) in image.data_mut().iter_mut().enumerate() {
                    let noise = (i * 7919 + source * 104_729) % 10_007;
                    let error = ((i * 31 + source * 17) % 101) as f64 / 101.0;
                    let light = (noise as f64 / 10_007.0).powi(3) + off * error;
                    *channel += (level * light) as f32;
                }
            }
            image
        };
        Ok(settings.iter().map(draw).collect())
    }
}

fn show(exposure: &str) -> String {
    let mut text = String::from("show \"Edited\"\nstage \"room.obj\"\n");
    text += "view house from 0, -6, 1.6 to 0, 0, 1.4 fov 40 size 640x360\n";
    text += &format!("preview {{ coarse 2 refined 4 tolerance 0.01% {exposure} }}\n");
    for i in 0..BANKS {
        let x = i as f64 / 4.0 - 3.0;
        text += &format!(
            "light l{i} spot at {x}, -2, 3.5 aim {x}, 0.5, 0.5 beam 30 field 50 900 cd 2700 K\n\
             bank b{i} = l{i}\n"
        );
    }
    for cue in 0..12 {
        let moves: Vec<String> = (0..BANKS)
            .map(|b| format!("b{b} {}", 5 + (b * 37 + cue * 53) % 95))
            .collect();
        let time = if cue == 0 { "snap" } else { "time 3" };
        text += &format!(
            "cue {} at 0:{:02} {{ {time} {} }}\n",
            cue + 1,
            cue * 4,
            moves.join(" ")
        );
    }
    text
}

/// Opens the show and renders its images.
fn opened(exposure: &str, threads: usize) -> Repl {
    let room = "mtllib room.mtl\nusemtl wall\nv -3 0 3\nv 3 0 3\nv 3 0 -2\nv -3 0 -2\nf 1 2 3 4\n";
    let files = Memory::default().with("room.obj", room);
    let files = files.with("room.mtl", "newmtl wall\nKd 0.5 0.5 0.5\n");
    let host = Host {
        files: Box::new(files),
        renderer: Arc::new(Painter),
        threads,
        ..Host::default()
    };
    let text = show(exposure);
    let mut engine = Engine::from_text("edited.lxq", text.as_bytes(), host).unwrap();
    engine.refine(Goal::count(REFINED)).unwrap();
    assert_eq!(engine.estimate().refined(), REFINED);
    let mut show = Repl::new(engine, Console::default());
    show.execute("at 0:17").unwrap();
    show
}

/// Prints the fastest and the median edit, with a fixed and an automatic exposure.
pub fn measure(rounds: usize) {
    println!(
        "\nfrom an edited cue to the picture at the current time, 640x360, {BANKS} coarse pictures \
         of two qualities, {REFINED} refined"
    );
    for (name, exposure) in [("given", "exposure -2"), ("automatic", "")] {
        for threads in [1, 2] {
            let mut show = opened(exposure, threads);
            show.execute("picture").unwrap();
            // The first edit fills caches for the later ones.
            edited(&mut show, 0);
            let (mut times, mut spent) = (Vec::new(), Vec::new());
            for n in 1..=rounds.max(3) {
                let (time, own) = edited(&mut show, n);
                times.push(time);
                spent.extend(own.filter(|_| threads == 1));
            }
            times.sort_by(f64::total_cmp);
            let own = match spent.is_empty() {
                true => String::new(),
                false => format!(", {:6.2} ms on the processor", 1e3 * crate::median(spent)),
            };
            println!(
                "exposure {name:9} threads {threads}: {:6.2} ms, median {:6.2} ms{own}",
                times[0] * 1e3,
                times[times.len() / 2] * 1e3
            );
        }
    }
}

/// Elapsed seconds, and processor seconds of this thread.
fn edited(show: &mut Repl, n: usize) -> (f64, Option<f64>) {
    let before = show.execute("picture").unwrap().picture.unwrap().rgb;
    let level = 20 + n * 7 % 60;
    let (begin, spent) = (Instant::now(), crate::on_processor());
    show.execute(&format!("cue 5 at 0:16 {{ time 3  b7 {level} }}"))
        .unwrap();
    let after = show.execute("picture").unwrap().picture.unwrap().rgb;
    let time = begin.elapsed().as_secs_f64();
    let own = crate::on_processor().zip(spent);
    assert!(n == 0 || before != after, "the edit is seen");
    (time, own.map(|(now, then)| now - then))
}
