//! The command line, built from the interpreter's table of verbs: same words, same options.

use std::ffi::OsString;
use std::num::NonZero;
use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use crate::interpreter::{Call, POOL_LIMIT, VERBS, VerbSpec};
use crate::transport::outside;

/// What the command line says.
#[derive(Debug)]
pub struct Arguments {
    /// No progress bars.
    pub quiet: bool,
    /// Threads to use.
    pub threads: usize,
    /// Bytes that rendering may hold.
    pub memory: usize,
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
    /// The prompt, or commands given in its place.
    Prompt {
        /// The show's file; none: an empty show.
        show: Option<String>,
        /// Lines to run instead of reading any.
        commands: Vec<String>,
    },
}

/// Reads the arguments.
///
/// # Errors
/// clap's, for help, the version and every mistake.
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
        threads: matches
            .get_one::<u16>("threads")
            .map_or(threads, |t| usize::from(*t)),
        memory: matches
            .get_one::<u32>("memory")
            .map_or(4 << 30, |m| (*m as usize) << 20),
        renderer: renderer(&matches),
        pool: matches.get_one::<PathBuf>("pool").cloned(),
        pool_limit: matches
            .get_one::<u32>("pool-limit")
            .map_or(POOL_LIMIT, |m| u64::from(*m) * 1_000_000),
        task,
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
            .help("Steps of quality that it knows (default: 1, it has no scale)"),
    ]
}

fn commands(matches: &ArgMatches) -> Vec<String> {
    matches
        .get_many::<String>("command")
        .into_iter()
        .flatten()
        .cloned()
        .collect()
}

fn call(spec: &VerbSpec, matches: &ArgMatches) -> Call {
    let mut call = Call::new(spec.verb);
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
                .help("No progress bars"),
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
                .arg(show_argument().required(false))
                .arg(commands_argument()),
        );
    VERBS
        .iter()
        .filter(|v| v.command)
        .fold(root, |root, spec| root.subcommand(subcommand(spec)))
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
