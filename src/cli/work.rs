//! `work` and `collect`: task lists shared by machines.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use clap::Args;

use super::screen::Screen;
use super::settings::Settings;
use super::{host, print};
use footlight_engine::{self as engine, Engine, LEASE, Task, TaskList, TaskState, Worked};
use footlight_host::files::{Disk, normal};
use footlight_prompt::Error;
use footlight_report::tasks;
use footlight_show::{lang, printable};
use footlight_transport::outside::{self, Outside};

/// Exit code for trying again later.
const TRY_AGAIN: u8 = 75;

/// The arguments of `work`.
#[derive(Debug, Args)]
pub struct Worker {
    /// The list that `plan --tasks` wrote
    #[arg(id = "TASKS")]
    tasks: PathBuf,
    /// The task, from 1 (default: whatever is free, until nothing is)
    #[arg(id = "N")]
    task: Option<usize>,
    /// How long a claim holds that is not renewed, as where a worker was killed (default: 1:00)
    #[arg(long, value_name = "TIME", value_parser = duration)]
    lease: Option<Duration>,
}

/// Parses a positive time in the notation of shows.
fn duration(text: &str) -> Result<Duration, String> {
    let micros = lang::time(text).and_then(|time| u64::try_from(time.micros()).ok());
    match micros.filter(|micros| *micros > 0) {
        Some(micros) => Ok(Duration::from_micros(micros)),
        None => Err("write a time, such as `30s`, `5:00` or `500ms`".to_owned()),
    }
}

/// Renders a task, or all free ones.
pub fn work(told: &Worker, settings: &Settings, screen: &Screen) -> Result<u8, Error> {
    let list = read(&told.tasks, settings)?;
    let chosen = match told.task {
        None => None,
        Some(number) => Some(
            number
                .checked_sub(1)
                .and_then(|i| list.tasks.get(i))
                .ok_or(Error::Usage(format!(
                    "there is no task {number}; they are 1 to {}",
                    list.tasks.len()
                )))?,
        ),
    };
    let mut engine = open(&list, settings, screen)?;
    list.check_for(&engine)?;
    let lease = told.lease.unwrap_or(LEASE);
    let done = match chosen {
        Some(task) => one(&mut engine, &list, task, lease),
        None => all_free(&mut engine, &list, lease),
    };
    match done {
        // A full disk or a lost network: another time, or another machine, may succeed.
        Err(engine::Error::File(error)) => {
            let trouble = engine::Error::File(error).into();
            screen.fail(&trouble);
            Ok(TRY_AGAIN)
        }
        done => Ok(done?),
    }
}

/// Reads the list, with the pool given by the user replacing its own.
fn read(path: &Path, settings: &Settings) -> Result<TaskList, Error> {
    let list = tasks::read(&Disk, path)?;
    if let Some(pool) = settings.pool.clone() {
        return Ok(TaskList { pool, ..list });
    }
    // A stranger's list may write only where its show's own images are.
    let plain = |path: &Path| std::path::absolute(path).map(|path| normal(&path)).ok();
    let inside = plain(&list.pool).zip(plain(super::folder_of(&list.show)));
    if inside.is_none_or(|(pool, folder)| !pool.starts_with(folder)) {
        return Err(Error::Usage(format!(
            "{} stores its pictures in {}, outside the show's folder: say `--pool {1}` if that is \
             meant",
            path.display(),
            list.pool.display()
        )));
    }
    Ok(list)
}

fn open(list: &TaskList, settings: &Settings, screen: &Screen) -> Result<Engine, Error> {
    let mut settings = settings.clone();
    settings.pool = Some(list.pool.clone());
    let mut host = host(Some(&list.show), &settings, screen);
    if let Some(call) = settings.renderer() {
        let show = std::path::absolute(&list.show).ok();
        let outside = Outside::new(outside::RendererCall { show, ..call });
        host.renderer = Arc::new(outside.unmeasured());
    }
    let mut engine = Engine::open(&list.show, host)?;
    if let Some(view) = &list.view {
        engine.look_from(view)?;
    }
    Ok(engine)
}

/// Renders one task unless it exists or another worker has claimed it.
fn one(
    engine: &mut Engine,
    list: &TaskList,
    task: &Task,
    lease: Duration,
) -> Result<u8, engine::Error> {
    let worked = list.work_on(engine, task, lease)?;
    print(format!("{}\n", tasks::worked(task.task, &worked)));
    Ok(match worked {
        Worked::Rendered(_) | Worked::There => 0,
        Worked::Claimed(_) => TRY_AGAIN,
    })
}

/// Renders free tasks, then those that failed before, then those that became free meanwhile.
fn all_free(engine: &mut Engine, list: &TaskList, lease: Duration) -> Result<u8, engine::Error> {
    let mut is_new = true;
    loop {
        let states = list.states(&Disk, lease)?;
        let mut open: Vec<_> = list.tasks.iter().zip(&states).collect();
        open.retain(|(_, state)| **state != TaskState::There);
        if open.is_empty() {
            print("every picture is there\n");
            return Ok(0);
        }
        if !is_new {
            print(tasks::describe(list, &states));
            return Ok(TRY_AGAIN);
        }
        open.sort_by_key(|(_, state)| matches!(state, TaskState::Failed(_)));
        is_new = false;
        for (task, _) in open {
            if let done @ Worked::Rendered(_) = list.work_on(engine, task, lease)? {
                print(format!("{}\n", tasks::worked(task.task, &done)));
                is_new = true;
            }
        }
    }
}

/// Prints the state of a list.
pub fn collect(path: &Path, json: bool, settings: &Settings) -> Result<u8, Error> {
    let list = read(path, settings)?;
    let states = list.states(&Disk, LEASE)?;
    if json {
        print(printable::json(&tasks::json(&list, &states)?));
    } else {
        print(tasks::describe(&list, &states));
    }
    let is_done = states.iter().all(|state| *state == TaskState::There);
    Ok(if is_done { 0 } else { TRY_AGAIN })
}
