//! Any text gives a show or errors, with every span inside the text, in every style, and its curves
//! are checked.
#![no_main]

use footlight_show::check::check;
use footlight_show::diagnostic::{Diagnostic, Severity, Sources, Style, render};
use footlight_show::lang;
use libfuzzer_sys::fuzz_target;

fn told(found: &[Diagnostic], sources: &Sources) {
    for label in found.iter().flat_map(|d| &d.labels) {
        let (_, text) = sources.get(label.file).expect("a file that was read");
        assert!(text.get(label.span.clone()).is_some(), "{label:?}");
    }
    for style in [Style::Plain, Style::Short, Style::Json] {
        render(found, sources, style);
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = lang::decode("a.lxq", bytes) else {
        return;
    };
    let mut sources = Sources::default();
    let parsed = lang::parse(&mut sources, "a.lxq", &text);
    let failed = parsed
        .diagnostics
        .iter()
        .any(|d| d.severity == Severity::Error);
    assert_eq!(parsed.show.is_none(), failed);
    told(&parsed.diagnostics, &sources);
    if let Some(show) = &parsed.show {
        let checked = check(show, &parsed.spans);
        let failed = checked
            .diagnostics
            .iter()
            .any(|d| d.severity == Severity::Error);
        assert_eq!(checked.timeline.is_none(), failed);
        told(&checked.diagnostics, &sources);
    }
});
