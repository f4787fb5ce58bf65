//! A desk's file, record by record.
//!
//! Palettes, curves and types of fixtures may stand behind the cues that use them, so the text is
//! gone through twice: first for everything but cues, then for the cues of the first list. Every
//! record is either used or counted among the losses.

use std::collections::{BTreeMap, BTreeSet};

use super::model::{Channel, Cue, Curve, Desk, Group, Look, Part, Tenths};
use super::record::{Record, records};
use super::{LIMIT, MOST_CHANNELS, MOST_CUES, MOST_GROUPS, MOST_MEMBERS};
use crate::desk::Loss;
use crate::diagnostic::Diagnostic;
use crate::units::Time;

type Refused = Box<Diagnostic>;

/// A desk's show, with what of the file is not in it.
pub struct Read {
    pub show: Desk,
    pub losses: Vec<Loss>,
}

/// What a palette or preset sets of a channel.
#[derive(Clone, Debug, Default)]
struct Values {
    level: Option<Tenths>,
    colour: [Option<f64>; 3],
}

/// Where a record belongs.
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
    /// What is not read, by its keyword.
    Other(String),
}

/// Records of a kind that are not read.
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
    members: usize,
    palettes: BTreeMap<String, BTreeMap<u32, Values>>,
    unread: BTreeMap<String, Unread>,
    /// The list whose cues are read, and how many cues others have.
    list: Option<String>,
    others: BTreeMap<String, (usize, usize)>,
    lines: BTreeMap<u32, usize>,
    known: usize,
}

/// Red, green and blue among a desk's parameters.
const EMITTERS: [u32; 3] = [12, 13, 14];

/// Reads `text`, which the file `name` holds.
pub fn read(name: &str, text: &str) -> Result<Read, Refused> {
    if text.len() > LIMIT {
        let message = format!("`{name}` has {} bytes; {LIMIT} are read", text.len());
        return Err(Box::new(Diagnostic::error("", message)));
    }
    let mut reader = Reader::default();
    for cues in [false, true] {
        reader.section = Section::Head;
        for record in records(text) {
            if record.key == "enddata" {
                break;
            }
            reader.record(&record, cues)?;
        }
        reader.mix();
    }
    if reader.known == 0 {
        let message = format!("`{name}` is no USITT ASCII file: no line begins with a word of it");
        let help = "export the show from the desk as USITT ASCII (.asc)";
        return Err(Box::new(Diagnostic::error("", message).help(help)));
    }
    reader.finish()
}

