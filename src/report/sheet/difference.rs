//! Changes between two versions of a show, in a designer's words and in light.

mod light;
mod shift;

use std::collections::BTreeMap;
use std::fmt::Write;

use self::light::curves;
use self::shift::Shifts;
use super::cue::effect;
use super::level::{self, by_bank, clock, motion, number, time, up_down};
use super::pose;
use footlight_engine::Version;
use footlight_show::geometry::Vec3;
use footlight_show::lang;
use footlight_show::model::{Cue, HeadAxis, Part, Pose, Show, Trigger};
use footlight_show::printable::{columns, left};
use footlight_show::timeline::Timeline;
use footlight_show::units::{Time, percent};

/// One change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShowChange {
    /// The changed item: `cue 12`, `bank lamps`.
    pub what: String,
    /// The change: `lamps 40 -> 55 at 0:31`.
    pub how: String,
}

/// One line: `cue 12: lamps 40 -> 55 at 0:31`.
impl std::fmt::Display for ShowChange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.what, self.how)
    }
}

/// Change of a bank's curve, in light relative to full. Each cue is compared with the cue of its
/// number, from GO to the next GO, so that a mere delay is no change.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveChange {
    /// The bank (`sky.r` for one emitter of an rgb bank).
    pub name: String,
    /// Root of the mean square over all cues of both versions.
    pub norm: f64,
    /// The largest difference.
    pub largest: f64,
    /// Time of the largest difference, in the new version.
    pub at: Time,
}

/// All changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShowDifference {
    /// In the order of the new version's text, removals last; cues after the rest.
    pub changes: Vec<ShowChange>,
    /// Banks of both versions whose curves differ, the largest norm first.
    pub curves: Vec<CurveChange>,
    /// True when something changed on which images depend: the stage, surfaces, lights, banks or
    /// view.
    pub pictures: bool,
    /// Number of poses of lit heads whose reflected light no image of the old version has.
    pub poses: usize,
}

impl ShowDifference {
    /// True when nothing changed in the language's terms.
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty() && self.curves.is_empty()
    }

    /// The changes as lines, then the curves.
    pub fn text(&self) -> String {
        let mut out = String::new();
        for change in &self.changes {
            let _ = writeln!(out, "{change}");
        }
        if !self.curves.is_empty() {
            let widest = self.curves.iter().map(|c| columns(&c.name)).max();
            let _ = writeln!(
                out,
                "\nhow far the light moved within the cues of both, in percent of full (on average: root \
                 mean square over time):"
            );
            for c in &self.curves {
                let _ = writeln!(
                    out,
                    "  {}  {:>6} on average, at most {} at {}",
                    left(&c.name, widest.unwrap_or(0)),
                    number(percent(c.norm)),
                    number(percent(c.largest)),
                    clock(rounded(c.at)),
                );
            }
        }
        out
    }
}

/// Rounded to hundredths of a second: the time of the largest difference is not a written time.
fn rounded(at: Time) -> Time {
    Time::from_micros((at.micros() as f64 / 1e4).round() as i64 * 10_000)
}

/// The changes from `old` to `new`.
pub fn difference(old: &Version, new: &Version) -> ShowDifference {
    let mut out = ShowDifference::default();
    declarations(&old.text(), &new.text(), &mut out);
    let first = |version: &Version| version.show.view().map(|view| view.name.clone());
    let declared = |name: &String| old.show.views.iter().any(|view| view.name == *name);
    if let (Some(was), Some(now)) = (first(old), first(new))
        && was != now
        && declared(&now)
        && new.show.views.iter().any(|view| view.name == was)
    {
        out.note("view", format!("the first is {now}, and was {was}"));
    }
    cues(old, new, &mut out.changes);
    out.curves = curves(old, new);
    let (before, after) = (bounced(old), bounced(new));
    out.poses = after.iter().filter(|pose| !before.contains(pose)).count();
    out
}

/// The poses for reflected light, each with its head's light.
fn bounced(version: &Version) -> Vec<(&str, Pose)> {
    let heads = pose::heads(&version.show);
    let all = version.timeline.bounced().iter();
    let mut poses: Vec<(&str, Pose)> = all
        .filter_map(|bounced| Some((heads.get(bounced.head)?.light.name.as_str(), bounced.pose)))
        .collect();
    poses.dedup();
    poses
}

