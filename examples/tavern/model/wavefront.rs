//! Writes a set as Wavefront files: OBJ for its faces, MTL for its materials.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use super::finish::{self, Finish, Painter};
use super::solid::{Face, Point, Set};

/// A material of the set.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Its name in the show's text.
    pub name: &'static str,
    /// Diffuse reflectance, linear RGB.
    pub reflectance: [f64; 3],
    /// Emitted radiance at level 100, cd/m2 in linear RGB; zero for most.
    pub emission: [f64; 3],
    /// Its finish, if any.
    pub finish: Option<Finish>,
}

/// A material that only reflects.
pub const fn paint(name: &'static str, reflectance: [f64; 3]) -> Material {
    Material {
        name,
        reflectance,
        emission: [0.0; 3],
        finish: None,
    }
}

/// A reflecting material with an image; `reflectance` is the mean.
pub const fn finished(
    name: &'static str,
    reflectance: [f64; 3],
    finish: Option<Finish>,
) -> Material {
    Material {
        name,
        reflectance,
        emission: [0.0; 3],
        finish,
    }
}

/// A material that also emits.
pub const fn glow(name: &'static str, emission: [f64; 3]) -> Material {
    Material {
        name,
        reflectance: [0.1, 0.1, 0.1],
        emission,
        finish: None,
    }
}

/// Distinct lines of one kind, and their numbers.
#[derive(Default)]
struct Lines {
    text: String,
    numbers: BTreeMap<String, usize>,
}

impl Lines {
    /// The number of a line, from 1.
    fn number(&mut self, keyword: &str, values: String) -> usize {
        let next = self.numbers.len() + 1;
        let Lines { text, numbers } = self;
        *numbers.entry(values).or_insert_with_key(|values| {
            let _ = writeln!(text, "{keyword} {values}");
            next
        })
    }
}

/// The OBJ file of the set with this title, whose files are called `name`.
pub fn obj(set: &Set, materials: &[Material], title: &str, name: &str) -> String {
    let (mut points, mut places, mut normals) = <(Lines, Lines, Lines)>::default();
    let mut faces = String::new();
    let (mut object, mut used) = ("", "");
    for (number, face) in set.faces.iter().enumerate() {
        if face.object != object {
            object = face.object;
            let _ = writeln!(faces, "o {object}");
        }
        if face.material != used {
            used = face.material;
            let _ = writeln!(faces, "usemtl {used}");
        }
        faces.push('f');
        let place = places_of(face, number, materials);
        for (i, point) in face.vertices.iter().enumerate() {
            let _ = write!(faces, " {}", points.number("v", vertex(*point)));
            let place = place.get(i).map(|p| places.number("vt", decimals(p)));
            let normal = face.normals.get(i);
            let normal = normal.map(|n| normals.number("vn", vertex(*n)));
            let _ = match (place, normal) {
                (Some(place), Some(normal)) => write!(faces, "/{place}/{normal}"),
                (Some(place), None) => write!(faces, "/{place}"),
                (None, Some(normal)) => write!(faces, "//{normal}"),
                (None, None) => Ok(()),
            };
        }
        faces.push('\n');
    }
    format!(
        "# {title}: made by examples/{name}/model.rs, do not edit\n\
         # metres, Y up; faces run counter-clockwise seen from the front\n\
         mtllib {name}.mtl\n{}{}{}{faces}",
        points.text, places.text, normals.text
    )
}

/// Texture coordinates of a face's corners in the image of its material.
fn places_of(face: &Face, number: usize, materials: &[Material]) -> Vec<[f64; 2]> {
    let material = materials.iter().find(|m| m.name == face.material);
    let finish = material.and_then(|m| m.finish);
    finish.map_or(Vec::new(), |finish| finish.places(face, number))
}

/// A point in the file: Y up, rounded to the micrometre.
fn vertex([x, y, z]: Point) -> String {
    decimals(&[x, z, -y])
}

/// Numbers with six decimals, without negative zero.
fn decimals(numbers: &[f64]) -> String {
    let number = |c: &f64| {
        let text = format!("{c:.6}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0" } else { text }.to_owned()
    };
    numbers.iter().map(number).collect::<Vec<_>>().join(" ")
}

/// The MTL file; images are those of `painters`.
pub fn mtl(
    materials: &[Material],
    painters: &[(&str, Painter)],
    title: &str,
    name: &str,
) -> String {
    let mut text = format!(
        "# {title}: made by examples/{name}/model.rs, do not edit\n\
         # Kd: diffuse reflectance, linear; under an image what makes it so in the mean.\n\
         # Ke: radiance at level 100, cd/m2.\n"
    );
    for material in materials {
        let image = material.finish.map(|finish| finish.image);
        let painter = painters.iter().find(|(name, _)| Some(*name) == image);
        let mean = painter.map_or(1.0, |(_, painter)| finish::mean(*painter));
        let full = material.reflectance.map(|c| (c / mean * 1e4).round() / 1e4);
        let [r, g, b] = full;
        let _ = writeln!(text, "\nnewmtl {}\nKd {r} {g} {b}", material.name);
        if let Some(image) = image {
            let _ = writeln!(text, "map_Kd {image}.png");
        }
        let [r, g, b] = material.emission;
        let _ = writeln!(text, "Ke {r} {g} {b}\nillum 1");
    }
    text
}

/// Writes the images into the show's folder.
pub fn write_images(folder: &Path, painters: &[(&str, Painter)]) -> std::io::Result<()> {
    for (name, painter) in painters {
        let file = std::fs::File::create(folder.join(format!("{name}.png")))?;
        let side = finish::SIDE as u32;
        let mut encoder = png::Encoder::new(file, side, side);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&finish::paint(*painter))?;
    }
    Ok(())
}
