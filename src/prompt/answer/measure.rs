//! Measurements: quality, the error of a picture.

use clap::Args;

use super::picture::ShotArgs;
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine as engine;
use footlight_engine::measure::{Effort, independent};
use footlight_report as report;

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
