//! Levels tried at a desk: reads moves without a change of the show's text.
//!
//! Invariant: the moves mean what they would mean in a cue after all others, and get the same
//! diagnostics. The cues of the show are not read, since no move depends on them.

use super::lower;
use super::read::{self, Read};
use super::{codes, include};
use crate::diagnostic::{Diagnostic, Sources};
use crate::model::{Cue, Motion};
use footlight_host::files::Files;

/// A parameter and its level, before the dimmer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetLevel {
    /// Index among the parameters of the show.
    pub parameter: usize,
    /// Fraction of full, 0 to 1.
    pub level: f64,
}

/// Opening of the cue in which the moves are read. Any number will do, since no other cue is read.
const OPENING: &str = "cue 9999.999 { snap  ";
const CLOSING: &str = " }";

/// Returns the levels that moves such as `lamps 40 sky #203060 night` set in the show of `source`,
/// in the order of the parts and then by parameter.
///
/// Moves to a level count, including those of groups, looks and `blackout`, inside parts and
/// outside. Paths over time and timing set no level.
///
/// # Errors
/// Diagnostics with places in `typed` as file 0. Errors in the declarations of `source`, or of the
/// files that it includes from `files`, come without a place; errors in cues are not noticed.
pub fn levels(
    files: &dyn Files,
    name: &str,
    source: &str,
    typed: &str,
) -> Result<Vec<SetLevel>, Vec<Diagnostic>> {
    let cue = cue(files, (name, source), typed).map_err(|found| {
        let placed = found.into_iter().map(|one| within(one, typed));
        placed.collect::<Vec<_>>()
    })?;
    let moves = cue.parts.into_iter().flat_map(|part| part.moves);
    let set = moves.filter_map(|one| match one.motion {
        Motion::To(level) => Some(SetLevel {
            parameter: one.parameter,
            level,
        }),
        Motion::Path(_) => None,
    });
    Ok(set.collect())
}

/// Reads the moves as a cue of the show; diagnostics have places in the cue's text, as file 0.
fn cue(
    files: &dyn Files,
    (name, source): (&str, &str),
    typed: &str,
) -> Result<Cue, Vec<Diagnostic>> {
    let text = format!("{OPENING}{typed}{CLOSING}");
    let (_, moves, mut report) = read::typed(&text)?;
    let mut sources = Sources::default();
    sources.add("typed", text.as_str());
    if moves.statements.len() != 1 {
        let message = "moves stand side by side, without declarations";
        return Err(vec![Diagnostic::error(codes::MISPLACED, message)]);
    }
    let own = sources.add(name, source) as u32;
    let parts = include::gather(files, &mut sources, (name, own, source), &mut report);
    let mut reads = Vec::new();
    for part in &parts {
        let mut scan = part.scan();
        scan.cuts.retain(|cut| !cut.is_cue());
        reads.push(read::read(&part.text, part.file, &scan, &mut report));
    }
    let mut read: Read<'_> = include::joined(&parts, reads);
    read.statements.extend(moves.statements);
    let (show, _) = lower::lower(&read, &mut report);
    let cue = show.and_then(|show| show.cues.into_iter().next());
    cue.ok_or_else(|| report.finish().0)
}

/// Translates a diagnostic from the cue's text to the typed text.
fn within(mut diagnostic: Diagnostic, typed: &str) -> Diagnostic {
    diagnostic.labels.retain_mut(|label| {
        let own = label.file == 0 && label.span.start >= OPENING.len();
        let moved = |at: usize| at.saturating_sub(OPENING.len()).min(typed.len());
        label.span = moved(label.span.start)..moved(label.span.end);
        own
    });
    diagnostic
}
