//! Key images ready to play, in the fastest format that is good enough for the show.

use std::sync::Arc;

use super::measure::playback::{Frame, Judged, KeyFormat, UNSEEN, judge};
use super::{Engine, Error};
use crate::picture::Image;
use crate::picture::tone::Tone;
use crate::playback::key::Format;
use crate::playback::{Playback, Player};
use crate::units::Time;

/// Channels that decide the default format; a measurement looks at whole images.
const SAMPLE: usize = 20_000;

/// Key images that memory does not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManyKeys {
    /// How many there are.
    pub keys: usize,
    /// Bytes that they need.
    pub needed: usize,
    /// Bytes allowed.
    pub budget: usize,
    /// Effects that cues start, each with the bank that it runs on: while one runs, every turn of it is
    /// a key.
    pub effects: Vec<(String, String)>,
}

impl Engine {
    /// Key images from the pool as it stands, ready to play; coarse images are rendered if they are
    /// not there.
    ///
    /// # Errors
    /// [`Error::NoSetup`] when the show has no stage or view, else what rendering says.
    pub fn playback(&mut self) -> Result<Arc<Playback>, Error> {
        self.visible()?;
        let needed = Playback::bytes(self.document.keys(), self.rendered()?);
        if needed > self.work().memory
            && let Some(rendering) = &mut self.rendering
        {
            rendering.keep_operators(&[]);
        }
        let budget = self.work().memory;
        if needed > budget {
            return Err(Error::KeyImages(self.many_keys(needed, budget)));
        }
        let pool = self.rendered()?;
        let playback = Playback::new(self.document.keys(), pool, self.work())?;
        Ok(Arc::new(playback))
    }

    /// The key images of the show, where memory does not hold them; `None` where it does, or where
    /// there is nothing to render.
    pub fn key_images_beyond_memory(&self) -> Option<ManyKeys> {
        let view = &self.setup()?.view;
        let keys = self.document.keys();
        let (needed, budget) = (
            Playback::bytes_at(keys, (view.width, view.height)),
            self.host.memory,
        );
        (needed > budget).then(|| self.many_keys(needed, budget))
    }

    fn many_keys(&self, needed: usize, budget: usize) -> ManyKeys {
        let show = self.show();
        let changes = show.cues.iter().flat_map(|cue| &cue.parts);
        let changes = changes.flat_map(|part| &part.effects);
        let mut effects: Vec<(String, String)> = Vec::new();
        for change in changes {
            let effect = change.effect.and_then(|effect| show.effects.get(effect));
            let (Some(effect), Some(bank)) = (effect, show.banks.get(change.bank)) else {
                continue;
            };
            let pair = (effect.name.clone(), bank.name.clone());
            if !effects.contains(&pair) {
                effects.push(pair);
            }
        }
        ManyKeys {
            keys: self.document.keys().keys().len(),
            needed,
            budget,
            effects,
        }
    }

    /// The sequence as display bytes, exposed as one: any frame is at most three blends of key
    /// images.
    ///
    /// # Errors
    /// As [`Engine::playback`].
    pub fn player(&mut self) -> Result<Player, Error> {
        let playback = self.playback()?;
        let tone = self.tone_of(playback.images());
        self.player_of(&playback, tone, None)
    }

    /// A player with keys in a format, or else in the fastest that is good enough for this show.
    pub(crate) fn player_of(
        &self,
        playback: &Arc<Playback>,
        tone: Tone,
        format: Option<Format>,
    ) -> Result<Player, Error> {
        match format {
            Some(format) => Ok(Player::new(playback, format, tone, self.host.work())?),
            None => self.default_player(playback, tone),
        }
    }

    /// Half precision where its error stays under half a step of 8 bits, as it does unless a light
    /// in sight is a hundred million times brighter than what is to be seen next to it; else single.
    /// 8 bits are never the default: they err by more, and take longer to decode than to read.
    fn default_player(&self, playback: &Arc<Playback>, tone: Tone) -> Result<Player, Error> {
        let half = Player::new(playback, Format::Half, tone, self.host.work())?;
        if self.sampled(playback, tone, &half)? < UNSEEN {
            return Ok(half);
        }
        let work = self.host.work();
        Ok(Player::new(playback, Format::Float, tone, work)?)
    }

    /// The largest error of some channels, in steps of 8 bits.
    fn sampled(&self, playback: &Playback, tone: Tone, player: &Player) -> Result<f64, Error> {
        let stride = (playback.size().0 * playback.size().1 * 3).div_ceil(SAMPLE);
        Ok(self.judge(playback, tone, stride, player)?.most)
    }

    /// All formats, judged as the default is.
    pub(super) fn key_formats(
        &self,
        playback: &Arc<Playback>,
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

    /// How far a player's frames are off, of every `stride`-th channel.
    fn judge(
        &self,
        playback: &Playback,
        tone: Tone,
        stride: usize,
        player: &Player,
    ) -> Result<Judged, Error> {
        let mut frame = |time| {
            let mut image = Image::new(0, 0);
            player.light(time, &mut image);
            Frame::Light(image)
        };
        let work = self.host.work();
        Ok(judge(playback, tone, stride, &mut frame, work)?)
    }

    /// Frames a second that playback alone reaches, measured over about half a second.
    pub(crate) fn frame_rate(&self, player: &Player) -> f64 {
        let mut bytes = Vec::new();
        let begin = self.now();
        let mut frames = 0;
        loop {
            player.show(self.visited(frames), &mut bytes);
            frames += 1;
            let passed = self.now() - begin;
            if passed > 0.5 || frames >= 500 {
                return frames as f64 / passed.max(1e-9);
            }
        }
    }

    /// The `n`-th moment of a measurement: a stride that is no simple fraction visits all kinds of
    /// segments.
    fn visited(&self, n: usize) -> Time {
        let timeline = self.document.timeline();
        let (start, end) = (timeline.start(), timeline.end());
        start + (end - start).scaled((n as f64 * 0.618_033_988_75).fract())
    }
}
