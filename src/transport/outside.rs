//! An external renderer: any program that turns a file of settings into an OpenEXR image.
//!
//! The program comes from the command line or the embedding program, never from a show. It is
//! started once for each image, with a JSON file that describes the request and the path for the
//! result; images share nothing. Time, exit code, size and finite numbers are checked. Linearity is
//! measured before the first image, because the plan uses sums of images as images of sums. A
//! setting with negative numbers takes two runs: the image of its negative part is subtracted from
//! that of its positive part.

mod scene;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::json;

use crate::contract::{check_memory, check_quality, check_settings};
use crate::{Cost, Prepared, Quality, Setup, Transport, TransportError, TransportWarning, seed};
use footlight_host::files::process::{Job, ProcessError, Processes, Programs, SplitError, split};
use footlight_host::work::Work;
use footlight_picture::combine::{combine, dot};
use footlight_picture::exr;
use footlight_picture::{Image, PictureError};
use footlight_show::geometry::Vec3;
use footlight_show::geometry::View;

/// Placeholder in the command for the path of the settings.
const SETTINGS: &str = "{settings}";
/// Placeholder for the path of the image.
pub const OUTPUT: &str = "{output}";

/// Placeholder for the path of the scene; its numbers are in `scene.bin` in the same directory.
pub const SCENE: &str = "{scene}";
/// Placeholder for the path of a bundled script.
const SCRIPT: &str = "{script}";

/// A renderer that is called by name, through a bundled Python script.
struct Known {
    name: &'static str,
    program: &'static str,
    /// Arguments before the paths of scene, settings and image.
    arguments: &'static [&'static str],
    script: &'static str,
}

const KNOWN: [Known; 2] = [
    Known {
        name: "mitsuba",
        program: "python3",
        arguments: &[SCRIPT],
        script: include_str!("../../examples/outside/mitsuba.py"),
    },
    Known {
        name: "blender",
        program: "blender",
        arguments: &[
            "--background",
            "--factory-startup",
            "-noaudio",
            "--python-exit-code",
            "1",
            "--python",
            SCRIPT,
            "--",
        ],
        script: include_str!("../../examples/outside/blender.py"),
    },
];

/// Quality steps of a known renderer.
const KNOWN_STEPS: u8 = 4;

/// Relative deviation from linearity above which the user is warned. Rounding alone causes up to
/// 5e-4 in half-precision images.
const TOLERATED: f64 = 2e-3;

/// Number of standard errors by which a mean must differ to exclude chance, even if a few bright
/// samples dominate the noise.
const SIGNIFICANT: f64 = 6.0;

/// Most bytes of an OpenEXR file apart from its pixels.
const HEADER: u64 = 1 << 20;

/// Reason for which an external renderer returned no image.
#[derive(Debug, thiserror::Error)]
pub enum OutsideError {
    /// The command cannot be split into words.
    #[error("the renderer's command cannot be read: {0}")]
    Command(#[from] SplitError),
    /// The command lacks the placeholder of a path.
    #[error(
        "the renderer's command has no `{0}`: write it where that path belongs, as in \
         `python3 render.py {SETTINGS} {OUTPUT}`"
    )]
    Mark(&'static str),
    /// The program failed.
    #[error("the renderer failed: {0}")]
    Process(ProcessError),
    /// Its output is not an image.
    #[error("the renderer's picture cannot be used: {0}")]
    Picture(#[from] PictureError),
    /// Its image has the wrong size.
    #[error(
        "the renderer's picture has {}x{} pixels, the view has {}x{}",
        found.0, found.1, wanted.0, wanted.1
    )]
    Size {
        /// Width and height of its image.
        found: (usize, usize),
        /// Width and height of the view.
        wanted: (usize, usize),
    },
    /// The settings could not be written.
    #[error("the settings cannot be written: {0}")]
    Settings(String),
}

/// The call of a renderer.
#[derive(Clone, Debug, PartialEq)]
pub struct RendererCall {
    /// The program.
    pub program: String,
    /// Its arguments, including `SETTINGS` and `OUTPUT`.
    pub arguments: Vec<String>,
    /// Time limit for one image, seconds.
    pub timeout: f64,
    /// Number of quality steps, 1 if it has no scale.
    pub steps: u8,
    /// Path of the show's file, passed to the program.
    pub show: Option<PathBuf>,
    /// A bundled Python script.
    pub script: Option<&'static str>,
    /// The user's name for the version of its images, which are stored only if it is given.
    pub version: Option<String>,
}

