//! The page: a show in one HTML file that plays it in a browser, without Footlight or a network;
//! and the same page served by a program, with the show and its images in separate files.
//!
//! Invariants: a file fetches nothing, and a served page only from its own server (their content
//! security policies forbid the rest); images use the 8-bit code of `byte_curve`, as PNG or JPEG,
//! and are decoded to light before blending; exposure and curve equal those of every other output;
//! the images keep the size budget, reduced if necessary. The page's own text (`page/`) decides its
//! appearance and does not depend on Rust.

mod byte_curve;
mod coding;

use std::borrow::Cow;

use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde::Serialize;

pub use self::coding::{Coded, fit};
use self::coding::{Form, attempt, smaller};
use footlight_host::work::{Cancelled, Work};
use footlight_picture::tone::Tone;
use footlight_picture::{Image, PictureError};
use footlight_show::printable::{self, escaped};
use footlight_show::timeline::{KeySequence, Segment};
use footlight_show::units::ToneCurve;

/// Default limit of a page, bytes.
pub const BUDGET: usize = 20_000_000;

/// Reason why a page could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// The embedding program cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// An image could not be encoded, or the images do not fit.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The show could not be written as data.
    #[error("the show as data: {0}")]
    Data(#[from] serde_json::Error),
}

/// A coordinate in the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fader {
    /// Its name.
    pub name: String,
    /// Channel of its bank at the desk.
    pub channel: Option<u32>,
    /// Index of its image, alone at full, in [`Contents::banks`].
    pub picture: usize,
    /// True when a fader moves it; false for the fixed lights.
    pub varies: bool,
    /// From level to setting.
    pub law: Law,
}

/// An rgb bank: a fader for its level, a control for its colour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mixer {
    /// Its name.
    pub name: String,
    /// The coordinate of its red emitter; green and blue follow.
    pub first: usize,
    /// From level to light.
    pub law: Law,
    /// Seconds, level, and shares of red, green and blue (0 to 1, linear): at least one entry,
    /// straight lines between, two entries at one time for a jump.
    pub track: Vec<[f64; 5]>,
}

/// A dimmer's law from level (0 to 1) to setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Law {
    /// Setting = level to this power.
    Power(u8),
    /// Settings of evenly spaced levels, with straight lines between.
    Table(Vec<f64>),
}

/// A cue in the list.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageCue {
    /// Its number.
    pub number: String,
    /// Its label; may be empty.
    pub label: String,
    /// Start, seconds.
    pub go: f64,
    /// Completion, seconds.
    pub complete: f64,
    /// True when it starts the next cue automatically.
    pub starts: bool,
    /// Its times and link, in a designer's words; may be empty.
    pub timing: String,
    /// Note for the operator; may be empty.
    pub note: String,
    /// Coordinates that it moves, with the seconds from its GO to the end of the move.
    pub moves: Vec<(usize, f64)>,
}

/// Content of a page.
#[derive(Debug)]
pub struct Contents<'a> {
    /// The show's title.
    pub title: Cow<'a, str>,
    /// Quality of its images, in one line; may be empty.
    pub quality: String,
    /// Its coordinates, in order.
    pub faders: Vec<Fader>,
    /// Its banks of colour mixers, in order.
    pub mixers: Vec<Mixer>,
    /// Its cues, by time.
    pub cues: Vec<PageCue>,
    /// Its key settings and segments.
    pub keys: &'a KeySequence,
    /// True when key images contain the light of heads, which images of banks lack, so that they
    /// are never left out. They become JPEG files if PNG files do not fit.
    pub has_heads: bool,
    /// Images of the keys, in order.
    pub pictures: Vec<&'a Image>,
    /// Images for the faders, of equal size.
    pub banks: Vec<&'a Image>,
    /// Tone mapping.
    pub tone: Tone,
}

/// A page within its budget.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// The file.
    pub html: String,
    /// Width and height of its images.
    pub size: (usize, usize),
    /// True with images of keys; otherwise the page adds up images of banks.
    pub blends: bool,
}

