//! How much memory a text takes to read.

use super::codes;
use super::scan::Scan;
use crate::diagnostic::Diagnostic;

/// Bytes for each byte of the files: as read, as kept for `undo` and as diagnostics show it.
const EACH_BYTE: usize = 4;
/// Bytes for each byte of the statements: words of a few letters with their places, and what they
/// mean.
const EACH_WRITTEN: usize = 40;
/// Bytes for each level that groups, looks and blackouts amount to.
pub(super) const EACH_LEVEL: usize = 110;
/// Bytes for each statement besides.
const EACH_STATEMENT: usize = 500;

/// Bytes that reading texts takes at most, about.
pub(super) fn needed<'a>(scans: impl IntoIterator<Item = (usize, &'a Scan<'a>)>) -> usize {
    let of = |(bytes, scan): (usize, &Scan<'_>)| {
        let written: usize = scan.cuts.iter().map(|cut| cut.text.len()).sum();
        bytes * EACH_BYTE + written * EACH_WRITTEN + scan.cuts.len() * EACH_STATEMENT
    };
    scans.into_iter().map(of).sum()
}

/// Of those the bytes that are held from then on: the show, its places, its texts, and the cues as
/// they are kept for the next edit.
pub(super) fn held(needed: usize) -> usize {
    needed / 4 * 3
}

/// Checks that reading a show fits into `memory`, bytes.
///
/// # Errors
/// A diagnostic without a place if not.
pub(super) fn check(name: &str, needed: usize, memory: usize) -> Result<(), Diagnostic> {
    if needed <= memory {
        return Ok(());
    }
    let mega = |bytes: usize| bytes.div_ceil(1 << 20);
    let message = format!(
        "reading `{name}` takes about {} MB; the memory allowed is {} MB",
        mega(needed),
        mega(memory)
    );
    let help = format!("allow more with `--memory {}`", mega(needed));
    Err(Diagnostic::error(codes::TOO_LARGE, message).help(help))
}
