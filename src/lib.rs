//! Footlight: an embeddable interpreter for a cue-sheet language of stage lighting.
//!
//! ```
//! use footlight::{Engine, Folder, Goal, Host, Time, encode_png};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let files = Box::new(Folder::new("examples", 64 << 20)); // the show's own folder
//! let host = Host { files, threads: 2, ..Host::default() };
//! let mut engine = Engine::open("examples/first.lxq".as_ref(), host)?;
//! println!("{:?}", engine.levels(Time::from_micros(5_000_000))); // level of each bank, 0 to 1
//! let image = engine.picture(Time::from_micros(5_000_000))?; // linear light, from coarse images
//! let rgb = engine.tone()?.encode(&image);
//! let _png = encode_png(image.width(), image.height(), &rgb)?;
//! let done = engine.refine(Goal::until(0.01))?; // render what matters, to 1 % of the sequence
//! println!("{} images in {:.1} s", done.images, done.seconds);
//! assert!(done.images > 0);
//! # Ok(())
//! # }
//! ```
//!
//! It is the system of Dorsey, Arvo and Greenberg, "Interactive Design of Complex
//! Time-Dependent Lighting" (1995): a show's text is compiled to *key settings*, a singular value
//! decomposition orders the few settings worth rendering well, a linear light-transport operator
//! G renders them, and any frame is at most three linear blends of key images.
//!
//! The [`manual`] has the language, the commands, the files, and how exact and fast it is.
//!
//! - [`Document`] is a text with everything that follows from it; an [`Edit`] is the smallest
//!   change of the text.
//! - [`Engine`] is a document with a renderer and the images made of it: levels, pictures, plan,
//!   refinement (here or in the background), playback.
//! - [`LiveControl`] is what a hand does at a desk: go, back, levels that are tried and recorded.
//! - [`Repl`] is the prompt, without a terminal: lines in, words and pictures out.
//! - [`Host`] is what the embedding program gives: files, clock, threads, progress, limits. Nothing
//!   else of the outside is touched; the library prints nothing and keeps no state of the process.
//!   A renderer of one's own is a [`Transport`].
//!
//! Without the feature `cli`, which is on by default, no terminal crate is compiled, and the
//! library builds for `wasm32-unknown-unknown`; an embedding program there gives its own [`Clock`].
//!
//! # The way of the data
//!
//! ```text
//! text --lang--> Show --timeline--> key settings --plan--> basis, order, predicted error
//!                                                    |
//!           scene --renderer (G)--> images --pool--> key images --playback--> frames --> report
//!                              \____________ engine ____________/
//! ```
//!
//! # Modules
//!
//! Each module is on a layer. It imports modules of lower layers that its row names, and the
//! outside crates of its row belong to it alone (`serde` and `thiserror` are free to all, as they
//! only derive traits). `tests/layering.rs` reads this table and the `use` lines and compares them.
//! `build.rs` is the build script: it makes the operator's version of `radiosity` and what that
//! imports, so that no image of older code is ever taken from a store.
//!
//! | layer | module | its job | may import | its own outside crates |
//! |---|---|---|---|---|
//! | 0 | `units` | times, levels, angles, colours | - | - |
//! | 0 | `geometry` | points, polygons, transforms: plain three-dimensional mathematics | - | - |
//! | 0 | `hash` | mixing of bits: numbers that look random and are the same everywhere | - | - |
//! | 0 | `work` | progress, cancel, threads and memory as the embedding program gives them | - | - |
//! | 0 | `linalg` | verified SVD, QR, Bernstein: mathematics only | - | nalgebra |
//! | 0 | `files` | the one door to the outside: reading, writing, other programs, the clock | - | nix, shlex |
//! | 0 | `printable` | text for a person, in which nothing is hidden | - | unicode_width |
//! | 1 | `diagnostic` | one Diagnostic type; plain, coloured and JSON reports | printable | annotate_snippets, serde_json |
//! | 1 | `picture` | linear float RGB image; EXR, PNG; tone mapping | units, files | base64, exr, image, nalgebra, png |
//! | 2 | `chart` | axes, series, curves; PNG and SVG | units, picture, printable | base64, tiny_skia |
//! | 2 | `scene` | geometry, materials, lights, images, views; OBJ and glTF import | units, geometry, files, picture, printable | base64, draco_core, gltf_json, serde_json, sha2 |
//! | 3 | `show` | the model (IR): banks, fixed, looks, cues, parts, curves; no syntax, no spans | units, geometry, scene | - |
//! | 3 | `renderer` | `Setup`, `Transport`, `Prepared`: the operator G with its quality and cost; banks given as images; an outside renderer | units, geometry, hash, work, files, scene, picture | serde_json |
//! | 4 | `radiosity` | our own operator: geometry, visibility, mesh, direct and indirect light, camera | renderer, scene, picture, units, geometry, hash, work | arrayvec, nalgebra, rayon, wide |
//! | 4 | `lang` | grammar, AST, names, units, lowering, in-place edits: text to Show and span map | show, scene, units, geometry, files, diagnostic | color, pest, pest_derive, strsim |
//! | 4 | `timeline` | cues to polynomial segments, knots, positivity, key settings | show, units, hash, linalg | - |
//! | 5 | `check` | what follows from the curves alone: levels out of range, overtaken cues | lang, timeline, show, units, diagnostic | - |
//! | 5 | `plan` | pure: keys, durations, a metric, the pool's settings and costs in; basis, order, predicted error out | show, timeline, linalg, units | - |
//! | 5 | `desk` | shows and rigs of other programs: USITT ASCII, QLC+, MVR and GDTF; packets of the lighting network | lang, timeline, show, scene, files, units, diagnostic, printable, work | flate2, roxmltree |
//! | 6 | `pool` | coarse and refined images and their settings, the preview's coefficients; content addresses, the store on disk | renderer, plan, timeline, scene, linalg, picture, files, geometry, units, work | serde_json, sha2 |
//! | 7 | `playback` | key images and their formats, the fused kernel, frames; the page that plays them in a browser | timeline, plan, pool, picture, printable, units, work | base64, multiversion, serde_json |
//! | 8 | `engine` | `Document`, `Engine`, `LiveControl`: typed calls, no prose, no terminal; the public face | lang, check, show, scene, timeline, plan, pool, playback, radiosity, renderer, picture, linalg, files, diagnostic, geometry, units, work | - |
//! | 9 | `report` | typed results as text, tables, sheets, charts, files | engine, desk, playback, pool, plan, renderer, timeline, lang, show, chart, picture, linalg, files, diagnostic, printable, units, work | base64, flate2, serde_json, sha2 |
//! | 10 | `repl` | verbs, completion, dispatch: parse, engine, report; no terminal | report, engine, desk, lang, plan, playback, picture, chart, show, renderer, diagnostic, printable, files, units, work | serde_json |
//! | 11 | `lsp` | the language server: an editor's texts in, diagnostics, completion, names, hints, pictures out | repl, engine, lang, diagnostic, show, timeline, picture, files, units, work | crossbeam_channel, lsp_server, lsp_types, serde_json |
//! | 11 | `serve` | the live page: a show served to browsers of this machine | repl, report, engine, playback, picture, diagnostic, printable | getrandom, httparse, serde_json |
//! | 12 | `cli` | arguments, line editor, progress bars, terminal pictures | lsp, serve, repl, report, engine, desk, lang, radiosity, renderer, timeline, show, units, diagnostic, printable, files, picture, work | clap, clap_complete, rustyline, indicatif, signal_hook, ctrlc, console |

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        reason = "modules are also the ground of this project's tests and studies"
    )
)]

