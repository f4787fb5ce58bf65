//! `run`: the whole loop on a show, with its results in a folder.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::answer::{count, duration, fraction, percent, whole};
use super::refine::Ended;
use super::{Call, Error, Goal, Interpreter, Reply, output};
use crate::picture::Image;
use crate::plan::PlanReport;
use crate::playback::Playback;
use crate::playback::key::Format;
use crate::pool::archive::Tally;
use crate::work::Cancelled;

/// What `run` did, and what it took.
#[derive(Clone, Debug)]
pub struct Summary {
    /// The plan at the show's own tolerance, in the metric that the pool allows.
    pub plan: PlanReport,
    /// Why refinement ended.
    pub ended: Ended,
    /// Seconds for coarse pictures, plan, refinement, key images, and writing with playback.
    pub seconds: [f64; 5],
    /// How its pictures were come by.
    pub tally: Tally,
    /// Frames a second of playback alone.
    pub frame_rate: f64,
    /// How its key images are kept.
    pub format: Format,
    /// What was done to the animated picture to keep it within its size.
    pub animation: output::Animation,
    /// The folder with the results.
    pub folder: PathBuf,
}

/// Lies in the folder while results are written, and where that was cut off.
const UNFINISHED: &str = "unfinished.txt";

/// What it says.
const NOTE: &str = "A run of footlight has begun here and not ended: what lies beside this is not \
                    of one run. The same `run` again makes it whole.\n";

/// A run before its results are written.
struct Through {
    plan: PlanReport,
    ended: Ended,
    playback: Playback,
    /// The clock at the beginning and after coarse pictures, plan, refinement and key images.
    marks: [f64; 5],
}

impl Interpreter {
    pub(super) fn answer_run(&mut self, call: &Call) -> Result<Reply, Error> {
        let mut goal = Goal {
            until: call.option("until").map(fraction).transpose()?,
            count: call.option("count").map(whole).transpose()?,
            budget: call
                .option("budget")
                .map(|t| duration(t).map(|t| t.seconds()))
                .transpose()?,
        };
        if goal == Goal::default() {
            goal.until = Some(self.show().preview.tolerance);
        }
        let folder = call
            .option("out")
            .map_or_else(|| self.default_folder(), PathBuf::from);
        let summary = self.run(goal, &folder)?;
        Ok(Reply::text(self.describe_run(&summary)))
    }

    fn default_folder(&self) -> PathBuf {
        let stem = Path::new(&self.name).file_stem().unwrap_or_default();
        Path::new("out").join(stem)
    }

    /// Coarse pictures, plan, refinement until `goal`, whose count is that of the pool's refined
    /// pictures in all, key images, playback; the results go to
    /// `folder`: `plan.json`, `keys/*.exr`, `curves.png`, `error.png`, `basis.png`,
    /// `sequence.png`. Keys of an earlier run are removed. While they are written, and where that is
    /// cut off, `unfinished.txt` says so.
    ///
    /// # Errors
    /// [`Error`]; refined pictures finished before it stay in the pool.
    pub fn run(&mut self, goal: Goal, folder: &Path) -> Result<Summary, Error> {
        self.in_time(|show| show.run_all(goal, folder))
    }

    fn run_all(&mut self, goal: Goal, folder: &Path) -> Result<Summary, Error> {
        // Before anything is rendered: a folder that cannot be written to is told at once.
        let note = folder.join(UNFINISHED);
        self.host.store.write(&note, NOTE.as_bytes())?;
        let before = self.tally();
        let loops = match self.run_through(goal) {
            Ok(loops) => loops,
            Err(error) => {
                // Nothing was written yet: what lies there is of one run.
                self.host.store.remove(&note)?;
                return Err(error);
            }
        };
        let results = self.write_results(&loops.plan, &loops.playback, folder);
        let (animation, frame_rate, format) = results?;
        self.host.store.remove(&note)?;
        let end = self.host.clock.seconds();
        let [a, b, c, d, e] = loops.marks;
        Ok(Summary {
            plan: loops.plan,
            ended: loops.ended,
            seconds: [b - a, c - b, d - c, e - d, end - e],
            tally: self.tally().since(before),
            frame_rate,
            format,
            animation,
            folder: folder.to_owned(),
        })
    }

