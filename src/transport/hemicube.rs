//! The cubic tetrahedron: which elements a point sees, weighted by form factor.
//!
//! After Cohen and Greenberg, "The Hemi-Cube" (1985), in the form of Beran-Koehn and Pavicic, "A
//! Cubic Tetrahedral Adaptation of the Hemi-Cube Algorithm" (1991): the corner of a cube points
//! along the normal, so that three faces cover the hemisphere: triangles above the horizon, from
//! slope -2 to 1. The finest pixels lie where the form factor is largest. It is turned about the normal by an angle that looks random:
//! aliasing becomes noise without pattern, several times smaller when summed. And only the table
//! of the pixels' form factors is normalised to sum to 1, never a row, so that open scenes lose the
//! light that leaves them. In a closed room a row sums to 1 because outlines are drawn wider by a
//! five-hundredth of a pixel: neighbours overlap and leave no gap. This room knows nothing of lights.

#![allow(
    clippy::indexing_slicing,
    reason = "buffers and tables have one entry for each pixel, corner, facet or element"
)]

use crate::geometry::{Vec3, frame};
use crate::transport::mesh::{Mesh, NONE};
use crate::transport::panorama::{BLACK, Outline, Panorama, Sheet, lead};
use crate::transport::surface::Surfaces;

/// The pixels' share of the hemisphere, one table for all faces of a resolution.
#[derive(Clone, Debug)]
pub struct Table {
    resolution: usize,
    weights: Vec<f32>,
    /// Those times the depth of a pixel's middle over its distance.
    nearness: Vec<f32>,
}

/// Points along a pixel's side at which its share is averaged.
const FINE: usize = 4;

impl Table {
    /// For `resolution` pixels along the edge of a cube, half as many more along that of a face.
    pub fn new(resolution: usize) -> Table {
        let resolution = resolution * 3 / 2;
        let n = (resolution * FINE) as f64;
        let at = |i: usize| (i as f64 + 0.5) * 3.0 / n - 2.0;
        let density = |x: f64, y: f64| (1.0 + x + y).max(0.0) / (1.0 + x * x + y * y).powi(2);
        let pixel = |column: usize, row: usize| -> f64 {
            // A pixel whose middle is not above the horizon may see nothing: its share goes to all.
            if column < lead(resolution, row) {
                return 0.0;
            }
            let fine = (0..FINE * FINE).map(|k| (k % FINE, k / FINE));
            fine.map(|(i, j)| density(at(column * FINE + i), at(row * FINE + j)))
                .sum()
        };
        let raw: Vec<f64> = (0..resolution * resolution)
            .map(|k| pixel(k % resolution, k / resolution))
            .collect();
        let total = 3.0 * raw.iter().sum::<f64>();
        let step = 3.0 / resolution as f64;
        let slant = |k: usize| {
            let [x, y] = [k % resolution, k / resolution].map(|i| (i as f64 + 0.5) * step - 2.0);
            (1.0 + x * x + y * y).sqrt()
        };
        let nearness = raw.iter().enumerate();
        Table {
            resolution,
            nearness: nearness
                .map(|(k, w)| (w / total / slant(k)) as f32)
                .collect(),
            weights: raw.iter().map(|w| (w / total) as f32).collect(),
        }
    }
}

/// A row of form factors: elements and their shares, each element once.
pub type Row = Vec<(u32, f32)>;

/// What a point sees, all in all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outlook {
    /// One over the harmonic mean distance of all that is seen, weighted by form factor (1/m); what
    /// is open counts as infinitely far.
    pub closeness: f32,
    /// Sum of the form factors to elements, 0 to 1.
    pub seen: f32,
}

impl Outlook {
    /// How fast reflected light changes, as a share of itself (1/m).
    pub fn change(&self) -> f32 {
        if self.seen > 0.0 {
            self.closeness / self.seen
        } else {
            0.0
        }
    }
}

/// Where a facet's grid is, seen from a point: cells are
/// `offset + slopes . ray / inverse depth`.
#[derive(Clone, Copy, Debug, Default)]
struct Placed {
    /// The hemicube that it was placed for.
    stamp: u64,
    offset: [f32; 2],
    slopes: [[f32; 3]; 2],
}

