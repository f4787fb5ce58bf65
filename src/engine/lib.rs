//! The engine: a document, a renderer and the pool of images, as typed calls.
//!
//! State is three values. [`Document`]: text, compiled show, undo. [`Engine`]: what is rendered of
//! the document's setup; an edit keeps all of it that the edit does not touch. [`LiveControl`]: the
//! moment, the levels being tried, blind edits. One state machine refines, whether called, in the
//! background or replayed. Nothing here returns prose, reads a command line or knows a terminal;
//! every effect on the outside goes through the [`Host`].

mod background;
mod compile;
mod displayed;
mod document;
mod error;
mod exposure;
mod forecast;
mod host;
mod limit;
mod live;
pub mod measure;
pub mod plan;
mod planning;
pub mod playback;
mod player;
pub mod pool;
mod pooled;
mod refine;
mod refiner;
mod rendering;
mod setup;
mod stage;
mod tasks;
mod ways;

#[cfg(test)]
#[path = "../../tests/kit/planted.rs"]
mod planted;

use std::path::Path;
use std::sync::Arc;

use crate::pool::Pool;
use crate::pool::disk_cache::Note;
use crate::pool::image_cache::{CacheStatistics, ImageCache};
use footlight_host::files::{Stamp, Store};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::lang::edit::Edit;
use footlight_show::model::Show;
use footlight_show::units::{ErrorUnit, Time};
use footlight_transport::contract::check_memory;
use footlight_transport::{self as renderer, Quality, Setup};

pub use self::background::{Ahead, Background, Event, JobStatus, Status};
pub use self::compile::{Compiled, Version};
pub use self::document::{Document, Edited, TEXT_LIMIT, decode, format};
pub use self::error::{Error, TaskFault};
pub use self::forecast::{Forecast, NextImage};
pub use self::host::{Host, POOL_LIMIT, PoolPlace};
pub use self::live::{LiveControl, Moves};
pub use self::player::ManyKeys;
pub use self::pooled::{Freed, PoolSummary, StoreSummary, UnlitBank};
pub use self::refine::{Ended, Goal, RefinementSummary, Step, Warning, WorstMoment};
pub use self::stage::{StageFile, StageMaterial};
pub use self::tasks::{LEASE, Task, TaskList, TaskState, Worked};
pub use self::ways::{Way, WayForecast};
pub use footlight_stage::LampShape;
pub use footlight_stage::texture::Alpha;

pub use self::limit::TimedCall;

/// Events that are kept for the next [`Engine::poll`].
const EVENTS: usize = 64;

/// A document with a renderer and the images made of it.
///
/// ```
/// use footlight_engine::{Engine, Host};
///
/// # fn main() -> Result<(), footlight_engine::Error> {
/// let show = b"show \"S\"\nsurface floor reflectance 0.5 box from -2,-2,-1 to 2,2,0\n\
///     view house from 0,-5,2 to 0,0,0 fov 40 size 32x18\n\
///     light key spot at 0,-2,3 aim 0,0,0 beam 30 field 60 900 cd\nbank front = key\n\
///     cue 1 at 0:00 { snap  front 100 }\n";
/// let mut engine = Engine::from_text("s.lxq", show, Host::default())?;
/// let image = engine.picture(footlight_show::units::Time::ZERO)?;
/// assert!(image.data().iter().any(|light| *light > 0.0));
/// # Ok(())
/// # }
/// ```
pub struct Engine {
    /// With the memory that the document leaves.
    host: Host,
    /// Bytes that the host allows for all.
    memory: usize,
    deadline: Option<Arc<limit::Deadline>>,
    document: Document,
    /// Every image at hand, whether the pool uses it or not.
    image_cache: ImageCache,
    /// Operators and pool of the document's setup; `None` where it has none.
    rendering: Option<rendering::SetupImages>,
    /// What orders the images that are refined; `None`: the best that the images allow.
    /// How images are chosen.
    way: Way,
    background: Option<background::BackgroundRefinement>,
    /// Calls do not wait for what the background renders.
    impatient: bool,
    steps: Vec<Step>,
    /// How long things take here against what the operator predicts.
    pace: forecast::CostScale,
    exposure: exposure::Exposure,
    events: Vec<Event>,
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Engine")
            .field("document", &self.document.name())
            .field("host", &self.host)
            .field("steps", &self.steps)
            .finish_non_exhaustive()
    }
}

