//! The operators and images of one setup, kept as long as the setup stays.

mod job;
mod reuse;

pub(super) use self::job::{Job, Rendered};
pub(super) use self::reuse::Reused;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use crate::document::Document;
use crate::goal::TooLarge;
use crate::measure::MeasuredMoment;
use crate::pool::Pool;
use crate::pool::address::{Lighting, Lights, SceneKey};
use crate::pool::disk_cache::Place;
use crate::pool::image_cache::{ImageCache, Wanted};
use footlight_host::files::Store;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::model::Preview;
use footlight_transport::contract::check_memory;
use footlight_transport::layered::{Layered, only_images};
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};

/// Images that the pool does not use at present may take the memory budget divided by this.
const IDLE_MEMORY_DIVISOR: usize = 4;

/// Images that are made of others at a time: a sum or two, their bytes and a file.
const WORKING_IMAGES: usize = 2;

/// Operators that are kept beside another one may take the memory budget divided by this.
const KEPT_OPERATORS_DIVISOR: usize = 4;

/// The prepared operators of one setup by step of quality, the addresses of its images, and the
/// pool of them.
pub(super) struct SetupImages {
    pub setup: Setup,
    /// The coarse and the refined step of quality that the show asks for.
    pub steps: [u8; 2],
    operators: BTreeMap<u8, Box<dyn Prepared>>,
    /// The step of quality whose operator is at work in a job.
    in_job: Option<u8>,
    /// The rig as addresses see it.
    lights: Lights,
    /// Where its images belong; `None` when the operator's images are not to be kept.
    scene_key: Option<SceneKey>,
    /// Refined images at hand that the pool does not use, as they say next to nothing new.
    pub near_copies: usize,
    /// The steps of the images of sources alone, where they are not what the show asks for.
    pub base: Option<[Quality; 2]>,
    /// Those that the pool is made of.
    pub pool_base: Option<[Quality; 2]>,
    /// Coarse and refined images, once there are any.
    pub pool: Option<Pool>,
    /// Errors that were measured of images of sources alone, one for a step of quality.
    pub measured: Vec<MeasuredShow>,
    /// Seconds that the images of all sources alone took, by step of quality.
    pub taken: BTreeMap<u8, f64>,
    /// Factor from the operator's usual errors to those of this show.
    pub error_scale: f64,
    /// The coarsest step known not to fit into the memory.
    pub too_large: Option<TooLarge>,
}

/// Errors that were measured of some moments of a show.
#[derive(Clone, Debug)]
pub(super) struct MeasuredShow {
    /// The step of the images of sources alone.
    pub quality: Quality,
    /// [`Document::revision`] of the show that they are of.
    pub revision: u64,
    /// The worst first.
    pub moments: Vec<MeasuredMoment>,
    /// Likely error of the worst one, relative.
    pub error: f64,
    /// What was expected of it before.
    pub expected: f64,
    /// Times the usual effort that the one in doubt was measured with.
    pub effort: usize,
    /// Seconds that it took.
    pub seconds: f64,
}

impl MeasuredShow {
    /// The moment whose error may be the largest.
    pub fn doubtful(&self) -> Option<&MeasuredMoment> {
        let most = |m: &&MeasuredMoment| m.measured.interval[1];
        self.moments
            .iter()
            .max_by(|a, b| most(a).total_cmp(&most(b)))
    }
}

/// At which steps of quality a show is seen.
#[derive(Clone, Copy)]
pub(super) struct Shown {
    /// What it asks for, coarse and refined.
    steps: [u8; 2],
    /// The steps of the images of sources alone, where they are others.
    base: Option<[Quality; 2]>,
    /// [`SetupImages::error_scale`].
    error_scale: f64,
}

/// Images to be rendered, with their addresses where they are to be kept.
pub(super) struct Missing {
    /// What is to be rendered.
    pub settings: Vec<Vec<f64>>,
    /// As many, unless the operator's images are not to be kept.
    pub wanted: Option<Vec<Wanted>>,
}

