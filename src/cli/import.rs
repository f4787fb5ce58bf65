//! `import`: a show or a rig of another program as the text of a show.

use std::path::{Path, PathBuf};

use clap::Args;

use super::print;
use crate::desk::{Carried, usitt};
use crate::diagnostic::Diagnostics;
use crate::engine;
use crate::files::{Disk, Store as _, is_same};
use crate::printable;
use crate::repl::Error;
use crate::report::{self, exchange, format};

/// What `import` is told.
#[derive(Debug, Args)]
pub struct Imported {
    /// The file of the other program: USITT ASCII (.asc)
    #[arg(id = "FILE")]
    file: PathBuf,
    /// The show to write (.lxq)
    #[arg(long, short, value_name = "SHOW")]
    output: PathBuf,
    /// Print what does not go across as data
    #[arg(long)]
    json: bool,
}

/// Writes the show and reports what is not in it.
pub fn import(told: &Imported) -> Result<u8, Error> {
    format::SHOW.check(&told.output)?;
    if is_same(&told.file, &told.output) {
        return Err(report::Error::ShowsFile(told.output.clone()).into());
    }
    let carried = carried(&told.file)?;
    Disk.output(&told.output, carried.text.as_bytes())?;
    let wrote = told.output.display().to_string();
    match told.json {
        true => print(printable::json(&exchange::json(&wrote, &carried.losses)?)),
        false => {
            let losses = exchange::describe(&carried.losses);
            print(format!("wrote {wrote}\n{losses}"))
        }
    };
    Ok(0)
}

/// The text for a file, by its ending.
fn carried(path: &Path) -> Result<Carried, Error> {
    format::FOREIGN.check(path)?;
    let bytes = Disk.read(path, usitt::LIMIT as u64)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (text, carried) = usitt::import(&name, &bytes);
    let refused =
        |diagnostic| Diagnostics::of(vec![diagnostic], &path.display().to_string(), &text);
    carried.map_err(|diagnostic| engine::Error::Show(refused(*diagnostic)).into())
}
