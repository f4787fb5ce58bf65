//! Reads statements from a text: cuts it, parses each, and finds more than one error in a
//! statement.

use std::collections::BTreeMap;
use std::ops::Range;

use super::ast::{Span, Statement, Word};
use super::build::Builder;
use super::names::{self, Kind, STANDING_OFF, nearest};
use super::report::{Place, Report};
use super::scan::{Cut, Fault, STATEMENTS, Scan, first_word, scan, split_word};
use super::syntax::{self, Failure, Rule};
use super::{codes, limits};
use crate::diagnostic::Diagnostic;
use crate::model::HeadAxis;
use crate::units::Rgb;

/// The statements read.
#[derive(Debug, Default)]
pub struct Read<'a> {
    /// Statements that parsed, if need be without their faulty lines.
    pub statements: Vec<Statement<'a>>,
    /// Names whose declarations did not parse.
    pub broken: Vec<(Kind, Word<'a>)>,
    /// True when a cue did not parse, so that the order of cues cannot be checked.
    pub cue_lost: bool,
    /// True when an included file was not read, so that the names in it are unknown.
    pub names_lost: bool,
    /// Colours of gels by number.
    pub gels: BTreeMap<String, Rgb>,
}

/// Reads all statements of a file.
pub fn read<'a>(text: &'a str, file: u32, scan: &Scan<'a>, report: &mut Report) -> Read<'a> {
    let mut reader = Reader {
        text,
        file,
        report,
        out: Read::default(),
    };
    for fault in &scan.faults {
        reader.fault(fault);
    }
    for cut in &scan.cuts {
        if reader.report.full() {
            break;
        }
        reader.statement(cut);
    }
    reader.out
}

/// Reads typed declarations as file 0. Returns their scan, the statements, and the report, which
/// has no errors.
///
/// # Errors
/// Diagnostics when the text is too large or does not parse.
pub fn typed(text: &str) -> Result<(Scan<'_>, Read<'_>, Report), Vec<Diagnostic>> {
    if text.len() > limits::STATEMENT {
        let message = format!("more than {} bytes at once", limits::STATEMENT);
        return Err(vec![Diagnostic::error(codes::TOO_LARGE, message)]);
    }
    let mut report = Report::default();
    let scan = scan(text);
    let read = read(text, 0, &scan, &mut report);
    if report.failed() {
        return Err(report.finish().0);
    }
    Ok((scan, read, report))
}

struct Reader<'a, 'r> {
    text: &'a str,
    file: u32,
    report: &'r mut Report,
    out: Read<'a>,
}

