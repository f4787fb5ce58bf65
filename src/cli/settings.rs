//! Settings of every command, as types.

use std::num::NonZero;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, value_parser};

use footlight_engine::POOL_LIMIT;
use footlight_host::files;
use footlight_show::diagnostic::Style;
use footlight_transport::outside;

/// Bytes of the program itself.
const PROGRAM: usize = 64 << 20;

/// Help of `-c`.
pub const LINE: &str = "Run this line instead of opening the prompt; may be repeated";

// Options of every command, and the lines to run without a command. A doc comment here would become
// the program's description.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Options of every command")]
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
    pub commands: Vec<String>,
}

impl Settings {
    /// Style of diagnostics; [`Style::Plain`] becomes coloured on a terminal.
    pub fn format(&self) -> Style {
        self.format.unwrap_or(Style::Plain)
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        let all = || std::thread::available_parallelism().map_or(1, NonZero::get);
        self.threads.unwrap_or_else(all)
    }

    /// True when the user, or the system, limits the memory of a show.
    pub fn is_memory_limited(&self) -> bool {
        self.memory.is_some() || files::is_limited()
    }

    /// Memory of a show, read and rendered, in bytes. With a limit on address space, half of what
    /// the program leaves, because some addresses are reserved without being used.
    pub fn memory(&self) -> usize {
        let addresses = files::address_space().saturating_sub(PROGRAM);
        self.memory.unwrap_or(4 << 30).min(addresses / 2)
    }

    /// Most bytes of images in their folder.
    pub fn pool_limit(&self) -> u64 {
        self.pool_limit.unwrap_or(POOL_LIMIT)
    }

    /// The external renderer, if any.
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

    /// Options to pass to a worker on another machine.
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

/// A renderer's command as typed, and parsed.
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
