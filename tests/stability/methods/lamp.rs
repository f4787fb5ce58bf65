//! Form factors from points of a floor to a lamp above: by hemicube, by a point approximation, and
//! by the shipped closed form of direct light.

use std::f64::consts::{PI, TAU};

use super::furnace::{mesh, scene};
use footlight_host::work::Work;
use footlight_show::geometry::{Vec3, vec3};
use footlight_transport::TransportError;
use footlight_transport::direct::cluster::{Receiver, Receivers};
use footlight_transport::direct::{IrradiancePrecision, PreparedLight, irradiance};
use footlight_transport::hemicube::indirect::hemicube::{FormFactorTable, Hemicube, hash_to_unit};
use footlight_transport::hemicube::raster::VertexBuffer;
use footlight_transport::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use footlight_transport::surfaces::surface::Surfaces;

/// A rectangular lamp, parallel to the floor and facing down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Along x, metres.
    pub width: f64,
    /// Along y, metres.
    pub depth: f64,
    /// Height over the floor, metres.
    pub height: f64,
}

/// Relative root mean square errors of form factors over the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// By the pixels of a hemicube.
    pub hemicube: f64,
    /// With the lamp as a point: cos² A / (π d²).
    pub point: f64,
    /// By the closed form.
    pub ours: f64,
}

/// Relative mean errors of hemicubes over many points, which remain in a sum over elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aliasing {
    /// All cubes equally oriented.
    pub aligned: f64,
    /// Each randomly rotated, as shipped.
    pub turned: f64,
}

impl Lamp {
    fn polygon(&self) -> Vec<Vec3> {
        let (a, b) = (0.5 * self.width, 0.5 * self.depth);
        [(-a, b), (a, b), (a, -b), (-a, -b)]
            .map(|(x, y)| vec3(x, y, self.height))
            .to_vec()
    }

    /// The exact form factor from a point of the floor: the signed sum of four rectangles with a
    /// corner over the point.
    pub fn exact(&self, p: Vec3) -> f64 {
        let (a, b) = (0.5 * self.width, 0.5 * self.depth);
        let over = |x: f64, y: f64| corner((x - p.x) / self.height, (y - p.y) / self.height);
        over(a, b) - over(-a, b) - over(a, -b) + over(-a, -b)
    }

    /// The lamp with a floor that reaches beyond all points.
    fn room(&self, reach: f64) -> Result<Room, TransportError> {
        let h = 2.0 * reach + self.width + self.depth;
        let floor = [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, y)| vec3(x, y, 0.0));
        let surfaces = Surfaces::new(&scene(&[floor.to_vec(), self.polygon()]))?;
        let floor = surfaces.facets.iter().position(|f| f.normal.z > 0.9);
        Ok(Room {
            floor: floor.unwrap_or(0),
            between: vec3(0.0, 0.0, 0.5 * self.height),
            surfaces,
        })
    }

    /// Errors at `count` points within `reach` of the point below the lamp's middle.
    ///
    /// # Errors
    /// Never in practice.
    pub fn seen(&self, resolution: usize, reach: f64, count: u64) -> Result<Seen, TransportError> {
        let room = self.room(reach)?;
        let points = points(reach, count);
        let closed = room.closed(&points)?;
        let cubes = room.hemicubes(&points, resolution, &hash_to_unit)?;
        let (mut square, mut errors) = (0.0, [0.0; 3]);
        for ((p, closed), cube) in points.iter().zip(closed).zip(cubes) {
            let truth = self.exact(*p);
            square += truth * truth;
            let distance = self.height * self.height + p.x * p.x + p.y * p.y;
            let area = self.width * self.depth;
            let point = area * self.height * self.height / (PI * distance * distance);
            for (error, found) in errors.iter_mut().zip([cube, point, closed]) {
                *error += (found - truth) * (found - truth);
            }
        }
        let [hemicube, point, ours] = errors.map(|e| (e / square).sqrt());
        Ok(Seen {
            hemicube,
            point,
            ours,
        })
    }

    /// Systematic and cancelling errors over many points with nearly equal form factors.
    ///
    /// # Errors
    /// Never in practice.
    pub fn aliasing(&self, resolution: usize, count: u64) -> Result<Aliasing, TransportError> {
        let reach = 0.01 * self.height;
        let room = self.room(reach)?;
        let points = points(reach, count);
        let mean = |turn: &dyn Fn(u64) -> f64| -> Result<f64, TransportError> {
            let cubes = room.hemicubes(&points, resolution, turn)?;
            let off = points
                .iter()
                .zip(cubes)
                .map(|(p, f)| f / self.exact(*p) - 1.0);
            Ok((off.sum::<f64>() / count as f64).abs())
        };
        Ok(Aliasing {
            aligned: mean(&|_| 0.0)?,
            turned: mean(&hash_to_unit)?,
        })
    }
}