impl SetupImages {
    /// Nothing yet of `setup`. What is seen is as good as it was before, if `preview` asks for the
    /// steps that were then `shown`. `results_version` is [`Transport::results_version`].
    pub fn new(
        setup: Setup,
        preview: &Preview,
        results_version: Option<&str>,
        shown: Option<Shown>,
    ) -> SetupImages {
        let steps = [preview.coarse, preview.refined];
        let error_scale = shown.map_or(1.0, |shown| shown.error_scale);
        let shown = shown.filter(|shown| shown.steps == steps);
        // Banks given as images are images already: nothing is gained by keeping them twice.
        let version = results_version.filter(|_| !only_images(&setup.rig));
        SetupImages {
            lights: Lights::new(&setup.rig),
            scene_key: version.map(|v| SceneKey::new(v, &setup.scene, &setup.view)),
            setup,
            steps,
            operators: BTreeMap::new(),
            in_job: None,
            near_copies: 0,
            base: shown.and_then(|shown| shown.base),
            pool_base: None,
            pool: None,
            measured: Vec::new(),
            taken: BTreeMap::new(),
            error_scale,
            too_large: None,
        }
    }

    /// Those of `setup`: the same operators where it is the same setup, and the same pool if
    /// `preview` asks for the same steps.
    pub fn renew(
        mut self,
        setup: Setup,
        preview: &Preview,
        results_version: Option<&str>,
    ) -> SetupImages {
        if self.setup != setup {
            return SetupImages::new(setup, preview, results_version, Some(self.shown()));
        }
        let steps = [preview.coarse, preview.refined];
        // A pool's coarse images are of one step; operators are kept by step anyway.
        if self.steps != steps {
            (self.pool, self.base) = (None, None);
        }
        SetupImages {
            setup,
            steps,
            near_copies: 0,
            ..self
        }
    }

    /// What was measured of a step for a show as it is now.
    pub fn measured_at(&self, step: Quality, document: &Document) -> Option<&MeasuredShow> {
        let is_it = |m: &&MeasuredShow| m.quality == step && m.revision == document.revision();
        self.measured.iter().find(is_it)
    }

    /// The steps that the show asks for and those that it is seen at.
    pub fn shown(&self) -> Shown {
        Shown {
            steps: self.steps,
            base: self.base,
            error_scale: self.error_scale,
        }
    }

    /// Number of sources: coordinates of a setting.
    pub fn sources(&self) -> usize {
        self.setup.rig.sources.len()
    }

    /// The setting of each source alone at full, which coarse images are of.
    pub fn units(&self) -> Vec<Vec<f64>> {
        Pool::unit_settings(self.sources())
    }

