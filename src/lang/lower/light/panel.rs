//! A panel: a surface of the stage that shines.

use super::{Form, Spec};
use crate::lang::ast;
use crate::lang::lower::Lower;
use crate::show::LightKind;

pub(super) const PANEL: Form = Form {
    word: "panel",
    phrase: "panel",
    needs: &[],
    takes: &[],
    reason: ": it shines from its own surface",
    own_amount: true,
    luminance: true,
    example: "panel pane_left  40 cd/m2",
    finished,
};

fn finished<'a>(
    lower: &mut Lower<'a, '_>,
    light: &ast::Light<'a>,
    spec: &Spec,
) -> Option<LightKind> {
    Some(LightKind::Panel {
        material: spec.of.clone(),
        strength: lower.panel_strength(light, spec)?,
    })
}
