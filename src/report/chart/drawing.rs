//! The list of marks that make up a chart.

use super::colour::{Colour, Palette};
use super::frame::{Frame, Point};
use super::{ChartError, font};
use footlight_show::printable::visible;

/// Margin around a chart.
pub(super) const MARGIN: f32 = 16.0;
/// The size of a chart's title.
pub(super) const TITLE: f32 = 17.0;

/// One step of a path, in absolute pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// Begins a contour.
    Move(f32, f32),
    Line(f32, f32),
    /// A cubic Bezier curve: two control points and the end.
    Cubic([f32; 6]),
    /// Closes the contour.
    Close,
}

/// Style of a line; joins and ends are round unless it is dashed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stroke {
    pub(super) colour: Colour,
    /// Pixels.
    pub(super) width: f32,
    /// Lengths of dash and gap, pixels.
    pub(super) dash: Option<(f32, f32)>,
}

impl Stroke {
    /// An unbroken line.
    pub(super) const fn solid(colour: Colour, width: f32) -> Stroke {
        Stroke {
            colour,
            width,
            dash: None,
        }
    }

    /// A line of `dash` pixels on and off.
    pub(super) const fn dashed(colour: Colour, width: f32, dash: (f32, f32)) -> Stroke {
        Stroke {
            colour,
            width,
            dash: Some(dash),
        }
    }
}

/// Alignment of a text to its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    /// Its left end.
    Start,
    Middle,
    /// Its right end.
    End,
}

/// A display-coded RGB8 image whose bytes fit its size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    /// An image of `width` x `height` pixels, row 0 on top, three bytes per pixel.
    ///
    /// # Errors
    /// [`ChartError::Picture`] unless both sides are at least 1 and the bytes fit.
    pub(super) fn new(width: usize, height: usize, rgb: Vec<u8>) -> Result<Picture, ChartError> {
        let needed = width.saturating_mul(height).saturating_mul(3);
        if needed == 0 || rgb.len() != needed {
            return Err(ChartError::Picture {
                width,
                height,
                needed,
                found: rgb.len(),
            });
        }
        Ok(Picture { width, height, rgb })
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    pub(super) fn rgb(&self) -> &[u8] {
        &self.rgb
    }
}

/// One mark, drawn over all previous ones.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Mark {
    Rectangle {
        frame: Frame,
        fill: Colour,
    },
    /// The filled inside of a path (nonzero winding).
    Area {
        steps: Vec<Step>,
        fill: Colour,
    },
    /// The line along a path.
    Line {
        steps: Vec<Step>,
        stroke: Stroke,
    },
    Text(Label),
    /// An image stretched over a frame.
    Picture {
        frame: Frame,
        picture: Picture,
    },
}

/// A laid out chart: marks in drawing order.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width and height, in the units of the marks.
    pub(super) size: (f32, f32),
    /// Pixels per unit of the marks.
    pub(super) scale: f32,
    /// Background colour.
    pub(super) ground: Colour,
    /// Marks from the bottom up.
    pub(super) marks: Vec<Mark>,
}

impl Drawing {
    /// An empty drawing.
    pub(super) fn new(width: f32, height: f32, ground: Colour) -> Drawing {
        Drawing {
            size: (width, height),
            scale: 1.0,
            ground,
            marks: Vec::new(),
        }
    }

    /// A drawing with its title in the top left corner, shortened to the width.
    pub(super) fn titled(title: &str, width: f32, height: f32, palette: &Palette) -> Drawing {
        let mut drawing = Drawing::new(width, height, palette.ground);
        let title = font::fit(title, TITLE, width - 2.0 * MARGIN);
        let at = (MARGIN, MARGIN + 14.0);
        drawing.text(Label::new(&title, at, TITLE, palette.ink));
        drawing
    }

    /// Multiplies the painted pixels per side by `factor`, for fine displays.
    #[must_use]
    pub fn magnified(mut self, factor: f32) -> Drawing {
        if factor.is_finite() && factor > 0.0 {
            self.scale *= factor;
        }
        self
    }

    pub(super) fn rectangle(&mut self, frame: Frame, fill: Colour) {
        self.marks.push(Mark::Rectangle { frame, fill });
    }

    pub(super) fn picture(&mut self, frame: Frame, picture: Picture) {
        self.marks.push(Mark::Picture { frame, picture });
    }

    /// A straight line.
    pub(super) fn line(&mut self, from: Point, to: Point, stroke: Stroke) {
        self.polyline(&[from, to], stroke);
    }

    /// Straight lines from point to point.
    pub(super) fn polyline(&mut self, points: &[Point], stroke: Stroke) {
        self.path(contour(points), stroke);
    }

    /// Draws a line along a path.
    pub(super) fn path(&mut self, steps: Vec<Step>, stroke: Stroke) {
        self.marks.push(Mark::Line { steps, stroke });
    }

