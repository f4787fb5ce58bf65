//! Materials: names, diffuse reflectance with its textures, gloss, emitted luminance.

use std::collections::{BTreeMap, BTreeSet};

use gltf_json::Material as Described;
use gltf_json::extensions::texture::TextureTransform;
use gltf_json::material::AlphaMode;
use gltf_json::texture::{Info, WrappingMode};
use gltf_json::validation::Checked;

use super::container::Document;
use super::description::Root;
use super::{Fault, LeftOut, outside, place};
use crate::stage_file::{Finish, UNSTATED, reflectance};
use crate::texture::reader::{Channels, TextureReader};
use crate::texture::{Alpha, Texture, Wrap};
use crate::{Gloss, Material};
use footlight_host::files::Files;
use footlight_show::units::Rgb;

/// Factor that replaces an unreadable texture. Surface images average about a half, whereas the
/// material's own factor is usually one, at which a closed room would never get dark.
const UNREAD: f64 = 0.5;

/// The materials of a file; the last is for primitives without one.
pub struct Materials {
    pub materials: Vec<Material>,
    pub double_sided: Vec<bool>,
    /// Texture coordinates of each textured material.
    pub places: Vec<Option<Places>>,
    /// Faults of materials: only primitives that use them are refused.
    pub faults: BTreeMap<usize, Fault>,
    pub left_out: LeftOut,
}

/// A texture coordinate set and its transform (KHR_texture_transform).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Places {
    /// Number of the TEXCOORD attribute.
    pub set: u32,
    rows: [[f64; 3]; 2],
}

impl Places {
    fn of(info: &Info) -> Places {
        let extensions = info.extensions.as_ref();
        let default = TextureTransform::default();
        let moved = extensions.and_then(|e| e.texture_transform.as_ref());
        let set = moved.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        let TextureTransform {
            offset,
            rotation,
            scale,
            ..
        } = moved.unwrap_or(&default);
        let ([x, y], [u, v]) = (offset.0.map(f64::from), scale.0.map(f64::from));
        let (sine, cosine) = f64::from(rotation.0).sin_cos();
        Places {
            set,
            rows: [[cosine * u, sine * v, x], [-sine * u, cosine * v, y]],
        }
    }

    /// Transforms a texture coordinate.
    pub fn moved(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.rows.map(|[a, b, c]| a * u + b * v + c)
    }
}

/// All materials, used or not, because a show may name them; `matt` leaves out their gloss.
pub fn all(
    files: &dyn Files,
    document: &Document<'_>,
    textures: &mut TextureReader,
    matt: bool,
) -> Materials {
    let root = &document.root;
    let mut out = Materials {
        materials: Vec::new(),
        double_sided: Vec::new(),
        places: Vec::new(),
        faults: BTreeMap::new(),
        left_out: BTreeSet::new(),
    };
    let mut names = Names::of(root);
    for (i, described) in root.materials.iter().enumerate() {
        let name = names.next(described.name.as_deref(), &format!("material.{i}"));
        let base = Base::of(described).unwrap_or_else(|reason| {
            let at = place("material", i, described.name.as_ref());
            out.faults.insert(i, Fault::new(at, reason));
            Base::default()
        });
        let channels = channels(described);
        let read = |info: &Info| image(files, document, textures, channels, info);
        let image = base.texture.map(read).transpose();
        let image = image.unwrap_or_else(|reason| {
            out.left_out.insert(format!(
                "the texture of `{name}`: {reason}; it reflects half of its factor, and \
                 `surface` can say more"
            ));
            None
        });
        let unread = base.texture.is_some() && image.is_none();
        let [r, g, b, a] = base.factor;
        let share = if unread { UNREAD } else { 1.0 };
        let mut material = Material {
            emission: base.emission,
            ..Material::diffuse(name, Rgb([r, g, b].map(|c| c * share)))
        };
        if described.emissive_texture.is_some() && material.emission != Rgb([0.0; 3]) {
            out.left_out.insert(format!(
                "the emission texture of `{}`: as a `panel` it shines evenly, by its factor",
                material.name
            ));
        }
        let alpha = alpha(described);
        // A cut-out sheet is thin: without a back, leaves and gauze would be black from behind.
        let is_cut_out = image.is_some() && alpha != Alpha::Opaque;
        if let Some(image) = image {
            let texture = Texture {
                factor: base.factor,
                alpha,
                ..image
            };
            material.reflectance = Rgb(texture.mean_reflectance());
            material.texture = Some(texture);
        } else if a < 1.0 && alpha != Alpha::Opaque {
            material.texture = Some(Texture::plain([r * share, g * share, b * share, a], alpha));
        }
        out.places
            .push(material.texture.as_ref().and(base.texture).map(Places::of));
        let mean = |info: &Info| mean(files, document, textures, info);
        let gloss = (!matt && !is_unlit(described)).then(|| finish(described, mean));
        match gloss.transpose() {
            Ok(finish) => finish.into_iter().for_each(|f| material.polish(f)),
            Err(reason) => {
                let name = &material.name;
                out.left_out
                    .insert(format!("the gloss of `{name}`: {reason}; it is matt"));
            }
        }
        out.materials.push(material);
        out.double_sided.push(described.double_sided || is_cut_out);
    }
    out.materials.push(Material::diffuse(
        names.next(None, "default"),
        Rgb([UNSTATED; 3]),
    ));
    out.double_sided.push(false);
    out.places.push(None);
    out
}

