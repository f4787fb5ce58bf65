//! A person at a terminal: completion, declarations over several lines, history, Ctrl-C during
//! rendering, Ctrl-D with unsaved edits.
#![cfg(unix)]

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use nix::pty::{Winsize, openpty};
use nix::sys::signal::{Signal, kill};
use nix::sys::termios::{LocalFlags, tcgetattr};
use nix::unistd::Pid;

/// Longer than anything here takes, even in a debug build on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// The program on a pseudo-terminal.
struct Terminal {
    child: Child,
    keys: File,
    shown: Receiver<Vec<u8>>,
    seen: String,
}

impl Terminal {
    fn open(show: &Path, history: &Path) -> Terminal {
        let size = Winsize {
            ws_row: 40,
            ws_col: 100,
            ws_xpixel: 0,
            ws_ypixel: 0,
        };
        let pty = openpty(&size, None).unwrap();
        let end = || Stdio::from(pty.slave.try_clone().unwrap());
        let child = Command::new(env!("CARGO_BIN_EXE_footlight"))
            .args(["repl", "--pool", "off"])
            .arg(show)
            .env("TERM", "xterm")
            .env("NO_COLOR", "1")
            .env("FOOTLIGHT_HISTORY", history)
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .unwrap();
        drop(pty.slave);
        let keys = File::from(pty.master);
        let mut screen = keys.try_clone().unwrap();
        let (send, shown) = channel();
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            // The read fails once the program has ended.
            while let Ok(n @ 1..) = screen.read(&mut bytes) {
                if send.send(bytes.iter().take(n).copied().collect()).is_err() {
                    break;
                }
            }
        });
        Terminal {
            child,
            keys,
            shown,
            seen: String::new(),
        }
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
    }

    /// Waits until `text` appears, and discards everything up to it.
    fn wait(&mut self, text: &str) {
        let begin = Instant::now();
        loop {
            if let Some(at) = self.seen.find(text) {
                self.seen.drain(..at + text.len());
                return;
            }
            let left = PATIENCE.saturating_sub(begin.elapsed());
            match self.shown.recv_timeout(left) {
                Ok(bytes) => self.seen.push_str(&String::from_utf8_lossy(&bytes)),
                Err(_) => panic!("waited for `{text}`, and saw:\n{}", self.seen),
            }
        }
    }

    /// The exit code, once the program has ended.
    fn code(mut self) -> i32 {
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code().unwrap();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        self.child.kill().unwrap();
        panic!("it does not leave");
    }
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(name)
}

#[test]
fn lines_are_completed_remembered_and_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let history = folder.path().join("state/history");
    let mut terminal = Terminal::open(&example("first.lxq"), &history);
    terminal.wait("lxq> ");

    terminal.press("goto 2 at 5\x15");
    terminal.press("pict\t");
    terminal.wait("picture");
    terminal.press("--ba\tda\t");
    terminal.wait("--bank day");
    terminal.press("\x15");

    terminal.press("cue 9 {\r");
    terminal.press("lamp 5 }\r");
    terminal.wait("cue 9: added");
    terminal.wait("lxq> ");

    terminal.press("\x04");
    terminal.wait("the edits are not saved");
    terminal.press("undo\r");
    terminal.wait("0 edits to undo");
    terminal.wait("lxq> ");
    terminal.press("\x04");
    assert_eq!(terminal.code(), 0);

    let mut again = Terminal::open(&example("first.lxq"), &history);
    again.wait("lxq> ");
    again.press("\x1b[A\x1b[A");
    again.wait("lamp 5 }");
    again.press("\x03");
    // Input after a Ctrl-C is dropped with the line, as in a shell.
    again.wait("lxq> ");
    again.press("quit\r");
    assert_eq!(again.code(), 0);
}

/// A signal during input: the terminal is restored.
#[test]
fn a_signal_at_the_prompt_gives_the_terminal_back() {
    let folder = tempfile::tempdir().unwrap();
    let history = folder.path().join("history");
    for (signal, code) in [(Signal::SIGTERM, 143), (Signal::SIGHUP, 129)] {
        let mut terminal = Terminal::open(&example("first.lxq"), &history);
        terminal.wait("lxq> ");
        terminal.press("goto");
        terminal.wait("goto");
        let mode = |terminal: &Terminal| tcgetattr(&terminal.keys).unwrap().local_flags;
        assert!(!mode(&terminal).contains(LocalFlags::ICANON));
        kill(Pid::from_raw(terminal.child.id().cast_signed()), signal).unwrap();
        let ended = terminal.child.wait().unwrap();
        assert_eq!(ended.code(), Some(code));
        assert!(mode(&terminal).contains(LocalFlags::ICANON | LocalFlags::ECHO));
    }
}

#[test]
fn keys_typed_ahead_of_the_prompt_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let history = folder.path().join("history");
    let mut terminal = Terminal::open(&example("first.lxq"), &history);
    terminal.wait("lxq> ");
    // The second line is typed before the first is done, the third during it.
    terminal.press("refine 1\rat 0:03\rgo");
    terminal.wait("at 3s");
    terminal.press("to 2\r");
    terminal.wait("at 3.5s");
    terminal.press("quit\r");
    assert_eq!(terminal.code(), 0);
}

#[test]
fn ctrl_c_stops_the_rendering_and_not_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let history = folder.path().join("history");
    let mut terminal = Terminal::open(&example("tavern/tavern.lxq"), &history);
    terminal.wait("lxq> ");
    terminal.press("refine 20\r");
    // The bar of the first long task.
    terminal.wait("0s");
    kill(
        Pid::from_raw(terminal.child.id().cast_signed()),
        Signal::SIGINT,
    )
    .unwrap();
    terminal.wait("stopped");
    terminal.wait("lxq> ");
    terminal.press("at 0:05\r");
    terminal.wait("at 5s");
    terminal.press("quit\r");
    assert_eq!(terminal.code(), 0);
}

#[test]
fn refinement_goes_on_beside_the_prompt() {
    let folder = tempfile::tempdir().unwrap();
    let history = folder.path().join("history");
    let mut terminal = Terminal::open(&example("first.lxq"), &history);
    terminal.wait("lxq> ");
    terminal.press("refine 1 &\r");
    terminal.wait("in the background");
    terminal.wait("lxq> ");
    // Messages appear above the current input line, which stays.
    terminal.press("goto 2");
    terminal.wait("refine 1 &: predicted error");
    terminal.wait("goto 2");
    terminal.press("\r");
    terminal.wait("at 3.5s");
    terminal.wait("lxq> ");

    terminal.press("quit\r");
    assert_eq!(terminal.code(), 0);

    // During long work the prompt stays usable.
    let mut terminal = Terminal::open(&example("tavern/tavern.lxq"), &history);
    terminal.wait("lxq> ");
    terminal.press("refine 20 &\r");
    terminal.wait("shows how far");
    terminal.wait("lxq> ");
    terminal.press("status\r");
    terminal.wait("coarse pictures at quality 1");
    terminal.wait("lxq> ");
    terminal.press("stop now\r");
    terminal.wait("it stops");
    terminal.wait("stopped; what is finished is kept");
    terminal.press("quit\r");
    assert_eq!(terminal.code(), 0);
}
