//! Reports on a document: headline, declarations, results of edits, levels.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::sheet::{heads, hex};
use super::words::{count, label};
use footlight_engine::{Document, Edited, LiveControl, UnlitBank};
use footlight_show::diagnostic::{Diagnostic, Style};
use footlight_show::lang::{self, codes, edit::Action};
use footlight_show::model::{Cue, Link, Role, Show};
use footlight_show::printable::{Printable, left};
use footlight_show::timeline;
use footlight_show::units::{Time, percent};

/// One line with title, banks, cues and length.
pub fn headline(document: &Document) -> String {
    let (show, timeline) = (document.show(), document.timeline());
    let length = timeline.end() - timeline.start();
    format!(
        "{}: {}, {}, {length}",
        show.title,
        count(show.banks.len(), "bank"),
        count(show.cues.len(), "cue")
    )
}

/// The warnings, and true if there are any, including `unlit` banks. `transparent` names the
/// transparent materials of the stage.
pub fn check(
    document: &Document,
    unlit: Vec<UnlitBank>,
    transparent: &str,
    style: Style,
) -> Printable {
    let mut diagnostics = document.diagnostics().clone();
    let view = document.view();
    diagnostics
        .list
        .extend(unlit.into_iter().map(|bank| self::unlit(bank, view)));
    let mut text = diagnostics.render(style);
    if !style.is_for_people() {
        return text;
    }
    let _ = writeln!(text, "{}", headline(document));
    if !transparent.is_empty() {
        let _ = writeln!(text, "{transparent}");
    }
    text.push(&match diagnostics.warnings() {
        0 => "no errors".to_owned(),
        n => format!("no errors, {}", count(n, "warning")),
    });
    text
}

/// Warning about a bank whose light is nowhere in the view.
fn unlit(bank: UnlitBank, view: Option<&str>) -> Diagnostic {
    let place = view.map_or_else(|| "its picture".to_owned(), |view| format!("view `{view}`"));
    let message = format!("`{}` at full puts no light into {place}", bank.name);
    let mut warning = Diagnostic::warning(codes::UNLIT, message).help(
        "aim its lights at what the view shows, put them before the set, or look from elsewhere",
    );
    warning.labels.extend(bank.place);
    warning
}

/// Lists banks, and cues with their times.
pub fn listing(document: &Document) -> String {
    let mut text = headline(document) + "\n\nbanks\n";
    let show = document.show();
    for bank in &show.banks {
        let channel = bank
            .channel
            .map_or(String::new(), |c| format!("channel {c}"));
        let lights = lights(show, &bank.lights);
        let name = left(&bank.name, 14);
        let _ = writeln!(text, "  {name} {channel:<12} {lights}");
    }
    for fixed in &show.fixed {
        let at = format!("fixed at {}", percent(fixed.level));
        let lights = lights(show, &fixed.lights);
        let name = left(&fixed.name, 14);
        let _ = writeln!(text, "  {name} {at:<12} {lights}");
    }
    text.push_str("\ncues\n");
    for (cue, time) in show.cues.iter().zip(document.timeline().cues()) {
        let assumed = if time.assumed { "  (assumed GO)" } else { "" };
        let _ = writeln!(
            text,
            "  {:>9} - {:<9} {:<7} {}{assumed}",
            time.go.to_string(),
            time.completion.to_string(),
            cue.number.to_string(),
            label(cue)
        );
    }
    text
}

fn lights(show: &Show, lights: &[usize]) -> String {
    let names = lights
        .iter()
        .filter_map(|l| show.lights.get(*l))
        .map(|l| l.name.as_str());
    names.collect::<Vec<_>>().join(" ")
}

/// Texts that declare a name, given with or without its kind: `bank lamps`, `lamps`, `2.5`.
pub fn declarations<'d>(document: &'d Document, name: &str) -> Vec<&'d str> {
    let texts = document.diagnostics().sources.texts();
    texts.flat_map(|text| declared(text, name)).collect()
}

fn declared<'t>(text: &'t str, name: &str) -> Vec<&'t str> {
    let find = |what: &str| lang::edit::locate(text, what);
    let of_kind = |kind: &&str| find(&format!("{kind} {name}"));
    // These kinds have no name and would match any.
    let named = |kind: &&&str| !["show", "preview", "haze", "default"].contains(*kind);
    let kinds = lang::keywords().iter().filter(named).filter_map(of_kind);
    let mut places: Vec<_> = find(name).into_iter().chain(kinds).collect();
    places.sort_by_key(|place| place.start);
    places.dedup();
    places
        .into_iter()
        .filter_map(|place| text.get(place))
        .collect()
}

/// Reports an edit: new warnings, changes, and the number of refined images before it and still
/// valid.
pub fn edited(
    document: &Document,
    edited: &Edited,
    [before, after]: [usize; 2],
    style: Style,
) -> Printable {
    let mut text = Printable::default();
    if !edited.warnings.list.is_empty() {
        text.append(&edited.warnings.render(style));
    }
    for change in &edited.changes {
        let done = match &change.action {
            Action::Added => "added".to_owned(),
            Action::Removed => "removed".to_owned(),
            Action::Updated => "changed".to_owned(),
            Action::Renamed(name) => format!("renamed to {name}"),
            Action::Replaced => "replaced as a whole".to_owned(),
        };
        let what = change.what();
        let _ = writeln!(text, "{what}: {done}");
        if let (Action::Added, Some(number)) = (change.action.clone(), what.strip_prefix("cue ")) {
            text.push(&started_instead(document.show(), number));
        }
    }
    text.push(&headline(document));
    match (before, after) {
        (0, _) => {}
        (before, 0) => {
            let _ = write!(text, "; {} no longer fit", count(before, "refined picture"));
        }
        (_, kept) => {
            let _ = write!(text, "; {} kept", count(kept, "refined picture"));
        }
    }
    text
}

