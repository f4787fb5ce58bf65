//! The engine in a page: questions in JSON in, answers out.
//!
//! The page writes a question to [`input`], calls [`answer`], and reads as many bytes at [`output`].
//! One instance edits on the page's own thread and renders nothing; another renders in a worker.
//! Neither has an idea of the language that is not the library's.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;

use base64::prelude::{BASE64_STANDARD, Engine as _};
use footlight::diagnostic::{Diagnostics, Severity};
use footlight::engine::{self, Engine, Error, Host};
use footlight::files::{Memory, MemoryStore};
use footlight::lang::{self, Token};
use footlight::picture::tone::{Curve, Tone};
use footlight::playback::page::{self, MODULE, Picture};
use footlight::pool::Pool;
use footlight::renderer::{Quality, Setup};
use footlight::repl::Vocabulary;
use footlight::report;
use footlight::show::ToneCurve;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Bytes that a show may take in a page.
const MEMORY: usize = 1 << 30;

/// What a page asks.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Question {
    /// To begin with a show.
    Open {
        name: String,
        text: String,
        /// The files that it names, in base64.
        files: BTreeMap<String, String>,
        /// Stops, at which all pictures are shown.
        exposure: f64,
    },
    /// What a text comes to.
    Edit(String),
    /// What it may go on with at a place, in units of UTF-16.
    Complete(String, usize),
    /// Its canonical layout.
    Format(String),
    /// The pictures on the page are those of the last text without errors.
    Taken,
    /// Pictures of all banks at a step of quality.
    Render(u8),
    /// The light of a moment in seconds from coarse pictures: single precision, in base64.
    Light(f64),
}

/// A show that is edited.
struct Live {
    engine: Engine,
    /// What the page's pictures show.
    shown: Option<Setup>,
    /// What the last text without errors shows, and how often that was another.
    last: Option<Setup>,
    scene: u64,
    name: String,
    exposure: f64,
}

#[derive(Default)]
struct State {
    live: Option<Live>,
    input: Vec<u8>,
    output: Vec<u8>,
}

thread_local! {
    static STATE: RefCell<State> = RefCell::default();
}

/// Room for a question of so many bytes.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    STATE.with_borrow_mut(|state| {
        state.input.resize(length, 0);
        state.input.as_mut_ptr()
    })
}

/// Answers the question; the bytes of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> usize {
    STATE.with_borrow_mut(|state| {
        let asked = serde_json::from_slice(&state.input);
        let answer = match asked {
            Ok(question) => state.answer(question),
            Err(error) => json!({ "failed": error.to_string() }),
        };
        state.output = answer.to_string().into_bytes();
        state.output.len()
    })
}

/// Where the answer is.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    STATE.with_borrow(|state| state.output.as_ptr())
}

/// Where the version is by which the program knows this module.
#[unsafe(no_mangle)]
pub extern "C" fn version() -> *const u8 {
    MODULE.as_ptr()
}

impl State {
    fn answer(&mut self, question: Question) -> Value {
        if let Question::Open { name, text, files, exposure } = question {
            return match open(&name, &text, &files) {
                Ok(engine) => {
                    let shown = engine.setup().cloned();
                    let last = shown.clone();
                    let live = Live { engine, shown, last, scene: 0, name, exposure };
                    let answer = live.edited(&text, None);
                    self.live = Some(live);
                    answer
                }
                Err(error) => json!({ "failed": error.to_string() }),
            };
        }
        match &mut self.live {
            Some(live) => live.answer(question),
            None => json!({ "failed": "no show is open" }),
        }
    }
}

fn open(name: &str, text: &str, files: &BTreeMap<String, String>) -> Result<Engine, Error> {
    let mut memory = Memory::default();
    for (path, content) in files {
        // What the program has written is base64.
        let bytes = BASE64_STANDARD.decode(content).unwrap_or_default();
        memory = memory.with(path, bytes);
    }
    let host = Host {
        files: Box::new(memory),
        store: Box::new(MemoryStore::default()),
        memory: MEMORY,
        ..Host::default()
    };
    Engine::from_text(name, text.as_bytes(), host)
}

impl Live {
    fn answer(&mut self, question: Question) -> Value {
        match question {
            Question::Open { .. } => Value::Null,
            Question::Edit(text) => {
                let taken = self.engine.replace(&text);
                if self.engine.setup() != self.last.as_ref() {
                    self.last = self.engine.setup().cloned();
                    self.scene += 1;
                }
                self.edited(&text, taken.err())
            }
            Question::Complete(text, at) => self.complete(&text, at),
            Question::Format(text) => {
                match engine::format(&self.name, text.as_bytes(), MEMORY) {
                    Ok(text) => json!({ "text": text }),
                    Err(error) => json!({ "failed": error.to_string() }),
                }
            }
            Question::Taken => {
                self.shown = self.engine.setup().cloned();
                json!({})
            }
            Question::Render(step) => self.render(step).unwrap_or_else(failed),
            Question::Light(seconds) => self.light(seconds).unwrap_or_else(failed),
        }
    }

