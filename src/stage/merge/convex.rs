//! Convex parts of a region without a simple outline, such as a wall with windows. Cuts are removed
//! one by one, the longest first, where the union is convex (Hertel and Mehlhorn 1983; at most four
//! times the least number of parts).

use std::collections::HashMap;

use super::{CORNERS, Mesh, sides};
use footlight_show::geometry::Vec3;

/// Most corners of a part before collinear ones are removed.
const MOST: usize = 4 * CORNERS;

/// A part of the region.
#[derive(Clone, Default)]
struct Part {
    outline: Vec<u32>,
    triangles: Vec<u32>,
}

/// The parts of a region.
pub fn parts(mesh: &Mesh, owner: u32, region: &[u32]) -> Vec<Vec<Vec3>> {
    let places: HashMap<u32, usize> = region.iter().enumerate().map(|(i, t)| (*t, i)).collect();
    let mut cuts = Vec::new();
    let mut area = Vec3::ZERO;
    for (here, triangle) in region.iter().enumerate() {
        area += mesh.area(*triangle);
        for edge in sides(mesh.triangle(*triangle)) {
            let other = mesh.within(edge, owner).and_then(|t| places.get(&t));
            if let Some(there) = other.filter(|there| here < **there) {
                let [a, b] = edge.map(|v| mesh.vertex(v));
                cuts.push(((b - a).length(), edge, [here, *there]));
            }
        }
    }
    cuts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut joined = Joined::new(mesh, region, area.normalized());
    for (_, edge, sides) in cuts {
        joined.join(edge, sides);
    }
    let mut out = Vec::new();
    for part in joined.parts {
        match mesh.straightened(&part.outline, &part.triangles) {
            _ if part.triangles.is_empty() => {}
            Some(polygon) => out.push(polygon),
            None => out.extend(part.triangles.iter().map(|t| mesh.corners(*t))),
        }
    }
    out
}

/// The parts while they are being merged.
struct Joined<'m> {
    mesh: &'m Mesh,
    normal: Vec3,
    /// A part without triangles has been merged into another.
    parts: Vec<Part>,
    /// The part into which each was merged, or itself.
    became: Vec<usize>,
}

impl<'m> Joined<'m> {
    fn new(mesh: &'m Mesh, region: &[u32], normal: Vec3) -> Joined<'m> {
        let part = |t: &u32| Part {
            outline: mesh.triangle(*t).to_vec(),
            triangles: vec![*t],
        };
        Joined {
            mesh,
            normal,
            parts: region.iter().map(part).collect(),
            became: (0..region.len()).collect(),
        }
    }

    fn find(&mut self, part: usize) -> usize {
        let mut at = part;
        while self.became[at] != at {
            self.became[at] = self.became[self.became[at]];
            at = self.became[at];
        }
        at
    }

    /// Removes the cut between the parts of two triangles if the union is convex.
    fn join(&mut self, edge: [u32; 2], sides: [usize; 2]) {
        let [here, there] = sides.map(|s| self.find(s));
        if here == there {
            return;
        }
        let (left, right) = (&self.parts[here], &self.parts[there]);
        let Some(outline) = self.union(&left.outline, &right.outline, edge) else {
            return;
        };
        let (few, many) = if left.triangles.len() < right.triangles.len() {
            (here, there)
        } else {
            (there, here)
        };
        let moved = std::mem::take(&mut self.parts[few]);
        let part = &mut self.parts[many];
        part.outline = outline;
        part.triangles.extend(moved.triangles);
        self.became[few] = many;
    }

    /// The outline of two parts without the edge from `a` to `b`, which the left one has in this
    /// direction; `None` when it is not convex.
    fn union(&self, left: &[u32], right: &[u32], [a, b]: [u32; 2]) -> Option<Vec<u32>> {
        if left.len() + right.len() > MOST {
            return None;
        }
        let mut outline = from(left, b)?;
        // Both loops begin and end at the edge.
        let rest = from(right, a)?;
        if outline.last() != Some(&a) || rest.last() != Some(&b) {
            return None;
        }
        outline.extend(rest.get(1..rest.len().checked_sub(1)?)?);
        without_spikes(&mut outline);
        let n = outline.len();
        let convex = (0..n).all(|i| {
            let [p, q, r] = [i, i + 1, i + 2].map(|k| self.mesh.vertex(outline[k % n]));
            let turn = (q - p).cross(r - q).dot(self.normal);
            turn >= -self.mesh.tolerance * (r - p).length()
        });
        (n >= 3 && convex).then_some(outline)
    }
}

/// The loop, rotated to begin at `start`.
fn from(outline: &[u32], start: u32) -> Option<Vec<u32>> {
    let at = outline.iter().position(|v| *v == start)?;
    let (before, after) = outline.split_at(at);
    Some([after, before].concat())
}

/// Removes the spikes that remain when two parts share more than one edge.
fn without_spikes(outline: &mut Vec<u32>) {
    let mut i = 0;
    let mut steady = 0;
    while outline.len() > 2 && steady < outline.len() {
        let n = outline.len();
        i %= n;
        let at = |k: usize| outline.get((i + k) % n);
        if at(0) == at(2) {
            outline.remove((i + 1) % n);
            let n = outline.len();
            outline.remove(i.min(n - 1));
            i = (i + n).saturating_sub(2);
            steady = 0;
        } else {
            i += 1;
            steady += 1;
        }
    }
}
