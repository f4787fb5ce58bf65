//! Builds a small hall as glTF: `cargo run -p footlight-studies --bin hall_model` writes
//! `hall.gltf` next to this file.
//!
//! The file is like an export from a modelling program: everything is cut into triangles, a table
//! is one mesh with two instances (the second mirrored), a double-sided cloth hangs freely, and
//! lights have their own nodes. Metres, Y up. The numbers are equal on every machine; a test
//! compares the file.

use std::fmt::Write as _;
use std::path::Path;

use base64::prelude::{BASE64_STANDARD, Engine as _};

type Point = [f32; 3];

fn moved([x, y, z]: Point, [a, b, c]: Point, by: f32) -> Point {
    [x + by * a, y + by * b, z + by * c]
}

/// Triangles of one mesh.
#[derive(Default)]
struct Mesh {
    points: Vec<Point>,
    corners: Vec<u16>,
}

impl Mesh {
    /// A quad at `at` with sides `u` and `v`, front towards u x v, cut into `n` by `n` cells.
    fn quad(&mut self, at: Point, u: Point, v: Point, n: u16) {
        let first = self.points.len() as u16;
        for j in 0..=n {
            for i in 0..=n {
                let (s, t) = (f32::from(i) / f32::from(n), f32::from(j) / f32::from(n));
                self.points.push(moved(moved(at, u, s), v, t));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let a = first + j * (n + 1) + i;
                let d = a + n + 1;
                self.corners.extend([a, a + 1, d + 1, a, d + 1, d]);
            }
        }
    }

    /// A box on the floor, without its bottom.
    fn table(&mut self, [x, z]: [f32; 2], [w, h, d]: Point) {
        self.quad([x, h, z + d], [w, 0.0, 0.0], [0.0, 0.0, -d], 1);
        self.quad([x, 0.0, z + d], [w, 0.0, 0.0], [0.0, h, 0.0], 1);
        self.quad([x + w, 0.0, z], [-w, 0.0, 0.0], [0.0, h, 0.0], 1);
        self.quad([x, 0.0, z], [0.0, 0.0, d], [0.0, h, 0.0], 1);
        self.quad([x + w, 0.0, z + d], [0.0, 0.0, -d], [0.0, h, 0.0], 1);
    }
}