impl Engine {
    /// An engine for a show's text; `name` is what diagnostics call it.
    ///
    /// # Errors
    /// As [`Document::new`]; [`Error::OutOfTime`]; on cancel.
    pub fn from_text(name: &str, text: &[u8], host: Host) -> Result<Engine, Error> {
        let begin = host.clock.seconds();
        let document = Document::within(name, text, host.files.as_ref(), host.memory)?;
        Engine::opened(document, host, begin)
    }

    /// An engine for the show in a file, read through the host's store; the stage and other files
    /// that it names are read from [`Host::files`], such as a [`Folder`](footlight_host::files::Folder).
    ///
    /// # Errors
    /// [`Error::File`] when it cannot be read, else as [`Engine::from_text`].
    pub fn open(path: &Path, host: Host) -> Result<Engine, Error> {
        let begin = host.clock.seconds();
        let (store, files) = (host.store.as_ref(), host.files.as_ref());
        let document = Document::open(path, store, files, host.memory)?;
        Engine::opened(document, host, begin)
    }

    /// An engine for a document that was being opened since `begin`.
    fn opened(document: Document, host: Host, begin: f64) -> Result<Engine, Error> {
        let engine = Engine::new(document, host);
        engine.host.work().check()?;
        if let Some(deadline) = &engine.deadline {
            limit::opened(deadline, begin, engine.now())?;
        }
        Ok(engine)
    }

    /// An engine for a document, which must have been read from the host's files.
    pub fn new(mut document: Document, host: Host) -> Engine {
        document.allow(host.memory);
        let (host, deadline) = limit::limited(host);
        let mut engine = Engine {
            memory: host.memory,
            image_cache: host.image_cache(),
            host,
            deadline,
            document,
            rendering: None,
            way: Way::default(),
            background: None,
            impatient: false,
            steps: Vec::new(),
            pace: forecast::CostScale::default(),
            exposure: exposure::Exposure::default(),
            events: Vec::new(),
        };
        engine.leave_memory();
        engine.renew_rendering();
        engine
    }

    /// Leaves to rendering what the document does not hold of the memory.
    fn leave_memory(&mut self) {
        self.host.memory = self.memory.saturating_sub(self.document.loaded_bytes());
    }

    /// The document.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// The model of the show.
    pub fn show(&self) -> &Show {
        self.document.show()
    }

    /// The means that the embedding program gave.
    pub fn host(&self) -> &Host {
        &self.host
    }

    /// Makes an edit. Everything rendered that still means the same is kept.
    ///
    /// # Errors
    /// As [`Document::apply`]; the show is then as it was.
    pub fn edit(&mut self, edit: &Edit) -> Result<Edited, Error> {
        self.change(|document, host| document.apply(edit, host.files.as_ref()))
    }

    /// Takes another text as a whole. Everything rendered that still means the same is kept.
    ///
    /// # Errors
    /// As [`Document::apply`]; the show is then as it was.
    pub fn replace(&mut self, text: &str) -> Result<Edited, Error> {
        self.change(|document, host| document.replace(text, host.files.as_ref()))
    }

    /// Takes the last edit back.
    ///
    /// # Errors
    /// As [`Document::undo`].
    pub fn undo(&mut self) -> Result<Edited, Error> {
        self.change(|document, host| document.undo(host.files.as_ref()))
    }

    /// Makes the edit again that was taken back last.
    ///
    /// # Errors
    /// As [`Document::redo`].
    pub fn redo(&mut self) -> Result<Edited, Error> {
        self.change(|document, host| document.redo(host.files.as_ref()))
    }

