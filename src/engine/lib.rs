//! Documents, images, plan, refinement and playback, as typed calls.
//!
//! ```text
//! text --> Document --> setup of each view --transport--> Images --> Playback, Player --> frames
//!                                             ^       |
//!                             Refinement -----+       +--> Estimate: errors, plan, ways
//! ```
//!
//! The state is a few values, each the only owner of its content:
//!
//! - [`Document`]: the text, everything that follows from it, and its history. It renders nothing.
//! - [`Images`]: the rendered images of every view in use. An edit keeps what it does not affect.
//! - [`Refinement`]: a goal, a method and a view. One state machine executes it, blocking, in the
//!   background or as tasks for a farm ([`TaskList`]).
//! - [`Player`](playback::Player): key images ready to show, independent of the other values.
//! - [`LiveControl`]: the current moment, trial levels, blind edits.
//!
//! [`Engine`] combines a document, its images, the background refinement and the [`Host`]; its
//! methods delegate to them. Everything that needs no rendering is a function of values:
//! [`Engine::estimate`], [`plan`], [`pool`], [`measure`]. [`solve`] finds levels for a target
//! image.
//!
//! Invariants: a failing call changes nothing, except that images finished before are kept; equal
//! shows give equal images on any number of threads; every outside effect goes through the host.
//! This crate must not contain messages for people, command lines or terminals.

mod background;
mod compile;
mod displayed;
mod document;
mod error;
mod estimate;
mod exposure;
mod forecast;
mod goal;
mod heads;
mod host;
mod images;
mod live;
mod means;
pub mod measure;
mod pace;
pub mod plan;
mod planning;
pub mod playback;
mod player;
pub mod pool;
mod pooled;
mod prediction;
mod refine;
mod refiner;
mod rendering;
mod setup;
pub mod solve;
mod speed_accuracy;
mod stage;
mod stepped;
mod tasks;
mod ways;

#[cfg(test)]
#[path = "../../tests/kit/planted.rs"]
mod planted;

use std::path::Path;

use crate::pool::Pool;
use crate::pool::disk_cache::Note;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::lang::edit::Edit;
use footlight_show::model::{Coordinate, Pose, Show};
use footlight_show::units::Time;
use footlight_transport::contract::check_memory;
use footlight_transport::{Quality, TransportWarning};

pub use self::background::{Event, JobStatus, Status};
pub use self::compile::{Compiled, Version};
pub use self::document::{Document, Edited, TEXT_LIMIT, decode, format};
pub use self::error::{Error, TaskFault};
pub use self::estimate::Estimate;
pub use self::goal::{
    Ended, Goal, Refinement, RefinementSummary, SequenceState, TooLarge, Way, WorstMoment,
};
pub use self::heads::{Heads, frame};
pub use self::host::{Background, Host, POOL_LIMIT, PoolPlace};
pub use self::images::Images;
pub use self::live::{LiveControl, Moves};
pub use self::pooled::{Freed, PoolSummary, StoreSummary, UnlitBank};
pub use self::speed_accuracy::{SpeedAccuracy, SpeedPoint};
pub use self::stage::{StageFile, StageMaterial};
pub use self::stepped::stepped;
pub use self::tasks::{LEASE, Task, TaskList, TaskState, Worked};
pub use self::ways::WayForecast;

use self::images::ViewName;
use self::means::Means;

/// Most events kept for the next [`Engine::poll`].
const EVENTS: usize = 64;

/// A document with a renderer and its images.
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
    /// With the memory that the document leaves free.
    host: Host,
    /// The host's memory limit, bytes.
    memory: usize,
    document: Document,
    images: Images,
    background: Option<background::BackgroundRefinement>,
    exposure: exposure::Exposure,
    events: Vec<Event>,
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Engine")
            .field("document", &self.document.name())
            .field("host", &self.host)
            .field("images", &self.images)
            .finish_non_exhaustive()
    }
}

