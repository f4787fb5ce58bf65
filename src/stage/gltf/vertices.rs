//! The vertices of a primitive.

use std::rc::Rc;

use crate::shading::Corner;
use footlight_show::geometry::vec3;

/// Vertices with what they have.
#[derive(Clone, Default)]
pub struct Vertices {
    /// Where they are.
    pub points: Rc<Vec<[f64; 3]>>,
    /// To shade by.
    pub normals: Option<Rc<Vec<[f64; 3]>>>,
    /// In the texture of the material.
    pub places: Option<Rc<Vec<[f64; 2]>>>,
    /// In the order in which they are drawn; without it as they stand.
    pub indices: Option<Vec<u32>>,
}

impl Vertices {
    /// The corner of this index.
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
