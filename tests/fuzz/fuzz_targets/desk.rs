//! Any file of a desk or a plan gives the text of a show or an error.
#![no_main]

use footlight_desk::{mvr, osc, usitt};
use footlight_show::diagnostic::Sources;
use footlight_show::lang;
use footlight_host::work::Work;
use libfuzzer_sys::fuzz_target;

fn is_show(text: &str) {
    let parsed = lang::parse(&mut Sources::default(), "a.lxq", text);
    assert!(parsed.show.is_some(), "{text}");
}

fuzz_target!(|bytes: &[u8]| {
    let work = Work {
        memory: 256 << 20,
        ..Work::silent()
    };
    osc::read(bytes);
    if let (_, Ok(carried)) = usitt::import("a.asc", bytes, None, work) {
        is_show(&carried.text);
    }
    if let Ok(carried) = mvr::import("a.mvr", bytes, "set", work) {
        is_show(&carried.text);
    }
});
