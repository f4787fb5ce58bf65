//! Polylines for drawing: cut to a span, thinned to visible detail.

use super::frame::Point;

/// Thins a line to at most four points per pixel column: the first, the lowest, the highest and the
/// last, in order, which cover the same pixels as all points.
///
/// The points' x must not decrease.
pub(super) fn thinned(points: &[Point]) -> Vec<Point> {
    let mut kept = Vec::with_capacity(points.len().min(4096));
    let same_column = |a: &Point, b: &Point| a.0.floor() == b.0.floor();
    for column in points.chunk_by(same_column) {
        if column.len() <= 4 {
            kept.extend_from_slice(column);
            continue;
        }
        let by_height = |a: &(usize, &Point), b: &(usize, &Point)| a.1.1.total_cmp(&b.1.1);
        let points = || column.iter().enumerate();
        let (lowest, highest) = (points().min_by(by_height), points().max_by(by_height));
        let four = [points().next(), lowest, highest, points().next_back()];
        let mut shown: Vec<(usize, &Point)> = four.into_iter().flatten().collect();
        shown.sort_unstable_by_key(|(index, _)| *index);
        shown.dedup_by_key(|(index, _)| *index);
        kept.extend(shown.into_iter().map(|(_, point)| *point));
    }
    kept
}

/// The curve through `points` (time, level) from `start` to `end`.
///
/// Between points it is straight; two points at one time are a jump; the first and last levels
/// extend outwards. Points that are not finite are dropped; the rest are sorted by time, stably.
/// Empty when no point is left or the span is invalid.
pub(super) fn cut(points: &[(f64, f64)], start: f64, end: f64) -> Vec<(f64, f64)> {
    let mut curve: Vec<(f64, f64)> = points
        .iter()
        .copied()
        .filter(|(time, level)| time.is_finite() && level.is_finite())
        .collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(&(_, opening)), Some(&(_, closing))) = (curve.first(), curve.last()) else {
        return Vec::new();
    };
    if !(start.is_finite() && end.is_finite() && start <= end) {
        return Vec::new();
    }
    curve.insert(0, (f64::NEG_INFINITY, opening));
    curve.push((f64::INFINITY, closing));
    let mut inside = Vec::with_capacity(curve.len());
    for pair in curve.windows(2) {
        let &[from, to] = pair else { continue };
        if to.0 < start || from.0 > end {
            continue;
        }
        for time in [from.0.clamp(start, end), to.0.clamp(start, end)] {
            let point = (time, between(from, to, time));
            if inside.last() != Some(&point) {
                inside.push(point);
            }
        }
    }
    inside
}

/// The level at `time` on the segment; exact at its ends.
fn between(from: (f64, f64), to: (f64, f64), time: f64) -> f64 {
    if time == from.0 || from.1 == to.1 {
        from.1
    } else if time == to.0 {
        to.1
    } else {
        from.1 + (to.1 - from.1) * ((time - from.0) / (to.0 - from.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_hold_outside_the_points_and_jumps_stay_upright() {
        let points = [(1.0, 0.2), (2.0, 0.6), (2.0, 0.1)];
        assert_eq!(
            cut(&points, 0.0, 3.0),
            [(0.0, 0.2), (1.0, 0.2), (2.0, 0.6), (2.0, 0.1), (3.0, 0.1)]
        );
    }

    #[test]
    fn segments_are_cut_where_the_span_ends() {
        let inside = cut(&[(0.0, 0.0), (10.0, 1.0)], 2.0, 4.0);
        assert_eq!(inside, [(2.0, 0.2), (4.0, 0.4)]);
    }

    #[test]
    fn points_that_are_no_numbers_are_left_out() {
        let points = [(f64::NAN, 1.0), (0.0, f64::INFINITY), (1.0, 0.5)];
        assert_eq!(cut(&points, 0.0, 2.0), [(0.0, 0.5), (1.0, 0.5), (2.0, 0.5)]);
        assert!(cut(&points[..2], 0.0, 2.0).is_empty());
        assert!(cut(&points, 2.0, 0.0).is_empty());
        assert!(cut(&points, f64::NAN, 0.0).is_empty());
    }

    #[test]
    fn points_out_of_order_are_sorted_and_one_of_a_kind_holds() {
        let sorted = cut(&[(2.0, 1.0), (0.0, 0.0)], 0.0, 2.0);
        assert_eq!(sorted, [(0.0, 0.0), (2.0, 1.0)]);
        assert_eq!(cut(&[(5.0, 0.5)], 0.0, 1.0), [(0.0, 0.5), (1.0, 0.5)]);
    }

    #[test]
    fn thinning_keeps_every_columns_extremes() {
        let wave = |index: i32| (index as f32 * 0.01, ((index * 37) % 101) as f32);
        let points: Vec<Point> = (0..100_000).map(wave).collect();
        let kept = thinned(&points);
        assert!(kept.len() <= 4 * 1001, "{}", kept.len());
        let extremes = |points: &[Point], column: f32| {
            let inside = points.iter().filter(|point| point.0.floor() == column);
            inside.fold((f32::MAX, f32::MIN), |(low, high), point| {
                (low.min(point.1), high.max(point.1))
            })
        };
        for column in [0.0, 1.0, 500.0, 998.0] {
            assert_eq!(extremes(&kept, column), extremes(&points, column));
        }
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        assert_eq!(kept.last(), points.last());
    }
}