/// Statement words of declarations on which images depend.
const SEEN: [&str; 7] = [
    "stage", "surface", "figure", "view", "light", "bank", "fixed",
];

/// Adds changes of everything except cues, by the canonical text of each declaration.
fn declarations(old: &str, new: &str, out: &mut ShowDifference) {
    let (old, new) = (lang::declarations(old), lang::declarations(new));
    let before: BTreeMap<&str, &str> = old.iter().map(|(k, t)| (k.as_str(), t.as_str())).collect();
    let after: BTreeMap<&str, &str> = new.iter().map(|(k, t)| (k.as_str(), t.as_str())).collect();
    for (what, text) in &new {
        let how = match before.get(what.as_str()) {
            None => format!("added: {text}"),
            Some(was) if was != text => format!("was: {was}\n  now: {text}"),
            Some(_) => continue,
        };
        out.note(what, how);
    }
    for (what, _) in old
        .iter()
        .filter(|(what, _)| !after.contains_key(what.as_str()))
    {
        out.note(what, "removed".to_owned());
    }
}

impl ShowDifference {
    fn note(&mut self, what: &str, how: String) {
        let word = what.split(' ').next().unwrap_or(what);
        self.pictures |= SEEN.contains(&word);
        self.changes.push(ShowChange {
            what: what.to_owned(),
            how,
        });
    }
}

fn cues(old: &Version, new: &Version, out: &mut Vec<ShowChange>) {
    let find = |show: &Show, cue: &Cue| {
        let found = show.cues.binary_search_by_key(&cue.number, |c| c.number);
        found.ok()
    };
    let mut stated = Shifts::of("at", false);
    // A changed default time changes the times of cues.
    let default = |show: &Show| {
        let mut parts = show.cues.iter().flat_map(|cue| &cue.parts);
        let found = parts.find(|part| part.by_default == [true; 2]);
        found.map(|part| (part.up, part.down))
    };
    let mut followed = Shifts::of("GO", default(&old.show) != default(&new.show));
    for (i, cue) in new.show.cues.iter().enumerate() {
        let what = format!("cue {}", cue.number);
        let Some(k) = find(&old.show, cue) else {
            let go = new.timeline.cues().get(i).map_or(Time::ZERO, |c| c.go);
            let label = if cue.label.is_empty() {
                String::new()
            } else {
                format!(" \"{}\"", cue.label)
            };
            let how = format!("added{label} at {}", clock(go));
            out.push(ShowChange { what, how });
            continue;
        };
        if let Some(was) = old.show.cues.get(k) {
            let mut hows = heads(was, cue);
            if let (Trigger::At(was), Trigger::At(now)) = (was.trigger, cue.trigger) {
                stated.add(&what, (was, now), out);
            }
            // A changed clock time was reported and includes the GO.
            if was.trigger == cue.trigger {
                followed.add(&what, (go(&old.timeline, k), go(&new.timeline, i)), out);
            }
            let go = go(&new.timeline, i);
            hows.extend(parts((&old.show, was), (&new.show, cue), go));
            out.extend(hows.into_iter().map(|how| ShowChange {
                what: what.clone(),
                how,
            }));
        }
    }
    for cue in &old.show.cues {
        if find(&new.show, cue).is_none() {
            out.push(ShowChange {
                what: format!("cue {}", cue.number),
                how: "removed".to_owned(),
            });
        }
    }
}

fn go(timeline: &Timeline, cue: usize) -> Time {
    timeline.cues().get(cue).map_or(Time::ZERO, |c| c.go)
}

