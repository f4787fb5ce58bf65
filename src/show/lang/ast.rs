//! The syntax tree between the grammar and the model.
//!
//! Invariants: texts are slices of the source; a [`Span`] is a byte range on character boundaries
//! and covers the whole node unless documented otherwise; lists are in the order of the text. Only
//! the grammar is checked: names are words, quantities are texts.

use std::ops::Range;

use crate::model::Interpolation;

/// A byte range of one source file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// Index of the file among the sources.
    pub file: u32,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The span as a range of bytes.
    pub fn range(self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A piece of the source.
#[derive(Clone, Copy, Debug)]
pub struct Word<'a> {
    /// The text as written.
    pub text: &'a str,
    pub span: Span,
}

/// A statement of the file.
#[derive(Debug)]
pub struct Statement<'a> {
    pub span: Span,
    pub item: Declaration<'a>,
}

/// The statements.
#[derive(Debug)]
pub enum Declaration<'a> {
    /// `show "…"`
    Show(Word<'a>),
    /// `preview { … }`: key, value, and the stops after `auto`.
    Preview(Vec<(Word<'a>, Word<'a>, Option<Word<'a>>)>),
    /// `include "…"`; the position of the statement identifies the file.
    Include,
    /// `gels "…"`; the position of the statement identifies the file.
    Gels,
    /// `let NAME = …`
    Let {
        name: Word<'a>,
        /// A colour, or a sum.
        value: Word<'a>,
    },
    /// `stage "…" z up one-sided matt`
    Stage {
        path: Word<'a>,
        clauses: Vec<Clause<'a>>,
    },
    /// `surface NAME reflectance … box …`
    Surface {
        material: Word<'a>,
        /// One entry for each time the clause is written.
        reflectances: Vec<Vec<Word<'a>>>,
        clauses: Vec<Clause<'a>>,
        solids: Vec<Solid<'a>>,
    },
    /// `figure at P …`
    Figure(Vec<Clause<'a>>),
    /// `haze 60m …`, `haze 0.05/m …`
    Haze {
        amount: Word<'a>,
        clauses: Vec<Clause<'a>>,
    },
    /// `view NAME …`
    View {
        name: Word<'a>,
        clauses: Vec<Clause<'a>>,
    },
    /// `light NAME …`
    Light(Light<'a>),
    /// `point NAME = P`: three lengths.
    Point { name: Word<'a>, at: Vec<Word<'a>> },
    /// `bank NAME = …`, `bank NAME image …`
    Bank(Bank<'a>),
    /// `fixed NAME = … level …`, `fixed NAME image … level …`
    Fixed {
        name: Word<'a>,
        lights: Vec<Word<'a>>,
        image: Option<ImageWords<'a>>,
        level: Option<Word<'a>>,
    },
    /// `group NAME = …`
    Group {
        name: Word<'a>,
        banks: Vec<Word<'a>>,
    },
    /// `look NAME …`
    Look {
        name: Word<'a>,
        terms: Vec<Term<'a>>,
    },
    /// `default time …`
    Default(Timing<'a>),
    /// `curve NAME = …`
    Curve { name: Word<'a>, path: Path<'a> },
    /// `effect NAME = …`
    Effect {
        name: Word<'a>,
        /// `flicker` or `pulse`.
        kind: Word<'a>,
        clauses: Vec<Clause<'a>>,
    },
    /// `cue NUMBER …`
    Cue(Cue<'a>),
}

/// A clause of a light, a view or the haze: a keyword (empty for a bare quantity or colour) and its values.
#[derive(Debug)]
pub struct Clause<'a> {
    /// `at`, `aim`, `beam`, `field`, `moves`, `from`, `to`, `fov`, `lens`, `roll`, `size`, `forward`, `albedo`, or the value itself when bare.
    pub word: Word<'a>,
    /// Values after the keyword: none, one value, two of a range, or three of a position.
    pub values: Vec<Word<'a>>,
    pub span: Span,
}

impl<'a> Clause<'a> {
    /// The first clause with this keyword.
    pub fn find<'c>(clauses: &'c [Clause<'a>], word: &str) -> Option<&'c Clause<'a>> {
        clauses.iter().find(|clause| clause.word.text == word)
    }

    /// The first value of that clause.
    pub fn value<'c>(clauses: &'c [Clause<'a>], word: &str) -> Option<&'c Word<'a>> {
        Clause::find(clauses, word)?.values.first()
    }
}

/// `box from P to P`, `quad P P P P` …
#[derive(Debug)]
pub struct Solid<'a> {
    /// `quad`, `box`, `disc`, `cylinder` or `sphere`.
    pub kind: Word<'a>,
    /// Three lengths of each of a quad's four corners.
    pub corners: Vec<Word<'a>>,
    pub clauses: Vec<Clause<'a>>,
    pub span: Span,
}

/// `light NAME KIND clauses`
#[derive(Debug)]
pub struct Light<'a> {
    pub name: Word<'a>,
    /// `spot`, `panel`, `sphere`, `disc`, `photometric`, `project` or `like`.
    pub kind: Word<'a>,
    /// The panel's material, the file, or the light that this one is like.
    pub of: Option<Word<'a>>,
    pub clauses: Vec<Clause<'a>>,
}

/// `image "FILE" layer "NAME"`
#[derive(Clone, Copy, Debug)]
pub struct ImageWords<'a> {
    /// The file.
    pub path: Word<'a>,
    /// The layer, if one is named.
    pub layer: Option<Word<'a>>,
}

/// `bank NAME = lights options`, `bank NAME image … options`
#[derive(Debug)]
pub struct Bank<'a> {
    pub name: Word<'a>,
    /// Names of lights; none when it is an image.
    pub lights: Vec<Word<'a>>,
    /// Its image, in place of lights.
    pub image: Option<ImageWords<'a>>,
    /// `channel N`, one entry for each time it is written.
    pub channels: Vec<Word<'a>>,
    /// `dimmer NAME`, one entry for each time it is written.
    pub dimmers: Vec<Word<'a>>,
    /// `rgb`
    pub rgb: bool,
}

/// A bank, a group, a look, or one emitter of an rgb bank.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// The name.
    pub name: Word<'a>,
    /// `r`, `g` or `b`.
    pub channel: Option<Word<'a>>,
    pub span: Span,
}

/// A term of a look: another look, or levels.
#[derive(Clone, Debug)]
pub enum Term<'a> {
    Look(Word<'a>),
    Levels(Vec<Level<'a>>),
}

/// `lamps 40` in a look.
#[derive(Clone, Debug)]
pub struct Level<'a> {
    pub target: Target<'a>,
    /// A quantity, `full`, `out` or a colour.
    pub value: Word<'a>,
    /// A colour after a level, or a level after a colour.
    pub second: Option<Word<'a>>,
}

/// A function of time or of a fraction.
#[derive(Clone, Debug)]
pub struct Path<'a> {
    /// The interpolation between knots.
    pub interpolation: Interpolation,
    /// At least one.
    pub knots: Vec<Knot<'a>>,
    pub span: Span,
}

