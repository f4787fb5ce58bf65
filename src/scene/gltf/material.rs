//! Materials: names, diffuse reflectance, emitted luminance.

use std::collections::{BTreeMap, BTreeSet};

use gltf_json::{Material as Described, Root};

use super::{Fault, LeftOut, PartError, place};
use crate::scene::Material;
use crate::units::Rgb;

/// What a texture leaves of a material's factor. Textures are not read; images of surfaces are a
/// half on average rather than one, which is what the factor beside them usually says, and at one a
/// closed room would never get dark.
const TEXTURED: f64 = 0.5;

/// Reflectance of what has no material. glTF says one, at which a closed room never gets dark.
const UNSTATED: f64 = 0.8;

/// The materials of a file, the one for primitives without any last.
pub struct Materials {
    pub materials: Vec<Material>,
    pub double_sided: Vec<bool>,
    pub left_out: LeftOut,
}

/// All materials, used or not, because a show may name them.
pub fn all(root: &Root) -> Result<Materials, Fault> {
    let mut out = Materials {
        materials: Vec::new(),
        double_sided: Vec::new(),
        left_out: BTreeSet::new(),
    };
    let mut names = Names::of(root);
    for (i, described) in root.materials.iter().enumerate() {
        let name = names.next(described.name.as_deref(), &format!("material.{i}"));
        let fault = |e| Fault::new(place("material", i, described.name.as_ref()), e);
        if described
            .pbr_metallic_roughness
            .base_color_texture
            .is_some()
        {
            let half = format!(
                "the texture of `{name}`: it reflects half of its factor; `surface` can say more"
            );
            out.left_out.insert(half);
        }
        out.materials.push(Material {
            reflectance: reflectance(described).map_err(fault)?,
            emission: emission(described).map_err(fault)?,
            name,
        });
        out.double_sided.push(described.double_sided);
    }
    out.materials.push(Material::diffuse(
        names.next(None, "default"),
        Rgb([UNSTATED; 3]),
    ));
    out.double_sided.push(false);
    Ok(out)
}

/// Gives every material a name of its own, so that a show can say which it means: those without
/// one are called `material.N`, N counted from 0; of several that share one the second is
/// `NAME.2`.
struct Names {
    /// As written in the file, and those given so far.
    taken: BTreeSet<String>,
    given: BTreeSet<String>,
    /// The number to try next for a name that many share: trying from the start each time would
    /// take time by the square of their number.
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

fn reflectance(described: &Described) -> Result<Rgb, PartError> {
    let pbr = &described.pbr_metallic_roughness;
    let [r, g, b, _] = pbr.base_color_factor.0.map(f64::from);
    let share = if pbr.base_color_texture.is_some() {
        TEXTURED
    } else {
        1.0
    };
    let factor = [r, g, b];
    match factor.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        Some(bad) => Err(PartError::Range {
            what: "base colour",
            value: *bad,
            range: "0 to 1",
        }),
        None => Ok(Rgb(factor.map(|c| c * share))),
    }
}

fn emission(described: &Described) -> Result<Rgb, PartError> {
    let extensions = described.extensions.as_ref();
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |s| f64::from(s.emissive_strength.0));
    let radiance = described.emissive_factor.0.map(|c| f64::from(c) * strength);
    match radiance.iter().find(|c| !(0.0..=1e30).contains(*c)) {
        Some(bad) => Err(PartError::Range {
            what: "emitted luminance",
            value: *bad,
            range: "0 to 1e30",
        }),
        None => Ok(Rgb(radiance)),
    }
}