    /// The rig's operator: images, and `renderer` for other lights.
    pub fn layered<'t>(&self, renderer: &'t dyn Transport) -> Layered<'t> {
        Layered::new(&self.setup.rig, renderer)
    }

    /// The finest step of quality that the rig's operator has.
    pub fn finest(&self, renderer: &dyn Transport) -> Quality {
        self.layered(renderer).finest()
    }

    /// A new operator at a step of quality.
    pub fn prepare(
        &self,
        renderer: &dyn Transport,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        self.layered(renderer).prepare(&self.setup, quality, work)
    }

    /// The error of images of a step, relative to their light: the usual one, scaled by the measurements.
    pub fn step_error(&self, renderer: &dyn Transport, quality: Quality) -> Option<f64> {
        let usual = self.layered(renderer).usual_error(&self.setup, quality)?;
        Some(self.error_scale * usual)
    }

    /// Predicted cost of the rig's operator.
    pub fn cost(&self, renderer: &dyn Transport, quality: Quality) -> Cost {
        self.layered(renderer).cost(&self.setup, quality)
    }

    /// True when the operator of this step of quality is at hand, or will be given back.
    pub fn is_prepared(&self, quality: Quality) -> bool {
        self.operators.contains_key(&quality.0) || self.in_job == Some(quality.0)
    }

    /// True where operators of other steps than this one are at hand.
    pub fn has_other_operators(&self, quality: Quality) -> bool {
        self.operators.keys().any(|step| *step != quality.0)
    }

    /// Lets go of all operators but those of some steps.
    pub fn keep_operators(&mut self, steps: &[u8]) {
        self.operators.retain(|step, _| steps.contains(step));
    }

    /// Bytes that the operators at hand take, about.
    pub fn operator_bytes(&self) -> usize {
        self.operators.values().map(|o| o.bytes()).sum()
    }

    /// Bytes of the pool's images that the cache does not hold as well.
    pub fn image_bytes(&self) -> usize {
        let pool = self.pool.as_ref();
        pool.map_or(0, |pool| match self.scene_key {
            Some(_) => pool.extrapolated_bytes(),
            None => pool.extrapolated_bytes() + pool.image_bytes(),
        })
    }

    /// Checks that so many more images fit into `memory`, bytes, of which some are `held`, with
    /// what rendering them takes at least.
    ///
    /// # Errors
    /// [`TransportError::Memory`] if not.
    pub fn check_images(
        &self,
        renderer: &dyn Transport,
        images: usize,
        (memory, held): (usize, usize),
    ) -> Result<(), TransportError> {
        let needed = self.image_size().saturating_mul(images);
        let least = self.layered(renderer).least_bytes(&self.setup);
        let besides = held.saturating_add(self.working_bytes() + least);
        check_memory(
            "the stage and its pictures",
            besides.saturating_add(needed),
            memory,
        )
    }

    /// Bytes of an image.
    fn image_size(&self) -> usize {
        let view = &self.setup.view;
        let pixels = view.width.saturating_mul(view.height);
        pixels.saturating_mul(size_of::<[f32; 3]>())
    }

    /// Bytes of the images that are made of others at a time.
    pub fn working_bytes(&self) -> usize {
        self.image_size().saturating_mul(WORKING_IMAGES)
    }

    /// Lets go of the operators of other steps where they leave too little to prepare one of this
    /// step.
    fn make_room(&mut self, quality: Quality, memory: usize) {
        let is_new = !self.operators.contains_key(&quality.0);
        if is_new && self.operator_bytes() > memory / KEPT_OPERATORS_DIVISOR {
            self.operators.clear();
        }
    }

    /// The operator at a step of quality, prepared on first use.
    pub fn operator(
        &mut self,
        renderer: &dyn Transport,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<&mut dyn Prepared, TransportError> {
        self.make_room(quality, work.memory);
        let others = self
            .operators
            .iter()
            .filter(|(step, _)| **step != quality.0);
        let work = work.holding(others.map(|(_, operator)| operator.bytes()).sum());
        let layered = self.layered(renderer);
        let operator = match self.operators.entry(quality.0) {
            Entry::Occupied(prepared) => prepared.into_mut(),
            Entry::Vacant(place) => place.insert(layered.prepare(&self.setup, quality, work)?),
        };
        Ok(operator.as_mut())
    }

    /// Of the images of `settings` those that are at hand, in their order with gaps, and those that
    /// are not. Refined images are counted on from `refined`; coarse ones have none.
    pub fn find(
        &self,
        image_cache: &mut ImageCache,
        quality: Quality,
        settings: &[Vec<f64>],
        refined: Option<usize>,
        store: &dyn Store,
    ) -> (Vec<Option<Arc<Image>>>, Missing) {
        let Some(key) = self.scene_key else {
            let missing = Missing {
                settings: settings.to_vec(),
                wanted: None,
            };
            return (vec![None; settings.len()], missing);
        };
        let wanted = self.wanted(key, quality, settings, refined);
        let size = (self.setup.view.width, self.setup.view.height);
        let found = image_cache.find(&wanted, size, store);
        let open = |((setting, wanted), found): ((&Vec<f64>, Wanted), &Option<Arc<Image>>)| {
            found.is_none().then(|| (setting.clone(), wanted))
        };
        let pairs = settings.iter().zip(wanted).zip(&found).filter_map(open);
        let (settings, wanted) = pairs.unzip();
        let missing = Missing {
            settings,
            wanted: Some(wanted),
        };
        (found, missing)
    }

    /// Which images of settings need no rendering, as far as can be told without reading any.
    pub fn at_hand(
        &self,
        image_cache: &ImageCache,
        quality: Quality,
        settings: &[Vec<f64>],
        store: &dyn Store,
    ) -> Vec<bool> {
        let Some(key) = self.scene_key else {
            return vec![false; settings.len()];
        };
        image_cache.has(&self.wanted(key, quality, settings, None), store)
    }

    /// Images of settings as the cache holds them; `refined` as in [`SetupImages::find`].
    pub fn wanted(
        &self,
        key: SceneKey,
        quality: Quality,
        settings: &[Vec<f64>],
        refined: Option<usize>,
    ) -> Vec<Wanted> {
        let want = |(i, setting): (usize, &Vec<f64>)| Wanted {
            address: self.lights.address(key, quality, setting),
            words: self.setup.rig.lit(setting),
            refined: refined.map(|first| Place {
                order: first + i,
                setting: setting.clone(),
            }),
        };
        settings.iter().enumerate().map(want).collect()
    }

    /// Predicted cost of so many sources alone, in the operator's units.
    pub fn cost_of_units(&self, renderer: &dyn Transport, quality: Quality, images: usize) -> f64 {
        let cost = self.cost(renderer, quality);
        let prepare = if self.is_prepared(quality) {
            0.0
        } else {
            cost.prepare
        };
        Cost { prepare, ..cost }.alone(images as f64)
    }

    /// Where this scene and view have their images; `None` when these are not to be kept.
    pub fn scene_key(&self) -> Option<SceneKey> {
        self.scene_key
    }

    /// True for where this scene and view have their images.
    pub fn is_of_scene(&self, key: SceneKey) -> bool {
        Some(key) == self.scene_key
    }

    /// True for images that this scene, rig and view can use.
    pub fn can_use(&self, key: SceneKey, lighting: &Lighting) -> bool {
        self.is_of_scene(key) && self.lights.has_all(lighting)
    }

    /// Number of refined images that the pool has, or, until it is made, will have of those in
    /// memory.
    pub fn refined(&self, image_cache: &ImageCache, least: Quality) -> usize {
        match &self.pool {
            Some(pool) => pool.refined().len(),
            None => self.known(image_cache, least, None).len(),
        }
    }
}

