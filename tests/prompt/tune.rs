//! `tune` as typed: what it says of its choice, and why it has none.

use std::sync::Arc;

use crate::operator::Altered;
use crate::prompt;
use footlight::engine::Host;
use footlight::files::Memory;
use footlight::renderer::Quality;
use footlight::repl::Repl;
use footlight::study::random_show;

/// A random show, small, with other means.
fn random(host: Host) -> Repl {
    let made = random_show(1);
    let files = Memory::default()
        .with("room.obj", made.stage)
        .with("room.mtl", made.materials);
    let host = Host {
        files: Box::new(files),
        threads: 2,
        ..host
    };
    let text = made.show.replace("size 96x54", "size 48x27");
    prompt("random.lxq", text.as_bytes(), host).unwrap()
}

fn refused(show: &mut Repl, line: &str) -> String {
    let error = show.execute(line).unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    error.to_string()
}

#[test]
fn what_is_out_of_reach_says_what_to_ask_for() {
    let mut show = random(Host::default());
    let said = refused(&mut show, "tune --until 0.0001%");
    assert!(said.contains("out of reach"), "{said}");
    let (_, asked) = said.rsplit_once("ask for ").unwrap();
    let text = show.execute(&format!("tune {asked}")).unwrap().text;
    assert!(text.contains("<- chosen"), "{text}");
    // All pictures were there already.
    assert!(text.contains("seconds predicted"), "{text}");
}

#[test]
fn a_show_that_cannot_be_tuned_says_why() {
    let mut empty = crate::empty(Host::default());
    let said = refused(&mut empty, "tune");
    assert!(said.contains("no stage"), "{said}");
    let said = refused(&mut random(Host::default()), "tune 2%");
    assert!(said.contains("tune --until 2%"), "{said}");
    let short = Host {
        renderer: Arc::new(Altered {
            finest: Some(Quality(2)),
            ..Altered::default()
        }),
        ..Host::default()
    };
    let said = refused(&mut random(short), "tune");
    assert!(said.contains("2 steps of quality: tune needs 3"), "{said}");
    let narrow = Host {
        memory: 1 << 16,
        ..Host::default()
    };
    let said = refused(&mut random(narrow), "tune");
    assert!(said.contains("MB"), "{said}");
}
