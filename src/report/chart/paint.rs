//! Paints marks to pixels with tiny-skia.

use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, StrokeDash, Transform,
};

use super::colour::Colour;
use super::drawing::{Drawing, Mark, Picture, Step, Stroke};
use super::frame::Frame;
use super::{ChartError, font};
use footlight_picture::shrink::resampled;

/// Most pixels of a side: at most 256 MB for a square.
const MOST_PIXELS: usize = 1 << 13;
/// Most pixels of the longer side of a long, narrow chart.
const LONGEST_SIDE: usize = 1 << 15;

/// Columns, rows, RGB8.
pub(super) fn rgb8(drawing: &Drawing) -> Result<(usize, usize, Vec<u8>), ChartError> {
    let scale = drawing.scale;
    let (width, height) = drawing.size;
    let (width, height) = (pixels(width * scale), pixels(height * scale));
    let refused = ChartError::TooLarge {
        width,
        height,
        limit: LONGEST_SIDE,
    };
    let fits = width.max(height) <= LONGEST_SIDE
        && width.saturating_mul(height) <= MOST_PIXELS * MOST_PIXELS;
    let (true, Ok(columns), Ok(rows)) = (fits, u32::try_from(width), u32::try_from(height)) else {
        return Err(refused);
    };
    let mut pixmap = Pixmap::new(columns, rows).ok_or(refused)?;
    let [red, green, blue] = drawing.ground.rgb;
    pixmap.fill(tiny_skia::Color::from_rgba8(red, green, blue, 255));
    for mark in &drawing.marks {
        paint(&mut pixmap, mark, scale);
    }
    // The background is opaque, so every pixel is: premultiplied bytes equal the colours.
    let mut rgb = vec![0; columns as usize * rows as usize * 3];
    let colours = rgb.as_chunks_mut::<3>().0.iter_mut();
    for (colour, pixel) in colours.zip(pixmap.pixels()) {
        *colour = [pixel.red(), pixel.green(), pixel.blue()];
    }
    Ok((width, height, rgb))
}

fn pixels(length: f32) -> usize {
    length.ceil().max(1.0) as usize
}

fn paint(pixmap: &mut Pixmap, mark: &Mark, scale: f32) {
    let place = Transform::from_scale(scale, scale);
    match mark {
        Mark::Rectangle { frame, fill } => {
            if let Some(rect) = Rect::from_xywh(frame.x, frame.y, frame.width, frame.height) {
                pixmap.fill_rect(rect, &ink(*fill), place, None);
            }
        }
        Mark::Area { steps, fill } => {
            if let Some(path) = path(steps) {
                pixmap.fill_path(&path, &ink(*fill), FillRule::Winding, place, None);
            }
        }
        Mark::Line { steps, stroke } => {
            if let Some(path) = path(steps) {
                pixmap.stroke_path(&path, &ink(stroke.colour), &line(stroke), place, None);
            }
        }
        Mark::Text(label) => {
            let at = (label.frame().x, label.at.1);
            if let Some(path) = font::outline(&label.text, label.size, at) {
                pixmap.fill_path(&path, &ink(label.colour), FillRule::Winding, place, None);
            }
        }
        Mark::Picture { frame, picture } => copy(pixmap, picture, frame, scale),
    }
}

fn ink(colour: Colour) -> Paint<'static> {
    let [red, green, blue] = colour.rgb;
    let alpha = (colour.alpha * 255.0).round().clamp(0.0, 255.0) as u8;
    let mut paint = Paint {
        anti_alias: true,
        ..Paint::default()
    };
    paint.set_color_rgba8(red, green, blue, alpha);
    paint
}

fn line(stroke: &Stroke) -> tiny_skia::Stroke {
    let (dash, line_cap) = match stroke.dash {
        Some((on, off)) => (StrokeDash::new(vec![on, off], 0.0), LineCap::Butt),
        None => (None, LineCap::Round),
    };
    tiny_skia::Stroke {
        width: stroke.width,
        line_cap,
        line_join: LineJoin::Round,
        dash,
        ..tiny_skia::Stroke::default()
    }
}

fn path(steps: &[Step]) -> Option<Path> {
    let mut builder = PathBuilder::with_capacity(steps.len(), steps.len());
    for step in steps {
        match *step {
            Step::Move(x, y) => builder.move_to(x, y),
            Step::Line(x, y) => builder.line_to(x, y),
            Step::Cubic([x1, y1, x2, y2, x, y]) => builder.cubic_to(x1, y1, x2, y2, x, y),
            Step::Close => builder.close(),
        }
    }
    builder.finish()
}

