//! The terminal around the prompt: arguments, line editor, progress bars, pictures.
//!
//! Every action of the program is a verb of [`footlight_prompt`]; this module only reads words from
//! a person and shows the results. It is the only module that prints.

mod argument;
mod drawing;
mod editor;
mod encoder;
mod import;
mod prompt;
mod remote;
mod reports;
mod screen;
mod send;
#[cfg(feature = "serve")]
mod serve;
mod settings;
mod signals;
mod slurm;
mod stop;
mod work;

use std::ffi::OsString;
use std::io::{self, BufWriter, IsTerminal, Read, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::channel;
use std::sync::{Arc, OnceLock};

use footlight_engine::{Background, Engine, Host, PoolPlace, TEXT_LIMIT};
use footlight_host::files::{self, Disk, Folder, Monotonic, process};
#[cfg(feature = "lsp")]
use footlight_lsp as lsp;
use footlight_prompt::{Console, Error, Repl, help_of, spared};
use footlight_report::explain::explain;
use footlight_report::film::{Outlets, Pipe};
use footlight_show::printable::Printable;
use footlight_stage::import::ENDINGS;
use footlight_transport::Transport;
use footlight_transport::outside::{self, Outside};
use footlight_transport::radiosity::Radiosity;

use self::argument::{OwnCommand, Task};
use self::encoder::Ffmpeg;
use self::prompt::Threads;
use self::reports::Versions;
use self::screen::Screen;
use self::settings::Settings;
use self::slurm::Slurm;

/// Runs the program with the process's own arguments and returns its exit code: 0 well, 1 the show
/// has errors, 2 usage, 3 files or devices, 65 tasks of another version, 70 our own fault, 75 try
/// again, 130 stopped by the user, 143 and 129 by SIGTERM and SIGHUP.
pub fn main() -> ExitCode {
    let (settings, task) = match argument::parse(std::env::args_os().map(spared)) {
        Ok(parsed) => parsed,
        Err(error) if !error.use_stderr() => return help(&error),
        Err(_) if verb_help().is_some() => {
            print(format!("{}\n", verb_help().unwrap_or_default()));
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            // Standard error may be closed.
            complain(error.render().to_string());
            if let Some(show) = sole_show(std::env::args_os()) {
                complain(format!(
                    "\na verb comes first: `footlight check {show}`, `footlight repl {show}`\n"
                ));
            }
            return ExitCode::from(2);
        }
    };
    if settings.is_memory_limited() {
        files::return_large_blocks();
    }
    let screen = Screen::new(settings.quiet, settings.format(), settings.kitty);
    signals::install(&screen);
    let code = match serve(&task, &settings, &screen) {
        Ok(code) => code,
        Err(error) => screen.fail(&error),
    };
    // Background rendering ends with the program.
    process::end_all();
    match LOST.get() {
        None => ExitCode::from(code),
        Some(lost) => ExitCode::from(screen.fail(&Error::Device(lost.clone()))),
    }
}

/// Help of `footlight help go`: a verb that exists only at the prompt.
fn verb_help() -> Option<String> {
    let words: Vec<OsString> = std::env::args_os().skip(1).collect();
    match words.as_slice() {
        [help, word] if help == "help" => help_of(word.to_str()?).ok(),
        _ => None,
    }
}

/// Prints requested help or the version.
fn help(error: &clap::Error) -> ExitCode {
    let printed = error.print().and_then(|()| io::stdout().flush());
    match printed {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            complain(format!("error: standard output: {error}\n"));
            ExitCode::from(3)
        }
        _ => ExitCode::SUCCESS,
    }
}

/// Error of writing to standard output, unless it was closed.
static LOST: OnceLock<String> = OnceLock::new();

/// The show's file, when it stands in place of a verb.
fn sole_show(mut words: impl Iterator<Item = OsString>) -> Option<String> {
    let word = words.nth(1)?.into_string().ok()?;
    word.ends_with(".lxq").then_some(word)
}

