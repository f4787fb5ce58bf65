//! Reads the files of a show and builds its scene, rig and view as one [`Setup`].

mod diagnostics;
#[cfg(test)]
mod gloss_test;
mod luminaires;

use std::f64::consts::PI;
use std::sync::Arc;

use footlight_host::files::Files;
use footlight_picture::Image;
use footlight_show::diagnostic::Diagnostic;
use footlight_show::geometry::View;
use footlight_show::geometry::shape::Shape;
use footlight_show::geometry::solid::Solid;
use footlight_show::geometry::{Vec3, bounds, vec3};
use footlight_show::lang::SpanMap;
use footlight_show::model::{self as show, Show};
use footlight_show::model::{ImageFile, LightKind, Luminaire, Pose};
use footlight_show::timeline::Bounced;
use footlight_show::units::Rgb;
use footlight_stage::import;
use footlight_stage::luminaire_asset::LuminaireAssets;
use footlight_stage::rig;
use footlight_stage::rig_error::RigError;
use footlight_stage::stage_file::Options;
use footlight_stage::{
    Emitter, Gloss, Lamp, Light, Rig, Scene, Shading, StageCamera, StillImages, still,
};
use footlight_transport::Setup;
use footlight_transport::layered::only_images;

/// Approximate bytes of a polygon besides its corners.
const POLYGON_BYTES: usize = 64;

/// A text to compile, and the source of the files that it names.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// Name of the text in diagnostics.
    pub name: &'a str,
    pub text: &'a str,
    /// Name of the view; `None` uses the show's first.
    pub view: Option<&'a str>,
    pub files: &'a dyn Files,
    /// Most bytes of its stage, images and luminaires.
    pub memory: usize,
}

impl Source<'_> {
    /// The source with `held` bytes less memory.
    #[must_use]
    pub(super) fn holding(self, held: usize) -> Self {
        Source {
            memory: self.memory.saturating_sub(held),
            ..self
        }
    }
}

/// Inputs of a scene; equal inputs make equal scenes.
#[derive(Clone, Debug, PartialEq)]
struct Inputs {
    stages: Vec<(String, Options)>,
    surfaces: Vec<SurfaceInput>,
    shapes: Vec<(String, Shape)>,
}

/// Name, reflectance, gloss and solids.
type SurfaceInput = (String, Option<Rgb>, Option<f64>, Vec<Solid>);

impl Inputs {
    fn of(show: &Show) -> Inputs {
        let stages = show
            .stages
            .iter()
            .map(|s| (s.path.clone(), options(s, show)));
        let surfaces = show.surfaces.iter();
        let surfaces = surfaces.map(|s| (s.name.clone(), s.reflectance, s.gloss, s.solids.clone()));
        let shapes = show.shapes().map(|(name, shape)| (name.to_owned(), shape));
        Inputs {
            stages: stages.collect(),
            surfaces: surfaces.collect(),
            shapes: shapes.collect(),
        }
    }
}

/// A setup with the data read for it, so that an edit reads only what changed.
#[derive(Debug)]
pub(super) struct Loaded {
    inputs: Inputs,
    images: StillImages,
    luminaires: LuminaireAssets,
    cameras: Vec<StageCamera>,
    notes: Notes,
    pub setup: Setup,
}

/// For each stage, by index, contents that are not read unchanged.
type Notes = Vec<(usize, Vec<String>)>;

impl Loaded {
    /// The setup for another view of the show.
    pub fn setup_from(&self, show: &Show, view: &str) -> Option<Setup> {
        let view = show.views.iter().find(|v| v.name == view)?;
        Some(Setup {
            view: camera_of(view, &self.cameras)?,
            ..self.setup.clone()
        })
    }

    /// Adds the reflected light of heads.
    ///
    /// # Errors
    /// When a light does not fit.
    pub fn add_bounced(
        &mut self,
        (show, spans): (&Show, &SpanMap),
        bounced: &[Bounced],
    ) -> Result<(), Diagnostic> {
        if bounced.is_empty() {
            return Ok(());
        }
        let (mut rig, scene) = (Rig::clone(&self.setup.rig), &self.setup.scene);
        let (images, luminaires) = (&self.images, &self.luminaires);
        rig::add_bounced(&mut rig, (show, bounced), scene, images, luminaires)
            .map_err(|error| diagnostics::of_rig(&error, scene, spans))?;
        self.setup.rig = Arc::new(rig);
        Ok(())
    }

    /// A light with a head in a pose.
    pub fn posed(&self, light: &Luminaire, pose: Pose) -> Vec<Light> {
        let scene = &self.setup.scene;
        let lights = rig::posed(light, pose, scene, &self.images, &self.luminaires);
        // The light was resolved in another pose before.
        lights.unwrap_or_default()
    }

