"""Words of plugins in the editor: of those that it names, by the command line or by settings, and of no others."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

pytest.importorskip("pytest_lsp")

import pytest_lsp
from editor_client import COMMAND, LOOP, began, opened, said
from editor_texts import LINES, SCENE
from lsprotocol import types
from pytest_lsp import ClientServerConfig, LanguageClient

from softmark.interpreter.language_server.code_lenses import lenses
from softmark.interpreter.language_server.text_document import Document
from softmark.interpreter.validation.constructor_registry import vocabulary_with

pytestmark = LOOP
PARTS = Path(__file__).parents[1] / "errors" / "parts"
NAMED = [part for name in ("breaking_plugin.py", "broken_plugin.py") for part in ("--plugin", str(PARTS / name))]
UNKNOWN = ["E730"]  # a word that nobody has, unless the broken plugin does
SWAY = (PARTS / "sway_plugin.py").read_text(encoding="utf-8")


@pytest_lsp.fixture(scope="module", config=ClientServerConfig(server_command=[*COMMAND, *NAMED]))
async def client(lsp_client: LanguageClient) -> AsyncIterator[None]:
    """A server that is started with a plugin whose words can be used, and with a broken one."""
    await began(lsp_client)
    yield
    await lsp_client.shutdown_session()


def configure(client: LanguageClient, *plugins: object) -> None:
    settings = {"softmark": {"plugins": list(plugins)}}
    client.workspace_did_change_configuration(types.DidChangeConfigurationParams(settings))


def errors(found: list[types.Diagnostic]) -> list[object]:
    return [d.code for d in found if d.severity == types.DiagnosticSeverity.Error]


async def shown(client: LanguageClient, part: str) -> str:
    """The message that the server shows and that has a text in it; it may come a little later."""
    for _ in range(600):
        if found := [m.message for m in client.messages if part in m.message]:
            return found[-1]
        await asyncio.sleep(0.05)
    raise AssertionError([m.message for m in client.messages])


async def test_a_broken_plugin_is_told_and_the_words_of_the_other_are_known(
    client: LanguageClient, tmp_path: Path
) -> None:
    text = opened(client, SCENE + "metric a = lean(end)\n", tmp_path)
    assert errors(await said(client, text)) == []
    assert "broken_plugin.py` is broken" in await shown(client, "W730")


async def test_every_answer_knows_the_words(client: LanguageClient, tmp_path: Path) -> None:
    line = "metric a = lean(end)"
    text = opened(client, SCENE + line + "\n", tmp_path, "words.scene")
    await said(client, text)
    behind, within = types.Position(LINES, line.index("lean")), types.Position(LINES, line.index("end"))
    found = await client.text_document_completion_async(types.CompletionParams(text, behind))
    assert isinstance(found, types.CompletionList)
    assert {"lean", "ratio", "displacement"} <= {item.label for item in found.items}
    hovered = await client.text_document_hover_async(types.HoverParams(text, behind))
    assert hovered is not None
    assert "From the plugin" in str(hovered.contents)
    kinds = await client.text_document_hover_async(types.HoverParams(text, types.Position(LINES, 2)))
    assert kinds is not None
    assert "ratio" in str(kinds.contents)
    call = await client.text_document_signature_help_async(types.SignatureHelpParams(text, within))
    assert call is not None
    assert call.signatures[0].label == "lean(probe, [share])"
    colours = await client.text_document_semantic_tokens_full_async(types.SemanticTokensParams(text))
    assert colours is not None
    end = types.ReferenceParams(types.ReferenceContext(False), text, within)
    places = await client.text_document_references_async(end) or ()
    assert within in [place.range.start for place in places]


async def test_settings_name_further_plugins_and_a_mended_one_is_taken_anew(
    client: LanguageClient, tmp_path: Path
) -> None:
    """A text that is open is looked at again, by whatever there is now; a file beside a scene is nobody's plugin."""
    file = tmp_path / "sway.py"
    file.write_text(SWAY, encoding="utf-8")
    text = opened(client, SCENE + "metric a = sway(end)\n", tmp_path, "set.scene")
    assert errors(await said(client, text)) == UNKNOWN
    configure(client, str(file))
    assert errors(await said(client, text)) == []
    file.write_text(SWAY.replace('{"sway"', '{"swing"'), encoding="utf-8")
    event = types.FileEvent(file.as_uri(), types.FileChangeType.Changed)
    client.workspace_did_change_watched_files(types.DidChangeWatchedFilesParams([event]))
    assert errors(await said(client, text)) == UNKNOWN
    file.write_text(SWAY, encoding="utf-8")
    client.text_document_did_save(types.DidSaveTextDocumentParams(text))
    assert errors(await said(client, text)) == []
    configure(client)
    assert errors(await said(client, text)) == UNKNOWN


async def test_what_is_named_and_cannot_be_used_is_told(client: LanguageClient, tmp_path: Path) -> None:
    configure(client, str(tmp_path / "nothing.py"))
    assert "cannot be read" in await shown(client, "E731")
    configure(client, 3)
    assert "to a list of" in await shown(client, "softmark.plugins")
    for name, does in {"leaves": "raise SystemExit(3)", "interrupts": "raise KeyboardInterrupt"}.items():
        file = tmp_path / f"{name}.py"
        file.write_text(SWAY + does, encoding="utf-8")
        configure(client, str(file))
        await shown(client, {"leaves": "SystemExit", "interrupts": "KeyboardInterrupt"}[name])
    configure(client)


async def test_a_word_that_fails_is_said_in_the_scene_and_ends_nothing(client: LanguageClient, tmp_path: Path) -> None:
    """By a plugin whose metric divides by zero wherever somebody asks for its unit."""
    file = tmp_path / "failing.py"
    failing = SWAY.replace('unit = "m"', "@property\n    def unit(self):\n        return 1 / 0")
    file.write_text(failing, encoding="utf-8")
    configure(client, str(file))
    text = opened(client, SCENE + "metric a = sway(end)\nexpect rod.a < 3 mm\n", tmp_path, "fails.scene")
    assert any("ZeroDivisionError" in d.message and "failing.py" in d.message for d in await said(client, text))
    configure(client)
    assert errors(await said(client, text)) == UNKNOWN


async def test_what_a_lens_runs_has_the_plugins(tmp_path: Path) -> None:
    (tmp_path / "sway.py").write_text(SWAY)
    named = str(tmp_path / "sway.py")
    vocabulary, found = vocabulary_with([named])
    assert not found
    document = Document(SCENE, tmp_path, tmp_path / "a.scene", vocabulary=vocabulary)
    offered = lenses(document, types.CodeLensParams(types.TextDocumentIdentifier(document.uri)))
    assert offered
    assert all(list(one.command.arguments or ())[-2:] == ["--plugin", named] for one in offered if one.command)
