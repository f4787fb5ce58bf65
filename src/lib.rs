//! Footlight: an embeddable interpreter for a cue-sheet language of stage lighting.
//!
//! It is the system of Dorsey, Arvo and Greenberg, "Interactive Design of Complex
//! Time-Dependent Lighting" (1995): a show's text is compiled to *key settings*, a singular value
//! decomposition orders the few settings worth rendering well, a linear light-transport operator
//! G renders them, and any frame is at most three linear blends of key images.
//!
//! # The way of the data
//!
//! ```text
//! text --lang--> Show --timeline--> key settings --plan--> basis, order, predicted error
//!                                                    |
//!               scene --renderer (G)--> images --pool--> key images --playback--> frames
//! ```
//!
//! # The rooms
//!
//! Each module is a room on a layer. It may import rooms of lower layers that its row names, and
//! the outside crates of its row belong to it alone (`serde` and `thiserror` are free to all, as
//! they only derive traits). `tests/layering.rs` reads this table and the `use` lines and compares
//! them. `build.rs` is the build script: it makes the operator's version of `radiosity` and the
//! rooms below it, so that no picture of older code is ever taken from a store.
//!
//! | layer | module | its job | may import | its own outside crates |
//! |---|---|---|---|---|
//! | 0 | `units` | times, levels, angles, colours | - | - |
//! | 0 | `geometry` | points, polygons, transforms: plain three-dimensional mathematics | - | - |
//! | 0 | `work` | progress, cancel, threads and memory as the embedding program gives them | - | - |
//! | 0 | `linalg` | verified SVD, QR, Bernstein: mathematics only | - | nalgebra |
//! | 0 | `files` | the one door to the outside: reading, writing, other programs, the clock | - | nix |
//! | 0 | `diagnostic` | one Diagnostic type; plain, coloured and JSON reports | - | annotate_snippets, serde_json |
//! | 1 | `picture` | linear float RGB image; EXR, PNG, animated PNG; tone mapping | files | exr, image, png |
//! | 2 | `chart` | axes, series, curves; PNG and SVG | picture | tiny_skia, skrifa |
//! | 2 | `scene` | geometry, materials, lights, images, views; OBJ and glTF import | units, geometry, files, picture | tobj, gltf_json |
//! | 3 | `show` | the model (IR): banks, fixed, looks, cues, parts, curves; no syntax, no spans | units, geometry, scene | - |
//! | 3 | `renderer` | `Setup`, `Transport`, `Prepared`: the operator G with its quality and cost; banks given as images; an outside renderer | units, work, files, scene, picture | serde_json |
//! | 4 | `radiosity` | our own operator: geometry, visibility, mesh, direct and indirect light, camera | renderer, scene, picture, units, geometry, work | rayon |
//! | 4 | `lang` | grammar, AST, names, units, lowering, in-place edits: text to Show and span map | show, scene, units, geometry, files, diagnostic | pest, pest_derive |
//! | 4 | `timeline` | cues to polynomial segments, knots, positivity, key settings | show, units, linalg | - |
//! | 5 | `check` | what only the curves can tell: levels out of range, overtaken cues | lang, timeline, show, units, diagnostic | - |
//! | 5 | `plan` | pure: keys, durations, a metric, the pool's settings and costs in; basis, order, predicted error out | show, timeline, linalg | - |
//! | 6 | `pool` | coarse and refined images and their settings, the preview's coefficients; content addresses, the store on disk | renderer, plan, timeline, scene, linalg, picture, files, geometry, units, work | sha2 |
//! | 7 | `playback` | key images and their formats, the fused kernel, frames; the page that plays them in a browser | timeline, plan, pool, picture, units, work | multiversion, serde_json |
//! | 8 | `study` | measurements as typed results: the one measure of error, comparisons, where methods fail | linalg, geometry, radiosity, renderer, scene, pool, plan, playback, timeline, picture, files, units, work | - |
//! | 9 | `engine` | `Document`, `Engine`, `LiveControl`: typed calls, no prose, no terminal; the public face | lang, check, show, scene, timeline, plan, pool, playback, study, radiosity, renderer, picture, linalg, files, diagnostic, geometry, units, work | - |
//! | 10 | `report` | typed results as text, tables, sheets, charts, files | engine, study, playback, pool, plan, renderer, timeline, lang, show, chart, picture, linalg, files, diagnostic, units, work | serde_json |
//! | 11 | `repl` | verbs, completion, dispatch: parse, engine, report; no terminal | all above | - |
//! | 12 | `cli` | arguments, line editor, progress bars, terminal pictures | repl, report, engine, radiosity, renderer, show, units, diagnostic, files, picture, work | clap, clap_complete, rustyline, indicatif, ctrlc, console |

pub mod chart;
pub mod check;
pub mod cli;
pub mod diagnostic;
pub mod engine;
pub mod files;
pub mod geometry;
pub mod lang;
pub mod linalg;
pub mod picture;
pub mod plan;
pub mod playback;
pub mod pool;
pub mod radiosity;
pub mod renderer;
pub mod repl;
pub mod report;
pub mod scene;
pub mod show;
pub mod study;
pub mod timeline;
pub mod units;
pub mod work;
