//! Luminaires: emitters and their strength.

use std::sync::Arc;

use super::gobo::Gobo;
use super::photometric::Distribution;
use footlight_picture::Image;
use footlight_show::geometry::mount::Mount;
use footlight_show::model::Spot;
use footlight_show::units::Rgb;

/// A luminaire.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Every polygon of a material emits `radiance` (Lambertian) at unit setting.
    Panel {
        /// Index into [`super::Scene::materials`].
        material: usize,
        /// Emitted radiance at unit setting.
        radiance: Rgb,
    },
    /// A point source with a beam.
    Spot(Spot),
    /// An image of the light at unit setting, rendered elsewhere, independent of the stage.
    Image(Arc<Image>),
    /// A measured point source.
    Measured(MeasuredLight),
    /// One colour plane of a projected image.
    Projection(Projection),
    /// The reflected light of another light; its direct light is computed elsewhere.
    Bounced(Box<Light>),
}

impl Light {
    /// True when only reflected light is wanted.
    pub fn is_bounced(&self) -> bool {
        matches!(self, Light::Bounced(_))
    }

    /// Strength at unit setting: luminance of a panel, peak intensity of a spot or a projection,
    /// factor on the candela of a measured luminaire; 1 for an image, which has its own numbers.
    pub fn strength(&self) -> Rgb {
        match self {
            Light::Panel { radiance, .. } => *radiance,
            Light::Spot(spot) => spot.intensity,
            Light::Image(_) => Rgb::WHITE,
            Light::Measured(measured) => measured.factor,
            Light::Projection(projection) => projection.intensity,
            Light::Bounced(light) => light.strength(),
        }
    }
}

/// A point source with the distribution of a photometric file: vertical angle 0 is the axis,
/// horizontal angle 0 the mount's right, 90 the mount's up.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredLight {
    /// Its mount.
    pub mount: Mount,
    /// The distribution of the file.
    pub distribution: Arc<Distribution>,
    /// Multiplies the file's candela at unit setting.
    pub factor: Rgb,
}

/// A plane (red, green or blue) of an image projected from a point through a frustum. For one texel
/// value the intensity is equal in every direction of the frustum, so that the illuminance of a
/// flat screen square to the axis falls by the cube of the cosine. The image's top is the mount's
/// up; an observer behind the projector reads it the right way round.
#[derive(Clone, Debug, PartialEq)]
pub struct Projection {
    /// Its mount.
    pub mount: Mount,
    /// Full angle from the image's bottom to its top, degrees; its width follows.
    pub field: f64,
    /// The image.
    pub gobo: Arc<Gobo>,
    /// Channel of the image.
    pub plane: usize,
    /// Intensity (cd) of a texel of 1 at unit setting.
    pub intensity: Rgb,
}

impl Projection {
    /// Half the image's width and height, 1 m from the projector.
    pub fn half_size(gobo: &Gobo, field: f64) -> [f64; 2] {
        let (width, height) = gobo.size();
        let tangent = (0.5 * field.to_radians()).tan();
        [tangent * width as f64 / height as f64, tangent]
    }

    /// Luminous flux (lm) of a white image projected at 1 cd: the solid angle of the frustum.
    pub fn flux(gobo: &Gobo, field: f64) -> f64 {
        let [a, b] = Projection::half_size(gobo, field);
        4.0 * (a * b / (1.0 + a * a + b * b).sqrt()).atan()
    }
}
