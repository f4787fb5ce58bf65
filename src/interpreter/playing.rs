//! How key images are kept for playback, and what each format is worth: `chart playback`.

use std::path::Path;

use super::{Call, Error, Interpreter, Reply};
use crate::chart::Theme;
use crate::picture::tone::Tone;
use crate::picture::{Image, png, signed};
use crate::playback::key::Format;
use crate::playback::{Playback, Player};
use crate::report;
use crate::study::playback::{
    self as study, Displayed, FormatTradeoff, Frame, Judged, KeyFormat, Timed, UNSEEN,
};
use crate::units::Time;

/// Channels that decide the default format; the whole picture is looked at by `chart playback`.
const SAMPLE: usize = 20_000;
/// How often each way is timed, in turns, so that what disturbs one disturbs the others too.
const ROUNDS: usize = 5;
/// Frames of one turn.
const FRAMES: usize = 20;
/// What the paper's hardware did, as `--where` and the chart call it.
const DISPLAYED: &str = "displayed";

impl Interpreter {
    /// A player with keys in the format that `--keys` names, or else in the fastest that is good
    /// enough for this show.
    pub(super) fn player<'p>(
        &self,
        playback: &'p Playback,
        tone: Tone,
        call: Option<&Call>,
    ) -> Result<Player<'p>, Error> {
        let asked = call
            .and_then(|c| c.option("keys"))
            .map(format)
            .transpose()?;
        match asked {
            Some(format) => Ok(Player::new(playback, format, tone, self.host.work())?),
            None => self.default_player(playback, tone),
        }
    }

    /// Half precision where its error stays under half a step of 8 bits, as it does unless a light
    /// in sight is a hundred million times brighter than what is to be seen beside it; else single.
    /// 8 bits are never the default: they err by more, and take longer to decode than to read.
    fn default_player<'p>(&self, playback: &'p Playback, tone: Tone) -> Result<Player<'p>, Error> {
        let half = Player::new(playback, Format::Half, tone, self.host.work())?;
        if self.sampled(playback, tone, &half)? < UNSEEN {
            return Ok(half);
        }
        Ok(Player::new(
            playback,
            Format::Float,
            tone,
            self.host.work(),
        )?)
    }

    /// The largest error of some channels, in steps of 8 bits.
    fn sampled(&self, playback: &Playback, tone: Tone, player: &Player<'_>) -> Result<f64, Error> {
        let stride = (playback.size().0 * playback.size().1 * 3).div_ceil(SAMPLE);
        Ok(self.judge(playback, tone, stride, player)?.most)
    }

    /// All formats, judged as the default is.
    pub(super) fn key_formats(
        &self,
        playback: &Playback,
        tone: Tone,
    ) -> Result<Vec<KeyFormat>, Error> {
        let chosen = self.default_player(playback, tone)?.format();
        let mut out = Vec::new();
        for format in Format::ALL {
            let player = Player::new(playback, format, tone, self.host.work())?;
            out.push(KeyFormat {
                name: format.name(),
                bytes: player.bytes(),
                error: self.sampled(playback, tone, &player)?,
                chosen: format == chosen,
            });
        }
        Ok(out)
    }

    fn judge(
        &self,
        playback: &Playback,
        tone: Tone,
        stride: usize,
        player: &Player<'_>,
    ) -> Result<Judged, Error> {
        let mut frame = |time| {
            let mut image = Image::new(0, 0);
            player.light(time, &mut image);
            Frame::Light(image)
        };
        Ok(study::judge(
            playback,
            tone,
            stride,
            &mut frame,
            self.host.work(),
        )?)
    }

    /// Frames a second that playback alone reaches, measured over about half a second.
    pub(super) fn frame_rate(&self, player: &Player<'_>) -> f64 {
        let mut bytes = Vec::new();
        let begin = self.host.clock.seconds();
        let mut frames = 0;
        loop {
            player.show(self.visited(frames), &mut bytes);
            frames += 1;
            let passed = self.host.clock.seconds() - begin;
            if passed > 0.5 || frames >= 500 {
                return frames as f64 / passed.max(1e-9);
            }
        }
    }

    /// The `n`-th moment of a measurement: a stride that is no simple fraction visits all kinds of
    /// segments.
    fn visited(&self, n: usize) -> Time {
        let (start, end) = (self.timeline().start(), self.timeline().end());
        start + (end - start).scaled((n as f64 * 0.618_033_988_75).fract())
    }

    pub(super) fn answer_chart_playback(
        &mut self,
        call: &Call,
        path: Option<&Path>,
        theme: Theme,
    ) -> Result<Reply, Error> {
        if let Some(way) = call.option("where") {
            return self.where_off(way, path);
        }
        let found = self.chart_playback()?;
        let text = report::playback::describe(&found);
        let record = || report::playback::record(&found);
        let drawing = |theme| report::playback::drawing(&found, theme);
        self.deliver(text, &record, &drawing, path, theme)
    }

    /// Error against frames a second for each format of key images and number of threads, and for
    /// the paper's hardware with one.
    ///
    /// # Errors
    /// [`Error::Usage`] without stage or view, else what rendering says.
    pub fn chart_playback(&mut self) -> Result<FormatTradeoff, Error> {
        let playback = self.playback()?;
        let tone = self.tone(playback.images());
        let work = self.host.work();
        let chosen = self.default_player(&playback, tone)?.format();
        let mut players = Vec::new();
        for format in Format::ALL {
            players.push(Player::new(&playback, format, tone, work)?);
        }
        let displayed = Displayed::new(&playback, tone);
        let mut seconds = self.paces(&mut players, &displayed)?;
        let apart = seconds.pop().unwrap_or_default();
        let mut ways = Vec::new();
        for (player, seconds) in players.iter().zip(seconds) {
            ways.push(Timed {
                seconds,
                bytes: player.bytes(),
                judged: self.judge(&playback, tone, 1, player)?,
                format: Some(player.format()),
            });
        }
        ways.push(Timed {
            seconds: apart,
            bytes: displayed.bytes(),
            judged: self.judge_displayed(&playback, tone, &displayed)?,
            format: None,
        });
        Ok(FormatTradeoff {
            origin: self.origin(),
            size: playback.size(),
            chosen,
            ways,
        })
    }

    fn judge_displayed(
        &self,
        playback: &Playback,
        tone: Tone,
        displayed: &Displayed<'_>,
    ) -> Result<Judged, Error> {
        let mut frame = |time| {
            let mut bytes = Vec::new();
            displayed.show(time, &mut bytes);
            Frame::Bytes(bytes)
        };
        Ok(study::judge(
            playback,
            tone,
            1,
            &mut frame,
            self.host.work(),
        )?)
    }

    /// Seconds a frame of each player by number of threads, then of the paper's way with one: the
    /// fastest of several turns.
    fn paces(
        &self,
        players: &mut [Player<'_>],
        displayed: &Displayed<'_>,
    ) -> Result<Vec<Vec<(usize, f64)>>, Error> {
        let threads = doubled(self.host.threads);
        let fresh = |threads: &[usize]| threads.iter().map(|n| (*n, f64::INFINITY)).collect();
        let mut best: Vec<Vec<(usize, f64)>> = vec![fresh(&threads); players.len()];
        best.push(fresh(&[1]));
        let mut bytes = Vec::new();
        for _ in 0..ROUNDS {
            for (way, turns) in best.iter_mut().enumerate() {
                for (threads, best) in turns {
                    self.host.work().check()?;
                    let begin = self.host.clock.seconds();
                    for n in 0..FRAMES {
                        match players.get_mut(way) {
                            Some(player) => {
                                player.set_threads(*threads);
                                player.show(self.visited(n), &mut bytes);
                            }
                            None => displayed.show(self.visited(n), &mut bytes),
                        }
                    }
                    let passed = self.host.clock.seconds() - begin;
                    *best = best.min(passed.max(1e-9) / FRAMES as f64);
                }
            }
        }
        Ok(best)
    }

    /// A picture of where a way of playing is off: the largest error of each channel.
    fn where_off(&mut self, way: &str, path: Option<&Path>) -> Result<Reply, Error> {
        let playback = self.playback()?;
        let tone = self.tone(playback.images());
        let judged = match way {
            DISPLAYED => {
                let displayed = Displayed::new(&playback, tone);
                self.judge_displayed(&playback, tone, &displayed)?
            }
            _ => {
                let player = Player::new(&playback, format(way)?, tone, self.host.work())?;
                self.judge(&playback, tone, 1, &player)?
            }
        };
        let (width, height) = playback.size();
        let worst = Image::from_data(width, height, judged.worst);
        let worst = worst.unwrap_or_else(|| Image::new(width, height));
        let scale = signed::scale(&worst);
        let rgb = signed::encode(&worst, scale);
        let text = format!(
            "keys {way}: at most {:.2} steps of 8 bits, RMS {:.3}; full amber is {scale:.2} steps",
            judged.most, judged.rms
        );
        self.picture_reply(path, (width, height), rgb, text)
    }

    /// A display-coded picture beside the words, or into a `.png`.
    fn picture_reply(
        &self,
        path: Option<&Path>,
        size: (usize, usize),
        rgb: Vec<u8>,
        text: String,
    ) -> Result<Reply, Error> {
        let Some(path) = path else {
            return Ok(Reply {
                picture: Some(super::Shown { size, rgb }),
                ..Reply::text(text)
            });
        };
        if super::output::ending(path) != "png" {
            return Err(super::output::unknown_ending(path, ".png: it is a picture"));
        }
        let bytes = png::encode(size.0, size.1, &rgb)?;
        self.host.store.write(path, &bytes)?;
        Ok(Reply::text(format!("{text}\nwrote {}", path.display())))
    }
}

/// One, two, four and so on up to a number of threads, and that number.
fn doubled(most: usize) -> Vec<usize> {
    let mut out: Vec<usize> = std::iter::successors(Some(1), |n| Some(2 * n))
        .take_while(|n| *n < most)
        .collect();
    out.push(most.max(1));
    out
}

/// The format that a word names.
fn format(word: &str) -> Result<Format, Error> {
    let known = |f: &&Format| f.name() == word;
    Format::ALL.iter().find(known).copied().ok_or_else(|| {
        Error::Usage(format!(
            "`{word}` is no format of key images; there are f32, f16 and 8-bit"
        ))
    })
}
