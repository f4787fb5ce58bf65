//! Errors of frames made of key images.

use std::path::PathBuf;
use std::sync::Arc;

use crate::displayed::Displayed;
use crate::judge::{Frame, Judged, judge};
use footlight_engine::playback::{Playback, Player};
use footlight_engine::{Engine, Host};
use footlight_host::files::{Folder, MemoryStore};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::tone::{Tone, auto_exposure, sampling};
use footlight_prompt::{Console, Repl};
use footlight_show::units::Time;
use footlight_show::units::ToneCurve;

/// The first show in another size, with a separate store.
fn first(store: &MemoryStore, size: &str) -> Repl {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(folder.join("first.lxq")).unwrap();
    let text = text.replace("size 480x270", &format!("size {size}"));
    let host = Host {
        files: Box::new(Folder::new(&folder, 1 << 20)),
        store: Box::new(store.clone()),
        threads: 2,
        ..Host::default()
    };
    let engine = Engine::from_text("first.lxq", text.as_bytes(), host).unwrap();
    Repl::new(engine, Console::default())
}

/// A show of cubics between two looks with synthetic key images: `light` of the key's levels and of
/// a number from 0 to 1 for each channel.
fn made_up(light: impl Fn(&[f64], f64) -> f64) -> Arc<Playback> {
    let text = b"show \"Made up\"\n\
        light left  spot at -1, 0, 3 aim 0, 0, 0 beam 30 field 50 900 cd\n\
        light right spot at  1, 0, 3 aim 0, 0, 0 beam 30 field 50 900 cd\n\
        bank a = left\nbank b = right\n\
        cue 1 at 0:00 { snap a full b 5 }\n\
        cue 2 at 0:02 { time 4 curve ease a out b full }\n\
        cue 3 at 0:08 { time 3 a 30 b out }\n";
    let engine = Engine::from_text("made.lxq", text, Host::default()).unwrap();
    let keys = engine.document().keys();
    let image = |key: &Vec<f64>| {
        let channel = |i: u32| light(key, f64::from(i) / 6000.0) as f32;
        Image::from_data(50, 40, (0..6000).map(channel).collect()).unwrap()
    };
    let images = keys.keys().iter().map(image).collect();
    Arc::new(Playback::of(keys, images).unwrap())
}

fn judged(playback: &Arc<Playback>, tone: Tone) -> Judged {
    let player = Player::new(playback, tone, Work::silent());
    let mut frame = |time| {
        let mut image = Image::new(0, 0);
        player.light(time, &mut image);
        Frame::Light(image)
    };
    judge(playback, tone, 1, &mut frame, Work::silent()).unwrap()
}

/// The paper's hardware, [`Displayed`].
fn as_displayed(playback: &Playback, tone: Tone) -> Judged {
    let displayed = Displayed::new(playback, tone);
    let mut frame = |time| Frame::Bytes(displayed.show(time));
    judge(playback, tone, 1, &mut frame, Work::silent()).unwrap()
}

#[test]
fn frames_err_little_where_the_papers_hardware_errs_much() {
    for curve in [ToneCurve::Filmic, ToneCurve::Plain] {
        let tone = Tone {
            exposure: -1.0,
            curve,
        };
        // One look falls, the other rises, over four decades up to twice white.
        let white = tone.light(1.0);
        let playback = made_up(|key, x| {
            2.0 * white * (key[0] * 10f64.powf(-4.0 * x) + key[1] * 10f64.powf(-4.0 * (1.0 - x)))
        });
        let ours = judged(&playback, tone);
        assert!(ours.most < 1e-3 && ours.seen == 0.0, "{}", ours.most);
        // Blending codes is very wrong where the keys differ.
        let paper = as_displayed(&playback, tone);
        assert!(
            paper.most > 20.0 && paper.rms > 5.0,
            "{} {}",
            paper.most,
            paper.rms
        );
        assert!(paper.seen > 0.2, "{}", paper.seen);
        assert_eq!(paper.worst.len(), 6000);
    }
}

#[test]
fn a_player_shows_what_the_thresholds_say() {
    let tone = Tone::default();
    let playback = made_up(|key, x| key[0] * x + key[1] * (1.0 - x) - 0.02);
    let player = Player::new(&playback, tone, Work::silent());
    let (mut light, mut bytes) = (Image::new(0, 0), Vec::new());
    for tenth in -5..130 {
        let time = Time::from_seconds(f64::from(tenth) / 10.0).unwrap();
        player.light(time, &mut light);
        player.frame(time, &mut bytes);
        assert_eq!(bytes, tone.encode(&light));
    }
}

#[test]
fn the_keys_of_a_show_err_little() {
    let mut show = first(&MemoryStore::default(), "96x54");
    let playback = show.engine_mut().playback().unwrap();
    let tone = show.engine().document().tone_of(playback.images());
    assert!(judged(&playback, tone).most < 1e-3);
}

/// The exposure after an edit samples only some pixels of the changed keys; the image must equal
/// that with the exposure of all full key images.
#[test]
fn the_exposure_after_an_edit_is_that_of_whole_key_images() {
    let mut show = first(&MemoryStore::default(), "200x150");
    assert_eq!(sampling(200, 150), 2);
    let time = Time::from_seconds(9.0).unwrap();
    show.execute("at 0:09").unwrap();
    let mut exposures = Vec::new();
    for line in [
        "",
        "cue 3 \"Dawn\" at 0:06 { time 8  curve ease  day 40 }",
        "refine 1",
        "cue 3 \"Dawn\" at 0:06 { time 8  curve ease  day 90 }",
    ] {
        show.execute(line).unwrap();
        let shown = show.execute("picture").unwrap().picture.unwrap().rgb;
        let whole = show.engine_mut().playback().unwrap();
        let exposure = auto_exposure(whole.images().iter());
        let tone = Tone {
            exposure,
            curve: ToneCurve::Filmic,
        };
        assert_eq!(
            shown,
            tone.encode(&show.engine_mut().picture(time).unwrap()),
            "{line}"
        );
        exposures.push(exposure);
    }
    assert!(exposures[0] != exposures[1] && exposures[1] != exposures[3]);
    let setting = show.engine().document().setting(time);
    let pool = show.engine().estimate().pool().unwrap();
    let thin = pool.thinned(2).preview(&setting, Work::silent()).unwrap();
    let whole = pool.preview(&setting, Work::silent()).unwrap();
    assert_eq!((thin.width(), thin.height()), (100, 75));
    assert_eq!(thin, whole.every(2));
}
