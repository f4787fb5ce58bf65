//! The sequence: animated, as video, as numbered pictures.
//!
//! Invariant: frames are made and written one at a time, so that memory holds the key images and
//! one frame, however long the show is; an animated PNG has a limited size instead.

use std::io::{self, Write};
use std::path::Path;

use super::Error;
use super::format::header;
use super::target::{Kind, Numbered};
use super::text::count;
use crate::engine::Engine;
use crate::files::{FileError, Growing};
use crate::picture::apng::{self, Limits};
use crate::picture::exr;
use crate::picture::y4m::{Chroma, Film};
use crate::picture::{Image, png};
use crate::playback::Player;
use crate::playback::key::Format;
use crate::units::Time;

/// How the sequence was fitted into an animated picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// Frames in the file; a still stretch is one.
    pub frames: usize,
    /// Frames a second where something moves.
    pub rate: f64,
    /// Frames a second that the show asked for.
    pub asked: f64,
    /// Size of the file.
    pub bytes: usize,
}

impl Animation {
    /// In words.
    pub fn describe(&self) -> String {
        let size = self.bytes as f64 / 1e6;
        let frames = count(self.frames, "frame");
        if self.rate < self.asked {
            let (rate, asked) = (self.rate, self.asked);
            return format!("{frames}, {size:.1} MB, {rate:.2} frames/s to fit (asked: {asked})");
        }
        format!("{frames}, {size:.1} MB, {} frames/s", self.rate)
    }
}

impl Interpreter {
    /// The sequence as an animated PNG, and how it was fitted.
    pub(super) fn animate(&self, player: &Player<'_>) -> Result<(Vec<u8>, Animation), Error> {
        let (start, length) = (self.timeline().start(), self.keys().duration());
        let still: Vec<(f64, f64)> = self
            .keys()
            .segments()
            .iter()
            .filter(|s| s.degree == 0)
            .map(|s| (s.start() - start.seconds(), s.end() - start.seconds()))
            .collect();
        let mut drawn = 0;
        let expected = Limits::default().frames;
        let mut frame = |seconds: f64| {
            let time = start + Time::from_seconds(seconds).unwrap_or_default();
            let mut bytes = Vec::new();
            player.show(time, &mut bytes);
            drawn += 1;
            self.host
                .progress
                .report("sequence", drawn.min(expected), expected);
            bytes
        };
        let asked = self.show().preview.rate;
        let limits = Limits::default();
        let made = apng::animate(player.size(), length, asked, &still, &mut frame, limits)?;
        let told = Animation {
            frames: made.frames,
            rate: made.rate,
            asked,
            bytes: made.bytes.len(),
        };
        Ok((made.bytes, told))
    }

    /// The frame of the current time, and how fast frames are made.
    fn show_playback(&self, player: &Player<'_>) -> Reply {
        let rate = self.frame_rate(player);
        let mut rgb = Vec::new();
        player.show(self.now, &mut rgb);
        let (width, height) = player.size();
        let keys = count(player.keys(), "key image");
        let format = player.format().name();
        let text = format!(
            "{keys} in {format}; playback reaches {rate:.0} frames/s at {width}x{height}. \
             `play -o show.png` writes the sequence"
        );
        Reply {
            picture: Some(Shown {
                size: player.size(),
                rgb,
            }),
            ..Reply::text(text)
        }
    }

    /// Plays on the host's canvas in real time, from the current time, or from the start where that
    /// is the end; stopping it is no error.
    fn perform(&self, player: &Player<'_>, canvas: &dyn Canvas) -> Reply {
        let (start, end) = (self.timeline().start(), self.timeline().end());
        let from = if self.now < end { self.now } else { start };
        let mut frame = Shown {
            size: player.size(),
            rgb: Vec::new(),
        };
        let begin = self.host.clock.seconds();
        let mut frames = 0;
        let (passed, reached) = loop {
            let passed = self.host.clock.seconds() - begin;
            let time = from + Time::from_seconds(passed).unwrap_or_default();
            player.show(time.min(end), &mut frame.rgb);
            frames += 1;
            let seen = canvas.frame(&frame);
            if !seen || time >= end || self.host.progress.cancelled() {
                break (passed, time.min(end));
            }
        };
        canvas.end();
        let frames = count(frames, "frame");
        Reply::text(format!(
            "played from {from} to {}: {frames} in {passed:.1} s",
            reached.rounded()
        ))
    }