/// An image in the page.
#[derive(Clone, Debug, Serialize)]
pub struct PagePicture {
    /// Like [`Coded::law`].
    pub law: [f32; 2],
    /// URL of a PNG or JPEG file of the codes.
    pub codes: String,
    /// URL of a PNG file that is white in negative channels.
    pub signs: Option<String>,
}

impl PagePicture {
    /// An image with its files as data URLs.
    pub fn inside(coded: Coded) -> PagePicture {
        let address = |file: Vec<u8>| {
            let kind = if file.starts_with(&[0xff, 0xd8]) {
                "jpeg"
            } else {
                "png"
            };
            let mut address = format!("data:image/{kind};base64,");
            BASE64_STANDARD.encode_string(file, &mut address);
            address
        };
        PagePicture {
            law: coded.law,
            codes: address(coded.codes),
            signs: coded.signs.map(address),
        }
    }
}

/// A segment in the page, times in seconds.
#[derive(Debug, Serialize)]
struct Stretch<'a> {
    start: f64,
    end: f64,
    degree: usize,
    keys: &'a [usize],
}

/// The page's data.
#[derive(Debug, Serialize)]
struct Data<'a> {
    title: &'a str,
    size: [usize; 2],
    start: f64,
    end: f64,
    curve: &'a str,
    quality: &'a str,
    made: String,
    coordinates: &'a [Fader],
    mixers: &'a [Mixer],
    cues: &'a [PageCue],
    /// Number of key images, which precede those of banks.
    keys: usize,
    /// True when only key images show heads where they are.
    heads: bool,
    settings: &'a [Vec<f64>],
    segments: Vec<Stretch<'a>>,
    pictures: Vec<PagePicture>,
}

/// Approximate memory for [`write()`] with this number of images: one image being encoded on each
/// thread, and twice the file, which is at most all images uncompressed in base64.
pub fn bytes(
    pictures: usize,
    (width, height): (usize, usize),
    budget: usize,
    threads: usize,
) -> usize {
    let one = 3 * width * height;
    threads * one * (size_of::<f32>() + 4) + 2 * budget.min(pictures * one / 3 * 4)
}

/// Writes the page of a show in at most `budget` bytes. If the key images do not fit, as with
/// effects, the page adds up images of banks instead, or, with heads, has them as JPEG; if it still
/// does not fit, all images are reduced, down to a width of 160 pixels.
///
/// # Errors
/// [`PageError`] on cancel, for images without pixels, and when even small ones do not fit.
pub fn write(contents: &Contents<'_>, budget: usize, work: Work<'_>) -> Result<Page, PageError> {
    let full = contents.banks.first().map_or((0, 0), |i| i.size());
    let mut form = Form {
        size: full,
        jpegs: 0,
    };
    let mut keys = contents.pictures.as_slice();
    loop {
        let all: Vec<&Image> = keys.iter().chain(&contents.banks).copied().collect();
        let needed = match attempt(&all, contents.tone, form, budget, work)? {
            Ok(pictures) => {
                let pictures = pictures.into_iter().map(PagePicture::inside).collect();
                let html = html(contents, pictures, keys.len(), (form.size, full))?;
                if html.len() <= budget {
                    return Ok(Page {
                        html,
                        size: form.size,
                        blends: !keys.is_empty(),
                    });
                }
                html.len()
            }
            Err(estimate) => estimate,
        };
        if contents.has_heads && form.jpegs < keys.len() {
            form.jpegs = keys.len();
        } else if !contents.has_heads && !keys.is_empty() {
            keys = &[];
        } else {
            form.size = smaller(form.size, full, needed, budget)?;
        }
    }
}

/// The data of a served page, which adds up images of banks with the URLs `pictures` and this size.
///
/// # Errors
/// [`PageError::Data`].
pub fn data(
    contents: &Contents<'_>,
    pictures: Vec<PagePicture>,
    size: (usize, usize),
) -> Result<String, PageError> {
    let full = contents.banks.first().map_or(size, |i| i.size());
    json(contents, pictures, 0, (size, full))
}

/// A served page; with `follows`, one that watches while another runs the show.
pub fn served(title: &str, follows: bool) -> String {
    let policy = "default-src 'none'; connect-src 'self'; img-src 'self' data:; \
                  script-src 'unsafe-inline'; style-src 'unsafe-inline'";
    let data = format!("{{\"follows\":{follows}}}");
    let start = [
        include_str!("page/change.js"),
        include_str!("page/served.js"),
    ];
    filled(&escaped(title), policy, &start, &data)
}

