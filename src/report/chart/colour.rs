//! Colours and the two themes.
//!
//! The hues of series follow Okabe and Ito, "Color Universal Design" (2008), which common colour
//! vision deficiencies can distinguish; hues too near a theme's background are left out of its
//! list.

use footlight_show::units::srgb_decode;

/// A display-coded (sRGB) colour with its coverage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// Red, green, blue.
    pub rgb: [u8; 3],
    /// 0 is transparent, 1 opaque.
    pub alpha: f32,
}

impl Colour {
    /// An opaque colour from `0xRRGGBB`.
    pub const fn hex(code: u32) -> Colour {
        let [_, red, green, blue] = code.to_be_bytes();
        Colour {
            rgb: [red, green, blue],
            alpha: 1.0,
        }
    }

    /// The colour with another coverage.
    pub const fn faded(self, alpha: f32) -> Colour {
        Colour {
            rgb: self.rgb,
            alpha,
        }
    }

    /// Interpolates to `other` by `share`, in display-coded values.
    pub(super) fn toward(self, other: Colour, share: f32) -> Colour {
        let mut rgb = self.rgb;
        for (channel, goal) in rgb.iter_mut().zip(other.rgb) {
            let (from, to) = (f32::from(*channel), f32::from(goal));
            *channel = (from + (to - from) * share).round().clamp(0.0, 255.0) as u8;
        }
        Colour { rgb, ..self }
    }

    /// Relative luminance (WCAG 2.2, from IEC 61966-2-1).
    fn luminance(self) -> f32 {
        let [red, green, blue] = self.rgb.map(linear);
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    }

    /// WCAG contrast ratio, 1 to 21.
    pub fn contrast(self, other: Colour) -> f32 {
        let (one, two) = (self.luminance(), other.luminance());
        (one.max(two) + 0.05) / (one.min(two) + 0.05)
    }

    /// The colour, moved toward `ink` in steps until it is distinguishable from `ground`.
    ///
    /// WCAG asks 3:1 of graphical objects; 2.4:1 keeps more of the hue, and the curves that use it
    /// also have a filled area.
    pub(super) fn legible(self, ground: Colour, ink: Colour) -> Colour {
        (0..=10)
            .map(|tenth| self.toward(ink, tenth as f32 / 10.0))
            .find(|colour| colour.contrast(ground) >= 2.4)
            .unwrap_or(ink)
    }
}

/// The linear value of a display code, 0 to 1.
pub(super) fn linear(code: u8) -> f32 {
    srgb_decode(f64::from(code) / 255.0) as f32
}

/// Background of a chart: a page, or a dark desk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// Dark ink on white.
    #[default]
    Light,
    /// Light ink on near black, for the theatre.
    Dark,
}

/// The colours of one theme.
#[derive(Clone, Copy, Debug)]
pub(super) struct Palette {
    pub(super) ground: Colour,
    /// Background of a strip or plot.
    pub(super) field: Colour,
    pub(super) grid: Colour,
    pub(super) frame: Colour,
    pub(super) ink: Colour,
    pub(super) quiet: Colour,
    pub(super) playhead: Colour,
    hues: &'static [Colour],
}

impl Palette {
    /// The hue of the series with this index; hues repeat.
    pub(super) fn hue(&self, index: usize) -> Colour {
        let mut hues = self.hues.iter().cycle().copied();
        hues.nth(index).unwrap_or(self.ink)
    }
}

const LIGHT: Palette = Palette {
    ground: Colour::hex(0xffffff),
    field: Colour::hex(0xf5f6f8),
    grid: Colour::hex(0xe1e4e8),
    frame: Colour::hex(0x9aa1aa),
    ink: Colour::hex(0x1c2128),
    quiet: Colour::hex(0x59636e),
    playhead: Colour::hex(0xc2185b),
    hues: &[
        Colour::hex(0x0072b2),
        Colour::hex(0xd55e00),
        Colour::hex(0x009e73),
        Colour::hex(0xcc79a7),
        Colour::hex(0x56b4e9),
        Colour::hex(0xe69f00),
        Colour::hex(0x1c2128),
    ],
};

const DARK: Palette = Palette {
    ground: Colour::hex(0x14171c),
    field: Colour::hex(0x1d2229),
    grid: Colour::hex(0x313842),
    frame: Colour::hex(0x68727e),
    ink: Colour::hex(0xe8eaed),
    quiet: Colour::hex(0xa3adb8),
    playhead: Colour::hex(0xff5c8a),
    hues: &[
        Colour::hex(0x56b4e9),
        Colour::hex(0xe69f00),
        Colour::hex(0x20b98c),
        Colour::hex(0xcc79a7),
        Colour::hex(0xf0e442),
        Colour::hex(0xe8702a),
        Colour::hex(0xe8eaed),
    ],
};

impl Theme {
    pub(super) fn palette(self) -> Palette {
        match self {
            Theme::Light => LIGHT,
            Theme::Dark => DARK,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_series_stand_out_from_their_ground() {
        for theme in [Theme::Light, Theme::Dark] {
            let palette = theme.palette();
            assert!(palette.ink.contrast(palette.field) >= 7.0);
            assert!(palette.quiet.contrast(palette.field) >= 4.5);
            for index in 0..7 {
                let hue = palette.hue(index);
                assert!(hue.contrast(palette.field) >= 2.0, "{theme:?} {hue:?}");
            }
        }
    }

    #[test]
    fn colours_near_the_ground_are_moved_toward_the_ink_and_others_kept() {
        for theme in [Theme::Light, Theme::Dark] {
            let palette = theme.palette();
            let hidden = palette.field.legible(palette.field, palette.ink);
            assert!(hidden.contrast(palette.field) >= 2.4);
            let red = Colour::hex(0xe02020);
            assert_eq!(red.legible(palette.field, palette.ink), red);
        }
    }
}
