//! What stands on the stage: polygons, materials, lights and cameras.
//!
//! ```text
//! OBJ, glTF --import--> Scene, lamps, cameras        Show, Scene --rig--> Rig
//! ```
//!
//! - [`Scene`] holds [`Polygon`]s and [`Material`]s. [`Shading`] varies over a polygon, a
//!   [`Texture`] over a material.
//! - [`import`] reads a stage's file, [`obj`] or [`gltf`]; [`stage_file`] holds what the readers share.
//! - [`Rig`] holds [`Light`]s and the [`Source`]s that drive them: setting `i` multiplies source `i`.
//!   [`mod@rig`] makes it of a show's lights, and reports each light that does not fit the stage
//!   ([`rig_error`]).
//! - [`photometric`] reads measured luminaires. [`gobo`] prepares the images of projections, and
//!   [`footprint`] averages them over a pixel. [`still`] reads banks that are given as images.
//!
//! Invariants:
//!
//! - Polygons are planar, simple and finite. Their vertices run counter-clockwise seen from the front.
//! - Only the front of a polygon reflects and emits. Its back is black and opaque.
//! - Coordinates are metres with Z up ([`footlight_show::geometry`]).
//! - A file that is refused leaves nothing behind. Fixed limits bound memory and time, not the counts
//!   that a file claims.
//!
//! This crate does not know light transport, cues or time. It resolves the names of lights and banks
//! to indices; the text's names stay in `footlight-show`.

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
pub use self::still::Images;
use self::texture::{Alpha, Texture};

/// A diffuse material, as shows refer to it by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the stage file.
    pub name: String,
    /// Diffuse reflectance of each channel, 0 to 1; of a texture the mean.
    pub reflectance: Rgb,
    /// Emitted radiance at unit setting (cd/m2 or W/m2/sr, as the scene has it); zero for most.
    pub emission: Rgb,
    /// What it reflects point by point, and where light passes through it.
    pub texture: Option<Texture>,
    /// What it reflects as a mirror does, over its matt reflectance; `None` where it is matt.
    pub gloss: Option<Gloss>,
}

/// Light that a surface reflects as a mirror does, sharply or spread.
#[derive(Clone, Debug, PartialEq)]
pub struct Gloss {
    /// 0 (a mirror) to 1, as glTF has it: its square is the root mean square slope of what it is made of.
    pub roughness: f64,
    /// Reflectance of light from right above, of each channel.
    pub normal: Rgb,
    /// Metals have a colour of their own, and nothing matt below.
    pub is_metal: bool,
}

impl Gloss {
    /// Reflectance from right above of varnish, water, plastic, and most of what is no metal.
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

    /// Does light pass through it somewhere?
    pub fn is_cut(&self) -> bool {
        self.alpha() != Alpha::Opaque
    }

    /// By what light passes through it somewhere; [`Alpha::Opaque`] where it does not.
    pub fn alpha(&self) -> Alpha {
        let cut = self.texture.as_ref().filter(|texture| texture.is_cut());
        cut.map_or(Alpha::Opaque, |texture| texture.alpha)
    }
}

/// A planar polygon.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    /// At least three, counter-clockwise seen from the front, metres.
    pub vertices: Arc<[Vec3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// What varies over it.
    pub shading: Option<Box<Shading>>,
}

impl Polygon {
    /// One that is shaded flat and has no texture.
    pub fn new(vertices: Vec<Vec3>, material: usize) -> Polygon {
        Polygon {
            vertices: vertices.into(),
            material,
            shading: None,
        }
    }

    /// The faces of a block between two corners: five seen from outside, without the one below, or
    /// all six seen from `within`.
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

/// All that light meets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Materials; polygons refer to them by index.
    pub materials: Vec<Material>,
    /// Surfaces.
    pub polygons: Vec<Polygon>,
    /// Haze in the air between them; `None` where the air is clear.
    pub haze: Option<Haze>,
}

/// How far a back stands behind its front, as a part of the scene's size. Surfaces nearer than
/// about 1e-6 of a distance count as one plane to the rasterizer.
const THICKNESS: f64 = 2e-5;

/// What a luminaire's own shape reflects: frosted glass and its fitting, so that an unlit lamp is no
/// black ball.
const HOUSING: f64 = 0.3;