/// Changes of label, note, trigger, links and flags.
fn heads(was: &Cue, now: &Cue) -> Vec<String> {
    // All fields of a cue: a new field does not compile until it is compared.
    let Cue {
        id: _,
        number: _,
        label: _,
        note,
        trigger: _,
        link: _,
        block: _,
        assert: _,
        cueonly: _,
        parts: _,
    } = now;
    let mut out = Vec::new();
    if was.note != *note {
        out.push(format!("note \"{}\" -> \"{note}\"", was.note));
    }
    if was.label != now.label {
        out.push(format!("label \"{}\" -> \"{}\"", was.label, now.label));
    }
    let trigger = |t: Trigger| match t {
        Trigger::Go => "GO".to_owned(),
        Trigger::At(time) => format!("at {}", clock(time)),
    };
    // Changes from one clock time to another are reported together with neighbouring cues.
    let both_at = matches!((was.trigger, now.trigger), (Trigger::At(_), Trigger::At(_)));
    if was.trigger != now.trigger && !both_at {
        out.push(format!(
            "starts {} -> {}",
            trigger(was.trigger),
            trigger(now.trigger)
        ));
    }
    let link = |l: &Cue| {
        l.link
            .map_or("nothing".to_owned(), |(_, link)| level::link(link))
    };
    if was.link.map(|l| l.1) != now.link.map(|l| l.1) {
        out.push(format!("{} -> {}", link(was), link(now)));
    }
    let flags = [
        (was.block, now.block, "block"),
        (was.assert, now.assert, "assert"),
        (was.cueonly, now.cueonly, "cueonly"),
    ];
    for (_, after, word) in flags.into_iter().filter(|f| f.0 != f.1) {
        out.push(format!(
            "{word} {}",
            if after { "added" } else { "removed" }
        ));
    }
    out
}

fn parts((old, was): (&Show, &Cue), (new, now): (&Show, &Cue), go: Time) -> Vec<String> {
    let mut out = Vec::new();
    let (before, after) = (moves(old, was), moves(new, now));
    // Heads that aim elsewhere in equal words, because a point or a head moved.
    let mut elsewhere = Alike::default();
    for (
        key @ (name, _),
        Moved {
            part,
            words,
            place: to,
        },
    ) in &after
    {
        let at = clock(go + part.delay);
        match before.get(key) {
            None => out.push(format!("{words} added at {at}")),
            Some(was) if was.words != *words => {
                let now = words.strip_prefix(&format!("{name} ")).unwrap_or(words);
                let far = was
                    .place
                    .zip(*to)
                    .and_then(|(was, is)| pose::further(was, is));
                let far = far.map_or(String::new(), |far| format!(", {far}"));
                out.push(format!("{} -> {now} at {at}{far}", was.words));
            }
            Some(Moved { part: was, .. }) if place(was) != place(part) => {
                out.push(format!(
                    "{words} moves {}, and moved {}",
                    place(part),
                    place(was)
                ));
            }
            Some(was) => {
                let far = was
                    .place
                    .zip(*to)
                    .and_then(|(was, is)| pose::further(was, is));
                let Some(far) = far else { continue };
                let aim = words.strip_prefix(&format!("{name} ")).unwrap_or(words);
                let how = format!("{aim} at {at}: {far}");
                elsewhere.add(name, how);
            }
        }
    }
    out.extend(elsewhere.lines());
    for (_, was) in before.iter().filter(|(key, _)| !after.contains_key(*key)) {
        out.push(format!("{} removed", was.words));
    }
    let (before, after) = (effects(old, was), effects(new, now));
    let mut alike = Alike::default();
    for (bank, effect) in &after {
        match before.get(bank) {
            None => alike.add(bank, format!("effect {effect} added")),
            Some(was) if was != effect => alike.add(bank, format!("effect {was} -> {effect}")),
            Some(_) => {}
        }
    }
    for (bank, effect) in before.iter().filter(|(bank, _)| !after.contains_key(*bank)) {
        alike.add(bank, format!("effect {effect} removed"));
    }
    out.extend(alike.lines());
    for part in &now.parts {
        let moved = |p: &Part| p.moves.first().map(|m| m.parameter);
        let same = |p: &&Part| {
            if part.written {
                p.written && p.number == part.number
            } else {
                !p.written && moved(p) == moved(part)
            }
        };
        if let Some(was) = was.parts.iter().find(same) {
            out.extend(timing((old, was), (new, part)));
        }
    }
    out
}

/// Names that share a line.
#[derive(Default)]
struct Alike<'s>(Vec<(String, Vec<&'s str>)>);

impl<'s> Alike<'s> {
    fn add(&mut self, name: &'s str, how: String) {
        match self.0.iter_mut().find(|(other, _)| *other == how) {
            Some((_, names)) => names.push(name),
            None => self.0.push((how, vec![name])),
        }
    }

    fn lines(self) -> impl Iterator<Item = String> {
        let lines = self.0.into_iter();
        lines.map(|(how, names)| format!("{} {how}", names.join(", ")))
    }
}

