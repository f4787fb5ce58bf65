//! The formatter against random shows: every statement of the language, comments in odd places,
//! wide characters, tabs and both kinds of line end. The formatted text is the same show, keeps its
//! words, comments and groups, and is a fixed point.

use std::fmt::Write as _;

use proptest::prelude::*;

use super::super::format;
use crate::diagnostic::Sources;
use crate::lang;
use crate::model::{HeadAxis, Show};
use crate::timeline::Timeline;

/// A sequence of random choices. When it is used up, the plainest choice is made, so that a failure
/// shrinks to a small text.
struct Choices<'c> {
    left: std::slice::Iter<'c, u16>,
    text: String,
    comments: usize,
}

/// Kinds of gap between two words.
#[derive(Clone, Copy, PartialEq)]
enum Between {
    /// Any gap, including a line end.
    Any,
    /// A gap without a line end.
    Beside,
    /// No gap, or any gap.
    Near,
}

impl Choices<'_> {
    fn pick(&mut self, n: usize) -> usize {
        usize::from(*self.left.next().unwrap_or(&0)) % n
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.pick(100) >= 100 - percent
    }

    fn one<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.pick(of.len())]
    }

    /// Writes one of these, chosen at random.
    fn push(&mut self, of: &[&str]) {
        let one = self.one(of);
        self.text.push_str(one);
    }

    fn block_comment(&mut self, lines: bool) -> String {
        self.comments += 1;
        let n = self.comments;
        let plain = ["x", "照明 {", "\" }", "// no", "* / =", "", "\t|"];
        let inner = self.one(&plain);
        if lines && self.chance(20) {
            return format!("/* b{n}\n   {inner}\n*/");
        }
        format!("/*b{n} {inner}*/")
    }

    fn line_comment(&mut self) -> String {
        self.comments += 1;
        let n = self.comments;
        let inner = self.one(&["x", "照明 {", "\" }", "/* no", "é\t.  ", "///"]);
        format!("// l{n} {inner}\n")
    }

    fn blanks(&mut self) -> &'static str {
        self.one(&[" ", "  ", "\t", " \t ", "     "])
    }

    /// Writes the gap before a word.
    fn gap(&mut self, between: Between) {
        let mut out = String::new();
        let near = between == Between::Near && self.chance(50);
        if !near {
            out.push_str(self.blanks());
        }
        if between != Between::Near && self.chance(6) {
            out.push_str(&self.block_comment(between != Between::Beside));
            out.push_str(self.blanks());
        }
        let breaks = between != Between::Beside && self.chance(8);
        if breaks {
            if self.chance(25) {
                out.push_str(&self.line_comment());
            } else {
                out.push('\n');
            }
            while self.chance(20) {
                out.push_str(self.one(&["\n", " \n", "\t\n"]));
                if self.chance(30) {
                    let _ = write!(out, "  {}", self.line_comment());
                }
            }
            out.push_str(self.one(&["    ", "\t", "  ", "         "]));
        }
        self.text.push_str(&out);
    }

    fn words(&mut self, words: &[&str]) {
        for word in words {
            self.word(word, Between::Any);
        }
    }

    fn word(&mut self, word: &str, between: Between) {
        let between = match word {
            "," | "/" | "{" | "}" | "=" | "+" if between == Between::Any => Between::Near,
            _ => between,
        };
        if !self.text.is_empty() && !self.text.ends_with('\n') {
            self.gap(between);
        }
        self.text.push_str(word);
    }

    /// Writes words with gaps between them.
    fn say(&mut self, words: &str) {
        let words: Vec<&str> = words.split(' ').collect();
        self.words(&words);
    }

    /// Writes the gap between two statements.
    fn end(&mut self) {
        if self.chance(20) {
            self.push(&[" ", "", "\t"]);
            let comment = self.line_comment();
            self.text.push_str(&comment);
        } else {
            self.push(&["\n", " \n", "\t\n"]);
        }
        while self.chance(25) {
            self.push(&["\n", "  \n"]);
        }
        while self.chance(12) {
            let comment = if self.chance(30) {
                self.block_comment(true) + "\n"
            } else {
                self.line_comment()
            };
            self.text.push_str(&comment);
            while self.chance(25) {
                self.text.push('\n');
            }
        }
    }

    // ---- statements -------------------------------------------------------------------------

    fn number(&mut self, unit: &str) -> String {
        let n = self.pick(40) + 1;
        match self.pick(3) {
            0 => format!("{n}"),
            1 => format!("{n}.5"),
            _ => format!("{n}{unit}"),
        }
    }

    fn position(&mut self) {
        for i in 0..3 {
            let number = self.number("m");
            let sign = if self.chance(30) { "-" } else { "" };
            self.words(&[&format!("{sign}{number}")]);
            if i < 2 {
                self.words(&[","]);
            }
        }
    }

    fn rig(&mut self) {
        let title = self.one(&["show \"A\"", "show \"照 \\\"x\\\" // {\""]);
        let (word, text) = title.split_once(' ').unwrap();
        self.words(&[word, text]);
        self.end();
        if self.chance(40) {
            self.say("preview { tolerance 2% gap 5 rate 25 exposure auto tone plain coarse 1 refined 2 }");
            self.end();
        }
        if self.chance(40) {
            let option = self.one(&["", " z up", " one-sided", " one-sided z up matt"]);
            self.say(&format!("stage \"set.obj\"{option}"));
            self.end();
            let colour = self.one(&["#6B4a2f", "#fB6", "0.4", "0.1 0.2 0.3", "0.1 , 0.2 , 0.3"]);
            let gloss = self.one(&["", " gloss 0.2"]);
            self.say(&format!("surface boards reflectance {colour}{gloss}"));
            self.end();
        }
        let value = self.one(&["40", "2 * 20 + 5", "- ( 3 - 60 ) / 2", "40%", "full"]);
        self.say(&format!("let dim = {value}"));
        self.end();
        let value = self.one(&["12s", "( 1:30 - 6 ) / 2", "250ms"]);
        self.say(&format!("let slow = {value}"));
        self.end();
        self.solids();
        if self.chance(40) {
            let amount = self.one(&["60m", "0.05/m", "( 2 * 40 )", "200ft"]);
            let clauses = self.one(&["", " forward -0.5", " albedo 0.9 forward 0.6"]);
            self.say(&format!("haze {amount}{clauses}"));
            self.end();
        }
        if self.chance(40) {
            self.say("view stalls from");
            self.position();
            self.say("to 0 , 0 , 0 fov 28deg size 640x360");
            self.end();
        }
        self.lights();
        self.banks();
        self.looks();
    }

    fn solids(&mut self) {
        let solids = [
            "box from -2 , 1 , 0 to 2 , 3 , 0.4",
            "box inside from -4 , -4 , 0 to 4 , 4 , 3",
            "quad -3 , 4 , 0 3 , 4 , 0 3 , 4 , 5 -3 , 4 , 5 two-sided",
            "disc at 0 , 0 , 0.8 aim 0 , 0 , 2 radius 60cm",
            "cylinder from 0 , 0 , 0 to 0 , 0 , 0.79 radius 5cm sides 8",
        ];
        let mut name = 0;
        while self.chance(40) {
            name += 1;
            self.say(&format!("surface s{name} reflectance 0.5"));
            let solid = self.one(&solids);
            self.say(solid);
            self.end();
        }
    }

    fn lights(&mut self) {
        self.say("light l1 spot at");
        self.position();
        self.say("aim 0 , 0 , 0 beam 20 field 40deg");
        let rest = self.one(&[
            "1200   cd",
            "1200cd #FFb36b",
            "800 lm 2700 K",
            "900 cd 3200K",
        ]);
        self.clause(rest);
        // Any position is within reach of these.
        let ranges = self.one(&[
            "",
            " standing",
            " pan -200deg to 400",
            " zoom 3 to 90 speed 120",
        ]);
        self.say(&format!("moves tilt -180 to 180{ranges}"));
        self.end();
        self.say("point p = 30 , 40 , -50");
        self.end();
        self.say("light l2 like l1 at");
        self.position();
        self.end();
        let panel = self.one(&["glass", "\"sign.l\"", "glass 40 cd/m2 #abc"]);
        self.text.push_str("light l3 panel");
        self.clause(panel);
        self.end();
        let kind = self.one(&[
            "sphere at 0 , 0 , 3 radius 5cm 800 lm",
            "disc at 0 , 0 , 3 aim 0 , 0 , 0 radius 20cm 800 lm",
            "photometric \"d.ies\" at 0 , 0 , 3 aim 0 , 0 , 0 turn 90",
            "project \"c.png\" from 0 , -9 , 4 aim 0 , 3 , 2 field 50 9000 cd",
            "from \"Key\" 1200 cd",
        ]);
        self.say("light 照");
        self.clause(kind);
        self.end();
    }

    /// Writes words of which a photometric unit stays on its number's line.
    fn clause(&mut self, words: &str) {
        for word in words.split(' ').filter(|w| !w.is_empty()) {
            if matches!(word, "cd" | "lm" | "K" | "cd/m2") {
                self.push(&[" ", "", "   "]);
                self.text.push_str(word);
            } else {
                self.words(&[word]);
            }
        }
    }

    fn banks(&mut self) {
        let options = self.one(&["", " channel 1", " dimmer dawn channel 7"]);
        self.say(&format!("bank a = l1{options}"));
        self.end();
        self.say("bank lamps = l2 l3");
        self.end();
        let rgb = self.one(&["rgb", "rgb channel 3", "channel 3 rgb dimmer square"]);
        self.say(&format!("bank 天 = 照 {rgb}"));
        self.end();
        if self.chance(30) {
            let image = self.one(&["", " layer \"x y\""]);
            let image = format!("image \"f .exr\"{image}");
            self.text.push_str("bank pic ");
            // A text is one word, blanks in it or not.
            self.text.push_str(&image);
            self.say("channel 9");
            self.end();
            self.text.push_str("fixed exits image \"g.png\"");
            self.say("level 10%");
            self.end();
        }
        self.say("group ab = a lamps");
        self.end();
    }

    fn looks(&mut self) {
        self.say("look night { a 10 lamps to 4% 天 #203060 }");
        self.end();
        self.say("look late = night + { lamps out } + { a full }");
        self.end();
        let knots = self.one(&[
            "spline 0 0 , 0.4 8 , 1 100",
            "linear 0 0 , 1 100%",
            "hermite 0 0 slope 0 , 1 100 slope 0",
            "bezier 0 0 via 10 60 , 1 100",
        ]);
        self.say(&format!("curve dawn = {knots}"));
        self.end();
        if self.chance(30) {
            let time = self.one(&["4", "4 / 3", "1:30", "250ms"]);
            self.say(&format!("default time {time}"));
            self.end();
        }
    }

    // ---- cues -------------------------------------------------------------------------------

    fn cues(&mut self) {
        let count = self.pick(4) + 1;
        let mut linked = false;
        for i in 1..=count {
            let number = format!("{i}{}", self.one(&["", ".5", ".25"]));
            self.text.push_str("cue");
            self.words(&[&number]);
            if self.chance(50) {
                let label = self.one(&["\"Go\"", "\"照明 // {\"", "\"a \\\" b\""]);
                self.words(&[label]);
            }
            if !linked && self.chance(40) {
                self.words(&["at", &format!("{i}:00")]);
            }
            linked = i < count && self.chance(30);
            self.cue(linked);
            self.end();
        }
    }

    fn cue(&mut self, linked: bool) {
        self.words(&["{"]);
        if self.chance(12) {
            self.words(&["blackout"]);
        } else {
            self.timing(Between::Any);
            let parts = self.chance(40);
            self.moves(&["a", "lamps"][..if parts { 1 } else { 2 }]);
            if parts {
                self.say("part 2");
                if self.chance(50) {
                    self.words(&["\"slow 照\""]);
                }
                self.words(&["{"]);
                self.timing(Between::Any);
                self.moves(&["lamps"]);
                self.words(&["}"]);
            }
            if self.chance(30) {
                let sky = self.one(&["#20A0ff", "to 3200K", "#fff"]);
                self.text.push('\n');
                self.say(&format!("  天 {sky}"));
            }
        }
        if linked {
            let link = self.one(&["follow 3", "hang -1.5"]);
            self.say(link);
        }
        if self.chance(15) {
            let flag = self.one(&["block", "assert", "cueonly"]);
            self.words(&[flag]);
        }
        self.words(&["}"]);
    }

    /// Writes timing: of the cue at its start, of a move when it follows one.
    fn timing(&mut self, first: Between) {
        let mut between = first;
        let one = self.one(&[
            "",
            "time 5",
            "time 4/3",
            "up 6 down 250ms",
            "snap",
            "time ( slow + 2 )",
        ]);
        let two = self.one(&["", "delay 2"]);
        let three = self.one(&["", "curve dawn", "curve slow-top"]);
        for clause in [one, two, three] {
            for word in clause.split(' ').filter(|w| !w.is_empty()) {
                self.word(word, between);
                between = if first == Between::Beside {
                    first
                } else {
                    Between::Any
                };
            }
        }
    }

    fn moves(&mut self, banks: &[&str]) {
        for bank in banks {
            // A move may follow timing of the cue on one line, but timing after a move belongs to
            // the move.
            self.words(&[bank]);
            match self.pick(13) {
                0 => self.words(&["85"]),
                6 => self.say("( dim )"),
                7 => self.say("to ( 2 * dim / 2 )"),
                1 => self.say("to 40%"),
                2 => self.words(&["full"]),
                3 => {
                    let kind =
                        self.one(&["spline", "linear", "steps", "natural", "spline clamped"]);
                    self.say(&format!("{kind} 0s 30 , 3s 55 , 4.5s 20"));
                    if self.chance(30) {
                        self.word("repeat", Between::Beside);
                        self.words(&["3"]);
                    }
                }
                8 => self.say("to p"),
                9 => self.say("80 to p beam 21"),
                10 => self.say("full to -20 , 2m , ( 2 * 3m )"),
                11 => self.say("pan 30 tilt -20deg beam 21"),
                12 => self.say("to 1 , 2 , 90 field 38 beam 19"),
                4 => self.say("hermite 0s 0 slope 0 , 4s 80 slope 10"),
                _ => self.say("bezier 0s 0 via 10 60 , 4s 80"),
            }
            if self.chance(30) && !self.text.ends_with('3') {
                self.timing(Between::Beside);
            }
        }
    }
}

