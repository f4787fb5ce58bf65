//! Where the nodes of a model stand in the text.

use super::ast::Span;
use crate::model::NodeId;

/// Turns the model's node ids back into places.
#[derive(Clone, Debug, Default)]
pub struct SpanMap {
    spans: Vec<Span>,
}

impl SpanMap {
    /// The place of a node: the whole statement, but of a cue or a part only its word and number.
    pub fn get(&self, id: NodeId) -> Option<Span> {
        self.spans.get(id.0 as usize).copied()
    }

    pub(super) fn add(&mut self, span: Span) -> NodeId {
        self.spans.push(span);
        NodeId(self.spans.len() as u32 - 1)
    }
}
