//! What is legal in the rig and surely not meant.

use std::collections::BTreeMap;

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::lang::codes;
use crate::lang::report::Place;
use crate::show::{Bank, NodeId};

impl Lower<'_, '_> {
    /// Banks that share a channel: the desk has one level for both.
    pub fn channels_in_use(&mut self) {
        let mut users: BTreeMap<u32, NodeId> = BTreeMap::new();
        let shared = |bank: &Bank| {
            let channel = bank.channel?;
            let earlier = users.insert(channel, bank.id)?;
            Some((channel, bank.id, earlier))
        };
        let found: Vec<_> = self.show.banks.iter().filter_map(shared).collect();
        for (channel, bank, earlier) in found {
            let (Some(here), Some(there)) = (self.spans.get(bank), self.spans.get(earlier)) else {
                continue;
            };
            let message = format!("two banks are on channel {channel}");
            self.report.add(
                Diagnostic::warning(codes::SHARED_CHANNEL, message)
                    .place(here, "here")
                    .place(there, "and here")
                    .help("a desk has one level for a channel: give each bank its own, or make them one bank"),
            );
        }
    }
}
