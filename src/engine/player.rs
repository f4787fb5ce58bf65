//! Players for a show, in the fastest format of sufficient quality.

use std::sync::Arc;

use super::document::Document;
use super::{Engine, Error};
use crate::playback::{Playback, Player};
use footlight_picture::Image;
use footlight_picture::tone::Tone;
use footlight_show::units::Time;

/// Key images beyond the memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManyKeys {
    /// Their number.
    pub keys: usize,
    /// Bytes needed.
    pub needed: usize,
    /// Bytes allowed.
    pub budget: usize,
    /// Effects in cues, each with its bank: while one runs, each of its turns is a key.
    pub effects: Vec<(String, String)>,
}

impl ManyKeys {
    /// Key images of a document beyond `memory` bytes; `None` if they fit, or without anything to
    /// render.
    pub fn of(document: &Document, memory: usize) -> Option<ManyKeys> {
        let view = &document.setup()?.view;
        let needed = Playback::bytes_at(document.keys(), (view.width, view.height));
        (needed > memory).then(|| ManyKeys::new(document, needed, memory))
    }

    fn new(document: &Document, needed: usize, budget: usize) -> ManyKeys {
        let show = document.show();
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
            keys: document.keys().keys().len(),
            needed,
            budget,
            effects,
        }
    }
}

/// Most moments at which the light of heads counts for the exposure.
const EXPOSED: usize = 32;

impl Document {
    /// The tone of a sequence: the show's own exposure, or an automatic one from its brightest key
    /// images; with heads, from frames at cues' completion.
    pub fn tone_of_playback(&self, playback: &Playback) -> Tone {
        if playback.heads().is_none() {
            return self.tone_of(playback.images());
        }
        let frames: Vec<Image> = self.exposed().map(|time| playback.frame(time)).collect();
        self.tone_of(&frames)
    }

    /// Moments whose frames set the exposure of a show with heads.
    pub(super) fn exposed(&self) -> impl Iterator<Item = Time> {
        let all = self.timeline().cues();
        let step = all.len().div_ceil(EXPOSED).max(1);
        all.iter().step_by(step).map(|cue| cue.completion)
    }
}

impl Engine {
    /// Makes key images from the current pool, ready to play; missing coarse images are rendered
    /// first.
    ///
    /// # Errors
    /// [`Error::NoSetup`] when the show has no stage or view, or an error of rendering.
    pub fn playback(&mut self) -> Result<Arc<Playback>, Error> {
        self.coarse()?;
        let needed = Playback::bytes(self.document.keys(), self.estimate().rendered()?);
        if needed > self.work().memory {
            let view = self.looked_from().view;
            self.images.rendering(&view)?.keep_operators(&[]);
        }
        let budget = self.work().memory;
        if needed > budget {
            return Err(Error::KeyImages(ManyKeys::new(
                &self.document,
                needed,
                budget,
            )));
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
        let tone = self.document.tone_of_playback(&playback);
        Ok(Player::fitting(&playback, tone, self.host.work())?)
    }
}
