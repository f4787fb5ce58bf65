//! The verbs: one enum for the prompt, the command line and the manual.
//!
//! A new verb needs a variant and an arm here, and its options and function in a file of `answer`.

use std::sync::LazyLock;

use clap::{Command, Subcommand};

use super::Error;
use super::answer::{edit, export, help, live, measure, picture, play, plot, render, solve, text};
use super::repl::{Repl, Reply};

// The options of each verb.
pub use super::answer::edit::{CopyArgs, DeleteArgs, RenameArgs};
pub use super::answer::export::ExportArgs;
pub use super::answer::help::HelpArgs;
pub use super::answer::live::{AtArgs, BlindArgs, GotoArgs, InsertArgs, RecordArgs, SetArgs};
pub use super::answer::measure::{MeasureArgs, QualityArgs};
pub use super::answer::picture::{PictureArgs, ShotArgs};
pub use super::answer::play::{FilmArgs, FramesArgs, PlayArgs};
pub use super::answer::plot::PlotArgs;
pub use super::answer::render::{PlanArgs, PoolArgs, RefineArgs, RunArgs, StopArgs};
pub use super::answer::solve::SolveArgs;
pub use super::answer::text::{
    DiffArgs, ExplainArgs, FmtArgs, SaveArgs, SheetArgs, ShowArgs, ViewArgs,
};
pub use super::argument::{ByWay, FromView};

