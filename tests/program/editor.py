"""The language server under pytest-lsp, which speaks the protocol as it is written, with the capabilities of two
editors: Neovim counts columns in bytes, Visual Studio Code in units of UTF-16. Run by `editor.rs`, with the program
in `FOOTLIGHT`.
"""

import asyncio
import os

import pytest
import pytest_lsp
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

PROGRAM = os.environ["FOOTLIGHT"]
SHOWN = "footlight/picture"
WAIT = 60

RIG = """light moon spot at 0,-1,3 aim 0,0,0 beam 20 field 40 900 cd
light lamp spot at 1,-1,3 aim 0,0,0 beam 20 field 40 900 cd
bank lamps = lamp
bank sky = moon
"""
SHOW = """show "Él"
include "rig.lxq"
surface floor reflectance 0.5 quad -2,-2,0 2,-2,0 2,2,0 -2,2,0
view v from 0,-4,2 to 0,0,0 fov 40 size 16x12
cue 1 "ü🎭" at 0:00 { snap /* ü🎭 */ lamps 50 }
cue 2 "🎭" at 0:05 { time 4  lamps out  sky 80 }  // 🎭
cue 3 { lamps full }
"""
# A picture that takes far longer than a message.
LONG = SHOW.replace("size 16x12", "size 1280x960").replace('include "rig.lxq"', RIG + "preview { coarse 3 }")


def width(text, encoding):
    """Columns of a text, by Python's own coding."""
    return len(text.encode()) if encoding == "utf-8" else len(text.encode("utf-16-le")) // 2


class Editor:
    """A client with a show and its rig in a folder."""

    def __init__(self, client, folder, encoding):
        self.client, self.folder, self.encoding = client, folder, encoding
        self.versions, self.shown = {}, []

    def uri(self, name):
        return (self.folder / name).as_uri()

    def document(self, name):
        return lsp.TextDocumentIdentifier(self.uri(name))

    def place(self, text, at):
        before = text[:at].split("\n")
        return lsp.Position(len(before) - 1, width(before[-1], self.encoding))

    def range(self, text, piece):
        at = text.index(piece)
        return lsp.Range(self.place(text, at), self.place(text, at + len(piece)))

    def index(self, text, place):
        lines = text.split("\n")
        before = sum(len(line) + 1 for line in lines[: place.line])
        columns = [width(lines[place.line][:i], self.encoding) for i in range(len(lines[place.line]) + 1)]
        return before + columns.index(place.character)

    def edited(self, text, edits):
        """A text after edits, of which none touches another."""
        for edit in sorted(edits, key=lambda e: (e.range.start.line, e.range.start.character), reverse=True):
            start, end = (self.index(text, at) for at in (edit.range.start, edit.range.end))
            text = text[:start] + edit.new_text + text[end:]
        return text

    def open(self, name, text):
        self.versions[name] = 1
        item = lsp.TextDocumentItem(self.uri(name), "lxq", 1, text)
        self.client.text_document_did_open(lsp.DidOpenTextDocumentParams(item))

    def type(self, name, text, old, new):
        """Replaces a piece by its place alone; the text that then is there."""
        self.versions[name] += 1
        document = lsp.VersionedTextDocumentIdentifier(version=self.versions[name], uri=self.uri(name))
        change = lsp.TextDocumentContentChangePartial(range=self.range(text, old), text=new)
        self.client.text_document_did_change(lsp.DidChangeTextDocumentParams(document, [change]))
        return text.replace(old, new, 1)

    async def diagnostics(self, name):
        # What is asked for is answered of the text as it stands, behind what is said of it.
        await self.client.text_document_folding_range_async(lsp.FoldingRangeParams(self.document(name)))
        return list(self.client.diagnostics[self.uri(name)])

    async def pieces(self, name, text):
        """The coloured pieces, each with its kind."""
        asked = lsp.SemanticTokensParams(self.document(name))
        data = (await self.client.text_document_semantic_tokens_full_async(asked)).data
        lines, line, column, found = text.split("\n"), 0, 0, []
        for lines_on, columns_on, length, kind, modifiers in zip(*[iter(data)] * 5):
            line, column = line + lines_on, columns_on + (column if lines_on == 0 else 0)
            start, end = (self.index(text, lsp.Position(line, at)) for at in (column, column + length))
            assert start < end and modifiers == 0
            found.append((text[start:end], self.legend[kind]))
        return found

    async def lenses(self, name):
        return await self.client.text_document_code_lens_async(lsp.CodeLensParams(self.document(name)))

    def picture(self, command, number):
        """Asks for the picture of a lens; the answer comes later."""
        asked = lsp.ExecuteCommandParams(command.command, command.arguments)
        send = self.client.protocol.send_request_async
        return asyncio.ensure_future(send(lsp.WORKSPACE_EXECUTE_COMMAND, asked, msg_id=number))

    async def until(self, is_so):
        async with asyncio.timeout(WAIT):
            while not is_so():
                await asyncio.sleep(0.005)


@pytest_lsp.fixture(
    config=pytest_lsp.ClientServerConfig(server_command=[PROGRAM, "lsp"]),
    params=[("neovim", "utf-8"), ("visual_studio_code", "utf-16")],
    ids=["neovim", "vscode"],
)
async def client(lsp_client: pytest_lsp.LanguageClient, request, tmp_path):
    name, encoding = request.param
    folder = tmp_path.resolve()
    (folder / "show.lxq").write_text(SHOW)
    (folder / "rig.lxq").write_text(RIG)
    made = lsp_client.editor = Editor(lsp_client, folder, encoding)

    @lsp_client.feature(SHOWN)
    def show(params):
        made.shown.append(params.uri)

    asked = lsp.InitializeParams(capabilities=pytest_lsp.client_capabilities(name))
    answer = await lsp_client.initialize_session(asked)
    assert answer.capabilities.position_encoding == encoding
    made.legend = answer.capabilities.semantic_tokens_provider.legend.token_types
    yield
    await lsp_client.shutdown_session()
    assert lsp_client._server.returncode == 0


