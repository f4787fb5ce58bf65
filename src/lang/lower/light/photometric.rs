//! A luminaire as a photometric file has it measured.

use super::{Form, Spec};
use crate::lang::ast;
use crate::lang::lower::Lower;
use crate::show::LightKind;

pub(super) const PHOTOMETRIC: Form = Form {
    word: "photometric",
    phrase: "photometric light",
    needs: &["at", "aim"],
    takes: &["turn"],
    reason: "",
    own_amount: true,
    luminance: false,
    example: "photometric \"desk.ies\"  at 0, -2, 4  aim 0, 0, 1",
    finished,
};

fn finished<'a>(
    lower: &mut Lower<'a, '_>,
    light: &ast::Light<'a>,
    spec: &Spec,
) -> Option<LightKind> {
    Some(LightKind::Photometric {
        path: spec.of.clone(),
        mount: lower.mount(light, spec)?,
        tint: spec.tint(),
        output: spec.output(),
    })
}
