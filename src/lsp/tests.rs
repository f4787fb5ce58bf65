use super::buffers::{path_of, uri_of};
use super::outline::PICTURE;
use super::text::Lines;
use super::*;
use footlight_host::files::Monotonic;
use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::{NumberOrString, PublishDiagnosticsParams, Uri};
use proptest::prelude::*;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::thread::JoinHandle;
use std::time::Duration;
use tempfile::TempDir;

const RIG: &str = "light moon spot at 0,-1,3 aim 0,0,0 beam 20 field 40 900 cd\n\
    light lamp spot at 1,-1,3 aim 0,0,0 beam 20 field 40 900 cd\n\
    light exit spot at 0,2,3 aim 0,2,0 beam 20 field 40 9 cd\n\
    bank lamps = lamp\nbank sky = moon  channel 3\nfixed sign = exit  level 100\n";

const SHOW: &str = "show \"Él\"\n\
    include \"rig.lxq\"\n\
    surface floor reflectance 0.5 quad -2,-2,0 2,-2,0 2,2,0 -2,2,0\n\
    view v from 0,-4,2 to 0,0,0 fov 40 size 16x12\n\
    cue 1 \"🎭 Preset\" at 0:00 { snap  lamps 50 }\n\
    cue 2 \"Moon\" at 0:05 { time 4\n  sky 80\n}\n\
    cue 3 { lamps out }\n";

/// A client with a show and its rig in a folder.
struct Editor {
    connection: Connection,
    server: Option<JoinHandle<Result<End, String>>>,
    folder: TempDir,
    number: i32,
    heard: Vec<Notification>,
    answered: Vec<Response>,
}

fn means() -> Means {
    Means {
        limits: Limits {
            memory: 1 << 30,
            file: 1 << 20,
        },
        host: Box::new(|_, files| Host {
            files,
            clock: Box::new(Monotonic::default()),
            ..Host::default()
        }),
    }
}

