//! The track sheet: level of every bank at every cue's completion, and its origin.

use std::collections::BTreeMap;

use super::{level, pose};
use crate::table::Table;
use footlight_host::work::{Cancelled, Work};
use footlight_show::model::{Bank, Cue, Motion, Move, Show};

/// Origin of a bank's level in a cue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// No cue has moved it yet.
    Unused,
    /// The cue moves it to a higher level.
    Up,
    /// The cue moves it to a lower level.
    Down,
    /// The cue raises some channels of an rgb bank and lowers others, or turns a head.
    Changed,
    /// It follows a path.
    Path,
    /// The cue after a `cueonly` one restores it.
    Restored,
    /// The cue restates its current level, or blocks or asserts all levels.
    Blocked,
    /// It keeps the level of an earlier cue.
    Tracked,
}

impl Held {
    /// The sign before a level.
    pub fn sign(self) -> &'static str {
        match self {
            Held::Unused => "",
            Held::Up => "↑",
            Held::Down => "↓",
            Held::Changed => "→",
            Held::Path => "~",
            Held::Restored => "↺",
            Held::Blocked => "■",
            Held::Tracked => "·",
        }
    }

    /// The word after a level, for formats without signs.
    pub fn word(self) -> &'static str {
        match self {
            Held::Unused => "",
            Held::Up => "up",
            Held::Down => "down",
            Held::Changed => "changed",
            Held::Path => "path",
            Held::Restored => "restored",
            Held::Blocked => "blocked",
            Held::Tracked => "tracked",
        }
    }
}

/// Levels of every bank at every cue's completion.
#[derive(Clone, Copy, Debug)]
pub struct TrackSheet<'s> {
    show: &'s Show,
    work: Work<'s>,
}

/// Approximate bytes of a cell and of its text.
const CELL_BYTES: usize = 16;

const LEGEND: &str = "↑ up  ↓ down  → another colour  ~ along a path  ↺ put back after a cueonly cue  ■ blocked: restated  · tracked";

impl TrackSheet<'_> {
    /// A table of cues by banks, with a sign before each level.
    ///
    /// # Errors
    /// On cancel.
    pub fn table(&self) -> Result<Table, Cancelled> {
        self.with(LEGEND, |text, held| format!("{}{text}", held.sign()))
    }

    /// A table of cues by banks, with a word after each level.
    ///
    /// # Errors
    /// On cancel.
    pub fn words(&self) -> Result<Table, Cancelled> {
        self.with("", |text, held| {
            format!("{text} {}", held.word()).trim().to_owned()
        })
    }

    /// Approximate size of a table with its text, bytes.
    pub fn bytes(&self) -> usize {
        let (cues, banks) = (self.show.cues.len(), self.show.banks.len());
        let banks = banks + self.show.heads().len();
        cues.saturating_mul(banks + 2).saturating_mul(CELL_BYTES)
    }

    fn with(&self, legend: &str, cell: impl Fn(&str, Held) -> String) -> Result<Table, Cancelled> {
        let show = self.show;
        let banks = show.banks.iter().zip(show.first_parameters());
        let mut tracks: Vec<Track> = banks.map(|(bank, first)| Track::new(bank, first)).collect();
        let columns = ["cue".to_owned(), "label".to_owned()].into_iter();
        let mut columns: Vec<String> = columns
            .chain(show.banks.iter().map(|b| b.name.clone()))
            .collect();
        let heads = pose::heads(show);
        let turned = heads
            .iter()
            .enumerate()
            .filter(|(index, _)| turns(show, *index));
        for (index, moving) in turned {
            columns.push(moving.light.name.clone());
            tracks.push(Track::of_head(show.first_pose_of(index), *moving));
        }
        let legend = if columns.len() > show.banks.len() + 2 {
            legend.replace("another colour", "another colour or place")
        } else {
            legend.to_owned()
        };
        let mut table = Table::new(columns, &legend);
        for cue in &show.cues {
            self.work.check()?;
            let moves = cue.parts.iter().flat_map(|part| &part.moves);
            let moved = moves.map(|one| (one.parameter, &one.motion)).collect();
            let head = [cue.number.to_string(), cue.label.clone()].into_iter();
            table.push(head.chain(tracks.iter_mut().map(|track| {
                let (text, held) = track.cell(show, cue, &moved);
                cell(&text, held)
            })));
        }
        Ok(table)
    }
}

/// The track sheet of a show. Levels track as written, even when a fade is interrupted later; the
/// fixed lights are left out.
pub fn track_sheet<'s>(show: &'s Show, work: Work<'s>) -> TrackSheet<'s> {
    TrackSheet { show, work }
}

/// True when a cue turns the head with this index.
fn turns(show: &Show, index: usize) -> bool {
    let first = show.first_pose_of(index);
    let turns = |one: &Move| (first..first + 4).contains(&one.parameter);
    let mut parts = show.cues.iter().flat_map(|cue| &cue.parts);
    parts.any(|part| part.moves.iter().any(turns))
}