/// A verb with its options, in the order of the manual. Its doc comment is its help, `after_help`
/// an example line for the prompt; a hidden verb is not on the command line.
#[derive(Clone, Debug, Subcommand)]
pub enum Verb {
    /// Look for errors in the show, its stage and its curves
    #[command(after_help = "check")]
    Check,
    /// List banks and cues with their times, or the text of NAME
    #[command(after_help = "show lamps", hide = true)]
    Show(text::ShowArgs),
    /// Move to a time and print the levels and the light there
    #[command(after_help = "at cue 2 + 1s", hide = true)]
    At(live::AtArgs),
    /// Keys, basis, and the error predicted after each refined picture
    #[command(after_help = "plan --tolerance 1%")]
    Plan(render::PlanArgs),
    /// One picture of the show
    #[command(after_help = "picture 1:30 -o evening.png")]
    Picture(picture::PictureArgs),
    /// Render refined pictures, most useful first; `&`: in the background
    #[command(after_help = "refine until 2%")]
    Refine(render::RefineArgs),
    /// How far the refinement in the background is, and when it will end
    #[command(after_help = "status", hide = true)]
    Status,
    /// Wait for the refinement; Ctrl-C ends the waiting alone
    #[command(after_help = "wait", hide = true)]
    Wait,
    /// End the refinement in the background after what is in hand, or now
    #[command(after_help = "stop", hide = true)]
    Stop(render::StopArgs),
    /// Play the sequence back from its key images
    #[command(after_help = "play -o show.html")]
    Play(play::PlayArgs),
    /// Write the sequence as a film
    #[command(after_help = "film -o show.y4m")]
    Film(play::FilmArgs),
    /// Write the sequence as numbered pictures, or as layers of an .exr
    #[command(after_help = "frames -o frames/####.png")]
    Frames(play::FramesArgs),
    /// Draw curves of banks and groups, or rig, spectrum, basis
    #[command(after_help = "plot -o curves.svg")]
    Plot(plot::PlotArgs),
    /// The whole loop: pictures, plan, refined ones, page, cues, sheets
    #[command(after_help = "run --until 2%")]
    Run(render::RunArgs),
    /// What a picture is off by, measured on some of its pixels
    #[command(after_help = "measure cue 3")]
    Measure(measure::MeasureArgs),
    /// How long each step of quality is likely to take
    #[command(after_help = "quality")]
    Quality(measure::QualityArgs),
    /// What pictures there are and which serve this show, or free them
    #[command(after_help = "pool drop unused")]
    Pool(render::PoolArgs),
    /// List the views, or make pictures from NAME from now on
    #[command(after_help = "view stalls", hide = true)]
    View(text::ViewArgs),
    /// Run the next cue, and those that follow by themselves, to the end
    #[command(after_help = "go", hide = true)]
    Go,
    /// Back to the end of the cue before
    #[command(after_help = "back", hide = true)]
    Back,
    /// To the end of a cue, or to where a part of its time has gone by
    #[command(after_help = "goto 2.5 at 50%", hide = true)]
    Goto(live::GotoArgs),
    /// Try levels without a cue; a move in time lets go of them
    #[command(after_help = "set lamps 40 sky #203060", hide = true)]
    Set(live::SetArgs),
    /// Try the levels that come nearest to a sketch, or to lux at points
    #[command(after_help = "solve sketch.png --cue 2")]
    Solve(solve::SolveArgs),
    /// Let go of the levels that are tried
    #[command(after_help = "release", hide = true)]
    Release,
    /// Write the tried levels as a new cue; alone: keep blind edits
    #[command(after_help = "record 2.5 \"Lamp up\" --time 3", hide = true)]
    Record(live::RecordArgs),
    /// Write the tried levels into the cue that stands
    #[command(after_help = "update", hide = true)]
    Update,
    /// Write the tried levels as a new cue behind the one that stands
    #[command(after_help = "insert \"Lamp up\" --time 3", hide = true)]
    Insert(live::InsertArgs),
    /// Take a cue or another declaration out
    #[command(after_help = "delete cue 3", hide = true)]
    Delete(edit::DeleteArgs),
    /// Write a cue once more under another number
    #[command(after_help = "copy cue 2 to 7", hide = true)]
    Copy(edit::CopyArgs),
    /// Call something otherwise, wherever the show names it
    #[command(after_help = "rename lamps to practicals", hide = true)]
    Rename(edit::RenameArgs),
    /// Show edits but keep them only by `record`; `off` drops them
    #[command(after_help = "blind", hide = true)]
    Blind(live::BlindArgs),
    /// Take the last edit back
    #[command(after_help = "undo", hide = true)]
    Undo,
    /// Make the edit again that was taken back
    #[command(after_help = "redo", hide = true)]
    Redo,
    /// Cues by banks: each bank's level; moved, tracked, blocked marked
    #[command(after_help = "tracksheet -o tracks.csv")]
    Tracksheet(text::SheetArgs),
    /// What each cue does, when it starts and how long it takes
    #[command(after_help = "cuesheet -o cues.md")]
    Cuesheet(text::SheetArgs),
    /// Every light by channel: what it is, where it hangs and points
    #[command(after_help = "hookup -o hookup.csv")]
    Hookup(text::SheetArgs),
    /// Every light by place, from the house upstage
    #[command(after_help = "schedule -o schedule.md")]
    Schedule(text::SheetArgs),
    /// Write the show for a desk or QLC+; tell what is lost
    #[command(after_help = "export -o show.asc")]
    Export(export::ExportArgs),
    /// Lay out the show's text, comments and groups kept
    #[command(after_help = "fmt", hide = true)]
    Fmt(text::FmtArgs),
    /// What changed since the show was read or saved, or from FILE to it
    #[command(after_help = "diff -o changes.png", hide = true)]
    Diff(text::DiffArgs),
    /// What a message's code means, with a wrong sheet and its correction
    #[command(after_help = "explain E012", hide = true)]
    Explain(text::ExplainArgs),
    /// Write the show's text, comments and layout kept
    #[command(after_help = "save", hide = true)]
    Save(text::SaveArgs),
    /// List the verbs, or explain one
    #[command(after_help = "help picture", hide = true)]
    Help(help::HelpArgs),
    /// Leave
    #[command(alias = "exit", after_help = "quit", hide = true)]
    Quit,
}

