//! USITT ASCII 3.0, "ASCII Text Representation for Lighting Console Data" (USITT, 1992), with the
//! `$` and `$$` records of ETC's Eos family.
//!
//! `record` cuts the text into records, `read` collects them, `settle` finds out what each cue moves
//! and in which time, `sheet` writes the text of a show. `write` goes the other way.

mod model;
mod read;
mod record;
mod settle;
mod sheet;
mod write;

#[cfg(test)]
mod tests;

pub use write::write;

use super::Carried;
use crate::diagnostic::Diagnostic;

/// Bytes of a file that is read: a show of 16 MB has no more text.
pub const LIMIT: usize = 16 << 20;
/// Cues of a file: the numbers of the desks that write such files go no further.
const MOST_CUES: usize = 10_000;
/// Channels of a file.
const MOST_CHANNELS: usize = 10_000;
/// Groups of a file, and submasters and presets.
const MOST_GROUPS: usize = 2_000;
/// Channels in all groups.
const MOST_MEMBERS: usize = 1_000_000;

/// The text of a show for the desk's file `name`, and the file's own text, into which a diagnostic
/// points.
///
/// # Errors
/// A diagnostic with the line that cannot be read.
pub fn import(name: &str, bytes: &[u8]) -> (String, Result<Carried, Box<Diagnostic>>) {
    let text = decoded(bytes);
    let carried = read::read(name, &text).and_then(|desk| {
        let mut losses = desk.losses;
        let cues = settle::settle(&desk.show, &mut losses);
        let sheet = sheet::text(name, &desk.show, &cues, &mut losses);
        losses.sort_by_key(|loss| loss.line.unwrap_or(0));
        sheet.map(|text| Carried { text, losses })
    });
    (text, carried)
}

/// UTF-8, or else Latin-1, which older desks write.
fn decoded(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.strip_prefix('\u{feff}').unwrap_or(text).to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}