    /// The setup with heads as fixed lights in these poses, with a source for each of the show's
    /// own coordinates.
    ///
    /// # Errors
    /// When a light does not fit.
    pub fn standing(&self, show: &Show, poses: &[Pose]) -> Result<Setup, Vec<RigError>> {
        let show = rig::standing(show, poses);
        let rig = rig::rig_with(&show, &self.setup.scene, &self.images, &self.luminaires)?;
        Ok(Setup {
            rig: Arc::new(rig),
            ..self.setup.clone()
        })
    }

    /// Approximate bytes of scene, lights and images.
    pub fn bytes(&self) -> usize {
        let images = self.images.values().map(|image| size_of_val(image.data()));
        scene_bytes(&self.setup.scene)
            + rig_bytes(&self.setup.rig)
            + self.luminaires.bytes()
            + images.sum::<usize>()
    }
}

fn scene_bytes(scene: &Scene) -> usize {
    let polygons = scene.polygons.iter();
    let corners: usize = polygons.map(|polygon| polygon.vertices.len()).sum();
    let shadings = scene
        .polygons
        .iter()
        .filter(|p| p.shading.is_some())
        .count();
    let textures = scene.materials.iter().filter_map(|m| m.texture.as_ref());
    scene.polygons.len() * POLYGON_BYTES
        + corners * size_of::<Vec3>()
        + shadings * size_of::<Shading>()
        + textures.map(|t| t.pixels.bytes()).sum::<usize>()
}

fn rig_bytes(rig: &Rig) -> usize {
    let emitters: usize = rig.sources.iter().map(|s| s.emitters.len()).sum();
    rig.lights.len() * size_of::<Light>() + emitters * size_of::<Emitter>()
}

/// Loads the setup of `show`, reusing scene and images of `old` where the inputs are equal; `None`
/// when the show has no stage or no view. If every bank is an image neither is needed: the view
/// then has their size. Also returns warnings about contents of the stages' files that are not
/// rendered.
///
/// # Errors
/// A diagnostic for every file that cannot be used and every light that does not fit.
pub(super) fn load(
    show: &Show,
    spans: &SpanMap,
    source: Source<'_>,
    old: Option<&Loaded>,
) -> Result<(Option<Loaded>, Vec<Diagnostic>), Vec<Diagnostic>> {
    let inputs = Inputs::of(show);
    let stages = match old.filter(|l| l.inputs == inputs) {
        Some(old) => Ok(Stages {
            scene: Arc::clone(&old.setup.scene),
            lamps: old.luminaires.lamps.clone(),
            cameras: old.cameras.clone(),
            notes: old.notes.clone(),
        }),
        None => read_scene(show, spans, source),
    };
    let stages = stages.map(|stages| stages.with_haze(show.haze));
    // One budget for everything that is read.
    let held = stages.as_ref().map_or(0, |s| scene_bytes(&s.scene));
    let source = source.holding(held);
    let none = StillImages::new();
    let known = old.map_or(&none, |l| &l.images);
    let images = read_images(show, spans, source, known);
    let held = images
        .iter()
        .flat_map(StillImages::values)
        .map(|image| size_of_val(image.data()));
    let source = source.holding(held.sum());
    let luminaires = luminaires::read(show, spans, source, old.map(|l| &l.luminaires));
    let (stages, images, (mut luminaires, mut warnings)) = match (stages, images, luminaires) {
        (Ok(stages), Ok(images), Ok(luminaires)) => (stages, images, luminaires),
        (stages, images, luminaires) => {
            let errors = [stages.err(), images.err(), luminaires.err()];
            return Err(errors.into_iter().flatten().flatten().collect());
        }
    };
    let Stages {
        scene,
        lamps,
        cameras,
        notes,
    } = stages;
    luminaires.lamps = lamps;
    let rig = rig::rig_with(show, &scene, &images, &luminaires);
    let rig = rig.map_err(|errors| {
        let diagnostics = errors.iter().map(|e| diagnostics::of_rig(e, &scene, spans));
        diagnostics.collect::<Vec<_>>()
    })?;
    let view = view(show, &cameras, spans).map_err(|error| vec![error])?;
    let view = if only_images(&rig) {
        view.or_else(|| images.values().next().map(|i| view_of(i)))
    } else if show.stages.is_empty() && show.surfaces.iter().all(|s| s.solids.is_empty()) {
        None
    } else {
        view
    };
    let stages = notes
        .iter()
        .filter_map(|(i, of)| Some((show.stages.get(*i)?, of)));
    let of_stages =
        stages.map(|(stage, of)| diagnostics::of_file_notes(&stage.path, stage.id, of, spans));
    warnings.splice(0..0, of_stages);
    let Some(view) = view else {
        return Ok((None, warnings));
    };
    warnings.extend(small_stage(show, &scene, &view, spans));
    warnings.extend(shining_sets(show, &scene, spans));
    // If the rig is unchanged, keep the old value, so that comparisons are cheap.
    let rig = match old {
        Some(old) if *old.setup.rig == rig => Arc::clone(&old.setup.rig),
        _ => Arc::new(rig),
    };
    let loaded = Loaded {
        inputs,
        images,
        luminaires,
        cameras,
        notes,
        setup: Setup { scene, rig, view },
    };
    Ok((Some(loaded), warnings))
}

