//! `refine … &`: refinement beside the prompt, with `status`, `wait` and `stop`.
//!
//! The interpreter stays the only owner of show, plan and pool. What is rendered beside it is one
//! call of the operator at a time, lent out with all that it needs; [`Interpreter::attend`] takes
//! the pictures in and starts the next call, planned anew from the show as it is then. So edits and
//! pictures are served at once in between, every finished picture improves the next preview, and an
//! edit changes what is still to come. Pictures are rendered one at a time: a call of several would
//! keep the first waiting for the last.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::answer::{count, percent};
use super::refine::{Ended, Goal, Refined, no_stage};
use super::stage::{Again, Footing, Returned};
use super::{Call, Error, Interpreter, Method, Reply, economy};
use crate::picture::Image;
use crate::pool::archive::Wanted;
use crate::report::words::seconds;
use crate::renderer::{Quality, TransportError};
use crate::work::{Progress, Work};

/// How long a wait goes on before it looks at progress and cancel again.
const GLANCE: Duration = Duration::from_millis(40);

/// Runs tasks beside the caller, such as on threads.
pub trait Background {
    /// Starts a task and comes back; [`Interpreter::attend`] should be called once it is done.
    fn start(&self, task: Box<dyn FnOnce() + Send>);
}

/// How far a rendering elsewhere is, and the way to stop it.
#[derive(Debug, Default)]
struct Gauge {
    stop: AtomicBool,
    at: Mutex<(String, usize, usize)>,
}

impl Gauge {
    fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    fn at(&self) -> (String, usize, usize) {
        let held = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        held.clone()
    }
}

impl Progress for Gauge {
    fn report(&self, task: &str, done: usize, total: usize) {
        let mut held = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        *held = (task.to_owned(), done, total);
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }
}

/// One call of the operator that is at work elsewhere. Dropped, it is given up.
struct InHand {
    footing: Footing,
    quality: Quality,
    settings: Vec<Vec<f64>>,
    wanted: Option<Vec<Wanted>>,
    /// Corrections for the pool; else its coarse pictures.
    refined: bool,
    gauge: Arc<Gauge>,
    from: Receiver<Returned>,
    /// What came back before it was asked for.
    returned: Option<Returned>,
    begin: f64,
    predicted: f64,
}

impl InHand {
    /// Waits at most `patience` for it; `Some(false)` where it will never come back.
    fn wait(&mut self, patience: Duration) -> Option<bool> {
        if self.returned.is_none() {
            match self.from.recv_timeout(patience) {
                Ok(returned) => self.returned = Some(returned),
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => return Some(false),
            }
        }
        Some(true)
    }

    fn describe(&self) -> String {
        let what = match self.refined {
            true => "a picture".to_owned(),
            false => count(self.settings.len(), "coarse picture"),
        };
        format!("{what} at quality {}", self.quality.0)
    }
}

impl Drop for InHand {
    fn drop(&mut self) {
        self.gauge.stop();
    }
}

/// A refinement beside the prompt.
pub(super) struct Beside {
    goal: Goal,
    words: String,
    method: Method,
    done: Refined,
    hand: Option<InHand>,
    stopping: bool,
    /// Coarse pictures that no pool holds yet.
    held: Vec<Arc<Image>>,
    /// When the coarse pictures were begun.
    begin: f64,
}

/// How far a refinement beside the prompt is.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// What was asked for, as it was typed.
    pub words: String,
    /// Pictures that it has added.
    pub rendered: usize,
    /// Seconds that they took.
    pub seconds: f64,
    /// Predicted error of the sequence, relative; `None` before the coarse pictures are there.
    pub error: Option<f64>,
    /// What is being rendered, for how long, and how long it is predicted to take, in seconds.
    pub in_hand: Option<(String, f64, f64)>,
    /// The loop that it is in: its name, steps done and steps in all.
    pub task: (String, usize, usize),
    /// Pictures that are predicted to follow, the seconds until the last of them is there, and the
    /// error that they will leave.
    pub ahead: Option<(usize, f64, f64)>,
}

impl Interpreter {
    /// True while a refinement goes on beside the prompt.
    pub fn is_busy(&self) -> bool {
        self.beside.is_some()
    }

    /// Refuses what would render the same pictures twice.
    pub(super) fn idle(&self) -> Result<(), Error> {
        match &self.beside {
            None => Ok(()),
            Some(beside) => Err(Error::Usage(format!(
                "`{}` is at work: `wait` for it, or `stop` it",
                beside.words
            ))),
        }
    }

