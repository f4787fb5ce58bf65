//! Other programs: started without a shell, watched, never left running.
//!
//! Invariants: a program works on files in a private folder, created for the one run and removed
//! afterwards; only the end of its output and error output is kept, in memory; after a timeout or a
//! cancel it is killed; at its end, everything it started is killed too (on Unix, by its process
//! group; elsewhere only the program itself). Nothing of it outlives this process, unless that is
//! killed.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::{FileError, io_error, open, read_limited, unique};

/// Most bytes kept of a program's output, and most bytes shown.
const KEPT: usize = 64 << 10;
const TAIL: usize = 2048;
/// Time to wait for remaining output after a program has ended.
const LAST_WORDS: Duration = Duration::from_millis(500);

/// Polling interval of a running program: this fraction of its running time, within these bounds.
const LOOK: (u32, Duration, Duration) = (20, Duration::from_millis(2), Duration::from_millis(100));

/// One run of a program.
pub struct Job<'a> {
    /// The program.
    pub program: &'a str,
    /// Its arguments; marks of [`Job::inputs`] and [`Job::output`] in them are replaced by paths.
    pub arguments: &'a [String],
    /// Input files: mark (`{settings}`), name and content.
    pub inputs: &'a [(&'a str, &'a str, &'a [u8])],
    /// The output file that the program must write: mark and name.
    pub output: (&'a str, &'a str),
    /// Most bytes read of the output.
    pub limit: u64,
    /// Seconds after which the program is killed.
    pub timeout: f64,
    /// Polled repeatedly; true kills the program.
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// A successful run.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// Content of the output file.
    pub output: Vec<u8>,
    /// Seconds from start to exit.
    pub seconds: f64,
}

/// Error of a run. The tail is the end of the program's error output.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// The program does not exist, or may not be run.
    #[error("`{program}` cannot be started: {source}")]
    Start {
        /// Its name in the command.
        program: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// It ended with a code other than 0, or by a signal.
    #[error("`{program}` ended with {status}{}", complaint(tail))]
    Exit {
        /// Its name in the command.
        program: String,
        /// `code 3`, or the signal.
        status: String,
        /// The end of its standard error, or of its standard output if that is empty.
        tail: String,
    },
    /// It timed out and was killed.
    #[error(
        "`{program}` was stopped after {seconds} s without an end{}",
        complaint(tail)
    )]
    Timeout {
        /// Its name in the command.
        program: String,
        /// Its time limit, seconds.
        seconds: f64,
        /// The end of its standard error, or of its standard output if that is empty.
        tail: String,
    },
    /// It ended well but wrote no output.
    #[error("`{program}` ended well but wrote no file{}", complaint(tail))]
    NoOutput {
        /// Its name in the command.
        program: String,
        /// The end of its standard error, or of its standard output if that is empty.
        tail: String,
    },
    /// The user cancelled; the program was killed.
    #[error("stopped")]
    Cancelled,
    /// The private folder is unusable, or the output could not be read.
    #[error(transparent)]
    File(#[from] FileError),
}

fn complaint(tail: &str) -> String {
    match tail.trim() {
        "" => "; it said nothing".to_owned(),
        said => format!("; it said last:\n{said}"),
    }
}