/// Diffuse colour with its texture, in either material model, and emitted luminance.
#[derive(Default)]
struct Base<'d> {
    factor: [f64; 4],
    texture: Option<&'d Info>,
    emission: Rgb,
}

impl Base<'_> {
    fn of(described: &Described) -> Result<Base<'_>, String> {
        let extensions = described.extensions.as_ref();
        let glossy = extensions.and_then(|e| e.pbr_specular_glossiness.as_ref());
        let metallic = &described.pbr_metallic_roughness;
        let (factor, texture) = match glossy {
            Some(glossy) => (glossy.diffuse_factor.0, glossy.diffuse_texture.as_ref()),
            None => (
                metallic.base_color_factor.0,
                metallic.base_color_texture.as_ref(),
            ),
        };
        let mut factor = factor.map(f64::from);
        // Transmitted light is not stopped.
        let [.., stopped] = &mut factor;
        *stopped *= 1.0 - transmission(described);
        for channel in &mut factor {
            *channel =
                reflectance(*channel).ok_or_else(|| outside("base colour", *channel, "0 to 1"))?;
        }
        Ok(Base {
            factor,
            texture,
            emission: emission(described)?,
        })
    }
}

/// Gloss of a material, in either model; `mean` reads the image of its roughness and metalness.
fn finish(
    described: &Described,
    mean: impl FnOnce(&Info) -> Result<[f64; 4], String>,
) -> Result<Finish, String> {
    let extensions = described.extensions.as_ref();
    if let Some(glossy) = extensions.and_then(|e| e.pbr_specular_glossiness.as_ref()) {
        let finish = Finish {
            roughness: 1.0 - f64::from(glossy.glossiness_factor.0),
            metallic: 0.0,
            normal: glossy.specular_factor.0.map(f64::from),
        };
        let image = glossy.specular_glossiness_texture.as_ref();
        let unread = "textures of KHR_materials_pbrSpecularGlossiness are not read";
        return image.map_or(Ok(finish), |_| Err(unread.to_owned()));
    }
    let factors = &described.pbr_metallic_roughness;
    let image = factors.metallic_roughness_texture.as_ref();
    let [_, rough, metal, _] = image.map(mean).transpose()?.unwrap_or([1.0; 4]);
    let index = extensions.and_then(|e| e.ior.as_ref());
    let normal = index.map_or(Gloss::COMMON, |index| {
        let index = f64::from(index.ior.0);
        ((index - 1.0) / (index + 1.0)).powi(2)
    });
    let specular = extensions.and_then(|e| e.specular.as_ref());
    let tint = specular.map_or([1.0; 3], |specular| {
        let factor = f64::from(specular.specular_factor.0);
        specular
            .specular_color_factor
            .0
            .map(|c| factor * f64::from(c))
    });
    let finish = Finish {
        roughness: rough * f64::from(factors.roughness_factor.0),
        metallic: metal * f64::from(factors.metallic_factor.0),
        normal: tint.map(|tint| tint * normal),
    };
    let [r, g, b] = finish.normal;
    let is_finite = [finish.roughness, finish.metallic, r, g, b]
        .iter()
        .all(|number| number.is_finite());
    let wrong = || "one of its numbers is out of range".to_owned();
    is_finite.then_some(finish).ok_or_else(wrong)
}

fn is_unlit(described: &Described) -> bool {
    let extensions = described.extensions.as_ref();
    extensions.is_some_and(|e| e.others.contains_key("KHR_materials_unlit"))
}

/// Share of light that glass transmits.
fn transmission(described: &Described) -> f64 {
    let extensions = described.extensions.as_ref();
    let glass = extensions.and_then(|e| e.transmission.as_ref());
    glass.map_or(0.0, |glass| f64::from(glass.transmission_factor.0))
}

