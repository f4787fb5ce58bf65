//! Lights: what each kind takes, and what it must be given.

use super::{Lower, colour, heads};
use crate::geometry::Vec3;
use crate::geometry::mount::Mount;
use crate::geometry::profile::Profile;
use crate::geometry::shape::Shape;
use crate::lang::ast::{self, Clause, Span, Word};
use crate::lang::codes;
use crate::lang::lanterns::lanterns;
use crate::lang::names::{Kind, nearest};
use crate::lang::quantity::{self, Unit, Wanted};
use crate::model::Spot;
use crate::model::{ImportedLuminaire, LightKind, Luminaire, Output, Strength};
use crate::units::Rgb;

/// Clauses of a kind of light.
struct Form {
    /// The word that opens it.
    word: &'static str,
    /// Its name in messages.
    phrase: &'static str,
    /// Required clauses; the first is its position.
    needs: &'static [&'static str],
    /// Optional clauses.
    takes: &'static [&'static str],
    /// Reason why it has no other clause, for kinds where `example` does not show it.
    reason: &'static str,
    /// True when a file or a material may give the brightness in place of the text.
    own_amount: bool,
    /// True when the text may give the brightness as the luminance of a surface.
    luminance: bool,
    /// A complete light of its kind.
    example: &'static str,
}

impl Form {
    fn takes_amount(&self, unit: Unit) -> bool {
        match unit {
            Unit::Candela | Unit::Lumen => true,
            Unit::Luminance => self.luminance,
            _ => false,
        }
    }

    /// Clauses that give brightness and colour.
    fn amounts(&self) -> &'static str {
        if !self.luminance {
            "`1200 cd`, `800 lm`, `2700 K` or a colour such as `#ffb36b`"
        } else {
            "`40 cd/m2`, `800 lm`, `60 cd`, `6500 K` or a colour such as `#cfe0ff`"
        }
    }
}

const SPOT: Form = Form {
    word: "spot",
    phrase: "spot",
    needs: &["at", "aim", "beam", "field"],
    takes: &heads::CLAUSES,
    reason: "",
    own_amount: false,
    luminance: false,
    example: "spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd",
};

/// The kinds of light. A new kind needs a row here, an arm in `finished`, and its word in the
/// grammar.
static FORMS: [Form; 8] = [
    SPOT,
    Form {
        word: "lantern",
        needs: &["at", "aim"],
        takes: &[
            "beam", "field", "moves", "pan", "tilt", "zoom", "speed", "standing",
        ],
        own_amount: true,
        example: "lantern \"profile 26\"  at 0, -2, 4  aim 0, 0, 1",
        ..SPOT
    },
    Form {
        word: "panel",
        phrase: "panel",
        needs: &[],
        takes: &[],
        reason: ": it shines from its own surface",
        own_amount: true,
        luminance: true,
        example: "panel pane_left  40 cd/m2",
    },
    Form {
        word: "sphere",
        phrase: "sphere",
        needs: &["at", "radius"],
        takes: &[],
        luminance: true,
        example: "sphere at 0, 0, 3  radius 5cm  800 lm",
        ..SPOT
    },
    Form {
        word: "disc",
        phrase: "disc",
        needs: &["at", "aim", "radius"],
        takes: &[],
        luminance: true,
        example: "disc at 0, 0, 3  aim 0, 0, 0  radius 20cm  800 lm",
        ..SPOT
    },
    Form {
        word: "photometric",
        phrase: "photometric light",
        needs: &["at", "aim"],
        takes: &["turn"],
        own_amount: true,
        example: "photometric \"desk.ies\"  at 0, -2, 4  aim 0, 0, 1",
        ..SPOT
    },
    Form {
        word: "project",
        phrase: "projection",
        needs: &["from", "aim", "field"],
        takes: &["turn", "moves", "pan", "tilt", "zoom", "speed", "standing"],
        example: "project \"clouds.png\"  from 0, -9, 4  aim 0, 3, 2  field 50  9000 cd",
        ..SPOT
    },
    Form {
        word: "from",
        phrase: "light of the stage",
        needs: &[],
        takes: &["at", "aim", "beam", "field"],
        own_amount: true,
        example: "from \"Key\"  1200 cd",
        ..SPOT
    },
];

