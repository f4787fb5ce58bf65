//! Cues: lit channels, moves, colours and times.

use super::super::model::{Cue, Fade, Part, Tenths};
use super::super::record::Record;
use super::super::{MOST_CHANNELS, MOST_CUES};
use super::{AXES, EMITTERS, Reader, Refused, Section, Text, utf16, why};
use crate::Loss;
use footlight_show::units::Time;

impl Reader {
    /// `Cue NUMBER LIST`, or `Cue NUMBER/PART LIST`.
    pub(super) fn cue(&mut self, record: &Record<'_>) -> Result<Section, Refused> {
        let rest = record
            .rest
            .trim_start_matches(super::super::record::is_delimiter);
        let (number, part) = match rest.split_once('/') {
            Some((number, rest)) => (number.trim(), rest.split_whitespace().next()),
            None => (record.words().next().unwrap_or_default(), None),
        };
        let skipped = usize::from(part.is_some());
        let list = record.words().nth(1 + skipped).unwrap_or("1").to_owned();
        let read = self.list.get_or_insert_with(|| list.clone());
        if *read != list {
            let other = self.others.entry(list).or_insert((record.line, 0));
            other.1 += usize::from(part.is_none());
            return Ok(Section::OtherCue);
        }
        self.timed.clear();
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

    /// Begins part `number` of the last cue.
    pub(super) fn part(&mut self, record: &Record<'_>, number: u32) -> Result<(), Refused> {
        let Some(cue) = self.show.cues.last_mut() else {
            return Ok(());
        };
        self.timed.clear();
        // Records before the first part belong to the cue itself.
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
        if cue.parts.len() > MOST_CHANNELS {
            record.refuse("too many parts".to_owned(), "a desk has 20 parts in a cue")
        } else {
            Ok(())
        }
    }

    pub(super) fn of_cue(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        if record.key == "part" {
            return self.part(record, record.number(record.words().next())?);
        }
        let number = self.show.cues.last().map(|cue| cue.number.to_string());
        let loss = |what: String| {
            let loss = Loss::new(what).line(record.line);
            loss.cue(number.clone().unwrap_or_default())
        };
        let is_time = matches!(record.key.as_str(), "up" | "down");
        if is_time && !self.timed.insert(record.key.clone()) {
            let what = format!("`{}` stands twice: the last counts", record.key);
            self.losses.push(loss(what));
        }
        match record.key.as_str() {
            "chan" | "$$chanmove" => return self.levels(record),
            "$$param" => return self.colours(record),
            "$$paramtimes" => return self.own_time(record),
            "link" | "$$link" => {
                let what = format!("`Link {}`: cues run in their order here", record.rest);
                self.losses.push(loss(what));
                return Ok(());
            }
            "$$timeup" | "$$timedown" if record.words().nth(2) == Some("M") => {
                self.losses.push(loss(format!(
                    "`{} {}`: a time by hand is a time of its own here",
                    record.key, record.rest
                )));
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
            "text" | "$$text" => {
                part.label = record.text();
                self.labelled = Text::Label;
            }
            "$$notes" | "$$cuenotes" => {
                cue.note = record.text();
                self.labelled = Text::Note;
            }
            "$$utext" => match (self.labelled, utf16(record)) {
                (Text::Label, Some(text)) => part.label = text,
                (Text::Note, Some(text)) => cue.note = text,
                _ => {}
            },
            "up" => part.up = Some(record.fade()?),
            "down" => part.down = Some(record.fade()?),
            "$$timeup" => part.up = part.up.or(Some(record.fade()?)),
            "$$timedown" => part.down = part.down.or(Some(record.fade()?)),
            "$$timecolor" => part.colour = Some(record.fade()?),
            "$$curve" => part.curve = Some(record.number(record.words().next())?),
            "followon" => cue.follow = cue.follow.or(Some(record.time(words())?)),
            "$$follow" => cue.follow = Some(record.time(words())?),
            "$$hang" => cue.hang = Some(record.hang(words())?),
            "$$block" => cue.block = true,
            "$$assert" => cue.assert = true,
            key => {
                self.labelled = Text::Other;
                let key = format!("cue {key}");
                return self.skip(record, &key, why(&key));
            }
        }
        Ok(())
    }

    /// The current part.
    fn last_part(&mut self) -> Option<&mut Part> {
        self.show.cues.last_mut()?.parts.last_mut()
    }

    /// `Chan` or `$$ChanMove`: levels of channels.
    pub(super) fn levels(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        let moves = record.key != "chan";
        for (channel, word) in record.pairs()? {
            let channel = record.channel(channel)?;
            self.channel(channel, record)?;
            let Some(level) = self.resolved(record, channel, word)? else {
                continue;
            };
            let Some(part) = self.last_part() else {
                continue;
            };
            let before = if moves {
                part.moves.insert(channel, level)
            } else {
                part.lit.get_or_insert_default().insert(channel, level)
            };
            if before.is_some_and(|before| before != level) {
                let what = format!("channel {channel} has two levels: the last counts");
                let cue = self.show.cues.last().map(|cue| cue.number.to_string());
                let loss = Loss::new(what).line(record.line);
                self.losses.push(loss.cue(cue.unwrap_or_default()));
            }
        }
        if moves {
            self.show.tracks = true
        } else {
            self.show.states = true
        }
        Ok(())
    }

    /// A level, or the level of the palette used in its place.
    pub(super) fn resolved(
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
            let loss = Loss::new(what).line(record.line);
            self.losses.push(loss.cue(cue.unwrap_or_default()));
        }
        Ok(found)
    }

    /// `$$Param CHANNEL PARAMETER@VALUE …`.
    #[expect(clippy::type_complexity, reason = "a channel with pairs of words")]
    pub(super) fn parameters<'a>(
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
    pub(super) fn value(&self, channel: u32, parameter: u32, word: &str) -> Option<f64> {
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

    /// The angle of pan or tilt, to a hundredth of a degree.
    fn degrees(&self, channel: u32, axis: u32, word: &str) -> Option<f64> {
        let channel = self.show.channels.get(&channel)?;
        channel.head?;
        let [first, last, from, to] = *self.degrees.get(&(channel.personality?, axis))?;
        let part = (word.parse::<f64>().ok()? - first) / (last - first);
        let angle = ((from + (to - from) * part) * 100.0).round() / 100.0;
        Some(angle.clamp(from.min(to), from.max(to))).filter(|angle| angle.is_finite())
    }

    /// Adds a colour and a pose to the current part. A bank and a head move in one part of a cue,
    /// so values of earlier parts move to this part unless it replaces them. Returns true when
    /// there are such values.
    fn place(&mut self, channel: u32, colour: [Option<f64>; 3], pose: [Option<f64>; 2]) -> bool {
        let mut twice = false;
        let parts = self.show.cues.last_mut().map(|cue| &mut cue.parts);
        let Some((part, earlier)) = parts.and_then(|parts| parts.split_last_mut()) else {
            return false;
        };
        if colour.iter().any(Option::is_some) {
            let taken = earlier
                .iter_mut()
                .filter_map(|part| part.colours.remove(&channel));
            let taken: Vec<_> = taken.collect();
            twice |= !taken.is_empty();
            let own = part.colours.entry(channel).or_default();
            for was in taken.into_iter().chain([colour]) {
                merge(own, was);
            }
        }
        if pose.iter().any(Option::is_some) {
            for was in earlier
                .iter_mut()
                .filter_map(|part| part.poses.get_mut(&channel))
            {
                for (was, _) in was.iter_mut().zip(pose).filter(|(_, now)| now.is_some()) {
                    twice |= was.take().is_some();
                }
            }
            merge(part.poses.entry(channel).or_default(), pose);
        }
        twice
    }

    pub(super) fn colours(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        let (channel, values) = self.parameters(record)?;
        let mut colour = [None; 3];
        let mut pose = [None; 2];
        let mut others = Vec::new();
        for (parameter, written) in values {
            let emitter = EMITTERS.iter().position(|e| *e == parameter);
            // Asserted, which is no move; or a prefix for blocked or asserted before the value.
            if written.starts_with('a') {
                continue;
            }
            let word = written.strip_prefix(['b', 'k']).unwrap_or(written);
            let axis = AXES.iter().position(|axis| *axis == parameter);
            let degrees = axis.and_then(|_| self.degrees(channel, parameter, word));
            if let (Some(place), true) = (axis.and_then(|a| pose.get_mut(a)), degrees.is_some()) {
                *place = degrees;
                continue;
            }
            match emitter.and_then(|emitter| colour.get_mut(emitter).zip(Some(emitter))) {
                Some((place, emitter)) => {
                    let palette = self.palettes.get(word).and_then(|p| p.get(&channel));
                    let of_palette = palette.and_then(|v| v.colour.get(emitter).copied().flatten());
                    *place = self.value(channel, parameter, word).or(of_palette);
                    if place.is_none() {
                        others.push(format!("{parameter}@{word}"));
                    }
                }
                // The intensity is among the levels too.
                None if parameter == 1 => {}
                None => others.push(format!("{parameter}@{word}")),
            }
        }
        let cue = self.show.cues.last().map(|cue| cue.number.to_string());
        if !others.is_empty() {
            let what = format!(
                "channel {channel}: parameters {} (more emitters, positions, shapes)",
                others.join(" ")
            );
            let loss = Loss::new(what).line(record.line);
            self.losses.push(loss.cue(cue.clone().unwrap_or_default()));
        }
        self.channel(channel, record)?.rgb |= colour.iter().any(Option::is_some);
        if self.place(channel, colour, pose) {
            let what = format!("channel {channel} stands in two parts: the later one counts");
            let loss = Loss::new(what).line(record.line);
            self.losses.push(loss.cue(cue.unwrap_or_default()));
        }
        Ok(())
    }

    /// `$$ParamTimes CHANNEL PARAMETER TIME DELAY`: the time of one channel's level.
    pub(super) fn own_time(&mut self, record: &Record<'_>) -> Result<(), Refused> {
        let words: Vec<&str> = record.words().collect();
        let [channel, "1", time, rest @ ..] = words.as_slice() else {
            return self.skip(record, "cue $$paramtimes", why("cue $$paramtimes"));
        };
        if *time == "M" {
            let key = "cue $$paramtimes M";
            return self.skip(record, key, "a time by hand is the cue's here");
        }
        let own = |word: Option<&&str>| match word {
            None | Some(&"-") => Ok(Time::ZERO),
            Some(word) => record.time(word),
        };
        let (channel, delay) = (record.channel(channel)?, own(rest.first())?);
        let time = own(Some(time))?;
        if let Some(part) = self.last_part() {
            part.times.insert(channel, Fade { time, delay });
        }
        Ok(())
    }
}

/// Replaces the values present in `now`.
fn merge<const N: usize>(values: &mut [Option<f64>; N], now: [Option<f64>; N]) {
    for (value, now) in values.iter_mut().zip(now) {
        *value = now.or(*value);
    }
}
