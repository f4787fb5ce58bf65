//! The shapes on points.

use super::colour::Colour;
use super::drawing::{Drawing, Mark, Step, Stroke};
use super::trace::Point;

/// The shape on a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Marker {
    /// A disc.
    #[default]
    Circle,
    /// A square.
    Square,
    /// A triangle, point up.
    Triangle,
    /// A square on its corner.
    Diamond,
    /// Two crossed lines.
    Cross,
    /// The line alone.
    None,
}

impl Marker {
    /// Draws itself `size` times its usual size, with a rim of the ground's colour, so that it
    /// stands off lines and other markers.
    pub(super) fn draw(
        self,
        drawing: &mut Drawing,
        at: Point,
        size: f32,
        colour: Colour,
        ground: Colour,
    ) {
        let steps = match self {
            Marker::None => return,
            Marker::Circle => disc(at, 4.0 * size),
            Marker::Square => closed(
                &[(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)],
                at,
                size,
            ),
            Marker::Triangle => closed(&[(0.0, -4.8), (4.5, 3.2), (-4.5, 3.2)], at, size),
            Marker::Diamond => closed(
                &[(0.0, -5.0), (5.0, 0.0), (0.0, 5.0), (-5.0, 0.0)],
                at,
                size,
            ),
            Marker::Cross => return cross(drawing, at, 3.5 * size, colour),
        };
        let rim = Stroke::solid(ground, 2.0 * size);
        for (fill, stroke) in [(None, Some(rim)), (Some(colour), None)] {
            drawing.push(Mark::Path {
                steps: steps.clone(),
                fill,
                stroke,
            });
        }
    }
}

fn cross(drawing: &mut Drawing, (x, y): Point, arm: f32, colour: Colour) {
    let stroke = Stroke::solid(colour, 2.0);
    drawing.line((x - arm, y - arm), (x + arm, y + arm), stroke);
    drawing.line((x - arm, y + arm), (x + arm, y - arm), stroke);
}

fn closed(corners: &[Point], (x, y): Point, size: f32) -> Vec<Step> {
    let corner = |(index, (dx, dy)): (usize, &Point)| {
        let (x, y) = (x + dx * size, y + dy * size);
        match index {
            0 => Step::Move(x, y),
            _ => Step::Line(x, y),
        }
    };
    let corners = corners.iter().enumerate().map(corner);
    corners.chain([Step::Close]).collect()
}

/// A circle of four cubics; 0.5523 keeps them within 0.03 % of the radius.
fn disc((x, y): Point, radius: f32) -> Vec<Step> {
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
