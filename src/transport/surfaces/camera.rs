//! The camera of a view: rays through places of the image.

use crate::TransportError;
use footlight_show::geometry::{Vec3, View};
use std::ops::Range;

/// Most pixels of a view.
const MOST_PIXELS: usize = 1 << 27;

/// A pinhole camera with an arbitrary window: the ray through the continuous image position (x, y),
/// y downwards, is `forward + right * (left + step_x * x) + up * (top - step_y * y)`.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// The eye.
    pub origin: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Unit vector into the image.
    pub forward: Vec3,
    /// Horizontal slope of the left edge.
    pub left: f64,
    /// Vertical slope of the top edge.
    pub top: f64,
    /// Slope per pixel to the right.
    pub step_x: f64,
    /// Slope per pixel downwards.
    pub step_y: f64,
}

impl Camera {
    /// The unnormalised ray through (x, y). Its component along `forward` is 1, so depth times ray
    /// leads from the eye to the surface.
    pub fn ray(&self, x: f64, y: f64) -> Vec3 {
        self.forward
            + self.right * (self.left + self.step_x * x)
            + self.up * (self.top - self.step_y * y)
    }

    /// For tests: `pixels` x `pixels` over a square of side 2 at distance 1, towards -z, x to the
    /// right.
    #[cfg(test)]
    pub fn of_square(pixels: f64) -> Camera {
        use footlight_show::geometry::vec3;
        Camera {
            origin: Vec3::ZERO,
            right: vec3(1.0, 0.0, 0.0),
            up: vec3(0.0, 1.0, 0.0),
            forward: vec3(0.0, 0.0, -1.0),
            left: -1.0,
            top: 1.0,
            step_x: 2.0 / pixels,
            step_y: 2.0 / pixels,
        }
    }
}

/// The pixels of a view, or of a band of its rows.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// One unit a pixel; (0, 0) is the window's upper left corner.
    pub camera: Camera,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl Window {
    /// All pixels of a view.
    ///
    /// # Errors
    /// Errors of [`camera`].
    pub fn new(view: &View) -> Result<Window, TransportError> {
        Ok(Window {
            camera: camera(view)?,
            width: view.width,
            height: view.height,
        })
    }

    /// Some of its rows.
    pub fn rows(&self, rows: Range<usize>) -> Window {
        let camera = Camera {
            top: self.camera.top - self.camera.step_y * rows.start as f64,
            ..self.camera
        };
        Window {
            camera,
            height: rows.len(),
            ..*self
        }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }
}

/// The camera of a view, with one sample a pixel.
///
/// # Errors
/// [`TransportError::Scene`] for a view with no pixels or too many, without a direction, or with a
/// field of view outside 0 to 180 degrees.
pub fn camera(view: &View) -> Result<Camera, TransportError> {
    let bad = |what: &str| TransportError::Scene(format!("the view {what}"));
    let pixels = view.width.checked_mul(view.height);
    if pixels.is_none_or(|n| n == 0 || n > MOST_PIXELS) {
        return Err(bad("must have 1 to 2^27 pixels"));
    }
    if !(view.fov > 0.0 && view.fov < 180.0) {
        return Err(bad("must have a field between 0 and 180 degrees"));
    }
    let [right, up, forward] = view.axes();
    if !right.is_finite() || !view.from.is_finite() || right == Vec3::ZERO {
        return Err(bad("must look from one point to another"));
    }
    let slope = (view.fov.to_radians() * 0.5).tan();
    let step = 2.0 * slope / view.height as f64;
    Ok(Camera {
        origin: view.from,
        right,
        up,
        forward,
        left: -0.5 * step * view.width as f64,
        top: slope,
        step_x: step,
        step_y: step,
    })
}
