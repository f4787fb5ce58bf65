//! Banks given as images: images rendered elsewhere, added to those of another operator.
//!
//! An image is light that arrives in the view and does not depend on the stage: G is the sum of
//! the images, each times its setting, and of the inner operator's image of the other lights.
//! Invariant: the inner operator receives no image; if all lights are images it is not called, and
//! the quality scale has one step.

#![allow(
    clippy::indexing_slicing,
    reason = "images are numbered as they are taken from the setup"
)]

use std::sync::Arc;

use crate::contract::{check_memory, check_pictures, check_quality, check_settings};
use crate::{Cost, Prepared, Quality, Setup, Transport, TransportError, TransportWarning};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::combine::add_coloured;
use footlight_show::units::Rgb;
use footlight_stage::{Emitter, Light, Rig};

/// Seconds to add one number of an image to another.
const SECONDS_PER_NUMBER: f64 = 1.5e-9;

/// This cost in units of the inner operator, assumed to be 0.1 s. Where its unit is longer the
/// share of images is small anyway.
const UNITS_PER_NUMBER: f64 = 1.5e-8;

/// Images on top of another operator, or alone.
#[derive(Clone, Copy)]
pub struct Layered<'t> {
    /// Renders the lights that are not images; `None` when all are.
    inner: Option<&'t dyn Transport>,
}

impl<'t> Layered<'t> {
    /// The operator for `rig`, with `inner` unless every light in use is an image.
    pub fn new(rig: &Rig, inner: &'t dyn Transport) -> Layered<'t> {
        let inner = (!only_images(rig)).then_some(inner);
        Layered { inner }
    }
}

/// For each source, true when it consists of images alone, whose quality does not depend on a
/// renderer.
pub fn images_alone(rig: &Rig) -> impl Iterator<Item = bool> + '_ {
    let is_image = |e: &Emitter| matches!(rig.lights.get(e.light), Some(Light::Image(_)));
    let sources = rig.sources.iter();
    sources.map(move |s| s.emitters.iter().all(is_image))
}

/// True when at least one light is in use and all of them are images.
pub fn only_images(rig: &Rig) -> bool {
    let has_emitters = rig.sources.iter().any(|s| !s.emitters.is_empty());
    has_emitters && images_alone(rig).all(|alone| alone)
}

impl Transport for Layered<'_> {
    fn name(&self) -> &str {
        self.inner.map_or("images", Transport::name)
    }

    fn finest(&self) -> Quality {
        self.inner.map_or(Quality(1), Transport::finest)
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        check_quality(quality, self.finest())?;
        let parts = SplitSetup::new(setup)?;
        if let (Some(inner), true) = (self.inner, parts.images.is_empty()) {
            return Checked::prepare(inner, setup, quality, work);
        }
        let view = &setup.view;
        let size = (view.width, view.height);
        let wrong = |i: &&Arc<Image>| (i.width(), i.height()) != size;
        if let Some(image) = parts.images.iter().find(wrong) {
            return Err(TransportError::Scene(format!(
                "an image of {}x{} pixels does not fit a view of {}x{}",
                image.width(),
                image.height(),
                size.0,
                size.1
            )));
        }
        let inner = self
            .inner
            .map(|inner| Checked::prepare(inner, &parts.rest, quality, work))
            .transpose()?;
        Ok(Box::new(Sum { inner, size, parts }))
    }

    fn warnings(&self) -> Vec<TransportWarning> {
        self.inner.map_or_else(Vec::new, Transport::warnings)
    }

    /// Scale of the inner operator; seconds without one.
    fn cost_scale(&self, clock: &dyn Fn() -> f64, work: Work<'_>) -> Result<f64, TransportError> {
        self.inner
            .map_or(Ok(1.0), |inner| inner.cost_scale(clock, work))
    }

    fn least_bytes(&self, setup: &Setup) -> usize {
        self.inner.map_or(0, |inner| inner.least_bytes(setup))
    }

    fn usual_error(&self, setup: &Setup, quality: Quality) -> Option<f64> {
        self.inner?.usual_error(setup, quality)
    }

    fn samples(&self, quality: Quality) -> Option<f64> {
        self.inner?.samples(quality)
    }

    fn cost(&self, setup: &Setup, quality: Quality) -> Cost {
        let Ok(parts) = SplitSetup::new(setup) else {
            return Cost::default();
        };
        let inner = self
            .inner
            .map_or(Cost::default(), |inner| inner.cost(&parts.rest, quality));
        let each = match self.inner {
            Some(_) => UNITS_PER_NUMBER,
            None => SECONDS_PER_NUMBER,
        };
        let (rig, view) = (&setup.rig, &setup.view);
        let numbers = (view.width * view.height * 3 * parts.images.len()) as f64;
        Cost {
            per_image: inner.per_image + numbers * each,
            // A source has its share of the images.
            per_lone: inner.per_lone + numbers * each / rig.sources.len().max(1) as f64,
            ..inner
        }
    }
}

