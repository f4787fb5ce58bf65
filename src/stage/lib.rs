//! The stage: polygons, materials, lights and cameras.
//!
//! ```text
//! OBJ, glTF --import--> Scene, lamps, cameras        Show, Scene --rig--> Rig
//! ```
//!
//! - [`Scene`] holds [`Polygon`]s and [`Material`]s. A [`Shading`] varies over a polygon, a
//!   [`Texture`] over a material.
//! - [`import`] reads a stage's file, [`obj`] or [`gltf`]; [`stage_file`] holds what the readers
//!   share.
//! - [`Rig`] holds [`Light`]s and the [`Source`]s that drive them: setting `i` multiplies source
//!   `i`. [`mod@rig`] makes it of a show's lights, and reports each light that does not fit the
//!   stage ([`rig_error`]).
//! - [`photometric`] reads measured luminaires. [`gobo`] prepares the images of projections, and
//!   [`footprint`] averages them over a pixel. [`still`] reads banks that are given as images.
//!
//! Invariants:
//!
//! - Polygons are planar, simple and finite. Their vertices run counter-clockwise seen from the
//!   front.
//! - Only the front of a polygon reflects and emits. Its back is black and opaque.
//! - Coordinates are metres with Z up ([`footlight_show::geometry`]).
//! - A refused file has no effect. Fixed limits bound memory and time, not the counts that a file
//!   claims.
//!
//! This crate does not know light transport, cues or time. It resolves the names of lights and
//! banks to indices; the text's names stay in `footlight-show`.

pub mod footprint;
pub mod gltf;
pub mod gobo;
pub mod import;
mod imported_luminaire;
mod light;
pub mod luminaire_asset;
mod merge;
pub mod obj;
pub mod photometric;
pub mod rig;
pub mod rig_error;
pub mod shading;
pub mod stage_file;
pub mod still;
pub mod texture;

use std::collections::BTreeMap;
use std::sync::Arc;

use footlight_show::geometry::{
    Vec3, View, block, diameter, newell, polygon, shape, solid, upright,
};
use footlight_show::model::Haze;
use footlight_show::units::Rgb;

pub use self::light::{Light, MeasuredLight, Projection};
pub use self::shading::Shading;
pub use self::still::StillImages;
use self::texture::{Alpha, Texture};

/// A diffuse material, as shows refer to it by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the stage file.
    pub name: String,
    /// Diffuse reflectance of each channel, 0 to 1; the mean of a texture.
    pub reflectance: Rgb,
    /// Emitted radiance at unit setting (cd/m2 or W/m2/sr, as in the scene); usually zero.
    pub emission: Rgb,
    /// Its texture: reflectance and transparency by position.
    pub texture: Option<Texture>,
    /// Specular reflection on top of the diffuse; `None` for a matt material.
    pub gloss: Option<Gloss>,
}

/// Specular reflection, sharp or spread.
#[derive(Clone, Debug, PartialEq)]
pub struct Gloss {
    /// 0 (a mirror) to 1, as in glTF: its square is the root mean square slope of the microfacets.
    pub roughness: f64,
    /// Reflectance at normal incidence, of each channel.
    pub normal: Rgb,
    /// True for metals, whose gloss is coloured and which reflect nothing diffusely.
    pub is_metal: bool,
}

impl Gloss {
    /// Reflectance at normal incidence of varnish, water, plastic, and most other dielectrics.
    pub const COMMON: f64 = 0.04;

    /// The gloss of varnish.
    pub fn varnish(roughness: f64) -> Gloss {
        Gloss {
            roughness,
            normal: Rgb([Gloss::COMMON; 3]),
            is_metal: false,
        }
    }
}

impl Material {
    /// A material that emits nothing.
    pub fn diffuse(name: impl Into<String>, reflectance: Rgb) -> Material {
        Material {
            name: name.into(),
            reflectance,
            emission: Rgb::default(),
            texture: None,
            gloss: None,
        }
    }

    /// True when it lets light through somewhere.
    pub fn is_cut(&self) -> bool {
        self.alpha() != Alpha::Opaque
    }

    /// Kind of transparency; [`Alpha::Opaque`] when it lets no light through.
    pub fn alpha(&self) -> Alpha {
        let cut = self.texture.as_ref().filter(|texture| texture.is_cut());
        cut.map_or(Alpha::Opaque, |texture| texture.alpha)
    }
}

/// A planar polygon.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    /// At least three vertices, counter-clockwise seen from the front, metres.
    pub vertices: Arc<[Vec3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Normal and texture coordinates that vary over it.
    pub shading: Option<Box<Shading>>,
}

impl Polygon {
    /// A flat-shaded polygon without a texture.
    pub fn new(vertices: Vec<Vec3>, material: usize) -> Polygon {
        Polygon {
            vertices: vertices.into(),
            material,
            shading: None,
        }
    }

