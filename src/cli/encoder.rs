//! Films in common formats, encoded by an installed `ffmpeg`.
//!
//! Invariant: the film appears at its path only when complete. The encoder writes to another file,
//! because its container has to seek back for its index.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

use footlight_host::files::process::Private;
use footlight_host::files::{AtomicWriter, Disk, FileError, Store as _};
use footlight_report::film::Encoder;
use footlight_report::format::ending;

const PROGRAM: &str = "ffmpeg";

/// Arguments for every film: frames come from [`footlight_picture::y4m`], coded for a display by
/// sRGB's curve; four pixels share a colour, so sides are made even.
const ALWAYS: &str = "-hide_banner -loglevel error -y -f yuv4mpegpipe -i pipe:0 -pix_fmt yuv420p \
    -vf pad=ceil(iw/2)*2:ceil(ih/2)*2 -colorspace bt709 -color_primaries bt709 \
    -color_trc iec61966-2-1 -color_range tv";

/// Arguments for H.264 that a browser can play while loading.
const MP4: &str = "-c:v libx264 -preset medium -crf 18 -movflags +faststart -f mp4";

/// Arguments for VP9.
const WEBM: &str = "-c:v libvpx-vp9 -crf 24 -b:v 0 -row-mt 1 -deadline good -cpu-used 4 -f webm";

/// Most bytes of its error output that are shown.
const COMPLAINT: u64 = 2000;

/// The `ffmpeg` of the search path.
pub struct Ffmpeg;

impl Encoder for Ffmpeg {
    fn is_there(&self) -> bool {
        let folders = std::env::var_os("PATH").unwrap_or_default();
        let named = |folder: PathBuf| {
            folder
                .join(PROGRAM)
                .with_extension(std::env::consts::EXE_EXTENSION)
        };
        std::env::split_paths(&folders).any(|folder| named(folder).is_file())
    }

    fn begin(&self, path: &Path) -> Result<Box<dyn AtomicWriter>, FileError> {
        let folder = Private::new()?;
        let encoding = Encoding::new(path, folder).map_err(|e| failed(path, e))?;
        Ok(Box::new(encoding))
    }
}

fn failed(path: &Path, source: io::Error) -> FileError {
    FileError::Io {
        path: path.display().to_string(),
        source,
    }
}

/// A running encoder.
struct Encoding {
    path: PathBuf,
    /// The encoder's output file; its folder is removed with it.
    draft: PathBuf,
    _folder: Private,
    child: Child,
    /// Thread that reads its error output.
    complaint: Option<JoinHandle<String>>,
}

impl Encoding {
    fn new(path: &Path, folder: Private) -> io::Result<Encoding> {
        let ending = ending(path);
        let draft = folder.path().join("film").with_extension(&ending);
        let codec = if ending == "webm" { WEBM } else { MP4 };
        let mut command = Command::new(PROGRAM);
        command.args(ALWAYS.split_whitespace().chain(codec.split_whitespace()));
        command.arg(&draft).stdin(Stdio::piped());
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let said = child.stderr.take();
        Ok(Encoding {
            path: path.to_owned(),
            draft,
            _folder: folder,
            child,
            complaint: said.map(|said| std::thread::spawn(move || read(said))),
        })
    }

    /// The encoder's own message for its failure.
    fn complaint(&mut self) -> io::Error {
        let said = self.complaint.take().and_then(|said| said.join().ok());
        io::Error::other(match said.as_deref().map(str::trim) {
            None | Some("") => format!("{PROGRAM} failed"),
            Some(said) => format!("{PROGRAM} failed: {said}"),
        })
    }

    /// Waits for the encoder, and copies the film to its path.
    fn deliver(&mut self) -> Result<(), FileError> {
        drop(self.child.stdin.take());
        let ended = self.child.wait();
        if !ended.is_ok_and(|status| status.success()) {
            let complaint = self.complaint();
            return Err(failed(&self.path, complaint));
        }
        let mut film = File::open(&self.draft).map_err(|e| failed(&self.draft, e))?;
        let mut place = Disk.begin(&self.path)?;
        io::copy(&mut film, &mut place).map_err(|e| failed(&self.path, e))?;
        place.finish()
    }
}

/// Reads the start of the error output; the rest is dropped, so that the encoder does not block.
fn read(mut said: impl Read) -> String {
    let mut text = Vec::new();
    let _ = said.by_ref().take(COMPLAINT).read_to_end(&mut text);
    let _ = io::copy(&mut said, &mut io::sink());
    String::from_utf8_lossy(&text).into_owned()
}

impl Write for Encoding {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.child.stdin.as_mut().map(|to| to.write(bytes));
        match written {
            // A closed pipe means that the encoder failed.
            None => Err(self.complaint()),
            Some(Err(e)) if e.kind() == io::ErrorKind::BrokenPipe => Err(self.complaint()),
            Some(written) => written,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl AtomicWriter for Encoding {
    fn finish(mut self: Box<Self>) -> Result<(), FileError> {
        self.deliver()
    }
}

impl Drop for Encoding {
    /// Removes an abandoned film.
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
