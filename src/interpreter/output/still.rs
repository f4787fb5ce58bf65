//! One picture.

use std::path::Path;

use super::target::precision;
use super::{described, ending, unknown_ending};
use crate::interpreter::answer::count;
use crate::interpreter::{Call, Error, Interpreter, Reply, Shown, refine};
use crate::picture::exr;
use crate::picture::tone::{self, Tone};
use crate::picture::{Image, png};
use crate::renderer::Quality;

impl Interpreter {
    pub(in crate::interpreter) fn answer_picture(&mut self, call: &Call) -> Result<Reply, Error> {
        if call.words.len() + usize::from(call.option("at").is_some()) > 1 {
            return Err(Error::Usage(
                "a picture is of one moment: say one time".to_owned(),
            ));
        }
        let time = match call.option("at").or(call.words.first().map(String::as_str)) {
            Some(text) => self.time(text)?,
            None => self.now,
        };
        let setting = match call.option("bank") {
            Some(name) => self.alone(name)?,
            None if time == self.now => self.present(),
            None => self.timeline().evaluate(time),
        };
        let image = match call.option("quality") {
            Some(text) => self.render(&setting, self.quality(text)?)?,
            None => {
                self.coarse()?;
                self.projected()?.preview(&setting, self.host.work())?
            }
        };
        let what = match call.option("bank") {
            Some(name) => format!("{name} alone at full"),
            None => format!("{time}"),
        };
        let quality = match call.option("quality") {
            Some(text) => format!("quality {text}"),
            None if self.is_final() => "the sum of the banks".to_owned(),
            None => {
                let refined = match self.refined() {
                    0 => "coarse alone, nothing refined yet".to_owned(),
                    n => format!("coarse, and {}", count(n, "refined picture")),
                };
                format!("{refined}{}", self.method().aside())
            }
        };
        let negative = tone::negative(&image);
        let below = match negative {
            0 => String::new(),
            n => format!("; {} a little below zero, shown as 0", count(n, "value")),
        };
        let path = call.option("output").map(Path::new);
        let text = format!("{what}: {quality}{below}");
        let linear = path.is_some_and(|p| ending(p) == "exr");
        if call.option("float").is_some() && !linear {
            return Err(Error::Usage("`--float` is for an .exr".to_owned()));
        }
        if linear {
            let header = [described("picture", &text)];
            let bytes = exr::encode(&image, precision(call), &header)?;
            return self.write_reply(path, &bytes, text);
        }
        let tone = self.picture_tone(&image)?;
        let rgb = tone.encode(&image);
        let size = (image.width(), image.height());
        match path {
            Some(p) if ending(p) == "png" => {
                let bytes = png::encode(size.0, size.1, &rgb)?;
                self.write_reply(path, &bytes, text)
            }
            Some(p) => Err(unknown_ending(p, ".png (as displayed) or .exr (linear)")),
            None => Ok(Reply {
                picture: Some(Shown { size, rgb }),
                ..Reply::text(text)
            }),
        }
    }

    /// The exposure of the whole sequence, so that pictures of different moments compare; a show
    /// without cues is exposed for the picture itself.
    fn picture_tone(&mut self, image: &Image) -> Result<Tone, Error> {
        if self.show().preview.exposure.is_some() || self.show().cues.is_empty() {
            return Ok(self.tone(std::slice::from_ref(image)));
        }
        let made_by = (self.refined(), self.method().projection);
        if let Some((exposure, at)) = self.exposure
            && at == made_by
        {
            return Ok(self.tone_at(exposure));
        }
        let exposure = self.auto_exposure()?;
        self.exposure = Some((exposure, made_by));
        Ok(self.tone_at(exposure))
    }

    /// A bank alone at full: 1 in its coordinates.
    pub(in crate::interpreter) fn alone(&self, name: &str) -> Result<Vec<f64>, Error> {
        let coordinates = self.show().coordinates();
        let banks = &self.show().banks;
        let of = |c: &crate::show::Coordinate| {
            let bank = c
                .bank
                .and_then(|b| banks.get(b))
                .is_some_and(|b| b.name == name);
            bank || c.name == name
        };
        if !coordinates.iter().any(of) {
            let fixed = self.show().fixed.iter().any(|f| f.name == name);
            if fixed {
                return Err(Error::Usage(format!(
                    "`{name}` is always on, as all that is fixed: `--bank fixed` is that together"
                )));
            }
            let mut names: Vec<&str> = banks.iter().map(|b| b.name.as_str()).collect();
            names.extend((!self.show().fixed.is_empty()).then_some("fixed"));
            let near = crate::lang::nearest(name, names.iter().copied());
            let hint = near.map_or(names.join(", "), |n| format!("did you mean `{n}`?"));
            return Err(Error::Usage(format!("there is no bank `{name}`: {hint}")));
        }
        Ok(coordinates
            .iter()
            .map(|c| f64::from(u8::from(of(c))))
            .collect())
    }

    pub(in crate::interpreter) fn quality(&self, text: &str) -> Result<Quality, Error> {
        let finest = self.finest().0;
        let number = text.parse().ok().filter(|q| (1..=finest).contains(q));
        number.map(Quality).ok_or_else(|| {
            Error::Usage(format!(
                "`{text}` is not a quality; the scale is 1 to {finest}"
            ))
        })
    }

    /// Renders a setting anew at a quality of one's own choice, without the pool.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, else what rendering says.
    pub fn render(&mut self, setting: &[f64], quality: Quality) -> Result<Image, Error> {
        let work = self.host.work();
        let stage = self.stage.as_mut().ok_or_else(refine::no_stage)?;
        let operator = stage.operator(self.host.transport.as_ref(), quality, work)?;
        let mut images = operator.render(&[setting.to_vec()], work)?;
        images.pop().ok_or_else(refine::no_stage)
    }
}
