//! Effects as factors of the light, from the instant a cue begins one until another cue ends it.
//!
//! When an effect is spread over a group, bank i of n reaches each turn i/n of a period after the
//! first bank. Its first step leads to its next turn.
//!
//! Each effect begins and ends without a jump: its first step leads from the current light, and
//! its end leads back to 1 in the time of the move that ends it, or in one more step if that time is
//! 0. Shares of a flicker are eighths of its depth, so that many of its key settings coincide.

use super::clock::CueTime;
use super::curve::{CurvePiece, hold};
use super::error::TimelineError;
use crate::hash::{GOLDEN, mix};
use crate::linalg::Bernstein;
use crate::model::{Effect, EffectChange, EffectKind, Show};
use crate::units::Time;

/// Most steps of all effects of a show, to bound memory for them and their keys.
const MOST: usize = 500_000;
/// Number of shares of its depth that a flicker uses.
const SHARES: u64 = 8;

/// A bank between two changes of its effect.
#[derive(Clone, Copy)]
struct Run<'s> {
    start: Time,
    /// Time of rising moves of its part.
    up: Time,
    change: &'s EffectChange,
}

/// By bank, the factor of its light over the sequence; no pieces for a bank without effects.
pub(super) fn factors(
    show: &Show,
    cues: &[CueTime],
    (start, end): (Time, Time),
) -> Result<Vec<Vec<CurvePiece>>, TimelineError> {
    let mut runs: Vec<Vec<Run<'_>>> = vec![Vec::new(); show.banks.len()];
    for (cue, time) in show.cues.iter().zip(cues) {
        for part in &cue.parts {
            for change in &part.effects {
                if let Some(runs) = runs.get_mut(change.bank) {
                    let start = time.go + part.delay;
                    // As with moves, the later cue takes over, and an effect still waiting never
                    // begins.
                    runs.retain(|run| run.start < start);
                    let up = part.up;
                    runs.push(Run { start, up, change });
                }
            }
        }
    }
    let mut left = MOST;
    let factor = |runs: Vec<Run<'_>>| factor(show, &runs, (start, end), &mut left);
    runs.into_iter().map(factor).collect()
}

fn factor(
    show: &Show,
    runs: &[Run<'_>],
    (start, end): (Time, Time),
    left: &mut usize,
) -> Result<Vec<CurvePiece>, TimelineError> {
    let Some(first) = runs.first() else {
        return Ok(Vec::new());
    };
    let mut out = hold(start, first.start.min(end), 1.0);
    let (mut reached, mut step) = (1.0, Time::ZERO);
    for (i, run) in runs.iter().enumerate() {
        let until = runs.get(i + 1).map_or(end, |next| next.start.min(end));
        let effect = run.change.effect.and_then(|e| show.effects.get(e));
        let mut at = run.start;
        let back = if run.up > Time::ZERO { run.up } else { step };
        let (skipped, first_step) = effect.map_or((0, back), |effect| first_turn(effect, run));
        for n in skipped.. {
            if at >= until {
                break;
            }
            *left = left.checked_sub(1).ok_or(TimelineError::TooManyEffects {
                id: run.change.id,
                effect: run.change.effect.unwrap_or_default(),
                bank: run.change.bank,
                limit: MOST,
            })?;
            step = effect.map_or(step, step_of);
            let next = match effect {
                None if n > 0 || step == Time::ZERO => until,
                _ if n == skipped => at + first_step,
                _ => at + step,
            };
            let to = effect.map_or(1.0, |effect| share(effect, run.change.bank, n));
            let whole = CurvePiece {
                start: at,
                end: next,
                polynomial: shape(effect, reached, to),
            };
            let piece = CurvePiece {
                start: at,
                end: next.min(until),
                polynomial: whole.between(at, next.min(until)),
            };
            reached = piece.polynomial.last();
            out.push(piece);
            at = next;
        }
    }
    Ok(out)
}

/// Time from one turn of the effect to the next.
fn step_of(effect: &Effect) -> Time {
    let seconds = match effect.kind {
        EffectKind::Pulse => 0.5 / effect.rate,
        EffectKind::Flicker(_) => 1.0 / effect.rate,
    };
    Time::from_micros((seconds * 1e6).round() as i64)
}

/// Number of the first step of a bank, and its duration. A period is two steps of a pulse and one
/// of a flicker.
fn first_turn(effect: &Effect, run: &Run<'_>) -> (u64, Time) {
    let step = step_of(effect);
    let (place, banks) = run.change.spread.unwrap_or((0, 1));
    let behind = f64::from(place) / f64::from(banks.max(1));
    let (skipped, steps) = match effect.kind {
        EffectKind::Flicker(_) if place > 0 => (0, behind),
        EffectKind::Pulse if behind > 0.5 => (0, 2.0 * behind - 1.0),
        EffectKind::Pulse if place > 0 => (1, 2.0 * behind),
        _ => (0, 1.0),
    };
    (skipped, step.scaled(steps).max(Time::from_micros(1)))
}

/// The factor at the end of step `n`.
fn share(effect: &Effect, bank: usize, n: u64) -> f64 {
    let taken = match effect.kind {
        EffectKind::Pulse => 1.0 - (n % 2) as f64,
        EffectKind::Flicker(seed) => {
            let start = mix(u64::from(seed).wrapping_mul(GOLDEN) ^ bank as u64);
            let random = mix(start.wrapping_add(n.wrapping_mul(GOLDEN)));
            (random % (SHARES + 1)) as f64 / SHARES as f64
        }
    };
    1.0 - effect.depth * taken
}

fn shape(effect: Option<&Effect>, from: f64, to: f64) -> Bernstein {
    match effect.map(|e| e.kind) {
        _ if from == to => Bernstein::constant(from),
        Some(EffectKind::Pulse) => Bernstein::cubic([from, from, to, to]),
        _ => Bernstein::linear(from, to),
    }
}
