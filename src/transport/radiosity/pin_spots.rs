//! Pin spots in small scenes.
//!
//! A very narrow beam lights a place smaller than the elements of the hemicube's mesh, and a
//! hemicube's pixel; the light that it reflects would be off by a tenth. So the pictures of such
//! lights are made by final gathering, which follows them from the lamp, and added to those of the
//! other lights.

use crate::gather::GatherStage;
use crate::hemicube::HemicubeScene;
use crate::hemicube::step::HemicubeStep;
use crate::threads::Threads;
use crate::unit_lights::Composed;
use crate::{Prepared, Quality, Setup, TransportError};
use footlight_host::work::Work;
use footlight_picture::{Image, combine};
use footlight_show::geometry::diameter;
use footlight_stage::{Emitter, Light, Rig, Source};

/// Beam angle of a pin spot, degrees, exclusive.
const PIN: f64 = 4.0;
/// Greatest radius of the place that it lights, relative to the scene's diameter. The beam of a
/// light far away is narrow too, but lights a whole stage.
const SMALL: f64 = 0.015;

/// A setup whose pin spots are set apart.
pub struct PinSpots {
    /// The pin spots alone.
    pub pins: Setup,
    /// All other lights.
    pub others: Setup,
}

impl PinSpots {
    /// `None` for a setup without pin spots.
    pub fn of(setup: &Setup) -> Option<PinSpots> {
        let corners = setup.scene.polygons.iter().flat_map(|p| p.vertices.iter());
        let small = SMALL * diameter(corners);
        let is_pin = |light: &Light| match light {
            Light::Spot(spot) if spot.beam < PIN => {
                let length = (spot.aim - spot.position).length();
                length * (0.5 * spot.beam).to_radians().tan() < small
            }
            _ => false,
        };
        setup.rig.lights.iter().any(is_pin).then(|| PinSpots {
            pins: only(setup, is_pin),
            others: only(setup, |light| !is_pin(light)),
        })
    }

    /// Prepares the other lights; pin spots are prepared when one is lit.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable setup or too small a budget, and on cancel.
    pub fn prepare(self, quality: Quality, work: Work<'_>) -> Result<WithPins, TransportError> {
        let scene = HemicubeScene::new(&self.others, HemicubeStep::of(quality)?, work)?;
        Ok(WithPins {
            others: Composed::new(scene, &self.others.rig, work)?,
            by_rays: None,
            pins: self.pins,
            quality,
        })
    }
}

/// The setup with the lights that `keep` accepts; its sources stay, some without light.
fn only(setup: &Setup, keep: impl Fn(&Light) -> bool) -> Setup {
    let mut lights = Vec::new();
    let place = |light: &Light| {
        keep(light).then(|| {
            lights.push(light.clone());
            lights.len() - 1
        })
    };
    let places: Vec<Option<usize>> = setup.rig.lights.iter().map(place).collect();
    let emitter = |emitter: &Emitter| {
        let light = places.get(emitter.light).copied().flatten()?;
        Some(Emitter {
            light,
            filter: emitter.filter,
        })
    };
    let source = |source: &Source| Source {
        name: source.name.clone(),
        emitters: source.emitters.iter().filter_map(emitter).collect(),
    };
    let sources = setup.rig.sources.iter().map(source).collect();
    Setup::new(
        setup.scene.clone(),
        Rig { lights, sources },
        setup.view.clone(),
    )
}

/// Radiosity of a small scene, with final gathering for its pin spots.
pub struct WithPins {
    others: Composed<HemicubeScene>,
    /// Made when a pin spot is lit.
    by_rays: Option<Composed<GatherStage>>,
    pins: Setup,
    quality: Quality,
}

impl WithPins {
    /// True when a setting lights a pin spot.
    fn are_lit(&self, setting: &[f64]) -> bool {
        let mut pairs = self.pins.rig.sources.iter().zip(setting);
        pairs.any(|(source, level)| *level != 0.0 && !source.emitters.is_empty())
    }
}

impl Prepared for WithPins {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        let held = self.by_rays.as_ref().map_or(0, Prepared::bytes);
        let mut images = self.others.render(settings, work.holding(held))?;
        if !settings.iter().any(|setting| self.are_lit(setting)) {
            return Ok(images);
        }
        let bytes = images.iter().map(|image| size_of_val(image.data()));
        let work = work.holding(self.others.bytes() + bytes.sum::<usize>());
        let by_rays = match self.by_rays.take() {
            Some(by_rays) => by_rays,
            None => Threads::new(work)?.install(|| {
                let stage = GatherStage::new(&self.pins, self.quality, work)?;
                Composed::new(stage, &self.pins.rig, work)
            })?,
        };
        let by_rays = self.by_rays.insert(by_rays);
        let pins = by_rays.render(settings, work)?;
        for (image, pins) in images.iter_mut().zip(&pins) {
            combine::add(image, &[(1.0, pins)], work.threads);
        }
        Ok(images)
    }

    fn bytes(&self) -> usize {
        self.others.bytes() + self.by_rays.as_ref().map_or(0, Prepared::bytes)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::Transport;
    use crate::gather::first_bounce::tests::{setup, wall};
    use crate::radiosity::Radiosity;
    use footlight_show::units::Rgb;

    /// Images of the settings of a pin spot and of a wider one, each a source.
    fn images(settings: &[[f64; 2]]) -> Vec<Image> {
        let setup = setup();
        let source = |light: usize| Source {
            name: light.to_string(),
            emitters: vec![Emitter {
                light,
                filter: Rgb::WHITE,
            }],
        };
        let rig = Rig {
            lights: setup.rig.lights.clone(),
            sources: vec![source(0), source(1)],
        };
        let (setup, work) = (Setup::new(setup.scene, rig, setup.view), Work::silent());
        let mut operator = Radiosity.prepare(&setup, Quality(2), work).unwrap();
        let settings: Vec<Vec<f64>> = settings.iter().map(|s| s.to_vec()).collect();
        operator.render(&settings, work).unwrap()
    }

    #[test]
    fn a_pin_spot_on_a_ceiling_lights_a_wall_as_a_point_does() {
        let image = &images(&[[1.0, 0.0]])[0];
        let mut mean = 0.0;
        for (at, pixel) in image.data().chunks_exact(3).enumerate() {
            for (found, exact) in pixel.iter().zip(wall(at % 24, at / 24)) {
                let found = f64::from(*found) / exact;
                assert!((found - 1.0).abs() < 0.04, "{at}: {found}");
                mean += found / (24.0 * 18.0 * 3.0);
            }
        }
        assert!((mean - 1.0).abs() < 0.01, "{mean}");
    }

    #[test]
    fn pictures_add_up_and_darkness_is_black() {
        let all = images(&[[0.0, 1.0], [1.0, 0.0], [0.5, 2.0], [0.0, 0.0]]);
        let [one, pin, both, dark] = &all[..] else {
            panic!("four images");
        };
        let parts = one.data().iter().zip(pin.data());
        for ((one, pin), both) in parts.zip(both.data()) {
            let sum = 2.0 * one + 0.5 * pin;
            assert!((sum - both).abs() <= 1e-6 * sum.abs(), "{sum} {both}");
        }
        assert!(dark.data().iter().all(|light| *light == 0.0));
        // Without the pin spot, the picture is the hemicubes' to the bit.
        assert_eq!(one.data(), images(&[[0.0, 1.0]])[0].data());
    }
}
