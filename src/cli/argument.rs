//! The command line: settings and commands on files by their types, verbs by their table, so that
//! these have the same words and options as at the prompt.

use std::ffi::OsString;
use std::num::NonZero;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, StringValueParser, TypedValueParser, ValueParser};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, Subcommand, value_parser};

use super::import::Imported;
use super::work::Worker;
use footlight_engine::POOL_LIMIT;
use footlight_host::files;
use footlight_prompt::{Call, VERBS, VerbSpec};
use footlight_show::diagnostic::Style;
use footlight_show::lang;
use footlight_transport::outside;

/// Bytes that the program takes beside a show.
const PROGRAM: usize = 64 << 20;

const SHOW: &str = "The show's file (.lxq); `-` reads standard input";
const LINE: &str = "Run this line instead of opening the prompt; may be repeated";

// What holds for every command, and the lines to run where there is none. A doc comment here would
// be the program's description.
#[derive(Clone, Debug, Args)]
pub struct Settings {
    /// No progress bars and no pictures in the terminal
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Draw pictures in the terminal by Kitty's graphics protocol
    #[arg(long, global = true)]
    pub kitty: bool,
    /// How errors and warnings are written (default: text); `short`, a line each, and `json` go to
    /// standard output
    #[arg(long, global = true, value_name = "FORMAT")]
    #[arg(value_parser = PossibleValuesParser::new(["text", "short", "json"]).map(style))]
    format: Option<Style>,
    /// Threads to use (default: all cores); results do not depend on it
    #[arg(long, global = true, value_name = "N")]
    #[arg(value_parser = value_parser!(u16).range(1..=256).map(usize::from))]
    threads: Option<usize>,
    /// Megabytes that a show may take, read and rendered (default: 4096)
    #[arg(long, global = true, value_name = "MB")]
    #[arg(value_parser = value_parser!(u32).range(64..=1_000_000).map(|mb| (mb as usize) << 20))]
    memory: Option<usize>,
    /// Longest that a command, or a line of the prompt, may take: `30s`, `5:00` (default: none);
    /// pictures finished by then are kept
    #[arg(long, global = true, value_name = "TIME", value_parser = time_limit)]
    pub time_limit: Option<Duration>,
    /// Program that renders in place of this one's own radiosity: `mitsuba`, `blender`, or
    /// 'python3 render.py {settings} {output}'
    #[arg(long, global = true, value_name = "COMMAND")]
    #[arg(value_parser = RendererLine::parse)]
    renderer: Option<RendererLine>,
    /// Seconds that it may take for one picture (default: 600)
    #[arg(long, global = true, value_name = "SECONDS")]
    #[arg(value_parser = value_parser!(u32).range(1..=1_000_000))]
    renderer_timeout: Option<u32>,
    /// Its steps of quality (default: 1, it has no scale)
    #[arg(long, global = true, value_name = "N", value_parser = value_parser!(u8).range(1..=5))]
    renderer_steps: Option<u8>,
    /// What the version of its pictures is called, so that they are kept and shared (default: none, they
    /// are not)
    #[arg(long, global = true, value_name = "TEXT")]
    renderer_version: Option<String>,
    /// Folder that keeps pictures (default: .footlight next to the show; `off`: none)
    #[arg(long, global = true, value_name = "DIR")]
    pub pool: Option<PathBuf>,
    /// Megabytes kept there, least recently used dropped first (default: 2000)
    #[arg(long, global = true, value_name = "MB")]
    #[arg(value_parser = value_parser!(u32).range(1..).map(|mb| u64::from(mb) * 1_000_000))]
    pool_limit: Option<u64>,
    #[arg(short = 'c', value_name = "LINE", help = LINE)]
    commands: Vec<String>,
}

impl Settings {
    /// How diagnostics are rendered; [`Style::Plain`] turns into colours on a terminal.
    pub fn format(&self) -> Style {
        self.format.unwrap_or(Style::Plain)
    }

