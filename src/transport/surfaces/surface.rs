//! The scene for light transport: facets (planar polygons) and their convex pieces.
//!
//! Invariants: every facet has a positive area and at least one piece; the pieces tile the facet;
//! facets are ordered by decreasing area, so that of two coplanar ones the smaller is drawn on top.
//! Degenerate polygons are omitted. This module does not depend on pixels or settings.

#![allow(
    clippy::indexing_slicing,
    reason = "indices of vertices come from the polygon's own length"
)]

use crate::TransportError;
use crate::surfaces::facet::{Facet, Piece};
use crate::surfaces::lobe::Lobe;
use footlight_show::geometry::{Vec3, diameter, newell};
use footlight_show::hash::mix;
use footlight_show::model::Haze;
use footlight_stage::stage_file::FAR;
use footlight_stage::texture::Texture;
use footlight_stage::{Material, Scene};
use std::sync::Arc;

/// Lengths below this share of the scene's size are ignored: stored coordinates are rounded to
/// about 1e-7 of it. On a ground plane of 10 km nothing lower than 14 mm casts a shadow.
const TOUCHING: f64 = 1e-6;

/// Distance that points keep from edges, relative to the scene's size.
const INSET: f64 = 1e-4;

/// Surfaces and air of a scene.
#[derive(Clone, Debug)]
pub struct Surfaces {
    /// By decreasing area.
    pub facets: Vec<Facet>,
    /// In the order of the facets.
    pub pieces: Vec<Piece>,
    /// Diagonal of the bounding box, metres.
    pub size: f64,
    /// Texture of each material.
    textures: Vec<Option<Texture>>,
    /// Gloss of each material.
    lobes: Vec<Option<Lobe>>,
    /// True when some material lets light pass.
    pub is_cut: bool,
    /// Haze in the air.
    pub haze: Option<Haze>,
}

impl Surfaces {
    /// Converts the polygons of a scene.
    ///
    /// # Errors
    /// [`TransportError::Scene`] for a vertex that is not finite or is a million kilometres away, a
    /// missing material, or a reflectance outside 0 to 1.
    pub fn new(scene: &Scene) -> Result<Surfaces, TransportError> {
        let mut surfaces = Surfaces::shapes(scene)?;
        for facet in 0..surfaces.facets.len() {
            let own = &mut surfaces.facets[facet];
            if let Some(lobe) = surfaces.lobes[own.material].as_ref() {
                own.reflectance = lobe.albedo(lobe.matt);
            }
            if let Some(mean) = surfaces.mean_reflectance(facet) {
                surfaces.facets[facet].reflectance = mean;
            }
        }
        Ok(surfaces)
    }

    /// Like [`Surfaces::new`], when only shapes matter: a textured facet reflects the mean of its
    /// whole texture.
    ///
    /// # Errors
    /// Errors of [`Surfaces::new`].
    pub fn shapes(scene: &Scene) -> Result<Surfaces, TransportError> {
        let mut facets = Vec::with_capacity(scene.polygons.len());
        for (i, polygon) in scene.polygons.iter().enumerate() {
            let Some(material) = scene.materials.get(polygon.material) else {
                return Err(TransportError::Scene(format!(
                    "polygon {i} has no material {}",
                    polygon.material
                )));
            };
            let reflectance = material.reflectance.0;
            if !reflectance.iter().all(|r| (0.0..=1.0).contains(r)) {
                return Err(TransportError::Scene(format!(
                    "reflectance of material {} is outside 0 to 1",
                    material.name
                )));
            }
            if !polygon.vertices.iter().all(|v| v.is_finite()) {
                return Err(TransportError::Scene(format!(
                    "polygon {i} has a vertex that is not finite"
                )));
            }
            let far = |v: &Vec3| v.x.abs().max(v.y.abs()).max(v.z.abs()) > FAR;
            if polygon.vertices.iter().any(far) {
                return Err(TransportError::Scene(format!(
                    "polygon {i} has a vertex more than {FAR:e} m away: nothing of the stage would be left beside it"
                )));
            }
            let shading = polygon.shading.clone();
            let own = facet(outline(&polygon.vertices), polygon.material, reflectance);
            facets.extend(own.map(|own| Facet { shading, ..own }));
        }
        facets.sort_by(|a, b| b.area.total_cmp(&a.area));
        let mut pieces = Vec::with_capacity(facets.len());
        for (i, f) in facets.iter_mut().enumerate() {
            let start = pieces.len();
            pieces.extend(
                convex_parts(&f.vertices, f.normal)
                    .into_iter()
                    .map(|vertices| Piece {
                        vertices,
                        normal: f.normal,
                        facet: i,
                    }),
            );
            f.pieces = start..pieces.len();
        }
        Ok(Surfaces {
            size: diameter(facets.iter().flat_map(|f| f.vertices.iter())),
            facets,
            pieces,
            textures: scene.materials.iter().map(|m| m.texture.clone()).collect(),
            lobes: scene.materials.iter().map(lobe).collect(),
            is_cut: scene.is_cut(),
            haze: scene.haze,
        })
    }