/// A setup split into its images and the rest, with the same sources.
struct SplitSetup {
    rest: Setup,
    images: Vec<Arc<Image>>,
    /// For each source its images, with their colours.
    own: Vec<Vec<(usize, Rgb)>>,
}

impl SplitSetup {
    fn new(setup: &Setup) -> Result<SplitSetup, TransportError> {
        let rig = &setup.rig;
        let mut others = Rig {
            lights: Vec::new(),
            sources: rig.sources.clone(),
        };
        let (mut images, mut all_own) = (Vec::new(), Vec::with_capacity(rig.sources.len()));
        // Index of each light among the images or the rest.
        let mut places = Vec::with_capacity(rig.lights.len());
        for light in &rig.lights {
            if let Light::Image(image) = light {
                places.push((true, images.len()));
                images.push(Arc::clone(image));
            } else {
                places.push((false, others.lights.len()));
                others.lights.push(light.clone());
            }
        }
        for source in &mut others.sources {
            let mut own = Vec::new();
            let mut rest = Vec::new();
            for mut emitter in source.emitters.drain(..) {
                let place = places.get(emitter.light);
                let finite = emitter.filter.0.iter().all(|c| c.is_finite());
                match place.filter(|_| finite) {
                    Some((true, image)) => own.push((*image, emitter.filter)),
                    Some((false, light)) => {
                        emitter.light = *light;
                        rest.push(emitter);
                    }
                    None => {
                        return Err(TransportError::Scene(format!(
                            "source {} has an unknown light or a filter that is not finite",
                            source.name
                        )));
                    }
                }
            }
            source.emitters = rest;
            all_own.push(own);
        }
        Ok(SplitSetup {
            rest: Setup::new(Arc::clone(&setup.scene), others, setup.view.clone()),
            images,
            own: all_own,
        })
    }

    /// Strength of each image in each channel under a setting.
    fn strengths(&self, setting: &[f64]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.images.len()];
        for (own, s) in self.own.iter().zip(setting) {
            for (image, filter) in own {
                let sum = out[*image].iter_mut();
                sum.zip(filter.0).for_each(|(to, f)| *to += s * f);
            }
        }
        out
    }

    /// The setting with zeros for sources that consist of images alone.
    fn rest_of(&self, setting: &[f64]) -> Vec<f64> {
        let sources = self.rest.rig.sources.iter().zip(setting);
        sources
            .map(|(source, s)| if source.emitters.is_empty() { 0.0 } else { *s })
            .collect()
    }
}

/// G as a sum of images and, if there are other lights, of another operator's image.
struct Sum {
    inner: Option<Box<dyn Prepared>>,
    size: (usize, usize),
    parts: SplitSetup,
}

impl Sum {
    /// Images of the lights that are not images; black, without a call, when those are off.
    fn render_inner(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        let rest: Vec<Vec<f64>> = settings.iter().map(|s| self.parts.rest_of(s)).collect();
        let lit = |setting: &Vec<f64>| setting.iter().any(|s| *s != 0.0);
        let wanted: Vec<Vec<f64>> = rest.iter().filter(|s| lit(s)).cloned().collect();
        let rendered = match &mut self.inner {
            Some(inner) if !wanted.is_empty() => inner.render(&wanted, work)?,
            _ => Vec::new(),
        };
        let mut rendered = rendered.into_iter();
        let missing = || TransportError::Scene("the renderer left out a picture".to_owned());
        let picture = |setting| match (lit(setting), &self.inner) {
            (true, Some(_)) => rendered.next().ok_or_else(missing),
            _ => Ok(Image::new(self.size.0, self.size.1)),
        };
        rest.iter().map(picture).collect()
    }
}