impl Engine {
    /// Creates an engine for a show's text; `name` appears in diagnostics.
    ///
    /// # Errors
    /// As [`Document::new`]; on cancel.
    pub fn from_text(name: &str, text: &[u8], host: Host) -> Result<Engine, Error> {
        let document = Document::within(name, text, host.files.as_ref(), host.memory)?;
        Engine::opened(document, host)
    }

    /// Opens the show in a file, read through the host's store; the stage and other files that it
    /// names are read from [`Host::files`], such as a [`Folder`](footlight_host::files::Folder).
    ///
    /// # Errors
    /// [`Error::File`] when it cannot be read, else as [`Engine::from_text`].
    pub fn open(path: &Path, host: Host) -> Result<Engine, Error> {
        let (store, files) = (host.store.as_ref(), host.files.as_ref());
        let document = Document::open(path, store, files, host.memory)?;
        Engine::opened(document, host)
    }

    /// Creates an engine unless the host cancels.
    fn opened(document: Document, host: Host) -> Result<Engine, Error> {
        let engine = Engine::new(document, host);
        engine.host.work().check()?;
        Ok(engine)
    }

    /// Creates an engine for a document read from the host's files.
    pub fn new(mut document: Document, host: Host) -> Engine {
        document.allow(host.memory);
        let mut engine = Engine {
            memory: host.memory,
            images: Images::new(&host),
            host,
            document,
            background: None,
            exposure: exposure::Exposure::default(),
            events: Vec::new(),
        };
        engine.leave_memory();
        engine.renew_images();
        engine
    }

    /// Gives the memory that the document leaves free to rendering.
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

    /// The host.
    pub fn host(&self) -> &Host {
        &self.host
    }

    /// Applies an edit. Images that are still valid are kept.
    ///
    /// # Errors
    /// As [`Document::apply`]; the show is then unchanged.
    pub fn edit(&mut self, edit: &Edit) -> Result<Edited, Error> {
        self.change(|document, host| document.apply(edit, host.files.as_ref()))
    }

    /// Replaces the whole text. Images that are still valid are kept.
    ///
    /// # Errors
    /// As [`Document::apply`]; the show is then unchanged.
    pub fn replace(&mut self, text: &str) -> Result<Edited, Error> {
        self.change(|document, host| document.replace(text, host.files.as_ref()))
    }

    /// Reverts the last edit.
    ///
    /// # Errors
    /// As [`Document::undo`].
    pub fn undo(&mut self) -> Result<Edited, Error> {
        self.change(|document, host| document.undo(host.files.as_ref()))
    }

    /// Applies the last reverted edit again.
    ///
    /// # Errors
    /// As [`Document::redo`].
    pub fn redo(&mut self) -> Result<Edited, Error> {
        self.change(|document, host| document.redo(host.files.as_ref()))
    }

    /// Makes the view of this name current. Images from other views are kept.
    ///
    /// # Errors
    /// [`Error::NoSuchView`]; [`Error::Show`] when a file that the show names has become
    /// unreadable.
    pub fn look_from(&mut self, view: &str) -> Result<Edited, Error> {
        if self.document.view() == Some(view) {
            return Ok(Edited::default());
        }
        self.document.check_view(view)?;
        self.change(|document, host| document.look_from(view, host.files.as_ref()))
    }

