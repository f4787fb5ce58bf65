//! Materials: names, emission, textures, backs.

use super::*;

#[test]
fn materials_have_names_and_light() {
    let materials = r#""materials":[{"name":"wood"},{},{"name":"wood","emissiveFactor":[1,0.5,0],
        "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":200}}},
        {"name":"cloth","pbrMetallicRoughness":{"baseColorFactor":[0.4,0.4,0.4,1],"baseColorTexture":{"index":0}}},
        {"name":"material.1"}],"nodes":[{"mesh":0}]"#;
    let stage = import(&described(materials), &square()).unwrap();
    let names: Vec<_> = stage
        .scene
        .materials
        .iter()
        .map(|m| m.name.as_str())
        .collect();
    assert_eq!(
        names,
        [
            "wood",
            "material.1.2",
            "wood.2",
            "cloth",
            "material.1",
            "default"
        ]
    );
    assert_eq!(stage.scene.materials[2].emission, Rgb([200.0, 100.0, 0.0]));
    let cloth = stage.scene.materials[3].reflectance.0[0];
    assert!((cloth - 0.2).abs() < 1e-6, "{cloth}");
    assert!(
        stage.summary.left_out[0].contains("`cloth`"),
        "{:?}",
        stage.summary
    );
    let bad = materials.replace("[0.4,0.4,0.4,1]", "[0.4,1.4,0.4,1]");
    let unused = import(&described(&bad), &square()).unwrap();
    assert_eq!(unused.scene.polygons, stage.scene.polygons);
    let used = described(&bad).replace(r#""material":0"#, r#""material":3"#);
    let (place, reason) = refused(import(&used, &square()));
    assert_eq!(place, "material 3 \"cloth\"");
    assert!(reason.starts_with("base colour "), "{reason}");
}

/// An emissive image is not read and is reported, unless a black factor turns it off.
#[test]
fn emission_textures_are_told() {
    let materials = r#""materials":[{"name":"sign","emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}},
        {"name":"off","emissiveTexture":{"index":0}}],"nodes":[{"mesh":0}]"#;
    let stage = import(&described(materials), &square()).unwrap();
    assert_eq!(
        stage.summary.left_out,
        ["the emission texture of `sign`: as a `panel` it shines evenly, by its factor"]
    );
}

