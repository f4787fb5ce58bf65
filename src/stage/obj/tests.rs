#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use proptest::prelude::*;

use super::*;
use crate::import;
use footlight_host::files::{FileError, Memory};
use footlight_picture::png;
use footlight_show::geometry::{newell, vec3};
use footlight_show::units::Rgb;

const MTL: &str =
    "newmtl wall\nKd 0.7 0.6 1\n\nnewmtl lamp # hangs\nKd 0 0 0\nKe 10 9 8\nmap_Kd x.png\n";
const CROSSING: &str = "the face crosses itself";
const HEAD: &str = "mtllib mtl/stage.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl wall\n";

fn import(files: &Memory, path: &str, z_up: bool) -> Result<Scene, SceneError> {
    let options = Options {
        z_up,
        ..Options::default()
    };
    Ok(parse(files, path, &files.read(path)?, &options, usize::MAX)?.scene)
}

fn read(obj: &str, mtl: &str) -> Result<Scene, SceneError> {
    let files = Memory::default()
        .with("set/stage.obj", obj)
        .with("set/mtl/stage.mtl", mtl);
    import(&files, "set/stage.obj", true)
}

fn refused(obj: &str, mtl: &str) -> (String, usize, String) {
    match read(obj, mtl).unwrap_err() {
        SceneError::Line { path, line, reason } => (path, line, reason),
        other => unreachable!("{other}"),
    }
}

fn area(polygon: &Polygon) -> f64 {
    newell(&polygon.vertices).length() / 2.0
}

#[test]
fn polygons_stay_whole_and_take_their_materials() {
    let obj = format!("{HEAD}o a\nf 1/1 2/2/2 3//3 -1\nusemtl lamp\no b\nf 1 2 3\n# f 9 9 9\n");
    let scene = read(&obj, MTL).unwrap();
    assert_eq!(scene.materials.len(), 2);
    assert_eq!(scene.materials[0].reflectance, Rgb([0.7, 0.6, 1.0]));
    assert_eq!(scene.materials[1].emission, Rgb([10.0, 9.0, 8.0]));
    let sizes = scene
        .polygons
        .iter()
        .map(|p| (p.vertices.len(), p.material));
    assert_eq!(sizes.collect::<Vec<_>>(), [(4, 0), (3, 1)]);
}

/// Every notation finds the one image.
#[test]
fn images_are_found_as_programs_name_them() {
    let image = png::encode(2, 2, &[200; 12]).unwrap();
    for name in [
        "x y.png",
        "\"x y.png\"",
        ".\\x y.png",
        "C:\\Users\\me\\x y.png",
        "/home/me/x y.png",
        "-s 2 2 1 -o 0.5 0 0 x y.png",
        "-bm 1.0 -imfchan l -clamp on x y.png",
    ] {
        let mtl = format!("newmtl wall\r\nKd 1 1 1\r\nmap_Kd {name}\r\n");
        let files = Memory::default()
            .with("set/stage.obj", format!("{HEAD}f -4 -3 -2 -1\n"))
            .with("set/mtl/stage.mtl", mtl)
            .with("set/mtl/x y.png", image.clone());
        let scene = import(&files, "set/stage.obj", true).unwrap();
        assert!(scene.materials[0].texture.is_some(), "{name}");
    }
}

#[test]
fn names_may_be_in_latin_1_and_an_image_that_shines_is_told() {
    let mut obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl W\xe4nde\nf 1 2 3\n".to_vec();
    obj.extend(b"g B\xfchne\n");
    let files = Memory::default().with("a.obj", obj).with(
        "a.mtl",
        b"newmtl W\xe4nde\nKd .5 .5 .5\nmap_Ke x.png\n".to_vec(),
    );
    let stage = import::read(&files, "a.obj", &Options::default(), usize::MAX).unwrap();
    assert_eq!(stage.scene.materials[0].name, "W\u{e4}nde");
    assert_eq!(stage.scene.polygons[0].material, 0);
    let said = stage.summary.left_out.join("; ");
    assert!(said.contains("`map_Ke` of `W\u{e4}nde`"), "{said}");
}

