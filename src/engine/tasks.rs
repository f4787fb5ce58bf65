//! Render tasks: idempotent, one image each. This module lists the tasks of a goal, works on one of
//! them, and reports the state of all.
//!
//! A task is an address in the pool. A worker claims it first, so that many workers on one folder
//! render different images. If claims fail nothing is lost: images of one address are equal, and
//! the first one stored stays. Workers only add images; listing tasks makes room for them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::error::TaskFault;
use super::estimate::Estimate;
use super::goal::Refinement;
use super::refiner::{Next, Refiner};
use super::rendering::each_step;
use super::ways::Extent;
use super::{Engine, Error};
use crate::pool::address::Digest;
use crate::pool::disk_cache::{names, pictures_of};
use crate::pool::image_cache::Wanted;
use footlight_host::files::claim::{self, Claim, Claimed, Holder};
use footlight_host::files::{FileError, Store};
use footlight_host::work::{Progress, Work};
use footlight_picture::Image;
use footlight_transport::{self as renderer, Quality};

/// Version of the list's format.
const SCHEMA: u32 = 0;

/// Default lease of a claim without renewal: longer than network file systems cache a file.
pub const LEASE: Duration = Duration::from_secs(60);

/// Reason to refuse a folder of the pool: a link in a downloaded show may lead anywhere.
const LINK: &str = "a link";

/// Approximate bytes of a file beyond its pixels.
const HEADER: u64 = 4096;

/// Most bytes read of a failure's reason.
const REASON: u64 = 4096;

/// Tasks of a show, for any process that has its files and can write to its pool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskList {
    /// Version of the format.
    pub schema: u32,
    /// The show's file. This path and the pool's are relative to the list's folder, unless
    /// absolute.
    pub show: PathBuf,
    /// The view, if the show has several.
    pub view: Option<String>,
    /// The folder for the images.
    pub pool: PathBuf,
    /// Name and version of the operator.
    pub operator: String,
    /// Key of operator, scene and view.
    pub scene: String,
    /// Width and height.
    pub size: [usize; 2],
    /// Names of a setting's numbers.
    pub coordinates: Vec<String>,
    /// Tasks, the most useful first.
    pub tasks: Vec<Task>,
}

/// One image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Its number in the list, from 1.
    pub task: usize,
    /// Its file name in the scene's folder, without `.exr`.
    pub picture: String,
    /// Quality step.
    pub quality: u8,
    /// One number for each coordinate, as text that preserves the bits in every program.
    #[serde(with = "exact")]
    pub setting: Vec<f64>,
    /// Its index among the refined images of the plan; `None` for a single source.
    pub order: Option<usize>,
    /// Seed for a renderer that uses random numbers.
    pub seed: u32,
    /// Predicted seconds on the machine that listed it, for a worker with this task alone; `None`
    /// if unknown.
    pub seconds: Option<f64>,
}

/// Numbers as text, separated by blanks.
mod exact {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(numbers: &[f64], to: S) -> Result<S::Ok, S::Error> {
        let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
        to.serialize_str(&words.join(" "))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        let text = String::deserialize(from)?;
        let numbers = text.split_whitespace().map(str::parse);
        numbers.collect::<Result<_, _>>().map_err(D::Error::custom)
    }
}

/// Result of work on a task.
#[derive(Debug, PartialEq)]
pub enum Worked {
    /// It was rendered, in this many seconds.
    Rendered(f64),
    /// Its image exists.
    There,
    /// Another worker has claimed it.
    Claimed(Holder),
}

/// State of a task.
#[derive(Clone, Debug, PartialEq)]
pub enum TaskState {
    /// Its image exists.
    There,
    /// A worker has claimed it; a stale claim counts as none.
    Claimed(Holder),
    /// Rendering failed, for this reason.
    Failed(String),
    /// No worker has begun it.
    Free,
}

impl TaskList {
    /// Checks a list after reading.
    ///
    /// # Errors
    /// The fault.
    pub fn check(&self) -> Result<(), TaskFault> {
        if self.schema != SCHEMA {
            return Err(TaskFault::Schema(self.schema, SCHEMA));
        }
        if Digest::parse(&self.scene).is_none() {
            return Err(TaskFault::Scene);
        }
        for (task, number) in self.tasks.iter().zip(1..) {
            if task.task != number {
                return Err(TaskFault::Number(number));
            }
            let parts = task.picture.split_once('-');
            let is_named = |(q, key): (&str, &str)| {
                q == task.quality.to_string() && Digest::parse(key).is_some()
            };
            if !parts.is_some_and(is_named) {
                return Err(TaskFault::Picture(number));
            }
            let is_finite = task.setting.iter().all(|x| x.is_finite());
            if !is_finite || task.setting.len() != self.coordinates.len() {
                return Err(TaskFault::Setting(number));
            }
        }
        Ok(())
    }

