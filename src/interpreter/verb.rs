//! The verbs: one table for the REPL, the command line and the manual, and the parser of a typed
//! line.

use std::collections::BTreeMap;

use super::Error;
use crate::lang::nearest;

/// What can be done with a show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verb {
    /// Look for mistakes.
    Check,
    /// List what the show declares.
    Show,
    /// Move to a time and tell the levels there.
    At,
    /// Key settings, basis and predicted error.
    Plan,
    /// One picture.
    Picture,
    /// Render more refined pictures.
    Refine,
    /// Play the sequence.
    Play,
    /// Draw the banks' curves.
    Plot,
    /// The whole loop, with its results in a folder.
    Run,
    /// Hold every bank against its reference picture.
    Compare,
    /// Tell what each step of quality sets and costs.
    Quality,
    /// Draw measurements.
    Chart,
    /// Replay a design session and measure it.
    Session,
    /// What pictures there are, and freeing them.
    Pool,
    /// How refined pictures are chosen, and previews made of them.
    Method,
    /// Which view pictures are made from.
    View,
    /// Run the next cue.
    Go,
    /// Back to the cue before.
    Back,
    /// To a cue.
    Goto,
    /// Try levels.
    Set,
    /// Let go of levels that are tried.
    Release,
    /// Write what is tried as a cue.
    Record,
    /// Edits that are not kept yet.
    Blind,
    /// Take an edit back.
    Undo,
    /// Make it again.
    Redo,
    /// Cues by banks.
    Tracksheet,
    /// What each cue does.
    Cuesheet,
    /// The canonical layout.
    Fmt,
    /// What changed.
    Diff,
    /// What a code means.
    Explain,
    /// Write the show's text.
    Save,
    /// Explain the verbs.
    Help,
    /// Leave.
    Quit,
}

/// An option of a verb.
#[derive(Clone, Copy, Debug)]
pub struct OptionSpec {
    /// Its name after two dashes.
    pub name: &'static str,
    /// Its letter after one dash.
    pub letter: Option<char>,
    /// The name of its value; `None` for a switch.
    pub value: Option<&'static str>,
    /// What it does.
    pub about: &'static str,
}

/// A verb as the manual shows it.
#[derive(Clone, Copy, Debug)]
pub struct VerbSpec {
    /// The verb.
    pub verb: Verb,
    /// Its name.
    pub name: &'static str,
    /// What may stand first after it, on the command line before the show: one of these, unless
    /// there are none.
    pub kinds: &'static [&'static str],
    /// What stands after it without dashes; empty when nothing does.
    pub words: &'static str,
    /// Its options.
    pub options: &'static [OptionSpec],
    /// What it does, in a line.
    pub about: &'static str,
    /// A line that can be typed at the prompt.
    pub example: &'static str,
    /// Whether it is a command of its own on the command line.
    pub command: bool,
}

const fn value(name: &'static str, value: &'static str, about: &'static str) -> OptionSpec {
    OptionSpec {
        name,
        letter: None,
        value: Some(value),
        about,
    }
}

const fn output(about: &'static str) -> OptionSpec {
    OptionSpec {
        name: "output",
        letter: Some('o'),
        value: Some("FILE"),
        about,
    }
}

const JSON: OptionSpec = OptionSpec {
    name: "json",
    letter: None,
    value: None,
    about: "print data instead of words",
};

const SIGNED: OptionSpec = OptionSpec {
    name: "signed-keys",
    letter: None,
    value: None,
    about: "allow negative keys, which float playback can show, and spare the knots",
};

const METRIC: OptionSpec = value(
    "metric",
    "M",
    "what makes a picture worth refining: settings, influence or error (default: error)",
);

const PROJECTION: OptionSpec = value(
    "projection",
    "P",
    "how previews are made: settings, influence, full-error, error, extrapolated (default), \
     corrections",
);

const FLOAT: OptionSpec = OptionSpec {
    name: "float",
    letter: None,
    value: None,
    about: "an .exr in 32 bits a number (default: 16, the relative error 2^-11)",
};

const VIEW: OptionSpec = value("view", "NAME", "the view to look from (default: the first)");

const KEYS: OptionSpec = value(
    "keys",
    "F",
    "format of key images: f32, f16 or 8-bit (default: f16 where its error stays under half a \
     step of 8 bits, else f32)",
);

/// What can be charted.
const CHARTS: &[&str] = &["transport", "playback"];

const QUALITY: OptionSpec = value(
    "quality",
    "Q",
    "the step of the scale, 1 to 5 (default: that of the show's coarse pictures)",
);

