//! Measurements: quality, references, charts.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::picture::ShotArgs;
use crate::argument::{Output, check_quality, step};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine as engine;
use footlight_engine::measure::independent::{self, Effort};
use footlight_report::chart::Theme;
use footlight_report::format::{self, DRAWING, RECORD};
use footlight_report::{self as report, comparison, tradeoff};
use footlight_transport::Quality;

/// Options of `quality`.
#[derive(Args, Clone, Debug)]
pub struct QualityArgs {
    /// Print data instead of words
    #[arg(long)]
    json: bool,
}

/// The picture to measure.
#[derive(Args, Clone, Debug, Default)]
pub struct MeasureArgs {
    #[command(flatten)]
    pub(crate) picture: ShotArgs,
    /// Pixels that are estimated
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(32..=100_000))]
    pixels: u32,
    /// Paths of each of the two estimates of a pixel
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    paths: u32,
    /// Print data instead of words
    #[arg(long)]
    json: bool,
}

/// The pictures to compare.
#[derive(Args, Clone, Debug)]
pub struct CompareArgs {
    /// The folder of BANK.exr, or of the halves BANK_A.exr and BANK_B.exr
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    reference: PathBuf,
    /// The step of the scale, 1 to 3 (default: that of the show's coarse pictures)
    #[arg(long, value_name = "Q", value_parser = step)]
    quality: Option<Quality>,
    /// Print data instead of words
    #[arg(long)]
    json: bool,
    /// Write the differences as a .png or an .svg
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<Output>,
}

/// Options of `chart`.
#[derive(Args, Clone, Debug)]
pub struct ChartArgs {
    /// What to draw
    #[arg(value_name = "KIND", value_parser = ["transport"])]
    kind: String,
    /// The folder of reference pictures (default: the finest step is the reference)
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    reference: Option<PathBuf>,
    /// Light lines on a dark ground, in a file too
    #[arg(long)]
    dark: bool,
    /// Write a .png, an .svg, or the figures as .csv or .json
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<Output>,
}

pub fn quality(repl: &mut Repl, asked: &QualityArgs) -> Result<Reply, Error> {
    let forecast = engine::measure::quality::predict(&repl.engine)?;
    if asked.json {
        Reply::json(&forecast)
    } else {
        Ok(Reply::text(report::quality::describe(&forecast)))
    }
}

pub fn measure(repl: &mut Repl, asked: &MeasureArgs) -> Result<Reply, Error> {
    let (image, (setting, poses), what) = asked.picture.image(repl)?;
    let effort = Effort {
        pixels: asked.pixels as usize,
        paths: asked.paths,
    };
    let found = independent::measure(&repl.engine, &image, (&setting, &poses), effort)?;
    if asked.json {
        Reply::json(&found)
    } else {
        Ok(Reply::text(report::measured::describe(
            &what,
            found.as_ref(),
        )))
    }
}

pub fn compare(repl: &mut Repl, asked: &CompareArgs) -> Result<Reply, Error> {
    let quality = asked
        .quality
        .unwrap_or(repl.engine.estimate().coarse_steps()[1]);
    check_quality(&repl.engine, quality)?;
    let path = repl.optional_output(asked.output.as_ref(), &DRAWING)?;
    let compared = engine::measure::comparison::compare(&repl.engine, &asked.reference, quality)?;
    let reply = if asked.json {
        Reply::json(&compared.comparison)?
    } else {
        Reply::text(comparison::describe(&compared.comparison))
    };
    let Some(path) = path else {
        return Ok(reply);
    };
    let drawing = comparison::drawing(&repl.engine.show().title, &compared);
    let drawing = drawing.map_err(report::Error::from)?;
    let bytes = format::drawing(&drawing, 1.0, path)?;
    let written = repl.written(path, &bytes, &reply.text)?;
    Ok(if asked.json { reply } else { written })
}

pub fn chart(repl: &mut Repl, asked: &ChartArgs) -> Result<Reply, Error> {
    let path = repl.optional_output(asked.output.as_ref(), &RECORD)?;
    let theme = if asked.dark {
        Theme::Dark
    } else {
        Theme::Light
    };
    let found = engine::measure::tradeoff::measure(&repl.engine, asked.reference.as_deref())?;
    let (text, record) = (tradeoff::describe(&found), || tradeoff::record(&found));
    repl.deliver(
        text,
        &record,
        &|theme| tradeoff::drawing(&found, theme),
        (path, theme),
    )
}
