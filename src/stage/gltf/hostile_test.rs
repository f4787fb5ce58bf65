//! Hostile files: every claim that a glTF file can get wrong, and random damage.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use proptest::prelude::*;

use super::tests::{described, floats, glb, square};
use super::*;
use crate::import::{Import, read};
use crate::stage_file::{Options, POLYGON_LIMIT};
use footlight_host::files::Memory;

const NODE: &str = r#""nodes":[{"mesh":0}],"materials":[{"name":"wall"}]"#;

fn import_bytes(bytes: Vec<u8>) -> Result<Import, SceneError> {
    read(
        &Memory::default().with("a.glb", bytes),
        "a.glb",
        &Options::default(),
        usize::MAX,
    )
}

fn import(json: &str) -> Result<Import, SceneError> {
    import_bytes(glb(json, &square()))
}

/// Place and reason as a message.
fn said(result: Result<Import, SceneError>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn every_index_is_looked_up() {
    let good = described(NODE);
    assert_eq!(import(&good).unwrap().scene.polygons.len(), 1);
    for (from, to, wanted) in [
        (
            r#""POSITION":0"#,
            r#""POSITION":9"#,
            "accessor 9 does not exist; there are 2",
        ),
        (
            r#""indices":1"#,
            r#""indices":7"#,
            "accessor 7 does not exist",
        ),
        (
            r#""material":0"#,
            r#""material":3"#,
            "mesh 0 \"Square\" primitive 0: material 3",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":4}]"#,
            "node 0: mesh 4 does not exist; there are 1",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"children":[5]}],"scene":0,"scenes":[{"nodes":[0]}]"#,
            "node 0: node 5",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":0}],"scene":1"#,
            "scene 1 does not exist",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":0}],"scenes":[{"nodes":[8]}]"#,
            "node 8",
        ),
        (
            r#"{"bufferView":0"#,
            r#"{"bufferView":6"#,
            "accessor 0: bufferView 6",
        ),
        (
            r#"[{"buffer":0"#,
            r#"[{"buffer":2"#,
            "bufferView 0: buffer 2",
        ),
    ] {
        let found = said(import(&good.replacen(from, to, 1)));
        assert!(found.contains(wanted), "{to}: {found}");
    }
}

