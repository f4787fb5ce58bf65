//! Splits a file's lines into records: a keyword and its words.

use std::ops::Range;

use footlight_show::diagnostic::Diagnostic;
use footlight_show::units::{CueNumber, Time};

use super::model::{FULL, Tenths, tenths};

/// A line with content.
#[derive(Clone, Debug)]
pub struct Record<'a> {
    /// Line number, from 1.
    pub line: usize,
    /// Position of the line in the text.
    pub span: Range<usize>,
    /// The keyword in small letters.
    pub key: String,
    /// The rest, without comments unless it is a text.
    pub rest: &'a str,
}

/// The records of a text.
pub fn records(text: &str) -> impl Iterator<Item = Record<'_>> {
    let mut start = 0;
    text.split_inclusive('\n')
        .enumerate()
        .filter_map(move |(index, whole)| {
            let at = start;
            start += whole.len();
            let content = whole.trim();
            let key = content.split(is_delimiter).next().unwrap_or_default();
            let key = key.split('!').next().unwrap_or_default();
            let rest = content.get(key.len()..).unwrap_or_default();
            let key = key.to_ascii_lowercase();
            let commented = !matches!(
                key.as_str(),
                "text" | "$$text" | "$$title" | "$$notes" | "$$cuenotes"
            );
            let rest = match rest.find('!').filter(|_| commented) {
                Some(comment) => rest.get(..comment).unwrap_or_default(),
                None => rest,
            };
            let before = whole.len() - whole.trim_start().len();
            let record = Record {
                line: index + 1,
                span: at + before..at + before + content.len(),
                key,
                rest: rest.trim(),
            };
            (!record.key.is_empty()).then_some(record)
        })
}

/// True for a delimiter; all are equivalent.
pub fn is_delimiter(c: char) -> bool {
    c.is_whitespace() || matches!(c, ',' | '<' | '>' | '=' | '@' | '/')
}

impl<'a> Record<'a> {
    /// The words after the keyword.
    pub fn words(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.rest
            .split(is_delimiter)
            .filter(|word| !word.is_empty())
    }

    /// The words in pairs: channels and levels. An incomplete pair is an error.
    pub fn pairs(&self) -> Result<Vec<(&'a str, &'a str)>, Box<Diagnostic>> {
        let words: Vec<&str> = self.words().collect();
        let pairs = words.chunks(2).map(|pair| match pair {
            [first, second] => Ok((*first, *second)),
            other => {
                let word = other.first().copied().unwrap_or_default();
                self.refuse(
                    format!("`{word}` has no level"),
                    "a pair is written 12@80 or 12@Hcc",
                )
            }
        });
        pairs.collect()
    }

    /// The text after the keyword, without characters that labels cannot hold.
    pub fn text(&self) -> String {
        self.rest.chars().filter(|c| !c.is_control()).collect()
    }

    /// An error at this line.
    pub fn refuse<T>(&self, message: String, help: &str) -> Result<T, Box<Diagnostic>> {
        let error = Diagnostic::error("", message).at(0, self.span.clone(), "");
        Err(Box::new(error.help(help)))
    }

    /// Reads a channel's number.
    pub fn channel(&self, word: &str) -> Result<u32, Box<Diagnostic>> {
        match word.parse() {
            Ok(channel @ 1..=999_999) => Ok(channel),
            _ => self.refuse(
                format!("`{word}` is no channel"),
                "a channel is a whole number from 1 to 999999",
            ),
        }
    }

    /// Reads a level: percent, or 256 steps as `Hcc`.
    pub fn level(&self, word: &str) -> Result<Tenths, Box<Diagnostic>> {
        let step = word.strip_prefix(['H', 'h']);
        let level = match (step, word.to_ascii_lowercase().as_str()) {
            (Some(step), _) => u8::from_str_radix(step, 16).ok().map(tenths),
            (None, "fl" | "ff" | "full") => Some(FULL),
            (None, percent) => percent.parse().ok().and_then(of_percent),
        };
        match level {
            Some(level) => Ok(level),
            None => self.refuse(
                format!("`{word}` is no level"),
                "a level is a percentage from 0 to 100, or H00 to Hff",
            ),
        }
    }

    /// Reads a time and its delay.
    pub fn fade(&self) -> Result<super::model::Fade, Box<Diagnostic>> {
        let mut words = self.words();
        let time = self.time(words.next().unwrap_or("0"))?;
        let delay = self.time(words.next().unwrap_or("0"))?;
        Ok(super::model::Fade { time, delay })
    }

    /// Reads a time: seconds, or minutes and seconds with a colon.
    pub fn time(&self, word: &str) -> Result<Time, Box<Diagnostic>> {
        match seconds(word).and_then(Time::from_seconds) {
            Some(time) => Ok(time),
            None => self.refuse(
                format!("`{word}` is no time"),
                "a time is written 5, 2.5 or 1:30",
            ),
        }
    }

    /// Reads the time from a cue's completion to the next cue's start; may be negative.
    pub fn hang(&self, word: &str) -> Result<Time, Box<Diagnostic>> {
        match word.strip_prefix('-') {
            Some(before) => self.time(before).map(|time| Time::ZERO - time),
            None => self.time(word),
        }
    }

    /// Reads a cue's number.
    pub fn cue(&self, word: &str) -> Result<CueNumber, Box<Diagnostic>> {
        match CueNumber::parse(word) {
            Some(number) => Ok(number),
            None => self.refuse(
                format!("`{word}` is no cue number"),
                "cue numbers go from 0.001 to 9999.999",
            ),
        }
    }

    /// Reads a whole number.
    pub fn number(&self, word: Option<&str>) -> Result<u32, Box<Diagnostic>> {
        match word.and_then(|word| word.parse().ok()) {
            Some(number) => Ok(number),
            None => self.refuse(
                format!("`{}` needs a number", self.key),
                "the number stands right behind the keyword",
            ),
        }
    }
}

fn of_percent(percent: f64) -> Option<Tenths> {
    (0.0..=100.0)
        .contains(&percent)
        .then(|| (percent * 10.0).round() as Tenths)
}

/// Seconds of `1:02:03.5`; `None` for a malformed time.
fn seconds(word: &str) -> Option<f64> {
    let digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let parts: Vec<&str> = word.split(':').collect();
    if parts.len() > 3 || !parts.iter().all(|part| digits(part)) {
        return None;
    }
    let mut sum = 0.0;
    for part in parts {
        sum = sum * 60.0 + part.parse::<f64>().ok()?;
    }
    Some(sum)
}