impl<'a> Reader<'a, '_> {
    fn span(&self, start: usize, end: usize) -> Span {
        Span {
            file: self.file,
            start: start as u32,
            end: end as u32,
        }
    }

    fn fault(&mut self, fault: &Fault) {
        let one = |at: usize| (at, at + 1);
        let (code, message, (start, end), label, help) = match fault {
            Fault::Unclosed(at, _) => (
                codes::UNCLOSED,
                "this brace is never closed".to_owned(),
                one(*at),
                "opened here",
                "add `}` where the statement ends",
            ),
            Fault::Stray(at) => (
                codes::STRAY_BRACE,
                "this brace closes nothing".to_owned(),
                one(*at),
                "no `{` before it",
                "remove it, or look for a brace too many above",
            ),
            Fault::Text(span) => (
                codes::UNCLOSED,
                "this text is never closed".to_owned(),
                (span.start, span.end),
                "opened here",
                "add `\"` on the same line; a quote inside a text is written `\\\"`",
            ),
            Fault::Comment(at) => (
                codes::UNCLOSED,
                "this comment is never closed".to_owned(),
                (*at, at + 2),
                "opened here",
                "add `*/`, or begin each line with `//`",
            ),
            Fault::Deep(at) => (
                codes::TOO_LARGE,
                format!("brackets nest deeper than {}", limits::DEPTH),
                one(*at),
                "too deep",
                "a cue holds parts, and nothing nests deeper; the rest of the file was not read",
            ),
            Fault::Long(span) => (
                codes::TOO_LARGE,
                format!(
                    "a statement of {} bytes: {} is the most",
                    span.len(),
                    limits::STATEMENT
                ),
                (span.start, span.start),
                "begins here",
                "is a line break or a brace missing?",
            ),
            Fault::Many(at) => (
                codes::TOO_LARGE,
                format!("more than {} statements", limits::STATEMENTS),
                one(*at),
                "too many",
                "the rest of the file was not read",
            ),
        };
        let mut diagnostic = Diagnostic::error(code, message).place(self.span(start, end), label);
        if let Fault::Unclosed(_, Some(next)) = fault {
            let word = self.text.get(*next..).map_or("", first_word);
            let span = self.span(*next, next + word.len());
            diagnostic = diagnostic.place(span, "the next statement begins here");
        }
        self.report.add(diagnostic.help(help));
    }

    fn statement(&mut self, cut: &Cut<'a>) {
        let text = cut.text;
        let word = first_word(text);
        let Some(rule) = syntax::rule_of(word) else {
            if !cut.broken {
                self.unknown(cut.span.start, text, word);
            }
            return;
        };
        let parsed = if cut.broken {
            None
        } else {
            self.parse(rule, text, cut.span.start)
        };
        match parsed {
            Some(statement) => self.out.statements.push(statement),
            None => self.broken(word, text, cut.span.start),
        }
    }

    fn unknown(&mut self, start: usize, text: &str, word: &str) {
        let shown: String = if word.is_empty() {
            text.chars().take(1).collect()
        } else {
            word.to_owned()
        };
        let span = self.span(start, start + shown.len());
        let small = word.to_ascii_lowercase();
        let help = match nearest(&small, STATEMENTS.into_iter()) {
            _ if STATEMENTS.contains(&small.as_str()) => format!("did you mean `{small}`?"),
            _ if shown == "#" => "a comment begins with `//`".to_owned(),
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("a statement begins with one of: {}", STATEMENTS.join(", ")),
        };
        let shown: String = shown.chars().take(40).collect();
        let message = format!("no statement begins with `{shown}`");
        self.report.error::<()>(
            codes::UNKNOWN_STATEMENT,
            message,
            (span, "not a statement"),
            help,
        );
    }

    /// Declares the name of a statement that did not parse, so that its uses are not reported.
    fn broken(&mut self, word: &str, text: &'a str, start: usize) {
        self.out.cue_lost |= word == "cue";
        self.out.names_lost |= matches!(word, "include" | "gels");
        let Some(kind) = Kind::of_statement(word) else {
            return;
        };
        let (_, rest) = split_word(text);
        let name = rest.trim_start();
        let at = start + text.len() - name.len();
        let name = first_word(name);
        if !name.is_empty() {
            let span = self.span(at, at + name.len());
            self.out.broken.push((kind, Word { text: name, span }));
        }
    }

    /// Parses a statement. After an error inside braces, parses it again without the line of the
    /// error, to find the next one.
    fn parse(&mut self, rule: Rule, text: &'a str, base: usize) -> Option<Statement<'a>> {
        let builder = Builder {
            source: self.text,
            file: self.file,
            base,
        };
        let first = match syntax::parse(rule, text) {
            Ok(pairs) => return builder.statement(pairs),
            Err(failure) => failure,
        };
        self.failure(&first, text, base);
        let mut copy = text.to_owned();
        let mut failure = first;
        for _ in 0..limits::RETRIES {
            copy = without_line(&copy, &failure)?;
            match syntax::parse(rule, &copy) {
                Ok(pairs) => return builder.statement(pairs),
                Err(next) => failure = next,
            }
            self.failure(&failure, text, base);
        }
        None
    }

    fn failure(&mut self, failure: &Failure, text: &str, base: usize) {
        let rest = text.get(failure.at..).unwrap_or("");
        let word = first_word(rest);
        let ends = |c: char| c.is_whitespace() || matches!(c, ',' | '{' | '}');
        let mut buffer = [0; 4];
        let found: &str = match rest.chars().next() {
            None => "",
            Some(_) if !word.is_empty() => word,
            Some(c) if c.is_ascii_digit() || c == '-' || c == '#' => {
                rest.split_once(ends).map_or(rest, |(found, _)| found)
            }
            Some(c) => c.encode_utf8(&mut buffer),
        };
        let shown: String = found.chars().take(40).collect();
        let what = if found.is_empty() {
            "the end of the statement".to_owned()
        } else {
            format!("`{shown}`")
        };
        let message = match failure.expected.as_slice() {
            [] => format!("{what} does not fit here"),
            [only] => format!("expected {only}, found {what}"),
            [most @ .., last] => format!("expected {} or {last}, found {what}", most.join(", ")),
        };
        let (start, end) = if found.is_empty() {
            // After the last text, where something is missing.
            let end = base + text.len();
            (end, end)
        } else {
            (base + failure.at, base + failure.at + found.len())
        };
        let before = text.get(..failure.at).unwrap_or("");
        let (range, meant) = mistaken(before, found).unzip();
        let span = match range {
            Some(range) => self.span(base + range.start, base + range.end),
            None => self.span(start, end),
        };
        let mut diagnostic = Diagnostic::error(codes::SYNTAX, message).place(span, "not expected");
        let behind = unfinished(before).filter(|_| !found.is_empty() && !failure.between_items);
        if let Some(word) = behind {
            let span = self.span(base + word.start, base + word.end);
            diagnostic = diagnostic.place(span, "it is missing behind this");
        }
        let meant = meant.map(|meant| format!("did you mean `{meant}`?"));
        if let Some(help) = meant.or_else(|| advice(failure, before, found, word)) {
            diagnostic = diagnostic.help(help);
        }
        self.report.add(diagnostic);
    }
}

