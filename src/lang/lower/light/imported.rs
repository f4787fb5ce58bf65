//! A light that the stage's file brings along.

use super::{Form, Spec};
use crate::lang::ast;
use crate::lang::lower::Lower;
use crate::show::{ImportedLuminaire, LightKind};
use crate::units::Rgb;

pub(super) const IMPORTED: Form = Form {
    word: "from",
    phrase: "light of the stage",
    needs: &[],
    takes: &["at", "aim", "beam", "field"],
    reason: "",
    own_amount: true,
    luminance: false,
    example: "from \"Key\"  1200 cd",
    finished,
};

fn finished<'a>(_: &mut Lower<'a, '_>, _: &ast::Light<'a>, spec: &Spec) -> Option<LightKind> {
    Some(LightKind::ImportedLuminaire(ImportedLuminaire {
        name: spec.of.clone(),
        position: spec.at,
        aim: spec.aim,
        beam: spec.beam,
        field: spec.field,
        white: spec.kelvin,
        gel: spec.gel.unwrap_or(Rgb::WHITE),
        output: spec.output(),
    }))
}