impl Prepared for Sum {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        work.check()?;
        check_settings(settings, self.parts.own.len())?;
        let needed = settings
            .len()
            .saturating_mul(self.size.0 * self.size.1 * 3 * size_of::<f32>());
        check_memory("the pictures of all settings", needed, work.memory)?;
        let mut out = self.render_inner(settings, work)?;
        for (done, (image, setting)) in out.iter_mut().zip(settings).enumerate() {
            work.check()?;
            let strengths = self.parts.strengths(setting);
            let images = self.parts.images.iter().map(AsRef::as_ref);
            let terms: Vec<([f64; 3], &Image)> = strengths.into_iter().zip(images).collect();
            add_coloured(image, &terms, work.threads);
            work.progress.report("images", done + 1, settings.len());
        }
        Ok(out)
    }

    fn bytes(&self) -> usize {
        self.inner.as_ref().map_or(0, |inner| inner.bytes())
    }
}

/// An operator with its images checked before use.
struct Checked {
    inner: Box<dyn Prepared>,
    view: (usize, usize),
}

impl Checked {
    fn prepare(
        operator: &dyn Transport,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        Ok(Box::new(Checked {
            inner: operator.prepare(setup, quality, work)?,
            view: (setup.view.width, setup.view.height),
        }))
    }
}