#[test]
fn claims_are_held_against_the_bytes() {
    let good = described(NODE);
    for (from, to, wanted) in [
        (
            r#""byteOffset":48"#,
            r#""byteOffset":18446744073709551615"#,
            "accessor 1: 12 bytes are needed and 0",
        ),
        (
            r#""count":4,"#,
            r#""count":5,"#,
            "accessor 0: 60 bytes are needed and 48",
        ),
        (
            r#""count":4,"#,
            r#""count":4000000000000,"#,
            "more than 8000000 vertices",
        ),
        (
            r#""count":6"#,
            r#""count":18446744073709551615"#,
            "more than 6000000 corners",
        ),
        (
            r#""bufferView":0,"#,
            r#""bufferView":0,"byteOffset":18446744073709551615,"#,
            "accessor 0",
        ),
        (r#""bufferView":0,"#, "", "has no polygons"),
        (
            r#""type":"VEC3""#,
            r#""type":"VEC2""#,
            "positions of three numbers",
        ),
        (r#""type":"VEC3""#, r#""type":"VEC9""#, "no known type"),
        ("5123", "5126", "unsigned whole numbers"),
        ("5126", "99", "no known component type"),
        (
            r#""2.0""#,
            r#""1.0""#,
            "glTF version `1.0`; this program reads 2",
        ),
        (r#""version":"2.0""#, r#""copyright":"me""#, "not glTF"),
        (
            r#""asset""#,
            r#""extensionsRequired":["EXT_meshopt_compression"],"asset""#,
            "the extension `EXT_meshopt_compression`",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":0,"rotation":[0,0,0,0]}]"#,
            "no length",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":0,"translation":[1e30,0,0]}]"#,
            "beyond 1e9",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":0,"scale":[1e300,0,0]}]"#,
            "node 0: a coordinate",
        ),
        (
            r#"[{"mesh":0}]"#,
            r#"[{"mesh":0,"matrix":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}]"#,
            "not affine",
        ),
        ("}]}", "}]", "line"),
    ] {
        let found = said(import(&good.replacen(from, to, 1)));
        assert!(found.contains(wanted), "{to}: {found}");
    }
    // Bytes that no accessor needs may be missing.
    for (from, to) in [
        (r#""byteLength":60"#, r#""byteLength":61"#),
        (r#""byteLength":48"#, r#""byteLength":480"#),
    ] {
        let stage = import(&good.replacen(from, to, 1)).unwrap();
        assert_eq!(stage.scene.polygons.len(), 1, "{to}");
    }
    // A vertex that does not exist, and one that is not a number.
    let mut binary = square();
    binary[48] = 4;
    let found = said(import_bytes(glb(&good, &binary)));
    assert!(
        found.contains("primitive 0: vertex 4 does not exist; there are 4"),
        "{found}"
    );
    let mut binary = square();
    binary[..4].copy_from_slice(&floats(&[f32::NAN]));
    assert!(said(import_bytes(glb(&good, &binary))).contains("accessor 0: a coordinate"));
}

#[test]
fn containers_are_held_against_their_lengths() {
    let good = glb(&described(NODE), &square());
    assert!(import_bytes(good.clone()).is_ok());
    for end in 0..good.len() {
        assert!(import_bytes(good[..end].to_vec()).is_err(), "{end}");
    }
    // Stated lengths from zero to beyond the end; a chunk longer than the file.
    for length in [0_u32, 3, 11, 12, 19, 20, u32::MAX] {
        let mut bytes = good.clone();
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        assert!(import_bytes(bytes).is_err(), "{length}");
    }
    let mut bytes = good.clone();
    bytes[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(said(import_bytes(bytes)).contains("chunk 0"));
    let mut bytes = good;
    bytes[4] = 3;
    assert!(said(import_bytes(bytes)).contains("version `3`"));
}

/// Cycles and shared branches of nodes, with which twenty nodes could ask for a million; and a
/// chain as deep as a file can hold.
#[test]
fn nodes_are_met_once() {
    for nodes in [
        r#"[{"children":[0]}]"#,
        r#"[{"children":[1]},{"children":[0]}]"#,
        r#"[{"children":[1,2]},{"children":[3]},{"children":[3]},{"mesh":0}]"#,
        r#"[{"children":[1,1]},{"mesh":0}]"#,
    ] {
        let json = described(&format!(
            r#""scenes":[{{"nodes":[0]}}],"nodes":{nodes},"materials":[{{}}]"#
        ));
        assert!(said(import(&json)).contains("two parents"), "{nodes}");
    }
    let chain: Vec<_> = (1..50_000)
        .map(|i| format!(r#"{{"children":[{i}]}}"#))
        .collect();
    let json = described(&format!(
        r#""nodes":[{},{{"mesh":0}}],"materials":[{{}}]"#,
        chain.join(",")
    ));
    assert_eq!(import(&json).unwrap().scene.polygons.len(), 1);
}

/// Small files that ask for much are refused before memory is allocated.
#[test]
fn limits_hold() {
    let many = |n: usize, what: &str| vec![what; n].join(",");
    let nodes = |n| {
        format!(
            r#""materials":[{{}}],"nodes":[{}]"#,
            many(n, r#"{"mesh":0}"#)
        )
    };
    // Empty primitives in as many instances: nothing to draw, but still too much work.
    let primitive = r#"{"attributes":{"POSITION":0},"indices":1}"#;
    let empty = described(&nodes(5000))
        .replace(r#""count":6"#, r#""count":0"#)
        .replace(
            r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#,
            &many(5000, primitive),
        );
    assert!(said(import(&empty)).contains("more than 2000000 triangles"));
    // Instances apart from each other, so that they do not merge.
    let instances: Vec<_> = (0..=POLYGON_LIMIT / 40)
        .map(|i| format!(r#"{{"mesh":0,"translation":[{},0,0]}}"#, 2 * i))
        .collect();
    let json = described(&format!(
        r#""materials":[{{}}],"nodes":[{}]"#,
        instances.join(",")
    ));
    let twenty = many(
        20,
        r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#,
    );
    let json = json.replace(
        r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#,
        &twenty,
    );
    assert!(said(import(&json)).contains("more than 2000000 triangles"));
    let objects = described(&nodes(250_000));
    assert!(said(import(&objects)).contains("more than 200000 objects"));
    let values = described(&format!(r#""x":[{}],{NODE}"#, many(4_000_001, "1")));
    assert!(said(import(&values)).contains("more than 4000000 values"));
    let nested = format!(
        r#""min":{}{},"count":4,"#,
        "[".repeat(100_000),
        "]".repeat(100_000)
    );
    let deep = described(NODE).replacen(r#""count":4,"#, &nested, 1);
    assert!(said(import(&deep)).contains("recursion"));
    // Millions of vertices without bytes, many times.
    let accessor = r#"{"componentType":5126,"count":1000000,"type":"VEC3"}"#;
    let primitives: Vec<_> = (2..50)
        .map(|i| format!(r#"{{"attributes":{{"POSITION":{i}}}}}"#))
        .collect();
    let json = described(NODE)
        .replace(
            r#""type":"SCALAR"}"#,
            &format!(r#""type":"SCALAR"}},{}"#, many(48, accessor)),
        )
        .replace(
            r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#,
            &primitives.join(","),
        );
    assert!(said(import(&json)).contains("more than"));
}

fn holds(import: &Import) -> Result<(), TestCaseError> {
    prop_assert!(!import.scene.polygons.is_empty());
    prop_assert!(import.scene.polygons.len() <= POLYGON_LIMIT);
    for polygon in &import.scene.polygons {
        prop_assert!(polygon.material < import.scene.materials.len());
        prop_assert!(polygon.vertices.len() >= 3);
        prop_assert!(polygon.vertices.iter().all(|v| v.is_finite()));
    }
    Ok(())
}

/// A file with one of each feature.
fn rich() -> String {
    described(
        r#""materials":[{"name":"wall","doubleSided":true}],"cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}}],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","intensity":9,"spot":{"outerConeAngle":0.5}}]}},
        "nodes":[{"children":[1,2],"scale":[-1,1,1]},{"mesh":0,"rotation":[0,0,0.6,0.8]},
        {"camera":0,"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}],"scenes":[{"nodes":[0]}]"#,
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// A damaged GLB gives a valid scene or an error.
    #[test]
    fn damaged_binaries_do_not_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = glb(&rich(), &square());
        for (at, to) in flips {
            let at = at.index(bytes.len());
            bytes[at] = to;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(import) = import_bytes(bytes) {
            holds(&import)?;
        }
    }

    /// Changed numbers in the JSON, which damage to bytes seldom leaves well-formed.
    #[test]
    fn changed_numbers_do_not_panic(
        at in any::<prop::sample::Index>(),
        to in prop_oneof![
            Just("-1"), Just("0"), Just("1"), Just("2"), Just("3"), Just("5"), Just("59"), Just("1e9"),
            Just("4294967295"), Just("4294967296"), Just("18446744073709551615"), Just("1e38"),
            Just("1e400"), Just("0.5"), Just("null"), Just("\"x\""), Just("[]"), Just("{}"),
        ],
    ) {
        let json = rich();
        let digits = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
        let mut numbers: Vec<(usize, usize)> = Vec::new();
        for (i, _) in json.match_indices(digits) {
            match numbers.last_mut() {
                Some((_, end)) if *end == i => *end = i + 1,
                _ => numbers.push((i, i + 1)),
            }
        }
        let (start, end) = numbers[at.index(numbers.len())];
        let json = format!("{}{to}{}", &json[..start], &json[end..]);
        if let Ok(import) = import(&json) {
            holds(&import)?;
        }
    }
}
