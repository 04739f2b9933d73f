"""The language server: requests of an editor, each answered by a function of a file of this room.

To answer one more request: a file with a function `f(document, params)` that returns what `lsprotocol.types` says of
the method, and a line in FEATURES. Of a method whose parameters name no text document the function gets all that is
open in place of one document (`opened.py`). What a function raises is said on standard error, the answer is None.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Generator
from importlib import import_module
from typing import Any, BinaryIO, NamedTuple

from lsprotocol import types
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol, lsp_method

from softmark import __version__
from softmark.interpreter.editor.opened import Opened


class Feature(NamedTuple):
    """Who answers a request: a module of this room and a function of it; and what an editor is told beforehand."""

    answer: str
    options: Any = None


FEATURES: dict[str, Feature] = {}


class Protocol(LanguageServerProtocol):
    """As pygls has it, but texts are ours: its own splits lines where the protocol does not, at form feeds for one."""

    _server: Server

    @lsp_method(types.INITIALIZE)
    def lsp_initialize(self, params: types.InitializeParams) -> Generator[Any, Any, types.InitializeResult]:
        """Columns count in UTF-16, which every client knows."""
        if params.capabilities.general:
            params.capabilities.general.position_encodings = None
        return (yield from super().lsp_initialize(params))

    @lsp_method(types.TEXT_DOCUMENT_DID_OPEN)
    def lsp_text_document__did_open(self, params: types.DidOpenTextDocumentParams) -> None:
        """A text is in an editor from now on."""
        self._server.opened.open(params.text_document)

    @lsp_method(types.TEXT_DOCUMENT_DID_CHANGE)
    def lsp_text_document__did_change(self, params: types.DidChangeTextDocumentParams) -> None:
        """It was changed in places."""
        self._server.opened.change(params.text_document, params.content_changes)

    @lsp_method(types.TEXT_DOCUMENT_DID_CLOSE)
    def lsp_text_document__did_close(self, params: types.DidCloseTextDocumentParams) -> None:
        """It is in no editor any more."""
        self._server.opened.close(params.text_document.uri)


class Server(LanguageServer):
    """The server of one editor, and what is open there."""

    def __init__(self) -> None:
        super().__init__("softmark", __version__, protocol_cls=Protocol)
        self.opened = Opened(self)
        for method, feature in FEATURES.items():
            self.feature(method, feature.options)(self._answering(feature.answer))

    def _answering(self, answer: str) -> Callable[[Any], Any]:
        module, function = answer.split(":")

        def answered(params: Any) -> Any:
            try:
                asked = getattr(params, "text_document", None)
                about = self.opened if asked is None else self.opened.documents.get(asked.uri)
                name = f"softmark.interpreter.editor.{module}"
                return None if about is None else getattr(import_module(name), function)(about, params)
            except Exception:  # an editor goes on without this answer
                traceback.print_exc(file=sys.stderr)
                return None

        return answered


def serve(incoming: BinaryIO, outgoing: BinaryIO) -> None:
    """Answer an editor until it leaves."""
    Server().start_io(incoming, outgoing)