/// The alternatives that a message lists when a light has no kind yet.
pub(in crate::lang) const EXPECTED: &str = "a kind of light (`spot`, `lantern`, `panel`, `sphere`, `disc`, `photometric`, `project`, `from`, `like`)";

/// The words of the kinds.
pub(in crate::lang) fn words() -> impl Iterator<Item = &'static str> {
    FORMS.iter().map(|form| form.word)
}

/// The clauses of a light, before the check that they are complete.
#[derive(Clone, Default)]
pub(super) struct Spec {
    form: Option<&'static Form>,
    /// Material of a panel, or file.
    of: String,
    at: Option<Vec3>,
    aim: Option<Vec3>,
    beam: Option<f64>,
    field: Option<f64>,
    radius: Option<f64>,
    turn: f64,
    amount: Option<(f64, Unit)>,
    kelvin: Option<Rgb>,
    gel: Option<Rgb>,
    /// White and colour as written.
    written: [String; 2],
    /// Set for a moving light.
    head: Option<heads::Ranges>,
}

impl Spec {
    fn lacks(&self, word: &str) -> bool {
        match word {
            "at" | "from" => self.at.is_none(),
            "aim" => self.aim.is_none(),
            "beam" => self.beam.is_none(),
            "field" => self.field.is_none(),
            "radius" => self.radius.is_none(),
            _ => false,
        }
    }

    /// Brightness of a point source.
    fn output(&self) -> Output {
        match self.amount {
            None => Output::Own,
            Some((lumens, Unit::Lumen)) => Output::Flux(lumens),
            Some((candela, _)) => Output::Peak(candela),
        }
    }

    fn tint(&self) -> Rgb {
        let white = self.kelvin.unwrap_or(Rgb::WHITE);
        white.filtered(self.gel.unwrap_or(Rgb::WHITE))
    }

    /// Kind and colour in the words of the text.
    fn words(&self) -> [String; 2] {
        // A lantern is recognised by its name.
        let form = self
            .form
            .map(|form| form.word)
            .filter(|word| *word != "lantern");
        let form = form.unwrap_or_default();
        [format!("{form} {}", self.of), self.written.join(" ")].map(|text| text.trim().to_owned())
    }

    /// Brightness of a surface, when the text gives it.
    fn strength(&self) -> Option<Strength> {
        let (amount, unit) = self.amount?;
        let light = self.tint().scaled(amount);
        Some(match unit {
            Unit::Lumen => Strength::Flux(light),
            Unit::Candela => Strength::Intensity(light),
            _ => Strength::Luminance(light),
        })
    }
}

/// A word of the text without regard to spacing and case.
fn plain(text: &str) -> String {
    let text = text.chars().filter(|c| !c.is_whitespace());
    text.collect::<String>().to_lowercase()
}

