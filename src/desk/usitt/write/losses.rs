//! Losses of a desk's file, with the error of light.

use std::collections::BTreeMap;

use super::{Writer, of};
use crate::Loss;
use footlight_show::model::{Cue, Dimmer, Trigger};
use footlight_show::timeline::Moved;
use footlight_show::units::{Rgb, Time};

/// Moments at which a curve is compared with a straight fade.
const SAMPLES: i32 = 64;

impl Writer<'_> {
    /// Deviation of paths, curves and repeats from the straight fades in the file.
    pub(super) fn bends(&mut self, index: usize, cue: &Cue, curved: &[(usize, Time, Time)]) {
        let Some(go) = self.timeline.cues().get(index).map(|cue| cue.go) else {
            return;
        };
        let until = self.timeline.cues().get(index + 1).map(|next| next.go);
        let mut off: BTreeMap<usize, f64> = BTreeMap::new();
        let mut spans: Vec<(Time, Time)> = curved
            .iter()
            .map(|(_, delay, time)| (*delay, *time))
            .collect();
        spans.sort_unstable();
        spans.dedup();
        for (delay, time) in spans {
            let from = go + delay;
            // Just before the start: a path may jump there.
            let start = self.timeline.levels(from - Time::from_micros(1));
            for sample in 0..=SAMPLES {
                let fraction = f64::from(sample) / f64::from(SAMPLES);
                let moment = from + time.scaled(fraction);
                if until.is_some_and(|until| moment >= until) {
                    break;
                }
                let levels = self.timeline.levels(moment);
                let mine = curved.iter().filter(|(_, d, t)| (*d, *t) == (delay, time));
                for (parameter, _, _) in mine {
                    let get = |list: &[f64]| list.get(*parameter).copied().unwrap_or(0.0);
                    let (was, to) = (get(&start), get(&self.held));
                    let straight = was + (to - was) * fraction;
                    let far = (get(&levels) - straight).abs();
                    let most = off.entry(*parameter).or_default();
                    *most = most.max(far);
                }
            }
        }
        for (parameter, far) in off {
            if far > 1e-6 {
                let name = self
                    .show
                    .parameters()
                    .get(parameter)
                    .map(|p| p.name.clone());
                let name = name.unwrap_or_default();
                let what = format!("`{name}`: its curve is a straight fade to its last level");
                self.losses.push(Loss::new(what).cue(cue.number).light(far));
            }
        }
    }

    /// Levels and colours between the file's steps.
    pub(super) fn rounding(&mut self, cue: &Cue, moves: &[Moved<'_>]) {
        let mut off = (0.0_f64, 0.0_f64);
        let first_pose = self.show.first_pose();
        for one in moves.iter().filter(|one| one.parameter < first_pose) {
            let target = one.motion.target();
            match self.bank_of(one.parameter).1 {
                0 => off.0 = off.0.max((f64::from(of(target)) / 1000.0 - target).abs()),
                _ => {
                    let coded = Rgb([target; 3]).to_srgb8();
                    let read = Rgb::from_srgb8(coded).0.first().copied().unwrap_or(0.0);
                    off.1 = off.1.max((read - target).abs());
                }
            }
        }
        for (off, what) in [
            (off.0, "levels in 256 steps"),
            (off.1, "colours between two steps"),
        ] {
            if off > 1e-9 {
                self.losses.push(Loss::new(what).cue(cue.number).light(off));
            }
        }
    }

    /// Parts of the show without a record in the file.
    pub(super) fn rest(&mut self) {
        let show = self.show;
        for fixed in &show.fixed {
            let what = format!("fixed `{}` is no channel of the desk", fixed.name);
            self.losses.push(Loss::new(what).light(fixed.level));
        }
        for bank in &show.banks {
            let far = match bank.dimmer {
                Dimmer::Linear => continue,
                Dimmer::Square => 0.25,
                Dimmer::Curve(index) => {
                    let curve = show.curves.get(index);
                    let knots = curve.map_or([].as_slice(), |curve| curve.knots.as_slice());
                    knots
                        .iter()
                        .map(|k| (k.value - k.at).abs())
                        .fold(0.0, f64::max)
                }
            };
            let what = format!("bank `{}`: its dimmer is to be set at the desk", bank.name);
            self.losses.push(Loss::new(what).light(far));
        }
        for cue in &show.cues {
            for change in cue.parts.iter().flat_map(|part| &part.effects) {
                let Some(effect) = change.effect.and_then(|effect| show.effects.get(effect)) else {
                    continue;
                };
                let what = format!("effect `{}`", effect.name);
                self.losses
                    .push(Loss::new(what).cue(cue.number).light(effect.depth));
            }
        }
        let clocked = show
            .cues
            .iter()
            .filter(|cue| matches!(cue.trigger, Trigger::At(_)));
        let clocked: Vec<String> = clocked.map(|cue| cue.number.to_string()).collect();
        if !clocked.is_empty() {
            let what = format!(
                "clock times (`at`) of cues {}: they wait for GO",
                clocked.join(" ")
            );
            self.losses.push(Loss::new(what));
        }
    }
}