@pytest.fixture
def editor(client):
    return client.editor


pytestmark = pytest.mark.asyncio


async def test_columns_behind_wide_letters(editor):
    editor.open("show.lxq", SHOW)
    assert await editor.diagnostics("show.lxq") == []
    broken = editor.type("show.lxq", SHOW, "lamps out  sky", "lmaps out  sky")
    [found] = await editor.diagnostics("show.lxq")
    assert found.range == editor.range(broken, "lmaps")
    assert "did you mean `lamps`?" in found.message
    mended = editor.type("show.lxq", broken, "lmaps", "lamps")
    assert await editor.diagnostics("show.lxq") == [] and mended == SHOW


async def test_colours(editor):
    editor.open("show.lxq", SHOW)
    pieces = await editor.pieces("show.lxq", SHOW)
    first = pieces.index(('"ü🎭"', "string"))
    assert pieces[first - 2 : first + 6] == [
        ("cue", "keyword"), ("1", "number"), ('"ü🎭"', "string"), ("at", "modifier"), ("0:00", "number"),
        ("snap", "modifier"), ("/* ü🎭 */", "comment"), ("lamps", "variable"),
    ]
    assert ("sky", "variable") in pieces and ("// 🎭", "comment") in pieces


async def test_times_of_cues(editor):
    editor.open("show.lxq", SHOW)
    whole = lsp.Range(lsp.Position(0, 0), editor.place(SHOW, len(SHOW)))
    asked = lsp.InlayHintParams(editor.document("show.lxq"), whole)
    hints = await editor.client.text_document_inlay_hint_async(asked)
    assert [hint.label for hint in hints] == ["0s → 0s", "5s → 9s", "~14s → 19s"]
    headers = [" { snap", " { time", " { lamps"]
    assert [hint.position for hint in hints] == [editor.range(SHOW, behind).start for behind in headers]


async def test_a_name_in_two_files(editor):
    for name, text in [("show.lxq", SHOW), ("rig.lxq", RIG)]:
        editor.open(name, text)
    at = editor.range(SHOW, "lamps out").start
    document = editor.document("show.lxq")
    prepared = await editor.client.text_document_prepare_rename_async(lsp.PrepareRenameParams(document, at))
    assert prepared == lsp.Range(at, editor.place(SHOW, SHOW.index("lamps out") + 5))
    asked = lsp.RenameParams(document, at, "tables")
    changes = (await editor.client.text_document_rename_async(asked)).changes
    for name, text in [("show.lxq", SHOW), ("rig.lxq", RIG)]:
        assert editor.edited(text, changes.pop(editor.uri(name))) == text.replace("lamps", "tables")
    assert changes == {}


async def test_picture_and_again_after_a_save(editor):
    editor.open("show.lxq", SHOW)
    lenses = await editor.lenses("show.lxq")
    assert [lens.command.title for lens in lenses] == ["picture here"] * 3
    assert lenses[1].range.start == editor.range(SHOW, "cue 2").start
    answer = await editor.picture(lenses[1].command, "first")
    assert editor.shown == [answer["uri"]]
    assert [(shown.uri, shown.external) for shown in editor.client.shown_documents] == [(editor.shown[0], True)]
    path = editor.shown[0].removeprefix("file://")
    with open(path, "rb") as file:
        before = file.read()
    assert before.startswith(b"\x89PNG")
    [reports] = editor.client.progress_reports.values()
    assert isinstance(reports[0], lsp.WorkDoneProgressBegin) and reports[0].title == "picture of cue 2"
    assert isinstance(reports[-1], lsp.WorkDoneProgressEnd)
    assert all(0 <= report.percentage <= 100 for report in reports[:-1])
    changed = editor.type("show.lxq", SHOW, "sky 80", "sky 8")
    (editor.folder / "show.lxq").write_text(changed)
    saved = lsp.DidSaveTextDocumentParams(editor.document("show.lxq"))
    editor.client.text_document_did_save(saved)
    await editor.until(lambda: len(editor.shown) == 2)
    assert editor.shown[1] == editor.shown[0]
    with open(path, "rb") as file:
        assert file.read() != before
    # The view beside the text is only made anew: nothing is opened again.
    assert len(editor.client.shown_documents) == 1


async def test_a_picture_is_taken_back(editor):
    editor.open("show.lxq", LONG)
    assert await editor.diagnostics("show.lxq") == []
    command = (await editor.lenses("show.lxq"))[1].command

    def request():
        editor.client.cancel_request(lsp.CancelParams("long"))

    def progress():
        [*_, token] = editor.client.progress_reports
        editor.client.window_work_done_progress_cancel(lsp.WorkDoneProgressCancelParams(token))

    for count, cancel in enumerate([request, progress], 1):
        answer = editor.picture(command, "long")
        reports = editor.client.progress_reports
        await editor.until(lambda: len(reports) == count and len(list(reports.values())[-1]) >= 2)
        assert not answer.done()
        cancel()
        async with asyncio.timeout(WAIT):
            with pytest.raises(JsonRpcException) as refused:
                await answer
        assert refused.value.code == lsp.LSPErrorCodes.RequestCancelled
        assert isinstance(list(reports.values())[-1][-1], lsp.WorkDoneProgressEnd)
    assert editor.shown == []
    # The server goes on.
    assert len(await editor.lenses("show.lxq")) == 3
