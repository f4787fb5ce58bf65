//! Lights against the light that they deliver: the flux of each kind of luminaire arrives
//! completely on the walls of a closed black box (CIE 171:2006, case 5.4).

use std::sync::Arc;

use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::geometry::View;
use footlight_show::geometry::mount::Mount;
use footlight_show::geometry::profile::Profile;
use footlight_show::geometry::shape::Shape;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::gobo::Gobo;
use footlight_stage::photometric::Distribution;
use footlight_stage::{
    Emitter, Light, Material, MeasuredLight, Polygon, Projection, Rig, Scene, Source,
};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Setup, Transport};

/// Reflectance so low that reflected light is below a millionth, yet visible to a camera.
const DARK: f64 = 1e-6;

/// A box from -1 to 1 of walls that face inwards.
fn black_box() -> Scene {
    let mut scene = Scene::default();
    scene
        .materials
        .push(Material::diffuse("black", Rgb([DARK; 3])));
    for axis in walls() {
        let (u, v) = tangents(axis);
        let corner = |a: f64, b: f64| axis + u * a + v * b;
        // Seen from inside, along the axis, this order is counter-clockwise.
        let vertices = vec![
            corner(-1.0, -1.0),
            corner(-1.0, 1.0),
            corner(1.0, 1.0),
            corner(1.0, -1.0),
        ];
        scene.polygons.push(Polygon::new(vertices, 0));
    }
    scene
}

fn walls() -> [Vec3; 6] {
    let e = [
        vec3(1.0, 0.0, 0.0),
        vec3(0.0, 1.0, 0.0),
        vec3(0.0, 0.0, 1.0),
    ];
    [e[0], -e[0], e[1], -e[1], e[2], -e[2]]
}

fn tangents(axis: Vec3) -> (Vec3, Vec3) {
    let u = if axis.x.abs() > 0.5 {
        vec3(0.0, 1.0, 0.0)
    } else {
        vec3(1.0, 0.0, 0.0)
    };
    (u, axis.cross(u))
}

/// Each group of lights as one source, white.
fn sources(groups: Vec<Vec<Light>>) -> Rig {
    let mut rig = Rig::default();
    for group in groups {
        let first = rig.lights.len();
        rig.lights.extend(group);
        let emitters = (first..rig.lights.len()).map(|light| Emitter {
            light,
            filter: Rgb::WHITE,
        });
        rig.sources.push(Source {
            name: format!("from {first}"),
            emitters: emitters.collect(),
        });
    }
    rig
}

/// Flux of each group on the six walls: the mean illuminance of each wall, measured by a camera
/// close to it, times its area. The camera looks at the wall square on, so that every pixel has
/// equal area.
fn delivered(scene: &Scene, groups: Vec<Vec<Light>>, pixels: usize) -> Vec<[f64; 3]> {
    let (scene, rig) = (Arc::new(scene.clone()), Arc::new(sources(groups)));
    let count = rig.sources.len();
    let alone = |i: usize| (0..count).map(|j| f64::from(u8::from(i == j))).collect();
    let settings: Vec<Vec<f64>> = (0..count).map(alone).collect();
    let mut sums = vec![[0.0; 3]; count];
    for axis in walls() {
        let near = 0.25;
        let view = View {
            from: axis * (1.0 - near),
            to: axis,
            fov: 2.0 * (1.0 / near).atan().to_degrees(),
            roll: 0.0,
            width: pixels,
            height: pixels,
        };
        let setup = Setup::new(Arc::clone(&scene), Arc::clone(&rig), view);
        let work = Work::silent();
        // Cheap steps interpolate direct light for each piece of a light separately, and the errors
        // add up: step 1 loses 0.29 % of the flux of a 10 cm sphere.
        let mut prepared = Radiosity.prepare(&setup, Quality(2), work).unwrap();
        let images = prepared.render(&settings, work).unwrap();
        let area = 4.0 / (pixels * pixels) as f64;
        for (image, sum) in images.iter().zip(&mut sums) {
            for pixel in image.data().chunks_exact(3) {
                for (s, p) in sum.iter_mut().zip(pixel) {
                    *s += f64::from(*p) * std::f64::consts::PI / DARK * area;
                }
            }
        }
    }
    sums
}