/// The page's data as JSON.
fn json<'a>(
    contents: &'a Contents<'_>,
    pictures: Vec<PagePicture>,
    keys: usize,
    (size, full): ((usize, usize), (usize, usize)),
) -> Result<String, PageError> {
    let segments = contents.keys.segments();
    let stretch = |s: &'a Segment| Stretch {
        start: s.start(),
        end: s.end(),
        degree: s.degree,
        keys: &s.keys,
    };
    let data = Data {
        title: &contents.title,
        size: [size.0, size.1],
        start: segments.first().map_or(0.0, |s| s.start()),
        end: segments.last().map_or(0.0, |s| s.end()),
        curve: match contents.tone.curve {
            ToneCurve::Filmic => "filmic",
            ToneCurve::Plain => "plain",
        },
        quality: &contents.quality,
        made: remark(contents, keys, size, full),
        coordinates: &contents.faders,
        mixers: &contents.mixers,
        cues: &contents.cues,
        keys,
        heads: contents.has_heads,
        settings: contents.keys.keys(),
        segments: segments.iter().map(stretch).collect(),
        pictures,
    };
    // Free each copy before the next, so that at most two exist.
    let json = serde_json::to_string(&data)?;
    drop(data);
    Ok(printable::json(&json))
}

/// The page as a file.
fn html(
    contents: &Contents<'_>,
    pictures: Vec<PagePicture>,
    keys: usize,
    sizes: ((usize, usize), (usize, usize)),
) -> Result<String, PageError> {
    let policy =
        "default-src 'none'; img-src data:; script-src 'unsafe-inline'; style-src 'unsafe-inline'";
    // Inside a script element nothing may look like its end tag, or like an old browser's line end.
    let data = json(contents, pictures, keys, sizes)?.replace('<', "\\u003c");
    let title = escaped(&contents.title);
    let start = [include_str!("page/file.js")];
    Ok(filled(&title, policy, &start, &data))
}

/// The remark shown in the page.
fn remark(
    contents: &Contents<'_>,
    keys: usize,
    size: (usize, usize),
    full: (usize, usize),
) -> String {
    let (width, height) = size;
    let of = if size == full {
        String::new()
    } else {
        format!(
            ", made smaller from {}x{} to keep the file small",
            full.0, full.1
        )
    };
    let stops = contents.tone.exposure;
    let how = match keys {
        0 => format!("bank images of {width}x{height}{of}; every moment is a sum of them"),
        _ => format!(
            "{keys} key images of {width}x{height}{of}; every moment is at most three blends of them"
        ),
    };
    format!(
        "Made with Footlight: {how}, at an exposure of {stops:.2} stops. Faders mix in light, each \
         through its dimmer."
    )
}

