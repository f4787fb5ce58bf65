//! `watch`: the show is edited elsewhere; every save is checked, reported in words and shown again.

use std::path::PathBuf;

use super::screen::Screen;
use super::{complain, print};
use crate::engine;
use crate::lang;
use crate::printable::Printable;
use crate::repl::saves::{Look, PAUSE, Saves};
use crate::repl::{Call, Error, Repl, find};
use crate::report::words;

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
    let mut saves = Saves::new(path)?;
    let mut show = None;
    match open() {
        Ok(repl) => show = Some(repl),
        Err(error) if error.diagnostics().is_some() => {
            screen.fail(&error);
        }
        Err(error) => return Err(error),
    }
    if let Some(repl) = &mut show {
        saves.follow(repl);
        picture(repl, watched, watched.at.clone(), screen)?;
        print(format!("watching {}; Ctrl-C ends it\n", path.display()));
    }
    let mut shown = watched.at.clone();
    let mut changes = 0;
    while !screen.stop().is_asked() && watched.count.is_none_or(|count| changes < count) {
        std::thread::sleep(PAUSE);
        let (text, is_new) = match saves.look(show.as_ref()) {
            Look::Same => continue,
            Look::Away => {
                complain(format!("{}\n", saves.away()));
                keep(show.is_some());
                continue;
            }
            Look::Saved { text, is_new } => (text, is_new),
        };
        let changed = match &mut show {
            Some(repl) => change(repl, &text, &mut shown, watched, screen),
            None => open().and_then(|mut repl| {
                picture(&mut repl, watched, shown.clone(), screen)?;
                show = Some(repl);
                Ok(())
            }),
        };
        if !is_new && changed.is_err() {
            continue;
        }
        changes += 1;
        match changed {
            Ok(()) => {}
            // A file that is away, or something else for a moment, comes back.
            Err(error) if error.is_of_input() => {
                screen.fail(&error);
                keep(show.is_some());
            }
            Err(error) => return Err(error),
        }
        if let Some(repl) = &show {
            saves.follow(repl);
        }
    }
    Ok(match screen.stop().is_asked() {
        true => screen.stop().code(),
        false => 0,
    })
}

/// Prints that the last good show stays, where there was one.
pub fn keep(is_kept: bool) {
    if is_kept {
        complain("the last good show is kept\n");
    }
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
