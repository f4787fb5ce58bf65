//! Moving heads: a frame against the moment rendered with fixed lights of equal aims.

use footlight_engine::{Engine, Host};
use footlight_picture::Image;
use footlight_show::model::{LightKind, Pose};
use footlight_show::units::Time;
use footlight_transport::Quality;

/// A room with a block in it.
const STAGE: &str = "show \"S\"\n\
    surface floor reflectance 0.6 box from -6,-4,-1 to 6,6,0\n\
    surface wall reflectance #a08060 box from -6,5,0 to 6,6,6\n\
    surface side reflectance 0.7 box from -6,-4,0 to -5,5,6\n\
    surface block reflectance 0.5 box from 1,1,0 to 2.5,2.5,1.2\n\
    view house from 0,-12,3 to 0,1,1.5 fov 36 size 192x108\n";

const CUES: &str = "cue 1 at 0:00 { snap  heads 80  rest 40 }\n\
    cue 2 at 0:01 { time 4  mh_1 to 2, 2, 0.5  mh_2 to -4, 4, 3 }\n\
    cue 3 at 0:06 { time 3  mh_1 beam 24 field 36  mh_2 to -5, 1, 1  heads #ff8040 }\n\
    cue 4 at 0:10 { time 2  heads 20 }\n";

fn engine(lights: &str, cues: &str, stage: &str) -> Engine {
    let text = format!(
        "{stage}\n{lights}light back spot at 4,-3,5 aim 0,3,0 beam 40 field 60 800 cd\n\
         bank heads = mh_1 mh_2 rgb\nbank rest = back\n{cues}"
    );
    let engine = Engine::from_text("s.lxq", text.as_bytes(), Host::default());
    engine.unwrap_or_else(|error| panic!("{error}"))
}

fn moving() -> String {
    "light mh_1 spot at -3,-2,5.5 aim -2,2,0 beam 14 field 22 4000 cd moves\n\
     light mh_2 spot at 3,-2,5.5 aim 3,1,0 beam 10 field 16 6000 cd moves\n"
        .to_owned()
}

/// The heads as fixed lights in these poses.
fn standing(engine: &Engine, poses: &[Pose]) -> String {
    let show = engine.show();
    let mut out = String::new();
    for ((light, head, _), pose) in show.heads().into_iter().zip(poses) {
        let light = &show.lights[light];
        let LightKind::Spot(spot) = head.aimed(light, *pose).kind else {
            panic!("a spot");
        };
        let [p, a] = [spot.position, spot.aim];
        out += &format!(
            "light {} spot at {},{},{} aim {},{},{} beam {} field {} {} cd\n",
            light.name, p.x, p.y, p.z, a.x, a.y, a.z, spot.beam, spot.field, spot.intensity.0[0],
        );
    }
    out
}

/// Root mean square of the difference, relative to the light.
fn off(found: &Image, exact: &Image) -> f64 {
    let square = |x: f64| x * x;
    let pairs = found.data().iter().zip(exact.data());
    let (mut error, mut light) = (0.0, 0.0);
    for (a, b) in pairs {
        error += square(f64::from(*a) - f64::from(*b));
        light += square(f64::from(*b));
    }
    f64::sqrt(error / light)
}

/// The largest error over moments of the show, for images of a step.
fn worst(stage: &str, quality: Quality, moments: usize) -> f64 {
    let mut engine = engine(&moving(), CUES, stage);
    let own = engine.show().coordinates().len();
    let mut worst = 0.0_f64;
    for k in 0..moments {
        let part = (k as f64 * 0.618_033_988_75).fract();
        let time = Time::from_micros((12e6 * part) as i64);
        let document = engine.document();
        let (setting, poses) = (document.setting(time), document.timeline().poses(time));
        let found = engine.render_with(&setting, &poses, quality).unwrap();
        let mut fixed = self::engine(&standing(&engine, &poses), "", stage);
        let exact = fixed.render(&setting[..own], quality).unwrap();
        let off = off(&found, &exact);
        println!("{:.2} s: {:.2} %", time.micros() as f64 * 1e-6, 100.0 * off);
        worst = worst.max(off);
    }
    worst
}

#[test]
fn frames_are_those_of_fixed_lights() {
    let worst = worst(STAGE, Quality(2), 4);
    assert!(worst < 0.01, "{worst}");
}

/// Wide gloss shows a head's light once, whichever renderer makes the pictures. At step 1 each of
/// the two pictures is off by more than 2 % in the mirror.
#[test]
fn frames_with_gloss_are_those_of_fixed_lights() {
    let stage = STAGE
        .replace("0.6 box", "0.1 gloss 0.3 box")
        .replace("0.5 box", "0.5 gloss 0.05 box")
        .replace("192x108", "96x54");
    let worst = worst(&stage, Quality(2), 2);
    assert!(worst < 0.015, "{stage}: {worst}");
}

/// A head that rests while another moves keeps its light in haze from the frame before.
#[test]
fn a_frame_does_not_depend_on_the_frame_before() {
    let stage = format!("{STAGE}haze 20m").replace("192x108", "48x27");
    let cues = "cue 1 at 0:00 { snap  heads 80  rest 40 }\n\
                cue 2 at 0:01 { time 4  mh_1 to 2, 2, 0.5 }\n";
    let frames = |seconds: &[i64]| {
        let mut engine = engine(&moving(), cues, &stage);
        let frame = |second: &i64| {
            let time = Time::from_micros(1_000_000 * second);
            let document = engine.document();
            let (setting, poses) = (document.setting(time), document.timeline().poses(time));
            engine.render_with(&setting, &poses, Quality(1)).unwrap()
        };
        seconds.iter().map(frame).collect::<Vec<Image>>()
    };
    let (after, alone) = (frames(&[2, 4]), frames(&[4]));
    assert!(after[0] != after[1]);
    assert!(after[1] == alone[0]);
}

/// With haze, and at more moments. The largest errors are at the foot of the wall, in the row of
/// pixels that shows floor and wall, and half of that is the other renderer's.
#[test]
#[ignore = "slow: many moments"]
fn frames_in_haze_are_those_of_fixed_lights() {
    for (haze, moments) in [("", 24), ("haze 40m forward 0.4", 12)] {
        let worst = worst(&format!("{STAGE}{haze}"), Quality(2), moments);
        assert!(worst < 0.02, "{haze}: {worst}");
    }
}