impl Prepared for Checked {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        let pictures = self.inner.render(settings, work)?;
        check_pictures(&pictures, settings.len(), self.view)?;
        Ok(pictures)
    }

    fn bytes(&self) -> usize {
        self.inner.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_show::geometry::View;
    use footlight_show::geometry::vec3;
    use footlight_stage::{Emitter, Scene, Source};

    /// Paints the coordinates of the setting into the image, and records the request.
    struct Painter;

    struct Painted(usize);

    impl Transport for Painter {
        fn name(&self) -> &str {
            "painter"
        }

        fn finest(&self) -> Quality {
            Quality(3)
        }

        fn prepare(
            &self,
            setup: &Setup,
            _: Quality,
            _: Work<'_>,
        ) -> Result<Box<dyn Prepared>, TransportError> {
            let rig = &setup.rig;
            assert!(!rig.lights.iter().any(|l| matches!(l, Light::Image(_))));
            let used = |s: &Source| s.emitters.iter().all(|e| e.light < rig.lights.len());
            assert!(rig.sources.iter().all(used));
            Ok(Box::new(Painted(0)))
        }

        fn cost(&self, _: &Setup, _: Quality) -> Cost {
            Cost {
                prepare: 1.0,
                per_source: 2.0,
                per_image: 3.0,
                per_lone: 3.0,
            }
        }
    }

    impl Prepared for Painted {
        fn render(
            &mut self,
            settings: &[Vec<f64>],
            _: Work<'_>,
        ) -> Result<Vec<Image>, TransportError> {
            self.0 += settings.len();
            let picture = |s: &Vec<f64>| {
                let value = s.iter().sum::<f64>() as f32 * 100.0;
                assert!(value != 0.0, "black is not worth asking for");
                Image::from_data(2, 1, vec![value; 6])
            };
            Ok(settings.iter().filter_map(picture).collect())
        }
    }

    fn setup(rig: &Rig) -> Setup {
        let view = View {
            from: vec3(0.0, -1.0, 0.0),
            to: vec3(0.0, 0.0, 0.0),
            fov: 40.0,
            roll: 0.0,
            width: 2,
            height: 1,
        };
        Setup::new(Scene::default(), rig.clone(), view)
    }

    fn image(values: [f32; 6]) -> Light {
        Light::Image(Arc::new(Image::from_data(2, 1, values.to_vec()).unwrap()))
    }

    fn source(emitters: &[(usize, [f64; 3])]) -> Source {
        let emitter = |(light, filter): &(usize, [f64; 3])| Emitter {
            light: *light,
            filter: Rgb(*filter),
        };
        Source {
            name: "s".to_owned(),
            emitters: emitters.iter().map(emitter).collect(),
        }
    }

    fn render(rig: &Rig, settings: &[Vec<f64>]) -> Result<Vec<Image>, TransportError> {
        let layered = Layered::new(rig, &Painter);
        let mut prepared = layered.prepare(&setup(rig), Quality(1), Work::silent())?;
        prepared.render(settings, Work::silent())
    }

    const WHITE: [f64; 3] = [1.0; 3];
    const RED: [f64; 3] = [1.0, 0.0, 0.0];

    #[test]
    fn images_alone_are_summed_and_have_one_step_of_quality() {
        let rig = Rig {
            lights: vec![
                image([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
                image([0.5, 0.0, -0.5, 0.25, 1e-3, 8.0]),
            ],
            sources: vec![source(&[(0, WHITE)]), source(&[(1, WHITE), (0, RED)])],
        };
        let settings = [vec![1.0, 0.0], vec![-2.0, 0.5], vec![0.0, 0.0]];
        let found = render(&rig, &settings).unwrap();
        assert_eq!(found[0].data(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let mixed = [-1.25, -4.0, -6.25, -5.875, -9.9995, -8.0];
        assert_eq!(found[1].data(), mixed);
        assert_eq!(found[2], Image::new(2, 1));
        let layered = Layered::new(&rig, &Painter);
        assert_eq!((layered.finest(), layered.name()), (Quality(1), "images"));
        let fine = layered.prepare(&setup(&rig), Quality(2), Work::silent());
        assert!(matches!(fine, Err(TransportError::Quality(2, 1))));
        let cost = layered.cost(&setup(&rig), Quality(1));
        assert!(cost.prepare == 0.0 && cost.per_source == 0.0 && cost.per_image > 0.0);
    }

    #[test]
    fn other_lights_go_to_the_operator_underneath() {
        let spot = Light::Panel {
            material: 0,
            radiance: Rgb::WHITE,
        };
        let rig = Rig {
            lights: vec![image([1.0; 6]), spot],
            sources: vec![source(&[(0, WHITE)]), source(&[(1, WHITE)])],
        };
        let settings = [vec![1.0, 0.0], vec![2.0, 3.0], vec![0.0, -1.0]];
        let found = render(&rig, &settings).unwrap();
        for (image, value) in found.iter().zip([1.0, 302.0, -100.0]) {
            assert_eq!(image.data(), [value; 6]);
        }
        let layered = Layered::new(&rig, &Painter);
        assert_eq!((layered.finest(), layered.name()), (Quality(3), "painter"));
        let cost = layered.cost(&setup(&rig), Quality(1));
        assert!(cost.prepare == 1.0 && cost.per_source == 2.0 && cost.per_image > 3.0);
    }

    /// Returns one image for any request.
    struct One(Image);

    impl Prepared for One {
        fn render(&mut self, _: &[Vec<f64>], _: Work<'_>) -> Result<Vec<Image>, TransportError> {
            Ok(vec![self.0.clone()])
        }
    }

    #[test]
    fn pictures_of_another_number_or_size_are_refused() {
        let rendered = |image: Image, settings: usize| {
            let inner: Box<dyn Prepared> = Box::new(One(image));
            let mut operator = Checked {
                inner,
                view: (2, 1),
            };
            operator.render(&vec![vec![1.0]; settings], Work::silent())
        };
        assert!(rendered(Image::new(2, 1), 1).is_ok());
        for (size, settings) in [((2, 1), 2), ((1, 2), 1)] {
            let refused = rendered(Image::new(size.0, size.1), settings);
            assert!(
                matches!(refused, Err(TransportError::Pictures { .. })),
                "{size:?}"
            );
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let mut rig = Rig {
            lights: vec![image([1.0; 6])],
            sources: vec![source(&[(0, WHITE)])],
        };
        for wrong in [vec![], vec![1.0, 2.0], vec![f64::NAN]] {
            let refused = render(&rig, &[wrong]);
            assert!(matches!(
                refused,
                Err(TransportError::Setting { expected: 1 })
            ));
        }
        rig.lights[0] = Light::Image(Arc::new(Image::new(1, 2)));
        assert!(matches!(render(&rig, &[]), Err(TransportError::Scene(_))));
        rig.sources[0].emitters[0].light = 7;
        assert!(matches!(render(&rig, &[]), Err(TransportError::Scene(_))));
    }
}
