//! Reads a desk's file, record by record.
//!
//! Palettes, curves and fixture types may follow the cues that use them, so there are two passes:
//! first everything except cues, then the cues of one list. Every record is either used or counted
//! among the losses.

mod cues;
mod rig;

use std::collections::{BTreeMap, BTreeSet};

use super::model::{Channel, Desk, Group, Tenths};
use super::record::{Record, records};
use super::{LIMIT, MOST_CHANNELS, MOST_GROUPS};
use crate::{ImportError, Loss};
use footlight_host::work::Work;
use footlight_show::diagnostic::Diagnostic;
use footlight_show::units::Time;

type Refused = Box<Diagnostic>;

/// A desk's show, with the losses.
pub struct Read {
    pub show: Desk,
    pub losses: Vec<Loss>,
}

/// Values of a channel in a palette or preset.
#[derive(Clone, Debug, Default)]
struct Values {
    level: Option<Tenths>,
    colour: [Option<f64>; 3],
}

/// Section to which a record belongs.
#[derive(Clone, Debug, Default, PartialEq)]
enum Section {
    #[default]
    Head,
    Patch(u32),
    Personality(u32),
    Group,
    Look,
    /// `CP`, `IP` or `PR` with its number.
    Palette(String),
    Curve(u32),
    CueList(String),
    Cue,
    /// A cue of another list.
    OtherCue,
    /// A section that is not read, by its keyword.
    Other(String),
}

/// The owner of the last ASCII label.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Text {
    #[default]
    Label,
    Note,
    Other,
}

/// Unread records of one kind.
#[derive(Debug)]
struct Unread {
    first: usize,
    count: usize,
    why: &'static str,
}

#[derive(Default)]
struct Reader {
    show: Desk,
    losses: Vec<Loss>,
    section: Section,
    /// Bytes of a fixture type's parameters, by type and parameter.
    sizes: BTreeMap<(u32, u32), u32>,
    kinds: BTreeSet<u32>,
    /// Degrees of pan and tilt of a fixture type: first and last value, and their degrees.
    degrees: BTreeMap<(u32, u32), [f64; 4]>,
    /// Parameter of the last `$$PersChan`.
    parameter: u32,
    members: usize,
    palettes: BTreeMap<String, BTreeMap<u32, Values>>,
    unread: BTreeMap<String, Unread>,
    /// Owner of the next `$$UText`.
    labelled: Text,
    /// The cue list being read, and the number of cues in others.
    list: Option<String>,
    others: BTreeMap<String, (usize, usize)>,
    lines: BTreeMap<u32, usize>,
    /// Time records seen in the current part.
    timed: BTreeSet<String>,
    known: usize,
}

/// Parameter numbers of red, green and blue.
const EMITTERS: [u32; 3] = [12, 13, 14];
/// Parameter numbers of pan and tilt.
const AXES: [u32; 2] = [2, 3];

/// Reads `text`, the content of the file `name`, with the cues of one list, or of the first.
pub fn read(
    name: &str,
    text: &str,
    list: Option<u32>,
    work: Work<'_>,
) -> Result<Read, ImportError> {
    if text.len() > LIMIT {
        let message = format!("`{name}` has {} bytes; {LIMIT} are read", text.len());
        return Err(Box::new(Diagnostic::error("", message)).into());
    }
    let mut reader = Reader {
        list: list.map(|list| list.to_string()),
        ..Reader::default()
    };
    for cues in [false, true] {
        reader.section = Section::Head;
        let mut records = records(text);
        for record in records.by_ref() {
            if record.key == "enddata" {
                break;
            }
            work.check()?;
            reader.record(&record, cues)?;
        }
        reader.mix();
        if let Some(cue) = records.find(|record| cues && record.key == "cue") {
            let what = "cues behind `EndData`, where the file ends, are not read";
            reader.losses.push(Loss::new(what).line(cue.line));
        }
    }
    if reader.known == 0 {
        let message = format!("`{name}` is no USITT ASCII file: no line begins with a word of it");
        let help = "export the show from the desk as USITT ASCII (.asc)";
        return Err(Box::new(Diagnostic::error("", message).help(help)).into());
    }
    if let (Some(list), true) = (list, reader.show.cues.is_empty()) {
        let others = reader.others.iter();
        let others = others.map(|(list, (_, count))| format!("{list} ({})", cues(*count)));
        let others: Vec<String> = others.collect();
        let message = format!("`{name}` has no cue of list {list}");
        let error = Diagnostic::error("", message);
        return Err(Box::new(if others.is_empty() {
            error.help("it has no cues")
        } else {
            error.help(format!("its lists: {}", others.join(", ")))
        })
        .into());
    }
    Ok(reader.finish())
}

