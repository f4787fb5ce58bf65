//! What is legal and surely not meant.

use std::collections::{BTreeMap, BTreeSet};

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::lang::codes;
use crate::lang::report::Place;
use crate::show::{Bank, NodeId, Part};

impl Lower<'_, '_> {
    /// Looks for all of it.
    pub fn lints(&mut self) {
        self.shared_lights();
        self.unused_lights();
        if !self.show.cues.is_empty() {
            self.still_cues();
            self.unused_banks();
        }
        self.shared_channels();
    }

    /// The statements that use lights, with their lights.
    fn users(&self) -> impl Iterator<Item = (NodeId, &[usize])> {
        let banks = self.show.banks.iter().map(|b| (b.id, b.lights.as_slice()));
        let fixed = self.show.fixed.iter().map(|f| (f.id, f.lights.as_slice()));
        banks.chain(fixed)
    }

    fn shared_lights(&mut self) {
        let mut earlier: BTreeMap<usize, NodeId> = BTreeMap::new();
        let mut shared = Vec::new();
        for (user, lights) in self.users() {
            for light in lights {
                if let Some(first) = earlier.insert(*light, user) {
                    shared.push((*light, user, first));
                }
            }
        }
        for (light, here, there) in shared {
            let name = self.show.lights.get(light).map_or("", |l| l.name.as_str());
            let message = format!("the light `{name}` is in two places");
            self.report.add(
                Diagnostic::warning(codes::SHARED_LIGHT, message)
                    .place_of(here, &self.spans, "here")
                    .place_of(there, &self.spans, "and here")
                    .help("it shines twice as bright when both are full"),
            );
        }
    }

    fn unused_lights(&mut self) {
        let mut used = vec![false; self.show.lights.len()];
        for (_, lights) in self.users() {
            for light in lights {
                if let Some(slot) = used.get_mut(*light) {
                    *slot = true;
                }
            }
        }
        for (light, used) in self.show.lights.iter().zip(used) {
            if used {
                continue;
            }
            let name = &light.name;
            let message = format!("the light `{name}` is in no bank: it never shines");
            self.report.add(
                Diagnostic::warning(codes::UNUSED_LIGHT, message)
                    .place_of(light.id, &self.spans, "")
                    .help(format!(
                        "write `bank NAME = {name}`, or `fixed NAME = {name}`"
                    )),
            );
        }
    }

    fn still_cues(&mut self) {
        for cue in &self.show.cues {
            let acts = |part: &Part| !(part.moves.is_empty() && part.effects.is_empty());
            if cue.parts.iter().any(acts) {
                continue;
            }
            let message = format!("cue {} moves nothing", cue.number);
            self.report.add(
                Diagnostic::warning(codes::STILL_CUE, message)
                    .place_of(cue.id, &self.spans, "")
                    .help(
                        "give it a move, such as `lamps 40`; to wait, give the next cue its time",
                    ),
            );
        }
    }

    fn unused_banks(&mut self) {
        let parts = self.show.cues.iter().flat_map(|cue| &cue.parts);
        let moved: BTreeSet<usize> = parts
            .flat_map(|part| &part.moves)
            .map(|one| one.parameter)
            .collect();
        let ends = self.first_parameters.iter().skip(1);
        let parameters = self.first_parameters.iter().zip(ends);
        for (bank, (first, end)) in self.show.banks.iter().zip(parameters) {
            if moved.range(first..end).next().is_some() {
                continue;
            }
            let name = &bank.name;
            let message = format!("no cue moves the bank `{name}`: it stays out");
            self.report.add(
                Diagnostic::warning(codes::UNUSED_BANK, message)
                    .place_of(bank.id, &self.spans, "")
                    .help(format!("write `{name} 50` in a cue, or make it `fixed`")),
            );
        }
    }

    /// Banks that share a channel: the desk has one level for both.
    fn shared_channels(&mut self) {
        let mut users: BTreeMap<u32, NodeId> = BTreeMap::new();
        for Bank { id, channel, .. } in &self.show.banks {
            let Some(channel) = *channel else { continue };
            let Some(earlier) = users.insert(channel, *id) else {
                continue;
            };
            let message = format!("two banks are on channel {channel}");
            self.report.add(
                Diagnostic::warning(codes::SHARED_CHANNEL, message)
                    .place_of(*id, &self.spans, "here")
                    .place_of(earlier, &self.spans, "and here")
                    .help("a desk has one level for a channel: give each bank its own, or make them one bank"),
            );
        }
    }
}
