//! Drawings of `plot`: curves with cues and moves, spectrum, basis, error.

use std::path::Path;

use footlight_engine::{Engine, Host};
use footlight_host::files::{Memory, MemoryStore, Store};
use footlight_prompt::{self as repl, Console, Repl};

/// A bank called `rig` among others; its curve touches zero at 0:00.8, where a knot must be
/// inserted.
const SHOW: &str = "show \"Knots\"
preview { tolerance 2% }
stage \"room.obj\"
view house  from 0, -3, 1  to 0, 1, 1  fov 40  size 32x18
light a  spot at -1, 0, 2  aim -1, 1, 0  beam 30  field 50  900 cd
light b  spot at 0, 0, 2   aim 0, 1, 0   beam 30  field 50  900 cd
light c  spot at 1, 0, 2   aim 1, 1, 0   beam 30  field 50  900 cd
bank rig = a
bank warm = b  rgb
bank cold = c
group sides = rig cold
cue 1 at 0:00 { rig hermite 0 4 slope -10, 4 64 slope 40, 8 20 slope 0  cold 50 time 6 }
cue 2 at 0:05 { warm to #ff8040 time 5  cold 20 time 1 }
cue 3 at 0:09 { rig hermite 0 20 slope -15, 4 16 slope 10 }
cue 4 at 0:15 { snap blackout }
";

const ROOM: &str = "mtllib room.mtl\nusemtl wall\nv -2 0 0\nv 2 0 0\nv 2 0 -2\nv -2 0 -2\nf 1 2 3 4\n\
                    v -2 0 -2\nv 2 0 -2\nv 2 2 -2\nv -2 2 -2\nf 5 6 7 8\n";

fn open(text: &str) -> (Repl, MemoryStore) {
    let store = MemoryStore::default();
    let host = Host {
        files: Box::new(
            Memory::default()
                .with("room.obj", ROOM)
                .with("room.mtl", "newmtl wall\nKd 0.5 0.5 0.5\n"),
        ),
        store: Box::new(store.clone()),
        ..Host::default()
    };
    let engine = Engine::from_text("knots.lxq", text.as_bytes(), host).map_err(repl::Error::from);
    let engine = engine.map_err(|e| e.report(footlight_show::diagnostic::Style::Plain));
    (Repl::new(engine.unwrap(), Console::default()), store)
}

fn drawn(show: &mut Repl, store: &MemoryStore, words: &str) -> (String, String) {
    let said = show
        .execute(&format!("plot {words} -o drawn.svg"))
        .unwrap()
        .text;
    let bytes = store.read(Path::new("drawn.svg"), 1 << 24).unwrap();
    (said.into(), String::from_utf8(bytes).unwrap())
}

#[test]
fn moves_begin_and_end_where_they_do() {
    let (show, _) = open(SHOW);
    let moves = |coordinate: usize| -> Vec<(f64, f64)> {
        let moves = show.engine().document().timeline().moves(coordinate).iter();
        moves.map(|(a, b)| (a.seconds(), b.seconds())).collect()
    };
    assert_eq!(moves(0), [(0.0, 8.0), (9.0, 13.0), (15.0, 15.0)]);
    assert_eq!(moves(1), [(5.0, 10.0), (15.0, 15.0)]);
    // Cue 2 overtakes cue 1.
    assert_eq!(moves(4), [(0.0, 5.0), (5.0, 6.0), (15.0, 15.0)]);
    assert!(show.engine().document().timeline().moves(99).is_empty());
}

#[test]
fn a_knot_is_put_in_where_a_key_would_be_negative() {
    let (show, _) = open(SHOW);
    let keys = show.engine().document().keys();
    assert_eq!(keys.inserted(), 1);
    let starts: Vec<f64> = keys.segments().iter().map(|s| s.start()).collect();
    assert!(starts.iter().any(|s| (s - 0.8).abs() < 1e-6), "{starts:?}");
}

#[test]
fn banks_are_drawn_by_name_and_groups_count() {
    let (mut show, store) = open(SHOW);
    let all = ["rig", "warm.r", "warm.g", "warm.b", "cold"];
    let of = |drawn: &str| -> Vec<bool> {
        let named = |name: &&str| drawn.contains(&format!(">{name}<"));
        all.iter().map(named).collect()
    };
    let (said, svg) = drawn(&mut show, &store, "");
    assert!(said.starts_with("3 banks of Knots"), "{said}");
    assert_eq!(of(&svg), [true; 5]);
    for word in ["move", ">now<", "over time"] {
        assert!(svg.contains(word), "{word}");
    }
    let (said, svg) = drawn(&mut show, &store, "warm");
    assert!(said.starts_with("1 bank of"), "{said}");
    assert_eq!(of(&svg), [false, true, true, true, false]);
    let (_, svg) = drawn(&mut show, &store, "sides cold");
    assert_eq!(of(&svg), [true, false, false, false, true]);
    // The word alone means the light plot; a bank of that name is named as in `show`.
    let (said, _) = drawn(&mut show, &store, "rig");
    assert!(said.starts_with("3 lights of Knots"), "{said}");
    let (said, svg) = drawn(&mut show, &store, "bank rig");
    assert!(said.starts_with("1 bank"), "{said}");
    assert_eq!(of(&svg), [true, false, false, false, false]);
}

#[test]
fn what_cannot_be_drawn_says_what_could() {
    let (mut show, _) = open(SHOW);
    for (line, said) in [
        (
            "plot wram",
            "there is no bank, group or head `wram`; did you mean `warm`?",
        ),
        ("plot side", "did you mean `sides`?"),
        ("plot spectrums", "did you mean `spectrum`?"),
        ("plot moonlight", "`show` lists the banks"),
        ("plot rig -o rig.gif", "use .png or .svg"),
        (
            "plot warm --tolerance 2%",
            "`--tolerance` is for `plot spectrum`",
        ),
        ("plot spectrum --tolerance much", "is not an error"),
    ] {
        let error = show.execute(line).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains(said), "{line}: {error}");
    }
}

