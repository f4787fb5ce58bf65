//! Lights, banks, fixed lights and groups.

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::geometry::Vec3;
use crate::lang::ast::{self, Clause, Declaration, ImageWords, Span, Statement, Word};
use crate::lang::codes;
use crate::lang::names::{FADES, Kind};
use crate::lang::quantity::{self, Unit, Wanted};
use crate::lang::report::Place;
use crate::scene::{ImageFile, Spot};
use crate::show::{Bank, Dimmer, Fixed, Group, Light, LightKind, NodeId};
use crate::units::Rgb;

/// What a light's clauses say, before its kind is known to have what it needs.
#[derive(Clone, Debug, Default)]
struct Spec {
    /// The panel's material; `None` for spots.
    material: Option<String>,
    at: Option<Vec3>,
    aim: Option<Vec3>,
    beam: Option<f64>,
    field: Option<f64>,
    amount: Option<(f64, Unit)>,
    kelvin: Option<Rgb>,
    gel: Option<Rgb>,
}

impl<'a> Lower<'a, '_> {
    /// Lowers the statements of this room.
    pub fn rig(&mut self, statements: &[Statement<'a>]) {
        let lights: Vec<(&ast::Light<'a>, Span)> = statements
            .iter()
            .filter_map(|s| match &s.item {
                Declaration::Light(light) => Some((light, s.span)),
                _ => None,
            })
            .collect();
        self.lights(&lights);
        for statement in statements {
            match &statement.item {
                Declaration::Bank(bank) => self.bank(bank, statement.span),
                Declaration::Fixed {
                    name,
                    lights,
                    image,
                    level,
                } => {
                    let id = self.node(statement.span);
                    let fixed = Fixed {
                        id,
                        name: name.text.to_owned(),
                        lights: self.shining(id, lights, *image),
                        level: level.map_or(100.0, |w| self.level(w).unwrap_or_default()),
                    };
                    self.show.fixed.push(fixed);
                }
                _ => {}
            }
        }
        let mut next = 0;
        for bank in &self.show.banks {
            self.first_coordinates.push(next);
            next += if bank.rgb { 3 } else { 1 };
        }
        self.first_coordinates.push(next);
        for statement in statements {
            if let Declaration::Group { name, banks } = &statement.item {
                let group = Group {
                    id: self.node(statement.span),
                    name: name.text.to_owned(),
                    banks: self.listed(banks, Kind::Bank),
                };
                self.show.groups.push(group);
            }
        }
    }

    /// Names in a row, each once.
    fn listed(&mut self, words: &[Word<'a>], kind: Kind) -> Vec<usize> {
        let mut seen = std::collections::BTreeMap::new();
        let mut out = Vec::new();
        for word in words {
            let Some((_, index)) = self.find(*word, &[kind], &[]) else {
                continue;
            };
            match seen.insert(index, word.span) {
                Some(earlier) => self.once(&mut Some(earlier), word.text, word.span),
                None => out.push(index),
            }
        }
        out
    }

    /// The lights of the statement `id`: those it names, or its image, which becomes a light that
    /// no other statement can name.
    fn shining(
        &mut self,
        id: NodeId,
        names: &[Word<'a>],
        image: Option<ImageWords<'a>>,
    ) -> Vec<usize> {
        let Some(ImageWords { path, layer }) = image else {
            return self.listed(names, Kind::Light);
        };
        let file = ImageFile {
            path: super::unquoted(path),
            layer: layer.map(super::unquoted),
        };
        for (word, text) in [(Some(path), Some(&file.path)), (layer, file.layer.as_ref())] {
            if let (Some(word), Some("")) = (word, text.map(String::as_str)) {
                let help =
                    "a whole one is `bank front image \"groups.exr\" layer \"Combined_front\"`";
                let at = (word.span, "empty");
                self.report
                    .error::<()>(codes::MISSING, "the image has no name", at, help);
            }
        }
        self.show.lights.push(Light {
            id,
            name: match layer {
                None => format!("image {}", path.text),
                Some(layer) => format!("image {} layer {}", path.text, layer.text),
            },
            kind: LightKind::Image(file),
        });
        vec![self.show.lights.len() - 1]
    }

    fn bank(&mut self, bank: &ast::Bank<'a>, span: Span) {
        let id = self.node(span);
        for (what, words) in [("channel", &bank.channels), ("dimmer", &bank.dimmers)] {
            if let [first, second, ..] = words.as_slice() {
                self.once(&mut Some(first.span), what, second.span);
            }
        }
        let channel = bank.channels.first();
        let channel = channel.and_then(|w| self.count(*w, 999_999, "a channel"));
        let dimmer = bank.dimmers.first().and_then(|w| self.dimmer(*w));
        let bank = Bank {
            id,
            name: bank.name.text.to_owned(),
            lights: self.shining(id, &bank.lights, bank.image),
            channel,
            dimmer: dimmer.unwrap_or(Dimmer::Linear),
            rgb: bank.rgb,
        };
        self.show.banks.push(bank);
    }

    fn dimmer(&mut self, word: Word<'a>) -> Option<Dimmer> {
        match word.text {
            "linear" => Some(Dimmer::Linear),
            "square" => Some(Dimmer::Square),
            fade if FADES.contains(&fade) => {
                let message = format!("`{fade}` is a fade, not a dimmer");
                let help = "a dimmer is `linear`, `square` or a curve of the show";
                self.report.error(
                    codes::WRONG_KIND_OF_NAME,
                    message,
                    (word.span, "not a dimmer"),
                    help,
                )
            }
            _ => self
                .find(word, &[Kind::Curve], &["linear", "square"])
                .map(|(_, index)| Dimmer::Curve(index)),
        }
    }

    // ---- lights -----------------------------------------------------------------------------

    fn lights(&mut self, lights: &[(&ast::Light<'a>, Span)]) {
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
                    radiance: None,
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
                let help = "one of them must be a `spot` or a `panel`";
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
        match (light.kind.text, light.of) {
            ("panel", Some(of)) => spec.material = Some(super::unquoted(of)),
            ("project", _) => {
                let message = "this build does not know scenic projections yet";
                let help = "take a `spot` or a `panel` for now";
                let at = (light.kind.span, "not yet");
                self.report.error::<()>(codes::NOT_YET, message, at, help);
            }
            _ => {}
        }
        self.repeated_clauses(&light.clauses);
        for clause in &light.clauses {
            // What is wrong was said; the clause then changes nothing.
            let _ = self.clause(clause, spec);
        }
    }

    fn clause(&mut self, clause: &Clause<'a>, spec: &mut Spec) -> Option<()> {
        let word = clause.word;
        let angle = |lower: &mut Self| {
            let value = *clause.values.first()?;
            lower.within(
                value,
                Wanted::Angle,
                (0.1, 179.0),
                "a spot's angles are 0.1 to 179 degrees",
            )
        };
        match word.text {
            "at" | "aim" | "beam" | "field" if spec.material.is_some() => {
                let message = format!(
                    "a panel has no `{}`: it shines from its own surface",
                    word.text
                );
                return self.report.error(
                    codes::DOES_NOT_FIT,
                    message,
                    (clause.span, "not of a panel"),
                    "",
                );
            }
            "at" => spec.at = Some(self.position(&clause.values)?),
            "aim" => spec.aim = Some(self.position(&clause.values)?),
            "beam" => spec.beam = Some(angle(self)?),
            "field" => spec.field = Some(angle(self)?),
            colour if colour.starts_with('#') => spec.gel = Some(self.colour(word)?),
            _ => self.amount(word, spec)?,
        }
        Some(())
    }

    fn amount(&mut self, word: Word<'a>, spec: &mut Spec) -> Option<()> {
        let panel = spec.material.is_some();
        match (quantity::unit(word.text), panel) {
            (Ok(Unit::Kelvin), _) => spec.kelvin = Some(self.kelvin(word)?),
            (Ok(unit @ (Unit::Candela | Unit::Lumen)), false)
            | (Ok(unit @ Unit::Radiance), true) => match quantity::number(word.text) {
                Ok(value) if value > 0.0 => spec.amount = Some((value, unit)),
                _ => {
                    let message = format!("`{}` is out of range: a light must shine", word.text);
                    self.report.error::<()>(
                        codes::RANGE,
                        message,
                        (word.span, "not above 0"),
                        "",
                    )?;
                }
            },
            _ => {
                let (kind, wanted) = if panel {
                    (
                        "panel",
                        "`40 cd/m2`, `6500 K` or a colour such as `#cfe0ff`",
                    )
                } else {
                    (
                        "spot",
                        "`1200 cd`, `800 lm`, `2700 K` or a colour such as `#ffb36b`",
                    )
                };
                let message = format!("`{}` says nothing about a {kind}", word.text);
                let help = format!("a {kind} takes {wanted}");
                return self.report.error(
                    codes::WRONG_QUANTITY,
                    message,
                    (word.span, "not here"),
                    help,
                );
            }
        }
        Some(())
    }

    fn finished(&mut self, light: &ast::Light<'a>, spec: &Spec) -> Option<LightKind> {
        let tint = spec
            .kelvin
            .unwrap_or(Rgb::WHITE)
            .filtered(spec.gel.unwrap_or(Rgb::WHITE));
        if let Some(material) = &spec.material {
            let radiance = spec.amount.map(|(value, _)| tint.scaled(value));
            if radiance.is_none() && tint != Rgb::WHITE {
                let message = format!(
                    "the panel `{}` has a colour, but no radiance",
                    light.name.text
                );
                let help = "say how bright it is too, as `40 cd/m2`";
                let at = (light.name.span, "how bright?");
                return self.report.error(codes::MISSING, message, at, help);
            }
            return Some(LightKind::Panel {
                material: material.clone(),
                radiance,
            });
        }
        if self.report.failed() && light.kind.text != "spot" {
            // A light like a broken one would only repeat its mistakes.
            return None;
        }
        self.spot(light, spec, tint).map(LightKind::Spot)
    }

    fn spot(&mut self, light: &ast::Light<'a>, spec: &Spec, tint: Rgb) -> Option<Spot> {
        let stated = |word: &str| light.clauses.iter().any(|c| c.word.text == word);
        let missing: Vec<&str> = [
            ("at", spec.at.is_none()),
            ("aim", spec.aim.is_none()),
            ("beam", spec.beam.is_none()),
            ("field", spec.field.is_none()),
        ]
        .into_iter()
        .filter_map(|(word, none)| (none && !stated(word)).then_some(word))
        .collect();
        let no_amount = spec.amount.is_none() && !light.clauses.iter().any(|c| c.values.is_empty());
        let mut wanted: Vec<String> = missing.iter().map(|w| format!("`{w}`")).collect();
        if no_amount {
            wanted.push("intensity".to_owned());
        }
        if !wanted.is_empty() {
            let message = format!(
                "the spot `{}` has no {}",
                light.name.text,
                wanted.join(", no ")
            );
            let help = format!(
                "a whole spot is `light {} spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd`",
                light.name.text
            );
            let at = (light.name.span, "incomplete");
            return self.report.error(codes::MISSING, message, at, help);
        }
        let (position, aim, beam, field) = (spec.at?, spec.aim?, spec.beam?, spec.field?);
        if position == aim {
            let message = format!(
                "the spot `{}` shines nowhere: `at` and `aim` are one point",
                light.name.text
            );
            let at = (light.name.span, "no direction");
            return self.report.error(codes::RANGE, message, at, "");
        }
        if field <= beam {
            let message = format!(
                "the field of `{}` ({field} degrees) is not wider than its beam ({beam})",
                light.name.text
            );
            let help = "the beam ends at half the peak intensity, the field at a tenth: `beam 24  field 40`";
            return self
                .report
                .error(codes::BEAM, message, (light.name.span, "too narrow"), help);
        }
        let candela = match spec.amount? {
            (lumens, Unit::Lumen) => lumens / lumens_per_candela(beam, field),
            (candela, _) => candela,
        };
        Some(Spot {
            position,
            aim,
            beam,
            field,
            intensity: tint.scaled(candela),
        })
    }

    // ---- remarks ----------------------------------------------------------------------------

    /// Lights in no bank, and lights in two.
    pub fn lights_in_use(&mut self) {
        let mut users: Vec<Option<usize>> = self.show.lights.iter().map(|_| None).collect();
        let banks = self.show.banks.iter().map(|b| (b.id, &b.lights));
        let fixed = self.show.fixed.iter().map(|f| (f.id, &f.lights));
        let all: Vec<_> = banks.chain(fixed).collect();
        for (user, (id, lights)) in all.iter().enumerate() {
            for light in lights.iter() {
                let earlier = users.get_mut(*light).and_then(|slot| slot.replace(user));
                let earlier = earlier
                    .and_then(|e| all.get(e))
                    .and_then(|(id, _)| self.spans.get(*id));
                let (Some(here), Some(there)) = (self.spans.get(*id), earlier) else {
                    continue;
                };
                let name = self.show.lights.get(*light).map_or("", |l| l.name.as_str());
                self.report.add(
                    Diagnostic::warning(
                        codes::SHARED_LIGHT,
                        format!("the light `{name}` is in two places"),
                    )
                    .place(here, "here")
                    .place(there, "and here")
                    .help("it shines twice as bright when both are full"),
                );
            }
        }
        for (light, user) in self.show.lights.iter().zip(users) {
            if let (None, Some(span)) = (user, self.spans.get(light.id)) {
                let message = format!("the light `{}` is in no bank: it never shines", light.name);
                self.report.add(
                    Diagnostic::warning(codes::UNUSED_LIGHT, message)
                        .place(span, "")
                        .help(format!(
                            "write `bank NAME = {}`, or `fixed NAME = {}`",
                            light.name, light.name
                        )),
                );
            }
        }
    }
}

/// Luminous flux of a spot of peak intensity 1 cd: the integral of its profile over the sphere.
///
/// The profile is 2^-(a/b)^p with `b` half the beam angle and `p` such that it is a tenth at half
/// the field angle; Simpson's rule over 0 to 180 degrees, 4096 steps.
fn lumens_per_candela(beam: f64, field: f64) -> f64 {
    let half = beam.to_radians() / 2.0;
    let power = 10.0_f64.log2().ln() / (field / beam).ln();
    let value = |a: f64| (-(a / half).powf(power) * std::f64::consts::LN_2).exp() * a.sin();
    let steps = 4096;
    let width = std::f64::consts::PI / f64::from(steps);
    let inner: f64 = (1..steps)
        .map(|i| value(f64::from(i) * width) * if i % 2 == 1 { 4.0 } else { 2.0 })
        .sum();
    let ends = value(0.0) + value(std::f64::consts::PI);
    std::f64::consts::TAU * (inner + ends) * width / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flux_of_a_narrow_gaussian_beam_has_a_closed_form() {
        // With field/beam = sqrt(log2 10) the power is 2; the integral of 2 pi a 2^-(a/b)^2 over
        // all a is pi b^2 / ln 2, and sin a = a to 2e-4 for a beam of 2 degrees.
        let half = 1.0_f64.to_radians();
        let exact = std::f64::consts::PI * half * half / std::f64::consts::LN_2;
        let found = lumens_per_candela(2.0, 2.0 * 10.0_f64.log2().sqrt());
        assert!((found / exact - 1.0).abs() < 5e-4, "{found} {exact}");
    }
}
