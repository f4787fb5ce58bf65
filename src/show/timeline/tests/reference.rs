//! The reference implementation: evaluates the cues at one instant straight from the rules, with
//! none of the compiler's code. At any time the latest cue whose move has started wins.

#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "test oracle")]

use crate::linalg::{Matrix, least_squares};
use crate::model::*;

/// Action of a cue on a parameter: motion, repeats, and the part that gives the times.
type Does<'s> = Option<(Motion, u32, &'s Part)>;

/// A show with the written and implied moves of its cues.
pub struct Reference<'s> {
    show: &'s Show,
    parameters: Vec<Coordinate>,
    /// By cue and parameter.
    does: Vec<Vec<Does<'s>>>,
    /// Microseconds of GO and completion.
    pub go: Vec<(i64, i64)>,
}

fn written(cue: &Cue, c: usize) -> Does<'_> {
    let parts = cue.parts.iter();
    let mut all = parts.flat_map(|p| p.moves.iter().map(move |m| (m, p)));
    let (m, part) = all.find(|(m, _)| m.parameter == c)?;
    Some((m.motion.clone(), m.repeat, part))
}

fn arrives(motion: &Motion) -> f64 {
    match motion {
        Motion::To(level) => *level,
        Motion::Path(p) => p.knots.last().unwrap().level,
    }
}

/// The part without time, for moves implied by a path.
fn at_once(part: &Part) -> &'static Part {
    let zero = crate::units::Time::ZERO;
    let (up, down) = (zero, zero);
    Box::leak(Box::new(Part {
        up,
        down,
        ..part.clone()
    }))
}