    /// State of each task, without opening the show. A claim that does not state its lease holds
    /// for `lease`.
    ///
    /// # Errors
    /// [`Error::File`] when the pool cannot be read.
    pub fn states(&self, store: &dyn Store, lease: Duration) -> Result<Vec<TaskState>, Error> {
        let there = pictures_of(store, &self.pool, &self.scene)?;
        let folder = claims(&self.pool);
        let is_done = self.tasks.iter().all(|t| there.contains(&t.picture));
        let holders = if is_done {
            BTreeMap::new()
        } else {
            claim::holders(&folder, lease)?
        };
        let state = |task: &Task| {
            if there.contains(&task.picture) {
                return TaskState::There;
            }
            let name = self.claim_name(task);
            if let Some(holder) = holders.get(&name) {
                return TaskState::Claimed(holder.clone());
            }
            match store.read(&failure(&folder, &name), REASON) {
                Ok(said) => TaskState::Failed(String::from_utf8_lossy(&said).trim().to_owned()),
                Err(_) => TaskState::Free,
            }
        };
        Ok(self.tasks.iter().map(state).collect())
    }

    fn claim_name(&self, task: &Task) -> String {
        [&self.scene, "-", &task.picture].concat()
    }
}

/// Folder of a pool's claims.
fn claims(pool: &Path) -> PathBuf {
    pool.join("claims")
}

/// Path of the reason of a failed rendering.
fn failure(claims: &Path, name: &str) -> PathBuf {
    claims.join([name, ".failed"].concat())
}

/// Progress that renews a claim: every loop of the operator polls it for cancellation.
struct Renewing<'a> {
    progress: &'a dyn Progress,
    claim: &'a Claim,
}

impl Progress for Renewing<'_> {
    fn report(&self, task: &str, done: usize, total: usize) {
        self.progress.report(task, done, total);
    }

    fn cancelled(&self) -> bool {
        self.claim.renew();
        self.progress.cancelled()
    }
}

impl TaskList {
    /// The next images that a refinement needs and that do not exist: those of single sources, or,
    /// once these exist, mixtures in the order of the plan. The list is empty once the goal is met
    /// as far as is known. Old images in the pool's folder are removed to make room.
    ///
    /// # Errors
    /// [`Error::NoVersion`] and [`Error::NoPool`] when images cannot be shared;
    /// [`Error::PoolLimit`]; [`Error::Busy`]; or an error of planning.
    pub fn of(engine: &mut Engine, wanted: impl Into<Refinement>) -> Result<TaskList, Error> {
        engine.idle()?;
        let wanted = engine.seen(wanted.into())?;
        let mut list = empty_list(engine, &wanted)?;
        engine.means().calibrate(&wanted)?;
        list.tasks = missing_images(engine, &wanted)?;
        for (task, number) in list.tasks.iter_mut().zip(1..) {
            task.task = number;
        }
        list.make_room(engine, &wanted)?;
        Ok(list)
    }

    /// Removes old images of the pool's folder, so that those of the list fit.
    fn make_room(&self, engine: &mut Engine, wanted: &Refinement) -> Result<(), Error> {
        let [width, height] = self.size;
        let bytes = (width as u64 * height as u64 * 12 + HEADER) * self.tasks.len() as u64;
        let store = engine.host.store.as_ref();
        let (cache, of_view) = engine.images.split(&wanted.view)?;
        let disk_cache = cache.disk_cache.as_mut().ok_or(Error::NoPool)?;
        let own = disk_cache.stored(store).into_iter();
        let own = own.filter(|stored| of_view.rendering.is_of_scene(stored.scene_key));
        let needed = bytes + own.map(|stored| stored.bytes).sum::<u64>();
        let limit = disk_cache.limit;
        if needed > limit {
            return Err(Error::PoolLimit { needed, limit });
        }
        Ok(disk_cache.make_room(store, bytes)?)
    }

    /// Refuses a list for another scene, view or operator. The lights of each task are compared
    /// before it is rendered.
    ///
    /// # Errors
    /// [`Error::OtherTasks`].
    pub fn check_for(&self, engine: &Engine) -> Result<(), Error> {
        let estimate = engine.estimate();
        let rendering = estimate.rendering()?;
        let version = engine.host.renderer.results_version();
        let here = version.ok_or(Error::NoVersion)?;
        if here != self.operator {
            return Err(Error::OtherTasks {
                what: "renderer",
                listed: self.operator.clone(),
                here,
            });
        }
        let here = rendering.scene_key().ok_or(Error::NoVersion)?.0.to_string();
        if here != self.scene {
            return Err(Error::OtherTasks {
                what: "scene or view",
                listed: self.scene.clone(),
                here,
            });
        }
        let (listed, here) = (self.coordinates.len(), rendering.sources());
        if listed == here {
            Ok(())
        } else {
            Err(Error::OtherTasks {
                what: "number of sources",
                listed: listed.to_string(),
                here: here.to_string(),
            })
        }
    }

