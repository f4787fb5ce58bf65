//! The model of a show (the IR): its meaning, without syntax and spans.
//!
//! `lang` lowers text to a [`Show`]; `timeline` turns it into curves. Names are resolved to
//! indices; each statement that can turn out wrong later carries an opaque [`NodeId`], which
//! `lang`'s span map turns back into a place. Invariants (kept by `lang`, relied upon elsewhere):
//! indices are valid; cues are sorted by number, numbers unique; a parameter is moved at most once
//! in a cue; levels are fractions of full, those of fades and knots within 0 to 1; path knots start
//! at time 0 and increase strictly; durations are not negative; the last cue links to nothing; a
//! cue that another one starts waits for GO; clock times do not decrease from cue to cue.

mod effect;
mod fade;
mod haze;
mod head;
mod light;

pub use self::effect::{Effect, EffectChange, EffectKind};
pub use self::fade::{FADES, Fade, FadeCurve};
pub use self::haze::Haze;
pub use self::head::{Head, HeadAxis, Point, Pose};
pub use self::light::{ImageFile, ImportedLuminaire, LightKind, Luminaire, Output, Spot, Strength};

use std::ops::Range;

use crate::geometry::shape::Shape;
use crate::geometry::solid::Solid;
use crate::geometry::{self, Place};
use crate::units::{CueNumber, Rgb, Time, Tolerance, ToneCurve};

/// Identifies a statement or a part of one; meaningful only to the span map made with the show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// A whole show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Show {
    /// Its title.
    pub title: String,
    /// Settings of previews and plans.
    pub preview: Preview,
    /// Geometry files, in order.
    pub stages: Vec<Stage>,
    /// Materials declared or replaced in the show.
    pub surfaces: Vec<Surface>,
    /// Haze in the air; `None` for clear air.
    pub haze: Option<Haze>,
    /// The `haze` statement, if there is one.
    pub haze_id: Option<NodeId>,
    /// Cameras; the first is current.
    pub views: Vec<NamedView>,
    /// Luminaires.
    pub lights: Vec<Luminaire>,
    /// Points where heads can aim; after the declared ones the places that cues write, `0, 2, 1`.
    pub points: Vec<Point>,
    /// Banks, in order of declaration: the varying coordinates.
    pub banks: Vec<Bank>,
    /// Lights that never vary.
    pub fixed: Vec<Fixed>,
    /// Named selections.
    pub groups: Vec<Group>,
    /// Named sets of levels.
    pub looks: Vec<Look>,
    /// Named curves (fades and dimmers refer to them).
    pub curves: Vec<NamedCurve>,
    /// Effects, which parts refer to.
    pub effects: Vec<Effect>,
    /// Lighting changes, sorted by number.
    pub cues: Vec<Cue>,
}

/// The `preview` statement: defaults for plan, run and play.
#[derive(Clone, Debug, PartialEq)]
pub struct Preview {
    /// Error of the worst moment to refine to.
    pub tolerance: Tolerance,
    /// Assumed wait between a cue's completion and the next GO when the text gives no time.
    pub gap: Time,
    /// Frames a second.
    pub rate: f64,
    /// Exposure in stops; `None` = automatic over the whole sequence.
    pub exposure: Option<f64>,
    /// Stops added to an automatic exposure.
    pub bias: f64,
    /// The colour temperature that shows as white, kelvin; `None` for no adaptation.
    pub white: Option<f64>,
    /// Tone curve from light to displayed brightness.
    pub tone: ToneCurve,
    /// Quality step of coarse images.
    pub coarse: u8,
    /// Quality step of refined images.
    pub refined: u8,
}

impl Default for Preview {
    fn default() -> Preview {
        Preview {
            tolerance: Tolerance::from(0.02),
            gap: Time::from_micros(5_000_000),
            rate: 25.0,
            exposure: None,
            bias: 0.0,
            white: None,
            tone: ToneCurve::default(),
            coarse: 1,
            refined: 2,
        }
    }
}

/// A geometry file next to the show.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// The statement.
    pub id: NodeId,
    /// Path relative to the show's folder.
    pub path: String,
    /// True when the file's up axis is Z (default: Y up, turned on reading).
    pub z_up: bool,
    /// Its scale and placement.
    pub place: Place,
    /// True when double-sided materials of a glTF file get a front only.
    pub one_sided: bool,
    /// True when no material is glossy, whatever the file says.
    pub matt: bool,
}