/// The verbs as commands.
pub fn verbs() -> &'static Command {
    static VERBS: LazyLock<Command> = LazyLock::new(|| {
        let prompt = Command::new("prompt")
            .no_binary_name(true)
            .disable_help_flag(true)
            .disable_help_subcommand(true);
        let mut verbs = Verb::augment_subcommands(prompt);
        verbs.build();
        verbs
    });
    &VERBS
}

impl Verb {
    /// The option for a view.
    fn view(&self) -> Option<&str> {
        let from = match self {
            Verb::Plan(asked) => &asked.from,
            Verb::Picture(asked) => &asked.shot.from,
            Verb::Refine(asked) => &asked.from,
            Verb::Play(asked) => &asked.from,
            Verb::Film(asked) => &asked.from,
            Verb::Frames(asked) => &asked.from,
            Verb::Run(asked) => &asked.from,
            Verb::Measure(asked) => &asked.picture.from,
            Verb::Solve(asked) => &asked.from,
            _ => return None,
        };
        from.view.as_deref()
    }

    /// Runs the verb.
    pub(super) fn answer(&self, repl: &mut Repl) -> Result<Reply, Error> {
        repl.seen_from(self.view(), |repl| self.answer_there(repl))
    }

    fn answer_there(&self, repl: &mut Repl) -> Result<Reply, Error> {
        match self {
            Verb::Check => text::check(repl),
            Verb::Show(asked) => text::show(repl, asked),
            Verb::At(asked) => live::at(repl, asked),
            Verb::Plan(asked) => render::plan(repl, asked),
            Verb::Picture(asked) => picture::picture(repl, asked),
            Verb::Refine(asked) => render::refine(repl, asked),
            Verb::Status => render::status(repl),
            Verb::Wait => render::wait(repl),
            Verb::Stop(asked) => render::stop(repl, asked),
            Verb::Play(asked) => play::play(repl, asked),
            Verb::Film(asked) => play::film(repl, asked),
            Verb::Frames(asked) => play::frames(repl, asked),
            Verb::Plot(asked) => plot::plot(repl, asked),
            Verb::Run(asked) => render::run(repl, asked),
            Verb::Measure(asked) => measure::measure(repl, asked),
            Verb::Quality(asked) => measure::quality(repl, asked),
            Verb::Pool(asked) => render::pool(repl, asked),
            Verb::View(asked) => text::view(repl, asked),
            Verb::Go => live::go(repl),
            Verb::Back => live::back(repl),
            Verb::Goto(asked) => live::goto(repl, asked),
            Verb::Set(asked) => live::set(repl, asked),
            Verb::Solve(asked) => solve::solve(repl, asked),
            Verb::Release => live::release(repl),
            Verb::Record(asked) => live::record(repl, asked),
            Verb::Update => live::update(repl),
            Verb::Insert(asked) => live::insert(repl, asked),
            Verb::Delete(asked) => edit::delete(repl, asked),
            Verb::Copy(asked) => edit::copy(repl, asked),
            Verb::Rename(asked) => edit::rename(repl, asked),
            Verb::Blind(asked) => live::blind(repl, asked),
            Verb::Undo => text::undo(repl),
            Verb::Redo => text::redo(repl),
            Verb::Tracksheet(asked) => text::tracksheet(repl, asked),
            Verb::Cuesheet(asked) => text::cuesheet(repl, asked),
            Verb::Hookup(asked) => text::hookup(repl, asked),
            Verb::Schedule(asked) => text::schedule(repl, asked),
            Verb::Export(asked) => export::export(repl, asked),
            Verb::Fmt(asked) => text::fmt(repl, asked),
            Verb::Diff(asked) => text::diff(repl, asked),
            Verb::Explain(asked) => text::explain(asked),
            Verb::Save(asked) => text::save(repl, asked),
            Verb::Help(asked) => help::help(verbs(), asked),
            Verb::Quit => text::quit(repl),
        }
    }
}