/// The manual. Each page answers one question.
///
/// - [`language`](manual::language): how do I write a cue sheet?
/// - [`commands`](manual::commands): what can I type?
/// - [`editors`](manual::editors): how do I write shows in my editor?
/// - [`files`](manual::files): which files go in and come out?
/// - [`accuracy`](manual::accuracy): how exact is it, and how fast?
/// - [`desk`](manual::desk): how does a show come from a desk, and go back?
/// - [`plan`](manual::plan): how does the rig of my plan come in?
/// - [`qlc`](manual::qlc): how does a show get to QLC+?
/// - [`live`](manual::live): how does a show get to a visualiser, or to real lamps?
/// - [`serve`](manual::serve): how do others see my show while I write it?
/// - [`farm`](manual::farm): can another renderer or other machines make the pictures?
/// - [`security`](manual::security): can I open a show that a stranger sent me?
/// - [`embedding`](manual::embedding): how do I call it from my own program?
#[cfg(doc)]
pub mod manual {
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
    #[doc = include_str!("manual/farm.md")]
    pub mod farm {}
    #[doc = include_str!("manual/security.md")]
    pub mod security {}
    #[doc = include_str!("manual/embedding.md")]
    pub mod embedding {}
}

cfg_if::cfg_if! {
    if #[cfg(feature = "internals")] {
        pub mod chart;
        pub mod check;
        pub mod desk;
        pub mod diagnostic;
        pub mod engine;
        pub mod files;
        pub mod geometry;
        pub mod hash;
        pub mod lang;
        pub mod linalg;
        pub mod picture;
        pub mod plan;
        pub mod playback;
        pub mod pool;
        pub mod printable;
        pub mod radiosity;
        pub mod renderer;
        pub mod repl;
        pub mod report;
        pub mod scene;
        pub mod show;
        pub mod timeline;
        pub mod units;
        pub mod work;
    } else {
        mod chart;
        mod check;
        mod desk;
        mod diagnostic;
        mod engine;
        mod files;
        mod geometry;
        mod hash;
        mod lang;
        mod linalg;
        mod picture;
        mod plan;
        mod playback;
        mod pool;
        mod printable;
        mod radiosity;
        mod renderer;
        mod repl;
        mod report;
        mod scene;
        mod show;
        mod timeline;
        mod units;
        mod work;
    }
}
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "lsp")]
mod lsp;
#[cfg(feature = "serve")]
mod serve;

pub use crate::diagnostic::{Diagnostic, Diagnostics, Severity, Style};
#[cfg(feature = "cli")]
#[doc(hidden)]
pub use cli::main;
pub use engine::{
    Background, Document, Edited, Ended, Engine, Error, Event, Forecast, Goal, Host, LiveControl,
    Moves, PoolPlace, RefinementSummary, Status, Way, WayForecast,
};
pub use files::{
    AtomicWriter, Clock, Disk, Entry, FileError, Files, Folder, Memory, MemoryStore, Store,
};
pub use lang::edit::{Change, CueMove, CueText, Edit};
pub use picture::Image;
pub use picture::png::encode as encode_png;
pub use picture::tone::Tone;
pub use plan::{Metric, PlanReport};
pub use playback::Player;
pub use printable::Printable;
pub use radiosity::Radiosity;
pub use renderer::{Cost, Prepared, Quality, Setup, Transport, TransportError};
pub use repl::{Call, Console, Error as ReplError, Repl, Reply};
pub use report::film::{Canvas, Shown};
pub use scene::{Rig, Scene, View};
pub use show::Show;
pub use timeline::Timeline;
pub use units::{CueNumber, ErrorUnit, Time, Tolerance};
pub use work::{Progress, Work};
