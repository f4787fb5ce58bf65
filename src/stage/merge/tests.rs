#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use proptest::prelude::*;

use super::*;
use footlight_show::geometry::vec3;

/// A surface over cells of a grid as triangles, bent by `height`, placed by `place`.
fn grid(
    cells: &[(u32, u32)],
    height: impl Fn(f64, f64) -> f64,
    place: impl Fn(Vec3) -> Vec3,
) -> Vec<Polygon> {
    let corner = |x: u32, y: u32| {
        let (x, y) = (f64::from(x), f64::from(y));
        place(vec3(x, y, height(x, y)))
    };
    let mut out = Vec::new();
    for &(x, y) in cells {
        let square = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| corner(x, y));
        // The diagonal alternates, unlike in any exporter.
        let cuts = match (x + y) % 2 {
            0 => [[0, 1, 2], [0, 2, 3]],
            _ => [[0, 1, 3], [1, 2, 3]],
        };
        for cut in cuts {
            out.push(Polygon::new(cut.map(|i: usize| square[i]).to_vec(), 0));
        }
    }
    out
}

fn rectangle(width: u32, height: u32) -> Vec<(u32, u32)> {
    (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .collect()
}

fn flat(cells: &[(u32, u32)]) -> Vec<Polygon> {
    grid(cells, |_, _| 0.0, |p| p)
}

fn area(polygons: &[Polygon]) -> Vec3 {
    let areas = polygons
        .iter()
        .map(|p| polygon::doubled_area(&p.vertices) * 0.5);
    areas.fold(Vec3::ZERO, |sum, a| sum + a)
}

fn sizes(merged: &Merged) -> Vec<usize> {
    merged.polygons.iter().map(|p| p.vertices.len()).collect()
}

#[test]
fn a_cut_quad_is_whole_again() {
    let merged = triangles(flat(&[(0, 0)]));
    assert_eq!((merged.before, sizes(&merged)), (2, vec![4]));
    assert_eq!(area(&merged.polygons), vec3(0.0, 0.0, 1.0));
}

/// Any plane, in single precision, far from the origin: a tessellated wall becomes one quad.
#[test]
fn a_wall_of_many_triangles_is_one_quad() {
    let (u, v) = (vec3(0.36, 0.48, -0.8), vec3(-0.8, 0.6, 0.0));
    let single = |c: f64| f64::from(c as f32);
    let place = |p: Vec3| {
        let q = vec3(30.0, -7.0, 2.0) + u * (p.x * 0.37) + v * (p.y * 0.21);
        vec3(single(q.x), single(q.y), single(q.z))
    };
    let before = grid(&rectangle(30, 20), |_, _| 0.0, place);
    let merged = triangles(before.clone());
    assert_eq!((merged.before, sizes(&merged)), (1200, vec![4]));
    let lost = (area(&before) - area(&merged.polygons)).length();
    assert!(lost < 1e-5 * area(&before).length(), "{lost}");
}

#[test]
fn an_l_is_one_polygon_and_a_wall_with_a_window_a_few_convex_ones() {
    let ell: Vec<_> = rectangle(4, 4)
        .into_iter()
        .filter(|(x, y)| *x < 2 || *y < 2)
        .collect();
    let merged = triangles(flat(&ell));
    assert_eq!(sizes(&merged), [6]);
    let window: Vec<_> = rectangle(5, 4)
        .into_iter()
        .filter(|(x, y)| !(2..4).contains(x) || *y != 2)
        .collect();
    let merged = triangles(flat(&window));
    assert!(merged.polygons.len() <= 8, "{:?}", sizes(&merged));
    assert!((area(&merged.polygons).z - 18.0).abs() < 1e-12);
    for polygon in &merged.polygons {
        assert_eq!(polygon::planar(polygon.vertices.to_vec()).unwrap().len(), 1);
    }
}

#[test]
fn what_differs_stays_apart() {
    // Another material, another plane, another side, and more than three corners.
    let mut two = flat(&rectangle(2, 1));
    for triangle in &mut two[2..] {
        triangle.material = 1;
    }
    assert_eq!(triangles(two).polygons.len(), 2);
    let folded = grid(&rectangle(2, 1), |x, _| (x - 1.0).max(0.0) * 0.01, |p| p);
    assert_eq!(triangles(folded).polygons.len(), 2);
    let mut turned = flat(&rectangle(2, 1));
    for triangle in &mut turned[2..] {
        std::sync::Arc::make_mut(&mut triangle.vertices).reverse();
    }
    assert_eq!(triangles(turned).polygons.len(), 2);
    let quad = |x: f64| {
        Polygon::new(
            vec![
                vec3(x, 0.0, 0.0),
                vec3(x + 1.0, 0.0, 0.0),
                vec3(x + 1.0, 1.0, 0.0),
                vec3(x, 1.0, 0.0),
            ],
            0,
        )
    };
    let quads = vec![quad(0.0), quad(1.0)];
    assert_eq!(triangles(quads.clone()).polygons, quads);
}

/// Facets that approach a plane more and more: a bend beyond rounding prevents merging.
#[test]
fn bent_surfaces_keep_their_triangles() {
    for bend in [1e-1, 1e-2, 1e-3, 1e-4] {
        // The mixed term twists every cell: without it each would be flat.
        let bowl = |x: f64, y: f64| bend * (x * x + y * y + x * y);
        let before = grid(&rectangle(8, 8), bowl, |p| p);
        let merged = triangles(before.clone());
        assert_eq!(merged.polygons.len(), before.len(), "bend {bend}");
    }
}

/// Three sheets along one edge, and one triangle twice: no panic, no lost area.
#[test]
fn edges_of_many_triangles_stay() {
    let mut many = flat(&rectangle(2, 1));
    let wing = vec3(1.0, 0.5, 1.0);
    let [a, b] = [vec3(1.0, 0.0, 0.0), vec3(1.0, 1.0, 0.0)];
    for vertices in [
        vec![a, b, wing],
        vec![b, a, wing],
        many[0].vertices.to_vec(),
    ] {
        many.push(Polygon::new(vertices, 0));
    }
    let before = area(&many);
    let merged = triangles(many);
    assert!((area(&merged.polygons) - before).length() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Any set of cells, with holes and touching corners, keeps its area and side in fewer valid
    /// polygons than triangles.
    #[test]
    fn area_stays(mask in prop::collection::vec(any::<bool>(), 36), material in 0_usize..3) {
        let cells: Vec<_> =
            rectangle(6, 6).into_iter().zip(&mask).filter(|(_, on)| **on).map(|(c, _)| c).collect();
        let mut before = flat(&cells);
        for (i, polygon) in before.iter_mut().enumerate() {
            polygon.material = (i / 7) % (material + 1);
        }
        let merged = triangles(before.clone());
        for material in 0..3 {
            let of = |all: &[Polygon]| -> Vec<Polygon> {
                all.iter().filter(|p| p.material == material).cloned().collect()
            };
            let (b, a) = (area(&of(&before)), area(&of(&merged.polygons)));
            prop_assert!((a - b).length() < 1e-9);
        }
        for polygon in &merged.polygons {
            prop_assert!(polygon::doubled_area(&polygon.vertices).z > 0.0);
            prop_assert_eq!(polygon::planar(polygon.vertices.to_vec()).unwrap().len(), 1);
        }
        prop_assert!(merged.polygons.len() <= before.len());
        // Without cuts by material, each whole square is at most one polygon.
        prop_assert!(material > 0 || merged.polygons.len() <= cells.len());
    }
}