impl RendererCall {
    /// Parses a command line, split without a shell ([`split`]), with ten minutes per image and one
    /// quality step; or the name of a known renderer, `mitsuba` or `blender`, with arguments for
    /// its script.
    ///
    /// # Errors
    /// [`OutsideError::Command`] and [`OutsideError::Mark`].
    pub fn parse(line: &str) -> Result<RendererCall, OutsideError> {
        let (program, arguments) = split(line)?;
        if let Some(known) = KNOWN.iter().find(|known| known.name == program) {
            let paths = [SCENE, SETTINGS, OUTPUT];
            let own = known.arguments.iter().chain(&paths);
            let own = own.map(|word| (*word).to_owned());
            return Ok(RendererCall {
                program: known.program.to_owned(),
                arguments: own.chain(arguments).collect(),
                timeout: 600.0,
                steps: KNOWN_STEPS,
                show: None,
                script: Some(known.script),
                version: None,
            });
        }
        for mark in [SETTINGS, OUTPUT] {
            if !arguments.iter().any(|a| a.contains(mark)) {
                return Err(OutsideError::Mark(mark));
            }
        }
        Ok(RendererCall {
            program,
            arguments,
            timeout: 600.0,
            steps: 1,
            show: None,
            script: None,
            version: None,
        })
    }

    /// True when the program reads the scene.
    fn reads_scene(&self) -> bool {
        self.arguments.iter().any(|a| a.contains(SCENE))
    }
}

/// Relative RMS deviations of a renderer from linearity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Linearity {
    /// Deviation of G(a) + G(b) from G(a + b).
    pub sum: f64,
    /// Deviation of G(2a) from 2 G(a).
    pub double: f64,
}

/// Measurements of the runs so far.
#[derive(Debug, Default)]
struct Measurements {
    linearity: Option<Linearity>,
    /// For each rendered step its number of images and their seconds.
    runs: Vec<(Quality, usize, f64)>,
    /// Numbers of images with positive light, without light, and with only negative light.
    lit: usize,
    black: usize,
    negative: usize,
}

struct Renderer {
    call: RendererCall,
    processes: Box<dyn Processes>,
    measured: Mutex<Measurements>,
}

/// G by an external renderer.
#[derive(Clone)]
pub struct Outside(Arc<Renderer>);

impl Outside {
    /// Starts programs of this machine.
    pub fn new(call: RendererCall) -> Outside {
        Outside::with(call, Box::new(Programs))
    }

    /// Starts programs by `processes`.
    pub fn with(call: RendererCall, processes: Box<dyn Processes>) -> Outside {
        Outside(Arc::new(Renderer {
            call,
            processes,
            measured: Mutex::default(),
        }))
    }

    /// The renderer for one of many workers, without the linearity test, which would cost each
    /// worker four more images.
    #[must_use]
    pub fn unmeasured(self) -> Outside {
        self.0.measured().linearity = Some(Linearity::default());
        self
    }

    /// Measured linearity; `None` before the first image.
    fn linearity(&self) -> Option<Linearity> {
        self.0.measured().linearity
    }
}

impl Transport for Outside {
    fn name(&self) -> &str {
        "outside renderer"
    }

    fn finest(&self) -> Quality {
        Quality(self.0.call.steps.max(1))
    }

    fn results_version(&self) -> Option<String> {
        let RendererCall { version, steps, .. } = &self.0.call;
        let version = version.as_ref()?;
        Some(format!("outside {version}, of {steps} steps"))
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        check_quality(quality, self.finest())?;
        check_memory("the scene's files", scene::image_bytes(setup), work.memory)?;
        let scene = if self.0.call.reads_scene() {
            Some(scene::files(setup).map_err(OutsideError::Settings)?)
        } else {
            None
        };
        if let Some((json, binary)) = &scene {
            check_memory("the scene's files", json.len() + binary.len(), work.memory)?;
        }
        let operator = OutsideOperator {
            renderer: Arc::clone(&self.0),
            scene,
            names: setup.rig.sources.iter().map(|s| s.name.clone()).collect(),
            view: setup.view.clone(),
            quality,
        };
        if self.linearity().is_none() {
            let linearity = operator.linearity(work)?;
            self.0.measured().linearity = Some(linearity);
        }
        Ok(Box::new(operator))
    }

    /// Mean time of its runs at this quality, or of the last other one scaled by samples; zero
    /// before the first run. Images share nothing.
    fn cost(&self, _setup: &Setup, quality: Quality) -> Cost {
        let measured = self.0.measured();
        let run = measured.runs.iter().find(|r| r.0 == quality);
        let run = run.or(measured.runs.last());
        let per_image = run.map_or(0.0, |(known, count, seconds)| {
            let samples = [quality, *known].map(|step| self.samples(step).unwrap_or(1.0));
            seconds / *count as f64 * samples[0] / samples[1]
        });
        Cost {
            per_image,
            per_lone: per_image,
            ..Cost::default()
        }
    }