    /// Formats the text in its canonical layout; false if nothing changed.
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
        self.renew_images();
        self.drop_useless_job();
        self.exposure.expire();
        if self.estimate().refined() == 0
            && let Ok((_, of_view)) = self.images.split(&self.looked_from().view)
        {
            of_view.steps.clear();
        }
        Ok(edited)
    }

    /// Keeps the images that are still valid for the document.
    fn renew_images(&mut self) {
        self.renew_images_and(None);
    }

    /// Like [`Engine::renew_images`], for one more view.
    fn renew_images_and(&mut self, more: Option<&ViewName>) {
        let refined = self.background.as_ref().map(|b| b.view());
        let others = refined.into_iter().chain(more);
        self.images.renew(&self.document, &self.host, others);
    }

    /// Sets the view of a refinement and makes its images available.
    fn seen(&mut self, mut wanted: Refinement) -> Result<Refinement, Error> {
        match &wanted.view {
            None => wanted.view = self.looked_from().view,
            Some(view) => {
                self.document.check_view(view)?;
                self.renew_images_and(Some(&wanted.view));
            }
        }
        Ok(wanted)
    }

    /// A refinement of the current view.
    fn looked_from(&self) -> Refinement {
        Refinement {
            view: self.document.view().map(str::to_owned),
            ..Refinement::default()
        }
    }

    /// Estimates for the current view: errors, plan, methods.
    pub fn estimate(&self) -> Estimate<'_> {
        self.estimate_of(&self.looked_from())
    }

    /// Estimates for a refinement, with its own view and method.
    fn estimate_of(&self, wanted: &Refinement) -> Estimate<'_> {
        Estimate::new(&self.document, &self.host, &self.images, wanted)
    }

    /// Measures the operator's speed by its own small task, unless a rendering has shown it.
    /// Forecasts are then in seconds of this machine.
    ///
    /// # Errors
    /// [`Error::NoSetup`], or an error of rendering.
    pub fn calibrate(&mut self) -> Result<(), Error> {
        let wanted = self.looked_from();
        self.means().calibrate(&wanted)
    }

    /// The methods for the goal of a refinement from the existing images, the chosen one first;
    /// empty when they cannot be compared before there are coarse images, or nothing is left to
    /// render.
    ///
    /// # Errors
    /// [`Error::NoSetup`], or an error of rendering.
    pub fn ways(&mut self, wanted: impl Into<Refinement>) -> Result<Vec<WayForecast>, Error> {
        let wanted = self.seen(wanted.into())?;
        self.means().calibrate(&wanted)?;
        self.estimate_of(&wanted).ways(&wanted.goal)
    }

    fn means(&mut self) -> Means<'_> {
        Means {
            document: &self.document,
            host: &self.host,
            images: &mut self.images,
        }
    }

    /// Keeps an event for the next [`Engine::poll`]; without polls, the oldest are dropped.
    fn tell(&mut self, event: Event) {
        if self.events.len() >= EVENTS {
            self.events.remove(0);
        }
        self.events.push(event);
    }

    /// The image of a moment from the current pool; missing coarse images are rendered first. Times
    /// as in [`Document::levels`]. Linear light, in cd/m² for shows whose lights are measured; values
    /// may lie a little below zero.
    ///
    /// # Errors
    /// [`Error::NoSetup`] when the show has no stage or view, or an error of rendering.
    pub fn picture(&mut self, time: Time) -> Result<Image, Error> {
        let document = &self.document;
        let (setting, poses) = (document.setting(time), document.timeline().poses(time));
        self.picture_with(&setting, &poses)
    }

    /// The image of a setting, one number for each coordinate, from the current pool, with heads in
    /// these poses.
    ///
    /// # Errors
    /// As [`Engine::picture`]; [`Error::Plan`] for a wrong number of coordinates.
    pub fn picture_with(&mut self, setting: &[f64], poses: &[Pose]) -> Result<Image, Error> {
        self.coarse()?;
        let image = self.estimate().rendered()?.preview(setting, self.work())?;
        self.with_heads(image, setting, poses)
    }

    /// The heads of the show in the current view; `None` without heads, and before any image is
    /// rendered.
    pub fn heads(&self) -> Option<Heads> {
        self.images.heads(&self.document)
    }

    /// Adds the direct light of the heads to an image.
    fn with_heads(
        &mut self,
        mut image: Image,
        setting: &[f64],
        poses: &[Pose],
    ) -> Result<Image, Error> {
        self.images.find_heads(&self.document, self.host.work())?;
        if let Some(heads) = self.images.heads(&self.document) {
            heads.add(setting, poses, &mut image, self.host.work())?;
        }
        Ok(image)
    }

    /// Renders a setting at a quality step, without the pool, with heads at home.
    ///
    /// # Errors
    /// [`Error::NoSetup`], or an error of rendering.
    pub fn render(&mut self, setting: &[f64], quality: Quality) -> Result<Image, Error> {
        self.render_with(setting, &self.document.home(), quality)
    }

    /// Like [`Engine::render`], with heads in these poses.
    ///
    /// # Errors
    /// As [`Engine::render`].
    pub fn render_with(
        &mut self,
        setting: &[f64],
        poses: &[Pose],
        quality: Quality,
    ) -> Result<Image, Error> {
        let view = self.looked_from().view;
        let (cache, of_view) = self.images.split(&view)?;
        let rendering = &mut of_view.rendering;
        let work = self.host.work();
        let work = work.holding(cache.bytes() + rendering.image_bytes());
        let operator = rendering.operator(self.host.renderer.as_ref(), quality, work)?;
        let mut images = operator.render(&[setting.to_vec()], work)?;
        let image = images.pop().ok_or(Error::NoSetup)?;
        self.with_heads(image, setting, poses)
    }

    /// The image of each coordinate alone at full, as in previews, with heads as they first shine;
    /// `held` bytes of the caller count against the memory.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered; on cancel.
    pub fn bank_images(&self, held: usize) -> Result<Vec<Image>, Error> {
        let pool = self.estimate().rendered()?;
        let count = self.show().coordinates().len();
        let work = self.work().holding(held);
        let bytes = count * pool.size().0 * pool.size().1 * size_of::<[f32; 3]>();
        check_memory("a picture of each bank", bytes, work.memory)?;
        let mut images = Vec::with_capacity(count);
        let document = &self.document;
        let poses = |coordinate: &Coordinate| {
            let lit = coordinate.bank.and_then(|bank| document.first_lit(bank));
            lit.map_or_else(|| document.home(), |time| document.timeline().poses(time))
        };
        self.each_bank(poses, work, |image| images.push(image))?;
        Ok(images)
    }

    /// Makes the image of each coordinate alone at full, with heads in its poses.
    fn each_bank(
        &self,
        poses: impl Fn(&Coordinate) -> Vec<Pose>,
        work: Work<'_>,
        mut each: impl FnMut(Image),
    ) -> Result<(), Error> {
        let (pool, heads) = (self.estimate().rendered()?, self.heads());
        let coordinates = self.show().coordinates();
        let units = Pool::unit_settings(coordinates.len());
        for (i, (unit, coordinate)) in units.iter().zip(&coordinates).enumerate() {
            work.check()?;
            let poses = poses(coordinate);
            let setting = self.document.timeline().with_bounced(unit, &poses);
            each(frame((pool, heads.as_ref()), &setting, &poses, work)?);
            self.host.progress.report("banks", i + 1, units.len());
        }
        Ok(())
    }

    /// The rendered images.
    pub fn images(&self) -> &Images {
        &self.images
    }

    /// Warnings of the renderer so far, and faults of stored images since the last call.
    pub fn warnings(&mut self) -> (Vec<TransportWarning>, Vec<Note>) {
        (self.host.renderer.warnings(), self.images.notes())
    }

    /// The host's resources, minus the memory of images and operators, except images that can be
    /// derived from others.
    pub fn work(&self) -> Work<'_> {
        self.images.work(&self.host)
    }

    /// Seconds of the host's clock.
    fn now(&self) -> f64 {
        self.host.clock.seconds()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An engine can move to another thread with its host.
    #[test]
    fn an_engine_is_send() {
        fn is_send<T: Send>() {}
        is_send::<Engine>();
        is_send::<Host>();
        is_send::<Document>();
        is_send::<LiveControl>();
    }
}
