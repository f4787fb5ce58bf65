//! The sequence as video and as numbered images.
//!
//! Invariant: frames are made and written one at a time, so that memory holds the key images and
//! one frame, independent of the show's length.

use std::io::{self, Write};
use std::path::Path;

use super::Error;
use super::format::header;
use super::numbered::{FrameFormat, Numbered};
use super::words::count;
use footlight_engine::playback::Player;
use footlight_engine::{self as engine, Engine};
use footlight_host::files::{AtomicWriter, FileError};
use footlight_picture::exr;
use footlight_picture::y4m::{Chroma, Film};
use footlight_picture::{Image, png};
use footlight_show::units::Time;

/// A display-coded image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Width and height.
    pub size: (usize, usize),
    /// RGB, 8 bits, row by row from the top.
    pub rgb: Vec<u8>,
}

/// A display for the sequence during playback.
pub trait Canvas: Send {
    /// Shows a frame, taking as long as needed; false when the viewer has left.
    fn frame(&self, picture: &Shown) -> bool;

    /// Ends the playback.
    fn end(&self);
}

/// Opens the target of `-o -`, such as standard output.
pub type Pipe = Box<dyn Fn() -> Box<dyn Write> + Send>;

/// Encodes YUV4MPEG2 to common film formats.
pub trait Encoder: Send {
    /// True when it is installed.
    fn is_there(&self) -> bool;

    /// Starts encoding to a file of this name, `.mp4` or `.webm`; the result takes the frames.
    ///
    /// # Errors
    /// [`FileError`] when it cannot be started.
    fn begin(&self, path: &Path) -> Result<Box<dyn AtomicWriter>, FileError>;
}

/// Targets of sequences besides the store.
#[derive(Default)]
pub struct Outlets {
    /// Target of `-o -`; without it the option is refused.
    pub pipe: Option<Pipe>,
    /// Encoder of films; without it films are refused.
    pub encoder: Option<Box<dyn Encoder>>,
}

/// The part of a show to play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayedSpan {
    /// The first moment.
    pub from: Time,
    /// The last moment, not before the first.
    pub to: Time,
}

impl PlayedSpan {
    /// The whole show.
    pub fn whole(engine: &Engine) -> PlayedSpan {
        let timeline = engine.document().timeline();
        PlayedSpan {
            from: timeline.start(),
            to: timeline.end(),
        }
    }

    fn seconds(self) -> f64 {
        (self.to - self.from).seconds()
    }
}

/// The frame of a moment, and the speed of rendering frames.
pub fn still(engine: &Engine, player: &Player, time: Time) -> (Shown, String) {
    let rate = player.frame_rate(engine.document().timeline(), engine.host().clock.as_ref());
    let size = player.size();
    let mut rgb = Vec::new();
    player.frame(time, &mut rgb);
    let images = match player.keys() {
        0 => "every frame is a sum of the banks".to_owned(),
        keys => count(keys, "key image"),
    };
    let text = format!(
        "{images}; playback reaches {rate:.0} frames/s at {}x{}. `play -o show.html` \
         writes it as a page",
        size.0, size.1
    );
    (Shown { size, rgb }, text)
}

/// Plays on a canvas in real time; stopping is no error.
pub fn perform(engine: &Engine, player: &Player, span: PlayedSpan, canvas: &dyn Canvas) -> String {
    let PlayedSpan { from, to: end } = span;
    let mut frame = Shown {
        size: player.size(),
        rgb: Vec::new(),
    };
    let host = engine.host();
    let begin = host.clock.seconds();
    let mut frames = 0;
    let (passed, reached) = loop {
        let passed = host.clock.seconds() - begin;
        let time = from + Time::nearest(passed);
        player.frame(time.min(end), &mut frame.rgb);
        frames += 1;
        let seen = canvas.frame(&frame);
        if !seen || time >= end || host.progress.cancelled() {
            break (passed, time.min(end));
        }
    };
    canvas.end();
    let frames = count(frames, "frame");
    format!(
        "played from {from} to {}: {frames} in {passed:.1} s",
        reached.rounded()
    )
}

