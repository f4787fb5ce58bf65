//! The figures drawn by `examples/stability`, against known properties of the methods.

use crate::meter::contour;
use crate::methods::furnace::Solved;
use crate::methods::lamp::Lamp;
use crate::methods::orthogonality::Way;
use crate::methods::study;
use footlight_show::geometry::vec3;
use footlight_transport::hemicube::indirect::hemicube::hash_to_unit;

#[test]
#[ignore = "slow"]
fn the_study_says_what_is_known_and_the_same_each_time() {
    let found = study().unwrap();
    assert_eq!(found, study().unwrap());
    let loss = |way: Way| -> Vec<(f64, f64)> {
        let own = found.orthogonality.iter().filter(|o| o.way == way);
        own.map(|o| (o.condition, o.loss)).collect()
    };
    let u = f64::EPSILON / 2.0;
    let between = |all: Vec<(f64, f64)>, power: i32| -> Vec<f64> {
        let middle = all.into_iter().filter(|(c, _)| (1e3..1e7).contains(c));
        middle.map(|(c, l)| l / (c.powi(power) * u)).collect()
    };
    // The square of the condition, its first power, none.
    for (way, power, spread) in [(Way::Classical, 2, 1e4), (Way::Modified, 1, 1e3)] {
        let rates = between(loss(way), power);
        let (low, high) = rates
            .iter()
            .fold((f64::MAX, 0.0_f64), |(l, h), r| (l.min(*r), h.max(*r)));
        assert!(
            rates.len() > 10 && high / low < spread && high < 100.0,
            "{way:?}: {low} {high}"
        );
    }
    assert!(loss(Way::Shipped).iter().all(|p| p.1 < 2e-15));

    assert!(found.nalgebra.wrong() > 100 && found.ours.wrong() == 0);

    let solved: Vec<Solved> = found.furnace.iter().map(|r| r.solved).collect();
    assert!(solved.iter().all(|s| s.ours < 1e-3));
    assert!(solved.last().unwrap().jacobi > 0.5);
    // 1 - rho^5 is reached after four bounces.
    for s in &solved {
        let lost = f64::from(s.reflectance).powi(5);
        assert!((s.few - lost).abs() < 1e-3, "{s:?}");
    }

    let distances = &found.distances;
    assert!(distances.iter().all(|d| d.closed < 1e-5));
    let (near, far) = (distances.first().unwrap(), distances.last().unwrap());
    assert!(near.point > 0.5 && far.point < 5e-4);
    // Distant lamps are lost between pixels.
    assert!(far.cubes[1] > 10.0 * distances[2].cubes[1], "{distances:?}");

    let means = found.resolutions.iter().map(|r| r.mean);
    let better = means.filter(|m| m.turned < m.aligned).count();
    assert!(better >= 5, "{:?}", found.resolutions);

    for knots in &found.knots {
        assert!(3.0 * knots.fewest < knots.bisection, "{knots:?}");
    }
}

#[test]
fn no_show_needs_more_knots_than_halving() {
    use crate::methods::knot::counted;
    let all: Vec<_> = counted().into_iter().flat_map(|(_, c)| c).collect();
    assert_eq!(all.len(), 500);
    assert!(all.iter().all(|c| c.fewest <= c.bisection));
    // Where a curve touches zero, bisection continues until rounding hides it.
    assert!(all.iter().any(|c| c.bisection >= 24 && c.fewest <= 3));
}

/// The study's exact form factor, a sum of four rectangles, against the integral along the edges.
#[test]
fn two_closed_forms_of_a_lamp_say_the_same() {
    for [width, depth, height] in [[0.4, 0.4, 5.0], [1e-3, 1.0, 1.0], [2.0, 0.5, 0.05]] {
        let lamp = Lamp {
            width,
            depth,
            height,
        };
        let (a, b) = (0.5 * width, 0.5 * depth);
        for i in 0..50 {
            let at = |i: u64| 3.0 * (2.0 * hash_to_unit(i) - 1.0);
            let p = vec3(at(i), at(i + 7919), 0.0);
            let corners = [(-a, b), (a, b), (a, -b), (-a, -b)];
            let edges = contour(&corners.map(|(x, y)| vec3(x, y, height) - p));
            let found = lamp.exact(p);
            assert!((found - edges).abs() < 1e-12, "{found} {edges}");
        }
    }
}
