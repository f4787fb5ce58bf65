//! Separate intensity and colour of a bank; colours by name, by hue, by gel number.

use footlight_host::files::Memory;
use footlight_report::sheet::hex;
use footlight_show::diagnostic::Sources;
use footlight_show::lang::{codes, parse_with_files};
use footlight_show::model::Show;
use footlight_show::timeline::Timeline;
use footlight_show::units::Time;

const RIG: &str = "show \"t\"\nlight l spot at 0, 0, 4  aim 0, 0, 0  beam 20  field 40  100 cd\n\
    light m like l\nlight n like l\nbank a = l\nbank b = m\nbank c = n  rgb\n";

fn read(text: &str) -> Result<Show, &'static str> {
    let files = Memory::default().with("g.csv", "number,name,colour\nL201,Blue,#0000ff\n");
    let parsed = parse_with_files(&files, &mut Sources::default(), "a.lxq", text);
    parsed.show.ok_or_else(|| parsed.diagnostics[0].code)
}

/// Light of the three emitters, in percent of full, rounded to a tenth.
fn light(show: &Show, seconds: f64) -> Vec<f64> {
    let timeline = Timeline::new(show).unwrap();
    let time = Time::from_micros((seconds * 1e6) as i64);
    let setting = timeline.evaluate(time);
    setting[2..5]
        .iter()
        .map(|s| (s * 1e3).round() / 10.0)
        .collect()
}

#[test]
fn a_bank_fades_in_its_colour_and_changes_colour_at_its_level() {
    let text = format!(
        "{RIG}cue 1 at 0:00 {{ snap c 60 #f00 }}\ncue 2 at 0:10 {{ time 4 c to #00f }}\n\
         cue 3 at 0:20 {{ time 2 c 30 }}\ncue 4 at 0:30 {{ time 2 blackout }}\n\
         cue 5 at 0:40 {{ time 4 c #0f0 }}\ncue 6 at 0:50 {{ snap c out }}\ncue 7 at 0:55 {{ time 2 c.r 50 }}\n"
    );
    let show = read(&text).unwrap();
    for (seconds, wanted) in [
        (5.0, [60.0, 0.0, 0.0]),
        (12.0, [30.0, 0.0, 30.0]),
        (21.0, [0.0, 0.0, 45.0]),
        (25.0, [0.0, 0.0, 30.0]),
        (31.0, [0.0, 0.0, 15.0]),
        (35.0, [0.0, 0.0, 0.0]),
        // From black to green without passing blue; a plain colour brings the bank to full.
        (41.0, [0.0, 25.0, 0.0]),
        (45.0, [0.0, 100.0, 0.0]),
        (56.0, [25.0, 0.0, 0.0]),
        (58.0, [50.0, 0.0, 0.0]),
    ] {
        assert_eq!(light(&show, seconds), wanted, "{seconds}");
    }
}

#[test]
fn a_look_with_a_colour_is_absolute_and_dims_in_it() {
    let text = format!(
        "{RIG}look red {{ c #f00 }}\nlook dim {{ c 40 #0f0 }}\ncue 1 at 0:00 {{ snap c 10 }}\n\
         cue 2 at 0:10 {{ snap red }}\ncue 3 at 0:20 {{ snap red 50 }}\ncue 4 at 0:30 {{ snap dim 50 }}\n"
    );
    let show = read(&text).unwrap();
    for (seconds, wanted) in [
        (5.0, [10.0, 10.0, 10.0]),
        (15.0, [100.0, 0.0, 0.0]),
        (25.0, [50.0, 0.0, 0.0]),
        (35.0, [0.0, 20.0, 0.0]),
    ] {
        assert_eq!(light(&show, seconds), wanted, "{seconds}");
    }
}

#[test]
fn colours_have_names_hues_and_gels() {
    let colour = |written: &str| {
        let text = format!(
            "gels \"g.csv\"\nlet dusk = #red\nlet late = #dusk\n{RIG}cue 1 {{ c {written} }}"
        );
        let show = read(&text)?;
        let moves = show.cues[0].parts[0].moves.iter();
        let found: Vec<f64> = moves.map(|m| m.motion.target()).collect();
        Ok::<_, &str>(hex(&found[found.len() - 3..]))
    };
    for (written, wanted) in [
        ("#steelblue", "#4682b4"),
        ("#amber", "#ffbf00"),
        ("#late", "#ff0000"),
        ("(dusk)", "#ff0000"),
        ("60 hsb(60, 100%, 100%)", "#ffff00"),
        ("hsb(210 50 80)", "#6699cc"),
        ("gel L201 40", "#0000ff"),
    ] {
        assert_eq!(colour(written).as_deref(), Ok(wanted), "{written}");
    }
    for (written, code) in [
        ("#stealblue", codes::BAD_COLOUR),
        ("#transparent", codes::BAD_COLOUR),
        ("hsb(400, 1, 1)", codes::BAD_COLOUR),
        ("hsb(40)", codes::BAD_COLOUR),
        ("gel 201", codes::UNKNOWN_NAME),
        ("#f00 #0f0", codes::DOES_NOT_FIT),
        ("40 50", codes::DOES_NOT_FIT),
    ] {
        assert_eq!(colour(written), Err(code), "{written}");
    }
}