fn mount(aim: Vec3, turn: f64) -> Mount {
    let position = vec3(0.2, -0.1, 0.3);
    Mount {
        position,
        aim,
        turn,
    }
}

#[test]
#[ignore = "slow"]
fn a_files_lumens_arrive() {
    let text = "TILT=NONE\n1 -1 1 7 5 1 2 0 0 0 1 1 0\n0 30 60 90 120 150 180\n0 45 90 135 180\n\
        90 80 70 60 50 40 30\n90 120 10 60 9 40 30\n90 0 70 0 50 40 30\n90 80 70 60 50 40 30\n\
        90 60 70 60 50 40 30\n";
    let distribution = Arc::new(Distribution::parse(text.as_bytes()).unwrap());
    let light = Light::Measured(MeasuredLight {
        mount: mount(vec3(0.5, 0.4, -0.8), 25.0),
        factor: Rgb::WHITE.scaled(800.0 / distribution.flux()),
        distribution,
    });
    let flux = delivered(&black_box(), vec![vec![light]], 48)[0];
    assert!((flux[0] / 800.0 - 1.0).abs() < 3e-3, "{flux:?}");
}

/// A slide with different images in its channels.
fn slide() -> Arc<Gobo> {
    let (width, height) = (30, 20);
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let stripes = if x / 3 % 2 == 0 { 1.0 } else { 0.0 };
        [1.0, stripes, (y as f32 + 0.5) / height as f32]
    };
    let data = (0..width * height).flat_map(texel).collect();
    Arc::new(Gobo::new(Image::from_data(width, height, data).unwrap()).unwrap())
}

fn planes(slide: &Arc<Gobo>, mount: Mount, field: f64, candela: f64) -> Vec<Light> {
    let plane = |plane: usize| {
        let mut intensity = Rgb::default();
        intensity.0[plane] = candela;
        Light::Projection(Projection {
            mount,
            field,
            gobo: slide.clone(),
            plane,
            intensity,
        })
    };
    (0..3).map(plane).collect()
}

/// A spot and a projection, in one set of views.
#[test]
fn lumens_of_spots_and_projections_arrive() {
    let cones = [(24.0, 40.0), (60.0, 61.0), (100.0, 170.0)];
    let spot = |(beam, field)| {
        vec![Light::Spot(Spot {
            position: vec3(0.2, -0.1, 0.3),
            aim: vec3(0.5, 0.4, -0.8),
            beam,
            field,
            intensity: Rgb::WHITE.scaled(800.0 / Profile::new(beam, field).unwrap().flux()),
        })]
    };
    let slide = slide();
    let candela = 800.0 / Projection::flux(&slide, 70.0);
    let projection = planes(&slide, mount(vec3(0.5, 0.4, -0.8), 25.0), 70.0, candela);
    let groups = cones.map(spot).into_iter().chain([projection]).collect();
    let all = delivered(&black_box(), groups, 48);
    for ((beam, field), flux) in cones.into_iter().zip(&all) {
        assert!(
            (flux[0] / 800.0 - 1.0).abs() < 2e-3,
            "{beam}/{field}: {flux:?}"
        );
    }
    // The frustum's solid angle weights the stripes and the ramp almost equally.
    let flux = all[3];
    assert!((flux[0] / 800.0 - 1.0).abs() < 3e-3, "{flux:?}");
    assert!((flux[1] / 400.0 - 1.0).abs() < 0.02, "{flux:?}");
    assert!((flux[2] / 400.0 - 1.0).abs() < 0.02, "{flux:?}");
}

/// The upstage wall as a screen, seen square on from the middle of the room: illuminance in lux, at
/// the step without interpolated direct light.
fn screen(scene: &Scene, lights: Vec<Light>, pixels: usize) -> Image {
    let view = View {
        from: Vec3::ZERO,
        to: vec3(0.0, 1.0, 0.0),
        fov: 90.0,
        roll: 0.0,
        width: pixels,
        height: pixels,
    };
    let setup = Setup::new(scene.clone(), sources(vec![lights]), view);
    let work = Work::silent();
    let mut prepared = Radiosity.prepare(&setup, Quality(3), work).unwrap();
    let mut image = prepared.render(&[vec![1.0]], work).unwrap().remove(0);
    for x in image.data_mut() {
        *x *= (std::f64::consts::PI / DARK) as f32;
    }
    image
}

