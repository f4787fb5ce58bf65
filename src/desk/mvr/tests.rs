#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test's own data"
)]

mod heads;

use std::io::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};
use proptest::prelude::*;

use super::Fault;
use super::zip::Archive;
use super::{addressed, import};
use crate::{ImportError, Loss};
use footlight_host::work::{Progress, Work};
use footlight_show::diagnostic::Sources;
use footlight_show::lang;

/// A ZIP archive of deflated files.
fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in files {
        let mut packer = DeflateEncoder::new(Vec::new(), Compression::fast());
        packer.write_all(content).unwrap();
        let packed = packer.finish().unwrap();
        let mut crc = Crc::new();
        crc.update(content);
        let mut about = vec![20, 0, 0, 0, 8, 0, 0, 0, 0, 0];
        about.extend(crc.sum().to_le_bytes());
        about.extend((packed.len() as u32).to_le_bytes());
        about.extend((content.len() as u32).to_le_bytes());
        about.extend((name.len() as u16).to_le_bytes());
        about.extend([0, 0]);
        let header = out.len() as u32;
        out.extend(b"PK\x03\x04");
        out.extend(&about);
        out.extend(name.bytes());
        out.extend(packed);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(about);
        directory.extend([0; 10]);
        directory.extend(header.to_le_bytes());
        directory.extend(name.bytes());
    }
    let start = out.len() as u32;
    let count = (files.len() as u16).to_le_bytes();
    let size = (directory.len() as u32).to_le_bytes();
    out.extend(directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend(count.iter().chain(&count).chain(&size));
    out.extend(start.to_le_bytes());
    out.extend([0, 0]);
    out
}

const SCENE: &str = r#"<?xml version="1.0"?>
<GeneralSceneDescription verMajor="1" verMinor="5"><Scene>
<AUXData><Symdef uuid="AB"><ChildList><Geometry3D fileName="leg.glb"/></ChildList></Symdef></AUXData>
<Layers><Layer name="Rig"><ChildList>
<GroupObject name="Bar"><Matrix>{0,1,0}{-1,0,0}{0,0,1}{1000,2000,6000}</Matrix><ChildList>
<Fixture name="Profile 1"><Matrix>{1,0,0}{0,1,0}{0,0,1}{500,0,0}</Matrix>
<GDTFSpec>Maker@Profile.gdtf</GDTFSpec><GDTFMode>Basic</GDTFMode>
<Addresses><Address break="0">514</Address></Addresses><FixtureID>101</FixtureID>
<Color>0.3127,0.329,100</Color></Fixture>
<Fixture name="Profile 2"><Matrix>{1,0,0}{0,0,-1}{0,1,0}{0,0,0}</Matrix>
<GDTFSpec>Maker@Profile.gdtf</GDTFSpec><GDTFMode>Basic</GDTFMode><FixtureID>101</FixtureID></Fixture>
<Fixture name="Wash"><GDTFSpec>Maker@Profile.gdtf</GDTFSpec><GDTFMode>RGB</GDTFMode>
<Focus>F1</Focus><Addresses><Address break="0">2.11</Address></Addresses><FixtureID>7</FixtureID></Fixture>
<Fixture name="Unknown"><GDTFSpec>Nobody</GDTFSpec><FixtureID/></Fixture>
</ChildList></GroupObject>
<FocusPoint name="A" uuid="f1"><Matrix>{1,0,0}{0,1,0}{0,0,1}{0,3000,1500}</Matrix></FocusPoint>
<SceneObject name="Table"><Matrix>{2,0,0}{0,2,0}{0,0,2}{0,1000,0}</Matrix>
<Geometries><Geometry3D fileName="top.glb"/><Geometry3D fileName="old.3ds"/>
<Symbol symdef="ab"><Matrix>{1,0,0}{0,1,0}{0,0,1}{100,0,0}</Matrix></Symbol></Geometries></SceneObject>
<SceneObject name="Askew"><Matrix>{1,0,0}{0,0,1}{0,-1,0}{0,0,0}</Matrix>
<Geometries><Geometry3D fileName="top.glb"/></Geometries></SceneObject>
</ChildList></Layer></Layers></Scene></GeneralSceneDescription>"#;

