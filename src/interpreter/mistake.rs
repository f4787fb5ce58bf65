//! Mistakes that show only when the stage is there: turned into diagnostics at the statement that
//! names the file, the surface or the light.

use crate::diagnostic::{Diagnostic, Label, Severity};
use crate::lang::{SpanMap, nearest};
use crate::scene::Scene;
use crate::scene::obj::SceneError;
use crate::show::{NodeId, RigError, Stage, Surface};

fn error(
    code: &'static str,
    message: String,
    id: NodeId,
    spans: &SpanMap,
    help: Vec<String>,
) -> Diagnostic {
    let place = spans.get(id).map(|span| Label {
        file: span.file as usize,
        span: span.range(),
        text: String::new(),
    });
    Diagnostic {
        severity: Severity::Error,
        code,
        message,
        labels: place.into_iter().collect(),
        help,
    }
}

/// A stage file that cannot be used.
pub(super) fn of_stage(cause: &SceneError, stage: &Stage, spans: &SpanMap) -> Diagnostic {
    let help = match cause {
        SceneError::File(crate::files::FileError::Outside(_)) => {
            "a show reads files only from its own folder downwards; copy the file there"
        }
        SceneError::File(crate::files::FileError::Missing(_)) => {
            "the path is taken from the show's own folder"
        }
        _ => "export the geometry again as OBJ with its MTL beside it",
    };
    let message = format!("the stage cannot be read: {cause}");
    error("E301", message, stage.id, spans, vec![help.to_owned()])
}

/// A surface that replaces nothing.
pub(super) fn of_surface(surface: &Surface, scene: &Scene, spans: &SpanMap) -> Diagnostic {
    let message = format!("the stage has no material `{}` to replace", surface.name);
    error(
        "E302",
        message,
        surface.id,
        spans,
        materials(&surface.name, scene, false),
    )
}

/// A light that does not fit its stage.
pub(super) fn of_rig(cause: &RigError, scene: &Scene, spans: &SpanMap) -> Diagnostic {
    match cause {
        RigError::NoMaterial { id, material } => error(
            "E303",
            cause.to_string(),
            *id,
            spans,
            materials(material, scene, true),
        ),
        RigError::Dark { id, material } => {
            let help = format!("give it a radiance, such as `panel {material} 500 cd/m2`");
            error("E304", cause.to_string(), *id, spans, vec![help])
        }
    }
}

/// Names that could have been meant.
fn materials(name: &str, scene: &Scene, emitting: bool) -> Vec<String> {
    let names = || scene.materials.iter().map(|m| m.name.as_str());
    if let Some(near) = nearest(name, names()) {
        return vec![format!("did you mean `{near}`?")];
    }
    let lit = scene
        .materials
        .iter()
        .filter(|m| !emitting || m.emission.luminance() > 0.0);
    let some: Vec<String> = lit.take(8).map(|m| format!("`{}`", m.name)).collect();
    if some.is_empty() {
        return Vec::new();
    }
    vec![format!("the stage has {}", some.join(", "))]
}
