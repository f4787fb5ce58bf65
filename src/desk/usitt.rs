//! USITT ASCII 3.0, "ASCII Text Representation for Lighting Console Data" (USITT, 1992), with the
//! `$` and `$$` records of ETC's Eos family.
//!
//! `record` cuts the text into records, `read` collects them, `settle` finds the moves and times of
//! each cue, `sheet` writes the text of a show. `write` goes the other way.

mod model;
mod read;
mod record;
mod settle;
mod sheet;
mod write;

#[cfg(test)]
mod tests;

pub use write::write;

use self::read::Read;
use super::{Carried, ImportError};
use footlight_host::work::Work;
use footlight_show::printable::of_bytes;

/// Most bytes of a file. Reading takes up to 80 bytes of memory for each.
pub const LIMIT: usize = 8 << 20;
/// Most cues of a file: desks that write such files have no more.
const MOST_CUES: usize = 10_000;
/// Most channels of a file.
const MOST_CHANNELS: usize = 10_000;
/// Most groups of a file, and most submasters and presets.
const MOST_GROUPS: usize = 2_000;
/// Most channels in all groups together.
const MOST_MEMBERS: usize = 1_000_000;

/// Imports cue list `list`, or the first one, of the desk's file `name`. Returns the text of a
/// show, and the file's decoded text, to which diagnostics refer.
///
/// # Errors
/// A diagnostic with the faulty line, or a cancel.
pub fn import(
    name: &str,
    bytes: &[u8],
    list: Option<u32>,
    work: Work<'_>,
) -> (String, Result<Carried, ImportError>) {
    let text = decoded(bytes);
    let carried = carried(name, &text, list, work);
    (text, carried)
}

fn carried(
    name: &str,
    text: &str,
    list: Option<u32>,
    work: Work<'_>,
) -> Result<Carried, ImportError> {
    let Read { show, mut losses } = read::read(name, text, list, work)?;
    let cues = settle::settle(&show, &mut losses, work)?;
    let text = sheet::text(name, &show, &cues, &mut losses, work)?;
    losses.sort_by_key(|loss| loss.line.unwrap_or(0));
    Ok(Carried { text, losses })
}

/// Decodes UTF-16 with its byte order mark, UTF-8, or else Windows-1252, which older desks write;
/// by the standard, a carriage return alone ends a line.
fn decoded(bytes: &[u8]) -> String {
    let (units, _) = bytes.as_chunks::<2>();
    let utf_16 = |unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = units.iter().map(|two| unit(*two)).collect();
        String::from_utf16_lossy(&units).into()
    };
    let text = match units.first() {
        Some([0xff, 0xfe]) => utf_16(u16::from_le_bytes),
        Some([0xfe, 0xff]) => utf_16(u16::from_be_bytes),
        _ => of_bytes(bytes),
    };
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    text.replace("\r\n", "\n").replace('\r', "\n")
}