impl<'a> Lower<'a, '_> {
    /// Lowers all lights, in order.
    pub fn lights(&mut self, lights: &[(&ast::Light<'a>, Span)]) {
        let mut specs: Vec<Option<Spec>> = lights.iter().map(|_| None).collect();
        for index in 0..lights.len() {
            self.with_model(index, lights, &mut specs);
        }
        for ((light, span), spec) in lights.iter().zip(specs) {
            let id = self.node(*span);
            let spec = spec.unwrap_or_default();
            let kind = self.finished(light, &spec);
            let head = kind.as_ref().zip(spec.head.as_ref());
            let head = head.and_then(|(kind, ranges)| self.head(light, ranges, kind));
            let [form, colour] = spec.words();
            self.show.lights.push(Luminaire {
                id,
                name: light.name.text.to_owned(),
                form,
                colour,
                gel: spec.gel,
                head,
                // A placeholder: after an error, lowering returns no show.
                kind: kind.unwrap_or(LightKind::Panel {
                    material: String::new(),
                    strength: None,
                }),
            });
        }
    }

    /// Fills in `specs[index]` and those of the lights that it is like.
    fn with_model(
        &mut self,
        index: usize,
        lights: &[(&ast::Light<'a>, Span)],
        specs: &mut [Option<Spec>],
    ) {
        let mut chain: Vec<usize> = Vec::new();
        let mut inside = std::collections::BTreeSet::new();
        let mut next = Some(index);
        let mut spec = Spec::default();
        while let Some(i) = next {
            if let Some(Some(known)) = specs.get(i) {
                spec = known.clone();
                break;
            }
            let Some((light, _)) = lights.get(i) else {
                break;
            };
            if !inside.insert(i) {
                let message = format!("the light `{}` is like itself", light.name.text);
                let help = "one of them must be a `spot` or another kind of its own";
                let at = (light.name.span, "in a circle");
                self.report.error::<()>(codes::CYCLE, message, at, help);
                break;
            }
            chain.push(i);
            next = match light.kind.text {
                "like" => light
                    .of
                    .and_then(|of| self.find(of, &[Kind::Light], &[]))
                    .map(|(_, i)| i),
                _ => None,
            };
        }
        for i in chain.into_iter().rev() {
            if let Some((light, _)) = lights.get(i) {
                self.overridden(light, &mut spec);
            }
            if let Some(slot) = specs.get_mut(i) {
                *slot = Some(spec.clone());
            }
        }
    }

    fn overridden(&mut self, light: &ast::Light<'a>, spec: &mut Spec) {
        let form = FORMS.iter().find(|f| f.word == light.kind.text);
        if let Some(form) = form {
            spec.form = Some(form);
            spec.of = light.of.map(super::unquoted).unwrap_or_default();
        }
        if let ("lantern", Some(of)) = (light.kind.text, light.of) {
            self.lantern(of, spec);
        }
        self.repeated_clauses(&light.clauses);
        for clause in &light.clauses {
            // An error was reported; the clause then changes nothing.
            let _ = self.clause(clause, spec);
        }
    }

    /// Takes the figures of a lantern's data sheet; clauses after its name replace them.
    fn lantern(&mut self, name: Word<'a>, spec: &mut Spec) {
        let Some(found) = lanterns().find(|lantern| lantern.name == spec.of) else {
            let message = format!("there is no lantern called {}", name.text);
            let names = lanterns().map(|lantern| lantern.name);
            let help = match nearest(&spec.of, names) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => {
                    let names: Vec<&str> = lanterns().map(|lantern| lantern.name).collect();
                    format!("there are: {}", names.join(", "))
                }
            };
            let at = (name.span, "not in the table");
            self.report
                .error::<()>(codes::UNKNOWN_NAME, message, at, help);
            // Nothing else is known about it.
            spec.form = None;
            return;
        };
        let unit = if found.is_flux {
            Unit::Lumen
        } else {
            Unit::Candela
        };
        spec.amount = Some((found.amount, unit));
        (spec.beam, spec.field) = (Some(found.beam), Some(found.field));
    }

    fn clause(&mut self, clause: &Clause<'a>, spec: &mut Spec) -> Option<()> {
        let word = clause.word;
        if heads::CLAUSES.contains(&word.text) {
            self.fits(clause, spec.form)?;
            return self.head_clause(clause, &mut spec.head);
        }
        if clause.values.is_empty() {
            let text = self.text(word)?;
            if colour::is_colour(&text) {
                spec.gel = Some(self.colour(word)?);
                spec.written[1] = plain(&text);
            } else {
                self.amount(word, spec)?
            }
            return Some(());
        }
        self.fits(clause, spec.form)?;
        let first = *clause.values.first()?;
        match word.text {
            "at" | "from" => spec.at = Some(self.position(&clause.values)?),
            "aim" => spec.aim = Some(self.position(&clause.values)?),
            "beam" => spec.beam = Some(self.beam_angle(first)?),
            "field" => spec.field = Some(self.beam_angle(first)?),
            "turn" => {
                let range = "a turn is within 360 degrees";
                spec.turn = self.within(first, Wanted::Angle, (-360.0, 360.0), range)?;
            }
            "radius" => {
                let range = "a radius is 1 mm to 1000 m";
                spec.radius = Some(self.within(first, Wanted::Length, (1e-3, 1e3), range)?);
            }
            _ => {}
        }
        Some(())
    }

    fn beam_angle(&mut self, word: Word<'a>) -> Option<f64> {
        let range = "the angles of a beam are 0.1 to 179 degrees";
        self.within(word, Wanted::Angle, (0.1, 179.0), range)
    }

    /// Checks that lights of this kind have the clause. A light like a broken one passes.
    fn fits(&mut self, clause: &Clause<'a>, form: Option<&Form>) -> Option<()> {
        let word = clause.word.text;
        let has = |f: &&Form| f.needs.contains(&word) || f.takes.contains(&word);
        let Some(form) = form.filter(|f| !has(f)) else {
            return Some(());
        };
        let kind = form.phrase;
        let message = format!("a {kind} has no `{word}`{}", form.reason);
        let help = match form.reason {
            "" => format!("a whole {kind} is `{}`", form.example),
            _ => String::new(),
        };
        let label = format!("not of a {kind}");
        self.report
            .error(codes::DOES_NOT_FIT, message, (clause.span, &label), help)
    }

    fn amount(&mut self, word: Word<'a>, spec: &mut Spec) -> Option<()> {
        let text = self.text(word)?;
        let unit = quantity::unit(&text);
        if unit == Ok(Unit::Kelvin) {
            spec.kelvin = Some(self.kelvin(word)?);
            let number = plain(&text);
            spec.written[0] = format!("{} K", number.trim_end_matches('k'));
            return Some(());
        }
        let form = spec.form.unwrap_or(&SPOT);
        let Some(unit) = unit.ok().filter(|u| form.takes_amount(*u)) else {
            let kind = form.phrase;
            let message = format!("`{}` says nothing about a {kind}", word.text);
            let help = format!("a {kind} takes {}", form.amounts());
            let at = (word.span, "not here");
            return self.report.error(codes::WRONG_QUANTITY, message, at, help);
        };
        match quantity::number(&text) {
            Ok(value) if value > 0.0 => spec.amount = Some((value, unit)),
            _ => {
                let message = format!("`{}` is out of range: a light must shine", word.text);
                let at = (word.span, "not above 0");
                return self.report.error(codes::RANGE, message, at, "");
            }
        }
        Some(())
    }

    fn finished(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<LightKind> {
        let form = spec.form?;
        if self.report.failed() && light.kind.text == "like" {
            // A light like a broken one would only repeat its errors.
            return None;
        }
        self.complete(light, spec, form)?;
        let (of, tint, output) = (spec.of.clone(), spec.tint(), spec.output());
        Some(match form.word {
            "spot" | "lantern" => LightKind::Spot(self.spot(light, spec)?),
            "panel" => LightKind::Panel {
                material: of,
                strength: self.panel_strength(light, spec)?,
            },
            "sphere" => {
                let (centre, radius) = (spec.at?, spec.radius?);
                LightKind::Shape {
                    shape: Shape::Sphere { centre, radius },
                    strength: spec.strength()?,
                }
            }
            "disc" => {
                let (centre, aim) = self.focus(light, spec)?;
                let radius = spec.radius?;
                LightKind::Shape {
                    shape: Shape::Disc {
                        centre,
                        aim,
                        radius,
                    },
                    strength: spec.strength()?,
                }
            }
            "photometric" => LightKind::Photometric {
                path: of,
                mount: self.mount(light, spec)?,
                tint,
                output,
            },
            "project" => LightKind::Projection {
                path: of,
                mount: self.mount(light, spec)?,
                field: spec.field?,
                tint,
                output,
            },
            _ => LightKind::ImportedLuminaire(ImportedLuminaire {
                name: of,
                position: spec.at,
                aim: spec.aim,
                beam: spec.beam,
                field: spec.field,
                white: spec.kelvin,
                gel: spec.gel.unwrap_or(Rgb::WHITE),
                output,
            }),
        })
    }

    /// Reports missing clauses.
    fn complete(&mut self, light: &ast::Light<'a>, spec: &Spec, form: &Form) -> Option<()> {
        // A clause with an error was reported already.
        let stated = |word: &str| light.clauses.iter().any(|c| c.word.text == word);
        let lacking = form.needs.iter().filter(|w| spec.lacks(w));
        let mut missing: Vec<String> = lacking
            .clone()
            .filter(|w| !stated(w))
            .map(|w| format!("`{w}`"))
            .collect();
        let optional = form.own_amount;
        let bare = |c: &Clause<'_>| c.values.is_empty() && !heads::CLAUSES.contains(&c.word.text);
        let amount_stated = light.clauses.iter().any(bare);
        if spec.amount.is_none() && !optional && !amount_stated {
            missing.push("intensity".to_owned());
        }
        if missing.is_empty() {
            let whole = lacking.count() == 0 && (optional || spec.amount.is_some());
            return whole.then_some(());
        }
        let (kind, name) = (form.phrase, light.name.text);
        let message = format!("the {kind} `{name}` has no {}", missing.join(", no "));
        let help = format!("a whole {kind} is `light {name} {}`", form.example);
        let at = (light.name.span, "incomplete");
        self.report.error(codes::MISSING, message, at, help)
    }

    /// Position and aim, which must differ.
    fn focus(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<(Vec3, Vec3)> {
        let (position, aim) = (spec.at?, spec.aim?);
        if position != aim {
            return Some((position, aim));
        }
        let Form { phrase, needs, .. } = spec.form?;
        let from = needs.first()?;
        let message = format!(
            "the {phrase} `{}` shines nowhere: `{from}` and `aim` are one point",
            light.name.text
        );
        let at = (light.name.span, "no direction");
        self.report.error(codes::RANGE, message, at, "")
    }

    fn spot(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<Spot> {
        let (position, aim) = self.focus(light, spec)?;
        let (beam, field) = (spec.beam?, spec.field?);
        let Some(profile) = Profile::new(beam, field) else {
            let message = format!(
                "the field of `{}` ({field} degrees) is not wider than its beam ({beam})",
                light.name.text
            );
            let help = "the beam ends at half the peak intensity, the field at a tenth: \
                        `beam 24  field 40`";
            let at = (light.name.span, "too narrow");
            return self.report.error(codes::BEAM, message, at, help);
        };
        let candela = match spec.amount? {
            (lumens, Unit::Lumen) => lumens / profile.flux(),
            (candela, _) => candela,
        };
        Some(Spot {
            position,
            aim,
            beam,
            field,
            intensity: spec.tint().scaled(candela),
        })
    }

    fn mount(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<Mount> {
        let (position, aim) = self.focus(light, spec)?;
        let turn = spec.turn;
        Some(Mount {
            position,
            aim,
            turn,
        })
    }

    /// Strength of a panel; its material gives it when the text has neither amount nor colour.
    fn panel_strength(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<Option<Strength>> {
        match spec.strength() {
            None if spec.tint() != Rgb::WHITE => {
                let message = format!(
                    "the panel `{}` has a colour, but no luminance",
                    light.name.text
                );
                let help = "say how bright it is too, as `40 cd/m2`";
                let at = (light.name.span, "how bright?");
                self.report.error(codes::MISSING, message, at, help)
            }
            strength => Some(strength),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parser_expects_every_kind() {
        for word in words() {
            assert!(EXPECTED.contains(&format!("`{word}`")), "{word}");
        }
    }
}