/// A material declared in the show: it replaces the stage's material of that name, or belongs to
/// the show's own solids.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The statement.
    pub id: NodeId,
    /// The material's name.
    pub name: String,
    /// Diffuse reflectance, linear, 0 to 1; `None` keeps the stage's.
    pub reflectance: Option<Rgb>,
    /// Roughness of its gloss, 0 (a mirror) to 1; `None` keeps the stage's, or means matt.
    pub gloss: Option<f64>,
    /// Solids made of it; empty when it replaces a material.
    pub solids: Vec<Solid>,
}

/// A named camera.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedView {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// The camera; only its size counts when `imported` is set.
    pub camera: geometry::View,
    /// Name of the camera in the stage's files.
    pub imported: Option<String>,
}

/// Lights that always vary in unison: one coordinate, or three when `rgb`, which share a level.
#[derive(Clone, Debug, PartialEq)]
pub struct Bank {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Indices into [`Show::lights`].
    pub lights: Vec<usize>,
    /// Console channel.
    pub channel: Option<u32>,
    /// The law from level to light.
    pub dimmer: Dimmer,
    /// True for three emitters: coordinates `NAME.r`, `NAME.g`, `NAME.b`.
    pub rgb: bool,
}

/// The law from level to setting, both 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dimmer {
    /// Setting = level.
    Linear,
    /// Setting = level squared.
    Square,
    /// A named curve of [`Show::curves`], from level to setting.
    Curve(usize),
}

/// Lights that stay at one level throughout.
#[derive(Clone, Debug, PartialEq)]
pub struct Fixed {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Indices into [`Show::lights`].
    pub lights: Vec<usize>,
    /// Level, 0 to 1.
    pub level: f64,
}

/// A named selection of banks.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Indices into [`Show::banks`].
    pub banks: Vec<usize>,
}

/// A named set of levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Parameter and level (0 to 1), in order of parameters, each once.
    pub levels: Vec<(usize, f64)>,
}

/// Interpolation of a curve between its knots; all are piecewise polynomials of degree at most 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Holds each value until the next knot. Degree 0, with jumps.
    Steps,
    /// Straight between knots. Degree 1.
    Linear,
    /// C2 cubic spline, second derivative zero at both ends.
    Natural,
    /// C2 cubic spline, first derivative zero at both ends.
    Clamped,
    /// Cubic Hermite; slope at a knot is the chord of its neighbours, one-sided at the ends.
    CatmullRom,
    /// Cubic Hermite that does not overshoot (Fritsch and Butland's harmonic slopes; zero at
    /// local extremes).
    Monotone,
    /// Cubic Hermite with each knot's slope given.
    Hermite,
    /// Each span's two inner Bernstein coefficients given (at thirds of the span).
    Bezier,
}

/// A knot of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Time since the path's start.
    pub time: Time,
    /// Level, 0 to 1.
    pub level: f64,
    /// [`Interpolation::Hermite`]: slope here, in levels a second; else 0.
    pub slope: f64,
    /// [`Interpolation::Bezier`]: inner coefficients of the span that starts here; else the level.
    pub handles: [f64; 2],
}

/// A function of time in absolute levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Interpolation between knots.
    pub interpolation: Interpolation,
    /// At least one, the first at time 0.
    pub knots: Vec<Knot>,
}

/// A knot of a named curve: both numbers are fractions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveKnot {
    /// Fraction of the fade's time (or the level, for a dimmer), 0 to 1.
    pub at: f64,
    /// Completion (or setting), 0 to 1.
    pub value: f64,
    /// [`Interpolation::Hermite`]: slope, value per unit of `at`.
    pub slope: f64,
    /// [`Interpolation::Bezier`]: inner coefficients of the span that starts here.
    pub handles: [f64; 2],
}

/// A named curve: time fraction to completion, or level to light.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCurve {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Interpolation between knots.
    pub interpolation: Interpolation,
    /// First `at` 0, last 1.
    pub knots: Vec<CurveKnot>,
}

/// The start of a cue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// The operator's GO, or the `follow` or `hang` of the previous cue.
    Go,
    /// A clock time.
    At(Time),
}

/// Start of the NEXT cue by this one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Link {
    /// Starts it at this time after this cue's GO.
    Follow(Time),
    /// Starts it at this time after this cue's completion; may be negative.
    Hang(Time),
}

/// A numbered lighting change.
#[derive(Clone, Debug, PartialEq)]
pub struct Cue {
    /// The statement.
    pub id: NodeId,
    /// Its number.
    pub number: CueNumber,
    /// Its label; may be empty.
    pub label: String,
    /// Note for the operator; may be empty.
    pub note: String,
    /// Its start.
    pub trigger: Trigger,
    /// Its link to the next cue, with the node of the link.
    pub link: Option<(NodeId, Link)>,
    /// No level tracks through it when the show is edited (the curves do not change).
    pub block: bool,
    /// Tracked levels are restated with this cue's times, so that earlier fades end here.
    pub assert: bool,
    /// The next cue restores what this one moved.
    pub cueonly: bool,
    /// All its functions of time; the first holds the moves directly in the cue.
    pub parts: Vec<Part>,
}

