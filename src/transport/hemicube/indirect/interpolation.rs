//! Irradiance interpolation: gather points that need no hemicube.
//!
//! Over a distance d irradiance changes by approximately d / R of its value, where R is the
//! harmonic mean distance of the visible surfaces (Ward, Rubinstein and Clear, "A Ray Tracing
//! Solution for Diffuse Interreflection", 1988). Black surfaces send no light, but may uncover
//! elements; hence R = F / D here, with F the sum of the form factors to elements and D the mean
//! inverse distance of all visible surfaces ([`SurfaceProximity`]). If all visible surfaces are
//! elements, R is Ward's. The first pass draws the hemicubes of one gather point in 64; each
//! further pass halves the stride, draws those for which d / R to a parent is too large, and
//! interpolates the others. Invariant: the choice depends on the scene and the gather points alone,
//! so that G stays linear.

#![allow(
    clippy::indexing_slicing,
    reason = "gather points are the mesh's own elements, whose values are laid out one after the other"
)]

use crate::hemicube::indirect::hemicube::SurfaceProximity;
use crate::hemicube::mesh::Mesh;
use crate::hemicube::mesh::grid::Grid;

/// Cells between the gather points of the first pass.
const COARSEST: usize = 8;

/// Greatest distance of a regular gather point from its place in the grid, in cells.
const REGULAR_TOLERANCE: f64 = 0.1;

/// A gather point without a hemicube, and its parents with interpolation weights, which sum to 1.
#[derive(Clone, Debug)]
struct Interpolated {
    gather_point: u32,
    parents: Vec<(u32, f32)>,
}

/// The interpolated gather points.
#[derive(Clone, Debug)]
pub struct Interpolation {
    /// Parents precede the points that depend on them.
    interpolated: Vec<Interpolated>,
    /// Surface proximity at each gather point; interpolated where the irradiance is.
    pub proximity: Vec<SurfaceProximity>,
}

impl Interpolation {
    /// Selects the gather points that need a hemicube, in passes: `sample` draws those of a pass
    /// and returns their surface proximity, in the given order. A gather point is interpolated when
    /// its distance from each of its parents is below `reach` times that parent's R.
    ///
    /// # Errors
    /// Errors of `sample`.
    pub fn new<E>(
        mesh: &Mesh,
        reach: f64,
        mut sample: impl FnMut(&[u32]) -> Result<Vec<SurfaceProximity>, E>,
    ) -> Result<Interpolation, E> {
        let mut all = Interpolation {
            interpolated: Vec::new(),
            proximity: vec![SurfaceProximity::default(); mesh.elements.len()],
        };
        // A point moved from its place in the grid is neither interpolated nor a parent.
        let mut regular = vec![false; mesh.elements.len()];
        mesh.each_uncut(|grid, at, gather_point| {
            regular[gather_point] = is_regular(mesh, grid, at, gather_point)
        });
        let mut missing: Vec<u32> = (0..regular.len() as u32)
            .filter(|n| !regular[*n as usize])
            .collect();
        let mut stride = COARSEST;
        while stride > 0 {
            mesh.each_uncut(|grid, at, gather_point| {
                let counts = grid.counts;
                let is_on_grid = |stride| (0..2).all(|k| is_on(at[k], counts[k], stride));
                let done = stride < COARSEST && is_on_grid(2 * stride);
                if !regular[gather_point] || !is_on_grid(stride) || done {
                    return;
                }
                // Parents lie on the coarser stride, which earlier passes have handled.
                let can_interpolate = |from: &Vec<(u32, f32)>| {
                    let near = |(n, _): &(u32, f32)| {
                        let other = *n as usize;
                        regular[other] && all.error(mesh, gather_point, other) < reach
                    };
                    stride < COARSEST && from.iter().all(near)
                };
                match parents(mesh, grid, at, stride).filter(can_interpolate) {
                    Some(parents) => {
                        all.proximity[gather_point] = all.mean(&parents);
                        let gather_point = gather_point as u32;
                        all.interpolated.push(Interpolated {
                            gather_point,
                            parents,
                        });
                    }
                    None => missing.push(gather_point as u32),
                }
            });
            missing.sort_unstable();
            let sampled = sample(&missing)?;
            for (gather_point, near) in missing.drain(..).zip(sampled) {
                all.proximity[gather_point as usize] = near;
            }
            stride /= 2;
        }
        Ok(all)
    }

    /// Ward's error bound d / R: the distance between two gather points over the R of the `other`.
    fn error(&self, mesh: &Mesh, gather_point: usize, other: usize) -> f64 {
        let [a, b] = [gather_point, other].map(|n| mesh.elements[n].centre);
        (a - b).length() * f64::from(self.proximity[other].inverse_change_distance())
    }

