//! The rendered side of a show: scene, rig, prepared operators and pool, kept as long as the text
//! still means the same by them.

mod again;
mod loan;

pub(super) use self::again::Again;
pub(super) use self::loan::{Footing, Returned};

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::diagnostic::Diagnostic;
use crate::files::{Files, Store};
use crate::geometry::{Vec3, vec3};
use crate::lang::SpanMap;
use crate::picture::Image;
use crate::pool::Pool;
use crate::pool::address::{Ground, Lighting, Lights};
use crate::pool::archive::{Archive, Wanted};
use crate::pool::depot::Place;
use crate::renderer::layered::{Layered, only_images};
use crate::renderer::{Cost, Prepared, Quality, Transport, TransportError};
use crate::scene::fitting::Fittings;
use crate::scene::import;
use crate::scene::shape::Shape;
use crate::scene::solid::Solid;
use crate::scene::{self, ImageFile, Images, Lamp, Rig, Scene, still};
use crate::show::{self, Show};
use crate::units::Rgb;
use crate::work::Work;

use super::{fitting, mistake};

/// What a scene is made from; equal inputs make equal scenes.
#[derive(Clone, Debug, PartialEq)]
struct Inputs {
    stages: Vec<(String, import::Options)>,
    surfaces: Vec<(String, Rgb, Vec<Solid>)>,
    shapes: Vec<(String, Shape)>,
}

impl Inputs {
    fn of(show: &Show) -> Inputs {
        Inputs {
            stages: show
                .stages
                .iter()
                .map(|s| (s.path.clone(), options(s)))
                .collect(),
            surfaces: show
                .surfaces
                .iter()
                .map(|s| (s.name.clone(), s.reflectance, s.solids.clone()))
                .collect(),
            shapes: show
                .shapes()
                .map(|(name, shape)| (name.to_owned(), shape))
                .collect(),
        }
    }
}

/// Scene, rig, view, and what has been rendered of them.
pub(super) struct Stage {
    inputs: Inputs,
    /// What light meets.
    pub scene: Arc<Scene>,
    images: Images,
    fittings: Fittings,
    /// What emits it.
    pub rig: Arc<Rig>,
    /// Who sees it.
    pub view: scene::View,
    steps: [u8; 2],
    operators: BTreeMap<u8, Box<dyn Prepared>>,
    /// The step of quality whose operator is at work elsewhere.
    lent: Option<u8>,
    /// The rig as addresses see it.
    lights: Lights,
    /// Where its pictures belong; `None` when the operator's pictures are not to be kept.
    ground: Option<Ground>,
    /// Every picture at hand, whether the pool uses it or not.
    pub archive: Archive,
    /// Refined pictures at hand that the pool does not use, as they say next to nothing new.
    pub near_copies: usize,
    /// Coarse and refined pictures, once there are any.
    pub pool: Option<Pool>,
}

/// What rendering takes.
#[derive(Clone, Copy)]
pub(super) struct Means<'a> {
    pub transport: &'a dyn Transport,
    pub store: &'a dyn Store,
    pub work: Work<'a>,
}

/// What an edit leaves of a stage.
pub(super) struct Fresh {
    inputs: Inputs,
    scene: Arc<Scene>,
    images: Images,
    fittings: Fittings,
    rig: Rig,
    view: scene::View,
    steps: [u8; 2],
}