    /// Threads to use.
    pub fn threads(&self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, NonZero::get);
        self.threads.unwrap_or_else(all)
    }

    /// Whether the user, or the system, said how much memory a show may take.
    pub fn is_memory_limited(&self) -> bool {
        self.memory.is_some() || files::is_limited()
    }

    /// Bytes that a show may take, read and rendered. Of a limit of addresses half of what the
    /// program leaves, as some are reserved and not used.
    pub fn memory(&self) -> usize {
        let addresses = files::address_space().saturating_sub(PROGRAM);
        self.memory.unwrap_or(4 << 30).min(addresses / 2)
    }

    /// Bytes that pictures may take in their folder.
    pub fn pool_limit(&self) -> u64 {
        self.pool_limit.unwrap_or(POOL_LIMIT)
    }

    /// The renderer to use in place of the program's own.
    pub fn renderer(&self) -> Option<outside::RendererCall> {
        let mut call = self.renderer.clone()?.call;
        call.version.clone_from(&self.renderer_version);
        if let Some(seconds) = self.renderer_timeout {
            call.timeout = f64::from(seconds);
        }
        if let Some(steps) = self.renderer_steps {
            call.steps = steps;
        }
        Some(call)
    }

    /// The options that a worker on another machine is to be given.
    pub fn of_worker(&self) -> Vec<String> {
        let mut words = vec!["--quiet".to_owned()];
        let mut option = |name: &str, value: Option<String>| {
            words.extend(value.map(|value| format!("--{name}={value}")));
        };
        let pool = self.pool.as_ref().filter(|pool| pool.as_os_str() != "off");
        let pool = pool.and_then(|pool| std::path::absolute(pool).ok());
        option("pool", pool.map(|pool| pool.display().to_string()));
        option("threads", self.threads.map(|n| n.to_string()));
        option("memory", self.memory.map(|bytes| (bytes >> 20).to_string()));
        let renderer = self.renderer.as_ref();
        option("renderer", renderer.map(|r| r.line.clone()));
        option(
            "renderer-timeout",
            self.renderer_timeout.map(|s| s.to_string()),
        );
        option("renderer-steps", self.renderer_steps.map(|n| n.to_string()));
        option("renderer-version", self.renderer_version.clone());
        words
    }
}

/// A renderer's command as it was typed, and what it means.
#[derive(Clone, Debug)]
struct RendererLine {
    line: String,
    call: outside::RendererCall,
}

impl RendererLine {
    fn parse(line: &str) -> Result<RendererLine, String> {
        let call = outside::RendererCall::parse(line).map_err(|e| e.to_string())?;
        Ok(RendererLine {
            line: line.to_owned(),
            call,
        })
    }
}

fn style(name: String) -> Style {
    match name.as_str() {
        "short" => Style::Short,
        "json" => Style::Json,
        _ => Style::Plain,
    }
}

/// What to do.
#[derive(Debug)]
pub enum Task {
    /// A command that is no verb.
    Own(OwnCommand),
    /// One verb on a show.
    Verb { show: PathBuf, call: Call },
}

// Commands that are no verbs: the prompt, and those that take files in place of a show to open. A
// doc comment here would be the program's description.
#[derive(Debug, Subcommand)]
pub enum OwnCommand {
    /// open the prompt on a show
    #[command(after_help = "`help` at the prompt lists what can be typed there.\n\n\
        Example:\n  footlight repl show.lxq\n  \
        footlight repl show.lxq -c 'set lamps 40' -c 'record 2.5 \"Lamp up\"' -c save")]
    Repl {
        #[arg(id = "SHOW", help = SHOW)]
        show: Option<PathBuf>,
        #[arg(short = 'c', value_name = "LINE", help = LINE)]
        commands: Vec<String>,
    },
    /// bring shows into their canonical layout, comments and groups kept
    #[command(after_help = "Example:\n  footlight fmt show.lxq\n  footlight fmt --check *.lxq")]
    Fmt {
        /// The shows' files (.lxq), written in place
        #[arg(id = "FILE", value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
        /// Write nothing; exit with 1 when a file is laid out otherwise
        #[arg(long)]
        check: bool,
    },
    /// what changed between two versions of a show, in cues and in light
    #[command(
        after_help = "Exits with 0 when nothing changed, 1 when something did, 2 when it \
        cannot tell.\n\nExample:\n  footlight diff old.lxq show.lxq -o changes.png"
    )]
    Diff {
        /// The older and the newer file; or the seven words of git's diff drivers
        #[arg(id = "FILE", value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
        /// draw the changed curves as a .png or an .svg
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// what a message's code means, with a wrong sheet and its correction
    #[command(after_help = "Example:\n  footlight explain E012")]
    Explain {
        /// Such as E012
        #[arg(id = "CODE")]
        code: String,
    },
    /// what a stage's file holds: extent, polygons, materials, lights, cameras
    #[command(after_help = "Example:\n  footlight stage set.obj")]
    Stage {
        /// An OBJ or glTF file
        #[arg(id = "FILE", value_name = "FILE")]
        file: PathBuf,
    },
    /// the text of a show for a file of another program: a desk's cues, a plan's rig
    #[command(after_help = "Example:\n  footlight import house.asc -o house.lxq\n  \
        footlight import plan.mvr -o rig.lxq")]
    Import(Imported),
    /// render a task of a list that `plan --tasks` wrote, or whatever of it is free
    #[command(
        after_help = "Exits with 0 when it is done or was already, 75 when it is to be tried again (others \
        are at work on it, or it could not be stored), 65 when the list is of another version of \
        the program, the renderer or the show.\n\nExample:\n  \
        footlight plan show.lxq --tasks tasks.json\n  footlight work tasks.json"
    )]
    Work(Worker),
    /// how far a list of tasks is: what is missing, and why
    #[command(
        after_help = "Exits with 0 when everything is there, else with 75.\n\n\
        Example:\n  footlight collect tasks.json"
    )]
    Collect {
        /// The list that `plan --tasks` wrote
        #[arg(id = "TASKS")]
        tasks: PathBuf,
        /// Print data instead of words
        #[arg(long)]
        json: bool,
    },
    /// serve a show's page to browsers of this machine, from the file as it is edited
    #[cfg(feature = "serve")]
    #[command(
        after_help = "The first address that it prints runs the show, the second follows it. \
        Ctrl-C ends it.\n\nExample:\n  footlight serve show.lxq"
    )]
    Serve {
        /// The show's file (.lxq)
        #[arg(id = "SHOW")]
        show: PathBuf,
        /// the port to listen at (default: any that is free)
        #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..))]
        port: Option<u16>,
    },
    /// serve an editor by the language server protocol, on standard input and output
    #[cfg(feature = "lsp")]
    #[command(
        after_help = "Editors start it; the manual's page `editors` has the lines for them.\n\n\
        Example:\n  footlight lsp"
    )]
    Lsp,
    /// print a script that completes this program's commands in a shell
    #[command(after_help = "Example:\n  footlight completions bash > footlight.bash")]
    Completions {
        /// The shell
        #[arg(id = "SHELL")]
        shell: clap_complete::Shell,
    },
}

