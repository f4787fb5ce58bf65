//! Light between equal walls, where every solver's error is known: in a closed room of reflectance
//! ρ with unit emission, radiosity is 1 / (1 − ρ) everywhere.

use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::units::Rgb;
use footlight_stage::{Material, Polygon, Scene};
use footlight_transport::TransportError;
use footlight_transport::hemicube::indirect::form::{BLOCK, Block, Bounces, Rows};
use footlight_transport::hemicube::indirect::hemicube::{FormFactorTable, Hemicube, hash_to_unit};
use footlight_transport::hemicube::mesh::{CellRequest, Layout, Mesh};
use footlight_transport::hemicube::raster::VertexBuffer;
use footlight_transport::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use footlight_transport::surfaces::surface::Surfaces;

/// Reflectances, up to a thousand bounces of light.
pub const REFLECTANCES: [f32; 9] = [0.3, 0.5, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999];
/// A supposedly sufficient number of bounces.
pub const FEW: usize = 4;
/// Most sweeps.
pub const MOST: usize = 20_000;

/// A furnace divided into elements that see each other.
#[derive(Debug)]
pub struct Furnace {
    rows: Rows,
    elements: usize,
}

/// Largest relative errors of an element's radiosity, and the cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved {
    /// ρ
    pub reflectance: f32,
    /// The shipped solver's error.
    pub ours: f64,
    /// Error of Jacobi's method, the sum of bounces, with as many products as ours.
    pub jacobi: f64,
    /// Error of Gauss-Seidel with as many sweeps.
    pub seidel: f64,
    /// Error of [`FEW`] bounces.
    pub few: f64,
    /// Products of the shipped solver.
    pub products: usize,
}

/// Grey polygons.
pub fn scene(polygons: &[Vec<Vec3>]) -> Scene {
    let polygon = |vertices: &Vec<Vec3>| Polygon::new(vertices.clone(), 0);
    Scene {
        materials: vec![Material {
            name: "wall".into(),
            reflectance: Rgb([0.5; 3]),
            emission: Rgb::default(),
            texture: None,
            gloss: None,
        }],
        polygons: polygons.iter().map(polygon).collect(),
        ..Scene::default()
    }
}

/// A closed box of 2 x 2 x 1 metres seen from inside.
///
/// # Errors
/// Never in practice: the box is valid.
pub fn room() -> Result<Surfaces, TransportError> {
    let axes = [
        vec3(2.0, 0.0, 0.0),
        vec3(0.0, 2.0, 0.0),
        vec3(0.0, 0.0, 1.0),
    ];
    let [x, y, z] = axes;
    let o = vec3(-1.0, -1.0, 0.0);
    let walls = [
        (o, x, y),
        (o + z, y, x),
        (o, z, x),
        (o + y, x, z),
        (o, y, z),
        (o + x, z, y),
    ];
    let quads = walls.map(|(a, u, v)| vec![a, a + u, a + u + v, a + v]);
    Surfaces::new(&scene(&quads))
}

/// A mesh of about `elements` elements; `seed` is a point in the open, like the eye.
///
/// # Errors
/// Never: nothing cancels it.
pub fn mesh(surfaces: &Surfaces, elements: usize, seed: Vec3) -> Result<Mesh, Cancelled> {
    let hierarchy = Hierarchy::new(surfaces);
    let setting = SceneGeometry {
        surfaces,
        hierarchy: &hierarchy,
    };
    let layout = Layout::of_elements(surfaces, elements);
    let all = vec![CellRequest::WANTED; layout.cells()];
    layout.mesh(setting, &[seed], &all, Work::silent())
}

/// Form factors between all elements, by hemicubes of a resolution.
pub fn rows(surfaces: &Surfaces, mesh: &Mesh, resolution: usize) -> Rows {
    let (outline, table) = (
        VertexBuffer::new(surfaces),
        FormFactorTable::new(resolution),
    );
    let setting = SceneGeometry {
        surfaces,
        hierarchy: &Hierarchy::new(surfaces),
    };
    let mut cube = Hemicube::new(setting, &outline, mesh, &table);
    let mut blocks = Vec::new();
    for (at, elements) in mesh.elements.chunks(BLOCK).enumerate() {
        let mut block = Block::default();
        for (i, e) in elements.iter().enumerate() {
            let turn = hash_to_unit((at * BLOCK + i) as u64);
            cube.visit(e.facet, e.centre, turn, |c, share| block.add((c, share)));
            block.end();
        }
        blocks.push(block);
    }
    Rows::of(blocks)
}

impl Furnace {
    /// The box, divided into elements.
    ///
    /// # Errors
    /// As [`room`].
    pub fn new(elements: usize) -> Result<Furnace, TransportError> {
        let surfaces = room()?;
        let mesh = mesh(&surfaces, elements, vec3(0.0, 0.0, 0.5))?;
        Ok(Furnace {
            rows: rows(&surfaces, &mesh, 16),
            elements: mesh.elements.len(),
        })
    }

    /// Runs every solver at one reflectance.
    ///
    /// # Errors
    /// On cancel.
    pub fn solve(&self, reflectance: f32) -> Result<Solved, Cancelled> {
        let walls = vec![[reflectance; 3]; self.elements];
        let bounces = Bounces::new(&self.rows, &walls);
        let first = vec![1.0; self.elements];
        let ours = bounces.interreflect(&self.rows, &first, &walls, 1, Work::silent())?;
        let products = bounces.steps();
        let off = |b: &[f32]| worst(b, reflectance);
        Ok(Solved {
            reflectance,
            ours: off(&ours),
            jacobi: off(&self.swept(reflectance, products, false)),
            seidel: off(&self.swept(reflectance, products, true)),
            few: off(&self.swept(reflectance, FEW, false)),
            products,
        })
    }

    /// Radiosities after some sweeps from the emission, each element from those of the sweep before
    /// or `in_place` from the newest.
    fn swept(&self, reflectance: f32, sweeps: usize, in_place: bool) -> Vec<f32> {
        let mut b = vec![1.0; self.elements];
        for _ in 0..sweeps {
            self.sweep(&mut b, reflectance, in_place);
        }
        b
    }

    fn sweep(&self, b: &mut Vec<f32>, reflectance: f32, in_place: bool) {
        if !in_place {
            let seen = self.rows.times(b, 1);
            *b = seen.iter().map(|x| 1.0 + reflectance * x).collect();
            return;
        }
        for i in 0..self.elements {
            let lit = |(c, f): &(u32, f32)| f * b.get(*c as usize).copied().unwrap_or(0.0);
            let seen: f32 = self.rows.row(i).iter().map(lit).sum();
            if let Some(own) = b.get_mut(i) {
                *own = 1.0 + reflectance * seen;
            }
        }
    }

    /// Sweeps until all elements are within 1e-3, at most [`MOST`].
    pub fn sweeps(&self, reflectance: f32, in_place: bool) -> usize {
        let mut b = vec![1.0; self.elements];
        let mut done = 0;
        while done < MOST && worst(&b, reflectance) >= 1e-3 {
            self.sweep(&mut b, reflectance, in_place);
            done += 1;
        }
        done
    }
}

fn worst(b: &[f32], reflectance: f32) -> f64 {
    let exact = 1.0 / (1.0 - f64::from(reflectance));
    let off = b.iter().map(|x| (f64::from(*x) / exact - 1.0).abs());
    off.fold(0.0, f64::max)
}
