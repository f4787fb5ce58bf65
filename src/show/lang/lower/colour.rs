//! Colours: as numbers, by name, by hue, saturation and brightness, by the number of a gel.

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::Word;
use crate::lang::codes;
use crate::lang::names::{Kind, nearest};
use crate::lang::report::Place;
use crate::units::Rgb;

/// Colour names of CSS and `amber`, suggested for a mistyped name; the commonest come first.
const NAMED: &str = "\
    amber aqua black blue cyan gold green indigo lavender magenta orange pink purple red white \
    yellow aliceblue antiquewhite aquamarine azure beige bisque blanchedalmond blueviolet brown \
    burlywood cadetblue chartreuse chocolate coral cornflowerblue cornsilk crimson darkblue \
    darkcyan darkgoldenrod darkgray darkgreen darkgrey darkkhaki darkmagenta darkolivegreen \
    darkorange darkorchid darkred darksalmon darkseagreen darkslateblue darkslategray \
    darkslategrey darkturquoise darkviolet deeppink deepskyblue dimgray dimgrey dodgerblue \
    firebrick floralwhite forestgreen fuchsia gainsboro ghostwhite goldenrod gray greenyellow grey \
    honeydew hotpink indianred ivory khaki lavenderblush lawngreen lemonchiffon lightblue \
    lightcoral lightcyan lightgoldenrodyellow lightgray lightgreen lightgrey lightpink lightsalmon \
    lightseagreen lightskyblue lightslategray lightslategrey lightsteelblue lightyellow lime \
    limegreen linen maroon mediumaquamarine mediumblue mediumorchid mediumpurple mediumseagreen \
    mediumslateblue mediumspringgreen mediumturquoise mediumvioletred midnightblue mintcream \
    mistyrose moccasin navajowhite navy oldlace olive olivedrab orangered orchid palegoldenrod \
    palegreen paleturquoise palevioletred papayawhip peachpuff peru plum powderblue rebeccapurple \
    rosybrown royalblue saddlebrown salmon sandybrown seagreen seashell sienna silver skyblue \
    slateblue slategray slategrey snow springgreen steelblue tan teal thistle tomato turquoise \
    violet wheat whitesmoke yellowgreen";

/// True when a value is written as a colour.
pub fn is_colour(text: &str) -> bool {
    text.starts_with('#') || text.starts_with("hsb(") || text.starts_with("gel")
}

impl Lower<'_, '_> {
    /// Linear light of a colour in any notation.
    pub fn colour(&mut self, word: Word<'_>) -> Option<Rgb> {
        let text = self.text(word)?;
        if let Some(inner) = text.strip_prefix("hsb(") {
            return self.hsb(word, inner.trim_end_matches(')'));
        }
        if let Some(number) = text.strip_prefix("gel") {
            return self.gel(word, number.trim());
        }
        let digits = text.trim_start_matches('#');
        match hex(digits) {
            Some(srgb) => Some(Rgb::from_srgb8(srgb)),
            None => self.named_colour(word, digits),
        }
    }

    /// A colour of the show by name, else one of CSS.
    fn named_colour(&mut self, word: Word<'_>, name: &str) -> Option<Rgb> {
        if let Some(Kind::Value) = self.names.get(name).map(|e| e.kind) {
            let value = self.value_called(name)?;
            if is_colour(&value) && value.trim_start_matches('#') != name {
                let text = value.as_str();
                let span = word.span;
                return self.colour(Word { text, span });
            }
        }
        if let Some(srgb) = named(name) {
            return Some(Rgb::from_srgb8(srgb));
        }
        let message = format!("`{}` is not a colour", word.text);
        let near = nearest(
            name,
            self.names
                .of(&[Kind::Value])
                .chain(NAMED.split_whitespace()),
        );
        let help = match near {
            _ if name.is_empty() => {
                "a comment begins with `//`; a colour is written `#ffb36b`".to_owned()
            }
            Some(near) => format!("did you mean `#{near}`?"),
            None => {
                "write a colour as `#ffb36b`, `#fb6`, `#orange` or `hsb(30, 60%, 100%)`".to_owned()
            }
        };
        let at = (word.span, "not a colour");
        self.report.error(codes::BAD_COLOUR, message, at, help)
    }

