//! The rendered side of a show: scene, rig, prepared operators and pool, kept as long as the text
//! still means the same by them.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::diagnostic::Diagnostic;
use crate::files::Files;
use crate::geometry::{Vec3, vec3};
use crate::lang::SpanMap;
use crate::picture::Image;
use crate::pool::Pool;
use crate::scene::fitting::Fittings;
use crate::scene::import;
use crate::scene::shape::Shape;
use crate::scene::{self, ImageFile, Images, Lamp, Rig, Scene, still};
use crate::show::{self, Show};
use crate::transport::layered::{Layered, only_images};
use crate::transport::{Cost, Prepared, Quality, Transport, TransportError};
use crate::units::Rgb;
use crate::work::Work;

use super::{fitting, mistake};

/// What a scene is made from; equal inputs make equal scenes.
#[derive(Clone, Debug, PartialEq)]
struct Inputs {
    stages: Vec<(String, import::Options)>,
    surfaces: Vec<(String, Rgb)>,
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
                .map(|s| (s.name.clone(), s.reflectance))
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
    pub rig: Rig,
    /// Who sees it.
    pub view: scene::View,
    steps: [u8; 2],
    operators: BTreeMap<u8, Box<dyn Prepared>>,
    /// Coarse and refined pictures, once there are any.
    pub pool: Option<Pool>,
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
        } else if show.stages.is_empty() {
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

    /// The stage after an edit: everything rendered stays when scene, rig and view are the same.
    pub fn renew(old: Option<Stage>, fresh: Option<Fresh>) -> Option<Stage> {
        let fresh = fresh?;
        let (operators, pool) = match old {
            Some(old)
                if (Arc::ptr_eq(&old.scene, &fresh.scene) || old.scene == fresh.scene)
                    && old.rig == fresh.rig
                    && old.view == fresh.view =>
            {
                // A pool's coarse pictures are of one step; operators are kept by step anyway.
                let pool = old.pool.filter(|_| old.steps == fresh.steps);
                (old.operators, pool)
            }
            _ => (BTreeMap::new(), None),
        };
        Some(Stage {
            inputs: fresh.inputs,
            scene: fresh.scene,
            images: fresh.images,
            fittings: fresh.fittings,
            rig: fresh.rig,
            view: fresh.view,
            steps: fresh.steps,
            operators,
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
        layered.prepare(&self.scene, &self.rig, &self.view, quality, work)
    }

    /// Predicted seconds of the rig's operator.
    pub fn cost(&self, transport: &dyn Transport, quality: Quality) -> Cost {
        let layered = Layered::new(&self.rig, transport);
        layered.cost(&self.scene, &self.rig, &self.view, quality)
    }

    /// True when the operator of this step of quality is at hand.
    pub fn is_prepared(&self, quality: Quality) -> bool {
        self.operators.contains_key(&quality.0)
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

    /// The pool, with its coarse pictures rendered on first use: the show's coarse step and the
    /// next finer one, whose difference estimates the error. Also true when it was made just now.
    pub fn coarse(
        &mut self,
        transport: &dyn Transport,
        work: Work<'_>,
    ) -> Result<bool, TransportError> {
        if self.pool.is_some() {
            return Ok(false);
        }
        let [cheap, fine] = coarse_steps(self.steps[0], self.finest(transport)).map(Quality);
        let n = self.rig.sources.len();
        let coarser = match fine > cheap {
            true => Pool::units(n, self.operator(transport, cheap, work)?, work)?,
            false => Vec::new(),
        };
        let coarse = Pool::units(n, self.operator(transport, fine, work)?, work)?;
        self.pool = Some(Pool::new(coarse, coarser, work));
        Ok(true)
    }
}

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
        for surface in &show.surfaces {
            if !scene.set_reflectance(&surface.name, surface.reflectance) {
                mistakes.push(mistake::of_surface(surface, &scene, spans));
            }
        }
    }
    if mistakes.is_empty() {
        show.furnish(&mut scene);
        Ok((scene, lamps))
    } else {
        Err(mistakes)
    }
}
