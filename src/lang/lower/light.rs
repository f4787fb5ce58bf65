//! Lights: what each kind is told, and what it must be told.

use super::Lower;
use crate::geometry::Vec3;
use crate::lang::ast::{self, Clause, Span, Word};
use crate::lang::codes;
use crate::lang::names::Kind;
use crate::lang::quantity::{self, Unit, Wanted};
use crate::scene::Spot;
use crate::scene::mount::Mount;
use crate::scene::profile::Profile;
use crate::scene::shape::Shape;
use crate::show::{Hung, Light, LightKind, Output, Strength};
use crate::units::Rgb;

/// The kinds of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Spot,
    Panel,
    Sphere,
    Disc,
    Photometric,
    Projection,
    /// A light of the stage's file.
    Hung,
}

impl Form {
    fn of(word: &str) -> Option<Form> {
        Some(match word {
            "spot" => Form::Spot,
            "panel" => Form::Panel,
            "sphere" => Form::Sphere,
            "disc" => Form::Disc,
            "photometric" => Form::Photometric,
            "project" => Form::Projection,
            "from" => Form::Hung,
            _ => return None,
        })
    }

    fn word(self) -> &'static str {
        match self {
            Form::Spot => "spot",
            Form::Panel => "panel",
            Form::Sphere => "sphere",
            Form::Disc => "disc",
            Form::Photometric => "photometric light",
            Form::Projection => "projection",
            Form::Hung => "light of the stage",
        }
    }

    /// The clauses it needs, all of them.
    fn clauses(self) -> &'static [&'static str] {
        match self {
            Form::Spot => &["at", "aim", "beam", "field"],
            Form::Panel | Form::Hung => &[],
            Form::Sphere => &["at", "radius"],
            Form::Disc => &["at", "aim", "radius"],
            Form::Photometric => &["at", "aim"],
            Form::Projection => &["from", "aim", "field"],
        }
    }

    fn takes(self, word: &str) -> bool {
        let turns = matches!(self, Form::Photometric | Form::Projection);
        let file = self == Form::Hung && ["at", "aim", "beam", "field"].contains(&word);
        self.clauses().contains(&word) || (turns && word == "turn") || file
    }

    /// It may be left to a file how bright it is.
    fn has_own_amount(self) -> bool {
        matches!(self, Form::Panel | Form::Photometric | Form::Hung)
    }

    fn takes_unit(self, unit: Unit) -> bool {
        match unit {
            Unit::Candela | Unit::Lumen => true,
            Unit::Radiance => matches!(self, Form::Panel | Form::Sphere | Form::Disc),
            _ => false,
        }
    }

    /// What says how bright it is, and in what colour.
    fn amounts(self) -> &'static str {
        match self {
            Form::Spot | Form::Photometric | Form::Projection | Form::Hung => {
                "`1200 cd`, `800 lm`, `2700 K` or a colour such as `#ffb36b`"
            }
            _ => "`40 cd/m2`, `800 lm`, `60 cd`, `6500 K` or a colour such as `#cfe0ff`",
        }
    }

    /// A whole light of its kind.
    fn example(self) -> &'static str {
        match self {
            Form::Spot => "spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd",
            Form::Panel => "panel pane_left  40 cd/m2",
            Form::Sphere => "sphere at 0, 0, 3  radius 5cm  800 lm",
            Form::Disc => "disc at 0, 0, 3  aim 0, 0, 0  radius 20cm  800 lm",
            Form::Photometric => "photometric \"desk.ies\"  at 0, -2, 4  aim 0, 0, 1",
            Form::Projection => {
                "project \"clouds.png\"  from 0, -9, 4  aim 0, 3, 2  field 50  9000 cd"
            }
            Form::Hung => "from \"Key\"  1200 cd",
        }
    }
}

/// What a light's clauses say, before it is known to have what it needs.
#[derive(Clone, Debug, Default)]
struct Spec {
    form: Option<Form>,
    /// The panel's material, or the file.
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