#[test]
fn the_spectrum_the_basis_and_the_error_follow_the_pool() {
    let (mut show, store) = open(SHOW);
    let (said, svg) = drawn(&mut show, &store, "spectrum --tolerance 10%");
    assert!(said.contains("reach 10.0 %"), "{said}");
    assert!(svg.contains("tolerance 10.0 %") && svg.contains("singular value"));
    let (said, svg) = drawn(&mut show, &store, "basis");
    assert!(said.contains("nothing is refined yet"), "{said}");
    assert!(svg.contains("each bank alone") && svg.contains(">warm.g<"));
    let (_, svg) = drawn(&mut show, &store, "error");
    assert!(svg.contains("what more seconds would buy"));
    show.execute("refine 2").unwrap();
    let (said, svg) = drawn(&mut show, &store, "basis");
    assert!(said.starts_with("2 basis pictures"), "{said}");
    assert!(svg.contains("the error that each leaves"));
    let (said, _) = drawn(&mut show, &store, "error");
    assert!(
        said.starts_with("2 refined pictures: predicted error"),
        "{said}"
    );
}

#[test]
fn files_are_light_unless_dark_is_asked_for_and_the_terminal_is_dark() {
    let (mut show, store) = open(SHOW);
    let scene_key = |svg: &str| svg.contains("#ffffff");
    assert!(scene_key(&drawn(&mut show, &store, "").1));
    assert!(!scene_key(&drawn(&mut show, &store, "--dark").1));
    let shown = show.execute("plot").unwrap().picture.unwrap();
    assert!(shown.rgb[..3].iter().all(|c| *c < 64));
    show.execute("plot -o curves.png").unwrap();
    let png = store.read(Path::new("curves.png"), 1 << 24).unwrap();
    assert_eq!(&png[1..4], b"PNG");
}

#[test]
fn a_last_picture_that_leaves_nothing_is_seen_on_the_spectrum() {
    let (mut show, store) = open(SHOW);
    let (said, svg) = drawn(&mut show, &store, "spectrum --tolerance 0.01%");
    assert!(said.starts_with("3 refined pictures of 3 reach"), "{said}");
    assert!(svg.contains("3 pictures: nothing left"), "{svg}");
}

/// The rig on paper: two tables and the light plot.
#[test]
fn the_rig_is_drawn_and_listed_by_channel_and_by_place() {
    let text = SHOW
        .replace("bank cold = c", "bank cold = c  channel 2")
        .replace("rgb\n", "channel 7  rgb\n")
        .replace(
            "light c  spot at 1, 0, 2 ",
            "light c  spot at 1, -4, 2  moves  2700 K",
        );
    let (mut show, store) = open(&text);
    let hookup = show.execute("hookup").unwrap().text;
    assert_eq!(
        String::from(hookup),
        "\
channel  light  purpose       kind  x (m)  y (m)  z (m)  aim x (m)  aim y (m)  aim z (m)  beam (deg)
2        c      cold (sides)  spot  1      -4     2      1          1          0          30
7        b      warm          spot  0      0      2      0          1          0          30
         a      rig (sides)   spot  -1     0      2      -1         1          0          30

channel  light  field (deg)  colour  moves (deg)
2        c      50           2700 K  pan -270 to 270, tilt -135 to 135, zoom 4 to 60
7        b      50           rgb
         a      50

x to stage left, y upstage, z up. Moving heads stand at home.
"
    );
    show.execute("schedule -o s.csv").unwrap();
    let csv = store.read(Path::new("s.csv"), 1 << 16).unwrap();
    let csv = String::from_utf8(csv).unwrap();
    let order: Vec<&str> = csv.lines().filter_map(|line| line.get(..4)).collect();
    assert_eq!(order, ["ligh", "c,1,", "b,0,", "a,-1"]);
    let (said, svg) = drawn(&mut show, &store, "rig");
    assert!(said.starts_with("3 lights of Knots, 1:40 on A4"), "{said}");
    for label in [
        ">2<",
        ">7<",
        ">rig<",
        ">moving head<",
        ">2 m    1:40 on A4<",
    ] {
        assert!(svg.contains(label), "{label}");
    }
}
