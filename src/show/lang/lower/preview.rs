//! `show`, `preview`, `stage`, `haze`, `view`: everything before the rig.

use std::collections::BTreeMap;

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::geometry;
use crate::geometry::Vec3;
use crate::lang::ast::{Clause, Declaration, Span, Statement, Word};
use crate::lang::codes;
use crate::lang::quantity::{self, Unit, Wanted};
use crate::lang::quote::unquoted;
use crate::lang::report::Place;

use crate::model::{NamedView, Stage};
use crate::units::{Tolerance, ToneCurve, fraction};

/// Height of the frame behind a `lens`, metres.
const FRAME: f64 = 0.024;

/// The placeholder for an unknown view.
const NOWHERE: geometry::View = geometry::View {
    from: Vec3::ZERO,
    to: Vec3::ZERO,
    fov: 0.0,
    roll: 0.0,
    width: 0,
    height: 0,
};

impl<'a> Lower<'a, '_> {
    /// Lowers `show`, `preview`, `stage` and `view`.
    pub fn preview(&mut self, statements: &[Statement<'a>]) {
        let (mut title, mut preview, mut haze) = (None, None, None);
        let mut surfaces = BTreeMap::new();
        for statement in statements {
            match &statement.item {
                Declaration::Show(text) => {
                    self.once(&mut title, "show", statement.span);
                    self.show.title = unquoted(*text);
                }
                Declaration::Preview(entries) => {
                    self.once(&mut preview, "preview", statement.span);
                    self.preview_entries(entries);
                }
                Declaration::Stage { path, clauses } => self.stage(statement.span, *path, clauses),
                Declaration::Surface {
                    material,
                    reflectances,
                    clauses,
                    solids,
                } => self.surface(
                    statement.span,
                    *material,
                    (reflectances, clauses, solids),
                    &mut surfaces,
                ),
                Declaration::Haze { amount, clauses } => {
                    self.once(&mut haze, "haze", statement.span);
                    self.haze(statement.span, *amount, clauses);
                }
                Declaration::View { name, clauses } => self.view(statement.span, *name, clauses),
                _ => {}
            }
        }
        for statement in statements {
            if let Declaration::Figure(clauses) = &statement.item {
                self.figure(statement.span, clauses);
            }
        }
    }

    /// Reports a second statement of a kind allowed once; `first` remembers the first.
    pub fn once(&mut self, first: &mut Option<Span>, what: &str, span: Span) {
        let Some(earlier) = first.replace(span) else {
            return;
        };
        *first = Some(earlier);
        self.report.add(
            Diagnostic::error(codes::SAID_TWICE, format!("`{what}` stands twice"))
                .place(span, "again here")
                .place(earlier, "first here")
                .help("keep one of the two"),
        );
    }

    fn preview_entries(&mut self, entries: &[(Word<'a>, Word<'a>, Option<Word<'a>>)]) {
        let mut seen: Vec<Word<'a>> = Vec::new();
        for (key, value, stops) in entries {
            if let Some(earlier) = seen.iter().find(|w| w.text == key.text) {
                self.once(&mut Some(earlier.span), key.text, key.span);
            }
            seen.push(*key);
            // An error was reported; the entry then changes nothing.
            let _ = self.preview_entry(*key, *value);
            if let Some(stops) = stops {
                let _ = self.bias(*stops);
            }
        }
    }

    fn preview_entry(&mut self, key: Word<'a>, value: Word<'a>) -> Option<()> {
        let is_quantity = !matches!(value.text, "filmic" | "plain" | "on" | "off" | "auto");
        let quality = "qualities are 1 to 3, with another renderer up to 5";
        match (key.text, value.text) {
            ("tone", "filmic") => self.show.preview.tone = ToneCurve::Filmic,
            ("tone", "plain") => self.show.preview.tone = ToneCurve::Plain,
            ("exposure", "auto") => self.show.preview.exposure = None,
            ("tone" | "dither", _) => return self.unfit(key, value),
            (other, signed) if signed.starts_with('+') && other != "exposure" => {
                return self.unfit(key, value);
            }
            _ if !is_quantity => return self.unfit(key, value),
            ("tolerance", _) => self.show.preview.tolerance = self.tolerance(value)?,
            (_, steps) if steps.ends_with("steps") => {
                return self.unfit(key, value);
            }
            ("gap", _) => self.show.preview.gap = self.duration(value)?,
            ("rate", _) => {
                let range = "a rate is 1 to 1000 frames a second";
                self.show.preview.rate =
                    self.within(value, Wanted::Number, (1.0, 1000.0), range)?;
            }
            ("white", _) => {
                let text = self.text(value)?;
                if quantity::unit(&text) != Ok(Unit::Kelvin) {
                    return self.unfit(key, value);
                }
                let kelvin = quantity::number(&text).unwrap_or_default();
                if !(2000.0..=12_000.0).contains(&kelvin) {
                    let message = format!(
                        "`{}` is out of range: white is 2000 K to 12000 K",
                        value.text
                    );
                    let help = "the white of tungsten lamps is `white 3200 K`";
                    let at = (value.span, "out of range");
                    return self.report.error(codes::RANGE, message, at, help);
                }
                self.show.preview.white = Some(kelvin);
            }
            ("exposure", _) => {
                let range = "an exposure is -30 to 30 stops";
                self.show.preview.exposure = Some(self.stops(value, range)?);
            }
            ("coarse", _) => self.show.preview.coarse = self.step(value, quality)?,
            _ => self.show.preview.refined = self.step(value, quality)?,
        }
        Some(())
    }

    fn tolerance(&mut self, value: Word<'a>) -> Option<Tolerance> {
        let text = value.text;
        if !text.ends_with("steps") {
            let range = "a tolerance is 0% to 100%";
            let percent = self.within(value, Wanted::Share, (0.0, 100.0), range)?;
            return Some(Tolerance::from(fraction(percent)));
        }
        let steps = Tolerance::parse_steps(text);
        if steps.is_none() {
            let message = format!("`{text}` is out of range: a tolerance is 0 to 255 steps");
            let at = (value.span, "out of range");
            return self.report.error(codes::RANGE, message, at, "");
        }
        steps
    }

    /// The stops after `exposure auto`.
    fn bias(&mut self, word: Word<'a>) -> Option<()> {
        self.show.preview.bias = self.stops(word, "stops are -30 to 30")?;
        Some(())
    }

    fn stops(&mut self, word: Word<'a>, range: &str) -> Option<f64> {
        let text = word.text.trim_start_matches('+');
        let unsigned = Word { text, ..word };
        self.within(unsigned, Wanted::Number, (-30.0, 30.0), range)
    }

    /// Reports a value of the wrong kind for its setting.
    fn unfit(&mut self, key: Word<'a>, value: Word<'a>) -> Option<()> {
        let (key, word) = (key.text, value.text);
        let message = match (key, word) {
            ("tone", _) => format!("`{word}` is no tone: it is `filmic` or `plain`"),
            ("dither", _) => {
                "`dither` was removed: films and pages show 8 bits as they are".to_owned()
            }
            ("white", _) => {
                format!("`white` is a colour temperature such as `3200 K`, not `{word}`")
            }
            (_, signed) if signed.starts_with('+') => {
                format!("only `exposure` has a `+`, `{key}` is a plain number")
            }
            (_, steps) if steps.ends_with("steps") => {
                format!("only `tolerance` has `steps`, `{key}` is a plain number")
            }
            (_, "auto") => format!("only `exposure` may be `auto`, `{key}` is a number"),
            _ => format!("`{word}` is a tone, not a number"),
        };
        self.report
            .error(codes::DOES_NOT_FIT, message, (value.span, "not here"), "")
    }

    fn step(&mut self, value: Word<'a>, range: &str) -> Option<u8> {
        let step = self.within(value, Wanted::Number, (1.0, 5.0), range)?;
        if step.fract() == 0.0 {
            return Some(step as u8);
        }
        let message = format!("`{}` is not a quality: they are whole numbers", value.text);
        self.report.error(
            codes::RANGE,
            message,
            (value.span, "not whole"),
            "write `coarse 1  refined 2`",
        )
    }

    fn stage(&mut self, span: Span, path: Word<'a>, clauses: &[Clause<'a>]) {
        let id = self.node(span);
        self.repeated_clauses(clauses);
        let find = |word| Clause::find(clauses, word);
        if let (Some(y), Some(z)) = (find("y"), find("z")) {
            self.once(&mut Some(y.span), "up", z.span);
        }
        let value = |word| Clause::value(clauses, word);
        let range = "a unit of a file is 1 micrometre to 100 km";
        let scale =
            value("scale").and_then(|w| self.within(*w, Wanted::Length, (1e-6, 1e5), range));
        let range = "a turn is -360 to 360 degrees";
        let turn =
            value("turn").and_then(|w| self.within(*w, Wanted::Angle, (-360.0, 360.0), range));
        let at = find("at").and_then(|c| self.position(&c.values));
        let place = geometry::Place {
            scale: scale.unwrap_or(1.0),
            turn: turn.unwrap_or(0.0),
            at: at.unwrap_or_default(),
        };
        let text = unquoted(path);
        if text.is_empty() {
            let help =
                "write the name of an OBJ or glTF file next to the show: stage \"tavern.obj\"";
            let at = (path.span, "no file");
            self.report
                .error::<()>(codes::MISSING, "the stage has no file", at, help);
        }
        self.show.stages.push(Stage {
            id,
            path: text,
            z_up: find("z").is_some(),
            one_sided: find("one-sided").is_some(),
            matt: find("matt").is_some(),
            place,
        });
    }

    fn view(&mut self, span: Span, name: Word<'a>, clauses: &[Clause<'a>]) {
        let id = self.node(span);
        self.repeated_clauses(clauses);
        let value = |word| Clause::value(clauses, word);
        let size = value("size").map_or(Some((640, 360)), |w| self.size(*w));
        let (width, height) = size.unwrap_or_default();
        let imported = value("from").filter(|w| w.text.starts_with('"'));
        let camera = match imported {
            Some(_) => self.imported_view(name, clauses),
            None => self.own_view(span, name, clauses),
        };
        self.show.views.push(NamedView {
            id,
            name: name.text.to_owned(),
            camera: geometry::View {
                width,
                height,
                ..camera
            },
            imported: imported.map(|w| unquoted(*w)),
        });
    }

    /// A view of a camera in the stage, not yet known.
    fn imported_view(&mut self, name: Word<'a>, clauses: &[Clause<'a>]) -> geometry::View {
        let is_more = |c: &&Clause<'a>| !["from", "size"].contains(&c.word.text);
        if let Some(clause) = clauses.iter().find(is_more) {
            let message = format!("a camera of the stage has its own `{}`", clause.word.text);
            let help = format!("write `view {} from \"Camera\"  size 720p`", name.text);
            let at = (clause.span, "not here");
            self.report
                .error::<()>(codes::DOES_NOT_FIT, message, at, help);
        }
        NOWHERE
    }

    fn own_view(&mut self, span: Span, name: Word<'a>, clauses: &[Clause<'a>]) -> geometry::View {
        let find = |word| Clause::find(clauses, word);
        let mut point = |word| find(word).map(|c| self.position(&c.values));
        let (from, to) = (point("from"), point("to"));
        if let (Some(fov), Some(lens)) = (find("fov"), find("lens")) {
            self.once(&mut Some(fov.span), "the angle", lens.span);
        }
        let fov = self.field_of_view(find("fov"), find("lens"));
        for (missing, there) in [
            ("from", from.is_some()),
            ("to", to.is_some()),
            ("fov", fov.is_some()),
        ] {
            if !there {
                let message = format!("the view `{}` has no `{missing}`", name.text);
                let help = format!(
                    "write `view {} from 0, -14, 1.7  to 0, 0, 2.2  fov 28`",
                    name.text
                );
                let at = (name.span, "incomplete");
                self.report.error::<()>(codes::MISSING, message, at, help);
            }
        }
        let (from, to) = (from.flatten(), to.flatten());
        if from.is_some() && from == to {
            let message = format!(
                "the view `{}` looks nowhere: `from` and `to` are one point",
                name.text
            );
            self.report
                .error::<()>(codes::RANGE, message, (span, "no direction"), "");
        }
        let range = "a roll is -180 to 180 degrees";
        let roll = find("roll").and_then(|c| c.values.first());
        let roll = roll.and_then(|w| self.within(*w, Wanted::Angle, (-180.0, 180.0), range));
        geometry::View {
            from: from.unwrap_or_default(),
            to: to.unwrap_or_default(),
            fov: fov.flatten().unwrap_or_default(),
            roll: roll.unwrap_or_default(),
            ..NOWHERE
        }
    }

    /// Vertical field of view in degrees, from `fov` or `lens`; `None` without either.
    fn field_of_view(
        &mut self,
        fov: Option<&Clause<'a>>,
        lens: Option<&Clause<'a>>,
    ) -> Option<Option<f64>> {
        let value = |clause: Option<&Clause<'a>>| clause.and_then(|c| c.values.first()).copied();
        if let Some(word) = value(fov) {
            let range = "a field of view is 1 to 170 degrees";
            return Some(self.within(word, Wanted::Angle, (1.0, 170.0), range));
        }
        let range = "a lens is 4mm to 1300mm long";
        let long = self.within(value(lens)?, Wanted::Length, (0.004, 1.3), range);
        Some(long.map(|long| 2.0 * (0.5 * FRAME / long).atan().to_degrees()))
    }

    /// Reports keywords used twice among the clauses of a statement.
    pub fn repeated_clauses(&mut self, clauses: &[Clause<'a>]) {
        for (i, clause) in clauses.iter().enumerate().take(32) {
            // A clause that begins with no letter is a value without a keyword.
            let keyword = clause.word.text.starts_with(char::is_alphabetic);
            let same = |c: &&Clause<'a>| keyword && c.word.text == clause.word.text;
            if let Some(earlier) = clauses.iter().take(i).find(same) {
                self.once(&mut Some(earlier.span), clause.word.text, clause.span);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::diagnostic::Sources;
    use crate::lang::{codes, parse};

    #[test]
    fn views_by_lens_and_from_cameras_of_the_stage() {
        let text = "view a from 0, -5, 1 to 0, 0, 1 lens 35mm roll -4 size 1080p\n\
                    view b from \"Camera 1\" size 4k\n";
        let show = parse(&mut Sources::default(), "a", text).show.unwrap();
        let [a, b] = show.views.as_slice() else {
            unreachable!("{:?}", show.views)
        };
        let wanted = 2.0 * (12.0_f64 / 35.0).atan().to_degrees();
        assert!((a.camera.fov - wanted).abs() < 1e-12 && a.camera.roll == -4.0);
        assert_eq!((a.camera.width, a.camera.height), (1920, 1080));
        assert_eq!(b.imported.as_deref(), Some("Camera 1"));
        assert_eq!((b.camera.width, b.camera.height), (3840, 2160));
    }

    #[test]
    fn what_is_no_view_says_why() {
        for (text, code) in [
            ("from 0, -5, 1 to 0, 0, 1", codes::MISSING),
            ("from 0, -5, 1 to 0, 0, 1 lens 35", codes::RANGE),
            (
                "from 0, -5, 1 to 0, 0, 1 lens 35mm fov 30",
                codes::SAID_TWICE,
            ),
            ("from 0, -5, 1 to 0, 0, 1 fov 30 size 999p", codes::RANGE),
            ("from 0, -5, 1 to 0, 0, 1 fov 30 roll 200", codes::RANGE),
            ("from \"Camera\" fov 30", codes::DOES_NOT_FIT),
        ] {
            let text = format!("view v {text}\n");
            let found = parse(&mut Sources::default(), "a", &text).diagnostics;
            let codes: Vec<_> = found.iter().map(|d| d.code).collect();
            assert_eq!(codes, [code], "{text}: {found:#?}");
        }
    }
}
