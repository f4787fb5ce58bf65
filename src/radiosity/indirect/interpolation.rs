//! GatherPoints that need no hemicube, as they stand between others that see about the same.
//!
//! How fast reflected light can change is known from how near the things are that a gather point
//! sees (Ward, Rubinstein and Clear, "A Ray Tracing Solution for Diffuse Interreflection", 1988):
//! over a distance d by about d / R, with R the harmonic mean of their distances, taken of what
//! sends light: in the open the light of the little that is seen changes faster, as a share of
//! itself. So first one gather point of 64 looks, the eighth along each line, and the last; then
//! those halfway between two or four of them where d / R is large, then those halfway between
//! these, and so on. All others take the mean of what they stand between, so that gather points are
//! as dense as the picture wants them at corners and joints, and as the light wants them elsewhere.
//! At a reach of .07 seven eighths of the tavern's gather points look, which is full of small
//! things, five sixths of the stage's at the third step and seven tenths at the fourth, and half of
//! a bare room's at .1. Invariant: who looks follows from the scene and the gather points alone, so
//! that G stays linear.

#![allow(
    clippy::indexing_slicing,
    reason = "nodes are of the mesh's own elements, whose values are laid out one after the other"
)]

use crate::radiosity::indirect::hemicube::NearbyEmission;
use crate::radiosity::mesh::Mesh;
use crate::radiosity::mesh::grid::Grid;

/// Cells between the gather points that look first.
const COARSEST: usize = 8;

/// A gather point must stand this near to where its cell has its sample, in cells.
const OFF: f64 = 0.1;

/// A gather point that takes shares of others, none of them twice.
#[derive(Clone, Debug)]
struct Fill {
    gather_point: u32,
    from: Vec<(u32, f32)>,
}

/// What the gather points between others take.
#[derive(Clone, Debug)]
pub struct Interpolation {
    /// In an order in which what is taken is known.
    fills: Vec<Fill>,
    /// What each gather point sees.
    pub nearby: Vec<NearbyEmission>,
}

impl Interpolation {
    /// Makes gather points look by `look`, which answers with what they see; those that stand
    /// nearer to others than a share `reach` of the distance over which their light changes are
    /// left out.
    ///
    /// # Errors
    /// Those of `look`.
    pub fn gather_points<E>(
        mesh: &Mesh,
        reach: f64,
        mut look: impl FnMut(&[u32]) -> Result<Vec<NearbyEmission>, E>,
    ) -> Result<Interpolation, E> {
        let mut all = Interpolation {
            fills: Vec::new(),
            nearby: vec![NearbyEmission::default(); mesh.elements.len()],
        };
        // A point that does not stand as its grid says looks for itself, and gives to none.
        let mut regular = vec![false; mesh.elements.len()];
        mesh.each_whole(|grid, at, gather_point| {
            regular[gather_point] = is_regular(mesh, grid, at, gather_point)
        });
        let mut missing: Vec<u32> = (0..regular.len() as u32)
            .filter(|n| !regular[*n as usize])
            .collect();
        let mut stride = COARSEST;
        while stride > 0 {
            mesh.each_whole(|grid, at, gather_point| {
                let counts = grid.counts();
                let turn = |stride| (0..2).all(|k| is_on(at[k], counts[k], stride));
                let done = stride < COARSEST && turn(2 * stride);
                if !regular[gather_point] || !turn(stride) || done {
                    return;
                }
                // These have had their turn: they are on strides of twice the length.
                let is_even = |from: &Vec<(u32, f32)>| {
                    let near = |(n, _): &(u32, f32)| {
                        let other = *n as usize;
                        regular[other] && all.way(mesh, gather_point, other) < reach
                    };
                    stride < COARSEST && from.iter().all(near)
                };
                match parents(mesh, grid, at, stride).filter(is_even) {
                    Some(from) => {
                        all.nearby[gather_point] = all.mean(&from);
                        let gather_point = gather_point as u32;
                        all.fills.push(Fill { gather_point, from });
                    }
                    None => missing.push(gather_point as u32),
                }
            });
            missing.sort_unstable();
            let seen = look(&missing)?;
            for (gather_point, near) in missing.drain(..).zip(seen) {
                all.nearby[gather_point as usize] = near;
            }
            stride /= 2;
        }
        Ok(all)
    }