/// True for a word that could be the name of a value.
fn is_name(word: &str) -> bool {
    !word.is_empty() && !syntax::is_inner_word(word) && !STATEMENTS.contains(&word)
}

/// Bytes of a statement parsed again for a suggestion.
const LONG: usize = 1 << 14;

/// The keyword that `word` probably stands for and that `behind` may follow.
fn meant(before: &str, word: &str, behind: &str) -> Option<&'static str> {
    let short = Some(before).filter(|before| before.len() <= LONG);
    let rule = syntax::rule_of(first_word(short?))?;
    let fits = |near: &&str| {
        // No rule takes the last character, so that parsing stops there at the latest.
        let text = format!("{before}{near} {behind}");
        let stop = syntax::stop(rule, &format!("{text}\u{1}"));
        stop.is_some_and(|(at, _)| at >= text.trim_end().len())
    };
    let is_near = |near: &&str| nearest(word, std::iter::once(*near)).is_some();
    nearest(
        word,
        syntax::inner_words().filter(|near| is_near(near) && fits(near)),
    )
}

/// The fault before `found` and its correction: a number with a detached unit, or a keyword taken
/// for a name.
fn mistaken(before: &str, found: &str) -> Option<(Range<usize>, String)> {
    let written = before.trim_end();
    let word = written.rsplit([' ', '\t', '\n', '{', '}', ',']).next()?;
    let start = written.len() - word.len();
    if syntax::UNIT_WORDS.contains(&found) && word.ends_with(is_digit) {
        return Some((start..before.len() + found.len(), format!("{word}{found}")));
    }
    let word = Some(word).filter(|word| is_name(word) && !found.is_empty())?;
    let meant = meant(before.get(..start)?, word, found)?;
    Some((start..written.len(), meant.to_owned()))
}

/// The last word of the line before, when the error is first on its line: something is missing
/// there. `None` after a comment.
fn unfinished(before: &str) -> Option<Range<usize>> {
    let end = before.trim_end().len();
    let (written, blanks) = before.split_at_checked(end)?;
    let line = written.rsplit_once('\n').map_or(written, |(_, line)| line);
    if !blanks.contains('\n') || line.contains("//") || line.contains("*/") {
        return None;
    }
    let word = line
        .rsplit_once(char::is_whitespace)
        .map_or(line, |(_, word)| word);
    Some(end - word.len()..end)
}

