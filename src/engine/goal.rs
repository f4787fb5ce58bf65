//! What refinement is asked for, and what it came to: plain values.

use footlight_show::units::{ErrorUnit, Time, Tolerance};
use footlight_transport::Quality;
use serde::Serialize;

/// How a sequence becomes good enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// Whichever is predicted to take the fewest seconds.
    #[default]
    Auto,
    /// Coarse images, and mixtures in the order of the plan (Dorsey, Arvo and Greenberg 1995).
    Paper,
    /// Each source alone at one step of quality.
    Alone,
}

impl Way {
    /// All of them.
    pub const ALL: [Way; 3] = [Way::Auto, Way::Paper, Way::Alone];

    /// As options and reports write it.
    pub fn name(self) -> &'static str {
        match self {
            Way::Auto => "auto",
            Way::Paper => "paper",
            Way::Alone => "alone",
        }
    }
}

/// When to stop refining; the first of these that is met ends it, and so does the end of the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Predicted error of the worst moment.
    pub until: Option<Tolerance>,
    /// Number of images to render now.
    pub count: Option<usize>,
    /// Seconds to spend now; an image that is begun is finished, one that is not predicted to fit
    /// is not begun, but for the first.
    pub budget: Option<f64>,
}

impl Goal {
    /// A number of images.
    pub fn count(count: usize) -> Goal {
        Goal {
            count: Some(count),
            ..Goal::default()
        }
    }

    /// An error of the worst moment, as a plain number relative (0.02 = 2 %); 0 refines to the end
    /// of the plan.
    pub fn until(error: impl Into<Tolerance>) -> Goal {
        Goal {
            until: Some(error.into()),
            ..Goal::default()
        }
    }

    /// What its error is measured in.
    pub fn unit(&self) -> ErrorUnit {
        self.until.map_or(ErrorUnit::Light, |until| until.unit)
    }

    /// Whether it leaves open which images are rendered: for a number of them the plan's next are.
    pub fn asks_for_a_way(&self) -> bool {
        let error = self.until.is_some_and(|until| until.error > 0.0);
        self.count.is_none() && (error || self.until.is_none() && self.budget.is_some())
    }

    /// One image where nothing is said.
    pub fn or_one(self) -> Goal {
        if self == Goal::default() {
            Goal::count(1)
        } else {
            self
        }
    }
}

/// What is to be refined: how far, by which way, seen from where. A goal alone is one by the best
/// way, from the view that the engine looks from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Refinement {
    /// When to stop.
    pub goal: Goal,
    /// How images are chosen.
    pub way: Way,
    /// The view, by its name; `None`: that which the engine looks from when it begins.
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
    /// The same by another way.
    #[must_use]
    pub fn by(self, way: Way) -> Refinement {
        Refinement { way, ..self }
    }
}

/// Where the sequence stood after an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Refined images in the pool.
    pub refined: usize,
    /// Seconds of computing since the show was opened.
    pub seconds: f64,
    /// Predicted error of the sequence, relative, as it was known then.
    pub error: f64,
    /// The same before it was calibrated by known corrections; it never rises.
    pub forecast: f64,
}

/// The moment that is predicted to be furthest off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstMoment {
    /// Index into [`Show::cues`](footlight_show::model::Show::cues) of the cue that runs or is complete
    /// then.
    pub cue: usize,
    /// When.
    pub time: Time,
    /// Predicted error.
    pub error: f64,
}

/// Why refinement ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The predicted error is within what was asked for.
    Reached,
    /// As many images as asked for were rendered.
    Counted,
    /// The time is used up, or too short for another image.
    Spent,
    /// Nothing is left that another image would improve.
    Complete,
    /// The finest step is there; the error asked for is below what it is itself off by.
    Finest,
    /// A finer step does not fit into the memory that the host allows; the images that fit are there.
    Memory(TooLarge),
    /// [`Engine::stop`](super::Engine::stop) or the host's progress stopped it; what is finished is kept.
    Stopped,
}

/// A step of quality that does not fit into the memory that the host allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLarge {
    /// The step.
    pub quality: Quality,
    /// Bytes that a host has to allow for it, at least.
    pub memory: usize,
}

/// Why refinement ended before its time did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Warning {
    /// The next image is predicted to take longer than what is left.
    DoesNotFit {
        /// Its predicted seconds.
        seconds: f64,
    },
}

/// What a refinement did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RefinementSummary {
    /// Images that it rendered or took up; those of every bank alone count where the goal is an error
    /// or a time.
    pub images: usize,
    /// Seconds of computing them.
    pub seconds: f64,
    /// Why it ended early.
    pub warnings: Vec<Warning>,
    /// Why it ended; `None` while it goes on.
    pub ended: Option<Ended>,
}