    /// Begins a refinement that goes on while other verbs are served; see [`Interpreter::attend`].
    ///
    /// # Errors
    /// [`Error::Usage`] when one is at work already, when the host gives no [`Background`], and
    /// when the show has no stage or view.
    pub fn refine_beside(&mut self, goal: Goal, words: &str) -> Result<Vec<String>, Error> {
        self.idle()?;
        if self.host.background.is_none() {
            return Err(Error::Usage(
                "nothing can run beside the prompt here; say it without `&`".to_owned(),
            ));
        }
        if self.stage.is_none() {
            return Err(no_stage());
        }
        self.beside = Some(Beside {
            goal: goal.or_one(),
            words: words.to_owned(),
            method: self.method,
            done: Refined::default(),
            hand: None,
            stopping: false,
            held: Vec::new(),
            begin: self.host.clock.seconds(),
        });
        Ok(self.attend())
    }

    /// Takes in what was rendered beside the prompt and starts what comes next; what there is to
    /// tell of it. Cheap while nothing is finished; every verb does it first.
    pub fn attend(&mut self) -> Vec<String> {
        let Some(mut beside) = self.beside.take() else {
            return Vec::new();
        };
        let usual = std::mem::replace(&mut self.method, beside.method);
        let ended = self.go_on(&mut beside);
        self.method = usual;
        let ended = match ended {
            Ok(None) => {
                self.beside = Some(beside);
                return Vec::new();
            }
            Ok(Some(ended)) => ended.words().to_owned(),
            Err(error) => format!("stopped: {error}"),
        };
        let error = self.predicted_error();
        let mut text = format!("{}: ", beside.words);
        if let Ok(error) = error {
            let refined = count(self.refined(), "refined picture");
            let _ = write!(text, "error {} % with {refined}; ", percent(error));
        }
        text.push_str(if ended.is_empty() { "done" } else { &ended });
        let mut notes = beside.done.remarks;
        notes.push(text);
        notes
    }

    /// As far as it goes without waiting.
    fn go_on(&mut self, beside: &mut Beside) -> Result<Option<Ended>, Error> {
        loop {
            if let Some(mut hand) = beside.hand.take() {
                match hand.wait(Duration::ZERO) {
                    None => {
                        beside.hand = Some(hand);
                        return Ok(None);
                    }
                    Some(false) => {
                        // Its operator is lost with it.
                        if let Some(stage) = self.stage.as_mut() {
                            stage.give_back(hand.quality, None);
                        }
                        return Err(Error::Device("the rendering broke off".to_owned()));
                    }
                    Some(true) => self.bring_home(beside, hand)?,
                }
            }
            if beside.stopping {
                return Ok(Some(Ended::Stopped));
            }
            if let Some(ended) = self.next_beside(beside)? {
                return Ok(Some(ended));
            }
        }
    }

    /// Takes in what a call of the operator rendered. One that was cancelled brings nothing.
    fn bring_home(&mut self, beside: &mut Beside, mut hand: InHand) -> Result<(), Error> {
        let Some(returned) = hand.returned.take() else {
            return Ok(());
        };
        let means = self.host.means();
        let Some(stage) = self.stage.as_mut() else {
            return Ok(());
        };
        let same = stage.stands_on(&hand.footing);
        if same {
            stage.give_back(hand.quality, returned.operator);
        }
        let images = match returned.images {
            Err(TransportError::Cancelled(_)) => return Ok(()),
            other => other?,
        };
        let seconds = self.host.clock.seconds() - hand.begin;
        self.pace.learn(hand.predicted, seconds);
        let kept = stage.take_in(hand.wanted.as_deref(), images, means);
        stage.trim(means.work.memory);
        if !hand.refined {
            beside.held.extend(kept);
            return Ok(());
        }
        beside.done.rendered += kept.len();
        beside.done.seconds += seconds;
        // Of another rig it serves as soon as a pool of that is made anew.
        if !same || stage.pool.is_none() {
            return Ok(());
        }
        let settings = std::mem::take(&mut hand.settings);
        self.add_refined(Again::of(settings, kept, hand.quality), hand.begin)
    }

    /// Starts the next call of the operator, or takes up pictures that are at hand; why nothing is
    /// to be done, if so.
    fn next_beside(&mut self, beside: &mut Beside) -> Result<Option<Ended>, Error> {
        if self.pool().is_none() {
            self.coarse_beside(beside)?;
            return Ok(None);
        }
        if let Some(ended) = self.ended(&beside.goal, &beside.done)? {
            return Ok(Some(ended));
        }
        let outlook = self.outlook()?;
        let Some(next) = outlook.steps.into_iter().next() else {
            return Ok(Some(Ended::Complete));
        };
        let left = beside.goal.budget.map(|s| s - beside.done.seconds);
        if beside.done.rendered > 0 && left.is_some_and(|left| next.seconds > left) {
            beside.done.remarks.extend(economy::too_long(next.seconds));
            return Ok(Some(Ended::Spent));
        }
        let begin = self.host.clock.seconds();
        let quality = self.refined_step();
        let store = self.host.store.as_ref();
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        let place = stage.pool.as_ref().map_or(0, |p| p.refined().len());
        let settings = [next.setting];
        let (found, missing) = stage.find(quality, &settings, Some(place), store);
        if !missing.settings.is_empty() {
            let call = (missing.settings, missing.wanted, true);
            self.launch(beside, quality, call, next.seconds)?;
            return Ok(None);
        }
        beside.done.rendered += 1;
        let found = found.into_iter().flatten();
        self.add_refined(Again::of(settings, found, quality), begin)?;
        Ok(None)
    }

