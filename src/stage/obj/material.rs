//! MTL files: materials with their textures and gloss.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::super::texture::reader::{Channels, TextureReader};
use super::super::texture::{Alpha, Texture, Wrap};
use super::super::{Gloss, Material, gltf};
use super::read::{colour, each_line, named, numbers, split};
use super::{SceneError, UNSTATED};
use crate::stage_file::{Finish, reflectance};
use footlight_host::files::Files;
use footlight_show::units::Rgb;

/// A material as described in its file.
#[derive(Default)]
struct Described {
    name: String,
    diffuse: Option<[f64; 3]>,
    emission: [f64; 3],
    /// Share of light that it stops: `d`, else `1 - Tr`.
    stops: Option<f64>,
    lets: Option<f64>,
    image: Option<Map>,
    /// `map_d`, if it is another image than `map_Kd`.
    mask: Option<String>,
    /// True with a `map_Ke`.
    shines_by_image: bool,
    /// The numbers of keywords that describe its gloss.
    gloss: BTreeMap<String, [f64; 3]>,
    /// Fault in the gloss; the material is then matt.
    gloss_fault: Option<String>,
    /// Fault of the material; only faces that use it are refused.
    fault: Option<SceneError>,
}

/// Keywords of gloss.
const GLOSS: [&str; 6] = ["Ns", "Ks", "Ka", "illum", "Pr", "Pm"];

/// Reflectance at normal incidence for `Ks` 1, as in Blender.
const MOST_NORMAL: f64 = 0.08;

/// `map_Kd`: a file and its placement.
#[derive(Clone, Default)]
struct Map {
    file: String,
    scale: [f64; 2],
    offset: [f64; 2],
    clamp: bool,
}

/// The materials of all MTL files.
#[derive(Default)]
pub(super) struct Materials {
    /// In the order of the files.
    list: Vec<Described>,
    /// Indices into `list`.
    pub(super) by_name: BTreeMap<String, usize>,
    /// First material and folder of each file.
    folders: Vec<(usize, String)>,
    /// The material being described.
    open: Option<usize>,
    /// Names defined twice.
    twice: BTreeSet<String>,
}

impl Materials {
    /// Adds the materials of an MTL file.
    pub(super) fn read(&mut self, path: &str, bytes: &[u8]) -> Result<(), SceneError> {
        let first = self.list.len();
        let folder = Path::new(path).parent().unwrap_or(Path::new(""));
        self.folders
            .push((first, folder.to_string_lossy().into_owned()));
        self.open = None;
        each_line(path, bytes, |text, line| {
            let Err(reason) = self.line(text) else {
                return Ok(());
            };
            let Some(open) = self.open.and_then(|index| self.list.get_mut(index)) else {
                return Err(reason);
            };
            open.fault.get_or_insert(SceneError::Line {
                path: path.to_owned(),
                line,
                reason,
            });
            Ok(())
        })
    }

    /// For each material its fault, and true when it gives no colour.
    pub(super) fn checked(&mut self) -> Vec<(Option<SceneError>, bool)> {
        let of = |described: &mut Described| {
            let is_dark = described.emission == [0.0; 3];
            let is_unstated = described.diffuse.is_none() && described.image.is_none() && is_dark;
            if is_unstated {
                described.diffuse = Some([UNSTATED; 3]);
            }
            (described.fault.take(), is_unstated)
        };
        self.list.iter_mut().map(of).collect()
    }

