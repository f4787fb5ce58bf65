#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

mod materials;

use crate::import::{Import, read};
use crate::stage_file::{Options, SceneError};
use crate::{LampShape, Polygon};
use footlight_host::files::{FileError, Memory};
use footlight_picture::png;
use footlight_show::geometry::{Vec3, newell, vec3};
use footlight_show::units::Rgb;

/// Builds a GLB from a JSON text and a binary chunk.
pub fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], by: u8| {
        let mut out = bytes.to_vec();
        out.resize(bytes.len().next_multiple_of(4), by);
        out
    };
    let mut body = Vec::new();
    for (kind, data) in [
        (b"JSON", padded(json.as_bytes(), b' ')),
        (b"BIN\0", padded(binary, 0)),
    ] {
        body.extend((data.len() as u32).to_le_bytes());
        body.extend(kind);
        body.extend(data);
    }
    let length = body.len() as u32 + 12;
    [
        b"glTF".as_slice(),
        &2_u32.to_le_bytes(),
        &length.to_le_bytes(),
        &body,
    ]
    .concat()
}

pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A unit square in the file's XY plane, facing +Z: 48 bytes of positions, 12 of indices.
pub fn square() -> Vec<u8> {
    let corners = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    [floats(&corners), shorts(&[0, 1, 2, 0, 2, 3])].concat()
}

/// JSON that describes [`square`] as mesh 0; `rest` adds to the root object.
pub fn described(rest: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},
        "buffers":[{{"byteLength":60}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":12}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
          {{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}}],
        "meshes":[{{"name":"Square","primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],
        {rest}}}"#
    )
}

const WALL: &str = r#""materials":[{"name":"wall","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1]}}]"#;

fn import(json: &str, binary: &[u8]) -> Result<Import, SceneError> {
    let files = Memory::default().with("a.glb", glb(json, binary));
    read(&files, "a.glb", &Options::default(), usize::MAX)
}

/// Imports the square with these nodes.
fn with_nodes(nodes: &str) -> Result<Import, SceneError> {
    import(&described(&format!("{WALL},{nodes}")), &square())
}

fn refused(result: Result<Import, SceneError>) -> (String, String) {
    match result.unwrap_err() {
        SceneError::Part { place, reason, .. } => (place, reason),
        other => unreachable!("{other}"),
    }
}

fn normal(polygon: &Polygon) -> Vec3 {
    newell(&polygon.vertices) * 0.5
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1e-6
}

