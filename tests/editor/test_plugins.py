"""Words of plugins in an editor: of those that whoever starts the server, or the editor, names, and of no others."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest

pytest.importorskip("pytest_lsp")

import pytest_lsp
from editor_client import COMMAND, LOOP, began, opened, said
from editor_texts import LINES, SCENE
from lsprotocol import types
from pytest_lsp import ClientServerConfig, LanguageClient

from softmark.interpreter.editor.document import Document
from softmark.interpreter.editor.lenses import lenses
from softmark.interpreter.editor.server import asked_plugins

pytestmark = LOOP
PARTS = Path(__file__).parents[1] / "errors" / "parts"
SWAY, BROKEN = PARTS / "sway_plugin.py", PARTS / "broken_plugin.py"
WORD = "metric aside = sway(end)\n"


@pytest_lsp.fixture(
    scope="module", config=ClientServerConfig(server_command=[*COMMAND, "--plugin", str(SWAY), "--plugin", str(BROKEN)])
)
async def client(lsp_client: LanguageClient) -> AsyncIterator[None]:
    await began(lsp_client)
    yield
    await lsp_client.shutdown_session()


async def test_words_of_a_plugin_are_words(client: LanguageClient, tmp_path: Path) -> None:
    """They are no errors, are proposed, and have their meaning; a plugin that is broken is said, and stops nothing."""
    text = opened(client, SCENE + WORD, tmp_path)
    found = await said(client, text)
    assert [d.code for d in found if d.severity == types.DiagnosticSeverity.Error] == []
    (broken,) = [d for d in found if d.code == "W730"]
    (place,) = broken.related_information or ()
    assert place.location.uri == BROKEN.as_uri()
    at = types.Position(LINES, WORD.index("sway") + 2)
    offered = await client.text_document_completion_async(types.CompletionParams(text, at))
    assert isinstance(offered, types.CompletionList)
    assert "sway" in [item.label for item in offered.items]
    shown = await client.text_document_hover_async(types.HoverParams(text, at))
    assert shown is not None
    assert "goes sideways" in str(shown.contents)
    inside = types.Position(LINES, WORD.index("end"))
    call = await client.text_document_signature_help_async(types.SignatureHelpParams(text, inside))
    assert call is not None
    assert "sway(probe" in call.signatures[0].label


async def test_who_names_none_has_none(tmp_path: Path) -> None:
    document = Document(SCENE + WORD, tmp_path, tmp_path / "a.scene")
    assert [d.code for d in document.checked[1] if d.severity == "error"] != []
    own = Document(SCENE + WORD, tmp_path, tmp_path / "a.scene", plugins=(str(SWAY),))
    assert [d.code for d in own.checked[1] if d.severity == "error"] == []
    asked = types.CodeLensParams(types.TextDocumentIdentifier(own.uri))
    commands = [lens.command.arguments for lens in lenses(own, asked) if lens.command]
    assert all(list(words or ())[-2:] == ["--plugin", str(SWAY)] for words in commands)


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (None, ()),
        ({}, ()),
        ({"plugins": None}, ()),
        ({"plugins": "sway.py"}, ()),
        ({"plugins": [3, "", "own.py", "installed"]}, ("own.py", "installed")),
    ],
)
async def test_what_an_editor_names(given: object, found: tuple[str, ...], tmp_path: Path) -> None:
    """Files lie in its folder; what is no list of names names none."""
    (tmp_path / "own.py").touch()
    params = types.InitializeParams(
        types.ClientCapabilities(), root_uri=tmp_path.as_uri(), initialization_options=given
    )
    assert asked_plugins(params) == tuple(str(tmp_path / n) if n == "own.py" else n for n in found)