    /// A renderer that reads the scene receives a seed, and four times the samples at each step.
    fn samples(&self, quality: Quality) -> Option<f64> {
        let is_noisy = self.0.call.reads_scene();
        is_noisy.then(|| 4_f64.powi(i32::from(quality.0) - 1))
    }

    fn warnings(&self) -> Vec<TransportWarning> {
        let mut out = Vec::new();
        let Linearity { sum, double } = self.linearity().unwrap_or_default();
        if sum.max(double) > TOLERATED {
            out.push(TransportWarning::NotLinear { sum, double });
        }
        let measured = self.0.measured();
        // A single bank may light nothing in the view; all banks together should.
        if measured.lit == 0 && measured.black > 0 {
            let pictures = measured.black;
            out.push(TransportWarning::Black { pictures });
        }
        if measured.negative > 0 {
            let pictures = measured.negative;
            out.push(TransportWarning::Negative { pictures });
        }
        out
    }
}

impl Renderer {
    /// Counts an image by its light.
    fn record_light(&self, image: &Image) {
        let has = |sign: f32| image.data().iter().any(|light| light * sign > 0.0);
        let mut measured = self.measured();
        match (has(1.0), has(-1.0)) {
            (true, _) => measured.lit += 1,
            (false, true) => measured.negative += 1,
            (false, false) => measured.black += 1,
        }
    }

    fn measured(&self) -> MutexGuard<'_, Measurements> {
        // Each change is one assignment, so a panic elsewhere leaves no partial change.
        self.measured.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn record_run(&self, quality: Quality, seconds: f64) {
        let mut measured = self.measured();
        match measured.runs.iter_mut().find(|r| r.0 == quality) {
            Some((_, count, sum)) => {
                *count += 1;
                *sum += seconds;
            }
            None => measured.runs.push((quality, 1, seconds)),
        }
    }
}

/// G for one rig, view and quality.
struct OutsideOperator {
    renderer: Arc<Renderer>,
    /// `scene.json` and `scene.bin`, if the program reads them.
    scene: Option<(Vec<u8>, Vec<u8>)>,
    names: Vec<String>,
    view: View,
    quality: Quality,
}

impl OutsideOperator {
    fn size(&self) -> (usize, usize) {
        (self.view.width, self.view.height)
    }

    /// The settings file of one image; the manual's page `renderer` specifies the format.
    fn request(&self, setting: &[f64]) -> Result<Vec<u8>, OutsideError> {
        let call = &self.renderer.call;
        let view = &self.view;
        let point = |p: Vec3| [p.x, p.y, p.z];
        let coordinates = self.names.iter().zip(setting);
        let coordinates = coordinates.map(|(name, value)| json!({ "name": name, "value": value }));
        let mut request = json!({
            "schema": self.scene.as_ref().map_or(0, |_| scene::SCHEMA),
            "show": call.show.as_ref().map(|p| p.display().to_string()),
            "view": {
                "from": point(view.from),
                "to": point(view.to),
                "up": point(view.axes()[1]),
                "fov": view.fov,
                "roll": view.roll,
                "width": view.width,
                "height": view.height,
            },
            "quality": self.quality.0,
            "steps": call.steps,
            "coordinates": coordinates.collect::<Vec<_>>(),
        });
        if let (Some(_), Some(fields)) = (&self.scene, request.as_object_mut()) {
            fields.insert("seed".to_owned(), json!(seed(setting, self.quality)));
        }
        serde_json::to_vec_pretty(&request).map_err(|e| OutsideError::Settings(e.to_string()))
    }

