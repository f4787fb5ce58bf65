//! The terminal around the prompt: arguments, line editor, progress bars, pictures.
//!
//! Everything the program can do is a verb of [`crate::repl`]; this module only reads words from a
//! person and shows what comes back. It is the only module that prints.

mod argument;
mod drawing;
mod editor;
mod prompt;
mod reports;
mod screen;
mod watch;

use std::ffi::OsString;
use std::io::{self, BufWriter, IsTerminal, Read, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::channel;
use std::sync::{Arc, OnceLock};

use crate::engine::{Background, Engine, Host, PoolPlace, TEXT_LIMIT};
use crate::files::{self, Disk, Folder, Monotonic};
use crate::radiosity::Radiosity;
use crate::renderer::Transport;
use crate::renderer::outside::{self, Outside};
use crate::repl::{Call, Console, Error, Repl};
use crate::report::explain::explain;
use crate::report::film::Pipe;

use self::argument::{OwnCommand, Settings, Task};
use self::prompt::Threads;
use self::reports::Versions;
use self::screen::Screen;

/// The exit code of what the user stopped.
const STOPPED: u8 = 130;

/// Runs the program with the process's own arguments and returns its exit code: 0 well, 1 the show
/// has errors, 2 usage, 3 files or devices, 70 our own fault, 130 stopped by the user.
pub fn main() -> ExitCode {
    let (settings, task) = match argument::parse(std::env::args_os()) {
        Ok(parsed) => parsed,
        Err(error) => {
            // Help goes to standard output, errors to standard error; both may be closed.
            let _ = error.print();
            if let Some(show) = sole_show(std::env::args_os()) {
                complain(&format!(
                    "\na verb comes first: `footlight check {show}`, `footlight repl {show}`\n"
                ));
            }
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    let screen = Screen::new(settings.quiet, settings.format(), settings.kitty);
    let code = match serve(&task, &settings, &screen) {
        Ok(code) => code,
        Err(error) => screen.fail(&error),
    };
    match LOST.get() {
        None => ExitCode::from(code),
        Some(lost) => ExitCode::from(screen.fail(&Error::Device(lost.clone()))),
    }
}

/// Why something could not be written to standard output, if it was not closed.
static LOST: OnceLock<String> = OnceLock::new();

/// The show's file that stands where a verb is expected.
fn sole_show(mut words: impl Iterator<Item = OsString>) -> Option<String> {
    let word = words.nth(1)?.into_string().ok()?;
    word.ends_with(".lxq").then_some(word)
}

fn serve(task: &Task, settings: &Settings, screen: &Screen) -> Result<u8, Error> {
    let own = match task {
        Task::Own(own) => own,
        Task::Verb { show, call } => {
            show_comes_first(show, call)?;
            let mut repl = open(Some(show), settings, screen)?;
            let reply = repl.call(call)?;
            screen.reply(&reply);
            return Ok(if reply.stopped { STOPPED } else { 0 });
        }
    };
    match own {
        OwnCommand::Fmt { files, check } => reports::format(files, *check, settings.memory()),
        OwnCommand::Diff { files, output } => {
            let versions = Versions::of(files)?;
            let host = host(Some(&versions.name()), settings, screen);
            reports::difference(&versions, output.as_deref(), (&host, screen))
        }
        OwnCommand::Watch(watched) => watch::watch(watched, screen, || {
            open(Some(&watched.show), settings, screen)
        }),
        OwnCommand::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut argument::command(), "footlight", &mut script);
            print(&String::from_utf8_lossy(&script));
            Ok(0)
        }
        OwnCommand::Explain { code } => {
            print(&explain(code)?);
            Ok(0)
        }
        OwnCommand::Repl { show, commands } => {
            let (wake, events) = channel();
            let background: Box<dyn Background> = Box::new(Threads::new(wake.clone()));
            let host = Host {
                background: Some(background),
                ..host(show.as_deref(), settings, screen)
            };
            let mut repl = load(show.as_deref(), host, screen)?;
            if !commands.is_empty() {
                prompt::batch(&mut repl, commands.join("\n").as_bytes(), screen)
            } else if io::stdin().is_terminal() {
                prompt::converse(&mut repl, screen, (wake, &events))
            } else {
                prompt::batch(&mut repl, io::stdin().lock(), screen)
            }
        }
    }
}

/// Refuses `plot keys show.lxq` with what was meant.
fn show_comes_first(show: &str, call: &Call) -> Result<(), Error> {
    let is_file = |name: &str| name == "-" || Path::new(name).exists();
    let other = call
        .words
        .iter()
        .find(|w| w.ends_with(".lxq") && is_file(w));
    match other {
        Some(file) if !is_file(show) => Err(Error::Usage(format!(
            "`{show}` is no show; its file comes first: {} {file} {show}",
            call.verb.name
        ))),
        _ => Ok(()),
    }
}

/// The terminal's means, for the show at `path` (`-`: standard input; none: an empty show).
fn host(path: Option<&str>, settings: &Settings, screen: &Screen) -> Host {
    let file = path.filter(|p| *p != "-").map(Path::new);
    let folder = file.map_or(Path::new("."), folder_of);
    let renderer: Arc<dyn Transport> = match settings.renderer() {
        None => Arc::new(Radiosity),
        Some(call) => {
            let show = path.filter(|p| *p != "-").map(std::path::absolute);
            Arc::new(Outside::new(outside::Call {
                show: show.and_then(Result::ok),
                ..call
            }))
        }
    };
    Host {
        renderer,
        files: Box::new(Folder::new(folder, TEXT_LIMIT)),
        store: Box::new(Disk),
        clock: Box::new(Monotonic::default()),
        progress: screen.progress(),
        threads: settings.threads(),
        memory: settings.memory(),
        time: settings.time_limit,
        processor: files::processor(),
        pool: pool_place(path, folder, settings),
        background: None,
    }
}

/// Opens a show with the terminal's means.
fn open(path: Option<&str>, settings: &Settings, screen: &Screen) -> Result<Repl, Error> {
    load(path, host(path, settings, screen), screen)
}

fn load(path: Option<&str>, host: Host, screen: &Screen) -> Result<Repl, Error> {
    let engine = match path {
        None => Engine::from_text("untitled.lxq", b"show \"Untitled\"\n", host),
        Some("-") => {
            let mut text = Vec::new();
            let read = io::stdin()
                .lock()
                .take(TEXT_LIMIT + 1)
                .read_to_end(&mut text);
            read.map_err(|e| Error::Device(format!("standard input: {e}")))?;
            Engine::from_text("standard input", &text, host)
        }
        Some(path) => Engine::open(Path::new(path), host),
    };
    let console = Console {
        style: screen.style(),
        pipe: pipe(),
        canvas: screen.canvas(),
    };
    Ok(Repl::new(engine?, console))
}

/// Standard output for files, unless it is a terminal, which shows no films.
fn pipe() -> Option<Pipe> {
    let open = || Box::new(BufWriter::new(io::stdout())) as Box<dyn Write>;
    (!io::stdout().is_terminal()).then(|| Box::new(open) as Pipe)
}

/// The folder that a file lies in.
fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Where pictures are stored: where the user says, else next to the show's file.
fn pool_place(show: Option<&str>, folder: &Path, settings: &Settings) -> Option<PoolPlace> {
    let folder = match &settings.pool {
        Some(said) if said.as_os_str() == "off" => return None,
        Some(said) => said.clone(),
        None if matches!(show, None | Some("-")) => return None,
        None => folder.join(".footlight"),
    };
    Some(PoolPlace {
        folder,
        limit: settings.pool_limit(),
    })
}

/// Writes to standard output; false once it is closed.
fn print(text: &str) -> bool {
    let mut out = io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    if let Err(error) = &written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| format!("standard output: {error}"));
    }
    written.is_ok()
}

/// Writes to standard error, where a closed end does no harm.
fn complain(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}
