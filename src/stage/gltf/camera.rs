//! Cameras. One without perspective has no field of view and is left out.

use super::description::Root;

use super::node::Placed;
use super::{Fault, entry, outside, place};
use crate::StageCamera;
use footlight_show::geometry::{Vec3, vec3};

/// Adds the camera of a node, if it has one.
pub fn add(root: &Root, placed: &Placed<'_>, cameras: &mut Vec<StageCamera>) -> Result<(), Fault> {
    let Some(index) = placed.node.camera.map(|camera| camera.value()) else {
        return Ok(());
    };
    let camera = entry(&root.cameras, index, "camera", || placed.place())?;
    let Some(perspective) = &camera.perspective else {
        return Ok(());
    };
    let fov = f64::from(perspective.yfov).to_degrees();
    if !(fov > 0.0 && fov < 180.0) {
        let at = place("camera", index, camera.name.as_ref());
        return Err(Fault::new(
            at,
            outside("vertical angle in degrees", fov, "0 to 180"),
        ));
    }
    // A camera looks along its -Z, +Y up.
    let way = |v: Vec3| placed.transform.direction(v).y_up_to_z_up().normalized();
    let named = placed.node.name.clone().or_else(|| camera.name.clone());
    cameras.push(StageCamera {
        name: named.unwrap_or_else(|| format!("camera.{}", cameras.len())),
        position: placed.transform.point(Vec3::ZERO).y_up_to_z_up(),
        direction: way(vec3(0.0, 0.0, -1.0)),
        up: way(vec3(0.0, 1.0, 0.0)),
        fov,
    });
    Ok(())
}
