//! The vertices of a primitive.

use std::rc::Rc;

use crate::shading::Corner;
use footlight_show::geometry::vec3;

/// Vertices with their attributes.
#[derive(Clone, Default)]
pub struct Vertices {
    /// Positions.
    pub points: Rc<Vec<[f64; 3]>>,
    /// Shading normals.
    pub normals: Option<Rc<Vec<[f64; 3]>>>,
    /// Texture coordinates.
    pub places: Option<Rc<Vec<[f64; 2]>>>,
    /// Drawing order; `None` draws them in sequence.
    pub indices: Option<Vec<u32>>,
}

impl Vertices {
    /// The corner with this index.
    pub fn corner(&self, index: u32) -> Corner {
        let index = index as usize;
        let vector = |[x, y, z]: [f64; 3]| vec3(x, y, z);
        let of = |list: &Rc<Vec<[f64; 3]>>| list.get(index).copied().map(vector);
        Corner {
            point: of(&self.points).unwrap_or_default(),
            normal: self.normals.as_ref().and_then(of),
            place: self.places.as_ref().and_then(|p| p.get(index).copied()),
        }
    }
}