/// A bank or a head between cues.
struct Track<'s> {
    /// The head, if it is one.
    head: Option<pose::Moving<'s>>,
    /// Its first parameter.
    first: usize,
    parameters: Vec<Tracked>,
    /// True once a cue has moved it.
    used: bool,
}

/// A parameter between cues.
#[derive(Clone, Copy)]
struct Tracked {
    /// Its value.
    now: f64,
    /// Its value without cueonly cues.
    lasting: f64,
    /// True when the next cue restores it.
    restore: bool,
}

impl Tracked {
    fn at(level: f64) -> Tracked {
        Tracked {
            now: level,
            lasting: level,
            restore: false,
        }
    }

    fn go(&mut self, level: f64, cueonly: bool) {
        self.now = level;
        self.restore = cueonly;
        if !cueonly {
            self.lasting = level;
        }
    }
}

impl<'s> Track<'s> {
    fn of_head(first: usize, moving: pose::Moving<'s>) -> Track<'s> {
        Track {
            head: Some(moving),
            first,
            parameters: moving.head.at_home().map(Tracked::at).to_vec(),
            used: false,
        }
    }

    fn new(bank: &Bank, first: usize) -> Track<'s> {
        Track {
            head: None,
            first,
            parameters: if bank.rgb {
                vec![
                    Tracked::at(0.0),
                    Tracked::at(1.0),
                    Tracked::at(1.0),
                    Tracked::at(1.0),
                ]
            } else {
                vec![Tracked::at(0.0)]
            },
            used: false,
        }
    }

    /// The light of the bank, or of each of its emitters, before the dimmer.
    fn light(&self) -> Vec<f64> {
        let now: Vec<f64> = self.parameters.iter().map(|p| p.now).collect();
        match now.as_slice() {
            [level, emitters @ ..] if !emitters.is_empty() && self.head.is_none() => {
                emitters.iter().map(|emitter| level * emitter).collect()
            }
            _ => now,
        }
    }

    /// The bank's level or the head's pose after a cue, and its origin; `moved` has the cue's
    /// motions by parameter.
    fn cell(&mut self, show: &Show, cue: &Cue, moved: &BTreeMap<usize, &Motion>) -> (String, Held) {
        let was = self.light();
        let (mut paths, mut back) = (Vec::new(), false);
        // A plain colour brings a bank that is out to full, with unnamed emitters dark.
        let colour = (1..self.parameters.len()).any(|e| moved.contains_key(&(self.first + e)));
        let out = self.parameters.first().is_some_and(|level| {
            if level.restore {
                level.lasting == 0.0
            } else {
                level.now == 0.0
            }
        });
        let implied = self.head.is_none() && colour && out && !moved.contains_key(&self.first);
        for (index, parameter) in (self.first..).zip(&mut self.parameters) {
            if let Some(motion) = moved.get(&index) {
                paths.push(matches!(motion, Motion::Path(_)));
                parameter.go(motion.target(), cue.cueonly);
            } else if implied {
                let level = if index == self.first { 1.0 } else { 0.0 };
                parameter.go(level, cue.cueonly);
            } else if std::mem::take(&mut parameter.restore) {
                back |= parameter.now != parameter.lasting;
                parameter.now = parameter.lasting;
            }
        }
        let is: Vec<f64> = self.parameters.iter().map(|c| c.now).collect();
        let mut held = held(
            &paths,
            back,
            self.used,
            cue.block || cue.assert,
            &was,
            &self.light(),
        );
        self.used |= !paths.is_empty();
        if let (Some(_), Held::Up | Held::Down) = (self.head, held) {
            held = Held::Changed;
        }
        let text = match (held, self.head) {
            (Held::Unused, _) => String::new(),
            (_, Some(moving)) => {
                let pose = is.try_into().map(|is| moving.head.pose(is));
                moving.whole(show, pose.unwrap_or_default())
            }
            (_, None) => level::level(&is),
        };
        (text, held)
    }
}

/// Kind of a bank's change from `was` to `is`; `moves` is true for each move along a path.
fn held(moves: &[bool], back: bool, used: bool, block: bool, was: &[f64], is: &[f64]) -> Held {
    let up = was.iter().zip(is).any(|(w, i)| i > w);
    let down = was.iter().zip(is).any(|(w, i)| i < w);
    match (moves.is_empty(), up, down) {
        _ if moves.contains(&true) => Held::Path,
        (false, true, true) => Held::Changed,
        (false, true, false) => Held::Up,
        (false, false, true) => Held::Down,
        (false, false, false) => Held::Blocked,
        _ if back => Held::Restored,
        _ if !used => Held::Unused,
        _ if block => Held::Blocked,
        _ => Held::Tracked,
    }
}
