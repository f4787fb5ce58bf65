//! Faults of single files: whatever happens to the bytes, an image found equals the one stored.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]

use super::*;
use crate::pool::address::Lights;
use footlight_host::files::MemoryStore;
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::{Emitter, Light, Rig, Scene, Source};

const SIZE: (usize, usize) = (5, 3);

fn lights() -> Lights {
    Lights::new(&Rig {
        lights: vec![Light::Spot(Spot {
            position: vec3(0.0, 0.0, 4.0),
            aim: Vec3::ZERO,
            beam: 20.0,
            field: 40.0,
            intensity: Rgb([900.0, 0.1, 300.0]),
        })],
        sources: vec![Source {
            name: "l\u{e4}mp".to_owned(),
            emitters: vec![Emitter {
                light: 0,
                filter: Rgb::WHITE,
            }],
        }],
    })
}

fn place(order: usize) -> PlaceInPool {
    let setting = vec![0.1, -1e-300, 2.0 / 3.0];
    PlaceInPool { order, setting }
}

fn view() -> View {
    View {
        from: vec3(0.0, -9.0, 1.7),
        to: Vec3::ZERO,
        fov: 40.0,
        roll: 0.0,
        width: SIZE.0,
        height: SIZE.1,
    }
}

fn address(setting: f64) -> Address {
    let scene_key = SceneKey::new("g 1", &Scene::default(), &view());
    lights().address(scene_key, Quality(2), &[setting])
}

fn image(seed: f32) -> Image {
    let numbers = (0..SIZE.0 * SIZE.1 * 3).map(|i| (i as f32 - 7.0) * seed);
    Image::from_data(SIZE.0, SIZE.1, numbers.collect()).unwrap()
}

#[test]
fn what_is_stored_is_found_bit_for_bit() {
    let (store, address) = (MemoryStore::default(), address(0.3));
    let mut disk_cache = DiskCache::new("p", 1 << 20);
    assert_eq!(disk_cache.find(&store, address.name(), SIZE), None);
    disk_cache.keep(
        &store,
        &address,
        ("l\u{e4}mp 0.3", Some(&place(3))),
        &image(0.1),
    );
    let (lighting, found) = disk_cache.find(&store, address.name(), SIZE).unwrap();
    assert_eq!((&lighting, &found), (&address.lighting, &image(0.1)));
    let listed = disk_cache.addresses(&store, address.scene_key, address.quality);
    assert_eq!(listed, std::slice::from_ref(&address));
    let refined = disk_cache.refined(&store, address.scene_key, Quality(2));
    assert_eq!(refined, [(place(3), address.clone())]);
    assert_eq!(
        disk_cache.refined(&store, address.scene_key, Quality(3)),
        []
    );
    assert_eq!(disk_cache.notes(), []);
}

#[test]
fn pictures_of_another_version_of_the_operator_are_left_alone() {
    let (store, old) = (MemoryStore::default(), address(0.3));
    let mut disk_cache = DiskCache::new("p", 1 << 20);
    disk_cache.keep(&store, &old, ("lamp", Some(&place(0))), &image(0.1));
    disk_cache.keep(
        &store,
        &address(0.4),
        ("lamp", Some(&place(1))),
        &image(0.2),
    );
    let new = Address {
        scene_key: SceneKey::new("g 2", &Scene::default(), &view()),
        ..address(0.3)
    };
    assert_eq!(disk_cache.find(&store, new.name(), SIZE), None);
    assert_eq!(disk_cache.refined(&store, new.scene_key, Quality(1)), []);
    disk_cache.keep(&store, &new, ("lamp", Some(&place(0))), &image(0.5));
    assert_eq!(
        disk_cache.find(&store, new.name(), SIZE).unwrap().1,
        image(0.5)
    );
    assert_eq!(
        disk_cache.find(&store, old.name(), SIZE).unwrap().1,
        image(0.1)
    );
}

#[test]
fn no_flipped_bit_no_truncation_and_no_other_file_is_taken_for_the_picture() {
    let (store, address) = (MemoryStore::default(), address(0.3));
    let mut disk_cache = DiskCache::new("p", 1 << 20);
    disk_cache.keep(&store, &address, ("lamp", None), &image(0.1));
    let path = disk_cache.path(address.name());
    let whole = store.read(&path, 1 << 20).unwrap();
    let mut refused = 0;
    let mut harmless = Vec::new();
    for at in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        store.write(&path, &flipped).unwrap();
        match disk_cache.find(&store, address.name(), SIZE) {
            None => refused += 1,
            Some((lighting, found)) => {
                assert_eq!((&lighting, &found), (&address.lighting, &image(0.1)));
                harmless.push(at);
            }
        }
    }
    // The remaining bytes have no meaning here: spare bits of offsets, pixel aspect, the window's
    // centre.
    assert!(refused > harmless.len(), "{refused} {}", harmless.len());
    for end in 0..whole.len() {
        store.write(&path, &whole[..end]).unwrap();
        assert_eq!(disk_cache.find(&store, address.name(), SIZE), None, "{end}");
    }
    let other = self::address(0.4);
    disk_cache.keep(&store, &other, ("lamp", None), &image(0.2));
    let foreign = disk_cache.path(other.name());
    let foreign = store.read(&foreign, 1 << 20).unwrap();
    store.write(&path, &foreign).unwrap();
    assert_eq!(disk_cache.find(&store, address.name(), SIZE), None);
    let notes = disk_cache.notes();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert_eq!(disk_cache.notes(), [], "told once");
}

#[test]
fn somebody_elses_folder_is_not_hidden_and_his_files_stay() {
    let (store, address) = (MemoryStore::default(), address(1.0));
    store.write(Path::new("p/thesis.txt"), b"mine").unwrap();
    store
        .write(Path::new("p/pictures/holiday.exr"), b"mine")
        .unwrap();
    let mut disk_cache = DiskCache::new("p", 1 << 20);
    disk_cache.keep(&store, &address, ("lamp", None), &image(0.1));
    assert!(store.read(Path::new("p/.gitignore"), 9).is_err());
    assert_eq!(disk_cache.free(&store, |_| true).unwrap().0, 1);
    let left: Vec<PathBuf> = store.paths();
    let his = ["p/pictures/holiday.exr", "p/thesis.txt"].map(PathBuf::from);
    assert_eq!(left, his);
}

#[test]
fn parts_that_killed_processes_left_are_swept() {
    let folder = tempfile::tempdir().unwrap();
    let (store, address) = (footlight_host::files::Disk, address(1.0));
    let mut disk_cache = DiskCache::new(folder.path(), 1 << 20);
    disk_cache.keep(&store, &address, ("lamp", None), &image(0.1));
    let path = disk_cache.path(address.name());
    let part = path.with_extension("exr.4194305-0123456789abcdef.part");
    store.write(&part, b"half").unwrap();
    disk_cache.free(&store, |_| false).unwrap();
    assert!(path.exists() && !part.exists());
}

#[test]
fn the_first_damage_is_told_and_how_many_more() {
    let damaged = |pictures| {
        let note = Note::Damaged {
            path: "p/1.exr".into(),
            reason: "cut off".to_owned(),
            pictures,
        };
        note.to_string()
    };
    assert!(damaged(1).ends_with("rendered again: p/1.exr: cut off"));
    assert!(damaged(3).ends_with("cut off (2 more like it)"));
}
