//! The show text of a plan: a light for each fixture, a bank for each channel, a stage for each
//! geometry file.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::frame::Frame;
use super::gdtf::{self, Fixture};
use super::head::{self, Hanging};
use super::zip::Archive;
use super::{Carried, Fault, Hung, Plan, Set, addressed, rounded};
use crate::Loss;
use crate::names::Names;
use footlight_host::files::Memory;
use footlight_host::work::Work;
use footlight_show::lang::{self, quoted};
use footlight_show::units::Rgb;
use footlight_stage::gltf::named_files;
use footlight_stage::import;
use footlight_stage::stage_file::{Options, SceneError};

/// Defaults of a fixture whose type is unknown: angles of a profile, and the light of a 575 W lamp.
const BEAM: f64 = 20.0;
const FIELD: f64 = 30.0;
const LUMENS: f64 = 10_000.0;
/// Most losses named in an error about an empty plan.
const SAID: usize = 4;
/// Valid channel numbers.
const CHANNELS: std::ops::RangeInclusive<u32> = 1..=999_999;
/// Full angles of a spot's light, degrees.
const ANGLES: [f64; 2] = [0.2, 170.0];
/// Ratio of beam to field angle when a file has one angle for both.
const NARROWER: f64 = 2.0 / 3.0;

/// Assumptions, each with the fixtures it applies to.
#[derive(Default)]
struct Assumed {
    said: BTreeMap<String, usize>,
}

impl Assumed {
    fn say(&mut self, what: impl Into<String>) {
        *self.said.entry(what.into()).or_default() += 1;
    }
}

/// Text, patch and files of a plan.
pub fn carried(
    name: &str,
    plan: &Plan,
    archive: &Archive<'_>,
    folder: &str,
    work: Work<'_>,
) -> Result<Carried, Fault> {
    let mut out = Carried::default();
    let mut assumed = Assumed::default();
    let mut text = format!("// The rig of {}.\n\n", name.replace(char::is_control, " "));
    let work = sets(plan, (archive, folder), (&mut text, &mut out), work)?;
    lights(plan, archive, (&mut text, &mut out), &mut assumed, work)?;
    if let Some((line, count)) = plan.odd_matrices {
        let what = match count {
            1 => "a matrix is not of four times three numbers: what has it stays at its origin"
                .to_owned(),
            count => format!(
                "{count} matrices are not of four times three numbers: what has them stays at its \
                 origin"
            ),
        };
        out.losses.push(Loss::new(what).line(line));
    }
    for (ending, (line, count)) in &plan.skipped {
        let files = match count {
            1 => "1 file of geometry ends".to_owned(),
            count => format!("{count} files of geometry end"),
        };
        let what = format!("{files} in .{ending}: only glTF is read");
        out.losses.push(Loss::new(what).line(*line));
    }
    if out.files.is_empty() && !text.contains("\nlight ") {
        let reasons: Vec<String> = out.losses.iter().take(SAID).map(Loss::to_string).collect();
        return Err(Fault::Nothing(reasons.join("; ")));
    }
    out.assumed = assumed
        .said
        .iter()
        .map(|(what, count)| match count {
            1 => what.clone(),
            count => format!("{what} ({count} times)"),
        })
        .collect();
    out.assumed
        .push("the plan's X is stage left and its Y upstage".to_owned());
    out.text = lang::format(&text).unwrap_or(text);
    Ok(out)
}

