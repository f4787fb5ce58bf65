//! Random shows for tests: some with a planted answer (segments, degrees, keys, rank), some wild.

#![allow(
    dead_code,
    missing_docs,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "test generators"
)]

use footlight_show::model::*;
use footlight_show::units::{CueNumber, Time, fraction};

/// Marsaglia's xorshift, sufficient for tests.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A whole number from `from` to `to`, inclusive.
    pub fn between(&mut self, from: i64, to: i64) -> i64 {
        from + ((self.next() >> 11) % (to - from + 1) as u64) as i64
    }

    pub fn chance(&mut self, share: f64) -> bool {
        (self.next() >> 11) as f64 / ((1u64 << 53) as f64) < share
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.between(0, from.len() as i64 - 1) as usize]
    }
}

pub fn seconds(s: f64) -> Time {
    Time::from_seconds(s).unwrap()
}

/// A show of `n` plain banks without cues.
pub fn empty(n: usize) -> Show {
    let bank = |i: usize| Bank {
        id: NodeId(i as u32),
        name: format!("b{i}"),
        lights: Vec::new(),
        channel: Some(i as u32 + 1),
        dimmer: Dimmer::Linear,
        rgb: false,
    };
    Show {
        title: "planted".to_owned(),
        banks: (0..n).map(bank).collect(),
        ..Show::default()
    }
}

pub fn fixed_light(show: &mut Show) {
    show.fixed.push(Fixed {
        id: NodeId(900),
        name: "exits".to_owned(),
        lights: Vec::new(),
        level: 0.1,
    });
}

/// A cue with one part; `number` counts from 1 in the order of the list.
pub fn cue(number: u32, trigger: Trigger, up: f64, moves: Vec<Move>) -> Cue {
    Cue {
        id: NodeId(1000 * number),
        number: CueNumber::from_thousandths(1000 * number).unwrap(),
        label: String::new(),
        note: String::new(),
        trigger,
        link: None,
        block: false,
        assert: false,
        cueonly: false,
        parts: vec![Part {
            id: NodeId(1000 * number + 1),
            number: 1,
            written: true,
            label: String::new(),
            delay: Time::ZERO,
            up: seconds(up),
            down: seconds(up),
            by_default: [false; 2],
            curve: Fade::LINEAR,
            moves,
            effects: Vec::new(),
        }],
    }
}

/// A fade to `percent` of full.
pub fn to(parameter: usize, percent: f64) -> Move {
    moving(parameter, Motion::To(fraction(percent)))
}

pub fn moving(parameter: usize, motion: Motion) -> Move {
    Move {
        id: NodeId(500_000 + parameter as u32),
        parameter,
        motion,
        repeat: 1,
    }
}

/// A knot at `percent` of full.
pub fn knot(time: f64, percent: f64) -> Knot {
    let level = fraction(percent);
    Knot {
        time: seconds(time),
        level,
        slope: 0.0,
        handles: [level; 2],
    }
}

/// A path through points of seconds and percent of full.
pub fn path(interpolation: Interpolation, points: &[(f64, f64)]) -> Motion {
    let knots = points.iter().map(|(t, l)| knot(*t, *l)).collect();
    Motion::Path(Path {
        interpolation,
        knots,
    })
}

/// A show and its expected properties.
#[derive(Debug)]
pub struct Planted {
    pub show: Show,
    /// Start and end in seconds, degree.
    pub segments: Vec<(f64, f64, usize)>,
    pub keys: usize,
    pub rank: usize,
}

