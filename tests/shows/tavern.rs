//! The example show: its set is its program's output, and its text uses the whole language.

use std::path::Path;

use crate::set;
use footlight_host::files::Folder;
use footlight_show::diagnostic::Sources;
use footlight_show::geometry::vec3;
use footlight_show::lang;
use footlight_show::model::{Dimmer, Fade, Interpolation, Link, Motion, Move, Part, Show, Trigger};
use footlight_stage::import;
use footlight_stage::stage_file::Options;

#[allow(dead_code, reason = "the program's `main` is not wanted here")]
#[path = "../../examples/tavern/model.rs"]
mod model;

fn beside_the_show(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tavern");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn show() -> Show {
    let mut sources = Sources::default();
    let parsed = lang::parse(&mut sources, "tavern.lxq", &beside_the_show("tavern.lxq"));
    assert_eq!(parsed.diagnostics, [], "neither errors nor warnings");
    parsed.show.unwrap()
}

fn outlines() -> Vec<set::VertexBuffer> {
    let faces = model::tavern().faces.into_iter();
    faces
        .map(|f| set::outline(f.material, f.object, &f.vertices))
        .collect()
}

#[test]
fn the_files_are_what_the_program_makes() {
    assert!(
        beside_the_show("tavern.obj") == model::obj(&model::tavern()),
        "run the example"
    );
    assert!(
        beside_the_show("tavern.mtl") == model::mtl(),
        "run the example"
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tavern");
    let painted = model::PAINTERS.iter().map(|(n, p)| (*n, model::paint(*p)));
    set::has_its_images(&folder, model::SIDE, painted);
}

#[test]
fn every_face_is_planar_convex_and_worth_drawing() {
    let outlines = outlines();
    assert!((400..1000).contains(&outlines.len()), "{}", outlines.len());
    set::is_worth_drawing(&outlines);
}

/// The solids face outwards: by the divergence theorem the signed volumes under the faces of a
/// closed solid add up to its volume; a face with the wrong winding spoils the sum.
#[test]
fn solids_look_outwards() {
    let mut set = model::Set::default();
    let frame = model::Frame::facing([1.0, 2.0, 3.0], [3.0, 4.0]);
    set.block(frame, "oak", [0.0, 0.0, 0.0], [2.0, 3.0, 4.0], &[]);
    assert!((volume(&set) - 24.0).abs() < 1e-9);

    let mut set = model::Set::default();
    let rings = [[1.0, 0.0], [2.0, 1.5], [1.0, 3.0]];
    set.mantle(frame, "oak", &model::octagon(), &rings);
    set.lid(frame, "oak", &model::octagon(), [1.0, 3.0]);
    set.underside(frame, "oak", &model::octagon(), [1.0, 0.0]);
    // Two octagonal frustums, each h/3 (A + sqrt(A B) + B), A = 2 sqrt 2 r^2.
    let expected = 2.0 * 1.5 / 3.0 * 8_f64.sqrt() * (1.0 + 2.0 + 4.0);
    assert!((volume(&set) - expected).abs() < 1e-9);

    let mut set = model::Set::default();
    let triangle = [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]];
    set.extrude(frame, "oak", &triangle, [0.0, 5.0], &[]);
    // Its back is left out: at local y = 5, area 1.
    let back = triangle.map(|[x, z]| [x, 5.0, z]);
    set.face(frame, "oak", &[back[2], back[1], back[0]]);
    assert!((volume(&set) - 5.0).abs() < 1e-9);
}

fn volume(set: &model::Set) -> f64 {
    let sixth =
        |[ax, ay, az]: model::Point, [bx, by, bz]: model::Point, [cx, cy, cz]: model::Point| {
            vec3(ax, ay, az).dot(vec3(bx, by, bz).cross(vec3(cx, cy, cz))) / 6.0
        };
    let faces = set.faces.iter().map(|f| &f.vertices);
    faces
        .map(|v| {
            (1..v.len() - 1)
                .map(|i| sixth(v[0], v[i], v[i + 1]))
                .sum::<f64>()
        })
        .sum()
}

#[test]
fn no_back_is_seen_from_the_house() {
    set::shows_fronts(&outlines(), &show().views[0].camera);
}

