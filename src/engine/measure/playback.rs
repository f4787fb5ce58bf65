//! What keeping key images in a format takes and loses.

use crate::engine::{Engine, Error};
use crate::picture::tone::Tone;
use crate::playback::key::Format;
use crate::playback::{Playback, Player};
use crate::study::playback::{self as study, Displayed, FormatTradeoff, Frame, Judged, Timed};

/// How often each way is timed, in turns, so that what disturbs one disturbs the others too.
const ROUNDS: usize = 5;
/// Frames of one turn.
const FRAMES: usize = 20;

impl Engine {
    /// Error against frames a second for each format of key images and number of threads, and for
    /// the paper's hardware with one.
    ///
    /// # Errors
    /// [`Error::NoSetup`], else what rendering says.
    pub fn measure_playback(&mut self) -> Result<FormatTradeoff, Error> {
        let playback = self.playback()?;
        let tone = self.tone_of(playback.images());
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

    pub(in crate::engine) fn judge_displayed(
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
        players: &mut [Player],
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
                    let begin = self.now();
                    for n in 0..FRAMES {
                        match players.get_mut(way) {
                            Some(player) => {
                                player.set_threads(*threads);
                                player.show(self.visited(n), &mut bytes);
                            }
                            None => displayed.show(self.visited(n), &mut bytes),
                        }
                    }
                    let passed = self.now() - begin;
                    *best = best.min(passed.max(1e-9) / FRAMES as f64);
                }
            }
        }
        Ok(best)
    }

    /// How far frames are off where keys are kept in a format, and their width and height; `None`
    /// for the paper's hardware, 8 bits blended as displayed.
    ///
    /// # Errors
    /// As [`Engine::playback`].
    pub fn measure_format(
        &mut self,
        format: Option<Format>,
    ) -> Result<(Judged, (usize, usize)), Error> {
        let playback = self.playback()?;
        let tone = self.tone_of(playback.images());
        let judged = match format {
            Some(format) => {
                let player = Player::new(&playback, format, tone, self.host.work())?;
                self.judge(&playback, tone, 1, &player)?
            }
            None => {
                let displayed = Displayed::new(&playback, tone);
                self.judge_displayed(&playback, tone, &displayed)?
            }
        };
        Ok((judged, playback.size()))
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
