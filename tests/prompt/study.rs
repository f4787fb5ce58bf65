//! Predicted seconds of the steps of quality, and a renderer that ignores them.

use std::path::{Path, PathBuf};

use crate::operator::Altered;
use crate::{Ticking, prompt};
use footlight_engine::{Ended, Goal, Host, Refinement, Way};
use footlight_host::files::{Folder, MemoryStore, Store};
use footlight_prompt::Repl;
use footlight_transport::Quality;
use std::sync::Arc;

/// The furnace, small, with a separate store.
fn furnace(store: &MemoryStore) -> Repl {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/reference/furnace");
    let text = std::fs::read_to_string(folder.join("furnace.lxq")).unwrap();
    let host = Host {
        files: Box::new(Folder::new(&folder, 1 << 20)),
        store: Box::new(store.clone()),
        clock: Box::new(Ticking::by(0.25)),
        ..Host::default()
    };
    let text = text.replace("size 128x128", "size 32x32");
    prompt("furnace.lxq", text.as_bytes(), host).unwrap()
}

#[test]
fn the_price_of_a_step_rises_with_it() {
    let store = MemoryStore::default();
    let mut show = furnace(&store);
    let text = show.execute("quality --json").unwrap().text;
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(found["operator"], "radiosity");
    let steps = found["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 3);
    let total = |step: &serde_json::Value| {
        let of = |part: &str| step["predicted"][part].as_f64().unwrap();
        of("prepare") + of("banks")
    };
    for pair in steps.windows(2) {
        assert!(total(&pair[0]) > 0.0 && total(&pair[0]) <= total(&pair[1]));
    }
    let words = show.execute("quality").unwrap().text;
    assert!(words.contains("all banks s"), "{words}");
}

/// A random show with images of a size, and another host.
fn random_of(size: [usize; 2], store: &MemoryStore, host: Host) -> Repl {
    let made = crate::random_show::random_show(7, size);
    let path = Path::new("set/random.lxq");
    store.write(path, made.show.as_bytes()).unwrap();
    let host = Host {
        files: Box::new(made.files()),
        store: Box::new(store.clone()),
        ..host
    };
    crate::open(path, host)
}

/// A show with a renderer that ignores quality.
fn stubborn() -> Repl {
    let host = Host {
        renderer: Arc::new(Altered {
            finest: Some(Quality(4)),
            quality: Some(Quality(1)),
            ..Altered::default()
        }),
        ..Host::default()
    };
    random_of([16, 9], &MemoryStore::default(), host)
}

#[test]
fn a_renderer_that_ignores_quality_leaves_no_error_and_nothing_to_refine() {
    for way in [Way::Paper, Way::Auto] {
        let mut show = stubborn();
        let wanted = Refinement::from(Goal::until(0.01)).by(way);
        let ended = show.engine_mut().refine(wanted).unwrap().ended;
        assert_eq!(ended, Some(Ended::Complete), "{way:?}");
        assert_eq!(show.engine().estimate().refined(), 0);
        assert_eq!(show.engine().estimate().predicted_error().unwrap(), 0.0);
        let pool = show.engine().estimate().pool().unwrap();
        assert!(pool.has_no_estimated_error(), "{way:?}");
    }
}
