//! The operator G: light settings to images, at a quality, exactly linear.
//!
//! ```text
//! Transport --prepare(Setup, Quality)--> Prepared --render(settings)--> images
//! ```
//!
//! - A [`Transport`] prepares a [`Setup`] (scene, rig and view) once. The [`Prepared`] operator
//!   then renders any settings, of either sign. [`Cost`] predicts the time.
//! - [`radiosity`] chooses one of the project's two renderers for a scene: [`hemicube`] (radiosity
//!   with exact direct light) or `gather` (final gathering by ray tracing, for many polygons). Both
//!   are based on [`surfaces`] (scene and view) and [`direct`] (direct light), and are independent
//!   of each other.
//! - [`layered`] adds banks given as images to the images of another operator.
//! - [`outside`] runs an external program as the renderer.
//! - [`contract`] holds the checks that every operator must make.
//!
//! Invariants:
//!
//! - At one quality G is one linear operator: mesh, order of summation and number of iterations
//!   depend on setup and quality, never on settings.
//! - Results are bitwise independent of the number of threads and of the other settings in a call.
//! - [`Transport::results_version`] changes whenever an image could. For the project's own
//!   renderers `build.rs` derives it from the sources.
//! - No operator takes more memory than [`Work`] allows; it returns [`TransportError::Memory`]
//!   instead.
//!
//! This crate does not depend on shows, cues, result files or the image store. It identifies a
//! light by its index in the rig.

pub mod contract;
pub mod direct;
mod gather;
pub mod hemicube;
pub mod layered;
mod memory;
pub mod moving;
pub mod outside;
pub mod radiosity;
pub mod seen;
mod setup;
pub mod surfaces;
mod threads;
mod unit_lights;

pub use setup::Setup;

use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::hash::{GOLDEN, mix};

/// A step on an operator's quality scale; 1 is the cheapest.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
)]
pub struct Quality(pub u8);

/// Predicted cost: `prepare` once, `per_source` for each newly lit source, `per_image` for each
/// image of all sources, and `per_lone` for each image of one source. Units are the operator's own;
/// [`Transport::cost_scale`] returns the seconds per unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Meshing, visibility, form factors.
    pub prepare: f64,
    /// Direct light and radiosity of one newly lit source.
    pub per_source: f64,
    /// Composition of one image of all sources.
    pub per_image: f64,
    /// Composition of one image of one source.
    pub per_lone: f64,
}

impl std::ops::Add for Cost {
    type Output = Cost;

    fn add(self, other: Cost) -> Cost {
        Cost {
            prepare: self.prepare + other.prepare,
            per_source: self.per_source + other.per_source,
            per_image: self.per_image + other.per_image,
            per_lone: self.per_lone + other.per_lone,
        }
    }
}

impl Cost {
    /// Cost of `sources` sources, each lit alone, including preparation.
    pub fn alone(self, sources: f64) -> f64 {
        self.prepare + sources * (self.per_source + self.per_lone)
    }
}

/// A warning about an operator's images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TransportWarning {
    /// Images are not linear in the light, or are noisy although the operator does not declare it
    /// ([`Transport::samples`]); previews have errors of this size.
    NotLinear {
        /// Relative difference between the sum of two images and the image of the sum.
        sum: f64,
        /// Relative difference between twice an image and the image of twice the light.
        double: f64,
    },
    /// No image has any light.
    Black {
        /// Number of images.
        pictures: usize,
    },
    /// Some images have negative light and no positive light.
    Negative {
        /// Number of such images.
        pictures: usize,
    },
}

impl std::fmt::Display for TransportWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let of = |pictures: usize, one: &str, many: &str| match pictures {
            1 => format!("picture {one}"),
            n => format!("{n} pictures {many}"),
        };
        match self {
            TransportWarning::NotLinear { sum, double } => write!(
                f,
                "the outside renderer is not linear, or noisy: the sum of two pictures is off the \
                 picture of the sum by {:.2} %, twice the light off twice the picture by {:.2} %; \
                 previews made of its pictures err by as much",
                sum * 100.0,
                double * 100.0
            ),
            TransportWarning::Black { pictures } => write!(
                f,
                "the outside renderer's {} black all over: does it read the settings, and do its \
                 lights reach the view?",
                of(*pictures, "is", "are")
            ),
            TransportWarning::Negative { pictures } => write!(
                f,
                "the outside renderer's {} negative light and no other: its sign is wrong, or what it \
                 takes off is more than there is",
                of(*pictures, "has", "have")
            ),
        }
    }
}