    /// Transmittance of haze over a distance, metres.
    pub fn clearness(&self, distance: f64) -> f64 {
        self.haze
            .map_or(1.0, |haze| (-haze.extinction * distance).exp())
    }

    /// The texture of a material.
    pub fn texture(&self, material: usize) -> Option<&Texture> {
        self.textures.get(material).and_then(Option::as_ref)
    }

    /// True when a facet may be glossy.
    pub fn is_glossy(&self) -> bool {
        self.lobes.iter().any(Option::is_some)
    }

    /// Least spread of the wide lobes, radians; `None` without one.
    pub fn narrowest_wide_gloss(&self) -> Option<f64> {
        let lobes = self.lobes.iter().flatten();
        let wide = lobes.filter(|lobe| lobe.is_wide()).map(Lobe::spread);
        wide.min_by(f64::total_cmp)
    }

    /// The gloss of a facet.
    pub fn lobe(&self, facet: u32) -> Option<&Lobe> {
        let own = self.facets.get(facet as usize)?;
        self.lobes.get(own.material)?.as_ref()
    }

    /// Colour of the reflection in a facet; white for a facet without gloss.
    pub fn tint(&self, mirror: u32) -> [f64; 3] {
        self.lobe(mirror).map_or([1.0; 3], |lobe| lobe.tint)
    }

    /// Reflectance at a point of a facet to an eye that sees it directly, averaged over a
    /// parallelogram with these sides; for a glossy facet that of the matt part.
    pub fn reflectance_to(
        &self,
        eye: Vec3,
        (facet, point): (&Facet, Vec3),
        footprint: impl FnOnce() -> [Vec3; 2],
    ) -> [f64; 3] {
        let Some(lobe) = self.lobes.get(facet.material).and_then(Option::as_ref) else {
            return self.reflectance_at(facet, point, footprint);
        };
        let matt = self.texture_at(facet, point, footprint);
        let cosine = facet.normal_at(point).dot((eye - point).normalized());
        lobe.matt_to(matt.unwrap_or(lobe.matt), cosine.max(0.0))
    }

    /// Reflectance at a point of a facet, averaged over a parallelogram with these sides; for a
    /// glossy facet that of a matt surface that reflects as much.
    pub fn reflectance_at(
        &self,
        facet: &Facet,
        point: Vec3,
        footprint: impl FnOnce() -> [Vec3; 2],
    ) -> [f64; 3] {
        let Some(matt) = self.texture_at(facet, point, footprint) else {
            return facet.reflectance;
        };
        let lobe = self.lobes.get(facet.material).and_then(Option::as_ref);
        lobe.map_or(matt, |lobe| lobe.albedo(matt))
    }

    fn texture_at(
        &self,
        facet: &Facet,
        point: Vec3,
        footprint: impl FnOnce() -> [Vec3; 2],
    ) -> Option<[f64; 3]> {
        let texture = self.texture(facet.material);
        let (texture, shading) = texture.zip(facet.shading.as_deref())?;
        Some(texture.reflectance(shading.place(point), shading.sides(footprint())))
    }

