//! What a show file may be at most. All of it is far above any real show; it is here so that a
//! hostile file costs seconds and megabytes, not hours and gigabytes.

/// Bytes of a file.
pub const FILE: usize = 16 << 20;
/// Bytes of a statement.
pub const STATEMENT: usize = 1 << 20;
/// Files that a show is made of, beside its own.
pub const INCLUDES: usize = 100;
/// Statements of a file.
pub const STATEMENTS: usize = 200_000;
/// Braces inside braces, or round brackets inside round brackets.
pub const DEPTH: usize = 16;
/// Errors after which the rest of the file is not read.
pub const ERRORS: usize = 100;
/// Values that a value may rest on, one behind the other.
pub const VALUES: usize = 100;
/// Times over that a move may be repeated.
pub const REPEAT: u32 = 10_000;
/// Levels that groups, looks and blackouts may amount to in the whole show.
pub const LEVELS: usize = 500_000;
/// Pixels of a view in either direction.
pub const PIXELS: usize = 16_384;
/// Errors looked for inside one statement by leaving out the line that was wrong.
pub const RETRIES: usize = 8;
