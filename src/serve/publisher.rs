//! Publishes an engine to the pages: the show as data, its banks' images as files.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::audience::{Audience, Files};
use footlight_engine::Engine;
use footlight_engine::playback::page::{self, PagePicture};
use footlight_picture::Image;
use footlight_picture::tone::Tone;
use footlight_prompt::Error;
use footlight_report as report;
use footlight_report::words::{count, percent};

/// Pause between publications of refined images, in multiples of the time of one.
const REST: u32 = 4;

/// The banks' images as last published.
#[derive(Default)]
struct Kept {
    images: Vec<Image>,
    tone: Option<Tone>,
    size: (usize, usize),
    pictures: Vec<PagePicture>,
    files: Files,
    /// Number of the next file; numbers are never reused.
    next: u64,
}

/// Publishes a show when there is something new to see.
pub struct Publisher {
    audience: Arc<Audience>,
    kept: Kept,
    /// True when the show was edited since.
    is_due: bool,
    /// Number of refined images published.
    refined: Option<usize>,
    /// Earliest time for the next refined images.
    rested: Instant,
}

impl Publisher {
    pub fn new(audience: Arc<Audience>) -> Publisher {
        audience.state("Reading the show".to_owned());
        Publisher {
            audience,
            kept: Kept::default(),
            is_due: false,
            refined: None,
            rested: Instant::now(),
        }
    }

    /// Records that the show has changed.
    pub fn expire(&mut self) {
        self.is_due = true;
    }

    /// Publishes what is wrong; empty if nothing is.
    pub fn wrong(&self, text: &str) {
        self.audience.wrong(text);
    }

    /// Publishes news, if any.
    pub fn publish(&mut self, engine: &mut Engine) -> Result<(), Error> {
        if engine.estimate().pool().is_none() {
            self.refined = None;
            self.audience.state(first_images(engine));
            return Ok(());
        }
        let refined = Some(engine.estimate().refined());
        let is_rested = Instant::now() >= self.rested;
        if !self.is_due && (self.refined == refined || !is_rested) {
            return Ok(());
        }
        // After a failure, wait for the next edit.
        (self.is_due, self.refined) = (false, refined);
        let begin = Instant::now();
        self.show(engine)?;
        self.audience.state(refined_images(engine));
        self.rested = Instant::now() + REST * begin.elapsed().max(Duration::from_millis(50));
        Ok(())
    }

    fn show(&mut self, engine: &mut Engine) -> Result<(), Error> {
        let tone = engine.tone()?;
        let held: usize = self.kept.images.iter().map(|i| size_of_val(i.data())).sum();
        let banks = engine.bank_images(held)?;
        if self.kept.tone != Some(tone) || self.kept.images != banks {
            self.kept.take(&banks, tone, engine)?;
        }
        self.kept.images = banks;
        let contents = report::page::contents(engine, (&[], &self.kept.images), tone);
        let pictures = self.kept.pictures.clone();
        let data = page::data(&contents, pictures, self.kept.size);
        let data = data.map_err(report::Error::from)?;
        self.audience.show(data, self.kept.files.clone());
        Ok(())
    }
}

impl Kept {
    /// Encodes images; an unchanged file keeps its number, so that no page reads it again.
    fn take(&mut self, images: &[Image], tone: Tone, engine: &Engine) -> Result<(), Error> {
        let all: Vec<&Image> = images.iter().collect();
        let coded = page::fit(&all, tone, page::BUDGET, engine.work());
        let (coded, size) = coded.map_err(report::Error::from)?;
        let before = std::mem::take(&mut self.files);
        let mut file = |bytes: Vec<u8>| {
            let same = before.iter().find(|(_, old)| ***old == bytes);
            let (number, bytes) = match same {
                Some((number, old)) => (*number, Arc::clone(old)),
                None => {
                    self.next += 1;
                    (self.next, Arc::new(bytes))
                }
            };
            self.files.insert(number, bytes);
            format!("picture/{number}")
        };
        let pictures = coded.into_iter().map(|coded| PagePicture {
            law: coded.law,
            codes: file(coded.codes),
            signs: coded.signs.map(&mut file),
        });
        self.pictures = pictures.collect();
        (self.tone, self.size) = (Some(tone), size);
        Ok(())
    }
}

/// Progress of the first images, in words.
fn first_images(engine: &Engine) -> String {
    match engine.status().and_then(|status| status.job) {
        Some(job) if job.task.2 > 0 => {
            let (task, done, total) = job.task;
            format!("Rendering the first pictures: {task}, {done} of {total}")
        }
        _ if engine.is_busy() => "Rendering the first pictures".to_owned(),
        _ => String::new(),
    }
}

/// Quality of the images, in words.
fn refined_images(engine: &Engine) -> String {
    match (
        engine.estimate().refined(),
        engine.estimate().predicted_error(),
    ) {
        (_, Err(_)) => String::new(),
        (0, Ok(_)) if engine.estimate().is_final() => String::new(),
        (0, Ok(error)) => format!("Coarse pictures, predicted error {} %", percent(error)),
        (refined, Ok(error)) => {
            let refined = count(refined, "refined picture");
            format!("{refined}, predicted error {} %", percent(error))
        }
    }
}
