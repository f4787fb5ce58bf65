//! The command line: settings and file commands as types, and the verbs of the prompt with the
//! show's file before their words.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args as _, Command, FromArgMatches, Subcommand, value_parser};

use super::import::Imported;
use super::send::Sent;
use super::settings::{LINE, Settings};
use super::work::Worker;
use footlight_prompt::{Verb, example};

const SHOW: &str = "The show's file (.lxq); `-` reads standard input";

/// The requested task.
#[derive(Debug)]
pub enum Task {
    /// A command that is not a verb.
    Own(OwnCommand),
    /// One verb on a show.
    Verb { show: PathBuf, verb: Box<Verb> },
}

// Commands that are not verbs: the prompt, and those that take files in place of a show to open. A
// doc comment here would become the program's description.
#[derive(Debug, Subcommand)]
pub enum OwnCommand {
    /// Open the prompt on a show
    #[command(after_help = "`help` at the prompt lists what can be typed there.\n\n\
        Example:\n  footlight repl show.lxq\n  \
        footlight repl show.lxq -c 'set lamps 40' -c 'record 2.5 \"Lamp up\"' -c save")]
    Repl {
        #[arg(id = "SHOW", help = SHOW)]
        show: Option<PathBuf>,
        #[arg(short = 'c', value_name = "LINE", help = LINE)]
        commands: Vec<String>,
    },
    /// Bring shows into their canonical layout, comments and groups kept
    #[command(after_help = "Example:\n  footlight fmt show.lxq\n  footlight fmt --check *.lxq")]
    Fmt {
        /// The shows' files (.lxq), written in place
        #[arg(id = "FILE", value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
        /// Write nothing; exit with 1 when a file is laid out otherwise
        #[arg(long)]
        check: bool,
    },
    /// What changed between two versions of a show, in cues and in light
    #[command(
        after_help = "Exits with 0 when nothing changed, 1 when something did, 2 when it \
        cannot tell.\n\nExample:\n  footlight diff old.lxq show.lxq -o changes.png"
    )]
    Diff {
        /// The older and the newer file; or the seven words of git's diff drivers
        #[arg(id = "FILE", value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
        /// Draw the changed curves as a .png or an .svg
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// What a message's code means, with a wrong sheet and its correction
    #[command(after_help = "Example:\n  footlight explain E012")]
    Explain {
        /// Such as E012
        #[arg(id = "CODE")]
        code: String,
    },
    /// What a stage's file holds: extent, polygons, materials, lights, cameras
    #[command(after_help = "Example:\n  footlight stage set.obj")]
    Stage {
        /// An OBJ or glTF file
        #[arg(id = "FILE", value_name = "FILE")]
        file: PathBuf,
    },
    /// The text of a show for a file of another program: a desk's cues, a plan's rig
    #[command(after_help = "Example:\n  footlight import house.asc -o house.lxq\n  \
        footlight import plan.mvr -o rig.lxq")]
    Import(Imported),
    /// Render a task of a list that `plan --tasks` wrote, or whatever of it is free
    #[command(
        after_help = "Exits with 0 when it is done or was already, 75 when it is to be tried again (others \
        are at work on it, or it could not be stored), 65 when the list is of another version of \
        the program, the renderer or the show.\n\nExample:\n  \
        footlight plan show.lxq --tasks tasks.json\n  footlight work tasks.json"
    )]
    Work(Worker),
    /// How far a list of tasks is: what is missing, and why
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
    /// Serve a show's page to browsers of this machine, from the file as it is edited
    #[cfg(feature = "serve")]
    #[command(
        after_help = "The first address that it prints runs the show, the second follows it. \
        Ctrl-C ends it.\n\nExample:\n  footlight serve show.lxq"
    )]
    Serve {
        /// The show's file (.lxq)
        #[arg(id = "SHOW")]
        show: PathBuf,
        /// The port to listen at (default: any that is free)
        #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..))]
        port: Option<u16>,
    },
    /// Serve an editor by the language server protocol, on standard input and output
    #[cfg(feature = "lsp")]
    #[command(
        after_help = "Editors start it; the manual's page `editors` has the lines for them.\n\n\
        Example:\n  footlight lsp"
    )]
    Lsp,
    /// Send the levels of a show to lamps or a visualiser, as E1.31 (sACN) or Art-Net
    #[command(after_help = "Example:\n  footlight send show.lxq --artnet 127.0.0.1")]
    Send(Sent),
    /// Print a script that completes this program's commands in a shell
    #[command(after_help = "Example:\n  footlight completions bash > footlight.bash")]
    Completions {
        /// The shell
        #[arg(id = "SHELL")]
        shell: clap_complete::Shell,
    },
}

/// Parses the arguments. Help and the version are also returned as errors.
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
            let show = sub.get_one::<PathBuf>("SHOW").cloned();
            let show = show.ok_or(clap::Error::new(ErrorKind::MissingRequiredArgument))?;
            show_comes_first(name, &show, sub)?;
            Task::Verb {
                show,
                verb: Box::new(Verb::from_arg_matches(&matches)?),
            }
        }
    };
    Ok((settings, task))
}

/// Rejects `plot rig show.lxq` with a correction.
fn show_comes_first(verb: &str, show: &Path, matches: &ArgMatches) -> Result<(), clap::Error> {
    let is_file = |name: &Path| name == Path::new("-") || name.exists();
    let is_show = |name: &&Path| name.extension() == Some(OsStr::new("lxq")) && is_file(name);
    let words = matches.ids().filter_map(|id| matches.get_raw(id.as_str()));
    match words.flatten().map(Path::new).find(is_show) {
        Some(file) if !is_file(show) => {
            let (word, file) = (show.display(), file.display());
            let message =
                format!("`{word}` is no show; its file comes first: {verb} {file} {word}\n");
            Err(clap::Error::raw(ErrorKind::ValueValidation, message))
        }
        _ => Ok(()),
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
    let verbs = Verb::augment_subcommands(Command::new("prompt"));
    let verbs = verbs.get_subcommands().filter(|verb| !verb.is_hide_set());
    root.subcommands(verbs.map(on_show))
}

/// A verb as a command: the show's file comes before its words, after required ones.
fn on_show(verb: &Command) -> Command {
    let mut positionals = verb.get_positionals();
    let place = 1 + usize::from(positionals.any(Arg::is_required_set));
    let example = example(verb);
    let words: Vec<&str> = example.splitn(place + 1, ' ').collect();
    let (front, rest) = words.split_at(place.min(words.len()));
    let line = [front, &["show.lxq"], rest].concat().join(" ");
    let show = Arg::new("SHOW").value_parser(value_parser!(PathBuf));
    verb.clone()
        .mut_args(|argument| match argument.is_positional() {
            true if argument.is_required_set() => argument.index(1),
            true => argument.index(place + 1),
            false => argument,
        })
        .arg(show.required(true).help(SHOW).index(place))
        .after_help(format!("Example:\n  footlight {line}"))
}
