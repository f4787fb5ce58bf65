#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]

use std::io::Write as _;

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};
use proptest::prelude::*;

use super::zip::{Archive, ZipError};
use super::{addressed, import};
use crate::diagnostic::Sources;
use crate::lang;

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
        ("top.glb", b"a mesh"),
        ("leg.glb", b"another"),
    ])
}

#[test]
fn a_plan_becomes_a_rig() {
    let carried = import("plan.mvr", &plan(), "rig-set").unwrap();
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
        line 12: `Wash`: its own dimmer is to stand at full
        line 12: `Wash`: colours other than red, green and blue
        line 12: `Wash` can turn its head: it stays as it hangs
        line 14: the type `Nobody` of `Unknown`: its GDTF file is not in the archive
        line 17: 1 files of geometry end in .3ds: only glTF is read
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
    assert_eq!(addressed("0"), None);
}

#[test]
fn a_file_of_an_archive_is_checked() {
    let whole = archive(&[("a", &[7; 5000])]);
    let read = |bytes: &[u8]| Archive::new(bytes).and_then(|archive| archive.read("a"));
    assert_eq!(read(&whole).unwrap().unwrap(), [7; 5000]);
    assert_eq!(Archive::new(&whole).unwrap().read("b"), Ok(None));
    let mut damaged = whole.clone();
    damaged[34] ^= 1;
    assert_eq!(read(&damaged), Err(ZipError::File("a".to_owned())));
    assert_eq!(read(&whole[..30]), Err(ZipError::Damaged));
    let huge = archive(&[("a", &vec![0; (64 << 20) + 1])]);
    assert_eq!(read(&huge), Err(ZipError::TooLarge("a".to_owned())));
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
        let _ = import("plan.mvr", &bytes, "set");
    }

    /// So are damaged descriptions.
    #[test]
    fn damaged_xml_is_no_fault(at in 0..SCENE.len(), text in "[<>a-z0-9{},./\"=& -]{1,4}", kind in any::<bool>()) {
        let mut scene = SCENE.as_bytes().to_vec();
        let mut description = TYPE.as_bytes().to_vec();
        let target = if kind { &mut description } else { &mut scene };
        for (place, byte) in target.iter_mut().skip(at % TYPE.len()).zip(text.bytes()) {
            *place = byte;
        }
        let inner = archive(&[("description.xml", &description)]);
        let outer = archive(&[("GeneralSceneDescription.xml", &scene), ("Maker@Profile.gdtf", &inner)]);
        if let Ok(carried) = import("plan.mvr", &outer, "set") {
            let parsed = lang::parse(&mut Sources::default(), "rig.lxq", &carried.text);
            prop_assert!(parsed.show.is_some(), "{}", carried.text);
        }
    }
}