    /// What a text came to: what is said of it, how it is coloured, and the show as data where it has
    /// no errors. `stale` where the page's pictures are those of another light or stage.
    fn edited(&self, text: &str, error: Option<Error>) -> Value {
        let own = self.engine.document().diagnostics();
        let (said, show) = match &error {
            None => (own.clone(), self.data(&[], Vec::new(), (1, 1)).ok()),
            Some(Error::Show(diagnostics)) => (diagnostics.clone(), None),
            Some(error) => return json!({ "failed": error.to_string(), "tokens": tokens(text) }),
        };
        json!({
            "said": said.render(footlight::diagnostic::Style::Plain).to_string(),
            "is_wrong": error.is_some(),
            "marks": marks(&said, text),
            "tokens": tokens(text),
            "show": show,
            "exposure": self.tone().exposure,
            "scene": self.scene,
            "stale": error.is_none() && self.engine.setup() != self.shown.as_ref(),
        })
    }

    fn tone(&self) -> Tone {
        let preview = &self.engine.show().preview;
        Tone {
            exposure: preview.exposure.unwrap_or(self.exposure),
            curve: match preview.tone {
                ToneCurve::Filmic => Curve::Filmic,
                ToneCurve::Plain => Curve::Plain,
            },
            dither: preview.dither,
        }
    }

    /// The show as the page reads it.
    fn data(
        &self,
        banks: &[footlight::picture::Image],
        pictures: Vec<Picture>,
        size: (usize, usize),
    ) -> Result<Value, report::Error> {
        let contents = report::page::contents(&self.engine, (&[], banks), self.tone());
        let data = page::data(&contents, pictures, size)?;
        Ok(serde_json::from_str(&data).unwrap_or_default())
    }

    fn complete(&self, text: &str, at: usize) -> Value {
        let at = byte_of(text, at);
        let typed = text.get(lang::statement_start(text, at)..at).unwrap_or("");
        let found = Vocabulary::of(self.engine.document()).complete_statement(typed);
        let typed = typed.get(found.start..).unwrap_or("");
        json!({ "typed": typed, "words": found.words })
    }

    /// All banks alone at full, at a step of quality.
    fn render(&mut self, step: u8) -> Result<Value, Error> {
        let finest = self.engine.coarse_steps()[1];
        let quality = Quality(step).min(finest);
        let units = Pool::unit_settings(self.engine.show().coordinates().len());
        let mut banks = Vec::new();
        for unit in &units {
            banks.push(self.engine.render(unit, quality)?);
        }
        let all: Vec<_> = banks.iter().collect();
        let fitted = page::fit(&all, self.tone(), page::BUDGET, footlight::work::Work::silent());
        let Ok((coded, size)) = fitted else {
            return Ok(json!({ "failed": "the pictures are too large for a page" }));
        };
        let pictures = coded.into_iter().map(Picture::inside).collect();
        let show = self.data(&banks, pictures, size);
        Ok(match show {
            Ok(show) => json!({ "show": show, "exposure": self.tone().exposure, "is_finest": quality == finest }),
            Err(error) => json!({ "failed": error.to_string() }),
        })
    }

    fn light(&mut self, seconds: f64) -> Result<Value, Error> {
        let time = footlight::units::Time::nearest(seconds);
        let image = self.engine.picture(time)?;
        let bytes: Vec<u8> = image.data().iter().flat_map(|v| v.to_le_bytes()).collect();
        Ok(json!({ "light": BASE64_STANDARD.encode(bytes) }))
    }
}

fn failed(error: Error) -> Value {
    json!({ "failed": error.to_string() })
}

/// A piece of a text, in units of UTF-16, with what it is.
#[derive(Serialize)]
struct Piece(usize, usize, &'static str);

/// Counts units of UTF-16 up to places that only go forward.
struct Units<'a> {
    text: &'a str,
    byte: usize,
    unit: usize,
}

impl Units<'_> {
    fn at(&mut self, byte: usize) -> usize {
        let passed = self.text.get(self.byte..byte).unwrap_or("");
        self.unit += passed.encode_utf16().count();
        self.byte = byte.max(self.byte);
        self.unit
    }
}

/// The byte of a place in units of UTF-16.
fn byte_of(text: &str, unit: usize) -> usize {
    let mut units = 0;
    let found = text.char_indices().find(|(_, c)| {
        let here = units;
        units += c.len_utf16();
        here >= unit
    });
    found.map_or(text.len(), |(byte, _)| byte)
}

fn pieces(text: &str, mut all: Vec<(Range<usize>, &'static str)>) -> Vec<Piece> {
    all.sort_by_key(|(range, _)| range.start);
    let mut units = Units { text, byte: 0, unit: 0 };
    let mut out: Vec<Piece> = Vec::new();
    for (range, kind) in all {
        // What overlaps is marked already.
        if range.start >= units.byte {
            out.push(Piece(units.at(range.start), units.at(range.end), kind));
        }
    }
    out
}

fn tokens(text: &str) -> Vec<Piece> {
    let kind = |token| match token {
        Token::Statement => "statement",
        Token::Word => "word",
        Token::Name => "name",
        Token::Quantity => "quantity",
        Token::Colour => "colour",
        Token::Text => "text",
        Token::Comment => "comment",
        Token::Mark => "mark",
    };
    let tokens = lang::tokens(text).into_iter();
    pieces(text, tokens.map(|(range, token)| (range, kind(token))).collect())
}

/// The places in the sheet itself that something is said about.
fn marks(said: &Diagnostics, text: &str) -> Vec<Piece> {
    let first = said.list.iter().filter_map(|diagnostic| {
        let label = diagnostic.labels.first().filter(|label| label.file == 0)?;
        let kind = match diagnostic.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        Some((label.span.clone(), kind))
    });
    pieces(text, first.collect())
}
