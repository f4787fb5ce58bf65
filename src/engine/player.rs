//! Key images ready to play, in the fastest format that is good enough for the show.

use std::sync::Arc;

use super::{Engine, Error};
use crate::playback::key::{self, Format};
use crate::playback::{Playback, Player};
use footlight_host::work::Cancelled;
use footlight_picture::tone::Tone;
use footlight_show::units::{Time, srgb_decode};

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
        self.coarse()?;
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
        Ok(self.player_of(&playback, tone)?)
    }

    /// A player with keys in half precision where that shows no difference, else in single.
    ///
    /// A half keeps light to 2^-11 of itself, a twentieth of a step of the display, down to 2^-29 of
    /// the brightest light of its image. So halves serve unless that is more than the light of half
    /// a step, as where the sun stands in sight.
    pub fn player_of(&self, playback: &Arc<Playback>, tone: Tone) -> Result<Player, Cancelled> {
        let brightest = playback.images().iter().map(key::peak).fold(0.0, f32::max);
        let format = if f64::from(brightest) * key::HALF_RANGE
            < tone.light(srgb_decode(0.5 / 255.0))
            && brightest < key::HALF_BRIGHTEST
        {
            Format::Half
        } else {
            Format::Float
        };
        Player::new(playback, format, tone, self.host.work())
    }

    /// Frames a second that playback alone reaches, measured over about half a second.
    pub fn frame_rate(&self, player: &Player) -> f64 {
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
