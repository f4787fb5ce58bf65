use super::*;
use crate::gather::sampling::point;
use footlight_show::geometry::vec3;

/// Squares of different sizes at random places in a room.
fn squares(count: u32) -> Surfaces {
    let square = |i: u32| {
        let ([x, y], [z, size], [turn, tilt]) = (point(i, 1), point(i, 2), point(i, 3));
        let middle = vec3(x, y, z) * 10.0;
        let way = vec3(turn - 0.5, tilt - 0.5, 0.3).normalized();
        let [u, v] = footlight_show::geometry::frame(way).map(|side| side * (0.1 + size));
        vec![
            middle - u - v,
            middle + u - v,
            middle + u + v,
            middle - u + v,
        ]
    };
    Surfaces::grey((0..count).map(square).collect())
}

fn by_all(surfaces: &Surfaces, origin: Vec3, way: Vec3) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for piece in &surfaces.pieces {
        let facet = &surfaces.facets[piece.facet];
        let distance = -facet.height(origin) / facet.normal.dot(way);
        let nearer = best.is_none_or(|(_, known)| distance < known);
        if distance > 0.0 && nearer && piece.holds(origin + way * distance) {
            best = Some((piece.facet, distance));
        }
    }
    best
}

#[test]
fn hits_are_those_of_a_search_through_all() {
    let surfaces = squares(700);
    let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
    let mut met = 0;
    for i in 0..2000 {
        let ([x, y], [z, a], [b, c]) = (point(i, 4), point(i, 5), point(i, 6));
        let origin = vec3(x, y, z) * 12.0 - vec3(1.0, 1.0, 1.0);
        let way = vec3(a - 0.5, b - 0.5, c - 0.5) * 3.0;
        let hit = bvh.first_hit(origin, way);
        let expected = by_all(&surfaces, origin, way);
        // A ray along an edge may hit or miss.
        let Some((facet, distance)) = expected else {
            assert!(hit.is_none(), "{i}");
            continue;
        };
        met += 1;
        let hit = hit.unwrap();
        assert_eq!(hit.facet as usize, facet, "{i}: {hit:?}, {distance}");
        let off = (f64::from(hit.distance) - distance).abs();
        assert!(off < 1e-5 * (10.0 + distance), "{i}: {off}");
        let front = surfaces.facets[facet].normal.dot(way) < 0.0;
        assert_eq!(hit.front, front, "{i}");
        for (share, blocked) in [(0.99, false), (1.01, true)] {
            let way = way * (distance * share);
            assert_eq!(bvh.is_blocked(origin, way), blocked, "{i} {share}");
        }
    }
    assert!(met > 500, "{met}");
}

/// A ray hits the front of two coincident sheets back to back, and the smaller of two in one plane.
#[test]
fn of_surfaces_at_one_place_the_front_and_the_smaller_are_hit() {
    let sheet = |half: f64, up: bool| {
        let mut corners = vec![
            vec3(-half, -half, 0.0),
            vec3(half, -half, 0.0),
            vec3(half, half, 0.0),
            vec3(-half, half, 0.0),
        ];
        if !up {
            corners.reverse();
        }
        corners
    };
    let sheets = vec![sheet(1.0, true), sheet(1.0, false), sheet(0.5, true)];
    let surfaces = Surfaces::grey(sheets);
    let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
    for (x, up, size) in [(0.8, true, 4.0), (0.8, false, 4.0), (0.2, true, 1.0)] {
        let height = if up { 3.0 } else { -3.0 };
        let hit = bvh.first_hit(vec3(x, 0.1, height), vec3(0.0, 0.0, -height));
        let hit = hit.unwrap();
        let facet = &surfaces.facets[hit.facet as usize];
        assert!(hit.front && (facet.area - size).abs() < 1e-9, "{x} {up}");
        assert_eq!(facet.normal.z > 0.0, up, "{x}");
    }
}

#[test]
fn nothing_is_hit_in_an_empty_scene() {
    let bvh = Bvh::new(&Surfaces::grey(Vec::new()), Work::silent()).unwrap();
    assert_eq!(bvh.first_hit(Vec3::ZERO, vec3(1.0, 0.0, 0.0)), None);
    assert!(!bvh.is_blocked(Vec3::ZERO, vec3(1.0, 0.0, 0.0)));
}