/// A line that is not UTF-8; five bytes have no character in Windows-1252.
#[test]
fn names_may_be_in_windows_1252() {
    let mut obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec();
    obj.extend(
        b"usemtl \x84B\xfchne\x93 \x96 5 \x80 \x81\nf 1 2 3\nusemtl \xe2\x82\xac\nf 1 2 3\n",
    );
    let files = Memory::default().with("a.obj", obj);
    let scene = import(&files, "a.obj", true).unwrap();
    let names: Vec<&str> = scene.materials.iter().map(|m| &*m.name).collect();
    assert_eq!(
        names,
        [
            "\u{201e}B\u{fc}hne\u{201c} \u{2013} 5 \u{20ac} \u{81}",
            "\u{20ac}"
        ]
    );
}

#[test]
fn y_up_is_turned() {
    let files = Memory::default()
        .with(
            "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 0\nusemtl m\nf 1 2 3",
        )
        .with("a.mtl", "newmtl m\nKd 1 1 1");
    let up = |z_up| newell(&import(&files, "a.obj", z_up).unwrap().polygons[0].vertices);
    assert_eq!(up(true), vec3(0.0, 1.0, 0.0));
    assert_eq!(up(false), vec3(0.0, 0.0, 1.0));
}

#[test]
fn what_no_face_has_is_no_reason_to_refuse() {
    for vertex in ["v 1 nan 2", "v 1 2 -inf", "v 1 2 1e999"] {
        let scene = read(&format!("{HEAD}{vertex}\nf 1 2 3\n"), MTL).unwrap();
        assert_eq!(scene.polygons.len(), 1, "{vertex}");
        let (_, _, reason) = refused(&format!("{HEAD}{vertex}\nf 1 2 -1\n"), MTL);
        assert!(reason.contains("not a finite number"), "{vertex}: {reason}");
    }
    let unused = format!("{MTL}newmtl odd\nKd 2 2 2\nnewmtl empty\nKd\nd\nmap_Kd\n");
    let scene = read(&format!("{HEAD}f 1 2 3\n"), &unused).unwrap();
    assert_eq!(scene.polygons.len(), 1);
    let (_, _, reason) = refused(&format!("{HEAD}usemtl odd\nf 1 2 3\n"), &unused);
    assert_eq!(reason, "reflectance 2 is outside 0 to 1");
    // A material without properties counts as missing.
    let scene = read(&format!("{HEAD}usemtl empty\nf 1 2 3\n"), &unused).unwrap();
    let own = scene.polygons[0].material;
    assert_eq!(scene.materials[own].reflectance, Rgb([UNSTATED; 3]));
    // Lines that end in a carriage return alone.
    let old = |text: &str| text.replace("\r\n", "\n").replace('\n', "\r");
    let scene = read(&old(&format!("{HEAD}f 1 2 3\n")), &old(MTL)).unwrap();
    assert_eq!(scene.materials[0].reflectance, Rgb([0.7, 0.6, 1.0]));
}

#[test]
fn wrong_lines_are_named() {
    let long = "f 1 2 3 ".to_owned() + &"1 ".repeat(CORNER_LIMIT);
    for (line, reason) in [
        ("v 1 2", "`v` needs 3 numbers and has 2"),
        ("v 1 2 1e10", "coordinate 10000000000 is beyond 1e9 metres"),
        ("v 1 2 x", "`x` is not a finite number"),
        ("f 1 2 x", "`x` is not a corner of a face"),
        ("f 1 2 3/1/1/1", "`3/1/1/1` is not a corner of a face"),
        ("f 1 2 /3", "`/3` is not a corner of a face"),
        (
            "f 1 2 5",
            "vertex 5 does not exist; 4 are defined up to here",
        ),
        (
            "f 1 2 0",
            "vertex 0 does not exist; 4 are defined up to here",
        ),
        (
            "f 1 2 -5",
            "vertex -5 does not exist; 4 are defined up to here",
        ),
        (
            "f 1 3 2 -9223372036854775808",
            "vertex -9223372036854775808 does not exist; 4 are defined up to here",
        ),
        (
            "f 1 2 \\\n 6",
            "vertex 6 does not exist; 4 are defined up to here",
        ),
        ("mtllib", "`mtllib` needs a name"),
        (long.as_str(), "more than 256 corners of a face"),
        ("v 3 1 0\nv 2 2 0\nf 1 5 4 6", CROSSING),
        // A square's bow tie: its lobes cancel, and it must not vanish like a face without area.
        ("\n\nf 1 3 2 4", CROSSING),
    ] {
        let (path, at, found) = refused(&format!("{HEAD}{line}\nf 1 2 3\n"), MTL);
        let expected = if found == CROSSING { 9 } else { 7 };
        assert_eq!(
            (path.as_str(), at, found.as_str()),
            ("set/stage.obj", expected, reason),
            "{line}"
        );
    }
    assert_eq!(
        refused("\u{0}\u{1}", MTL).2,
        "not text; is this an OBJ or MTL file?"
    );
}

