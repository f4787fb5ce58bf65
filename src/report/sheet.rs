//! Tables of the show: actions of each cue, levels of each bank, changes between two versions.
//!
//! Everything follows from the model and its timeline; nothing is rendered, and no file is used.
//! Sheets are data: a [`Table`](super::table::Table), written as text, Markdown or CSV.

mod cue;
mod difference;
mod level;
mod pose;
mod track;

pub use cue::{cue_sheet, fades};
pub use difference::{CurveChange, ShowChange, ShowDifference, difference};
pub use level::{clock, hex, link, time};
pub(crate) use level::{number, up_down};
pub(crate) use pose::heads;
pub use track::{Held, TrackSheet, track_sheet};

#[cfg(test)]
mod tests;