/// A knot of a path.
#[derive(Clone, Debug)]
pub struct Knot<'a> {
    /// Time or fraction.
    pub at: Word<'a>,
    /// Level or colour.
    pub value: Word<'a>,
    /// Slope, after `slope`.
    pub slope: Option<Word<'a>>,
    /// Inner levels, after `via`.
    pub via: Option<(Word<'a>, Word<'a>)>,
    pub span: Span,
}

/// A timing word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimingKind {
    /// `time 5`, `time 4/3`
    Time,
    /// `up 6`
    Up,
    /// `down 9`
    Down,
    /// `delay 2`
    Delay,
    /// `snap`
    Snap,
    /// `curve dawn`
    Curve,
    /// `repeat 3`
    Repeat,
}

impl TimingKind {
    /// The word as written.
    pub fn word(self) -> &'static str {
        match self {
            TimingKind::Time => "time",
            TimingKind::Up => "up",
            TimingKind::Down => "down",
            TimingKind::Delay => "delay",
            TimingKind::Snap => "snap",
            TimingKind::Curve => "curve",
            TimingKind::Repeat => "repeat",
        }
    }
}

/// A timing word with its values.
#[derive(Clone, Copy, Debug)]
pub struct Timing<'a> {
    pub kind: TimingKind,
    pub value: Option<Word<'a>>,
    /// `time UP/DOWN`: the second value.
    pub second: Option<Word<'a>>,
    pub span: Span,
}

