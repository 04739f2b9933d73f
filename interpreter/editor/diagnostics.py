"""What is wrong with a text while it is written, published when the writer pauses for a moment."""

from __future__ import annotations

import asyncio
import sys
import traceback
from typing import TYPE_CHECKING

from lsprotocol import types

from softmark.grammar.diagnostic import Diagnostic, encodable
from softmark.interpreter.editor.document import Document

if TYPE_CHECKING:
    from pygls.lsp.server import LanguageServer

PAUSE = 0.01  # s, in which further changes that are on their way arrive
SEVERITY = {"error": types.DiagnosticSeverity.Error, "warning": types.DiagnosticSeverity.Warning}


class Checks:
    """Checks that are due, one of each text: a change while one is due replaces it."""

    def __init__(self, server: LanguageServer, documents: dict[str, Document]) -> None:
        self.server, self.documents = server, documents
        self._due: dict[str, asyncio.TimerHandle] = {}

    def due(self, uri: str) -> None:
        """The latest state of a text is to be checked."""
        self._cancel(uri)
        self._due[uri] = asyncio.get_running_loop().call_later(PAUSE, self._check, uri)

    def forget(self, uri: str) -> None:
        """A text was closed: nothing is said of it any more."""
        self._cancel(uri)
        self._publish(uri, [], None)

    def _cancel(self, uri: str) -> None:
        if waiting := self._due.pop(uri, None):
            waiting.cancel()

    def _check(self, uri: str) -> None:
        self._due.pop(uri, None)
        try:
            document = self.documents[uri]
            self._publish(uri, diagnostics(document), document.version)
        except Exception:  # the next state may be checked all the same
            traceback.print_exc(file=sys.stderr)

    def _publish(self, uri: str, found: list[types.Diagnostic], version: int | None) -> None:
        params = types.PublishDiagnosticsParams(uri, found, version)
        self.server.text_document_publish_diagnostics(params)


def diagnostics(document: Document) -> list[types.Diagnostic]:
    """All that `dsl check` says of a text."""
    return [diagnostic(document, found) for found in document.checked[1]]


def diagnostic(document: Document, found: Diagnostic) -> types.Diagnostic:
    """One message; what another file is blamed for stands at the first character of this one."""
    here = found.source is not None and found.source.name == document.source.name
    at = document.range(found.span) if here and found.span else types.Range(types.Position(0, 0), types.Position(0, 0))
    remarks = [found.message, *([f"help: {found.help}"] if found.help else []), *(f"note: {n}" for n in found.notes)]
    return types.Diagnostic(at, encodable("\n".join(remarks)), SEVERITY[found.severity], found.code, source="softmark")