    /// Mean of a facet's texture over the facet.
    fn mean_reflectance(&self, facet: usize) -> Option<[f64; 3]> {
        const PARTS: usize = 4;
        let own = &self.facets[facet];
        self.texture(own.material)?;
        own.shading.as_ref()?;
        let (mut sum, mut area) = ([0.0; 3], 0.0);
        for piece in &self.pieces[own.pieces.clone()] {
            let first = piece.vertices[0];
            for pair in piece.vertices[1..].windows(2) {
                let (a, b) = (pair[0] - first, pair[1] - first);
                let weight = a.cross(b).length();
                let sides = [a / PARTS as f64, b / PARTS as f64];
                // Centres of equal parts, all upright triangles and those between.
                for i in 0..PARTS {
                    for j in 0..2 * (PARTS - i) - 1 {
                        let (row, third) = (j / 2, if j % 2 == 0 { 1.0 } else { 2.0 } / 3.0);
                        let at = |n: usize| (n as f64 + third) / PARTS as f64;
                        let point = first + a * at(i) + b * at(row);
                        let found = self.reflectance_at(own, point, || sides);
                        sum.iter_mut()
                            .zip(found)
                            .for_each(|(s, r)| *s += weight * r);
                        area += weight;
                    }
                }
            }
        }
        (area > 0.0).then(|| sum.map(|s| s / area))
    }

    /// True when light passes through some part of a facet.
    pub fn is_sheet(&self, facet: u32) -> bool {
        let own = self.facets.get(facet as usize);
        let texture = own.and_then(|own| self.texture(own.material));
        texture.is_some_and(Texture::is_cut)
    }

    /// The sheet to which a facet belongs, and its opacity at a point, 0 to below 1; `None` where
    /// it is opaque.
    pub fn sheet(&self, facet: u32, point: Vec3) -> Option<(u32, f64)> {
        let own = self.facets.get(facet as usize)?;
        let texture = self.texture(own.material).filter(|t| t.is_cut())?;
        let shading = own.shading.as_deref()?;
        let opacity = texture.opacity(shading.place(point));
        (opacity < 1.0).then_some((shading.sheet, opacity))
    }

    /// True when a ray passes through a facet at a point. At half-transparent points this is random
    /// but reproducible: it does not depend on other rays, and front and back agree.
    pub fn lets_through(&self, facet: u32, point: Vec3, way: Vec3) -> bool {
        let Some((sheet, opacity)) = self.sheet(facet, point) else {
            return false;
        };
        let bits = [way.x, way.y, way.z].map(f64::to_bits);
        let seed = bits.iter().fold(u64::from(sheet), |s, b| mix(s ^ b));
        let random = (seed >> 11) as f64 / (1_u64 << 53) as f64;
        opacity <= random
    }

    /// For tests: polygons with reflectance 1/2.
    #[cfg(test)]
    pub fn grey(polygons: Vec<Vec<Vec3>>) -> Surfaces {
        use footlight_show::units::Rgb;
        use footlight_stage::{Material, Polygon};
        let polygon = |vertices| Polygon::new(vertices, 0);
        let scene = Scene {
            materials: vec![Material::diffuse("grey", Rgb([0.5; 3]))],
            polygons: polygons.into_iter().map(polygon).collect(),
            ..Scene::default()
        };
        Surfaces::new(&scene).unwrap()
    }

    /// Length below which objects touch.
    pub fn touching(&self) -> f64 {
        self.size * TOUCHING
    }
}

fn lobe(material: &Material) -> Option<Lobe> {
    Lobe::new(material.gloss.as_ref()?, material.reflectance.0)
}

/// Moves a point of the facet away from its edges by a ten-thousandth of the scene, or on a narrow
/// facet by a fifth of its width.
pub fn kept_inside(surfaces: &Surfaces, facet: &Facet, p: Vec3) -> Vec3 {
    let margin = (surfaces.size * INSET).min(0.2 * facet.width);
    let mut moved = p;
    for edge in facet.rim() {
        let height = (moved - edge.start).dot(edge.inward);
        if height.abs() >= margin {
            continue;
        }
        // Only edges next to the point: others of a concave facet do not bound it here.
        let along = (moved - edge.start).dot(edge.along);
        if along > -margin && along < edge.length + margin {
            moved += edge.inward * (margin - height);
        }
    }
    moved
}

/// Vertices without consecutive duplicates; shared when there are none.
fn outline(vertices: &Arc<[Vec3]>) -> Arc<[Vec3]> {
    let next = vertices.iter().cycle().skip(1);
    if vertices.iter().zip(next).all(|(a, b)| a != b) {
        return Arc::clone(vertices);
    }
    let mut kept = vertices.to_vec();
    kept.dedup();
    if kept.len() > 1 && kept.first() == kept.last() {
        kept.pop();
    }
    kept.into()
}

