//! Losses of a desk's file.

use super::{Writer, of};
use crate::Loss;
use footlight_show::model::{Cue, Dimmer};
use footlight_show::timeline::Moved;
use footlight_show::units::Rgb;

impl Writer<'_> {
    /// Levels and colours between the file's steps.
    pub(super) fn rounding(&mut self, cue: &Cue, moves: &[Moved<'_>]) {
        let (mut levels, mut colours) = (false, false);
        let first_pose = self.show.first_pose();
        for one in moves.iter().filter(|one| one.parameter < first_pose) {
            let target = one.motion.target();
            let differs = |read: f64| (read - target).abs() > 1e-9;
            match self.bank_of(one.parameter).1 {
                0 => levels |= differs(f64::from(of(target)) / 1000.0),
                _ => {
                    let read = Rgb::from_srgb8(Rgb([target; 3]).to_srgb8());
                    colours |= read.0.into_iter().any(differs);
                }
            }
        }
        for (is_off, what) in [
            (levels, "levels in 256 steps"),
            (colours, "colours between two steps"),
        ] {
            if is_off {
                self.losses.push(Loss::new(what).cue(cue.number));
            }
        }
    }

    /// Parts of the show without a record in the file.
    pub(super) fn rest(&mut self) {
        let show = self.show;
        for fixed in &show.fixed {
            let what = format!("fixed `{}` is no channel of the desk", fixed.name);
            self.losses.push(Loss::new(what));
        }
        let banks = show.banks.iter();
        for bank in banks.filter(|bank| bank.dimmer != Dimmer::Linear) {
            let what = format!("bank `{}`: its dimmer is to be set at the desk", bank.name);
            self.losses.push(Loss::new(what));
        }
        for cue in &show.cues {
            for change in cue.parts.iter().flat_map(|part| &part.effects) {
                let Some(effect) = change.effect.and_then(|effect| show.effects.get(effect)) else {
                    continue;
                };
                let what = format!("effect `{}`", effect.name);
                self.losses.push(Loss::new(what).cue(cue.number));
            }
        }
        self.losses.extend(Loss::of_clock_times(show));
    }
}
