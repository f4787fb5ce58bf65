//! Fixtures with moving heads.

use super::*;
use crate::patch::{Patch, values};
use footlight_show::timeline::Timeline;

/// A spot with a yoke: pan and zoom fall as their values rise.
pub const YOKE: &str = r#"<GDTF DataVersion="1.2"><FixtureType Name="Head"><Geometries>
<Geometry Name="Base"><Axis Name="Yoke" Position="{1,0,0,0}{0,1,0,0}{0,0,1,-0.2}{0,0,0,1}">
<Axis Name="Head" Position="{1,0,0,0}{0,1,0,0}{0,0,1,-0.3}{0,0,0,1}">
<Beam Name="Lens" Position="{1,0,0,0}{0,1,0,0}{0,0,1,-0.15}{0,0,0,1}" BeamAngle="12" FieldAngle="18"
LuminousFlux="20000" ColorTemperature="6500"/></Axis></Axis></Geometry></Geometries><DMXModes>
<DMXMode Name="16" Geometry="Base"><DMXChannels>
<DMXChannel Offset="1,2" Geometry="Yoke"><LogicalChannel Attribute="Pan">
<ChannelFunction Attribute="Pan" PhysicalFrom="270" PhysicalTo="-270"/></LogicalChannel></DMXChannel>
<DMXChannel Offset="3,4" Geometry="Head"><LogicalChannel Attribute="Tilt">
<ChannelFunction Attribute="Tilt" PhysicalFrom="-130" PhysicalTo="130"/></LogicalChannel></DMXChannel>
<DMXChannel Offset="5" Geometry="Lens"><LogicalChannel Attribute="Zoom">
<ChannelFunction Attribute="Zoom" PhysicalFrom="48" PhysicalTo="6"/></LogicalChannel></DMXChannel>
<DMXChannel Offset="6,7" Geometry="Lens"><LogicalChannel Attribute="Dimmer"/></DMXChannel>
</DMXChannels></DMXMode></DMXModes></FixtureType></GDTF>"#;

fn yoke(id: u32, matrix: &str, rest: &str) -> String {
    format!(
        "<Fixture name=\"MH {id}\"><Matrix>{matrix}</Matrix><GDTFSpec>T</GDTFSpec><GDTFMode>16</GDTFMode>\
         <FixtureID>{id}</FixtureID><Addresses><Address break=\"0\">1.{}</Address></Addresses>{rest}\
         </Fixture>",
        20 * id + 1
    )
}

