//! The track sheet: what every bank holds when every cue is complete, and how it came to.

use super::level;
use crate::report::table::Table;
use crate::show::Show;

/// How a bank comes to its level in a cue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// No cue has moved it yet.
    Unused,
    /// The cue moves it to a higher level.
    Up,
    /// The cue moves it to a lower level.
    Down,
    /// The cue moves an rgb bank to another colour that is neither.
    Changed,
    /// It goes along a path.
    Path,
    /// The cue after a `cueonly` one puts it back.
    Restored,
    /// The cue states the level that it has already, or blocks or asserts all levels.
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

    /// The word behind a level where signs would be lost.
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

/// What every bank holds when every cue is complete.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackSheet {
    /// Cues in order, as `2.5 Evening`.
    pub cues: Vec<(String, String)>,
    /// Banks in order.
    pub banks: Vec<String>,
    /// For each cue, each bank's level as text and how it came to it.
    pub cells: Vec<Vec<(String, Held)>>,
}

const LEGEND: &str = "↑ up  ↓ down  → another colour  ~ along a path  ↺ put back after a cueonly cue  ■ blocked: restated  · tracked";

impl TrackSheet {
    /// Cues by banks, with a sign before each level.
    pub fn table(&self) -> Table {
        let cell = |(text, held): &(String, Held)| format!("{}{text}", held.sign());
        Table {
            legend: LEGEND.to_owned(),
            ..self.with(cell)
        }
    }

    /// Cues by banks, with a word behind each level.
    pub fn words(&self) -> Table {
        self.with(|(text, held)| format!("{text} {}", held.word()).trim().to_owned())
    }

    fn with(&self, cell: impl Fn(&(String, Held)) -> String) -> Table {
        let columns = ["cue".to_owned(), "label".to_owned()].into_iter();
        let rows = self
            .cues
            .iter()
            .zip(&self.cells)
            .map(|((number, label), cells)| {
                let head = [number.clone(), label.clone()].into_iter();
                head.chain(cells.iter().map(&cell)).collect()
            });
        Table {
            columns: columns.chain(self.banks.iter().cloned()).collect(),
            rows: rows.collect(),
            legend: String::new(),
        }
    }
}

/// The track sheet of a show. Levels track by what is written, whether or not a fade is later
/// interrupted; the fixed lights are left out.
pub fn track_sheet(show: &Show) -> TrackSheet {
    let first = level::first_coordinates(show);
    let count = first.last().copied().unwrap_or(0);
    let mut state = State {
        now: vec![0.0; count],
        lasting: vec![0.0; count],
        restore: Vec::new(),
        used: vec![false; show.banks.len()],
    };
    let mut cells = Vec::with_capacity(show.cues.len());
    for cue in &show.cues {
        cells.push(state.cue(show, cue, &first));
    }
    TrackSheet {
        cues: show
            .cues
            .iter()
            .map(|c| (c.number.to_string(), c.label.clone()))
            .collect(),
        banks: show.banks.iter().map(|b| b.name.clone()).collect(),
        cells,
    }
}

/// Levels between cues.
struct State {
    /// What each coordinate holds.
    now: Vec<f64>,
    /// What it would hold without cueonly cues.
    lasting: Vec<f64>,
    /// Coordinates that the next cue puts back.
    restore: Vec<usize>,
    /// Banks that a cue has moved.
    used: Vec<bool>,
}

impl State {
    fn cue(&mut self, show: &Show, cue: &crate::show::Cue, first: &[usize]) -> Vec<(String, Held)> {
        let before = self.now.clone();
        let mut moved = vec![None; before.len()];
        for one in cue.parts.iter().flat_map(|p| &p.moves) {
            let path = matches!(one.motion, crate::show::Motion::Path(_));
            if let Some(slot) = moved.get_mut(one.coordinate) {
                *slot = Some((one.motion.target(), path));
            }
        }
        let mut restored = vec![false; before.len()];
        for c in std::mem::take(&mut self.restore) {
            if moved.get(c).is_some_and(Option::is_none)
                && let (Some(now), Some(lasting), Some(flag)) = (
                    self.now.get_mut(c),
                    self.lasting.get(c),
                    restored.get_mut(c),
                )
            {
                *flag = *now != *lasting;
                *now = *lasting;
            }
        }
        for (c, (target, _)) in moved
            .iter()
            .enumerate()
            .filter_map(|(c, m)| Some((c, (*m)?)))
        {
            if let Some(now) = self.now.get_mut(c) {
                *now = target;
            }
            if cue.cueonly {
                self.restore.push(c);
            } else if let Some(lasting) = self.lasting.get_mut(c) {
                *lasting = target;
            }
        }
        let mut out = Vec::with_capacity(show.banks.len());
        for (b, bank) in show.banks.iter().enumerate() {
            let range = first.get(b).copied().unwrap_or(0)..first.get(b + 1).copied().unwrap_or(0);
            let of = |all: &[f64]| all.get(range.clone()).unwrap_or_default().to_vec();
            let moves: Vec<bool> = moved
                .get(range.clone())
                .unwrap_or_default()
                .iter()
                .flatten()
                .map(|m| m.1)
                .collect();
            let (was, is) = (of(&before), of(&self.now));
            let back = restored
                .get(range.clone())
                .unwrap_or_default()
                .contains(&true);
            let used = self.used.get(b).copied().unwrap_or(false);
            let held = held(&moves, back, used, cue.block || cue.assert, &was, &is);
            if let Some(used) = self.used.get_mut(b) {
                *used |= !moves.is_empty();
            }
            let text = if held == Held::Unused {
                String::new()
            } else {
                level::level(bank, &is)
            };
            out.push((text, held));
        }
        out
    }
}

/// How a bank comes from `was` to `is`; `moves` has whether each of its moves is a path.
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
