//! Gloss of a stage's file combined with a show's statements.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::Document;
use footlight_host::files::Memory;

/// Roughness of the boards and of the brass, and the brass's reflectance in its gloss.
fn glosses(stage: &str) -> (Option<f64>, Option<f64>, Option<f64>) {
    let files = Memory::default()
        .with(
            "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nusemtl boards\nf 1 2 3\nusemtl brass\nf 3 2 1",
        )
        .with(
            "a.mtl",
            "newmtl boards\nKd 0.2 0.2 0.2\nKs 0.5 0.5 0.5\nNs 640\n\
             newmtl brass\nKd 0.75 0.5 0.25\nKa 1 1 1\nKs 1 1 1\nNs 640\nillum 3\n",
        );
    let text = format!("stage \"a.obj\" {stage}\nview v from 0, -4, 2 to 0, 0, 0 fov 40\n");
    let document = Document::new("a.lxq", text.as_bytes(), &files).unwrap();
    let materials = &document.setup().unwrap().scene.materials;
    let gloss = |i: usize| materials[i].gloss.as_ref();
    (
        gloss(0).map(|g| g.roughness),
        gloss(1).map(|g| g.roughness),
        gloss(1).map(|g| g.normal.0[0]),
    )
}

#[test]
fn a_show_changes_the_gloss_of_a_file() {
    let own = glosses("");
    let near = |found: Option<f64>| found.is_some_and(|r| (r - 0.2).abs() < 1e-9);
    assert!(near(own.0) && near(own.1), "{own:?}");
    assert_eq!(own.2, Some(0.75));
    assert_eq!(glosses("matt"), (None, None, None));
    assert_eq!(
        glosses("matt\nsurface boards gloss 0.3"),
        (Some(0.3), None, None)
    );
    // Varnish is removed; a metal would be black without its gloss.
    let rough = glosses("\nsurface boards gloss 1\nsurface brass gloss 1");
    assert_eq!(rough, (None, Some(1.0), Some(0.75)));
    let polished = glosses("\nsurface brass gloss 0.1 reflectance 0.5");
    assert_eq!((polished.1, polished.2), (Some(0.1), Some(0.5)));
}