/// The steps of quality of one or two sets of images of sources alone, the coarser first.
pub(super) fn each_step([cheap, fine]: [Quality; 2]) -> impl Iterator<Item = Quality> {
    let cheaper = Some(cheap).filter(|cheap| *cheap < fine);
    cheaper.into_iter().chain([fine])
}

/// Keeps images that were rendered, where they have addresses.
pub(super) fn take_in(
    image_cache: &mut ImageCache,
    wanted: Option<&[Wanted]>,
    images: Vec<Image>,
    store: &dyn Store,
) -> Vec<Arc<Image>> {
    let Some(wanted) = wanted else {
        image_cache.count_rendered(images.len());
        return images.into_iter().map(Arc::new).collect();
    };
    let pairs = wanted.iter().zip(images);
    pairs
        .map(|(w, image)| image_cache.take_in(w, image, store))
        .collect()
}

/// Found images, with those that were rendered in their gaps.
pub(super) fn in_order(
    found: Vec<Option<Arc<Image>>>,
    rendered: Vec<Arc<Image>>,
) -> Vec<Arc<Image>> {
    let mut rendered = rendered.into_iter();
    let all = found.into_iter();
    all.filter_map(|f| f.or_else(|| rendered.next())).collect()
}

/// Lets go of images that nothing uses, beyond their share of the memory, bytes.
pub(super) fn trim(image_cache: &mut ImageCache, memory: usize) {
    image_cache.trim(memory / IDLE_MEMORY_DIVISOR);
}