/// Advice for words of other programs and of data sheets, by statement.
fn foreign(before: &str, found: &str, word: &str) -> Option<String> {
    let mut words = before.split_whitespace();
    let statement = words.next()?;
    let last = words.next_back().unwrap_or_default();
    let lower = word.to_ascii_lowercase();
    let in_braces = before.contains('{');
    let number = last.trim_end_matches(|c: char| !c.is_ascii_digit());
    Some(match (statement, lower.as_str()) {
        _ if found == "°" => format!("degrees are written `{number}` or `{number}deg`"),
        _ if found == "\'" && before.ends_with(is_digit) && is_timed(before) => {
            format!("minutes and seconds are written `{number}:30`")
        }
        ("light", "w" | "watt" | "watts" | "kw" | "lux" | "lx") => {
            "a lamp's light is in `cd` along its axis or in `lm` in all: the data sheet has them"
                .to_owned()
        }
        ("light", "fresnel" | "profile" | "ellipsoidal" | "par" | "pc" | "wash" | "led") => format!(
            "name a common lantern, `lantern \"profile 26\"  at 0, -2, 4  aim 0, 0, 1`, or use `spot` with its beam \
             and field: `spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd`; `{lower}` is no kind of light here"
        ),
        ("light", "gobo") => names::foreign(&lower)?.to_owned(),
        (of, _) if (of == "light" || in_braces) && names::is_gel(word) => {
            format!("a gel is written `gel {word}`")
        }
        ("effect", "chase") => {
            "a chase is a `pulse` that is spread over a group: `effect wave = pulse  depth 100%`, and in a \
             cue `units 60 effect wave spread`"
                .to_owned()
        }
        ("effect", "phase" | "offset") => {
            "banks out of step share an effect in a cue: `units 60 effect wave spread`".to_owned()
        }
        (_, "cue" | "bank" | "light" | "look" | "group" | "view" | "show" | "stage")
            if !in_braces || before.matches('{').count() == before.matches('}').count() =>
        {
            "begin each statement on a line of its own".to_owned()
        }
        ("cue", "cue") if in_braces => {
            "cues run in the order of their numbers; no cue jumps to another".to_owned()
        }
        ("cue", _) if in_braces && found == "," && before.contains(" aim ") => {
            "only a moving head turns in a cue: write `moves` behind its light, and `lamp1 to 0, 3, 1` here".to_owned()
        }
        ("cue", _) if in_braces && found == "@" => {
            format!("a level stands right behind its bank: `{last} 50`")
        }
        ("cue", "full" | "out") if last == "at" => {
            let bank = words.next_back().unwrap_or("lamps");
            format!("a level stands right behind its bank: `{bank} {lower}`")
        }
        ("cue", _) if !in_braces && is_lettered(word) => {
            let digits: String = format!("{last}{found}").chars().filter(char::is_ascii_digit).collect();
            if digits.is_empty() { return None } else { format!(
                "a cue's number has no letters: `cue {digits}`, and between two `cue {digits}.1`"
            ) }
        }
        _ => return None,
    })
}

/// True for a letter, alone or with a number: `A`, `Q5`.
fn is_lettered(word: &str) -> bool {
    let rest = word.strip_prefix(|c: char| c.is_ascii_alphabetic());
    rest.is_some_and(|rest| rest.bytes().all(|b| b.is_ascii_digit()))
}

/// True when the last word is a number of seconds.
fn is_timed(before: &str) -> bool {
    let word = before.split_whitespace().rev().nth(1);
    matches!(
        word,
        Some("time" | "up" | "down" | "delay" | "follow" | "hang" | "at" | "gap")
    )
}

/// Advice on `found`, whose first word is `word`, after the text `before`.
fn advice(failure: &Failure, before: &str, found: &str, word: &str) -> Option<String> {
    if let Some(help) = foreign(before, found, word) {
        return Some(help);
    }
    let cue = before.trim_end();
    if found.is_empty() && cue.starts_with("cue ") && cue.ends_with(is_digit) {
        return Some(format!(
            "what it does stands in braces: `{cue} {{ lamps 85 }}`; at the prompt `show {cue}` prints it"
        ));
    }
    let value = || format!("a value of the show stands in round brackets: `({word})`");
    let only = |what: &str| matches!(failure.expected.as_slice(), [one] if *one == what);
    if cue.ends_with(" at") && cue.contains('{') && is_name(word) {
        return Some(format!("a head points with `to`: `to {word}`"));
    }
    if HeadAxis::ALL
        .iter()
        .any(|axis| cue.ends_with(&format!(" {} +", axis.word())))
    {
        return Some("an angle is where the head turns to, not by how far: `pan 10`".to_owned());
    }
    if only(syntax::NUMBER) && is_name(word) {
        return Some(value());
    }
    let near = meant(before, word, "").or_else(|| nearest(word, syntax::inner_words()));
    if let Some(near) = near {
        return Some(format!("did you mean `{near}`?"));
    }
    if let Some(help) = misplaced(failure, word) {
        return Some(help.to_owned());
    }
    if failure.wants_quantity && is_name(word) {
        return Some(value());
    }
    if let Some(help) = place_without_word(before, found) {
        return Some(help);
    }
    let unit = unit_apart(before).filter(|_| found.starts_with(is_digit));
    if let Some(unit) = unit {
        return Some(format!(
            "`{unit}` is the unit of the number before it, and no name"
        ));
    }
    let image = before.trim_end().ends_with("image") && before.contains('=');
    let help = match found.chars().next()? {
        '\'' | '’' | '"' if before.ends_with(is_digit) => "feet are written `7ft`, inches `6in`",
        '“' | '”' | '„' | '‘' | '’' | '\'' => {
            "write texts in straight double quotes: \"Evening\""
        }
        c if c.is_whitespace() => "this is no ordinary space: delete it and type it again",
        '"' if image => "an image stands without `=`: `bank front image \"front.exr\"`",
        '"' if only("a name") => "a name stands without quotes",
        '#' if found == "#" => "a comment begins with `//`",
        ',' if failure.between_items => "what a cue does stands side by side, without commas",
        ',' | '+' if failure.expected.contains(&"a name") => {
            "names stand side by side: `bank lamps = lamp1 lamp2`"
        }
        ',' => "commas stand in positions and between knots; all else stands side by side",
        '=' => "only declarations have `=`: write `time 4` or `lamps 85`",
        _ if matches!(failure.expected.as_slice(), ["`,`"]) => {
            "a position is three lengths with commas: `0, -2.5, 3`"
        }
        _ => return None,
    };
    Some(help.to_owned())
}

