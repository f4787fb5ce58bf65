//! Footlight: an embeddable interpreter for a cue-sheet language of stage lighting.
//!
//! ```
//! use footlight::{Engine, Folder, Goal, Host, Time, encode_png};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let files = Box::new(Folder::new("examples", 64 << 20)); // the show's own folder
//! let host = Host { files, threads: 2, ..Host::default() };
//! let mut engine = Engine::open("examples/first.lxq".as_ref(), host)?;
//! println!("{:?}", engine.document().levels(Time::from_micros(5_000_000))); // levels of the banks, 0 to 1
//! let image = engine.picture(Time::from_micros(5_000_000))?; // linear light, from coarse images
//! let rgb = engine.tone()?.encode(&image);
//! let _png = encode_png(image.width(), image.height(), &rgb)?;
//! let done = engine.refine(Goal::until(0.01))?; // measure, and render what 1 % takes
//! println!("{} images in {:.1} s", done.images, done.seconds);
//! assert!(done.ended.is_some());
//! # Ok(())
//! # }
//! ```
//!
//! It is the system of Dorsey, Arvo and Greenberg, "Interactive Design of Complex Time-Dependent
//! Lighting" (1995): a show's text is compiled to *key settings*, a singular value decomposition
//! orders the few settings worth rendering well, a linear light-transport operator G renders them,
//! and a frame takes at most three linear blends, of four key images. One thing differs: the
//! built-in renderer is quick enough that rendering each bank alone is usually cheaper than the
//! mixtures of the decomposition (`--way paper`), which pay with slow renderers. The page
//! [`paper`](manual::paper) says where each idea is.
//!
//! The [`manual`] covers the language, the commands, the files, accuracy and speed.
//!
//! - [`Document`] is a text with everything that follows from it; an [`Edit`] is the smallest
//!   change of the text.
//! - [`Engine`] is a document with a renderer and the images made of it ([`Images`]): levels,
//!   pictures, plan and methods ([`Estimate`]), refinement ([`Refinement`], here or in the
//!   background), playback ([`Player`]).
//! - [`LiveControl`] is manual control as at a desk: go, back, levels that are tried and recorded.
//! - [`Repl`] is the prompt without a terminal: lines in, messages and images out.
//! - [`Host`] is provided by the embedding program: files, clock, threads, progress, limits. The
//!   library touches nothing else outside; it prints nothing and keeps no state of the process. A
//!   custom renderer implements [`Transport`].
//!
//! Without the feature `cli`, which is on by default, no terminal crate is compiled, and the
//! library builds for `wasm32-unknown-unknown`; an embedding program there supplies its own
//! [`Clock`].
//!
//! # Crates
//!
//! This crate is a facade: it re-exports the crates below. Each imports only crates above it in
//! this table, as Cargo enforces.
//!
//! ```text
//! text --show--> Show --timeline--> key settings --plan--> basis, order, predicted error
//!                                                   |
//!         stage --transport (G)--> images --pool--> key images --player--> frames --> report
//!                             \____________ engine ____________/
//! ```
//!
//! | crate | its job |
//! |---|---|
//! | `footlight-host` | services of the embedding program: files, clock, programs, progress, cancel |
//! | `footlight-show` | the text and its meaning: language, model, timeline, checks |
//! | `footlight-picture` | linear images: OpenEXR, PNG, tone, films |
//! | `footlight-stage` | geometry, materials, lights; OBJ, glTF, photometric files, textures |
//! | `footlight-transport` | the operator G: radiosity, and external renderers |
//! | `footlight-engine` | documents, images, plan, refinement, playback |
//! | `footlight-desk` | shows and rigs of other programs, packets of the lighting network |
//! | `footlight-report` | results as text, tables, charts, files |
//! | `footlight-prompt` | verbs, completion, answers; no terminal |
//! | `footlight-lsp`, `footlight-serve` | the language server; the live page |
//!
//! A program that reads cue sheets and needs levels over time uses only `footlight-show`.