    /// How far it is from a gather point to another, as a share of the distance over which the
    /// light of the other changes.
    fn way(&self, mesh: &Mesh, gather_point: usize, other: usize) -> f64 {
        let [a, b] = [gather_point, other].map(|n| mesh.elements[n].centre);
        (a - b).length() * f64::from(self.nearby[other].change())
    }

    fn mean(&self, from: &[(u32, f32)]) -> NearbyEmission {
        let sum = |part: fn(&NearbyEmission) -> f32| {
            let shares = from
                .iter()
                .map(|(n, share)| share * part(&self.nearby[*n as usize]));
            shares.sum()
        };
        NearbyEmission {
            inverse_distance: sum(|o| o.inverse_distance),
            seen: sum(|o| o.seen),
        }
    }

    /// Fills rows of `width` values, one row for each gather point.
    pub fn fill(&self, values: &mut [f32], width: usize) {
        for Fill { gather_point, from } in &self.fills {
            let at = *gather_point as usize * width;
            for k in 0..width {
                let share =
                    |sum, (n, share): &(u32, f32)| sum + share * values[*n as usize * width + k];
                values[at + k] = from.iter().fold(0.0, share);
            }
        }
    }
}

fn is_regular(mesh: &Mesh, grid: &Grid, at: [usize; 2], gather_point: usize) -> bool {
    let place = grid.place(mesh.elements[gather_point].centre);
    (0..2).all(|k| (place[k] - grid.stand(at[k], grid.counts()[k])).abs() < OFF)
}

/// Is a cell a whole number of strides from the first along its line, or the last?
fn is_on(at: usize, count: usize, stride: usize) -> bool {
    at.is_multiple_of(stride) || at + 1 == count
}

