//! `watch`: the show is edited elsewhere; every save is checked, reported in words and shown again.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::screen::Screen;
use super::{complain, print};
use crate::engine::{self, TEXT_LIMIT};
use crate::files::{Disk, Stamp, Store};
use crate::lang;
use crate::printable::Printable;
use crate::repl::{Call, Error, Repl, find};
use crate::report::words;

/// How often the files are looked at.
const PAUSE: Duration = Duration::from_millis(40);

/// Looks after which a file that is away is said to be.
const LONG: usize = 25;

// What to watch, and what to do at every change. A doc comment here would be the command's help.
#[derive(Clone, Debug, clap::Args)]
pub struct Watched {
    /// The show's file (.lxq)
    #[arg(id = "SHOW")]
    pub show: PathBuf,
    /// the moment to show (default: where the light changed most)
    #[arg(long, value_name = "TIME")]
    at: Option<String>,
    /// leave after N changes
    #[arg(long, value_name = "N")]
    count: Option<u32>,
    /// rewrite this .png or .exr in place of showing the picture in the terminal
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Watches until Ctrl-C. An error leaves the last good show.
pub fn watch(
    watched: &Watched,
    screen: &Screen,
    mut open: impl FnMut() -> Result<Repl, Error>,
) -> Result<u8, Error> {
    let path = watched.show.as_path();
    let mut seen = vec![Disk.read(path, TEXT_LIMIT)?];
    let mut show = None;
    match open() {
        Ok(repl) => show = Some(repl),
        Err(error) if error.diagnostics().is_some() => {
            screen.fail(&error);
        }
        Err(error) => return Err(error),
    }
    if let Some(repl) = &mut show {
        seen = texts(path, repl);
        let time = watched.at.clone();
        picture(repl, watched, time, screen)?;
        print(format!("watching {}; Ctrl-C ends it\n", path.display()));
    }
    let mut stamps = stamps_of(&show);
    let mut shown = watched.at.clone();
    let (mut changes, mut away, mut looks) = (0, 0, 0);
    while !screen.stop().is_asked() && watched.count.is_none_or(|count| changes < count) {
        std::thread::sleep(PAUSE);
        let now = match &show {
            Some(repl) => texts(path, repl),
            None => Disk.read(path, TEXT_LIMIT).into_iter().collect(),
        };
        // An editor that writes in two steps leaves the file away, or empty, for a moment.
        let Some(text) = now.first().filter(|text| !text.is_empty()).cloned() else {
            away += 1;
            if away == LONG {
                complain(format!("{} is gone or empty", path.display()));
                let kept = if show.is_some() {
                    "; the last good show is kept\n"
                } else {
                    "\n"
                };
                complain(kept);
            }
            continue;
        };
        away = 0;
        let stamped = stamps_of(&show);
        looks += 1;
        // Without a show it is not known which of its files was missing.
        let again = show.is_none() && looks % LONG == 0;
        if now == seen && stamped == stamps && !again {
            continue;
        }
        let unchanged = now == seen && show.is_none();
        stamps = stamped;
        seen = now;
        let changed = match &mut show {
            Some(repl) => change(repl, &text, &mut shown, watched, screen),
            None => open().and_then(|mut repl| {
                picture(&mut repl, watched, shown.clone(), screen)?;
                show = Some(repl);
                Ok(())
            }),
        };
        if unchanged && changed.is_err() {
            continue;
        }
        changes += 1;
        match changed {
            Ok(()) => {}
            // A file that is away, or something else for a moment, comes back.
            Err(error) if matches!(error.exit_code(), 1..=3) => {
                screen.fail(&error);
                if show.is_some() {
                    complain("the last good show is kept\n");
                }
            }
            Err(error) => return Err(error),
        }
        // What the show includes may be other files now.
        if let Some(repl) = &show {
            let now = texts(path, repl);
            seen.truncate(1);
            seen.extend(now.into_iter().skip(1));
        }
        let named = stamps_of(&show);
        if named.len() != stamps.len() {
            stamps = named;
        }
    }
    Ok(0)
}

/// The stage's files, images and all else that the show names, as they are on disk.
fn stamps_of(show: &Option<Repl>) -> Vec<Stamp> {
    show.as_ref()
        .map_or_else(Vec::new, |repl| repl.engine().files_now())
}

/// The show's file and those it includes, as they are on disk.
fn texts(path: &Path, repl: &Repl) -> Vec<Vec<u8>> {
    let sources = &repl.engine().document().diagnostics().sources;
    let included = (1..)
        .map_while(|i| sources.get(i))
        .map(|(name, _)| Path::new(name));
    let paths = std::iter::once(path).chain(included);
    paths
        .map(|p| Disk.read(p, TEXT_LIMIT).unwrap_or_default())
        .collect()
}

/// Takes a new text. The moment shown is where the light changed most, and else the last one.
fn change(
    repl: &mut Repl,
    text: &[u8],
    shown: &mut Option<String>,
    watched: &Watched,
    screen: &Screen,
) -> Result<(), Error> {
    let text = engine::decode(&watched.show.display().to_string(), text)?;
    let reloaded = repl.reload(&text)?;
    let largest = reloaded.difference.curves.first();
    let time = largest.map(|curve| curve.at.rounded().to_string());
    let notes = reloaded.reply.notes.iter();
    let mut said = Printable::from("\n");
    notes.for_each(|note| said.push(&format!("{note}\n")));
    said.append(&reloaded.reply.text);
    print(said);
    let count = repl.engine().document().diagnostics().warnings();
    if count > 0 {
        let them = if count == 1 { "it" } else { "them" };
        let warnings = words::count(count, "warning");
        print(format!("{warnings}: `footlight check` tells {them}\n"));
    }
    if let Some(time) = time.filter(|_| watched.at.is_none()) {
        *shown = Some(time);
    }
    let end = repl.engine().document().timeline().end();
    let within = |text: &String| lang::time(text).is_some_and(|time| time <= end);
    *shown = shown.take().filter(within).or(watched.at.clone());
    picture(repl, watched, shown.clone(), screen)
}

/// The picture of a moment, in the terminal or into its file.
fn picture(
    repl: &mut Repl,
    watched: &Watched,
    time: Option<String>,
    screen: &Screen,
) -> Result<(), Error> {
    if watched.output.is_none() && !screen.is_coloured() {
        return Ok(());
    }
    let mut call = Call::new(find("picture")?);
    if let Some(time) = time {
        call = call.with("at", &time);
    }
    if let Some(output) = &watched.output {
        call = call.with("output", output);
    }
    let reply = repl.call(&call)?;
    screen.reply(&reply);
    Ok(())
}