/// The manual. Each page answers one question.
///
/// - [`tutorial`](manual::tutorial): how do I begin?
/// - [`language`](manual::language): how do I write a cue sheet?
/// - [`commands`](manual::commands): what can I type?
/// - [`editors`](manual::editors): how do I write shows in my editor?
/// - [`files`](manual::files): which files go in and come out?
/// - [`accuracy`](manual::accuracy): how exact is it, and how fast?
/// - [`solve`](manual::solve): which levels look like my sketch?
/// - [`desk`](manual::desk): how does a show come from a desk, and go back?
/// - [`plan`](manual::plan): how does the rig of my plan come in?
/// - [`qlc`](manual::qlc): how does a show get to QLC+?
/// - [`live`](manual::live): how does a show get to a visualiser, or to real lamps?
/// - [`serve`](manual::serve): how do others see my show while I write it?
/// - [`farm`](manual::farm): can another renderer or other machines make the pictures?
/// - [`renderer`](manual::renderer): how do I write a renderer for it?
/// - [`security`](manual::security): can I open a show that a stranger sent me?
/// - [`embedding`](manual::embedding): how do I call it from my own program?
/// - [`paper`](manual::paper): where are the ideas of the paper?
#[cfg(doc)]
pub mod manual {
    #[doc = include_str!("manual-links.md")]
    #[doc = include_str!("manual/tutorial.md")]
    pub mod tutorial {}
    #[doc = include_str!("../grammar/README.md")]
    pub mod language {}
    #[doc = include_str!("manual/commands.md")]
    pub mod commands {}
    #[doc = include_str!("manual/editors.md")]
    pub mod editors {}
    #[doc = include_str!("manual/files.md")]
    pub mod files {}
    #[doc = include_str!("manual/accuracy.md")]
    pub mod accuracy {}
    #[doc = include_str!("manual/solve.md")]
    pub mod solve {}
    #[doc = include_str!("manual/desk.md")]
    pub mod desk {}
    #[doc = include_str!("manual/plan.md")]
    pub mod plan {}
    #[doc = include_str!("manual/qlc.md")]
    pub mod qlc {}
    #[doc = include_str!("manual/live.md")]
    pub mod live {}
    #[doc = include_str!("manual/serve.md")]
    pub mod serve {}
    #[doc = include_str!("manual-links.md")]
    #[doc = include_str!("manual/farm.md")]
    pub mod farm {}
    #[doc = include_str!("manual-links.md")]
    #[doc = include_str!("manual/renderer.md")]
    pub mod renderer {}
    #[doc = include_str!("manual-links.md")]
    #[doc = include_str!("manual/security.md")]
    pub mod security {}
    #[doc = include_str!("manual/embedding.md")]
    pub mod embedding {}
    #[doc = include_str!("manual-links.md")]
    #[doc = include_str!("manual/paper.md")]
    pub mod paper {}
}

#[cfg(feature = "cli")]
mod cli;

#[cfg(feature = "cli")]
#[doc(hidden)]
pub use cli::main;

// The crates below, each with its whole content.
pub use footlight_desk as desk;
pub use footlight_engine as engine;
pub use footlight_host as host;
pub use footlight_picture as picture;
pub use footlight_prompt as prompt;
pub use footlight_report as report;
pub use footlight_show as show;
pub use footlight_stage as stage;
pub use footlight_transport as transport;

// Items for most programs.
pub use footlight_engine::plan::PlanReport;
pub use footlight_engine::playback::{Playback, Player};
pub use footlight_engine::pool::Pool;
pub use footlight_engine::{
    Background, Document, Edited, Ended, Engine, Error, Estimate, Event, Goal, Host, Images,
    LiveControl, Moves, PoolPlace, Refinement, RefinementSummary, Status, TaskList, Way,
    WayForecast,
};
pub use footlight_host::files::{
    AtomicWriter, Clock, Disk, Entry, FileError, Files, Folder, Memory, MemoryStore, Store,
};
pub use footlight_host::work::{Cancelled, Progress, Work};
pub use footlight_picture::Image;
pub use footlight_picture::png::encode as encode_png;
pub use footlight_picture::tone::Tone;
pub use footlight_prompt::{Console, Error as ReplError, Repl, Reply, Verb};
pub use footlight_report::film::{Canvas, Shown};
pub use footlight_show::diagnostic::{Diagnostic, Diagnostics, Severity, Style};
pub use footlight_show::geometry::{Vec3, View};
pub use footlight_show::lang::edit::{Change, CueText, Edit};
pub use footlight_show::model::{Bank, Cue, Show};
pub use footlight_show::printable::Printable;
pub use footlight_show::timeline::Timeline;
pub use footlight_show::units::{CueNumber, ErrorUnit, Rgb, Time, Tolerance};
pub use footlight_stage::{Emitter, Light, Material, Polygon, Rig, Scene, Source};
pub use footlight_transport::radiosity::Radiosity;
pub use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};
