//! Describes a stage's file.

use std::fmt::Write;

use super::table::Table;
use super::words::count;
use footlight_engine::{StageFile, StageMaterial};
use footlight_show::printable::{Printable, trimmed};
use footlight_stage::LampShape;
use footlight_stage::texture::Alpha;

/// Most characters of a line.
const WIDTH: usize = 240;
/// Most names of materials in a list.
const TOLD: usize = 8;

/// Describes extent, polygons, lights, cameras, materials, and what is not read unchanged.
pub fn describe(name: &str, stage: &StageFile) -> Printable {
    let mut text = format!("{name}: {}\n", extent(stage));
    let _ = writeln!(text, "{}", polygons(stage));
    let light = |(name, shape): &(String, LampShape)| format!("`{name}` ({})", kind(shape));
    let lights: Vec<String> = stage.lights.iter().map(light).collect();
    let _ = writeln!(text, "lights: {}", listed(&lights));
    let cameras: Vec<String> = stage.cameras.iter().map(|c| format!("`{c}`")).collect();
    let _ = writeln!(text, "cameras: {}", listed(&cameras));
    for note in &stage.summary.left_out {
        let _ = writeln!(text, "not as it stands: {note}");
    }
    let _ = writeln!(text, "to begin with: {}\n", view(stage));
    let mut out = Printable::from(text);
    out.push(&materials(stage).text(1, WIDTH));
    out
}

fn extent(stage: &StageFile) -> String {
    let [low, high] = &stage.extent;
    let size: Vec<String> = low
        .iter()
        .zip(high)
        .map(|(low, high)| metres(high - low))
        .collect();
    let all = low.iter().zip(high).map(|(low, high)| high - low);
    let span = all.fold(0.0, f64::hypot);
    let point = |p: &[f64; 3]| p.map(|length| place(length, span)).join(", ");
    format!(
        "{} m (across, deep, high), from {} to {}",
        size.join(" x "),
        point(low),
        point(high)
    )
}

fn polygons(stage: &StageFile) -> String {
    let summary = &stage.summary;
    let verb = if summary.faces == 1 {
        "becomes"
    } else {
        "become"
    };
    let mut text = format!(
        "{} {verb} {}",
        count(summary.faces, "face"),
        count(stage.polygons, "polygon")
    );
    let parts = [
        (summary.merged, "triangle", "merged"),
        (summary.bent, "bent face", "cut"),
        (summary.dropped, "empty face", "left out"),
        (summary.backs, "back", "added"),
    ];
    for (n, what, done) in parts.iter().filter(|(n, ..)| *n > 0) {
        let _ = write!(text, ", {} {done}", count(*n, what));
    }
    text
}

fn kind(shape: &LampShape) -> &'static str {
    match shape {
        LampShape::Point => "point",
        LampShape::Spot { .. } => "spot",
        LampShape::Distant => "directional: cannot be used",
    }
}

fn listed(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        names => names.join(", "),
    }
}

fn materials(stage: &StageFile) -> Table {
    let columns = ["material", "reflectance", "m2", ""];
    let mut table = Table::new(columns.map(str::to_owned).to_vec(), "");
    for material in stage.materials.iter().filter(|m| m.area > 0.0) {
        let [r, g, b] = material.reflectance.0.map(|c| format!("{c:.2}"));
        table.push([
            material.name.clone(),
            format!("{r} {g} {b}"),
            metres(material.area),
            beside(material),
        ]);
    }
    table
}

fn beside(material: &StageMaterial) -> String {
    let texture = material.texture.map(|[w, h]| format!("texture {w}x{h}"));
    let cut = passes(material.alpha).map(str::to_owned);
    let glow =
        (material.luminance > 0.0).then(|| format!("shines {:.3} cd/m2", material.luminance));
    let gloss = material.gloss.map(|(roughness, is_metal)| {
        let metal = if is_metal { "metal, " } else { "" };
        format!("{metal}gloss {roughness:.2}")
    });
    let parts: Vec<String> = [texture, cut, gloss, glow].into_iter().flatten().collect();
    parts.join(", ")
}

/// Kind of transparency, in words.
fn passes(alpha: Alpha) -> Option<&'static str> {
    match alpha {
        Alpha::Opaque => None,
        Alpha::Mask(_) => Some("cut out by alpha"),
        Alpha::Blend => Some("thinned by alpha"),
    }
}

