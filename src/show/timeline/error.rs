//! What follows from the times and the curves of a show alone, as data without spans.

use crate::model::NodeId;
use crate::units::{Time, percent};

/// Why a show has no timeline.
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
        /// When it would start.
        go: Time,
        /// What starts it, when that is a `hang`.
        link: Option<NodeId>,
        /// The cue before.
        previous: NodeId,
        /// When that one starts.
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
    /// Effects make more steps than a show may have of them.
    #[error("effects would make more than {limit} steps")]
    TooManyEffects {
        /// The change of an effect that goes over the limit.
        id: NodeId,
        /// Its effect.
        effect: usize,
        /// The bank that has it.
        bank: usize,
        /// The limit.
        limit: usize,
    },
    /// A level leaves 0 to 1.
    #[error("the level is {} at {time}", percent(*.level))]
    Level {
        /// The move.
        id: NodeId,
        /// Which parameter.
        parameter: usize,
        /// When it is farthest outside, to the microsecond.
        time: Time,
        /// The level there.
        level: f64,
    },
    /// The beam of a head is not narrower than its field.
    #[error("the beam is as wide as the field at {time}")]
    Beam {
        /// The move.
        id: NodeId,
        /// Which head.
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

/// Legal but surely not meant.
#[derive(Clone, Debug, PartialEq)]
pub enum TimelineWarning {
    /// A path does not begin at the level that the parameter has.
    Jump {
        /// The move.
        id: NodeId,
        /// Which parameter.
        parameter: usize,
        /// When.
        time: Time,
        /// The level before.
        from: f64,
        /// The path's first level.
        to: f64,
    },
    /// A move never happens, since a later cue's move of the same parameter starts first.
    Overtaken {
        /// The move that never happens.
        id: NodeId,
        /// The move that comes first.
        by: NodeId,
        /// Which parameter.
        parameter: usize,
        /// When the move would have started.
        time: Time,
    },
    /// A fade is cut off by a later cue's move of the same parameter.
    CutOff {
        /// The fade that does not arrive.
        id: NodeId,
        /// The move that takes over.
        by: NodeId,
        /// Which parameter.
        parameter: usize,
        /// When.
        time: Time,
        /// The level that it has reached then.
        level: f64,
        /// The level that it was to reach.
        to: f64,
    },
    /// A cue moves banks only to where they are.
    Still {
        /// The cue.
        cue: NodeId,
    },
    /// A head has less time than its turn takes.
    Late {
        /// The move.
        id: NodeId,
        /// Which head.
        head: usize,
        /// When the move starts.
        time: Time,
        /// Time that the turn takes at the head's speed.
        needs: Time,
        /// Time of the move; in the dark all of the dark time.
        has: Time,
        /// Its bank is out.
        dark: bool,
    },
    /// A head turns while the light of its bank fades to 0.
    Seen {
        /// The move.
        id: NodeId,
        /// Which head.
        head: usize,
        /// When the move starts.
        time: Time,
        /// When it ends.
        until: Time,
    },
    /// Every bank is out between two lit moments, and no cue takes them all out.
    Dark {
        /// The move that puts the last light out.
        id: NodeId,
        /// The move that brings the first one back.
        by: NodeId,
        /// From.
        time: Time,
        /// To.
        until: Time,
    },
}
