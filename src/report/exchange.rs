//! Losses between a show and another program's file: in words, and as JSON.

use serde::Serialize;

use super::Error;
use super::words::count;
use footlight_desk::Loss;

#[derive(Serialize)]
struct Losses<'a> {
    wrote: &'a [String],
    losses: &'a [Loss],
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    assumed: &'a [String],
}

/// The losses for the file `wrote`, one line each.
pub fn describe(losses: &[Loss]) -> String {
    if losses.is_empty() {
        return "nothing is lost\n".to_owned();
    }
    let do_not = if losses.len() == 1 { "does" } else { "do" };
    let mut out = format!(
        "{} {do_not} not go across, or only nearly:\n",
        count(losses.len(), "thing")
    );
    for loss in losses {
        out.push_str(&format!("  {loss}\n"));
    }
    out
}

/// The assumptions for values missing in a file, one line each.
pub fn assumptions(assumed: &[String]) -> String {
    if assumed.is_empty() {
        return String::new();
    }
    let lines: String = assumed.iter().map(|what| format!("  {what}\n")).collect();
    format!("assumed, as the file does not say it:\n{lines}")
}

/// Losses and assumptions as one object, with the files written.
///
/// # Errors
/// Never for names that are text.
pub fn json(wrote: &[String], losses: &[Loss], assumed: &[String]) -> Result<String, Error> {
    Ok(serde_json::to_string_pretty(&Losses {
        wrote,
        losses,
        assumed,
    })?)
}