/// Reason for which an operator could not prepare or render.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// The embedding program cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// More memory is needed than the budget allows.
    #[error(
        "{what}: {} MB are needed and {} MB are left of the memory allowed; allow at least {} MB more \
         with `--memory MB`, or make less of it: a smaller `size` of the view, a simpler stage, fewer \
         lights, banks and cues",
        needed.div_ceil(1 << 20),
        budget >> 20,
        needed.saturating_sub(*budget).div_ceil(1 << 20)
    )]
    Memory {
        /// The data that is too large.
        what: &'static str,
        /// Bytes needed.
        needed: usize,
        /// Bytes allowed.
        budget: usize,
    },
    /// The quality is not on the operator's scale.
    #[error("quality {0} is not on the scale 1 to {1}")]
    Quality(u8, u8),
    /// A setting has the wrong number of coordinates, or a coordinate that is not finite.
    #[error("a setting must have {expected} finite coordinates")]
    Setting {
        /// Number of sources of the rig.
        expected: usize,
    },
    /// An operator returned the wrong number of images, or one of another size than the view's.
    #[error(
        "the renderer gave {} for {settings} settings of a view of {}x{}: one of that size is due for \
         each", gave(.found), view.0, view.1
    )]
    Pictures {
        /// Width and height of each returned image.
        found: Vec<(usize, usize)>,
        /// Number of requested images.
        settings: usize,
        /// Width and height of the view.
        view: (usize, usize),
    },
    /// An external renderer returned no image.
    #[error(transparent)]
    Outside(#[from] outside::OutsideError),
    /// The scene, rig or view cannot be used.
    #[error("{0}")]
    Scene(String),
}