#[test]
fn a_moving_head_moves() {
    let objects = yoke(1, "{1,0,0}{0,1,0}{0,0,1}{-2000,0,6000}", "<Focus>P</Focus>")
        + &yoke(2, "{1,0,0}{0,1,0}{0,0,1}{2000,0,6000}", "")
        + &yoke(
            3,
            "{0,1,0}{-1,0,0}{0,0,1}{0,0,6000}",
            "<CustomCommands><CustomCommand>Yoke_Pan.Pan.Pan 1,f 90.0</CustomCommand>\
             <CustomCommand>Head_Tilt.Tilt.Tilt 1,f 45.0</CustomCommand></CustomCommands>",
        )
        + &yoke(4, "{1,0,0}{0,-1,0}{0,0,-1}{0,2000,0}", "")
        + &yoke(5, "{1,0,0}{0,0,1}{0,-1,0}{0,0,6000}", "")
        + r#"<FocusPoint uuid="p"><Matrix>{1,0,0}{0,1,0}{0,0,1}{0,3000,1500}</Matrix></FocusPoint>"#;
    let kind = archive(&[("description.xml", YOKE.as_bytes())]);
    let plan = plan_of(&objects, &[("T.gdtf", &kind)]);
    let carried = import("a.mvr", &plan, "set", Work::silent()).unwrap();
    insta::assert_snapshot!(carried.text, @r#"
        // The rig of a.mvr.

        light mh_1  spot       at -2, 0, 5.5  aim 0, 3, 1.5  beam 12  field 18  20000 lm  6500 K  moves  pan -270 to 270  tilt -130 to 130  zoom 4 to 48
        light mh_2  like mh_1  at 2, 0, 5.5   aim 2, 0, 0
        light mh_3  spot       at 0, 0, 5.5   aim 0, -5.5, 0  beam 12  field 18  20000 lm  6500 K  moves  pan -180 to 360  tilt -130 to 130  zoom 4 to 48
        light mh_4  spot       at 0, 2, 0.5   aim 0, 2, 5.5   beam 12  field 18  20000 lm  6500 K  moves  pan -90 to 450   tilt -130 to 130  zoom 4 to 48  standing
        light mh_5  spot       at 0, 0.65, 6  aim 0, 5.65, 6  beam 12  field 18  20000 lm  6500 K

        bank ch1 = mh_1  channel 1
        bank ch2 = mh_2  channel 2
        bank ch3 = mh_3  channel 3
        bank ch4 = mh_4  channel 4
        bank ch5 = mh_5  channel 5
        "#);
    insta::assert_snapshot!(carried.patch, @r#"
        ch1 1/26 16bit
        ch2 1/46 16bit
        ch3 1/66 16bit
        ch4 1/86 16bit
        ch5 1/106 16bit
        mh_1 pan 1/21 270 to -270 tilt 1/23 field 1/25 8bit 48 to 6
        mh_2 pan 1/41 270 to -270 tilt 1/43 field 1/45 8bit 48 to 6
        mh_3 pan 1/61 360 to -180 tilt 1/63 field 1/65 8bit 48 to 6
        mh_4 pan 1/81 450 to -90 tilt 1/83 field 1/85 8bit 48 to 6
        "#);
    let losses: Vec<String> = carried.losses.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(losses.join("\n"), @"line 1: `MH 5` stays as it hangs: its base is not level");
    insta::assert_snapshot!(carried.assumed.join("\n"), @r#"
        fixtures without a focus point look as they hang (4 times)
        the plan's X is stage left and its Y upstage
        "#);
    let show = lang::parse(&mut Sources::default(), "rig.lxq", &carried.text)
        .show
        .unwrap();
    // MH 3 looks along its pan of 90 and tilt of 45: to the house.
    let home = show.heads()[2].1.home;
    let to = show.heads()[2].1.direction(home.pan, home.tilt);
    assert!(
        (to.y + 0.5_f64.sqrt()).abs() < 1e-4 && to.x.abs() < 1e-4,
        "{to:?}"
    );
}

/// Compares the direction of the fixture for the values sent, by GDTF's rules, with that of the
/// show's head.
#[test]
fn what_is_sent_turns_the_fixture_as_the_show_turns_its_head() {
    let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
    for [u, v, w] in [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
        [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
        [[cosine, sine, 0.0], [sine, -cosine, 0.0], [0.0, 0.0, -1.0]],
    ] {
        let row = |[x, y, z]: [f64; 3]| format!("{{{x},{y},{z}}}");
        let matrix = format!("{}{}{}{{0,0,3000}}", row(u), row(v), row(w));
        let kind = archive(&[("description.xml", YOKE.as_bytes())]);
        let plan = plan_of(&yoke(1, &matrix, ""), &[("T.gdtf", &kind)]);
        let carried = import("a.mvr", &plan, "set", Work::silent()).unwrap();
        for (pan, tilt, field) in [(0, 0, 20), (10, 60, 30), (-70, -100, 8), (170, 30, 47)] {
            let cue =
                format!("cue 1 {{ snap  mh_1 pan {pan} tilt {tilt} beam 5 field {field} }}\n");
            let parsed = lang::parse(
                &mut Sources::default(),
                "a.lxq",
                &(carried.text.clone() + &cue),
            );
            let show = parsed
                .show
                .unwrap_or_else(|| panic!("{:?}", parsed.diagnostics));
            let patch = Patch::parse(&show, &carried.patch).unwrap();
            let timeline = Timeline::new(&show).unwrap();
            let mut frames = patch.dark();
            patch.fill(&values(&show, &timeline, timeline.end()), &mut frames);
            let sent = &frames[&1][20..];
            let part =
                |at: usize| f64::from(u16::from_be_bytes([sent[at], sent[at + 1]])) / 65535.0;
            let degrees = [270.0 - 540.0 * part(0), -130.0 + 260.0 * part(2)];
            let [(sp, cp), (st, ct)] = degrees.map(|angle| angle.to_radians().sin_cos());
            // Down, turned about X by the tilt, then about Z by the pan.
            let inner = [-sp * st, cp * st, -ct];
            let along = |i: usize| inner[0] * u[i] + inner[1] * v[i] + inner[2] * w[i];
            let head = show.heads()[0].1;
            let to = head.direction(f64::from(pan), f64::from(tilt));
            let off = (to.x - along(0)).abs() + (to.y - along(1)).abs() + (to.z - along(2)).abs();
            assert!(off < 3e-4, "{matrix} {pan} {tilt}: {off}");
            let zoom = 48.0 - 42.0 * f64::from(sent[4]) / 255.0;
            assert!((zoom - f64::from(field)).abs() < 0.1, "{zoom} {field}");
        }
    }
}