    /// Weighted mean of the parents' surface proximity.
    fn mean(&self, from: &[(u32, f32)]) -> SurfaceProximity {
        let sum = |part: fn(&SurfaceProximity) -> f32| {
            let shares = from
                .iter()
                .map(|(n, share)| share * part(&self.proximity[*n as usize]));
            shares.sum()
        };
        SurfaceProximity {
            mean_inverse_distance: sum(|o| o.mean_inverse_distance),
            form_factor_sum: sum(|o| o.form_factor_sum),
        }
    }

    /// Sets the rows of the interpolated gather points to the weighted sums of their parents' rows;
    /// all other rows must be set before. `values` has a row of `width` values for each gather
    /// point.
    pub fn fill(&self, values: &mut [f32], width: usize) {
        for Interpolated {
            gather_point,
            parents,
        } in &self.interpolated
        {
            let at = *gather_point as usize * width;
            for k in 0..width {
                let share =
                    |sum, (n, share): &(u32, f32)| sum + share * values[*n as usize * width + k];
                values[at + k] = parents.iter().fold(0.0, share);
            }
        }
    }
}

fn is_regular(mesh: &Mesh, grid: &Grid, at: [usize; 2], gather_point: usize) -> bool {
    let place = grid.place(mesh.elements[gather_point].centre);
    (0..2).all(|k| (place[k] - grid.stand(at[k], grid.counts[k])).abs() < REGULAR_TOLERANCE)
}

/// True when a cell is a whole number of strides from the first along its line, or the last.
fn is_on(at: usize, count: usize, stride: usize) -> bool {
    at.is_multiple_of(stride) || at + 1 == count
}

/// The two or four gather points between which the one at a cell is interpolated, with bilinear
/// weights. Along each axis on which the cell is an odd number of strides from the first, they are
/// `stride` cells before and after it, or the last of the line. `None` if one of them is missing.
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
    let gather_point = |(at, share)| Some((mesh.uncut_element(grid, at)? as u32, share));
    from.into_iter().map(gather_point).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::hemicube::indirect::hemicube::{FormFactorTable, Hemicube, hash_to_unit};
    use crate::hemicube::mesh::Layout;
    use crate::hemicube::raster::VertexBuffer;
    use crate::surfaces::hierarchy::Hierarchy;
    use crate::surfaces::hierarchy::SceneGeometry;
    use crate::surfaces::surface::Surfaces;
    use footlight_show::geometry::{Vec3, block, vec3};
    use std::convert::Infallible;

    /// Elements and gather points of a room of 6 x 6 x 4 m with a table half a metre in size.
    fn with_room<T>(task: impl Fn(SceneGeometry<'_>, &Mesh, &Mesh) -> T) -> T {
        let mut polygons = block([Vec3::ZERO, vec3(6.0, 6.0, 4.0)], true).to_vec();
        let table = [vec3(2.0, 3.0, 0.0), vec3(2.6, 3.6, 0.5)];
        polygons.extend_from_slice(&block(table, false)[..5]);
        let surfaces = Surfaces::grey(polygons);
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = SceneGeometry::new(&surfaces, &hierarchy);
        let eye = [vec3(3.0, 1.0, 2.0)];
        let elements = Layout::of_elements(&surfaces, 300).mesh_of_all_cells(setting, &eye);
        let layout = Layout::of_gather_points(&surfaces, 8000, &[0.0; 11]);
        let gather_points = layout.mesh_of_all_cells(setting, &eye);
        task(setting, &elements, &gather_points)
    }

    /// Number of hemicubes drawn at a `reach`, and the share of the ceiling at every gather point.
    fn seen(
        setting: SceneGeometry<'_>,
        elements: &Mesh,
        gather_points: &Mesh,
        reach: f64,
    ) -> (usize, Vec<f32>) {
        let surfaces = setting.surfaces;
        let (vertices, table) = (VertexBuffer::new(surfaces), FormFactorTable::new(64));
        let mut cube = Hemicube::new(setting, &vertices, elements, &table);
        let mut values = vec![0.0; gather_points.elements.len()];
        let mut drawn = 0;
        let interpolation = Interpolation::new(gather_points, reach, |which| {
            drawn += which.len();
            let mut draw = |n: &u32| {
                let gather_point = &gather_points.elements[*n as usize];
                let sum = &mut values[*n as usize];
                let turn = hash_to_unit(u64::from(*n));
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

    /// Where gather points see only black surfaces, an element may be visible between two of them,
    /// so each needs a hemicube; where they see nothing, nothing can be missed.
    #[test]
    fn among_black_things_every_gather_point_has_a_hemicube() {
        with_room(|_, _, gather_points| {
            let hemicubes = |mean_inverse_distance| {
                let mut drawn = 0;
                let dark = SurfaceProximity {
                    mean_inverse_distance,
                    form_factor_sum: 0.0,
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
            let near = SurfaceProximity {
                mean_inverse_distance: 0.05,
                form_factor_sum: 1.0,
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
