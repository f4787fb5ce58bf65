//! A projection's image on a surface, averaged over each receiver's footprint.
//!
//! The light of a projection is that of a uniform point source ([`super::beam::Beam::even`], with
//! visibility and distance) times the mean of the image over the footprint, a parallelogram on the
//! surface that stands for a pixel or part of an element. At the edge of the frustum the covered
//! share of the footprint counts. This module depends on neither shadows nor settings.

use std::sync::Arc;

use crate::surfaces::camera::Camera;
use footlight_show::geometry::Vec3;
use footlight_show::geometry::mount::{Axes, Mount};
use footlight_stage::footprint::Taps;
use footlight_stage::gobo::Gobo;
use footlight_stage::{Light, Projection};

/// A projector.
#[derive(Clone, Debug)]
pub struct Projector {
    mount: Mount,
    axes: Axes,
    half_size: [f64; 2],
    gobo: Arc<Gobo>,
    plane: usize,
}

impl Projector {
    /// `None` when [`super::beam::Beam::even`] returns `None`.
    pub fn new(light: &Projection) -> Option<Projector> {
        Some(Projector {
            mount: light.mount,
            axes: light.mount.axes()?,
            half_size: Projection::half_size(&light.gobo, light.field),
            gobo: Arc::clone(&light.gobo),
            plane: light.plane.min(2),
        })
    }

    /// True when both project the same image from the same place and so share visibility.
    pub fn shares_projection(&self, other: &Projector) -> bool {
        self.mount == other.mount
            && self.half_size == other.half_size
            && Arc::ptr_eq(&self.gobo, &other.gobo)
    }

    /// Mean of the image over the parallelogram with sides `footprint` centred at `point`, relative
    /// to the peak; zero outside the frustum.
    pub fn share(&self, point: Vec3, footprint: [Vec3; 2]) -> f64 {
        let d = point - self.mount.position;
        let depth = self.axes.axis.dot(d);
        if depth <= 0.0 {
            return 0.0;
        }
        let (x, y) = (self.axes.right.dot(d) / depth, self.axes.up.dot(d) / depth);
        let [a, b] = self.half_size;
        let place = [0.5 + 0.5 * x / a, 0.5 - 0.5 * y / b];
        // Sides of the footprint in the image, to first order.
        let side = |e: Vec3| {
            let near = self.axes.axis.dot(e);
            let [dx, dy] = [
                (self.axes.right.dot(e) - x * near) / depth,
                (self.axes.up.dot(e) - y * near) / depth,
            ];
            [0.5 * dx / a, -0.5 * dy / b]
        };
        self.mean(place, footprint.map(side))
    }

    /// Light of the projection at each receiver (a point and the sides of its footprint): its
    /// `even` light there times the image's mean.
    pub fn project<'a>(
        &self,
        even: &[f32],
        receivers: impl Iterator<Item = (Vec3, [Vec3; 2])> + 'a,
    ) -> Vec<f32> {
        let lit = |(light, (point, footprint)): (&f32, _)| match *light {
            0.0 => 0.0,
            light => light * self.share(point, footprint) as f32,
        };
        even.iter().zip(receivers).map(lit).collect()
    }

    /// Mean of the image over a parallelogram; the image is the unit square.
    fn mean(&self, place: [f64; 2], sides: [[f64; 2]; 2]) -> f64 {
        let [u, v] = place;
        let [[px, py], [qx, qy]] = sides;
        let wide = 0.5 * (px.abs() + qx.abs());
        let high = 0.5 * (py.abs() + qy.abs());
        let outside = |x: f64, r: f64| x + r <= 0.0 || x - r >= 1.0;
        if !(wide.is_finite() && high.is_finite()) || outside(u, wide) || outside(v, high) {
            return 0.0;
        }
        let (width, height) = self.gobo.size();
        let texels = [width as f64, height as f64];
        let scaled = sides.map(|s| [s[0] * texels[0], s[1] * texels[1]]);
        let taps = Taps::new(scaled);
        let size = taps.size;
        let mut sum = 0.0;
        for offset in taps.offsets() {
            let [u, v] = [0, 1].map(|k| place[k] + offset[k] / texels[k]);
            let inside = overlap(u, size / texels[0]) * overlap(v, size / texels[1]);
            if inside > 0.0 {
                sum += inside * self.gobo.texel(u, v, size, self.plane);
            }
        }
        sum / taps.count() as f64
    }
}

/// Footprint of a pixel on a plane of `normal` seen at `point`, scaled to the share `weight` of the
/// pixel.
pub fn pixel(camera: &Camera, point: Vec3, normal: Vec3, weight: f64) -> [Vec3; 2] {
    let ray = point - camera.origin;
    let depth = camera.forward.dot(ray) * weight.sqrt();
    let across = [camera.right * camera.step_x, camera.up * camera.step_y];
    // Moved along the ray back onto the plane.
    across.map(|e| (e - ray * (normal.dot(e) / normal.dot(ray))) * depth)
}

/// Share of an interval of length `size` centred at `x` that lies within 0 to 1.
fn overlap(x: f64, size: f64) -> f64 {
    if size < 1e-9 {
        return if (0.0..=1.0).contains(&x) { 1.0 } else { 0.0 };
    }
    let (from, to) = ((x - 0.5 * size).max(0.0), (x + 0.5 * size).min(1.0));
    ((to - from) / size).max(0.0)
}