impl Reader {
    /// One record, in the pass through the cues or the one before it.
    fn record(&mut self, record: &Record<'_>, cues: bool) -> Result<(), Refused> {
        let is_primary = matches!(record.key.as_str(), "cue" | "group" | "sub" | "patch")
            || (record.key.starts_with('$') && !record.key.starts_with("$$"));
        if is_primary {
            return self.begin(record, cues);
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

    /// A record that begins something.
    fn begin(&mut self, record: &Record<'_>, cues: bool) -> Result<(), Refused> {
        if (record.key == "cue") != cues {
            self.section = match record.key.as_str() {
                "cue" => Section::OtherCue,
                _ => Section::Head,
            };
            return Ok(());
        }
        self.known += 1;
        if self.show.groups.len().max(self.show.looks.len()) >= MOST_GROUPS {
            return record.refuse(
                format!("more than {MOST_GROUPS} groups or submasters"),
                "leave out what no cue uses",
            );
        }
        let number = record.words().next();
        self.section = match record.key.as_str() {
            "cue" => self.cue(record)?,
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
            "$intensitypalette" => Section::Palette(format!("IP{}", number.unwrap_or_default())),
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

    /// Counts a record that is not read.
    fn skip(&mut self, record: &Record<'_>, key: &str, why: &'static str) -> Result<(), Refused> {
        let named = match key.starts_with("cue ") {
            true => key.to_owned(),
            false => format!("{key} {}", record.key),
        };
        let named = match named.split_once(' ') {
            Some((a, b)) if a == b => a.to_owned(),
            // Of sections that are not read as a whole one line says enough.
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

    /// The channel of this number.
    fn channel(&mut self, number: u32, record: &Record<'_>) -> Result<&mut Channel, Refused> {
        if self.show.channels.len() >= MOST_CHANNELS && !self.show.channels.contains_key(&number) {
            return record.refuse(
                format!("more than {MOST_CHANNELS} channels"),
                "leave out what no cue uses",
            );
        }
        Ok(self.show.channels.entry(number).or_default())
    }

    /// `Patch PAGE CHANNEL<DIMMER@LEVEL …`.
    fn soft_patch(&mut self, record: &Record<'_>) -> Result<Section, Refused> {
        let words: Vec<&str> = record.words().skip(1).collect();
        for patched in words.chunks(3) {
            let (Some(channel), Some(dimmer)) = (patched.first(), patched.get(1)) else {
                return record.refuse(
                    "a channel without its dimmer".to_owned(),
                    "a dimmer is patched as `Patch 1 12<34@100`",
                );
            };
            let channel = record.channel(channel)?;
            self.channel(channel, record)?;
            let level = patched.get(2).map_or(Ok(1000), |word| record.level(word))?;
            if level != 1000 {
                let percent = f64::from(level) / 10.0;
                let what =
                    format!("dimmer {dimmer} of channel {channel} is patched at {percent} %");
                let loss = Loss::new(what).line(record.line);
                self.losses.push(loss.light(1.0 - percent / 100.0));
            }
        }
        Ok(Section::Other("patch".to_owned()))
    }

    /// `$Patch CHANNEL TYPE ADDRESS …`; some programs write the address first.
    fn patch(&mut self, record: &Record<'_>) -> Result<Section, Refused> {
        let mut words = record.words();
        let number = record.channel(words.next().unwrap_or_default())?;
        let words: Vec<u32> = words.map_while(|word| word.parse().ok()).collect();
        let known = |kind: &&u32| self.kinds.contains(kind);
        let kind = words.iter().take(2).find(known).or(words.first()).copied();
        let channel = self.channel(number, record)?;
        channel.personality = kind;
        Ok(Section::Patch(number))
    }

    fn of_patch(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
        let label = match record.key.as_str() {
            "text" => record.text(),
            "$$utext" => utf16(record).unwrap_or_default(),
            "$$pers" => return Ok(()),
            _ => return self.skip(record, "$patch", "no places, no gels"),
        };
        if !label.is_empty() {
            self.channel(number, record)?.label = label;
        }
        Ok(())
    }

    fn of_personality(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
        if record.key != "$$perschan" {
            return self.skip(
                record,
                "$personality",
                "of a type of fixture its colours are read",
            );
        }
        let words: Vec<u32> = record.words().map_while(|word| word.parse().ok()).collect();
        if let [parameter, size, ..] = words.as_slice() {
            self.sizes.insert((number, *parameter), *size);
            self.kinds.insert(number);
        }
        Ok(())
    }

    fn of_group(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        match record.key.as_str() {
            "text" | "$$utext" => {
                let label = label(record);
                if let (Some(group), Some(label)) = (self.show.groups.last_mut(), label) {
                    group.label = label;
                }
                Ok(())
            }
            "$$chanlist" => self.members(record, record.rest),
            "chan" => {
                let mut levels = BTreeMap::new();
                for (channel, level) in record.pairs()? {
                    levels.insert(record.channel(channel)?, record.level(level)?);
                }
                let list: Vec<String> = levels.keys().map(u32::to_string).collect();
                if levels.values().any(|level| *level != 1000) {
                    let what = "a group's levels: of a group only its channels are read";
                    self.losses.push(Loss::new(what).line(record.line));
                }
                self.members(record, &list.join(" "))
            }
            key if key.bytes().all(|b| b.is_ascii_digit()) => {
                let list = format!("{key} {}", record.rest);
                self.members(record, &list)
            }
            _ => self.skip(record, "$group", ""),
        }
    }

    /// Adds channels to the last group: `1 2 5 thru 8`.
    fn members(&mut self, record: &Record<'_>, list: &str) -> Result<(), Refused> {
        let mut channels = Vec::new();
        let mut words = list.split_whitespace().peekable();
        while let Some(word) = words.next() {
            let first = record.channel(word)?;
            let is_range = words.peek().is_some_and(|w| w.eq_ignore_ascii_case("thru"));
            let last = match is_range {
                true => words
                    .nth(1)
                    .map_or(Ok(first), |word| record.channel(word))?,
                false => first,
            };
            if last.saturating_sub(first) as usize >= MOST_CHANNELS {
                return record.refuse(
                    format!("more than {MOST_CHANNELS} channels in a row"),
                    "leave out what no cue uses",
                );
            }
            channels.extend(first..=last);
            if channels.len() > MOST_MEMBERS {
                break;
            }
        }
        self.members += channels.len();
        if self.members > MOST_MEMBERS {
            return record.refuse(
                format!("more than {MOST_MEMBERS} channels in all groups"),
                "leave out what no cue uses",
            );
        }
        for channel in &channels {
            self.channel(*channel, record)?;
        }
        if let Some(group) = self.show.groups.last_mut() {
            group.channels.extend(channels);
        }
        Ok(())
    }

    fn look(&mut self, record: &Record<'_>, word: &'static str) -> Section {
        let number = record.words().next().unwrap_or_default().to_owned();
        self.show.looks.push(Look {
            line: record.line,
            word,
            number,
            ..Look::default()
        });
        Section::Look
    }

    fn of_look(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        match record.key.as_str() {
            "text" | "$$utext" => {
                if let (Some(look), Some(label)) = (self.show.looks.last_mut(), label(record)) {
                    look.label = label;
                }
            }
            "chan" | "$$chanmove" => {
                for (channel, level) in record.pairs()? {
                    let (channel, level) = (record.channel(channel)?, record.level(level)?);
                    self.channel(channel, record)?;
                    if let Some(look) = self.show.looks.last_mut() {
                        look.levels.insert(channel, level);
                    }
                }
            }
            _ => return self.skip(record, "sub", "fades of submasters"),
        }
        Ok(())
    }

    fn of_palette(&mut self, record: &Record<'_>, key: &str) -> Result<(), Refused> {
        let is_preset = key.starts_with("PR");
        match record.key.as_str() {
            "text" | "$$utext" if is_preset => return self.of_look(record),
            "text" | "$$utext" => {}
            "chan" | "$$chanmove" => {
                for (channel, level) in record.pairs()? {
                    let (channel, level) = (record.channel(channel)?, record.level(level)?);
                    self.values(key, channel).level = Some(level);
                }
                if is_preset {
                    return self.of_look(record);
                }
            }
            "$$param" => {
                let (channel, values) = self.parameters(record)?;
                for (parameter, value) in values {
                    let emitter = EMITTERS.iter().position(|e| *e == parameter);
                    let value = self.value(channel, parameter, value);
                    if let (Some(emitter), Some(value)) = (emitter, value)
                        && let Some(place) = self.values(key, channel).colour.get_mut(emitter)
                    {
                        *place = Some(value);
                    }
                }
            }
            _ => return self.skip(record, "palette", ""),
        }
        Ok(())
    }

    fn values(&mut self, key: &str, channel: u32) -> &mut Values {
        let palette = self.palettes.entry(key.to_owned()).or_default();
        palette.entry(channel).or_default()
    }

    fn of_curve(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
        let curve: &mut Curve = self.show.curves.entry(number).or_default();
        match record.key.as_str() {
            "text" => curve.label = record.text(),
            "$$curvepoint" => {
                for (at, value) in record.pairs()? {
                    let (at, value) = (record.level(at)?, record.level(value)?);
                    curve
                        .points
                        .push((f64::from(at) / 1000.0, f64::from(value) / 1000.0));
                }
            }
            // The same curve in 256 steps.
            "$$curvedata" | "$$interpolated" => {}
            _ => return self.skip(record, "$curve", ""),
        }
        Ok(())
    }

    /// `Cue NUMBER LIST`, or `Cue NUMBER/PART LIST`.
    fn cue(&mut self, record: &Record<'_>) -> Result<Section, Refused> {
        let (number, part) = match record.rest.split_once('/') {
            Some((number, rest)) => (number.trim(), rest.split_whitespace().next()),
            None => (record.words().next().unwrap_or_default(), None),
        };
        let skipped = usize::from(part.is_some());
        let list = record.words().nth(1 + skipped).unwrap_or("1").to_owned();
        let first = self.list.get_or_insert_with(|| list.clone());
        if *first != list {
            let other = self.others.entry(list).or_insert((record.line, 0));
            other.1 += 1;
            return Ok(Section::OtherCue);
        }
        let number = record.cue(number)?;
        let last = self.show.cues.last().map(|cue| cue.number);
        if part.is_some() && last == Some(number) {
            self.part(record, record.number(part)?)?;
            return Ok(Section::Cue);
        }
        if let Some(earlier) = self.lines.insert(number.thousandths(), record.line) {
            return record.refuse(
                format!("cue {number} stands in line {earlier} already"),
                "a number is used once in a list",
            );
        }
        if self.show.cues.len() >= MOST_CUES {
            return record.refuse(
                format!("more than {MOST_CUES} cues"),
                "export fewer cues from the desk",
            );
        }
        let part = Part {
            line: record.line,
            ..Part::default()
        };
        self.show.cues.push(Cue {
            line: record.line,
            number,
            follow: None,
            hang: None,
            block: false,
            assert: false,
            note: String::new(),
            parts: vec![part],
        });
        Ok(Section::Cue)
    }

    /// Part `number` of the last cue.
    fn part(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
        let Some(cue) = self.show.cues.last_mut() else {
            return Ok(());
        };
        // What stands before the first part is the cue's own.
        let is_own = |part: &Part| part.moves.is_empty() && part.lit.is_none();
        if number > 1 || !cue.parts.iter().all(is_own) {
            let label = String::new();
            let line = record.line;
            cue.parts.push(Part {
                line,
                label,
                ..Part::default()
            });
        }
        match cue.parts.len() > MOST_CHANNELS {
            true => record.refuse("too many parts".to_owned(), "a desk has 20 parts in a cue"),
            false => Ok(()),
        }
    }

    fn of_cue(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        if record.key == "part" {
            return self.part(record, record.number(record.words().next())?);
        }
        let number = self.show.cues.last().map(|cue| cue.number.to_string());
        let loss = |what: String| {
            let loss = Loss::new(what).line(record.line);
            loss.cue(number.clone().unwrap_or_default())
        };
        match record.key.as_str() {
            "chan" | "$$chanmove" => return self.levels(record),
            "$$param" => return self.colours(record),
            "$$paramtimes" => return self.own_time(record),
            "link" => {
                let what = format!("`Link {}`: cues run in their order here", record.rest);
                self.losses.push(loss(what));
                return Ok(());
            }
            "$$rate" | "$$effect" | "$$mark" | "$$loop" | "$$allfade" => {
                let what = format!("`{} {}` is not read", record.key, record.rest);
                self.losses.push(loss(what));
                return Ok(());
            }
            _ => {}
        }
        let Some(cue) = self.show.cues.last_mut() else {
            return Ok(());
        };
        let Some(part) = cue.parts.last_mut() else {
            return Ok(());
        };
        let words = || record.words().next().unwrap_or_default();
        match record.key.as_str() {
            "text" => part.label = record.text(),
            "$$utext" => part.label = utf16(record).unwrap_or(std::mem::take(&mut part.label)),
            "up" => part.up = Some(record.fade()?),
            "down" => part.down = Some(record.fade()?),
            "$$timeup" => part.up = part.up.or(Some(record.fade()?)),
            "$$timedown" => part.down = part.down.or(Some(record.fade()?)),
            "$$timecolor" => part.colour = Some(record.fade()?),
            "$$curve" => part.curve = Some(record.number(record.words().next())?),
            "followon" => cue.follow = cue.follow.or(Some(record.time(words())?)),
            "$$follow" => cue.follow = Some(record.time(words())?),
            "$$hang" => cue.hang = Some(record.time(words())?),
            "$$block" => cue.block = true,
            "$$assert" => cue.assert = true,
            "$$notes" => cue.note = record.text(),
            key => {
                let key = format!("cue {key}");
                return self.skip(record, &key, why(&key));
            }
        }
        Ok(())
    }

    /// `Chan` or `$$ChanMove`: levels of channels.
    fn levels(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        let moves = record.key != "chan";
        for (channel, word) in record.pairs()? {
            let channel = record.channel(channel)?;
            self.channel(channel, record)?;
            let Some(level) = self.resolved(record, channel, word)? else {
                continue;
            };
            let part = self
                .show
                .cues
                .last_mut()
                .and_then(|cue| cue.parts.last_mut());
            let Some(part) = part else { continue };
            match moves {
                true => part.moves.insert(channel, level),
                false => part.lit.get_or_insert_default().insert(channel, level),
            };
        }
        match moves {
            true => self.show.tracks = true,
            false => self.show.states = true,
        }
        Ok(())
    }

    /// A level, or that of the palette which stands in its place.
    fn resolved(
        &mut self,
        record: &Record<'_>,
        channel: u32,
        word: &str,
    ) -> Result<Option<Tenths>, Refused> {
        if !word.starts_with("IP") && !word.starts_with("PR") {
            return record.level(word).map(Some);
        }
        let found = self.palettes.get(word).and_then(|p| p.get(&channel)?.level);
        if found.is_none() {
            let what = format!("channel {channel} at `{word}`, which has no level for it");
            let cue = self.show.cues.last().map(|cue| cue.number.to_string());
            let loss = Loss::new(what).line(record.line).light(1.0);
            self.losses.push(loss.cue(cue.unwrap_or_default()));
        }
        Ok(found)
    }

    /// `$$Param CHANNEL PARAMETER@VALUE …`.
    #[expect(clippy::type_complexity, reason = "a channel with pairs of words")]
    fn parameters<'a>(
        &mut self,
        record: &Record<'a>,
    ) -> Result<(u32, Vec<(u32, &'a str)>), Refused> {
        let words: Vec<&str> = record.words().collect();
        let Some((channel, values)) = words.split_first() else {
            return record.refuse("no channel".to_owned(), "`$$Param 12 13@255`");
        };
        let channel = record.channel(channel)?;
        self.channel(channel, record)?;
        let mut out = Vec::new();
        for pair in values.chunks(2) {
            match pair {
                [parameter, value] => out.push((record.number(Some(parameter))?, *value)),
                _ => return record.refuse("a parameter without a value".to_owned(), "`13@255`"),
            }
        }
        Ok((channel, out))
    }

    /// The value of an emitter, 0 to 1.
    fn value(&self, channel: u32, parameter: u32, word: &str) -> Option<f64> {
        let value: f64 = word.parse().ok().filter(|v: &f64| *v >= 0.0)?;
        let kind = self.show.channels.get(&channel).and_then(|c| c.personality);
        let size = kind.and_then(|kind| self.sizes.get(&(kind, parameter)));
        let full = match size {
            Some(2) => 65535.0,
            Some(_) => 255.0,
            None if value > 255.0 => 65535.0,
            None => 255.0,
        };
        Some((value / full).min(1.0))
    }

    fn colours(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        let (channel, values) = self.parameters(record)?;
        let mut colour = [None; 3];
        let mut others = Vec::new();
        for (parameter, word) in values {
            let emitter = EMITTERS.iter().position(|e| *e == parameter);
            match emitter.and_then(|emitter| colour.get_mut(emitter).zip(Some(emitter))) {
                Some((place, emitter)) => {
                    let palette = self.palettes.get(word).and_then(|p| p.get(&channel));
                    let of_palette = palette.and_then(|v| v.colour.get(emitter).copied().flatten());
                    *place = self.value(channel, parameter, word).or(of_palette);
                    if place.is_none() {
                        others.push(format!("{parameter}@{word}"));
                    }
                }
                // The intensity stands among the levels too.
                None if parameter == 1 => {}
                None => others.push(format!("{parameter}@{word}")),
            }
        }
        let cue = self.show.cues.last().map(|cue| cue.number.to_string());
        if !others.is_empty() {
            let what = format!(
                "channel {channel}: parameters {} (more emitters, places, shapes)",
                others.join(" ")
            );
            let loss = Loss::new(what).line(record.line);
            self.losses.push(loss.cue(cue.unwrap_or_default()));
        }
        if colour.iter().any(Option::is_some) {
            self.channel(channel, record)?.rgb = true;
            let part = self
                .show
                .cues
                .last_mut()
                .and_then(|cue| cue.parts.last_mut());
            if let Some(part) = part {
                part.colours.insert(channel, colour);
            }
        }
        Ok(())
    }

    /// `$$ParamTimes CHANNEL PARAMETER TIME DELAY`: a level with a time of its own.
    fn own_time(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        let words: Vec<&str> = record.words().collect();
        let [channel, "1", time, rest @ ..] = words.as_slice() else {
            return self.skip(record, "cue $$paramtimes", why("cue $$paramtimes"));
        };
        let own = |word: Option<&&str>| match word {
            None | Some(&"-") => Ok(Time::ZERO),
            Some(word) => record.time(word),
        };
        let (channel, delay) = (record.channel(channel)?, own(rest.first())?);
        let time = own(Some(time))?;
        let part = self
            .show
            .cues
            .last_mut()
            .and_then(|cue| cue.parts.last_mut());
        if let Some(part) = part {
            part.times
                .insert(channel, super::model::Fade { time, delay });
        }
        Ok(())
    }

    /// Channels whose fixtures mix colours.
    fn mix(&mut self) {
        for channel in self.show.channels.values_mut() {
            let mixes = |kind: u32| {
                EMITTERS
                    .iter()
                    .all(|e| self.sizes.contains_key(&(kind, *e)))
            };
            channel.rgb |= channel.personality.is_some_and(mixes);
        }
    }

    fn finish(mut self) -> Result<Read, Refused> {
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
            let what =
                format!("list {list} ({count} of its records begin a cue): the first list is read");
            self.losses.push(Loss::new(what).line(*line));
        }
        self.show.cues.sort_by_key(|cue| cue.number);
        Ok(Read {
            show: self.show,
            losses: self.losses,
        })
    }
}

/// The text of a `Text` or `$$UText`, if there is one.
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

/// Why records are not read.
fn why(key: &str) -> &'static str {
    match key {
        "cue $$timeposition" | "cue $$timegraphic" => "lights do not move here",
        "cue $$timecolor" => "",
        "cue $$paramtimes" => "times of parameters other than the level",
        "$effect" => "effects are written by hand: `effect NAME = …`",
        "$paramtype" => "red, green and blue are 12, 13 and 14",
        "$focuspalette" | "$beampalette" => "lights do not move here",
        "$macro" | "$snapshot" | "$magicsheet" | "$partition" | "$pixmap" => "part of the desk",
        _ => "",
    }
}