/// Note for a new cue that the previous cue now starts in place of the next.
fn started_instead(show: &Show, number: &str) -> String {
    let cues = &show.cues;
    let index = cues.iter().position(|c| c.number.to_string() == number);
    let around = index.and_then(|i| Some((cues.get(i.checked_sub(1)?)?, cues.get(i + 1)?)));
    let Some((before, behind)) = around else {
        return String::new();
    };
    let word = match before.link {
        Some((_, Link::Follow(_))) => "follow",
        Some((_, Link::Hang(_))) => "hang",
        None => return String::new(),
    };
    format!(
        "cue {}: its `{word}` starts cue {number} now, and no longer cue {}\n",
        before.number, behind.number
    )
}

/// The moment, its cue and its levels, with changes not yet in the text.
pub fn moment(document: &Document, live: &LiveControl) -> String {
    let mut text = format!("at {}", live.time());
    if let Some(cue) = current_cue(document, live) {
        let _ = write!(text, ", cue {} {}", cue.number, label(cue));
    }
    text.push('\n');
    text.push_str(&levels(document, live));
    if live.is_blind() {
        text.push_str("blind edits: `record` keeps them, `blind off` drops them\n");
    }
    if live.is_trying() {
        let _ = writeln!(text, "trying {}", live.tried().join("  "));
    }
    text
}

/// The levels in percent, as on a desk, with the light after the dimmer if it differs.
fn levels(document: &Document, live: &LiveControl) -> String {
    let levels = live.levels(document);
    let show = document.show();
    let bent =
        |bank: &footlight_show::model::Bank| bank.dimmer != footlight_show::model::Dimmer::Linear;
    let bent = show.banks.iter().any(bent);
    let mut text = String::new();
    if bent {
        let _ = writeln!(text, "  {:<14} {:>6} {:>7}", "", "level", "light");
    }
    let running = running_effects(document, live.time());
    let rows = show.parameters().into_iter().enumerate().zip(&levels);
    for ((parameter, coordinate), level) in rows {
        if !matches!(coordinate.role, Role::Level | Role::Fixed) {
            continue;
        }
        let bank = coordinate.bank.and_then(|bank| show.banks.get(bank));
        let light = bank.map_or(1.0, |bank| {
            let law = timeline::settings(bank.dimmer, &show.curves, &[*level]);
            law.first().copied().unwrap_or(*level)
        });
        let colour = match bank.filter(|bank| bank.rgb) {
            Some(_) => levels
                .get(parameter + 1..parameter + 4)
                .map_or_else(String::new, hex),
            None => String::new(),
        };
        let effect = coordinate.bank.and_then(|bank| running.get(&bank));
        let effect = effect.map_or(String::new(), |name| {
            let bank = coordinate.bank.unwrap_or_default();
            let factor = document.timeline().factor(bank, live.time());
            if *name == "none" && factor >= 1.0 {
                return String::new();
            }
            format!("  effect {name} {:.0} %", 100.0 * factor)
        });
        let bar = "#".repeat((level * 40.0).round().clamp(0.0, 40.0) as usize);
        let behind = if bent {
            format!(" {:>7.1}", light * 100.0)
        } else {
            String::new()
        };
        let (name, percent) = (left(&coordinate.name, 14), level * 100.0);
        let line = format!("  {name} {percent:>6.1}{behind}  {bar} {colour}{effect}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    for (index, moving) in heads(show).iter().enumerate() {
        let pose = show.pose_of(&levels, index);
        let name = left(&moving.light.name, 14);
        let _ = writeln!(text, "  {name} {}", moving.whole(show, pose));
    }
    text
}

/// The latest effect of each bank at a time, `none` after its end, by bank index.
fn running_effects(document: &Document, time: Time) -> BTreeMap<usize, &str> {
    let show = document.show();
    let mut running = BTreeMap::new();
    for (cue, at) in show.cues.iter().zip(document.timeline().cues()) {
        for part in cue.parts.iter().filter(|part| at.go + part.delay <= time) {
            for change in &part.effects {
                let effect = change.effect.and_then(|effect| show.effects.get(effect));
                running.insert(change.bank, effect.map_or("none", |e| e.name.as_str()));
            }
        }
    }
    running
}

/// Current cue for the prompt: number and label; empty before the first.
pub fn place(document: &Document, live: &LiveControl) -> String {
    current_cue(document, live).map_or_else(String::new, |cue| {
        format!("{} {}", cue.number, label(cue))
            .trim_end()
            .to_owned()
    })
}

/// The last started cue.
fn current_cue<'d>(document: &'d Document, live: &LiveControl) -> Option<&'d Cue> {
    document.show().cues.get(live.cue(document)?)
}

/// The views, the current one marked.
pub fn views(document: &Document) -> String {
    let views = &document.show().views;
    if views.is_empty() {
        return "the show declares no view".to_owned();
    }
    let mut sorted: Vec<_> = views.iter().collect();
    sorted.sort_unstable_by_key(|view| &view.name);
    let line = |view: &&footlight_show::model::NamedView| {
        let name = &view.name;
        let mark = if document.view() == Some(name) {
            "*"
        } else {
            " "
        };
        let camera = &view.camera;
        format!("{mark} {name}  {}x{}\n", camera.width, camera.height)
    };
    sorted.iter().map(line).collect()
}
