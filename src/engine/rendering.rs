//! The operators and images of one setup, kept while the setup is unchanged.

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
use crate::pool::disk_cache::PlaceInPool;
use crate::pool::image_cache::{ImageCache, Wanted};
use footlight_host::files::Store;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::model::Preview;
use footlight_transport::contract::check_memory;
use footlight_transport::layered::{Layered, only_images};
use footlight_transport::{Cost, Prepared, Quality, Setup, Transport, TransportError};

/// Images that the pool does not use may take the memory budget divided by this.
const IDLE_MEMORY_DIVISOR: usize = 4;

/// Images derived from others at a time: a sum or two, their bytes and a file.
const WORKING_IMAGES: usize = 2;

/// Operators kept besides the current one may take the memory budget divided by this.
const KEPT_OPERATORS_DIVISOR: usize = 4;

/// The prepared operators of one setup by quality step, the addresses of its images, and their
/// pool.
pub(super) struct SetupImages {
    pub setup: Setup,
    /// The coarse and the refined quality step of the show's settings.
    pub steps: [u8; 2],
    operators: BTreeMap<u8, Box<dyn Prepared>>,
    /// Quality step of the operator in a running job.
    in_job: Option<u8>,
    /// The rig in the terms of addresses.
    lights: Lights,
    /// Key of its images; `None` when the operator's images are not to be kept.
    scene_key: Option<SceneKey>,
    /// Steps of the images of single sources, if they differ from the show's settings.
    pub base: Option<[Quality; 2]>,
    /// Steps of the pool's images of single sources.
    pub pool_base: Option<[Quality; 2]>,
    /// Coarse and refined images, if there are any.
    pub pool: Option<Pool>,
    /// Measured errors of images of single sources, one entry per quality step.
    pub measured: Vec<MeasuredShow>,
    /// Rendering time of the images of all single sources in seconds, by quality step.
    pub taken: BTreeMap<u8, f64>,
    /// Ratio of this show's errors to the operator's usual ones.
    pub error_scale: f64,
    /// The coarsest step known not to fit into memory.
    pub too_large: Option<TooLarge>,
}

/// Measured errors of some moments of a show.
#[derive(Clone, Debug)]
pub(super) struct MeasuredShow {
    /// Step of the images of single sources.
    pub quality: Quality,
    /// [`Document::revision`] of the measured show.
    pub revision: u64,
    /// Moments, the worst first.
    pub moments: Vec<MeasuredMoment>,
    /// Likely error of the worst moment, relative.
    pub error: f64,
    /// Expected error before the measurement.
    pub expected: f64,
    /// Multiple of the usual effort for the doubtful moment.
    pub effort: usize,
    /// Duration in seconds.
    pub seconds: f64,
}

impl MeasuredShow {
    /// The moment with the largest possible error.
    pub fn doubtful(&self) -> Option<&MeasuredMoment> {
        let most = |m: &&MeasuredMoment| m.measured.interval[1];
        self.moments
            .iter()
            .max_by(|a, b| most(a).total_cmp(&most(b)))
    }
}

/// Quality steps at which a show is seen.
#[derive(Clone, Copy)]
pub(super) struct Shown {
    /// The show's settings, coarse and refined.
    steps: [u8; 2],
    /// Steps of the images of single sources, if different.
    base: Option<[Quality; 2]>,
    /// [`SetupImages::error_scale`].
    error_scale: f64,
}

/// Images to render, with their addresses if they are to be kept.
pub(super) struct Missing {
    /// Their settings.
    pub settings: Vec<Vec<f64>>,
    /// One address for each, unless the operator's images are not to be kept.
    pub wanted: Option<Vec<Wanted>>,
}

impl SetupImages {
    /// Images for a new `setup`, none rendered yet. The quality steps are as before if `preview`
    /// asks for the steps `shown` then. `results_version` is [`Transport::results_version`].
    pub fn new(
        setup: Setup,
        preview: &Preview,
        results_version: Option<&str>,
        shown: Option<Shown>,
    ) -> SetupImages {
        let steps = [preview.coarse, preview.refined];
        let error_scale = shown.map_or(1.0, |shown| shown.error_scale);
        let shown = shown.filter(|shown| shown.steps == steps);
        // Banks given as images need no second copy in the cache.
        let version = results_version.filter(|_| !only_images(&setup.rig));
        SetupImages {
            lights: Lights::new(&setup.rig),
            scene_key: version.map(|v| SceneKey::new(v, &setup.scene, &setup.view)),
            setup,
            steps,
            operators: BTreeMap::new(),
            in_job: None,
            base: shown.and_then(|shown| shown.base),
            pool_base: None,
            pool: None,
            measured: Vec::new(),
            taken: BTreeMap::new(),
            error_scale,
            too_large: None,
        }
    }