/// The form factor from a point to a rectangle in a parallel plane at distance 1, one corner over
/// the point, the other at (a, b); odd in both.
fn corner(a: f64, b: f64) -> f64 {
    let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / p * (b / p).atan() + b / q * (a / q).atan()) / TAU
}

/// Pseudo-random points of the floor.
fn points(reach: f64, count: u64) -> Vec<Vec3> {
    let at = |i: u64| reach * (2.0 * hash_to_unit(i) - 1.0);
    (0..count).map(|i| vec3(at(i), at(i + 7919), 0.0)).collect()
}

/// The floor and the lamp.
struct Room {
    surfaces: Surfaces,
    /// Facet of the floor; the other one is the lamp.
    floor: usize,
    between: Vec3,
}

impl Room {
    fn setting<'a>(&'a self, hierarchy: &'a Hierarchy) -> SceneGeometry<'a> {
        SceneGeometry {
            surfaces: &self.surfaces,
            hierarchy,
        }
    }

    fn closed(&self, points: &[Vec3]) -> Result<Vec<f64>, TransportError> {
        let hierarchy = Hierarchy::new(&self.surfaces);
        let setting = self.setting(&hierarchy);
        let receiver = |point: &Vec3| Receiver {
            point: *point,
            facet: self.floor,
        };
        let receivers: Vec<Receiver> = points.iter().map(receiver).collect();
        let receivers = Receivers::new(&self.surfaces, &receivers);
        let lamp = self.surfaces.facets.get(1 - self.floor.min(1));
        let pieces = lamp.map(|f| f.pieces.clone().collect());
        let light = PreparedLight::Panel(pieces.unwrap_or_default());
        let lit = irradiance(
            setting,
            &light,
            &receivers,
            None,
            IrradiancePrecision::EXACT,
            Work::silent(),
        )?;
        Ok(lit.into_iter().map(|e| f64::from(e) / PI).collect())
    }

    fn hemicubes(
        &self,
        points: &[Vec3],
        resolution: usize,
        turn: &dyn Fn(u64) -> f64,
    ) -> Result<Vec<f64>, TransportError> {
        let mesh = mesh(&self.surfaces, 60, self.between)?;
        let (outline, table) = (
            VertexBuffer::new(&self.surfaces),
            FormFactorTable::new(resolution),
        );
        let hierarchy = Hierarchy::new(&self.surfaces);
        let mut cube = Hemicube::new(self.setting(&hierarchy), &outline, &mesh, &table);
        let mut out = Vec::new();
        for (i, p) in points.iter().enumerate() {
            let mut seen = 0.0;
            cube.visit(self.floor, *p, turn(i as u64), |element, share| {
                let facet = mesh.elements.get(element as usize).map(|e| e.facet);
                if facet.is_some_and(|f| f != self.floor) {
                    seen += f64::from(share);
                }
            });
            out.push(seen);
        }
        Ok(out)
    }
}