    /// The faces of a box between two corners: five seen from outside, without the bottom, or all
    /// six seen from `within`.
    pub fn block(
        corners: [Vec3; 2],
        within: bool,
        material: usize,
    ) -> impl Iterator<Item = Polygon> {
        let faces = block(corners, within).into_iter();
        let polygon = move |vertices| Polygon::new(vertices, material);
        faces.take(if within { 6 } else { 5 }).map(polygon)
    }
}

/// All surfaces and the haze.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Materials; polygons refer to them by index.
    pub materials: Vec<Material>,
    /// Surfaces.
    pub polygons: Vec<Polygon>,
    /// Haze between them; `None` for clear air.
    pub haze: Option<Haze>,
}

/// Distance of a back behind its front, relative to the scene's size. The rasterizer treats
/// surfaces nearer than about 1e-6 of a distance as one plane.
const THICKNESS: f64 = 2e-5;

/// Reflectance of a luminaire's shape, frosted glass and fitting, so that an unlit lamp is no black
/// ball.
const HOUSING: f64 = 0.3;

impl Scene {
    /// True when a polygon lets light through somewhere. Unused materials do not count.
    pub fn is_cut(&self) -> bool {
        let is_cut: Vec<bool> = self.materials.iter().map(Material::is_cut).collect();
        let mut materials = self.polygons.iter().map(|p| p.material);
        is_cut.contains(&true) && materials.any(|m| is_cut.get(m) == Some(&true))
    }

    /// Gloss of each glossy polygon.
    pub fn glosses(&self) -> impl Iterator<Item = &Gloss> {
        let of = |p: &Polygon| self.materials.get(p.material)?.gloss.as_ref();
        self.polygons.iter().filter_map(of)
    }

    /// Adds another file's materials and polygons.
    ///
    /// A material equal to an existing one, name included, is merged with it. One with an existing
    /// name but other colours is kept separate, after the earlier: its polygons keep its colours,
    /// and a show that uses the name means the earlier file's.
    pub fn append(&mut self, other: Scene) {
        let mut named: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (index, material) in self.materials.iter().enumerate() {
            named.entry(material.name.clone()).or_default().push(index);
        }
        let mut indices = Vec::with_capacity(other.materials.len());
        for material in other.materials {
            let same_name = named.entry(material.name.clone()).or_default();
            let mut candidates = same_name.iter().copied();
            let equal = candidates.find(|i| self.materials.get(*i) == Some(&material));
            indices.push(equal.unwrap_or_else(|| {
                self.materials.push(material);
                same_name.push(self.materials.len() - 1);
                self.materials.len() - 1
            }));
        }
        self.polygons
            .extend(other.polygons.into_iter().filter_map(|polygon| {
                let material = *indices.get(polygon.material)?;
                Some(Polygon {
                    material,
                    ..polygon
                })
            }));
    }

    /// Total area of the polygons of this material, m².
    pub fn area(&self, material: usize) -> f64 {
        self.areas().get(material).copied().unwrap_or_default()
    }

    /// Total area of the polygons of each material, m².
    pub fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.materials.len()];
        for polygon in &self.polygons {
            if let Some(area) = areas.get_mut(polygon.material) {
                *area += 0.5 * newell(&polygon.vertices).length();
            }
        }
        areas
    }

    /// Adds a solid of the material `name`, created with this reflectance if missing. A solid that
    /// has no polygons adds none.
    pub fn add_solid(&mut self, name: &str, reflectance: Rgb, solid: &solid::Solid) {
        let known = self.materials.iter().position(|m| m.name == name);
        let material = known.unwrap_or(self.materials.len());
        if known.is_none() {
            self.materials.push(Material::diffuse(name, reflectance));
        }
        for vertices in solid.polygons().unwrap_or_default() {
            let point = vertices.first().copied().unwrap_or_default();
            let plane = (point, polygon::doubled_area(&vertices).normalized());
            self.polygons.push(Polygon {
                shading: Shading::of_solid(solid, plane).map(Box::new),
                ..Polygon::new(vertices, material)
            });
        }
    }

    /// Numbers each polygon that lets light through somewhere; its back will share the number.
    pub fn number_sheets(&mut self) {
        let cut: Vec<bool> = self.materials.iter().map(Material::is_cut).collect();
        let is_cut = |p: &Polygon| cut.get(p.material) == Some(&true);
        let polygons = self.polygons.iter_mut().filter(|p| is_cut(p));
        for (number, polygon) in (1..).zip(polygons) {
            let origin = polygon.vertices.first().copied().unwrap_or_default();
            let flat = || Box::new(Shading::flat(origin));
            polygon.shading.get_or_insert_with(flat).sheet = number;
        }
    }

    /// Gives these polygons a back: the reversed outline, a hair behind.
    pub fn add_backs(&mut self, fronts: &[usize]) {
        let corners = self.polygons.iter().flat_map(|p| p.vertices.iter());
        let thickness = diameter(corners) * THICKNESS;
        for index in fronts {
            let Some(front) = self.polygons.get(*index) else {
                continue;
            };
            let normal = polygon::doubled_area(&front.vertices).normalized();
            let behind = front.vertices.iter().rev().map(|v| *v - normal * thickness);
            let back = Polygon {
                vertices: behind.collect(),
                material: front.material,
                shading: front.shading.as_ref().map(|s| Box::new(s.of_back())),
            };
            self.polygons.push(back);
        }
    }

    /// Adds a shape as polygons of a new material `name` with the reflectance `HOUSING`; the rig
    /// drives its light.
    pub fn add_shape(&mut self, name: String, shape: &shape::Shape) {
        let material = self.materials.len();
        self.materials
            .push(Material::diffuse(name, Rgb([HOUSING; 3])));
        let polygons = shape.polygons().into_iter();
        self.polygons
            .extend(polygons.map(|vertices| Polygon::new(vertices, material)));
    }

    /// Sets the reflectance of every material called `name`; for a metal, that of its gloss.
    /// Returns false, without a change, when there is no such material or a channel is outside
    /// 0..1.
    pub fn set_reflectance(&mut self, name: &str, rgb: Rgb) -> bool {
        if !rgb.0.iter().all(|c| (0.0..=1.0).contains(c)) {
            return false;
        }
        let mut found = false;
        for material in self.materials.iter_mut().filter(|m| m.name == name) {
            found = true;
            if let Some(metal) = material.gloss.as_mut().filter(|gloss| gloss.is_metal) {
                metal.normal = rgb;
                continue;
            }
            material.reflectance = rgb;
            // Cut-outs stay.
            material.texture = material
                .texture
                .take()
                .filter(Texture::is_cut)
                .map(|t| t.painted(rgb));
        }
        found
    }
}

