//! Limits of a show file, far above any real show: a hostile file costs seconds and megabytes, not
//! hours and gigabytes.

/// Bytes of a file.
pub const FILE: usize = 16 << 20;
/// Bytes of a statement.
pub const STATEMENT: usize = 1 << 20;
/// Files that a show includes.
pub const INCLUDES: usize = 100;
/// Statements of a file.
pub const STATEMENTS: usize = 200_000;
/// Nesting of braces, or of round brackets.
pub const DEPTH: usize = 16;
/// Errors after which reading stops.
pub const ERRORS: usize = 100;
/// Length of a chain of values that depend on each other.
pub const VALUES: usize = 100;
/// Repeats of a move.
pub const REPEAT: u32 = 10_000;
/// Levels that groups, looks and blackouts expand to in the whole show.
pub const LEVELS: usize = 500_000;
/// Pixels of a view in either direction.
pub const PIXELS: usize = 16_384;
/// Further errors looked for inside one statement by leaving out the faulty line.
pub const RETRIES: usize = 8;
