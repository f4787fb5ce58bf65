//! Shapes of points.

use super::colour::Colour;
use super::drawing::{Drawing, Step, Stroke, closed};
use super::frame::Point;

/// Shape of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Marker {
    /// A filled disc.
    #[default]
    Circle,
    /// A square.
    Square,
    /// A triangle, point up.
    Triangle,
    /// A square on its corner.
    Diamond,
    /// A circle.
    Ring,
    /// No shape, only the line.
    None,
}

impl Marker {
    /// Draws the shape `size` times its usual size, with a rim of the background's colour, so that
    /// it stands out from lines and other markers.
    pub(super) fn draw(
        self,
        drawing: &mut Drawing,
        at: Point,
        size: f32,
        colour: Colour,
        ground: Colour,
    ) {
        let corners: &[Point] = match self {
            Marker::Square => &[(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)],
            Marker::Triangle => &[(0.0, -4.8), (4.5, 3.2), (-4.5, 3.2)],
            Marker::Diamond => &[(0.0, -5.0), (5.0, 0.0), (0.0, 5.0), (-5.0, 0.0)],
            Marker::Circle | Marker::Ring => &[],
            Marker::None => return,
        };
        let steps = match corners {
            [] => disc(at, 4.0 * size),
            corners => {
                let placed = |(dx, dy): &Point| (at.0 + dx * size, at.1 + dy * size);
                closed(&corners.iter().map(placed).collect::<Vec<_>>())
            }
        };
        drawing.path(steps.clone(), Stroke::solid(ground, 2.0 * size));
        drawing.area(steps, colour);
        if self == Marker::Ring {
            drawing.area(disc(at, 2.2 * size), ground);
        }
    }
}

/// A circle of four cubics; the factor 0.5523 keeps them within 0.03 % of the radius.
pub(super) fn disc((x, y): Point, radius: f32) -> Vec<Step> {
    let (r, k) = (radius, radius * 0.5523);
    vec![
        Step::Move(x + r, y),
        Step::Cubic([x + r, y + k, x + k, y + r, x, y + r]),
        Step::Cubic([x - k, y + r, x - r, y + k, x - r, y]),
        Step::Cubic([x - r, y - k, x - k, y - r, x, y - r]),
        Step::Cubic([x + k, y - r, x + r, y - k, x + r, y]),
        Step::Close,
    ]
}
