//! Hemicubes against closed forms and naive drawing.

use super::*;
use crate::direct::lambert::{LambertIntegrator, LightPolygon};
use crate::hemicube::mesh::Layout;
use crate::surfaces::facet::Facet;
use crate::surfaces::hierarchy::Hierarchy;
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::{block, vec3};
use std::collections::BTreeMap;

/// A box 2 x 2 x 1 from inside, its lid as wide as `lid`.
fn room(lid: f64) -> Surfaces {
    let (x, y, z) = (
        vec3(2.0, 0.0, 0.0),
        vec3(0.0, 2.0, 0.0),
        vec3(0.0, 0.0, 1.0),
    );
    let o = vec3(-1.0, -1.0, 0.0);
    let quad = |a: Vec3, u: Vec3, v: Vec3| vec![a, a + u, a + u + v, a + v];
    Surfaces::grey(vec![
        quad(o, x, y),
        quad(o + z, y, x * lid),
        quad(o, z, x),
        quad(o + y, x, z),
        quad(o, y, z),
        quad(o + x, z, y),
    ])
}

fn with_cube<T>(
    surfaces: &Surfaces,
    resolution: usize,
    task: impl Fn(&mut Hemicube<'_>, &Mesh) -> T,
) -> T {
    let hierarchy = Hierarchy::new(surfaces);
    let setting = SceneGeometry::new(surfaces, &hierarchy);
    let layout = Layout::of_elements(surfaces, 60);
    let mesh = layout.mesh_of_all_cells(setting, &[vec3(0.0, 0.0, 0.5)]);
    let (vertices, table) = (
        VertexBuffer::new(surfaces),
        FormFactorTable::new(resolution),
    );
    task(&mut Hemicube::new(setting, &vertices, &mesh, &table), &mesh)
}

fn floor(surfaces: &Surfaces) -> usize {
    surfaces
        .facets
        .iter()
        .position(|f| f.normal.z > 0.9)
        .unwrap()
}

/// From the centre of the floor to the lid; from a point next to a wall to that wall.
#[test]
fn closed_forms_are_met_better_with_resolution() {
    let surfaces = room(1.0);
    let root = 0.5_f64.sqrt();
    let lid = 4.0 * root * root.atan() / std::f64::consts::PI;
    let mut last = f64::INFINITY;
    for (resolution, most) in [(8, 0.011), (16, 0.005), (32, 0.0015), (64, 0.0006)] {
        let seen = with_cube(&surfaces, resolution, |cube, mesh| {
            let row = |i| cube.row(floor(&surfaces), Vec3::ZERO, hash_to_unit(i));
            let rows: Vec<Row> = (0..64).map(row).collect();
            let above = |e: u32| surfaces.facets[mesh.elements[e as usize].facet].normal.z < -0.9;
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
            for turn in [0.0, hash_to_unit(i as u64)] {
                let row = cube.row(e.facet, e.centre, turn);
                let sum: f64 = row.iter().map(|r| f64::from(r.1)).sum();
                assert!((sum - 1.0).abs() < 3e-6, "element {i}: {sum}");
            }
        }
    });
}

/// Under an infinite ceiling at height h the mean inverse distance is 2 / (3 h).
#[test]
fn what_is_near_is_told() {
    let surfaces = room(1.0);
    with_cube(&surfaces, 32, |cube, _| {
        let near = cube.visit(floor(&surfaces), vec3(0.2, 0.1, 0.0), 0.3, |_, _| ());
        let near = near.mean_inverse_distance;
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
        let near = near.mean_inverse_distance;
        assert!((near - 1.0 / 3.0).abs() < 2e-3, "{near}");
    });
}

/// A shelf cuts the wall that it hangs on, and the strip above it is less than a pixel high. From
/// the other wall, one sample a pixel may find or miss it.
#[test]
fn parts_of_a_cut_cell_are_seen_evenly() {
    let mut polygons = block([vec3(-3.0, -3.0, 0.0), vec3(3.0, 3.0, 4.0)], true).to_vec();
    let store = [vec3(-3.0, 0.05, 1.74), vec3(-2.8, 1.45, 1.75)];
    polygons.extend(block(store, false));
    let surfaces = Surfaces::grey(polygons);
    let facet = |way: Vec3| {
        let faces = |f: &Facet| f.normal.dot(way) > 0.9 && f.area > 1.0;
        surfaces.facets.iter().position(faces).unwrap()
    };
    let (wall, opposite) = (facet(vec3(1.0, 0.0, 0.0)), facet(vec3(-1.0, 0.0, 0.0)));
    let error = |places: [[f32; 2]; 4]| {
        with_cube(&surfaces, 16, |cube, mesh| {
            cube.places = places;
            let mut divided = vec![true; mesh.elements.len()];
            mesh.each_uncut(|_, _, e| divided[e] = false);
            let (mut apart, mut power, mut off, mut all) = (0.0, 0.0, 0.0, 0.0);
            for i in 0..400 {
                let at = |k: u64| 0.6 * hash_to_unit(k) - 0.3;
                let point = vec3(3.0, at(2 * i) - 1.5, 1.8 + at(2 * i + 1));
                let row: BTreeMap<u32, f32> = cube
                    .row(opposite, point, hash_to_unit(i))
                    .into_iter()
                    .collect();
                for (k, e) in mesh.elements.iter().enumerate() {
                    if e.facet != wall || !divided[k] || e.centre.z < 1.75 {
                        continue;
                    }
                    let exact = e.samples.iter().map(|s| {
                        let way = s.point - point;
                        let square = way.dot(way);
                        s.area * way.x * way.x / (square * square * std::f64::consts::PI)
                    });
                    let exact: f64 = exact.sum();
                    let found = row.get(&(k as u32)).copied().unwrap_or(0.0);
                    apart += (f64::from(found) - exact).powi(2);
                    power += exact * exact;
                    off += f64::from(found) - exact;
                    all += exact;
                }
            }
            [f64::sqrt(apart / power), off / all]
        })
    };
    let ([naive, _], [ours, off]) = (error([[0.0; 2]; 4]), error(SUB_SAMPLES));
    println!("a strip: {naive:.3} by one sample a pixel, {ours:.3} by four, {off:.3} on average");
    assert!(off.abs() < 0.05, "{off}");
    assert!(naive > 0.3, "{naive}");
    assert!(ours < 0.5 * naive, "{ours} of {naive}");
}

/// Normalised rows would sum to 1 in any scene; ours lose the light that leaves through the open
/// half.
#[test]
fn what_leaves_an_open_scene_is_lost() {
    let surfaces = room(0.5);
    let lid = 2.0 * 0.5_f64.sqrt() * 0.5_f64.sqrt().atan() / std::f64::consts::PI;
    with_cube(&surfaces, 64, |cube, _| {
        let row = cube.row(floor(&surfaces), Vec3::ZERO, 0.3);
        let sum: f64 = row.iter().map(|r| f64::from(r.1)).sum();
        assert!((sum - (1.0 - lid)).abs() < 0.006, "{sum}");
        // A normalised row also gives the walls the light that leaves through the lid.
        let normalised: f64 = row.iter().map(|r| f64::from(r.1) / sum).sum();
        assert!(normalised / (1.0 - lid) - 1.0 > 0.35, "{normalised}");
    });
}

/// Under a ceiling of 30 x 30 tiles, 4 m up, a distant tile covers less than a pixel or a few and
/// may be missed; the sum over all tiles is still right.
#[test]
fn far_single_pairs_are_coarse_and_their_sum_is_not() {
    let (count, side) = (30, 0.4);
    let tile = |k: usize| {
        let at = |i: usize| (i as f64 - 0.5 * count as f64) * side;
        let (x, y) = (at(k % count), at(k / count));
        [(x, y), (x, y + side), (x + side, y + side), (x + side, y)]
            .map(|(x, y)| vec3(x, y, 4.0))
            .to_vec()
    };
    let tiles: Vec<Vec<Vec3>> = (0..count * count).map(tile).collect();
    let half = 0.5 * count as f64 * side;
    let below = [(-half, -half), (half, -half), (half, half), (-half, half)];
    let mut polygons = vec![below.map(|(x, y)| vec3(x, y, 0.0)).to_vec()];
    polygons.extend(tiles.iter().cloned());
    let surfaces = Surfaces::grey(polygons);
    let own_facet = floor(&surfaces);
    let point = vec3(0.13, -0.07, 0.0);
    let up = vec3(0.0, 0.0, 1.0);
    let errors = |resolution: usize| {
        with_cube(&surfaces, resolution, |cube, mesh| {
            let row: BTreeMap<u32, f32> = cube.row(own_facet, point, 0.3).into_iter().collect();
            let mut integrator = LambertIntegrator::default();
            let (mut square, mut far, mut found, mut exact) = (0.0, 0.0, 0.0, 0.0);
            for (e, element) in (0..).zip(&mesh.elements) {
                let facet = &surfaces.facets[element.facet];
                if element.facet == own_facet {
                    continue;
                }
                let light_polygon = LightPolygon::new(facet.vertices.to_vec(), facet.normal);
                let own = integrator.unoccluded(point, up, &light_polygon) / std::f64::consts::PI;
                let share = f64::from(row.get(&e).copied().unwrap_or_default());
                found += share;
                exact += own;
                if (element.centre - point).length() > 6.0 {
                    square += (share / own - 1.0).powi(2);
                    far += 1.0;
                }
            }
            assert!(far > 100.0, "{far} tiles are far");
            [f64::sqrt(square / far), (found / exact - 1.0).abs()]
        })
    };
    let ([coarse, sum], [fine, fine_sum]) = (errors(32), errors(128));
    println!("single tiles {coarse:.3}, {fine:.3}; together {sum:.1e}, {fine_sum:.1e}");
    assert!(coarse > 0.1 && fine < 0.5 * coarse, "{coarse} {fine}");
    assert!(sum < 2e-3 && fine_sum < 5e-4, "{sum} {fine_sum}");
}
