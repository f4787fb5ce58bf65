//! Stretches of a parameter's levels.

use super::curve::CurvePiece;
use crate::model::NodeId;

/// A stretch of levels with the move that made it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub piece: CurvePiece,
    pub by: Option<(NodeId, usize)>,
    /// True once the move has arrived.
    pub holds: bool,
}

/// A parameter's stretches; the last holds for ever.
pub(super) type Track = Vec<Stretch>;
