//! `plot`: what the show and its plan look like, drawn.

use std::collections::BTreeMap;
use std::path::Path;

use super::result::ROUNDING;
use super::{ending, unknown_ending};
use crate::chart::{self, Axis, Drawing, Grid, Marker, Panel, Scale, Series, Stand, Theme, Tie};
use crate::interpreter::answer::{count, fraction, percent};
use crate::interpreter::{Call, Error, Interpreter, Reply};
use crate::lang::nearest;
use crate::plan::{Metric, PlanReport};

/// What is drawn instead of banks where its word stands alone.
pub(in crate::interpreter) const SUBJECTS: [&str; 4] = ["keys", "spectrum", "basis", "error"];

impl Interpreter {
    pub(in crate::interpreter) fn answer_plot(&mut self, call: &Call) -> Result<Reply, Error> {
        let words: Vec<&str> = call.words.iter().map(String::as_str).collect();
        let path = call.option("output").map(Path::new);
        if let Some(p) = path.filter(|p| !matches!(ending(p).as_str(), "png" | "svg")) {
            return Err(unknown_ending(p, ".png or .svg"));
        }
        for option in ["metric", "tolerance"] {
            if call.option(option).is_some() && words != ["spectrum"] {
                return Err(Error::Usage(format!("`--{option}` is for `plot spectrum`")));
            }
        }
        // In a terminal it is dark around.
        let theme = match call.option("dark").is_some() || path.is_none() {
            true => Theme::Dark,
            false => Theme::Light,
        };
        let (drawing, text) = self.plotted(&words, call.option("tolerance"), theme)?;
        self.draw(&drawing, path, text)
    }

    fn plotted(
        &mut self,
        words: &[&str],
        tolerance: Option<&str>,
        theme: Theme,
    ) -> Result<(Drawing, String), Error> {
        match words {
            ["keys"] => Ok(self.plot_keys(theme)),
            ["spectrum"] => {
                let tolerance = tolerance.map(fraction).transpose()?;
                self.plot_spectrum(tolerance, theme)
            }
            ["basis"] => self.plot_basis(theme),
            ["error"] => self.plot_error(theme),
            names => {
                let (wanted, text) = self.chosen(names)?;
                Ok((self.curves(&wanted, Some(self.now), theme), text))
            }
        }
    }

    /// Into a file by its ending, or beside the words.
    fn draw(&self, drawing: &Drawing, path: Option<&Path>, text: String) -> Result<Reply, Error> {
        let Some(path) = path else {
            return Reply::drawn(drawing, text);
        };
        let bytes = match ending(path).as_str() {
            "svg" => drawing.svg().into_bytes(),
            _ => drawing.clone().magnified(2.0).png()?,
        };
        self.write_reply(Some(path), &bytes, text)
    }

    /// The coordinates of the banks and groups of these names, each once and in the order named;
    /// all banks without names. `bank` before a name is passed over.
    fn chosen(&self, names: &[&str]) -> Result<(Vec<usize>, String), Error> {
        let show = self.show();
        let of_show = format!("of {}", show.title);
        if names.is_empty() {
            let banks = count(show.banks.len(), "bank");
            return Ok((self.moving(), format!("{banks} {of_show}")));
        }
        let names = match names {
            ["bank" | "group", rest @ ..] if !rest.is_empty() => rest,
            all => all,
        };
        let mut banks: Vec<usize> = Vec::new();
        for name in names {
            for bank in self.banks_of(name)? {
                if !banks.contains(&bank) {
                    banks.push(bank);
                }
            }
        }
        let coordinates = show.coordinates();
        let of = |bank: &usize| {
            let all = coordinates.iter().enumerate();
            let own = all.filter(|(_, c)| c.bank == Some(*bank));
            own.map(|(i, _)| i).collect::<Vec<usize>>()
        };
        let text = format!("{} {of_show}", count(banks.len(), "bank"));
        Ok((banks.iter().flat_map(of).collect(), text))
    }

    /// The banks that a name stands for, as indices.
    fn banks_of(&self, name: &str) -> Result<Vec<usize>, Error> {
        let show = self.show();
        if let Some(bank) = show.banks.iter().position(|b| b.name == name) {
            return Ok(vec![bank]);
        }
        if let Some(group) = show.groups.iter().find(|g| g.name == name) {
            return Ok(group.banks.clone());
        }
        let banks = show.banks.iter().map(|b| b.name.as_str());
        let groups = show.groups.iter().map(|g| g.name.as_str());
        let hint = match nearest(name, banks.chain(groups).chain(SUBJECTS)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`show` lists the banks".to_owned(),
        };
        let message = format!("there is no bank or group `{name}`; {hint}");
        Err(Error::Usage(message))
    }

    /// The key settings in a grid, tied to the moments at which they count.
    fn plot_keys(&self, theme: Theme) -> (Drawing, String) {
        let keys = self.keys();
        let inserted = match keys.inserted() {
            0 => "none put in between".to_owned(),
            n => format!("{} put in so that no key is negative", count(n, "knot")),
        };
        let counted = format!(
            "{} for {}",
            count(keys.keys().len(), "key setting"),
            count(keys.segments().len(), "segment")
        );
        let data = Grid {
            title: format!("{}: {counted}, {inserted}", self.show().title),
            column: "key".to_owned(),
            rows: self
                .show()
                .coordinates()
                .into_iter()
                .map(|c| c.name)
                .collect(),
            columns: keys.keys().to_vec(),
            ties: self.ties(),
            start: self.timeline().start().seconds(),
            end: self.timeline().end().seconds(),
            cues: self.cues_in_time(),
        };
        (chart::grid(&data, theme), format!("{counted}, {inserted}"))
    }

