"""A language server as a real client meets it: pytest-lsp over its standard input and output, for a file of tests.

A test file imports `client` after `pytest.importorskip("pytest_lsp")`; its tests are `async` and marked LOOP.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_lsp
from lsprotocol import types
from pytest_lsp import ClientServerConfig, LanguageClient, client_capabilities

LOOP = [pytest.mark.slow, pytest.mark.asyncio(loop_scope="module")]
# one message of each state: what is said meanwhile where a check takes long would come before it on a busy machine
PATIENT = "from softmark.interpreter.language_server import background_checks; background_checks.PATIENCE = 600.0; "
DSL = f"{PATIENT}import sys; from softmark.interpreter.cli.main import main; sys.exit(main())"
LATEST = 60.0  # s that a test waits for a message
COMMAND = [sys.executable, "-c", DSL, "lsp"]

_arrived: dict[LanguageClient, asyncio.Queue[types.PublishDiagnosticsParams]] = {}


@pytest_lsp.fixture(scope="module", config=ClientServerConfig(server_command=COMMAND))
async def client(lsp_client: LanguageClient) -> AsyncIterator[None]:
    """A server of its own for a file of tests, and an editor that can do what VS Code can."""
    await began(lsp_client)
    yield
    await lsp_client.shutdown_session()


async def began(client: LanguageClient) -> None:
    """The session has begun, and no message is lost: two may arrive at once, and a test waits for one."""
    publish = types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS
    arrived, known = _arrived.setdefault(client, asyncio.Queue()), client.protocol.fm.features[publish]

    def keep(params: types.PublishDiagnosticsParams) -> None:
        arrived.put_nowait(params)
        known(params)

    client.protocol.fm.features[publish] = keep
    refreshed = (types.WORKSPACE_INLAY_HINT_REFRESH, types.WORKSPACE_SEMANTIC_TOKENS_REFRESH)
    for request in (types.CLIENT_REGISTER_CAPABILITY, *refreshed):
        client.feature(request)(lambda params: None)  # which the server asks of it, and needs no answer to
    capabilities = client_capabilities("visual-studio-code")
    await client.initialize_session(types.InitializeParams(capabilities))


def opened(client: LanguageClient, text: str, folder: Path, name: str = "some.scene") -> types.TextDocumentIdentifier:
    """A text that is open in the editor, as a file that need not exist."""
    uri = (folder / name).as_uri()
    item = types.TextDocumentItem(uri, "softmark", 1, text)
    client.text_document_did_open(types.DidOpenTextDocumentParams(item))
    return types.TextDocumentIdentifier(uri)


async def said(
    client: LanguageClient, of: types.TextDocumentIdentifier, version: int | None = None
) -> list[types.Diagnostic]:
    """What the server has published of a text and no test has looked at yet, of any state or of one."""
    while True:
        found = await asyncio.wait_for(_arrived[client].get(), LATEST)
        if found.uri == of.uri and version in (None, found.version):
            return list(found.diagnostics)