/// Working memory for one thread.
#[derive(Debug)]
pub struct Hemicube<'a> {
    surfaces: &'a Surfaces,
    mesh: &'a Mesh,
    table: &'a Table,
    panorama: Panorama<'a>,
    sheet: Sheet,
    placed: Vec<Placed>,
    stamp: u64,
    /// Share of each element, and which have one.
    shares: Vec<f32>,
    touched: Vec<u32>,
}

/// A number in 0..1 that looks random, from an index (the finaliser of SplitMix64).
pub fn scatter(index: u64) -> f64 {
    let mut z = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Three orthogonal unit vectors whose sum points along `normal`, turned about it by a `turn` in
/// 0..1 of the third of a circle after which they repeat.
fn corner(normal: Vec3, turn: f64) -> [Vec3; 3] {
    let [a, b] = frame(normal);
    let third = std::f64::consts::TAU / 3.0;
    [0.0, 1.0, 2.0].map(|k| {
        let (sine, cosine) = ((turn + k) * third).sin_cos();
        normal * (1.0 / 3.0_f64.sqrt()) + (a * cosine + b * sine) * (2.0 / 3.0_f64).sqrt()
    })
}

impl<'a> Hemicube<'a> {
    /// Hemicubes that look at `mesh`, whose polygons are `outline`.
    pub fn new(
        surfaces: &'a Surfaces,
        outline: &'a Outline,
        mesh: &'a Mesh,
        table: &'a Table,
    ) -> Hemicube<'a> {
        Hemicube {
            surfaces,
            mesh,
            table,
            panorama: Panorama::new(outline),
            sheet: Sheet::new(table.resolution),
            placed: vec![Placed::default(); surfaces.facets.len()],
            stamp: 0,
            shares: vec![0.0; mesh.elements.len()],
            touched: Vec::new(),
        }
    }

    /// Form factors from `point` of `facet` to every element; `turn` in 0..1 turns the cube.
    pub fn row(&mut self, facet: usize, point: Vec3, turn: f64) -> Row {
        let mut row = Row::new();
        self.visit(facet, point, turn, |element, share| {
            row.push((element, share))
        });
        row
    }

    /// The same, each element given to `take` once, in an order that depends on the scene alone.
    pub fn visit(
        &mut self,
        facet: usize,
        point: Vec3,
        turn: f64,
        mut take: impl FnMut(u32, f32),
    ) -> Outlook {
        let axes = corner(self.surfaces.facets[facet].normal, turn);
        self.stamp += 1;
        self.panorama.look(self.surfaces, facet, point, axes);
        let mut closeness = 0.0;
        for face in 0..3 {
            self.sheet.clear();
            self.panorama.draw(face, &mut self.sheet);
            closeness += self.closeness();
            self.resolve(face, point, axes);
        }
        let mut seen = 0.0;
        for e in self.touched.drain(..) {
            let share = std::mem::take(&mut self.shares[e as usize]);
            seen += share;
            take(e, share);
        }
        Outlook { closeness, seen }
    }

    /// Sum over a face of the pixels' shares over their distances; nothing is drawn below the
    /// horizon that counts.
    fn closeness(&self) -> f32 {
        let depths = self.sheet.inverse_depths.iter();
        depths.zip(&self.table.nearness).map(|(d, n)| d * n).sum()
    }

    /// Gives the pixels of a face to the elements that they see.
    fn resolve(&mut self, face: usize, point: Vec3, axes: [Vec3; 3]) {
        let n = self.table.resolution;
        let step = 3.0 / n as f32;
        let (forward, right, up) = (face, (face + 1) % 3, (face + 2) % 3);
        for row in 0..n {
            let y = (row as f32 + 0.5) * step - 2.0;
            let mut current = BLACK;
            let (mut placed, mut base) = (Placed::default(), [0.0_f32; 2]);
            let (mut counts, mut first) = ([1.0_f32; 2], 0);
            for column in lead(n, row)..n {
                let at = row * n + column;
                let item = self.sheet.items[at];
                if item >= BLACK {
                    continue;
                }
                if item != current {
                    let Some(grid) = &self.mesh.grids[item as usize] else {
                        continue;
                    };
                    current = item;
                    placed = self.place(item as usize, point, axes);
                    base = [0, 1].map(|k| placed.slopes[k][forward] + placed.slopes[k][up] * y);
                    counts = grid.counts().map(|c| c as f32 - 1e-3);
                    first = grid.first();
                }
                let x = (column as f32 + 0.5) * step - 2.0;
                let depth = 1.0 / self.sheet.inverse_depths[at];
                let place = [0, 1].map(|k| {
                    let ray = base[k] + placed.slopes[k][right] * x;
                    // The outermost cells take what rounding puts beyond them.
                    (placed.offset[k] + ray * depth).max(0.0).min(counts[k])
                });
                let line = counts[0] as usize + 1;
                let [u, v] = place.map(|x| x as usize);
                let element = self.mesh.seen(first + v * line + u, place);
                let weight = self.table.weights[at];
                if element != NONE {
                    let share = &mut self.shares[element as usize];
                    if *share == 0.0 {
                        self.touched.push(element);
                    }
                    *share += weight;
                }
            }
        }
    }

    /// The grid of a facet as the point sees it.
    fn place(&mut self, facet: usize, point: Vec3, axes: [Vec3; 3]) -> Placed {
        let known = self.placed[facet];
        if known.stamp == self.stamp {
            return known;
        }
        let mut made = Placed {
            stamp: self.stamp,
            ..Placed::default()
        };
        if let Some(grid) = &self.mesh.grids[facet] {
            made.offset = grid.place(point).map(|x| x as f32);
            made.slopes = grid
                .slopes()
                .map(|slope| axes.map(|axis| slope.dot(axis) as f32));
        }
        self.placed[facet] = made;
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{block, vec3};
    use crate::scene::{Material, Polygon, Scene};
    use crate::transport::direct::Setting;
    use crate::transport::element::Element;
    use crate::transport::mesh::{Layout, Wish};
    use crate::transport::solid::Solids;
    use crate::transport::visibility::Hierarchy;
    use crate::units::Rgb;
    use std::collections::BTreeMap;

    /// A box 2 x 2 x 1 seen from inside, its lid as wide as `lid`.
    fn room(lid: f64) -> Surfaces {
        let (x, y, z) = (
            vec3(2.0, 0.0, 0.0),
            vec3(0.0, 2.0, 0.0),
            vec3(0.0, 0.0, 1.0),
        );
        let o = vec3(-1.0, -1.0, 0.0);
        let quad = |a: Vec3, u: Vec3, v: Vec3| Polygon {
            vertices: vec![a, a + u, a + u + v, a + v],
            material: 0,
        };
        let polygons = vec![
            quad(o, x, y),
            quad(o + z, y, x * lid),
            quad(o, z, x),
            quad(o + y, x, z),
            quad(o, y, z),
            quad(o + x, z, y),
        ];
        let materials = vec![Material {
            name: "wall".into(),
            reflectance: Rgb([0.5; 3]),
            emission: Rgb::default(),
        }];
        Surfaces::new(&Scene {
            materials,
            polygons,
        })
        .unwrap()
    }

    fn with_cube<T>(
        surfaces: &Surfaces,
        resolution: usize,
        task: impl Fn(&mut Hemicube<'_>, &Mesh) -> T,
    ) -> T {
        let hierarchy = Hierarchy::new(surfaces);
        let setting = Setting {
            surfaces,
            hierarchy: &hierarchy,
        };
        let layout = Layout::of_elements(surfaces, 60);
        let all = vec![Wish::WANTED; layout.cells()];
        let mesh = layout.mesh(setting, &[vec3(0.0, 0.0, 0.5)], &all);
        let (outline, table) = (Outline::new(surfaces), Table::new(resolution));
        task(&mut Hemicube::new(surfaces, &outline, &mesh, &table), &mesh)
    }

    fn floor(surfaces: &Surfaces) -> usize {
        surfaces
            .facets
            .iter()
            .position(|f| f.normal.z > 0.9)
            .unwrap()
    }

    /// From the middle of the floor to the lid; from beside a wall to that wall.
    #[test]
    fn closed_forms_are_met_better_with_resolution() {
        let surfaces = room(1.0);
        let root = 0.5_f64.sqrt();
        let lid = 4.0 * root * root.atan() / std::f64::consts::PI;
        let mut last = f64::INFINITY;
        for (resolution, most) in [(8, 0.011), (16, 0.005), (32, 0.0015), (64, 0.0006)] {
            let seen = with_cube(&surfaces, resolution, |cube, mesh| {
                let row = |i| cube.row(floor(&surfaces), Vec3::ZERO, scatter(i));
                let rows: Vec<Row> = (0..64).map(row).collect();
                let above =
                    |e: u32| surfaces.facets[mesh.elements[e as usize].facet].normal.z < -0.9;
                let all = rows.iter().flatten().filter(|r| above(r.0));
                all.map(|r| f64::from(r.1)).sum::<f64>() / 64.0
            });
            let error = (seen / lid - 1.0).abs();
            assert!(error < most && error < last, "{resolution}: {seen} {lid}");
            last = error;
        }
    }

    #[test]
    fn a_closed_room_is_seen_whole_from_everywhere() {
        let surfaces = room(1.0);
        with_cube(&surfaces, 16, |cube, mesh| {
            for (i, e) in mesh.elements.iter().enumerate() {
                for turn in [0.0, scatter(i as u64)] {
                    let row = cube.row(e.facet, e.centre, turn);
                    let sum: f64 = row.iter().map(|r| f64::from(r.1)).sum();
                    assert!((sum - 1.0).abs() < 3e-6, "element {i}: {sum}");
                }
            }
        });
    }

    /// Under a ceiling without end at height h the mean of one over the distance is 2 / (3 h).
    #[test]
    fn what_is_near_is_told() {
        let surfaces = room(1.0);
        with_cube(&surfaces, 32, |cube, _| {
            let near = cube.visit(floor(&surfaces), vec3(0.2, 0.1, 0.0), 0.3, |_, _| ());
            let near = near.closeness;
            // The walls of the room are a little nearer than such a ceiling, and some farther.
            assert!((0.67..0.85).contains(&near), "{near}");
        });
        let sheets = [0.0, 2.0].map(|z| {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let corner = |(x, y): (f64, f64)| vec3(400.0 * x, 400.0 * y * (1.0 - z), z);
            corners.map(corner).to_vec()
        });
        let surfaces = Surfaces::grey(sheets.to_vec());
        with_cube(&surfaces, 64, |cube, _| {
            let near = cube.visit(floor(&surfaces), Vec3::ZERO, 0.3, |_, _| ());
            let near = near.closeness;
            assert!((near - 1.0 / 3.0).abs() < 2e-3, "{near}");
        });
    }

    /// A block on the floor, drawn with all its faces and without those that its fronts hide.
    #[test]
    fn backs_of_solids_change_nothing() {
        let facets = room(1.0).facets.into_iter();
        let mut polygons: Vec<Vec<Vec3>> = facets.map(|f| f.vertices).collect();
        let corners = [vec3(0.2, -0.1, 0.0), vec3(0.7, 0.3, 0.6)];
        polygons.extend_from_slice(&block(corners, false)[..5]);
        let with_block = Surfaces::grey(polygons);
        let mut without = with_block.clone();
        without.solids = Solids::new(&[], &without.pieces, without.touching()).into();
        assert_eq!(
            (with_block.solids().count(), without.solids().count()),
            (1, 0)
        );
        let rows = |surfaces: &Surfaces| {
            with_cube(surfaces, 16, |cube, mesh| {
                let row =
                    |(i, e): (usize, &Element)| cube.row(e.facet, e.centre, scatter(i as u64));
                mesh.elements
                    .iter()
                    .enumerate()
                    .map(row)
                    .collect::<Vec<Row>>()
            })
        };
        // Outlines are widened: a pixel on a back's rim may have been black. Its share is below .002.
        let shares = |row: &Row| row.iter().copied().collect::<BTreeMap<u32, f32>>();
        for (a, b) in rows(&with_block).iter().zip(&rows(&without)) {
            let (a, b) = (shares(a), shares(b));
            assert!(a.keys().eq(b.keys()));
            let apart = a.values().zip(b.values()).map(|(x, y)| (x - y).abs());
            assert!(apart.sum::<f32>() < 0.002);
        }
    }

    /// Normalised rows would sum to 1 in any scene; ours lose what leaves by the open half.
    #[test]
    fn what_leaves_an_open_scene_is_lost() {
        let surfaces = room(0.5);
        let lid = 2.0 * 0.5_f64.sqrt() * 0.5_f64.sqrt().atan() / std::f64::consts::PI;
        with_cube(&surfaces, 64, |cube, _| {
            let row = cube.row(floor(&surfaces), Vec3::ZERO, 0.3);
            let sum: f64 = row.iter().map(|r| f64::from(r.1)).sum();
            assert!((sum - (1.0 - lid)).abs() < 0.006, "{sum}");
        });
    }
}