    /// The loop without its results: coarse pictures, plan, refinement, key images.
    fn run_through(&mut self, goal: Goal) -> Result<Through, Error> {
        self.idle()?;
        let begin = self.host.clock.seconds();
        self.coarse()?;
        let coarse = self.host.clock.seconds();
        // Those that earlier runs stored count, so that a second run renders nothing.
        let goal = Goal {
            count: goal.count.map(|n| n.saturating_sub(self.refined())),
            ..goal
        };
        let tolerance = goal.until.unwrap_or(self.show().preview.tolerance);
        let metric = self.plan_weighting(self.rendered()?)?.metric();
        let plan = self.plan(metric, tolerance)?;
        let planned = self.host.clock.seconds();
        let ended = self.refine(goal)?;
        if ended == Ended::Stopped {
            return Err(Cancelled.into());
        }
        // The chart of what is ahead tells seconds, even where nothing was left to render.
        self.know_pace()?;
        let refined = self.host.clock.seconds();
        let playback = self.playback()?;
        let keys = self.host.clock.seconds();
        Ok(Through {
            plan,
            ended,
            playback,
            marks: [begin, coarse, planned, refined, keys],
        })
    }

    /// Key images from the pool as it stands, ready to play.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, else what rendering says.
    pub fn playback(&mut self) -> Result<Playback, Error> {
        self.coarse()?;
        let pool = self.projected()?;
        Ok(Playback::new(&self.compiled.keys, &pool, self.host.work())?)
    }

    /// The summary a designer reads.
    fn describe_run(&self, done: &Summary) -> String {
        let [coarse, plan, refine, keys, write] = done.seconds;
        let steps = self.steps();
        let first = steps.first().map_or(0.0, |s| s.error);
        let last = steps.last().map_or(0.0, |s| s.error);
        let refined = self.refined();
        let mut text = self.headline() + "\n";
        let mut line = |what: &str, words: String, seconds: f64| {
            let _ = writeln!(text, "  {what:<9} {words:<66} {seconds:>6.1} s");
        };
        let sources = self.show().coordinates().len();
        let [cheap, fine] = self.coarse_steps();
        let at = match cheap == fine {
            true => format!("at quality {cheap}"),
            false => format!("at quality {cheap} and {fine}"),
        };
        line(
            "coarse",
            format!("{} {at}", count(sources, "picture")),
            coarse,
        );
        line(
            "plan",
            format!(
                "{}, {}, rank {}",
                count(done.plan.segments.len(), "segment"),
                count(done.plan.keys.len(), "key"),
                done.plan.rank
            ),
            plan,
        );
        let ended = match done.ended {
            Ended::Reached => "tolerance reached",
            Ended::Counted => "as many as asked for",
            Ended::Spent => "budget used up",
            Ended::Complete => "nothing left to refine",
            Ended::Stopped => "stopped",
        };
        line(
            "refine",
            format!(
                "{} at quality {}; error {} % -> {} %, predicted ({ended})",
                count(refined, "picture"),
                self.refined_step().0,
                percent(first),
                percent(last)
            ),
            refine,
        );
        let Tally { rendered, .. } = done.tally;
        let from_pool = match done.tally {
            Tally { summed: 0, .. } => count(done.tally.found(), "picture"),
            Tally { summed, .. } => format!(
                "{} ({summed} of them sums of others)",
                count(done.tally.found(), "picture")
            ),
        };
        let _ = writeln!(
            text,
            "  {:<9} from the pool: {from_pool}, rendered: {rendered}",
            "pictures"
        );
        let mut line = |what: &str, words: String, seconds: f64| {
            let _ = writeln!(text, "  {what:<9} {words:<66} {seconds:>6.1} s");
        };
        line("keys", count(done.plan.keys.len(), "key image"), keys);
        line(
            "write",
            "results, most of it the animated sequence".to_owned(),
            write,
        );
        let _ = writeln!(
            text,
            "  playback reaches {:.0} frames/s, at most three blends a frame, keys in {}",
            done.frame_rate,
            done.format.name()
        );
        let _ = writeln!(text, "  sequence.png: {}", done.animation.describe());
        let _ = writeln!(
            text,
            "  results in {}: plan.json, keys/, curves.png, error.png, basis.png, sequence.png",
            done.folder.display()
        );
        text
    }

    /// The picture of a moment from the pool as it stands, coarse pictures rendered if they are
    /// not there.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, else what rendering says.
    pub fn preview(&mut self, time: crate::units::Time) -> Result<Image, Error> {
        self.coarse()?;
        let setting = self.compiled.timeline.evaluate(time);
        Ok(self.projected()?.preview(&setting, self.host.work())?)
    }
}