    /// Hue in degrees, saturation and brightness in percent (Smith 1978), sRGB-coded.
    fn hsb(&mut self, word: Word<'_>, inner: &str) -> Option<Rgb> {
        let pieces = inner.split([',', ' ']).filter(|piece| !piece.is_empty());
        let numbers: Vec<Option<f64>> = pieces
            .map(|piece| {
                piece
                    .trim_end_matches('%')
                    .trim_end_matches("deg")
                    .parse()
                    .ok()
            })
            .collect();
        let share = 0.0..=100.0;
        if let [Some(hue), Some(saturation), Some(brightness)] = numbers[..]
            && (0.0..=360.0).contains(&hue)
            && share.contains(&saturation)
            && share.contains(&brightness)
        {
            let (s, b) = (saturation / 100.0, brightness / 100.0);
            let channel = |n: f64| {
                let k = (n + hue / 60.0) % 6.0;
                b - b * s * k.min(4.0 - k).clamp(0.0, 1.0)
            };
            let coded = [channel(5.0), channel(3.0), channel(1.0)];
            return Some(Rgb::from_srgb(coded));
        }
        let message = format!("`{}` is not a colour", word.text);
        let help =
            "hue is 0 to 360, saturation and brightness are 0% to 100%: `hsb(30, 60%, 100%)`";
        let at = (word.span, "not a colour");
        self.report.error(codes::BAD_COLOUR, message, at, help)
    }

    /// A gel of the show's tables.
    fn gel(&mut self, word: Word<'_>, number: &str) -> Option<Rgb> {
        if let Some(colour) = self.gels.get(number) {
            return Some(*colour);
        }
        if self.names_lost {
            return None;
        }
        let message = format!("there is no gel `{number}`");
        let near = nearest(number, self.gels.keys().map(String::as_str));
        let help = match near {
            _ if self.gels.is_empty() => {
                "name a table of gels next to the show, with number, name and colour in each line: gels \"lee.csv\"".to_owned()
            }
            Some(near) => format!("did you mean `gel {near}`?"),
            None => format!("the tables of the show have {} gels", self.gels.len()),
        };
        let diagnostic = Diagnostic::error(codes::UNKNOWN_NAME, message);
        self.report
            .add(diagnostic.place(word.span, "in no table").help(help));
        None
    }
}

/// `rrggbb` or `rgb`.
pub fn hex(digits: &str) -> Option<[u8; 3]> {
    let nibble = |c: char| c.to_digit(16).and_then(|d| u8::try_from(d).ok());
    let nibbles: Option<Vec<u8>> = digits.chars().map(nibble).collect();
    match nibbles.as_deref() {
        Some([r, g, b]) => Some([r * 17, g * 17, b * 17]),
        Some([a, b, c, d, e, f]) => Some([a * 16 + b, c * 16 + d, e * 16 + f]),
        _ => None,
    }
}

/// A colour of CSS by its name, and `amber`, which every desk has.
pub fn named(name: &str) -> Option<[u8; 3]> {
    if name == "amber" {
        return Some([255, 191, 0]);
    }
    let named = name.chars().all(|c| c.is_ascii_alphabetic()) && name != "transparent";
    let colour = named.then(|| color::parse_color(&name.replace("grey", "gray")).ok())??;
    let coded = colour.to_alpha_color::<color::Srgb>().to_rgba8();
    Some([coded.r, coded.g, coded.b])
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_name_that_is_suggested_is_a_colour() {
        let mut names = super::NAMED.split_whitespace();
        assert_eq!(names.clone().count(), 149);
        assert!(names.all(|name| super::named(name).is_some()));
    }
}