/// Share of the image below which a set probably uses other units than assumed.
const SMALL: f64 = 5e-3;

/// A warning when the whole set is a dot in the view.
fn small_stage(show: &Show, scene: &Scene, view: &View, spans: &SpanMap) -> Option<Diagnostic> {
    let stage = show.stages.first()?;
    let [low, high] = bounds(scene.polygons.iter().flat_map(|p| p.vertices.iter()));
    let radius = (high - low).length() / 2.0;
    let distance = ((low + high) * 0.5 - view.from).length();
    // Half the image's height and width at the set's distance.
    let height = distance * (view.fov.to_radians() / 2.0).tan();
    let width = height * view.width as f64 / view.height as f64;
    let share = PI * radius * radius / (4.0 * height * width);
    (radius > 0.0 && share < SMALL).then(|| {
        let unit = stage.place.scale * height / radius;
        diagnostics::of_small_stage(stage, 2.0 * radius, distance, unit, spans)
    })
}

/// Polygons of a panel that is no lamp but the set, which may be one wall where it has fewer.
const MANY: usize = 100;

/// A warning for each panel that has most of the set's area, in many polygons.
fn shining_sets(show: &Show, scene: &Scene, spans: &SpanMap) -> Vec<Diagnostic> {
    let areas = scene.areas();
    let whole: f64 = areas.iter().sum();
    let of = |light: &Luminaire| {
        let LightKind::Panel { material, .. } = &light.kind else {
            return None;
        };
        let own = scene
            .materials
            .iter()
            .position(|own| own.name == *material)?;
        if *areas.get(own)? <= 0.5 * whole {
            return None;
        }
        let polygons = scene.polygons.iter().filter(|p| p.material == own).count();
        (polygons >= MANY).then(|| diagnostics::of_shining_set(light, material, polygons, spans))
    };
    show.lights.iter().filter_map(of).collect()
}

/// The show's view; a camera of the stages is looked up.
fn view(show: &Show, cameras: &[StageCamera], spans: &SpanMap) -> Result<Option<View>, Diagnostic> {
    let Some(view) = show.view() else {
        return Ok(None);
    };
    match (camera_of(view, cameras), &view.imported) {
        (None, Some(name)) => Err(diagnostics::of_camera((view, name), cameras, spans)),
        (camera, _) => Ok(camera),
    }
}

/// A view from a camera of the stages; `None` if they have no camera of its name.
fn camera_of(view: &show::NamedView, cameras: &[StageCamera]) -> Option<View> {
    let own = &view.camera;
    match &view.imported {
        None => Some(own.clone()),
        Some(name) => {
            let camera = cameras.iter().find(|camera| camera.name == *name)?;
            Some(camera.view([own.width, own.height]))
        }
    }
}

/// The images given as banks, all of one size, which is the view's if there is one.
fn read_images(
    show: &Show,
    spans: &SpanMap,
    source: Source<'_>,
    known: &StillImages,
) -> Result<StillImages, Vec<Diagnostic>> {
    let wanted: Vec<ImageFile> = show.images().map(|(_, file)| file.clone()).collect();
    let images = still::read(source.files, &wanted, known, source.memory);
    let images = images.map_err(|refused| {
        let of_one = |one| diagnostics::of_image(one, show, spans);
        refused.iter().flat_map(of_one).collect::<Vec<_>>()
    })?;
    let named = || {
        let read = |(id, file)| images.get(file).map(|image| (id, file, size(image)));
        show.images().filter_map(read)
    };
    let of_view = show.view().map(|v| {
        let camera = (v.camera.width, v.camera.height);
        (camera, diagnostics::view_name(v))
    });
    let of_first = || {
        let (_, file, size) = named().next()?;
        Some((size, diagnostics::file_name(file)))
    };
    let Some((wanted, of)) = of_view.or_else(of_first) else {
        return Ok(images);
    };
    let other = named().filter(|(_, _, size)| *size != wanted);
    let errors: Vec<Diagnostic> = other
        .map(|(id, file, size)| diagnostics::of_size((id, file), size, wanted, &of, spans))
        .collect();
    if errors.is_empty() {
        Ok(images)
    } else {
        Err(errors)
    }
}

