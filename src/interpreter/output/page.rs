//! The page that plays a show in a browser.

use std::path::Path;

use super::hue;
use crate::interpreter::answer::count;
use crate::interpreter::{Error, Interpreter, Reply};
use crate::picture::tone::Tone;
use crate::playback::Playback;
use crate::playback::page::{self, Contents, Cue, Fader, Law};
use crate::show::{Coordinate, Dimmer};
use crate::timeline;

/// Levels at which a user's dimmer curve is told to the page.
const LEVELS: usize = 257;

impl Interpreter {
    /// Writes the page.
    pub(super) fn write_page(
        &self,
        playback: &Playback,
        tone: Tone,
        path: &Path,
    ) -> Result<Reply, Error> {
        let banks = self.bank_images()?;
        let coordinates = self.show().coordinates();
        let keys = playback.images();
        let faders = coordinates.iter().enumerate();
        let contents = Contents {
            title: &self.show().title,
            faders: faders.map(|(i, c)| self.fader(c, keys.len() + i)).collect(),
            cues: self.page_cues(),
            keys: self.keys(),
            pictures: keys.iter().chain(&banks).collect(),
            tone,
        };
        let made = page::write(&contents, page::BUDGET, self.host.work())?;
        let (width, height) = made.size;
        let smaller = match made.size == playback.size() {
            true => "",
            false => ", made smaller to stay below 20 MB",
        };
        let text = format!(
            "{} and {} of {width}x{height}{smaller}; {:.1} MB",
            count(keys.len(), "key image"),
            count(banks.len(), "bank image"),
            made.html.len() as f64 / 1e6
        );
        self.write_reply(Some(path), made.html.as_bytes(), text)
    }

    fn fader(&self, coordinate: &Coordinate, picture: usize) -> Fader {
        let bank = coordinate.bank.and_then(|b| self.show().banks.get(b));
        let law = match bank.map_or(Dimmer::Linear, |b| b.dimmer) {
            Dimmer::Linear => Law::Power(1),
            Dimmer::Square => Law::Power(2),
            curve @ Dimmer::Curve(_) => {
                let level = |i| i as f64 / (LEVELS - 1) as f64;
                let levels: Vec<f64> = (0..LEVELS).map(level).collect();
                Law::Table(timeline::settings(curve, &self.show().curves, &levels))
            }
        };
        Fader {
            name: coordinate.name.clone(),
            picture,
            varies: bank.is_some(),
            law,
            colour: hue(coordinate).map(|[r, g, b]| format!("rgb({r} {g} {b})")),
        }
    }

    fn page_cues(&self) -> Vec<Cue> {
        let cues = self.show().cues.iter().zip(self.timeline().cues());
        let cue = |(cue, time): (&crate::show::Cue, &timeline::CueTime)| Cue {
            number: cue.number.to_string(),
            label: cue.label.clone(),
            go: time.go.seconds(),
            complete: time.completion.seconds(),
            starts: cue.link.is_some(),
        };
        cues.map(cue).collect()
    }
}