fn facet(kept: Arc<[Vec3]>, material: usize, reflectance: [f64; 3]) -> Option<Facet> {
    let first = *kept.first()?;
    // Relative to one of its vertices: far from the origin the products would cancel.
    let local: Vec<Vec3> = kept.iter().map(|v| *v - first).collect();
    let doubled = newell(&local);
    let reach = local.iter().map(|v| v.length()).fold(0.0, f64::max);
    let area = doubled.length() * 0.5;
    if kept.len() < 3 || area <= reach * reach * 1e-12 {
        return None;
    }
    let normal = doubled.normalized();
    let mut facet = Facet {
        width: 0.0,
        normal,
        vertices: kept,
        area,
        material,
        reflectance,
        pieces: 0..0,
        shading: None,
    };
    let longest = facet.rim().map(|e| e.length).fold(0.0, f64::max);
    facet.width = area / longest;
    Some(facet)
}

/// Twice the signed area of a triangle about `normal`; positive at a convex corner.
fn turn(a: Vec3, b: Vec3, c: Vec3, normal: Vec3) -> f64 {
    (b - a).cross(c - b).dot(normal)
}

/// Convex parts of a simple polygon: itself if convex, else triangles by ear clipping.
fn convex_parts(vertices: &Arc<[Vec3]>, normal: Vec3) -> Vec<Arc<[Vec3]>> {
    let n = vertices.len();
    let corner = |i: usize| {
        let (a, b, c) = (
            vertices[(i + n - 1) % n],
            vertices[i],
            vertices[(i + 1) % n],
        );
        turn(a, b, c, normal) >= -1e-9 * (b - a).length() * (c - b).length()
    };
    if (0..n).all(corner) && turns_once(vertices, normal) {
        return vec![Arc::clone(vertices)];
    }
    let mut rest = vertices.to_vec();
    let mut parts = Vec::new();
    while rest.len() > 3 {
        let n = rest.len();
        let ear = (0..n).find(|&i| is_ear(&rest, i, normal));
        // A polygon that is not simple may have no ear: any corner is cut, so that the loop ends.
        let i = ear.unwrap_or(0);
        let triangle = [rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]];
        if turn(triangle[0], triangle[1], triangle[2], normal) > 0.0 {
            parts.push(triangle.into());
        }
        rest.remove(i);
    }
    if turn(rest[0], rest[1], rest[2], normal) > 0.0 || parts.is_empty() {
        parts.push(rest.into());
    }
    parts
}

/// True when the outline winds once (a pentagram turns left at each corner, but winds twice).
fn turns_once(vertices: &[Vec3], normal: Vec3) -> bool {
    let n = vertices.len();
    let angle: f64 = (0..n)
        .map(|i| {
            let (a, b) = (
                vertices[(i + 1) % n] - vertices[i],
                vertices[(i + 2) % n] - vertices[(i + 1) % n],
            );
            a.cross(b).dot(normal).atan2(a.dot(b))
        })
        .sum();
    angle < 1.5 * std::f64::consts::TAU
}