const fn spec(
    verb: Verb,
    name: &'static str,
    words: &'static str,
    options: &'static [OptionSpec],
    about: &'static str,
    example: &'static str,
) -> VerbSpec {
    VerbSpec {
        verb,
        name,
        kinds: match verb {
            Verb::Chart => CHARTS,
            _ => &[],
        },
        words,
        options,
        about,
        example,
        command: !matches!(
            verb,
            Verb::Show
                | Verb::At
                | Verb::Refine
                | Verb::Method
                | Verb::View
                | Verb::Go
                | Verb::Back
                | Verb::Goto
                | Verb::Set
                | Verb::Release
                | Verb::Record
                | Verb::Blind
                | Verb::Undo
                | Verb::Redo
                | Verb::Fmt
                | Verb::Diff
                | Verb::Explain
                | Verb::Save
                | Verb::Help
                | Verb::Quit
        ),
    }
}

/// Every verb, in the order of the manual.
pub const VERBS: &[VerbSpec] = &[
    spec(
        Verb::Check,
        "check",
        "",
        &[],
        "look for mistakes in the show, its stage and its curves",
        "check",
    ),
    spec(
        Verb::Show,
        "show",
        "[NAME]",
        &[],
        "list banks and cues with their times, or the text that declares NAME",
        "show lamps",
    ),
    spec(
        Verb::At,
        "at",
        "[TIME]",
        &[],
        "move to a time and tell the levels there",
        "at 1:30",
    ),
    spec(
        Verb::Plan,
        "plan",
        "[N]",
        &[
            JSON,
            OptionSpec {
                name: "next",
                letter: None,
                value: None,
                about: "the next N pictures to refine (default: 5), their seconds and what they leave",
            },
            value(
                "tolerance",
                "X",
                "error allowed, such as 2% (default: the show's preview)",
            ),
            SIGNED,
            value(
                "metric",
                "M",
                "settings, influence or error; the last two render coarse pictures first",
            ),
        ],
        "key settings, basis, and the error predicted after each refined picture",
        "plan --tolerance 1%",
    ),
    spec(
        Verb::Picture,
        "picture",
        "[TIME]",
        &[
            value(
                "at",
                "TIME",
                "the moment (default: the current time, or the start)",
            ),
            value("bank", "NAME", "this bank alone, at full"),
            value(
                "quality",
                "Q",
                "render anew at this step of the scale, 1 to 5",
            ),
            VIEW,
            PROJECTION,
            FLOAT,
            output("write a .png (as displayed) or an .exr (linear)"),
        ],
        "one picture of the show",
        "picture 1:30 -o evening.png",
    ),
    spec(
        Verb::Refine,
        "refine",
        "[N | until X% | for TIME]",
        &[VIEW, METRIC, PROJECTION],
        "render refined pictures in the order of the plan, one if nothing is said",
        "refine until 2%",
    ),
    spec(
        Verb::Play,
        "play",
        "",
        &[
            VIEW,
            PROJECTION,
            KEYS,
            value(
                "layers",
                "WHAT",
                "layers of an .exr: keys (default), banks (each alone at full) or basis (the \
                 refined pictures)",
            ),
            FLOAT,
            value(
                "chroma",
                "C",
                "colour of a video: 420 (default) or 444, BT.709",
            ),
            output(
                "write a .png or .apng (animated), a .y4m or `-` (video, to standard output), a \
                 .html (a page that plays), an .exr (layers), or numbered pictures such as \
                 frames/####.png",
            ),
        ],
        "play the sequence back from its key images",
        "play -o show.png",
    ),
    spec(
        Verb::Plot,
        "plot",
        "",
        &[output("write a .png or an .svg")],
        "draw every bank's curve with the cues marked",
        "plot -o curves.svg",
    ),
    spec(
        Verb::Run,
        "run",
        "",
        &[
            value(
                "until",
                "X",
                "refine until this error, such as 2% (default: the show's preview)",
            ),
            value(
                "count",
                "N",
                "refine until there are N pictures, stored ones included",
            ),
            value("budget", "TIME", "stop refining when this time is used up"),
            VIEW,
            METRIC,
            PROJECTION,
            value(
                "out",
                "DIR",
                "where the results go (default: out/ and the show's file name)",
            ),
        ],
        "the whole loop: coarse pictures, plan, refinement, key images, sequence",
        "run --until 2%",
    ),
    spec(
        Verb::Compare,
        "compare",
        "",
        &[
            value(
                "reference",
                "DIR",
                "the folder of BANK.exr, or of the halves BANK_A.exr and BANK_B.exr",
            ),
            QUALITY,
            JSON,
            output("write the differences as a .png or an .svg"),
        ],
        "render every bank alone and hold it against its reference picture",
        "compare --reference refs --quality 4 -o differences.png",
    ),
    spec(
        Verb::Quality,
        "quality",
        "",
        &[
            JSON,
            OptionSpec {
                name: "measure",
                letter: None,
                value: None,
                about: "render at every step too, and tell the seconds it took",
            },
        ],
        "what each step of quality sets for this show, and how long it is likely to take",
        "quality --measure",
    ),
    spec(
        Verb::Chart,
        "chart",
        "",
        &[
            value(
                "reference",
                "DIR",
                "the folder of reference pictures (default: the finest step is the reference)",
            ),
            value(
                "where",
                "KEYS",
                "of playback, a picture of where keys of this format are off: f32, f16, 8-bit, or \
                 displayed (8 bits blended as displayed)",
            ),
            OptionSpec {
                name: "dark",
                letter: None,
                value: None,
                about: "light lines on a dark ground",
            },
            output("write a .png, an .svg, or the figures as .csv or .json"),
        ],
        "draw error against time: `transport` by step of quality, `playback` by format of keys",
        "chart transport -o transport.png",
    ),
    spec(
        Verb::Session,
        "session",
        "COMMANDS",
        &[
            OptionSpec {
                name: "truth",
                letter: None,
                value: None,
                about: "measure against every source at the refined quality, rendered beside",
            },
            METRIC,
            PROJECTION,
            output("write a .png or an .svg, or the data as .csv or .json"),
        ],
        "replay edits and `refine` lines from a file: error against time and refined pictures",
        "session session.txt --truth -o session.png",
    ),
    spec(
        Verb::Pool,
        "pool",
        "[drop [unused | all]]",
        &[],
        "tell what pictures there are and which serve this show, or free them",
        "pool drop unused",
    ),
    spec(
        Verb::Method,
        "method",
        "[metric M | projection P | default]",
        &[],
        "how refined pictures are chosen and previews made of them, from now on",
        "method projection settings",
    ),
    spec(
        Verb::View,
        "view",
        "[NAME]",
        &[],
        "list the views, or make pictures from NAME from now on",
        "view stalls",
    ),
    spec(
        Verb::Go,
        "go",
        "",
        &[],
        "run the next cue to its end and tell the levels then",
        "go",
    ),
    spec(
        Verb::Back,
        "back",
        "",
        &[],
        "back to the end of the cue before",
        "back",
    ),
    spec(
        Verb::Goto,
        "goto",
        "CUE [at PART%]",
        &[],
        "to the end of a cue, or to where a part of its time has gone by",
        "goto 2.5 at 50%",
    ),
    spec(
        Verb::Set,
        "set",
        "[LEVELS]",
        &[],
        "try levels on top of the current moment, without a cue",
        "set lamps 40 sky #203060",
    ),
    spec(
        Verb::Release,
        "release",
        "",
        &[],
        "let go of the levels that are tried",
        "release",
    ),
    spec(
        Verb::Record,
        "record",
        "[NUMBER [LABEL]]",
        &[value(
            "time",
            "TIME",
            "the new cue's time, such as 3 or 4/6",
        )],
        "write the levels that are tried as a new cue; alone: keep blind edits",
        "record 2.5 \"Lamp up\" --time 3",
    ),
    spec(
        Verb::Blind,
        "blind",
        "[off]",
        &[],
        "edits from now on are shown, but kept only by `record`; `off` drops them",
        "blind",
    ),
    spec(
        Verb::Undo,
        "undo",
        "",
        &[],
        "take the last edit back",
        "undo",
    ),
    spec(
        Verb::Redo,
        "redo",
        "",
        &[],
        "make the edit again that was taken back",
        "redo",
    ),
    spec(
        Verb::Tracksheet,
        "tracksheet",
        "",
        &[output("write a .md, .csv or .txt")],
        "cues by banks: the level each bank holds, moved, tracked and blocked told apart",
        "tracksheet -o tracks.csv",
    ),
    spec(
        Verb::Cuesheet,
        "cuesheet",
        "",
        &[output("write a .md, .csv or .txt")],
        "what each cue does, when it starts and how long it takes",
        "cuesheet -o cues.md",
    ),
    spec(
        Verb::Fmt,
        "fmt",
        "",
        &[OptionSpec {
            name: "check",
            letter: None,
            value: None,
            about: "only tell whether the layout is canonical",
        }],
        "lay the show's text out anew, comments and groups kept",
        "fmt",
    ),
    spec(
        Verb::Diff,
        "diff",
        "[FILE]",
        &[output("draw the changed curves as a .png or an .svg")],
        "what changed since the show was read or saved, or from FILE to it, in cues and in light",
        "diff -o changes.png",
    ),
    spec(
        Verb::Explain,
        "explain",
        "CODE",
        &[],
        "what a message's code means, with a wrong sheet and its correction",
        "explain E012",
    ),
    spec(
        Verb::Save,
        "save",
        "[FILE]",
        &[],
        "write the show's text, comments and layout kept",
        "save",
    ),
    spec(
        Verb::Help,
        "help",
        "[VERB]",
        &[],
        "list the verbs, or explain one",
        "help picture",
    ),
    spec(Verb::Quit, "quit", "", &[], "leave", "quit"),
];

