//! Orders of refined images and their predictions against ground truth: exact errors of the worst
//! moment of a sequence, without rendering a frame.
//!
//! Images of every source at both coarse qualities and at the refined one determine the pool's
//! previews: G is linear, so the refined image of any setting is the sum of the sources', and every
//! error is a quadratic form in the scalar products of D_i = C_i - X_i (finer minus cheaper coarse
//! image) and K_i = R_i - C_i (refined minus coarse). The rules are the pool's own ([`Fit`]).
//! `examples/studies` compares them with others on random shows.

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed by the sources and settings they were made of"
)]

use footlight_engine::Engine;
use footlight_engine::plan::{self, Moment, PlanError, Weighting};
use footlight_engine::pool::{Evidence, Fit, Pool};
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_picture::combine::{combine, dot};
use footlight_show::linalg::Matrix;
use footlight_show::timeline::KeySequence;
use footlight_transport::{Quality, TransportError};

/// Scalar products of the images of a show's n sources, with its keys.
#[derive(Clone, Debug)]
pub struct Trial {
    keys: KeySequence,
    moments: Vec<Moment>,
    /// Norms of the finer coarse images, ‖C_i‖.
    pub norms: Vec<f64>,
    /// D_i·D_j, n x n.
    pub dd: Matrix,
    /// K_i·D_j, n x n.
    pub kd: Matrix,
    /// K_i·K_j, n x n.
    pub kk: Matrix,
}

/// A preview compared with ground truth: the error of light L is (K - a·D)·H·L.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// H: share of each source's light that coarse images show.
    rest: Matrix,
    /// a
    extrapolation: f64,
}

impl Shown {
    /// A preview with refined images of `settings` at coefficients `c`, a row for each source, and
    /// coarse images extrapolated by `extrapolation`.
    pub fn new(settings: &[Vec<f64>], c: &[Vec<f64>], extrapolation: f64) -> Shown {
        let n = c.len();
        let s = Matrix::from_fn(n, settings.len(), |i, j| settings[j][i]);
        let c = Matrix::from_fn(settings.len(), n, |j, i| c[i][j]);
        Shown {
            rest: Matrix::identity(n, n) - s * c,
            extrapolation,
        }
    }
}

/// Definition of the weights w_i of the coordinates; C_i is coordinate i's coarse image at full, ‖·‖
/// the square root of the sum of squares over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// w_i = 1: light as set at the desk.
    Settings,
    /// w_i = ‖C_i‖ · |(1/T) ∫ l_i(t) dt|, with l_i the coordinate's setting over the sequence of
    /// length T (Dorsey, Arvo and Greenberg, "Interactive Design of Complex Time-Dependent
    /// Lighting", 1995).
    Influence,
    /// w_i = ‖D_i‖, with D_i the difference of i's coarse images at two qualities: the estimated
    /// error of its coarse image.
    Error,
}

impl Metric {
    /// All metrics.
    pub const ALL: [Metric; 3] = [Metric::Settings, Metric::Influence, Metric::Error];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Settings => "settings",
            Metric::Influence => "influence",
            Metric::Error => "error",
        }
    }
}

/// Time averages of the settings; a segment's average is the mean of its control points.
fn means(keys: &KeySequence) -> Vec<f64> {
    let timeless = keys.duration() <= 0.0;
    let segments = keys.segments().iter();
    let lengths = segments.map(|s| if timeless { 1.0 } else { s.duration() });
    let total: f64 = lengths.clone().sum();
    let mut out = vec![0.0; keys.coordinates()];
    for (segment, length) in keys.segments().iter().zip(lengths) {
        let share = length / total / segment.keys.len() as f64;
        for key in &segment.keys {
            for (m, x) in out.iter_mut().zip(&keys.keys()[*key]) {
                *m += share * x;
            }
        }
    }
    out
}

/// Order of refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The directions of a metric, [`Trial::weighting`].
    Metric(Metric),
    /// The directions of the true errors, [`Trial::oracle`].
    Oracle,
    /// One image for each bank, the most useful first.
    BankByBank,
}

impl Order {
    /// The pool's own order.
    pub const SHIPPED: Order = Order::Metric(Metric::Error);
}

/// Predicted and true error of the worst moment, relative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// The interpreter's prediction.
    pub predicted: f64,
    /// The true error.
    pub truth: f64,
}