/// Functions of time for some coordinates, with common timing.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The statement.
    pub id: NodeId,
    /// Its number within the cue, from 1.
    pub number: u32,
    /// True for a part in the text or the moves directly in a cue; false for a single move with
    /// timing.
    pub written: bool,
    /// Its label; may be empty.
    pub label: String,
    /// Wait after the cue's GO.
    pub delay: Time,
    /// Duration of rising fades.
    pub up: Time,
    /// Duration of falling fades.
    pub down: Time,
    /// True for a time, up or down, that is the show's default.
    pub by_default: [bool; 2],
    /// Shape of the fades.
    pub curve: Fade,
    /// Its moves, in order of parameters; a parameter is moved once in the whole cue.
    pub moves: Vec<Move>,
    /// Effects that begin or end when the moves start; each bank once in the whole cue.
    pub effects: Vec<EffectChange>,
}

/// One parameter's motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// The statement.
    pub id: NodeId,
    /// Index into [`Show::parameters`].
    pub parameter: usize,
    /// The motion.
    pub motion: Motion,
    /// Number of passes, at least 1; each pass of a fade starts from the first pass's start.
    pub repeat: u32,
}

/// A fade from the current level, or a path of absolute levels.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Fades to a level, 0 to 1, in the part's up or down time (`up` when the level stays equal).
    To(f64),
    /// Follows a path, in the path's own time.
    Path(Path),
}

impl Motion {
    /// The highest level written in it, 0 to 1.
    pub fn brightest(&self) -> f64 {
        match self {
            Motion::To(level) => *level,
            Motion::Path(path) => path.knots.iter().map(|k| k.level).fold(0.0, f64::max),
        }
    }

    /// The final level, 0 to 1.
    pub fn target(&self) -> f64 {
        match self {
            Motion::To(level) => *level,
            Motion::Path(path) => path.knots.last().map_or(0.0, |k| k.level),
        }
    }
}

/// One dimension of a setting, or one parameter of cues.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coordinate {
    /// `lamps`, `sky.r`, or `fixed`.
    pub name: String,
    /// The bank to which it belongs; `None` for the fixed lights.
    pub bank: Option<usize>,
    /// Its role.
    pub role: Role,
}

/// Role of a coordinate or a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The level of a bank, or the light of a bank that is not rgb.
    Level,
    /// One of the three emitters of an rgb bank.
    Emitter(usize),
    /// The fixed lights.
    Fixed,
    /// A pose parameter of a head of [`Show::heads`]; the bank is the head's.
    Pose(usize, HeadAxis),
}

impl Coordinate {
    /// Index of its emitter in an rgb bank.
    pub fn emitter(&self) -> Option<usize> {
        match self.role {
            Role::Emitter(emitter) => Some(emitter),
            _ => None,
        }
    }
}

impl Show {
    /// The dimensions of a setting: one for each bank, three for an rgb bank, then one for the
    /// fixed lights, if any.
    pub fn coordinates(&self) -> Vec<Coordinate> {
        let mut out = Vec::new();
        for (i, bank) in self.banks.iter().enumerate() {
            let names: &[&str] = if bank.rgb { &[".r", ".g", ".b"] } else { &[""] };
            for (c, suffix) in names.iter().enumerate() {
                out.push(Coordinate {
                    name: format!("{}{suffix}", bank.name),
                    bank: Some(i),
                    role: if bank.rgb {
                        Role::Emitter(c)
                    } else {
                        Role::Level
                    },
                });
            }
        }
        if !self.fixed.is_empty() {
            out.push(Coordinate {
                name: "fixed".to_owned(),
                bank: None,
                role: Role::Fixed,
            });
        }
        out
    }

    /// The parameters of cues, each 0 to 1. Each bank has its level; an rgb bank also has its
    /// colour (`sky`, `sky.r`, `sky.g`, `sky.b`), the light of each emitter with the level at full.
    /// Then come the fixed lights, if any, which no cue moves, and four parameters of each head
    /// (`mh1.pan`, `mh1.tilt`, `mh1.beam`, `mh1.field`).
    pub fn parameters(&self) -> Vec<Coordinate> {
        let mut out = Vec::new();
        for coordinate in self.coordinates() {
            if coordinate.role == Role::Emitter(0) {
                let bank = coordinate.bank.and_then(|b| self.banks.get(b));
                out.push(Coordinate {
                    name: bank.map_or_else(String::new, |b| b.name.clone()),
                    role: Role::Level,
                    ..coordinate.clone()
                });
            }
            out.push(coordinate);
        }
        for (i, (light, _, bank)) in self.heads().into_iter().enumerate() {
            let light = self.lights.get(light).map_or("", |l| l.name.as_str());
            out.extend(HeadAxis::ALL.map(|axis| Coordinate {
                name: format!("{light}.{}", axis.word()),
                bank: Some(bank),
                role: Role::Pose(i, axis),
            }));
        }
        out
    }

