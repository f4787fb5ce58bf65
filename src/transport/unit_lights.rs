//! Common part of both methods: every light is solved once at unit strength, and images of settings
//! are composed from these. Large pictures are made in bands of rows, so that memory follows the
//! band.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light of the rig, or each row of the picture"
)]

use crate::contract::{check_memory, check_settings};
use crate::surfaces::camera::Window;
use crate::threads::Threads;
use crate::{Prepared, TransportError};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_stage::{Light, Rig};
use std::ops::Range;
use std::sync::Arc;

/// Rows that a band shares with the next, and in which the pictures of both are blended.
const SHARED_ROWS: usize = 16;

/// A scene prepared for a view, from which bands of the picture are made.
pub trait BandedScene: Send + Sync + Sized {
    /// A band.
    type Band: UnitLights;

    /// The picture and its bands.
    fn bands(&self) -> &Bands;

    /// Bytes held.
    fn bytes(&self) -> usize;

    /// Prepares a band, whose rows are `window`.
    ///
    /// # Errors
    /// [`TransportError`] for too small a budget, and on cancel.
    fn band(self: Arc<Self>, window: Window, work: Work<'_>) -> Result<Self::Band, TransportError>;

    /// The whole picture as one band.
    #[cfg(test)]
    fn whole(self: &Arc<Self>, work: Work<'_>) -> Result<Self::Band, TransportError> {
        let window = self.bands().window;
        Threads::new(work)?.install(|| Arc::clone(self).band(window, work))
    }
}

/// Some rows of the picture, with lights at unit strength.
pub trait UnitLights: Send {
    /// Bytes held, without those of the scene.
    fn bytes(&self) -> usize;

    /// Solves the `wanted` lights that are not solved yet.
    ///
    /// # Errors
    /// [`TransportError`] for too small a budget, and on cancel.
    fn solve(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), TransportError>;

    /// Image of lights of given strengths, all of which are solved.
    fn picture(&self, strengths: &[[f64; 3]]) -> Image;
}

/// A picture and its bands of rows.
#[derive(Clone, Debug)]
pub struct Bands {
    /// The whole picture.
    pub window: Window,
    /// The rows of each band. Apart from the first, each begins [`SHARED_ROWS`] before the end of
    /// the one above.
    pub rows: Vec<Range<usize>>,
}

impl Bands {
    /// Splits a picture, given the bytes of a pixel and of a band.
    pub fn new(window: Window, pixel_bytes: usize, band_bytes: usize) -> Bands {
        let most = band_bytes / (pixel_bytes * window.width).max(1);
        let count = window.height.div_ceil(most.max(4 * SHARED_ROWS)).max(1);
        let start = |band: usize| band * window.height / count;
        let band = |at| start(at).saturating_sub(SHARED_ROWS)..start(at + 1);
        Bands {
            window,
            rows: (0..count).map(band).collect(),
        }
    }

    /// The windows of the bands, without the rows that each shares with the one above.
    pub fn apart(&self) -> impl Iterator<Item = Window> {
        let starts = std::iter::once(0).chain(self.rows.iter().map(|rows| rows.end));
        let pairs = starts.zip(&self.rows);
        pairs.map(|(start, rows)| self.window.rows(start..rows.end))
    }

    /// True when the picture is a single band.
    pub fn is_whole(&self) -> bool {
        self.rows.len() == 1
    }
}

/// A scene prepared for the settings of a rig.
pub struct Composed<S: BandedScene> {
    scene: Arc<S>,
    /// The bands that are held.
    held: Vec<Option<S::Band>>,
    /// Number of calls.
    calls: usize,
    rig: Arc<Rig>,
    first_equal: Vec<usize>,
}

impl<S: BandedScene> Composed<S> {
    /// A scene with its first band, for the lights of a rig.
    ///
    /// # Errors
    /// [`TransportError`] for too small a budget, and on cancel.
    pub fn new(scene: S, rig: &Arc<Rig>, work: Work<'_>) -> Result<Composed<S>, TransportError> {
        let mut composed = Composed {
            held: scene.bands().rows.iter().map(|_| None).collect(),
            scene: Arc::new(scene),
            calls: 0,
            rig: Arc::clone(rig),
            first_equal: first_equal(&rig.lights),
        };
        composed.band(0, work)?;
        Ok(composed)
    }