    /// Starts rendering the coarse pictures that are missing; makes the pool once all are there.
    fn coarse_beside(&mut self, beside: &mut Beside) -> Result<(), Error> {
        let [cheap, fine] = self.coarse_steps();
        let transport = Arc::clone(&self.host.transport);
        let store = self.host.store.as_ref();
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        let units = stage.units();
        let cheaper = Some(cheap).filter(|c| *c < fine && stage.keeps());
        let steps = cheaper.into_iter().chain(stage.keeps().then_some(fine));
        for quality in steps.map(Quality) {
            let (found, missing) = stage.find(quality, &units, None, store);
            beside.held.extend(found.into_iter().flatten());
            if !missing.settings.is_empty() {
                let pictures = missing.settings.len();
                let cost = stage.cost_of_units(transport.as_ref(), quality, pictures);
                let predicted = cost * self.pace.seconds();
                let call = (missing.settings, missing.wanted, false);
                return self.launch(beside, quality, call, predicted);
            }
        }
        // All are at hand; or they cannot be kept, and are rendered here.
        self.coarse_since(beside.begin)?;
        beside.held.clear();
        Ok(())
    }

    /// Starts a call of the operator: settings, their addresses, and whether they are refined.
    fn launch(
        &mut self,
        beside: &mut Beside,
        quality: Quality,
        (settings, wanted, refined): (Vec<Vec<f64>>, Option<Vec<Wanted>>, bool),
        predicted: f64,
    ) -> Result<(), Error> {
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        let background = self.host.background.as_ref().ok_or_else(no_stage)?;
        let footing = stage.setup();
        let loan = stage.lend(quality, settings.clone());
        let gauge = Arc::new(Gauge::default());
        let (send, from) = channel();
        let transport = Arc::clone(&self.host.transport);
        let (threads, memory) = (self.host.threads, self.host.memory);
        let begin = self.host.clock.seconds();
        let watched = Arc::clone(&gauge);
        background.start(Box::new(move || {
            let work = Work {
                progress: watched.as_ref(),
                threads,
                memory,
            };
            // Nobody may want it any more.
            let _ = send.send(loan.render(transport.as_ref(), work));
        }));
        beside.hand = Some(InHand {
            footing,
            quality,
            settings,
            wanted,
            refined,
            gauge,
            from,
            returned: None,
            begin,
            predicted,
        });
        Ok(())
    }

    /// Gives up a call of the operator whose pictures the show has no use for any more: they would
    /// show another scene, or from another place. In another light they are of use again.
    pub(super) fn drop_useless(&mut self) {
        let Some(hand) = self.beside.as_ref().and_then(|b| b.hand.as_ref()) else {
            return;
        };
        if self.stage.as_ref().is_none_or(|s| !s.sees(&hand.footing)) {
            hand.gauge.stop();
        }
    }

    /// Waits while the refinement beside the prompt is at work and `enough` is not true, reporting
    /// its progress as that of the foreground; what there is to tell.
    fn wait_beside(&mut self, enough: impl Fn(&Interpreter) -> bool) -> Result<Vec<String>, Error> {
        let mut notes = self.attend();
        while !enough(self) {
            let Some(hand) = self.beside.as_mut().and_then(|b| b.hand.as_mut()) else {
                break;
            };
            if hand.wait(GLANCE).is_some() {
                notes.extend(self.attend());
                continue;
            }
            let (task, done, total) = hand.gauge.at();
            if total > 0 {
                self.host.progress.report(&task, done, total);
            }
            self.host.work().check()?;
        }
        Ok(notes)
    }

    /// Waits for the coarse pictures, if they are being rendered beside the prompt.
    pub(super) fn wait_for_coarse(&mut self) -> Result<(), Error> {
        let notes = self.wait_beside(|me| me.pool().is_some())?;
        self.unheard.extend(notes);
        Ok(())
    }

    /// Waits until the refinement beside the prompt has ended; what there is to tell of it.
    ///
    /// # Errors
    /// [`Error::Cancelled`] when the host's progress says so, [`Error::OutOfTime`]; the refinement
    /// then goes on.
    pub fn wait(&mut self) -> Result<Vec<String>, Error> {
        self.in_time(|show| show.wait_beside(|_| false))
    }