    /// When each key counts: at the ends of its segments, the inner control points in equal steps
    /// between, where a polynomial's control points belong (its Greville abscissae). A key that
    /// stands at one moment in two ways stands there in the stronger one.
    fn ties(&self) -> Vec<Tie> {
        let mut found: BTreeMap<(usize, i64), Tie> = BTreeMap::new();
        let rank = |stand: Stand| match stand {
            Stand::Near => 0,
            Stand::Met => 1,
            Stand::Inserted => 2,
        };
        for segment in self.keys().segments() {
            for (place, column) in segment.keys.iter().enumerate() {
                let along = place as f64 / segment.degree.max(1) as f64;
                let stand = match place {
                    0 if segment.is_inserted() => Stand::Inserted,
                    p if p == 0 || p == segment.degree => Stand::Met,
                    _ => Stand::Near,
                };
                let tie = Tie {
                    column: *column,
                    time: segment.start() + along * segment.duration(),
                    stand,
                };
                let at = (*column, (tie.time * 1e6).round() as i64);
                let known = found.entry(at).or_insert(tie);
                if rank(stand) > rank(known.stand) {
                    *known = tie;
                }
            }
        }
        found.into_values().collect()
    }

    /// The singular values and what they leave, with the tolerance.
    fn plot_spectrum(
        &mut self,
        tolerance: Option<f64>,
        theme: Theme,
    ) -> Result<(Drawing, String), Error> {
        let tolerance = tolerance.unwrap_or(self.show().preview.tolerance);
        let metric = self.method().metric.unwrap_or(Metric::Settings);
        let plan = self.plan(metric, tolerance)?;
        let words = format!(
            "{} of {} reach {} %",
            count(plan.used, "refined picture"),
            plan.rank,
            percent(tolerance)
        );
        let title = format!("{}: {words}", plan.show);
        let text = format!("{words} (metric {})", plan.metric);
        Ok((chart::panels(&title, &[spectrum(&plan)], theme), text))
    }

    fn plot_basis(&mut self, theme: Theme) -> Result<(Drawing, String), Error> {
        self.coarse()?;
        let text = match self.refined() {
            0 => format!(
                "nothing is refined yet: the coarse pictures of {}",
                count(self.show().coordinates().len(), "source")
            ),
            n => count(n, "basis picture"),
        };
        let sheet = self.basis_sheet(theme)?;
        let sheet = sheet.ok_or_else(crate::interpreter::refine::no_stage)?;
        Ok((sheet, text))
    }

    fn plot_error(&mut self, theme: Theme) -> Result<(Drawing, String), Error> {
        self.coarse()?;
        let tolerance = self.show().preview.tolerance;
        let text = format!(
            "{}: predicted error {} %",
            count(self.refined(), "refined picture"),
            percent(self.predicted_error()?)
        );
        Ok((self.error_chart(tolerance, theme)?, text))
    }
}

/// Shares of the sequence's light: of each direction, and of what is left after it.
fn spectrum(plan: &PlanReport) -> Panel {
    let total = plan
        .singular_values
        .iter()
        .map(|s| s * s)
        .sum::<f64>()
        .sqrt();
    let start = plan.predicted.first().map_or(1.0, |p| p.error);
    let scale = if total > 0.0 { start / total } else { 0.0 };
    let values = plan.singular_values.iter().enumerate();
    let shown = |x: f64| {
        if x > ROUNDING { 100.0 * x } else { f64::NAN }
    };
    let left = plan.predicted.iter();
    let used = |refined: usize, error: f64| match (refined == plan.used, error > ROUNDING) {
        (true, true) => format!("{}: {} %", count(refined, "picture"), percent(error)),
        (true, false) => format!("{}: nothing left", count(refined, "picture")),
        (false, _) => String::new(),
    };
    // The picture that leaves nothing is seen under the tolerance, at the foot.
    let after = |refined: usize, error: f64| match used(refined, error).ends_with("left") {
        true => 25.0 * plan.tolerance,
        false => shown(error),
    };
    Panel {
        title: format!("metric {}", plan.metric),
        x: Axis::new("refined pictures", Scale::Whole),
        y: Axis::new("% of the sequence", Scale::Log),
        series: vec![
            Series {
                name: "error predicted after so many pictures".to_owned(),
                points: left
                    .clone()
                    .map(|p| (p.refined as f64, after(p.refined, p.error)))
                    .collect(),
                marker: Marker::Square,
                labels: left.map(|p| used(p.refined, p.error)).collect(),
            },
            Series {
                name: "singular value: what each one adds".to_owned(),
                points: values
                    .map(|(i, s)| (i as f64 + 1.0, shown(scale * s)))
                    .collect(),
                marker: Marker::Circle,
                labels: Vec::new(),
            },
        ],
        reference: Some((
            100.0 * plan.tolerance,
            format!("tolerance {} %", percent(plan.tolerance)),
        )),
    }
}