    /// The band of an index, made unless it is held, and the memory that it leaves.
    fn band<'w>(
        &mut self,
        at: usize,
        work: Work<'w>,
    ) -> Result<(&mut S::Band, Work<'w>), TransportError> {
        let held = self.held[at].take();
        let others = self.bytes();
        let band = match held {
            Some(band) => band,
            None => {
                let Bands { window, rows } = self.scene.bands();
                let window = window.rows(rows[at].clone());
                Arc::clone(&self.scene).band(window, work.holding(others))?
            }
        };
        let left = work.holding(others + band.bytes());
        Ok((self.held[at].insert(band), left))
    }

    /// True when a band stays in memory for later calls. The first call of several bands keeps
    /// none, as most pictures are rendered once.
    fn stays(&self, work: Work<'_>) -> bool {
        self.scene.bands().is_whole() || self.calls > 1 && self.bytes() <= work.memory / 2
    }
}

impl<S: BandedScene> Prepared for Composed<S> {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        check_settings(settings, self.rig.sources.len())?;
        self.calls += 1;
        let strengths = settings.iter();
        let strengths = strengths.map(|s| strengths_of(&self.rig, &self.first_equal, s));
        let strengths: Vec<Vec<[f64; 3]>> = strengths.collect();
        let is_lit = |l: &usize| strengths.iter().any(|s| s[*l].iter().any(|x| *x != 0.0));
        let wanted: Vec<usize> = (0..self.rig.lights.len()).filter(is_lit).collect();
        let bands = self.scene.bands().clone();
        let Window { width, height, .. } = bands.window;
        let needed = settings.len() * width * height * size_of::<[f32; 3]>();
        check_memory("the pictures", needed, work.holding(self.bytes()).memory)?;
        let all = bands.rows.len() * settings.len();
        let mut images = Vec::with_capacity(settings.len());
        Threads::new(work)?.install(|| {
            for (at, rows) in bands.rows.iter().enumerate() {
                let work = match bands.is_whole() {
                    true => work,
                    false => work.holding(needed),
                };
                let (band, left) = self.band(at, work)?;
                band.solve(&wanted, left)?;
                for (number, strengths) in strengths.iter().enumerate() {
                    work.check()?;
                    let done = at * settings.len() + number;
                    work.progress.report("pictures", done, all);
                    let picture = band.picture(strengths);
                    if bands.is_whole() {
                        images.push(picture);
                        continue;
                    }
                    if at == 0 {
                        images.push(Image::new(width, height));
                    }
                    blend(&mut images[number], rows.start, &picture);
                }
                if !self.stays(work) {
                    self.held[at] = None;
                }
            }
            work.progress.report("pictures", all, all);
            Ok(images)
        })
    }

    fn bytes(&self) -> usize {
        let bands = self.held.iter().flatten();
        self.scene.bytes() + bands.map(S::Band::bytes).sum::<usize>()
    }
}

/// Puts a band that starts at a row into the picture; its first rows, unless it is the uppermost,
/// are blended with those of the band above.
fn blend(picture: &mut Image, start: usize, band: &Image) {
    let width = 3 * band.width();
    let rows = band.data().chunks_exact(width.max(1)).enumerate();
    for (y, row) in rows {
        let new = match start {
            0 => 1.0,
            _ => ((y as f32 + 0.5) / SHARED_ROWS as f32).min(1.0),
        };
        let out = &mut picture.data_mut()[(start + y) * width..][..width];
        for (out, value) in out.iter_mut().zip(row) {
            *out += new * (value - *out);
        }
    }
}

/// Strength of each light in each channel under a setting; the strength of equal lights is added to
/// the first of them.
pub fn strengths_of(rig: &Rig, first_equal: &[usize], setting: &[f64]) -> Vec<[f64; 3]> {
    let mut out = vec![[0.0; 3]; rig.lights.len()];
    for (source, s) in rig.sources.iter().zip(setting) {
        for emitter in &source.emitters {
            let colour = rig.lights[emitter.light].strength().0;
            let first = first_equal[emitter.light];
            for c in 0..3 {
                out[first][c] += s * emitter.filter.0[c] * colour[c];
            }
        }
    }
    out
}