fn size(image: &Image) -> (usize, usize) {
    (image.width(), image.height())
}

/// A view with the size of `image`, for a show of images only; its position does not matter.
fn view_of(image: &Image) -> View {
    View {
        from: vec3(0.0, -1.0, 0.0),
        to: Vec3::ZERO,
        fov: 40.0,
        roll: 0.0,
        width: image.width(),
        height: image.height(),
    }
}

/// Options for reading a stage's file.
fn options(stage: &show::Stage, show: &Show) -> Options {
    let replaced = show.surfaces.iter().filter(|s| s.solids.is_empty());
    let panels = show.lights.iter().filter_map(|light| match &light.kind {
        show::LightKind::Panel { material, .. } => Some(material),
        _ => None,
    });
    Options {
        z_up: stage.z_up,
        one_sided: stage.one_sided,
        matt: stage.matt,
        place: stage.place,
        parts: replaced.map(|s| &s.name).chain(panels).cloned().collect(),
    }
}

/// Data of the stages' files.
struct Stages {
    scene: Arc<Scene>,
    lamps: Vec<Lamp>,
    cameras: Vec<StageCamera>,
    notes: Notes,
}

impl Stages {
    /// The stages in this haze. Files are not read again, and an unchanged scene stays shared.
    fn with_haze(mut self, haze: Option<show::Haze>) -> Stages {
        if self.scene.haze != haze {
            Arc::make_mut(&mut self.scene).haze = haze;
        }
        self
    }
}

fn read_scene(show: &Show, spans: &SpanMap, source: Source<'_>) -> Result<Stages, Vec<Diagnostic>> {
    let mut scene = Scene::default();
    let mut notes = Notes::new();
    let (mut lamps, mut cameras) = (Vec::new(), Vec::new());
    let mut errors = Vec::new();
    for (number, stage) in show.stages.iter().enumerate() {
        match import::read(
            source.files,
            &stage.path,
            &options(stage, show),
            source.holding(scene_bytes(&scene)).memory,
        ) {
            Ok(read) => {
                if !read.summary.left_out.is_empty() {
                    notes.push((number, read.summary.left_out));
                }
                scene.append(read.scene);
                lamps.extend(read.lamps);
                cameras.extend(read.cameras);
            }
            Err(error) => errors.push(diagnostics::of_stage(&error, stage, spans)),
        }
    }
    if errors.is_empty() {
        errors = apply_materials(show, spans, &mut scene);
    }
    if errors.is_empty() {
        rig::add_light_geometry(show, &mut scene);
        Ok(Stages {
            scene: Arc::new(scene),
            lamps,
            cameras,
            notes,
        })
    } else {
        Err(errors)
    }
}

/// Applies the show's surfaces to the scene: replaced materials, then the solids of new materials.
/// Returns the errors.
fn apply_materials(show: &Show, spans: &SpanMap, scene: &mut Scene) -> Vec<Diagnostic> {
    let mut errors = Vec::new();
    let (own, replaced): (Vec<_>, Vec<_>) =
        show.surfaces.iter().partition(|s| !s.solids.is_empty());
    for surface in replaced {
        let is_known = scene.materials.iter().any(|m| m.name == surface.name)
            && surface
                .reflectance
                .is_none_or(|reflectance| scene.set_reflectance(&surface.name, reflectance));
        if !is_known {
            errors.push(diagnostics::of_surface(surface, scene, spans));
        }
    }
    let mut fronts = Vec::new();
    for surface in own {
        if scene.materials.iter().any(|m| m.name == surface.name) {
            errors.push(diagnostics::of_own_surface(surface, spans));
            continue;
        }
        for solid in &surface.solids {
            let first = scene.polygons.len();
            let reflectance = surface.reflectance.unwrap_or_default();
            scene.add_solid(&surface.name, reflectance, solid);
            if solid.two_sided() {
                fronts.extend(first..scene.polygons.len());
            }
        }
    }
    scene.add_backs(&fronts);
    for surface in &show.surfaces {
        let own = scene
            .materials
            .iter_mut()
            .filter(|m| m.name == surface.name);
        if let Some(roughness) = surface.gloss {
            own.for_each(|material| match &mut material.gloss {
                // A metal keeps its colour.
                Some(gloss) if gloss.is_metal => gloss.roughness = roughness,
                gloss => *gloss = (roughness < 1.0).then(|| Gloss::varnish(roughness)),
            });
        }
    }
    errors
}