impl Scene {
    /// Does light pass through a polygon somewhere? A material that none is of does not count.
    pub fn is_cut(&self) -> bool {
        let is_cut: Vec<bool> = self.materials.iter().map(Material::is_cut).collect();
        let mut materials = self.polygons.iter().map(|p| p.material);
        is_cut.contains(&true) && materials.any(|m| is_cut.get(m) == Some(&true))
    }

    /// Is a polygon glossy? A material that none is of does not count.
    pub fn is_glossy(&self) -> bool {
        let of = |p: &Polygon| self.materials.get(p.material);
        let mut used = self.polygons.iter().filter_map(of);
        used.any(|material| material.gloss.is_some())
    }

    /// Adds another file's materials and polygons.
    ///
    /// A material equal to one that is here already, name and all, becomes that one. One of the
    /// same name but other colours is kept apart, behind the earlier: its polygons keep its
    /// colours, and a show that asks for the name means the earlier file's.
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

    /// Area in square metres of all polygons of the material of this index.
    pub fn area(&self, material: usize) -> f64 {
        self.areas().get(material).copied().unwrap_or_default()
    }

    /// Area in square metres of all polygons of each material.
    pub fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.materials.len()];
        for polygon in &self.polygons {
            if let Some(area) = areas.get_mut(polygon.material) {
                *area += 0.5 * newell(&polygon.vertices).length();
            }
        }
        areas
    }

    /// Adds a solid of the material called `name`, made with this reflectance when there is none.
    /// What cannot be polygons adds none.
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

    /// Gives each polygon that light passes through somewhere a number of its own, which its back
    /// will share.
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

    /// Gives the polygons at these indices a back: the same outline the other way round, a hair
    /// behind.
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

    /// Adds a shape as polygons of a material of this name, behind all others, which reflects
    /// `HOUSING`; its light is the rig's.
    pub fn add_shape(&mut self, name: String, shape: &shape::Shape) {
        let material = self.materials.len();
        self.materials
            .push(Material::diffuse(name, Rgb([HOUSING; 3])));
        let polygons = shape.polygons().into_iter();
        self.polygons
            .extend(polygons.map(|vertices| Polygon::new(vertices, material)));
    }

    /// Gives every material called `name` this reflectance, a metal in its gloss; false when there is
    /// none, or when a channel is outside 0..1 (nothing is changed then).
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
            // What was cut out stays cut out.
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
    /// Where it stands.
    pub position: Vec3,
    /// Where it looks: a unit vector.
    pub direction: Vec3,
    /// Which way is up in its picture: a unit vector.
    pub up: Vec3,
    /// Vertical field of view, full angle, degrees.
    pub fov: f64,
}

/// A light of a stage's file.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Its name in the file.
    pub name: String,
    /// How it shines.
    pub shape: LampShape,
    /// Where it hangs.
    pub position: Vec3,
    /// Where it points: a unit vector.
    pub direction: Vec3,
    /// Its colour, by which `peak` is multiplied.
    pub colour: Rgb,
    /// Intensity (cd), in the axis for spots; illuminance (lx) for distant ones.
    pub peak: f64,
}

/// How a light of a stage's file shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LampShape {
    /// Equally in all directions.
    Point,
    /// Round its direction: full angles at half and at a tenth of the peak, degrees.
    Spot {
        /// At half the peak.
        beam: f64,
        /// At a tenth of the peak.
        field: f64,
    },
    /// From infinitely far, in its direction.
    Distant,
}

/// A part of a source: one light, seen through a colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Index into [`Rig::lights`].
    pub light: usize,
    /// Multiplies the light's own colour.
    pub filter: Rgb,
}

/// One coordinate of a setting: all that varies in unison with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// The coordinate's name (`lamps`, `sky.r`, `fixed`).
    pub name: String,
    /// Its parts.
    pub emitters: Vec<Emitter>,
}

/// The lights, and how settings drive them: setting `i` multiplies source `i`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// Luminaires.
    pub lights: Vec<Light>,
    /// One for each coordinate.
    pub sources: Vec<Source>,
}

impl Rig {
    /// A setting for people: the sources that are lit, by name.
    pub fn lit(&self, setting: &[f64]) -> String {
        let pairs = self.sources.iter().zip(setting);
        let lit = pairs.filter(|(_, s)| **s != 0.0);
        let words: Vec<String> = lit.map(|(o, s)| format!("{} {s}", o.name)).collect();
        words.join(", ")
    }
}

impl StageCamera {
    /// The view from it, as large as that.
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
