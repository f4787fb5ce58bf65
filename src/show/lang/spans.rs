//! Positions of the model's nodes in the text.

use super::ast::Span;
use crate::model::NodeId;

/// Maps the model's node ids to spans.
#[derive(Clone, Debug, Default)]
pub struct SpanMap {
    spans: Vec<Span>,
}

impl SpanMap {
    /// The span of a node: the whole statement; for a cue or a part, only its word and number.
    pub fn get(&self, id: NodeId) -> Option<Span> {
        self.spans.get(id.0 as usize).copied()
    }

    pub(super) fn add(&mut self, span: Span) -> NodeId {
        self.spans.push(span);
        NodeId(self.spans.len() as u32 - 1)
    }
}
