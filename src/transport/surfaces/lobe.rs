//! Gloss: the specular lobe of a glossy surface over a matt one.
//!
//! Microfacets with normals distributed after Trowbridge and Reitz (GGX), with separable Smith
//! shadowing (Walter, Marschner, Li and Torrance, *Microfacet Models for Refraction through Rough
//! Surfaces*, 2007); directions are sampled by visible normals (Dupuy and Benyoub, *Sampling
//! Visible GGX Normals with Spherical Caps*, 2023). Fresnel's formula is exact for dielectrics,
//! Schlick's approximates metals. The matt part receives the light that the lobe does not reflect,
//! both from the light and to the eye: `(1 - A(v)) (1 - A(l)) / (1 - mean A)`, with `A` the
//! reflectance of the lobe (Kelemen and Szirmay-Kalos 2001), so that no surface returns more light
//! than it receives. This module does not depend on scenes.

#![allow(clippy::indexing_slicing, reason = "three channels")]

use footlight_show::geometry::{Vec3, frame, vec3};
use footlight_stage::Gloss;
use std::f64::consts::{PI, TAU};

/// Angles at which the lobe's reflectance is tabulated, evenly spaced in the cosine.
const ANGLES: usize = 64;
/// Side of the square of samples for each angle.
const SIDE: usize = 24;
/// Lobes narrower than this are mirrors.
const MIRROR: f64 = 1e-4;
/// Least width of lobes that blur more than the cells of the radiosity cache.
const WIDE: f64 = 0.0225;

/// True for a gloss whose lobe is not wide ([`Lobe::is_wide`]).
pub fn is_sharp(gloss: &Gloss) -> bool {
    gloss.roughness * gloss.roughness < WIDE
}

/// The lobe of a material.
#[derive(Clone, Debug)]
pub struct Lobe {
    /// Root mean square slope of the microfacets: roughness squared.
    alpha: f64,
    /// Ratio of refractive indices of a dielectric.
    index: Option<f64>,
    /// Reflectance at normal incidence in the highest channel.
    normal: f64,
    /// Factor for each channel.
    pub tint: [f64; 3],
    /// Reflectance of the matt part if it has no texture.
    pub matt: [f64; 3],
    /// Reflectance of the lobe for light from each angle.
    shares: Vec<f64>,
    /// Reflectance for uniform light.
    mean: f64,
}