fn text([rig, cues, rest]: [&[u16]; 3]) -> String {
    let mut c = Choices {
        left: rig.iter(),
        text: String::new(),
        comments: 0,
    };
    if c.chance(30) {
        let comment = c.line_comment();
        c.text.push_str(&comment);
    }
    c.rig();
    c.left = cues.iter();
    c.cues();
    c.left = rest.iter();
    let windows = c.chance(20);
    let unended = c.chance(20);
    let mut text = c.text;
    if unended {
        text.truncate(text.trim_end().len());
    }
    if windows {
        text.replace('\n', "\r\n")
    } else {
        text
    }
}

fn show(text: &str) -> Show {
    let mut sources = Sources::default();
    let parsed = lang::parse(&mut sources, "a.lxq", text);
    let style = crate::diagnostic::Style::Plain;
    let said = || crate::diagnostic::render(&parsed.diagnostics, &sources, style);
    parsed
        .show
        .clone()
        .unwrap_or_else(|| panic!("{}\n{text}", said()))
}

/// A word, or a comment; the flag is true when an empty line precedes.
#[derive(Clone, Debug, PartialEq)]
enum Token {
    Word(String, bool),
    Comment(String, bool),
}

/// Words without regard to case, comments to the letter. Each is marked when it begins a group: an
/// empty line precedes it, and it is next to no brace.
fn tokens(text: &str) -> Vec<Token> {
    let text = text.replace("\r\n", "\n");
    let (mut out, mut rest, mut lines) = (Vec::new(), text.as_str(), 0);
    while let Some(c) = rest.chars().next() {
        if c.is_whitespace() {
            lines += usize::from(c == '\n');
            rest = &rest[c.len_utf8()..];
            continue;
        }
        let apart = std::mem::take(&mut lines) > 1;
        let length = match c {
            _ if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            _ if rest.starts_with("/*") => rest.find("*/").unwrap() + 2,
            '"' => {
                let mut escaped = false;
                let end = rest[1..].find(|c| {
                    let ends = c == '"' && !escaped;
                    escaped = c == '\\' && !escaped;
                    ends
                });
                end.unwrap() + 2
            }
            '{' | '}' | ',' | '/' | '=' | '+' => 1,
            _ => {
                let ends = |c: char| c.is_whitespace() || "{},/=+\"".contains(c);
                rest[c.len_utf8()..]
                    .find(ends)
                    .map_or(rest.len(), |n| n + c.len_utf8())
            }
        };
        let (word, after) = rest.split_at(length.max(c.len_utf8()));
        rest = after;
        out.push(match word.starts_with("//") || word.starts_with("/*") {
            true => Token::Comment(word.trim_end().to_owned(), apart),
            false => Token::Word(word.to_lowercase(), apart),
        });
    }
    out
}