/// A light-transport operator, before it has a scene. An embedding program may supply its own.
///
/// This one shines the spots directly on matt surfaces of one colour, with hard shadows and without
/// bounces or haze. It traces one ray for each pixel, and uses the ray caster of [`surfaces`] and
/// the checks of [`contract`]. In a program that uses the crate `footlight`,
/// `footlight_show::geometry` is `footlight::show::geometry`, and so on.
///
/// ```
/// use footlight_host::work::Work;
/// use footlight_picture::Image;
/// use footlight_show::geometry::Vec3;
/// use footlight_show::geometry::profile::Profile;
/// use footlight_stage::{Light, Source};
/// use footlight_transport::contract::{check_quality, check_settings};
/// use footlight_transport::surfaces::camera::camera;
/// use footlight_transport::surfaces::facet::Facet;
/// use footlight_transport::surfaces::hierarchy::Hierarchy;
/// use footlight_transport::surfaces::surface::Surfaces;
/// use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};
///
/// struct Direct;
/// /// The radiance (cd/m2) of each pixel and channel, one image for each source at unit setting.
/// struct Ready(Setup, Vec<Vec<f32>>);
///
/// /// Reflected radiance at a point, of the lights from whose positions it is lit.
/// fn radiance(
///     source: &Source,
///     lights: &[Light],
///     facet: &Facet,
///     point: Vec3,
///     is_lit: impl Fn(Vec3) -> bool,
/// ) -> [f64; 3] {
///     let mut out = [0.0; 3];
///     for emitter in &source.emitters {
///         let Light::Spot(spot) = &lights[emitter.light] else {
///             continue; // a complete renderer handles each kind of `Light`
///         };
///         let profile = Profile::new(spot.beam, spot.field);
///         let (Some(profile), true) = (profile, is_lit(spot.position)) else {
///             continue;
///         };
///         let way = point - spot.position;
///         let axis = (spot.aim - spot.position).normalized();
///         let angle = way.normalized().dot(axis).clamp(-1.0, 1.0).acos();
///         // Illuminance at 1 cd.
///         let lux = profile.share(angle) * -facet.normal.dot(way.normalized()) / way.dot(way);
///         for c in 0..3 {
///             let candela = spot.intensity.0[c] * emitter.filter.0[c];
///             out[c] += facet.reflectance[c] / std::f64::consts::PI * candela * lux;
///         }
///     }
///     out
/// }
///
/// impl Transport for Direct {
///     fn name(&self) -> &str {
///         "direct"
///     }
///     fn finest(&self) -> Quality {
///         Quality(1)
///     }
///     fn cost(&self, setup: &Setup, _: Quality) -> Cost {
///         let pixels = (setup.view.width * setup.view.height) as f64;
///         Cost { prepare: pixels * setup.rig.lights.len() as f64, ..Cost::default() }
///     }
///     fn prepare(
///         &self,
///         setup: &Setup,
///         quality: Quality,
///         work: Work<'_>,
///     ) -> Result<Box<dyn Prepared>, TransportError> {
///         check_quality(quality, self.finest())?;
///         let Setup { scene, rig, view } = setup;
///         let (surfaces, camera) = (Surfaces::new(scene)?, camera(view)?);
///         let hierarchy = Hierarchy::new(&surfaces);
///         let mut images = vec![Vec::new(); rig.sources.len()];
///         for y in 0..view.height {
///             work.check()?; // the user may have cancelled
///             for x in 0..view.width {
///                 let ray = camera.ray(x as f64 + 0.5, y as f64 + 0.5);
///                 let hit = hierarchy.first_hit(&surfaces, camera.origin, ray);
///                 for (source, image) in rig.sources.iter().zip(&mut images) {
///                     let light = hit.map_or([0.0; 3], |(piece, distance)| {
///                         let facet = &surfaces.facets[surfaces.pieces[piece].facet];
///                         let point = camera.origin + ray * distance;
///                         // Backs are black: eye and light must be in front.
///                         let is_lit = |from: Vec3| {
///                             facet.height(camera.origin) > 0.0
///                                 && facet.height(from) > 0.0
///                                 && !hierarchy.blocked(&surfaces, from, point)
///                         };
///                         radiance(source, &rig.lights, facet, point, is_lit)
///                     });
///                     image.extend(light.map(|light| light as f32));
///                 }
///             }
///         }
///         Ok(Box::new(Ready(setup.clone(), images)))
///     }
/// }
///
/// impl Prepared for Ready {
///     fn render(
///         &mut self,
///         settings: &[Vec<f64>],
///         work: Work<'_>,
///     ) -> Result<Vec<Image>, TransportError> {
///         let Ready(setup, images) = self;
///         check_settings(settings, images.len())?;
///         let mut out = Vec::new();
///         for setting in settings {
///             work.check()?;
///             let mut data = vec![0.0; setup.view.width * setup.view.height * 3];
///             for (level, image) in setting.iter().zip(&*images) {
///                 for (value, light) in data.iter_mut().zip(image) {
///                     *value += *level as f32 * light;
///                 }
///             }
///             out.extend(Image::from_data(setup.view.width, setup.view.height, data));
///         }
///         Ok(out)
///     }
/// }
/// # // A spot 2 m above a floor of reflectance 0.5, seen from the side: 0.5 / pi * 800 / 4 cd/m2.
/// # use footlight_show::{geometry::{View, vec3}, model::Spot, units::Rgb};
/// # use footlight_stage::{Emitter, Material, Polygon, Rig, Scene};
/// # let corners = [vec3(-3., -3., 0.), vec3(3., -3., 0.), vec3(3., 3., 0.), vec3(-3., 3., 0.)];
/// # let scene = Scene {
/// #     materials: vec![Material::diffuse("floor", Rgb([0.5; 3]))],
/// #     polygons: vec![Polygon::new(corners.to_vec(), 0)],
/// #     haze: None,
/// # };
/// # let (position, aim) = (vec3(0., 0., 2.), vec3(0., 0., 0.));
/// # let spot = Spot { position, aim, beam: 20., field: 30., intensity: Rgb([800.; 3]) };
/// # let emitters = vec![Emitter { light: 0, filter: Rgb([1.0, 0.5, 0.0]) }];
/// # let sources = vec![Source { name: "key".into(), emitters }];
/// # let rig = Rig { lights: vec![Light::Spot(spot)], sources };
/// # let from = vec3(0., -4., 2.);
/// # let view = View { from, to: aim, fov: 1., roll: 0., width: 3, height: 3 };
/// # let mut ready = Direct.prepare(&Setup::new(scene, rig, view), Quality(1), Work::silent())?;
/// # let image = ready.render(&[vec![0.5]], Work::silent())?.remove(0);
/// # let centre = &image.data()[3 * 4..][..3];
/// # let want = 0.5 * 0.5 / std::f32::consts::PI * 200.0;
/// # for (seen, filter) in centre.iter().zip([1.0, 0.5, 0.0]) {
/// #     assert!((seen - want * filter).abs() < 1e-3 * want, "{seen} {want}");
/// # }
/// # Ok::<(), TransportError>(())
/// ```
pub trait Transport: Send + Sync {
    /// A short name for reports.
    fn name(&self) -> &str;

    /// Name and version of the operator's images, which must change whenever they do; `None` if
    /// images of one session must not be reused in another.
    ///
    /// An operator that returns a version promises that an image depends only on scene, view,
    /// quality and the strength of each lit light in each channel, and that channels do not mix.
    /// Images are then stored on disk, reused after edits, and added up.
    fn results_version(&self) -> Option<String> {
        None
    }

    /// The finest step of the quality scale, which starts at 1.
    fn finest(&self) -> Quality;