    /// One run: the image of a setting without negative numbers.
    fn run(&self, setting: &[f64], work: Work<'_>) -> Result<Image, TransportError> {
        work.check()?;
        let request = self.request(setting)?;
        let (width, height) = self.size();
        // Approximately five times the image's own floats, to allow channels other than R, G and B.
        let pixels = (width as u64 * height as u64).saturating_mul(64);
        let mut inputs: Vec<(&str, &str, &[u8])> = vec![(SETTINGS, "settings.json", &request)];
        if let Some((json, binary)) = &self.scene {
            inputs.push((SCENE, "scene.json", json));
            inputs.push(("{numbers}", "scene.bin", binary));
        }
        if let Some(script) = self.renderer.call.script {
            inputs.push((SCRIPT, "render.py", script.as_bytes()));
        }
        let done = self.renderer.processes.run(&Job {
            program: &self.renderer.call.program,
            arguments: &self.renderer.call.arguments,
            inputs: &inputs,
            output: (OUTPUT, "picture.exr"),
            limit: (pixels + HEADER).min(work.memory as u64),
            timeout: self.renderer.call.timeout,
            cancelled: &|| work.progress.cancelled(),
        });
        let done = done.map_err(|error| match error {
            ProcessError::Cancelled => TransportError::Cancelled(footlight_host::work::Cancelled),
            other => OutsideError::Process(other).into(),
        })?;
        let image = exr::decode(&done.output, work.memory).map_err(OutsideError::Picture)?;
        let found = (image.width(), image.height());
        if found != self.size() {
            let wanted = self.size();
            return Err(OutsideError::Size { found, wanted }.into());
        }
        self.renderer.record_run(self.quality, done.seconds);
        self.renderer.record_light(&image);
        Ok(image)
    }

    /// The image of any setting: that of its positive part less that of its negative part.
    fn signed(&self, setting: &[f64], work: Work<'_>) -> Result<Image, TransportError> {
        let part = |sign: f64| {
            let part: Vec<f64> = setting.iter().map(|s| (s * sign).max(0.0)).collect();
            let is_lit = part.iter().any(|s| *s > 0.0);
            is_lit.then(|| self.run(&part, work)).transpose()
        };
        match (part(1.0)?, part(-1.0)?) {
            (Some(image), None) => Ok(image),
            (positive, negative) => {
                let positive = positive.iter().map(|image| (1.0, image));
                let negative = negative.iter().map(|image| (-1.0, image));
                let terms: Vec<(f64, &Image)> = positive.chain(negative).collect();
                Ok(combine(self.size(), &terms, work.threads))
            }
        }
    }

    /// Renders four settings: every other source (a), the rest (b), both, and twice the first. For
    /// a rig of one source the rest is that source at half.
    fn linearity(&self, work: Work<'_>) -> Result<Linearity, TransportError> {
        let n = self.names.len();
        if n == 0 {
            return Ok(Linearity::default());
        }
        let a: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i % 2 == 0))).collect();
        let b: Vec<f64> = match n {
            1 => vec![0.5],
            _ => a.iter().map(|x| 1.0 - x).collect(),
        };
        let both: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + b).collect();
        let twice: Vec<f64> = a.iter().map(|a| 2.0 * a).collect();
        let picture = |done, setting: Vec<f64>| {
            let image = self.run(&setting, work)?;
            work.progress.report("linearity of the renderer", done, 4);
            Ok::<Image, TransportError>(image)
        };
        let (a, b) = (&picture(1, a)?, &picture(2, b)?);
        let (both, twice) = (&picture(3, both)?, &picture(4, twice)?);
        let off = |terms: &[(f64, &Image)], whole: &Image| {
            let difference = combine(self.size(), terms, work.threads);
            if self.scene.is_some() {
                return bias(&difference, whole);
            }
            let (error, light) = (dot(&difference, &difference), dot(whole, whole));
            if light > 0.0 {
                (error / light).sqrt()
            } else {
                f64::from(u8::from(error > 0.0))
            }
        };
        Ok(Linearity {
            sum: off(&[(1.0, a), (1.0, b), (-1.0, both)], both),
            double: off(&[(2.0, a), (-1.0, twice)], twice),
        })
    }
}

/// Mean of a difference of noisy images, relative to the image's mean; 0 if chance may explain it.
fn bias(difference: &Image, whole: &Image) -> f64 {
    let count = difference.data().len().max(1) as f64;
    let mean = |image: &Image| image.data().iter().map(|v| f64::from(*v)).sum::<f64>() / count;
    let off = mean(difference).abs();
    let by_chance = (dot(difference, difference) / count / count).sqrt();
    if off > SIGNIFICANT * by_chance {
        off / mean(whole).abs().max(f64::MIN_POSITIVE)
    } else {
        0.0
    }
}

impl Prepared for OutsideOperator {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        check_settings(settings, self.names.len())?;
        let (width, height) = self.size();
        // Two partial images of a mixed setting, in addition to the results.
        let needed = (settings.len() + 2).saturating_mul(width * height * 3 * size_of::<f32>());
        check_memory("the pictures of all settings", needed, work.memory)?;
        let mut images = Vec::with_capacity(settings.len());
        for setting in settings {
            images.push(self.signed(setting, work)?);
            work.progress
                .report("outside renderer", images.len(), settings.len());
        }
        Ok(images)
    }
}

#[cfg(test)]
mod tests;
