use super::*;

/// A grey image of one row.
fn row(values: &[f32]) -> Image {
    let data = values.iter().flat_map(|v| [*v; 3]).collect();
    Image::from_data(values.len(), 1, data).unwrap()
}

fn distance(a: &Image, b: &Image) -> f64 {
    let d = combine(a.size(), &[(1.0, a), (-1.0, b)], 1);
    (dot(&d, &d) / 3.0).sqrt()
}

/// Two banks with coarse errors of 0.01 and 1, which a projection in plain settings confuses.
struct Two {
    truth: [Image; 2],
    pool: Pool,
}

impl Two {
    fn new() -> Two {
        let truth = [row(&[5.0, 0.0, 0.0, 0.0]), row(&[0.0, 7.0, 0.0, 0.0])];
        let coarse = [row(&[5.0, 0.0, 0.01, 0.0]), row(&[0.0, 7.0, 0.0, 1.0])];
        // The cheaper quality errs twice as much, so that the difference is the error.
        let coarser = [row(&[5.0, 0.0, 0.02, 0.0]), row(&[0.0, 7.0, 0.0, 2.0])];
        let [coarse, coarser] = [coarse, coarser].map(|i| i.map(Arc::new).to_vec());
        let pool = Pool::new(coarse, coarser, Work::silent()).unwrap();
        Two { truth, pool }
    }

    fn rendered(&self, setting: [f64; 2]) -> Arc<Image> {
        let [a, b] = &self.truth;
        Arc::new(combine((4, 1), &[(setting[0], a), (setting[1], b)], 1))
    }
}

#[test]
fn projecting_in_plain_settings_would_be_worse_than_coarse_and_ours_is_not() {
    let mut two = Two::new();
    let refined = two.rendered([1.0, 1.0]);
    assert!(
        two.pool
            .add(vec![1.0, 1.0], refined.clone(), Quality(4), Work::silent())
    );
    let truth = two.rendered([1.0, 0.0]);
    let coarse = distance(&two.pool.coarse()[0], &truth);
    assert!((coarse - 0.01).abs() < 1e-6);

    // In plain settings, (1,0) projected on (1,1) is half of the refined image.
    let c = two.pool.coarse();
    let plain = combine((4, 1), &[(0.5, &refined), (0.5, &c[0]), (-0.5, &c[1])], 1);
    assert!(distance(&plain, &truth) > 40.0 * coarse);

    let ours = two.pool.preview(&[1.0, 0.0], Work::silent()).unwrap();
    assert!(
        distance(&ours, &truth) <= coarse * 1.0001,
        "{}",
        distance(&ours, &truth)
    );
}

#[test]
fn errors_are_relative_to_the_light_of_each_moment() {
    let mut two = Two::new();
    let left = |pool: &Pool, setting: [f64; 2]| {
        let moment = plan::Moment {
            setting: setting.to_vec(),
            scale: 1.0 / pool.light(&setting),
        };
        plan::worst_left(&[moment], &pool.settings(), &[], pool.weighting())
    };
    // The lights' coarse images are 5 and sqrt(50), off by 0.01 and 1.
    for dim in [1.0, 1e-4] {
        assert!((left(&two.pool, [dim, 0.0])[1] - 0.01 / 5.0).abs() < 1e-5);
    }
    assert!((left(&two.pool, [0.0, 1.0])[1] - 1.0 / 50.0_f64.sqrt()).abs() < 1e-5);
    let refined = two.rendered([0.0, 1.0]);
    assert!(
        two.pool
            .add(vec![0.0, 1.0], refined, Quality(4), Work::silent())
    );
    let [alone, now] = left(&two.pool, [0.0, 1.0])[..] else {
        panic!("two numbers");
    };
    assert!(now < 1e-9 && alone > 0.1);
}