    /// Computes everything that does not depend on settings: meshing, visibility, form factors.
    ///
    /// # Errors
    /// [`TransportError`] for a quality off the scale, an unusable setup, or too small a memory
    /// budget, and on cancel.
    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError>;

    /// Warnings for the user, from measurements so far.
    fn warnings(&self) -> Vec<TransportWarning> {
        Vec::new()
    }

    /// Seconds per unit of [`Transport::cost`] on this machine, measured by a short task of known
    /// cost where necessary; by default a unit is a second. Forecasts and budgets rest on it.
    /// `clock` returns seconds.
    ///
    /// # Errors
    /// Errors of that task; on cancel.
    fn cost_scale(&self, _clock: &dyn Fn() -> f64, _work: Work<'_>) -> Result<f64, TransportError> {
        Ok(1.0)
    }

    /// Known lower bound, without computation, of the bytes to prepare this setup at any quality.
    fn least_bytes(&self, _setup: &Setup) -> usize {
        0
    }

    /// Usual error of images of this setup at this quality, relative to their light. It falls with
    /// the quality. Once an image is measured by [`Transport::estimator`], only the ratios between
    /// steps are used. `None` when unknown; errors are then estimated from two steps.
    fn usual_error(&self, _: &Setup, _: Quality) -> Option<f64> {
        None
    }

    /// Samples per pixel at a step, in the operator's own unit, if its images are unbiased with
    /// independent noise: the variance falls as this number grows. `None` if images have no noise
    /// or nothing is known about it.
    fn samples(&self, _quality: Quality) -> Option<f64> {
        None
    }

    /// Predicted cost for this setup and quality, in units of [`Transport::cost_scale`].
    fn cost(&self, setup: &Setup, quality: Quality) -> Cost;

    /// True when [`Transport::estimator`] can measure images of a setup.
    fn is_measurable(&self, _: &Setup) -> bool {
        false
    }

    /// An independent estimator of pixels of a setup, to measure the error of images; `None` if the
    /// operator has none.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable setup or too small a budget, and on cancel.
    fn estimator(
        &self,
        _setup: &Setup,
        _work: Work<'_>,
    ) -> Result<Option<Box<dyn PixelEstimator>>, TransportError> {
        Ok(None)
    }
}

/// Unbiased estimates of single pixels.
pub trait PixelEstimator: Send + Sync {
    /// Two independent estimates of each pixel's radiance (three channels, units as in
    /// [`Prepared::render`]) under a setting, each the mean over the given paths. A pixel is its
    /// index, row by row from the top. A pixel that shows part of a light returns NaN, since the
    /// visible share of the light would dominate the estimate.
    ///
    /// # Errors
    /// On cancel.
    fn estimate(
        &self,
        setting: &[f64],
        pixels: &[usize],
        paths: std::ops::Range<u32>,
        work: Work<'_>,
    ) -> Result<Vec<[[f64; 3]; 2]>, TransportError>;
}

/// G for one setup and quality.
pub trait Prepared: Send {
    /// Renders one image of the view's size for each of the `settings`, in order; a setting has one
    /// finite number (of either sign) for every source of the rig. A pixel is the radiance seen
    /// there, linear and not exposed: cd/m2 if the lights are in candela or lumens (a matt surface
    /// sends reflectance / pi times its illuminance). The image of a sum of settings must be the
    /// sum of their images, since previews are computed that way. Work shared between settings is
    /// done once and kept for later calls.
    ///
    /// A loop longer than a tenth of a second must call [`Work::check`], which reports when to
    /// stop, and may report progress by `work.progress`; the engine itself reports "refined
    /// pictures", "key images" and a few more.
    ///
    /// # Errors
    /// [`TransportError`] for an invalid setting or too small a budget, and on cancel. The engine
    /// rejects a wrong number or size of images with [`TransportError::Pictures`].
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError>;

    /// Approximate bytes held between calls; 0 if they are not counted.
    fn bytes(&self) -> usize {
        0
    }
}

fn gave(found: &[(usize, usize)]) -> String {
    let mut sizes: Vec<String> = found.iter().map(|(w, h)| format!("{w}x{h}")).collect();
    sizes.dedup();
    format!("{} pictures ({})", found.len(), sizes.join(", "))
}

/// Random seed of a stochastic operator for a setting at a quality: equal for equal requests.
pub fn seed(setting: &[f64], quality: Quality) -> u32 {
    let bits = setting.iter().map(|value| value.to_bits());
    let mixed = bits.fold(u64::from(quality.0), |seed, bits| {
        mix((seed ^ bits).wrapping_add(GOLDEN))
    });
    (mixed >> 33) as u32
}
