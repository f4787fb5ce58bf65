//! Writes marks as SVG (1.1, with SVG 2's plain `href`).
//!
//! Texts state their measured length (`textLength`), so the layout holds in any font. Images are
//! embedded as PNG.

use std::fmt::Write;

use base64::prelude::{BASE64_STANDARD, Engine as _};

use super::colour::Colour;
use super::drawing::{Anchor, Drawing, Mark, Picture, Step, Stroke};
use super::font;
use super::frame::Frame;
use footlight_picture::png;
use footlight_show::printable::{escaped, trimmed};

/// The whole document.
pub(super) fn document(drawing: &Drawing) -> String {
    let (width, height) = drawing.size;
    let scale = drawing.scale;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" \
         viewBox=\"0 0 {} {}\" font-family=\"DejaVu Sans, Verdana, sans-serif\">\n",
        number(width * scale),
        number(height * scale),
        number(width),
        number(height),
    );
    let ground = Mark::Rectangle {
        frame: Frame::new(0.0, 0.0, width, height),
        fill: drawing.ground,
    };
    element(&mut out, &ground);
    for mark in &drawing.marks {
        element(&mut out, mark);
    }
    out.push_str("</svg>\n");
    out
}

/// Appends to a string, which cannot fail.
macro_rules! put {
    ($out:expr, $($argument:tt)*) => {
        let _ = write!($out, $($argument)*);
    };
}

fn element(out: &mut String, mark: &Mark) {
    match mark {
        Mark::Rectangle { frame, fill } => {
            put!(out, "<rect {}{}/>\n", place(frame), paint("fill", *fill));
        }
        Mark::Area { steps, fill } => {
            let fill = paint("fill", *fill);
            put!(out, "<path d=\"{}\"{fill}/>\n", data(steps));
        }
        Mark::Line { steps, stroke } => {
            let (path, line) = (data(steps), line(stroke));
            put!(out, "<path d=\"{path}\" fill=\"none\"{line}/>\n");
        }
        Mark::Text(label) => {
            put!(
                out,
                "<text x=\"{}\" y=\"{}\" font-size=\"{}\"{} textLength=\"{}\" \
                 lengthAdjust=\"spacingAndGlyphs\"{}>{}</text>\n",
                number(label.at.0),
                number(label.at.1),
                number(label.size),
                anchored(label.anchor),
                number(font::width(&label.text, label.size)),
                paint("fill", label.colour),
                escaped(&label.text),
            );
        }
        Mark::Picture { frame, picture } => embedded(out, frame, picture),
    }
}

fn anchored(anchor: Anchor) -> &'static str {
    match anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    }
}

fn place(frame: &Frame) -> String {
    format!(
        "x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"",
        number(frame.x),
        number(frame.y),
        number(frame.width.max(0.0)),
        number(frame.height.max(0.0)),
    )
}

fn paint(attribute: &str, colour: Colour) -> String {
    let [red, green, blue] = colour.rgb;
    let mut out = format!(" {attribute}=\"#{red:02x}{green:02x}{blue:02x}\"");
    if colour.alpha < 1.0 {
        put!(out, " {attribute}-opacity=\"{}\"", number(colour.alpha));
    }
    out
}

fn line(stroke: &Stroke) -> String {
    let mut out = paint("stroke", stroke.colour);
    put!(out, " stroke-width=\"{}\"", number(stroke.width));
    match stroke.dash {
        Some((on, off)) => {
            put!(out, " stroke-dasharray=\"{} {}\"", number(on), number(off));
        }
        None => out.push_str(" stroke-linecap=\"round\""),
    }
    out.push_str(" stroke-linejoin=\"round\"");
    out
}

fn data(steps: &[Step]) -> String {
    let mut out = String::new();
    for step in steps {
        match *step {
            Step::Move(x, y) => {
                put!(out, "M{} {}", number(x), number(y));
            }
            Step::Line(x, y) => {
                put!(out, "L{} {}", number(x), number(y));
            }
            Step::Cubic(points) => {
                let points = points.map(number);
                put!(out, "C{}", points.join(" "));
            }
            Step::Close => out.push('Z'),
        }
    }
    out
}

/// Rounded to hundredths of a pixel, without trailing zeros.
fn number(value: f32) -> String {
    let value = if value.is_finite() { value } else { 0.0 };
    trimmed(&format!("{value:.2}"))
}

/// Embeds the image as PNG, or an empty frame if the encoder refuses it.
fn embedded(out: &mut String, frame: &Frame, picture: &Picture) {
    let (width, height) = picture.size();
    let Ok(png) = png::encode(width, height, picture.rgb()) else {
        put!(
            out,
            "<rect {} fill=\"none\" stroke=\"#808080\"/>\n",
            place(frame)
        );
        return;
    };
    // An enlarged image shows its pixels, as when painted.
    let rendering = if frame.width > width as f32 {
        " image-rendering=\"pixelated\""
    } else {
        ""
    };
    put!(
        out,
        "<image {} preserveAspectRatio=\"none\"{rendering} \
         href=\"data:image/png;base64,{}\"/>\n",
        place(frame),
        BASE64_STANDARD.encode(&png),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::drawing::Label;

    #[test]
    fn names_are_escaped_and_forbidden_characters_dropped() {
        assert_eq!(
            escaped("<a&b> \"c\"\n\u{1}d"),
            "&lt;a&amp;b&gt; &quot;c&quot; d"
        );
        let mut drawing = Drawing::new(50.0, 20.0, Colour::hex(0xffffff));
        drawing.text(Label::new("<a&b>", (1.0, 9.0), 9.0, Colour::hex(0)));
        assert!(drawing.svg().contains(">&lt;a&amp;b&gt;</text>"));
    }

    #[test]
    fn numbers_are_short_and_never_broken() {
        assert_eq!(number(1.0), "1");
        assert_eq!(number(0.126), "0.13");
        assert_eq!(number(-0.001), "0");
        assert_eq!(number(100.0), "100");
        assert_eq!(number(f32::NAN), "0");
    }
}