/// Adds the stages with their files; returns the remaining memory.
fn sets<'w>(
    plan: &Plan,
    (archive, folder): (&Archive<'_>, &str),
    (text, out): (&mut String, &mut Carried),
    mut work: Work<'w>,
) -> Result<Work<'w>, Fault> {
    let mut written = BTreeSet::new();
    // By path, true for a stage.
    let mut tried: BTreeMap<String, bool> = BTreeMap::new();
    for set in &plan.sets {
        work.check()?;
        if !archive.has(&set.file) {
            let what = format!("`{}` is not in the archive", set.file);
            out.losses.push(Loss::new(what).line(set.line));
            continue;
        }
        let Some((scale, turn)) = set.frame.upright() else {
            let what = format!("`{}` stands askew, which no stage does: left out", set.file);
            out.losses.push(Loss::new(what).line(set.line));
            continue;
        };
        let path = format!("{folder}/{}", plain(&set.file));
        let is_stage = if let Some(known) = tried.get(&path) {
            *known
        } else {
            let files = copied(set, archive, folder, out, work)?;
            let unread = unread(&path, &files, work);
            tried.insert(path.clone(), unread.is_none());
            if let Some(error) = &unread {
                let what = format!("`{}`: {error}: left out", set.file);
                out.losses.push(Loss::new(what).line(set.line));
            } else {
                for (path, bytes) in files {
                    if written.insert(path.clone()) {
                        work = work.holding(bytes.len());
                        out.files.push((path, bytes));
                    }
                }
            }
            unread.is_none()
        };
        if !is_stage {
            continue;
        }
        let _ = write!(text, "stage {}", quoted(&path));
        if (scale - 1.0).abs() > 1e-6 {
            let _ = write!(text, "  scale {}m", rounded(scale));
        }
        if set.frame.origin != [0.0; 3] {
            let _ = write!(text, "  at {}", point(set.frame.origin));
        }
        if turn.abs() > 1e-4 {
            let _ = write!(text, "  turn {}", rounded(turn));
        }
        text.push('\n');
    }
    text.push('\n');
    Ok(work)
}

/// The path of a file of the archive, in letters that every system accepts.
fn plain(name: &str) -> String {
    let kept = |c: char| {
        if c.is_alphanumeric() || ".-_".contains(c) {
            c
        } else {
            '_'
        }
    };
    let parts = name
        .split(['/', '\\'])
        .map(|part| part.trim_start_matches('.'));
    let parts = parts.filter(|part| !part.is_empty());
    let parts: Vec<String> = parts.map(|part| part.chars().map(kept).collect()).collect();
    parts.join("/")
}

