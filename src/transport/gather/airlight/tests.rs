use super::*;
use crate::gather::bvh::Bvh;
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::vec3;
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::Scene;

/// A scene of these polygons in haze.
pub fn with_air<T>(haze: Haze, polygons: &[Vec<Vec3>], of: impl FnOnce(Airlight<'_>) -> T) -> T {
    let mut surfaces = Surfaces::new(&Scene::default()).unwrap();
    if !polygons.is_empty() {
        surfaces = Surfaces::grey(polygons.to_vec());
    }
    surfaces.haze = Some(haze);
    let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
    let scene = RayScene {
        surfaces: &surfaces,
        bvh: &bvh,
        offset: 1e-6,
    };
    of(Airlight {
        scene,
        haze,
        nodes: 64,
    })
}

pub fn haze(extinction: f64, forward: f64) -> Haze {
    Haze {
        extinction,
        forward,
        albedo: 0.9,
    }
}

fn beam(beam: f64, field: f64, aim: Vec3) -> Beam {
    let position = vec3(0.0, 1.5, 0.0);
    let intensity = Rgb::WHITE;
    Beam::new(&Spot {
        position,
        aim: position + aim,
        beam,
        field,
        intensity,
    })
    .unwrap()
}

fn sight(eye: Vec3, way: Vec3, length: f64) -> Sight {
    Sight {
        eye,
        way: way.normalized(),
        length,
        spread: 1e-6,
    }
}

/// Integral over the whole ray with many intervals.
fn fine(air: &Airlight<'_>, beam: &Beam, sight: &Sight) -> f64 {
    let lamp = Lamp::of_beam(beam, None);
    let length = sight.length.min(DEEPEST / air.haze.extinction);
    let spans = lamp.spans(sight, length);
    let parts = spans.iter().flat_map(|[from, to]| {
        let at = move |k: i32| from + (to - from) * (f64::from(k) / 200.0).powi(2);
        (0..200).map(move |k| [at(k), at(k + 1)])
    });
    parts.map(|span| air.along(&lamp, sight, span, 0.5)).sum()
}

/// Simpson's rule.
fn integral(f: impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> f64 {
    let n = 4000;
    let step = (to - from) / f64::from(n);
    let weight = |k: i32| match k {
        0 => 1.0,
        k if k == n => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=n)
        .map(|k| weight(k) * f(from + f64::from(k) * step))
        .sum::<f64>()
        * step
        / 3.0
}

/// An isotropic point light along a half-line from its nearest point (Sun, Ramamoorthi, Narasimhan
/// and Nayar, *A Practical Analytic Single Scattering Model for Real Time Rendering*, 2005), whose
/// special function at a right angle is `Ci(u) sin u + (pi/2 - Si(u)) cos u`.
#[test]
fn a_half_line_past_an_isotropic_point_has_a_closed_form() {
    for extinction in [0.02, 0.1, 0.5] {
        let u: f64 = extinction * 1.5;
        let (mut si, mut ci) = (0.0, 0.577_215_664_901_532_9 + u.ln());
        let mut term = 1.0;
        for k in 1..30 {
            let n = f64::from(k);
            term *= u / n;
            let sign = if k / 2 % 2 == 0 { 1.0 } else { -1.0 };
            if k % 2 == 1 {
                si += sign * term / n;
            } else {
                ci += sign * term / n;
            }
        }
        let whole = ci * u.sin() + (FRAC_PI_2 - si) * u.cos();
        let part = integral(|x| (-u * x.tan()).exp(), [0.0, PI / 4.0]);
        let exact = 0.9 * extinction / (4.0 * PI) * 2.0 / 1.5 * (whole - part);
        let bulb = beam(359.0, 360.0, vec3(0.0, 0.0, 1.0));
        let ray = sight(Vec3::ZERO, vec3(1.0, 0.0, 0.0), f64::INFINITY);
        let found = with_air(haze(extinction, 0.0), &[], |air| fine(&air, &bulb, &ray));
        assert!(
            (found / exact - 1.0).abs() < 1e-5,
            "{extinction}: {}",
            found / exact - 1.0
        );
    }
}

/// For thin haze, radiance over extinction tends to `albedo (u1 - u0) / (4 pi h)`.
#[test]
fn thin_haze_has_a_closed_form() {
    let bulb = beam(359.0, 360.0, vec3(0.0, 0.0, 1.0));
    let ray = sight(vec3(-2.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), 5.0);
    let exact = 0.9 * ((3.0_f64 / 1.5).atan() + (2.0_f64 / 1.5).atan()) / (4.0 * PI * 1.5);
    let found = with_air(haze(1e-9, 0.0), &[], |air| fine(&air, &bulb, &ray)) / 1e-9;
    assert!(
        (found / exact - 1.0).abs() < 1e-6,
        "{}",
        found / exact - 1.0
    );
    assert!((phase(0.0, 0.3) - 1.0 / (4.0 * PI)).abs() < 1e-15);
    let all = integral(
        |angle| 2.0 * PI * angle.sin() * phase(0.7, angle.cos()),
        [0.0, PI],
    );
    assert!((all - 1.0).abs() < 1e-9, "{all}");
}

/// Compares each step's nodes with many, on rays through a spot's beam, with the eye inside or
/// outside.
#[test]
fn few_nodes_meet_the_integral() {
    let lamp = beam(24.0, 40.0, vec3(0.3, -1.0, 0.2));
    with_air(haze(0.02, 0.7), &[], |air| {
        for (nodes, allowed) in [(8, 5e-3), (16, 2e-3), (32, 1e-3)] {
            let few = Airlight { nodes, ..air };
            let (mut error, mut square) = (0.0, 0.0);
            for k in 0..100 {
                let ([a, b], [c, d]) = (point(k, 1), point(k, 2));
                let eye = vec3(6.0 * a - 3.0, 4.0 * b - 4.0, 4.0 * c - 6.0);
                let to = vec3(2.0 * d - 1.0, 2.0 * a - 1.5, 2.0 * b - 1.0);
                let ray = sight(eye, to - eye, 12.0);
                let exact = fine(&air, &lamp, &ray);
                let found = few.radiance(&Emitter::Point(&lamp, None), &ray, 0.5);
                error += (found - exact).powi(2);
                square += exact * exact;
            }
            let error = (error / square).sqrt();
            assert!(square > 0.0 && error < allowed, "{nodes}: {error}");
        }
    });
}

/// A plate that hides the lamp from half of a ray leaves the other half unchanged, and no light
/// passes through it; a one-node estimate has the same mean.
#[test]
fn a_plate_shades_the_haze_behind_it() {
    let bulb = beam(359.0, 360.0, vec3(0.0, 0.0, 1.0));
    let plate = vec![
        vec3(0.0, 1.0, -50.0),
        vec3(50.0, 1.0, -50.0),
        vec3(50.0, 1.0, 50.0),
        vec3(0.0, 1.0, 50.0),
    ];
    let ray = sight(vec3(-2.1, 0.0, 0.0), vec3(1.0, 0.0, 0.0), 5.0);
    let lit = sight(ray.eye, ray.way, 2.1);
    let emitter = Emitter::Point(&bulb, None);
    let exact = with_air(haze(0.05, 0.3), &[], |air| fine(&air, &bulb, &lit));
    with_air(haze(0.05, 0.3), &[plate], |air| {
        for nodes in [8, 16, 32] {
            let found = Airlight { nodes, ..air }.radiance(&emitter, &ray, 0.5);
            assert!(
                (found / exact - 1.0).abs() < 0.02,
                "{nodes}: {found} for {exact}"
            );
        }
        let sample = |k| air.sample(&emitter, &ray, [point(k, 3), point(k, 4)]);
        let mean = (0..4096).map(sample).sum::<f64>() / 4096.0;
        assert!((mean / exact - 1.0).abs() < 2e-3, "{mean} for {exact}");
    });
}

/// In thin haze, each metre of a beam seen from the side sends the same light, the lamp's flux
/// times `albedo extinction / (4 pi)`, even at its tip, which is narrower than a pixel.
#[test]
fn a_beam_is_as_bright_at_its_tip() {
    const SIZE: [usize; 2] = [24, 9];
    let step = 0.002;
    let camera = |[x, y]: [f64; 2]| Camera {
        left: -(4.0 + x) * step,
        top: (4.0 + y) * step,
        ..Camera::of_square(2.0 / step)
    };
    let position = vec3(0.0, 0.0, -10.0);
    let lamp = Beam::new(&Spot {
        position,
        aim: position + vec3(1.0, 0.0, 0.0),
        beam: 5.0,
        field: 9.0,
        intensity: Rgb::WHITE,
    });
    let lamp = lamp.unwrap();
    let share = |angle: f64| lamp.share(vec3(angle.cos(), angle.sin(), 0.0));
    let flux = integral(|angle| 2.0 * PI * angle.sin() * share(angle), [0.0, 0.2]);
    let thin = haze(1e-6, 0.0);
    // A pixel is 2 cm wide and high there.
    let exact = 0.9 * 1e-6 / (4.0 * PI) * flux / 0.02;
    // Wherever the lamp lies in its pixel.
    let places = [[0.3, 0.6], [0.5, 0.5], [0.04, 0.96], [0.75, 0.25]];
    for (nodes, place) in [8, 16, 32].into_iter().flat_map(|n| places.map(|p| (n, p))) {
        let of = |air: Airlight<'_>| {
            let air = Airlight { nodes, ..air };
            let emitters = [Emitter::Point(&lamp, None)];
            let void = |_: usize| std::iter::empty();
            air.picture(&emitters, (&camera(place), SIZE), void, Work::silent())
        };
        let picture = with_air(thin, &[], of).unwrap();
        for column in 4..SIZE[0] {
            let pixels = picture.iter().skip(column).step_by(SIZE[0]);
            let found = f64::from(pixels.sum::<f32>()) / exact;
            // Within the lamp's radius, half a pixel, it is dimmer.
            let after = column as f64 - 4.0 - place[0];
            let is_right = if after < 0.5 {
                found < 1.0
            } else {
                (found - 1.0).abs() < 0.01
            };
            assert!(
                is_right,
                "{nodes} nodes, {place:?}, column {column}: {found}"
            );
        }
    }
}

/// A tile that a beam is said to miss has no light of it, directly or in gloss.
#[test]
fn skipped_tiles_are_dark() {
    let camera = Camera::of_square(90.0);
    let random = |k: u32| point(k, 7);
    let mut skipped = 0;
    for k in 0..4000 {
        let [u, v] = random(3 * k);
        let [a, b] = random(3 * k + 1);
        let [c, d] = random(3 * k + 2);
        let position = vec3(8.0 * u - 4.0, 8.0 * v - 4.0, -12.0 * a - 0.5);
        let lamp = Beam::new(&Spot {
            position,
            aim: position + vec3(b - 0.5, c - 0.5, d - 0.5),
            beam: 1.0 + 20.0 * c,
            field: 2.0 + 40.0 * c,
            intensity: Rgb::WHITE,
        });
        let lamp = lamp.unwrap();
        let corner = [u, d].map(|x| (80.0 * x) as usize);
        let glossy = (k % 2 == 0).then(|| vec3(0.3 * c, 1.0, -0.4 * d));
        let pixel = |[i, j]: [usize; 2]| {
            let pixel = [corner[0] + i, corner[1] + j];
            let way = camera.ray(pixel[0] as f64 + 0.5, pixel[1] as f64 + 0.5);
            let length = 2.0 + 10.0 * b + 0.2 * i as f64;
            let direct = Sight {
                spread: camera.step_x,
                ..sight(camera.origin, way, length)
            };
            let end = camera.origin + direct.way * length;
            let reflected = glossy.map(|way| (0.1, sight(end, way, 3.0 + j as f64)));
            Pixel {
                place: pixel,
                direct: vec![(1.0, direct)],
                mirrored: reflected.into_iter().collect(),
            }
        };
        let tile: Vec<Pixel> = places([4; 2]).map(pixel).collect();
        let emitter = Emitter::Point(&lamp, None);
        let bundles = [true, false].map(|direct| Bundle::of(&tile, direct, 100.0));
        if !bundles
            .iter()
            .flatten()
            .all(|bundle| bundle.misses(&emitter))
        {
            continue;
        }
        skipped += 1;
        for pixel in &tile {
            let divided = pixel.direct.iter();
            let divided = divided.flat_map(|(_, sight)| split(sight, &camera, pixel.place, 4));
            let mut rays = divided.chain(pixel.mirrored.iter().map(|(_, sight)| *sight));
            assert!(rays.all(|ray| emitter.is_unseen(&ray)), "case {k}");
        }
    }
    assert!((1000..3900).contains(&skipped), "{skipped} of 4000");
}

/// Pixels that show a slanted plane, with a pole before it, are interpolated on both.
#[test]
fn surfaces_one_behind_another_are_interpolated() {
    let camera = Camera::of_square(90.0);
    let lamp = beam(80.0, 120.0, vec3(0.0, -1.0, -6.0));
    let length = |[i, _]: [usize; 2], way: Vec3| match i {
        3 => -4.0 / way.z,
        // The plane `z = -7 + x / 2`.
        _ => -7.0 / (way.z - 0.5 * way.x),
    };
    let pixel = |[i, j]: [usize; 2]| {
        let place = [40 + i, 30 + j];
        let way = camera.ray(place[0] as f64 + 0.5, place[1] as f64 + 0.5);
        let direct = Sight {
            spread: camera.step_x,
            ..sight(camera.origin, way, length([i, j], way.normalized()))
        };
        Pixel {
            place,
            direct: vec![(1.0, direct)],
            mirrored: Vec::new(),
        }
    };
    let pixels: Vec<Pixel> = places([TILE; 2]).map(pixel).collect();
    let tile = Tile::of(pixels.iter().collect(), [TILE; 2]);
    let emitter = Emitter::Point(&lamp, None);
    with_air(haze(0.05, 0.3), &[], |air| {
        let between = air.interpolated((&emitter, 0.0), &camera, &tile).unwrap();
        for ((pixel, found), place) in pixels.iter().zip(between).zip(places([TILE; 2])) {
            let exact = air.whole(&emitter, &camera, pixel);
            assert!(
                (found / exact - 1.0).abs() < 0.01,
                "{place:?}: {found} for {exact}"
            );
        }
    });
}

/// A cone of 180 degrees is a half-space: a ray that leaves it is lit up to there, exactly.
#[test]
fn a_half_space_ends_at_its_plane() {
    for k in 0..2000 {
        let [[a, b], [c, d]] = [point(2 * k, 9), point(2 * k + 1, 9)];
        let axis = vec3(a - 0.5, b - 0.5, c - 0.5).normalized();
        let ray = sight(
            vec3(4.0 * c - 2.0, 1.0, d),
            vec3(d - 0.5, c - 0.4, b - 0.5),
            6.0,
        );
        let found = spans(&ray, ray.length, (Vec3::ZERO, axis, FRAC_PI_2));
        let height = |t: f64| axis.dot(ray.eye + ray.way * t);
        for t in (0..60).map(|k| 0.1 * f64::from(k) + 0.05) {
            let is_lit = found.iter().any(|[from, to]| (*from..*to).contains(&t));
            let is_near = height(t).abs() < 1e-6;
            assert!(
                is_near || is_lit == (height(t) > 0.0),
                "{ray:?} {axis:?} {t}"
            );
        }
    }
}