fn alpha(described: &Described) -> Alpha {
    match described.alpha_mode {
        Checked::Valid(AlphaMode::Mask) => {
            let least = described.alpha_cutoff.as_ref().map_or(0.5, |c| c.0);
            Alpha::Mask(f64::from(least))
        }
        Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
        _ if transmission(described) > 0.0 => Alpha::Blend,
        _ => Alpha::Opaque,
    }
}

fn channels(described: &Described) -> Channels {
    match described.alpha_mode {
        Checked::Valid(AlphaMode::Mask | AlphaMode::Blend) => Channels::All,
        _ => Channels::Colour,
    }
}

/// The texture of a material, without factor and transparency.
fn image(
    files: &dyn Files,
    document: &Document<'_>,
    textures: &mut TextureReader,
    channels: Channels,
    info: &Info,
) -> Result<Texture, String> {
    let root = &document.root;
    let (texture, index, image) = found(root, info)?;
    let content = || document.image(files, image);
    let pixels = textures.read(&format!("image {index}"), channels, content)?;
    let sampler = texture.sampler.and_then(|s| root.samplers.get(s.value()));
    let wrap = sampler.map_or([Wrap::Repeat; 2], |s| [&s.wrap_s, &s.wrap_t].map(wrap));
    Ok(Texture {
        pixels,
        wrap,
        ..Texture::plain([1.0; 4], Alpha::Opaque)
    })
}

/// Mean of a texture that holds numbers.
fn mean(
    files: &dyn Files,
    document: &Document<'_>,
    textures: &mut TextureReader,
    info: &Info,
) -> Result<[f64; 4], String> {
    let (_, index, image) = found(&document.root, info)?;
    let content = || document.image(files, image);
    textures.mean(&format!("image {index}"), content)
}

/// A material's texture and its image, with the image's index.
fn found<'r>(
    root: &'r Root,
    info: &Info,
) -> Result<(&'r gltf_json::Texture, usize, &'r gltf_json::Image), String> {
    let missing = || "it does not exist".to_owned();
    let texture = root.textures.get(info.index.value()).ok_or_else(missing)?;
    let others = texture.extensions.as_ref().map(|e| &e.others);
    let webp = || {
        let source = others?.get("EXT_texture_webp")?.get("source")?;
        usize::try_from(source.as_u64()?).ok()
    };
    let own = texture.source.value();
    let numbered = |index: usize| Some((texture, index, root.images.get(index)?));
    numbered(own)
        .or_else(|| numbered(webp()?))
        .ok_or_else(|| match others {
            Some(others) if !others.is_empty() => "it is neither PNG nor JPEG nor WebP".to_owned(),
            _ => missing(),
        })
}

fn wrap(mode: &Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

/// Gives every material a unique name, so that a show can refer to it: a nameless one becomes
/// `material.N`, N counted from 0; of several with one name, the second becomes `NAME.2`.
struct Names {
    /// Names in the file, and names given so far.
    taken: BTreeSet<String>,
    given: BTreeSet<String>,
    /// The next number to try for a shared name: starting over each time would take quadratic time.
    numbers: BTreeMap<String, u32>,
}

impl Names {
    fn of(root: &Root) -> Names {
        let written = root.materials.iter().filter_map(|m| m.name.clone());
        Names {
            taken: written.collect(),
            given: BTreeSet::new(),
            numbers: BTreeMap::new(),
        }
    }

    fn next(&mut self, own: Option<&str>, otherwise: &str) -> String {
        let own = own.filter(|name| !name.is_empty());
        let name = match own {
            Some(own) if !self.given.contains(own) => own.to_owned(),
            None if !self.taken.contains(otherwise) => otherwise.to_owned(),
            _ => self.numbered(own.unwrap_or(otherwise)),
        };
        self.taken.insert(name.clone());
        self.given.insert(name.clone());
        name
    }

    fn numbered(&mut self, base: &str) -> String {
        let number = self.numbers.entry(base.to_owned()).or_insert(1);
        loop {
            *number += 1;
            let name = format!("{base}.{number}");
            if !self.taken.contains(&name) {
                return name;
            }
        }
    }
}

fn emission(described: &Described) -> Result<Rgb, String> {
    let extensions = described.extensions.as_ref();
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |s| f64::from(s.emissive_strength.0));
    let radiance = described.emissive_factor.0.map(|c| f64::from(c) * strength);
    match radiance.iter().find(|c| !(0.0..=1e30).contains(*c)) {
        Some(bad) => Err(outside("emitted luminance", *bad, "0 to 1e30")),
        None => Ok(Rgb(radiance)),
    }
}
