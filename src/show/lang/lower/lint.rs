//! Warnings: legal statements that are probably mistakes.

use std::collections::{BTreeMap, BTreeSet};

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::lang::codes;
use crate::lang::report::Place;
use crate::model::{Bank, Cue, EffectChange, Interpolation, Motion, NodeId, Part};
use crate::units::percent;

impl Lower<'_, '_> {
    /// Runs all checks.
    pub fn lints(&mut self) {
        self.shared_lights();
        self.unused_lights();
        if !self.show.cues.is_empty() {
            self.still_cues();
            self.unused_banks();
            self.endless_effects();
        }
        self.shared_channels();
        self.fractions();
        self.repeats_that_jump();
        self.unseen_stage();
        self.buried_lamps();
        self.images_in_haze();
    }

    fn warn(&mut self, code: &'static str, message: String, at: (NodeId, &str), help: String) {
        let diagnostic = Diagnostic::warning(code, message);
        let diagnostic = diagnostic.place_of(at.0, &self.spans, at.1);
        self.report.add(diagnostic.help(help));
    }

    /// Warns when no level exceeds 1, in the whole show or in a cue of several moves: the author
    /// probably meant fractions, not percent.
    fn fractions(&mut self) {
        let of_cues: Vec<Vec<(NodeId, f64)>> =
            self.show.cues.iter().map(|c| self.cue_levels(c)).collect();
        let brightest = |levels: &[(NodeId, f64)]| levels.iter().map(|l| l.1).fold(0.0, f64::max);
        let everywhere = of_cues.iter().all(|levels| brightest(levels) <= 0.01);
        let found = of_cues.iter().find_map(|levels| {
            let low: BTreeMap<NodeId, f64> = levels
                .iter()
                .filter(|(_, level)| *level > 0.0 && *level < 0.01)
                .copied()
                .collect();
            let meant = everywhere || (low.len() > 1 && brightest(levels) <= 0.01);
            low.into_iter().next().filter(|_| meant)
        });
        let Some((id, level)) = found else {
            return;
        };
        let message = format!("no level is above 1: this is {} % of full", percent(level));
        let help = format!("levels are 0 to 100: write `{}`", percent(100.0 * level));
        self.warn(codes::FRACTIONS, message, (id, "nearly dark"), help);
    }

    /// The highest level of each move of a cue.
    fn cue_levels(&self, cue: &Cue) -> Vec<(NodeId, f64)> {
        let moves = cue.parts.iter().flat_map(|part| &part.moves);
        let levels =
            moves.filter(|m| m.parameter < self.first_pose && self.emitter(m.parameter).is_none());
        levels.map(|m| (m.id, m.motion.brightest())).collect()
    }

    fn repeats_that_jump(&mut self) {
        let parts = self.show.cues.iter().flat_map(|cue| &cue.parts);
        let mut found: Vec<(NodeId, f64, f64)> = Vec::new();
        for one in parts.flat_map(|part| &part.moves) {
            let Motion::Path(path) = &one.motion else {
                continue;
            };
            let (Some(first), Some(last)) = (path.knots.first(), path.knots.last()) else {
                continue;
            };
            let jumps = one.repeat > 1 && first.level != last.level;
            if jumps && path.interpolation != Interpolation::Steps {
                found.push((one.id, last.level, first.level));
            }
        }
        found.dedup_by_key(|(id, ..)| *id);
        for (id, from, to) in found {
            let (from, to) = (percent(from), percent(to));
            let message = format!("this path jumps from {from} to {to} each time it is repeated");
            let help = format!("let its last knot be at {to} as its first");
            self.warn(codes::REPEAT_JUMP, message, (id, "ends elsewhere"), help);
        }
    }

    fn unseen_stage(&mut self) {
        let solids = self.show.surfaces.iter().any(|s| !s.solids.is_empty());
        let stage = solids || !self.show.stages.is_empty();
        let Some(light) = self.show.lights.first().filter(|_| stage) else {
            return;
        };
        if self.show.views.is_empty() {
            let message = "there is a stage with lights, and no view: no picture can be made";
            let help = "write `view house from 0, -12, 1.7  to 0, 0, 1.5  fov 30`";
            let at = (light.id, "nobody sees it");
            self.warn(codes::NO_VIEW, message.to_owned(), at, help.to_owned());
        }
    }