    /// Makes images from the view of this name from now on. Images from other views are kept.
    ///
    /// # Errors
    /// [`Error::NoSuchView`]; [`Error::Show`] when a file that the show names has become
    /// unreadable.
    pub fn look_from(&mut self, view: &str) -> Result<Edited, Error> {
        if self.document.view() == Some(view) {
            return Ok(Edited::default());
        }
        self.document.check_view(view)?;
        self.leave_view();
        let looked = self.change(|document, host| document.look_from(view, host.files.as_ref()));
        self.enter_view();
        looked
    }

    /// Brings the text into its canonical layout; false where it had it already.
    ///
    /// # Errors
    /// As [`Document::format`].
    pub fn format(&mut self) -> Result<bool, Error> {
        self.document.format()
    }

    /// Writes the show's text to `path`.
    ///
    /// # Errors
    /// As [`Document::save`].
    pub fn save(&mut self, path: &Path) -> Result<(), Error> {
        self.document.save(path, self.host.store.as_ref())
    }

    fn change(
        &mut self,
        change: impl FnOnce(&mut Document, &Host) -> Result<Edited, Error>,
    ) -> Result<Edited, Error> {
        let edited = change(&mut self.document, &self.host)?;
        self.leave_memory();
        if edited.reread {
            self.tell(Event::FilesReread);
        }
        self.renew_rendering();
        self.drop_useless_job();
        self.exposure.expire();
        if self.refined() == 0 {
            self.steps.clear();
        }
        Ok(edited)
    }

    /// Keeps of what is rendered what the document's setup still means.
    fn renew_rendering(&mut self) {
        let version = self.host.renderer.results_version();
        let old = self.rendering.take();
        let preview = &self.document.show().preview;
        let setup = self.document.setup();
        self.rendering = setup
            .map(|setup| rendering::SetupImages::renew(old, setup, preview, version.as_deref()));
        self.renew_away(version.as_deref());
    }

    /// Calls that need images which the background is still rendering fail from now on with
    /// [`Error::NotYet`], in place of waiting for them: for a program in which somebody types.
    pub fn be_impatient(&mut self) {
        self.impatient = true;
    }

    /// Keeps an event for the next [`Engine::poll`]; the oldest go first when they are not polled.
    fn tell(&mut self, event: Event) {
        if self.events.len() >= EVENTS {
            self.events.remove(0);
        }
        self.events.push(event);
    }

    /// What happened since this or [`Engine::poll`] was called last.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// What cues move, at a time, before the dimmers and as a fraction of full: the level of each
    /// bank, behind that of an rgb bank its three emitters, then one for the fixed lights if there
    /// are any ([`Show::parameters`] names them). Before the show's start it is that of the start, after
    /// its end that of the end ([`Timeline::start`](footlight_show::timeline::Timeline::start),
    /// [`end`](footlight_show::timeline::Timeline::end)).
    pub fn levels(&self, time: Time) -> Vec<f64> {
        self.document.timeline().levels(time)
    }

    /// The light of each coordinate at a time, behind the dimmers and relative to full: what
    /// [`Engine::picture_of`] takes. Times as in [`Engine::levels`].
    pub fn setting(&self, time: Time) -> Vec<f64> {
        self.document.timeline().evaluate(time)
    }

    /// The image of a moment from the pool as it stands; coarse images are rendered first if they
    /// are not there. Times as in [`Engine::levels`]. Linear light, in cd/m² for shows whose lights
    /// are measured; values may lie a little below zero.
    ///
    /// # Errors
    /// [`Error::NoSetup`] when the show has no stage or view, else what rendering says.
    pub fn picture(&mut self, time: Time) -> Result<Image, Error> {
        let setting = self.setting(time);
        self.picture_of(&setting)
    }

    /// The image of a setting, one number for each coordinate, from the pool as it stands.
    ///
    /// # Errors
    /// As [`Engine::picture`]; [`Error::Plan`] for another number of coordinates.
    pub fn picture_of(&mut self, setting: &[f64]) -> Result<Image, Error> {
        self.coarse()?;
        Ok(self.rendered()?.preview(setting, self.work())?)
    }