/// A camera of a stage's file.
#[derive(Clone, Debug, PartialEq)]
pub struct StageCamera {
    /// Its name in the file.
    pub name: String,
    /// Its position.
    pub position: Vec3,
    /// Viewing direction: a unit vector.
    pub direction: Vec3,
    /// Up direction of the image: a unit vector.
    pub up: Vec3,
    /// Vertical field of view, full angle, degrees.
    pub fov: f64,
}

/// A light of a stage's file.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Its name in the file.
    pub name: String,
    /// Its distribution.
    pub shape: LampShape,
    /// Its position.
    pub position: Vec3,
    /// Its direction: a unit vector.
    pub direction: Vec3,
    /// Its colour, by which `peak` is multiplied.
    pub colour: Rgb,
    /// Intensity (cd), on the axis for spots; illuminance (lx) for distant ones.
    pub peak: f64,
}

/// Distribution of a light of a stage's file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LampShape {
    /// Equally in all directions.
    Point,
    /// Around its direction: full angles at half and at a tenth of the peak, degrees.
    Spot {
        /// At half the peak.
        beam: f64,
        /// At a tenth of the peak.
        field: f64,
    },
    /// Parallel light from infinity, in its direction.
    Distant,
}

/// A part of a source: one light, seen through a colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Index into [`Rig::lights`].
    pub light: usize,
    /// Multiplies the light's own colour: white, one channel of an rgb bank, or the level of a fixed
    /// light. Gel and colour temperature are in the light.
    pub filter: Rgb,
}

/// One coordinate of a setting: all lights that vary in unison with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// The coordinate's name (`lamps`, `sky.r`, `fixed`).
    pub name: String,
    /// Its emitters.
    pub emitters: Vec<Emitter>,
}

/// The lights and the sources that drive them: setting `i` multiplies source `i`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// Luminaires.
    pub lights: Vec<Light>,
    /// One for each coordinate.
    pub sources: Vec<Source>,
}

impl Rig {
    /// Names of the lit sources, for messages.
    pub fn lit(&self, setting: &[f64]) -> String {
        let pairs = self.sources.iter().zip(setting);
        let lit = pairs.filter(|(_, s)| **s != 0.0);
        let words: Vec<String> = lit.map(|(o, s)| format!("{} {s}", o.name)).collect();
        words.join(", ")
    }
}

impl StageCamera {
    /// The view from this camera, with this size.
    pub fn view(&self, [width, height]: [usize; 2]) -> View {
        let [right, up] = upright(self.direction);
        View {
            from: self.position,
            to: self.position + self.direction,
            fov: self.fov,
            roll: self.up.dot(right).atan2(self.up.dot(up)).to_degrees(),
            width,
            height,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_show::geometry::vec3;

    #[test]
    fn a_camera_becomes_a_view_with_its_axes() {
        let [right, up] = upright(vec3(0.6, 0.0, 0.8));
        let (s, c) = 0.7_f64.sin_cos();
        let camera = StageCamera {
            name: String::new(),
            position: vec3(1.0, 2.0, 3.0),
            direction: vec3(0.6, 0.0, 0.8),
            up: up * c + right * s,
            fov: 30.0,
        };
        let view = camera.view([4, 3]);
        assert!((view.roll.to_radians() - 0.7).abs() < 1e-12);
        let found = view.axes();
        let wanted = [right * c - up * s, camera.up, camera.direction];
        let off = found.iter().zip(wanted).map(|(a, b)| (*a - b).length());
        assert!(off.fold(0.0, f64::max) < 1e-12);
    }
}