    /// Every parameter before the first cue: levels at 0, emitters at full, heads at home.
    pub fn dark_levels(&self) -> Vec<f64> {
        let heads = self.heads();
        let at_first = |p: Coordinate| match p.role {
            Role::Level | Role::Fixed => 0.0,
            Role::Emitter(_) => 1.0,
            Role::Pose(head, axis) => heads.get(head).map_or(0.0, |(_, head, _)| {
                head.parameter(axis, head.home.angle(axis))
            }),
        };
        self.parameters().into_iter().map(at_first).collect()
    }

    /// The heads in banks, in order of lights: index of the light, head, index of its bank.
    pub fn heads(&self) -> Vec<(usize, &Head, usize)> {
        let heads = self.lights.iter().enumerate();
        let heads: Vec<(usize, &Head)> = heads
            .filter_map(|(i, l)| Some((i, l.head.as_ref()?)))
            .collect();
        if heads.is_empty() {
            return Vec::new();
        }
        let mut banks = vec![None; self.lights.len()];
        for (b, bank) in self.banks.iter().enumerate() {
            for light in &bank.lights {
                if let Some(slot) = banks.get_mut(*light) {
                    *slot = Some(b);
                }
            }
        }
        let in_bank = heads.into_iter();
        in_bank
            .filter_map(|(i, head)| Some((i, head, banks.get(i).copied().flatten()?)))
            .collect()
    }

    /// The first parameter of heads; each head has four, in the order of [`HeadAxis::ALL`].
    pub fn first_pose(&self) -> usize {
        let banks = self.first_parameters().pop().unwrap_or(0);
        banks + usize::from(!self.fixed.is_empty())
    }

    /// The first parameter of one head of [`Show::heads`].
    pub fn first_pose_of(&self, head: usize) -> usize {
        self.first_pose() + HeadAxis::ALL.len() * head
    }

    /// The pose of a head of [`Show::heads`] at these parameters of the show.
    pub fn pose_of(&self, parameters: &[f64], head: usize) -> Pose {
        let first = self.first_pose_of(head);
        let own = parameters.get(first..first + 4);
        match (
            own.and_then(|own| own.try_into().ok()),
            self.heads().get(head),
        ) {
            (Some(own), Some((_, head, _))) => head.pose(own),
            _ => Pose::default(),
        }
    }

    /// The coordinates of a bank, which are contiguous.
    pub fn coordinates_of(&self, bank: usize) -> Range<usize> {
        let width = |bank: &Bank| if bank.rgb { 3 } else { 1 };
        let first = self.banks.iter().take(bank).map(width).sum();
        first..first + self.banks.get(bank).map_or(0, width)
    }

    /// The first parameter of each bank; the last entry is the end of the banks' parameters.
    pub fn first_parameters(&self) -> Vec<usize> {
        let mut out = vec![0];
        for bank in &self.banks {
            let next = out.last().copied().unwrap_or(0);
            out.push(next + if bank.rgb { 4 } else { 1 });
        }
        out
    }

    /// Makes the view of this name the first; an unknown name changes nothing.
    pub fn look_from(&mut self, name: &str) {
        if let Some(at) = self.views.iter().position(|view| view.name == name) {
            let view = self.views.remove(at);
            self.views.insert(0, view);
        }
    }

    /// The first view, which is the current one.
    pub fn view(&self) -> Option<&NamedView> {
        self.views.first()
    }

    /// The sphere and disc lights, by name.
    pub fn shapes(&self) -> impl Iterator<Item = (&str, Shape)> {
        self.lights.iter().filter_map(|light| match light.kind {
            LightKind::Shape { shape, .. } => Some((light.name.as_str(), shape)),
            _ => None,
        })
    }

    /// The images given as banks and fixed lights, with their statements.
    pub fn images(&self) -> impl Iterator<Item = (NodeId, &ImageFile)> {
        self.lights.iter().filter_map(|light| match &light.kind {
            LightKind::Image(file) => Some((light.id, file)),
            _ => None,
        })
    }
}