/// The operator's statement serves as the estimate: at every moment before refinement, and for
/// refined images at the end.
#[test]
fn stated_errors_hold_before_and_after_refining() {
    let coarse = vec![row(&[5.0, 0.0]), row(&[0.0, 7.0])];
    let pool = Pool::new(coarse, Vec::new(), Work::silent()).unwrap();
    let stated = Stated {
        calibration: 0.02,
        refined: 0.25,
        noise: None,
    };
    let pool = pool.stating(Some(stated), &[false; 2]).unwrap();
    assert!(pool.is_relative() && pool.is_stated());
    // Norms are over all channels, of which these images have three equal ones.
    let wanted = 3.0_f64.sqrt() * 15.0_f64.hypot(28.0);
    assert!((pool.light(&[3.0, 4.0]) - wanted).abs() < 1e-9);
    assert_eq!(pool.error(1.0, 1.0), 0.02);
    assert_eq!(pool.error(0.0, 1.0), 0.005);
    assert!(pool.error(0.5, 1.0) < 0.02 && pool.error(0.5, 1.0) > 0.01);
    // A refined image that shows smaller errors of coarse ones tells nothing about refined ones.
    let mut exact = pool.clone();
    assert!(exact.add(vec![1.0, 1.0], row(&[5.0, 7.0]), Quality(2), Work::silent()));
    assert!(exact.error(1.0, 1.0) < 0.02);
    assert_eq!(exact.error(0.0, 1.0), 0.005);
    // Sums of the coarse images themselves keep the stated error.
    let same = Stated {
        refined: 1.0,
        ..stated
    };
    let mut same = pool.stating(Some(same), &[false; 2]).unwrap();
    assert!(same.add(vec![1.0, 1.0], row(&[5.0, 7.0]), Quality(1), Work::silent()));
    assert_eq!(same.error(0.0, 1.0), 0.02);
}

/// A bank that is an image has no error.
#[test]
fn what_is_exact_has_no_weight() {
    let coarse = vec![row(&[5.0, 0.0]), row(&[0.0, 7.0])];
    let pool = Pool::new(coarse, Vec::new(), Work::silent()).unwrap();
    let pool = pool
        .stating(Some(Stated::of(0.02, 0.02, 0.005)), &[false, true])
        .unwrap();
    assert_eq!(pool.weighting().weights()[1], 0.0);
    assert!(pool.weighting().weights()[0] > 0.0 && pool.light(&[0.0, 1.0]) > 0.0);
}

#[test]
fn a_refined_setting_is_reproduced_and_other_sizes_are_refused() {
    let mut two = Two::new();
    for setting in [[1.0, 0.5], [0.2, -1.0]] {
        let image = two.rendered(setting);
        assert!(
            two.pool
                .add(setting.to_vec(), image, Quality(4), Work::silent())
        );
    }
    for setting in [[1.0, 0.5], [0.2, -1.0]] {
        let preview = two.pool.preview(&setting, Work::silent()).unwrap();
        assert!(distance(&preview, &two.rendered(setting)) < 1e-6);
    }
    assert!(!two.pool.add(
        vec![1.0],
        Arc::new(row(&[0.0; 4])),
        Quality(4),
        Work::silent()
    ));
    assert!(!two.pool.add(
        vec![1.0, 1.0],
        Arc::new(row(&[0.0; 3])),
        Quality(4),
        Work::silent()
    ));
    assert_eq!(two.pool.refined().len(), 2);
}

/// With and without memory for the extrapolated images, after each change of the fit.
#[test]
fn a_preview_is_the_same_to_the_bit_with_little_memory() {
    let mut two = Two::new();
    let mut shown = Vec::new();
    for setting in [[1.0, 1.0], [0.2, -1.0]] {
        let image = two.rendered(setting);
        two.pool
            .add(setting.to_vec(), image, Quality(4), Work::silent());
        let lean = Work {
            memory: 0,
            ..Work::silent()
        };
        let setting = [0.37, 0.91];
        let preview = two.pool.preview(&setting, Work::silent()).unwrap();
        assert_eq!(two.pool.preview(&setting, lean).unwrap(), preview);
        let again = two.pool.clone().preview(&setting, Work::silent()).unwrap();
        assert_eq!(again, preview);
        shown.push(preview);
    }
    assert_ne!(shown[0], shown[1]);
}

#[test]
fn corrections_extrapolate_and_calibrate() {
    let mut two = Two::new();
    assert_eq!(two.pool.calibration(), 1.0);
    let refined = two.rendered([1.0, 1.0]);
    two.pool
        .add(vec![1.0, 1.0], refined, Quality(4), Work::silent());
    // The finer quality's error is minus the difference D = finer - coarser, so a = 1 removes it.
    assert!((two.pool.fit.extrapolation - 1.0).abs() < 1e-6);
    // One correction, as large as expected.
    assert!((two.pool.calibration() - 1.0).abs() < 1e-6);
    let refined = two.rendered([1.0, -0.5]);
    two.pool
        .add(vec![1.0, -0.5], refined, Quality(4), Work::silent());
    // Extrapolation leaves no error; only the estimate itself still contributes one.
    assert!((two.pool.calibration() - (1.0_f64 / 3.0).sqrt()).abs() < 1e-3);
    let preview = two.pool.preview(&[0.3, 0.9], Work::silent()).unwrap();
    assert!(distance(&preview, &two.rendered([0.3, 0.9])) < 1e-6);
}