    /// Renders a task of a checked list, unless its image exists or another worker has claimed it.
    /// The claim holds for `lease` without renewal. A failure is recorded for `TaskList::states`.
    ///
    /// # Errors
    /// [`Error::NotStored`] when the image could not be written; [`Error::File`] when nothing can
    /// be claimed; an error of rendering; on cancel.
    pub fn work_on(
        &self,
        engine: &mut Engine,
        task: &Task,
        lease: Duration,
    ) -> Result<Worked, Error> {
        let wanted = check_task(engine, task)?;
        if is_stored(engine, &wanted) {
            return Ok(Worked::There);
        }
        let name = self.claim_name(task);
        let claim = match claim_of(engine, &name, lease)? {
            Claimed::Ours(claim) => claim,
            Claimed::By(holder) => return Ok(Worked::Claimed(holder)),
        };
        // Another worker may have stored it just before the claim.
        if is_stored(engine, &wanted) {
            return Ok(Worked::There);
        }
        let begin = engine.now();
        let done = render_task(engine, &wanted, task, &claim);
        write_down(engine, &name, done.as_ref().err())?;
        done.map(|()| Worked::Rendered(engine.now() - begin))
    }
}

/// A list of this show without tasks.
fn empty_list(engine: &Engine, wanted: &Refinement) -> Result<TaskList, Error> {
    let estimate = engine.estimate_of(wanted);
    let rendering = estimate.rendering()?;
    let scene = rendering.scene_key().ok_or(Error::NoVersion)?;
    let version = engine.host.renderer.results_version();
    let view = &rendering.setup.view;
    let sources = rendering.setup.rig.sources.iter();
    Ok(TaskList {
        schema: SCHEMA,
        show: engine.document.path().ok_or(Error::NoFile)?.to_owned(),
        view: wanted.view.clone(),
        pool: pool_folder(engine)?.to_owned(),
        operator: version.ok_or(Error::NoVersion)?,
        scene: scene.0.to_string(),
        size: [view.width, view.height],
        coordinates: sources.map(|source| source.name.clone()).collect(),
        tasks: Vec::new(),
    })
}

fn pool_folder(engine: &Engine) -> Result<&Path, Error> {
    let disk_cache = engine.images.cache.disk_cache.as_ref();
    Ok(&disk_cache.ok_or(Error::NoPool)?.folder)
}

/// Missing images of single sources for the pool.
fn missing_units(estimate: Estimate<'_>) -> Result<Vec<Task>, Error> {
    let rendering = estimate.rendering()?;
    let (mut out, mut seen) = (Vec::new(), BTreeSet::new());
    let units = rendering.units();
    for quality in each_step(estimate.coarse_steps()) {
        let there = rendering.at_hand(
            &estimate.images.cache,
            quality,
            &units,
            estimate.host.store.as_ref(),
        );
        let missing = units.iter().zip(there).filter(|(_, there)| !there);
        for (unit, _) in missing {
            let wanted = wanted_of(estimate, quality, unit, None)?;
            let task = task_of(estimate, &wanted, unit)?;
            // Two sources may be lit alike.
            out.extend(seen.insert(task.picture.clone()).then_some(task));
        }
    }
    Ok(out)
}

/// The next images for a goal. Newly stored ones are added first.
fn missing_images(engine: &mut Engine, wanted: &Refinement) -> Result<Vec<Task>, Error> {
    if engine.estimate_of(wanted).pool().is_some() {
        engine.means().reuse_refined(wanted)?;
    }
    let mut refiner = Refiner::new(wanted.clone(), Extent::AtOnce, engine.now());
    loop {
        match refiner.advance(&mut engine.means())? {
            Next::Ended(_) => return Ok(Vec::new()),
            // A list is made without measuring.
            Next::Added | Next::Measure(_) => {}
            Next::Render(job, ticket) => {
                refiner.abandon(&mut engine.means(), &ticket);
                let estimate = engine.estimate_of(wanted);
                if !ticket.refined {
                    return missing_units(estimate);
                }
                let pairs = ticket.wanted().iter().zip(&job.settings);
                return pairs
                    .map(|(wanted, s)| task_of(estimate, wanted, s))
                    .collect();
            }
        }
    }
}

