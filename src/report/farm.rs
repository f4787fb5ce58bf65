//! Refinement on a farm: lists a goal's tasks, submits them, waits, collects the images, and plans
//! again.
//!
//! The farm owns queues and nodes. Lost tasks are resubmitted up to three times; existing images
//! are never rendered twice.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::{Error, tasks};
use footlight_engine::{self as engine, Engine, LEASE, Refinement, TaskList, TaskState};
use footlight_host::files::{FileError, claim};
use footlight_host::work::Cancelled;

/// Tasks per job: the usual limit of farms.
const MOST: usize = 1000;

/// Submissions of a task that ends without an image.
const ATTEMPTS: usize = 3;

/// Consecutive failed queries of a farm before it is given up.
const PATIENCE: usize = 60;

/// A program that runs workers on other machines.
pub trait Farm: Send {
    /// Starts a worker for each of these tasks of a list, and returns the job's name.
    ///
    /// # Errors
    /// The farm's message.
    fn submit(&self, list: &Path, tasks: &[usize]) -> Result<String, String>;

    /// Tasks of a job that wait or run.
    ///
    /// # Errors
    /// The farm's message, when it does not answer now.
    fn queued(&self, job: &str) -> Result<BTreeSet<usize>, String>;

    /// Ends a job, if possible.
    fn cancel(&self, job: &str);

    /// Waits before the next query, a second or so, or until `is_over` is true.
    fn rest(&self, is_over: &dyn Fn() -> bool);
}

/// Renders all images of a goal on a farm, so that the engine need not render. Returns the number
/// of images rendered.
///
/// # Errors
/// Errors of planning; [`engine::Error::Farm`] when the farm does not work or a task fails
/// repeatedly; on cancel, after ending all jobs. Finished images are kept.
pub fn refine(engine: &mut Engine, wanted: Refinement, farm: &dyn Farm) -> Result<usize, Error> {
    let mut wanted = wanted;
    wanted.goal = wanted.goal.or_one();
    let mut rendered = 0;
    loop {
        let mut list = TaskList::of(engine, wanted.clone())?;
        if list.tasks.is_empty() {
            return Ok(rendered);
        }
        list.tasks.truncate(MOST);
        round(engine, &list, farm)?;
        rendered += list.tasks.len();
        let mixtures = list.tasks.iter().filter(|task| task.order.is_some());
        let mixtures = mixtures.count();
        wanted.goal.count = wanted
            .goal
            .count
            .map(|count| count.saturating_sub(mixtures));
    }
}

/// Runs a list, and removes its file.
fn round(engine: &mut Engine, list: &TaskList, farm: &dyn Farm) -> Result<(), Error> {
    let path = list_path(list)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    if engine.host().store.is_link(folder) {
        let (path, kind) = (folder.display().to_string(), "a link");
        return Err(FileError::NotAFile { path, kind }.into());
    }
    tasks::write(engine.host().store.as_ref(), &path, list)?;
    let mut round = Round {
        list,
        path: &path,
        farm,
        jobs: Vec::new(),
        attempts: BTreeMap::new(),
        lost: BTreeSet::new(),
        silent: 0,
        there: 0,
    };
    let done = round.run(engine);
    // Cancel the jobs of a finished list too: waiting tasks have nothing to do.
    round.jobs.iter().for_each(|job| farm.cancel(job));
    engine.host().store.remove(&path)?;
    done
}

/// A unique file in the pool, which all machines see.
fn list_path(list: &TaskList) -> Result<PathBuf, Error> {
    let pool = std::path::absolute(&list.pool).map_err(|error| farm_error(&error))?;
    let name = format!("{}-{}.json", claim::host(), std::process::id());
    Ok(pool.join("tasks").join(name))
}

fn farm_error(what: &impl ToString) -> Error {
    engine::Error::Farm(what.to_string()).into()
}

