//! The list of marks that every chart becomes, and the three forms it leaves in.

use super::colour::Colour;
use super::{ChartError, font, paint, svg};
use crate::picture::png;

/// A rectangle, pixels, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Left edge.
    pub x: f32,
    /// Top edge.
    pub y: f32,
    /// To the right.
    pub width: f32,
    /// Downward.
    pub height: f32,
}

impl Frame {
    /// A rectangle by its top left corner and its size.
    pub const fn new(x: f32, y: f32, width: f32, height: f32) -> Frame {
        Frame {
            x,
            y,
            width,
            height,
        }
    }

    /// The right edge.
    pub fn right(&self) -> f32 {
        self.x + self.width
    }

    /// The bottom edge.
    pub fn bottom(&self) -> f32 {
        self.y + self.height
    }

    /// Whether the insides share a point.
    pub fn overlaps(&self, other: &Frame) -> bool {
        self.x < other.right()
            && other.x < self.right()
            && self.y < other.bottom()
            && other.y < self.bottom()
    }

    /// Whether `other` lies within, edges included.
    pub fn holds(&self, other: &Frame) -> bool {
        self.x <= other.x
            && self.y <= other.y
            && other.right() <= self.right()
            && other.bottom() <= self.bottom()
    }
}

/// One step of a path, absolute pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Begins a contour.
    Move(f32, f32),
    /// A straight line.
    Line(f32, f32),
    /// A cubic Bezier curve: two control points and the end.
    Cubic([f32; 6]),
    /// Back to where the contour began.
    Close,
}

/// How a path's line is drawn; joins and ends are round unless it is dashed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub colour: Colour,
    /// Pixels.
    pub width: f32,
    /// Pixels on and pixels off.
    pub dash: Option<(f32, f32)>,
}

impl Stroke {
    /// An unbroken line.
    pub const fn solid(colour: Colour, width: f32) -> Stroke {
        Stroke {
            colour,
            width,
            dash: None,
        }
    }
}

/// Which point of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// Its left end.
    Start,
    /// Its middle.
    Middle,
    /// Its right end.
    End,
}

/// A display-coded RGB8 picture whose bytes fill its size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    /// A picture of `width` x `height` pixels, row 0 on top, three bytes a pixel.
    ///
    /// # Errors
    /// [`ChartError::Picture`] unless both sides are at least 1 and the bytes fill them.
    pub fn new(width: usize, height: usize, rgb: Vec<u8>) -> Result<Picture, ChartError> {
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

    /// Pixels a row and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Its bytes.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }
}

/// One thing drawn, over all before it.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A filled rectangle.
    Rectangle {
        /// Where.
        frame: Frame,
        /// Its colour.
        fill: Colour,
    },
    /// A path, filled (nonzero winding), stroked, or both.
    Path {
        /// Its contours.
        steps: Vec<Step>,
        /// The colour inside.
        fill: Option<Colour>,
        /// The line along it.
        stroke: Option<Stroke>,
    },
    /// One line of text.
    Text {
        /// The anchor's place on the baseline.
        at: (f32, f32),
        /// Pixels an em.
        size: f32,
        /// Which point of the text stands there.
        anchor: Anchor,
        /// What it says.
        text: String,
        /// Its colour.
        colour: Colour,
    },
    /// A picture stretched over a frame.
    Picture {
        /// Where.
        frame: Frame,
        /// What.
        picture: Picture,
    },
}

/// A laid out chart: marks in the order they are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    width: f32,
    height: f32,
    scale: f32,
    ground: Colour,
    marks: Vec<Mark>,
}

impl Drawing {
    /// An empty drawing.
    pub fn new(width: f32, height: f32, ground: Colour) -> Drawing {
        Drawing {
            width,
            height,
            scale: 1.0,
            ground,
            marks: Vec::new(),
        }
    }

    /// The same drawing painted with `factor` times the pixels a side, for fine displays.
    #[must_use]
    pub fn magnified(mut self, factor: f32) -> Drawing {
        if factor.is_finite() && factor > 0.0 {
            self.scale *= factor;
        }
        self
    }