/// Copies the image to the pixels nearest to its frame, clipped to the drawing.
fn copy(pixmap: &mut Pixmap, picture: &Picture, frame: &Frame, scale: f32) {
    let edge = |place: f32| (place * scale).round().max(0.0) as usize;
    let (columns, rows) = (pixmap.width() as usize, pixmap.height() as usize);
    let (left, top) = (edge(frame.x), edge(frame.y));
    let right = edge(frame.right()).min(LONGEST_SIDE);
    let bottom = edge(frame.bottom()).min(LONGEST_SIDE);
    if left >= right.min(columns) || top >= bottom.min(rows) {
        return;
    }
    let shown = match (right - left, bottom - top) {
        size if size == picture.size() => picture.rgb().to_vec(),
        size => resampled(picture.size(), picture.rgb(), size),
    };
    let lines = shown.chunks_exact((right - left) * 3);
    let target = pixmap.data_mut().chunks_exact_mut(columns * 4).skip(top);
    for (line, row) in lines.zip(target) {
        let pixels = row.chunks_exact_mut(4).skip(left);
        for (colour, pixel) in line.chunks_exact(3).zip(pixels) {
            for (channel, &code) in pixel.iter_mut().zip(colour) {
                *channel = code;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::drawing::Label;

    const WHITE: Colour = Colour::hex(0xffffff);
    const BLACK: Colour = Colour::hex(0x000000);

    fn pixel(drawing: &Drawing, x: usize, y: usize) -> [u8; 3] {
        let (width, _, rgb) = drawing.rgb8().unwrap();
        rgb[(y * width + x) * 3..][..3].try_into().unwrap()
    }

    #[test]
    fn rectangles_and_pictures_land_on_their_pixels() {
        let mut drawing = Drawing::new(8.0, 4.0, WHITE);
        drawing.rectangle(Frame::new(1.0, 1.0, 2.0, 2.0), Colour::hex(0x102030));
        let picture = Picture::new(1, 1, vec![9, 8, 7]).unwrap();
        drawing.picture(Frame::new(6.0, 2.0, 2.0, 2.0), picture);
        assert_eq!(pixel(&drawing, 0, 0), [255; 3]);
        assert_eq!(pixel(&drawing, 1, 1), [0x10, 0x20, 0x30]);
        assert_eq!(pixel(&drawing, 3, 1), [255; 3]);
        assert_eq!(pixel(&drawing, 6, 2), [9, 8, 7]);
        assert_eq!(pixel(&drawing, 7, 3), [9, 8, 7]);
        assert_eq!(pixel(&drawing, 5, 3), [255; 3]);
    }

    #[test]
    fn a_picture_over_the_edge_is_cut_off() {
        let mut drawing = Drawing::new(4.0, 4.0, WHITE);
        let picture = Picture::new(1, 1, vec![0, 0, 0]).unwrap();
        for frame in [
            Frame::new(2.0, 2.0, 90.0, 90.0),
            Frame::new(50.0, 50.0, 2.0, 2.0),
            Frame::new(1.0, 1.0, 0.0, 0.0),
        ] {
            drawing.picture(frame, picture.clone());
        }
        assert_eq!(pixel(&drawing, 3, 3), [0; 3]);
        assert_eq!(pixel(&drawing, 1, 1), [255; 3]);
    }

    #[test]
    fn the_ink_of_a_text_stays_in_its_box() {
        let mut drawing = Drawing::new(120.0, 60.0, WHITE);
        let label = Label::new("Ég 100%", (20.0, 40.0), 20.0, BLACK);
        let frame = label.frame();
        drawing.text(label);
        let (width, height, rgb) = drawing.rgb8().unwrap();
        let mut inked = 0;
        for y in 0..height {
            for x in 0..width {
                if rgb[(y * width + x) * 3] < 128 {
                    inked += 1;
                    let dot = Frame::new(x as f32 + 0.25, y as f32 + 0.25, 0.5, 0.5);
                    assert!(frame.overlaps(&dot), "ink at {x}, {y} outside {frame:?}");
                }
            }
        }
        assert!(inked > 150);
    }

    #[test]
    fn magnified_drawings_have_more_pixels_and_huge_ones_are_refused() {
        let drawing = Drawing::new(10.0, 5.0, WHITE);
        assert_eq!(drawing.clone().magnified(2.0).rgb8().unwrap().0, 20);
        assert_eq!(drawing.clone().magnified(f32::NAN).rgb8().unwrap().0, 10);
        let huge = drawing.magnified(1e9).rgb8().unwrap_err();
        assert!(matches!(huge, ChartError::TooLarge { .. }));
        let long = Drawing::new(f32::INFINITY, 1.0, WHITE).rgb8();
        assert!(long.is_err());
    }

    #[test]
    fn painting_twice_gives_the_same_bytes() {
        let mut drawing = Drawing::new(60.0, 30.0, WHITE);
        drawing.text(Label::new("same", (3.0, 20.0), 15.0, BLACK));
        assert_eq!(drawing.rgb8().unwrap(), drawing.rgb8().unwrap());
        assert_eq!(drawing.png().unwrap(), drawing.png().unwrap());
    }
}
