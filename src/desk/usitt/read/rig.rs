//! The patch, fixture types, groups, submasters, palettes and curves.

use std::collections::BTreeMap;

use super::super::model::{Curve, FULL, Look};
use super::super::record::Record;
use super::super::{MOST_CHANNELS, MOST_MEMBERS};
use super::{AXES, EMITTERS, Reader, Refused, Section, Values, label, utf16};
use crate::Loss;

/// Largest angle of pan and tilt, degrees.
const MOST_DEGREES: f64 = 1000.0;

impl Reader {
    /// `Patch PAGE CHANNEL<DIMMER@LEVEL …`.
    pub(super) fn soft_patch(&mut self, record: &Record<'_>) -> Result<Section, Refused> {
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
            let level = patched.get(2).map_or(Ok(FULL), |word| record.level(word))?;
            if level != FULL {
                let percent = f64::from(level) / 10.0;
                let what =
                    format!("dimmer {dimmer} of channel {channel} is patched at {percent} %");
                self.losses.push(Loss::new(what).line(record.line));
            }
        }
        Ok(Section::Other("patch".to_owned()))
    }

    /// `$Patch CHANNEL TYPE ADDRESS …`; some programs write the address first.
    pub(super) fn patch(&mut self, record: &Record<'_>) -> Result<Section, Refused> {
        let mut words = record.words();
        let number = record.channel(words.next().unwrap_or_default())?;
        let words: Vec<u32> = words.map_while(|word| word.parse().ok()).collect();
        let known = |kind: &&u32| self.kinds.contains(kind);
        let kind = words.iter().take(2).find(known).or(words.first()).copied();
        let channel = self.channel(number, record)?;
        channel.personality = kind;
        Ok(Section::Patch(number))
    }

    pub(super) fn of_patch(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
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

    pub(super) fn of_personality(
        &mut self,
        record: &Record<'_>,
        number: u32,
    ) -> Result<(), Refused> {
        if record.key == "$$persslot" && AXES.contains(&self.parameter) {
            return self.of_slot(record, number);
        }
        if record.key != "$$perschan" {
            return self.skip(
                record,
                "$personality",
                "of a type of fixture its colours, and degrees of pan and tilt, are read",
            );
        }
        let words: Vec<u32> = record.words().map_while(|word| word.parse().ok()).collect();
        if let [parameter, size, ..] = words.as_slice() {
            self.parameter = *parameter;
            self.sizes.insert((number, *parameter), *size);
            self.kinds.insert(number);
        }
        Ok(())
    }

    /// `$$PersSlot FIRST LAST HOME FROM TO UNIT` for pan or tilt: values, and the degrees of the
    /// first and the last.
    fn of_slot(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
        let words: Vec<f64> = record.words().map_while(|word| word.parse().ok()).collect();
        let unit = record.words().nth(5).unwrap_or_default();
        match words.as_slice() {
            [first, last, _, from, to]
                if first < last
                    && (from - to).abs() > 1.0
                    && from.abs().max(to.abs()) <= MOST_DEGREES
                    && unit != "%" =>
            {
                let key = (number, self.parameter);
                self.degrees
                    .entry(key)
                    .or_insert([*first, *last, *from, *to]);
                Ok(())
            }
            _ => self.skip(
                record,
                "$personality",
                "its pan and tilt are not in degrees",
            ),
        }
    }

    pub(super) fn of_group(&mut self, record: &Record<'_>) -> Result<(), Refused> {
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
                if levels.values().any(|level| *level != FULL) {
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
    pub(super) fn members(&mut self, record: &Record<'_>, list: &str) -> Result<(), Refused> {
        let mut channels = Vec::new();
        let mut words = list.split_whitespace().peekable();
        while let Some(word) = words.next() {
            let first = record.channel(word)?;
            let is_range = words.peek().is_some_and(|w| w.eq_ignore_ascii_case("thru"));
            let last = if is_range {
                words
                    .nth(1)
                    .map_or(Ok(first), |word| record.channel(word))?
            } else {
                first
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

    pub(super) fn look(&mut self, record: &Record<'_>, word: &'static str) -> Section {
        let number = record.words().next().unwrap_or_default().to_owned();
        self.show.looks.push(Look {
            line: record.line,
            word,
            number,
            ..Look::default()
        });
        Section::Look
    }

    pub(super) fn of_look(&mut self, record: &Record<'_>) -> Result<(), Refused> {
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

    pub(super) fn of_palette(&mut self, record: &Record<'_>, key: &str) -> Result<(), Refused> {
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

    pub(super) fn values(&mut self, key: &str, channel: u32) -> &mut Values {
        let palette = self.palettes.entry(key.to_owned()).or_default();
        palette.entry(channel).or_default()
    }

    pub(super) fn of_curve(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
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
            "$$curvedata" => {
                let step = |word: &str| -> Result<f64, Refused> {
                    Ok(f64::from(record.number(Some(word))?.min(255)) / 255.0)
                };
                for (at, value) in record.pairs()? {
                    curve.steps.push((step(at)?, step(value)?));
                }
            }
            "$$interpolated" => {}
            _ => return self.skip(record, "$curve", ""),
        }
        Ok(())
    }
}
