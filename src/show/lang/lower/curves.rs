//! Named curves, and paths of levels.

use super::Lower;
use super::values::Setting;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::{self, Declaration, Statement, Word};
use crate::lang::codes;
use crate::lang::names::Kind;
use crate::lang::quantity::Wanted;
use crate::lang::report::Place;
use crate::model::{CurveKnot, FADES, Fade, Interpolation, Knot, NamedCurve};
use crate::units::{Time, fraction, percent};

/// A knot of a path whose level may be a colour.
#[derive(Clone, Copy, Debug)]
pub struct PathKnot {
    /// Time and, for hermite and bezier, slope and inner levels.
    pub knot: Knot,
    /// Setting of the bank at the knot.
    pub setting: Setting,
    /// Inner levels as written; `None` when they equal the level.
    pub via: Option<[f64; 2]>,
}

impl<'a> Lower<'a, '_> {
    /// Lowers named curves.
    pub fn curves(&mut self, statements: &[Statement<'a>]) {
        for statement in statements {
            let Declaration::Curve { name, path } = &statement.item else {
                continue;
            };
            let id = self.node(statement.span);
            let mut knots = Vec::with_capacity(path.knots.len());
            for (i, knot) in path.knots.iter().enumerate() {
                let last = i + 1 == path.knots.len();
                knots.extend(self.curve_knot(knot, path.interpolation, last));
            }
            // A knot with an error was reported; the order of the others is then not checked.
            if knots.len() < path.knots.len() {
                knots.clear();
            }
            self.curve_order(*name, path, &knots);
            self.show.curves.push(NamedCurve {
                id,
                name: name.text.to_owned(),
                interpolation: path.interpolation,
                knots,
            });
        }
    }

    fn curve_knot(
        &mut self,
        knot: &ast::Knot<'a>,
        kind: Interpolation,
        last: bool,
    ) -> Option<CurveKnot> {
        let at = self.within(
            knot.at,
            Wanted::Number,
            (0.0, 1.0),
            "a curve runs from 0 to 1 of the fade's time",
        );
        let value = self.level(knot.value);
        let (slope, via) = self.extras(knot, kind, last)?;
        let (at, value) = (at?, value?);
        Some(CurveKnot {
            at,
            value,
            slope,
            handles: via.unwrap_or([value; 2]),
        })
    }

    fn curve_order(&mut self, name: Word<'a>, path: &ast::Path<'a>, knots: &[CurveKnot]) {
        for (pair, written) in knots.windows(2).zip(path.knots.iter().skip(1)) {
            if let [a, b] = pair
                && b.at <= a.at
            {
                self.backwards(written);
            }
        }
        let (Some(first), Some(last)) = (knots.first(), knots.last()) else {
            return;
        };
        if first.at != 0.0 || last.at != 1.0 {
            let message = format!("the curve `{}` must run from 0 to 1", name.text);
            let help = "the first number of a knot is a fraction of the fade's time: `spline 0 0, 0.4 8, 1 100`";
            let at = (path.span, "does not");
            self.report
                .error::<()>(codes::CURVE_ENDS, message, at, help);
        }
    }

    fn backwards(&mut self, knot: &ast::Knot<'a>) {
        let message = format!(
            "the knot at `{}` is not later than the one before it",
            knot.at.text
        );
        let help = "knots follow each other in time; for a jump take `steps`, or two cues";
        self.report
            .error::<()>(codes::KNOTS, message, (knot.at.span, "not later"), help);
    }

    /// Slope and inner levels of a knot, in fractions of full, as the kind of curve requires.
    fn extras(
        &mut self,
        knot: &ast::Knot<'a>,
        kind: Interpolation,
        last: bool,
    ) -> Option<(f64, Option<[f64; 2]>)> {
        let wants_slope = kind == Interpolation::Hermite;
        let wants_via = kind == Interpolation::Bezier && !last;
        let what = match (knot.slope.is_some(), knot.via.is_some()) {
            (true, _) if !wants_slope => Some("`slope` belongs to `hermite` curves"),
            (_, true) if kind == Interpolation::Bezier && last => {
                Some("the last knot of a bezier has no `via`: no span begins there")
            }
            (_, true) if !wants_via => Some("`via` belongs to `bezier` curves"),
            (false, _) if wants_slope => Some("a knot of a hermite curve has a slope"),
            (_, false) if wants_via => {
                Some("a knot of a bezier has the two levels between it and the next")
            }
            _ => None,
        };
        if let Some(what) = what {
            let help = match kind {
                Interpolation::Hermite => "write a knot as `3s 55 slope 4`",
                Interpolation::Bezier => "write `bezier 0s 0 via 10 60, 4s 80`",
                _ => "write a knot as `3s 55`",
            };
            return self
                .report
                .error(codes::KNOT_FORM, what, (knot.span, ""), help);
        }
        let number = |lower: &mut Self, w: Word<'a>| {
            lower.within(w, Wanted::Number, (-1e6, 1e6), "that is too steep")
        };
        let slope = match knot.slope {
            Some(word) => fraction(number(self, word)?),
            None => 0.0,
        };
        let via = match knot.via {
            Some((a, b)) => {
                let (a, b) = (self.inner_level(a), self.inner_level(b));
                Some([a?, b?])
            }
            None => None,
        };
        Some((slope, via))
    }

    /// An inner level of a bezier, as a fraction of full. It may lie outside 0 to 1 as long as the
    /// curve does not.
    fn inner_level(&mut self, word: Word<'a>) -> Option<f64> {
        let range = "that is far from every level";
        self.within(word, Wanted::Level, (-1000.0, 1000.0), range)
            .map(fraction)
    }

    /// A path of levels; `None` after an error was reported.
    pub fn path(&mut self, path: &ast::Path<'a>) -> Option<Vec<PathKnot>> {
        let count = path.knots.len();
        let mut out = Some(Vec::with_capacity(count));
        let mut before: Option<Time> = None;
        for (i, written) in path.knots.iter().enumerate() {
            let knot = self.path_knot(written, path.interpolation, i + 1 == count);
            let Some(knot) = knot else {
                out = None;
                continue;
            };
            let time = knot.knot.time;
            match before {
                None if i == 0 && time != Time::ZERO => {
                    let message = format!("a path begins at time 0, not at {time}");
                    let help =
                        "times in a path count from its own start; to begin later, add `delay`";
                    self.report.error::<()>(
                        codes::KNOTS,
                        message,
                        (written.at.span, "not 0"),
                        help,
                    );
                    out = None;
                }
                Some(earlier) if time <= earlier => {
                    self.backwards(written);
                    out = None;
                }
                _ => {}
            }
            before = Some(time);
            if let Some(out) = &mut out {
                out.push(knot);
            }
        }
        out
    }

    fn path_knot(
        &mut self,
        knot: &ast::Knot<'a>,
        kind: Interpolation,
        last: bool,
    ) -> Option<PathKnot> {
        let time = self.duration(knot.at);
        let setting = self.setting(knot.value);
        let (slope, via) = self.extras(knot, kind, last)?;
        Some(PathKnot {
            knot: Knot {
                time: time?,
                level: 0.0,
                slope,
                handles: [0.0; 2],
            },
            setting: setting?,
            via,
        })
    }

    /// The shape of a fade.
    pub fn fade(&mut self, word: Word<'a>) -> Option<Fade> {
        if let Some(fade) = Fade::built_in(word.text) {
            return Some(fade);
        }
        let built_in: Vec<&str> = FADES.iter().map(|curve| curve.name).collect();
        let (_, index) = self.find(word, &[Kind::Curve], &built_in)?;
        let curve = self.show.curves.get(index)?;
        let ends = (curve.knots.first()?.value, curve.knots.last()?.value);
        if ends == (0.0, 1.0) {
            return Some(Fade::Curve(index));
        }
        let message = format!(
            "the curve `{}` is no fade: a fade goes from 0 to 100",
            word.text
        );
        let goes = format!("goes from {} to {}", percent(ends.0), percent(ends.1));
        self.report.add(
            Diagnostic::error(codes::CURVE_ENDS, message)
                .place(word.span, "used as a fade")
                .place_of(curve.id, &self.spans, goes),
        );
        None
    }
}