impl Trial {
    /// Creates a trial from the settings of the counted moments and images of every source alone at
    /// unit setting: at the cheaper and the finer coarse quality, and at the refined one. `None`
    /// unless there is one of each for every coordinate of the keys, all of one size.
    ///
    /// # Errors
    /// On cancel.
    pub fn new(
        keys: KeySequence,
        moments: Vec<Vec<f64>>,
        pictures: [&[Image]; 3],
        work: Work<'_>,
    ) -> Result<Option<Trial>, Cancelled> {
        let [coarser, coarse, refined] = pictures;
        let Some(size) = coarse.first().map(|i| (i.width(), i.height())) else {
            return Ok(None);
        };
        let fits = |list: &[Image]| {
            list.len() == keys.coordinates() && list.iter().all(|i| (i.width(), i.height()) == size)
        };
        if !pictures.iter().all(|p| fits(p)) {
            return Ok(None);
        }
        let minus = |a: &[Image], b: &[Image]| -> Result<Vec<Image>, Cancelled> {
            let difference = |(a, b)| {
                work.check()?;
                Ok(combine(size, &[(1.0, a), (-1.0, b)], work.threads))
            };
            a.iter().zip(b).map(difference).collect()
        };
        let (d, k) = (minus(coarse, coarser)?, minus(refined, coarse)?);
        let between = |a: &[Image], b: &[Image]| between(a, b, work);
        let products = [between(&d, &d)?, between(&k, &d)?, between(&k, &k)?];
        let coarse = between(coarse, coarse)?;
        Ok(Some(Trial::of_products(keys, moments, &coarse, products)))
    }

    /// From the scalar products of the finer coarse images, and D·D, K·D and K·K.
    fn of_products(
        keys: KeySequence,
        moments: Vec<Vec<f64>>,
        coarse: &Matrix,
        known: [Matrix; 3],
    ) -> Trial {
        let [dd, kd, kk] = known;
        Trial {
            moments: Moment::relative(moments, |setting| root(form(coarse, setting, setting))),
            norms: roots(coarse),
            dd,
            kd,
            kk,
            keys,
        }
    }

    /// The show's keys.
    pub fn keys(&self) -> &KeySequence {
        &self.keys
    }

    /// Weights of a metric, with the counted moments; `error` is the pool's estimate.
    pub fn weighting(&self, metric: Metric) -> Result<Weighting, PlanError> {
        let weighting = match metric {
            Metric::Settings => return Ok(Weighting::settings(self.norms.len())),
            Metric::Influence => {
                let means = means(&self.keys);
                let weights = self.norms.iter().zip(means).map(|(n, m)| n * m.abs());
                return Weighting::new(weights.collect());
            }
            Metric::Error => Weighting::new(roots(&self.dd))?,
        };
        Ok(weighting.at(self.moments.clone()))
    }

    /// The metric with perfect knowledge: norms of the true coarse errors.
    pub fn oracle(&self) -> Result<Weighting, PlanError> {
        let weighting = Weighting::new(roots(&self.kk))?;
        Ok(weighting.at(self.moments.clone()))
    }

    /// Settings to refine, the most useful first, in a metric.
    pub fn order(&self, weighting: &Weighting) -> Result<Vec<Vec<f64>>, PlanError> {
        plan::next(&self.keys, &[], weighting)
    }

    /// Settings to refine, the most useful first, in an order.
    pub fn ordered(&self, by: Order) -> Result<Vec<Vec<f64>>, PlanError> {
        match by {
            Order::Metric(metric) => self.order(&self.weighting(metric)?),
            Order::Oracle => self.order(&self.oracle()?),
            Order::BankByBank => Ok(self.banks_in_best_order()),
        }
    }

    /// One image per bank, each time the one that reduces the worst true error most.
    pub fn banks_in_best_order(&self) -> Vec<Vec<f64>> {
        let mut units = Pool::unit_settings(self.norms.len());
        let mut order = Vec::new();
        let mut rest: Vec<Moment> = self.moments.clone();
        let mut left: Vec<usize> = (0..units.len()).collect();
        while !left.is_empty() {
            let without = |i: usize| {
                // Without source i the sum over all pairs loses row and column i.
                let error = |Moment { setting, scale }: &Moment| {
                    let row = self.kk.row(i);
                    let along: f64 = row.iter().zip(setting).map(|(k, x)| k * x).sum();
                    let x = setting[i];
                    let now = form(&self.kk, setting, setting);
                    (now - 2.0 * x * along + x * x * row[i]) * scale * scale
                };
                rest.iter().map(error).fold(0.0, f64::max)
            };
            let worst: Vec<f64> = left.iter().map(|i| without(*i)).collect();
            let best = (0..left.len()).min_by(|a, b| worst[*a].total_cmp(&worst[*b]));
            let Some(best) = best else { break };
            let bank = left.remove(best);
            rest.iter_mut()
                .for_each(|moment| moment.setting[bank] = 0.0);
            order.push(std::mem::take(&mut units[bank]));
        }
        order
    }

    /// The preview of a pool with refined images of `settings`.
    pub fn shown(&self, settings: &[Vec<f64>]) -> Result<Shown, PlanError> {
        let extrapolation = self.fit(settings)?.extrapolation;
        let plain = self.shown_in(&self.weighting(Metric::Error)?, settings)?;
        Ok(Shown {
            extrapolation,
            ..plain
        })
    }

    /// The preview by projection in another metric, on coarse images without extrapolation.
    pub fn shown_in(&self, w: &Weighting, settings: &[Vec<f64>]) -> Result<Shown, PlanError> {
        let units = Pool::unit_settings(self.norms.len());
        let c = plan::projection(settings, w, &units)?;
        Ok(Shown::new(settings, &c, 0.0))
    }

