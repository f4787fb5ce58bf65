//! Slurm: one job array for the tasks of a list, by Slurm's standard programs.
//!
//! Other settings of a site (partition, account, time) come from variables that `sbatch` reads
//! itself, such as `SBATCH_PARTITION`; without `SBATCH_OUTPUT` the workers' output is not kept.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::settings::Settings;
use footlight_host::files::process::quote;
use footlight_report::farm::Farm;

/// Polling interval of the queue.
const REST: Duration = Duration::from_secs(1);

/// Polling interval for cancellation.
const GLANCE: Duration = Duration::from_millis(20);

/// Variable of `sbatch` for the workers' output.
const OUTPUT: &str = "SBATCH_OUTPUT";

/// Slurm on this machine.
pub struct Slurm {
    /// Options of each worker.
    options: Vec<String>,
}

impl Slurm {
    /// Slurm for workers with these settings.
    pub fn new(settings: &Settings) -> Slurm {
        Slurm {
            options: settings.of_worker(),
        }
    }

    /// The command line of a task.
    fn line(&self, list: &Path) -> Result<String, String> {
        let program = std::env::current_exe().map_err(|e| format!("this program's path: {e}"))?;
        let options = self.options.iter().map(String::as_str);
        let (program, list) = (program.to_string_lossy(), list.to_string_lossy());
        let words = [program.as_ref(), "work"].into_iter().chain(options);
        let words = quote(words.chain([list.as_ref()]));
        let words = words.ok_or("a worker's options hold what no shell can be told")?;
        Ok(format!("exec {words} \"$SLURM_ARRAY_TASK_ID\""))
    }
}

impl Farm for Slurm {
    fn submit(&self, list: &Path, tasks: &[usize]) -> Result<String, String> {
        let array = format!("--array={}", ranges(tasks));
        let wrapped = format!("--wrap={}", self.line(list)?);
        let said = run(
            "sbatch",
            &[
                "--parsable",
                "--requeue",
                "--job-name=footlight",
                &array,
                &wrapped,
            ],
        )?;
        // `1234`, or `1234;cluster`.
        let job = said.trim().split(';').next().unwrap_or_default();
        if !job.is_empty() && job.bytes().all(|b| b.is_ascii_digit()) {
            jobs().push(job.to_owned());
            Ok(job.to_owned())
        } else {
            Err(format!("sbatch answered `{}`", said.trim()))
        }
    }

    fn queued(&self, job: &str) -> Result<BTreeSet<usize>, String> {
        let said = match run(
            "squeue",
            &["--noheader", "--array", "--format=%K", "--jobs", job],
        ) {
            // Slurm forgets a job some time after its end.
            Err(error) if error.contains("Invalid job id") => String::new(),
            other => other?,
        };
        let numbers = said.split_whitespace().map(str::parse);
        let numbers: Result<BTreeSet<usize>, _> = numbers.collect();
        numbers.map_err(|_| format!("squeue answered `{}`", said.trim()))
    }

    fn cancel(&self, job: &str) {
        jobs().retain(|other| other != job);
        // It may have ended.
        let _ = run("scancel", &[job]);
    }

    fn rest(&self, is_over: &dyn Fn() -> bool) {
        let begin = Instant::now();
        while begin.elapsed() < REST && !is_over() {
            std::thread::sleep(GLANCE);
        }
    }
}

/// Jobs to cancel if the process ends early.
static JOBS: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn jobs() -> MutexGuard<'static, Vec<String>> {
    JOBS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Cancels the jobs of this process, before it ends.
pub fn cancel_all() {
    let jobs = std::mem::take(&mut *jobs());
    if !jobs.is_empty() {
        let names: Vec<&str> = jobs.iter().map(String::as_str).collect();
        let _ = run("scancel", &names);
    }
}

/// Output of a Slurm command.
fn run(program: &str, arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null());
    if std::env::var_os(OUTPUT).is_none() {
        command.env(OUTPUT, "/dev/null");
    }
    let output = command.output().map_err(|e| {
        format!("`{program}` cannot be started: {e}; `--farm slurm` needs Slurm's programs")
    })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("`{program}` failed: {}", said.trim()));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Increasing numbers as `1-3,7`.
fn ranges(numbers: &[usize]) -> String {
    let together = numbers.chunk_by(|a, b| a + 1 == *b);
    let words = together.filter_map(|run| match run {
        [] => None,
        [one] => Some(one.to_string()),
        [first, .., last] => Some(format!("{first}-{last}")),
    });
    words.collect::<Vec<String>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_are_ranges() {
        assert_eq!(ranges(&[1, 2, 3, 7, 9, 10]), "1-3,7,9-10");
        assert_eq!(ranges(&[4]), "4");
    }

    #[test]
    fn a_line_is_quoted_for_the_shell() {
        let slurm = Slurm {
            options: vec!["--renderer=python3 my render.py {settings}".to_owned()],
        };
        let line = slurm.line(Path::new("/net/it's/tasks.json"));
        let line = line.unwrap_or_default();
        assert!(line.starts_with("exec ") && line.ends_with(" \"$SLURM_ARRAY_TASK_ID\""));
        let (_, words) = footlight_host::files::process::split(&line).unwrap_or_default();
        assert_eq!(
            words.get(2).map(String::as_str),
            Some("--renderer=python3 my render.py {settings}")
        );
        assert_eq!(
            words.get(3).map(String::as_str),
            Some("/net/it's/tasks.json")
        );
    }
}
