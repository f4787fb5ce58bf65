//! The structure of a text: symbols, folds, semantic tokens, hints, links, lenses.

use std::path::Path;

use lsp_types::{
    CodeLens, Command, DocumentLink, DocumentSymbol, FoldingRange, FoldingRangeKind, InlayHint,
    InlayHintLabel, InlayHintTooltip, SemanticToken, SemanticTokenType, SymbolKind, Uri,
};

use super::background::Stop;
use super::buffers::uri_of;
use super::open_show::OpenShow;
use super::text::{Encoding, Lines};
use footlight_host::files::normal;
use footlight_show::lang::{self, Outlined, Token};
use footlight_show::timeline::CueTime;
use footlight_show::units::CueNumber;

/// Most statements, folds, hints and so on sent for a text: each takes kilobytes on its way to the
/// client.
const MOST: usize = 10_000;

/// The command that renders a cue.
pub const PICTURE: &str = "footlight.picture";

/// The statements of a text, with the parts of cues below them.
pub fn symbols(text: &str, encoding: Encoding, stop: &Stop) -> Vec<DocumentSymbol> {
    let lines = Lines::new(text, encoding);
    let statements = lang::outline(text).into_iter();
    statements
        .take_while(|_| !stop.is_set())
        .filter_map(|statement| symbol(text, &statement, &lines))
        .take(MOST)
        .collect()
}

fn symbol(text: &str, statement: &Outlined<'_>, lines: &Lines<'_>) -> Option<DocumentSymbol> {
    let own = text.get(statement.range.clone())?;
    let name = statement.name.as_deref().unwrap_or(statement.word);
    let short = match statement.word {
        "cue" | "" => name,
        word => name.strip_prefix(word).map_or(name, str::trim),
    };
    let mut children = Vec::new();
    if statement.word == "cue" {
        let tokens = lang::tokens(own);
        for (i, (range, _)) in tokens.iter().enumerate() {
            let number = tokens.get(i + 1).filter(|(_, t)| *t == Token::Quantity);
            let (Some("part"), Some((number, _))) = (own.get(range.clone()), number) else {
                continue;
            };
            let start = statement.range.start;
            let bytes = start + range.start..start + number.end;
            let name = own.get(range.start..number.end).unwrap_or("part");
            children.push(made(name, None, SymbolKind::EVENT, (&bytes, &bytes), lines));
        }
    }
    let header = statement.range.start..statement.range.start + header_length(own);
    let kind = kind(statement.word);
    let short = if short.is_empty() {
        statement.word
    } else {
        short
    };
    let mut made = made(short, label(own), kind, (&statement.range, &header), lines);
    made.children = (!children.is_empty()).then_some(children);
    (!made.name.is_empty()).then_some(made)
}

#[allow(deprecated, reason = "a field of the protocol's type has to be given")]
fn made(
    name: &str,
    detail: Option<String>,
    kind: SymbolKind,
    (bytes, own): (&std::ops::Range<usize>, &std::ops::Range<usize>),
    lines: &Lines<'_>,
) -> DocumentSymbol {
    DocumentSymbol {
        name: name.to_owned(),
        detail,
        kind,
        tags: None,
        deprecated: None,
        range: lines.range(bytes),
        selection_range: lines.range(own),
        children: None,
    }
}

fn kind(word: &str) -> SymbolKind {
    match word {
        "cue" => SymbolKind::EVENT,
        "bank" | "fixed" => SymbolKind::VARIABLE,
        "group" => SymbolKind::ARRAY,
        "look" => SymbolKind::STRUCT,
        "light" => SymbolKind::OBJECT,
        "curve" | "effect" => SymbolKind::FUNCTION,
        "let" | "point" => SymbolKind::CONSTANT,
        "view" => SymbolKind::INTERFACE,
        "stage" | "include" | "gels" => SymbolKind::FILE,
        _ => SymbolKind::PROPERTY,
    }
}

/// Bytes up to the brace, or the end of the line.
fn header_length(statement: &str) -> usize {
    let line = statement.lines().next().unwrap_or("");
    let brace = line.find('{').unwrap_or(line.len());
    line.get(..brace).unwrap_or(line).trim_end().len()
}

/// The quoted label of a cue.
fn label(statement: &str) -> Option<String> {
    let header = statement.get(..header_length(statement))?;
    let mut texts = lang::tokens(header).into_iter();
    let (range, _) = texts.find(|(_, token)| *token == Token::Text)?;
    Some(lang::unquote(header.get(range)?))
}

/// Statements and comments of several lines.
pub fn folds(text: &str, encoding: Encoding, stop: &Stop) -> Vec<FoldingRange> {
    let lines = Lines::new(text, encoding);
    let comments = lang::pieces(text).take_while(|_| !stop.is_set());
    let comments = comments.filter(|(_, token)| *token == Token::Comment);
    let comments = comments.map(|(range, _)| (range, Some(FoldingRangeKind::Comment)));
    let statements = lang::outline(text).into_iter().map(|s| (s.range, None));
    let fold = |(range, kind)| {
        let range = lines.range(&range);
        (range.start.line < range.end.line).then(|| FoldingRange {
            start_line: range.start.line,
            end_line: range.end.line,
            kind,
            ..FoldingRange::default()
        })
    };
    statements
        .chain(comments)
        .filter_map(fold)
        .take(MOST)
        .collect()
}

/// Kinds of semantic tokens, in the order of their numbers.
pub fn legend() -> Vec<SemanticTokenType> {
    vec![
        SemanticTokenType::KEYWORD,
        SemanticTokenType::MODIFIER,
        SemanticTokenType::VARIABLE,
        SemanticTokenType::NUMBER,
        SemanticTokenType::ENUM_MEMBER,
        SemanticTokenType::STRING,
        SemanticTokenType::COMMENT,
    ]
}

