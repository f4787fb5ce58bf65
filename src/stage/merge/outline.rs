//! The outline of a region of triangles, when it is one simple loop.

use std::collections::HashMap;

use super::{Mesh, sides};
use footlight_show::geometry::Vec3;

/// Most consecutive corners tested for one line: more would cost quadratic time, and a remaining
/// corner on an edge does no harm.
const RUN: usize = 256;

/// The region as one polygon; `None` when it has holes, touches itself in a corner, or its outline
/// must be divided.
pub fn of(mesh: &Mesh, owner: u32, region: &[u32]) -> Option<Vec<Vec3>> {
    let mut next = HashMap::new();
    let mut start = None;
    for triangle in region {
        for edge in sides(mesh.triangle(*triangle)) {
            if mesh.within(edge, owner).is_some() {
                continue;
            }
            let [a, b] = edge;
            start = start.or(Some(a));
            if next.insert(a, b).is_some() {
                return None;
            }
        }
    }
    let start = start?;
    let mut outline = vec![start];
    let mut at = *next.get(&start)?;
    while at != start && outline.len() < next.len() {
        outline.push(at);
        at = *next.get(&at)?;
    }
    let whole = at == start && outline.len() == next.len();
    whole.then(|| mesh.straightened(&outline, region)).flatten()
}

/// The corners without those within `tolerance` of a straight edge between others.
pub fn without_straight(corners: &[Vec3], tolerance: f64) -> Vec<Vec3> {
    let origin = corners.first().copied().unwrap_or_default();
    // The corner farthest from any point is certainly a true corner.
    let distance = |i: &usize| corners.get(*i).map_or(0.0, |v| (*v - origin).length());
    let far = (0..corners.len()).max_by(|a, b| distance(a).total_cmp(&distance(b)));
    let far = far.unwrap_or_default();
    let mut round = corners
        .iter()
        .cycle()
        .skip(far)
        .copied()
        .take(corners.len() + 1);
    let Some(mut anchor) = round.next() else {
        return Vec::new();
    };
    let mut kept = vec![anchor];
    let mut run: Vec<Vec3> = Vec::new();
    for corner in round {
        let straight = run
            .iter()
            .all(|v| is_between(anchor, *v, corner, tolerance));
        // A run without corners is straight.
        if (!straight || run.len() >= RUN)
            && let Some(last) = run.last()
        {
            anchor = *last;
            kept.push(anchor);
            run.clear();
        }
        run.push(corner);
    }
    kept
}

fn is_between(a: Vec3, v: Vec3, b: Vec3, tolerance: f64) -> bool {
    let (along, d) = (b - a, v - a);
    let length = along.length();
    let at = d.dot(along);
    at >= 0.0 && at <= length * length && along.cross(d).length() <= tolerance * length
}

/// The length of a closed outline.
pub fn length(corners: &[Vec3]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners
        .iter()
        .zip(next)
        .map(|(a, b)| (*b - *a).length())
        .sum()
}