    /// Renders a setting at a step of quality, without the pool.
    ///
    /// # Errors
    /// [`Error::NoSetup`], else what rendering says.
    pub fn render(&mut self, setting: &[f64], quality: Quality) -> Result<Image, Error> {
        let work = self.host.work();
        let rendering = self.rendering.as_mut().ok_or(Error::NoSetup)?;
        let work = work.holding(self.image_cache.bytes() + rendering.image_bytes());
        let operator = rendering.operator(self.host.renderer.as_ref(), quality, work)?;
        let mut images = operator.render(&[setting.to_vec()], work)?;
        images.pop().ok_or(Error::NoSetup)
    }

    /// The setting of a bank alone at full; `fixed` is all fixed lights together.
    ///
    /// # Errors
    /// [`Error::NoSuchBank`].
    pub fn alone(&self, bank: &str) -> Result<Vec<f64>, Error> {
        let show = self.show();
        let coordinates = show.coordinates();
        let of = |c: &footlight_show::model::Coordinate| {
            let own = c.bank.and_then(|b| show.banks.get(b));
            own.is_some_and(|b| b.name == bank) || c.name == bank
        };
        if !coordinates.iter().any(of) {
            let mut known: Vec<String> = show.banks.iter().map(|b| b.name.clone()).collect();
            known.extend((!show.fixed.is_empty()).then(|| "fixed".to_owned()));
            return Err(Error::NoSuchBank {
                name: bank.to_owned(),
                fixed: show.fixed.iter().any(|f| f.name == bank),
                known,
            });
        }
        Ok(coordinates
            .iter()
            .map(|c| f64::from(u8::from(of(c))))
            .collect())
    }

    /// The image of each coordinate alone at full, as previews have it.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered; on cancel.
    pub fn bank_images(&self) -> Result<Vec<Image>, Error> {
        self.bank_images_beside(0)
    }

    /// The same where the caller holds so many bytes.
    pub fn bank_images_beside(&self, held: usize) -> Result<Vec<Image>, Error> {
        let pool = self.rendered()?;
        let units = Pool::unit_settings(self.show().coordinates().len());
        let mut images = Vec::with_capacity(units.len());
        let work = self.work().holding(held);
        let bytes = units.len() * pool.size().0 * pool.size().1 * size_of::<[f32; 3]>();
        check_memory("a picture of each bank", bytes, work.memory)?;
        for (i, unit) in units.iter().enumerate() {
            work.check()?;
            images.push(pool.preview(unit, work)?);
            self.host.progress.report("banks", i + 1, units.len());
        }
        Ok(images)
    }

    /// The files that the show was read from besides its own, as they are now: another answer says
    /// that one of them was edited.
    pub fn files_now(&self) -> Vec<Stamp> {
        self.host.files.as_is()
    }

    /// What is rendered; `None` where the show has no stage or no view.
    pub fn setup(&self) -> Option<&Setup> {
        self.document.setup()
    }

    /// Coarse and refined images, once there are any.
    pub fn pool(&self) -> Option<&Pool> {
        self.rendering.as_ref().and_then(|r| r.pool.as_ref())
    }

    /// True where the pool is yet to be made, of other images than it has.
    fn is_pool_due(&self) -> bool {
        let base = self.coarse_steps();
        let rendering = self.rendering.as_ref();
        rendering.is_some_and(|r| r.pool.is_none() || r.pool_base != Some(base))
    }

    /// The pool, which must have been rendered.
    pub fn rendered(&self) -> Result<&Pool, Error> {
        if self.rendering.is_none() {
            return Err(Error::NoSetup);
        }
        self.pool().ok_or(Error::NotRendered)
    }

    /// Warnings of the renderer about its images, as far as they are known by now, and what went
    /// wrong with stored images since this was called last.
    pub fn warnings(&mut self) -> (Vec<renderer::Warning>, Vec<Note>) {
        (self.host.renderer.warnings(), self.image_cache.notes())
    }

    /// How the images of this session were obtained so far.
    pub fn statistics(&self) -> CacheStatistics {
        self.image_cache.statistics()
    }