/// Position of a move in a cue.
fn place(part: &Part) -> String {
    match (part.written, part.number) {
        (false, _) => "in times of its own".to_owned(),
        (true, ..=1) => "in the cue's times".to_owned(),
        (true, number) => format!("in part {number}"),
    }
}

/// Action of a bank or a head in a cue.
struct Moved<'s> {
    /// The part that contains it.
    part: &'s Part,
    words: String,
    /// Target of the head then.
    place: Option<Vec3>,
}

/// Actions of each bank and each head in a cue, by name; several actions of a head are keyed by
/// their first axis.
fn moves<'s>(show: &'s Show, cue: &'s Cue) -> BTreeMap<(&'s str, Option<HeadAxis>), Moved<'s>> {
    let (first, heads) = (show.first_parameters(), pose::heads(show));
    let mut out = BTreeMap::new();
    for part in &cue.parts {
        for (bank, moves) in by_bank(show, &part.moves) {
            if let (Some(of), Some(start)) = (show.banks.get(bank), first.get(bank)) {
                let words = motion(of, *start, &moves);
                let place = None;
                out.insert((of.name.as_str(), None), Moved { part, words, place });
            }
        }
        for (index, axes, pose) in pose::turned(show, &part.moves) {
            if let Some(moving) = heads.get(index) {
                let name = moving.light.name.as_str();
                let words = format!("{name} {}", moving.words(show, pose, &axes));
                let both = axes.contains(&HeadAxis::Pan) && axes.contains(&HeadAxis::Tilt);
                let place = moving.place(show, pose).filter(|_| both);
                let first = axes.first().copied();
                out.insert((name, first), Moved { part, words, place });
            }
        }
    }
    out
}

/// The new effect of each bank in a cue, `none` for an end.
fn effects<'s>(show: &'s Show, cue: &Cue) -> BTreeMap<&'s str, String> {
    let changes = cue.parts.iter().flat_map(|part| &part.effects);
    let named = changes.filter_map(|change| {
        let bank = show.banks.get(change.bank)?;
        Some((bank.name.as_str(), effect(show, change)))
    });
    named.collect()
}

fn timing((old, was): (&Show, &Part), (new, now): (&Show, &Part)) -> Vec<String> {
    // All fields of a part: a new field does not compile until it is compared.
    let Part {
        id: _,
        number: _,
        written: _,
        label: _,
        delay: _,
        up: _,
        down: _,
        by_default: _,
        curve: _,
        moves: _,
        effects: _,
    } = now;
    let which = if !now.written {
        let bank = by_bank(new, &now.moves).first().map(|(bank, _)| *bank);
        let bank = bank.and_then(|bank| new.banks.get(bank));
        let turned = pose::turned(new, &now.moves)
            .first()
            .map(|(head, ..)| *head);
        let head = turned.and_then(|head| pose::heads(new).get(head).map(|h| &h.light.name));
        let name = bank.map(|bank| &bank.name).or(head);
        name.map_or_else(String::new, |name| format!("{name} "))
    } else if now.number > 1 {
        format!("part {} ", now.number)
    } else {
        String::new()
    };
    let mut out = Vec::new();
    if was.delay != now.delay {
        let (before, after) = (time(was.delay), time(now.delay));
        out.push(format!("{which}delay {before} -> {after}"));
    }
    // When both are defaults, the line of `default` or of its value reports the change.
    let is_up = was.up != now.up && !(was.by_default[0] && now.by_default[0]);
    let is_down = was.down != now.down && !(was.by_default[1] && now.by_default[1]);
    match (is_up, is_down) {
        (true, true) => out.push(format!("{which}time {} -> {}", up_down(was), up_down(now))),
        (true, false) => out.push(format!("{which}up {} -> {}", time(was.up), time(now.up))),
        (false, true) => out.push(format!(
            "{which}down {} -> {}",
            time(was.down),
            time(now.down)
        )),
        (false, false) => {}
    }
    let (before, after) = (was.curve.name(old), now.curve.name(new));
    if before != after {
        out.push(format!("{which}curve {before} -> {after}"));
    }
    if was.label != now.label {
        out.push(format!(
            "{which}label \"{}\" -> \"{}\"",
            was.label, now.label
        ));
    }
    out
}