    fn line(&mut self, text: &str) -> Result<(), String> {
        let (keyword, rest) = split(text);
        if keyword == "newmtl" {
            let name = if rest.is_empty() { "default" } else { rest };
            let described = Described {
                name: name.to_owned(),
                ..Described::default()
            };
            // The last definition of a name counts, as in most readers.
            let index = *self
                .by_name
                .entry(name.to_owned())
                .or_insert(self.list.len());
            match self.list.get_mut(index) {
                Some(before) => {
                    *before = described;
                    self.twice.insert(name.to_owned());
                }
                None => self.list.push(described),
            }
            self.open = Some(index);
            return Ok(());
        }
        let known = ["Kd", "Ke", "d", "Tr", "map_Kd", "map_Ke", "map_d"].contains(&keyword);
        if !(known || GLOSS.contains(&keyword)) || rest.is_empty() {
            return Ok(());
        }
        let open = self.open.and_then(|index| self.list.get_mut(index));
        let material = open.ok_or("`newmtl` needs a name")?;
        match keyword {
            // A spectrum, or a colour in CIE XYZ, is not read.
            "Kd" | "Ka" | "Ks" if ["spectral", "xyz"].contains(&split(rest).0) => {}
            "Kd" => {
                let kd = colour("Kd", rest)?;
                let mut diffuse = [0.0; 3];
                for (to, value) in diffuse.iter_mut().zip(kd) {
                    *to = reflectance(value)
                        .ok_or_else(|| format!("reflectance {value} is outside 0 to 1"))?;
                }
                material.diffuse = Some(diffuse);
            }
            "Ke" => {
                let ke = colour("Ke", rest)?;
                if let Some(bad) = ke.iter().find(|v| **v < 0.0) {
                    return Err(format!("emitted luminance {bad} is negative"));
                }
                material.emission = ke;
            }
            _ if GLOSS.contains(&keyword) => match colour(keyword, rest) {
                Ok(value) => drop(material.gloss.insert(keyword.to_owned(), value)),
                Err(reason) => material.gloss_fault = Some(reason),
            },
            "d" => material.stops = Some(share("d", rest.trim_start_matches("-halo"))?),
            "Tr" => material.lets = Some(share("Tr", rest)?),
            "map_Ke" => material.shines_by_image = true,
            "map_Kd" => material.image = Some(Map::of(named("map_Kd", rest)?)),
            _ => material.mask = Some(Map::of(named("map_d", rest)?).file),
        }
        Ok(())
    }

    /// All materials with their images, and for each the placement of its image.
    pub(super) fn finish(
        self,
        files: &dyn Files,
        textures: &mut TextureReader,
        matt: bool,
        left_out: &mut gltf::LeftOut,
    ) -> (Vec<Material>, Vec<Option<Moved>>) {
        let mut out = (Vec::new(), Vec::new());
        left_out.extend(
            self.twice.iter().map(|name| {
                format!("material `{name}` is defined twice: the last definition counts")
            }),
        );
        for (i, described) in self.list.into_iter().enumerate() {
            let folder = self.folders.iter().rev().find(|(first, _)| *first <= i);
            let folder = folder.map_or("", |(_, folder)| folder.as_str());
            let gloss = described.gloss().filter(|_| !matt);
            let (mut material, moved) = described.finish(files, folder, textures, left_out);
            if let Some(finish) = gloss {
                material.polish(finish);
            }
            out.0.push(material);
            out.1.push(moved);
        }
        out
    }
}

impl Described {
    /// Gloss by the rule of Blender's exporter; `None` for a matt material.
    fn gloss(&self) -> Option<Finish> {
        let of = |keyword| self.gloss.get(keyword).copied();
        let number = |keyword| of(keyword).map(|[value, ..]| value);
        let (illum, metallic) = (number("illum"), number("Pm"));
        let has_highlight = illum.is_none_or(|illum| illum >= 2.0);
        let exponent = number("Ns").filter(|_| has_highlight);
        let of_exponent = |ns: f64| 1.0 - (ns / 1000.0).clamp(0.0, 1.0).sqrt();
        let roughness = number("Pr").or(exponent.map(of_exponent))?;
        // In other programs' files it is a mirror with the colour `Ks`.
        let mirrors = illum == Some(3.0) && metallic.is_none();
        let scale = if mirrors { 1.0 } else { MOST_NORMAL };
        let unstated = number("Pr").map_or(0.0, |_| Gloss::COMMON / MOST_NORMAL);
        let share = number("Ka").filter(|_| mirrors);
        self.gloss_fault.is_none().then(|| Finish {
            roughness,
            metallic: metallic.or(share).unwrap_or(0.0),
            normal: of("Ks")
                .unwrap_or([unstated; 3])
                .map(|ks| ks.min(1.0) * scale),
        })
    }