/// Those that a gather point stands between, `stride` cells away along the axes along which it is
/// an odd number of strides from the first, or the last of their line, with bilinear shares; `None`
/// if one is missing.
fn parents(mesh: &Mesh, grid: &Grid, at: [usize; 2], stride: usize) -> Option<Vec<(u32, f32)>> {
    let mut from = vec![(at, 1.0)];
    for axis in 0..2 {
        let count = grid.counts()[axis];
        if is_on(at[axis], count, 2 * stride) {
            continue;
        }
        let (low, high) = (at[axis] - stride, (at[axis] + stride).min(count - 1));
        let [a, b, x] = [low, high, at[axis]].map(|i| grid.stand(i, count));
        let share = ((x - a) / (b - a)) as f32;
        let split = |(mut at, own): ([usize; 2], f32)| {
            [(low, 1.0 - share), (high, share)].map(|(i, share)| {
                at[axis] = i;
                (at, own * share)
            })
        };
        from = from.into_iter().flat_map(split).collect();
    }
    let gather_point = |(at, share)| Some((mesh.whole(grid, at)? as u32, share));
    from.into_iter().map(gather_point).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::geometry::{Vec3, block, vec3};
    use crate::radiosity::direct::Setting;
    use crate::radiosity::geometry::surface::Surfaces;
    use crate::radiosity::indirect::hemicube::{Hemicube, Table, scatter};
    use crate::radiosity::mesh::{CellRequest, Layout};
    use crate::radiosity::visibility::Hierarchy;
    use crate::radiosity::visibility::hemicube_raster::VertexBuffer;
    use std::convert::Infallible;

    /// Elements and gather points of a room of 6 x 6 x 4 m with a table of half a metre in it.
    fn with_room<T>(task: impl Fn(Setting<'_>, &Mesh, &Mesh) -> T) -> T {
        let mut polygons = block([Vec3::ZERO, vec3(6.0, 6.0, 4.0)], true).to_vec();
        let table = [vec3(2.0, 3.0, 0.0), vec3(2.6, 3.6, 0.5)];
        polygons.extend_from_slice(&block(table, false)[..5]);
        let surfaces = Surfaces::grey(polygons);
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        let made = |layout: Layout| {
            let requests = vec![CellRequest::WANTED; layout.cells()];
            layout.mesh(setting, &[vec3(3.0, 1.0, 2.0)], &requests)
        };
        let elements = made(Layout::of_elements(&surfaces, 300));
        let gather_points = made(Layout::of_gather_points(&surfaces, 8000, &[0.0; 11]));
        task(setting, &elements, &gather_points)
    }

    /// What every gather point sees of the ceiling when only some look, by how many looked, and the
    /// greatest error against all of them looking.
    fn seen(
        setting: Setting<'_>,
        elements: &Mesh,
        gather_points: &Mesh,
        reach: f64,
    ) -> (usize, Vec<f32>) {
        let surfaces = setting.surfaces;
        let (vertices, table) = (VertexBuffer::new(surfaces), Table::new(64));
        let mut cube = Hemicube::new(setting, &vertices, elements, &table);
        let mut values = vec![0.0; gather_points.elements.len()];
        let mut looked = 0;
        let between = Interpolation::gather_points(gather_points, reach, |which| {
            looked += which.len();
            let mut look = |n: &u32| {
                let gather_point = &gather_points.elements[*n as usize];
                let sum = &mut values[*n as usize];
                let turn = scatter(u64::from(*n));
                cube.visit(gather_point.facet, gather_point.centre, turn, |e, share| {
                    let facet = elements.elements[e as usize].facet;
                    if surfaces.facets[facet].normal.z < -0.9 {
                        *sum += share;
                    }
                })
            };
            Ok::<_, Infallible>(which.iter().map(&mut look).collect())
        });
        between.unwrap().fill(&mut values, 1);
        (looked, values)
    }

    #[test]
    fn most_nodes_need_not_look() {
        with_room(|setting, elements, gather_points| {
            let (all, exact) = seen(setting, elements, gather_points, 0.0);
            assert_eq!(all, gather_points.elements.len());
            let mut last = (usize::MAX, 0.0);
            for (reach, share, most) in [(0.1, 0.55, 3e-3), (0.2, 0.35, 8e-3)] {
                let (looked, found) = seen(setting, elements, gather_points, reach);
                let apart = found
                    .iter()
                    .zip(&exact)
                    .map(|(a, b)| f64::from(a - b).powi(2));
                let power: f64 = exact.iter().map(|b| f64::from(*b).powi(2)).sum();
                let error = (apart.sum::<f64>() / power).sqrt();
                println!("reach {reach}: {looked} of {all} look, error {error:.5}");
                assert!(
                    looked < (all as f64 * share) as usize && looked < last.0,
                    "{looked}"
                );
                assert!(error < most && error > last.1, "{error}");
                last = (looked, error);
            }
        });
    }

    /// Interpolation gather points before which black things stand there may be a gap that lets
    /// light in; in the void there is nothing to miss.
    #[test]
    fn among_black_things_every_node_looks() {
        with_room(|_, _, gather_points| {
            let looking = |inverse_distance| {
                let mut looked = 0;
                let dark = NearbyEmission {
                    inverse_distance,
                    seen: 0.0,
                };
                let all = Interpolation::gather_points(gather_points, 0.1, |which| {
                    looked += which.len();
                    Ok::<_, Infallible>(vec![dark; which.len()])
                });
                all.unwrap();
                looked
            };
            assert_eq!(looking(0.5), gather_points.elements.len());
            assert!(looking(0.0) < gather_points.elements.len() / 8);
        });
    }

    #[test]
    fn slopes_stay_as_they_are() {
        with_room(|_, _, gather_points| {
            let slope = |n: &u32| {
                let centre = gather_points.elements[*n as usize].centre;
                centre.dot(vec3(0.3, -0.2, 0.5)) as f32
            };
            let mut values = vec![f32::NAN; gather_points.elements.len()];
            let near = NearbyEmission {
                inverse_distance: 0.05,
                seen: 1.0,
            };
            let between = Interpolation::gather_points(gather_points, 0.5, |which| {
                for n in which {
                    values[*n as usize] = slope(n);
                }
                Ok::<_, Infallible>(vec![near; which.len()])
            });
            between.unwrap().fill(&mut values, 1);
            for (n, value) in (0..).zip(&values) {
                assert!(
                    (value - slope(&n)).abs() < 2e-3,
                    "{n}: {value} {}",
                    slope(&n)
                );
            }
        });
    }
}
