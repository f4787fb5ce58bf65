//! Small rooms and the light meter: an image read as illuminances.
//!
//! A pixel that shows a diffuse surface of reflectance rho has rho / pi times its illuminance. In a
//! camera that looks straight at a wall, pixels are equal squares of it, so one image measures a
//! grid of known points.

use footlight_host::work::{Silent, Work};
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::{Emitter, Light, Material, Polygon, Rig, Scene, Source};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Setup, Transport};
use std::f64::consts::{PI, TAU};

/// Reflectance of walls that are measured but must not light each other.
pub const GREY: f64 = 1e-5;

/// Every quality of the scale.
pub fn qualities() -> std::ops::RangeInclusive<u8> {
    1..=Radiosity.finest().0
}

/// The cheapest and the finest step: enough to check improvement when each step takes seconds.
pub fn both_ends() -> [u8; 2] {
    [*qualities().start(), *qualities().end()]
}

/// Two threads, plenty of memory.
pub fn work() -> Work<'static> {
    Work {
        progress: &Silent,
        threads: 2,
        memory: 2 << 30,
    }
}

/// A scene with a source for each light.
#[derive(Clone, Default)]
pub struct Room {
    pub scene: Scene,
    pub lights: Vec<Light>,
}

impl Room {
    /// A surface of this reflectance.
    pub fn wall(&mut self, vertices: &[Vec3], reflectance: f64) {
        let material = self.scene.materials.len();
        self.scene.materials.push(Material::diffuse(
            format!("m{material}"),
            Rgb([reflectance; 3]),
        ));
        self.scene
            .polygons
            .push(Polygon::new(vertices.to_vec(), material));
    }

    /// A light made of black surfaces of this radiance.
    pub fn panel(&mut self, parts: &[Vec<Vec3>], radiance: f64) {
        self.emitter(parts, radiance, 0.0);
    }

    /// A light whose surfaces also reflect.
    pub fn emitter(&mut self, parts: &[Vec<Vec3>], radiance: f64, reflectance: f64) {
        let material = self.scene.materials.len();
        self.scene.materials.push(Material {
            name: format!("m{material}"),
            reflectance: Rgb([reflectance; 3]),
            emission: Rgb([radiance; 3]),
            texture: None,
            gloss: None,
        });
        let parts = parts
            .iter()
            .map(|vertices| Polygon::new(vertices.clone(), material));
        self.scene.polygons.extend(parts);
        self.lights.push(Light::Panel {
            material,
            radiance: Rgb([radiance; 3]),
        });
    }

    /// A spot so narrow and far away that it lights surfaces with the illuminance `level` times the
    /// cosine, by light that travels along `direction` and would pass through `through`.
    pub fn sun(&mut self, through: Vec3, direction: Vec3, level: f64) {
        const FAR: f64 = 1e6;
        self.lights.push(Light::Spot(Spot {
            position: through - direction.normalized() * FAR,
            aim: through,
            beam: 1.0,
            field: 2.0,
            intensity: Rgb([level * FAR * FAR; 3]),
        }));
    }

    /// A point that emits equally in all directions except the last twentieth of a degree.
    pub fn bulb(&mut self, position: Vec3, intensity: f64) {
        self.lights.push(Light::Spot(Spot {
            position,
            aim: position + vec3(0.3, 0.5, 0.81),
            beam: 359.9,
            field: 360.0,
            intensity: Rgb([intensity; 3]),
        }));
    }

    /// A source for each light.
    pub fn rig(&self) -> Rig {
        let sources = (0..self.lights.len()).map(|light| Source {
            name: format!("s{light}"),
            emitters: vec![Emitter {
                light,
                filter: Rgb::WHITE,
            }],
        });
        Rig {
            sources: sources.collect(),
            lights: self.lights.clone(),
        }
    }

    /// Radiance in the pixels with all lights on, red channel.
    pub fn radiances(&self, view: &View, quality: u8) -> Vec<f64> {
        let rig = self.rig();
        let on = vec![vec![1.0; rig.sources.len()]];
        let setup = Setup::new(self.scene.clone(), rig, view.clone());
        let mut g = Radiosity.prepare(&setup, Quality(quality), work()).unwrap();
        let image = g.render(&on, work()).unwrap().remove(0);
        let red = image.data().chunks_exact(3).map(|p| f64::from(p[0]));
        red.collect()
    }

    /// Asserts that the image of a mixture of the two lights is that mixture of their images.
    pub fn assert_linear(&self, view: &View) {
        let setup = Setup::new(self.scene.clone(), self.rig(), view.clone());
        let mut operator = Radiosity.prepare(&setup, Quality(1), work()).unwrap();
        let mix = [0.3, 1.7];
        let settings = [vec![1.0, 0.0], vec![0.0, 1.0], mix.to_vec()];
        let images = operator.render(&settings, work()).unwrap();
        let [a, b, both] = [0, 1, 2].map(|i| images[i].data());
        let most = both.iter().copied().fold(0.0, f32::max);
        for ((a, b), both) in a.iter().zip(b).zip(both) {
            let sum = mix[0] * f64::from(*a) + mix[1] * f64::from(*b);
            assert!((sum - f64::from(*both)).abs() < 1e-6 * f64::from(most));
        }
    }

    /// Illuminance at the meter's points, on a wall of this reflectance.
    pub fn illuminances(&self, meter: &Meter, reflectance: f64, quality: u8) -> Vec<f64> {
        let radiances = self.radiances(&meter.view(), quality);
        radiances.iter().map(|l| l * PI / reflectance).collect()
    }

    /// Mean illuminance over the meter's squares.
    pub fn mean(&self, meter: &Meter, reflectance: f64, quality: u8) -> f64 {
        mean(&self.illuminances(meter, reflectance, quality))
    }
}