/// `cue NUMBER "label" at T { … }`
#[derive(Debug)]
pub struct Cue<'a> {
    pub number: Word<'a>,
    /// Its label, with the quotes.
    pub label: Option<Word<'a>>,
    /// `at` in the header.
    pub at: Option<Word<'a>>,
    /// Content of the braces.
    pub body: Body<'a>,
}

/// Content of the braces of a cue or a part.
#[derive(Debug, Default)]
pub struct Body<'a> {
    /// Timing of the whole.
    pub timing: Vec<Timing<'a>>,
    pub moves: Vec<Move<'a>>,
    /// `part N { … }`
    pub parts: Vec<Part<'a>>,
    /// `follow`, `hang`, `at`, `block`, `assert`, `cueonly`: the word, its value, the span of both.
    pub marks: Vec<(Mark, Option<Word<'a>>, Span)>,
    /// `note "…"`, one entry for each: the text, and the span of the statement.
    pub notes: Vec<(Word<'a>, Span)>,
}

/// Words of a cue that are neither timing nor moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// `follow T`
    Follow,
    /// `hang T`
    Hang,
    /// `at T`, which belongs before the brace.
    At,
    /// `block`
    Block,
    /// `assert`
    Assert,
    /// `cueonly`
    Cueonly,
}

/// `part N "label" { … }`
#[derive(Debug)]
pub struct Part<'a> {
    pub number: Word<'a>,
    /// Its label, with the quotes.
    pub label: Option<Word<'a>>,
    pub body: Body<'a>,
    pub span: Span,
}

/// A move, with its timing when that follows on the same line.
#[derive(Clone, Debug)]
pub struct Move<'a> {
    /// Target of the move; `None` for `blackout`.
    pub target: Option<Target<'a>>,
    pub motion: Motion<'a>,
    /// Direction of the heads.
    pub aim: Option<Aim<'a>>,
    pub effect: Option<EffectBegun<'a>>,
    pub timing: Vec<Timing<'a>>,
    /// Without the timing.
    pub span: Span,
    /// The move before it on its line, when that move has no timing.
    pub beside: Option<Span>,
}

/// `effect wave spread`
#[derive(Clone, Copy, Debug)]
pub struct EffectBegun<'a> {
    pub name: Word<'a>,
    /// Position of `spread`.
    pub spread: Option<Span>,
}

/// `to drummer`, `to 2, 1, 0`, `pan 30 tilt -20`
#[derive(Clone, Debug)]
pub struct Aim<'a> {
    /// After `to`: the name of a point, or three lengths.
    pub at: Vec<Word<'a>>,
    /// `pan`, `tilt`, `beam` or `field`, each with its angle.
    pub angles: Vec<(Word<'a>, Word<'a>)>,
    pub span: Span,
}

/// Destination of a move.
#[derive(Clone, Debug)]
pub enum Motion<'a> {
    /// No level: a plain look, `blackout`, or moving heads.
    Bare,
    /// A level, a colour, or one of each.
    To(Word<'a>, Option<Word<'a>>),
    /// A path over time.
    Path(Path<'a>),
    /// A look with these terms on top.
    Plus(Vec<Term<'a>>),
}
