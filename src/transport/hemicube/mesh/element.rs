//! One element: the centre of its hemicube and the samples of its direct light.
//!
//! This module does not depend on other cells or lights.

#![allow(
    clippy::indexing_slicing,
    reason = "facets and pieces are named by the surfaces"
)]

use crate::hemicube::interior::is_interior;
use crate::hemicube::mesh::bsp::{BspTree, Line, height};
use crate::hemicube::mesh::grid::Grid;
use crate::hemicube::mesh::sample::Sample;
use crate::surfaces::hierarchy::SceneGeometry;
use crate::surfaces::surface::{Surfaces, kept_inside};
use footlight_show::geometry::{Vec3, frame};

/// A mesh cell that light can reach.
#[derive(Clone, Debug)]
pub struct Element {
    /// Its facet.
    pub facet: usize,
    /// Position of its hemicube.
    pub centre: Vec3,
    /// Samples over which its direct light is first averaged.
    pub samples: Vec<Sample>,
}

impl Element {
    /// Mean reflectance over its samples, weighted by area.
    pub fn reflectance(&self, surfaces: &Surfaces) -> [f64; 3] {
        let facet = &surfaces.facets[self.facet];
        let area: f64 = self.samples.iter().map(|sample| sample.area).sum();
        if surfaces.texture(facet.material).is_none() || area <= 0.0 {
            return facet.reflectance;
        }
        let ways = frame(facet.normal);
        let mut mean = [0.0; 3];
        for sample in &self.samples {
            let sides = || ways.map(|way| way * sample.area.sqrt());
            let own = surfaces.reflectance_at(facet, sample.point, sides);
            for (mean, own) in mean.iter_mut().zip(own) {
                *mean += own * sample.area / area;
            }
        }
        mean
    }
}

/// Makes the elements of one cell.
pub struct Maker<'a> {
    /// The scene.
    pub setting: SceneGeometry<'a>,
    /// Visibility seeds.
    pub seeds: &'a [Vec3],
    /// The cell's facet.
    pub facet: usize,
    /// Its grid.
    pub grid: &'a Grid,
    /// Index of the cell within the grid.
    pub cell: usize,
    /// A point of the cell that a fragment shows, which is therefore outside all solids.
    pub visible_point: Option<Vec3>,
}

impl Maker<'_> {
    /// An element for each part that has one.
    pub fn elements(&self, tree: BspTree<Vec<Line>>) -> BspTree<Option<Element>> {
        match tree {
            BspTree::Leaf(bounds) => BspTree::Leaf(self.element(bounds)),
            BspTree::Split(plane, sides) => {
                BspTree::Split(plane, Box::new((*sides).map(|side| self.elements(side))))
            }
        }
    }

    fn is_open(&self, p: Vec3) -> bool {
        !is_interior(self.setting, self.seeds, self.facet, p)
    }

    fn element(&self, bounds: Vec<Line>) -> Option<Element> {
        let surfaces = self.setting.surfaces;
        let facet = &surfaces.facets[self.facet];
        let is_uncut = bounds.is_empty();
        let within = |p: &Vec3| {
            let place = self.grid.place(*p);
            bounds.iter().all(|line| height(*line, place) >= 0.0)
        };
        let visible_point = self.visible_point.filter(within);
        let square = (self.grid.corner(self.cell), 1.0);
        let whole = Sample::new(surfaces, facet, self.grid, square, bounds.into())?;
        let mut centre = whole.point;
        if self.grid.on_rim {
            if let Some(p) = self.rim().filter(|_| is_uncut) {
                centre = p;
            }
            // A gather point only gathers: its samples matter only when its centre is inside a
            // solid.
            if self.is_open(centre) {
                return Some(self.made(centre, Vec::new()));
            }
        }
        let quarters = whole.quarters(surfaces, facet, self.grid);
        let samples: Vec<Sample> = quarters.filter(|s| self.is_open(s.point)).collect();
        let distance = |s: &Sample| (s.point - centre).length();
        let nearest = samples
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(nearest) = nearest else {
            // All samples are inside a solid: a visible point of the image replaces them.
            let p = kept_inside(surfaces, facet, visible_point?);
            return Some(self.made(p, vec![whole.at(p)]));
        };
        // Partly inside a solid: the open sample nearest to the centre replaces it.
        let stands = if self.is_open(centre) {
            centre
        } else {
            nearest.point
        };
        Some(self.made(stands, samples))
    }

    fn made(&self, centre: Vec3, samples: Vec<Sample>) -> Element {
        Element {
            facet: self.facet,
            centre,
            samples,
        }
    }

    /// Position of a gather point, on the rim if it is an outermost one; `None` where the facet
    /// does not reach.
    fn rim(&self) -> Option<Vec3> {
        let (grid, surfaces) = (self.grid, self.setting.surfaces);
        let facet = &surfaces.facets[self.facet];
        let [i, j] = grid.position(self.cell);
        let [u, v] = [grid.stand(i, grid.counts[0]), grid.stand(j, grid.counts[1])];
        let p = grid.origin + grid.along * (u / grid.scale[0]) + grid.across * (v / grid.scale[1]);
        let p = kept_inside(surfaces, facet, p);
        let pieces = &surfaces.pieces[facet.pieces.clone()];
        pieces.iter().any(|piece| piece.holds(p)).then_some(p)
    }
}