/// A verb with what was said to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// The verb.
    pub verb: Verb,
    /// Options by name; a switch has the empty value.
    pub options: BTreeMap<String, String>,
    /// What stood after it without dashes.
    pub words: Vec<String>,
}

impl Call {
    /// A verb with nothing said to it.
    pub fn new(verb: Verb) -> Call {
        Call {
            verb,
            options: BTreeMap::new(),
            words: Vec::new(),
        }
    }

    /// The same with an option set.
    #[must_use]
    pub fn with(mut self, option: &str, value: &str) -> Call {
        self.options.insert(option.to_owned(), value.to_owned());
        self
    }

    /// An option's value.
    pub fn option(&self, name: &str) -> Option<&str> {
        self.options.get(name).map(String::as_str)
    }

    /// Reads a typed line.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown verb or option, a missing value or an open quote, with what
    /// could have been meant.
    pub fn parse(line: &str) -> Result<Call, Error> {
        let mut tokens = split(line)?.into_iter();
        let name = tokens.next().unwrap_or_default();
        let spec = find(&name)?;
        let mut call = Call::new(spec.verb);
        while let Some(token) = tokens.next() {
            let Some(option) = spec.option(&token)? else {
                call.words.push(token);
                continue;
            };
            let inline = token.split_once('=').map(|(_, v)| v.to_owned());
            let value = match (option.value, inline) {
                (None, _) => String::new(),
                (Some(_), Some(value)) => value,
                (Some(what), None) => tokens.next().ok_or_else(|| {
                    Error::Usage(format!("`{token}` needs a value {what}: {}", spec.usage()))
                })?,
            };
            call.options.insert(option.name.to_owned(), value);
        }
        Ok(call)
    }
}

