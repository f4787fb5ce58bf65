//! Drawings of the show and its plan.

use clap::{Args, ValueHint};

use super::usage;
use crate::argument::{self, Output, tolerance};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine::Goal;
use footlight_report::chart::{Drawing, Theme};
use footlight_report::curves::{curves, moving};
use footlight_report::format::DRAWING;
use footlight_report::words::{count, percent};
use footlight_report::{self as report, results};
use footlight_show::lang::nearest;
use footlight_show::model::Show;
use footlight_show::units::Tolerance;

/// Options of `plot`.
#[derive(Args, Clone, Debug)]
pub struct PlotArgs {
    #[arg(value_name = "BANK… | HEAD… | rig | spectrum | basis | error")]
    words: Vec<String>,
    /// Error allowed in `spectrum`, such as 2% or 1.5steps (default: the show's preview)
    #[arg(long, value_name = "X", value_parser = argument::error)]
    tolerance: Option<Tolerance>,
    /// Light lines on a dark ground, in a file too
    #[arg(long)]
    dark: bool,
    /// Write a .png or an .svg
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<Output>,
}

/// Words that, alone, name another subject than banks.
const SUBJECTS: [&str; 4] = ["rig", "spectrum", "basis", "error"];

pub fn plot(repl: &mut Repl, asked: &PlotArgs) -> Result<Reply, Error> {
    let words: Vec<&str> = asked.words.iter().map(String::as_str).collect();
    let path = repl.optional_output(asked.output.as_ref(), &DRAWING)?;
    if asked.tolerance.is_some() && words != ["spectrum"] {
        return usage("`--tolerance` is for `plot spectrum`");
    }
    // Terminals are usually dark.
    let theme = if asked.dark || path.is_none() {
        Theme::Dark
    } else {
        Theme::Light
    };
    let (drawing, text) = match words.as_slice() {
        ["rig"] => report::rig::plot(repl.engine.document(), theme),
        ["spectrum"] => spectrum(repl, asked.tolerance, theme)?,
        ["basis"] => basis(repl, theme)?,
        ["error"] => error(repl, theme)?,
        names => {
            let (wanted, heads, text) = chosen(repl, names)?;
            let document = repl.engine.document();
            let now = Some(repl.live.time());
            (curves(document, (&wanted, &heads), now, theme), text)
        }
    };
    repl.drawing(&drawing, path, text)
}

/// The coordinates of the named banks and groups, each once and in the order named, and the named
/// heads; all banks without names. `bank` before a name is skipped.
fn chosen(repl: &Repl, names: &[&str]) -> Result<(Vec<usize>, Vec<usize>, String), Error> {
    let show = repl.engine.show();
    let of_show = format!("of {}", show.title);
    if names.is_empty() {
        let banks = count(show.banks.len(), "bank");
        return Ok((moving(show), Vec::new(), format!("{banks} {of_show}")));
    }
    let names = match names {
        ["bank" | "group" | "light", rest @ ..] if !rest.is_empty() => rest,
        all => all,
    };
    let (mut banks, mut heads): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    for name in names {
        if let Some(head) = head_names(show).position(|head| head == *name) {
            heads.push(head);
            continue;
        }
        for bank in banks_of(repl, name)? {
            if !banks.contains(&bank) {
                banks.push(bank);
            }
        }
    }
    let counts = [(banks.len(), "bank"), (heads.len(), "head")].into_iter();
    let counts = counts.filter(|(n, _)| *n > 0).map(|(n, of)| count(n, of));
    let text = format!("{} {of_show}", counts.collect::<Vec<_>>().join(", "));
    let own = banks.iter().flat_map(|bank| show.coordinates_of(*bank));
    Ok((own.collect(), heads, text))
}

/// The names of the heads of a show, in order.
fn head_names(show: &Show) -> impl Iterator<Item = &str> {
    let heads = show.heads().into_iter();
    heads.filter_map(|(light, ..)| Some(show.lights.get(light)?.name.as_str()))
}

/// Indices of the banks of a name.
fn banks_of(repl: &Repl, name: &str) -> Result<Vec<usize>, Error> {
    let show = repl.engine.show();
    if let Some(bank) = show.banks.iter().position(|b| b.name == name) {
        return Ok(vec![bank]);
    }
    if let Some(group) = show.groups.iter().find(|g| g.name == name) {
        return Ok(group.banks.clone());
    }
    let banks = show.banks.iter().map(|b| b.name.as_str());
    let groups = show.groups.iter().map(|g| g.name.as_str());
    let names = banks.chain(groups).chain(head_names(show));
    let hint = match nearest(name, names.chain(SUBJECTS)) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "`show` lists the banks".to_owned(),
    };
    usage(format!("there is no bank, group or head `{name}`; {hint}"))
}

/// The singular values and the remaining error, with the tolerance.
fn spectrum(
    repl: &mut Repl,
    said: Option<Tolerance>,
    theme: Theme,
) -> Result<(Drawing, String), Error> {
    repl.engine.take_up()?;
    let plan = repl.engine.estimate().plan(tolerance(&repl.engine, said))?;
    Ok(report::plot::spectrum(&plan, theme))
}

fn basis(repl: &mut Repl, theme: Theme) -> Result<(Drawing, String), Error> {
    repl.engine.coarse()?;
    let (engine, pool) = (&repl.engine, repl.engine.estimate().pool());
    let pool = pool.ok_or(footlight_engine::Error::NoSetup)?;
    Ok(match pool.refined().len() {
        0 => (
            results::channel_sheet(engine, 0, theme)?,
            format!(
                "nothing is refined yet: the coarse pictures of {}",
                count(engine.show().coordinates().len(), "source")
            ),
        ),
        n => (
            results::basis_sheet(engine, pool, theme)?,
            count(n, "basis picture"),
        ),
    })
}

fn error(repl: &mut Repl, theme: Theme) -> Result<(Drawing, String), Error> {
    repl.engine.coarse()?;
    if !repl.engine.is_busy() {
        // Any tolerance will do: the call measures the pictures.
        repl.engine.refine(Goal::until(f64::MAX))?;
    }
    let tolerance = repl.engine.show().preview.tolerance;
    let text = format!(
        "{}: predicted error {} %",
        count(repl.engine.estimate().refined(), "refined picture"),
        percent(repl.engine.estimate().predicted_error()?)
    );
    let chart = results::error_chart(&repl.engine, tolerance, theme)?;
    Ok((chart, text))
}