/// Advice on a position right after a name, or after a keyword of another statement.
fn place_without_word(before: &str, found: &str) -> Option<String> {
    let mut words = before.split_whitespace();
    let statement = words.next()?;
    let mut last = words.next_back()?;
    if statement == "light" && found == "to" {
        return Some(
            "a light looks by `aim`: `spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd`"
                .to_owned(),
        );
    }
    let is_place = |word: &str| word.starts_with(|c: char| is_digit(c) || c == '-' || c == '.');
    // The first number of a position may have been taken for a strength.
    if found == "," && is_place(last) {
        last = words.next_back()?;
    } else if !is_place(found) {
        return None;
    }
    let example = match last {
        "box" => "box from -1, 0, 0  to 1, 1, 0.4",
        "cylinder" => "cylinder from 2, 2, 0  to 2, 2, 3  radius 20cm",
        "disc" => "disc at 0, 0, 0.8  aim 0, 0, 2  radius 60cm",
        "sphere" => "sphere at 2, 2, 1  radius 40cm",
        "spot" => "spot at 0, -2, 4  aim 0, 0, 1  beam 24  field 40  1200 cd",
        // The last word is its name.
        _ if statement == "view" && words.next().is_none() => {
            return Some(format!(
                "places have words before them: `view {last} from 0, -14, 1.7  to 0, 0, 2.2  fov 28`"
            ));
        }
        _ => return None,
    };
    Some(format!("places have words before them: `{example}`"))
}

fn is_digit(c: char) -> bool {
    c.is_ascii_digit()
}

/// Advice on a keyword in the wrong place.
fn misplaced(failure: &Failure, word: &str) -> Option<&'static str> {
    const TIMING: [&str; 8] = [
        "time", "up", "down", "delay", "snap", "follow", "hang", "repeat",
    ];
    let expects = |what: &str| failure.expected.contains(&what);
    let outside = expects("`{`") || expects(syntax::END);
    match word {
        "out" | "full" if failure.between_items => {
            Some("it stands behind a bank: `lamps out`; everything out is `blackout`")
        }
        // A cue's header, or what follows its closing brace.
        _ if TIMING.contains(&word) && outside => {
            Some("timing stands between the braces: `cue 3 { time 5  lamps 85 }`")
        }
        _ => None,
    }
}

/// The unit at the end of `before`, if it is one that a blank may separate from its number.
fn unit_apart(before: &str) -> Option<&'static str> {
    let mut words = before.split_whitespace().rev();
    let last = words.next()?;
    let unit = STANDING_OFF.into_iter().find(|unit| *unit == last)?;
    words.next()?.ends_with(is_digit).then_some(unit)
}

/// The text with the line of the error blanked out, of equal length; `None` when that would
/// unbalance braces.
fn without_line(text: &str, failure: &Failure) -> Option<String> {
    let before = text.get(..failure.at)?;
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    let first_on_line = text.get(line_start..failure.at)?.trim().is_empty();
    // Something missing at the start of a line is missing at the end of the line before.
    let anchor = if first_on_line && !failure.between_items {
        before.trim_end().len()
    } else {
        failure.at
    };
    let start = text.get(..anchor)?.rfind('\n')? + 1;
    let end = text.get(anchor..)?.find('\n').map(|i| anchor + i)?;
    let line = text.get(start..end)?;
    // Round brackets must stay balanced too, because the scanner has counted their nesting.
    let count = |bracket: char| line.matches(bracket).count();
    let parted = line.contains(['{', '}']) || count('(') != count(')');
    if parted || line.trim().is_empty() {
        return None;
    }
    let blank = " ".repeat(line.len());
    Some([text.get(..start)?, &blank, text.get(end..)?].concat())
}
