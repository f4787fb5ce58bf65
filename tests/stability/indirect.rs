//! Reflected light: hemicubes, rows of form factors, bounces, memory.

pub use crate::methods::furnace::scene;
use crate::methods::furnace::{self, Furnace, room, rows};
use crate::reference::{Case, render, stage};
use footlight_host::work::{Progress, Work};
use footlight_picture::Image;
use footlight_show::geometry::vec3;
use footlight_transport::hemicube::indirect::form::Bounces;
use footlight_transport::hemicube::indirect::hemicube::{
    FormFactorTable, Hemicube, Row, hash_to_unit,
};
use footlight_transport::hemicube::mesh::Mesh;
use footlight_transport::hemicube::raster::VertexBuffer;
use footlight_transport::radiosity::Radiosity;
use footlight_transport::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use footlight_transport::surfaces::surface::Surfaces;
use footlight_transport::{Quality, Transport, TransportError};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A mesh of about this many elements, seen from half a metre over the floor.
pub fn mesh(surfaces: &Surfaces, elements: usize) -> Mesh {
    furnace::mesh(surfaces, elements, vec3(0.0, 0.0, 0.5)).unwrap()
}

#[test]
fn bounces_between_bright_walls_take_sweeps_by_the_hundred_and_a_few_steps_here() {
    let surfaces = room().unwrap();
    let mesh = mesh(&surfaces, 60);
    let rows = rows(&surfaces, &mesh, 16);
    let n = mesh.elements.len();
    let furnace = Furnace::new(60).unwrap();
    for (rho, jacobi, ours) in [
        (0.5_f32, 9, 10),
        (0.9, 60, 24),
        (0.99, 600, 70),
        (0.999, 5000, 240),
    ] {
        let reflectance = vec![[rho; 3]; n];
        let bounces = Bounces::new(&rows, &reflectance);
        let b = bounces
            .interreflect(&rows, &vec![1.0; n], &reflectance, 1, Work::silent())
            .unwrap();
        let exact = 1.0 / (1.0 - rho);
        for x in b {
            assert!((x / exact - 1.0).abs() < 1e-3, "rho {rho}: {x} for {exact}");
        }
        assert!(bounces.steps() <= ours, "rho {rho}: {}", bounces.steps());
        let naive = furnace.sweeps(rho, false);
        assert!(naive >= jacobi, "rho {rho}: {naive} sweeps");
        let better = furnace.sweeps(rho, true);
        assert!(better > naive / 4, "rho {rho}: {better} sweeps in place");
    }
}

/// In dark rooms two bounces are nearly complete; in bright ones most light is missing.
#[test]
fn a_few_bounces_lose_light_and_ours_go_on_until_it_is_all_there() {
    let surfaces = room().unwrap();
    let mesh = mesh(&surfaces, 60);
    let rows = rows(&surfaces, &mesh, 16);
    let n = mesh.elements.len();
    for (rho, bounces, least) in [(0.5_f32, 4, 0.02), (0.8, 4, 0.3), (0.95, 8, 0.5)] {
        let exact = 1.0 / (1.0 - rho);
        let mut naive = vec![1.0_f32; n];
        for _ in 0..bounces {
            let seen = rows.times(&naive, 1);
            naive = seen.iter().map(|x| 1.0 + rho * x).collect();
        }
        let lost = 1.0 - naive.iter().sum::<f32>() / (n as f32 * exact);
        assert!(
            lost > least,
            "rho {rho}: {bounces} bounces lose {lost} only"
        );
        let reflectance = vec![[rho; 3]; n];
        let ours = Bounces::new(&rows, &reflectance)
            .interreflect(&rows, &vec![1.0; n], &reflectance, 1, Work::silent())
            .unwrap();
        let off = ours
            .iter()
            .map(|b| (b / exact - 1.0).abs())
            .fold(0.0, f32::max);
        println!("rho {rho}: {bounces} bounces lose {lost:.3}, ours {off:.1e}");
        assert!(off < 1e-3, "rho {rho}: {off}");
    }
}

/// Forcing reciprocity on form factors, by the mean of A_i F_ij and A_j F_ji, spoils their sums;
/// the error of each bounce accumulates in bright rooms.
#[test]
fn symmetrising_spoils_the_sums_of_rows_that_are_kept_here() {
    let surfaces = room().unwrap();
    let mesh = mesh(&surfaces, 60);
    let rows = rows(&surfaces, &mesh, 16);
    let n = mesh.elements.len();
    let area = |e: usize| mesh.elements[e].samples.iter().map(|s| s.area).sum::<f64>();
    let areas: Vec<f64> = (0..n).map(area).collect();
    let mut exchange = vec![vec![0.0; n]; n];
    for i in 0..n {
        for (j, share) in rows.row(i) {
            let half = 0.5 * areas[i] * f64::from(*share);
            exchange[i][*j as usize] += half;
            exchange[*j as usize][i] += half;
        }
    }
    let rho = 0.999;
    let exact = 1.0 / (1.0 - rho);
    let mut naive = vec![exact; n];
    for _ in 0..4000 {
        for i in 0..n {
            let seen: f64 = exchange[i].iter().zip(&naive).map(|(x, b)| x * b).sum();
            naive[i] = 1.0 + rho * seen / areas[i];
        }
    }
    let off = |b: f64| (b / exact - 1.0).abs();
    let naive = naive.iter().map(|b| off(*b)).fold(0.0, f64::max);
    let reflectance = vec![[rho as f32; 3]; n];
    let ours = Bounces::new(&rows, &reflectance)
        .interreflect(&rows, &vec![1.0; n], &reflectance, 1, Work::silent())
        .unwrap();
    let ours = ours.iter().map(|b| off(f64::from(*b))).fold(0.0, f64::max);
    println!("rho {rho}: symmetrised {naive:.3}, ours {ours:.1e}");
    assert!(naive > 0.02, "the naive way errs by {naive} only");
    assert!(ours < 1e-3, "{ours}");
}

