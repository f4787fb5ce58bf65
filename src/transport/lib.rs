//! The operator G: light settings to images, at a quality, exactly linear.
//!
//! ```text
//! Transport --prepare(Setup, Quality)--> Prepared --render(settings)--> images
//! ```
//!
//! - A [`Transport`] prepares a [`Setup`] (scene, rig and view) once. The [`Prepared`] operator then
//!   renders any settings, of either sign. [`Cost`] predicts the time.
//! - [`radiosity`] chooses one of the project's two renderers for a scene: [`hemicube`] (radiosity
//!   with exact direct light) or `gather` (final gathering by ray tracing, for many polygons). Both
//!   stand on [`surfaces`] (scene and view) and [`direct`] (direct light), and neither knows the other.
//! - [`layered`] adds banks that are given as images to what another operator renders.
//! - [`outside`] starts a program as the renderer.
//! - [`contract`] checks what every operator must check.
//!
//! Invariants:
//!
//! - At one quality G is one linear operator: mesh, order of summation and number of iterations depend
//!   on setup and quality, never on settings.
//! - Results are equal to the bit for any number of threads and in any company of other settings.
//! - [`Transport::results_version`] changes whenever an image could. For the project's own renderers
//!   `build.rs` makes it of the sources.
//! - No operator takes more memory than [`Work`] allows; it returns [`TransportError::Memory`] instead.
//!
//! This crate does not know shows, cues, files of results or the store of images. It knows a light by
//! its index in the rig.

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

/// A step on an operator's one ordered scale of quality; 1 is the cheapest.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
)]
pub struct Quality(pub u8);

/// Predicted cost: `prepare` once, `per_source` for each source that is lit for the first time,
/// `per_image` for each picture of all sources, `per_lone` for one of a source alone. In units of
/// the operator's own; [`Transport::cost_scale`] returns the seconds of one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Meshing, visibility, form factors.
    pub prepare: f64,
    /// Direct light and radiosity of one newly lit source.
    pub per_source: f64,
    /// Composing one picture of all sources.
    pub per_image: f64,
    /// Composing one picture of a source alone.
    pub per_lone: f64,
}

impl Cost {
    /// Of so many sources, each lit alone, from nothing prepared.
    pub fn alone(self, sources: f64) -> f64 {
        self.prepare + sources * (self.per_source + self.per_lone)
    }
}

/// A warning about an operator's pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TransportWarning {
    /// They are not linear in the light, or noisy without the operator saying so
    /// ([`Transport::samples`]): previews made of them err by as much.
    NotLinear {
        /// How far the sum of two pictures is off the picture of the sum, relative.
        sum: f64,
        /// How far twice a picture is off the picture of twice the light, relative.
        double: f64,
    },
    /// None of them has any light.
    Black {
        /// How many.
        pictures: usize,
    },
    /// Some have negative light and no positive one.
    Negative {
        /// How many.
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

/// What a step of quality sets on a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualityParameter {
    /// What is set.
    pub name: &'static str,
    /// To what; 0 for what the step does without.
    pub amount: f64,
}

/// Why an operator could not prepare or render.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// The embedding program asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// It would need more memory than the budget allows.
    #[error(
        "{what}: {} MB are needed and {} MB are left of the memory allowed; allow at least {} MB more \
         with `--memory MB`, or make less of it: a smaller `size` of the view, a simpler stage, fewer \
         lights, banks and cues",
        needed.div_ceil(1 << 20),
        budget >> 20,
        needed.saturating_sub(*budget).div_ceil(1 << 20)
    )]
    Memory {
        /// What is too large.
        what: &'static str,
        /// Bytes needed.
        needed: usize,
        /// Bytes allowed.
        budget: usize,
    },
    /// The quality is not on the operator's scale.
    #[error("quality {0} is not on the scale 1 to {1}")]
    Quality(u8, u8),
    /// A setting has the wrong number of coordinates, or one that is not finite.
    #[error("a setting must have {expected} finite coordinates")]
    Setting {
        /// Number of sources of the rig.
        expected: usize,
    },
    /// An operator gave too few pictures, too many, or some of another size than the view's.
    #[error(
        "the renderer gave {} for {settings} settings of a view of {}x{}: one of that size is due for \
         each", gave(.found), view.0, view.1
    )]
    Pictures {
        /// Width and height of each picture that it gave.
        found: Vec<(usize, usize)>,
        /// How many it was asked for.
        settings: usize,
        /// Width and height of the view.
        view: (usize, usize),
    },
    /// An outside renderer gave no picture.
    #[error(transparent)]
    Outside(#[from] outside::OutsideError),
    /// The scene, rig or view cannot be used.
    #[error("{0}")]
    Scene(String),
}

