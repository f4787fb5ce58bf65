//! The command line, built from the table of verbs: same words, same options.

use std::ffi::OsString;
use std::num::NonZero;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use super::watch::Watched;
use crate::diagnostic::Style;
use crate::engine::POOL_LIMIT;
use crate::lang;
use crate::renderer::outside;
use crate::repl::{Call, VERBS, VerbSpec};

/// What the command line says.
#[derive(Debug)]
pub struct Arguments {
    /// No progress bars and no pictures in the terminal.
    pub quiet: bool,
    /// The terminal supports Kitty's graphics protocol.
    pub kitty: bool,
    /// How diagnostics are rendered; [`Style::Plain`] turns into colours on a terminal.
    pub format: Style,
    /// Threads to use.
    pub threads: usize,
    /// Bytes that rendering may hold.
    pub memory: usize,
    /// The longest that a command may take.
    pub time_limit: Option<Duration>,
    /// The renderer to use in place of the program's own.
    pub renderer: Option<outside::Call>,
    /// The folder for pictures; `None` beside the show.
    pub pool: Option<PathBuf>,
    /// Bytes that pictures may take there.
    pub pool_limit: u64,
    /// What to do.
    pub task: Task,
}

/// What to do.
#[derive(Debug)]
pub enum Task {
    /// One verb on a show.
    Verb {
        /// The show's file.
        show: String,
        /// The verb.
        call: Call,
    },
    /// Files into their canonical layout.
    Format {
        /// The files.
        files: Vec<PathBuf>,
        /// Only look.
        check: bool,
    },
    /// Two versions of a show.
    Difference {
        /// The older and the newer file.
        files: [PathBuf; 2],
        /// Where the changed curves are drawn.
        output: Option<PathBuf>,
        /// What git calls the file, when it is git that asks: it wants exit code 0.
        of_git: Option<String>,
    },
    /// A show that is edited elsewhere.
    Watch(Watched),
    /// A script that completes commands in a shell.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// The page of a code.
    Explain {
        /// The code.
        code: String,
    },
    /// The prompt, or commands given in its place.
    Prompt {
        /// The show's file; none: an empty show.
        show: Option<String>,
        /// Lines to run instead of reading any.
        commands: Vec<String>,
    },
}

