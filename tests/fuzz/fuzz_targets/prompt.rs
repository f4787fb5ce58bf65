//! Any lines at the prompt get an answer; a refused line leaves the text unchanged.
#![no_main]

use std::path::Path;

use footlight_engine::{Engine, Host};
use footlight_host::files::{MemoryStore, Store};
use footlight_prompt::{Console, Repl};
use libfuzzer_sys::fuzz_target;

/// A show without a stage, so that rendering is refused at once.
const SHOW: &str = "show \"Prompt\"
light l1 spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd
light l2 like l1
bank lamps = l1  channel 1
bank sky = l2  channel 2  rgb
look night { lamps 10  sky #203060 }  // kept
cue 1 \"Preset\" at 0:00 { snap  night }
cue 2 at 0:10 { lamps spline 0 10, 3 55, 9 90  follow 12 }
cue 3 { blackout }
";

fuzz_target!(|text: &str| {
    let store = MemoryStore::default();
    let written = store.write(Path::new("a.lxq"), SHOW.as_bytes());
    written.expect("a shelf takes everything");
    let host = Host {
        store: Box::new(store),
        ..Host::default()
    };
    let opened = Engine::open(Path::new("a.lxq"), host);
    let engine = opened.expect("the show is well");
    let mut show = Repl::new(engine, Console::default());
    for line in text.split('\u{1}').take(20) {
        let before = show.engine().document().text().to_owned();
        match show.execute(line) {
            Ok(reply) if reply.quit => return,
            Ok(_) => {}
            Err(_) => assert_eq!(show.engine().document().text(), before, "a refused line changed the show"),
        }
    }
});
