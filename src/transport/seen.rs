//! The surface that a view shows at a point, from which its image tells the illuminance.

use crate::direct::projector::pixel as footprint;
use crate::gather::bvh::Bvh;
use crate::gather::ray_scene::{DARK, RayScene, SurfacePoint};
use crate::surfaces::camera::{Camera, camera};
use crate::surfaces::surface::Surfaces;
use crate::{Setup, TransportError};
use footlight_host::work::{Cancelled, Work, in_order};
use footlight_show::geometry::Vec3;
use footlight_stage::Light;

/// Distance within which a visible surface counts as the one at a point, metres.
const NEAR: f64 = 0.05;
/// Least reflectance: darker surfaces reflect too little of the incident light.
const DARKEST: f64 = 0.01;
/// Offset of the rays' start from surfaces, relative to the scene.
const OFFSET: f64 = 1e-6;

/// A visible matt surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenSurface {
    /// Index of the pixel, row by row from the top.
    pub pixel: usize,
    /// Reflectance of each channel.
    pub reflectance: [f64; 3],
}

/// Reason for which the image gives no illuminance at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Hidden {
    /// The point lies outside the image.
    #[error("lies outside the view")]
    Outside,
    /// No visible surface is at the point.
    #[error(
        "lies on no surface that the view shows: something stands before it, or it is in the air"
    )]
    NoSurface,
    /// Its pixel shows more than one surface.
    #[error("lies at an edge: take a point further inside the surface")]
    Edge,
    /// It is a lamp, glossy, or translucent.
    #[error(
        "lies on a lamp, a glossy surface, or what lets light through: its brightness is not what falls on it"
    )]
    OwnLight,
    /// Its reflectance is nearly zero.
    #[error("lies on a black surface, which does not show how much light falls on it")]
    Black,
}

/// The surfaces that the setup's view shows at the given points. A ray from the eye through a point
/// must end within 5 cm of it, and rays through the corners of its pixel on the same plane.
///
/// # Errors
/// [`TransportError`] for an unusable scene or view, and on cancel.
pub fn seen(
    setup: &Setup,
    points: &[Vec3],
    work: Work<'_>,
) -> Result<Vec<Result<SeenSurface, Hidden>>, TransportError> {
    if points.is_empty() {
        return Ok(Vec::new());
    }
    let surfaces = Surfaces::new(&setup.scene)?;
    let bvh = Bvh::new(&surfaces, work)?;
    let eye = Eye::new(setup, &surfaces, &bvh)?;
    let (camera, [width, height]) = (
        &eye.camera,
        [setup.view.width as f64, setup.view.height as f64],
    );
    let at = |point: &Vec3| {
        let way = *point - camera.origin;
        let depth = way.dot(camera.forward);
        let x = (way.dot(camera.right) / depth - camera.left) / camera.step_x;
        let y = (camera.top - way.dot(camera.up) / depth) / camera.step_y;
        if !(depth > 0.0 && (0.0..width).contains(&x) && (0.0..height).contains(&y)) {
            return Err(Hidden::Outside);
        }
        let (place, _) = eye.scene.look(camera.origin, way);
        let facet = surfaces.facets.get(place.facet as usize);
        let near = place.facet != DARK && (place.point - *point).length() <= NEAR;
        let facet = facet.filter(|_| near).ok_or(Hidden::NoSurface)?;
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let on_plane = |(dx, dy): (f64, f64)| {
            let (other, far) = eye.look(x.floor() + dx, y.floor() + dy);
            let own = surfaces.facets.get(other.facet as usize);
            own.is_some_and(|own| own.material == facet.material)
                && facet.height(other.point).abs() <= 1e-3 * far
        };
        let reflectance = eye.reflectance(place);
        if reflectance != Err(Hidden::OwnLight) && !corners.into_iter().all(on_plane) {
            return Err(Hidden::Edge);
        }
        let pixel = y as usize * setup.view.width + x as usize;
        reflectance.map(|reflectance| SeenSurface { pixel, reflectance })
    };
    Ok(points.iter().map(at).collect())
}

/// The reflectance that each pixel of the setup's view shows, row by row from the top; `None` where the pixel
/// shows no matt surface, a black one, or more than one material.
///
/// # Errors
/// Like [`seen`].
pub fn reflectances(
    setup: &Setup,
    work: Work<'_>,
) -> Result<Vec<Option<[f64; 3]>>, TransportError> {
    let surfaces = Surfaces::new(&setup.scene)?;
    let bvh = Bvh::new(&surfaces, work)?;
    let eye = Eye::new(setup, &surfaces, &bvh)?;
    let (columns, rows) = (setup.view.width, setup.view.height);
    let corners = |y: usize| -> Vec<Option<usize>> {
        let corner = |x: usize| eye.material(eye.look(x as f64, y as f64).0);
        (0..=columns).map(corner).collect()
    };
    let row = |y: &usize| -> Result<Vec<Option<[f64; 3]>>, Cancelled> {
        work.check()?;
        let (above, below) = (corners(*y), corners(*y + 1));
        let corners = above.windows(2).zip(below.windows(2));
        let pixels = corners.enumerate().map(|(x, (above, below))| {
            let (place, _) = eye.look(x as f64 + 0.5, *y as f64 + 0.5);
            let own = eye.material(place)?;
            let is_one = above.iter().chain(below).all(|other| *other == Some(own));
            eye.reflectance(place).ok().filter(|_| is_one)
        });
        Ok(pixels.collect())
    };
    let found = in_order(&(0..rows).collect::<Vec<usize>>(), work.threads, row);
    let found: Result<Vec<Vec<_>>, Cancelled> = found.into_iter().collect();
    Ok(found?.concat())
}