impl Reader {
    /// Handles a record, in the pass for cues or the one before.
    fn record(&mut self, record: &Record<'_>, cues: bool) -> Result<(), Refused> {
        // Cues of other lists, and those with more than one decimal.
        let is_cue = record.key == "cue" || (record.key == "$cue" && self.is_etc());
        let is_primary = matches!(record.key.as_str(), "cue" | "group" | "sub" | "patch")
            || (record.key.starts_with('$') && !record.key.starts_with("$$"));
        if is_primary {
            return self.begin(record, is_cue, cues);
        }
        let in_cue = matches!(self.section, Section::Cue | Section::OtherCue);
        if matches!(
            record.key.as_str(),
            "ident" | "manufacturer" | "console" | "clear" | "set"
        ) {
            self.section = Section::Head;
        } else if in_cue != cues {
            return Ok(());
        }
        match self.section.clone() {
            Section::Head if cues => Ok(()),
            Section::Head => self.head(record),
            Section::Patch(channel) => self.of_patch(record, channel),
            Section::Personality(number) => self.of_personality(record, number),
            Section::Group => self.of_group(record),
            Section::Look => self.of_look(record),
            Section::Palette(key) => self.of_palette(record, &key),
            Section::Curve(number) => self.of_curve(record, number),
            Section::CueList(_) if record.key == "text" => Ok(()),
            Section::CueList(_) => self.skip(record, "$CueList", ""),
            Section::Cue => self.of_cue(record),
            Section::OtherCue => Ok(()),
            Section::Other(key) => self.skip(record, &key, why(&key)),
        }
    }

    /// Handles a record that begins a section.
    fn begin(&mut self, record: &Record<'_>, is_cue: bool, cues: bool) -> Result<(), Refused> {
        self.labelled = Text::Label;
        if is_cue != cues {
            self.section = if is_cue {
                Section::OtherCue
            } else {
                Section::Head
            };
            return Ok(());
        }
        self.known += 1;
        if is_cue {
            self.section = self.cue(record)?;
            return Ok(());
        }
        if self.show.groups.len().max(self.show.looks.len()) >= MOST_GROUPS {
            return record.refuse(
                format!("more than {MOST_GROUPS} groups or submasters"),
                "leave out what no cue uses",
            );
        }
        let number = record.words().next();
        self.section = match record.key.as_str() {
            "patch" => self.soft_patch(record)?,
            "$patch" => self.patch(record)?,
            "$personality" => Section::Personality(record.number(number)?),
            "group" | "$group" => {
                self.show.groups.push(Group {
                    number: number.unwrap_or_default().to_owned(),
                    ..Group::default()
                });
                Section::Group
            }
            "sub" => self.look(record, "sub"),
            "$preset" => {
                let key = format!("PR{}", number.unwrap_or_default());
                self.look(record, "preset");
                Section::Palette(key)
            }
            "$colorpalette" => Section::Palette(format!("CP{}", number.unwrap_or_default())),
            "$intenspalette" => Section::Palette(format!("IP{}", number.unwrap_or_default())),
            "$curve" => Section::Curve(record.number(number)?),
            "$cuelist" => Section::CueList(number.unwrap_or_default().to_owned()),
            "$paramtype" => Section::Other("$paramtype".to_owned()),
            other => {
                self.skip(record, other, why(other))?;
                Section::Other(other.to_owned())
            }
        };
        Ok(())
    }

    /// True for a file of an ETC desk, whose own records are known.
    fn is_etc(&self) -> bool {
        let console = self.show.console.to_ascii_lowercase();
        console
            .split(' ')
            .any(|word| word == "etc" || word == "eos")
    }

    /// Counts an unread record.
    fn skip(&mut self, record: &Record<'_>, key: &str, why: &'static str) -> Result<(), Refused> {
        let named = if key.starts_with("cue ") {
            key.to_owned()
        } else {
            format!("{key} {}", record.key)
        };
        let named = match named.split_once(' ') {
            Some((a, b)) if a == b => a.to_owned(),
            // One line is enough for a whole section.
            Some((a, _)) if !why.is_empty() && a != "cue" => a.to_owned(),
            _ => named,
        };
        let unread = self.unread.entry(named).or_insert(Unread {
            first: record.line,
            count: 0,
            why,
        });
        unread.count += 1;
        Ok(())
    }