/// The projector of a light that projects an image.
pub fn projector(light: &Light) -> Option<Projector> {
    match light {
        Light::Projection(projection) => Projector::new(projection),
        Light::Bounced(light) => self::projector(light),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use footlight_picture::Image;
    use footlight_show::geometry::vec3;
    use footlight_show::units::Rgb;

    /// A projector at the origin that looks upstage, 90 degrees high.
    fn projector(width: usize, height: usize, f: impl Fn(usize, usize) -> f32) -> Projector {
        let at = |i: usize| [f(i % width, i / width); 3];
        let data = (0..width * height).flat_map(at).collect();
        let image = Image::from_data(width, height, data).unwrap();
        Projector::new(&Projection {
            mount: Mount {
                position: Vec3::ZERO,
                aim: vec3(0.0, 5.0, 0.0),
                turn: 0.0,
            },
            field: 90.0,
            gobo: Arc::new(Gobo::new(image).unwrap()),
            plane: 0,
            intensity: Rgb::WHITE,
        })
        .unwrap()
    }

    const POINT: [Vec3; 2] = [Vec3::ZERO, Vec3::ZERO];

    #[test]
    fn the_image_is_read_the_right_way_round_from_behind() {
        // Values 0 to 3 from left to right; the top row is brighter by 10.
        let t = projector(4, 2, |x, y| x as f32 + if y == 0 { 10.0 } else { 0.0 });
        for x in 0..4 {
            for (y, height) in [(0, 0.5), (1, -0.5)] {
                // The frustum is 4 m wide and 2 m high at 1 m.
                let point = vec3(-1.5 + f64::from(x), 1.0, height) * 3.0;
                let texel = f64::from(x) + if y == 0 { 10.0 } else { 0.0 };
                assert!((t.share(point, POINT) - texel).abs() < 1e-9, "{x} {y}");
            }
        }
        assert_eq!(t.share(vec3(0.0, -1.0, 0.0), POINT), 0.0);
    }

    #[test]
    fn light_ends_at_the_frustum_within_a_footprint() {
        let t = projector(4, 2, |_, _| 1.0);
        for inside in [0.999_999, 1.000_001] {
            let expected = f64::from(u8::from(inside < 1.0));
            assert_eq!(t.share(vec3(2.0 * inside, 1.0, 0.3), POINT), expected);
            assert_eq!(t.share(vec3(0.7, 1.0, -inside), POINT), expected);
        }
        let footprint = [vec3(0.02, 0.0, 0.0), vec3(0.0, 0.0, 0.02)];
        for (x, share) in [
            (1.985, 1.0),
            (1.995, 0.75),
            (2.0, 0.5),
            (2.005, 0.25),
            (2.015, 0.0),
        ] {
            let found = t.share(vec3(x, 1.0, 0.0), footprint);
            assert!((found - share).abs() < 1e-9, "{x}: {found}");
        }
    }

    #[test]
    fn footprints_of_many_texels_see_their_mean() {
        // Stripes one texel wide, which point samples would see as black or white.
        let t = projector(512, 512, |x, _| (x % 2) as f32);
        let texel = 2.0 / 512.0;
        let mut worst = [0.0_f64; 2];
        for i in 0..200 {
            let at = vec3(-0.6 + 0.006 * f64::from(i) * 1.001, 1.0, 0.2);
            let naive = t.share(at, POINT);
            let wide = t.share(at, [vec3(8.0 * texel, 0.0, 0.0), vec3(0.0, 0.0, texel)]);
            worst[0] = worst[0].max((naive - 0.5).abs());
            worst[1] = worst[1].max((wide - 0.5).abs());
        }
        assert!(worst[0] > 0.45, "{worst:?}");
        assert!(worst[1] < 0.07, "{worst:?}");
    }

    #[test]
    fn a_footprint_long_in_one_direction_is_blurred_in_that_only() {
        let t = projector(256, 256, |x, _| if x < 128 { 0.0 } else { 1.0 });
        let texel = 2.0 / 256.0;
        // Twelve texels high, one wide, one texel from the edge: still fully inside or outside.
        let tall = [vec3(texel, 0.0, 0.0), vec3(0.0, 0.0, 12.0 * texel)];
        assert!(t.share(vec3(1.5 * texel, 1.0, 0.1), tall) > 0.999);
        assert!(t.share(vec3(-1.5 * texel, 1.0, 0.1), tall) < 0.001);
        // Turned to lie flat, it crosses the edge.
        let flat = [vec3(12.0 * texel, 0.0, 0.0), vec3(0.0, 0.0, texel)];
        let found = t.share(vec3(1.5 * texel, 1.0, 0.1), flat);
        assert!((found - 0.625).abs() < 0.05, "{found}");
    }

    #[test]
    fn footprints_add_up_to_the_image() {
        // Whatever the footprints, the mean over a screen that contains the frustum is the image's
        // mean.
        let t = projector(48, 32, |x, y| ((x * 5 + y * 3) % 7) as f32);
        let mean = t.gobo.texel(0.5, 0.5, 1e9, 0);
        for n in [7, 20, 150] {
            let (w, h) = (4.0 / f64::from(n), 2.4 / f64::from(n));
            let sides = [vec3(w, 0.0, 0.0), vec3(0.0, 0.0, h)];
            let mut sum = 0.0;
            for i in 0..n {
                for j in 0..n {
                    let (x, z) = (
                        -2.0 + w * (f64::from(i) + 0.5),
                        -1.2 + h * (f64::from(j) + 0.5),
                    );
                    sum += t.share(vec3(x, 1.0, z), sides) * w * h;
                }
            }
            // The frustum is 3 m wide and 2 m high.
            assert!((sum / (6.0 * mean) - 1.0).abs() < 0.02, "{n}: {sum} {mean}");
        }
    }
}