    /// Width and height, in the units of the marks.
    pub fn size(&self) -> (f32, f32) {
        (self.width, self.height)
    }

    /// Pixels for each unit of the marks.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// What the marks lie on.
    pub fn ground(&self) -> Colour {
        self.ground
    }

    /// What is drawn, from the bottom up.
    pub fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// Draws one more mark over the others.
    pub fn push(&mut self, mark: Mark) {
        self.marks.push(mark);
    }

    /// Pixels a row, rows, and the painted pixels: RGB8, row 0 on top.
    ///
    /// # Errors
    /// [`ChartError::TooLarge`] over the room's limit.
    pub fn rgb8(&self) -> Result<(usize, usize, Vec<u8>), ChartError> {
        paint::rgb8(self)
    }

    /// The painted pixels as a PNG file.
    ///
    /// # Errors
    /// [`ChartError::TooLarge`] over the room's limit, [`ChartError::Encode`] from the encoder.
    pub fn png(&self) -> Result<Vec<u8>, ChartError> {
        let (width, height, rgb) = self.rgb8()?;
        Ok(png::encode(width, height, &rgb)?)
    }

    /// The drawing as an SVG document. Text stays text.
    pub fn svg(&self) -> String {
        svg::document(self)
    }

    pub(super) fn rectangle(&mut self, frame: Frame, fill: Colour) {
        self.push(Mark::Rectangle { frame, fill });
    }

    /// A straight line.
    pub(super) fn line(&mut self, from: (f32, f32), to: (f32, f32), stroke: Stroke) {
        self.push(Mark::Path {
            steps: vec![Step::Move(from.0, from.1), Step::Line(to.0, to.1)],
            fill: None,
            stroke: Some(stroke),
        });
    }

    /// A text, unless it is empty.
    pub(super) fn text(&mut self, text: Label) {
        if !text.text.is_empty() {
            self.push(Mark::Text {
                at: text.at,
                size: text.size,
                anchor: text.anchor,
                text: text.text,
                colour: text.colour,
            });
        }
    }

    /// Every text with the box it fills.
    #[cfg(test)]
    pub(super) fn text_boxes(&self) -> Vec<(String, Frame)> {
        let boxed = |mark: &Mark| match mark {
            Mark::Text {
                at,
                size,
                anchor,
                text,
                ..
            } => Some((text.clone(), text_box(*at, *size, *anchor, text))),
            _ => None,
        };
        self.marks.iter().filter_map(boxed).collect()
    }
}

/// A text on its way into a drawing.
#[derive(Clone, Debug)]
pub(super) struct Label {
    pub(super) at: (f32, f32),
    pub(super) size: f32,
    pub(super) anchor: Anchor,
    pub(super) text: String,
    pub(super) colour: Colour,
}

impl Label {
    /// A text that begins at a point of its baseline.
    pub(super) fn new(text: &str, at: (f32, f32), size: f32, colour: Colour) -> Label {
        Label {
            at,
            size,
            anchor: Anchor::Start,
            text: text.to_owned(),
            colour,
        }
    }

    pub(super) fn anchored(mut self, anchor: Anchor) -> Label {
        self.anchor = anchor;
        self
    }

    /// Stands the middle of its digits, not its baseline, at the place.
    pub(super) fn centred(mut self) -> Label {
        self.at.1 += font::MIDDLE * self.size;
        self
    }

    pub(super) fn frame(&self) -> Frame {
        text_box(self.at, self.size, self.anchor, &self.text)
    }
}

/// Where a text's line begins.
pub(super) fn text_left(x: f32, width: f32, anchor: Anchor) -> f32 {
    match anchor {
        Anchor::Start => x,
        Anchor::Middle => x - width / 2.0,
        Anchor::End => x - width,
    }
}

fn text_box(at: (f32, f32), size: f32, anchor: Anchor, text: &str) -> Frame {
    let width = font::width(text, size);
    Frame::new(
        text_left(at.0, width, anchor),
        at.1 - font::ASCENT * size,
        width,
        (font::ASCENT + font::DESCENT) * size,
    )
}

/// The middle of the pixel that `x` lies in: a line of one pixel there is sharp.
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
