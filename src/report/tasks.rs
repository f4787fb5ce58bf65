//! Task lists as files, and their state in words and as JSON.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Error;
use super::words::{count, seconds};
use footlight_engine::{self as engine, TEXT_LIMIT, Task, TaskFault, TaskList, TaskState, Worked};
use footlight_host::files::Store;

/// Most tasks listed individually.
const NAMED: usize = 20;

/// Writes a list of tasks. Show and pool are relative to the list's folder if they lie in it or
/// below, so that machines may mount that folder at different paths.
///
/// # Errors
/// [`Error`] when it cannot be written.
pub fn write(store: &dyn Store, path: &Path, list: &TaskList) -> Result<(), Error> {
    let folder = absolute(path)?;
    let folder = folder.parent().unwrap_or(Path::new(""));
    let named = |file: &Path| -> Result<PathBuf, Error> {
        let file = absolute(file)?;
        Ok(file.strip_prefix(folder).unwrap_or(&file).to_owned())
    };
    let list = TaskList {
        show: named(&list.show)?,
        pool: named(&list.pool)?,
        ..list.clone()
    };
    let json = serde_json::to_string(&list)?;
    // One line for each task. Within a string the quotes would be escaped, so the pattern is
    // unique.
    let json = json.replace(r#"{"task":"#, "\n{\"task\":") + "\n";
    Ok(store.output(path, json.as_bytes())?)
}

fn absolute(path: &Path) -> Result<PathBuf, Error> {
    let absolute = std::path::absolute(path);
    absolute.map_err(|source| {
        let path = path.display().to_string();
        footlight_host::files::FileError::Io { path, source }.into()
    })
}

/// Reads a list of tasks and checks it; its paths are then relative to the current folder.
///
/// # Errors
/// [`engine::Error::NotTasks`]; [`engine::Error::File`].
pub fn read(store: &dyn Store, path: &Path) -> Result<TaskList, engine::Error> {
    let bytes = store.read(path, TEXT_LIMIT)?;
    let named = |fault| engine::Error::NotTasks {
        path: path.to_owned(),
        fault,
    };
    let list: Result<TaskList, _> = serde_json::from_slice(&bytes);
    let list = list.map_err(|error| named(TaskFault::Form(error.to_string())))?;
    list.check().map_err(named)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(TaskList {
        show: folder.join(&list.show),
        pool: folder.join(&list.pool),
        ..list
    })
}

/// Describes a written list, in a line or two.
pub fn listed(list: &TaskList, path: &Path) -> String {
    let tasks = &list.tasks;
    if tasks.is_empty() {
        return format!(
            "wrote {}: no task, nothing is missing as far as is known\n",
            path.display()
        );
    }
    let known: Option<Vec<f64>> = tasks.iter().map(|task| task.seconds).collect();
    let each = known.map(|known| known.iter().sum::<f64>());
    let each = each.map_or(String::new(), |sum| {
        format!(", predicted {} if each is done alone", seconds(sum))
    });
    let mixtures = tasks.iter().filter(|task| task.order.is_some()).count();
    let kind = match mixtures {
        0 => "of banks alone",
        _ => "mixtures of the plan",
    };
    format!(
        "wrote {}: {}, {kind}{each}\n`footlight work {0}` renders what is free, `footlight collect {0}` \
         tells how far it is; plan again after that\n",
        path.display(),
        count(tasks.len(), "task")
    )
}

/// State of a list, as data.
#[derive(Serialize)]
struct Form {
    /// Version of this form.
    schema: u32,
    tasks: usize,
    there: usize,
    missing: Vec<Item>,
}

#[derive(Serialize)]
struct Item {
    task: usize,
    picture: String,
    /// `claimed`, `stale`, `failed` or `free`.
    why: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    host: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    process: Option<u32>,
    /// Seconds since the claim was renewed.
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

/// State of a list, as JSON.
///
/// # Errors
/// [`Error::Json`].
pub fn json(list: &TaskList, states: &[TaskState]) -> Result<String, Error> {
    let missing: Vec<Item> = missing(list, states).map(item).collect();
    Ok(serde_json::to_string_pretty(&Form {
        schema: 0,
        tasks: list.tasks.len(),
        there: list.tasks.len() - missing.len(),
        missing,
    })?)
}

/// Result of work on a task, in one line.
pub fn worked(number: usize, worked: &Worked) -> String {
    match worked {
        Worked::Rendered(took) => format!("task {number}: rendered in {}", seconds(*took)),
        Worked::There => format!("task {number}: there already"),
        Worked::Claimed(holder) => {
            format!(
                "task {number}: {}",
                why(&TaskState::Claimed(holder.clone()))
            )
        }
    }
}

/// Tasks without images.
fn missing<'a>(
    list: &'a TaskList,
    states: &'a [TaskState],
) -> impl Iterator<Item = (&'a Task, &'a TaskState)> {
    let all = list.tasks.iter().zip(states);
    all.filter(|(_, state)| **state != TaskState::There)
}

fn item((task, state): (&Task, &TaskState)) -> Item {
    let plain = Item {
        task: task.task,
        picture: task.picture.clone(),
        why: "free",
        host: None,
        process: None,
        seconds: None,
        error: None,
    };
    match state {
        TaskState::Claimed(holder) => Item {
            why: if holder.is_stale() {
                "stale"
            } else {
                "claimed"
            },
            host: Some(holder.host.clone()),
            process: Some(holder.process),
            seconds: Some(holder.age.as_secs_f64()),
            ..plain
        },
        TaskState::Failed(said) => Item {
            why: "failed",
            error: Some(said.clone()),
            ..plain
        },
        TaskState::There | TaskState::Free => plain,
    }
}

/// State of a list in words: missing images, and why.
pub fn describe(list: &TaskList, states: &[TaskState]) -> String {
    let missing: Vec<_> = missing(list, states).collect();
    let all = list.tasks.len();
    let mut text = format!(
        "{} of {} there\n",
        all - missing.len(),
        count(all, "picture")
    );
    for (task, state) in missing.iter().take(NAMED) {
        let _ = writeln!(text, "  task {:<4} {}", task.task, why(state));
    }
    if missing.len() > NAMED {
        let _ = writeln!(text, "  and {} more", missing.len() - NAMED);
    }
    text
}

fn why(state: &TaskState) -> String {
    match state {
        TaskState::There => "there".to_owned(),
        TaskState::Free => "not begun".to_owned(),
        TaskState::Failed(said) => format!("failed on {said}"),
        TaskState::Claimed(holder) => {
            let did = if holder.is_stale() {
                "was given up by"
            } else {
                "is being rendered by"
            };
            format!(
                "{did} process {} on {}, last heard of {:.0} s ago",
                holder.process,
                holder.host,
                holder.age.as_secs_f64()
            )
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test's own data")]
mod tests {
    use super::*;
    use footlight_host::files::MemoryStore;
    use footlight_host::files::claim::Holder;
    use std::time::Duration;

    fn list(tasks: usize) -> TaskList {
        let task = |number: usize| Task {
            task: number,
            picture: format!("4-{number:032x}"),
            quality: 4,
            setting: vec![1.0 / 3.0, -f64::MIN_POSITIVE],
            order: None,
            seed: 7,
            seconds: Some(0.1 + 0.2),
        };
        TaskList {
            schema: 0,
            show: "shows/a \"show\".lxq".into(),
            view: Some("house".to_owned()),
            pool: "/net/pool".into(),
            operator: "radiosity 1 {\"task\":".to_owned(),
            scene: "0".repeat(32),
            size: [640, 360],
            coordinates: vec!["lamp".to_owned(), "sky".to_owned()],
            tasks: (1..=tasks).map(task).collect(),
        }
    }

    #[test]
    fn a_list_is_read_as_it_was_written_to_the_last_bit() {
        let store = MemoryStore::default();
        let (path, wanted) = (Path::new("lists/tasks.json"), list(3));
        write(&store, path, &wanted).unwrap();
        let found = read(&store, path).unwrap();
        assert_eq!(found.tasks, wanted.tasks);
        assert_eq!((found.operator, found.pool), (wanted.operator, wanted.pool));
        // The show is not below the list's folder.
        assert_eq!(found.show, std::path::absolute(wanted.show).unwrap());
        let beside = Path::new("tasks.json");
        write(&store, beside, &list(1)).unwrap();
        let text = String::from_utf8(store.read(beside, 1 << 20).unwrap()).unwrap();
        assert!(text.contains(r#""show":"shows/a \"show\".lxq""#), "{text}");
        let lines = text.lines().filter(|l| l.starts_with("{\"task\"")).count();
        assert_eq!(lines, 1, "{text}");
    }

    #[test]
    fn what_is_missing_has_its_reason() {
        let holder = |age| Holder {
            host: "n1".to_owned(),
            process: 4711,
            age: Duration::from_secs(age),
            lease: Duration::from_secs(60),
        };
        let states = [
            TaskState::There,
            TaskState::Claimed(holder(12)),
            TaskState::Claimed(holder(80)),
            TaskState::Failed("n2: no licence".to_owned()),
            TaskState::Free,
        ];
        let list = list(states.len());
        assert_eq!(
            describe(&list, &states),
            "1 of 5 pictures there\n\
             \x20 task 2    is being rendered by process 4711 on n1, last heard of 12 s ago\n\
             \x20 task 3    was given up by process 4711 on n1, last heard of 80 s ago\n\
             \x20 task 4    failed on n2: no licence\n\
             \x20 task 5    not begun\n"
        );
        let json: serde_json::Value = serde_json::from_str(&json(&list, &states).unwrap()).unwrap();
        let whys: Vec<_> = json["missing"]
            .as_array()
            .unwrap()
            .iter()
            .map(|m| &m["why"])
            .collect();
        assert_eq!(whys, ["claimed", "stale", "failed", "free"]);
        assert_eq!(
            (&json["there"], &json["missing"][0]["process"]),
            (&1.into(), &4711.into())
        );
    }
}
