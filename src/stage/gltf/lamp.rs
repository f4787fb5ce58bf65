//! Lights of KHR_lights_punctual.
//!
//! The falloff of a glTF spot (recommended, and used by its viewers) is the square of t = (cos a -
//! cos outer) / (cos inner - cos outer), with t clamped to 0..1. Our profile agrees at three
//! angles: the peak on the axis, a half where t is 0.7071, a tenth where t is 0.3162; elsewhere
//! ours is the smoother one.

use super::description::Root;
use gltf_json::extensions::scene::khr_lights_punctual::{Light, Spot, Type};
use gltf_json::validation::Checked;

use super::node::Placed;
use super::{Fault, entry, lacks, outside, place};
use crate::{Lamp, LampShape};
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::units::Rgb;

/// Adds the light of a node, if it has one.
pub fn add(root: &Root, placed: &Placed<'_>, lamps: &mut Vec<Lamp>) -> Result<(), Fault> {
    let extensions = placed.node.extensions.as_ref();
    if let Some(on_node) = extensions.and_then(|e| e.khr_lights_punctual.as_ref()) {
        let extensions = root.extensions.as_ref();
        let punctual = extensions.and_then(|e| e.khr_lights_punctual.as_ref());
        let lights: &[Light] = punctual.map_or(&[], |p| &p.lights);
        let index = on_node.light.value();
        let light = entry(lights, index, "light", || placed.place())?;
        let fault = |e| Fault::new(place("light", index, light.name.as_ref()), e);
        lamps.push(lamp(light, placed, lamps.len()).map_err(fault)?);
    }
    Ok(())
}

/// Direction of a light, along its -Z.
fn ahead(placed: &Placed<'_>) -> Result<Vec3, String> {
    let ahead = placed.transform.direction(vec3(0.0, 0.0, -1.0));
    let ahead = ahead.y_up_to_z_up().normalized();
    if ahead.length() > 0.5 && ahead.is_finite() {
        Ok(ahead)
    } else {
        Err(lacks("direction: its scale is zero"))
    }
}

fn lamp(light: &Light, placed: &Placed<'_>, count: usize) -> Result<Lamp, String> {
    let Checked::Valid(kind) = light.type_ else {
        return Err(lacks("known type"));
    };
    let peak = f64::from(light.intensity);
    let colour = light.color.map(f64::from);
    for (what, value) in colour
        .map(|c| ("colour", c))
        .into_iter()
        .chain([("intensity", peak)])
    {
        if !(0.0..=1e15).contains(&value) {
            return Err(outside(what, value, "0 to 1e15"));
        }
    }
    let shape = match kind {
        Type::Point => LampShape::Point,
        Type::Directional => LampShape::Distant,
        Type::Spot => spot(light.spot.as_ref().ok_or_else(|| lacks("spot"))?)?,
    };
    let named = placed.node.name.clone().or_else(|| light.name.clone());
    Ok(Lamp {
        name: named.unwrap_or_else(|| format!("light.{count}")),
        shape,
        position: placed.transform.point(vec3(0.0, 0.0, 0.0)).y_up_to_z_up(),
        direction: ahead(placed)?,
        colour: Rgb(colour),
        peak,
    })
}

/// Beam and field angle of a glTF spot.
fn spot(spot: &Spot) -> Result<LampShape, String> {
    let (inner, outer) = (
        f64::from(spot.inner_cone_angle),
        f64::from(spot.outer_cone_angle),
    );
    let right = std::f64::consts::FRAC_PI_2;
    // Single precision may round a right angle up.
    if !(outer > 0.0 && outer <= right + 1e-6) {
        return Err(outside(
            "outer cone angle",
            outer,
            "0 to a right angle (radians)",
        ));
    }
    if !(inner >= 0.0 && inner <= outer) {
        return Err(outside("inner cone angle", inner, "0 to the outer one"));
    }
    // Like viewers, use a thousandth when the two are nearly equal.
    let width = (inner.cos() - outer.cos()).max(1e-3);
    let at = |share: f64| 2.0 * (outer.cos() + share.sqrt() * width).clamp(-1.0, 1.0).acos();
    Ok(LampShape::Spot {
        beam: at(0.5).to_degrees(),
        field: at(0.1).to_degrees(),
    })
}
