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
/// ```
/// use footlight_host::work::Work;
/// use footlight_picture::Image;
/// use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};
///
/// /// Every source lights every pixel alike.
/// struct Flat;
/// struct Ready(usize, usize);
///
/// impl Transport for Flat {
///     fn name(&self) -> &str {
///         "flat"
///     }
///     fn finest(&self) -> Quality {
///         Quality(1)
///     }
///     fn prepare(
///         &self,
///         setup: &Setup,
///         _: Quality,
///         _: Work<'_>,
///     ) -> Result<Box<dyn Prepared>, TransportError> {
///         Ok(Box::new(Ready(setup.view.width, setup.view.height)))
///     }
///     fn cost(&self, _: &Setup, _: Quality) -> Cost {
///         Cost::default()
///     }
/// }
///
/// impl Prepared for Ready {
///     fn render(
///         &mut self,
///         settings: &[Vec<f64>],
///         _: Work<'_>,
///     ) -> Result<Vec<Image>, TransportError> {
///         let Ready(width, height) = *self;
///         let light = |setting: &Vec<f64>| setting.iter().sum::<f64>() as f32;
///         let pixels = |setting| vec![light(setting); width * height * 3];
///         let image = |setting| Image::from_data(width, height, pixels(setting));
///         Ok(settings.iter().filter_map(image).collect())
///     }
/// }
/// let _renderer: std::sync::Arc<dyn Transport> = std::sync::Arc::new(Flat);
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
    /// cost where necessary. `clock` returns seconds.
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