#[test]
fn the_show_is_as_large_as_it_says() {
    let show = show();
    assert!(show.banks.len() >= 16, "{} banks", show.banks.len());
    assert!((16..=24).contains(&show.coordinates().len()));
    assert!(show.cues.len() >= 8, "{} cues", show.cues.len());
    assert_eq!(show.stages[0].path, "tavern.obj");
    let names: Vec<&str> = model::MATERIALS.iter().map(|m| m.name).collect();
    for light in &show.lights {
        if let footlight_show::model::LightKind::Panel { material, .. } = &light.kind {
            assert!(
                names.contains(&material.as_str()),
                "{material} is on no panel"
            );
        }
    }
}

#[test]
fn the_rig_fits_the_stage() {
    let show = show();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tavern");
    let files = Folder::new(folder, 1 << 24);
    let stage = &show.stages[0];
    let scene = import::read(&files, &stage.path, &Options::default(), usize::MAX);
    let scene = scene.unwrap().scene;
    // Tapering round faces are cut in two.
    let faces = model::tavern().faces;
    let round = faces.iter().filter(|f| !f.normals.is_empty()).count();
    let cut = scene.polygons.len() - faces.len();
    assert!(cut <= round, "{cut} more polygons than faces");
    let rig = footlight_stage::rig::rig(&show, &scene).unwrap();
    let lit = |s: &footlight_stage::Source| s.emitters.iter().map(|e| e.light).collect::<Vec<_>>();
    let mut lit: Vec<usize> = rig.sources.iter().flat_map(lit).collect();
    lit.sort_unstable();
    lit.dedup();
    assert_eq!(
        lit.len(),
        rig.lights.len(),
        "a light hangs that no bank drives"
    );
    let emits = |m: usize| scene.materials[m].emission != footlight_show::units::Rgb::default();
    let glowing = scene.polygons.iter().filter(|p| emits(p.material)).count();
    assert!(glowing <= 40, "{glowing} emitting polygons");
}

#[test]
fn every_kind_of_part_is_used() {
    let show = show();
    let parts = || show.cues.iter().flat_map(|c| &c.parts);
    let moves = || parts().flat_map(|p| &p.moves);
    let path = |kind: Interpolation| {
        let is = |m: &Move| matches!(&m.motion, Motion::Path(p) if p.interpolation == kind);
        moves().any(is)
    };
    for kind in [
        Interpolation::Steps,
        Interpolation::Linear,
        Interpolation::Natural,
        Interpolation::CatmullRom,
        Interpolation::Monotone,
        Interpolation::Hermite,
        Interpolation::Bezier,
    ] {
        assert!(path(kind), "no {kind:?} path");
    }
    let fade = |test: fn(&Fade) -> bool| parts().any(|p| test(&p.curve));
    assert!(fade(|f| matches!(f, Fade::Curve(_))), "no curve of its own");
    assert!(
        fade(|f| Some(*f) == Fade::built_in("ease"))
            && fade(|f| Some(*f) == Fade::built_in("slow-bottom"))
    );
    let snaps = |p: &Part| p.up.micros() == 0 && p.down.micros() == 0 && !p.moves.is_empty();
    assert!(parts().any(snaps), "no snap");
    assert!(parts().any(|p| p.up != p.down), "no split time");
    assert!(parts().any(|p| p.delay.micros() > 0), "no delay");
    assert!(moves().any(|m| m.repeat > 1), "no repeat");
    assert!(
        show.cues.iter().any(|c| c.parts.len() > 2),
        "no cue in parts"
    );

    let cues = || show.cues.iter();
    assert!(cues().any(|c| matches!(c.trigger, Trigger::At(_))));
    assert!(cues().any(|c| matches!(c.link, Some((_, Link::Follow(_))))));
    assert!(cues().any(|c| matches!(c.link, Some((_, Link::Hang(_))))));
    assert!(cues().any(|c| c.block) && cues().any(|c| c.assert) && cues().any(|c| c.cueonly));
    assert!(
        cues().any(|c| c.number.to_string() == "6.5"),
        "no point cue"
    );
    assert!(show.banks.iter().any(|b| b.rgb) && !show.fixed.is_empty());
    assert!(show.banks.iter().any(|b| b.dimmer == Dimmer::Square));
    assert!(!show.groups.is_empty() && !show.looks.is_empty());
    // The curtain takes everything out.
    let last = show.cues.last().unwrap();
    let out = last.parts.iter().flat_map(|p| &p.moves);
    assert!(out.clone().all(|m| m.motion == Motion::To(0.0)));
    assert_eq!(out.count(), show.banks.len());
}