fn comments(tokens: &[Token]) -> Vec<&str> {
    let each = tokens.iter();
    each.filter_map(|token| match token {
        Token::Comment(text, _) => Some(text.as_str()),
        Token::Word(..) => None,
    })
    .collect()
}

/// The words without gaps: the formatter decides on blanks inside a quantity.
fn words(tokens: &[Token]) -> String {
    let word = |t: &Token| match t {
        Token::Word(text, _) => Some(text.clone()),
        Token::Comment(..) => None,
    };
    tokens.iter().filter_map(word).collect()
}

/// The first words of statements, each marked when it or the comments right before it begin a
/// group.
fn groups(tokens: &[Token]) -> Vec<(String, bool)> {
    let (mut out, mut depth, mut apart) = (Vec::new(), 0, false);
    for token in tokens {
        match token {
            Token::Comment(_, blank) => apart |= *blank,
            Token::Word(word, blank) => {
                apart |= *blank;
                let begins = lang::keywords().contains(&word.as_str()) && depth == 0;
                if begins {
                    out.push((word.clone(), apart && !out.is_empty()));
                }
                depth += i32::from(word == "{") - i32::from(word == "}");
                apart = false;
            }
        }
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 200,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn generated_shows_keep_their_meaning(
        rig in prop::collection::vec(any::<u16>(), 0..1000),
        cues in prop::collection::vec(any::<u16>(), 0..2000),
        rest in prop::collection::vec(any::<u16>(), 2),
    ) {
        let text = text([&rig, &cues, &rest]);
        let was = show(&text);
        if let Ok(timeline) = Timeline::new(&was) {
            for (index, (_, head, _)) in was.heads().into_iter().enumerate() {
                for time in timeline.pose_knots(index) {
                    let pose = timeline.pose(index, time);
                    for axis in HeadAxis::ALL {
                        let [low, high] = head.range(axis);
                        let within = low - 1e-6..=high + 1e-6;
                        prop_assert!(within.contains(&pose.angle(axis)), "{:?}", pose);
                    }
                    prop_assert!(pose.beam < pose.field, "{:?}", pose);
                }
            }
        }
        let once = format(&text).unwrap();
        prop_assert_eq!(&show(&once), &was, "another show:\n{}\n---\n{}", text, once);
        let twice = format(&once).unwrap();
        prop_assert_eq!(&twice, &once, "not idempotent:\n{}", text);
        let (before, after) = (tokens(&text), tokens(&once));
        prop_assert_eq!(comments(&before), comments(&after), "{}\n---\n{}", text, once);
        prop_assert_eq!(words(&before), words(&after), "{}\n---\n{}", text, once);
        prop_assert_eq!(groups(&before), groups(&after), "{}\n---\n{}", text, once);
        let lines = once.lines().map(|l| l.trim_end_matches('\r'));
        let ragged = lines.filter(|l| l.ends_with([' ', '\t'])).count();
        prop_assert!(ragged == 0 || text.contains("/*"), "blanks at a line's end:\n{}", once);
    }
}
