//! The sequence: animated, as video, as numbered pictures.
//!
//! Invariant: frames are made and written one at a time, so that memory holds the key images and
//! one frame, however long the show is; an animated PNG has a limited size instead.

use std::io::{self, Write};
use std::path::Path;

use super::described;
use super::target::{Kind, Numbered, Target};
use crate::files::{FileError, Growing};
use crate::interpreter::answer::count;
use crate::interpreter::{Call, Error, Interpreter, Reply, Shown};
use crate::picture::apng::{self, Limits};
use crate::picture::exr;
use crate::picture::tone::Tone;
use crate::picture::y4m::{Chroma, Film};
use crate::picture::{Image, png};
use crate::playback::Playback;
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
    /// Frames a second that playback alone reaches, measured over about a second.
    pub(super) fn frame_rate(&self, playback: &Playback) -> f64 {
        let (start, end) = (self.timeline().start(), self.timeline().end());
        let mut frame = Image::new(0, 0);
        let begin = self.host.clock.seconds();
        let mut frames = 0;
        loop {
            // A stride that is no simple fraction visits all kinds of segments.
            let at = (f64::from(frames) * 0.618_033_988_75).fract();
            playback.frame(start + (end - start).scaled(at), &mut frame);
            frames += 1;
            let passed = self.host.clock.seconds() - begin;
            if passed > 0.5 || frames >= 500 {
                return f64::from(frames) / passed.max(1e-9);
            }
        }
    }

    /// The sequence as an animated PNG, and how it was fitted.
    pub(super) fn animate(
        &self,
        playback: &Playback,
        tone: Tone,
    ) -> Result<(Vec<u8>, Animation), Error> {
        let (start, length) = (self.timeline().start(), self.keys().duration());
        let still: Vec<(f64, f64)> = self
            .keys()
            .segments()
            .iter()
            .filter(|s| s.degree == 0)
            .map(|s| (s.start() - start.seconds(), s.end() - start.seconds()))
            .collect();
        let mut image = Image::new(0, 0);
        let mut drawn = 0;
        let expected = Limits::default().frames;
        let mut frame = |seconds: f64| {
            let time = start + Time::from_seconds(seconds).unwrap_or_default();
            playback.frame(time, &mut image);
            drawn += 1;
            self.host
                .progress
                .report("sequence", drawn.min(expected), expected);
            tone.encode(&image)
        };
        let asked = self.show().preview.rate;
        let limits = Limits::default();
        let made = apng::animate(playback.size(), length, asked, &still, &mut frame, limits)?;
        let told = Animation {
            frames: made.frames,
            rate: made.rate,
            asked,
            bytes: made.bytes.len(),
        };
        Ok((made.bytes, told))
    }

    pub(in crate::interpreter) fn answer_play(&mut self, call: &Call) -> Result<Reply, Error> {
        let target = call.option("output").map(|path| Target::of(path, call));
        let target = target.transpose()?;
        let playback = self.playback()?;
        let tone = self.tone(playback.images());
        match target {
            None => Ok(self.show_playback(&playback, tone)),
            Some(Target::Animation(path)) => {
                let (bytes, told) = self.animate(&playback, tone)?;
                self.write_reply(Some(&path), &bytes, told.describe())
            }
            Some(Target::Video(Some(path), chroma)) => {
                let file = self.host.store.begin(&path)?;
                self.video(&playback, tone, chroma, file, &path)
            }
            Some(Target::Video(None, chroma)) => {
                let pipe = self.host.pipe.as_ref().ok_or_else(no_pipe)?;
                let place = Path::new("standard output");
                let reply = self.video(&playback, tone, chroma, Box::new(Pipe(pipe())), place)?;
                Ok(Reply {
                    beside: true,
                    ..reply
                })
            }
            Some(Target::Numbered(names, kind)) => self.numbered(&playback, tone, &names, kind),
            Some(Target::Layers(path, layers, precision)) => {
                self.write_layers(&playback, &path, layers, precision)
            }
        }
    }

    /// The frame of the current time, and how fast frames are made.
    fn show_playback(&self, playback: &Playback, tone: Tone) -> Reply {
        let rate = self.frame_rate(playback);
        let mut image = Image::new(0, 0);
        playback.frame(self.now, &mut image);
        let (width, height) = playback.size();
        let keys = count(playback.images().len(), "key image");
        let text = format!(
            "{keys}; playback reaches {rate:.0} frames/s at {width}x{height}. \
             `play -o show.png` writes the sequence"
        );
        Reply {
            picture: Some(Shown {
                size: playback.size(),
                rgb: tone.encode(&image),
            }),
            ..Reply::text(text)
        }
    }

    /// Hands every frame of the film to `take`, with its place from 0: the first at the start, the
    /// last not before the end, which holds the last look.
    fn frames(
        &self,
        playback: &Playback,
        task: &str,
        take: &mut dyn FnMut(usize, &Image) -> Result<(), Error>,
    ) -> Result<usize, Error> {
        let rate = self.show().preview.rate;
        // A whole number of frames must not become one more by rounding.
        let total = (self.keys().duration() * rate - 1e-6).ceil().max(0.0) as usize + 1;
        let mut image = Image::new(0, 0);
        for i in 0..total {
            self.host.work().check()?;
            let time = Time::from_seconds(i as f64 / rate).unwrap_or_default();
            playback.frame(self.timeline().start() + time, &mut image);
            take(i, &image)?;
            self.host.progress.report(task, i + 1, total);
        }
        Ok(total)
    }

    /// The film as YUV4MPEG2. A reader that has seen enough ends it, and that is well.
    fn video(
        &self,
        playback: &Playback,
        tone: Tone,
        chroma: Chroma,
        mut file: Box<dyn Growing + '_>,
        place: &Path,
    ) -> Result<Reply, Error> {
        let (width, height) = playback.size();
        let rate = self.show().preview.rate;
        let film = Film {
            width,
            height,
            rate,
            chroma,
        };
        let mut bytes = film.header().into_bytes();
        let mut done = 0;
        let written = self.frames(playback, "video", &mut |_, image| {
            film.push(&tone.encode(image), &mut bytes)?;
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
    fn numbered(
        &self,
        playback: &Playback,
        tone: Tone,
        names: &Numbered,
        kind: Kind,
    ) -> Result<Reply, Error> {
        let (width, height) = playback.size();
        let title = described("show", &self.show().title);
        let total = self.frames(playback, "pictures", &mut |i, image| {
            let bytes = match kind {
                Kind::Png => png::encode(width, height, &tone.encode(image))?,
                Kind::Exr(precision) => {
                    exr::encode(image, precision, std::slice::from_ref(&title))?
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