/// Resolves `name` from the folder of `file`; `None` when that is outside.
fn resolved(file: &str, name: &str) -> Option<String> {
    let mut parts: Vec<&str> = file.split(['/', '\\']).collect();
    parts.pop();
    if name.starts_with('/') || name.contains([':', '\0']) {
        return None;
    }
    for part in name.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// A geometry file and the files that it names, by their paths in the show's folder.
fn copied(
    set: &Set,
    archive: &Archive<'_>,
    folder: &str,
    out: &mut Carried,
    mut work: Work<'_>,
) -> Result<Vec<(String, Vec<u8>)>, Fault> {
    let Some(bytes) = archive.read(&set.file, work)? else {
        return Ok(Vec::new());
    };
    work = work.holding(bytes.len());
    let path = plain(&set.file);
    let mut files = Vec::new();
    for name in named_files(&bytes) {
        let places = resolved(&set.file, &name).zip(resolved(&path, &name));
        let inner = places.and_then(|(inner, place)| Some((archive.inner_name(&inner)?, place)));
        let Some((inner, place)) = inner else {
            let what = format!(
                "`{name}`, which `{}` names, is not in the archive",
                set.file
            );
            out.losses.push(Loss::new(what).line(set.line));
            continue;
        };
        if let Some(bytes) = archive.read(inner, work)? {
            work = work.holding(bytes.len());
            files.push((format!("{folder}/{place}"), bytes));
        }
    }
    files.push((format!("{folder}/{path}"), bytes));
    Ok(files)
}

/// The reason why the file at `path` is no valid stage, if so.
fn unread(path: &str, files: &[(String, Vec<u8>)], work: Work<'_>) -> Option<SceneError> {
    let beside = files
        .iter()
        .fold(Memory::default(), |beside, (path, bytes)| {
            beside.with(path, bytes.as_slice())
        });
    let memory = work.memory;
    import::read(&beside, path, &Options::default(), memory).err()
}

fn lights(
    plan: &Plan,
    archive: &Archive<'_>,
    (text, out): (&mut String, &mut Carried),
    assumed: &mut Assumed,
    work: Work<'_>,
) -> Result<(), Fault> {
    let mut names = Names::default();
    let mut types: BTreeMap<(String, String), Fixture> = BTreeMap::new();
    // The first light of each description; the others refer to it.
    let mut alike: BTreeMap<String, String> = BTreeMap::new();
    let mut channels: BTreeMap<u32, Channel> = BTreeMap::new();
    // Lines of the patch.
    let mut heads: Vec<String> = Vec::new();
    let numbers = plan
        .hung
        .iter()
        .filter_map(|hung| hung.id.parse::<u32>().ok());
    let taken: BTreeSet<u32> = numbers.filter(|n| CHANNELS.contains(n)).collect();
    let behind = taken.last().map_or(1, |last| last + 1)..=*CHANNELS.end();
    let mut free = behind.chain(CHANNELS.filter(|n| !taken.contains(n)));
    for hung in &plan.hung {
        work.check()?;
        let key = (hung.kind.clone(), hung.mode.clone());
        if !types.contains_key(&key) {
            let fixture = fixture(hung, archive, out, work)?;
            types.insert(key.clone(), fixture);
        }
        let Some(fixture) = types.get(&key) else {
            continue;
        };
        if fixture.is_without_beam && fixture.beams == 0 {
            let what = format!("`{}` makes no beam, it only glows: left out", hung.name);
            out.losses.push(Loss::new(what).line(hung.line));
            continue;
        }
        if fixture.mode == Some(false) {
            let (kind, mode) = (&hung.kind, &hung.mode);
            assumed.say(match mode.as_str() {
                "" => format!("`{kind}` in the first of its modes"),
                mode => format!("`{kind}` has no mode `{mode}`: its first one"),
            });
        }
        let rgb = fixture.rgb.iter().all(Option::is_some);
        let light = names.give(&hung.name, "light");
        let head = match head::hanging(hung, fixture) {
            Ok(head) => head,
            Err(why) => {
                let what = format!("`{}` stays as it hangs: {why}", hung.name);
                out.losses.push(Loss::new(what).line(hung.line));
                None
            }
        };
        let beam = || hung.frame.then(fixture.beam.unwrap_or_default());
        let frame = head.as_ref().map_or_else(beam, |head| head.frame);
        let described = described(hung, fixture, (rgb, head.as_ref()), assumed);
        let aim = aim(plan, hung, (frame, head.as_ref()), assumed);
        let at = format!("at {}  aim {}", point(frame.origin), point(aim));
        let _ = match alike.get(&described) {
            Some(first) => writeln!(text, "light {light} like {first}  {at}"),
            None => writeln!(text, "light {light} spot  {at}  {described}"),
        };
        alike.entry(described).or_insert_with(|| light.clone());
        let number = match hung.id.parse() {
            Ok(number) if CHANNELS.contains(&number) => number,
            _ => {
                assumed.say("fixtures without a number of a channel get the next ones");
                // There are more numbers than fixtures.
                free.next().unwrap_or(1)
            }
        };
        let channel = channels.entry(number).or_default();
        channel.lights.push(light);
        channel.rgb |= rgb;
        if let Some((head, (universe, start))) =
            head.zip(hung.address.as_deref().and_then(addressed))
        {
            let at = |offset| format!("{universe}/{}", start + u32::from(offset) - 1);
            heads.push(head.patch(
                fixture,
                channel.lights.last().map_or("", String::as_str),
                at,
            ));
        }
        addresses(hung, fixture, rgb, channel, out);
        losses(hung, fixture, out);
    }
    text.push('\n');
    for (number, channel) in &channels {
        let bank = names.give(&format!("ch{number}"), "ch");
        let rgb = if channel.rgb { "  rgb" } else { "" };
        let _ = writeln!(
            text,
            "bank {bank} = {}  channel {number}{rgb}",
            channel.lights.join(" ")
        );
        for address in &channel.addresses {
            let _ = writeln!(out.patch, "{bank} {address}");
        }
    }
    for line in heads {
        let _ = writeln!(out.patch, "{line}");
    }
    Ok(())
}

#[derive(Default)]
struct Channel {
    lights: Vec<String>,
    rgb: bool,
    /// Addresses as written in a patch file.
    addresses: Vec<String>,
}

/// The type of a fixture, from the file in the archive that it names.
fn fixture(
    hung: &Hung,
    archive: &Archive<'_>,
    out: &mut Carried,
    work: Work<'_>,
) -> Result<Fixture, Fault> {
    let wanted = hung.kind.strip_suffix(".gdtf").unwrap_or(&hung.kind);
    let mut files = archive.names().filter(|name| name.ends_with(".gdtf"));
    let found = files.find(|name| name.strip_suffix(".gdtf") == Some(wanted));
    let bytes = match found {
        Some(name) => archive.read(name, work)?,
        None => None,
    };
    let unread = |out: &mut Carried, why: String| {
        let what = format!("the type `{}` of `{}`: {why}", hung.kind, hung.name);
        out.losses.push(Loss::new(what).line(hung.line));
        Ok(Fixture::default())
    };
    let Some(bytes) = bytes else {
        return unread(out, "its GDTF file is not in the archive".to_owned());
    };
    let work = work.holding(bytes.len());
    let inner = Archive::new(&bytes).and_then(|archive| archive.read("description.xml", work));
    let description = match inner {
        Ok(Some(description)) => description,
        Ok(None) => return unread(out, "its GDTF file has no description".to_owned()),
        Err(Fault::Said(why)) => return unread(out, why),
        Err(fault) => return Err(fault),
    };
    let description = String::from_utf8_lossy(&description);
    let work = work.holding(description.len());
    match gdtf::read(&description, &hung.mode, work) {
        Ok(fixture) => Ok(fixture),
        Err(Fault::Said(why)) => unread(out, format!("description.xml: {why}")),
        Err(fault) => Err(fault.of(&hung.kind)),
    }
}

/// Angles, light and colour in a light's declaration.
fn described(
    hung: &Hung,
    fixture: &Fixture,
    (rgb, head): (bool, Option<&Hanging<'_>>),
    assumed: &mut Assumed,
) -> String {
    let kind = &hung.kind;
    let field = hung.zoom.or(fixture.field_angle).unwrap_or_else(|| {
        assumed.say(format!("`{kind}`: a field of {FIELD} degrees"));
        FIELD
    });
    let [narrowest, widest] = ANGLES;
    if !(narrowest..=widest).contains(&field) {
        let angle = rounded(field);
        assumed.say(format!(
            "`{kind}`: a field of {angle} degrees becomes {}",
            field.clamp(narrowest, widest)
        ));
    }
    let field = field.clamp(narrowest, widest);
    let beam = fixture.beam_angle.unwrap_or_else(|| {
        assumed.say(format!("`{kind}`: a beam of {BEAM} degrees"));
        BEAM
    });
    let beam = if beam < field {
        beam.max(narrowest / 2.0)
    } else {
        assumed.say(format!("`{kind}`: a beam of two thirds of its field"));
        field * NARROWER
    };
    let flux = fixture
        .flux
        .filter(|flux| *flux >= 1e-3)
        .unwrap_or_else(|| {
            assumed.say(format!("`{kind}`: {LUMENS} lumens"));
            LUMENS
        });
    let mut out = format!(
        "beam {}  field {}  {} lm",
        rounded(beam),
        rounded(field),
        rounded(flux)
    );
    if let Some(unknown) = &fixture.unknown_type {
        assumed.say(format!("`{kind}`: a spot for its beam of type `{unknown}`"));
    }
    let moves = head.map_or(String::new(), |head| {
        if !head.has_ranges() {
            assumed.say(format!("`{kind}`: pan of 540 and tilt of 270 degrees"));
        }
        format!("  {}", head.words(fixture, beam, field))
    });
    if rgb {
        return out + &moves;
    }
    match fixture.temperature {
        Some(kelvin) => {
            let taken = kelvin.clamp(1000.0, 25_000.0).round();
            if (taken - kelvin).abs() >= 1.0 {
                assumed.say(format!("`{kind}`: {kelvin} K becomes {taken} K"));
            }
            let _ = write!(out, "  {taken} K");
        }
        None => assumed.say(format!("`{kind}`: white light")),
    }
    if let Some(gel) = hung.colour.and_then(gel) {
        let _ = write!(out, "  {gel}");
    }
    out + &moves
}

/// Aim of a fixture: its focus point, else the point where its beam meets the floor, or five metres
/// along it. The beam follows the mount and the preset pan and tilt.
fn aim(
    plan: &Plan,
    hung: &Hung,
    (frame, head): (Frame, Option<&Hanging<'_>>),
    assumed: &mut Assumed,
) -> [f64; 3] {
    let focus = hung.focus.as_ref().and_then(|focus| plan.focus.get(focus));
    let [x, y, z] = frame.origin;
    // A focus point at the fixture itself, in the precision of the text, gives no direction.
    if let Some(focus) = focus.filter(|focus| point(**focus) != point(frame.origin)) {
        if head.is_none_or(|head| head.reaches(*focus)) {
            return *focus;
        }
        assumed.say("heads that cannot reach their focus points look as they hang");
    } else {
        assumed.say("fixtures without a focus point look as they hang");
    }
    let [dx, dy, dz] = frame.direction(hung.direction());
    let length = (dx * dx + dy * dy + dz * dz).sqrt();
    let [dx, dy, dz] = if length > 1e-6 {
        [dx / length, dy / length, dz / length]
    } else {
        assumed.say("fixtures whose matrix turns nowhere look straight down");
        [0.0, 0.0, -1.0]
    };
    let far = if dz < -0.1 && z > 0.1 { -z / dz } else { 5.0 };
    let far = far.min(50.0);
    [x + far * dx, y + far * dy, z + far * dz]
}

/// Adds the lines of a patch file for a fixture.
fn addresses(hung: &Hung, fixture: &Fixture, rgb: bool, channel: &mut Channel, out: &mut Carried) {
    let Some(written) = &hung.address else {
        return;
    };
    let Some((universe, start)) = addressed(written) else {
        let what = format!("`{}`: `{written}` is no address of DMX", hung.name);
        out.losses.push(Loss::new(what).line(hung.line));
        return;
    };
    let at = |(offset, low): (u16, Option<u16>)| {
        let fine = low == offset.checked_add(1);
        let sixteen = if fine { " 16bit" } else { "" };
        format!("{universe}/{}{sixteen}", start + u32::from(offset) - 1)
    };
    match (rgb, fixture.rgb, fixture.dimmer) {
        (true, [Some(red), Some(green), Some(blue)], dimmer) => {
            let step = if red.1.is_some() { 2 } else { 1 };
            let in_a_row = green.0 == red.0 + step && blue.0 == green.0 + step;
            if in_a_row {
                channel.addresses.push(at(red))
            } else {
                let what = format!("`{}`: its emitters are not in a row: no address", hung.name);
                out.losses.push(Loss::new(what).line(hung.line));
            }
            if dimmer.is_some() {
                let what = format!("`{}`: its own dimmer is to stand at full", hung.name);
                out.losses.push(Loss::new(what).line(hung.line));
            }
        }
        (_, _, Some(dimmer)) => channel.addresses.push(at(dimmer)),
        (_, _, None) => channel.addresses.push(at((1, None))),
    }
}

fn losses(hung: &Hung, fixture: &Fixture, out: &mut Carried) {
    let mut say = |what: String| out.losses.push(Loss::new(what).line(hung.line));
    if fixture.mixes_otherwise {
        say(format!(
            "`{}`: colours other than red, green and blue",
            hung.name
        ));
    }
    if fixture.is_without_beam {
        say(format!(
            "`{}` has a lamp that only glows: left out",
            hung.name
        ));
    }
    if fixture.beams > 1 {
        say(format!(
            "`{}` has {} beams: one light at the first",
            hung.name, fixture.beams
        ));
    }
}

/// A gel's colour from CIE x, y, Y, scaled to full brightness; `None` for white.
fn gel([x, y, luminance]: [f64; 3]) -> Option<String> {
    if y <= 0.0 || luminance <= 0.0 {
        return None;
    }
    let Rgb(linear) = Rgb::from_chromaticity(x, y);
    let most = linear.iter().copied().fold(0.0, f64::max);
    let [r, g, b] = Rgb(linear.map(|c| c / most.max(1e-9))).to_srgb8();
    let white = [r, g, b].iter().all(|code| *code > 250);
    (!white).then(|| format!("#{r:02x}{g:02x}{b:02x}"))
}

fn point(at: [f64; 3]) -> String {
    at.map(rounded).join(", ")
}