#[test]
fn a_square_comes_out_as_one_quad_turned_up() {
    let stage = with_nodes(r#""nodes":[{"mesh":0,"translation":[0,2,0]}]"#).unwrap();
    let scene = &stage.scene;
    assert_eq!(scene.polygons.len(), 1);
    let corners = &scene.polygons[0].vertices;
    assert_eq!(corners.len(), 4);
    // The file's +Y is up; its +Z faces the house, which is -Y here.
    assert!(close(normal(&scene.polygons[0]), vec3(0.0, -1.0, 0.0)));
    assert!(
        corners
            .iter()
            .all(|v| (2.0..=3.0).contains(&v.z) && v.y == 0.0)
    );
    assert_eq!(scene.materials[0].name, "wall");
    assert_eq!(scene.materials[0].reflectance, Rgb([0.5, 0.25, 0.125]));
    assert_eq!(
        (
            stage.summary.faces,
            stage.summary.merged,
            stage.summary.merged_to
        ),
        (2, 2, 1)
    );
}

/// Embedded, external and data-URI buffers give the same scene.
#[test]
fn buffers_come_from_anywhere() {
    let json = |uri: &str| {
        let nodes = described(&format!("{WALL},\"nodes\":[{{\"mesh\":0}}]"));
        nodes.replace(
            r#"{"byteLength":60}"#,
            &format!(r#"{{"byteLength":60,"uri":"{uri}"}}"#),
        )
    };
    let inside = with_nodes(r#""nodes":[{"mesh":0}]"#).unwrap();
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let base64: String = square()
        .chunks(3)
        .flat_map(|c| {
            let bits = c.iter().fold(0_usize, |b, byte| b << 8 | *byte as usize);
            [18, 12, 6, 0].map(|s| alphabet[bits >> s & 63] as char)
        })
        .collect();
    let files = Memory::default()
        .with("set/a.gltf", json("parts/the%20square.bin"))
        .with("set/parts/the square.bin", square())
        .with(
            "b.gltf",
            json(&format!("data:application/octet-stream;base64,{base64}")),
        )
        .with("c.gltf", json("../square.bin"))
        .with("d.gltf", json("https://example.org/square.bin"))
        .with("e.gltf", json("data:text/plain,hello"))
        .with("f.gltf", json("none.bin"));
    let read = |path| read(&files, path, &Options::default(), usize::MAX);
    assert_eq!(read("set/a.gltf").unwrap(), inside);
    assert_eq!(read("b.gltf").unwrap(), inside);
    assert!(matches!(
        read("c.gltf"),
        Err(SceneError::File(FileError::Outside(_)))
    ));
    for strange in ["d.gltf", "e.gltf"] {
        assert!(refused(read(strange)).1.contains("is neither a file"));
    }
    assert!(matches!(
        read("f.gltf"),
        Err(SceneError::File(FileError::Missing(_)))
    ));
}

#[test]
fn mirrors_keep_fronts_in_front() {
    // A mirror through X: the square lies at -1..0, and still faces the file's +Z.
    for nodes in [
        r#""nodes":[{"mesh":0,"scale":[-1,1,1]}]"#,
        r#""nodes":[{"children":[1],"scale":[-2,1,1]},{"mesh":0,"scale":[0.5,1,1]}],"scenes":[{"nodes":[0]}]"#,
        r#""nodes":[{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}]"#,
    ] {
        let stage = with_nodes(nodes).unwrap();
        assert!(
            close(normal(&stage.scene.polygons[0]), vec3(0.0, -1.0, 0.0)),
            "{nodes}"
        );
        assert!(stage.scene.polygons[0].vertices.iter().all(|v| v.x <= 0.0));
    }
    // A half turn about Y shows the back; two mirrors make a rotation.
    for nodes in [
        r#""nodes":[{"mesh":0,"rotation":[0,1,0,0]}]"#,
        r#""nodes":[{"mesh":0,"scale":[-1,1,-1]}]"#,
    ] {
        let stage = with_nodes(nodes).unwrap();
        assert!(
            close(normal(&stage.scene.polygons[0]), vec3(0.0, 1.0, 0.0)),
            "{nodes}"
        );
    }
}

#[test]
fn instances_stand_where_their_parents_put_them() {
    let stage = with_nodes(
        r#""scene":1,"scenes":[{"nodes":[3]},{"nodes":[0]}],
        "nodes":[{"children":[1,2],"translation":[10,0,0]},
          {"mesh":0,"translation":[0,0,5]},
          {"mesh":0,"rotation":[0.70710678,0,0,0.70710678],"scale":[2,3,1]},{"mesh":0}]"#,
    )
    .unwrap();
    let polygons = &stage.scene.polygons;
    assert_eq!(polygons.len(), 2);
    assert!(
        polygons[0]
            .vertices
            .iter()
            .any(|v| close(*v, vec3(11.0, -5.0, 1.0)))
    );
    // A quarter about X takes Y to Z and Z to -Y: a floor seen from below, 2 by 3.
    assert!(close(normal(&polygons[1]), vec3(0.0, 0.0, -6.0)));
    assert!(
        polygons[1]
            .vertices
            .iter()
            .any(|v| close(*v, vec3(12.0, -3.0, 0.0)))
    );
}

/// Strips and fans, with and without indices, give the same square; points and lines give no
/// surface.
#[test]
fn every_mode_is_read_or_said_to_be_left_out() {
    let strip = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.]);
    let json = |mode: u32, count: usize| {
        let (a, b, c) = (48, r#","indices":1"#, format!(r#""count":{count},"#));
        described(&format!("{WALL},\"nodes\":[{{\"mesh\":0}}]"))
            .replace(r#""byteLength":60"#, &format!(r#""byteLength":{a}"#))
            .replace(b, &format!(r#","mode":{mode}"#))
            .replace(r#""count":4,"#, &c)
    };
    let unit = vec3(0.0, -1.0, 0.0);
    let found = import(&json(5, 4), &strip).unwrap();
    assert!(close(normal(&found.scene.polygons[0]), unit));
    let found = import(&json(6, 4), &square()[..48]).unwrap();
    assert!(close(normal(&found.scene.polygons[0]), unit));
    // Remaining corners are ignored.
    let found = import(&json(4, 4), &square()[..48]).unwrap();
    assert!(close(normal(&found.scene.polygons[0]), unit * 0.5));
    for mode in [0, 1, 2, 3] {
        assert!(matches!(
            import(&json(mode, 4), &strip),
            Err(SceneError::Empty { .. })
        ));
    }
    assert_eq!(
        refused(import(&json(7, 4), &strip)).1,
        "it has no known mode"
    );
}

#[test]
fn sparse_accessors_change_what_is_under_them() {
    // Corner 2 moves from (1, 1, 0) to (3, 3, 0): a kite of area 3; then the same without a base.
    let sparse = r#""sparse":{"count":1,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":3}}"#;
    let changed = described(&format!("{WALL},\"nodes\":[{{\"mesh\":0}}]"))
        .replace(r#""byteLength":60"#, r#""byteLength":76"#)
        .replace(
            r#""byteLength":12}]"#,
            r#""byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":1},{"buffer":0,"byteOffset":64,"byteLength":12}]"#,
        )
        .replace(r#""type":"VEC3""#, &format!(r#""type":"VEC3",{sparse}"#));
    let binary = |at: u8| [square(), vec![at, 0, 0, 0], floats(&[3., 3., 0.])].concat();
    let stage = import(&changed, &binary(2)).unwrap();
    assert!(close(
        normal(&stage.scene.polygons[0]),
        vec3(0.0, -3.0, 0.0)
    ));
    assert_eq!(
        refused(import(&changed, &binary(4))).1,
        "element 4 does not exist; there are 4"
    );
    let nothing = changed.replace(
        r#""bufferView":0,"componentType":5126,"#,
        r#""componentType":5126,"#,
    );
    assert!(matches!(
        import(&nothing, &binary(2)),
        Err(SceneError::Empty { .. })
    ));
}

#[test]
fn integers_and_strides_are_read() {
    // Normalised bytes: 255 is one; four bytes per vertex, of which three count.
    let corners = [0_u8, 0, 0, 9, 255, 0, 0, 9, 255, 255, 0, 9, 0, 255, 0];
    let mut binary = corners.to_vec();
    binary.resize(48, 0);
    binary.extend(shorts(&[0, 1, 2, 0, 2, 3]));
    let json = described(&format!("{WALL},\"nodes\":[{{\"mesh\":0}}]"))
        .replace(r#""byteLength":48}"#, r#""byteLength":15,"byteStride":4}"#)
        .replace("5126", r#"5121,"normalized":true"#);
    let stage = import(&json, &binary).unwrap();
    assert!(close(
        normal(&stage.scene.polygons[0]),
        vec3(0.0, -1.0, 0.0)
    ));
    let narrow = json.replace("\"byteStride\":4", "\"byteStride\":2");
    assert!(
        refused(import(&narrow, &binary))
            .1
            .starts_with("it has no stride")
    );
}

#[test]
fn lights_come_along() {
    let rest = format!(
        r#"{WALL},"extensions":{{"KHR_lights_punctual":{{"lights":[
          {{"type":"spot","name":"L","intensity":1000,"color":[1,0.5,0.25],"spot":{{"innerConeAngle":0,"outerConeAngle":0.78539816}}}},
          {{"type":"point","name":"bulb","intensity":40}},{{"type":"directional","intensity":3}}]}}}},
        "nodes":[{{"mesh":0}},
          {{"name":"Key","translation":[1,4,2],"rotation":[-0.70710678,0,0,0.70710678],"scale":[2,2,2],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
          {{"extensions":{{"KHR_lights_punctual":{{"light":1}}}}}},{{"extensions":{{"KHR_lights_punctual":{{"light":2}}}}}}]"#
    );
    let lamps = import(&described(&rest), &square()).unwrap().lamps;
    let [key, bulb, sun] = lamps.as_slice() else {
        unreachable!("{lamps:?}")
    };
    assert_eq!(
        (key.name.as_str(), bulb.name.as_str(), sun.name.as_str()),
        ("Key", "bulb", "light.2")
    );
    assert!(close(key.position, vec3(1.0, -2.0, 4.0)));
    assert!(close(key.direction, vec3(0.0, 0.0, -1.0)));
    assert_eq!((key.colour, key.peak), (Rgb([1.0, 0.5, 0.25]), 1000.0));
    assert_eq!(
        (bulb.shape, sun.shape),
        (LampShape::Point, LampShape::Distant)
    );
    let LampShape::Spot { beam, field } = key.shape else {
        unreachable!()
    };
    // glTF's falloff, evaluated at our two angles.
    let share = |full: f64| {
        let (cosine, edge) = (
            (full / 2.0).to_radians().cos(),
            f64::from(std::f32::consts::FRAC_PI_4).cos(),
        );
        ((cosine - edge) / (1.0 - edge)).powi(2)
    };
    assert!((share(beam) - 0.5).abs() < 1e-9 && (share(field) - 0.1).abs() < 1e-9);
}

/// A unit square with normals and texture coordinates, from a Draco encoder at speed 3.
const DRACO: [u8; 188] = [
    68, 82, 65, 67, 79, 2, 2, 1, 1, 0, 0, 0, 4, 2, 2, 2, 0, 0, 1, 31, 255, 1, 17, 255, 1, 17, 255,
    1, 17, 3, 255, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 9, 3, 0, 0, 0, 1, 1, 9, 3, 0, 1, 0, 1, 3, 9, 2, 0,
    2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    128, 63, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 128, 63, 0, 0, 0, 0,
    0, 0, 128, 63, 0, 0, 128, 63, 0, 0, 0, 0,
];

#[test]
fn draco_gives_the_same_square_and_damage_an_error() {
    let json = r#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"],
        "buffers":[{"byteLength":188}],"bufferViews":[{"buffer":0,"byteLength":188}],
        "accessors":[{"componentType":5126,"count":4,"type":"VEC3"},
          {"componentType":5125,"count":6,"type":"SCALAR"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"extensions":
          {"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0,"NORMAL":1}}}}]}],
        "nodes":[{"mesh":0}]}"#;
    let stage = import(json, &DRACO).unwrap();
    let [whole] = stage.scene.polygons.as_slice() else {
        unreachable!()
    };
    assert_eq!(whole.vertices.len(), 4);
    assert!(close(normal(whole), vec3(0.0, -1.0, 0.0)) && whole.shading.is_none());
    for at in 0..DRACO.len() {
        let mut damaged = DRACO;
        damaged[at] ^= 0x85;
        let _ = import(json, &damaged);
    }
    let cut = [&DRACO[..100], &[0; 88]].concat();
    assert!(
        import(json, &cut[..]).is_ok() || refused(import(json, &cut)).1.starts_with("not glTF")
    );
}

/// Instances of a mesh are placed by their attributes.
#[test]
fn instances_of_a_node_are_placed() {
    let places = floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 7.0, 0.0]);
    let binary = [square(), places].concat();
    let json = described(&format!(
        r#"{WALL},"nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":
            {{"attributes":{{"TRANSLATION":2}}}}}}}}]"#
    ));
    let json = json
        .replace(r#"{"byteLength":60}"#, r#"{"byteLength":96}"#)
        .replace(
            r#""byteLength":12}]"#,
            r#""byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":36}]"#,
        )
        .replace(
            r#""type":"SCALAR"}]"#,
            r#""type":"SCALAR"},{"bufferView":2,"componentType":5126,"count":3,"type":"VEC3"}]"#,
        );
    let stage = import(&json, &binary).unwrap();
    assert_eq!(stage.scene.polygons.len(), 3);
    let far = |axis: usize, at: f64| {
        let mut all = stage.scene.polygons.iter().flat_map(|p| p.vertices.iter());
        all.any(|v| (v[axis] - at).abs() < 1e-6)
    };
    assert!(far(0, 6.0) && far(2, 8.0));
}

/// Views whose compressed bytes are in another buffer, which is not read.
#[test]
fn fallbacks_of_compressed_views_are_read() {
    let compressed = r#","extensions":{"EXT_meshopt_compression":{"buffer":1,"byteLength":9,
        "byteStride":12,"count":4,"mode":"ATTRIBUTES"}}}"#;
    let json = described(&format!(r#"{WALL},"nodes":[{{"mesh":0}}]"#))
        .replace(
            r#"[{"byteLength":60}]"#,
            r#"[{"byteLength":60},{"byteLength":9}]"#,
        )
        .replace(
            r#""byteLength":48}"#,
            &format!(r#""byteLength":48{compressed}"#),
        );
    assert!(json.contains("meshopt") && json.contains("60},"));
    assert_eq!(import(&json, &square()).unwrap().scene.polygons.len(), 1);
}

#[test]
fn what_is_not_read_is_no_reason_to_refuse() {
    let nodes = r#""nodes":[{"mesh":0}],"scenes":[{"nodes":[0]},{"name":"empty"}],"scene":0"#;
    for more in [
        r#""animations":[{"samplers":[{"input":0,"output":0}],"channels":[{"sampler":0,"target":{"path":"pointer"}}]}]"#,
        r#""animations":7,"skins":"none""#,
        r#""extras":"text""#,
        r#""extras":[null,{"a":1}]"#,
    ] {
        let read = with_nodes(&format!("{nodes},{more}")).unwrap();
        assert_eq!(read.scene.polygons.len(), 1, "{more}");
    }
    for extras in ["7", "null", "true", "[1]", "\"a\"", r#"{"a":{"b":[]}}"#] {
        let with_extras = described(&format!("{WALL},{nodes}"))
            .replace(r#""mesh":0"#, &format!(r#""mesh":0,"extras":{extras}"#))
            .replace(
                r#""material":0"#,
                &format!(r#""material":0,"extras":{extras}"#),
            )
            .replace(
                r#""name":"wall""#,
                &format!(r#""name":"wall","extras":{extras}"#),
            )
            .replace(
                r#""version":"2.0""#,
                &format!(r#""version":"2.0","extras":{extras}"#),
            );
        assert_eq!(
            import(&with_extras, &square())
                .unwrap()
                .scene
                .polygons
                .len(),
            1,
            "{extras}"
        );
    }
    let rounded = described(&format!("{WALL},{nodes}"))
        .replace("[0.5,0.25,0.125,1]", "[1.0000001,0.5,0.5,1]");
    let wall = &import(&rounded, &square()).unwrap().scene.materials[0];
    assert_eq!(wall.reflectance, Rgb([1.0, 0.5, 0.5]));
}

/// The square is imported without them.
#[test]
fn bad_cameras_lights_and_normals_are_left_out_and_named() {
    let nodes = |what: &str| {
        format!(
            r#""extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot"}},
            {{"type":"spot","spot":{{"innerConeAngle":2,"outerConeAngle":1}}}},
            {{"type":"spot","spot":{{"innerConeAngle":1,"outerConeAngle":1}}}}]}}}},
            "cameras":[{{"type":"perspective","perspective":{{"yfov":0,"znear":1}}}}],
            "nodes":[{{"mesh":0,{what}}}]"#
        )
    };
    let light = |i: usize| format!(r#""extensions":{{"KHR_lights_punctual":{{"light":{i}}}}}"#);
    for (what, said) in [
        (r#""camera":0"#, "camera 0: vertical angle in degrees 0"),
        (
            r#""camera":1"#,
            "node 0: camera 1 does not exist; there are 1",
        ),
        (&light(0), "light 0: it has no spot"),
        (&light(1), "light 1: inner cone angle 2"),
        (&light(3), "node 0: light 3 does not exist"),
    ] {
        let stage = with_nodes(&nodes(what)).unwrap();
        assert_eq!(stage.scene.polygons.len(), 1, "{what}");
        let left_out = stage.summary.left_out.join("; ");
        assert!(left_out.starts_with(said), "{what}: {left_out}");
        assert!(stage.lamps.is_empty() && stage.cameras.is_empty());
    }
    // A spot without a soft edge.
    assert_eq!(with_nodes(&nodes(&light(2))).unwrap().lamps.len(), 1);
    let normals = described(&format!("{WALL},\"nodes\":[{{\"mesh\":0}}]"))
        .replace(r#""POSITION":0"#, r#""POSITION":0,"NORMAL":9"#);
    let stage = import(&normals, &square()).unwrap();
    assert_eq!(stage.scene.polygons.len(), 1);
    assert_eq!(
        stage.summary.left_out,
        ["normals: accessor 9 does not exist"]
    );
}

#[test]
fn hidden_nodes_are_left_out_and_named() {
    let hidden = r#""extensions":{"KHR_node_visibility":{"visible":false}}"#;
    let nodes = format!(
        r#""extensionsRequired":["KHR_node_visibility"],"nodes":[{{"mesh":0}},{{"name":"spare","children":[2],{hidden}}},{{"mesh":0}}],"scenes":[{{"nodes":[0,1]}}]"#
    );
    let read = with_nodes(&nodes).unwrap();
    assert_eq!(read.scene.polygons.len(), 1);
    let said = read.summary.left_out.join("; ");
    assert!(said.contains("\"spare\": it is hidden"), "{said}");
}
