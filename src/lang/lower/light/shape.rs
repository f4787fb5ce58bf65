//! Spheres and discs: surfaces of their own that shine.

use super::{Form, Spec};
use crate::lang::ast;
use crate::lang::lower::Lower;
use crate::scene::shape::Shape;
use crate::show::LightKind;

pub(super) const SPHERE: Form = Form {
    word: "sphere",
    phrase: "sphere",
    needs: &["at", "radius"],
    takes: &[],
    reason: "",
    own_amount: false,
    luminance: true,
    example: "sphere at 0, 0, 3  radius 5cm  800 lm",
    finished: sphere,
};

pub(super) const DISC: Form = Form {
    word: "disc",
    phrase: "disc",
    needs: &["at", "aim", "radius"],
    takes: &[],
    reason: "",
    own_amount: false,
    luminance: true,
    example: "disc at 0, 0, 3  aim 0, 0, 0  radius 20cm  800 lm",
    finished: disc,
};

fn sphere<'a>(_: &mut Lower<'a, '_>, _: &ast::Light<'a>, spec: &Spec) -> Option<LightKind> {
    let (centre, radius) = (spec.at?, spec.radius?);
    Some(LightKind::Shape {
        shape: Shape::Sphere { centre, radius },
        strength: spec.strength()?,
    })
}

fn disc<'a>(lower: &mut Lower<'a, '_>, light: &ast::Light<'a>, spec: &Spec) -> Option<LightKind> {
    let radius = spec.radius?;
    let (centre, aim) = lower.focus(light, spec)?;
    Some(LightKind::Shape {
        shape: Shape::Disc {
            centre,
            aim,
            radius,
        },
        strength: spec.strength()?,
    })
}
