//! Players for a show.

use std::sync::Arc;

use super::document::Document;
use super::{Engine, Error};
use crate::playback::{Playback, Player};
use footlight_show::units::Time;

/// Most moments whose frames count for the exposure.
const EXPOSED: usize = 32;

impl Document {
    /// Moments whose frames set the exposure of a show with heads.
    pub(super) fn exposed(&self) -> impl Iterator<Item = Time> {
        let all = self.timeline().cues();
        let step = all.len().div_ceil(EXPOSED).max(1);
        all.iter().step_by(step).map(|cue| cue.completion)
    }
}

impl Engine {
    /// Makes key images from the current pool, ready to play, if they fit into memory; missing coarse
    /// images are rendered first.
    ///
    /// # Errors
    /// [`Error::NoSetup`] when the show has no stage or view, or an error of rendering.
    pub fn playback(&mut self) -> Result<Arc<Playback>, Error> {
        self.coarse()?;
        let pool = self.estimate().rendered()?;
        if !Playback::has_keys(self.document.keys(), pool, self.work().memory) {
            let view = self.looked_from().view;
            self.images.rendering(&view)?.keep_operators(&[]);
        }
        let pool = self.estimate().rendered()?;
        let playback = Playback::new(self.document.keys(), pool, self.work())?;
        self.images.find_heads(&self.document, self.host.work())?;
        let heads = self.images.heads(&self.document);
        Ok(Arc::new(playback.with_heads(heads)))
    }

    /// A player of the sequence as display bytes, with one exposure; each frame takes at most three
    /// blends of key images.
    ///
    /// # Errors
    /// As [`Engine::playback`].
    pub fn player(&mut self) -> Result<Player, Error> {
        let playback = self.playback()?;
        let tone = self.tone()?;
        Ok(Player::new(&playback, tone, self.host.work()))
    }
}