/// A double-sided square gets a back of equal size a hair behind it, unless the show turns that
/// off.
#[test]
fn double_sided_materials_get_a_back() {
    let json = described(&format!("{WALL},\"nodes\":[{{\"mesh\":0}}]"))
        .replace(r#""name":"wall""#, r#""name":"wall","doubleSided":true"#);
    let files = Memory::default().with("a.glb", glb(&json, &square()));
    let both = read(&files, "a.glb", &Options::default(), usize::MAX).unwrap();
    assert_eq!((both.summary.backs, both.scene.polygons.len()), (1, 2));
    let [front, back] = both.scene.polygons.as_slice() else {
        unreachable!()
    };
    assert!(close(normal(front) + normal(back), Vec3::ZERO));
    let behind = (front.vertices[0] - back.vertices[0]).dot(normal(front));
    assert!(behind > 1e-5 && behind < 1e-4, "{behind}");
    let one_sided = Options {
        one_sided: true,
        ..Options::default()
    };
    let front_only = read(&files, "a.glb", &one_sided, usize::MAX).unwrap();
    assert_eq!(
        (front_only.summary.backs, front_only.scene.polygons.len()),
        (0, 1)
    );
}

#[test]
fn a_webp_texture_is_read_where_there_is_no_other() {
    let rest = r#""materials":[{"name":"leaf",
            "pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
        "extensionsRequired":["EXT_texture_webp"],
        "textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],
        "images":[{"uri":"leaf.webp"}],"nodes":[{"mesh":0}]"#;
    let texture = |image: &[u8]| {
        let files = Memory::default()
            .with("a.glb", glb(&described(rest), &square()))
            .with("leaf.webp", image);
        let import = read(&files, "a.glb", &Options::default(), usize::MAX).unwrap();
        let said: Vec<String> = import.summary.left_out.into_iter().collect();
        (import.scene.materials[0].texture.is_some(), said.join("; "))
    };
    assert_eq!(
        texture(include_bytes!("../../../../tests/kit/two.webp")),
        (true, String::new())
    );
    let (is_read, said) = texture(b"\xabKTX 20");
    assert!(
        !is_read && said.contains("neither PNG nor JPEG nor WebP"),
        "{said}"
    );
}

/// Where alpha does not count, a transparent texel has its colour, even when another material uses
/// the image as a cut-out.
#[test]
fn alpha_is_nothing_to_what_is_opaque() {
    let material = |name: &str, mode: &str| {
        format!(
            r#"{{"name":"{name}","alphaMode":"{mode}","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}"#
        )
    };
    let (cut, whole) = (material("cut", "MASK"), material("whole", "OPAQUE"));
    for materials in [format!("{cut},{whole}"), format!("{whole},{cut}")] {
        let rest = format!(
            r#""materials":[{materials}],"textures":[{{"source":0}}],
            "images":[{{"uri":"leaf.png"}}],"nodes":[{{"mesh":0}}]"#
        );
        // White and opaque, and red and transparent.
        let mut leaf = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut leaf, 2, 1);
        encoder.set_color(::png::ColorType::Rgba);
        let mut writer = encoder.write_header().unwrap();
        writer
            .write_image_data(&[255, 255, 255, 255, 255, 0, 0, 0])
            .unwrap();
        writer.finish().unwrap();
        let files = Memory::default()
            .with("a.glb", glb(&described(&rest), &square()))
            .with("leaf.png", leaf);
        let import = read(&files, "a.glb", &Options::default(), usize::MAX).unwrap();
        let mean = |name: &str| {
            let found = import.scene.materials.iter().find(|m| m.name == name);
            found.unwrap().reflectance.0.map(|c| (c * 100.0).round())
        };
        assert_eq!(mean("cut"), [100.0; 3]);
        assert_eq!(mean("whole"), [100.0, 50.0, 50.0]);
    }
}

/// A cut-out square gets a back too, whatever the file says about its sides.
#[test]
fn what_is_cut_out_gets_a_back() {
    let backs = |mode: &str| {
        let rest = format!(
            r#""materials":[{{"name":"leaf","alphaMode":"{mode}",
                "pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "textures":[{{"source":0}}],"images":[{{"uri":"leaf.png"}}],"nodes":[{{"mesh":0}}]"#
        );
        let leaf = png::encode(2, 2, &[200; 12]).unwrap();
        let files = Memory::default()
            .with("a.glb", glb(&described(&rest), &square()))
            .with("leaf.png", leaf);
        let import = read(&files, "a.glb", &Options::default(), usize::MAX).unwrap();
        assert!(import.scene.materials[0].texture.is_some());
        import.summary.backs
    };
    assert_eq!(["OPAQUE", "MASK", "BLEND"].map(backs), [0, 1, 1]);
}

/// A beam in the haze is not a surface; when the file has nothing else, the message says so.
#[test]
fn volumes_of_light_are_left_out() {
    let of = |nodes: &str| {
        let json = described(&format!("{WALL},\"nodes\":[{nodes}]"));
        import(&json, &square())
    };
    let volume = r#"{"mesh":0,"name":"Spot Light_Volume.001"}"#;
    let both = of(&format!(r#"{volume},{{"mesh":0}}"#)).unwrap();
    assert_eq!(both.scene.polygons.len(), 1);
    let told = "`Spot Light_Volume.001`, a volume of light by its name: it is no wall";
    assert_eq!(both.summary.left_out, [told]);
    let alone = of(volume).unwrap_err().to_string();
    assert!(
        alone.ends_with(&format!("has no polygons; left out: {told}")),
        "{alone}"
    );
}