/// Reads the arguments. Its error is also what help and the version are.
pub fn parse(arguments: impl Iterator<Item = OsString>) -> Result<(Settings, Task), clap::Error> {
    let matches = command().try_get_matches_from(arguments)?;
    let settings = Settings::from_arg_matches(&matches)?;
    let task = match matches.subcommand() {
        None => Task::Own(OwnCommand::Repl {
            show: None,
            commands: settings.commands.clone(),
        }),
        Some((name, _)) if OwnCommand::has_subcommand(name) => {
            Task::Own(OwnCommand::from_arg_matches(&matches)?)
        }
        Some((name, sub)) => {
            let spec = VERBS.iter().find(|v| v.name == name);
            let spec = spec.ok_or(clap::Error::new(ErrorKind::InvalidSubcommand))?;
            let show = sub.get_one::<PathBuf>("SHOW").cloned();
            Task::Verb {
                show: show.ok_or(clap::Error::new(ErrorKind::MissingRequiredArgument))?,
                call: call(spec, sub),
            }
        }
    };
    Ok((settings, task))
}

/// A time that is not nothing, as shows write them.
pub fn time_limit(text: &str) -> Result<Duration, String> {
    let micros = lang::time(text).and_then(|time| u64::try_from(time.micros()).ok());
    match micros.filter(|micros| *micros > 0) {
        Some(micros) => Ok(Duration::from_micros(micros)),
        None => Err("write a time, such as `30s`, `5:00` or `500ms`".to_owned()),
    }
}

fn call(spec: &'static VerbSpec, matches: &ArgMatches) -> Call {
    let mut call = Call::new(spec);
    for option in spec.options {
        let given = match option.value {
            None => matches.get_flag(option.name).then(OsString::new),
            Some(_) => matches.get_one::<OsString>(option.name).cloned(),
        };
        call.options
            .extend(given.map(|value| (option.name.to_owned(), value)));
    }
    let kind = (!spec.kinds.is_empty()).then(|| matches.get_one::<String>("kind"));
    call.words.extend(kind.flatten().map(OsString::from));
    if !spec.words.is_empty() {
        let words = matches.get_many::<OsString>("words");
        call.words.extend(words.into_iter().flatten().cloned());
    }
    call
}

/// How a word or the value of an option is read: all but the name of a file is UTF-8.
fn text_or_path(is_path: bool) -> ValueParser {
    if is_path {
        ValueParser::os_string()
    } else {
        StringValueParser::new().map(OsString::from).into()
    }
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
        );
    let root = OwnCommand::augment_subcommands(Settings::augment_args(root));
    let verbs = VERBS.iter().filter(|v| v.command);
    root.subcommands(verbs.map(subcommand))
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
    let show = Arg::new("SHOW").value_parser(value_parser!(PathBuf));
    out = out.arg(show.required(true).help(SHOW));
    if !spec.words.is_empty() {
        // The outer brackets, around what may be left out, are clap's to write.
        let name = spec.words.strip_prefix('[');
        let name = name.and_then(|name| name.strip_suffix(']'));
        let words = Arg::new("words").num_args(0..);
        let words = words.value_name(name.unwrap_or(spec.words));
        out = out.arg(words.value_parser(text_or_path(spec.takes_files())));
    }
    for option in spec.options {
        let mut arg = Arg::new(option.name)
            .long(option.name)
            .allow_negative_numbers(option.value.is_some())
            .help(option.about);
        if let Some(letter) = option.letter {
            arg = arg.short(letter);
        }
        out = out.arg(match option.value {
            Some(value) => {
                let is_path = matches!(value, "FILE" | "DIR");
                arg.value_name(value).value_parser(text_or_path(is_path))
            }
            None => arg.action(ArgAction::SetTrue),
        });
    }
    out
}