/// Geometry of a triangle.
const TRIANGLE: &str = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"BUFFER"}]IMAGES}"#;
const CORNERS: &str =
    "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";

/// A glTF of one triangle, with its corners in `buffer`, which names `images`.
fn set(buffer: &str, images: &str) -> Vec<u8> {
    let text = TRIANGLE.replace("BUFFER", buffer);
    text.replace("IMAGES", images).into_bytes()
}

const TYPE: &str = r#"<GDTF DataVersion="1.2"><FixtureType Name="Profile"><Geometries>
<Geometry Name="Base"><Axis Name="Head" Position="{1,0,0,0}{0,1,0,0}{0,0,1,-0.3}{0,0,0,1}">
<Beam Name="Lens" Position="{1,0,0,0}{0,1,0,0}{0,0,1,-0.1}{0,0,0,1}" BeamAngle="18" FieldAngle="26"
LuminousFlux="8000" ColorTemperature="3200"/></Axis></Geometry></Geometries><DMXModes>
<DMXMode Name="Basic" Geometry="Base"><DMXChannels><DMXChannel Offset="1,2">
<LogicalChannel Attribute="Dimmer"/></DMXChannel></DMXChannels></DMXMode>
<DMXMode Name="RGB" Geometry="Base"><DMXChannels>
<DMXChannel Offset="1"><LogicalChannel Attribute="Dimmer"/></DMXChannel>
<DMXChannel Offset="2"><LogicalChannel Attribute="ColorAdd_R"/></DMXChannel>
<DMXChannel Offset="3"><LogicalChannel Attribute="ColorAdd_G"/></DMXChannel>
<DMXChannel Offset="4"><LogicalChannel Attribute="ColorAdd_B"/></DMXChannel>
<DMXChannel Offset="5"><LogicalChannel Attribute="ColorAdd_W"/></DMXChannel>
<DMXChannel Offset="6"><LogicalChannel Attribute="Pan"/></DMXChannel>
</DMXChannels></DMXMode></DMXModes></FixtureType></GDTF>"#;

fn plan() -> Vec<u8> {
    let kind = archive(&[("description.xml", TYPE.as_bytes())]);
    archive(&[
        ("GeneralSceneDescription.xml", SCENE.as_bytes()),
        ("Maker@Profile.gdtf", &kind),
        ("top.glb", &set(CORNERS, "")),
        ("leg.glb", &set(CORNERS, "")),
    ])
}