    /// Number of refined images that serve the show.
    pub fn refined(&self) -> usize {
        let least = self.least_refined();
        let rendering = self.rendering.as_ref();
        rendering.map_or(0, |r| r.refined(&self.image_cache, least))
    }

    /// The sequence after each refined image, coarse images alone first.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The two steps of quality at which sources are rendered alone, ascending; equal where one step
    /// is enough. Images of the second serve as coarse ones; their difference from the first
    /// estimates the error. What the show asks for unless another step was the cheaper way.
    pub fn coarse_steps(&self) -> [Quality; 2] {
        let chosen = self.rendering.as_ref().and_then(|r| r.base);
        chosen.unwrap_or_else(|| self.coarse_pair())
    }

    /// The two steps of quality that the show asks for.
    pub fn coarse_pair(&self) -> [Quality; 2] {
        self.coarse_pair_at(self.show().preview.coarse)
    }

    /// The step `coarse`, clamped to the scale, and the next finer one where only the difference of two
    /// shows their error: the operator states none, or its images have noise.
    fn coarse_pair_at(&self, coarse: u8) -> [Quality; 2] {
        let finest = self.finest().0;
        let cheap = coarse.clamp(1, finest);
        let is_stated = self.stated(Quality(cheap), ErrorUnit::Light).is_some();
        let is_pair = !is_stated || self.samples(Quality(cheap)).is_some();
        [cheap, cheap.saturating_add(u8::from(is_pair)).min(finest)].map(Quality)
    }

    /// The finest step of the scale that the show's lights are rendered on.
    pub fn finest(&self) -> Quality {
        let renderer = self.host.renderer.as_ref();
        let rendering = self.rendering.as_ref();
        rendering.map_or_else(|| renderer.finest(), |r| r.finest(renderer))
    }

    /// The step of quality of refined images: what the show asks for, or a finer one where the
    /// difference of two coarse steps estimates errors. An image at one of these two would say nothing
    /// of their error.
    pub fn refined_step(&self) -> Quality {
        let preview = &self.show().preview;
        self.refined_step_at(preview.coarse, preview.refined)
    }

    fn refined_step_at(&self, coarse: u8, refined: u8) -> Quality {
        let [cheap, fine] = self.coarse_pair_at(coarse);
        let least = fine.0.saturating_add(u8::from(cheap < fine));
        Quality(refined.max(least).min(self.finest().0))
    }

    /// The least step of quality of refined images that serve.
    fn least_refined(&self) -> Quality {
        self.refined_step().max(self.coarse_steps()[1])
    }

    /// True when the first images are as good as any: the scale has one step, so that nothing is
    /// left to refine. So it is where every bank is an image.
    pub fn is_final(&self) -> bool {
        self.rendering.is_some() && self.finest() == Quality(1)
    }

    /// The host's means, with the memory that images and operators leave, and those images that
    /// are made of others for a while.
    pub fn work(&self) -> Work<'_> {
        let rendering = self.rendering.as_ref();
        let operators = rendering.map_or(0, |r| r.operator_bytes());
        let images = rendering.map_or(0, |r| r.image_bytes()) + self.image_cache.bytes();
        let working = rendering.map_or(0, |r| r.working_bytes());
        self.host.work().holding(operators + images + working)
    }

    /// Seconds of the host's clock.
    pub fn now(&self) -> f64 {
        self.host.clock.seconds()
    }

    /// Where files are written.
    pub fn store(&self) -> &dyn Store {
        self.host.store.as_ref()
    }

    /// A call within the host's limit of time; it ends when it is dropped.
    pub fn begin_call(&self) -> TimedCall {
        TimedCall::begin(self.deadline.as_ref(), self.now())
    }

    /// Does something within the limit of time, if there is one.
    fn timed<T>(
        &mut self,
        something: impl FnOnce(&mut Engine) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let call = self.begin_call();
        let done = something(self);
        call.outcome(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An engine can be moved to another thread, and so can all that a host gives.
    #[test]
    fn an_engine_is_send() {
        fn is_send<T: Send>() {}
        is_send::<Engine>();
        is_send::<Host>();
        is_send::<Document>();
        is_send::<LiveControl>();
    }
}
