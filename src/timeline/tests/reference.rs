//! The cues evaluated at one instant straight from the rules, with none of the compiler's code: the
//! reference implementation. At any time the latest cue whose move has started rules.

#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "test oracle")]

use crate::linalg::{Matrix, least_squares};
use crate::show::*;

/// Microseconds of GO and completion.
pub fn go_times(show: &Show) -> Vec<(i64, i64)> {
    let mut out: Vec<(i64, i64)> = Vec::new();
    for (i, cue) in show.cues.iter().enumerate() {
        let go = match (cue.trigger, i) {
            (Trigger::At(t), _) => t.micros(),
            (Trigger::Go, 0) => 0,
            (Trigger::Go, _) => match show.cues[i - 1].link {
                Some((_, Link::Follow(t))) => out[i - 1].0 + t.micros(),
                Some((_, Link::Hang(t))) => out[i - 1].1 + t.micros(),
                None => out[i - 1].1 + show.preview.gap.micros(),
            },
        };
        let mut longest = None;
        for c in 0..show.coordinates().len() {
            if let Some((motion, repeat, part)) = moved(show, i, c) {
                let time = match motion {
                    Motion::To(_) => part.up.max(part.down).micros(),
                    Motion::Path(p) => p.knots.last().unwrap().time.micros(),
                };
                longest = longest.max(Some(part.delay.micros() + time * i64::from(repeat)));
            }
        }
        let stated = cue
            .parts
            .iter()
            .map(|p| (p.delay + p.up.max(p.down)).micros());
        let duration = longest.or(stated.max()).unwrap_or(0);
        out.push((go, go + duration));
    }
    out
}

fn written(show: &Show, cue: usize, c: usize) -> Option<(&Move, &Part)> {
    let parts = show.cues[cue].parts.iter();
    parts
        .flat_map(|p| p.moves.iter().map(move |m| (m, p)))
        .find(|(m, _)| m.coordinate == c)
}

fn arrives(motion: &Motion) -> f64 {
    match motion {
        Motion::To(level) => *level,
        Motion::Path(p) => p.knots.last().unwrap().level,
    }
}

/// The target without what cueonly cues did.
fn lasting(show: &Show, cue: Option<usize>, c: usize) -> f64 {
    let Some(k) = cue else { return 0.0 };
    match written(show, k, c) {
        Some((m, _)) if !show.cues[k].cueonly => arrives(&m.motion),
        _ => lasting(show, k.checked_sub(1), c),
    }
}

fn restores(show: &Show, k: usize, c: usize) -> bool {
    k > 0
        && show.cues[k - 1].cueonly
        && written(show, k - 1, c).is_some()
        && written(show, k, c).is_none()
}

fn tracked(show: &Show, cue: Option<usize>, c: usize) -> f64 {
    let Some(k) = cue else { return 0.0 };
    if let Some((m, _)) = written(show, k, c) {
        arrives(&m.motion)
    } else if restores(show, k, c) {
        lasting(show, Some(k), c)
    } else {
        tracked(show, k.checked_sub(1), c)
    }
}

fn moved(show: &Show, k: usize, c: usize) -> Option<(Motion, u32, &Part)> {
    show.coordinates()[c].bank?;
    if let Some((m, p)) = written(show, k, c) {
        return Some((m.motion.clone(), m.repeat, p));
    }
    let cue = &show.cues[k];
    (restores(show, k, c) || cue.assert)
        .then(|| (Motion::To(tracked(show, Some(k), c)), 1, &cue.parts[0]))
}

/// Level of a coordinate at `t` microseconds, of the first `count` cues alone.
pub fn level(show: &Show, go: &[(i64, i64)], c: usize, count: usize, t: i64) -> f64 {
    for k in (0..count).rev() {
        let Some((motion, repeat, part)) = moved(show, k, c) else {
            continue;
        };
        let start = go[k].0 + part.delay.micros();
        if start > t {
            continue;
        }
        let elapsed = t - start;
        let from = level(show, go, c, k, start);
        let whole = match &motion {
            Motion::To(to) if *to < from => part.down.micros(),
            Motion::To(_) => part.up.micros(),
            Motion::Path(p) => p.knots.last().unwrap().time.micros(),
        };
        let over = elapsed >= whole * i64::from(repeat);
        let within = if whole > 0 { elapsed % whole } else { 0 };
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
            Motion::Path(p) => {
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
                    .rposition(|k| k.time.micros() <= within)
                    .unwrap();
                let x = (within - p.knots[i].time.micros()) as f64 / 1e6;
                spline(p.interpolation, &at, &value, &slope, &handles, i, x)
            }
        };
    }
    0.0
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

/// The sum of binomial times power times coefficient.
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