#[test]
fn a_flat_screen_darkens_by_the_cube_of_the_cosine() {
    let white = Image::from_data(1, 1, vec![1.0; 3]).unwrap();
    let light = Light::Projection(Projection {
        mount: Mount {
            position: vec3(0.0, -0.9, 0.0),
            aim: vec3(0.0, 1.0, 0.0),
            turn: 0.0,
        },
        field: 50.0,
        gobo: Arc::new(Gobo::new(white).unwrap()),
        plane: 0,
        intensity: Rgb::WHITE.scaled(1000.0),
    });
    let pixels = 40;
    let image = screen(&black_box(), vec![light], pixels);
    // Half the image on the wall, 1.9 m away.
    let (distance, half) = (1.9, 1.9 * 25.0_f64.to_radians().tan());
    let mut inside = 0;
    for y in 0..pixels {
        for x in 0..pixels {
            let at = |i: usize| (i as f64 + 0.5) / pixels as f64 * 2.0 - 1.0;
            let (u, v) = (at(x), at(y));
            let found = f64::from(image.pixel(x, y).unwrap()[0]);
            // A pixel is 0.05 m; those on the rim are partly lit.
            let rim = u.abs().max(v.abs()) - half;
            if rim < -0.05 {
                let cosine = distance / (distance * distance + u * u + v * v).sqrt();
                let expected = 1000.0 * cosine.powi(3) / (distance * distance);
                assert!(
                    (found / expected - 1.0).abs() < 2e-3,
                    "{x} {y}: {found} {expected}"
                );
                inside += 1;
            } else if rim > 0.05 {
                assert!(found < 1e-3, "{x} {y}: {found} lx outside the frustum");
            }
        }
    }
    assert!(inside > 900);
}

#[test]
fn a_projection_is_stopped_by_what_stands_in_its_way() {
    let slide = slide();
    let aim = vec3(0.0, 1.0, 0.0);
    let position = vec3(0.0, -0.9, 0.0);
    let thrower = Mount {
        position,
        aim,
        turn: 0.0,
    };
    let mut scene = black_box();
    let open = screen(&scene, planes(&slide, thrower, 40.0, 1000.0), 32);
    // A shutter before the left half of the beam, facing the projector.
    let corner = |x: f64, z: f64| vec3(x, -0.5, z);
    let vertices = vec![
        corner(-1.0, -0.9),
        corner(0.0, -0.9),
        corner(0.0, 0.9),
        corner(-1.0, 0.9),
    ];
    scene.polygons.push(Polygon::new(vertices, 0));
    let half = screen(&scene, planes(&slide, thrower, 40.0, 1000.0), 32);
    let mut lit = 0;
    for y in 0..32 {
        for x in 0..32 {
            let (a, b) = (open.pixel(x, y).unwrap(), half.pixel(x, y).unwrap());
            for (a, b) in a.into_iter().zip(b) {
                match x {
                    0..=14 => assert!(b < 1e-3, "{x} {y}: {b}"),
                    17.. => assert!((a - b).abs() <= 2e-3 * a.abs() + 1e-3, "{x} {y}: {a} {b}"),
                    _ => {}
                }
                lit += usize::from(b > 10.0);
            }
        }
    }
    assert!(lit > 100, "{lit}");
}

#[test]
#[ignore = "slow"]
fn a_shapes_lumens_arrive() {
    let centre = vec3(0.1, 0.05, -0.1);
    for shape in [
        Shape::Sphere {
            centre,
            radius: 0.05,
        },
        Shape::Disc {
            centre,
            aim: vec3(1.0, 2.0, 3.0),
            radius: 0.05,
        },
    ] {
        let mut scene = black_box();
        scene.add_shape("lamp".to_owned(), &shape);
        let radiance = Rgb::WHITE.scaled(800.0 / (std::f64::consts::PI * shape.area()));
        let panel = Light::Panel {
            material: 1,
            radiance,
        };
        let flux = delivered(&scene, vec![vec![panel]], 28)[0];
        assert!((flux[0] / 800.0 - 1.0).abs() < 2e-3, "{shape:?}: {flux:?}");
    }
}