/// The camera of a view, with the surfaces.
struct Eye<'a> {
    setup: &'a Setup,
    camera: Camera,
    scene: RayScene<'a>,
}

impl<'a> Eye<'a> {
    fn new(
        setup: &'a Setup,
        surfaces: &'a Surfaces,
        bvh: &'a Bvh,
    ) -> Result<Eye<'a>, TransportError> {
        let camera = camera(&setup.view)?;
        let scene = RayScene {
            surfaces,
            bvh,
            offset: surfaces.size * OFFSET,
        };
        Ok(Eye {
            setup,
            camera,
            scene,
        })
    }

    /// The surface at a place of the image, in pixels, and its distance.
    fn look(&self, x: f64, y: f64) -> (SurfacePoint, f64) {
        self.scene.look(self.camera.origin, self.camera.ray(x, y))
    }

    fn material(&self, place: SurfacePoint) -> Option<usize> {
        let facet = self.scene.surfaces.facets.get(place.facet as usize);
        facet.map(|facet| facet.material)
    }

    /// The reflectance of a matt surface.
    fn reflectance(&self, place: SurfacePoint) -> Result<[f64; 3], Hidden> {
        let surfaces = self.scene.surfaces;
        let facet = surfaces.facets.get(place.facet as usize);
        let facet = facet.ok_or(Hidden::NoSurface)?;
        let emits =
            |l: &Light| matches!(l, Light::Panel { material: m, .. } if *m == facet.material);
        let is_glossy = surfaces.lobe(place.facet).is_some();
        let is_lamp = self.setup.rig.lights.iter().any(emits);
        if is_lamp || surfaces.is_sheet(place.facet) || is_glossy {
            return Err(Hidden::OwnLight);
        }
        let sides = || footprint(&self.camera, place.point, facet.normal, 1.0);
        let reflectance = surfaces.reflectance_at(facet, place.point, sides);
        if reflectance.iter().any(|r| *r < DARKEST) {
            return Err(Hidden::Black);
        }
        Ok(reflectance)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use footlight_show::geometry::{View, vec3};
    use footlight_show::units::Rgb;
    use footlight_stage::{Material, Polygon, Rig, Scene};

    /// Adjacent squares seen from above: grey, black, and a lamp; a plate half a metre over the
    /// grey square's corner.
    #[test]
    fn a_point_is_seen_on_a_plain_surface_alone() {
        let square = |x: f64, z: f64, side: f64, material| {
            let at = |dx: f64, dy: f64| vec3(x + side * dx, side * dy, z);
            Polygon::new(
                vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
                material,
            )
        };
        let paint = |name, reflectance| Material::diffuse(name, Rgb([reflectance; 3]));
        let scene = Scene {
            materials: vec![paint("grey", 0.5), paint("black", 0.0), paint("lamp", 0.5)],
            polygons: vec![
                square(0.0, 0.0, 1.0, 0),
                square(1.0, 0.0, 1.0, 1),
                square(2.0, 0.0, 1.0, 2),
                square(0.0, 0.5, 0.2, 0),
            ],
            ..Scene::default()
        };
        let light = Light::Panel {
            material: 2,
            radiance: Rgb([1.0; 3]),
        };
        let rig = Rig {
            lights: vec![light],
            ..Rig::default()
        };
        let view = View {
            from: vec3(1.5, 0.49, 6.0),
            to: vec3(1.5, 0.5, 0.0),
            fov: 40.0,
            roll: 0.0,
            width: 64,
            height: 48,
        };
        let points = [
            (0.5, 0.5, 0.0),
            (0.5, 0.5, 0.04),
            (0.5, 0.5, 0.06),
            (0.05, 0.1, 0.0),
            (0.1, 0.1, 0.5),
            (1.5, 0.5, 0.0),
            (2.5, 0.5, 0.0),
            (0.02, 0.7, 0.0),
            (9.0, 0.5, 0.0),
            (1.5, 0.5, 7.0),
        ];
        let places: Vec<Vec3> = points.iter().map(|(x, y, z)| vec3(*x, *y, *z)).collect();
        let found = seen(&Setup::new(scene, rig, view), &places, Work::silent()).unwrap();
        let reflectance = |found: &Result<SeenSurface, Hidden>| found.map(|seen| seen.reflectance);
        let found: Vec<_> = found.iter().map(reflectance).collect();
        let grey = Ok([0.5; 3]);
        use Hidden::{Black, Edge, NoSurface, Outside, OwnLight};
        let expected = [
            grey,
            grey,
            Err(NoSurface),
            Err(NoSurface),
            grey,
            Err(Black),
            Err(OwnLight),
            Err(Edge),
            Err(Outside),
            Err(Outside),
        ];
        assert_eq!(found, expected);
    }
}