impl<'s> Reference<'s> {
    pub fn new(show: &'s Show) -> Reference<'s> {
        let parameters = show.parameters();
        let first: Vec<f64> = parameters
            .iter()
            .map(|p| if p.emitter().is_some() { 1.0 } else { 0.0 })
            .collect();
        let mut made = Reference {
            show,
            parameters,
            does: Vec::new(),
            go: Vec::new(),
        };
        let (mut holds, mut lasting) = (first.clone(), first);
        let mut back: Vec<usize> = Vec::new();
        for cue in &show.cues {
            for c in &back {
                holds[*c] = lasting[*c];
            }
            let mut does: Vec<Does<'s>> = (0..holds.len()).map(|c| written(cue, c)).collect();
            made.brighten(&holds, &mut does);
            let said: Vec<usize> = (0..does.len()).filter(|c| does[*c].is_some()).collect();
            for c in 0..does.len() {
                let restated = back.contains(&c) || cue.assert;
                if does[c].is_none() && restated && made.parameters[c].bank.is_some() {
                    does[c] = Some((Motion::To(holds[c]), 1, &cue.parts[0]));
                }
            }
            back.clear();
            for c in said {
                holds[c] = arrives(&does[c].as_ref().unwrap().0);
                match cue.cueonly {
                    true => back.push(c),
                    false => lasting[c] = holds[c],
                }
            }
            made.does.push(does);
        }
        made.go_times();
        made
    }

    /// A plain colour brings a bank that is out to full.
    fn brighten(&self, holds: &[f64], does: &mut [Does<'s>]) {
        for level in 0..does.len() {
            let is_level = self.parameters[level].emitter().is_none();
            let coloured = self
                .parameters
                .get(level + 1)
                .is_some_and(|p| p.emitter() == Some(0));
            if !is_level || !coloured || holds[level] != 0.0 || does[level].is_some() {
                continue;
            }
            let emitters = level + 1..level + 4;
            let Some((motion, repeat, part)) = emitters.clone().find_map(|e| does[e].clone())
            else {
                continue;
            };
            let part = match motion {
                Motion::To(_) => part,
                Motion::Path(_) => at_once(part),
            };
            does[level] = Some((Motion::To(1.0), repeat, part));
            for e in emitters {
                does[e] = does[e].clone().or(Some((Motion::To(0.0), repeat, part)));
            }
        }
    }

    fn go_times(&mut self) {
        for (i, cue) in self.show.cues.iter().enumerate() {
            let go = match (cue.trigger, i) {
                (Trigger::At(t), _) => t.micros(),
                (Trigger::Go, 0) => 0,
                (Trigger::Go, _) => match self.show.cues[i - 1].link {
                    Some((_, Link::Follow(t))) => self.go[i - 1].0 + t.micros(),
                    Some((_, Link::Hang(t))) => self.go[i - 1].1 + t.micros(),
                    None => self.go[i - 1].1 + self.show.preview.gap.micros(),
                },
            };
            let takes = |(motion, repeat, part): &(Motion, u32, &Part)| {
                let time = match motion {
                    Motion::To(_) => part.up.max(part.down).micros(),
                    Motion::Path(p) => p.knots.last().unwrap().time.micros(),
                };
                part.delay.micros() + time * i64::from(*repeat)
            };
            let longest = self.does[i].iter().flatten().map(takes).max();
            let stated = cue
                .parts
                .iter()
                .map(|p| (p.delay + p.up.max(p.down)).micros());
            let duration = longest.or(stated.max()).unwrap_or(0);
            self.go.push((go, go + duration));
        }
    }

    /// Light of a coordinate at `t` microseconds, with linear dimmers.
    pub fn light(&self, coordinate: usize, t: i64) -> f64 {
        let (level, share) = self.level_and_share(coordinate, t);
        level * share
    }

    /// The level of a coordinate's bank, and the share of the light that its emitter gives.
    pub fn level_and_share(&self, coordinate: usize, t: i64) -> (f64, f64) {
        let wanted = &self.show.coordinates()[coordinate];
        let of = |channel: Option<usize>| {
            let same = |p: &Coordinate| p.bank == wanted.bank && p.emitter() == channel;
            let c = self.parameters.iter().position(same).unwrap();
            self.level(c, self.show.cues.len(), t)
        };
        (
            of(None),
            wanted.emitter().map_or(1.0, |emitter| of(Some(emitter))),
        )
    }

    /// A parameter at `t` microseconds under the first `count` cues alone.
    pub fn level(&self, c: usize, count: usize, t: i64) -> f64 {
        self.level_at(c, count, t, false)
    }

    /// Like [`Reference::level`]; at a jump, `before` selects the earlier value.
    fn level_at(&self, c: usize, count: usize, t: i64, before: bool) -> f64 {
        let show = self.show;
        for k in (0..count).rev() {
            let Some((motion, repeat, part)) = &self.does[k][c] else {
                continue;
            };
            let start = self.go[k].0 + part.delay.micros();
            if start > t || before && start == t {
                continue;
            }
            let elapsed = t - start;
            let from = self.level(c, k, start);
            let unseen = self.parameters[c].emitter().is_some_and(|e| {
                let dark = |before| self.level_at(c - 1 - e, k + 1, start, before) < 1e-9;
                dark(false) || dark(true)
            });
            let whole = match &motion {
                Motion::To(_) if unseen => 0,
                Motion::To(to) if *to < from => part.down.micros(),
                Motion::To(_) => part.up.micros(),
                Motion::Path(p) => p.knots.last().unwrap().time.micros(),
            };
            let all = whole * i64::from(*repeat);
            let over = elapsed > all || !before && elapsed == all;
            let within = match elapsed.checked_rem(whole).unwrap_or(0) {
                0 if before => whole,
                within => within,
            };
            return match &motion {
                Motion::To(to) => {
                    let completion = if over {
                        fade_end(show, part.curve)
                    } else {
                        fade(show, part.curve, within, whole)
                    };
                    if *to == from {
                        from
                    } else {
                        from + (to - from) * completion
                    }
                }
                Motion::Path(p) if over => p.knots.last().unwrap().level,
                Motion::Path(p) => along(p, within, before),
            };
        }
        if self.parameters[c].emitter().is_some() {
            1.0
        } else {
            0.0
        }
    }
}

/// The level of a path `within` microseconds after its start.
fn along(p: &Path, within: i64, before: bool) -> f64 {
    let at: Vec<f64> = p
        .knots
        .iter()
        .map(|k| k.time.micros() as f64 / 1e6)
        .collect();
    let value: Vec<f64> = p.knots.iter().map(|k| k.level).collect();
    let slope: Vec<f64> = p.knots.iter().map(|k| k.slope).collect();
    let handles: Vec<[f64; 2]> = p.knots.iter().map(|k| k.handles).collect();
    let i = p
        .knots
        .iter()
        .rposition(|k| k.time.micros() < within + i64::from(!before))
        .unwrap();
    let x = (within - p.knots[i].time.micros()) as f64 / 1e6;
    spline(p.interpolation, &at, &value, &slope, &handles, i, x)
}

fn fade_end(show: &Show, fade: Fade) -> f64 {
    match fade {
        Fade::Curve(i) => show.curves[i].knots.last().unwrap().value,
        _ => 1.0,
    }
}

fn fade(show: &Show, fade: Fade, within: i64, whole: i64) -> f64 {
    let u = within as f64 / whole as f64;
    match fade {
        Fade::BuiltIn(curve) => match curve.name {
            "linear" => u,
            "ease" => u * u * (3.0 - 2.0 * u),
            "square" => u * u,
            "slow-top" => 1.0 - (1.0 - u).powi(3),
            "slow-bottom" => u.powi(3),
            _ => bernstein_sum(curve.coefficients, u),
        },
        Fade::Curve(i) => {
            let curve = &show.curves[i];
            // A curve's knots fall on whole microseconds of the fade.
            let times: Vec<i64> = curve
                .knots
                .iter()
                .map(|k| (k.at * whole as f64).round() as i64)
                .collect();
            let at: Vec<f64> = curve.knots.iter().map(|k| k.at).collect();
            let value: Vec<f64> = curve.knots.iter().map(|k| k.value).collect();
            let i = times.iter().rposition(|t| *t <= within).unwrap();
            let i = i.min(times.len() - 2);
            let share = (within - times[i]) as f64 / (times[i + 1] - times[i]) as f64;
            let x = share * (at[i + 1] - at[i]);
            let zeros = vec![0.0; at.len()];
            spline(
                curve.interpolation,
                &at,
                &value,
                &zeros,
                &vec![[0.0; 2]; at.len()],
                i,
                x,
            )
        }
    }
}

/// The sum of binomial coefficient times power times coefficient.
fn bernstein_sum(coefficients: &[f64], u: f64) -> f64 {
    let degree = coefficients.len() as i32 - 1;
    let mut binomial = 1.0;
    let mut sum = 0.0;
    for (i, c) in (0..).zip(coefficients) {
        sum += c * binomial * u.powi(i) * (1.0 - u).powi(degree - i);
        binomial = binomial * f64::from(degree - i) / f64::from(i + 1);
    }
    sum
}

/// Textbook forms: second derivatives for the C2 splines, cubic Hermite in the power basis.
fn spline(
    kind: Interpolation,
    at: &[f64],
    v: &[f64],
    slope: &[f64],
    handles: &[[f64; 2]],
    i: usize,
    x: f64,
) -> f64 {
    use Interpolation as I;
    let n = at.len();
    if i + 1 >= n {
        return v[i];
    }
    let h = at[i + 1] - at[i];
    let t = x / h;
    let chord = |i: usize| (v[i + 1] - v[i]) / (at[i + 1] - at[i]);
    let hermite = |a: f64, b: f64| {
        v[i] * (1.0 + 2.0 * t) * (1.0 - t).powi(2)
            + a * h * t * (1.0 - t).powi(2)
            + v[i + 1] * t * t * (3.0 - 2.0 * t)
            + b * h * t * t * (t - 1.0)
    };
    match kind {
        I::Steps => v[i],
        I::Linear => v[i] * (1.0 - t) + v[i + 1] * t,
        I::Bezier => {
            let s = 1.0 - t;
            s * s * s * v[i]
                + 3.0 * s * s * t * handles[i][0]
                + 3.0 * s * t * t * handles[i][1]
                + t * t * t * v[i + 1]
        }
        I::Hermite => hermite(slope[i], slope[i + 1]),
        I::CatmullRom => {
            let of = |j: usize| {
                let (a, b) = (j.saturating_sub(1), (j + 1).min(n - 1));
                (v[b] - v[a]) / (at[b] - at[a])
            };
            hermite(of(i), of(i + 1))
        }
        I::Monotone if n == 2 => v[i] * (1.0 - t) + v[i + 1] * t,
        I::Monotone => {
            let end = |j: usize, k: usize| {
                let (hj, hk) = (at[j + 1] - at[j], at[k + 1] - at[k]);
                let (dj, dk) = (chord(j), chord(k));
                let s = ((2.0 * hj + hk) * dj - hj * dk) / (hj + hk);
                if s.signum() != dj.signum() || dj == 0.0 {
                    0.0
                } else if dj.signum() != dk.signum() && s.abs() > 3.0 * dj.abs() {
                    3.0 * dj
                } else {
                    s
                }
            };
            let of = |j: usize| {
                if j == 0 {
                    return end(0, 1);
                }
                if j == n - 1 {
                    return end(n - 2, n - 3);
                }
                let (a, b) = (chord(j - 1), chord(j));
                if a * b <= 0.0 {
                    return 0.0;
                }
                let (ha, hb) = (at[j] - at[j - 1], at[j + 1] - at[j]);
                let alpha = (ha + 2.0 * hb) / (3.0 * (ha + hb));
                a * b / (alpha * b + (1.0 - alpha) * a)
            };
            hermite(of(i), of(i + 1))
        }
        I::Natural | I::Clamped => {
            let mut a = Matrix::zeros(n, n);
            let mut b = Matrix::zeros(n, 1);
            for j in 1..n - 1 {
                let (ha, hb) = (at[j] - at[j - 1], at[j + 1] - at[j]);
                a[(j, j - 1)] = ha;
                a[(j, j)] = 2.0 * (ha + hb);
                a[(j, j + 1)] = hb;
                b[(j, 0)] = 6.0 * (chord(j) - chord(j - 1));
            }
            if kind == I::Natural {
                (a[(0, 0)], a[(n - 1, n - 1)]) = (1.0, 1.0);
            } else {
                let (h0, h1) = (at[1] - at[0], at[n - 1] - at[n - 2]);
                (a[(0, 0)], a[(0, 1)], b[(0, 0)]) = (2.0 * h0, h0, 6.0 * chord(0));
                (a[(n - 1, n - 1)], a[(n - 1, n - 2)], b[(n - 1, 0)]) =
                    (2.0 * h1, h1, -6.0 * chord(n - 2));
            }
            let m = least_squares(&a, &b).unwrap();
            let (ma, mb) = (m[(i, 0)], m[(i + 1, 0)]);
            let s = 1.0 - t;
            v[i] * s + v[i + 1] * t + h * h / 6.0 * (ma * (s.powi(3) - s) + mb * (t.powi(3) - t))
        }
    }
}