    /// Ends the refinement beside the prompt after the picture in hand, or at once.
    pub fn stop(&mut self, at_once: bool) -> Vec<String> {
        if let Some(beside) = &mut self.beside {
            beside.stopping = true;
            if let Some(hand) = beside.hand.as_ref().filter(|_| at_once) {
                hand.gauge.stop();
            }
        }
        self.attend()
    }

    /// How far the refinement beside the prompt is, if there is one.
    pub fn status(&self) -> Option<Status> {
        let beside = self.beside.as_ref()?;
        let now = self.host.clock.seconds();
        let hand = beside.hand.as_ref();
        let in_hand = hand.map(|h| (h.describe(), now - h.begin, h.predicted));
        Some(Status {
            words: beside.words.clone(),
            rendered: beside.done.rendered,
            seconds: beside.done.seconds,
            error: self.predicted_error().ok(),
            task: hand.map(|h| h.gauge.at()).unwrap_or_default(),
            ahead: self.ahead(beside, now),
            in_hand,
        })
    }

    /// What is predicted to follow: pictures, seconds, and the error that they leave.
    fn ahead(&self, beside: &Beside, now: f64) -> Option<(usize, f64, f64)> {
        let outlook = self.outlook().ok()?;
        let goal = &beside.goal;
        let left = goal.budget.map(|s| s - beside.done.seconds);
        let next = economy::call(&outlook, goal, self.refined(), left);
        let counted = goal.count.map(|n| n.saturating_sub(beside.done.rendered));
        let needed = counted.map_or(next.needed, |n| n.min(next.needed));
        let fits = |sum: f64| left.is_none_or(|left| sum <= left);
        let hand = beside.hand.as_ref().filter(|h| h.refined);
        let spent = hand.map_or(0.0, |h| now - h.begin);
        let (mut pictures, mut sum, mut error) = (0, 0.0, outlook.error);
        for (i, step) in outlook.steps.iter().take(needed).enumerate() {
            // The first is in hand already, with what it takes beyond the others.
            let seconds = match hand {
                Some(hand) if i == 0 => (hand.predicted - spent).max(0.0),
                _ => step.seconds,
            };
            if i > 0 && !fits(sum + seconds) {
                break;
            }
            (pictures, sum, error) = (pictures + 1, sum + seconds, step.error);
        }
        (pictures > 0).then_some((pictures, sum, error))
    }

    pub(super) fn answer_status(&self) -> Reply {
        let Some(status) = self.status() else {
            let mut text = "nothing is at work beside the prompt".to_owned();
            if let Some(step) = self.steps.last() {
                let _ = write!(
                    text,
                    "; {}, error {} %",
                    count(step.refined, "refined picture"),
                    percent(step.error)
                );
            }
            return Reply::text(text);
        };
        Reply::text(status.describe())
    }

    pub(super) fn answer_stop(&mut self, call: &Call) -> Result<Reply, Error> {
        let at_once = match call.words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            [] => false,
            ["now"] => true,
            _ => return Err(Error::Usage("usage: stop [now]".to_owned())),
        };
        if self.beside.is_none() {
            return Ok(self.answer_status());
        }
        let notes = self.stop(at_once);
        Ok(Reply::text(match (notes.is_empty(), at_once) {
            (false, _) => notes.join("\n"),
            (true, false) => {
                "it stops after what is in hand, which is kept; `stop now` gives that up".to_owned()
            }
            (true, true) => "it stops".to_owned(),
        }))
    }

    pub(super) fn answer_wait(&mut self) -> Result<Reply, Error> {
        if self.beside.is_none() {
            return Ok(self.answer_status());
        }
        Ok(Reply::text(self.wait()?.join("\n")))
    }
}

impl Status {
    /// In a few lines.
    pub fn describe(&self) -> String {
        let mut text = format!("{}: ", self.words);
        match self.error {
            Some(error) => {
                let done = match self.rendered {
                    0 => "no picture finished yet".to_owned(),
                    n => format!("{} in {}", count(n, "picture"), seconds(self.seconds)),
                };
                let _ = writeln!(text, "{done}, error {} %", percent(error));
            }
            None => text.push_str("before the first refined picture\n"),
        }
        if let Some((what, spent, predicted)) = &self.in_hand {
            let _ = write!(text, "  in hand: {what}, {}", seconds(*spent));
            if *predicted > 0.0 {
                let _ = write!(text, " of {} predicted", seconds(*predicted));
            }
            match &self.task {
                (_, _, 0) => {}
                (task, done, total) => {
                    let _ = write!(text, " ({task}: {done} of {total})");
                }
            }
            text.push('\n');
        }
        if let Some((pictures, left, error)) = self.ahead {
            let _ = writeln!(
                text,
                "  to come: {}, predicted to be there in {} with error {} %",
                count(pictures, "picture"),
                seconds(left),
                percent(error)
            );
        }
        text
    }
}