/// `` `leaves` cut out by alpha, `glass` thinned by alpha ``; empty when all materials are opaque.
pub fn transparent(materials: &[StageMaterial]) -> String {
    let shown = materials.iter().filter(|m| m.area > 0.0);
    let mut told: Vec<String> = shown
        .filter_map(|m| Some(format!("`{}` {}", m.name, passes(m.alpha)?)))
        .collect();
    if told.len() > TOLD {
        let more = told.len() - TOLD;
        told.truncate(TOLD);
        told.push(format!("and {more} more"));
    }
    told.join(", ")
}

/// A view from the house that holds the whole stage.
fn view(stage: &StageFile) -> String {
    let [low, high] = stage.extent;
    let [x, y, z] = [0, 1, 2].map(|k: usize| match (low.get(k), high.get(k)) {
        (Some(low), Some(high)) => (0.5 * (low + high), high - low),
        _ => (0.0, 0.0),
    });
    let span = (x.1.hypot(y.1)).hypot(z.1);
    let away = y.0 - 1.4 * span;
    let place = |at: [f64; 3]| at.map(|length| place(length, span)).join(", ");
    let (from, to) = (place([x.0, away, z.0 + 0.3 * span]), place([x.0, y.0, z.0]));
    format!("view house from {from}  to {to}  fov 40")
}

/// A coordinate, rounded to some hundredths of `size`, however far from the origin.
fn place(length: f64, size: f64) -> String {
    let decimals = if size > 0.0 {
        2.0 - size.log10().floor()
    } else {
        2.0
    };
    trimmed(&format!("{length:.*}", decimals.clamp(0.0, 6.0) as usize))
}

/// A length with a useful number of digits.
fn metres(length: f64) -> String {
    trimmed(&match length.abs() {
        l if l >= 100.0 => format!("{length:.0}"),
        l if l >= 1.0 => format!("{length:.2}"),
        _ => format!("{length:.4}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_host::files::Memory;

    const DESCRIBED: &str = "\
a.obj: 4 x 3 x 2.5 m (across, deep, high), from 0, 0, 0 to 4, 3, 2.5
4 faces become 5 polygons, 1 bent face cut
lights: none
cameras: none
not as it stands: the texture of `cloth`: `gone.png` does not exist; it reflects half of its factor, and `surface` can say more
to begin with: view house from 2, -6.33, 2.93  to 2, 1.5, 1.25  fov 40

material  reflectance     m2
floor     0.50 0.40 0.30  12
lamp      0.00 0.00 0.00  10.17  shines 2.000 cd/m2
gauze     0.80 0.80 0.80  6      thinned by alpha
cloth     0.30 0.10 0.10  5.75   gloss 0.20
";

    /// The whole message: a bent face, a missing texture, a gauze by `d`, a lamp.
    #[test]
    fn a_stage_file_is_described() {
        let materials = "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl lamp\nKe 2 2 2\n\
             newmtl gauze\nKd 0.8 0.8 0.8\nd 0.25\nnewmtl cloth\nKd 0.6 0.2 0.2\nPr 0.2\nmap_Kd gone.png\n";
        let object = "mtllib a.mtl\n\
             v 0 0 0\nv 4 0 0\nv 4 0 -3\nv 0 0 -3\nv 0 2 -3\nv 4 2.5 -2\nv 4 2 0\nv 0 2 0\n\
             usemtl floor\nf 1 2 3 4\nusemtl lamp\nf 8 5 6 7\nusemtl gauze\nf 1 4 5 8\n\
             usemtl cloth\nf 2 7 6 3\n";
        let files = Memory::default()
            .with("a.mtl", materials)
            .with("a.obj", object);
        let stage = StageFile::read(&files, "a.obj", 1 << 30).unwrap();
        let said = String::from(describe("a.obj", &stage));
        assert_eq!(said, DESCRIBED);
    }

    #[test]
    fn one_face_is_not_several() {
        let files = Memory::default().with("a.obj", "v 0 0 0\nv 1 0 0\nv 0 0 -1\nf 1 2 3\n");
        let stage = StageFile::read(&files, "a.obj", 1 << 30).unwrap();
        let said = String::from(describe("a.obj", &stage));
        assert!(said.contains("\n1 face becomes 1 polygon\n"), "{said}");
    }
}
