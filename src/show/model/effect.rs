//! Effects: variations on top of a level that cues continue to move.

use super::NodeId;

/// A named effect: a factor of the light, at most 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: EffectKind,
    /// Cycles a second of a pulse, changes a second of a flicker.
    pub rate: f64,
    /// Largest share of the light that it takes, 0 to 1.
    pub depth: f64,
}

/// Kinds of effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectKind {
    /// Falls by the depth and rises again in each cycle, along `ease`.
    Pulse,
    /// Straight lines between random shares of the depth; the seed decides them.
    Flicker(u32),
}

/// The start or end of an effect on a bank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectChange {
    /// The move that states it.
    pub id: NodeId,
    /// Index into [`super::Show::banks`].
    pub bank: usize,
    /// Index into [`super::Show::effects`]; `None` ends it.
    pub effect: Option<usize>,
    /// For an effect spread over a group: the bank's index in the group and the number of banks.
    /// Bank i of n lags the first by i/n of a period.
    pub spread: Option<(u32, u32)>,
}
