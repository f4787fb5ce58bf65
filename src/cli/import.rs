//! `import`: converts a show or a rig of another program to the text of a show.

use std::path::{Path, PathBuf};

use clap::Args;

use super::screen::Screen;
use super::settings::Settings;
use super::{complain, file_limit, print};
use footlight_desk::{ImportError, Loss, mvr, usitt};
use footlight_engine::{self as engine, Host};
use footlight_host::files::{Disk, Folder, Store as _, is_same};
use footlight_host::work::Work;
use footlight_prompt::Error;
use footlight_report::words::count;
use footlight_report::{self as report, exchange, format};
use footlight_show::diagnostic::Diagnostics;
use footlight_show::printable;

/// Arguments of `import`.
#[derive(Debug, Args)]
pub struct Imported {
    /// The file of the other program: USITT ASCII (.asc) or MVR (.mvr)
    #[arg(id = "FILE")]
    file: PathBuf,
    /// The show to write (.lxq)
    #[arg(long, short, value_name = "SHOW")]
    output: PathBuf,
    /// Cue list of the desk (default: the file's first)
    #[arg(long, value_name = "N")]
    list: Option<u32>,
    /// Print what does not go across as data
    #[arg(long)]
    json: bool,
}

/// Writes the show and reports the losses.
pub fn import(arguments: &Imported, settings: &Settings, screen: &Screen) -> Result<u8, Error> {
    let progress = screen.progress();
    let work = Work {
        progress: &*progress,
        threads: settings.threads(),
        memory: settings.memory(),
    };
    format::SHOW.check(&arguments.output)?;
    if is_same(&arguments.file, &arguments.output) {
        return Err(report::Error::ShowsFile(arguments.output.clone()).into());
    }
    let imported = match format::ending(&arguments.file).as_str() {
        "mvr" if arguments.list.is_some() => {
            return Err(Error::Usage(
                "`--list` is for a desk's file (.asc)".to_owned(),
            ));
        }
        "mvr" => rig(arguments, work)?,
        "asc" => desk(arguments, work)?,
        _ => {
            let file = shown(&arguments.file);
            return Err(Error::Usage(format!(
                "`{file}` cannot be imported: it is to end in .asc (a desk: USITT ASCII) or .mvr (a \
                 plan)"
            )));
        }
    };
    let (wrote, losses, assumed) = imported;
    if arguments.json {
        print(printable::json(&exchange::json(&wrote, &losses, &assumed)?))
    } else {
        let wrote: String = wrote.iter().map(|file| format!("wrote {file}\n")).collect();
        print(wrote + &exchange::describe(&losses) + &exchange::assumptions(&assumed))
    };
    check(&arguments.output, settings)?;
    Ok(0)
}

/// Checks the written show. It stays for correction if the check fails.
fn check(show: &Path, settings: &Settings) -> Result<(), Error> {
    let files = Box::new(Folder::new(
        super::folder_of(show),
        file_limit(settings.memory()),
    ));
    let host = Host {
        files,
        memory: settings.memory(),
        ..Host::default()
    };
    let checked = engine::Engine::open(show, host);
    checked.map(drop).map_err(|error| {
        let name = shown(show);
        complain(format!(
            "`{name}` was written, but does not check as it stands:\n"
        ));
        error.into()
    })
}

/// Files written, losses, and assumptions.
type Report = (Vec<String>, Vec<Loss>, Vec<String>);

/// Imports a desk's show.
fn desk(arguments: &Imported, work: Work<'_>) -> Result<Report, Error> {
    let bytes = Disk.read(&arguments.file, usitt::LIMIT as u64)?;
    let (text, carried) = usitt::import(&file_name(&arguments.file), &bytes, arguments.list, work);
    let carried = carried.map_err(|error| refused(error, &arguments.file, &text))?;
    Disk.output(&arguments.output, carried.text.as_bytes())?;
    Ok((vec![shown(&arguments.output)], carried.losses, Vec::new()))
}

/// Imports the rig of a plan, with its geometry in a folder next to the show and its addresses in a
/// file.
fn rig(arguments: &Imported, work: Work<'_>) -> Result<Report, Error> {
    let bytes = Disk.read(&arguments.file, mvr::LIMIT as u64)?;
    let stem = arguments.output.file_stem().unwrap_or_default();
    let folder = format!("{}-set", stem.to_string_lossy());
    let carried = mvr::import(&file_name(&arguments.file), &bytes, &folder, work);
    let carried = carried.map_err(|error| refused(error, &arguments.file, ""))?;
    let beside = super::folder_of(&arguments.output);
    for (path, bytes) in &carried.files {
        Disk.output(&beside.join(path), bytes)?;
    }
    let mut wrote = vec![shown(&arguments.output)];
    if !carried.patch.is_empty() {
        let patch = arguments.output.with_extension("patch");
        Disk.output(&patch, carried.patch.as_bytes())?;
        wrote.push(shown(&patch));
    }
    if !carried.files.is_empty() {
        wrote.push(format!(
            "{} ({})",
            shown(&arguments.output.with_file_name(folder)),
            count(carried.files.len(), "file")
        ));
    }
    Disk.output(&arguments.output, carried.text.as_bytes())?;
    Ok((wrote, carried.losses, carried.assumed))
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

fn refused(error: ImportError, path: &Path, text: &str) -> Error {
    match error {
        ImportError::Cancelled(cancelled) => engine::Error::Cancelled(cancelled).into(),
        ImportError::Refused(diagnostic) => {
            engine::Error::Show(Diagnostics::of(vec![*diagnostic], &shown(path), text)).into()
        }
    }
}
