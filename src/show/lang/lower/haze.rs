//! `haze`: its extinction, given directly or as a visibility, and its scattering.

use super::Lower;
use crate::lang::ast::{Clause, Span, Word};
use crate::lang::codes;
use crate::lang::quantity::Wanted;
use crate::model::Haze;

/// Least and greatest visibility, metres.
const VISIBILITY: (f64, f64) = (1.0, 1e5);

impl<'a> Lower<'a, '_> {
    /// Lowers the statement.
    pub fn haze(&mut self, span: Span, amount: Word<'a>, clauses: &[Clause<'a>]) {
        let id = self.node(span);
        self.repeated_clauses(clauses);
        let value = |word| Clause::value(clauses, word);
        let extinction = self.extinction(amount);
        let range = "`forward` is -0.95 to 0.95, 0 scatters to all sides alike";
        let forward =
            value("forward").and_then(|w| self.within(*w, Wanted::Number, (-0.95, 0.95), range));
        let range = "an albedo is 0 to 1, the part of the light that is not absorbed";
        let albedo =
            value("albedo").and_then(|w| self.within(*w, Wanted::Number, (0.0, 1.0), range));
        self.show.haze = extinction.map(|extinction| Haze {
            extinction,
            forward: forward.unwrap_or(0.0),
            albedo: albedo.unwrap_or(1.0),
        });
        self.show.haze_id = Some(id);
    }

    /// Extinction of a visibility or an extinction, 1/m.
    fn extinction(&mut self, amount: Word<'a>) -> Option<f64> {
        let Some(digits) = amount.text.strip_suffix("/m") else {
            let range = "a visibility is 1m to 100000m; an extinction has its unit, as in `0.05/m`";
            let visibility = self.within(amount, Wanted::Length, VISIBILITY, range)?;
            return Some(Haze::KOSCHMIEDER / visibility);
        };
        let extinction = digits.parse::<f64>().unwrap_or_default();
        let most = Haze::KOSCHMIEDER / VISIBILITY.0;
        if extinction > 0.0 && extinction <= most {
            return Some(extinction);
        }
        let message = format!(
            "`{}` is out of range: an extinction is above 0, at most {most}/m",
            amount.text
        );
        let help = "write `haze 0.01/m` for a touch of haze, `haze 0.05/m` for a concert";
        let at = (amount.span, "out of range");
        self.report.error(codes::RANGE, message, at, help)
    }
}

#[cfg(test)]
mod tests {
    use crate::diagnostic::Sources;
    use crate::lang::{codes, parse};
    use crate::model::Haze;

    #[test]
    fn visibility_and_extinction_mean_the_same_haze() {
        let haze = |text: &str| {
            let show = parse(&mut Sources::default(), "a", text).show.unwrap();
            assert!(show.haze_id.is_some());
            show.haze.unwrap()
        };
        let plain = Haze {
            extinction: 0.05,
            forward: 0.0,
            albedo: 1.0,
        };
        for text in ["haze 60m", "haze 0.05/m", "let v = 120m\nhaze (v / 2)"] {
            assert_eq!(haze(&format!("{text}\n")), plain, "{text}");
        }
        let all = Haze {
            forward: -0.6,
            albedo: 0.9,
            ..plain
        };
        assert_eq!(haze("haze 60m albedo 0.9 forward -0.6\n"), all);
        assert_eq!(all.visibility(), 60.0);
    }

    #[test]
    fn numbers_out_of_range_and_of_another_kind_are_refused() {
        for (text, code) in [
            ("0.05", codes::RANGE),
            ("90cm", codes::RANGE),
            ("100001m", codes::RANGE),
            ("0/m", codes::RANGE),
            ("-0.05/m", codes::RANGE),
            ("3.1/m", codes::RANGE),
            ("60s", codes::WRONG_QUANTITY),
            ("60m forward 1", codes::RANGE),
            ("60m forward -0.96", codes::RANGE),
            ("60m albedo 1.1", codes::RANGE),
            ("60m albedo 90%", codes::WRONG_QUANTITY),
            ("60m forward 0.5 forward 0.6", codes::SAID_TWICE),
            ("60m\nhaze 30m", codes::SAID_TWICE),
        ] {
            let text = format!("haze {text}\n");
            let found = parse(&mut Sources::default(), "a", &text).diagnostics;
            let codes: Vec<_> = found.iter().map(|d| d.code).collect();
            assert_eq!(codes, [code], "{text}: {found:#?}");
        }
    }
}