fn task_of(estimate: Estimate<'_>, wanted: &Wanted, setting: &[f64]) -> Result<Task, Error> {
    let quality = wanted.address.quality;
    let [_, picture] = names(wanted.address.name());
    let cost = estimate.cost(quality)?;
    let lit = setting.iter().filter(|s| **s != 0.0).count();
    let image = if lit > 1 {
        cost.per_image
    } else {
        cost.per_lone
    };
    let seconds =
        estimate.images.pace.seconds() * (cost.prepare + lit as f64 * cost.per_source + image);
    Ok(Task {
        task: 0,
        picture,
        quality: quality.0,
        setting: setting.to_vec(),
        order: wanted.refined.as_ref().map(|place| place.order),
        seed: renderer::seed(setting, quality),
        seconds: Some(seconds).filter(|s| *s > 0.0),
    })
}

fn wanted_of(
    estimate: Estimate<'_>,
    quality: Quality,
    setting: &[f64],
    order: Option<usize>,
) -> Result<Wanted, Error> {
    let rendering = estimate.rendering()?;
    let key = rendering.scene_key().ok_or(Error::NoVersion)?;
    let all = rendering.wanted(key, quality, &[setting.to_vec()], order);
    all.into_iter().next().ok_or(Error::NoSetup)
}

/// Checks a task's name against the lights of its setting, and returns its image.
fn check_task(engine: &Engine, task: &Task) -> Result<Wanted, Error> {
    let wanted = wanted_of(
        engine.estimate(),
        Quality(task.quality),
        &task.setting,
        task.order,
    )?;
    let [_, here] = names(wanted.address.name());
    if here == task.picture {
        Ok(wanted)
    } else {
        Err(Error::OtherTasks {
            what: "light",
            listed: task.picture.clone(),
            here,
        })
    }
}

fn claim_of(engine: &Engine, name: &str, lease: Duration) -> Result<Claimed, Error> {
    let folder = claims(pool_folder(engine)?);
    if engine.host.store.is_link(&folder) {
        let path = folder.display().to_string();
        return Err(FileError::NotAFile { path, kind: LINK }.into());
    }
    Ok(claim::claim(&folder, name, lease)?)
}

/// Records why a task failed, or deletes the record.
fn write_down(engine: &Engine, name: &str, error: Option<&Error>) -> Result<(), Error> {
    let path = failure(&claims(pool_folder(engine)?), name);
    match error {
        None => engine.host.store.remove(&path)?,
        // A farm that stops a worker may end its renderer first.
        Some(error) if error.is_cancel() || engine.host.progress.cancelled() => {}
        Some(error) => {
            let said = [claim::host(), ": ".to_owned(), error.to_string()].concat();
            // If this fails too, the error itself is still returned.
            let _ = engine.host.store.write(&path, said.as_bytes());
        }
    }
    Ok(())
}

fn is_stored(engine: &Engine, wanted: &Wanted) -> bool {
    let disk_cache = engine.images.cache.disk_cache.as_ref();
    disk_cache.is_some_and(|cache| cache.has(engine.host.store.as_ref(), wanted.address.name()))
}

fn render_task(
    engine: &mut Engine,
    wanted: &Wanted,
    task: &Task,
    claim: &Claim,
) -> Result<(), Error> {
    let quality = Quality(task.quality);
    let memory = engine.work().memory;
    let view = engine.looked_from().view;
    let rendering = engine.images.rendering(&view)?;
    let job = rendering.new_job(quality, vec![task.setting.clone()], memory);
    let renewing = Renewing {
        progress: engine.host.progress.as_ref(),
        claim,
    };
    let work = Work {
        progress: &renewing,
        threads: engine.host.threads,
        memory,
    };
    let rendered = job.run(engine.host.renderer.as_ref(), work);
    let rendering = engine.images.rendering(&view)?;
    rendering.return_operator(quality, rendered.operator);
    for image in rendered.images? {
        put(engine, wanted, &image)?;
    }
    Ok(())
}

/// Stores an image without keeping it in memory.
fn put(engine: &mut Engine, wanted: &Wanted, image: &Image) -> Result<(), Error> {
    let store = engine.host.store.as_ref();
    let disk_cache = engine.images.cache.disk_cache.as_mut();
    let disk_cache = disk_cache.ok_or(Error::NoPool)?;
    disk_cache.share();
    let about = (wanted.words.as_str(), wanted.refined.as_ref());
    disk_cache.keep(store, &wanted.address, about, image);
    match disk_cache.stopped() {
        None => Ok(()),
        Some(reason) => Err(Error::NotStored(reason.to_owned())),
    }
}