#[test]
fn what_has_no_material_of_the_file_gets_one_and_it_is_said() {
    let early = HEAD.replace(
        "usemtl wall",
        "f 1 2 3\nusemtl unknown\nf 1 2 3\nmtllib none.mtl",
    );
    let files = Memory::default()
        .with("set/stage.obj", early)
        .with("set/mtl/stage.mtl", MTL);
    let stage = import::read(&files, "set/stage.obj", &Options::default(), usize::MAX).unwrap();
    let names = |m: &usize| stage.scene.materials[*m].name.as_str();
    let used: Vec<_> = stage
        .scene
        .polygons
        .iter()
        .map(|p| names(&p.material))
        .collect();
    assert_eq!(used, ["default", "unknown"]);
    let said = stage.summary.left_out.join("; ");
    for part in ["`usemtl`", "`unknown` (line", "none.mtl"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn groups_that_are_named_become_materials() {
    let text = format!("{HEAD}g door panel\nf 1 2 3\no\nf 1 2 3\n");
    let files = Memory::default()
        .with("set/stage.obj", text)
        .with("set/mtl/stage.mtl", MTL);
    let options = Options {
        parts: vec!["door panel".to_owned()],
        ..Options::default()
    };
    let stage = import::read(&files, "set/stage.obj", &options, usize::MAX).unwrap();
    let names = stage
        .scene
        .polygons
        .iter()
        .map(|p| stage.scene.materials[p.material].name.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["door panel", "wall"]);
}

#[test]
fn wrong_materials_are_named() {
    let obj = format!("{HEAD}f 1 2 3\n");
    for (mtl, line, reason) in [
        (
            "newmtl wall\nKd 0.5 1.1 0",
            2,
            "reflectance 1.1 is outside 0 to 1",
        ),
        (
            "newmtl wall\nKd 0.5 -0.1 0",
            2,
            "reflectance -0.1 is outside 0 to 1",
        ),
        (
            "newmtl wall\n\nKd 0.5 0.5",
            3,
            "`Kd` needs 3 numbers and has 2",
        ),
        (
            "newmtl wall\nKe -1 0 0",
            2,
            "emitted luminance -1 is negative",
        ),
        ("newmtl wall\nKe 1 nan 0", 2, "`nan` is not a finite number"),
        ("Kd 1 1 1", 1, "`newmtl` needs a name"),
    ] {
        let found = refused(&obj, mtl);
        assert_eq!(
            found,
            ("set/mtl/stage.mtl".to_owned(), line, reason.to_owned())
        );
    }
    let files = Memory::default().with("a.obj", "mtllib ../a.mtl\nv 0 0 0");
    let outside = import(&files, "a.obj", true);
    assert!(matches!(
        outside,
        Err(SceneError::File(FileError::Outside(_)))
    ));
    let missing = import(&files, "b.obj", true);
    assert!(matches!(
        missing,
        Err(SceneError::File(FileError::Missing(_)))
    ));
    let nothing = Memory::default().with("a.obj", "");
    let empty = import::read(&nothing, "a.obj", &Options::default(), usize::MAX);
    assert!(matches!(empty, Err(SceneError::Empty { .. })));
}

/// Roughness, reflectance at normal incidence, and diffuse reflectance of a material with `Kd` 0.5.
type Finished = (f64, f64, f64);

#[test]
fn highlights_become_gloss_as_blender_writes_them() {
    let cases: [(&str, Option<Finished>); 15] = [
        ("Ns 640\nKs 0.5 0.5 0.5\nillum 2", Some((0.2, 0.04, 0.5))),
        ("Ks 0.25\nNs 360", Some((0.4, 0.02, 0.5))),
        // Above 1, which no Blender exporter writes.
        ("Ks 3 3 3\nNs 4000", Some((0.0, 0.08, 0.5))),
        ("Ns 640\nKs 0.5 0.5 0.5\nillum 1", None),
        ("Ns 640\nKs 0 0 0\nillum 2", None),
        ("Ns 640", None),
        // Blender's default, and the exponent of most other programs.
        ("Ns 250\nKs 0.5 0.5 0.5\nillum 2", None),
        ("Ns 96\nKs 1 1 1\nillum 2", None),
        ("Ks 1 1 1", None),
        // A metal in Blender's files, a mirror in others.
        (
            "Ns 640\nKa 1 1 1\nKs 0.5 0.5 0.5\nillum 3",
            Some((0.2, 0.5, 0.0)),
        ),
        (
            "Ns 1000\nKa 0 0 0\nKs 0.75 0.75 0.75\nillum 3",
            Some((0.0, 0.75, 0.5)),
        ),
        ("Pr 0.25", Some((0.25, 0.04, 0.5))),
        ("Ns 10\nPr 0.25\nPm 1\nillum 1", Some((0.25, 0.5, 0.0))),
        ("Ns 1000\nKs 1 1 1\nPr 0.5", None),
        ("Ns 640\nKs 0.5 0.5 0.5\nKe 1 1 1", None),
    ];
    let obj = format!("{HEAD}f 1 2 3\n");
    for (lines, wanted) in cases {
        let scene = read(&obj, &format!("newmtl wall\nKd 0.5 0.5 0.5\n{lines}\n")).unwrap();
        let material = &scene.materials[0];
        let found = material.gloss.as_ref();
        let found = found.map(|g| (g.roughness, g.normal.0[0], material.reflectance.0[0]));
        assert_eq!(found.is_some(), wanted.is_some(), "{lines}");
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let (found, wanted) = (found.unwrap_or_default(), wanted.unwrap_or_default());
        assert!(
            near(found.0, wanted.0) && near(found.1, wanted.1) && near(found.2, wanted.2),
            "{lines}: {found:?}"
        );
    }
}

#[test]
fn highlights_that_cannot_be_read_refuse_no_stage() {
    let files = Memory::default()
        .with(
            "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl wall\nf 1 2 3",
        )
        .with("a.mtl", "newmtl wall\nKd 1 1 1\nKs 1 1 1\nNs -nan(ind)\n");
    let read = import::read(&files, "a.obj", &Options::default(), usize::MAX).unwrap();
    assert_eq!(read.scene.materials[0].gloss, None);
    assert_eq!(
        read.summary.left_out,
        ["the gloss of `wall`: `-nan(ind)` is not a finite number; it is matt"]
    );
}

/// A square with a square hole; the outline leads to the hole and back along one edge.
#[test]
fn holes_are_bridged() {
    let obj = "mtllib mtl/stage.mtl\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\n\
               v 3 3 0\nv 3 1 0\nusemtl wall\nf 1 2 3 4 1 5 6 7 8 5\n";
    let scene = read(obj, MTL).unwrap();
    assert!((scene.polygons.iter().map(area).sum::<f64>() - 12.0).abs() < 1e-12);
}

/// Kd of exactly 1 (a furnace's wall) is valid; a face that goes there and back has no area and is
/// dropped.
#[test]
fn polygons_without_area_are_dropped() {
    let obj = format!("{HEAD}v 0.5 0 0\nf 1 2 5\nf 1 2 2\nf 1 2 3\nf 1 1 2 1\n");
    assert_eq!(read(&obj, MTL).unwrap().polygons.len(), 1);
}

#[test]
fn concave_polygons_stay_whole_and_bent_ones_are_cut() {
    // An L of area 3, flat, then with one corner lifted.
    let ell = |lift: f64| {
        format!(
            "mtllib mtl/stage.mtl\nusemtl wall\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 {lift}\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n"
        )
    };
    let flat = read(&ell(1e-5), MTL).unwrap();
    assert_eq!(flat.polygons.len(), 1);
    let bent = read(&ell(0.01), MTL).unwrap();
    assert_eq!(bent.polygons.len(), 4);
    assert!(bent.polygons.iter().all(|p| p.vertices.len() == 3));
    assert!(bent.polygons.iter().all(|p| newell(&p.vertices).z > 0.0));
    let covered: f64 = bent.polygons.iter().map(area).sum();
    assert!((covered - 3.0).abs() < 1e-3, "{covered}");
}

#[test]
#[ignore = "slow"]
fn limits_hold() {
    let vertices = "v 0 0 0\n".repeat(VERTEX_LIMIT + 1);
    let (_, line, reason) = refused(&vertices, MTL);
    assert_eq!(
        (line, reason),
        (VERTEX_LIMIT + 1, limit("vertices", VERTEX_LIMIT))
    );
    let faces = format!("{HEAD}{}", "f 1 2 3\n".repeat(POLYGON_LIMIT + 1));
    assert_eq!(refused(&faces, MTL).2, limit("faces", POLYGON_LIMIT));
}

#[test]
fn appended_scenes_share_equal_materials_only() {
    let mut scene = read(&format!("{HEAD}f 1 2 3\n"), MTL).unwrap();
    let same = scene.clone();
    scene.append(same);
    assert_eq!((scene.materials.len(), scene.polygons.len()), (2, 2));
    let other = read(&format!("{HEAD}f 1 2 4\n"), "newmtl wall\nKd 0 0 1").unwrap();
    scene.append(other.clone());
    scene.append(other);
    assert_eq!(scene.materials.len(), 3);
    let used: Vec<_> = scene.polygons.iter().map(|p| p.material).collect();
    assert_eq!(used, [0, 0, 2, 2]);
    assert!(scene.set_reflectance("wall", Rgb([0.1; 3])));
    assert!(!scene.set_reflectance("wall", Rgb([1.1; 3])));
    assert!(!scene.set_reflectance("none", Rgb([0.1; 3])));
    assert_eq!(scene.materials[2].reflectance, Rgb([0.1; 3]));
}

fn line() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        Just("v".to_owned()),
        Just("f".to_owned()),
        Just("vt".to_owned()),
        Just("vn".to_owned()),
        Just("usemtl".to_owned()),
        Just("mtllib".to_owned()),
        Just("newmtl".to_owned()),
        Just("Kd".to_owned()),
        Just("Ke".to_owned()),
        Just("o".to_owned()),
        Just("l".to_owned()),
        Just("illum".to_owned()),
        Just("wall".to_owned()),
        Just("\\".to_owned()),
        "-?[0-9]{1,2}(\\.[0-9])?",
        "-?[0-9]{1,3}/-?[0-9]{0,3}/-?[0-9]{0,3}",
        "\\PC{0,4}",
    ];
    prop::collection::vec(word, 0..7).prop_map(|words| words.join(" "))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Any files give a valid scene or an error.
    #[test]
    #[ignore = "slow"]
    fn nothing_panics(
        obj in prop::collection::vec(line(), 0..20),
        mtl in prop::collection::vec(line(), 0..8),
    ) {
        let obj = format!("{HEAD}{}\nf 1 2 3\n", obj.join("\n"));
        let mtl = format!("{MTL}{}", mtl.join("\n"));
        if let Ok(scene) = read(&obj, &mtl) {
            for polygon in &scene.polygons {
                prop_assert!(polygon.material < scene.materials.len());
                prop_assert!(area(polygon) > 0.0);
            }
        }
    }

    #[test]
    fn cut_and_flipped_files_do_not_panic(cut in 0_usize..200, at in 0_usize..200, to in any::<u8>()) {
        let mut bytes = format!("{HEAD}f 1/1/1 2/2/2 3/3/3 4\nusemtl lamp\nf 1 2 -1\n").into_bytes();
        let at = at % bytes.len();
        bytes[at] = to;
        bytes.truncate(cut);
        let files = Memory::default().with("a.obj", bytes).with("mtl/stage.mtl", MTL);
        let _ = import(&files, "a.obj", false);
    }

    /// Star-shaped bent polygons: the triangles cover the polygon's area seen from above.
    #[test]
    fn cutting_keeps_the_area(radii in prop::collection::vec((0.2_f64..1.0, -0.05_f64..0.05), 4..24)) {
        let step = std::f64::consts::TAU / radii.len() as f64;
        let corners: Vec<Vec3> = radii.iter().enumerate().map(|(i, (r, z))| {
            let angle = i as f64 * step;
            vec3(r * angle.cos(), r * angle.sin(), *z)
        }).collect();
        let whole = newell(&corners);
        let parts = polygon::planar(corners).unwrap();
        let sum = parts.iter().fold(Vec3::ZERO, |s, p| s + newell(p));
        prop_assert!((sum - whole).length() < 1e-9 * whole.length());
    }
}