/// A light-transport operator, before it has a scene. An embedding program may give its own.
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

    /// Name and version of its pictures, another one whenever they change; `None` where pictures
    /// of one session must not be taken for those of another.
    ///
    /// An operator that names its results promises that a picture depends on scene, view, quality
    /// and the lights that are lit alone, by their strength in each channel, and that channels do
    /// not mix: pictures are then kept on disk, found again after edits, and added up.
    fn results_version(&self) -> Option<String> {
        None
    }

    /// The finest step of its scale, which starts at 1.
    fn finest(&self) -> Quality;

    /// All that does not depend on settings: meshing, visibility, form factors.
    ///
    /// # Errors
    /// [`TransportError`] when the quality is off the scale, the setup unusable, the memory budget
    /// too small, or on cancel.
    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError>;

    /// What the user should be warned of, as far as it has been measured.
    fn warnings(&self) -> Vec<TransportWarning> {
        Vec::new()
    }

    /// What a step of quality sets for this setup; empty where the operator does not know.
    ///
    /// # Errors
    /// [`TransportError`] for a quality or setup that cannot be used.
    fn quality_parameters(
        &self,
        _setup: &Setup,
        _quality: Quality,
    ) -> Result<Vec<QualityParameter>, TransportError> {
        Ok(Vec::new())
    }

    /// How many seconds a unit of [`Transport::cost`] takes on this machine now, found by a short
    /// task of known cost where that is needed. `clock` returns seconds.
    ///
    /// # Errors
    /// [`TransportError`] when that task fails, and on cancel.
    fn cost_scale(&self, _clock: &dyn Fn() -> f64, _work: Work<'_>) -> Result<f64, TransportError> {
        Ok(1.0)
    }

    /// Bytes that preparing this setup takes at least, whatever the quality, as far as that is known
    /// without work.
    fn least_bytes(&self, _setup: &Setup) -> usize {
        0
    }

    /// What pictures of this setup at this quality are usually off by, relative to their light. It falls
    /// with the quality. Once a picture is measured by [`Transport::estimator`], only the ratios between
    /// steps count. `None` where the operator does not know; errors are then estimated from two steps.
    fn usual_error(&self, _: &Setup, _: Quality) -> Option<f64> {
        None
    }

    /// Samples a pixel at a step, in a unit of the operator's own, where its pictures are right in the
    /// mean and noisy, each by chance of its own: the variance falls as these grow. `None` where
    /// pictures have no noise, or nothing is known of it.
    fn samples(&self, _quality: Quality) -> Option<f64> {
        None
    }

    /// Predicted cost for this setup and quality, in units of [`Transport::cost_scale`].
    fn cost(&self, setup: &Setup, quality: Quality) -> Cost;

    /// True where [`Transport::estimator`] can measure pictures of a setup.
    fn is_measurable(&self, _: &Setup) -> bool {
        false
    }

    /// What estimates pixels of a setup independently of pictures, to measure their error; `None`
    /// where the operator has nothing of the kind.
    ///
    /// # Errors
    /// [`TransportError`] for a setup that cannot be used, a budget too small, or on cancel.
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
    /// Two independent estimates of each pixel's radiance (three channels, units as
    /// [`Prepared::render`]) under a setting, each the mean over the paths of these numbers. A pixel is
    /// its index, row by row from the top. One that shows a part of a light is not a number: how much
    /// of it there is would decide.
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
    /// One picture for each of the `settings`, in their order, each of the size of the view; a setting
    /// has one finite number (of any sign) for every source of the rig. A pixel is the radiance that
    /// comes from there, linear and not exposed: cd/m2 where the lights are in candela or lumens (a
    /// matt surface sends reflectance / pi times its illuminance). The picture of a sum of settings
    /// must be the sum of their pictures, as previews are made so. Work that settings share is done
    /// once and kept for later calls.
    ///
    /// A loop that takes longer than a tenth of a second calls [`Work::check`], which says when to
    /// stop, and may tell how far it is by `work.progress`; the engine itself tells no more than
    /// "refined pictures", "banks" and "key images".
    ///
    /// # Errors
    /// [`TransportError`] for a wrong setting, a budget too small, or on cancel. The engine refuses
    /// pictures of another number or size by [`TransportError::Pictures`].
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError>;

    /// Bytes that it holds between calls, about; 0 where it does not count them.
    fn bytes(&self) -> usize {
        0
    }
}

fn gave(found: &[(usize, usize)]) -> String {
    let mut sizes: Vec<String> = found.iter().map(|(w, h)| format!("{w}x{h}")).collect();
    sizes.dedup();
    format!("{} pictures ({})", found.len(), sizes.join(", "))
}

/// What an operator with chance draws its numbers from for a setting at a quality: the same whenever the
/// same image is asked for.
pub fn seed(setting: &[f64], quality: Quality) -> u32 {
    let bits = setting.iter().map(|value| value.to_bits());
    let mixed = bits.fold(u64::from(quality.0), |seed, bits| {
        mix((seed ^ bits).wrapping_add(GOLDEN))
    });
    (mixed >> 33) as u32
}
