#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use super::tests::{described, glb, square};
use crate::Material;
use crate::import::{Import, read};
use crate::stage_file::Options;
use footlight_host::files::Memory;
use footlight_picture::png;
use footlight_show::units::Rgb;

/// The square with a material, an image of roughness (0.2 and 0.6) and metalness (0 and 1), and a
/// white one.
fn import(material: &str, options: &Options) -> Import {
    let json = described(&format!(
        r#""materials":[{{"name":"wall",{material}}}],"nodes":[{{"mesh":0}}],
        "textures":[{{"source":0}},{{"source":1}},{{"source":2}}],
        "images":[{{"uri":"rough.png"}},{{"uri":"white.png"}},{{"uri":"gone.png"}}]"#
    ));
    let rough = png::encode(2, 1, &[9, 51, 0, 0, 153, 255]).unwrap();
    let files = Memory::default()
        .with("a.glb", glb(&json, &square()))
        .with("rough.png", rough)
        .with("white.png", png::encode(1, 1, &[255; 3]).unwrap());
    read(&files, "a.glb", options, usize::MAX).unwrap()
}

fn material(material: &str) -> Material {
    let import = import(material, &Options::default());
    import.scene.materials[0].clone()
}

/// A metallic-roughness material of colour 0.5, 0.25, 0.125.
fn pbr(factors: &str) -> String {
    format!(r#""pbrMetallicRoughness":{{"baseColorFactor":[0.5,0.25,0.125,1]{factors}}}"#)
}

fn close(found: [f64; 3], wanted: [f64; 3]) -> bool {
    let mut off = found.iter().zip(wanted).map(|(a, b)| (a - b).abs());
    off.all(|off| off < 1e-6)
}

/// Roughness, reflectance at normal incidence, metal or not, and diffuse reflectance.
type Finished = (f64, [f64; 3], bool, [f64; 3]);

#[test]
fn factors_become_gloss() {
    let base = [0.5, 0.25, 0.125];
    let smooth = |rest: &str| {
        pbr(&format!(
            r#","roughnessFactor":0.25,"metallicFactor":0{rest}"#
        ))
    };
    let extended =
        |name: &str, value: &str| format!(r#"{},"extensions":{{"{name}":{value}}}"#, smooth(""));
    let older = r#""extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.25,0.125,1],
        "specularFactor":[0.75,0.5,0.25],"glossinessFactor":0.75}}"#;
    let water = (0.33_f64 / 2.33).powi(2);
    let cases: [(String, Option<Finished>); 12] = [
        (smooth(""), Some((0.25, [0.04; 3], false, base))),
        // The limit in single precision.
        (
            pbr(r#","roughnessFactor":0.4000000059604645,"metallicFactor":0"#),
            Some((0.4, [0.04; 3], false, base)),
        ),
        (pbr(r#","roughnessFactor":0.41,"metallicFactor":0"#), None),
        (pbr(""), None),
        (
            pbr(r#","roughnessFactor":0.25"#),
            Some((0.25, base, true, [0.0; 3])),
        ),
        (
            pbr(r#","roughnessFactor":0,"metallicFactor":0.25"#),
            Some((
                0.0,
                [0.155, 0.0925, 0.06125],
                false,
                [0.375, 0.1875, 0.09375],
            )),
        ),
        (
            extended("KHR_materials_ior", r#"{"ior":1.33}"#),
            Some((0.25, [water; 3], false, base)),
        ),
        (
            extended(
                "KHR_materials_specular",
                r#"{"specularFactor":0.5,"specularColorFactor":[1,0.5,0]}"#,
            ),
            Some((0.25, [0.02, 0.01, 0.0], false, base)),
        ),
        (
            extended("KHR_materials_specular", r#"{"specularFactor":0}"#),
            None,
        ),
        (extended("KHR_materials_unlit", "{}"), None),
        (format!(r#"{},"emissiveFactor":[1,1,1]"#, smooth("")), None),
        (
            older.to_owned(),
            Some((0.25, [0.75, 0.5, 0.25], false, base)),
        ),
    ];
    for (described, wanted) in cases {
        let found = material(&described);
        let Some((roughness, normal, is_metal, matt)) = wanted else {
            assert_eq!(found.gloss, None, "{described}");
            assert!(close(found.reflectance.0, base), "{described}");
            continue;
        };
        let gloss = found.gloss.unwrap();
        assert!((gloss.roughness - roughness).abs() < 1e-6, "{described}");
        assert!(close(gloss.normal.0, normal), "{described}: {gloss:?}");
        assert_eq!(gloss.is_metal, is_metal, "{described}");
        assert!(close(found.reflectance.0, matt), "{described}");
    }
}

/// The mean roughness is 0.4 times the factor, the mean metalness a half.
#[test]
fn images_of_roughness_and_metalness_count_by_their_mean() {
    let with = |index: usize, factor: f64| {
        pbr(&format!(
            r#","baseColorTexture":{{"index":1}},"roughnessFactor":{factor},
            "metallicRoughnessTexture":{{"index":{index}}}"#
        ))
    };
    let found = material(&with(0, 0.5));
    let gloss = found.gloss.unwrap();
    assert!((gloss.roughness - 0.2).abs() < 1e-6, "{gloss:?}");
    assert!(close(gloss.normal.0, [0.27, 0.145, 0.0825]), "{gloss:?}");
    assert!(close(found.reflectance.0, [0.25, 0.125, 0.0625]));
    let mean = found.texture.unwrap().mean_reflectance();
    assert!(close(mean, found.reflectance.0), "{mean:?}");
    let unread = import(&with(2, 0.5), &Options::default());
    assert_eq!(unread.scene.materials[0].gloss, None);
    assert_eq!(
        unread.summary.left_out,
        ["the gloss of `wall`: `gone.png` does not exist; it is matt"]
    );
}

#[test]
fn numbers_out_of_range_refuse_no_stage() {
    let smooth = pbr(r#","roughnessFactor":0,"metallicFactor":0"#);
    for rest in [
        format!(r#"{smooth},"extensions":{{"KHR_materials_ior":{{"ior":-1}}}}"#),
        pbr(r#","roughnessFactor":1e39,"metallicFactor":0"#),
    ] {
        let found = import(&rest, &Options::default());
        assert_eq!(found.scene.materials[0].gloss, None);
        assert_eq!(
            found.summary.left_out,
            ["the gloss of `wall`: one of its numbers is out of range; it is matt"]
        );
    }
}

#[test]
fn a_file_that_is_to_be_matt_keeps_its_colours() {
    let brass = pbr(r#","roughnessFactor":0.25"#);
    let matt = Options {
        matt: true,
        ..Options::default()
    };
    let mut scene = import(&brass, &matt).scene;
    assert!(scene.glosses().next().is_none());
    assert_eq!(scene.materials[0].reflectance, Rgb([0.5, 0.25, 0.125]));
    // A show's reflectance sets the gloss of a metal.
    scene = import(&brass, &Options::default()).scene;
    assert!(scene.glosses().next().is_some());
    assert!(scene.set_reflectance("wall", Rgb([0.75; 3])));
    let metal = &scene.materials[0];
    assert_eq!(metal.reflectance, Rgb([0.0; 3]));
    assert_eq!(metal.gloss.as_ref().unwrap().normal, Rgb([0.75; 3]));
}