/// Floor, back and side walls; a lamp's pane in the back wall's plane a finger in front; a table;
/// a cloth.
fn meshes() -> [(&'static str, usize, Mesh); 5] {
    let [mut floor, mut walls, mut pane, mut table, mut cloth] = [(); 5].map(|()| Mesh::default());
    floor.quad([-4.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 0.0, -6.0], 4);
    walls.quad([-4.0, 0.0, -6.0], [8.0, 0.0, 0.0], [0.0, 4.0, 0.0], 4);
    walls.quad([-4.0, 0.0, 0.0], [0.0, 0.0, -6.0], [0.0, 4.0, 0.0], 3);
    walls.quad([4.0, 0.0, -6.0], [0.0, 0.0, 6.0], [0.0, 4.0, 0.0], 3);
    pane.quad([-0.6, 2.2, -5.99], [1.2, 0.0, 0.0], [0.0, 1.2, 0.0], 2);
    table.table([0.6, -3.5], [1.6, 0.8, 0.9]);
    cloth.quad([-0.5, 0.2, -4.2], [1.0, 0.0, 0.3], [0.0, 1.6, 0.0], 2);
    [
        ("Floor", 0, floor),
        ("Walls", 1, walls),
        ("Pane", 2, pane),
        ("Table", 0, table),
        ("Cloth", 3, cloth),
    ]
}

const MATERIALS: &str = r#"
    {"name": "boards", "pbrMetallicRoughness": {"baseColorFactor": [0.3, 0.18, 0.09, 1]}},
    {"name": "plaster", "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.57, 0.5, 1]}},
    {"name": "pane", "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}, "emissiveFactor": [0.5, 0.7, 1],
     "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 60}}},
    {"name": "cloth", "doubleSided": true, "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.08, 0.06, 1]}}"#;

const NODES: &str = r#"
    {"name": "Hall", "children": [1, 2, 3, 4, 5, 6, 7]},
    {"name": "Floor", "mesh": 0}, {"name": "Walls", "mesh": 1}, {"name": "Pane", "mesh": 2},
    {"name": "Table", "mesh": 3}, {"name": "Table.mirrored", "mesh": 3, "scale": [-1, 1, 1]},
    {"name": "Cloth", "mesh": 4},
    {"name": "Rig", "translation": [0, 3.6, -1], "children": [8, 9]},
    {"name": "Key", "translation": [-2.5, 0, 0], "rotation": [-0.6, -0.28, -0.04, 0.748],
     "extensions": {"KHR_lights_punctual": {"light": 0}}},
    {"name": "Bulb", "translation": [2, -0.4, -2], "extensions": {"KHR_lights_punctual": {"light": 1}}}"#;

const LIGHTS: &str = r#"
    {"type": "spot", "intensity": 9000, "color": [1, 0.85, 0.6], "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}},
    {"type": "point", "intensity": 120, "color": [1, 0.7, 0.4]}"#;

/// The text of the file.
pub fn gltf() -> String {
    let (mut buffer, mut views, mut accessors, mut all) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (name, material, mesh) in meshes() {
        let mut add = |bytes: Vec<u8>, kind: u16, count: usize, shape: &str| {
            let view = views.len();
            views.push(format!(
                r#"{{"buffer": 0, "byteOffset": {}, "byteLength": {}}}"#,
                buffer.len(),
                bytes.len()
            ));
            accessors.push(format!(
                r#"{{"bufferView": {view}, "componentType": {kind}, "count": {count}, "type": "{shape}"}}"#
            ));
            buffer.extend(bytes);
            buffer.resize(buffer.len().next_multiple_of(4), 0);
            view
        };
        let points = mesh.points.iter().flatten().flat_map(|c| c.to_le_bytes());
        let points = add(points.collect(), 5126, mesh.points.len(), "VEC3");
        let corners = mesh.corners.iter().flat_map(|c| c.to_le_bytes());
        let corners = add(corners.collect(), 5123, mesh.corners.len(), "SCALAR");
        all.push(format!(
            r#"{{"name": "{name}", "primitives": [{{"attributes": {{"POSITION": {points}}}, "indices": {corners}, "material": {material}}}]}}"#
        ));
    }
    let list = |items: &[String]| format!("\n    {}", items.join(",\n    "));
    let mut text =
        String::from("{\n  \"asset\": {\"version\": \"2.0\", \"generator\": \"hall_model\"},\n");
    text.push_str(
        "  \"extensionsUsed\": [\"KHR_lights_punctual\", \"KHR_materials_emissive_strength\"],\n",
    );
    let _ = writeln!(
        text,
        "  \"extensions\": {{\"KHR_lights_punctual\": {{\"lights\": [{LIGHTS}]}}}},\n  \
         \"scene\": 0, \"scenes\": [{{\"nodes\": [0]}}],\n  \"nodes\": [{NODES}],\n  \
         \"materials\": [{MATERIALS}],\n  \"meshes\": [{}],\n  \"accessors\": [{}],\n  \
         \"bufferViews\": [{}],\n  \"buffers\": [{{\"byteLength\": {}, \"uri\": \"data:application/octet-stream;base64,{}\"}}]\n}}",
        list(&all),
        list(&accessors),
        list(&views),
        buffer.len(),
        BASE64_STANDARD.encode(&buffer)
    );
    text
}

#[allow(dead_code, reason = "the test takes this file as a module")]
fn main() -> std::io::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hall/hall.gltf");
    std::fs::write(path, gltf())
}
