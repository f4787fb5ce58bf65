//! Errors found while reading the stage's files: diagnostics at the statement that names the file,
//! the surface or the light.

use footlight_host::files::FileError;
use footlight_picture::PictureError;
use footlight_show::diagnostic::{Diagnostic, Label, Severity};
use footlight_show::lang::{SpanMap, codes, nearest};
use footlight_show::model::{ImageFile, Luminaire};
use footlight_show::model::{NamedView, NodeId, Show, Stage, Surface};
use footlight_stage::rig_error::RigError;
use footlight_stage::stage_file::SceneError;
use footlight_stage::still::{ImageError, Refused};
use footlight_stage::{Scene, StageCamera};

/// Advice for a Windows path.
const NO_BACKSLASH: &str = "write `/` for `\\`; the file must be in the show's folder, or below it";

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
    let own = match cause {
        SceneError::File(FileError::Missing(path)) if *path != stage.path => Some(format!(
            "`{}` names it, by a path from its own folder",
            stage.path
        )),
        SceneError::File(FileError::Missing(path)) if path.contains('\\') => {
            Some(NO_BACKSLASH.to_owned())
        }
        SceneError::File(error) => file_help(error),
        _ => None,
    };
    let help = own.unwrap_or_else(|| {
        let export = match cause {
            SceneError::Extension { name, .. } if name == "EXT_meshopt_compression" => {
                "export the geometry again without compression, or unpack the file with \
                 `gltf-transform copy`, or with `gltfpack` without `-c`"
            }
            SceneError::Extension { .. } => {
                "export the geometry again without it; where that makes no difference to the geometry, \
                 take its name out of `extensionsRequired` in the file"
            }
            SceneError::Part { .. } => "export the geometry again as glTF 2.0, or as OBJ",
            _ => "export the geometry again as OBJ with its MTL next to it, or as glTF 2.0",
        };
        export.to_owned()
    });
    let message = format!("the stage cannot be read: {cause}");
    error(codes::STAGE_FILE, message, stage.id, spans, vec![help])
}

/// Contents of the file at `path` that are not read unchanged; `id` is the statement that names it.
pub(super) fn of_file_notes(
    path: &str,
    id: NodeId,
    notes: &[String],
    spans: &SpanMap,
) -> Diagnostic {
    const SHOWN: usize = 8;
    let mut help: Vec<String> = notes.iter().take(SHOWN).cloned().collect();
    if notes.len() > SHOWN {
        help.push(format!("and {} more", notes.len() - SHOWN));
    }
    let message = format!("not all of `{path}` is taken as it stands there");
    Diagnostic {
        severity: Severity::Warning,
        ..error(codes::STAGE_NOTES, message, id, spans, help)
    }
}

/// A set that is a dot in the view: `size` metres from corner to corner, at this distance. With
/// `unit` metres per unit of the file, it would fill the image.
pub(super) fn of_small_stage(
    stage: &Stage,
    size: f64,
    distance: f64,
    unit: f64,
    spans: &SpanMap,
) -> Diagnostic {
    let message = format!(
        "the set is {size:.2} m large and {distance:.1} m away: the view shows it as a dot"
    );
    let help = format!(
        "`scale` says what a unit of the file is: with `scale {unit:.0$}m` it would fill the picture",
        if unit < 2.0 { 3 } else { 0 }
    );
    Diagnostic {
        severity: Severity::Warning,
        ..error(codes::SMALL_STAGE, message, stage.id, spans, vec![help])
    }
}

/// A panel that has most of the set's area, in this number of polygons.
pub(super) fn of_shining_set(
    light: &Luminaire,
    material: &str,
    polygons: usize,
    spans: &SpanMap,
) -> Diagnostic {
    let message = format!(
        "all {polygons} polygons of `{material}`, most of the set, shine as `{}`",
        light.name
    );
    let help = "give the polygons of the lamp a material that nothing else has, or write a `disc` or \
                a `sphere` where it hangs";
    Diagnostic {
        severity: Severity::Warning,
        ..error(
            codes::SHINING_SET,
            message,
            light.id,
            spans,
            vec![help.to_owned()],
        )
    }
}

