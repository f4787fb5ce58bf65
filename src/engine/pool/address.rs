//! Content addresses of images: equal addresses, equal images.
//!
//! An image depends on scene, view, quality and the lit lights, each by its strength in three
//! channels; names of lights and banks, and dark lights, do not matter. Every type is destructured
//! field by field, so that a new field does not compile until it is part of the address. Addresses
//! are stable over compilers and machines: SHA-256 over little-endian bits.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_show::geometry::View;
use footlight_show::geometry::mount::Mount;
use footlight_show::model::{Haze, Spot};
use footlight_show::units::Rgb;
use footlight_stage::photometric::{Distribution, Parts, Symmetry};
use footlight_stage::texture::{Alpha, Texture, Wrap};
use footlight_stage::{
    Emitter, Gloss, Light, Material, MeasuredLight, Polygon, Projection, Rig, Scene, Shading,
    Source,
};
use footlight_transport::Quality;

/// Version of the addresses, raised when their definition changes.
const SCHEME: &str = "footlight address 2";

/// The first half of a SHA-256, written as 32 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Digest([u8; 16]);

impl From<Digest> for String {
    fn from(digest: Digest) -> String {
        digest.to_string()
    }
}

impl TryFrom<String> for Digest {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Digest, &'static str> {
        Digest::parse(&text).ok_or("not 32 hexadecimal digits")
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl Digest {
    /// Parses the output of `Display`.
    pub fn parse(text: &str) -> Option<Digest> {
        if text.len() != 32 || !text.bytes().all(|b| b.is_ascii_hexdigit()) {
            return None;
        }
        let number = u128::from_str_radix(text, 16).ok()?;
        Some(Digest(number.to_be_bytes()))
    }
}

/// A SHA-256 fed with typed values.
pub(super) struct Hasher(Sha256);

impl Hasher {
    pub fn new(purpose: &str) -> Hasher {
        let mut hasher = Hasher(Sha256::new());
        hasher.text(SCHEME);
        hasher.text(purpose);
        hasher
    }

