"""Requests over a real client, and on beginnings of shipped scenes: an answer in time, and no exception."""

from __future__ import annotations

import gc
import os
import random
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("pytest_lsp")

from editor_client import client, opened, said
from lsprotocol import types
from marked_texts import whole
from pygls.exceptions import JsonRpcException
from pytest_lsp import LanguageClient

from softmark.interpreter.language_server import server
from softmark.interpreter.language_server.request_error import RequestRefused
from softmark.interpreter.language_server.text_document import Document
from softmark.scenes import ROOT

__all__ = ["client"]
TEXT = "param L = 178 mm\nparam R = 2 * L\nparam E = 6 kpa\nmodel m = fem(\n  tet4,\n)\n"
AT = types.Position(1, 14)
ALL = types.Range(types.Position(0, 0), types.Position(9, 0))
NOTHING = types.CodeActionContext([])
IN_TIME = 0.2  # s, for an answer
SEED = 20261123
PREFIXES = int(os.environ.get("SOFTMARK_PREFIXES", "24"))  # of shipped scenes that are tried; a study takes more
OURS = (  # what these requests take besides their text
    (types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionParams, {"range": ALL, "context": NOTHING}),
    (types.TEXT_DOCUMENT_CODE_LENS, types.CodeLensParams, {}),
    (types.TEXT_DOCUMENT_DEFINITION, types.DefinitionParams, {"position": AT}),
    (types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT, types.DocumentHighlightParams, {"position": AT}),
    (types.TEXT_DOCUMENT_DOCUMENT_SYMBOL, types.DocumentSymbolParams, {}),
    (types.TEXT_DOCUMENT_FOLDING_RANGE, types.FoldingRangeParams, {}),
    (types.TEXT_DOCUMENT_INLAY_HINT, types.InlayHintParams, {"range": ALL}),
    (types.TEXT_DOCUMENT_PREPARE_RENAME, types.PrepareRenameParams, {"position": AT}),
    (types.TEXT_DOCUMENT_REFERENCES, types.ReferenceParams, {"position": AT, "context": types.ReferenceContext(True)}),
    (types.TEXT_DOCUMENT_RENAME, types.RenameParams, {"position": AT, "new_name": "wide"}),
    (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, types.SemanticTokensParams, {}),
    (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, types.SemanticTokensRangeParams, {"range": ALL}),
    (types.TEXT_DOCUMENT_FORMATTING, types.DocumentFormattingParams, {"options": types.FormattingOptions(4, True)}),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.asyncio(loop_scope="module")
async def test_every_request_is_answered(client: LanguageClient, tmp_path: Path) -> None:
    text = opened(client, TEXT, tmp_path)
    for method, params, more in OURS:
        answer = await client.protocol.send_request_async(method, params(text_document=text, **more))
        assert answer, method
    names = await client.workspace_symbol_async(types.WorkspaceSymbolParams("R"))
    assert [n.name for n in names or ()] == ["R"]


@pytest.mark.slow
@pytest.mark.asyncio(loop_scope="module")
async def test_what_is_refused_is_said_to_the_editor_and_the_server_goes_on(
    client: LanguageClient, tmp_path: Path
) -> None:
    text = opened(client, TEXT, tmp_path, "other.scene")
    with pytest.raises(JsonRpcException, match="`R` is already a param"):
        await client.text_document_rename_async(types.RenameParams(text, AT, "R"))
    found = await client.text_document_definition_async(types.DefinitionParams(text, AT))
    assert isinstance(found, types.Location)
    assert found.range.start == types.Position(0, 6)


def asked(document: Document, method: str, params: type[Any], more: dict[str, Any]) -> None:
    """One request, as the server answers it; a reason why something is not done is an answer."""
    identifier = types.TextDocumentIdentifier("file:///a.scene")
    own = SimpleNamespace(documents={identifier.uri: document})
    feature = server.FEATURES[method]
    module, function = feature.answer.split(":")
    answer = getattr(import_module(f"softmark.interpreter.language_server.{module}"), function)
    try:
        answer(own if feature.wide else document, params(text_document=identifier, **more))
    except RequestRefused:
        return


def prefixes(count: int) -> Iterator[tuple[str, Document]]:
    """Beginnings of shipped scenes, each ended by chance."""
    chance, scenes = random.Random(SEED), sorted(ROOT.rglob("*.scene"))
    for _ in range(count):
        file = chance.choice(scenes)
        text = file.read_text(encoding="utf-8")
        end = chance.randrange(len(text) + 1)
        yield f"{file.name}[:{end}]", Document(text[:end], file.parent, file.with_name("begun.scene"))


@pytest.fixture
def alone() -> Iterator[None]:
    """Without what other tests have left, which Python would look through for cycles in the midst of a request."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.mark.slow
@pytest.mark.usefixtures("alone")
def test_a_text_that_is_begun_has_its_answers_in_time() -> None:
    late = []
    for name, document in prefixes(PREFIXES):
        document.check_result  # noqa: B018  # which the server has done for its messages
        end = document.position(max(len(document.text.rstrip()) - 1, 0))
        for method, params, more in OURS:
            here = {**more, **({"position": end} if "position" in more else {})}
            here |= {"range": whole(document)} if "range" in more else {}
            begun = time.process_time()
            asked(document, method, params, here)
            if (taken := time.process_time() - begun) > IN_TIME:
                late.append(f"{name} {method}: {taken:.2f} s")
    assert not late


@pytest.mark.slow
@pytest.mark.asyncio(loop_scope="module")
async def test_a_scene_is_looked_at_again_when_what_it_uses_has_changed(client: LanguageClient, tmp_path: Path) -> None:
    used = tmp_path / "soft.scene"
    used.write_text("param nu = 0.49\n", encoding="utf-8")
    text = opened(client, 'use "soft.scene" as soft\nparam a = soft.nu + 1\n', tmp_path, "uses.scene")
    assert not errors(await said(client, text))
    used.write_text("param mu = 0.49\n", encoding="utf-8")
    event = types.FileEvent(used.as_uri(), types.FileChangeType.Changed)
    client.workspace_did_change_watched_files(types.DidChangeWatchedFilesParams([event]))
    assert errors(await said(client, text)) == ["E201"]


def errors(found: list[types.Diagnostic]) -> list[Any]:
    """The codes of the errors among messages."""
    return [d.code for d in found if d.severity == types.DiagnosticSeverity.Error]