    /// Warns of lamps inside a box, whose faces keep all light in.
    fn buried_lamps(&mut self) {
        let mut found = Vec::new();
        for light in &self.show.lights {
            let Some(at) = light.kind.place() else {
                continue;
            };
            let around = self.show.surfaces.iter().find(|surface| {
                let mut solids = surface.solids.iter();
                solids.any(|solid| solid.closes_in(at))
            });
            if let Some(surface) = around {
                found.push((
                    light.id,
                    light.name.clone(),
                    surface.id,
                    surface.name.clone(),
                ));
            }
        }
        for (id, light, around, solid) in found {
            let message = format!("the light `{light}` is inside a solid of `{solid}`");
            self.report.add(
                Diagnostic::warning(codes::LAMP_INSIDE, message)
                    .place_of(id, &self.spans, "its light does not get out")
                    .place_of(around, &self.spans, "this one")
                    .help("hang it outside, or make the box a room: `box inside from …`"),
            );
        }
    }

    /// Warns of banks given as images in a show with haze.
    fn images_in_haze(&mut self) {
        let first = self.show.images().next().map(|(id, _)| id);
        let (Some(haze), Some(image)) = (self.show.haze_id, first) else {
            return;
        };
        let message = "the haze does not change images: images as banks stay as they are";
        self.report.add(
            Diagnostic::warning(codes::IMAGE_IN_HAZE, message.to_owned())
                .place_of(image, &self.spans, "this image is shown as it is")
                .place_of(
                    haze,
                    &self.spans,
                    "this haze is in the light of all other banks",
                )
                .help("render the images in this haze too, or take the haze out"),
        );
    }

    /// The statements that use lights, with these lights.
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
        let mut restores = false;
        for cue in &self.show.cues {
            let acts = |part: &Part| !(part.moves.is_empty() && part.effects.is_empty());
            // Moves of a `cueonly` cue are undone by the next one.
            let restores = std::mem::replace(&mut restores, cue.cueonly);
            if restores || cue.assert || cue.parts.iter().any(acts) {
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

    /// Warns of effects that run to the end of the show on banks that a cue before the last has
    /// taken out for good.
    fn endless_effects(&mut self) {
        let mut running: BTreeMap<usize, &EffectChange> = BTreeMap::new();
        let mut levels: BTreeMap<usize, (f64, NodeId)> = BTreeMap::new();
        let last = self.show.cues.len().saturating_sub(1);
        for (number, cue) in self.show.cues.iter().enumerate() {
            for part in &cue.parts {
                let began = part.effects.iter().map(|change| (change.bank, change));
                running.extend(began);
                for one in part.moves.iter().filter(|_| !cue.cueonly) {
                    // A bank that goes out in the last cue goes out with the show.
                    let level = if number < last {
                        one.motion.target()
                    } else {
                        1.0
                    };
                    levels.insert(one.parameter, (level, one.id));
                }
            }
        }
        let mut told = BTreeSet::new();
        let mut found = Vec::new();
        for (bank, change) in running {
            let (Some(effect), Some(level)) = (
                change
                    .effect
                    .and_then(|effect| self.show.effects.get(effect)),
                self.first_parameters
                    .get(bank)
                    .and_then(|first| levels.get(first)),
            ) else {
                continue;
            };
            if level.0 == 0.0 && told.insert(change.id) {
                let name = self.show.banks.get(bank).map_or("", |b| b.name.as_str());
                found.push((effect.name.clone(), name.to_owned(), change.id, level.1));
            }
        }
        for (effect, bank, id, out) in found {
            let message =
                format!("the effect `{effect}` of `{bank}` never ends, though `{bank}` goes out");
            self.report.add(
                Diagnostic::warning(codes::ENDLESS_EFFECT, message)
                    .place_of(id, &self.spans, "runs to the end of the show")
                    .place_of(out, &self.spans, "out from here")
                    .help(format!(
                        "levels and `blackout` leave effects running: end it with `{bank} effect none`"
                    )),
            );
        }
    }

    /// Warns of banks that share a channel: the desk has one level for both.
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