    /// Images for `setup`, keeping the operators if the setup is unchanged, and the pool if
    /// `preview` also asks for the same steps.
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
            ..self
        }
    }

    /// The measurement at a step for the current show.
    pub fn measured_at(&self, step: Quality, document: &Document) -> Option<&MeasuredShow> {
        let is_it = |m: &&MeasuredShow| m.quality == step && m.revision == document.revision();
        self.measured.iter().find(is_it)
    }

    /// The quality steps asked for and shown.
    pub fn shown(&self) -> Shown {
        Shown {
            steps: self.steps,
            base: self.base,
            error_scale: self.error_scale,
        }
    }

    /// Number of sources, the coordinates of a setting.
    pub fn sources(&self) -> usize {
        self.setup.rig.sources.len()
    }

    /// The setting of each source alone at full, as for coarse images.
    pub fn units(&self) -> Vec<Vec<f64>> {
        Pool::unit_settings(self.sources())
    }

    /// The rig's operator: images, and `renderer` for other lights.
    pub fn layered<'t>(&self, renderer: &'t dyn Transport) -> Layered<'t> {
        Layered::new(&self.setup.rig, renderer)
    }

    /// The finest quality step of the rig's operator.
    pub fn finest(&self, renderer: &dyn Transport) -> Quality {
        self.layered(renderer).finest()
    }

    /// The error of images of a step, relative to their light: the usual one, scaled by
    /// measurements.
    pub fn step_error(&self, renderer: &dyn Transport, quality: Quality) -> Option<f64> {
        let usual = self.layered(renderer).usual_error(&self.setup, quality)?;
        Some(self.error_scale * usual)
    }

    /// Predicted cost of the rig's operator.
    pub fn cost(&self, renderer: &dyn Transport, quality: Quality) -> Cost {
        self.layered(renderer).cost(&self.setup, quality)
    }

    /// True when the operator of this quality step exists or will be returned by a job.
    pub fn is_prepared(&self, quality: Quality) -> bool {
        self.operators.contains_key(&quality.0) || self.in_job == Some(quality.0)
    }

    /// True when operators of other steps exist.
    pub fn has_other_operators(&self, quality: Quality) -> bool {
        self.operators.keys().any(|step| *step != quality.0)
    }

    /// Drops all operators except those of some steps.
    pub fn keep_operators(&mut self, steps: &[u8]) {
        self.operators.retain(|step, _| steps.contains(step));
    }

    /// Approximate bytes of the operators.
    pub fn operator_bytes(&self) -> usize {
        self.operators.values().map(|o| o.bytes()).sum()
    }

    /// Bytes of the pool's images that the cache does not share.
    pub fn image_bytes(&self) -> usize {
        let pool = self.pool.as_ref();
        pool.map_or(0, |pool| match self.scene_key {
            Some(_) => pool.extrapolated_bytes(),
            None => pool.extrapolated_bytes() + pool.image_bytes(),
        })
    }

    /// Checks that `count` more images and the least memory to render them fit into `memory` bytes,
    /// of which some are `held`.
    ///
    /// # Errors
    /// [`TransportError::Memory`] if they do not fit.
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

    /// Bytes of the images derived from others at a time.
    pub fn working_bytes(&self) -> usize {
        self.image_size().saturating_mul(WORKING_IMAGES)
    }

    /// Drops operators of other steps when they leave too little memory to prepare one of this
    /// step.
    fn make_room(&mut self, quality: Quality, memory: usize) {
        let is_new = !self.operators.contains_key(&quality.0);
        if is_new && self.operator_bytes() > memory / KEPT_OPERATORS_DIVISOR {
            self.operators.clear();
        }
    }

    /// The operator at a quality step, prepared on first use.
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

    /// Returns one entry per setting, `None` where the image is missing, and the missing settings.
    /// Refined images are numbered from `refined`; coarse ones have no number.
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

    /// For each setting, true when its image needs no rendering, judged without reading images.
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

    /// Images of settings in the cache's terms; `refined` as in [`SetupImages::find`].
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
            refined: refined.map(|first| PlaceInPool {
                order: first + i,
                setting: setting.clone(),
            }),
        };
        settings.iter().enumerate().map(want).collect()
    }

    /// Predicted cost of images of single sources, in the operator's units.
    pub fn cost_of_units(&self, renderer: &dyn Transport, quality: Quality, images: usize) -> f64 {
        let cost = self.cost(renderer, quality);
        let prepare = if self.is_prepared(quality) {
            0.0
        } else {
            cost.prepare
        };
        Cost { prepare, ..cost }.alone(images as f64)
    }

    /// Key of this scene and view in the cache; `None` when images are not to be kept.
    pub fn scene_key(&self) -> Option<SceneKey> {
        self.scene_key
    }

    /// True for the key of this scene and view.
    pub fn is_of_scene(&self, key: SceneKey) -> bool {
        Some(key) == self.scene_key
    }

    /// True for images that this scene, rig and view can use.
    pub fn can_use(&self, key: SceneKey, lighting: &Lighting) -> bool {
        self.is_of_scene(key) && self.lights.has_all(lighting)
    }

    /// Number of refined images in the pool, or, until it is created, of those in memory for it.
    pub fn refined(&self, image_cache: &ImageCache, least: Quality) -> usize {
        match &self.pool {
            Some(pool) => pool.refined().len(),
            None => self.known(image_cache, least, None).len(),
        }
    }
}

/// The quality steps of one or two sets of images of single sources, the coarser first.
pub(super) fn each_step([cheap, fine]: [Quality; 2]) -> impl Iterator<Item = Quality> {
    let cheaper = Some(cheap).filter(|cheap| *cheap < fine);
    cheaper.into_iter().chain([fine])
}

/// Keeps rendered images that have addresses.
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

/// Fills the gaps of existing images with rendered ones.
pub(super) fn in_order(
    found: Vec<Option<Arc<Image>>>,
    rendered: Vec<Arc<Image>>,
) -> Vec<Arc<Image>> {
    let mut rendered = rendered.into_iter();
    let all = found.into_iter();
    all.filter_map(|f| f.or_else(|| rendered.next())).collect()
}

/// Drops unused images beyond their share of `memory` bytes.
pub(super) fn trim(image_cache: &mut ImageCache, memory: usize) {
    image_cache.trim(memory / IDLE_MEMORY_DIVISOR);
}