/// A surface that replaces nothing.
pub(super) fn of_surface(surface: &Surface, scene: &Scene, spans: &SpanMap) -> Diagnostic {
    let message = format!("the stage has no material `{}` to replace", surface.name);
    error(
        codes::SURFACE,
        message,
        surface.id,
        spans,
        materials(&surface.name, scene, false),
    )
}

/// A new surface of the show whose name the stage uses.
pub(super) fn of_own_surface(surface: &Surface, spans: &SpanMap) -> Diagnostic {
    let name = &surface.name;
    let message = format!("the stage has a material `{name}` already");
    let help =
        format!("give the surface another name, such as `{name}_2`, or leave its solids out");
    error(
        codes::DECLARED_TWICE,
        message,
        surface.id,
        spans,
        vec![help],
    )
}

/// A file that needs more memory than is left.
pub(super) fn no_room(needed: usize, left: usize) -> String {
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    format!(
        "it needs {:.1} MB, and {:.1} MB are left; give more with `--memory MB`",
        megabytes(needed),
        megabytes(left)
    )
}

/// Fault of a photometric file, with its name.
pub(super) fn photometric_cause(path: &str, error: &dyn std::fmt::Display) -> String {
    format!("`{path}` {error}")
}

/// Fault of an image to project, with its name.
pub(super) fn slide_cause(path: &str, error: &dyn std::fmt::Display) -> String {
    format!("`{path}`: {error}")
}

/// A photometric file that cannot be used; the cause names the file if reading it failed.
pub(super) fn of_photometric(cause: &str, light: NodeId, spans: &SpanMap) -> Diagnostic {
    let message = format!("the photometric file cannot be read: {cause}");
    let help = "put the IES LM-63 file (type C) or the EULUMDAT file of the luminaire next to the \
                show; its maker publishes it";
    error(
        codes::PHOTOMETRIC,
        message,
        light,
        spans,
        vec![help.to_owned()],
    )
}

/// A slide that cannot be used.
pub(super) fn of_slide(cause: &str, light: NodeId, spans: &SpanMap) -> Diagnostic {
    let message = format!("the image cannot be thrown: {cause}");
    if cause.contains('\\') {
        return error(
            codes::SLIDE,
            message,
            light,
            spans,
            vec![NO_BACKSLASH.to_owned()],
        );
    }
    let help = "put a PNG, JPEG or OpenEXR file of at most 16,777,216 pixels next to the show; \
                many large images need more memory (option --memory)";
    error(codes::SLIDE, message, light, spans, vec![help.to_owned()])
}

/// A light that does not fit its stage.
pub(super) fn of_rig(cause: &RigError, scene: &Scene, spans: &SpanMap) -> Diagnostic {
    let said = |help: &str| vec![help.to_owned()];
    let (code, id, help) = match cause {
        RigError::NoMaterial { id, material } => {
            (codes::MATERIAL, id, materials(material, scene, true))
        }
        RigError::Dark { id, material } => {
            let help = format!("give it a luminance, such as `panel {material} 500 cd/m2`");
            (codes::DARK, id, vec![help])
        }
        RigError::NoImage { id, .. } => (codes::IMAGE, id, Vec::new()),
        RigError::Unread { id, .. } => (codes::PHOTOMETRIC, id, Vec::new()),
        RigError::NoLamp { id, name, known } => (
            codes::NO_LAMP,
            id,
            vec![of_stage_files(name, known, "lights")],
        ),
        RigError::Distant { id, .. } => {
            let help = "hang a `spot` far away with a narrow beam, or a `panel` for the sky";
            (codes::LAMP, id, said(help))
        }
        RigError::NoSpot { id, .. } => {
            let help = "say `beam` and `field`, `at` and `aim` of your own behind its name";
            (codes::LAMP, id, said(help))
        }
        RigError::NoArea { id, .. } => {
            let help = "lumens and candela are spread over its area; say `cd/m2`, or name another";
            (codes::NO_AREA, id, said(help))
        }
    };
    error(code, cause.to_string(), *id, spans, help)
}

/// A view from a camera that the stage does not have.
pub(super) fn of_camera(
    (view, name): (&NamedView, &str),
    cameras: &[StageCamera],
    spans: &SpanMap,
) -> Diagnostic {
    let known: Vec<String> = cameras.iter().map(|camera| camera.name.clone()).collect();
    let message = format!("the stage has no camera `{name}`");
    let help = of_stage_files(name, &known, "cameras");
    error(codes::NO_CAMERA, message, view.id, spans, vec![help])
}