/// Runs programs. A closure serves as a fake in tests.
pub trait Processes: Send + Sync {
    /// Runs `job` to its end.
    ///
    /// # Errors
    /// [`ProcessError`]; the program is then no longer running.
    fn run(&self, job: &Job<'_>) -> Result<Done, ProcessError>;
}

impl<F> Processes for F
where
    F: Fn(&Job<'_>) -> Result<Done, ProcessError> + Send + Sync,
{
    fn run(&self, job: &Job<'_>) -> Result<Done, ProcessError> {
        self(job)
    }
}

/// Runs programs of this machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Programs;

impl Processes for Programs {
    fn run(&self, job: &Job<'_>) -> Result<Done, ProcessError> {
        if cfg!(target_family = "wasm") {
            return Err(ProcessError::Start {
                program: job.program.to_owned(),
                source: std::io::ErrorKind::Unsupported.into(),
            });
        }
        let private = Private::new()?;
        let mut marks = Vec::new();
        for (mark, name, content) in job.inputs {
            let path = private.path.join(name);
            fs::write(&path, content).map_err(io_error(path.display()))?;
            marks.push((*mark, path));
        }
        let output = private.path.join(job.output.1);
        marks.push((job.output.0, output.clone()));
        let arguments = job.arguments.iter().map(|a| filled(a, &marks));
        let begin = Instant::now();
        let mut child = start(job.program, arguments)?;
        let said = child.stdout.take().and_then(Words::listen);
        let complaints = child.stderr.take().and_then(Words::listen);
        let watched = watch(&mut child, begin, job);
        let seconds = begin.elapsed().as_secs_f64();
        let program = || job.program.to_owned();
        // Some programs, such as Blender, print errors to standard output.
        let tail = || {
            let end = |words: &Option<Words>| words.as_ref().map_or(String::new(), Words::end);
            Some(end(&complaints))
                .filter(|text| !text.trim().is_empty())
                .unwrap_or_else(|| end(&said))
        };
        match watched.map_err(io_error(job.program))? {
            Watched::Cancelled => Err(ProcessError::Cancelled),
            Watched::Timeout => Err(ProcessError::Timeout {
                program: program(),
                seconds: job.timeout,
                tail: tail(),
            }),
            Watched::Ended(status) if !status.success() => Err(ProcessError::Exit {
                program: program(),
                status: status
                    .code()
                    .map_or_else(|| status.to_string(), |c| format!("code {c}")),
                tail: tail(),
            }),
            Watched::Ended(_) if !output.is_file() => Err(ProcessError::NoOutput {
                program: program(),
                tail: tail(),
            }),
            Watched::Ended(_) => Ok(Done {
                output: read_limited(open::regular(&output), "the renderer's picture", job.limit)?,
                seconds,
            }),
        }
    }
}

fn start(program: &str, arguments: impl Iterator<Item = String>) -> Result<Child, ProcessError> {
    // `end_all` must not miss a program that is just being started.
    let mut running = running();
    if running.ended {
        return Err(ProcessError::Cancelled);
    }
    let mut command = Command::new(program);
    command
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let child = command.spawn().map_err(|source| ProcessError::Start {
        program: program.to_owned(),
        source,
    })?;
    running.programs.push(child.id());
    Ok(child)
}

/// Resources that must not outlive this process.
struct Running {
    /// Process numbers of programs.
    programs: Vec<u32>,
    folders: Vec<PathBuf>,
    files: Vec<PathBuf>,
    /// Once true, no program is started.
    ended: bool,
}

impl Running {
    /// Forgets a program, and kills what it has left running.
    fn close(&mut self, program: u32) {
        kill_group(program);
        self.programs.retain(|other| *other != program);
    }
}

static RUNNING: Mutex<Running> = Mutex::new(Running {
    programs: Vec::new(),
    folders: Vec::new(),
    files: Vec::new(),
    ended: false,
});

fn running() -> MutexGuard<'static, Running> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registers a file to be removed if the process is ended.
pub(super) fn remember_file(path: &Path) {
    running().files.push(path.to_owned());
}

/// Unregisters a file.
pub(super) fn forget_file(path: &Path) {
    running().files.retain(|other| other != path);
}

/// Kills all running programs with everything that they started, removes their folders and the
/// registered files, and prevents new programs. For a process that is about to end.
pub fn end_all() {
    let mut running = running();
    running.ended = true;
    running.programs.iter().for_each(|p| kill_group(*p));
    for file in &running.files {
        let _ = fs::remove_file(file);
    }
    for folder in &running.folders {
        // A program being killed may still write.
        let gone = |_: &u32| {
            let removed = fs::remove_dir_all(folder);
            let gone = removed.is_ok() || !folder.exists();
            if !gone {
                std::thread::sleep(Duration::from_millis(10));
            }
            gone
        };
        (0..20).find(gone);
    }
}

enum Watched {
    Ended(ExitStatus),
    Timeout,
    Cancelled,
}

/// Waits for the end, and kills the program on timeout or cancel.
fn watch(child: &mut Child, begin: Instant, job: &Job<'_>) -> std::io::Result<Watched> {
    let (share, least, most) = LOOK;
    loop {
        let mut running = running();
        let ended = child.try_wait();
        if let Ok(Some(status)) = ended {
            // The number belongs to the group as long as a member is left; nothing else reuses it
            // within these few instructions.
            running.close(child.id());
            return Ok(Watched::Ended(status));
        }
        drop(running);
        let passed = begin.elapsed();
        let cancelled = (job.cancelled)();
        if cancelled || passed.as_secs_f64() >= job.timeout || ended.is_err() {
            end(child)?;
            ended?;
            return Ok(if cancelled {
                Watched::Cancelled
            } else {
                Watched::Timeout
            });
        }
        std::thread::sleep((passed / share).clamp(least, most));
    }
}

/// Kills a running program with its group, and waits until it is gone.
fn end(child: &mut Child) -> std::io::Result<()> {
    // The number is still the program's, because it has not been waited for.
    running().close(child.id());
    let _ = child.kill();
    child.wait().map(|_| ())
}

/// Kills the rest of a program's process group.
#[cfg(unix)]
fn kill_group(program: u32) {
    use nix::sys::signal::{Signal, killpg};
    if let Ok(group) = i32::try_from(program) {
        // It may have ended already.
        let _ = killpg(nix::unistd::Pid::from_raw(group), Signal::SIGKILL);
    }
}

#[cfg(not(unix))]
fn kill_group(_: u32) {}

/// Output of a program, of which a thread keeps the end.
struct Words {
    kept: Arc<Mutex<Vec<u8>>>,
    reader: JoinHandle<()>,
}

impl Words {
    /// Reads a pipe to its end; `None` when no thread can be started, which closes the pipe.
    fn listen(mut pipe: impl Read + Send + 'static) -> Option<Words> {
        let kept = Arc::new(Mutex::new(Vec::new()));
        let own = Arc::clone(&kept);
        let read = move || {
            let mut part = [0; 8192];
            while let Ok(length @ 1..) = pipe.read(&mut part) {
                let mut kept = own.lock().unwrap_or_else(PoisonError::into_inner);
                kept.extend_from_slice(part.get(..length).unwrap_or_default());
                let beyond = kept.len().saturating_sub(KEPT);
                kept.drain(..beyond);
            }
        };
        let reader = thread::Builder::new().spawn(read).ok()?;
        Some(Words { kept, reader })
    }

    /// The last lines.
    fn end(&self) -> String {
        let since = Instant::now();
        while !self.reader.is_finished() && since.elapsed() < LAST_WORDS {
            thread::sleep(Duration::from_millis(1));
        }
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let tail = kept
            .get(kept.len().saturating_sub(TAIL)..)
            .unwrap_or_default();
        let text = String::from_utf8_lossy(tail).into_owned();
        let text = match text.split_once('\n') {
            Some((_, rest)) if kept.len() > TAIL && !rest.trim().is_empty() => rest.to_owned(),
            _ => text,
        };
        let printable = |c: &char| *c == '\n' || *c == '\t' || !c.is_control();
        text.chars().filter(printable).collect()
    }
}

/// Replaces every mark in `word` by its path.
fn filled(word: &str, marks: &[(&str, PathBuf)]) -> String {
    let fill =
        |text: String, (mark, path): &(&str, PathBuf)| text.replace(mark, &path.to_string_lossy());
    marks.iter().fold(word.to_owned(), fill)
}

/// A folder that only this user may enter; removed when dropped.
#[derive(Debug)]
pub struct Private {
    path: PathBuf,
}

impl Private {
    /// Creates one among the system's temporary files.
    ///
    /// # Errors
    /// [`FileError`] when it cannot be created.
    pub fn new() -> Result<Private, FileError> {
        #[cfg_attr(not(unix), allow(unused_mut, reason = "modes are Unix's"))]
        let mut builder = fs::DirBuilder::new();
        #[cfg(unix)]
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
        let mut attempts = 1..16;
        loop {
            let name = format!("footlight-{}-{:016x}", std::process::id(), unique());
            let path = std::env::temp_dir().join(name);
            match builder.create(&path) {
                Ok(()) => {
                    running().folders.push(path.clone());
                    return Ok(Private { path });
                }
                // A folder that another user has made under the name is never used.
                Err(error) if attempts.next().is_none() => {
                    return Err(io_error(path.display())(error));
                }
                Err(_) => {}
            }
        }
    }
}

impl Private {
    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Private {
    fn drop(&mut self) {
        // If removal fails, the system clears its temporary folders later.
        let _ = fs::remove_dir_all(&self.path);
        running().folders.retain(|other| *other != self.path);
    }
}

/// Reason why a command line cannot be split.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SplitError {
    /// A quote or a backslash is not closed.
    #[error("a quote or a backslash is left open")]
    Open,
    /// There is no word.
    #[error("there is no program in it")]
    Empty,
}

/// Splits a command line into program and arguments like a shell: by blanks, with quotes,
/// backslashes and comments, but without variables, patterns or pipes.
///
/// # Errors
/// [`SplitError`].
pub fn split(line: &str) -> Result<(String, Vec<String>), SplitError> {
    let mut words = shlex::split(line).ok_or(SplitError::Open)?.into_iter();
    let program = words.next().filter(|word| !word.is_empty());
    Ok((program.ok_or(SplitError::Empty)?, words.collect()))
}

/// Joins words to one shell command line, quoted as needed; `None` for words that a shell cannot
/// express.
pub fn quote<'a>(words: impl IntoIterator<Item = &'a str>) -> Option<String> {
    shlex::try_join(words).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_split_as_a_shell_does() {
        let split_ok = |line: &str| {
            let (program, arguments) = split(line).unwrap();
            [vec![program], arguments].concat()
        };
        assert_eq!(split_ok("  a  b\tc "), ["a", "b", "c"]);
        assert_eq!(
            split_ok(r#"a 'b "c' "d 'e" f\ g"#),
            ["a", r#"b "c"#, "d 'e", "f g"]
        );
        assert_eq!(split_ok(r#"a "" x"y z"'w'"#), ["a", "", "xy zw"]);
        assert_eq!(split_ok(r#""\"\\\n" '\'"#), [r#""\\n"#, r"\"]);
        assert_eq!(split_ok("a $HOME *.x | b"), ["a", "$HOME", "*.x", "|", "b"]);
        for open in ["'a", "\"a", "a\\", "\"a\\"] {
            assert_eq!(split(open), Err(SplitError::Open), "{open}");
        }
        for empty in ["", "  ", "''", "'' a"] {
            assert_eq!(split(empty), Err(SplitError::Empty), "{empty}");
        }
    }

    #[cfg(unix)]
    fn run(
        script: &str,
        timeout: f64,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Done, ProcessError> {
        let arguments = ["-c", script, "sh", "{in}", "{out}"].map(str::to_owned);
        Programs.run(&Job {
            program: "sh",
            arguments: &arguments,
            inputs: &[("{in}", "in.txt", b"hello")],
            output: ("{out}", "out.txt"),
            limit: 100,
            timeout,
            cancelled,
        })
    }

    #[cfg(unix)]
    #[test]
    fn a_program_gets_its_files_in_a_folder_that_is_removed() {
        let go_on = || false;
        let done = run(r#"cat "$1" > "$2"; dirname "$2" >> "$2""#, 60.0, &go_on).unwrap();
        let text = String::from_utf8(done.output).unwrap();
        let folder = text.strip_prefix("hello").unwrap().trim();
        assert!(folder.contains("footlight-") && !Path::new(folder).exists());
        let open = run(r#"stat -c %a "$(dirname "$2")" > "$2""#, 60.0, &go_on).unwrap();
        assert_eq!(open.output, b"700\n");
    }

    #[cfg(unix)]
    #[test]
    fn every_bad_end_is_told_with_the_last_complaints() {
        let go_on = || false;
        let script = "i=0; while [ $i -lt 900 ]; do echo line $i >&2; i=$((i+1)); done; exit 3";
        let error = run(script, 60.0, &go_on).unwrap_err();
        let said = error.to_string();
        assert!(
            said.contains("code 3") && said.ends_with("line 899"),
            "{said}"
        );
        assert!(
            said.len() < 2200 && !said.contains("line 100\n"),
            "{}",
            said.len()
        );
        let nothing = run("true", 60.0, &go_on).unwrap_err();
        assert!(matches!(nothing, ProcessError::NoOutput { .. }));
        let killed = run("kill -9 $$", 60.0, &go_on).unwrap_err();
        assert!(killed.to_string().contains("signal"), "{killed}");
        let large = run(r#"head -c 101 /dev/zero > "$2""#, 60.0, &go_on).unwrap_err();
        assert!(matches!(
            large,
            ProcessError::File(FileError::TooLarge { .. })
        ));
        let none = Programs.run(&Job {
            program: "/none/such",
            arguments: &[],
            inputs: &[],
            output: ("{out}", "out.txt"),
            limit: 1,
            timeout: 1.0,
            cancelled: &go_on,
        });
        assert!(matches!(none, Err(ProcessError::Start { .. })));
    }

    /// A flood of output takes no disk and little memory, and does not block the program.
    #[cfg(unix)]
    #[test]
    fn a_flood_of_words_is_read_and_forgotten() {
        let script = r#"head -c 30000000 /dev/zero | tr '\0' 'x'; echo; echo last words; exit 4"#;
        let error = run(script, 60.0, &|| false).unwrap_err().to_string();
        assert!(error.ends_with("last words"), "{error}");
        let done = run(
            r#"yes | head -n 1000000; cp "$1" "$2"; ls "$(dirname "$2")" >> "$2""#,
            60.0,
            &|| false,
        );
        let text = String::from_utf8(done.unwrap().output).unwrap();
        assert_eq!(text, "helloin.txt\nout.txt\n");
    }

    /// The program's child must be killed too: it would write its file a second later.
    #[cfg(unix)]
    #[test]
    fn a_program_goes_with_all_it_started_however_it_ends() {
        let beside = tempfile::tempdir().unwrap();
        for stop in [false, true] {
            let file = beside.path().join(format!("late-{stop}"));
            let script = format!(
                "(sleep 1; touch '{}') & echo on >&2; sleep 60",
                file.display()
            );
            let error = run(&script, if stop { 60.0 } else { 0.2 }, &|| stop).unwrap_err();
            match error {
                ProcessError::Cancelled => assert!(stop),
                ProcessError::Timeout { .. } => assert!(!stop),
                other => panic!("{other}"),
            }
        }
        // So must the child of a program that ended well.
        let file = beside.path().join("left");
        let script = format!("(sleep 1; touch '{}') & cp \"$1\" \"$2\"", file.display());
        run(&script, 60.0, &|| false).unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        assert_eq!(fs::read_dir(beside.path()).unwrap().count(), 0);
    }
}