    /// Calls `take` for every frame of the film with its place from 0 and its time: the first at
    /// the start, the last not before the end, which holds the last look. How many there are.
    fn frames(
        &self,
        task: &str,
        take: &mut dyn FnMut(usize, Time) -> Result<(), Error>,
    ) -> Result<usize, Error> {
        let rate = self.show().preview.rate;
        // A whole number of frames must not become one more by rounding.
        let total = (self.keys().duration() * rate - 1e-6).ceil().max(0.0) as usize + 1;
        for i in 0..total {
            self.host.work().check()?;
            let time = Time::from_seconds(i as f64 / rate).unwrap_or_default();
            take(i, self.timeline().start() + time)?;
            self.host.progress.report(task, i + 1, total);
        }
        Ok(total)
    }

    /// The film as YUV4MPEG2. A reader that has seen enough ends it, and that is well.
    fn video(
        &self,
        player: &Player<'_>,
        chroma: Chroma,
        mut file: Box<dyn Growing + '_>,
        place: &Path,
    ) -> Result<Reply, Error> {
        let (width, height) = player.size();
        let rate = self.show().preview.rate;
        let film = Film {
            width,
            height,
            rate,
            chroma,
        };
        let mut bytes = film.header().into_bytes();
        let mut rgb = Vec::new();
        let mut done = 0;
        let written = self.frames("video", &mut |_, time| {
            player.show(time, &mut rgb);
            film.push(&rgb, &mut bytes)?;
            file.write_all(&bytes).map_err(|e| failed(place, e))?;
            bytes.clear();
            done += 1;
            Ok(())
        });
        let frames = |n| count(n, "frame");
        match written.and_then(|n| Ok((n, file.finish()?))) {
            Ok((n, ())) => Ok(Reply::text(format!(
                "{} of {width}x{height}, {rate} frames/s, BT.709\nwrote {}",
                frames(n),
                place.display()
            ))),
            Err(Error::File(FileError::Io { source, .. }))
                if source.kind() == io::ErrorKind::BrokenPipe =>
            {
                Ok(Reply::text(format!(
                    "the reader left after {}",
                    frames(done)
                )))
            }
            Err(error) => Err(error),
        }
    }

    /// A picture for each frame, from number 1.
    fn numbered(&self, player: &Player<'_>, names: &Numbered, kind: Kind) -> Result<Reply, Error> {
        let (width, height) = player.size();
        let (mut rgb, mut light) = (Vec::new(), Image::new(0, 0));
        let title = described("show", &self.show().title);
        let total = self.frames("pictures", &mut |i, time| {
            let bytes = match kind {
                Kind::Png => {
                    player.show(time, &mut rgb);
                    png::encode(width, height, &rgb)?
                }
                Kind::Exr(precision) => {
                    player.light(time, &mut light);
                    exr::encode(&light, precision, std::slice::from_ref(&title))?
                }
            };
            Ok(self.host.store.write(&names.path(i + 1), &bytes)?)
        })?;
        Ok(Reply::text(format!(
            "{} of {width}x{height}, {} frames/s\nwrote {} to {}",
            count(total, "frame"),
            self.show().preview.rate,
            names.path(1).display(),
            names.path(total).display()
        )))
    }
}

/// The host's pipe as a file that is finished when all of it is through.
struct Pipe(Box<dyn Write>);

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl Growing for Pipe {
    fn finish(mut self: Box<Self>) -> Result<(), FileError> {
        let flushed = self.flush();
        flushed.map_err(|source| FileError::Io {
            path: "standard output".to_owned(),
            source,
        })
    }
}

fn failed(place: &Path, source: io::Error) -> Error {
    Error::File(FileError::Io {
        path: place.display().to_string(),
        source,
    })
}

fn no_pipe() -> Error {
    Error::Usage(
        "`-` needs a reader at standard output: \
         footlight play show.lxq -o - | ffmpeg -i - show.mp4"
            .to_owned(),
    )
}