    pub fn bytes(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    pub fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    pub fn text(&mut self, text: &str) {
        self.count(text.len());
        self.bytes(text.as_bytes());
    }

    fn number(&mut self, number: f64) {
        self.bytes(&number.to_bits().to_le_bytes());
    }

    fn numbers(&mut self, numbers: [f64; 3]) {
        numbers.into_iter().for_each(|x| self.number(x));
    }

    /// Adds a list of numbers.
    fn list(&mut self, numbers: &[f64]) {
        self.count(numbers.len());
        numbers.iter().for_each(|x| self.number(*x));
    }

    fn digest(&mut self, digest: Digest) {
        self.bytes(&digest.0);
    }

    fn point(&mut self, point: Vec3) {
        self.numbers([point.x, point.y, point.z]);
    }

    /// Adds an image's size and numbers, in blocks for the hash.
    pub fn image(&mut self, image: &Image) {
        self.count(image.width());
        self.count(image.height());
        let mut block = Vec::with_capacity(1 << 16);
        for part in image.data().chunks(1 << 14) {
            block.clear();
            block.extend(part.iter().flat_map(|x| x.to_le_bytes()));
            self.bytes(&block);
        }
    }

    pub fn finish(self) -> Digest {
        let whole = self.0.finalize();
        let mut half = [0; 16];
        half.iter_mut().zip(whole).for_each(|(to, from)| *to = from);
        Digest(half)
    }
}

/// Operator, scene and view, which group images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct SceneKey(pub Digest);

impl SceneKey {
    /// Creates a key; `results` is name and version of the operator's images.
    pub fn new(results: &str, scene: &Scene, view: &View) -> SceneKey {
        let mut hasher = Hasher::new("ground");
        hasher.text(env!("CARGO_PKG_VERSION"));
        hasher.text(results);
        add_scene(&mut hasher, scene);
        let View {
            from,
            to,
            fov,
            roll,
            width,
            height,
        } = view;
        hasher.point(*from);
        hasher.point(*to);
        hasher.number(*fov);
        hasher.number(*roll);
        hasher.count(*width);
        hasher.count(*height);
        SceneKey(hasher.finish())
    }
}

fn add_scene(hasher: &mut Hasher, scene: &Scene) {
    let Scene {
        materials,
        polygons,
        haze,
    } = scene;
    if let Some(Haze {
        extinction,
        forward,
        albedo,
    }) = haze
    {
        hasher.text("haze");
        hasher.numbers([*extinction, *forward, *albedo]);
    }
    hasher.count(materials.len());
    for material in materials {
        let Material {
            name,
            reflectance,
            emission,
            texture,
            gloss,
        } = material;
        hasher.text(name);
        hasher.numbers(reflectance.0);
        hasher.numbers(emission.0);
        if let Some(Gloss {
            roughness,
            normal,
            is_metal,
        }) = gloss
        {
            hasher.text("gloss");
            hasher.numbers([*roughness, f64::from(u8::from(*is_metal)), 0.0]);
            hasher.numbers(normal.0);
        }
        if let Some(texture) = texture {
            add_texture(hasher, texture);
        }
    }
    hasher.count(polygons.len());
    for polygon in polygons {
        let Polygon {
            vertices,
            material,
            shading,
        } = polygon;
        hasher.count(*material);
        hasher.count(vertices.len());
        vertices.iter().for_each(|v| hasher.point(*v));
        if let Some(shading) = shading {
            add_shading(hasher, shading);
        }
    }
}

fn add_texture(hasher: &mut Hasher, texture: &Texture) {
    let Texture {
        pixels,
        factor,
        wrap,
        alpha,
        paint,
    } = texture;
    hasher.text("texture");
    hasher.bytes(&pixels.digest);
    hasher.list(factor);
    for wrap in wrap {
        hasher.text(match wrap {
            Wrap::Repeat => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Clamp => "clamp",
        });
    }
    match alpha {
        Alpha::Opaque => hasher.text("opaque"),
        Alpha::Mask(least) => hasher.list(&[*least]),
        Alpha::Blend => hasher.text("blend"),
    }
    hasher.list(paint.as_ref().map_or(&[], |p| p.as_slice()));
}

fn add_shading(hasher: &mut Hasher, shading: &Shading) {
    let Shading {
        origin,
        normal,
        place,
        sheet,
    } = shading;
    hasher.text("shading");
    hasher.point(*origin);
    hasher.count(normal.map_or(0, |n| n.len()));
    normal.iter().flatten().for_each(|v| hasher.point(*v));
    hasher.count(place.map_or(0, |p| p.len()));
    for (value, gradient) in place.iter().flatten() {
        hasher.number(*value);
        hasher.point(*gradient);
    }
    hasher.count(*sheet as usize);
}

fn add_mount(hasher: &mut Hasher, mount: &Mount) {
    let Mount {
        position,
        aim,
        turn,
    } = mount;
    hasher.point(*position);
    hasher.point(*aim);
    hasher.number(*turn);
}

fn add_distribution(hasher: &mut Hasher, distribution: &Distribution) {
    let Parts {
        vertical,
        horizontal,
        symmetry,
        candela,
        lamp_lumens,
    } = distribution.parts();
    hasher.list(vertical);
    hasher.list(horizontal);
    hasher.text(match symmetry {
        Symmetry::Round => "round",
        Symmetry::Quadrant => "quadrant",
        Symmetry::Half => "half",
        Symmetry::Across => "across",
        Symmetry::None => "none",
    });
    hasher.list(candela);
    hasher.list(lamp_lumens.as_slice());
}

/// A light's shape, without strength, and its colour.
fn apart(light: &Light) -> (Digest, Rgb) {
    let mut hasher = Hasher::new("light");
    let colour = match light {
        Light::Panel { material, radiance } => {
            hasher.text("panel");
            hasher.count(*material);
            *radiance
        }
        Light::Spot(Spot {
            position,
            aim,
            beam,
            field,
            intensity,
        }) => {
            hasher.text("spot");
            hasher.point(*position);
            hasher.point(*aim);
            hasher.number(*beam);
            hasher.number(*field);
            *intensity
        }
        Light::Measured(MeasuredLight {
            mount,
            distribution,
            factor,
        }) => {
            hasher.text("measured");
            add_mount(&mut hasher, mount);
            add_distribution(&mut hasher, distribution);
            *factor
        }
        Light::Projection(Projection {
            mount,
            field,
            gobo,
            plane,
            intensity,
        }) => {
            hasher.text("projection");
            add_mount(&mut hasher, mount);
            hasher.number(*field);
            gobo.image().into_iter().for_each(|i| hasher.image(i));
            hasher.count(*plane);
            *intensity
        }
        Light::Bounced(light) => {
            let (shape, colour) = apart(light);
            hasher.text("bounced");
            hasher.digest(shape);
            colour
        }
        Light::Image(image) => {
            hasher.text("image");
            hasher.image(image);
            Rgb::WHITE
        }
    };
    (hasher.finish(), colour)
}

/// The lit lights, by shape, with their strength in each channel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Bits", into = "Bits")]
pub struct Lighting {
    lit: BTreeMap<Digest, [f64; 3]>,
}

impl Lighting {
    /// From pairs of shape and strength; strengths of one shape add up, and lights that cancel are
    /// dark.
    pub fn new(lit: impl IntoIterator<Item = (Digest, [f64; 3])>) -> Lighting {
        let mut out: BTreeMap<Digest, [f64; 3]> = BTreeMap::new();
        for (shape, strength) in lit {
            let sum = out.entry(shape).or_default();
            sum.iter_mut().zip(strength).for_each(|(a, b)| *a += b);
        }
        out.retain(|_, strength| *strength != [0.0; 3]);
        Lighting { lit: out }
    }