impl Stage {
    /// Loads what `show` needs, taking the scene and the images of `old` where the text means the
    /// same; `None` when the show has no stage or no view. Where every bank is an image neither is
    /// needed: the picture is then as large as they are. Images hold at most `memory` bytes.
    ///
    /// # Errors
    /// A diagnostic for every file that cannot be used and every light that does not fit.
    pub fn read(
        show: &Show,
        spans: &SpanMap,
        files: &dyn Files,
        memory: usize,
        old: Option<&Stage>,
    ) -> Result<Option<Fresh>, Vec<Diagnostic>> {
        let inputs = Inputs::of(show);
        let scene = match old.filter(|s| s.inputs == inputs) {
            Some(old) => Ok((Arc::clone(&old.scene), old.fittings.lamps.clone())),
            None => load(show, spans, files).map(|(scene, lamps)| (Arc::new(scene), lamps)),
        };
        let none = Images::new();
        let known = old.map_or(&none, |s| &s.images);
        let images = pictures(show, spans, files, memory, known);
        let fittings = fitting::read(show, spans, files, old.map(|s| &s.fittings));
        let (scene, images, fittings) = match (scene, images, fittings) {
            (Ok((scene, lamps)), Ok(images), Ok(fittings)) => {
                (scene, images, Fittings { lamps, ..fittings })
            }
            (scene, images, fittings) => {
                let mistakes = [scene.err(), images.err(), fittings.err()];
                return Err(mistakes.into_iter().flatten().flatten().collect());
            }
        };
        let rig = show.rig_with(&scene, &images, &fittings);
        let rig = rig.map_err(|errors| {
            let mistakes = errors.iter().map(|e| mistake::of_rig(e, &scene, spans));
            mistakes.collect::<Vec<_>>()
        });
        let rig = rig?;
        let view = show.view().map(|v| v.camera.clone());
        let view = if only_images(&rig) {
            view.or_else(|| images.values().next().map(|i| view_of(i)))
        } else if show.stages.is_empty() && show.surfaces.iter().all(|s| s.solids.is_empty()) {
            None
        } else {
            view
        };
        Ok(view.map(|view| Fresh {
            inputs,
            scene,
            images,
            fittings,
            rig,
            view,
            steps: [show.preview.coarse, show.preview.refined],
        }))
    }

    /// The stage after an edit. The pool stays when scene, rig, view and steps are the same;
    /// `archive` keeps every picture, for what fits again. `results` is what the operator says of
    /// its pictures.
    pub fn renew(
        old: Option<Stage>,
        fresh: Option<Fresh>,
        results: Option<&str>,
        archive: &mut Option<Archive>,
    ) -> Option<Stage> {
        let mut old = old;
        if let Some(old) = &mut old {
            *archive = Some(std::mem::take(&mut old.archive));
        }
        let fresh = fresh?;
        let (operators, lent, pool) = match old {
            Some(old)
                if (Arc::ptr_eq(&old.scene, &fresh.scene) || old.scene == fresh.scene)
                    && *old.rig == fresh.rig
                    && old.view == fresh.view =>
            {
                // A pool's coarse pictures are of one step; operators are kept by step anyway.
                let pool = old.pool.filter(|_| old.steps == fresh.steps);
                (old.operators, old.lent, pool)
            }
            _ => (BTreeMap::new(), None, None),
        };
        // Banks given as images are pictures already: nothing is gained by keeping them twice.
        let results = results.filter(|_| !only_images(&fresh.rig));
        Some(Stage {
            lights: Lights::new(&fresh.rig),
            ground: results.map(|r| Ground::new(r, &fresh.scene, &fresh.view)),
            inputs: fresh.inputs,
            scene: fresh.scene,
            images: fresh.images,
            fittings: fresh.fittings,
            rig: Arc::new(fresh.rig),
            view: fresh.view,
            steps: fresh.steps,
            operators,
            lent,
            archive: archive.take().unwrap_or_default(),
            near_copies: 0,
            pool,
        })
    }

    /// The finest step of quality that the rig's operator has.
    pub fn finest(&self, transport: &dyn Transport) -> Quality {
        Layered::new(&self.rig, transport).finest()
    }

    /// A new operator at a step of quality.
    pub fn prepare(
        &self,
        transport: &dyn Transport,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        let layered = Layered::new(&self.rig, transport);
        layered.prepare(&self.setup(), quality, work)
    }

    /// Predicted seconds of the rig's operator.
    pub fn cost(&self, transport: &dyn Transport, quality: Quality) -> Cost {
        let layered = Layered::new(&self.rig, transport);
        layered.cost(&self.setup(), quality)
    }

    /// True when the operator of this step of quality is at hand, or will be given back.
    pub fn is_prepared(&self, quality: Quality) -> bool {
        self.operators.contains_key(&quality.0) || self.lent == Some(quality.0)
    }

    /// Lets go of all operators but those of some steps.
    pub fn keep_operators(&mut self, steps: &[u8]) {
        self.operators.retain(|step, _| steps.contains(step));
    }

