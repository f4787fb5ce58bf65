//! Errors and warnings that follow from times and curves alone, as data without spans.

use crate::model::NodeId;
use crate::units::{Time, percent};

/// Reasons why a show has no timeline.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TimelineError {
    /// A cue has a clock time although the cue before starts it.
    #[error("the cue has a clock time and is started by the cue before it as well")]
    AtAndLink {
        /// The cue with the clock time.
        cue: NodeId,
        /// The `follow` or `hang` of the cue before.
        link: NodeId,
    },
    /// A cue would start before the cue before it.
    #[error("the cue would start at {go}, before the cue before it (at {previous_go})")]
    Backwards {
        /// The cue.
        cue: NodeId,
        /// Its start.
        go: Time,
        /// The `hang` that starts it, if any.
        link: Option<NodeId>,
        /// The previous cue.
        previous: NodeId,
        /// Start of the previous cue.
        previous_go: Time,
    },
    /// There is no cue that a `follow` or `hang` could start.
    #[error("no cue comes after the last one")]
    LinkOnLast {
        /// The `follow` or `hang`.
        link: NodeId,
        /// The cue it stands in.
        cue: NodeId,
    },
    /// The show would run beyond [`Time::MAX`].
    #[error("the show would run beyond {}", Time::MAX)]
    TooLong {
        /// The first cue that does.
        cue: NodeId,
    },
    /// Moves and their repeats make more pieces than a show may have.
    #[error("the curves would have more than {limit} pieces")]
    TooManyPieces {
        /// The move or cue that goes over the limit.
        id: NodeId,
        /// The limit.
        limit: usize,
    },
    /// Effects make more steps than a show may have.
    #[error("effects would make more than {limit} steps")]
    TooManyEffects {
        /// The effect change that exceeds the limit.
        id: NodeId,
        /// Its effect.
        effect: usize,
        /// The bank with the effect.
        bank: usize,
        /// The limit.
        limit: usize,
    },
    /// A level leaves 0 to 1.
    #[error("the level is {} at {time}", percent(*.level))]
    Level {
        /// The move.
        id: NodeId,
        /// Index of the parameter.
        parameter: usize,
        /// Time at which it is farthest outside, to the microsecond.
        time: Time,
        /// The level there.
        level: f64,
    },
    /// The beam of a head is not narrower than its field.
    #[error("the beam is as wide as the field at {time}")]
    Beam {
        /// The move.
        id: NodeId,
        /// Index of the head.
        head: usize,
        /// When.
        time: Time,
    },
    /// A dimmer's law leaves 0 to 1.
    #[error("the dimmer gives {value} at the level fraction {at}")]
    Dimmer {
        /// The named curve.
        id: NodeId,
        /// The level.
        at: f64,
        /// Setting there.
        value: f64,
    },
}

/// Legal but probably a mistake.
#[derive(Clone, Debug, PartialEq)]
pub enum TimelineWarning {
    /// A path does not begin at the current level of its parameter.
    Jump {
        /// The move.
        id: NodeId,
        /// Index of the parameter.
        parameter: usize,
        /// When.
        time: Time,
        /// The level before.
        from: f64,
        /// The path's first level.
        to: f64,
    },
    /// A move never happens, because a later cue's move of the parameter starts first.
    Overtaken {
        /// The move that never happens.
        id: NodeId,
        /// The move that comes first.
        by: NodeId,
        /// Index of the parameter.
        parameter: usize,
        /// When the move would have started.
        time: Time,
    },
    /// A fade is cut off by a later cue's move of the parameter.
    CutOff {
        /// The fade that does not arrive.
        id: NodeId,
        /// The move that takes over.
        by: NodeId,
        /// Index of the parameter.
        parameter: usize,
        /// When.
        time: Time,
        /// The level reached.
        level: f64,
        /// The level it fades to.
        to: f64,
    },
    /// A cue moves banks only to their current levels.
    Still {
        /// The cue.
        cue: NodeId,
    },
    /// A head has less time than its turn takes.
    Late {
        /// The move.
        id: NodeId,
        /// Index of the head.
        head: usize,
        /// When the move starts.
        time: Time,
        /// Time of the turn at the head's speed.
        needs: Time,
        /// Time of the move; in the dark, the whole dark time.
        has: Time,
        /// True when its bank is out.
        dark: bool,
    },
    /// A head turns while the light of its bank fades to 0.
    Seen {
        /// The move.
        id: NodeId,
        /// Index of the head.
        head: usize,
        /// When the move starts.
        time: Time,
        /// When it ends.
        until: Time,
    },
    /// Every bank is out between two lit moments, and no cue takes all of them out.
    Dark {
        /// The move that takes the last light out.
        id: NodeId,
        /// The move that brings the first one back.
        by: NodeId,
        /// Start of the darkness.
        time: Time,
        /// Its end.
        until: Time,
    },
}
