//! Design sessions measured, and refinement that knows what its calls cost.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::operator::Altered;
use crate::{Stopped, prompt};
use footlight::diagnostic::Style;
use footlight::engine::{Host, Way};
use footlight::files::{Folder, MemoryStore, Store};
use footlight::picture::Image;
use footlight::picture::combine::{combine, dot};
use footlight::renderer::{Cost, Quality};
use footlight::repl::Repl;
use footlight::report::{Point, Record};
use footlight::units::Time;

const SHARED: Cost = Cost {
    prepare: 2.0,
    per_source: 0.25,
    per_image: 0.125,
    per_lone: 0.125,
};

const UNSHARED: Cost = Cost {
    prepare: 0.0,
    per_source: 0.0,
    per_image: 3.0,
    per_lone: 3.0,
};

/// The smallest show there is, smaller.
fn first(cost: Cost) -> (Repl, MemoryStore) {
    let examples = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(examples.join("first.lxq")).unwrap();
    let text = text.replace("size 480x270", "size 32x18");
    let store = MemoryStore::default();
    let host = Host {
        files: Box::new(Folder::new(&examples, 1 << 20)),
        store: Box::new(store.clone()),
        clock: Box::new(Stopped),
        renderer: Arc::new(Altered {
            cost: Some(cost),
            ..Altered::default()
        }),
        ..Host::default()
    };
    let show = prompt("first.lxq", text.as_bytes(), host).unwrap();
    (show, store)
}

#[test]
fn check_warns_of_a_run_of_minutes() {
    let warned = |prepare| {
        let cost = Cost {
            prepare,
            ..Cost::default()
        };
        first(cost).0.execute("check").unwrap().text
    };
    // Two coarse steps and the refined one, of a unit that takes a second.
    let long = warned(100.0);
    assert!(long.contains("[W030]"), "{long}");
    assert!(
        long.contains("`run` takes about 5:00 on this machine"),
        "{long}"
    );
    assert!(long.contains("every step of quality takes long"), "{long}");
    let less = warned(25.0);
    assert!(less.contains("takes about 1:15"), "{less}");
    assert!(
        less.contains("`preview { coarse 1  refined 2 }` takes about 50.00 s"),
        "{less}"
    );
    assert!(!warned(15.0).contains("warning"));
}

const COMMANDS: &str = "// on coarse pictures\n\
    cue 2 \"Lamp lit\" at 0:02 { lamp 60  time 1.5 }\n\n\
    refine   // one\n\
    cue 3 \"Dawn\" at 0:06 {\n  time 8\n  day 70\n}\n\
    refine 5\n";

/// A row of what a session measures: shares, not percent.
#[derive(Debug)]
struct Moment {
    label: String,
    event: String,
    predicted_quality: Option<f64>,
    error: f64,
    quality: Option<f64>,
}

fn replay(commands: &str) -> (Repl, Vec<Moment>) {
    let (mut show, store) = first(SHARED);
    let path = Path::new("commands.txt");
    store.write(path, commands.as_bytes()).unwrap();
    show.execute("session commands.txt --truth -o moments.json")
        .unwrap();
    let bytes = store.read(Path::new("moments.json"), 1 << 20).unwrap();
    let record: Record = serde_json::from_slice(&bytes).unwrap();
    let column = |name: &str| record.column(name).unwrap();
    let columns = ["predicted", "true error", "true"].map(column);
    let moment = |point: &Point| {
        let [predicted_quality, error, quality] = columns.map(|c| point.values[c]);
        Moment {
            label: point.label.clone(),
            event: point.marks.join(" "),
            predicted_quality,
            error: error.unwrap() / 100.0,
            quality,
        }
    };
    let moments = record.series[0].points.iter().map(moment).collect();
    (show, moments)
}

#[test]
fn a_session_goes_from_coarse_to_true() {
    let (show, moments) = replay(COMMANDS);
    let events: Vec<&str> = moments.iter().map(|m| m.event.as_str()).collect();
    assert_eq!(events, ["coarse", "edit", "refined", "edit", "refined"]);
    assert_eq!(moments[3].label, "line 5: cue 3 \"Dawn\" at 0:06 {");
    assert_eq!(show.engine().refined(), 2);

    let quality = |m: &Moment| m.quality.unwrap();
    assert_eq!(quality(&moments[0]), 0.0);
    assert!(quality(&moments[2]) > 0.3, "{moments:?}");
    // Two lights, two refined mixtures: nothing is left but rounding.
    assert!(moments[4].error < 1e-6, "{moments:?}");
    assert!(quality(&moments[4]) > 0.999);
    let predicted = moments[4].predicted_quality.unwrap();
    assert!(predicted > 0.999, "{predicted}");
}

/// The error of the sequence by looking at it, moment by moment.
fn by_looking(show: &mut Repl) -> f64 {
    let quality = Quality(show.engine().show().preview.refined);
    let units: [Image; 2] =
        [[1.0, 0.0], [0.0, 1.0]].map(|unit| show.engine_mut().render(&unit, quality).unwrap());
    let (start, end) = (
        show.engine().document().timeline().start(),
        show.engine().document().timeline().end(),
    );
    let count = 400;
    let (mut error, mut all) = (0.0, 0.0);
    for i in 0..count {
        let time: Time = start + (end - start).scaled((f64::from(i) + 0.5) / f64::from(count));
        let levels = show.engine().document().timeline().evaluate(time);
        let size = (units[0].width(), units[0].height());
        let truth = combine(size, &[(levels[0], &units[0]), (levels[1], &units[1])], 1);
        let off = combine(
            size,
            &[
                (1.0, &show.engine_mut().picture(time).unwrap()),
                (-1.0, &truth),
            ],
            1,
        );
        error += dot(&off, &off);
        all += dot(&truth, &truth);
    }
    (error / all).sqrt()
}