fn serve(task: &Task, settings: &Settings, screen: &Screen) -> Result<u8, Error> {
    let own = match task {
        Task::Own(own) => own,
        Task::Verb { show, verb } => {
            let reply = open(Some(show), settings, screen)?.call(verb)?;
            screen.reply(&reply);
            return Ok(if reply.stopped {
                screen.stop().code()
            } else {
                0
            });
        }
    };
    match own {
        OwnCommand::Fmt { files, check } => reports::format(files, *check),
        OwnCommand::Diff { files, output } => {
            let versions = Versions::of(files)?;
            reports::difference(&versions, output.as_deref(), screen)
        }
        OwnCommand::Import(arguments) => import::import(arguments, settings, screen),
        OwnCommand::Work(told) => work::work(told, settings, screen),
        OwnCommand::Collect { tasks, json } => work::collect(tasks, *json, settings),
        #[cfg(feature = "serve")]
        OwnCommand::Serve { show, port } => serve::page(show, port.unwrap_or(0), screen, || {
            let background: Box<dyn Background> = Box::new(serve::spawn);
            let host = Host {
                background: Some(background),
                ..host(Some(show), settings, screen)
            };
            load(Some(show), host, (settings, screen))
        }),
        #[cfg(feature = "lsp")]
        OwnCommand::Lsp => serve_editor(settings),
        OwnCommand::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut argument::command(), "footlight", &mut script);
            draw(&String::from_utf8_lossy(&script));
            Ok(0)
        }
        OwnCommand::Send(sent) => {
            send::send(&open(Some(&sent.show), settings, screen)?, sent, screen)
        }
        OwnCommand::Explain { code } => {
            print(explain(code)?);
            Ok(0)
        }
        OwnCommand::Stage { file } => reports::stage(file, settings.memory()),
        OwnCommand::Repl { show, commands } => {
            let (wake, events) = channel();
            let background: Box<dyn Background> = Box::new(Threads::new(wake.clone()));
            let host = Host {
                // An interactive user does not wait.
                impatient: commands.is_empty() && io::stdin().is_terminal(),
                background: Some(background),
                ..host(show.as_deref(), settings, screen)
            };
            let mut repl = load(show.as_deref(), host, (settings, screen))?;
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

/// The language server on standard input and output, until the editor leaves.
#[cfg(feature = "lsp")]
fn serve_editor(settings: &Settings) -> Result<u8, Error> {
    let (memory, threads) = (settings.memory(), settings.threads());
    let pool = settings.clone();
    let means = lsp::Means {
        limits: lsp::Limits {
            memory,
            file: file_limit(memory),
        },
        host: Box::new(move |path, files| Host {
            renderer: Arc::new(Radiosity),
            files,
            store: Box::new(Disk),
            clock: Box::new(Monotonic::default()),
            threads,
            memory,
            pool: pool_place(Some(folder_of(path)), &pool),
            ..Host::default()
        }),
    };
    // Exit code by the protocol; a lost client gets no message.
    Ok(match lsp::serve_standard(means).map_err(Error::Device)? {
        lsp::End::Orderly => 0,
        lsp::End::Abrupt => 1,
    })
}

/// The largest file that a show may name, in bytes. A stage may be larger than any text, and is
/// read within the show's memory (1.5 million polygons, 230 MB of OBJ, take 630 MB).
fn file_limit(memory: usize) -> u64 {
    TEXT_LIMIT.max(memory as u64 / 8)
}

/// The host of the show at `path` (`-`: standard input; `None`: an empty show).
fn host(path: Option<&Path>, settings: &Settings, screen: &Screen) -> Host {
    let file = path.filter(|p| *p != Path::new("-"));
    let folder = file.map_or(Path::new("."), folder_of);
    let renderer: Arc<dyn Transport> = match settings.renderer() {
        None => Arc::new(Radiosity),
        Some(call) => {
            let show = file.map(std::path::absolute);
            Arc::new(Outside::new(outside::RendererCall {
                show: show.and_then(Result::ok),
                ..call
            }))
        }
    };
    Host {
        renderer,
        files: Box::new(Folder::new(folder, file_limit(settings.memory()))),
        store: Box::new(Disk),
        clock: Box::new(Monotonic::default()),
        progress: screen.progress(),
        threads: settings.threads(),
        memory: settings.memory(),
        processor: files::processor(),
        pool: pool_place(file.map(folder_of), settings),
        impatient: false,
        background: None,
    }
}

/// Opens a show with the terminal as host.
fn open(path: Option<&Path>, settings: &Settings, screen: &Screen) -> Result<Repl, Error> {
    load(path, host(path, settings, screen), (settings, screen))
}

fn load(
    path: Option<&Path>,
    host: Host,
    (settings, screen): (&Settings, &Screen),
) -> Result<Repl, Error> {
    let engine = match path {
        None => Engine::from_text("untitled.lxq", b"show \"Untitled\"\n", host),
        Some(path) if path == Path::new("-") => {
            let mut text = Vec::new();
            let read = io::stdin()
                .lock()
                .take(TEXT_LIMIT + 1)
                .read_to_end(&mut text);
            read.map_err(|e| Error::Device(format!("standard input: {e}")))?;
            Engine::from_text("standard input", &text, host)
        }
        Some(path) => {
            let ending = footlight_report::format::ending(path);
            let other = match ending.as_str() {
                own if ENDINGS.contains(&own) => Some(("a stage", "stage", "")),
                "mvr" => Some(("a plan", "import", " -o show.lxq")),
                "asc" => Some(("a desk's show", "import", " -o show.lxq")),
                _ => None,
            };
            if let Some((what, command, output)) = other {
                let name = path.display();
                return Err(Error::Usage(format!(
                    "{name} is {what}: `footlight {command} {name}{output}` reads it"
                )));
            }
            Engine::open(path, host)
        }
    };
    let console = Console {
        style: screen.style(),
        outlets: Outlets {
            pipe: pipe(),
            encoder: Some(Box::new(Ffmpeg)),
        },
        canvas: screen.canvas(),
        farm: Some(Box::new(Slurm::new(settings))),
    };
    files::return_freed_memory();
    Ok(Repl::new(engine?, console))
}

/// Standard output for files, unless it is a terminal, which shows no films.
fn pipe() -> Option<Pipe> {
    let open = || Box::new(BufWriter::new(io::stdout())) as Box<dyn Write>;
    (!io::stdout().is_terminal()).then(|| Box::new(open) as Pipe)
}

fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// The folder for images: given by the user, else next to the show's file. A link there could have
/// come with the show and lead anywhere.
fn pool_place(folder: Option<&Path>, settings: &Settings) -> Option<PoolPlace> {
    let folder = match &settings.pool {
        Some(said) if said.as_os_str() == "off" => return None,
        Some(said) => said.clone(),
        None => folder?.join(".footlight"),
    };
    if settings.pool.is_none() && files::is_link(&folder) {
        let folder = folder.display();
        complain(format!(
            "note: pictures are not stored: `{folder}` is a link; `--pool DIR` names a folder for \
             them\n"
        ));
        return None;
    }
    Some(PoolPlace {
        folder,
        limit: settings.pool_limit(),
    })
}

/// Writes to standard output; false once it is closed.
fn print(text: impl Into<Printable>) -> bool {
    draw(&text.into())
}

/// Writes images and scripts to standard output unchanged; they contain no names from shows or
/// files. False once it is closed.
fn draw(text: &str) -> bool {
    let mut out = io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    if let Err(error) = &written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| format!("standard output: {error}"));
    }
    written.is_ok()
}

/// Writes to standard error; a closed end does no harm.
fn complain(text: impl Into<Printable>) {
    let _ = io::stderr().lock().write_all(text.into().as_bytes());
}
