//! A quantity of each pixel in false colours, over the legend of the colours.

use super::ChartError;
use super::axis::{Ruler, Scale};
use super::colour::{Colour, Theme};
use super::drawing::{Anchor, Drawing, Label, MARGIN, Picture, Stroke, TITLE};
use super::font;
use super::frame::Frame;

/// A quantity of each pixel of an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FalseColour {
    /// Title above the image.
    pub title: String,
    /// Pixels per row.
    pub width: usize,
    /// A value for each pixel, row by row from the top; NaN where it is unknown.
    pub values: Vec<f64>,
    /// Value of the brightest colour, which larger values share.
    pub most: f64,
    /// The quantity and its unit.
    pub unit: String,
    /// The meaning of the colour of unknown values.
    pub unknown: String,
}

/// The colours from zero to `most`: viridis (van der Walt and Smith 2015), whose lightness grows evenly, so that
/// it also reads in grey and with colour vision deficiencies.
const COLOURS: [Colour; 9] = [
    Colour::hex(0x440154),
    Colour::hex(0x472d7b),
    Colour::hex(0x3b528b),
    Colour::hex(0x2c728e),
    Colour::hex(0x21918c),
    Colour::hex(0x28ae80),
    Colour::hex(0x5ec962),
    Colour::hex(0xaddc30),
    Colour::hex(0xfde725),
];
const UNKNOWN: Colour = Colour::hex(0x808080);
/// Narrower images are enlarged to make room for the legend.
const NARROWEST: f32 = 480.0;
const TEXT: f32 = 12.0;

/// Draws the image and its legend.
///
/// # Errors
/// [`ChartError::Picture`] unless the values fill rows.
pub fn false_colour(data: &FalseColour, theme: Theme) -> Result<Drawing, ChartError> {
    let palette = theme.palette();
    let height = data.values.len() / data.width.max(1);
    let rgb = |value: &f64| colour(*value / data.most).rgb;
    let rgb = data.values.iter().flat_map(rgb).collect();
    let picture = Picture::new(data.width, height, rgb)?;
    let factor = (NARROWEST / data.width as f32).ceil().max(1.0);
    let (width, height) = (data.width as f32 * factor, height as f32 * factor);
    let top = MARGIN + TITLE + 10.0;
    let bar = Frame::new(MARGIN, top + height + 14.0, width, 14.0);
    let whole = (width + 2.0 * MARGIN, bar.bottom() + 54.0);
    let mut drawing = Drawing::titled(&data.title, whole.0, whole.1, &palette);
    drawing.picture(Frame::new(MARGIN, top, width, height), picture);
    let ramp = (0..=255_u8).flat_map(|step| colour(f64::from(step) / 255.0).rgb);
    drawing.picture(bar, Picture::new(256, 1, ramp.collect())?);
    let ruler = Ruler::exact(Scale::Linear, (0.0, data.most), (bar.x, bar.right()), 8);
    for (x, tick) in ruler.placed_ticks() {
        let (from, to) = ((x, bar.bottom()), (x, bar.bottom() + 4.0));
        drawing.line(from, to, Stroke::solid(palette.frame, 1.0));
        let label = Label::new(&tick.label, (x, bar.bottom() + 18.0), TEXT, palette.ink);
        drawing.text(label.anchored(Anchor::Middle));
    }
    let foot = bar.bottom() + 40.0;
    drawing.text(Label::new(&data.unit, (MARGIN, foot), TEXT, palette.ink));
    let label = Label::new(&data.unknown, (bar.right(), foot), TEXT, palette.quiet);
    drawing.text(label.anchored(Anchor::End));
    let left = bar.right() - font::width(&data.unknown, TEXT) - 18.0;
    drawing.rectangle(Frame::new(left, foot - 10.0, 12.0, 12.0), UNKNOWN);
    Ok(drawing)
}

/// The colour of a share of the most.
fn colour(share: f64) -> Colour {
    if share.is_nan() {
        return UNKNOWN;
    }
    let place = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let next = COLOURS.get(place as usize + 1);
    let (from, to) = (COLOURS.get(place as usize), next.or(COLOURS.last()));
    from.zip(to)
        .map_or(UNKNOWN, |(from, to)| from.toward(*to, place.fract() as f32))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use crate::chart::drawing::Mark;

    #[test]
    fn colours_grow_lighter_and_the_legend_has_them() {
        let data = FalseColour {
            width: 480,
            values: (0..960)
                .map(|x| f64::from(x % 480) / 479.0 * 300.0)
                .collect(),
            most: 300.0,
            ..FalseColour::default()
        };
        let drawing = false_colour(&data, Theme::Light).unwrap();
        let pictures: Vec<&Picture> = drawing
            .marks
            .iter()
            .filter_map(|mark| match mark {
                Mark::Picture { picture, .. } => Some(picture),
                _ => None,
            })
            .collect();
        let light = |rgb: &[u8]| {
            Colour::hex(0).contrast(Colour {
                rgb: rgb.try_into().unwrap(),
                alpha: 1.0,
            })
        };
        let row = &pictures[0].rgb()[..480 * 3];
        assert!(
            row.as_chunks::<3>()
                .0
                .windows(2)
                .all(|w| light(&w[0]) <= light(&w[1]) + 0.02)
        );
        assert_eq!(row[..3], pictures[1].rgb()[..3]);
        assert_eq!(row[479 * 3..], pictures[1].rgb()[255 * 3..]);
        assert_eq!((colour(7.0), colour(f64::NAN)), (COLOURS[8], UNKNOWN));
        let labels: Vec<String> = drawing
            .text_boxes()
            .into_iter()
            .map(|(text, _)| text)
            .collect();
        assert!(labels.contains(&"300".to_owned()), "{labels:?}");
        let short = FalseColour {
            width: 7,
            values: vec![0.0; 13],
            ..data
        };
        assert!(false_colour(&short, Theme::Light).is_err());
    }
}