    fn head(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        let mut words = record.words();
        match record.key.as_str() {
            "ident" | "clear" => self.known += 1,
            "manufacturer" | "console" => {
                let console = format!("{} {}", self.show.console, record.text());
                self.show.console = console.trim().to_owned();
            }
            "$$title" => self.show.title = record.text(),
            "set" => {
                self.known += 1;
                let which = words.next().unwrap_or_default().to_ascii_lowercase();
                match (which.as_str(), words.next()) {
                    ("$$timeup", Some(time)) => {
                        let down = self.show.time.map_or(Time::ZERO, |time| time.1);
                        self.show.time = Some((record.time(time)?, down));
                    }
                    ("$$timedown", Some(time)) => {
                        let up = self.show.time.map_or(Time::ZERO, |time| time.0);
                        self.show.time = Some((up, record.time(time)?));
                    }
                    ("channels" | "patch" | "dimmers", _) => {}
                    _ => return self.skip(record, "set", "settings of the desk"),
                }
            }
            "$$format" | "$$software" => {}
            _ => return self.skip(record, "head", ""),
        }
        Ok(())
    }

    fn channel(&mut self, number: u32, record: &Record<'_>) -> Result<&mut Channel, Refused> {
        if self.show.channels.len() >= MOST_CHANNELS && !self.show.channels.contains_key(&number) {
            return record.refuse(
                format!("more than {MOST_CHANNELS} channels"),
                "leave out what no cue uses",
            );
        }
        Ok(self.show.channels.entry(number).or_default())
    }

    /// Finds channels whose fixtures mix colours, or turn by known degrees through straight down.
    fn mix(&mut self) {
        for channel in self.show.channels.values_mut() {
            let mixes = |kind: u32| {
                EMITTERS
                    .iter()
                    .all(|e| self.sizes.contains_key(&(kind, *e)))
            };
            channel.rgb |= channel.personality.is_some_and(mixes);
            let range = |axis: u32| {
                let [.., from, to] = *self.degrees.get(&(channel.personality?, axis))?;
                Some([from.min(to), from.max(to)]).filter(|[low, high]| *low <= 0.0 && *high >= 0.0)
            };
            let [pan, tilt] = AXES.map(range);
            channel.head = pan.zip(tilt).map(|(pan, tilt)| [pan, tilt]);
        }
    }

    fn finish(mut self) -> Read {
        for (key, unread) in &self.unread {
            let records = match unread.count {
                1 => "1 record".to_owned(),
                count => format!("{count} records, the first here"),
            };
            let why = match unread.why {
                "" => String::new(),
                why => format!(": {why}"),
            };
            let what = format!("`{key}` is not read ({records}){why}");
            self.losses.push(Loss::new(what).line(unread.first));
        }
        for (list, (line, count)) in &self.others {
            let what = format!(
                "list {list} ({}) is left out: `--list {list}` reads it in place of this one",
                cues(*count)
            );
            self.losses.push(Loss::new(what).line(*line));
        }
        self.show.cues.sort_by_key(|cue| cue.number);
        Read {
            show: self.show,
            losses: self.losses,
        }
    }
}

fn cues(count: usize) -> String {
    match count {
        1 => "1 cue".to_owned(),
        count => format!("{count} cues"),
    }
}

/// The text of a `Text` or `$$UText`, if not empty.
fn label(record: &Record<'_>) -> Option<String> {
    match record.key.as_str() {
        "text" => Some(record.text()),
        _ => utf16(record),
    }
}

/// `$$UText`: UTF-16, each unit as four hexadecimal digits, the lower byte first.
fn utf16(record: &Record<'_>) -> Option<String> {
    let unit = |word: &str| u16::from_str_radix(word, 16).ok().map(u16::swap_bytes);
    let units: Option<Vec<u16>> = record.words().map(unit).collect();
    let text = String::from_utf16(&units?).ok()?;
    Some(text.chars().filter(|c| !c.is_control()).collect())
}

/// The reason why a record is not read.
fn why(key: &str) -> &'static str {
    match key {
        "cue $$timeposition" | "cue $$timegraphic" => "positions take the up time",
        "cue $$timecolor" => "",
        "cue $$paramtimes" => "times of parameters other than the level",
        "$effect" => "effects are written by hand: `effect NAME = …`",
        "$paramtype" => "red, green and blue are 12, 13 and 14",
        "$focuspalette" | "$beampalette" => "positions are written by hand: `point NAME = …`",
        "$macro" | "$snapshot" | "$magicsheet" | "$partition" | "$pixmap" => "part of the desk",
        _ => "",
    }
}
