//! Goals and results of refinement: plain values.

use footlight_show::units::{ErrorUnit, Time, Tolerance};
use footlight_transport::Quality;
use serde::Serialize;

/// Method for reaching a sufficient quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// The method with the fewest predicted seconds.
    #[default]
    Auto,
    /// Coarse images, and mixtures in the order of the plan (Dorsey, Arvo and Greenberg 1995).
    Paper,
    /// Each source alone at one step of quality.
    Alone,
}

impl Way {
    /// All methods.
    pub const ALL: [Way; 3] = [Way::Auto, Way::Paper, Way::Alone];

    /// Its name in options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Way::Auto => "auto",
            Way::Paper => "paper",
            Way::Alone => "alone",
        }
    }
}

/// Conditions for the end of refinement; the first one met ends it, and so does the end of the
/// plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Predicted error of the worst moment.
    pub until: Option<Tolerance>,
    /// Number of images to render now.
    pub count: Option<usize>,
    /// Seconds to spend now. An image that was begun is finished; an image that is not predicted to
    /// fit is not begun, except the first.
    pub budget: Option<f64>,
}

impl Goal {
    /// A goal of a number of images.
    pub fn count(count: usize) -> Goal {
        Goal {
            count: Some(count),
            ..Goal::default()
        }
    }

    /// A goal of an error at the worst moment, relative if a plain number (0.02 = 2 %); 0 refines
    /// to the end of the plan.
    pub fn until(error: impl Into<Tolerance>) -> Goal {
        Goal {
            until: Some(error.into()),
            ..Goal::default()
        }
    }

    /// Unit of its error.
    pub fn unit(&self) -> ErrorUnit {
        self.until.map_or(ErrorUnit::Light, |until| until.unit)
    }

    /// True when the method is to be chosen; a goal of a number of images follows the plan.
    pub fn asks_for_a_way(&self) -> bool {
        let error = self.until.is_some_and(|until| until.error > 0.0);
        self.count.is_none() && (error || self.until.is_none() && self.budget.is_some())
    }

    /// The goal, or one image for an empty goal.
    pub fn or_one(self) -> Goal {
        if self == Goal::default() {
            Goal::count(1)
        } else {
            self
        }
    }
}

/// A refinement: goal, method and view. A goal alone uses the best method and the current view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Refinement {
    /// Condition for its end.
    pub goal: Goal,
    /// Method for choosing images.
    pub way: Way,
    /// The view, by its name; `None` means the current one at the beginning.
    pub view: Option<String>,
}

impl From<Goal> for Refinement {
    fn from(goal: Goal) -> Refinement {
        Refinement {
            goal,
            ..Refinement::default()
        }
    }
}

impl Refinement {
    /// The refinement by another method.
    #[must_use]
    pub fn by(self, way: Way) -> Refinement {
        Refinement { way, ..self }
    }
}

/// State of the sequence after an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SequenceState {
    /// Refined images in the pool.
    pub refined: usize,
    /// Seconds of computing since the show was opened.
    pub seconds: f64,
    /// Predicted error of the sequence at that time, relative.
    pub error: f64,
    /// The prediction before calibration by known corrections; it never rises.
    pub forecast: f64,
}

/// The moment with the largest predicted error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstMoment {
    /// Index into [`Show::cues`](footlight_show::model::Show::cues) of the cue that runs or is complete
    /// then.
    pub cue: usize,
    /// Its time.
    pub time: Time,
    /// Predicted error.
    pub error: f64,
}

/// Reason for the end of refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The predicted error is within the goal.
    Reached,
    /// The requested number of images was rendered.
    Counted,
    /// The time is used up, or too short for another image.
    Spent,
    /// No further image would improve the sequence.
    Complete,
    /// The finest step is rendered; the requested error is below its own.
    Finest,
    /// A finer step exceeds the host's memory limit; images that fit are kept.
    Memory(TooLarge),
    /// [`Engine::stop`](super::Engine::stop) or the host's progress stopped it; finished images are
    /// kept.
    Stopped,
}

/// A quality step beyond the host's memory limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLarge {
    /// The step.
    pub quality: Quality,
    /// Least limit that would hold it, bytes.
    pub memory: usize,
}

/// Summary of a refinement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RefinementSummary {
    /// Number of images rendered or reused; images of single banks count when the goal is an error
    /// or a time.
    pub images: usize,
    /// Their computing time, seconds.
    pub seconds: f64,
    /// Predicted seconds of the next image, if they exceed the remaining time.
    pub too_long: Option<f64>,
    /// Reason for its end; `None` while it runs.
    pub ended: Option<Ended>,
}