/// Arithmetic mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The largest relative deviation.
pub fn worst(got: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(got.len(), expected.len());
    let pairs = got.iter().zip(expected);
    pairs.fold(0.0, |most: f64, (g, e)| most.max((g / e - 1.0).abs()))
}

/// Lambert's contour integral for polygons wholly above the horizon: the form factor from an
/// element at the origin, normal up.
pub fn contour(polygon: &[Vec3]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let edges = polygon.iter().zip(next).map(|(a, b)| {
        let cross = a.cross(*b);
        cross.length().atan2(a.dot(*b)) * cross.normalized().z
    });
    (edges.sum::<f64>() / TAU).abs()
}

/// Asserts on errors over the quality steps: the finest step is within the limit and better than
/// the first, and no step is much worse than the one before. Values far below the limit do not
/// count: they are the meter's own error, or chance.
pub fn assert_better(what: &str, errors: &[f64], limit: f64) {
    println!("{what}: {errors:.6?}");
    let noise = 0.5 * limit;
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    assert!(
        last < limit && last <= first.max(noise),
        "{what}: {errors:?}"
    );
    for pair in errors.windows(2) {
        assert!(pair[1] <= (1.5 * pair[0]).max(noise), "{what}: {errors:?}");
    }
}

/// A camera that looks straight at a wall from nearby.
#[derive(Clone, Debug)]
pub struct Meter {
    /// Middle of the field, on the wall.
    pub centre: Vec3,
    /// The wall's unit normal.
    pub normal: Vec3,
    /// Side of a square, metres.
    pub pitch: f64,
    /// Squares to the right and down, as the camera sees them.
    pub counts: [usize; 2],
    /// Distance from the wall.
    pub distance: f64,
}

impl Meter {
    /// `counts` squares of side `pitch`.
    pub fn new(centre: Vec3, normal: Vec3, pitch: f64, counts: [usize; 2], distance: f64) -> Meter {
        Meter {
            centre,
            normal,
            pitch,
            counts,
            distance,
        }
    }

    /// One tiny square.
    pub fn point(centre: Vec3, normal: Vec3) -> Meter {
        Meter::new(centre, normal, 1e-3, [1, 1], 0.05)
    }

    /// The camera.
    pub fn view(&self) -> View {
        let half = 0.5 * self.pitch * self.counts[1] as f64;
        View {
            from: self.centre + self.normal * self.distance,
            to: self.centre,
            fov: 2.0 * (half / self.distance).atan().to_degrees(),
            roll: 0.0,
            width: self.counts[0],
            height: self.counts[1],
        }
    }

    /// Middle of a square.
    pub fn at(&self, x: usize, y: usize) -> Vec3 {
        let forward = -self.normal;
        let up = if forward.x.hypot(forward.y) < 1e-9 {
            vec3(0.0, 1.0, 0.0)
        } else {
            vec3(0.0, 0.0, 1.0)
        };
        let right = forward.cross(up).normalized();
        let step = |i: usize, n: usize| self.pitch * (i as f64 + 0.5 - 0.5 * n as f64);
        self.centre + right * step(x, self.counts[0])
            - right.cross(forward) * step(y, self.counts[1])
    }
}

/// A rectangle `[x0, x1] x [y0, y1]` at height z that faces up, or down.
pub fn level(x: [f64; 2], y: [f64; 2], z: f64, up: bool) -> Vec<Vec3> {
    let corners = [
        vec3(x[0], y[0], z),
        vec3(x[1], y[0], z),
        vec3(x[1], y[1], z),
        vec3(x[0], y[1], z),
    ];
    facing(&corners, up)
}

/// A rectangle at y that faces along +y, or -y.
pub fn upright(x: [f64; 2], y: f64, z: [f64; 2], along: bool) -> Vec<Vec3> {
    let corners = [
        vec3(x[1], y, z[0]),
        vec3(x[0], y, z[0]),
        vec3(x[0], y, z[1]),
        vec3(x[1], y, z[1]),
    ];
    facing(&corners, along)
}

/// A rectangle at x that faces along +x, or -x.
pub fn aside(x: f64, y: [f64; 2], z: [f64; 2], along: bool) -> Vec<Vec3> {
    let corners = [
        vec3(x, y[0], z[0]),
        vec3(x, y[1], z[0]),
        vec3(x, y[1], z[1]),
        vec3(x, y[0], z[1]),
    ];
    facing(&corners, along)
}

fn facing(corners: &[Vec3], as_they_are: bool) -> Vec<Vec3> {
    let mut out = corners.to_vec();
    if !as_they_are {
        out.reverse();
    }
    out
}

/// The six faces of a box, seen from inside or outside: -x, +x, -y, +y, -z, +z.
pub fn cuboid(low: Vec3, high: Vec3, inside: bool) -> [Vec<Vec3>; 6] {
    let (x, y, z) = ([low.x, high.x], [low.y, high.y], [low.z, high.z]);
    [
        aside(low.x, y, z, inside),
        aside(high.x, y, z, !inside),
        upright(x, low.y, z, inside),
        upright(x, high.y, z, !inside),
        level(x, y, low.z, inside),
        level(x, y, high.z, !inside),
    ]
}

/// Inward normals of the faces of [`cuboid`].
pub const INWARD: [Vec3; 6] = [
    vec3(1.0, 0.0, 0.0),
    vec3(-1.0, 0.0, 0.0),
    vec3(0.0, 1.0, 0.0),
    vec3(0.0, -1.0, 0.0),
    vec3(0.0, 0.0, 1.0),
    vec3(0.0, 0.0, -1.0),
];