/// Form factors of a row of points to the lid, which all see equally: along the middle of a wide
/// room aligned cubes err equally, rotated ones independently, so that their sum is right.
#[test]
fn aliasing_of_aligned_cubes_adds_up_and_that_of_turned_ones_cancels() {
    let surfaces = room().unwrap();
    let mesh = mesh(&surfaces, 60);
    let (outline, table) = (VertexBuffer::new(&surfaces), FormFactorTable::new(16));
    let setting = SceneGeometry {
        surfaces: &surfaces,
        hierarchy: &Hierarchy::new(&surfaces),
    };
    let mut cube = Hemicube::new(setting, &outline, &mesh, &table);
    let floor = surfaces
        .facets
        .iter()
        .position(|f| f.normal.z > 0.9)
        .unwrap();
    let lid = |row: Row| -> f64 {
        let above = |e: u32| surfaces.facets[mesh.elements[e as usize].facet].normal.z < -0.9;
        row.iter()
            .filter(|r| above(r.0))
            .map(|r| f64::from(r.1))
            .sum()
    };
    // A quarter of the lid from the point below its corner, a side of `a` by `b` at height 1.
    let quarter = |a: f64, b: f64| {
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / p * (b / p).atan() + b / q * (a / q).atan()) / std::f64::consts::TAU
    };
    let (mut aligned, mut turned) = (0.0, 0.0);
    let count = 200;
    for i in 0..count {
        let p = vec3(
            0.02 * hash_to_unit(i) - 0.01,
            0.02 * hash_to_unit(i + 7919) - 0.01,
            0.0,
        );
        let (west, east, south, north) = (1.0 + p.x, 1.0 - p.x, 1.0 + p.y, 1.0 - p.y);
        let exact = quarter(west, south)
            + quarter(west, north)
            + quarter(east, south)
            + quarter(east, north);
        aligned += lid(cube.row(floor, p, 0.0)) / exact - 1.0;
        turned += lid(cube.row(floor, p, hash_to_unit(i))) / exact - 1.0;
    }
    let [aligned, turned] = [aligned, turned].map(|sum: f64| (sum / count as f64).abs());
    assert!(aligned > 2.0 * turned, "aligned {aligned}, turned {turned}");
    assert!(turned < 0.006, "{turned}");
}

/// With little memory the rows of the second gather are recomputed instead of kept: equal bits.
#[test]
fn little_memory_changes_the_way_and_not_the_picture() {
    let mut case = stage();
    (case.view.width, case.view.height) = (160, 90);
    let plenty = render(&case, 1, std::slice::from_ref(&case.mix), 1);
    let (least, lean) = leanest(&case);
    assert!(least > 4, "{least}");
    assert_eq!(plenty[0].data(), lean[0].data());
}

/// The mixed image with the least sufficient memory, megabytes: the rows of the elements fit into
/// half of the rest, those of the gather points, which are more, not into a quarter of it.
fn leanest(case: &Case) -> (usize, Vec<Image>) {
    for megabytes in 1.. {
        let work = Work {
            memory: megabytes << 20,
            ..Work::silent()
        };
        let done = Radiosity
            .prepare(&case.setup(), Quality(1), work)
            .and_then(|mut g| g.render(std::slice::from_ref(&case.mix), work));
        match done {
            Err(TransportError::Memory { .. }) => {}
            other => return (megabytes, other.unwrap()),
        }
    }
    unreachable!("memory grows")
}

/// Cancels after a number of polls.
struct Countdown {
    asked: AtomicUsize,
    patience: usize,
}

impl Progress for Countdown {
    fn cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.patience
    }
}

/// Wherever it is cancelled, with rows kept or recomputed, there is no image.
#[test]
#[ignore = "slow"]
fn a_cancel_is_heard_all_the_way() {
    let mut case = stage();
    (case.view.width, case.view.height) = (96, 54);
    for megabytes in [64, leanest(&case).0] {
        let with = |patience: usize| {
            let progress = Countdown {
                asked: AtomicUsize::new(0),
                patience,
            };
            let work = Work {
                progress: &progress,
                threads: 2,
                memory: megabytes << 20,
            };
            let done = Radiosity
                .prepare(&case.setup(), Quality(1), work)
                .and_then(|mut g| g.render(std::slice::from_ref(&case.mix), work));
            (done, progress.asked.into_inner())
        };
        let (done, asked) = with(usize::MAX);
        assert!(done.is_ok(), "{done:?}");
        println!("{megabytes} MB: asked {asked} times");
        assert!(asked > 200, "{asked}");
        for part in 0..16 {
            let (done, _) = with(asked * part / 16);
            assert!(matches!(done, Err(TransportError::Cancelled(_))), "{part}");
        }
    }
}