/// The specification of a verb by its name.
///
/// # Errors
/// [`Error::Usage`] with the nearest verb when there is none of that name.
pub fn find(name: &str) -> Result<&'static VerbSpec, Error> {
    VERBS.iter().find(|v| v.name == name).ok_or_else(|| {
        let near = nearest(name, VERBS.iter().map(|v| v.name));
        let hint = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`help` lists the verbs".to_owned(),
        };
        Error::Usage(format!("there is no verb or declaration `{name}`; {hint}"))
    })
}

impl VerbSpec {
    /// The one-line usage.
    pub fn usage(&self) -> String {
        let mut out = self.name.to_owned();
        if !self.kinds.is_empty() {
            out = format!("{out} {}", self.kinds.join("|"));
        }
        if !self.words.is_empty() {
            out = format!("{out} {}", self.words);
        }
        for option in self.options {
            let name = match option.letter {
                Some(letter) => format!("-{letter}"),
                None => format!("--{}", option.name),
            };
            let value = option.value.map(|v| format!(" {v}")).unwrap_or_default();
            out = format!("{out} [{name}{value}]");
        }
        out
    }

    /// The option that a token names; `None` for a token that is no option.
    fn option(&self, token: &str) -> Result<Option<&OptionSpec>, Error> {
        let name = token.split('=').next().unwrap_or_default();
        let negative_number = name
            .strip_prefix('-')
            .is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        if !name.starts_with('-') || name == "-" || negative_number {
            return Ok(None);
        }
        let matches = |o: &&OptionSpec| {
            name.strip_prefix("--") == Some(o.name)
                || o.letter.is_some_and(|l| name == format!("-{l}"))
        };
        match self.options.iter().find(matches) {
            Some(option) => Ok(Some(option)),
            None => Err(Error::Usage(format!(
                "`{}` has no option `{name}`: {}",
                self.name,
                self.usage()
            ))),
        }
    }
}

/// Cuts a line into words; double quotes keep spaces together, and hold `\"` and `\\` as a show's
/// texts do.
fn split(line: &str) -> Result<Vec<String>, Error> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quoted = false;
    let mut chars = line.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '\\' if quoted && matches!(chars.peek(), Some('"' | '\\')) => {
                word.get_or_insert_default().extend(chars.next());
            }
            '"' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            c if c.is_whitespace() && !quoted => words.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    if quoted {
        return Err(Error::Usage("a quote is not closed".to_owned()));
    }
    words.extend(word);
    Ok(words)
}