/// The semantic tokens of a text, each with its distance from the previous one.
pub fn pieces(text: &str, encoding: Encoding, stop: &Stop) -> Vec<SemanticToken> {
    let (mut out, mut line, mut column) = (Vec::new(), 0, 0);
    let lines = Lines::new(text, encoding);
    let pieces = lang::pieces(text).take_while(|_| !stop.is_set());
    for (range, token) in pieces.take(10 * MOST) {
        let token_type = match token {
            Token::Statement => 0,
            Token::Word => 1,
            Token::Name => 2,
            Token::Quantity => 3,
            Token::Colour => 4,
            Token::Text => 5,
            Token::Comment => 6,
            Token::Mark => continue,
        };
        let mut at = range.start;
        // Tokens of the protocol do not span lines.
        for part in text.get(range).unwrap_or("").split('\n') {
            let length = encoding.width(part.trim_end_matches('\r'));
            let start = lines.position(at);
            at += part.len() + 1;
            if length == 0 {
                continue;
            }
            let delta_line = start.line - line;
            out.push(SemanticToken {
                delta_line,
                delta_start: match delta_line {
                    0 => start.character - column,
                    _ => start.character,
                },
                length,
                token_type,
                token_modifiers_bitset: 0,
            });
            (line, column) = (start.line, start.character);
        }
    }
    out
}

/// The cues of a text, each with its time in the last good show.
fn cues<'s>(
    show: &'s OpenShow,
    text: &'s str,
) -> impl Iterator<Item = (Outlined<'s>, &'s CueTime)> + 's {
    let times = show.document().map(|document| document.timeline().cues());
    let statements = lang::outline(text).into_iter();
    statements.filter_map(move |statement| {
        let number = statement.name.as_deref()?.strip_prefix("cue ")?;
        let number = CueNumber::parse(number)?;
        let times = times?;
        let at = times.binary_search_by_key(&number, |time| time.number);
        Some((statement, times.get(at.ok()?)?))
    })
}

/// Start and completion of each cue.
pub fn hints(show: &OpenShow, text: &str, encoding: Encoding) -> Vec<InlayHint> {
    let lines = Lines::new(text, encoding);
    let hint = |(statement, time): (Outlined<'_>, &CueTime)| {
        let own = text.get(statement.range.clone())?;
        let at = statement.range.start + header_length(own);
        let assumed = if time.assumed { "~" } else { "" };
        Some(InlayHint {
            position: lines.position(at),
            label: InlayHintLabel::String(format!("{assumed}{} → {}", time.go, time.completion)),
            kind: None,
            text_edits: None,
            tooltip: time.assumed.then(|| {
                let why = "its GO is assumed: the gap after the cue before is complete";
                InlayHintTooltip::String(why.to_owned())
            }),
            padding_left: Some(true),
            padding_right: Some(true),
            data: None,
        })
    };
    cues(show, text).filter_map(hint).take(MOST).collect()
}

/// A command above each cue that renders it.
pub fn lenses(show: &OpenShow, (text, uri): (&str, &Uri), encoding: Encoding) -> Vec<CodeLens> {
    let setup = show.document().and_then(|document| document.setup());
    if setup.is_none() {
        return Vec::new();
    }
    let lines = Lines::new(text, encoding);
    let lens = |(statement, time): (Outlined<'_>, &CueTime)| CodeLens {
        range: lines.range(&(statement.range.start..statement.range.start)),
        command: Some(Command {
            title: "picture here".to_owned(),
            command: PICTURE.to_owned(),
            arguments: Some(vec![uri.to_string().into(), time.number.to_string().into()]),
        }),
        data: None,
    };
    cues(show, text).map(lens).take(MOST).collect()
}

/// The files named in a text.
pub fn links(show: &OpenShow, text: &str, encoding: Encoding, stop: &Stop) -> Vec<DocumentLink> {
    let lines = Lines::new(text, encoding);
    let folder = show.path().parent().unwrap_or(Path::new(""));
    let tokens: Vec<_> = lang::pieces(text).take_while(|_| !stop.is_set()).collect();
    let link = |pair: &[(std::ops::Range<usize>, Token)]| {
        let [(before, _), (range, Token::Text)] = pair else {
            return None;
        };
        let word = text.get(before.clone())?;
        endings(word)?;
        let inner = range.start + 1..range.end.checked_sub(1)?.max(range.start + 1);
        let path = normal(&folder.join(text.get(inner.clone())?));
        Some(DocumentLink {
            range: lines.range(&inner),
            target: Some(path.is_file().then(|| uri_of(&path)).flatten()?),
            tooltip: None,
            data: None,
        })
    };
    tokens.windows(2).filter_map(link).take(MOST).collect()
}

/// Words before file names, with the extensions that fit.
const FILE_WORDS: [(&str, &[&str]); 6] = [
    ("include", &["lxq"]),
    ("stage", footlight_stage::import::ENDINGS),
    ("gels", &["csv", "txt", "tsv"]),
    ("image", &["exr", "png", "jpg", "jpeg", "webp"]),
    ("photometric", footlight_stage::photometric::ENDINGS),
    ("project", &["png", "jpg", "jpeg", "webp", "exr"]),
];

/// Extensions of files that may follow a word; `None` for a word without a file.
pub fn endings(word: &str) -> Option<&'static [&'static str]> {
    let mut words = FILE_WORDS.into_iter();
    words
        .find(|(own, _)| *own == word)
        .map(|(_, endings)| endings)
}
