//! Positions and rectangles.

/// A position in pixels, y down.
pub(super) type Point = (f32, f32);

/// A rectangle, pixels, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) width: f32,
    pub(super) height: f32,
}

impl Frame {
    /// A rectangle by its top left corner and its size.
    pub(super) const fn new(x: f32, y: f32, width: f32, height: f32) -> Frame {
        Frame {
            x,
            y,
            width,
            height,
        }
    }

    pub(super) fn right(&self) -> f32 {
        self.x + self.width
    }

    pub(super) fn bottom(&self) -> f32 {
        self.y + self.height
    }

    pub(super) fn centre(&self) -> Point {
        (self.x + self.width / 2.0, self.y + self.height / 2.0)
    }

    /// True when `x` lies between left and right, or at most half a pixel outside.
    pub(super) fn spans(&self, x: f32) -> bool {
        (self.x - 0.5..=self.right() + 0.5).contains(&x)
    }

    /// True when the insides overlap.
    pub(super) fn overlaps(&self, other: &Frame) -> bool {
        self.x < other.right()
            && other.x < self.right()
            && self.y < other.bottom()
            && other.y < self.bottom()
    }

    /// True when `other` lies within, edges included.
    pub(super) fn holds(&self, other: &Frame) -> bool {
        self.x <= other.x
            && self.y <= other.y
            && other.right() <= self.right()
            && other.bottom() <= self.bottom()
    }
}
