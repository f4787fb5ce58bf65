//! Formatting keeps the show and is idempotent; a text that does not parse is refused.
#![no_main]

use footlight_show::diagnostic::Sources;
use footlight_show::lang;
use footlight_show::model::Show;
use libfuzzer_sys::fuzz_target;

fn show(text: &str) -> Option<Show> {
    lang::parse(&mut Sources::default(), "a.lxq", text).show
}

fuzz_target!(|text: &str| {
    let Ok(once) = lang::format(text) else {
        return;
    };
    assert_eq!(lang::format(&once).as_ref(), Ok(&once), "not idempotent");
    assert_eq!(show(text), show(&once), "another show");
});
