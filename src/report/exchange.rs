//! What did not go across between a show and a file of another program: in words, and as JSON.

use serde::Serialize;

use super::Error;
use super::words::count;
use crate::desk::Loss;

#[derive(Serialize)]
struct Losses<'a> {
    wrote: &'a str,
    losses: &'a [Loss],
}

/// The losses of a file that is called `wrote`, a line each.
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

/// The same as one object with the file's name.
///
/// # Errors
/// None with names that are text.
pub fn json(wrote: &str, losses: &[Loss]) -> Result<String, Error> {
    Ok(serde_json::to_string_pretty(&Losses { wrote, losses })?)
}
