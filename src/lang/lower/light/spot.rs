//! A spot: a round beam from a point.

use super::{Form, Spec};
use crate::lang::ast;
use crate::lang::codes;
use crate::lang::lower::Lower;
use crate::lang::quantity::Unit;
use crate::scene::Spot;
use crate::scene::profile::Profile;
use crate::show::LightKind;

pub(super) const SPOT: Form = Form {
    word: "spot",
    phrase: "spot",
    needs: &["at", "aim", "beam", "field"],
    takes: &[],
    reason: "",
    own_amount: false,
    luminance: false,
    example: "spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd",
    finished,
};

fn finished<'a>(
    lower: &mut Lower<'a, '_>,
    light: &ast::Light<'a>,
    spec: &Spec,
) -> Option<LightKind> {
    let (position, aim) = lower.focus(light, spec)?;
    let (beam, field) = (spec.beam?, spec.field?);
    let Some(profile) = Profile::new(beam, field) else {
        let message = format!(
            "the field of `{}` ({field} degrees) is not wider than its beam ({beam})",
            light.name.text
        );
        let help =
            "the beam ends at half the peak intensity, the field at a tenth: `beam 24  field 40`";
        let at = (light.name.span, "too narrow");
        return lower.report.error(codes::BEAM, message, at, help);
    };
    let candela = match spec.amount? {
        (lumens, Unit::Lumen) => lumens / profile.flux(),
        (candela, _) => candela,
    };
    Some(LightKind::Spot(Spot {
        position,
        aim,
        beam,
        field,
        intensity: spec.tint().scaled(candela),
    }))
}
