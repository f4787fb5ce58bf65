//! One picture.

use std::fmt::Write as _;

use clap::{Args, ValueHint};

use super::solve::point;
use super::usage;
use crate::argument::{self, FromView, Moment, Output, check_quality, number, step};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine::{UnlitBank, solve};
use footlight_picture::Image;
use footlight_picture::exr::Precision;
use footlight_picture::tone::{self, Tone};
use footlight_report::film::Shown;
use footlight_report::format::{self, DRAWING, PICTURE, ending};
use footlight_report::words::{count, qualities};
use footlight_report::{self as report, illuminance};
use footlight_show::geometry::Vec3;
use footlight_show::model::Pose;
use footlight_show::units::{CueNumber, Time};
use footlight_transport::Quality;

/// A picture of a moment or a bank.
#[derive(Args, Clone, Debug, Default)]
pub struct ShotArgs {
    #[arg(value_name = "TIME | cue N [+ TIME]", conflicts_with = "at")]
    moment: Vec<String>,
    /// The moment (default: the current time, or the start)
    #[arg(long, value_name = "TIME", value_parser = argument::duration)]
    at: Option<Time>,
    /// The moment at which this cue is complete
    #[arg(long, value_name = "N", value_parser = number, conflicts_with = "at")]
    cue: Option<CueNumber>,
    /// This bank alone, at full
    #[arg(long, value_name = "BANK")]
    bank: Option<String>,
    /// Render again at this step of the scale, 1 to 3
    #[arg(long, value_name = "Q", value_parser = step)]
    quality: Option<Quality>,
    #[command(flatten)]
    pub(crate) from: FromView,
}

/// The light of a picture: a setting, and the poses of heads.
pub type Look = (Vec<f64>, Vec<Pose>);

impl ShotArgs {
    /// The image, its light, and its description.
    pub fn image(&self, repl: &mut Repl) -> Result<(Image, Look, String), Error> {
        let now = repl.live.time();
        // `--cue 17 + 2s` is read as well as `cue 17 + 2s`.
        let mut words = self.moment.clone();
        words.splice(0..0, self.cue.iter().map(|cue| format!("cue {cue}")));
        let said = self.at.map(Moment::Time);
        let said = said.or(Moment::of(&words)?);
        let said = said.map(|moment| moment.time(&repl.engine)).transpose()?;
        let document = repl.engine.document();
        let show = document.show();
        let bank = self.bank.as_ref();
        let bank = bank.and_then(|name| show.banks.iter().position(|bank| bank.name == *name));
        let first = bank.and_then(|bank| Some((bank, document.first_lit(bank)?)));
        // A dark head may aim anywhere, unless its aim is being tried.
        let first_lit = first.filter(|(bank, _)| {
            let setting = repl.live.setting(document);
            let is_lit = |c: usize| setting.get(c).is_some_and(|light| *light != 0.0);
            let is_tried = || repl.live.poses(document) != document.timeline().poses(now);
            !show.coordinates_of(*bank).any(is_lit) && !is_tried()
        });
        let moment = said.or(first_lit.map(|(_, time)| time)).unwrap_or(now);
        let (mut setting, poses) = if moment == now {
            (repl.live.setting(document), repl.live.poses(document))
        } else {
            (document.setting(moment), document.timeline().poses(moment))
        };
        let mut what = format!("{moment}");
        if let Some(name) = &self.bank {
            setting = document.alone(name, &poses)?;
            let heads = if first.is_some() {
                format!(", its heads as at {moment}")
            } else {
                String::new()
            };
            what = format!("{name} alone at full{heads}");
        }
        let image = match self.quality {
            Some(quality) => {
                check_quality(&repl.engine, quality)?;
                repl.engine.render_with(&setting, &poses, quality)?
            }
            None => repl.engine.picture_with(&setting, &poses)?,
        };
        Ok((image, (setting, poses), what))
    }
}

/// The picture, its exposure and its file.
#[derive(Args, Clone, Debug, Default)]
pub struct PictureArgs {
    #[command(flatten)]
    pub(crate) shot: ShotArgs,
    /// How bright the light shows (default: that of the sequence; of a bank alone its own)
    #[arg(long, value_name = "STOPS", value_parser = argument::exposure)]
    #[arg(allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// An .exr in 32 bits a number (default: 16, the relative error 2^-11)
    #[arg(long)]
    float: bool,
    /// Show illuminance in false colours, and print it at points of the view such as `2,1,0`
    #[arg(long, value_name = "X,Y,Z", num_args = 0..=1, default_missing_value = "")]
    #[arg(value_parser = place, conflicts_with_all = ["exposure", "float"])]
    lux: Vec<Option<(String, Vec3)>>,
    /// Write a .png (as displayed) or an .exr (linear)
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<Output>,
}

/// A point, or nothing.
fn place(text: &str) -> Result<Option<(String, Vec3)>, String> {
    let text = text.trim();
    match point(text) {
        None if text.is_empty() => Ok(None),
        None => Err(format!(
            "`{text}` is not a point; write it as 2,1,0, and a time before `--lux`"
        )),
        Some(place) => Ok(Some((text.to_owned(), place))),
    }
}