    /// The operator at a step of quality, prepared on first use.
    pub fn operator(
        &mut self,
        transport: &dyn Transport,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<&mut dyn Prepared, TransportError> {
        let finest = self.finest(transport).0;
        if !self.operators.contains_key(&quality.0) {
            let prepared = self.prepare(transport, quality, work)?;
            self.operators.insert(quality.0, prepared);
        }
        match self.operators.get_mut(&quality.0) {
            Some(operator) => Ok(operator.as_mut()),
            None => Err(TransportError::Quality(quality.0, finest)),
        }
    }

    /// A picture of each setting: found, added up, or rendered. Refined pictures are counted on
    /// from `refined`; coarse ones have none.
    pub fn pictures(
        &mut self,
        means: Means<'_>,
        quality: Quality,
        settings: &[Vec<f64>],
        refined: Option<usize>,
    ) -> Result<Vec<Arc<Image>>, TransportError> {
        let (found, missing) = self.find(quality, settings, refined, means.store);
        let mut rendered = Vec::new();
        if !missing.settings.is_empty() {
            let operator = self.operator(means.transport, quality, means.work)?;
            let images = operator.render(&missing.settings, means.work)?;
            rendered = self.take_in(missing.wanted.as_deref(), images, means);
        }
        self.trim(means.work.memory);
        let mut rendered = rendered.into_iter();
        let each = found.into_iter();
        Ok(each.filter_map(|f| f.or_else(|| rendered.next())).collect())
    }

    /// Which pictures of settings need no rendering, as far as can be told without reading any.
    pub fn at_hand(&self, quality: Quality, settings: &[Vec<f64>], store: &dyn Store) -> Vec<bool> {
        let Some(ground) = self.ground else {
            return vec![false; settings.len()];
        };
        let wanted = self.wanted(ground, quality, settings, None);
        self.archive.has(&wanted, store)
    }

    /// Pictures of settings as the archive knows them; `refined` as in [`Stage::pictures`].
    fn wanted(
        &self,
        ground: Ground,
        quality: Quality,
        settings: &[Vec<f64>],
        refined: Option<usize>,
    ) -> Vec<Wanted> {
        let want = |(i, setting): (usize, &Vec<f64>)| Wanted {
            address: self.lights.address(ground, quality, setting),
            words: self.words(setting),
            refined: refined.map(|first| Place {
                order: first + i,
                setting: setting.clone(),
            }),
        };
        settings.iter().enumerate().map(want).collect()
    }

    /// A setting for people: the sources that are lit, by name.
    fn words(&self, setting: &[f64]) -> String {
        let pairs = self.rig.sources.iter().zip(setting);
        let lit = pairs.filter(|(_, s)| **s != 0.0);
        let words: Vec<String> = lit.map(|(o, s)| format!("{} {s}", o.name)).collect();
        words.join(", ")
    }

    /// The pool, with its coarse pictures found or rendered on first use: the show's coarse step
    /// and the next finer one, whose difference estimates the error. Also true when it was made
    /// just now.
    pub fn coarse(&mut self, means: Means<'_>) -> Result<bool, TransportError> {
        if self.pool.is_some() {
            return Ok(false);
        }
        let finest = self.finest(means.transport);
        let [cheap, fine] = coarse_steps(self.steps[0], finest).map(Quality);
        let units = Pool::unit_settings(self.rig.sources.len());
        let coarser = match fine > cheap {
            true => self.pictures(means, cheap, &units, None)?,
            false => Vec::new(),
        };
        let coarse = self.pictures(means, fine, &units, None)?;
        self.pool = Some(Pool::new(coarse, coarser, means.work));
        Ok(true)
    }

    /// True for where this scene and view have their pictures.
    pub fn is_ground(&self, ground: Ground) -> bool {
        Some(ground) == self.ground
    }

    /// True for pictures that this scene, rig and view can use.
    pub fn serves(&self, ground: Ground, lighting: &Lighting) -> bool {
        Some(ground) == self.ground && self.lights.has_all(lighting)
    }
}

/// The share of the memory budget for pictures that the pool does not use at present.
const KEPT_SHARE: usize = 4;

/// The two steps of quality for coarse pictures: `coarse` itself and the next finer one, whose
/// pictures serve; their difference estimates the error that these have. On the tavern steps 1 and
/// 2 predict 0.81 % where 0.84 % is true against step 4; steps 1 and 3 would predict 1.12 % for
/// 0.46 % and take a third longer. The estimate sees nothing of an error that both steps share: when
/// edge pixels were covered by 16 sub-pixels in both, it was a ninth of the truth.
pub(super) fn coarse_steps(coarse: u8, finest: Quality) -> [u8; 2] {
    let cheap = coarse.clamp(1, finest.0);
    [cheap, cheap.saturating_add(1).min(finest.0)]
}

/// The pictures that banks are given as, all of one size, which is the view's where there is one.
fn pictures(
    show: &Show,
    spans: &SpanMap,
    files: &dyn Files,
    memory: usize,
    known: &Images,
) -> Result<Images, Vec<Diagnostic>> {
    let wanted: Vec<ImageFile> = show.images().map(|(_, file)| file.clone()).collect();
    let images = still::read(files, &wanted, known, memory).map_err(|refused| {
        let of_one = |one| mistake::of_image(one, show, spans);
        refused.iter().flat_map(of_one).collect::<Vec<_>>()
    })?;
    let named = || {
        let read = |(id, file)| images.get(file).map(|image| (id, file, size(image)));
        show.images().filter_map(read)
    };
    let of_view = show.view().map(|v| {
        let camera = (v.camera.width, v.camera.height);
        (camera, format!("the view `{}`", v.name))
    });
    let of_first = || {
        named()
            .next()
            .map(|(_, f, size)| (size, format!("`{}`", f.path)))
    };
    let Some((wanted, of)) = of_view.or_else(of_first) else {
        return Ok(images);
    };
    let other = named().filter(|(_, _, size)| *size != wanted);
    let mistakes: Vec<Diagnostic> = other
        .map(|(id, file, size)| mistake::of_size((id, file), size, wanted, &of, spans))
        .collect();
    if mistakes.is_empty() {
        Ok(images)
    } else {
        Err(mistakes)
    }
}

fn size(image: &Image) -> (usize, usize) {
    (image.width(), image.height())
}

/// A view as large as `image`, for a show that has nothing to look at but images; where it stands
/// does not matter.
fn view_of(image: &Image) -> scene::View {
    scene::View {
        from: vec3(0.0, -1.0, 0.0),
        to: Vec3::ZERO,
        fov: 40.0,
        width: image.width(),
        height: image.height(),
    }
}

/// How a stage's file is to be taken.
fn options(stage: &show::Stage) -> import::Options {
    import::Options {
        z_up: stage.z_up,
        one_sided: stage.one_sided,
    }
}

/// The scene, and the lights of its files.
fn load(
    show: &Show,
    spans: &SpanMap,
    files: &dyn Files,
) -> Result<(Scene, Vec<Lamp>), Vec<Diagnostic>> {
    let mut scene = Scene::default();
    let mut lamps = Vec::new();
    let mut mistakes = Vec::new();
    for stage in &show.stages {
        match import::read(files, &stage.path, options(stage)) {
            Ok(read) => {
                scene.append(read.scene);
                lamps.extend(read.inventory.lamps);
            }
            Err(error) => mistakes.push(mistake::of_stage(&error, stage, spans)),
        }
    }
    if mistakes.is_empty() {
        mistakes = dressed(show, spans, &mut scene);
    }
    if mistakes.is_empty() {
        show.furnish(&mut scene);
        Ok((scene, lamps))
    } else {
        Err(mistakes)
    }
}

/// Gives the scene the show's surfaces: what replaces the stage's materials, then what stands
/// beside them. What is wrong with that.
fn dressed(show: &Show, spans: &SpanMap, scene: &mut Scene) -> Vec<Diagnostic> {
    let mut mistakes = Vec::new();
    let (own, replaced): (Vec<_>, Vec<_>) =
        show.surfaces.iter().partition(|s| !s.solids.is_empty());
    for surface in replaced {
        if !scene.set_reflectance(&surface.name, surface.reflectance) {
            mistakes.push(mistake::of_surface(surface, scene, spans));
        }
    }
    let mut fronts = Vec::new();
    for surface in own {
        if scene.materials.iter().any(|m| m.name == surface.name) {
            mistakes.push(mistake::of_own_surface(surface, spans));
            continue;
        }
        for solid in &surface.solids {
            let first = scene.polygons.len();
            scene.add_solid(&surface.name, surface.reflectance, solid);
            if solid.two_sided() {
                fronts.extend(first..scene.polygons.len());
            }
        }
    }
    scene.add_backs(&fronts);
    mistakes
}