    /// Fills the polygon of these points.
    pub(super) fn polygon(&mut self, points: &[Point], fill: Colour) {
        self.area(closed(points), fill);
    }

    /// Fills the inside of a path.
    pub(super) fn area(&mut self, steps: Vec<Step>, fill: Colour) {
        self.marks.push(Mark::Area { steps, fill });
    }

    /// A text, unless it is empty.
    pub(super) fn text(&mut self, text: Label) {
        if !text.text.is_empty() {
            self.marks.push(Mark::Text(text));
        }
    }

    /// Draws a text centred on a position.
    pub(super) fn text_around(&mut self, text: &str, at: Point, size: f32, colour: Colour) {
        let label = Label::new(text, at, size, colour);
        self.text(label.anchored(Anchor::Middle).centred());
    }

    /// Every text with its bounding box.
    #[cfg(test)]
    pub(super) fn text_boxes(&self) -> Vec<(String, Frame)> {
        let boxed = |mark: &Mark| match mark {
            Mark::Text(label) => Some((label.text.clone(), label.frame())),
            _ => None,
        };
        self.marks.iter().filter_map(boxed).collect()
    }
}

/// Path steps from point to point.
fn contour(points: &[Point]) -> Vec<Step> {
    let step = |(index, &(x, y)): (usize, &Point)| match index {
        0 => Step::Move(x, y),
        _ => Step::Line(x, y),
    };
    points.iter().enumerate().map(step).collect()
}

/// Path steps from point to point and back to the first.
pub(super) fn closed(points: &[Point]) -> Vec<Step> {
    let mut steps = contour(points);
    steps.push(Step::Close);
    steps
}

/// One line of text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Label {
    /// The anchor's position on the baseline.
    pub(super) at: Point,
    /// Font size, pixels per em.
    pub(super) size: f32,
    pub(super) anchor: Anchor,
    pub(super) text: String,
    pub(super) colour: Colour,
}

impl Label {
    /// A text that starts at a position on the baseline.
    pub(super) fn new(text: &str, at: Point, size: f32, colour: Colour) -> Label {
        Label {
            at,
            size,
            anchor: Anchor::Start,
            text: visible(text).into_owned(),
            colour,
        }
    }

    pub(super) fn anchored(mut self, anchor: Anchor) -> Label {
        self.anchor = anchor;
        self
    }

    /// Centres the digits vertically at the position, instead of the baseline.
    pub(super) fn centred(mut self) -> Label {
        self.at.1 += font::MIDDLE * self.size;
        self
    }

    /// The bounding box.
    pub(super) fn frame(&self) -> Frame {
        let width = font::width(&self.text, self.size);
        let left = match self.anchor {
            Anchor::Start => self.at.0,
            Anchor::Middle => self.at.0 - width / 2.0,
            Anchor::End => self.at.0 - width,
        };
        let top = self.at.1 - font::ASCENT * self.size;
        Frame::new(left, top, width, (font::ASCENT + font::DESCENT) * self.size)
    }
}

/// Centre of the pixel containing `x`: a line of one pixel there is sharp.
pub(super) fn crisp(x: f32) -> f32 {
    x.floor() + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_must_fill_its_size() {
        assert!(Picture::new(2, 1, vec![0; 6]).is_ok());
        let short = Picture::new(2, 2, vec![0; 6]).unwrap_err();
        assert!(matches!(
            short,
            ChartError::Picture {
                needed: 12,
                found: 6,
                ..
            }
        ));
        assert!(Picture::new(0, 2, vec![]).is_err());
        assert!(Picture::new(usize::MAX, 2, vec![]).is_err());
    }

    #[test]
    fn anchors_move_the_text_box_by_its_width() {
        let colour = Colour::hex(0);
        let start = Label::new("100", (50.0, 20.0), 10.0, colour);
        let width = font::width("100", 10.0);
        assert_eq!(start.frame().x, 50.0);
        let end = start.clone().anchored(Anchor::End);
        assert!((end.frame().right() - 50.0).abs() < 1e-3);
        let middle = start.anchored(Anchor::Middle).frame();
        assert!((middle.x + width / 2.0 - 50.0).abs() < 1e-3);
    }

    #[test]
    fn frames_that_only_touch_do_not_overlap() {
        let left = Frame::new(0.0, 0.0, 10.0, 10.0);
        assert!(!left.overlaps(&Frame::new(10.0, 0.0, 5.0, 5.0)));
        assert!(left.overlaps(&Frame::new(9.0, 9.0, 5.0, 5.0)));
        assert!(left.holds(&Frame::new(0.0, 0.0, 10.0, 10.0)));
        assert!(!left.holds(&Frame::new(1.0, 0.0, 10.0, 10.0)));
    }
}