/// Fills the template; each placeholder is replaced once, so that content is never taken for one.
fn filled(title: &str, policy: &str, start: &[&str], json: &str) -> String {
    let script = [
        include_str!("page/light.js"),
        include_str!("page/go.js"),
        include_str!("page/webgl.js"),
        include_str!("page/canvas.js"),
        include_str!("page/faders.js"),
        include_str!("page/sketch.js"),
        include_str!("page/desk.js"),
        include_str!("page/load.js"),
    ];
    let mut page = String::with_capacity(json.len() + (1 << 16));
    for part in include_str!("page/page.html").split("{{") {
        let Some((place, rest)) = part.split_once("}}") else {
            page.push_str(part);
            continue;
        };
        match place {
            "title" => page.push_str(title),
            "policy" => page.push_str(policy),
            "style" => page.push_str(include_str!("page/page.css")),
            "script" => page.extend(script.iter().chain(start).copied()),
            _ => page.push_str(json),
        }
        page.push_str(rest);
    }
    page
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use crate::planted::empty;
    use footlight_show::timeline::Timeline;

    fn tone() -> Tone {
        Tone {
            exposure: -2.0,
            curve: ToneCurve::Filmic,
        }
    }

    /// Noise, which PNG cannot compress.
    fn noise(width: usize, height: usize) -> Image {
        let mut state = 7_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 4e6
        };
        let data = (0..width * height * 3).map(|_| next()).collect();
        Image::from_data(width, height, data).unwrap()
    }

    fn fader(name: &str) -> Fader {
        Fader {
            name: name.to_owned(),
            channel: None,
            picture: 0,
            varies: true,
            law: Law::Power(2),
        }
    }

    fn made(title: &str, image: &Image, budget: usize) -> Result<Page, PageError> {
        made_with(title, image, budget, false)
    }

    fn made_with(
        title: &str,
        image: &Image,
        budget: usize,
        has_heads: bool,
    ) -> Result<Page, PageError> {
        let timeline = Timeline::new(&empty(1)).unwrap();
        let keys = KeySequence::new(&timeline).unwrap();
        let contents = Contents {
            title: title.into(),
            quality: String::new(),
            faders: vec![fader("{{show}}")],
            mixers: Vec::new(),
            cues: Vec::new(),
            keys: &keys,
            has_heads,
            pictures: vec![image; 2],
            banks: vec![image],
            tone: tone(),
        };
        write(&contents, budget, Work::silent())
    }

    #[test]
    fn a_page_keeps_its_budget_with_smaller_pictures() {
        let image = noise(400, 300);
        let whole = made("Show", &image, BUDGET).unwrap();
        assert_eq!(whole.size, (400, 300));
        assert!(!whole.html.contains("made smaller"));
        assert!(whole.blends && whole.html.contains("at most three blends"));
        let added = made("Show", &image, whole.html.len() / 2).unwrap();
        assert_eq!((added.size, added.blends), ((400, 300), false));
        assert!(
            added
                .html
                .contains("bank images of 400x300; every moment is a sum")
        );
        let budget = added.html.len() / 2;
        let small = made("Show", &image, budget).unwrap();
        assert!(small.html.len() <= budget && small.html.len() > budget * 7 / 10);
        let (width, height) = small.size;
        assert!((width as f64 / height as f64 - 4.0 / 3.0).abs() < 0.02);
        assert!(small.html.contains("made smaller from 400x300"));
        let refused = made("Show", &image, 40_000);
        assert!(matches!(
            refused,
            Err(PageError::Picture(PictureError::Bytes { .. }))
        ));
    }

    #[test]
    fn key_images_with_heads_become_jpeg_before_they_are_made_smaller() {
        let image = noise(400, 300);
        let whole = made_with("Show", &image, BUDGET, true).unwrap();
        assert!(!whole.html.contains("data:image/jpeg"));
        let close = made_with("Show", &image, whole.html.len() - 1, true).unwrap();
        assert_eq!((close.size, close.blends), ((400, 300), true));
        assert_eq!(close.html.matches("data:image/jpeg").count(), 2);
        assert_eq!(close.html.matches("data:image/png").count(), 1);
        let small = made_with("Show", &image, close.html.len() / 2, true).unwrap();
        assert!(small.size.0 < 400 && small.html.matches("data:image/jpeg").count() == 2);
    }

    #[test]
    fn no_name_or_title_leaves_its_place_and_nothing_is_fetched() {
        let title = "</script><b>&{{script}} \u{e4}";
        let html = made(title, &noise(4, 3), BUDGET).unwrap().html;
        assert_eq!(html.matches("</script").count(), 2);
        assert!(
            html.contains("<h1 id=\"title\">&lt;/script&gt;&lt;b&gt;&amp;{{script}} \u{e4}</h1>")
        );
        let (_, data) = html.split_once("id=\"show\">").unwrap();
        let (data, _) = data.split_once("</script>").unwrap();
        let data: serde_json::Value = serde_json::from_str(data).unwrap();
        assert_eq!(data["title"], title);
        assert_eq!(data["coordinates"][0]["name"], "{{show}}");
        // The only URL is a name, that of SVG.
        assert_eq!(html.matches("://").count(), 1);
        assert!(html.contains("default-src 'none'; img-src data:;"));
        let page = served(title, true);
        assert_eq!(page.matches("</script").count(), 2);
        assert_eq!(page.matches("://").count(), 1);
    }
}