/// Reads the arguments.
pub fn parse(arguments: impl Iterator<Item = OsString>) -> Result<Arguments, clap::Error> {
    let matches = command().try_get_matches_from(arguments)?;
    let task = match matches.subcommand() {
        None => Task::Prompt {
            show: None,
            commands: commands(&matches),
        },
        Some(("repl", sub)) => Task::Prompt {
            show: sub.get_one::<String>("SHOW").cloned(),
            commands: commands(sub),
        },
        Some(("fmt", sub)) => Task::Format {
            files: paths(sub, "FILE"),
            check: sub.get_flag("check"),
        },
        Some(("diff", sub)) => difference(sub)?,
        Some(("watch", sub)) => {
            let text = |name: &str| sub.get_one::<String>(name).cloned();
            Task::Watch(Watched {
                show: text("SHOW").unwrap_or_default(),
                at: text("at"),
                output: text("output"),
                count: sub.get_one::<u32>("count").copied(),
            })
        }
        Some(("completions", sub)) => Task::Completions {
            shell: sub
                .get_one::<clap_complete::Shell>("SHELL")
                .copied()
                .unwrap_or(clap_complete::Shell::Bash),
        },
        Some(("explain", sub)) => Task::Explain {
            code: sub.get_one::<String>("CODE").cloned().unwrap_or_default(),
        },
        Some((name, sub)) => {
            let unknown = || clap::Error::new(clap::error::ErrorKind::InvalidSubcommand);
            let spec = VERBS.iter().find(|v| v.name == name).ok_or_else(unknown)?;
            Task::Verb {
                show: sub.get_one::<String>("SHOW").cloned().unwrap_or_default(),
                call: call(spec, sub),
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    Ok(Arguments {
        quiet: matches.get_flag("quiet"),
        kitty: matches.get_flag("kitty"),
        format: match matches.get_one::<String>("format").map(String::as_str) {
            Some("short") => Style::Short,
            Some("json") => Style::Json,
            _ => Style::Plain,
        },
        threads: matches
            .get_one::<u16>("threads")
            .map_or(threads, |t| usize::from(*t)),
        memory: matches
            .get_one::<u32>("memory")
            .map_or(4 << 30, |m| (*m as usize) << 20),
        time_limit: matches.get_one::<Duration>("time-limit").copied(),
        renderer: renderer(&matches),
        pool: matches.get_one::<PathBuf>("pool").cloned(),
        pool_limit: matches
            .get_one::<u32>("pool-limit")
            .map_or(POOL_LIMIT, |m| u64::from(*m) * 1_000_000),
        task,
    })
}

fn paths(matches: &ArgMatches, name: &str) -> Vec<PathBuf> {
    matches
        .get_many::<PathBuf>(name)
        .into_iter()
        .flatten()
        .cloned()
        .collect()
}

/// `diff OLD NEW`, or the seven words that git gives a diff driver: the file's name, then for the
/// old and the new side a file, its hash and its mode.
fn difference(matches: &ArgMatches) -> Result<Task, clap::Error> {
    let files = paths(matches, "FILE");
    let output = matches.get_one::<PathBuf>("output").cloned();
    let (pair, of_git) = match files.as_slice() {
        [old, new] => ([old.clone(), new.clone()], None),
        [name, old, _, _, new, _, _] => {
            let name = name.display().to_string();
            ([old.clone(), new.clone()], Some(name))
        }
        _ => {
            let message = "say two files: footlight diff OLD.lxq NEW.lxq\n";
            return Err(clap::Error::raw(
                clap::error::ErrorKind::WrongNumberOfValues,
                message,
            ));
        }
    };
    Ok(Task::Difference {
        files: pair,
        output,
        of_git,
    })
}

fn renderer(matches: &ArgMatches) -> Option<outside::Call> {
    let mut call = matches.get_one::<outside::Call>("renderer")?.clone();
    if let Some(seconds) = matches.get_one::<u32>("renderer-timeout") {
        call.timeout = f64::from(*seconds);
    }
    if let Some(steps) = matches.get_one::<u8>("renderer-steps") {
        call.steps = *steps;
    }
    Some(call)
}

fn renderer_arguments() -> [Arg; 3] {
    let renderer = |name: &'static str| Arg::new(name).long(name).global(true);
    [
        renderer("renderer")
            .value_name("COMMAND")
            .value_parser(|line: &str| outside::Call::parse(line).map_err(|e| e.to_string()))
            .help(
                "Program that renders in place of this one's own radiosity: \
                 'python3 render.py {settings} {output}'",
            ),
        renderer("renderer-timeout")
            .value_name("SECONDS")
            .value_parser(value_parser!(u32).range(1..=1_000_000))
            .help("Seconds that it may take for one picture (default: 600)"),
        renderer("renderer-steps")
            .value_name("N")
            .value_parser(value_parser!(u8).range(1..=5))
            .help("Its steps of quality (default: 1, it has no scale)"),
    ]
}

/// A time that is not nothing, as shows write them.
fn time_limit(text: &str) -> Result<Duration, String> {
    let micros = lang::time(text).and_then(|time| u64::try_from(time.micros()).ok());
    match micros.filter(|micros| *micros > 0) {
        Some(micros) => Ok(Duration::from_micros(micros)),
        None => Err("write a time, such as `30s`, `5:00` or `500ms`".to_owned()),
    }
}

fn commands(matches: &ArgMatches) -> Vec<String> {
    matches
        .get_many::<String>("command")
        .into_iter()
        .flatten()
        .cloned()
        .collect()
}

fn call(spec: &'static VerbSpec, matches: &ArgMatches) -> Call {
    let mut call = Call::new(spec);
    for option in spec.options {
        let given = match option.value {
            None => matches.get_flag(option.name).then(String::new),
            Some(_) => matches.get_one::<String>(option.name).cloned(),
        };
        call.options
            .extend(given.map(|value| (option.name.to_owned(), value)));
    }
    let kind = (!spec.kinds.is_empty()).then(|| matches.get_one::<String>("kind"));
    call.words.extend(kind.flatten().cloned());
    if !spec.words.is_empty() {
        let words = matches
            .get_many::<String>("words")
            .into_iter()
            .flatten()
            .cloned();
        call.words.extend(words);
    }
    call
}

/// The whole command line.
pub fn command() -> Command {
    let root = Command::new("footlight")
        .version(env!("CARGO_PKG_VERSION"))
        .about("Stage lighting from a cue sheet: check it, plan it, see it, play it")
        .after_help(
            "Without a command the prompt opens on an empty show.\n\n\
             Examples:\n  \
             footlight check show.lxq\n  \
             footlight run show.lxq --until 2%\n  \
             footlight repl show.lxq -c 'at 1:30' -c 'picture -o evening.png'",
        )
        .arg(
            Arg::new("quiet")
                .long("quiet")
                .global(true)
                .action(ArgAction::SetTrue)
                .help("No progress bars and no pictures in the terminal"),
        )
        .arg(
            Arg::new("kitty")
                .long("kitty")
                .global(true)
                .action(ArgAction::SetTrue)
                .help("Draw pictures in the terminal by Kitty's graphics protocol"),
        )
        .arg(
            Arg::new("format")
                .long("format")
                .global(true)
                .value_name("FORMAT")
                .value_parser(["text", "short", "json"])
                .help(
                    "How mistakes and warnings are told (default: text); `short`, a line each, and \
                     `json` go to standard output",
                ),
        )
        .arg(
            Arg::new("threads")
                .long("threads")
                .global(true)
                .value_name("N")
                .value_parser(value_parser!(u16).range(1..=256))
                .help("Threads to use (default: all cores); results do not depend on it"),
        )
        .arg(
            Arg::new("memory")
                .long("memory")
                .global(true)
                .value_name("MB")
                .value_parser(value_parser!(u32).range(64..=1_000_000))
                .help("Megabytes that rendering may hold (default: 4096)"),
        )
        .arg(
            Arg::new("time-limit")
                .long("time-limit")
                .global(true)
                .value_name("TIME")
                .value_parser(time_limit)
                .help(
                    "Longest that a command, or a line of the prompt, may take: `30s`, `5:00` \
                     (default: none); pictures finished by then are kept",
                ),
        )
        .args(renderer_arguments())
        .arg(
            Arg::new("pool")
                .long("pool")
                .global(true)
                .value_name("DIR")
                .value_parser(value_parser!(PathBuf))
                .help(
                    "Folder that keeps pictures (default: .footlight beside the show; `off`: none)",
                ),
        )
        .arg(
            Arg::new("pool-limit")
                .long("pool-limit")
                .global(true)
                .value_name("MB")
                .value_parser(value_parser!(u32).range(1..))
                .help("Megabytes kept there, least recently used dropped first (default: 2000)"),
        )
        .arg(commands_argument())
        .subcommand(
            Command::new("repl")
                .about("open the prompt on a show")
                .after_help(
                    "`help` at the prompt lists what can be typed there.\n\n\
                     Example:\n  footlight repl show.lxq\n  \
                     footlight repl show.lxq -c 'set lamps 40' -c 'record 2.5 \"Lamp up\"' -c save",
                )
                .arg(show_argument().required(false))
                .arg(commands_argument()),
        )
        .subcommands(paper_commands());
    VERBS
        .iter()
        .filter(|v| v.command)
        .fold(root, |root, spec| root.subcommand(subcommand(spec)))
}

/// Verbs that take files in place of a show to open.
fn paper_commands() -> [Command; 5] {
    let files = |help: &'static str| {
        Arg::new("FILE")
            .required(true)
            .num_args(1..)
            .value_parser(value_parser!(PathBuf))
            .help(help)
    };
    let fmt = Command::new("fmt")
        .about("bring shows into their canonical layout, comments and groups kept")
        .after_help("Example:\n  footlight fmt show.lxq\n  footlight fmt --check *.lxq")
        .arg(files("The shows' files (.lxq), written in place"))
        .arg(
            Arg::new("check")
                .long("check")
                .action(ArgAction::SetTrue)
                .help("Write nothing; exit with 1 when a file is laid out otherwise"),
        );
    let diff = Command::new("diff")
        .about("what changed between two versions of a show, in cues and in light")
        .after_help(
            "Exits with 0 when nothing changed, 1 when something did, 2 when it cannot tell.\n\n\
             Example:\n  footlight diff old.lxq show.lxq -o changes.png",
        )
        .arg(files(
            "The older and the newer file; or the seven words of git's diff drivers",
        ))
        .arg(
            Arg::new("output")
                .long("output")
                .short('o')
                .value_name("FILE")
                .value_parser(value_parser!(PathBuf))
                .help("draw the changed curves as a .png or an .svg"),
        );
    let explain = Command::new("explain")
        .about("what a message's code means, with a wrong sheet and its correction")
        .after_help("Example:\n  footlight explain E012")
        .arg(Arg::new("CODE").required(true).help("Such as E012"));
    let watch = Command::new("watch")
        .about("show every save of a file that is edited elsewhere: mistakes, changes, the picture")
        .after_help(
            "A mistake leaves the last good show. Ctrl-C ends it.\n\n\
             Example:\n  footlight watch show.lxq -o now.png",
        )
        .arg(show_argument().help("The show's file (.lxq)"))
        .arg(
            Arg::new("at")
                .long("at")
                .value_name("TIME")
                .help("the moment to show (default: where the light changed most)"),
        )
        .arg(
            Arg::new("count")
                .long("count")
                .value_name("N")
                .value_parser(value_parser!(u32))
                .help("leave after N changes"),
        )
        .arg(
            Arg::new("output")
                .long("output")
                .short('o')
                .value_name("FILE")
                .help("rewrite this .png or .exr in place of showing the picture in the terminal"),
        );
    let completions = Command::new("completions")
        .about("print a script that completes this program's commands in a shell")
        .after_help("Example:\n  footlight completions bash > footlight.bash")
        .arg(
            Arg::new("SHELL")
                .required(true)
                .value_parser(value_parser!(clap_complete::Shell))
                .help("The shell"),
        );
    [fmt, diff, explain, watch, completions]
}

fn show_argument() -> Arg {
    Arg::new("SHOW")
        .required(true)
        .help("The show's file (.lxq); `-` reads standard input")
}

fn commands_argument() -> Arg {
    Arg::new("command")
        .short('c')
        .value_name("LINE")
        .action(ArgAction::Append)
        .help("Run this line instead of opening the prompt; may be repeated")
}

fn subcommand(spec: &'static VerbSpec) -> Command {
    let kind = spec.kinds.iter().find_map(|kind| {
        let rest = spec.example.strip_prefix(spec.name)?.trim_start();
        rest.starts_with(kind)
            .then(|| format!("{} {kind}", spec.name))
    });
    let first = kind.unwrap_or_else(|| spec.name.to_owned());
    let example = spec.example.strip_prefix(&first).unwrap_or_default();
    let mut out = Command::new(spec.name)
        .about(spec.about)
        .after_help(format!("Example:\n  footlight {first} show.lxq{example}"));
    if !spec.kinds.is_empty() {
        let kinds = PossibleValuesParser::new(spec.kinds);
        let kind = Arg::new("kind").required(true).value_name("KIND");
        out = out.arg(kind.value_parser(kinds).help("What to draw"));
    }
    out = out.arg(show_argument());
    if !spec.words.is_empty() {
        out = out.arg(Arg::new("words").num_args(0..).value_name(spec.words));
    }
    for option in spec.options {
        let mut arg = Arg::new(option.name).long(option.name).help(option.about);
        if let Some(letter) = option.letter {
            arg = arg.short(letter);
        }
        out = out.arg(match option.value {
            Some(value) => arg.value_name(value),
            None => arg.action(ArgAction::SetTrue),
        });
    }
    out
}