    fn tint(&self) -> Rgb {
        let white = self.kelvin.unwrap_or(Rgb::WHITE);
        white.filtered(self.gel.unwrap_or(Rgb::WHITE))
    }
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
            let kind = self.finished(light, &spec.unwrap_or_default());
            self.show.lights.push(Light {
                id,
                name: light.name.text.to_owned(),
                // A placeholder: there is an error, so that the show never leaves this room.
                kind: kind.unwrap_or(LightKind::Panel {
                    material: String::new(),
                    strength: Strength::Own,
                }),
            });
        }
    }

    /// Fills in `specs[index]` and those of all lights it is like.
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
        if let Some(form) = Form::of(light.kind.text) {
            spec.form = Some(form);
            spec.of = light.of.map(super::unquoted).unwrap_or_default();
        }
        self.repeated_clauses(&light.clauses);
        for clause in &light.clauses {
            // What is wrong was said; the clause then changes nothing.
            let _ = self.clause(clause, spec);
        }
    }

    fn clause(&mut self, clause: &Clause<'a>, spec: &mut Spec) -> Option<()> {
        let word = clause.word;
        if clause.values.is_empty() {
            match self.text(word)?.starts_with('#') {
                true => spec.gel = Some(self.colour(word)?),
                false => self.amount(word, spec)?,
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

    /// A clause that lights of this kind have. Nothing is known of a light like a broken one.
    fn fits(&mut self, clause: &Clause<'a>, form: Option<Form>) -> Option<()> {
        let Some(form) = form.filter(|f| !f.takes(clause.word.text)) else {
            return Some(());
        };
        let (kind, word) = (form.word(), clause.word.text);
        let reason = match form {
            Form::Panel => ": it shines from its own surface",
            _ => "",
        };
        let message = format!("a {kind} has no `{word}`{reason}");
        let help = match form {
            Form::Panel => String::new(),
            _ => format!("a whole {kind} is `{}`", form.example()),
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
            return Some(());
        }
        let form = spec.form.unwrap_or(Form::Spot);
        let Some(unit) = unit.ok().filter(|u| form.takes_unit(*u)) else {
            let kind = form.word();
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
            // A light like a broken one would only repeat its mistakes.
            return None;
        }
        self.complete(light, spec, form)?;
        Some(match form {
            Form::Panel => LightKind::Panel {
                material: spec.of.clone(),
                strength: self.strength(light, spec)?,
            },
            Form::Spot => LightKind::Spot(self.spot(light, spec)?),
            Form::Sphere | Form::Disc => LightKind::Shape {
                shape: self.shape(light, spec)?,
                strength: self.strength(light, spec)?,
            },
            Form::Photometric => LightKind::Photometric {
                path: spec.of.clone(),
                mount: self.mount(light, spec)?,
                tint: spec.tint(),
                output: output(spec),
            },
            Form::Hung => LightKind::Hung(Hung {
                name: spec.of.clone(),
                position: spec.at,
                aim: spec.aim,
                beam: spec.beam,
                field: spec.field,
                white: spec.kelvin,
                gel: spec.gel.unwrap_or(Rgb::WHITE),
                output: output(spec),
            }),
            Form::Projection => LightKind::Projection {
                path: spec.of.clone(),
                mount: self.mount(light, spec)?,
                field: spec.field?,
                tint: spec.tint(),
                output: output(spec),
            },
        })
    }

    /// Says what is missing.
    fn complete(&mut self, light: &ast::Light<'a>, spec: &Spec, form: Form) -> Option<()> {
        // What was written but wrong has been said already.
        let stated = |word: &str| light.clauses.iter().any(|c| c.word.text == word);
        let lacking = form.clauses().iter().filter(|w| spec.lacks(w));
        let mut missing: Vec<String> = lacking
            .clone()
            .filter(|w| !stated(w))
            .map(|w| format!("`{w}`"))
            .collect();
        let optional = form.has_own_amount();
        let amount_stated = light.clauses.iter().any(|c| c.values.is_empty());
        if spec.amount.is_none() && !optional && !amount_stated {
            missing.push("intensity".to_owned());
        }
        if missing.is_empty() {
            let whole = lacking.count() == 0 && (optional || spec.amount.is_some());
            return whole.then_some(());
        }
        let (kind, name) = (form.word(), light.name.text);
        let message = format!("the {kind} `{name}` has no {}", missing.join(", no "));
        let help = format!("a whole {kind} is `light {name} {}`", form.example());
        let at = (light.name.span, "incomplete");
        self.report.error(codes::MISSING, message, at, help)
    }

    /// A place and an aim that differ.
    fn focus(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<(Vec3, Vec3)> {
        let (position, aim) = (spec.at?, spec.aim?);
        if position != aim {
            return Some((position, aim));
        }
        let kind = spec.form?.word();
        let from = spec.form?.clauses().first()?;
        let message = format!(
            "the {kind} `{}` shines nowhere: `{from}` and `aim` are one point",
            light.name.text
        );
        let at = (light.name.span, "no direction");
        self.report.error(codes::RANGE, message, at, "")
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

    fn spot(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<Spot> {
        let (position, aim) = self.focus(light, spec)?;
        let (beam, field) = (spec.beam?, spec.field?);
        let Some(profile) = Profile::new(beam, field) else {
            let message = format!(
                "the field of `{}` ({field} degrees) is not wider than its beam ({beam})",
                light.name.text
            );
            let help = "the beam ends at half the peak intensity, the field at a tenth: `beam 24  field 40`";
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

    fn shape(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<Shape> {
        let radius = spec.radius?;
        if spec.form == Some(Form::Sphere) {
            let centre = spec.at?;
            return Some(Shape::Sphere { centre, radius });
        }
        let (centre, aim) = self.focus(light, spec)?;
        Some(Shape::Disc {
            centre,
            aim,
            radius,
        })
    }

    fn strength(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<Strength> {
        let tint = spec.tint();
        match spec.amount {
            Some((flux, Unit::Lumen)) => Some(Strength::Flux(tint.scaled(flux))),
            Some((intensity, Unit::Candela)) => Some(Strength::Intensity(tint.scaled(intensity))),
            Some((radiance, _)) => Some(Strength::Radiance(tint.scaled(radiance))),
            None if tint == Rgb::WHITE => Some(Strength::Own),
            None => {
                let message = format!(
                    "the panel `{}` has a colour, but no radiance",
                    light.name.text
                );
                let help = "say how bright it is too, as `40 cd/m2`";
                let at = (light.name.span, "how bright?");
                self.report.error(codes::MISSING, message, at, help)
            }
        }
    }
}

fn output(spec: &Spec) -> Output {
    match spec.amount {
        None => Output::Own,
        Some((lumens, Unit::Lumen)) => Output::Flux(lumens),
        Some((candela, _)) => Output::Peak(candela),
    }
}