/// A show of `n` banks whose settings are combinations of `rank` base curves, with segments of
/// these degrees (no two zeros in sequence). Percentages are multiples of small powers of two, so
/// that sums are exact; control points are within 0 to 100 %, so that positivity inserts nothing.
pub fn planted(random: &mut Random, n: usize, rank: usize, degrees: &[usize]) -> Planted {
    let mix = mixtures(random, n, rank);
    let level =
        |base: &[f64], c: usize| -> f64 { mix[c].iter().zip(base).map(|(w, b)| w * b).sum() };
    let mut show = empty(n);
    let mut points: Vec<Vec<f64>> = vec![base(random, rank, &[])];
    let first: Vec<Move> = (0..n).map(|c| to(c, level(&points[0], c))).collect();
    show.cues.push(cue(1, Trigger::At(Time::ZERO), 0.0, first));
    let mut here = points[0].clone();
    let mut time = 0.0;
    let mut segments = Vec::new();
    for (i, degree) in degrees.iter().enumerate() {
        let length = random.between(1, 40) as f64 / 4.0;
        // Sometimes return to an earlier look: its key must be equal.
        let again = random.chance(0.2) && points.len() > 3 && *degree == 3;
        let next = match degree {
            0 => here.clone(),
            _ if again => points[0].clone(),
            _ => base(random, rank, &points),
        };
        let handles = [base(random, rank, &points), base(random, rank, &points)];
        let mut moves = Vec::new();
        let mut fade = Fade::LINEAR;
        for c in 0..n {
            let (a, b) = (level(&here, c), level(&next, c));
            let h = [level(&handles[0], c), level(&handles[1], c)];
            match degree {
                0 => {}
                1 if c % 2 == 0 => moves.push(moving(
                    c,
                    path(Interpolation::Linear, &[(0.0, a), (length, b)]),
                )),
                1 => moves.push(to(c, b)),
                2 => {
                    fade = Fade::built_in("square").unwrap();
                    moves.push(to(c, b));
                }
                _ => {
                    let mut knots = vec![knot(0.0, a), knot(length, b)];
                    knots[0].handles = h.map(fraction);
                    let interpolation = Interpolation::Bezier;
                    moves.push(moving(
                        c,
                        Motion::Path(Path {
                            interpolation,
                            knots,
                        }),
                    ));
                }
            }
        }
        if *degree == 3 {
            points.extend(handles);
        }
        points.push(next.clone());
        let mut cue = cue(i as u32 + 2, Trigger::At(seconds(time)), length, moves);
        cue.parts[0].curve = fade;
        show.cues.push(cue);
        segments.push((time, time + length, *degree));
        time += length;
        here = next;
    }
    let mut distinct: Vec<Vec<f64>> = Vec::new();
    for p in points {
        if !distinct.contains(&p) {
            distinct.push(p);
        }
    }
    let spanned =
        footlight_show::linalg::Matrix::from_fn(rank, distinct.len(), |i, j| distinct[j][i]);
    let rank = footlight_show::linalg::svd(&spanned).unwrap().rank(1e-9);
    Planted {
        show,
        segments,
        keys: distinct.len(),
        rank,
    }
}

/// Each bank's shares of the base curves: the first banks are the curves themselves, the others
/// quarters that sum to one.
fn mixtures(random: &mut Random, n: usize, rank: usize) -> Vec<Vec<f64>> {
    let of = |c: usize, random: &mut Random| {
        let mut w = vec![0.0; rank];
        if c < rank {
            w[c] = 1.0;
        } else {
            for _ in 0..4 {
                w[random.between(0, rank as i64 - 1) as usize] += 0.25;
            }
        }
        w
    };
    (0..n).map(|c| of(c, random)).collect()
}

/// Percentages not in `taken`.
fn base(random: &mut Random, rank: usize, taken: &[Vec<f64>]) -> Vec<f64> {
    loop {
        let new: Vec<f64> = (0..rank)
            .map(|_| 4.0 * random.between(0, 25) as f64)
            .collect();
        if !taken.contains(&new) {
            return new;
        }
    }
}

