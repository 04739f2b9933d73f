"""Dialogues with the server over a real client: texts that open, change and close, and what is said of them."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("pytest_lsp")

from editor_client import LOOP, client, opened, said
from editor_texts import LINES, SCENE
from lsprotocol import types
from pytest_lsp import LanguageClient

from softmark.scenes import ROOT

pytestmark = LOOP
__all__ = ["client"]
BROKEN = SCENE + "param bad = 3 mn\n"


def edit(client: LanguageClient, text: types.TextDocumentIdentifier, version: int, new: str, *at: int) -> None:
    """Write over what is between two places (line, character, line, character), or over all."""
    change: types.TextDocumentContentChangeEvent = types.TextDocumentContentChangeWholeDocument(new)
    if at:
        where = types.Range(types.Position(at[0], at[1]), types.Position(at[2], at[3]))
        change = types.TextDocumentContentChangePartial(range=where, text=new)
    which = types.VersionedTextDocumentIdentifier(version, text.uri)
    client.text_document_did_change(types.DidChangeTextDocumentParams(which, [change]))


def errors(found: list[types.Diagnostic]) -> list[types.Diagnostic]:
    return [d for d in found if d.severity == types.DiagnosticSeverity.Error]


async def test_a_shipped_scene_has_warnings_and_no_errors(client: LanguageClient) -> None:
    file = next(ROOT.rglob("silicone-beam.scene"))
    text = opened(client, file.read_text(encoding="utf-8"), file.parent, file.name)
    assert {d.severity for d in await said(client, text)} == {types.DiagnosticSeverity.Warning}


async def test_an_error_comes_and_goes_with_the_text(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(client, BROKEN, tmp_path)
    (found,) = errors(await said(client, text))
    assert (found.code, found.source) == ("E209", "softmark")
    assert (found.range.start, found.range.end) == (types.Position(LINES, 14), types.Position(LINES, 16))
    assert "write `mN`" in found.message
    assert found.code_description is not None
    assert found.code_description.href.endswith("/E209.md")
    edit(client, text, 2, "mm", LINES, 14, LINES, 16)
    assert errors(await said(client, text)) == []
    edit(client, text, 3, BROKEN)
    assert len(errors(await said(client, text))) == 1
    client.text_document_did_close(types.DidCloseTextDocumentParams(text))
    assert await said(client, text) == []


async def test_the_latest_state_is_what_counts(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(client, SCENE, tmp_path, "fast.scene")
    for version in range(2, 40):
        edit(client, text, version, "x", LINES, version - 2, LINES, version - 2)
    edit(client, text, 40, SCENE)
    assert errors(await said(client, text, 40)) == []


async def test_related_places_and_what_nothing_uses(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(
        client, SCENE + "param soft = 3 mm\nmaterial b = neo_hookean(soft, 0.4, 1 kg/m^3)\n", tmp_path, "r.scene"
    )
    found = {d.code: d for d in await said(client, text)}
    (place,) = found["E204"].related_information or ()
    assert (place.location.uri, place.location.range.start.line) == (text.uri, LINES)
    edit(client, text, 2, SCENE + "param soft = 3 mm\n")
    found = {d.code: d for d in await said(client, text)}
    assert list(found["W309"].tags or ()) == [types.DiagnosticTag.Unnecessary]


async def test_an_error_of_a_scene_that_is_used_is_said_where_it_is_used(
    client: LanguageClient, tmp_path: Path
) -> None:
    (tmp_path / "inner.scene").write_text("param L = 3 mn\n", encoding="utf-8")
    text = opened(client, 'use "inner.scene" as inner\nparam M = inner.L\n', tmp_path, "outer.scene")
    (found,) = errors(await said(client, text))
    assert found.range.start == types.Position(0, 0)
    (place,) = found.related_information or ()
    assert place.location.uri == (tmp_path / "inner.scene").as_uri()
    assert place.location.range.start == types.Position(0, 12)


async def test_completion_hover_and_signatures_in_what_is_being_written(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(client, SCENE, tmp_path, "written.scene")
    line = "material a = neo_hookean(young = 60 "
    edit(client, text, 2, line, LINES, 0, LINES, 0)
    at = types.Position(LINES, len(line))
    found = await client.text_document_completion_async(types.CompletionParams(text, at))
    assert isinstance(found, types.CompletionList)
    assert [i.label for i in found.items][:4] == ["Pa", "kPa", "MPa", "GPa"]
    shown = await client.text_document_hover_async(types.HoverParams(text, types.Position(0, 6)))
    assert shown is not None
    assert "0.178 m" in str(shown.contents)
    call = await client.text_document_signature_help_async(types.SignatureHelpParams(text, at))
    assert call is not None
    assert call.active_parameter == 0


async def test_what_is_not_open_has_no_answer(client: LanguageClient) -> None:
    nowhere = types.TextDocumentIdentifier("file:///nowhere.scene")
    assert await client.text_document_hover_async(types.HoverParams(nowhere, types.Position(0, 0))) is None


async def test_a_text_without_a_file(client: LanguageClient) -> None:
    item = types.TextDocumentItem("untitled:Untitled-1", "softmark", 1, BROKEN)
    client.text_document_did_open(types.DidOpenTextDocumentParams(item))
    (found,) = errors(await said(client, types.TextDocumentIdentifier(item.uri)))
    assert found.code == "E209"


async def test_hostile_texts_leave_the_server_alone(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(client, "", tmp_path, "hostile.scene")
    for version, new in enumerate(["\0" * 100, "(" * 5000, "a" * 50_000, '"\\ud835', "\r\r\n\f\u2028"], 2):
        edit(client, text, version, new)
        params = types.CompletionParams(text, types.Position(0, 10_000))
        await client.text_document_completion_async(params)
    edit(client, text, 20, "")
    await said(client, text, 20)


async def test_what_a_scene_names_is_looked_for_again_when_it_is_saved(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(client, 'use "later.scene" as later\nparam M = later.L\n', tmp_path, "early.scene")
    assert {d.code for d in errors(await said(client, text))} == {"E401"}
    (tmp_path / "later.scene").write_text("param L = 3 mm\n", encoding="utf-8")
    client.text_document_did_save(types.DidSaveTextDocumentParams(text))
    assert errors(await said(client, text)) == []