    /// Scalar products of (K - a·D).
    fn wrong(&self, a: f64) -> Matrix {
        &self.kk - (&self.kd + self.kd.transpose()) * a + &self.dd * (a * a)
    }

    /// Error of the worst moment, relative to the norm of its coarse image: the square root of the
    /// largest (H·L)ᵀ G_a H·L.
    pub fn error(&self, shown: &Shown) -> f64 {
        let wrong = self.wrong(shown.extrapolation);
        worst(&self.moments, |setting| left_of(shown, &wrong, setting))
    }

    /// Error of one look, in the units of the images.
    pub fn look_error(&self, shown: &Shown, look: &[f64]) -> f64 {
        left_of(shown, &self.wrong(shown.extrapolation), look)
    }

    /// Evidence from refined images of `settings`, one after the other.
    pub fn evidence(&self, settings: &[Vec<f64>]) -> Result<Vec<Evidence>, PlanError> {
        let weighting = self.weighting(Metric::Error)?;
        let of = |s: &Vec<f64>| {
            let terms = s.iter().zip(weighting.weights());
            Evidence {
                kk: form(&self.kk, s, s),
                ke: form(&self.kd, s, s),
                ee: form(&self.dd, s, s),
                expected: terms.map(|(s, w)| (s * w) * (s * w)).sum(),
            }
        };
        Ok(settings.iter().map(of).collect())
    }

    /// The pool's fit.
    pub fn fit(&self, settings: &[Vec<f64>]) -> Result<Fit, PlanError> {
        Ok(Fit::of(1.0, &self.evidence(settings)?))
    }

    /// Predicted and true error of the worst moment.
    pub fn predicted(&self, settings: &[Vec<f64>]) -> Result<Predicted, PlanError> {
        let weighting = self.weighting(Metric::Error)?;
        let left = plan::worst_left(&self.moments, settings, &[], &weighting);
        let forecast = left.last().copied().unwrap_or(0.0);
        Ok(Predicted {
            predicted: forecast * self.fit(settings)?.calibration,
            truth: self.error(&self.shown(settings)?),
        })
    }
}

/// Renders every source of a show alone at three quality steps: at the show's coarse one and the
/// next, as for an operator without stated errors, and at the one after them, the refined one.
pub fn trial(engine: &Engine) -> Result<Trial, Box<dyn std::error::Error>> {
    let coarse = engine.show().preview.coarse;
    let steps = [coarse, coarse + 1, coarse + 2].map(Quality);
    let units = Pool::unit_settings(engine.show().coordinates().len());
    let setup = engine
        .document()
        .setup()
        .ok_or("the show has no stage or view")?;
    let work = Work::silent();
    let render = |step| -> Result<Vec<Image>, TransportError> {
        let mut operator = engine.host().renderer.prepare(setup, step, work)?;
        operator.render(&units, work)
    };
    let [coarser, coarse, refined] = steps.map(render);
    let (coarser, coarse, refined) = (coarser?, coarse?, refined?);
    let keys = engine.document().keys().clone();
    let moments = engine.estimate().settings_of_cues();
    let trial = Trial::new(keys, moments, [&coarser, &coarse, &refined], work)?;
    Ok(trial.ok_or("the show has no banks")?)
}

/// Scalar products of all images of one list with all of another.
fn between(rows: &[Image], columns: &[Image], work: Work<'_>) -> Result<Matrix, Cancelled> {
    let mut out = Matrix::zeros(rows.len(), columns.len());
    for (i, row) in rows.iter().enumerate() {
        work.check()?;
        for (j, column) in columns.iter().enumerate() {
            out[(i, j)] = dot(row, column);
        }
    }
    Ok(out)
}

/// Square roots of a Gram matrix's diagonal.
fn roots(gram: &Matrix) -> Vec<f64> {
    gram.diagonal().iter().map(|x| root(*x)).collect()
}

/// The square root; 0 where rounding made the square negative.
fn root(square: f64) -> f64 {
    square.max(0.0).sqrt()
}

/// The largest error, each times its moment's scale.
fn worst(moments: &[Moment], error: impl Fn(&[f64]) -> f64) -> f64 {
    let lit = moments.iter().filter(|m| m.scale > 0.0);
    let scaled = lit.map(|m| m.scale * error(&m.setting));
    scaled.fold(0.0, f64::max)
}

/// Error of a setting when images are wrong by `gram`.
fn left_of(shown: &Shown, gram: &Matrix, setting: &[f64]) -> f64 {
    let left = &shown.rest * Matrix::from_column_slice(setting.len(), 1, setting);
    root(form(gram, left.as_slice(), left.as_slice()))
}

/// aᵀ·G·b
fn form(gram: &Matrix, a: &[f64], b: &[f64]) -> f64 {
    let row = |i: usize| gram.row(i).iter().zip(b).map(|(g, b)| g * b).sum::<f64>();
    a.iter().enumerate().map(|(i, a)| a * row(i)).sum()
}