impl Editor {
    fn new(capabilities: Value) -> Editor {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("show.lxq"), SHOW).unwrap();
        fs::write(folder.path().join("rig.lxq"), RIG).unwrap();
        let (own, connection) = Connection::memory();
        let server = std::thread::spawn(move || serve(&own, means()));
        let mut editor = Editor {
            connection,
            server: Some(server),
            folder,
            number: 0,
            heard: Vec::new(),
            answered: Vec::new(),
        };
        editor.ask("initialize", json!({ "capabilities": capabilities }));
        editor.tell("initialized", json!({}));
        editor
    }

    fn uri(&self, file: &str) -> Uri {
        let folder = self.folder.path().canonicalize().unwrap();
        uri_of(&folder.join(file)).unwrap()
    }

    fn tell(&self, method: &str, params: Value) {
        let notification = Notification::new(method.to_owned(), params);
        self.connection.sender.send(notification.into()).unwrap();
    }

    fn request(&mut self, method: &str, params: Value) -> RequestId {
        self.number += 1;
        let id = RequestId::from(self.number);
        let request = Request::new(id.clone(), method.to_owned(), params);
        self.connection.sender.send(request.into()).unwrap();
        id
    }

    fn response(&mut self, id: &RequestId) -> Response {
        loop {
            if let Some(at) = self.answered.iter().position(|a| a.id == *id) {
                return self.answered.remove(at);
            }
            self.hear();
        }
    }

    /// Receives the next message.
    fn hear(&mut self) {
        let wait = Duration::from_secs(60);
        match self.connection.receiver.recv_timeout(wait).unwrap() {
            Message::Response(response) => self.answered.push(response),
            Message::Notification(notification) => self.heard.push(notification),
            _ => {}
        }
    }

    fn ask(&mut self, method: &str, params: Value) -> Value {
        let id = self.request(method, params);
        let response = self.response(&id);
        assert!(response.error.is_none(), "{method}: {:?}", response.error);
        response.result.unwrap_or_default()
    }

    fn open(&self, file: &str, text: &str) {
        let uri = self.uri(file);
        let document = json!({ "uri": uri, "languageId": "lxq", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    fn change(&self, file: &str, changes: Value) {
        let document = json!({ "uri": self.uri(file), "version": 2 });
        let params = json!({ "textDocument": document, "contentChanges": changes });
        self.tell("textDocument/didChange", params);
    }

    /// The latest diagnostics of a file.
    fn diagnostics(&mut self, file: &str) -> Vec<lsp_types::Diagnostic> {
        // An answer about the show ensures that it was read.
        self.at("textDocument/codeLens", file, json!({}));
        let uri = self.uri(file);
        let all = self.heard.iter().rev();
        let mut all =
            all.filter(|notification| notification.method == "textDocument/publishDiagnostics");
        let last = all.find_map(|notification| {
            let params: PublishDiagnosticsParams =
                serde_json::from_value(notification.params.clone()).unwrap();
            (params.uri == uri).then_some(params.diagnostics)
        });
        last.expect("something was said")
    }

    /// A request about a file.
    fn at(&mut self, method: &str, file: &str, more: Value) -> Value {
        let mut params = more;
        params["textDocument"] = json!({ "uri": self.uri(file) });
        self.ask(method, params)
    }

    /// A request about the first occurrence of a word in a file's text.
    fn on(&mut self, method: &str, (file, text): (&str, &str), word: &str, more: Value) -> Value {
        let at = text.find(word).unwrap();
        let position = Lines::new(text, Encoding::Utf16).position(at);
        let mut params = more;
        params["position"] = json!(position);
        self.at(method, file, params)
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        self.ask("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        assert_eq!(
            self.server.take().unwrap().join().unwrap(),
            Ok(End::Orderly)
        );
    }
}

fn labels(items: &Value) -> Vec<&str> {
    let items = items.as_array().unwrap().iter();
    items.map(|item| item["label"].as_str().unwrap()).collect()
}

#[test]
fn errors_are_published_with_code_place_and_fix() {
    let mut editor = Editor::new(json!({}));
    let broken = SHOW
        .replace("\"Moon\"", "\"🎭\"")
        .replace("time 4\n  sky 80", "skyy 80");
    editor.open("show.lxq", &broken);
    let found = editor.diagnostics("show.lxq");
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(
        found[0].code,
        Some(NumberOrString::String("E010".to_owned()))
    );
    // The mask before it is two units of UTF-16.
    assert_eq!(found[0].range.start, lsp_types::Position::new(5, 21));
    assert!(
        found[0].message.contains("did you mean `sky`?"),
        "{found:?}"
    );
    let range = json!({ "range": found[0].range, "context": { "diagnostics": [] } });
    let fixes = editor.at("textDocument/codeAction", "show.lxq", range);
    assert_eq!(fixes[0]["title"], "write `sky`");
    let edit = &fixes[0]["edit"]["changes"][editor.uri("show.lxq").as_str()][0];
    editor.change(
        "show.lxq",
        json!([{ "range": edit["range"], "text": edit["newText"] }]),
    );
    assert_eq!(editor.diagnostics("show.lxq"), []);
}

#[test]
fn a_show_is_read_when_nothing_was_typed_for_a_while() {
    let mut editor = Editor::new(json!({}));
    editor.open("show.lxq", SHOW);
    editor.diagnostics("show.lxq");
    editor.heard.clear();
    let text = format!("{SHOW}cue 9 {{ lamp 5 }}\n");
    editor.change("show.lxq", json!([{ "text": text }]));
    let symbols = editor.at("textDocument/documentSymbol", "show.lxq", json!({}));
    assert!(symbols.to_string().contains("cue 9"), "{symbols}");
    assert!(editor.heard.is_empty(), "{:?}", editor.heard);
    while editor.heard.is_empty() {
        editor.hear();
    }
}

#[test]
fn broken_text_keeps_the_last_good_show() {
    let mut editor = Editor::new(json!({}));
    editor.open("show.lxq", SHOW);
    assert_eq!(editor.diagnostics("show.lxq"), []);
    let broken = format!("{SHOW}cue 4 {{ la");
    editor.change("show.lxq", json!([{ "text": broken }]));
    assert!(!editor.diagnostics("show.lxq").is_empty());
    let end = Lines::new(&broken, Encoding::Utf16).position(broken.len());
    let position = json!({ "position": end });
    let offered = editor.at("textDocument/completion", "show.lxq", position);
    assert!(labels(&offered).contains(&"lamps"), "{offered}");
    let notification = editor.on(
        "textDocument/hover",
        ("show.lxq", &broken),
        "sky 80",
        json!({}),
    );
    let words = notification["contents"]["value"].as_str().unwrap();
    assert!(
        words.contains("channel 3") && words.contains("at most 80 %"),
        "{words}"
    );
}

#[test]
fn names_are_found_and_renamed_across_files() {
    let mut editor = Editor::new(json!({}));
    editor.open("show.lxq", SHOW);
    let show = ("show.lxq", SHOW);
    let declared = editor.on("textDocument/definition", show, "lamps 50", json!({}));
    assert_eq!(declared[0]["uri"], editor.uri("rig.lxq").as_str());
    assert_eq!(
        declared[0]["range"]["start"],
        json!({ "line": 3, "character": 5 })
    );
    let context = json!({ "context": { "includeDeclaration": true } });
    let all = editor.on("textDocument/references", show, "lamps 50", context);
    assert_eq!(all.as_array().unwrap().len(), 3);
    let to = json!({ "newName": "tables" });
    let edits = editor.on("textDocument/rename", show, "lamps 50", to);
    let changed = |file: &str| {
        edits["changes"][editor.uri(file).as_str()]
            .as_array()
            .unwrap()
            .len()
    };
    assert_eq!((changed("show.lxq"), changed("rig.lxq")), (2, 1));
    for (name, why) in [
        ("sky", "is used already"),
        ("cue", "cannot be a name"),
        ("4", "is not a name"),
    ] {
        let at = Lines::new(SHOW, Encoding::Utf16).position(SHOW.find("lamps 50").unwrap());
        let document = json!({ "uri": editor.uri("show.lxq") });
        let params = json!({ "textDocument": document, "position": at, "newName": name });
        let id = editor.request("textDocument/rename", params);
        let refused = editor.response(&id).error.unwrap().message;
        assert!(refused.contains(why), "{refused}");
    }
}

#[test]
fn an_open_rig_counts_before_it_is_saved_and_belongs_to_its_show() {
    let mut editor = Editor::new(json!({}));
    // The rig alone belongs to the show next to it, which has no error.
    editor.open("rig.lxq", RIG);
    assert_eq!(editor.diagnostics("rig.lxq"), []);
    editor.open("show.lxq", SHOW);
    editor.change(
        "rig.lxq",
        json!([{ "text": RIG.replace("bank sky", "bank night") }]),
    );
    let found = editor.diagnostics("show.lxq");
    assert!(found[0].message.contains("`sky`"), "{found:?}");
    assert_eq!(editor.diagnostics("rig.lxq"), []);
    editor.tell(
        "textDocument/didClose",
        json!({ "textDocument": { "uri": editor.uri("rig.lxq") } }),
    );
    assert_eq!(editor.diagnostics("show.lxq"), []);
}

#[test]
fn the_text_is_outlined_coloured_and_formatted() {
    let mut editor = Editor::new(json!({}));
    editor.open("show.lxq", SHOW);
    let symbols = editor.at("textDocument/documentSymbol", "show.lxq", json!({}));
    let names: Vec<_> = symbols
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["name"].clone())
        .collect();
    assert_eq!(names[4..], ["cue 1", "cue 2", "cue 3"], "{symbols}");
    assert_eq!(symbols[4]["detail"], "🎭 Preset");
    let folds = editor.at("textDocument/foldingRange", "show.lxq", json!({}));
    assert_eq!(folds, json!([{ "startLine": 5, "endLine": 7 }]));
    let all = json!({ "range": lsp_types::Range::default() });
    let hints = editor.at("textDocument/inlayHint", "show.lxq", all);
    let hints: Vec<_> = hints
        .as_array()
        .unwrap()
        .iter()
        .map(|h| h["label"].clone())
        .collect();
    assert_eq!(hints, ["0s → 0s", "5s → 9s", "~14s → 19s"]);
    let links = editor.at("textDocument/documentLink", "show.lxq", json!({}));
    assert_eq!(links[0]["target"], editor.uri("rig.lxq").as_str());
    let pieces = editor.at("textDocument/semanticTokens/full", "show.lxq", json!({}));
    assert_eq!(
        pieces["data"].as_array().unwrap()[..10],
        [0, 0, 4, 0, 0, 0, 5, 4, 5, 0]
    );
    let options = json!({ "options": { "tabSize": 2, "insertSpaces": true } });
    let edits = editor.at("textDocument/formatting", "show.lxq", options);
    let range: lsp_types::Range = serde_json::from_value(edits[0]["range"].clone()).unwrap();
    let mut formatted = SHOW.to_owned();
    let bytes = Lines::new(SHOW, Encoding::Utf16).bytes(range);
    formatted.replace_range(bytes, edits[0]["newText"].as_str().unwrap());
    assert_eq!(formatted, footlight_show::lang::format(SHOW).unwrap());
    let cue = editor.on(
        "textDocument/hover",
        ("show.lxq", SHOW),
        "2 \"Moon",
        json!({}),
    );
    let words = cue["contents"]["value"].as_str().unwrap();
    assert!(words.contains("GO 5s, complete 9s"), "{words}");
    assert!(
        words.ends_with("moves sky 80\n\ntracks through lamps 50"),
        "{words}"
    );
}

#[test]
fn a_picture_of_a_cue_is_made_and_made_again_on_save() {
    let window = json!({ "window": { "workDoneProgress": true } });
    let mut editor = Editor::new(window);
    editor.open("show.lxq", SHOW);
    let lenses = editor.at("textDocument/codeLens", "show.lxq", json!({}));
    let command = &lenses[1]["command"];
    assert_eq!(
        (&command["title"], &command["command"]),
        (&json!("picture here"), &json!(PICTURE))
    );
    let asked = json!({ "command": PICTURE, "arguments": command["arguments"] });
    let made = editor.ask("workspace/executeCommand", asked);
    let uri: Uri = serde_json::from_value(made["uri"].clone()).unwrap();
    let path = path_of(&uri).unwrap();
    let before = fs::read(&path).unwrap();
    assert_eq!(&before[1..4], b"PNG");
    let progress = editor
        .heard
        .iter()
        .filter(|notification| notification.method == "$/progress");
    assert!(progress.count() >= 2);
    let darker = SHOW.replace("sky 80", "sky 8");
    editor.change("show.lxq", json!([{ "text": darker }]));
    fs::write(editor.folder.path().join("show.lxq"), &darker).unwrap();
    let saved = json!({ "textDocument": { "uri": editor.uri("show.lxq") } });
    editor.tell("textDocument/didSave", saved);
    let begun = editor.heard.len();
    while !editor.heard[begun..]
        .iter()
        .any(|notification| notification.method == "footlight/picture")
    {
        editor.diagnostics("show.lxq");
    }
    assert_ne!(fs::read(&path).unwrap(), before);
    let none = json!({ "command": PICTURE, "arguments": [editor.uri("show.lxq"), "9"] });
    let id = editor.request("workspace/executeCommand", none);
    assert!(
        editor
            .response(&id)
            .error
            .unwrap()
            .message
            .contains("no cue 9")
    );
}

#[test]
fn a_request_that_waits_is_taken_back() {
    let mut editor = Editor::new(json!({}));
    editor.open("show.lxq", SHOW);
    let folds = json!({ "textDocument": { "uri": editor.uri("show.lxq") } });
    // Both answers arrive, in either order.
    let first = editor.request("textDocument/foldingRange", folds.clone());
    let second = editor.request("textDocument/foldingRange", folds);
    editor.tell("$/cancelRequest", json!({ "id": editor.number }));
    assert!(editor.response(&first).error.is_none());
    let answer = editor.response(&second);
    assert!(
        answer
            .error
            .is_none_or(|error| error.code == ErrorCode::RequestCanceled as i32)
    );
    let unknown = editor.request("textDocument/nothing", json!({}));
    assert!(editor.response(&unknown).error.is_some());
}

/// Typed text is read first, however long tokens take; the tokens are then stale.
#[test]
fn no_keystroke_waits_for_colours() {
    let mut editor = Editor::new(json!({}));
    let cue = |number| format!("cue {number} {{\n{}}}\n", "  b 5 // five\n".repeat(40));
    let cues: String = (1..300).map(cue).collect();
    let large = format!(
        "light l panel m\nbank b = l\n{}",
        cues.replacen("b 5", "bb 5", 1)
    );
    editor.open("large.lxq", &large);
    editor.open("show.lxq", SHOW);
    let colours = json!({ "textDocument": { "uri": editor.uri("large.lxq") } });
    let asked: Vec<RequestId> = (0..40)
        .map(|_| editor.request("textDocument/semanticTokens/full", colours.clone()))
        .collect();
    // An edit of another text, then of the same text.
    for (file, text) in [
        ("show.lxq", SHOW.replace("sky 80", "skyy 80")),
        ("large.lxq", large),
    ] {
        editor.change(file, json!([{ "text": text }]));
        let uri = json!(editor.uri(file));
        let is_said = |n: &Notification| n.params["uri"] == uri && n.params["version"] == 2;
        while !editor.heard.iter().any(is_said) {
            editor.hear();
        }
        assert!(editor.answered.len() < asked.len() || file == "large.lxq");
        // A waiting request can be cancelled.
        if file == "show.lxq" {
            editor.tell("$/cancelRequest", json!({ "id": editor.number }));
            let answer = editor.response(asked.last().unwrap());
            let code = answer.error.map(|error| error.code);
            assert_eq!(code, Some(ErrorCode::RequestCanceled as i32));
        }
    }
    let again = editor.request("textDocument/semanticTokens/full", colours);
    let codes: BTreeSet<Option<i32>> = asked[..39]
        .iter()
        .map(|id| editor.response(id).error.map(|error| error.code))
        .collect();
    let outdated = Some(ErrorCode::ContentModified as i32);
    assert!(codes.contains(&outdated), "{codes:?}");
    assert!(codes.is_subset(&BTreeSet::from([None, outdated])));
    assert!(editor.response(&again).error.is_none());
}

#[test]
fn a_second_request_to_begin_is_invalid() {
    let mut editor = Editor::new(json!({}));
    let again = editor.request("initialize", json!({ "capabilities": {} }));
    let code = editor.response(&again).error.map(|error| error.code);
    assert_eq!(code, Some(ErrorCode::InvalidRequest as i32));
}

#[test]
fn a_client_that_is_gone_or_forgets_to_shut_down_is_told_apart() {
    for exits in [true, false] {
        let (client, server) = Connection::memory();
        let thread = std::thread::spawn(move || serve(&server, means()));
        let begin = json!({ "capabilities": {} });
        let begin = Request::new(RequestId::from(1), "initialize".to_owned(), begin);
        client.sender.send(begin.into()).unwrap();
        client.receiver.recv().unwrap();
        if exits {
            let exit = Notification::new("exit".to_owned(), Value::Null);
            client.sender.send(exit.into()).unwrap();
        }
        drop(client);
        assert_eq!(thread.join().unwrap(), Ok(End::Abrupt));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// After any edits, the diagnostics equal those of a fresh check of the final text.
    #[test]
    fn edits_come_to_the_same_as_a_fresh_check(
        edits in prop::collection::vec((0_u32..9, 0_u32..30, 0_u32..3, 0_u32..12, prop::sample::select(vec![
            "", "{", "}", "\"", "/*", "sky ", "\n", "cue 7 { sky 5 }\n", "ü🎭", "time 3s ",
        ])), 1..8)
    ) {
        let mut editor = Editor::new(json!({}));
        editor.open("show.lxq", SHOW);
        let mut text = SHOW.to_owned();
        for (line, column, lines, more, new) in edits {
            let start = lsp_types::Position::new(line, column);
            let end = lsp_types::Position::new(line + lines, more);
            let range = lsp_types::Range::new(start, end);
            let bytes = Lines::new(&text, Encoding::Utf16).bytes(range);
            text.replace_range(bytes, new);
            editor.change("show.lxq", json!([{ "range": range, "text": new }]));
        }
        let found = editor.diagnostics("show.lxq");
        let mut fresh = Editor::new(json!({}));
        fresh.open("show.lxq", &text);
        let wanted = fresh.diagnostics("show.lxq");
        let plain = |list: Vec<lsp_types::Diagnostic>| -> Vec<_> {
            list.into_iter().map(|d| (d.range, d.code, d.message.clone())).collect()
        };
        let own = editor.folder.path().display().to_string();
        let other = fresh.folder.path().display().to_string();
        let found = format!("{:?}", plain(found)).replace(&own, "");
        let wanted = format!("{:?}", plain(wanted)).replace(&other, "");
        prop_assert_eq!(found, wanted, "{}", text);
    }
}

#[test]
fn words_of_the_language_are_explained_where_they_stand() {
    let mut editor = Editor::new(json!({}));
    let text = format!(
        "{SHOW}light spare spot at 0, 0, 3 aim 0, 0, 0 beam 20 field 30 900 cd\n\
         let dusk = #203060\nbank cyc = spare  dimmer square rgb\ncurve dawn = linear 0 0, 1 100\n\
         surface riser reflectance 0.5 gloss 0.2 box from 0, 0, 0 to 1, 1, 0.4\n\
         effect candle = flicker seed 3\nhaze 70m forward 0.6\n\
         cue 4 {{ cyc #steelblue }}\ncue 5 {{ cyc #dusk\n  curve dawn\n}}\n"
    );
    editor.open("show.lxq", &text);
    for (place, expected) in [
        ("spot at", "light NAME spot"),
        ("aim 0", "light NAME spot"),
        ("beam 20", "full angles"),
        ("time 4", "duration of fades"),
        ("out }", "100 and 0"),
        ("80\n", "percent"),
        ("floor reflectance", "reflects 50 % of red"),
        ("riser", "gloss of roughness 0.20"),
        ("gloss 0.2", "0 (a mirror)"),
        ("square r", "25 %"),
        ("rgb\n", "see \"rgb banks\""),
        ("#steelblue", "linear light"),
        ("#dusk", "let dusk"),
        ("curve dawn\n", "shape of fades"),
        ("16x12", "pixels wide"),
        ("seed 3", "random"),
        ("haze 70m", "how far one sees"),
        (
            "70m",
            "visibility 70 m = extinction 0.0429/m, haze as on a concert",
        ),
        ("forward", "mean cosine"),
    ] {
        let hover = editor.on("textDocument/hover", ("show.lxq", &text), place, json!({}));
        let words = hover["contents"]["value"].as_str().unwrap_or_default();
        assert!(words.contains(expected), "{place}: {hover}");
    }
}

#[test]
fn a_file_that_opens_with_an_error_is_explained() {
    let mut editor = Editor::new(json!({}));
    let text = format!("{SHOW}cue 9 {{ lamps @ }}\n");
    editor.open("show.lxq", &text);
    for (place, expected) in [
        ("sky 80", "bank sky = moon"),
        ("time 4", "duration of fades"),
        ("cue 2", "cue"),
    ] {
        let hover = editor.on("textDocument/hover", ("show.lxq", &text), place, json!({}));
        let words = hover["contents"]["value"].as_str().unwrap_or_default();
        assert!(words.contains(expected), "{place}: {hover}");
    }
}

#[test]
fn completion_says_what_it_offers() {
    let mut editor = Editor::new(json!({}));
    editor.open("show.lxq", SHOW);
    editor.diagnostics("show.lxq");
    let mut offered = |line: &str| {
        let text = format!("{SHOW}{line}");
        editor.change("show.lxq", json!([{ "text": text }]));
        let end = Lines::new(&text, Encoding::Utf16).position(text.len());
        editor.at(
            "textDocument/completion",
            "show.lxq",
            json!({ "position": end }),
        )
    };
    let item = |items: &Value, label: &str| -> Value {
        let all = items.as_array().unwrap().iter();
        all.clone()
            .find(|item| item["label"] == label)
            .cloned()
            .unwrap_or_default()
    };
    let moves = offered("cue 9 { ");
    assert_eq!(item(&moves, "sky")["detail"], "bank");
    assert!(
        item(&moves, "time")["documentation"]["value"]
            .as_str()
            .unwrap()
            .contains("duration")
    );
    assert_eq!(item(&offered("preview "), "{")["label"], "{");
    assert!(item(&offered("preview { "), "tolerance")["detail"].is_string());
    let numbers = offered("cue ");
    assert_eq!(item(&numbers, "4")["detail"], "the next number");
    assert_eq!(item(&numbers, "2")["detail"], "cue \"Moon\"");
    let times = offered("cue 9 { time 5");
    assert_eq!(item(&times, "5ms")["detail"], "milliseconds");
    assert!(item(&offered("preview { tone "), "plain")["detail"].is_string());
    let files = offered("include \"");
    assert_eq!(item(&files, "rig.lxq")["detail"], "file");
    assert_eq!(labels(&offered("stage \"")), Vec::<&str>::new());
    let values = offered("let x = ");
    assert!(labels(&values).contains(&"full"), "{values}");
}

#[test]
fn examples_of_the_manual_are_no_fixes() {
    let mut editor = Editor::new(json!({}));
    for (line, meant) in [
        ("cue 9 { lamps at 40 }", "40"),
        ("cue 9 { lamps 40% in 3s }", "time"),
        ("cue 9 { lamps @ 40 }", ""),
        ("cue 9 { part 2 { lamps 4 }  part 2 { sky 5 } }", "3"),
        ("effect candle = flicker rat 6", "rate"),
        ("cue 9 { time 4min  lamps 5 }", "4:00"),
        ("cue 9 { time 1.5min  lamps 5 }", "1:30"),
        ("cue 9 { lamps 5", " }"),
        ("cue 9 {\n  lamps 5", "\n}"),
        (
            "light l spot at 0,0,3 aim 0,0,0 beam 24 deg field 40 900 cd",
            "24deg",
        ),
        ("cue 9 { lamps 5  follow 2 }", ""),
        ("let blue_sky = #stealblue", "#steelblue"),
        ("bank more = moon chanel 7", "channel"),
    ] {
        let text = format!("{SHOW}{line}\n");
        editor.open("show.lxq", &text);
        let mut written = Vec::new();
        for diagnostic in editor.diagnostics("show.lxq") {
            let range = json!({ "range": diagnostic.range, "context": { "diagnostics": [] } });
            let fixes = editor.at("textDocument/codeAction", "show.lxq", range);
            for fix in fixes.as_array().unwrap() {
                let edit = &fix["edit"]["changes"][editor.uri("show.lxq").as_str()][0];
                written.push(edit["newText"].as_str().unwrap().to_owned());
            }
        }
        assert!(
            written.iter().any(|new| new == meant),
            "{line}: {written:?}"
        );
        let examples = ["85", "warm"];
        let is_example = |new: &String| examples.iter().any(|example| new.contains(example));
        assert!(!written.iter().any(is_example), "{line}: {written:?}");
    }
}

#[test]
fn what_no_file_may_hold_is_said() {
    let mut editor = Editor::new(json!({}));
    editor.open("show.lxq", SHOW);
    let code = |found: Vec<lsp_types::Diagnostic>| match &found[0].code {
        Some(NumberOrString::String(code)) => code.clone(),
        other => panic!("{other:?}"),
    };
    editor.change("show.lxq", json!([{ "text": format!("{SHOW}// \u{0}\n") }]));
    assert_eq!(code(editor.diagnostics("show.lxq")), "E001");
    let large = format!("{SHOW}// {}\n", "x".repeat(17 << 20));
    editor.change("show.lxq", json!([{ "text": large }]));
    assert_eq!(code(editor.diagnostics("show.lxq")), "E002");
    editor.change("show.lxq", json!([{ "text": SHOW }]));
    assert_eq!(editor.diagnostics("show.lxq"), []);
}
