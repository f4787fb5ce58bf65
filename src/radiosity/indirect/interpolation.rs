//! Irradiance interpolation: gather points that need no hemicube of their own.
//!
//! Irradiance changes over a distance d by about d / R, where R is the harmonic mean distance of
//! what is seen (Ward, Rubinstein and Clear, "A Ray Tracing Solution for Diffuse Interreflection",
//! 1988), here of what sends light. The first pass draws the hemicubes of one gather point in 64;
//! each further pass halves the stride, draws those where d / R to their parents is large, and
//! interpolates the others. Invariant: the choice depends on the scene and the gather points alone,
//! so that G stays linear.

#![allow(
    clippy::indexing_slicing,
    reason = "nodes are of the mesh's own elements, whose values are laid out one after the other"
)]

use crate::radiosity::indirect::hemicube::NearbyEmission;
use crate::radiosity::mesh::Mesh;
use crate::radiosity::mesh::grid::Grid;

/// Cells between the gather points of the first pass.
const COARSEST: usize = 8;

/// Greatest distance of a gather point from its place in the grid, in cells.
const OFF: f64 = 0.1;

/// An interpolated gather point with its parents and their weights.
#[derive(Clone, Debug)]
struct Fill {
    gather_point: u32,
    from: Vec<(u32, f32)>,
}

/// The gather points that are interpolated.
#[derive(Clone, Debug)]
pub struct Interpolation {
    /// Parents before those that need them.
    fills: Vec<Fill>,
    /// At each gather point.
    pub nearby: Vec<NearbyEmission>,
}

impl Interpolation {
    /// Chooses the gather points that need a hemicube, in passes: `sample` draws those of a pass
    /// and returns their nearby emission. One that is nearer to its parents than a share `reach` of
    /// the distance over which their light changes is interpolated.
    ///
    /// # Errors
    /// Those of `sample`.
    pub fn new<E>(
        mesh: &Mesh,
        reach: f64,
        mut sample: impl FnMut(&[u32]) -> Result<Vec<NearbyEmission>, E>,
    ) -> Result<Interpolation, E> {
        let mut all = Interpolation {
            fills: Vec::new(),
            nearby: vec![NearbyEmission::default(); mesh.elements.len()],
        };
        // A point that has been moved from its place in the grid is neither interpolated nor a
        // parent.
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
                let counts = grid.counts;
                let turn = |stride| (0..2).all(|k| is_on(at[k], counts[k], stride));
                let done = stride < COARSEST && turn(2 * stride);
                if !regular[gather_point] || !turn(stride) || done {
                    return;
                }
                // Parents lie on the coarser stride: earlier passes have dealt with them.
                let is_even = |from: &Vec<(u32, f32)>| {
                    let near = |(n, _): &(u32, f32)| {
                        let other = *n as usize;
                        regular[other] && all.error(mesh, gather_point, other) < reach
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
            let sampled = sample(&missing)?;
            for (gather_point, near) in missing.drain(..).zip(sampled) {
                all.nearby[gather_point as usize] = near;
            }
            stride /= 2;
        }
        Ok(all)
    }

    /// Ward's error bound: the distance from a gather point to another, as a share of the distance
    /// over which the light of the other changes.
    fn error(&self, mesh: &Mesh, gather_point: usize, other: usize) -> f64 {
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
    (0..2).all(|k| (place[k] - grid.stand(at[k], grid.counts[k])).abs() < OFF)
}

/// Is a cell a whole number of strides from the first along its line, or the last?
fn is_on(at: usize, count: usize, stride: usize) -> bool {
    at.is_multiple_of(stride) || at + 1 == count
}

/// The gather points that one is interpolated between, `stride` cells away along the axes along which it is
/// an odd number of strides from the first, or the last of their line, with bilinear shares; `None`
/// if one is missing.
fn parents(mesh: &Mesh, grid: &Grid, at: [usize; 2], stride: usize) -> Option<Vec<(u32, f32)>> {
    let mut from = vec![(at, 1.0)];
    for axis in 0..2 {
        let count = grid.counts[axis];
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
    use crate::radiosity::mesh::Layout;
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
        let setting = Setting::new(&surfaces, &hierarchy);
        let eye = [vec3(3.0, 1.0, 2.0)];
        let elements = Layout::of_elements(&surfaces, 300).whole(setting, &eye);
        let layout = Layout::of_gather_points(&surfaces, 8000, &[0.0; 11]);
        let gather_points = layout.whole(setting, &eye);
        task(setting, &elements, &gather_points)
    }

    /// How many hemicubes are drawn at a `reach`, and the share of the ceiling at every gather
    /// point.
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
        let mut drawn = 0;
        let interpolation = Interpolation::new(gather_points, reach, |which| {
            drawn += which.len();
            let mut draw = |n: &u32| {
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
            Ok::<_, Infallible>(which.iter().map(&mut draw).collect())
        });
        interpolation.unwrap().fill(&mut values, 1);
        (drawn, values)
    }

    #[test]
    fn most_gather_points_need_no_hemicube() {
        with_room(|setting, elements, gather_points| {
            let (all, exact) = seen(setting, elements, gather_points, 0.0);
            assert_eq!(all, gather_points.elements.len());
            let mut last = (usize::MAX, 0.0);
            for (reach, share, most) in [(0.1, 0.55, 3e-3), (0.2, 0.35, 8e-3)] {
                let (drawn, found) = seen(setting, elements, gather_points, reach);
                let apart = found
                    .iter()
                    .zip(&exact)
                    .map(|(a, b)| f64::from(a - b).powi(2));
                let power: f64 = exact.iter().map(|b| f64::from(*b).powi(2)).sum();
                let error = (apart.sum::<f64>() / power).sqrt();
                println!("reach {reach}: {drawn} of {all} hemicubes, error {error:.5}");
                assert!(
                    drawn < (all as f64 * share) as usize && drawn < last.0,
                    "{drawn}"
                );
                assert!(error < most && error > last.1, "{error}");
                last = (drawn, error);
            }
        });
    }

    /// Between gather points that see black things only there may be a gap that lets light in; in
    /// the void there is nothing to miss.
    #[test]
    fn among_black_things_every_gather_point_has_a_hemicube() {
        with_room(|_, _, gather_points| {
            let hemicubes = |inverse_distance| {
                let mut drawn = 0;
                let dark = NearbyEmission {
                    inverse_distance,
                    seen: 0.0,
                };
                let all = Interpolation::new(gather_points, 0.1, |which| {
                    drawn += which.len();
                    Ok::<_, Infallible>(vec![dark; which.len()])
                });
                all.unwrap();
                drawn
            };
            assert_eq!(hemicubes(0.5), gather_points.elements.len());
            assert!(hemicubes(0.0) < gather_points.elements.len() / 8);
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
            let interpolation = Interpolation::new(gather_points, 0.5, |which| {
                for n in which {
                    values[*n as usize] = slope(n);
                }
                Ok::<_, Infallible>(vec![near; which.len()])
            });
            interpolation.unwrap().fill(&mut values, 1);
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