/// The illuminance in a picture.
fn lux(repl: &mut Repl, asked: &PictureArgs) -> Result<Reply, Error> {
    let path = repl.optional_output(asked.output.as_ref(), &DRAWING)?;
    let (image, _, what) = asked.shot.image(repl)?;
    let points = asked.lux.iter().flatten();
    let points: Vec<(&str, Vec3)> = points.map(|(name, at)| (name.as_str(), *at)).collect();
    let (values, at) = solve::illuminance_of(&repl.engine, &image, &points)?;
    let title = format!("{}, {what}", repl.engine.show().title);
    let drawn = illuminance::drawing(&title, image.width(), values);
    let (drawing, mut text) = drawn.map_err(report::Error::from)?;
    text = format!("{what}: {}, {text}", made_of(repl, asked));
    for ((name, _), lux) in points.iter().zip(at) {
        let _ = write!(text, "\n{name}: {lux:.1} lux");
    }
    repl.drawing(&drawing, path, text)
}

pub fn picture(repl: &mut Repl, asked: &PictureArgs) -> Result<Reply, Error> {
    if !asked.lux.is_empty() {
        return lux(repl, asked);
    }
    let path = repl.optional_output(asked.output.as_ref(), &PICTURE)?;
    // An .exr is linear, and exposure does not apply.
    let shown = path.is_none_or(|p| ending(p) != "exr");
    if asked.float && shown {
        return usage("`--float` is for an .exr");
    }
    let (image, _, what) = asked.shot.image(repl)?;
    let below = match tone::negative(&image) {
        0 => String::new(),
        n => format!("; {} below zero shown as black", count(n, "value")),
    };
    let tone = shown.then(|| exposed(repl, asked, &image)).transpose()?;
    let exposure = match tone {
        _ if is_dark(repl, asked, &image) => ", dark: no light in sight".to_owned(),
        Some(tone) => format!(
            ", exposure {:.2} stops{}",
            tone.exposure,
            chosen(repl, asked)
        ),
        None => String::new(),
    };
    let text = format!("{what}: {}{exposure}{below}", made_of(repl, asked));
    let tone = tone.unwrap_or_else(|| repl.engine.document().tone_at(0.0));
    match path {
        Some(p) => {
            let precision = if asked.float {
                Precision::Float
            } else {
                Precision::Half
            };
            let about = (precision, text.as_str());
            let bytes = format::picture(&image, || Ok(tone), about, p)?;
            repl.written(p, &bytes, &text)
        }
        None => {
            let size = (image.width(), image.height());
            let rgb = tone.encode(&image);
            Ok(Reply::pictured(Shown { size, rgb }, text))
        }
    }
}

/// Describes the images from which the picture was made.
fn made_of(repl: &Repl, asked: &PictureArgs) -> String {
    if let Some(Quality(step)) = asked.shot.quality {
        return format!("quality {step}");
    }
    if repl.engine.estimate().is_final() {
        return "the sum of the banks".to_owned();
    }
    let [cheap, fine] = repl.engine.estimate().coarse_steps();
    match repl.engine.estimate().refined() {
        0 if cheap == fine && fine.0 > repl.engine.show().preview.coarse => {
            format!("pictures {}", qualities(&repl.engine))
        }
        0 => "coarse pictures".to_owned(),
        n => format!("coarse pictures and {}", count(n, "refined picture")),
    }
}

/// True when a picture, or a bank alone, is completely dark.
fn is_dark(repl: &mut Repl, asked: &PictureArgs, image: &Image) -> bool {
    let unlit = |name: &str| {
        UnlitBank::find(&mut repl.engine)
            .iter()
            .any(|b| b.name == name)
    };
    image.data().iter().all(|light| *light <= 0.0) || asked.shot.bank.as_deref().is_some_and(unlit)
}

/// Describes an automatic exposure.
fn chosen(repl: &Repl, asked: &PictureArgs) -> &'static str {
    match asked.exposure.is_some() || repl.engine.show().preview.exposure.is_some() {
        true => "",
        false if of_picture(repl, asked) => " (auto, for this picture)",
        false => " (auto)",
    }
}

/// True for a picture that is exposed individually, because no sequence shows it.
fn of_picture(repl: &Repl, asked: &PictureArgs) -> bool {
    asked.shot.bank.is_some() || repl.engine.show().cues.is_empty()
}

/// The given exposure, else that of the whole sequence, so that pictures of different moments
/// compare. A bank alone and a show without cues get an individual exposure.
fn exposed(repl: &mut Repl, asked: &PictureArgs, image: &Image) -> Result<Tone, Error> {
    if let Some(stops) = asked.exposure {
        return Ok(repl.engine.document().tone_at(stops));
    }
    if of_picture(repl, asked) {
        Ok(repl.engine.document().tone_of([image]))
    } else {
        Ok(repl.engine.tone()?)
    }
}