/// A show with every feature: triggers and links of every kind, delays, interrupted moves, paths of
/// every interpolation, repeats, assert, cueonly, user curves, an rgb bank, fixed lights. Dimmers
/// are linear. Some of these shows leave 0 to 1.
pub fn wild(random: &mut Random) -> Show {
    let n = random.between(2, 5) as usize;
    let mut show = empty(n);
    show.banks[0].rgb = random.chance(0.3);
    if random.chance(0.5) {
        fixed_light(&mut show);
    }
    show.preview.gap = Time::from_micros(random.between(0, 3_000_000));
    show.curves.push(user_curve(random));
    let parameters = show
        .parameters()
        .iter()
        .filter(|c| c.bank.is_some())
        .count();
    let cues = random.between(1, 8);
    let mut clock = 0;
    for i in 1..=cues {
        let linked = show.cues.last().is_some_and(|c: &Cue| c.link.is_some());
        let trigger = if !linked && random.chance(0.3) {
            clock += random.between(0, 30_000_000);
            Trigger::At(Time::from_micros(clock))
        } else {
            Trigger::Go
        };
        let mut cue = cue(i as u32, trigger, 0.0, Vec::new());
        cue.assert = random.chance(0.15);
        cue.cueonly = random.chance(0.2);
        cue.parts = parts(random, i as u32, parameters);
        if i < cues && random.chance(0.4) {
            let t = Time::from_micros(random.between(0, 6_000_000));
            let link = if random.chance(0.5) {
                Link::Follow(t)
            } else {
                Link::Hang(t)
            };
            cue.link = Some((NodeId(i as u32), link));
        }
        show.cues.push(cue);
    }
    show
}

fn user_curve(random: &mut Random) -> NamedCurve {
    let interpolation = random.pick(&[
        Interpolation::Linear,
        Interpolation::Monotone,
        Interpolation::Natural,
        Interpolation::Steps,
    ]);
    let knot = |at: f64, value: f64| CurveKnot {
        at,
        value,
        slope: 0.0,
        handles: [value; 2],
    };
    let (a, b) = (random.between(1, 40), random.between(50, 90));
    NamedCurve {
        id: NodeId(800),
        name: "own".to_owned(),
        interpolation,
        knots: vec![
            knot(0.0, 0.0),
            knot(a as f64 / 100.0, 0.3),
            knot(b as f64 / 100.0, 0.6),
            knot(1.0, 1.0),
        ],
    }
}

fn parts(random: &mut Random, cue: u32, parameters: usize) -> Vec<Part> {
    let count = random.between(1, 2) as u32;
    let mut free: Vec<usize> = (0..parameters).collect();
    let mut fades: Vec<Fade> = FADES.iter().map(Fade::BuiltIn).collect();
    fades.push(Fade::Curve(0));
    let mut out = Vec::new();
    for number in 1..=count {
        let mut moves = Vec::new();
        free.retain(|c| {
            let take = random.chance(0.5);
            if take {
                moves.push(any_move(random, *c, cue));
            }
            !take
        });
        let duration = |random: &mut Random| {
            let us = if random.chance(0.2) {
                0
            } else {
                random.between(1, 9_000_000)
            };
            Time::from_micros(us)
        };
        out.push(Part {
            id: NodeId(1000 * cue + number),
            number,
            written: true,
            label: String::new(),
            delay: if random.chance(0.5) {
                duration(random)
            } else {
                Time::ZERO
            },
            up: duration(random),
            down: duration(random),
            by_default: [false; 2],
            curve: random.pick(&fades),
            moves,
            effects: Vec::new(),
        });
    }
    out
}

fn any_move(random: &mut Random, coordinate: usize, cue: u32) -> Move {
    use Interpolation as I;
    let mut out = to(coordinate, random.between(0, 100) as f64);
    out.id = NodeId(100_000 * cue + coordinate as u32);
    out.repeat = if random.chance(0.15) {
        random.between(2, 4) as u32
    } else {
        1
    };
    if random.chance(0.5) {
        return out;
    }
    let kinds = [
        I::Steps,
        I::Linear,
        I::Natural,
        I::Clamped,
        I::CatmullRom,
        I::Monotone,
        I::Hermite,
        I::Bezier,
    ];
    let mut time = 0;
    let mut knots = Vec::new();
    for _ in 0..random.between(1, 5) {
        let mut level = || random.between(25, 75) as f64 / 100.0;
        let (level, handles) = (level(), [level(), level()]);
        knots.push(Knot {
            time: Time::from_micros(time),
            level,
            slope: random.between(-8, 8) as f64 / 100.0,
            handles,
        });
        time += random.between(1000, 5_000_000);
    }
    let interpolation = random.pick(&kinds);
    out.motion = Motion::Path(Path {
        interpolation,
        knots,
    });
    out
}