#[test]
fn one_number_is_grey() {
    let mtl = "newmtl wall\nKd 0.25\nKe 3\n";
    let scene = read(&format!("{HEAD}f 1 2 3\n"), mtl).unwrap();
    assert_eq!(scene.materials[0].reflectance, Rgb([0.25; 3]));
    assert_eq!(scene.materials[0].emission, Rgb([3.0; 3]));
}

#[test]
fn what_no_polygon_needs_is_no_reason_to_refuse() {
    for head in [
        "usemtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan nan nan\nf 1//1 2//1 3//1\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt 1 inf\nf 1/1 2/2 3/1\n",
        "v 0 0 0 nan nan nan\nv 1 0 0 1 1 1\nv 0 1 0 1\nf 1 2 3\n",
        "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    ] {
        let files = Memory::default().with("a.obj", head).with(
            "m.mtl",
            "newmtl\nKd 0.1 0.1 0.1\nnewmtl m\nKd 1.0000001 0.5 -1e-9\n",
        );
        let scene = import(&files, "a.obj", true).unwrap();
        assert!(
            (scene.polygons.iter().map(area).sum::<f64>() - 0.5).abs() < 1e-12,
            "{head}"
        );
        let used = &scene.materials[scene.polygons[0].material];
        if used.name == "m" {
            assert_eq!(used.reflectance, Rgb([1.0, 0.5, 0.0]));
        }
    }
}

