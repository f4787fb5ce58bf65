use super::*;
use crate::show::{Dimmer, Fade, Interpolation, LightKind, Link, Motion, Trigger};
use crate::units::{CueNumber, Time};

/// The sheet of the design, apart from the projection.
const SHEET: &str = r##"
// Luther's Tavern, Les Contes d'Hoffmann
show "Luther's Tavern"
preview { tolerance 2%  gap 5  rate 25  exposure auto  coarse 1  refined 4 }   // defaults

stage "tavern.obj"                          // geometry beside this file
surface boards  reflectance #6b4a2f
view stalls     from 0, -14, 1.7  to 0, 0, 2.2  fov 28  size 640x360

// --- rig -------------------------------------------------------------
light lamp1  spot   at -2.1, 1.0, 3.4  aim -2.1, 1.0, 0.9  beam 24  field 40  1200 cd  2700 K
light lamp2  like lamp1  at 0.0, 1.2, 3.4  aim 0.0, 1.2, 0.9
light moon   panel pane_left
light dusk   panel cloth  20 cd/m2
light sign_l panel "sign.l"
light sign_r panel sign_r

bank lamps    = lamp1 lamp2     channel 1
bank windows  = moon            channel 2   dimmer square
bank sky      = dusk            channel 3   rgb
fixed exits   = sign_l sign_r   level 10

group warm = lamps windows
look  night { lamps 10  windows 4 }
look  late = night + { windows 1 }

// --- cues ------------------------------------------------------------
default time 5
curve dawn = spline 0 0, 0.4 8, 0.7 55, 1 100

cue 1 "Preset"        at 0:00  { snap  lamps 30  windows 5 }
cue 2 "Evening"       at 0:04  {
  up 6  down 9
  lamps 85
  part 2 "slow sky" { time 20  delay 2  curve dawn
    sky 40
  }
  hang 2
}
cue 2.5 "Lamp turned up"  {
  lamps spline 0s 30, 3s 55, 4s 52, 9s 90
  sky to #203060 time 8
  follow 30
}
cue 3 "Blackout"          { blackout }
"##;

fn parsed(text: &str) -> Parsed {
    parse(&mut Sources::default(), "test.lxq", text)
}

#[test]
fn the_sheet_of_the_design_parses() {
    let parsed = parsed(SHEET);
    assert_eq!(parsed.diagnostics, []);
    let show = parsed.show.unwrap();
    assert_eq!(show.title, "Luther's Tavern");
    assert_eq!(show.preview, crate::show::Preview::default());
    let names: Vec<String> = show.coordinates().into_iter().map(|c| c.name).collect();
    assert_eq!(
        names,
        ["lamps", "windows", "sky.r", "sky.g", "sky.b", "fixed"]
    );
    assert_eq!(show.banks[1].dimmer, Dimmer::Square);
    assert_eq!(show.looks[1].levels, [(0, 10.0), (1, 1.0)]);
    let LightKind::Spot(lamp2) = &show.lights[1].kind else {
        panic!()
    };
    assert_eq!((lamp2.beam, lamp2.position.y), (24.0, 1.2));
    assert!((lamp2.intensity.luminance() - 1200.0).abs() < 1e-9);
    let [one, two, half, three] = show.cues.as_slice() else {
        panic!()
    };
    assert_eq!(one.trigger, Trigger::At(Time::ZERO));
    assert_eq!(one.parts[0].up, Time::ZERO);
    assert_eq!(
        two.link.unwrap().1,
        Link::Hang(Time::from_micros(2_000_000))
    );
    assert_eq!(
        (two.parts[0].up.seconds(), two.parts[0].down.seconds()),
        (6.0, 9.0)
    );
    assert_eq!(
        (two.parts[1].number, two.parts[1].curve),
        (2, Fade::Curve(0))
    );
    assert_eq!(two.parts[1].moves.len(), 3);
    assert_eq!(half.number, CueNumber::from_thousandths(2500).unwrap());
    let Motion::Path(path) = &half.parts[0].moves[0].motion else {
        panic!()
    };
    assert_eq!(path.interpolation, Interpolation::Monotone);
    assert_eq!(half.parts[1].up.seconds(), 8.0);
    assert!(matches!(half.parts[1].moves[2].motion, Motion::To(l) if (l - 11.697).abs() < 1e-3));
    assert_eq!(three.parts[0].moves.len(), 5);
}
