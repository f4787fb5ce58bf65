//! `surface`: redefined materials of the stage, and solids that a show declares.

use std::collections::BTreeMap;

use super::{Lower, colour};
use crate::geometry::Vec3;
use crate::geometry::figure::Figure;
use crate::geometry::solid::Solid;
use crate::lang::ast::{self, Clause, Span, Word};
use crate::lang::codes;
use crate::lang::quantity::Wanted;
use crate::lang::quote::unquoted;
use crate::model::Surface;
use crate::units::Rgb;

/// Default sides of round solids: few for a cylinder, which still looks round on a stage; for a
/// disc as many as a disc light has.
const SIDES: [(&str, usize); 3] = [("cylinder", 12), ("disc", 16), ("sphere", 15)];
const MOST_SIDES: u32 = 64;
/// The least length of a solid's edge, metres.
const LEAST: f64 = 1e-4;

/// Colours of a figure, sRGB: light skin and dark grey cloth.
const SKIN: [u8; 3] = [0xc8, 0x9a, 0x7c];
const CLOTH: [u8; 3] = [0x5a, 0x5c, 0x66];

/// Clauses that each kind requires, and those that it allows.
fn clauses_of(kind: &str) -> (&'static [&'static str], &'static [&'static str]) {
    match kind {
        "box" => (&["from", "to"], &["inside"]),
        "disc" => (&["at", "aim", "radius"], &["sides", "two-sided"]),
        "cylinder" => (&["from", "to", "radius"], &["sides"]),
        "sphere" => (&["at", "radius"], &["sides"]),
        _ => (&[], &["two-sided"]),
    }
}

fn example(kind: &str) -> &'static str {
    match kind {
        "box" => "box from -1, 0, 0  to 1, 1, 0.4",
        "disc" => "disc at 0, 0, 0.8  aim 0, 0, 2  radius 60cm",
        "cylinder" => "cylinder from 2, 2, 0  to 2, 2, 3  radius 20cm",
        "sphere" => "sphere at 2, 2, 1  radius 40cm",
        _ => "quad -3, 4, 0  3, 4, 0  3, 4, 5  -3, 4, 5",
    }
}