#[test]
fn what_is_left_out_is_named_with_its_line() {
    let mtl = "newmtl wall\nKd spectral wall.rfl\nTr 1\nnewmtl glass\nKd 1 1 1\nd 0\n\
               newmtl ciexyz\nKd xyz 0.3 0.3\n";
    let obj = "mtllib m.mtl\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nl 1 2\nsurf 0 1 0 1 1 2\n\
               usemtl ciexyz\nf 1 2 3\nusemtl wall\nfo 1 2 3\nf 2 3\n";
    let files = Memory::default().with("a.obj", obj).with("m.mtl", mtl);
    let stage = import::read(&files, "a.obj", &Options::default(), usize::MAX).unwrap();
    assert_eq!(stage.scene.polygons.len(), 2);
    assert_eq!(stage.scene.materials[0].reflectance, Rgb([UNSTATED; 3]));
    assert_eq!(
        stage.summary.left_out,
        [
            "`Tr 1` of `wall`: read as opaque",
            "`glass` is fully transparent (`d`, `Tr`): it cannot be seen",
            "colours of vertices: their materials' count (line 2)",
            "faces of fewer than 3 corners (line 5)",
            "free-form curves and surfaces (line 7)",
            "material `ciexyz` has no `Kd` in red, green and blue: it reflects 0.8",
            "material `wall` has no `Kd` in red, green and blue: it reflects 0.8",
            "points and lines: they have no area (line 6)",
        ]
    );
}

#[test]
fn a_line_names_several_libraries_and_a_name_may_have_blanks() {
    let files = |line: &str| {
        let obj = format!(
            "{line}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl blue\nf 3 2 1\n"
        );
        Memory::default()
            .with("x.obj", obj)
            .with(
                "a.mtl",
                "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0.2 0.2 0.2\n",
            )
            .with("b c.MTL", "newmtl blue\nKd 0 0 1\n")
    };
    for line in ["mtllib a.mtl b c.MTL", "mtllib a.mtl\nmtllib b c.MTL"] {
        let read = import::read(&files(line), "x.obj", &Options::default(), usize::MAX).unwrap();
        let colours: Vec<Rgb> = read
            .scene
            .polygons
            .iter()
            .map(|p| read.scene.materials[p.material].reflectance)
            .collect();
        assert_eq!(
            colours,
            [Rgb([1.0, 0.0, 0.0]), Rgb([0.0, 0.0, 1.0])],
            "{line}"
        );
        assert_eq!(
            read.summary.left_out,
            ["material `blue` is defined twice: the last definition counts"]
        );
    }
    assert_eq!(
        read::names_of_libraries("one.mtl.mtl two"),
        ["one.mtl.mtl", "two"]
    );
}
