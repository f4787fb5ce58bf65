//! Banks, fixed lights and groups.

use super::Lower;
use crate::lang::ast::{self, Declaration, ImageWords, Span, Statement, Word};
use crate::lang::codes;
use crate::lang::names::Kind;
use crate::model::ImageFile;
use crate::model::{Bank, Dimmer, Fade, Fixed, Group, LightKind, Luminaire, NodeId};

impl<'a> Lower<'a, '_> {
    /// Lowers banks, fixed lights and groups.
    pub fn rig(&mut self, statements: &[Statement<'a>]) {
        let lights: Vec<(&ast::Light<'a>, Span)> = statements
            .iter()
            .filter_map(|s| match &s.item {
                Declaration::Light(light) => Some((light, s.span)),
                _ => None,
            })
            .collect();
        self.lights(&lights);
        for statement in statements {
            match &statement.item {
                Declaration::Bank(bank) => self.bank(bank, statement.span),
                Declaration::Fixed {
                    name,
                    lights,
                    image,
                    level,
                } => {
                    let id = self.node(statement.span);
                    let fixed = Fixed {
                        id,
                        name: name.text.to_owned(),
                        lights: self.shining(id, lights, *image),
                        level: level.map_or(1.0, |w| self.level(w).unwrap_or_default()),
                    };
                    self.show.fixed.push(fixed);
                }
                _ => {}
            }
        }
        self.first_parameters = self.show.first_parameters();
        self.points(statements);
        self.heads_in_banks();
        for statement in statements {
            if let Declaration::Group { name, banks } = &statement.item {
                let group = Group {
                    id: self.node(statement.span),
                    name: name.text.to_owned(),
                    banks: self.listed(banks, Kind::Bank),
                };
                self.show.groups.push(group);
            }
        }
    }

    /// Indices of the named items, each once.
    fn listed(&mut self, words: &[Word<'a>], kind: Kind) -> Vec<usize> {
        let mut seen = std::collections::BTreeMap::new();
        let mut out = Vec::new();
        for word in words {
            let Some((_, index)) = self.find(*word, &[kind], &[]) else {
                continue;
            };
            match seen.insert(index, word.span) {
                Some(earlier) => self.once(&mut Some(earlier), word.text, word.span),
                None => out.push(index),
            }
        }
        out
    }

    /// The lights of the statement `id`: those it names, or its image, which becomes a light
    /// without a usable name.
    fn shining(
        &mut self,
        id: NodeId,
        names: &[Word<'a>],
        image: Option<ImageWords<'a>>,
    ) -> Vec<usize> {
        let Some(ImageWords { path, layer }) = image else {
            return self.listed(names, Kind::Light);
        };
        let file = ImageFile {
            path: super::unquoted(path),
            layer: layer.map(super::unquoted),
        };
        for (word, text) in [(Some(path), Some(&file.path)), (layer, file.layer.as_ref())] {
            if let (Some(word), Some("")) = (word, text.map(String::as_str)) {
                let help =
                    "a whole one is `bank front image \"groups.exr\" layer \"Combined_front\"`";
                let at = (word.span, "empty");
                self.report
                    .error::<()>(codes::MISSING, "the image has no name", at, help);
            }
        }
        self.show.lights.push(Luminaire {
            id,
            name: match layer {
                None => format!("image {}", path.text),
                Some(layer) => format!("image {} layer {}", path.text, layer.text),
            },
            kind: LightKind::Image(file),
            form: "image".to_owned(),
            colour: String::new(),
            gel: None,
            head: None,
        });
        vec![self.show.lights.len() - 1]
    }

    fn bank(&mut self, bank: &ast::Bank<'a>, span: Span) {
        let id = self.node(span);
        for (what, words) in [("channel", &bank.channels), ("dimmer", &bank.dimmers)] {
            if let [first, second, ..] = words.as_slice() {
                self.once(&mut Some(first.span), what, second.span);
            }
        }
        let channel = bank.channels.first();
        let channel = channel.and_then(|w| self.count(*w, 999_999, "a channel"));
        let dimmer = bank.dimmers.first().and_then(|w| self.dimmer(*w));
        let bank = Bank {
            id,
            name: bank.name.text.to_owned(),
            lights: self.shining(id, &bank.lights, bank.image),
            channel,
            dimmer: dimmer.unwrap_or(Dimmer::Linear),
            rgb: bank.rgb,
        };
        self.show.banks.push(bank);
    }

    fn dimmer(&mut self, word: Word<'a>) -> Option<Dimmer> {
        match word.text {
            "linear" => Some(Dimmer::Linear),
            "square" => Some(Dimmer::Square),
            fade if Fade::built_in(fade).is_some() => {
                let message = format!("`{fade}` is a fade, not a dimmer");
                let help = "a dimmer is `linear`, `square` or a curve of the show";
                self.report.error(
                    codes::WRONG_KIND_OF_NAME,
                    message,
                    (word.span, "not a dimmer"),
                    help,
                )
            }
            _ => self
                .find(word, &[Kind::Curve], &["linear", "square"])
                .map(|(_, index)| Dimmer::Curve(index)),
        }
    }
}