/// Number of frames of the film.
pub fn length(engine: &Engine, span: PlayedSpan) -> usize {
    let rate = engine.show().preview.rate;
    // Rounding must not add a frame to a whole number.
    (span.seconds() * rate - 1e-6).ceil().max(0.0) as usize + 1
}

/// Calls `take` for every frame of the film with its index and time: the first at the start, the
/// last at or after the end, which shows the last look. Returns the number of frames.
fn frames(
    engine: &Engine,
    span: PlayedSpan,
    task: &str,
    take: &mut dyn FnMut(usize, Time) -> Result<(), Error>,
) -> Result<usize, Error> {
    let rate = engine.show().preview.rate;
    let total = length(engine, span);
    for i in 0..total {
        engine.host().work().check()?;
        let time = Time::nearest(i as f64 / rate);
        take(i, span.from + time)?;
        engine.host().progress.report(task, i + 1, total);
    }
    Ok(total)
}

/// Writes the film as YUV4MPEG2 to a file or a pipe. A reader that closes the pipe early is no
/// error.
pub fn video(
    engine: &Engine,
    (player, span): (&Player, PlayedSpan),
    chroma: Chroma,
    mut file: Box<dyn AtomicWriter + '_>,
    place: &Path,
) -> Result<String, Error> {
    let (width, height) = player.size();
    let rate = engine.show().preview.rate;
    let film = Film {
        width,
        height,
        rate,
        chroma,
    };
    let mut bytes = film.header().into_bytes();
    let mut rgb = Vec::new();
    let mut done = 0;
    let written = frames(engine, span, "video", &mut |_, time| {
        player.frame(time, &mut rgb);
        film.push(&rgb, &mut bytes)?;
        file.write_all(&bytes).map_err(|e| failed(place, e))?;
        bytes.clear();
        done += 1;
        Ok(())
    });
    let frames = |n| count(n, "frame");
    match written.and_then(|n| Ok((n, file.finish()?))) {
        Ok((n, ())) => Ok(format!(
            "{} of {width}x{height}, {rate} frames/s, BT.709\nwrote {}",
            frames(n),
            place.display()
        )),
        Err(error) if is_broken_pipe(&error) => {
            Ok(format!("the reader left after {}", frames(done)))
        }
        Err(error) => Err(error),
    }
}

fn is_broken_pipe(error: &Error) -> bool {
    matches!(
        error,
        Error::Engine(engine::Error::File(FileError::Io { source, .. }))
            if source.kind() == io::ErrorKind::BrokenPipe
    )
}

/// Writes an image for each frame, numbered from 1.
pub fn numbered(
    engine: &Engine,
    (player, span): (&Player, PlayedSpan),
    names: &Numbered,
    kind: FrameFormat,
) -> Result<String, Error> {
    let (width, height) = player.size();
    let (mut rgb, mut light) = (Vec::new(), Image::new(0, 0));
    let title = header("show", &engine.show().title);
    let total = frames(engine, span, "pictures", &mut |i, time| {
        let bytes = match kind {
            FrameFormat::Png => {
                player.frame(time, &mut rgb);
                png::encode(width, height, &rgb)?
            }
            FrameFormat::Exr(precision) => {
                player.light(time, &mut light);
                exr::encode(&light, precision, std::slice::from_ref(&title))?
            }
        };
        Ok(engine.host().store.output(&names.path(i + 1), &bytes)?)
    })?;
    Ok(format!(
        "{} of {width}x{height}, {} frames/s\nwrote {} to {}",
        count(total, "frame"),
        engine.show().preview.rate,
        names.path(1).display(),
        names.path(total).display()
    ))
}

/// A pipe as a file that is finished when everything is written.
pub struct Piped(pub Box<dyn Write>);

impl Write for Piped {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl AtomicWriter for Piped {
    fn finish(mut self: Box<Self>) -> Result<(), FileError> {
        let flushed = self.flush();
        flushed.map_err(|source| FileError::Io {
            path: "standard output".to_owned(),
            source,
        })
    }
}

fn failed(place: &Path, source: io::Error) -> Error {
    Error::from(FileError::Io {
        path: place.display().to_string(),
        source,
    })
}
