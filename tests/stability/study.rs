//! What `chart stability` says, against what is known of the methods.

use crate::meter::contour;
use footlight::chart::Theme;
use footlight::geometry::vec3;
use footlight::radiosity::scatter;
use footlight::report::stability::{describe, drawing, record};
use footlight::report::{Kind, Record};
use footlight::study::Machine;
use footlight::study::stability::lamp::Lamp;
use footlight::study::stability::{Stability, study};
use footlight::work::Work;

fn found() -> Stability {
    study(Machine::here(1, None), Work::silent()).unwrap()
}

/// Two columns of a series.
fn curve(record: &Record, series: &str, x: &str, y: &str) -> Vec<(f64, f64)> {
    let found = record.series.iter().find(|s| s.name == series);
    record.curve(found.unwrap_or_else(|| panic!("{series}")), x, y)
}

#[test]
fn the_study_says_what_is_known_and_the_same_each_time() {
    let found = found();
    assert_eq!(found, self::found());
    let record = record(&found);
    let read: Record = serde_json::from_str(&record.json().unwrap()).unwrap();
    assert_eq!(read.quantities, record.quantities);
    assert_eq!(read.csv().lines().count(), record.csv().lines().count());
    assert_eq!(record.kind, Kind::Stability);
    let rows = record.series.iter().flat_map(|s| &s.points);
    for point in rows {
        assert_eq!(point.values.len(), record.quantities.len());
        assert!(point.values.iter().flatten().count() >= 1, "{point:?}");
    }

    let loss = |way: &str| {
        let name = format!("orthogonality: {way}");
        curve(&record, &name, "condition number", "loss of orthogonality")
    };
    let u = f64::EPSILON / 2.0;
    let between = |all: Vec<(f64, f64)>, power: i32| -> Vec<f64> {
        let middle = all.into_iter().filter(|(c, _)| (1e3..1e7).contains(c));
        middle.map(|(c, l)| l / (c.powi(power) * u)).collect()
    };
    // The square of the condition, its first power, none.
    for (way, power, spread) in [("classical Gram-Schmidt", 2, 1e4), ("modified", 1, 1e3)] {
        let rates = between(loss(way), power);
        let (low, high) = rates
            .iter()
            .fold((f64::MAX, 0.0_f64), |(l, h), r| (l.min(*r), h.max(*r)));
        assert!(
            rates.len() > 10 && high / low < spread && high < 100.0,
            "{way}: {low} {high}"
        );
    }
    assert!(loss("modified twice (shipped)").iter().all(|p| p.1 < 2e-15));

    let wrong = |solver: &str| {
        let name = format!("decomposition: {solver}");
        let column = "residual, in what rounding explains";
        let all = curve(&record, &name, column, column);
        all.iter().filter(|p| p.0.is_nan() || p.0 > 1.0).count()
    };
    assert!(wrong("nalgebra") > 100 && wrong("Footlight") == 0);

    let missed = |name: &str| {
        curve(
            &record,
            &format!("furnace: {name}"),
            "1 / (1 - reflectance)",
            "radiosity off by",
        )
    };
    assert!(missed("Chebyshev (shipped)").iter().all(|p| p.1 < 0.1));
    assert!(missed("Jacobi, as many products").last().unwrap().1 > 50.0);
    // 1 - rho^5 is there after four bounces.
    for (met, off) in missed("four bounces") {
        let rho = 1.0 - 1.0 / met;
        assert!((off / 100.0 - rho.powi(5)).abs() < 1e-3, "{met}: {off}");
    }

    let lamp = |name: &str| {
        curve(
            &record,
            &format!("lamp: {name}"),
            "distance of the lamp",
            "form factor off by",
        )
    };
    assert!(lamp("closed form (shipped)").iter().all(|p| p.1 < 1e-3));
    let point = lamp("taken for a point");
    assert!(point.first().unwrap().1 > 50.0 && point.last().unwrap().1 < 0.05);
    // Far lamps are lost between pixels.
    let cube = lamp("hemicube of 64");
    assert!(cube.last().unwrap().1 > 10.0 * cube[2].1, "{cube:?}");

    let mean = |name: &str| {
        curve(
            &record,
            &format!("hemicube: {name}"),
            "pixels along a hemicube's edge",
            "form factor off by",
        )
    };
    let (turned, aligned) = (
        mean("mean of many, turned (shipped)"),
        mean("mean of many, all aligned"),
    );
    let better = turned
        .iter()
        .zip(&aligned)
        .filter(|(t, a)| t.1 < a.1)
        .count();
    assert!(better >= 5, "{turned:?} {aligned:?}");

    let knots = |name: &str| {
        curve(
            &record,
            &format!("knots: {name}"),
            "banks that move at once",
            "knots a show",
        )
    };
    for (ours, halving) in knots("fewest (shipped)").iter().zip(knots("halving")) {
        assert!(3.0 * ours.1 < halving.1, "{ours:?} {halving:?}");
    }
}

#[test]
fn no_show_needs_more_knots_than_halving() {
    use footlight::study::stability::knot::counted;
    let all: Vec<_> = counted().into_iter().flat_map(|(_, c)| c).collect();
    assert_eq!(all.len(), 500);
    assert!(all.iter().all(|c| c.fewest <= c.bisection));
    // Where a curve touches zero halving goes on until rounding hides it.
    assert!(all.iter().any(|c| c.bisection >= 24 && c.fewest <= 3));
}

/// The study's exact form factor, which sums four rectangles, against the integral along the edges.
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
            let at = |i: u64| 3.0 * (2.0 * scatter(i) - 1.0);
            let p = vec3(at(i), at(i + 7919), 0.0);
            let corners = [(-a, b), (a, b), (a, -b), (-a, -b)];
            let edges = contour(&corners.map(|(x, y)| vec3(x, y, height) - p));
            let found = lamp.exact(p);
            assert!((found - edges).abs() < 1e-12, "{found} {edges}");
        }
    }
}

#[test]
fn every_panel_is_drawn_and_told() {
    let found = found();
    let words = describe(&found);
    for theme in [Theme::Light, Theme::Dark] {
        let svg = drawing(&found, theme).svg();
        assert!(!svg.contains("no data"));
        for word in [
            "Near-copies",
            "SVD of",
            "Four bounces lose 99.5 %",
            "A lamp of",
            "cubes",
            "Knots",
        ] {
            assert!(svg.contains(word) && words.contains(word), "{word}");
        }
    }
}
