//! A show on disk: its files are protected, and read again after external edits.

use footlight_engine::Host;
use footlight_host::files::{Disk, Folder, MemoryStore};
use footlight_prompt::{Repl, Verb};
use std::path::PathBuf;
use tempfile::TempDir;

const FILES: [&str; 3] = ["first.lxq", "first.obj", "first.mtl"];

/// The smallest show, in a fresh folder.
fn first() -> (TempDir, Repl) {
    let folder = tempfile::tempdir().unwrap();
    let examples = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    for name in FILES {
        std::fs::copy(examples.join(name), folder.path().join(name)).unwrap();
    }
    let show = folder.path().join("first.lxq");
    let text = std::fs::read_to_string(&show).unwrap();
    std::fs::write(&show, text.replace("size 480x270", "size 48x27")).unwrap();
    let host = Host {
        files: Box::new(Folder::new(folder.path(), 1 << 20)),
        store: Box::new(Disk),
        ..Host::default()
    };
    (folder, crate::open(&show, host))
}

/// Results never overwrite the show's files, however they are named.
#[test]
fn the_shows_own_files_are_spared() {
    let (folder, mut show) = first();
    std::fs::create_dir(folder.path().join("aside")).unwrap();
    for name in FILES.into_iter().chain(["aside/../first.mtl"]) {
        let path = folder.path().join(name);
        let before = std::fs::read(&path).unwrap();
        let words = ["tracksheet".as_ref(), "-o".as_ref(), path.as_os_str()];
        let refused = show
            .call(&Verb::of(words).unwrap())
            .unwrap_err()
            .to_string();
        assert!(refused.contains("belongs to the show"), "{refused}");
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }
}

#[test]
fn blind_edits_are_not_saved_by_the_way() {
    let (folder, mut show) = first();
    let path = folder.path().join("first.lxq");
    let before = std::fs::read(&path).unwrap();
    show.execute("blind").unwrap();
    show.execute("cue 9 { lamp 5 }").unwrap();
    let refused = show.execute("save").unwrap_err().to_string();
    assert!(refused.contains("blind"), "{refused}");
    assert_eq!(std::fs::read(&path).unwrap(), before);
    show.execute("record").unwrap();
    show.execute("save").unwrap();
    assert!(std::fs::read_to_string(&path).unwrap().contains("cue 9"));
}

#[test]
fn a_move_says_what_it_lets_go() {
    let (_folder, mut show) = first();
    show.execute("set lamp 33").unwrap();
    let notes = show.execute("go").unwrap().notes;
    assert!(
        notes.iter().any(|n| n.contains("let go of lamp 33")),
        "{notes:?}"
    );
    show.execute("set lamp 33").unwrap();
    let notes = show.execute("record 7").unwrap().notes;
    assert!(!notes.iter().any(|n| n.contains("let go")), "{notes:?}");
}

/// After a wall was painted in the modelling program, the next edit shows it; a missing stage is
/// reported.
#[test]
fn a_stage_edited_elsewhere_is_read_again() {
    let (folder, mut show) = first();
    let pixel = |show: &mut Repl| {
        let image = show
            .engine_mut()
            .render(&[1.0, 1.0], footlight_transport::Quality(1));
        image.unwrap().data().to_vec()
    };
    let before = pixel(&mut show);
    let paint = folder.path().join("first.mtl");
    let materials = std::fs::read_to_string(&paint).unwrap();
    std::fs::write(
        &paint,
        materials.replace("Kd 0.62 0.60 0.56", "Kd 0.3 0.3 0.5"),
    )
    .unwrap();
    assert_eq!(pixel(&mut show), before);
    let notes = show.execute("stage \"first.obj\"").unwrap().notes;
    assert!(notes.iter().any(|n| n.contains("read again")), "{notes:?}");
    let after = pixel(&mut show);
    assert_ne!(after, before);
    // Without further changes nothing is reported, and the image is equal.
    let notes = show.execute("stage \"first.obj\"").unwrap().notes;
    assert!(!notes.iter().any(|n| n.contains("read again")), "{notes:?}");
    std::fs::remove_file(folder.path().join("first.obj")).unwrap();
    assert!(show.execute("stage \"first.obj\"").is_err());
    assert_eq!(pixel(&mut show), after);
}

/// A part of the show is played between times, or as a cue from its GO to its completion.
#[test]
fn a_part_of_a_show_is_played() {
    let text = include_str!("../../examples/first.lxq").replace("size 480x270", "size 16x9");
    let (files, store) = (
        footlight_host::files::Memory::default(),
        MemoryStore::default(),
    );
    let host = Host {
        files: Box::new(
            files
                .with("first.obj", include_str!("../../examples/first.obj"))
                .with("first.mtl", include_str!("../../examples/first.mtl")),
        ),
        store: Box::new(store),
        ..Host::default()
    };
    let mut show = crate::prompt("first.lxq", text.as_bytes(), host).unwrap();
    let mut say = |line: &str| match show.execute(line) {
        Ok(reply) => reply.text.to_string(),
        Err(error) => error.to_string(),
    };
    let told = say("frames --from 0:01 --to 0:02 -o a###.png");
    assert!(told.starts_with("26 frames"), "{told}");
    let told = say("film --from 0:01 --to 0:01 -o b.y4m");
    assert!(told.starts_with("1 frame "), "{told}");
    let cue = say("frames --cue 3 -o c###.png");
    assert!(cue.contains("frames of 16x9"), "{cue}");
    for (line, said) in [
        ("film --from 0:02 --to 0:01 -o d.y4m", "nothing is between"),
        (
            "film --cue 3 --to 0:01 -o d.y4m",
            "`--cue N` does not go with `--to TIME`",
        ),
        ("film --cue 77 -o d.y4m", "there is no cue `77`"),
        ("play --from 0:01 -o d.html", "does not go with"),
        ("film --to visualiser -o d.y4m", "is not a time"),
    ] {
        let told = say(line);
        assert!(told.contains(said), "{line}: {told}");
    }
}