#[test]
fn the_true_error_is_what_one_sees() {
    for commands in ["", "refine\n"] {
        let (mut show, moments) = replay(commands);
        let exact = moments.last().unwrap().error;
        let seen = by_looking(&mut show);
        assert!((exact / seen - 1.0).abs() < 0.01, "{exact} against {seen}");
    }
}

#[test]
fn an_error_ends_a_session_with_its_line_and_keeps_what_is_done() {
    let cases = [
        (
            "refine\n\nrefine sometimes\n",
            3,
            2,
            "`sometimes` is not a whole number",
        ),
        ("refine\ncue 2 { lmap 5 }\nrefine\n", 2, 1, "no bank"),
        (
            "refine\nquit\n",
            2,
            2,
            "a session holds declarations and `refine`; `quit` is neither",
        ),
        ("refine\nlook open { lamp 5\nrefine\n", 2, 1, "}"),
    ];
    for (commands, line, code, words) in cases {
        let (mut show, store) = first(SHARED);
        let path = Path::new("commands.txt");
        store.write(path, commands.as_bytes()).unwrap();
        let error = show.execute("session commands.txt -o out.csv").unwrap_err();
        let text = error.report(Style::Plain);
        assert!(text.contains(&format!("commands.txt:{line}: ")), "{text}");
        assert!(text.contains(words), "{text}");
        assert!(text.contains("line 1: refine"), "{text}");
        assert_eq!(
            (error.exit_code(), show.engine().refined()),
            (code, 1),
            "{text}"
        );
        let csv = String::from_utf8(store.read(Path::new("out.csv"), 1 << 20).unwrap()).unwrap();
        assert!(
            csv.contains("# kind: session") && csv.contains("line 1: refine"),
            "{csv}"
        );
    }
}

#[test]
fn a_session_is_drawn_and_told() {
    let (mut show, store) = first(SHARED);
    store
        .write(Path::new("c.txt"), COMMANDS.as_bytes())
        .unwrap();
    let reply = show.execute("session c.txt --truth -o s.svg").unwrap();
    assert!(reply.text.ends_with("wrote s.svg\n"), "{}", reply.text);
    let svg = String::from_utf8(store.read(Path::new("s.svg"), 1 << 24).unwrap()).unwrap();
    for words in [
        "as predicted",
        "true",
        "after an edit",
        "how good was the sequence",
    ] {
        assert!(svg.contains(words), "{words}");
    }
    let error = show
        .execute("session c.txt -o s.gif")
        .unwrap_err()
        .to_string();
    assert!(error.contains(".png, .svg, .csv or .json"), "{error}");
    let error = show.execute("session").unwrap_err().to_string();
    assert!(error.contains("session FILE"), "{error}");
}

#[test]
fn the_next_steps_have_their_price() {
    let (mut show, _) = first(SHARED);
    show.execute("plan --next").unwrap();
    let outlook = show.engine().forecast().unwrap();
    let seconds: Vec<f64> = outlook.steps.iter().map(|s| s.seconds).collect();
    // Preparation and both lights, then a picture alone.
    assert_eq!(seconds, [2.625, 0.125]);
    assert_eq!(outlook.fixed, 2.5);
    assert!(outlook.error > outlook.steps[0].error);
    let words = show.execute("plan --next 1").unwrap().text;
    assert!(words.contains("2 directions left to refine"), "{words}");
    assert!(
        words.contains("the first costs 2.50 s before any picture"),
        "{words}"
    );
    show.execute("refine").unwrap();
    assert_eq!(show.engine().forecast().unwrap().steps[0].seconds, 0.125);
    for (line, words) in [
        ("plan 3", "stands behind --next"),
        ("plan --next 3 4", "`4` is left over"),
        ("plan --next some", "not a whole number"),
        (
            "plan --next --tolerance 1%",
            "belongs to the plan of the whole show",
        ),
    ] {
        let error = show.execute(line).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn several_at_once_where_they_share_work_and_never_when_counted() {
    let calls = |cost, goal: &str| {
        let (mut show, _) = first(cost);
        show.engine_mut().set_way(Way::Paper);
        let text = show.execute(goal).unwrap().text;
        (
            text.contains("2 pictures in one call"),
            show.engine().refined(),
        )
    };
    assert_eq!(calls(SHARED, "refine until 0.1%"), (true, 2));
    assert_eq!(calls(SHARED, "refine for 30s"), (true, 2));
    assert_eq!(calls(SHARED, "refine 2"), (false, 2));
    assert_eq!(calls(UNSHARED, "refine until 0.1%"), (false, 2));
    // One is always rendered; the second is not predicted to fit.
    let (mut show, _) = first(UNSHARED);
    let text = show.execute("refine for 2s").unwrap().text;
    assert_eq!(show.engine().refined(), 1);
    assert!(
        text.contains("would take 3.00 s, which does not fit"),
        "{text}"
    );
}
