//! A projection: an image thrown.

use super::{Form, Spec};
use crate::lang::ast;
use crate::lang::lower::Lower;
use crate::show::LightKind;

pub(super) const PROJECTION: Form = Form {
    word: "project",
    phrase: "projection",
    needs: &["from", "aim", "field"],
    takes: &["turn"],
    reason: "",
    own_amount: false,
    luminance: false,
    example: "project \"clouds.png\"  from 0, -9, 4  aim 0, 3, 2  field 50  9000 cd",
    finished,
};

fn finished<'a>(
    lower: &mut Lower<'a, '_>,
    light: &ast::Light<'a>,
    spec: &Spec,
) -> Option<LightKind> {
    Some(LightKind::Projection {
        path: spec.of.clone(),
        mount: lower.mount(light, spec)?,
        field: spec.field?,
        tint: spec.tint(),
        output: spec.output(),
    })
}
