//! Converts the lights of the text to those of the operator G: resolves materials, files and
//! amounts.

use super::imported_luminaire;
use super::luminaire_asset::LuminaireAssets;
use super::rig_error::RigError;
use super::{Emitter, Light, MeasuredLight, Projection, Rig, Scene, Source, StillImages};
use footlight_show::geometry::mount::Mount;
use footlight_show::model::{
    Coordinate, Fixed, LightKind, Luminaire, NodeId, Output, Pose, Show, Strength,
};
use footlight_show::timeline::Bounced;
use footlight_show::units::Rgb;

/// Adds the shapes of sphere and disc lights to `scene`, after its other materials and polygons.
pub fn add_light_geometry(show: &Show, scene: &mut Scene) {
    for (name, shape) in show.shapes() {
        scene.add_shape(shape_material(name), &shape);
    }
}

/// Like [`rig_with`], for a show whose lights and banks need no files.
///
/// # Errors
/// Every light that does not fit.
pub fn rig(show: &Show, scene: &Scene) -> Result<Rig, Vec<RigError>> {
    rig_with(
        show,
        scene,
        &StillImages::new(),
        &LuminaireAssets::default(),
    )
}

/// The lights for the operator, with one source per coordinate. Names become indices; materials are
/// looked up in `scene`, to which light shapes were added, images of banks in `images`, files of
/// lights in `luminaires`.
///
/// # Errors
/// Every light that does not fit.
pub fn rig_with(
    show: &Show,
    scene: &Scene,
    images: &StillImages,
    luminaires: &LuminaireAssets,
) -> Result<Rig, Vec<RigError>> {
    let mut errors = Vec::new();
    let mut lights = Vec::new();
    // First light of each statement; the last entry is the number of lights.
    let mut starts = vec![0];
    for light in &show.lights {
        match resolved(light, scene, images, luminaires) {
            Ok(resolved) => lights.extend(resolved),
            Err(error) => errors.push(error),
        }
        starts.push(lights.len());
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let sources = show
        .coordinates()
        .into_iter()
        .map(|coordinate| Source {
            emitters: emitters(show, &coordinate, &starts),
            name: coordinate.name,
        })
        .collect();
    Ok(Rig { lights, sources })
}

/// Adds the reflected light of heads: a source for each further coordinate of the show's timeline.
///
/// # Errors
/// A light that does not fit.
pub fn add_bounced(
    rig: &mut Rig,
    (show, bounced): (&Show, &[Bounced]),
    scene: &Scene,
    images: &StillImages,
    luminaires: &LuminaireAssets,
) -> Result<(), RigError> {
    let white = white(show);
    let (coordinates, heads) = (show.coordinates(), show.heads());
    // Coordinates of one head and pose are adjacent.
    let mut last: Option<(usize, usize, std::ops::Range<usize>)> = None;
    for one in bounced {
        let known = last
            .take()
            .filter(|(head, number, _)| (*head, *number) == (one.head, one.number));
        let lights = match known {
            Some((.., lights)) => lights,
            None => {
                let head = heads.get(one.head);
                let Some(light) = head.and_then(|(light, ..)| show.lights.get(*light)) else {
                    continue;
                };
                let lights = posed(light, one.pose, scene, images, luminaires)?;
                let start = rig.lights.len();
                let lights = lights
                    .into_iter()
                    .map(|light| Light::Bounced(Box::new(light)));
                rig.lights.extend(lights);
                start..rig.lights.len()
            }
        };
        let Some(coordinate) = coordinates.get(one.coordinate) else {
            continue;
        };
        let filter = filter(coordinate).filtered(white);
        let emitters = lights.clone().map(|light| Emitter { light, filter });
        rig.sources.push(Source {
            name: format!("{} pose {}", coordinate.name, one.number + 1),
            emitters: emitters.collect(),
        });
        last = Some((one.head, one.number, lights));
    }
    Ok(())
}

/// A light with a head, fixed in a pose, for the operator.
///
/// # Errors
/// A light that does not fit.
pub fn posed(
    light: &Luminaire,
    pose: Pose,
    scene: &Scene,
    images: &StillImages,
    luminaires: &LuminaireAssets,
) -> Result<Vec<Light>, RigError> {
    match &light.head {
        Some(head) => resolved(&head.aimed(light, pose), scene, images, luminaires),
        None => Ok(Vec::new()),
    }
}

/// Factor on a bank's lights in each channel under a setting.
pub fn strength(show: &Show, bank: usize, setting: &[f64]) -> [f64; 3] {
    let white = white(show).0;
    let is_rgb = show.banks.get(bank).is_some_and(|bank| bank.rgb);
    let mut out = [0.0; 3];
    for (emitter, coordinate) in show.coordinates_of(bank).enumerate() {
        let light = setting.get(coordinate).copied().unwrap_or(0.0);
        for (channel, (out, white)) in out.iter_mut().zip(white).enumerate() {
            if !is_rgb || channel == emitter {
                *out += light * white;
            }
        }
    }
    out
}

/// The show with its heads as fixed lights in these poses.
pub fn standing(show: &Show, poses: &[Pose]) -> Show {
    let mut out = show.clone();
    for ((light, head, _), pose) in show.heads().into_iter().zip(poses) {
        if let (Some(slot), Some(light)) = (out.lights.get_mut(light), show.lights.get(light)) {
            *slot = head.aimed(light, *pose);
        }
    }
    out
}

/// The channels that a coordinate lights.
fn filter(coordinate: &Coordinate) -> Rgb {
    match coordinate.emitter() {
        None => Rgb::WHITE,
        Some(0) => Rgb([1.0, 0.0, 0.0]),
        Some(1) => Rgb([0.0, 1.0, 0.0]),
        Some(_) => Rgb([0.0, 0.0, 1.0]),
    }
}

/// Factor on all light that makes the preview's white point white.
fn white(show: &Show) -> Rgb {
    let kelvin = show.preview.white.and_then(Rgb::from_kelvin);
    kelvin.map_or(Rgb::WHITE, |kelvin| Rgb(kelvin.0.map(f64::recip)))
}

fn emitters(show: &Show, coordinate: &Coordinate, starts: &[usize]) -> Vec<Emitter> {
    let white = white(show);
    let emitter = |light: usize, filter: Rgb| {
        let (Rgb([r, g, b]), Rgb([red, green, blue])) = (filter, white);
        let filter = Rgb([r * red, g * green, b * blue]);
        let start = |i: usize| starts.get(i).copied().unwrap_or(0);
        let all = start(light)..start(light + 1);
        all.map(move |light| Emitter { light, filter })
    };
    let Some(bank) = coordinate.bank.and_then(|b| show.banks.get(b)) else {
        let of = |f: &Fixed| {
            let filter = Rgb::WHITE.scaled(f.level);
            f.lights
                .iter()
                .flat_map(move |l| emitter(*l, filter))
                .collect::<Vec<_>>()
        };
        return show.fixed.iter().flat_map(of).collect();
    };
    let filter = filter(coordinate);
    // The direct light of a head is computed elsewhere.
    let stand = bank.lights.iter().filter(|l| {
        let light = show.lights.get(**l);
        light.is_some_and(|light| light.head.is_none())
    });
    stand.flat_map(|l| emitter(*l, filter)).collect()
}

/// Radiance of a Lambertian surface of `area` m²; an intensity is divided by the projected area
/// `shown`, m².
fn radiance(strength: Strength, area: f64, shown: f64) -> Rgb {
    match strength {
        Strength::Luminance(rgb) => rgb,
        Strength::Flux(rgb) => rgb.scaled(1.0 / (std::f64::consts::PI * area)),
        Strength::Intensity(rgb) => rgb.scaled(1.0 / shown),
    }
}

/// The operator's lights for it: one, or three for a coloured image.
fn resolved(
    light: &Luminaire,
    scene: &Scene,
    images: &StillImages,
    luminaires: &LuminaireAssets,
) -> Result<Vec<Light>, RigError> {
    let one = match &light.kind {
        LightKind::Image(file) => {
            let read = images.get(file).cloned().map(Light::Image);
            read.ok_or_else(|| RigError::NoImage {
                id: light.id,
                path: file.path.clone(),
            })?
        }
        LightKind::Spot(spot) => Light::Spot(spot.clone()),
        LightKind::ImportedLuminaire(imported) => {
            let lamps = &luminaires.lamps;
            Light::Spot(imported_luminaire::spot(light.id, imported, lamps)?)
        }
        LightKind::Panel { material, strength } => panel(light.id, material, *strength, scene)?,
        LightKind::Shape { shape, strength } => {
            let name = shape_material(&light.name);
            let material = scene.materials.iter().rposition(|m| m.name == name);
            let radiance = radiance(*strength, shape.area(), shape.shown());
            let missing = || RigError::NoMaterial {
                id: light.id,
                material: name.clone(),
            };
            Light::Panel {
                material: material.ok_or_else(missing)?,
                radiance,
            }
        }
        LightKind::Photometric {
            path,
            mount,
            tint,
            output,
        } => measured(light.id, path, *mount, *tint, *output, luminaires)?,
        LightKind::Projection {
            path,
            mount,
            field,
            tint,
            output,
        } => {
            let slide = luminaires.slides.get(path);
            let slide = slide.ok_or_else(|| unread(light.id, path))?;
            let candela = match output {
                Output::Flux(lumens) => lumens / Projection::flux(slide, *field),
                Output::Peak(candela) => *candela,
                Output::Own => 0.0,
            };
            let plane = |plane: usize, intensity: Rgb| {
                Light::Projection(Projection {
                    mount: *mount,
                    field: *field,
                    gobo: slide.clone(),
                    plane,
                    intensity,
                })
            };
            let whole = tint.scaled(candela);
            if slide.is_grey() {
                return Ok(vec![plane(0, whole)]);
            }
            let primaries = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let planes = primaries.into_iter().enumerate();
            let lights = planes.map(|(c, primary)| plane(c, whole.filtered(Rgb(primary))));
            return Ok(lights.collect());
        }
    };
    Ok(vec![one])
}

fn unread(id: NodeId, path: &str) -> RigError {
    let path = path.to_owned();
    RigError::Unread { id, path }
}

fn measured(
    id: NodeId,
    path: &str,
    mount: Mount,
    tint: Rgb,
    output: Output,
    luminaires: &LuminaireAssets,
) -> Result<Light, RigError> {
    let distribution = luminaires.photometric.get(path);
    let distribution = distribution.ok_or_else(|| unread(id, path))?;
    let factor = match output {
        Output::Own => 1.0,
        Output::Flux(lumens) => lumens / distribution.flux(),
        Output::Peak(candela) => candela / distribution.peak(),
    };
    Ok(Light::Measured(MeasuredLight {
        mount,
        distribution: distribution.clone(),
        factor: tint.scaled(factor),
    }))
}

/// Name of a light shape's material; its two words distinguish it from materials of a stage.
fn shape_material(light: &str) -> String {
    format!("light {light}")
}

fn panel(
    id: NodeId,
    material: &str,
    strength: Option<Strength>,
    scene: &Scene,
) -> Result<Light, RigError> {
    let mut materials = scene.materials.iter().enumerate();
    let found = materials.find(|(_, m)| m.name == material);
    let name = || material.to_owned();
    let (index, found) = found.ok_or_else(|| RigError::NoMaterial {
        id,
        material: name(),
    })?;
    let area = scene.area(index);
    if area == 0.0 && matches!(strength, Some(Strength::Flux(_) | Strength::Intensity(_))) {
        return Err(RigError::NoArea {
            id,
            material: name(),
        });
    }
    let radiance = strength.map_or(found.emission, |s| radiance(s, area, area));
    if radiance == Rgb::default() {
        return Err(RigError::Dark {
            id,
            material: name(),
        });
    }
    Ok(Light::Panel {
        material: index,
        radiance,
    })
}