/// For each light the first panel of the same material, or itself.
pub fn first_equal(lights: &[Light]) -> Vec<usize> {
    let material = |light: &Light| match light {
        Light::Panel { material, .. } => Some(*material),
        _ => None,
    };
    let first = |(i, light): (usize, &Light)| {
        let own = material(light);
        let is_equal = |other: &Light| own.is_some() && material(other) == own;
        lights.iter().position(is_equal).unwrap_or(i)
    };
    lights.iter().enumerate().map(first).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::gather::GatherStage;
    use crate::hemicube::HemicubeScene;
    use crate::hemicube::sources::tests::corner;
    use crate::hemicube::step::HemicubeStep;
    use crate::{Quality, Setup};

    /// A scene whose picture is made in these bands.
    struct InBands<S>(Arc<S>, Bands);

    impl<S: BandedScene> BandedScene for InBands<S> {
        type Band = S::Band;

        fn bands(&self) -> &Bands {
            &self.1
        }

        fn bytes(&self) -> usize {
            self.0.bytes()
        }

        fn band(
            self: Arc<Self>,
            window: Window,
            work: Work<'_>,
        ) -> Result<S::Band, TransportError> {
            Arc::clone(&self.0).band(window, work)
        }
    }

    /// Root mean square of the difference between a picture in three bands and one of a single
    /// band, relative to the light.
    fn difference<S: BandedScene>(scene: S, setup: &Setup) -> f64 {
        let (scene, work) = (Arc::new(scene), Work::silent());
        let mut whole = scene.whole(work).unwrap();
        whole.solve(&[0], work).unwrap();
        let whole = whole.picture(&[[1.0; 3]]);
        let bands = Bands::new(scene.bands().window, 1, 1);
        assert_eq!(bands.rows, [0..48, 32..96, 80..144]);
        let mut composed = Composed::new(InBands(scene, bands), &setup.rig, work).unwrap();
        let images = composed.render(&[vec![1.0], vec![2.0]], work).unwrap();
        let doubled = images[0].data().iter().zip(images[1].data());
        assert!(
            doubled
                .clone()
                .all(|(one, two)| (two - 2.0 * one).abs() <= 1e-6 * two)
        );
        let [mut wrong, mut all] = [0.0, 0.0];
        for (a, b) in whole.data().iter().zip(images[0].data()) {
            wrong += f64::from(a - b).powi(2);
            all += f64::from(*a).powi(2);
        }
        (wrong / all).sqrt()
    }

    #[test]
    fn a_picture_in_bands_is_that_of_a_single_band() {
        let (setup, work) = (corner(), Work::silent());
        let step = HemicubeStep::of(Quality(1)).unwrap();
        let by_hemicubes = HemicubeScene::new(&setup, step, work).unwrap();
        let by_rays = GatherStage::new(&setup, Quality(1), work).unwrap();
        let found = [
            difference(by_hemicubes, &setup),
            difference(by_rays, &setup),
        ];
        // Their random numbers differ.
        assert!(found.iter().all(|error| *error < 0.025), "{found:?}");
    }

    /// Shows the direction of each pixel.
    struct Sky(Bands);

    impl BandedScene for Sky {
        type Band = Window;

        fn bands(&self) -> &Bands {
            &self.0
        }

        fn bytes(&self) -> usize {
            0
        }

        fn band(self: Arc<Self>, window: Window, _: Work<'_>) -> Result<Window, TransportError> {
            Ok(window)
        }
    }

    impl UnitLights for Window {
        fn bytes(&self) -> usize {
            0
        }

        fn solve(&mut self, _: &[usize], _: Work<'_>) -> Result<(), TransportError> {
            Ok(())
        }

        fn picture(&self, _: &[[f64; 3]]) -> Image {
            let ray = |at: usize| {
                let ray = self
                    .camera
                    .ray((at % self.width) as f64, (at / self.width) as f64);
                [ray.x, ray.y, ray.z].map(|c| c as f32)
            };
            let data = (0..self.pixels()).flat_map(ray).collect();
            Image::from_data(self.width, self.height, data).unwrap()
        }
    }

    #[test]
    fn bands_meet_row_by_row() {
        let setup = corner();
        let window = Window::new(&setup.view).unwrap();
        let whole = window.picture(&[]);
        for bytes in [1, 80 * window.width, 144 * window.width] {
            let bands = Bands::new(window, 1, bytes);
            assert!((1..4).contains(&bands.rows.len()));
            let sky = Sky(bands);
            let mut composed = Composed::new(sky, &setup.rig, Work::silent()).unwrap();
            // The second call may keep bands.
            let calls = [(); 2].map(|()| composed.render(&[vec![1.0], vec![1.0]], Work::silent()));
            let images = calls.into_iter().flat_map(Result::unwrap);
            for image in images {
                for (a, b) in whole.data().iter().zip(image.data()) {
                    assert!((a - b).abs() < 1e-6);
                }
            }
        }
    }
}