impl Lobe {
    /// The lobe of a gloss over a matt reflectance; `None` if the gloss reflects nothing.
    pub fn new(gloss: &Gloss, matt: [f64; 3]) -> Option<Lobe> {
        let normal = gloss.normal.0.into_iter().fold(0.0, f64::max);
        if normal <= 0.0 {
            return None;
        }
        let root = normal.min(0.999).sqrt();
        let mut lobe = Lobe {
            alpha: gloss.roughness * gloss.roughness,
            index: (!gloss.is_metal).then(|| (1.0 + root) / (1.0 - root)),
            normal,
            tint: gloss.normal.0.map(|n| n / normal),
            matt,
            shares: Vec::new(),
            mean: 0.0,
        };
        let up = vec3(0.0, 0.0, 1.0);
        let share = |i: usize| {
            let cosine = (i as f64 + 0.5) / ANGLES as f64;
            let eye = vec3((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let of = |k: usize| {
                let place = [k % SIDE, k / SIDE].map(|at| (at as f64 + 0.5) / SIDE as f64);
                lobe.reflect(up, eye, place)
            };
            let found = (0..SIDE * SIDE).filter_map(of).map(|(_, share)| share);
            found.sum::<f64>() / (SIDE * SIDE) as f64
        };
        lobe.shares = (0..ANGLES).map(share).collect();
        let weighted = lobe.shares.iter().enumerate();
        let weighted = weighted.map(|(i, share)| 2.0 * share * (i as f64 + 0.5) / ANGLES as f64);
        lobe.mean = weighted.sum::<f64>() / ANGLES as f64;
        Some(lobe)
    }

    /// True when it does not spread light.
    pub fn is_mirror(&self) -> bool {
        self.alpha < MIRROR
    }

    /// True when it blurs so much that cells of the radiosity cache, or elements of the mesh,
    /// suffice for reflections.
    pub fn is_wide(&self) -> bool {
        self.alpha >= WIDE
    }

    /// Approximately half the angle of the lobe, radians.
    pub fn spread(&self) -> f64 {
        2.0 * self.alpha
    }

    /// Reflectance of the lobe for light from a direction with this cosine.
    fn share(&self, cosine: f64) -> f64 {
        let at = (cosine * ANGLES as f64 - 0.5).clamp(0.0, ANGLES as f64 - 1.0);
        let low = (at as usize).min(ANGLES - 2);
        let part = at - low as f64;
        let of = |i: usize| self.shares.get(i).copied().unwrap_or(self.mean);
        of(low) * (1.0 - part) + of(low + 1) * part
    }

    /// The direction that a mirror reflects to the eye, and the reflectance of the lobe for the eye.
    pub fn mirrored(&self, normal: Vec3, eye: Vec3) -> (Vec3, f64) {
        let height = normal.dot(eye);
        let weight = if self.is_mirror() {
            self.fresnel(height.max(0.0))
        } else {
            self.share(height)
        };
        (normal * (2.0 * height) - eye, weight)
    }

    /// Uniform light that the matt part reflects to the eye.
    pub fn matt_to(&self, matt: [f64; 3], cosine: f64) -> [f64; 3] {
        let left = 1.0 - self.share(cosine);
        matt.map(|r| r * left)
    }

    /// Factor of the matt part for light from one direction; its mean over all directions is 1.
    pub fn matt_from(&self, cosine: f64) -> f64 {
        (1.0 - self.share(cosine)) / (1.0 - self.mean).max(f64::MIN_POSITIVE)
    }

    /// Reflectance of a matt surface of equal appearance under light from one direction, given the
    /// matt part's reflectance to the eye. The lobe is included only for point sources, which no
    /// ray hits.
    pub fn seen_as(
        &self,
        matt: [f64; 3],
        normal: Vec3,
        [eye, light]: [Vec3; 2],
        is_point: bool,
    ) -> [f64; 3] {
        let from = self.matt_from(normal.dot(light).max(0.0));
        let gloss = if is_point {
            PI * self.value(normal, eye, light)
        } else {
            0.0
        };
        [0, 1, 2].map(|c| matt[c] * from + gloss * self.tint[c])
    }

    /// Reflectance of both parts together, as a matt surface.
    pub fn albedo(&self, matt: [f64; 3]) -> [f64; 3] {
        let mut both = matt.map(|r| r * (1.0 - self.mean));
        for (both, tint) in both.iter_mut().zip(self.tint) {
            *both += tint * self.mean;
        }
        both
    }

    /// Ratio of the light that both parts reflect from one direction to that from uniform light, as
    /// a mean over the channels.
    pub fn bounced(&self, cosine: f64) -> f64 {
        let sum = |share: f64| {
            let channels = self.matt.iter().zip(&self.tint);
            let sum = channels.map(|(matt, tint)| matt * (1.0 - share) + tint * share);
            sum.sum::<f64>()
        };
        sum(self.share(cosine.max(0.0))) / sum(self.mean).max(f64::MIN_POSITIVE)
    }

    /// Fresnel reflectance of the highest channel.
    fn fresnel(&self, cosine: f64) -> f64 {
        let Some(index) = self.index else {
            return self.normal + (1.0 - self.normal) * (1.0 - cosine).powi(5);
        };
        let inside = (index * index - 1.0 + cosine * cosine).sqrt();
        let [across, along] = [
            (cosine - inside) / (cosine + inside),
            (index * index * cosine - inside) / (index * index * cosine + inside),
        ];
        0.5 * (across * across + along * along)
    }

    /// Unshadowed share of the light in a direction with this cosine.
    fn passed(&self, cosine: f64) -> f64 {
        let square = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
        2.0 / (1.0 + (1.0 + self.alpha * self.alpha * square).sqrt())
    }

    /// Direction of the light that is reflected to `eye`, selected by random numbers, and its
    /// weight; `None` below the surface. All vectors have unit length.
    pub fn reflect(&self, normal: Vec3, eye: Vec3, [u, v]: [f64; 2]) -> Option<(Vec3, f64)> {
        let height = normal.dot(eye);
        if height <= 0.0 {
            return None;
        }
        if self.is_mirror() {
            return Some(self.mirrored(normal, eye));
        }
        let [x, y] = frame(normal);
        let local = vec3(eye.dot(x), eye.dot(y), height);
        let a = self.alpha;
        let stretched = vec3(a * local.x, a * local.y, local.z).normalized();
        let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
        let sine = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = (TAU * u).sin_cos();
        let half = stretched + vec3(sine * c, sine * s, z);
        let half = vec3(a * half.x, a * half.y, half.z.max(0.0)).normalized();
        let way = half * (2.0 * local.dot(half)) - local;
        if way.z <= 0.0 {
            return None;
        }
        let weight = self.passed(way.z) * self.fresnel(local.dot(half).clamp(0.0, 1.0));
        Some((x * way.x + y * way.y + normal * way.z, weight))
    }

    /// Value of the lobe, per steradian, for light from `light` to `eye`; 0 for a mirror, whose
    /// lobe no single direction meets.
    pub fn value(&self, normal: Vec3, eye: Vec3, light: Vec3) -> f64 {
        let (to, from) = (normal.dot(eye), normal.dot(light));
        if self.is_mirror() || to <= 0.0 || from <= 0.0 {
            return 0.0;
        }
        let half = (eye + light).normalized();
        let weight = self.passed(from) * self.fresnel(eye.dot(half).clamp(0.0, 1.0));
        self.density(normal, eye, light) * weight / from
    }

    /// Probability density, 1/sr, with which [`Lobe::reflect`] samples `light`; 0 for a mirror.
    pub fn density(&self, normal: Vec3, eye: Vec3, light: Vec3) -> f64 {
        let to = normal.dot(eye);
        if self.is_mirror() || to <= 0.0 {
            return 0.0;
        }
        let square = self.alpha * self.alpha;
        let up = normal.dot((eye + light).normalized());
        let spread = up * up * (square - 1.0) + 1.0;
        square / (PI * spread * spread) * self.passed(to) / (4.0 * to)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::gather::sampling::{cosine_direction, point};
    use footlight_show::units::Rgb;

    fn lobe(roughness: f64, normal: f64, is_metal: bool) -> Lobe {
        let gloss = Gloss {
            roughness,
            normal: Rgb([normal; 3]),
            is_metal,
        };
        Lobe::new(&gloss, [0.5; 3]).unwrap()
    }

    const UP: Vec3 = vec3(0.0, 0.0, 1.0);

    fn eye(cosine: f64) -> Vec3 {
        vec3((1.0 - cosine * cosine).sqrt(), 0.0, cosine)
    }

    /// The mean weight of sampled directions is the integral of the value times the cosine.
    #[test]
    fn sampling_is_the_integral_of_the_value() {
        for roughness in [0.4, 0.6, 1.0] {
            let lobe = lobe(roughness, 0.04, false);
            for cosine in [0.15, 0.5, 0.9] {
                let count = 1 << 16;
                let of = |k| PI * lobe.value(UP, eye(cosine), cosine_direction(UP, point(k, 1)));
                let integral = (0..count).map(of).sum::<f64>() / f64::from(count);
                let share = lobe.share(cosine);
                assert!(
                    (share / integral - 1.0).abs() < 0.02,
                    "{roughness} {cosine}: {share} {integral}"
                );
            }
        }
    }

    /// Glass reflects 4 % at normal incidence, and half of one polarisation at Brewster's angle.
    #[test]
    fn a_smooth_lobe_is_fresnels() {
        let glass = lobe(0.0, 0.04, false);
        assert!((glass.fresnel(1.0) - 0.04).abs() < 1e-12);
        let index: f64 = 1.5;
        let brewster = 1.0 / (1.0 + index * index).sqrt();
        let across = ((1.0 - index * index) / (1.0 + index * index)).powi(2);
        assert!((glass.fresnel(brewster) - 0.5 * across).abs() < 1e-12);
        let (way, weight) = glass.reflect(UP, eye(0.3), [0.5; 2]).unwrap();
        assert!((way - vec3(-eye(0.3).x, 0.0, 0.3)).length() < 1e-12);
        assert!((weight - glass.fresnel(0.3)).abs() < 1e-12);
    }

    /// In uniform light a white glossy surface returns no more than it receives, and its matt part
    /// is reciprocal.
    #[test]
    fn no_lobe_returns_more_than_it_gets() {
        for (roughness, normal, metal) in [
            (0.0, 0.04, false),
            (0.3, 0.04, false),
            (0.5, 0.9, true),
            (1.0, 1.0, true),
        ] {
            let lobe = lobe(roughness, normal, metal);
            for i in 1..=20 {
                let cosine = f64::from(i) / 20.0;
                let all = lobe.matt_to([1.0; 3], cosine)[0] + lobe.share(cosine);
                assert!(
                    (0.0..=1.0 + 1e-12).contains(&all),
                    "{roughness} {cosine}: {all}"
                );
            }
            let albedo = lobe.albedo([1.0; 3])[0];
            assert!((albedo - 1.0).abs() < 1e-12, "{albedo}");
            let count = 1 << 12;
            let of = |k| lobe.matt_from(cosine_direction(UP, point(k, 2)).z);
            let mean = (0..count).map(of).sum::<f64>() / f64::from(count);
            assert!(lobe.mean > 0.99 || (mean - 1.0).abs() < 1e-2, "{mean}");
        }
    }
}