impl<'a> Lower<'a, '_> {
    /// Lowers a `surface`; `seen` remembers the names.
    pub fn surface(
        &mut self,
        span: Span,
        material: Word<'a>,
        (reflectances, clauses, solids): (&[Vec<Word<'a>>], &[Clause<'a>], &[ast::Solid<'a>]),
        seen: &mut BTreeMap<String, Span>,
    ) {
        let id = self.node(span);
        let name = unquoted(material);
        if let Some(earlier) = seen.insert(name.clone(), span) {
            self.once(&mut Some(earlier), &format!("surface {name}"), span);
        }
        self.repeated_clauses(clauses);
        let range = "`gloss` is a roughness: 0 is a mirror, 0.2 a varnished floor, 1 matt";
        let gloss = Clause::value(clauses, "gloss")
            .and_then(|w| self.within(*w, Wanted::Number, (0.0, 1.0), range));
        let reflectance = match reflectances {
            // A material of the stage keeps its reflectance.
            [] if Clause::find(clauses, "gloss").is_some() && solids.is_empty() => None,
            [] => {
                let message = format!("the surface `{name}` has no reflectance");
                let help = "add how much light it gives back: `reflectance 0.5`, or a colour";
                let at = (material.span, "incomplete");
                self.report.error(codes::MISSING, message, at, help)
            }
            [one] => self.reflectance(one),
            [first, second, ..] => {
                let place = |words: &[Word<'a>]| words.first().map(|w| w.span);
                if let (mut earlier @ Some(_), Some(later)) = (place(first), place(second)) {
                    self.once(&mut earlier, "reflectance", later);
                }
                None
            }
        };
        let solids = solids.iter().filter_map(|s| self.solid(s)).collect();
        self.show.surfaces.push(Surface {
            id,
            name,
            reflectance: match reflectances {
                [] => None,
                _ => Some(reflectance.unwrap_or_default()),
            },
            gloss,
            solids,
        });
    }

    /// Adds a person: solids of two surfaces that all figures share. A `surface` of their names
    /// replaces the reflectances.
    pub fn figure(&mut self, span: Span, clauses: &[Clause<'a>]) {
        let id = self.node(span);
        self.repeated_clauses(clauses);
        let Some(place) = Clause::find(clauses, "at") else {
            let help = "a whole figure is `figure at 1, 2, 0  height 1.75  facing 30`";
            let at = (span, "incomplete");
            let message = "the figure has no `at`";
            self.report.error::<()>(codes::MISSING, message, at, help);
            return;
        };
        let at = self.position(&place.values);
        let value = |word| Clause::value(clauses, word).copied();
        let range = "a figure is 30 cm to 3 m high";
        let height = value("height").map(|w| self.within(w, Wanted::Length, (0.3, 3.0), range));
        let range = "a figure faces -360 to 360 degrees from the house";
        let facing = value("facing").map(|w| self.within(w, Wanted::Angle, (-360.0, 360.0), range));
        let (Some(at), Some(height), Some(facing)) = (
            at,
            height.unwrap_or(Some(1.75)),
            facing.unwrap_or(Some(0.0)),
        ) else {
            return;
        };
        let figure = Figure { at, height, facing };
        let parts = [
            ("figure.skin", SKIN, figure.skin()),
            ("figure.cloth", CLOTH, figure.cloth()),
        ];
        for (name, srgb, solids) in parts {
            let mut known = self.show.surfaces.iter_mut();
            match known.find(|surface| surface.name == name) {
                Some(surface) => surface.solids.extend(solids),
                None => self.show.surfaces.push(Surface {
                    id,
                    name: name.to_owned(),
                    reflectance: Some(Rgb::from_srgb8(srgb)),
                    gloss: None,
                    solids,
                }),
            }
        }
    }

    fn reflectance(&mut self, values: &[Word<'a>]) -> Option<Rgb> {
        let range = "reflectances are 0 to 1";
        if let [word] = values
            && colour::is_colour(&self.text(*word)?)
        {
            return self.colour(*word);
        }
        let mut number = |w: &Word<'a>| self.within(*w, Wanted::Number, (0.0, 1.0), range);
        match values {
            [one] => number(one).map(|v| Rgb([v; 3])),
            [r, g, b] => {
                let (r, g, b) = (number(r), number(g), number(b));
                Some(Rgb([r?, g?, b?]))
            }
            _ => None,
        }
    }

    fn solid(&mut self, solid: &ast::Solid<'a>) -> Option<Solid> {
        let kind = solid.kind.text;
        self.repeated_clauses(&solid.clauses);
        let (needed, allowed) = clauses_of(kind);
        let takes =
            |c: &&Clause<'a>| needed.contains(&c.word.text) || allowed.contains(&c.word.text);
        if let Some(clause) = solid.clauses.iter().find(|c| !takes(c)) {
            let message = format!("a {kind} has no `{}`", clause.word.text);
            let label = format!("not of a {kind}");
            let help = format!("a whole {kind} is `{}`", example(kind));
            let at = (clause.span, label.as_str());
            return self.report.error(codes::DOES_NOT_FIT, message, at, help);
        }
        let find = |word| Clause::find(&solid.clauses, word);
        let missing: Vec<String> = needed
            .iter()
            .filter(|word| find(word).is_none())
            .map(|word| format!("`{word}`"))
            .collect();
        if !missing.is_empty() {
            let message = format!("the {kind} has no {}", missing.join(", no "));
            let help = format!("a whole {kind} is `{}`", example(kind));
            let at = (solid.span, "incomplete");
            return self.report.error(codes::MISSING, message, at, help);
        }
        let two_sided = find("two-sided").is_some();
        let made = match kind {
            "quad" => Solid::Quad {
                corners: self.corners(&solid.corners)?,
                two_sided,
            },
            "box" => {
                let (a, b) = (self.point(find("from"))?, self.point(find("to"))?);
                Solid::Cuboid {
                    low: a.min(b),
                    high: a.max(b),
                    inside: find("inside").is_some(),
                }
            }
            "disc" => Solid::Disc {
                centre: self.point(find("at"))?,
                aim: self.point(find("aim"))?,
                radius: self.radius(find("radius"))?,
                sides: self.sides(kind, find("sides"))?,
                two_sided,
            },
            "sphere" => Solid::Sphere {
                centre: self.point(find("at"))?,
                radius: self.radius(find("radius"))?,
                sides: self.sides(kind, find("sides"))?,
            },
            _ => Solid::Cylinder {
                from: self.point(find("from"))?,
                to: self.point(find("to"))?,
                radius: self.radius(find("radius"))?,
                sides: self.sides(kind, find("sides"))?,
            },
        };
        self.solid_enough(&made, solid)?;
        Some(made)
    }

    fn point(&mut self, clause: Option<&Clause<'a>>) -> Option<Vec3> {
        self.position(&clause?.values)
    }

    fn radius(&mut self, clause: Option<&Clause<'a>>) -> Option<f64> {
        let range = "a radius is 1 mm to 1000 m";
        self.within(*clause?.values.first()?, Wanted::Length, (1e-3, 1e3), range)
    }

    fn sides(&mut self, kind: &str, clause: Option<&Clause<'a>>) -> Option<usize> {
        let Some(clause) = clause else {
            let usual = SIDES.iter().find(|(name, _)| *name == kind);
            return usual.map(|(_, sides)| *sides);
        };
        let word = *clause.values.first()?;
        match word.text.parse::<u32>() {
            Ok(sides) if (3..=MOST_SIDES).contains(&sides) => Some(sides as usize),
            _ => {
                let message = format!(
                    "`{}` is out of range: sides are 3 to {MOST_SIDES}",
                    word.text
                );
                let at = (word.span, "out of range");
                self.report.error(codes::RANGE, message, at, "")
            }
        }
    }

    fn corners(&mut self, words: &[Word<'a>]) -> Option<[Vec3; 4]> {
        let (corners, _) = words.as_chunks::<3>();
        let corners: Option<Vec<Vec3>> = corners.iter().map(|c| self.position(c)).collect();
        corners?.try_into().ok()
    }

    /// Checks that a solid is neither flat nor crosses itself.
    fn solid_enough(&mut self, made: &Solid, solid: &ast::Solid<'a>) -> Option<()> {
        let why = match made {
            Solid::Cuboid { low, high, .. } => {
                let size = *high - *low;
                let flat = [size.x, size.y, size.z].iter().any(|s| *s < LEAST);
                flat.then_some(
                    "the box is flat: `from` and `to` must differ in all three coordinates",
                )
            }
            Solid::Disc { centre, aim, .. } => {
                let same = (*aim - *centre).length() < LEAST;
                same.then_some("the disc faces nowhere: `at` and `aim` are one point")
            }
            Solid::Cylinder { from, to, .. } => {
                let same = (*to - *from).length() < LEAST;
                same.then_some("the cylinder has no length: `from` and `to` are one point")
            }
            Solid::Sphere { .. } => None,
            Solid::Quad { .. } => match made.polygons() {
                Ok(faces) if faces.is_empty() => Some("the quad has no area"),
                Ok(_) => None,
                Err(_) => Some("the quad's edges cross: give its corners in order around it"),
            },
        };
        let Some(why) = why else { return Some(()) };
        let help = format!("such as `{}`", example(solid.kind.text));
        let at = (solid.span, "not solid");
        self.report.error(codes::RANGE, why, at, help)
    }
}

#[cfg(test)]
mod tests {
    use crate::diagnostic::Sources;
    use crate::geometry::solid::Solid;
    use crate::geometry::vec3;
    use crate::lang::{codes, parse};

    #[test]
    fn solids_are_what_they_say() {
        let text = "surface all reflectance 0.5\n  box from 1, 2, 3 to 0, 0, 0 inside\n  \
                    quad 0, 0, 0  (1ft), 0, 0  1, 1, 0  0, 1, 0 two-sided\n  \
                    disc radius 60cm at 0, 0, 1 aim 0, 0, 2\n  \
                    cylinder from 0, 0, 0 to 0, 0, 3 radius 1ft sides 6\n  \
                    sphere at 0, 0, 1 radius 1\n";
        let show = parse(&mut Sources::default(), "a", text).show.unwrap();
        let solids = &show.surfaces[0].solids;
        let cuboid = Solid::Cuboid {
            low: vec3(0.0, 0.0, 0.0),
            high: vec3(1.0, 2.0, 3.0),
            inside: true,
        };
        assert_eq!(solids[0], cuboid);
        assert!(solids[1].two_sided() && !solids[2].two_sided());
        let sides = |solid: &Solid| match solid {
            Solid::Disc { sides, .. }
            | Solid::Cylinder { sides, .. }
            | Solid::Sphere { sides, .. } => *sides,
            _ => 0,
        };
        assert_eq!([2, 3, 4].map(|i: usize| sides(&solids[i])), [16, 6, 15]);
    }

    #[test]
    fn what_is_no_solid_says_why() {
        for (text, code) in [
            ("reflectance 0.5 box from 0, 0, 0 to 1, 1, 0", codes::RANGE),
            ("reflectance 0.5 box from 0, 0, 0", codes::MISSING),
            (
                "reflectance 0.5 box from 0, 0, 0 to 1, 1, 1 radius 3",
                codes::DOES_NOT_FIT,
            ),
            (
                "reflectance 0.5 quad 0, 0, 0  1, 1, 0  1, 0, 0  0, 1, 0",
                codes::RANGE,
            ),
            (
                "reflectance 0.5 quad 0, 0, 0  1, 0, 0  2, 0, 0  3, 0, 0",
                codes::RANGE,
            ),
            (
                "reflectance 0.5 quad 0, 0, 0  1, 1, 0  1, 0, 0",
                codes::SYNTAX,
            ),
            (
                "reflectance 0.5 disc at 0, 0, 0 aim 0, 0, 0 radius 1",
                codes::RANGE,
            ),
            (
                "reflectance 0.5 cylinder from 0, 0, 0 to 0, 0, 1 radius 1 sides 2",
                codes::RANGE,
            ),
            ("box from 0, 0, 0 to 1, 1, 1", codes::MISSING),
            ("reflectance 0.5 reflectance 0.4", codes::SAID_TWICE),
            (
                "reflectance 0.5 box inside inside from 0, 0, 0 to 1, 1, 1",
                codes::SAID_TWICE,
            ),
        ] {
            let text = format!("surface s {text}\n");
            let found = parse(&mut Sources::default(), "a", &text).diagnostics;
            let codes: Vec<_> = found.iter().map(|d| d.code).collect();
            assert_eq!(codes, [code], "{text}: {found:#?}");
        }
    }
}
