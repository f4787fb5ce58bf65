//! Levels read without an edit equal those of a cue written after all others, and errors have equal
//! words.

use footlight_host::files::{Files, Folder, Memory};
use footlight_show::diagnostic::{Diagnostic, Sources, Style, render};
use footlight_show::lang::edit::{self, Edit};
use footlight_show::lang::{self, SetLevel};
use footlight_show::model::Motion;
use proptest::prelude::*;

const SHOWS: [&str; 3] = [
    include_str!("../../examples/tavern/tavern.lxq"),
    include_str!("../../examples/turandot/turandot.lxq"),
    "light l panel m\nlight k panel m\nlight j panel m\nlet dim = 20\n\
     bank lamps = l dimmer square\nbank sky = k rgb\ncue 1 { lamps 5 }\nbank late = j\n\
     group warm = lamps late\nlook night { lamps 8  sky 3 }\ncurve lin = linear 0 0, 1 100\n",
];

/// The naive way: writes a cue with the moves at the end of the show, and reads the levels that it
/// sets. Places elsewhere in the text, such as a declaration, are not places of the typed text.
fn written(source: &str, typed: &str) -> Result<Vec<SetLevel>, Vec<Diagnostic>> {
    let (opening, closing) = ("cue 9999.999 { snap  ", " }");
    let statement = Edit::Declare(format!("{opening}{typed}{closing}"));
    let shifted = |found: Vec<Diagnostic>, start: usize| {
        let shift = |mut one: Diagnostic| {
            one.labels.retain_mut(|label| {
                let behind = start + typed.len() + closing.len();
                let own = label.file == 0 && (start..=behind).contains(&label.span.start);
                let moved = |at: usize| at.saturating_sub(start).min(typed.len());
                label.span = moved(label.span.start)..moved(label.span.end);
                own
            });
            one
        };
        found.into_iter().map(shift).collect::<Vec<_>>()
    };
    let edited = edit::apply(source, &statement).map_err(|found| shifted(found, opening.len()))?;
    let parsed = lang::parse(&mut Sources::default(), "any.lxq", &edited.source);
    let Some(show) = parsed.show else {
        let place = edit::locate(&edited.source, "cue 9999.999").unwrap();
        return Err(shifted(parsed.diagnostics, place.start + opening.len()));
    };
    let moves = show
        .cues
        .last()
        .unwrap()
        .parts
        .iter()
        .flat_map(|p| &p.moves);
    let set = moves.filter_map(|one| match one.motion {
        Motion::To(level) => Some(SetLevel {
            parameter: one.parameter,
            level,
        }),
        Motion::Path(_) => None,
    });
    Ok(set.collect())
}

fn rendered(typed: &str, found: &[Diagnostic]) -> String {
    let mut sources = Sources::default();
    sources.add("typed", typed);
    render(found, &sources, Style::Plain).into()
}

fn compare(source: &str, typed: &str) {
    let live = lang::levels(&Memory::default(), "any.lxq", source, typed);
    let wanted = written(source, typed);
    let show = |found: Vec<Diagnostic>| rendered(typed, &found);
    assert_eq!(live.map_err(show), wanted.map_err(show), "{typed}");
}

#[test]
fn levels_are_those_of_a_cue_at_the_end() {
    for typed in [
        "",
        "lamps 40",
        "warm 40  sky #203060",
        "night 50",
        "night + { late (dim) }",
        "blackout",
        "lamps (dim * 2) time 3  part 2 { sky.r 7  late spline 0 3, 1 5 }",
        "lamps spline 0 3, 1 5",
        "lamps 300",
        "lmaps 3",
        "l 3",
        "lamps",
        "lamps slow",
        "lamps #fff",
        "lamps 3  lamps 4",
        "lamps 3 follow 2",
        "at 3  block",
        "lamps 3 } cue 5 { sky 3",
        "lamps 3 }",
        "lamps {",
        "lamps \"",
        "lamps 3 // so",
        "lamps (",
        "lamps (nothing)",
        "curve dawn lamps 3",
        "lamps 5s  sky.x 3  warm #fff  late 3 K",
    ] {
        for source in SHOWS {
            compare(source, typed);
        }
    }
    compare(SHOWS[2], &"lamps 300 ".repeat(200));
    compare(SHOWS[2], &" ".repeat(1 << 20));
}

#[test]
fn levels_of_a_show_with_files_are_read() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/sketch");
    let text = std::fs::read_to_string(folder.join("sketch.lxq")).unwrap();
    let files = Folder::new(folder, 1 << 20);
    let levels = |files: &dyn Files, typed| lang::levels(files, "sketch.lxq", &text, typed);
    let set = levels(&files, "table (2 * dim)").unwrap();
    assert_eq!(set.iter().map(|s| s.level).collect::<Vec<_>>(), [0.5]);
    // The fault is not in the typed text.
    let found = levels(&Memory::default(), "table 5").unwrap_err();
    assert!(found.iter().all(|one| one.labels.is_empty()), "{found:#?}");
    // Text after the moves is not a declaration of the show.
    let found = levels(&files, "table 5 }\nbank x = lamp\nlet y = 3").unwrap_err();
    assert!(!found.is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn any_words_are_answered_alike(words in prop::collection::vec(prop::sample::select(vec![
        "lamps", "sky", "late", "warm", "night", "sky.r", "blackout", "40", "full", "out", "#203060",
        "2700 K", "(dim)", "(dim * 9)", "to", "+ { lamps 3 }", "spline 0 1, 2 3", "time 3", "snap",
        "follow 2", "part 2 {", "}", "{", "nothing", "l", "\"x\"", "// c", "curve lin", "repeat 3",
    ]), 0..7)) {
        compare(SHOWS[2], &words.join(" "));
    }
}