    fn finish(
        self,
        files: &dyn Files,
        folder: &str,
        textures: &mut TextureReader,
        left_out: &mut gltf::LeftOut,
    ) -> (Material, Option<Moved>) {
        // `Tr 1` alone is written by programs that mean opaque.
        let let_through = self.lets.filter(|lets| *lets < 1.0).unwrap_or(0.0);
        let stops = self.stops.unwrap_or(1.0 - let_through);
        let mut material = Material {
            emission: Rgb(self.emission),
            ..Material::diffuse(self.name, Rgb(self.diffuse.unwrap_or_default()))
        };
        let name = material.name.clone();
        if stops == 0.0 {
            left_out.insert(format!(
                "`{name}` is fully transparent (`d`, `Tr`): it cannot be seen"
            ));
        }
        if self.stops.is_none() && self.lets == Some(1.0) {
            left_out.insert(format!("`Tr 1` of `{name}`: read as opaque"));
        }
        if self
            .mask
            .as_ref()
            .is_some_and(|mask| self.image.as_ref().is_none_or(|i| i.file != *mask))
        {
            left_out.insert(format!(
                "`map_d` of `{name}`: only the alpha of `map_Kd` cuts out"
            ));
        }
        if let Some(reason) = &self.gloss_fault {
            left_out.insert(format!("the gloss of `{name}`: {reason}; it is matt"));
        }
        if self.shines_by_image {
            left_out.insert(format!(
                "`map_Ke` of `{name}`: as a `panel` it shines evenly, by its `Ke`"
            ));
        }
        let mut moved = None;
        if let Some(map) = self.image {
            // Programs that leave the colour to the image write black.
            let factor = self
                .diffuse
                .filter(|kd| *kd != [0.0; 3])
                .unwrap_or([1.0; 3]);
            let beside = |file: &str| Path::new(folder).join(file).to_string_lossy().into_owned();
            let path = beside(&map.file);
            // An absolute path of the machine that wrote the file means a copy next to it on any
            // other.
            let content = || match (files.read(&path), map.name_of_absolute()) {
                (Err(_), Some(name)) => files.read(&beside(name)).map_err(|e| e.to_string()),
                (found, _) => found.map_err(|e| e.to_string()),
            };
            match textures.read(&path, Channels::All, content) {
                Ok(pixels) => {
                    let [r, g, b] = factor;
                    let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
                    let alpha = if pixels.is_transparent() || stops < 1.0 {
                        Alpha::Blend
                    } else {
                        Alpha::Opaque
                    };
                    let texture = Texture {
                        pixels,
                        wrap: [wrap; 2],
                        ..Texture::plain([r, g, b, stops], alpha)
                    };
                    material.reflectance = Rgb(texture.mean_reflectance());
                    material.texture = Some(texture);
                    moved = Some(Moved(map));
                }
                Err(reason) => {
                    left_out.insert(format!(
                        "the texture of `{name}`: {reason}; it reflects half of its factor, and \
                         `surface` can say more"
                    ));
                    material.reflectance = Rgb(factor.map(|c| 0.5 * c));
                }
            }
        }
        if stops < 1.0 && material.texture.is_none() {
            let [r, g, b] = material.reflectance.0;
            material.texture = Some(Texture::plain([r, g, b, stops], Alpha::Blend));
        }
        (material, moved)
    }
}

/// Placement of an image.
#[derive(Clone)]
pub(super) struct Moved(Map);

impl Moved {
    /// Position from the left and from the top.
    pub(super) fn place(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let Map { scale, offset, .. } = &self.0;
        // The file counts from the bottom.
        [
            scale[0] * u + offset[0],
            1.0 - (scale[1] * (1.0 - v) + offset[1]),
        ]
    }
}

impl Map {
    /// Parses the text after the keyword: options, then the file, whose name may have blanks.
    fn of(text: &str) -> Map {
        let mut map = Map {
            scale: [1.0; 2],
            ..Map::default()
        };
        let mut rest = text.trim();
        while let Some(option) = rest.strip_prefix('-') {
            let (option, mut values) = split(option);
            let most = match option {
                "s" | "o" | "t" => 3,
                "mm" => 2,
                _ => 1,
            };
            for i in 0..most {
                let (value, after) = split(values);
                let number = value.parse::<f64>().ok().filter(|v| v.is_finite());
                // The second and third number are optional.
                if i > 0 && number.is_none() {
                    break;
                }
                let to = match option {
                    "s" => map.scale.get_mut(i),
                    "o" => map.offset.get_mut(i),
                    _ => None,
                };
                if let (Some(to), Some(number)) = (to, number) {
                    *to = number;
                }
                map.clamp |= option == "clamp" && value == "on";
                values = after;
            }
            rest = values;
        }
        let quoted = rest.strip_prefix('"').and_then(|r| r.strip_suffix('"'));
        map.file = quoted.unwrap_or(rest).replace('\\', "/");
        map
    }

    /// The file name alone, when its path begins at a root or a drive.
    fn name_of_absolute(&self) -> Option<&str> {
        let (folder, name) = self.file.rsplit_once('/')?;
        let is_drive = folder.as_bytes().get(1) == Some(&b':');
        (self.file.starts_with('/') || is_drive).then_some(name)
    }
}

/// Reads a number from 0 to 1.
fn share(keyword: &'static str, rest: &str) -> Result<f64, String> {
    let [value, ..] = numbers(keyword, rest, 1)?;
    Ok(value.clamp(0.0, 1.0))
}
