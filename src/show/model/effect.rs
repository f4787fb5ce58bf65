//! Effects: what runs on top of a level that cues go on moving.

use super::NodeId;

/// A named effect: a factor of the light, at most 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// How it runs.
    pub kind: EffectKind,
    /// Cycles a second of a pulse, changes a second of a flicker.
    pub rate: f64,
    /// How much of the light it takes at most, 0 to 1.
    pub depth: f64,
}

/// How an effect runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectKind {
    /// Down by the depth and up again in each cycle, along `ease`.
    Pulse,
    /// In straight lines from one random share of the depth to the next; the seed decides them.
    Flicker(u32),
}

/// A bank gets an effect, or is let go of by the one it has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectChange {
    /// The move that says so.
    pub id: NodeId,
    /// Index into [`super::Show::banks`].
    pub bank: usize,
    /// Index into [`super::Show::effects`]; `None` ends it.
    pub effect: Option<usize>,
    /// The bank's place in a group that the effect is spread over, from 0, and the group's number of
    /// banks: bank i of n runs i/n of a period behind the first.
    pub spread: Option<(u32, u32)>,
}
