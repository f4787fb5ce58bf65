//! When an animation's frames are drawn and how long each stays.

/// Delays are whole milliseconds where they fit, else coarser.
const MILLI: f64 = 1000.0;

/// A frame to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// Seconds from the start.
    pub(super) at: f64,
    /// Seconds it stays, as numerator and denominator.
    pub(super) delay: (u16, u16),
}

/// A stretch of the sequence, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    start: f64,
    end: f64,
    still: bool,
}

impl Stretch {
    fn frames(&self, rate: f64) -> usize {
        if self.still {
            return 1;
        }
        // A whole number of frames must not become one more by rounding.
        ((self.end - self.start) * rate - 1e-6).ceil().max(1.0) as usize
    }
}

/// A sequence cut into stretches, and the rate that keeps its number of frames in bounds.
pub(super) struct Pace {
    stretches: Vec<Stretch>,
    rate: f64,
}

impl Pace {
    /// `None` when the numbers make no animation. The rate is at most `rate` and such that there
    /// are at most `limit` frames. Where there are more stretches than that, what is still is
    /// drawn like the rest.
    pub(super) fn new(
        duration: f64,
        rate: f64,
        still: &[(f64, f64)],
        limit: usize,
    ) -> Option<Pace> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if !positive(duration) || !positive(rate) || limit == 0 {
            return None;
        }
        let mut pace = Pace {
            stretches: stretches(duration, still),
            rate,
        };
        if pace.stretches.len() > limit {
            pace.stretches = stretches(duration, &[]);
        }
        pace.slow_to_at_most(limit).then_some(pace)
    }

    pub(super) fn rate(&self) -> f64 {
        self.rate
    }

    /// Lowers the rate to at most `frames` frames, or to the fewest there can be. False when it
    /// cannot be lowered any more.
    pub(super) fn slow_to(&mut self, frames: usize) -> bool {
        let before = self.frames(self.rate);
        let goal = frames.clamp(self.stretches.len(), before);
        goal < before && self.slow_to_at_most(goal)
    }

    fn frames(&self, rate: f64) -> usize {
        self.stretches
            .iter()
            .fold(0, |sum: usize, s| sum.saturating_add(s.frames(rate)))
    }

    /// The highest rate up to the present one that gives at most `limit` frames, by bisection, cut
    /// to two decimals where that is not zero.
    fn slow_to_at_most(&mut self, limit: usize) -> bool {
        if self.frames(self.rate) <= limit {
            return true;
        }
        let (mut low, mut high) = (0.0, self.rate);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.frames(middle) <= limit {
                low = middle;
            } else {
                high = middle;
            }
        }
        let cut = (low * 100.0).floor() / 100.0;
        self.rate = if cut > 0.0 { cut } else { low };
        self.frames(self.rate) <= limit && self.rate > 0.0
    }

    pub(super) fn moments(&self) -> Vec<Moment> {
        let mut moments = Vec::new();
        for stretch in &self.stretches {
            let count = stretch.frames(self.rate);
            let step = (stretch.end - stretch.start) / count as f64;
            for i in 0..count {
                let start = stretch.start + step * i as f64;
                moments.push(Moment {
                    at: start + 0.5 * step,
                    delay: delay(start, start + step),
                });
            }
        }
        moments
    }
}

/// The time from `start` to `end`, both rounded, so that errors do not add up: milliseconds up to
/// a minute, then coarser; 18 hours at most.
fn delay(start: f64, end: f64) -> (u16, u16) {
    for unit in [1000, 100, 10, 1] {
        let rounded = |t: f64| (t * MILLI).round() * f64::from(unit) / MILLI;
        let units = (rounded(end) - rounded(start)).round();
        if units <= f64::from(u16::MAX) {
            return (units as u16, unit);
        }
    }
    (u16::MAX, 1)
}

/// The whole of `duration`, cut where stillness starts and ends. What overlaps counts once; what
/// is outside, reversed or NaN not at all.
fn stretches(duration: f64, still: &[(f64, f64)]) -> Vec<Stretch> {
    let cut = |&(a, b): &(f64, f64)| (a.max(0.0), b.min(duration));
    let inside = still.iter().filter(|(a, b)| a.is_finite() && b.is_finite());
    let mut still: Vec<(f64, f64)> = inside.map(cut).filter(|(a, b)| a < b).collect();
    still.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut all = Vec::new();
    let mut push = |start: f64, end: f64, still: bool| {
        // Less than the unit of delays would be a frame of no duration.
        if end - start >= 1.0 / MILLI {
            all.push(Stretch { start, end, still });
        }
    };
    let mut now = 0.0;
    for (start, end) in still {
        if end <= now {
            continue;
        }
        let start = start.max(now);
        push(now, start, false);
        push(start, end, true);
        now = end;
    }
    push(now, duration, false);
    if all.is_empty() {
        all.push(Stretch {
            start: 0.0,
            end: duration,
            still: true,
        });
    }
    all
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use proptest::prelude::*;

    #[test]
    fn long_delays_become_coarser_and_never_overflow() {
        assert_eq!(delay(0.0, 0.04), (40, 1000));
        assert_eq!(delay(0.0, 100.0), (10_000, 100));
        assert_eq!(delay(1.0, 3601.0), (36_000, 10));
        assert_eq!(delay(0.0, 1e9), (u16::MAX, 1));
    }

    proptest! {
        /// Any stillness: time is covered once, in order, within the limit and the rate.
        #[test]
        fn the_whole_time_is_covered(
            duration in 0.5_f64..60.0,
            rate in 0.5_f64..60.0,
            limit in 1_usize..400,
            still in prop::collection::vec((-5.0_f64..70.0, -5.0_f64..70.0), 0..12),
        ) {
            let pace = Pace::new(duration, rate, &still, limit).unwrap();
            let moments = pace.moments();
            prop_assert!(!moments.is_empty() && moments.len() <= limit);
            prop_assert!(pace.rate() <= rate);
            let seconds = |m: &Moment| f64::from(m.delay.0) / f64::from(m.delay.1);
            let total: f64 = moments.iter().map(seconds).sum();
            // Stretches under a millisecond are left out: at most one on each side of a still one.
            prop_assert!((total - duration).abs() < 1e-3 * (2.0 + 2.0 * still.len() as f64));
            prop_assert!(moments.is_sorted_by(|a, b| a.at < b.at));
            prop_assert!(moments.iter().all(|m| m.delay.0 > 0));
        }
    }
}