/// The light or camera of the stage that was probably meant.
fn of_stage_files(name: &str, known: &[String], what: &str) -> String {
    match nearest(name, known.iter().map(String::as_str)) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => format!("{what} come with glTF files only"),
        None => format!("the stage has {}", some(known)),
    }
}

/// An image that cannot be used, at every statement that names it.
pub(super) fn of_image((file, cause): &Refused, show: &Show, spans: &SpanMap) -> Vec<Diagnostic> {
    let (code, help) = match cause {
        ImageError::Picture(PictureError::Layer { wanted, layers }) => {
            (codes::IMAGE_LAYER, layer_help(wanted.as_deref(), layers))
        }
        ImageError::Picture(error) => (codes::IMAGE, vec![picture_help(error).to_owned()]),
        ImageError::File(error) => (codes::IMAGE, file_help(error).into_iter().collect()),
    };
    let said = match cause {
        ImageError::File(error) => error.to_string(),
        ImageError::Picture(PictureError::NotFinite { .. }) => match &file.layer {
            None => format!("`{}`: {cause}", file.path),
            Some(layer) => format!("`{}`, layer `{layer}`: {cause}", file.path),
        },
        ImageError::Picture(_) => format!("`{}`: {cause}", file.path),
    };
    let message = format!("the image cannot be used: {said}");
    let named = show.images().filter(|(_, f)| *f == file);
    named
        .map(|(id, _)| error(code, message.clone(), id, spans, help.clone()))
        .collect()
}

fn picture_help(error: &PictureError) -> &'static str {
    match error {
        PictureError::NotFinite { .. } => {
            "render it again; a pixel without a number has no place in a sum of lights"
        }
        PictureError::Memory { .. } => "render it smaller, or give more memory with `--memory MB`",
        _ => "an image is OpenEXR (linear light, with R, G and B) or PNG (sRGB)",
    }
}

/// Advice for a file that is missing, or not allowed.
fn file_help(error: &FileError) -> Option<String> {
    let help = match error {
        FileError::Outside(_) => {
            "a show reads files only from its own folder downwards; copy the file there"
        }
        FileError::Missing(_) => "the path is taken from the show's own folder",
        _ => return None,
    };
    Some(help.to_owned())
}

/// The layer that was probably meant.
fn layer_help(wanted: Option<&str>, layers: &[String]) -> Vec<String> {
    let names = || layers.iter().map(String::as_str);
    if let Some(near) = wanted.and_then(|name| nearest(name, names())) {
        return vec![format!("did you mean `layer \"{near}\"`?")];
    }
    let some: Vec<String> = names().take(12).map(|n| format!("`{n}`")).collect();
    let more = match layers.len().saturating_sub(some.len()) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    match (some.is_empty(), wanted) {
        (true, _) => vec!["leave `layer` out".to_owned()],
        (false, None) => vec![format!(
            "say which: `layer \"NAME\"`; the file has {}{more}",
            some.join(", ")
        )],
        (false, Some(_)) => vec![format!("the file has {}{more}", some.join(", "))],
    }
}

/// Name of a view in diagnostics.
pub(super) fn view_name(view: &NamedView) -> String {
    format!("the view `{}`", view.name)
}

/// Name of an image's file in diagnostics.
pub(super) fn file_name(file: &ImageFile) -> String {
    format!("`{}`", file.path)
}

/// An image whose size differs from that of `of`.
pub(super) fn of_size(
    (id, file): (NodeId, &ImageFile),
    found: (usize, usize),
    wanted: (usize, usize),
    of: &str,
    spans: &SpanMap,
) -> Diagnostic {
    let message = format!(
        "`{}` has {}x{} pixels, {of} has {}x{}",
        file.path, found.0, found.1, wanted.0, wanted.1
    );
    let help =
        "all images and the view have one size: render them alike, or change `size` in the view";
    error(codes::IMAGE_SIZE, message, id, spans, vec![help.to_owned()])
}

/// Names that were probably meant.
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

/// The first few of many names.
fn some(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().take(8).map(|n| format!("`{n}`")).collect();
    quoted.join(", ")
}