/// A list being run.
struct Round<'a> {
    list: &'a TaskList,
    path: &'a Path,
    farm: &'a dyn Farm,
    jobs: Vec<String>,
    /// Number of resubmissions by task.
    attempts: BTreeMap<usize, usize>,
    /// Tasks that had neither image nor queue entry at the last query.
    lost: BTreeSet<usize>,
    /// Number of consecutive failed queries.
    silent: usize,
    there: usize,
}

impl Round<'_> {
    fn run(&mut self, engine: &mut Engine) -> Result<(), Error> {
        let all: Vec<usize> = self.list.tasks.iter().map(|task| task.task).collect();
        self.submit(&all)?;
        while !self.look(engine)? {
            let progress = &engine.host().progress;
            self.farm.rest(&|| progress.cancelled());
            if progress.cancelled() {
                return Err(Cancelled.into());
            }
        }
        Ok(())
    }

    fn submit(&mut self, tasks: &[usize]) -> Result<(), Error> {
        let job = self.farm.submit(self.path, tasks);
        self.jobs.push(job.map_err(|error| farm_error(&error))?);
        Ok(())
    }

    /// Takes new images and resubmits lost tasks; true once all images exist.
    fn look(&mut self, engine: &mut Engine) -> Result<bool, Error> {
        // Query the queue first: a task leaves it after storing its image.
        let queued = self.queued()?;
        let states = self.list.states(engine.host().store.as_ref(), LEASE)?;
        let is_there = |state: &&TaskState| **state == TaskState::There;
        let there = states.iter().filter(is_there).count();
        let progress = &engine.host().progress;
        progress.report("pictures on the farm", there, states.len());
        if there > self.there {
            self.there = there;
            engine.take_up()?;
        }
        if let Some(queued) = queued {
            self.hand_over_again(&queued, &states)?;
        }
        Ok(there == states.len())
    }

    /// Tasks that wait or run; `None` when the farm does not answer now.
    fn queued(&mut self) -> Result<Option<BTreeSet<usize>>, Error> {
        let mut out = BTreeSet::new();
        for job in &self.jobs {
            match self.farm.queued(job) {
                Ok(tasks) => out.extend(tasks),
                Err(error) if self.silent >= PATIENCE => return Err(farm_error(&error)),
                Err(_) => {
                    self.silent += 1;
                    return Ok(None);
                }
            }
        }
        self.silent = 0;
        Ok(Some(out))
    }

    /// Resubmits lost tasks: without image, queue entry and claim twice in a row, because files may
    /// become visible late.
    fn hand_over_again(
        &mut self,
        queued: &BTreeSet<usize>,
        states: &[TaskState],
    ) -> Result<(), Error> {
        let is_lost = |state: &TaskState| match state {
            TaskState::There => false,
            TaskState::Claimed(holder) => holder.is_stale(),
            TaskState::Failed(_) | TaskState::Free => true,
        };
        let pairs = self.list.tasks.iter().zip(states);
        let lost = pairs.filter(|(task, state)| is_lost(state) && !queued.contains(&task.task));
        let lost: BTreeSet<usize> = lost.map(|(task, _)| task.task).collect();
        let again: Vec<usize> = lost.intersection(&self.lost).copied().collect();
        self.lost = lost;
        if again.is_empty() {
            return Ok(());
        }
        for task in &again {
            let attempts = self.attempts.entry(*task).or_insert(1);
            *attempts += 1;
            if *attempts > ATTEMPTS {
                return Err(self.given_up(states));
            }
        }
        self.lost.clear();
        self.submit(&again)
    }

    fn given_up(&self, states: &[TaskState]) -> Error {
        farm_error(&format!(
            "tasks were handed to the farm {ATTEMPTS} times and ended without a picture\n{}a node may \
             not see this program, the show's folder or the pool: try a line by hand there, `footlight \
             work {} N`",
            tasks::describe(self.list, states),
            self.path.display()
        ))
    }
}