#[test]
fn a_plan_becomes_a_rig() {
    let carried = import("plan.mvr", &plan(), "rig-set", Work::silent()).unwrap();
    let show = lang::parse(&mut Sources::default(), "rig.lxq", &carried.text);
    assert!(show.show.is_some(), "{:?}", show.diagnostics);
    insta::assert_snapshot!(carried.text, @r#"
        // The rig of plan.mvr.

        stage "rig-set/top.glb"  scale 2m  at 0, 1, 0
        stage "rig-set/leg.glb"  scale 2m  at 0.2, 1, 0

        light profile_1  spot            at 1, 2.5, 5.6  aim 1, 2.5, 0  beam 18  field 26  8000 lm  3200 K
        light profile_2  like profile_1  at 1.4, 2, 6    aim 6.4, 2, 6
        light wash       spot            at 1, 2, 5.6    aim 0, 3, 1.5  beam 18  field 26  8000 lm
        light unknown    spot            at 1, 2, 6      aim 1, 2, 0    beam 20  field 30  10000 lm

        bank ch7   = wash                 channel 7  rgb
        bank ch101 = profile_1 profile_2  channel 101
        bank ch102 = unknown              channel 102
        "#);
    insta::assert_snapshot!(carried.patch, @r#"
        ch7 2/12
        ch101 2/2 16bit
        "#);
    let losses: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(losses.join("\n"), @r#"
        line 20: `top.glb` stands askew, which no stage does: left out
        line 12: `Wash` stays as it hangs: it turns about one axis only
        line 12: `Wash`: its own dimmer is to stand at full
        line 12: `Wash`: colours other than red, green and blue
        line 14: the type `Nobody` of `Unknown`: its GDTF file is not in the archive
        line 17: 1 file of geometry ends in .3ds: only glTF is read
        "#);
    insta::assert_snapshot!(carried.assumed.join("\n"), @r#"
        `Nobody`: 10000 lumens
        `Nobody`: a beam of 20 degrees
        `Nobody`: a field of 30 degrees
        `Nobody`: white light
        fixtures without a focus point look as they hang (3 times)
        fixtures without a number of a channel get the next ones
        the plan's X is stage left and its Y upstage
        "#);
    let files: Vec<&str> = carried
        .files
        .iter()
        .map(|(path, _)| path.as_str())
        .collect();
    assert_eq!(files, ["rig-set/top.glb", "rig-set/leg.glb"]);
}

#[test]
fn addresses_are_counted_over_all_universes_or_not() {
    assert_eq!(addressed("1"), Some((1, 1)));
    assert_eq!(addressed("513"), Some((2, 1)));
    assert_eq!(addressed("3.17"), Some((3, 17)));
    assert_eq!(addressed("3.512"), Some((3, 512)));
    for none in ["0", "1.0", "0.1", "1.513", "x"] {
        assert_eq!(addressed(none), None, "{none}");
    }
}

#[test]
fn a_file_of_an_archive_is_checked() {
    let whole = archive(&[("a", &[7; 5000])]);
    let read =
        |bytes: &[u8]| Archive::new(bytes).and_then(|archive| archive.read("a", Work::silent()));
    assert_eq!(read(&whole).unwrap().unwrap(), [7; 5000]);
    assert_eq!(
        Archive::new(&whole).unwrap().read("b", Work::silent()),
        Ok(None)
    );
    let mut damaged = whole.clone();
    damaged[34] ^= 1;
    let said = |why: &str| Err(Fault::Said(why.to_owned()));
    assert_eq!(read(&damaged), said("`a` in it is damaged"));
    let cut = "it is no ZIP archive, or it is cut off";
    assert_eq!(read(&whole[..30]), said(cut));
    let little = Work {
        memory: 4999,
        ..Work::silent()
    };
    assert_eq!(
        Archive::new(&whole).unwrap().read("a", little),
        Err(Fault::Memory(
            "`a` in it does not fit into the memory allowed".to_owned()
        ))
    );
}

/// The error for a plan with this much memory; `None` when it is read.
fn refused(plan: &[u8], memory: usize) -> Option<String> {
    let work = Work {
        memory,
        ..Work::silent()
    };
    match import("plan.mvr", plan, "set", work) {
        Ok(_) => None,
        Err(ImportError::Refused(diagnostic)) => {
            Some(format!("{}; {:?}", diagnostic.message, diagnostic.help))
        }
        Err(ImportError::Cancelled(_)) => panic!("nobody cancelled"),
    }
}

#[test]
fn a_plan_is_read_within_its_memory() {
    let mut set = set(CORNERS, "");
    set.resize(3 << 20, b' ');
    let scene = SCENE.replace("leg.glb", "leg2.glb");
    let kind = archive(&[("description.xml", TYPE.as_bytes())]);
    let plan = archive(&[
        ("GeneralSceneDescription.xml", scene.as_bytes()),
        ("Maker@Profile.gdtf", &kind),
        ("top.glb", &set),
        ("leg2.glb", &set),
    ]);
    assert_eq!(refused(&plan, 16 << 20), None);
    // One of the two is held while the other is unpacked.
    for memory in [5 << 20, 2 << 20, 200_000, 10_000, 0] {
        let said = refused(&plan, memory).unwrap();
        assert!(said.contains("allow more with `--memory MB`"), "{said}");
    }
    // A fixture type counts as well.
    let large = format!("{TYPE}<!--{}-->", " ".repeat(9 << 20));
    let kind = archive(&[("description.xml", large.as_bytes())]);
    let plan = archive(&[
        ("GeneralSceneDescription.xml", SCENE.as_bytes()),
        ("Maker@Profile.gdtf", &kind),
    ]);
    let said = refused(&plan, 8 << 20).unwrap();
    assert!(
        said.contains("`description.xml` in it does not fit"),
        "{said}"
    );
}

/// Small files that could occupy a reader for hours, or fill all memory.
#[test]
fn a_plan_that_grows_as_it_is_read_is_refused() {
    let scene = |text: &str| {
        let scene = format!("<GeneralSceneDescription{text}</GeneralSceneDescription>");
        archive(&[("GeneralSceneDescription.xml", scene.as_bytes())])
    };
    let attributes: String = (0..100_000).map(|i| format!(" a{i}=''")).collect();
    let said = refused(&scene(&format!("{attributes}>")), 1 << 30).unwrap();
    assert!(said.contains("more than 250 attributes"), "{said}");
    let namespaces: String = (0..1_000)
        .map(|i| format!("<a xmlns:a{i}='{i}'>"))
        .collect();
    let said = refused(&scene(&format!(">{namespaces}")), 1 << 30).unwrap();
    assert!(said.contains("more than 20 namespaces"), "{said}");
    let object = "<SceneObject><Geometries><Symbol symdef='a'/></Geometries></SceneObject>";
    let files = "<Geometry3D fileName='a.glb'/>".repeat(5_000);
    let symbols = format!(
        "><Symdef uuid='a'><ChildList>{files}</ChildList></Symdef>\
         <Layer><ChildList>{}</ChildList></Layer>",
        object.repeat(5_000)
    );
    let said = refused(&scene(&symbols), 1 << 30).unwrap();
    assert!(said.contains("more than 10000 objects"), "{said}");
    // Each geometry refers to the next nine times.
    let mut geometries = String::new();
    for i in 0..20 {
        let next = format!("<GeometryReference Geometry='g{}'/>", i + 1);
        geometries += &format!("<Geometry Name='g{i}'>{}</Geometry>", next.repeat(9));
    }
    let kind = TYPE.replace("<Geometries>", &format!("<Geometries>{geometries}"));
    let kind = kind.replace("Geometry=\"Base\"", "Geometry=\"g0\"");
    let kind = archive(&[("description.xml", kind.as_bytes())]);
    let plan = archive(&[
        ("GeneralSceneDescription.xml", SCENE.as_bytes()),
        ("Maker@Profile.gdtf", &kind),
    ]);
    let carried = import("plan.mvr", &plan, "set", Work::silent()).unwrap();
    let told = |loss: &Loss| loss.what.contains("more than 100000 geometries");
    assert!(carried.losses.iter().any(told), "{:?}", carried.losses);
}

/// Cancels after a number of polls.
struct Patience(AtomicUsize);

impl Progress for Patience {
    fn cancelled(&self) -> bool {
        self.0.fetch_sub(1, Ordering::Relaxed) == 0
    }
}

#[test]
fn a_cancel_ends_it_wherever_it_is() {
    let plan = plan();
    let mut looks = 0;
    loop {
        let progress = Patience(AtomicUsize::new(looks));
        let work = Work {
            progress: &progress,
            ..Work::silent()
        };
        match import("plan.mvr", &plan, "set", work) {
            Err(ImportError::Cancelled(_)) => looks += 1,
            other => break assert!(other.is_ok(), "{other:?}"),
        }
    }
    // Polls for files unpacked, objects of the plan, fixtures, geometries of their types.
    assert!(looks > 30, "{looks}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Damaged archives are read or refused.
    #[test]
    fn damage_is_no_fault(at in 0.0..1.0_f64, byte in any::<u8>(), cut in 0.5..1.5_f64) {
        let mut bytes = plan();
        let at = (at * bytes.len() as f64) as usize;
        bytes[at] = byte;
        bytes.truncate((cut * bytes.len() as f64) as usize);
        let _ = import("plan.mvr", &bytes, "set", Work::silent());
    }

    /// Damaged descriptions are read or refused.
    #[test]
    fn damaged_xml_is_no_fault(at in 0..SCENE.len(), text in "[<>a-z0-9{},./\"=& -]{1,4}", kind in any::<bool>(), yoke in any::<bool>()) {
        let mut scene = SCENE.as_bytes().to_vec();
        let mut description = if yoke { heads::YOKE } else { TYPE }.as_bytes().to_vec();
        let target = if kind { &mut description } else { &mut scene };
        for (place, byte) in target.iter_mut().skip(at % TYPE.len()).zip(text.bytes()) {
            *place = byte;
        }
        let inner = archive(&[("description.xml", &description)]);
        let outer = archive(&[("GeneralSceneDescription.xml", &scene), ("Maker@Profile.gdtf", &inner)]);
        if let Ok(carried) = import("plan.mvr", &outer, "set", Work::silent()) {
            let parsed = lang::parse(&mut Sources::default(), "rig.lxq", &carried.text);
            prop_assert!(parsed.show.is_some(), "{}", carried.text);
        }
    }
}

/// A plan with these objects and other files.
fn plan_of(objects: &str, files: &[(&str, &[u8])]) -> Vec<u8> {
    let scene = format!(
        "<GeneralSceneDescription><Scene><Layers><Layer><ChildList>{objects}</ChildList></Layer>\
         </Layers></Scene></GeneralSceneDescription>"
    );
    let mut all: Vec<(&str, &[u8])> = vec![(super::SCENE, scene.as_bytes())];
    all.extend(files);
    archive(&all)
}

fn fixture(id: &str, rest: &str) -> String {
    format!(
        "<Fixture name=\"F\"><GDTFSpec>T</GDTFSpec><GDTFMode>Basic</GDTFMode>\
         <FixtureID>{id}</FixtureID>{rest}</Fixture>"
    )
}

#[test]
fn textures_and_buffers_of_a_set_come_out_of_the_archive() {
    let images = r#","images":[{"uri":"./maps/red%20cloth.png"},{"uri":"../up.png"},
        {"uri":"../../out.png"},{"uri":"data:image/png;base64,AA=="},{"bufferView":0}]"#;
    let gltf = set("CLOTH.bin", images);
    let object = r#"<SceneObject><Geometries><Geometry3D fileName="models/cloth.gltf"/>
        <Geometry3D fileName="gone.gltf"/><Geometry3D fileName="junk.glb"/>
        </Geometries></SceneObject>"#;
    let corners: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|c| c.to_le_bytes())
        .collect();
    let files: [(&str, &[u8]); 7] = [
        ("models/cloth.gltf", &gltf),
        ("models/maps/red cloth.png", b"red"),
        ("models/cloth.bin", &corners),
        ("up.png", b"up"),
        ("other.bin", b"not named"),
        ("gone.gltf", &set("gone.bin", "")),
        ("junk.glb", b"junk"),
    ];
    let plan = plan_of(object, &files);
    let carried = import("a.mvr", &plan, "set", Work::silent()).unwrap();
    let mut written: Vec<&str> = carried
        .files
        .iter()
        .map(|(path, _)| path.as_str())
        .collect();
    written.sort_unstable();
    assert_eq!(
        written,
        [
            "set/models/CLOTH.bin",
            "set/models/cloth.gltf",
            "set/models/maps/red cloth.png",
            "set/up.png"
        ]
    );
    assert_eq!(
        carried.text.matches("stage ").count(),
        1,
        "{}",
        carried.text
    );
    let losses: Vec<&str> = carried.losses.iter().map(|l| l.what.as_str()).collect();
    assert_eq!(losses.len(), 4, "{losses:?}");
    for (loss, word) in
        losses
            .iter()
            .zip(["`../../out.png`", "`gone.bin`", "`gone.gltf`", "`junk.glb`"])
    {
        assert!(loss.contains(word), "{losses:?}");
    }
}

#[test]
fn a_matrix_that_is_none_is_told() {
    let objects = fixture("1", "<Matrix>{nan,0,0}{0,1,0}{0,0,1}{0,0,6000}</Matrix>")
        + &fixture("2", "<Matrix>{1,0,0}{0,1,0}{0,0,1}</Matrix>")
        + &fixture("3", "<Matrix>{1,0,0}{0,1,0}{0,0,1}{0,0,6000}</Matrix>");
    let carried = import("a.mvr", &plan_of(&objects, &[]), "set", Work::silent()).unwrap();
    let told = |loss: &Loss| loss.what.starts_with("2 matrices are not of four");
    assert!(carried.losses.iter().any(told), "{:?}", carried.losses);
}

#[test]
fn every_fixture_has_a_channel_and_a_direction_that_the_language_takes() {
    let numeric = fixture("A12", "<FixtureIDNumeric>12</FixtureIDNumeric>");
    let objects = numeric
        + &fixture(
            "1000000",
            "<Matrix>{1,0,0}{0,1,0}{0,0,0}{0,0,3000}</Matrix>",
        )
        + &fixture(
            "999999",
            "<Matrix>{1,0,0}{0,1,0}{1e-320,0,0}{0,0,4000}</Matrix><Focus>P</Focus>",
        )
        + &fixture("", "")
        + r#"<FocusPoint uuid="p"><Matrix>{1,0,0}{0,1,0}{0,0,1}{0,0,4000.01}</Matrix></FocusPoint>"#;
    let carried = import("a.mvr", &plan_of(&objects, &[]), "set", Work::silent()).unwrap();
    let show = lang::parse(&mut Sources::default(), "rig.lxq", &carried.text);
    assert!(
        !show.diagnostics.iter().any(|d| d.code.starts_with('E')),
        "{:?}",
        show.diagnostics
    );
    let banks: Vec<&str> = carried
        .text
        .lines()
        .filter(|l| l.starts_with("bank"))
        .collect();
    insta::assert_snapshot!(banks.join("\n"), @r"
    bank ch1      = f_2  channel 1
    bank ch2      = f_4  channel 2
    bank ch12     = f    channel 12
    bank ch999999 = f_3  channel 999999
    ");
}

#[test]
fn what_makes_no_beam_is_no_light() {
    let kind = |beam: &str| {
        let text = TYPE.replace("BeamAngle=\"18\" FieldAngle=\"26\"", beam);
        archive(&[("description.xml", text.as_bytes())])
    };
    let carried = |beam: &str| {
        let kind = kind(beam);
        let plan = plan_of(&fixture("1", ""), &[("T.gdtf", &kind)]);
        import("a.mvr", &plan, "set", Work::silent())
    };
    let wide = carried("BeamAngle=\"360\" FieldAngle=\"360\"").unwrap();
    assert!(
        wide.assumed
            .join("; ")
            .contains("a field of 360 degrees becomes 170")
    );
    let plan = |kind: &[u8]| plan_of(&fixture("1", ""), &[("T.gdtf", kind)]);
    let said = refused(&plan(&kind("BeamType=\"None\"")), 1 << 30).unwrap();
    assert!(said.contains("makes no beam"), "{said}");
    assert!(said.contains("needs a fixture that gives light"), "{said}");
}

#[test]
fn a_plan_of_models_that_are_not_read_says_which() {
    let set = "<SceneObject><Geometries><Geometry3D fileName='a.3ds'/></Geometries></SceneObject>";
    let said = refused(&plan_of(set, &[]), 1 << 30).unwrap();
    assert!(said.contains("ends in .3ds: only glTF is read"), "{said}");
    assert!(said.contains("a set in glTF (.gltf, .glb)"), "{said}");
    let said = refused(&plan_of("", &[]), 1 << 30).unwrap();
    assert!(said.contains("neither fixtures nor a set"), "{said}");
}

#[test]
fn what_is_changed_or_left_out_of_a_fixture_is_told() {
    let beam = "BeamType=\"Foo\" BeamAngle=\"18\" FieldAngle=\"26\"";
    let kind = TYPE
        .replace("BeamAngle=\"18\" FieldAngle=\"26\"", beam)
        .replace("\"3200\"/>", "\"99999\"/><Beam BeamType=\"Glow\"/>");
    let kind = archive(&[("description.xml", kind.as_bytes())]);
    let objects = ["0", "1.513", "2.7"].map(|address| {
        let address = format!("<Addresses><Address>{address}</Address></Addresses>");
        fixture("1", &address)
    });
    let plan = plan_of(&objects.concat(), &[("T.gdtf", &kind)]);
    let carried = import("a.mvr", &plan, "set", Work::silent()).unwrap();
    let losses: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(losses.join("\n"), @r"
    line 1: `F`: `0` is no address of DMX
    line 1: `F` has a lamp that only glows: left out
    line 1: `F`: `1.513` is no address of DMX
    line 1: `F` has a lamp that only glows: left out
    line 1: `F` has a lamp that only glows: left out
    ");
    insta::assert_snapshot!(carried.assumed.join("\n"), @r"
    `T`: 99999 K becomes 25000 K (3 times)
    `T`: a spot for its beam of type `Foo` (3 times)
    fixtures without a focus point look as they hang (3 times)
    the plan's X is stage left and its Y upstage
    ");
    assert_eq!(carried.patch, "ch1 2/7 16bit\n");
}