fn is_ear(rest: &[Vec3], i: usize, normal: Vec3) -> bool {
    let n = rest.len();
    let (before, after) = ((i + n - 1) % n, (i + 1) % n);
    let (a, b, c) = (rest[before], rest[i], rest[after]);
    if turn(a, b, c, normal) <= 0.0 {
        return false;
    }
    rest.iter().enumerate().all(|(j, &p)| {
        let own = j == before || j == i || j == after || p == a || p == b || p == c;
        own || turn(a, b, p, normal) < 0.0
            || turn(b, c, p, normal) < 0.0
            || turn(c, a, p, normal) < 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_show::geometry::vec3;
    use footlight_show::units::Rgb;
    use footlight_stage::shading::Corner;
    use footlight_stage::texture::{Alpha, Pixels, Wrap};
    use footlight_stage::{Polygon, Shading};

    const UP: Vec3 = vec3(0.0, 0.0, 1.0);

    fn flat(points: &[(f64, f64)]) -> Vec<Vec3> {
        points.iter().map(|&(x, y)| vec3(x, y, 0.0)).collect()
    }

    fn area(vertices: &[Vec3]) -> f64 {
        newell(vertices).dot(UP) * 0.5
    }

    #[test]
    fn convex_polygons_stay_whole() {
        let hexagon: Arc<[Vec3]> = (0..6)
            .map(|i| f64::from(i) * std::f64::consts::FRAC_PI_3)
            .map(|a| vec3(a.cos(), a.sin(), 0.0))
            .collect();
        assert_eq!(convex_parts(&hexagon, UP), vec![hexagon.clone()]);
    }

    #[test]
    fn concave_polygons_are_tiled() {
        let ell = flat(&[
            (0.0, 0.0),
            (3.0, 0.0),
            (3.0, 1.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (0.0, 3.0),
        ]);
        let comb = flat(&[
            (0.0, 0.0),
            (5.0, 0.0),
            (5.0, 2.0),
            (4.0, 2.0),
            (4.0, 1.0),
            (3.0, 1.0),
            (3.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (0.0, 2.0),
        ]);
        for polygon in [ell, comb] {
            let polygon = polygon.into();
            let parts = convex_parts(&polygon, UP);
            assert!(parts.len() > 1);
            assert!(parts.iter().all(|p| area(p) > 0.0));
            let total: f64 = parts.iter().map(|p| area(p)).sum();
            assert!((total - area(&polygon)).abs() < 1e-12);
        }
    }

    /// A unit square with a texture of two texels, the left one white.
    fn painted(alpha: Alpha, codes: [[u8; 4]; 2]) -> Surfaces {
        let texture = Texture {
            pixels: std::sync::Arc::new(Pixels::new([2, 1], &codes)),
            wrap: [Wrap::Clamp; 2],
            ..Texture::plain([1.0; 4], alpha)
        };
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Corner {
            point: vec3(x, y, 0.0),
            normal: None,
            place: Some([x, y]),
        });
        let polygon = Polygon {
            shading: Shading::of_corners(&corners).unwrap().map(Box::new),
            ..Polygon::new(corners.map(|c| c.point).to_vec(), 0)
        };
        let mut material = footlight_stage::Material::diffuse("cloth", Rgb([0.5; 3]));
        material.texture = Some(texture);
        let mut scene = Scene {
            materials: vec![material],
            polygons: vec![polygon],
            ..Scene::default()
        };
        scene.number_sheets();
        Surfaces::new(&scene).unwrap()
    }

    #[test]
    fn a_facet_reflects_its_textures_mean_and_each_point_its_own() {
        let surfaces = painted(Alpha::Opaque, [[255; 4], [0, 0, 0, 255]]);
        let facet = &surfaces.facets[0];
        assert!((facet.reflectance[0] - 0.5).abs() < 1e-3, "{facet:?}");
        let at = |x: f64| surfaces.reflectance_at(facet, vec3(x, 0.5, 0.0), || [Vec3::ZERO; 2])[1];
        assert!(at(0.2) > 0.999 && at(0.8) < 1e-3);
        assert!(!surfaces.is_cut);
    }

    #[test]
    fn half_transparent_lets_half_of_the_rays_through_and_a_back_the_same_ones() {
        let surfaces = painted(Alpha::Blend, [[255, 255, 255, 128]; 2]);
        let way = |i: u32| vec3(0.1, f64::from(i) * 1e-3, -1.0);
        let passes = |i: &u32| surfaces.lets_through(0, vec3(0.3, 0.3, 0.0), way(*i));
        let count = (0..10_000).filter(passes).count();
        assert!(
            (count as f64 / 10_000.0 - 127.0 / 255.0).abs() < 0.02,
            "{count}"
        );
        let mask = painted(Alpha::Mask(0.5), [[255; 4], [255, 255, 255, 0]]);
        let at = |x: f64| mask.lets_through(0, vec3(x, 0.5, 0.0), way(0));
        assert!(!at(0.2) && at(0.8));
    }

    #[test]
    fn degenerate_polygons_are_left_out() {
        assert!(
            facet(
                outline(&flat(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]).into()),
                0,
                [0.0; 3]
            )
            .is_none()
        );
        assert!(facet(outline(&flat(&[(1.0, 1.0); 4]).into()), 0, [0.0; 3]).is_none());
        assert!(facet(outline(&[].into()), 0, [0.0; 3]).is_none());
    }
}