    /// Shapes and strengths, sorted by shape.
    pub fn lit(&self) -> &BTreeMap<Digest, [f64; 3]> {
        &self.lit
    }
}

/// Shapes and the bits of their strengths, which JSON preserves.
type Bits = Vec<(Digest, [u64; 3])>;

impl From<Lighting> for Bits {
    fn from(lighting: Lighting) -> Bits {
        let lit = lighting.lit.into_iter();
        lit.map(|(shape, strength)| (shape, strength.map(f64::to_bits)))
            .collect()
    }
}

impl From<Bits> for Lighting {
    fn from(bits: Bits) -> Lighting {
        let lit = bits.into_iter();
        Lighting::new(lit.map(|(shape, strength)| (shape, strength.map(f64::from_bits))))
    }
}

/// Content of one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Address {
    /// Operator, scene and view.
    pub scene_key: SceneKey,
    /// Quality step.
    pub quality: Quality,
    /// The lit lights.
    pub lighting: Lighting,
    /// Hash of the above and of the order in which the operator adds lights: sums in another order
    /// may differ in their last bits.
    pub key: Digest,
}

/// Identity of an image in a store.
pub type Name = (SceneKey, Quality, Digest);

impl Address {
    /// The image's name.
    pub fn name(&self) -> Name {
        (self.scene_key, self.quality, self.key)
    }
}

/// A rig in the terms of addresses.
#[derive(Clone, Debug)]
pub struct Lights {
    shapes: Vec<Digest>,
    /// For each source its lights and their strengths at unit setting.
    sources: Vec<Vec<(usize, [f64; 3])>>,
}

impl Lights {
    /// Extracts the lights of a rig. Emitters with an invalid light are skipped; operators refuse
    /// such rigs.
    pub fn new(rig: &Rig) -> Lights {
        let Rig { lights, sources } = rig;
        let (shapes, colours): (Vec<Digest>, Vec<Rgb>) = lights.iter().map(apart).unzip();
        let strength = |emitter: &Emitter| {
            let Emitter { light, filter } = emitter;
            let Rgb([r, g, b]) = *colours.get(*light)?;
            let [fr, fg, fb] = filter.0;
            Some((*light, [fr * r, fg * g, fb * b]))
        };
        let of_source = |source: &Source| source.emitters.iter().filter_map(strength).collect();
        Lights {
            sources: sources.iter().map(of_source).collect(),
            shapes,
        }
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        self.sources.len()
    }

    /// Strength of each light, in the rig's order, under a setting.
    fn strengths(&self, setting: &[f64]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.shapes.len()];
        for (source, s) in self.sources.iter().zip(setting) {
            for (light, unit) in source {
                if let Some(sum) = out.get_mut(*light) {
                    sum.iter_mut().zip(unit).for_each(|(a, b)| *a += s * b);
                }
            }
        }
        out
    }

    /// The lit lights under a setting.
    pub fn lighting(&self, setting: &[f64]) -> Lighting {
        let strengths = self.strengths(setting);
        Lighting::new(self.shapes.iter().copied().zip(strengths))
    }

    /// The address of the image of a setting.
    pub fn address(&self, scene_key: SceneKey, quality: Quality, setting: &[f64]) -> Address {
        let mut hasher = Hasher::new("picture");
        hasher.digest(scene_key.0);
        hasher.bytes(&[quality.0]);
        let strengths = self.strengths(setting);
        for (shape, strength) in self.shapes.iter().zip(&strengths) {
            if *strength != [0.0; 3] {
                hasher.digest(*shape);
                hasher.numbers(*strength);
            }
        }
        Address {
            scene_key,
            quality,
            lighting: Lighting::new(self.shapes.iter().copied().zip(strengths)),
            key: hasher.finish(),
        }
    }

    /// True when every lit light belongs to this rig.
    pub fn has_all(&self, lighting: &Lighting) -> bool {
        lighting.lit.keys().all(|shape| self.shapes.contains(shape))
    }
}

#[cfg(test)]
#[path = "address_test.rs"]
mod tests;
