"""Language server, whose requests are each answered by a function in a module of this package.

To answer a further request: write a module with a function `f(document, params)` that returns the method's result in
`lsprotocol.types`, and add a line in FEATURES. If the parameters name no text document, or the feature is `wide`, the
function gets all open documents (`open_documents.py`) instead. An exception is reported on standard error and the
answer is None, except for a refusal with a reason (`request_error.py`), which the editor shows.
"""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Callable, Generator, Iterator, Sequence
from importlib import import_module
from threading import Event
from typing import Any, BinaryIO, NamedTuple

from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pygls.io_ import StdoutWriter
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol, lsp_method
from pygls.protocol.json_rpc import JsonRPCNotification

from softmark import __version__
from softmark.interpreter.language_server import quick_fixes, semantic_tokens
from softmark.interpreter.language_server.message_reader import MALFORMED, Message, read_messages
from softmark.interpreter.language_server.open_documents import OpenDocuments
from softmark.interpreter.language_server.request_error import RequestRefused, report, silence_refusals
from softmark.interpreter.language_server.text_document import Document
from softmark.scenes import ROOT

LATER = (50_000, 20, 20)  # garbage collection thresholds: a state of a text has some ten thousand objects
TRIGGERS = ["(", ",", "=", ".", '"', "/", " "]  # characters that trigger completion, in addition to letters


class ClosingWriter(StdoutWriter):
    """Output to the editor that drops what is sent after the connection is closed, such as late diagnostics."""

    def write(self, data: bytes) -> None:
        """Send a message, or drop it if the output is closed."""
        try:
            super().write(data)
        except ValueError:
            if not self._stdout.closed:
                raise


class Feature(NamedTuple):
    """Feature of the server: module and function that answer a request, and the capability announced to the editor."""

    answer: str
    options: Any = None
    wide: bool = False  # the function gets all open documents, although its parameters name one


FEATURES: dict[str, Feature] = {
    types.INITIALIZED: Feature("file_watching:watch"),
    types.TEXT_DOCUMENT_CODE_ACTION: Feature("quick_fixes:actions", types.CodeActionOptions(list(quick_fixes.KINDS))),
    types.TEXT_DOCUMENT_CODE_LENS: Feature("code_lenses:lenses"),
    types.TEXT_DOCUMENT_COMPLETION: Feature("code_completion:complete", types.CompletionOptions(TRIGGERS)),
    types.TEXT_DOCUMENT_DEFINITION: Feature("go_to_definition:definition"),
    types.TEXT_DOCUMENT_DID_SAVE: Feature("file_watching:handle_save", wide=True),
    types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT: Feature("go_to_definition:highlights"),
    types.TEXT_DOCUMENT_DOCUMENT_SYMBOL: Feature("document_symbols:symbols"),
    types.TEXT_DOCUMENT_FOLDING_RANGE: Feature("document_symbols:folds"),
    types.TEXT_DOCUMENT_FORMATTING: Feature("document_formatting:format_document"),
    types.TEXT_DOCUMENT_HOVER: Feature("hover_text:hover"),
    types.TEXT_DOCUMENT_INLAY_HINT: Feature("inlay_hints:hints"),
    types.TEXT_DOCUMENT_PREPARE_RENAME: Feature("rename_symbol:prepare_rename"),
    types.TEXT_DOCUMENT_REFERENCES: Feature("go_to_definition:references", wide=True),
    types.TEXT_DOCUMENT_RENAME: Feature("rename_symbol:rename", wide=True),
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: Feature("semantic_tokens:colours", semantic_tokens.LEGEND),
    types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE: Feature("semantic_tokens:colours_between", semantic_tokens.LEGEND),
    types.TEXT_DOCUMENT_SIGNATURE_HELP: Feature(
        "signature_help:signature", types.SignatureHelpOptions(["(", ","], ["="])
    ),
    types.WORKSPACE_DID_CHANGE_CONFIGURATION: Feature("file_watching:handle_settings"),
    types.WORKSPACE_DID_CHANGE_WATCHED_FILES: Feature("file_watching:handle_file_changes"),
    types.WORKSPACE_SYMBOL: Feature("document_symbols:find_workspace_symbols"),
}


class Protocol(LanguageServerProtocol):
    """Protocol of pygls with another class of documents.

    The documents of pygls also split lines at form feeds, unlike the specification.
    """

    _server: Server

    @lsp_method(types.INITIALIZE)
    def lsp_initialize(self, params: types.InitializeParams) -> Generator[Any, Any, types.InitializeResult]:
        """Announce UTF-16 columns, which every client supports, and load plugins while the client reads the answer."""
        if params.capabilities.general:
            params.capabilities.general.position_encodings = None
        answer = yield from super().lsp_initialize(params)
        self._server.opened.plugins.configure(params.initialization_options)
        self._server.opened.plugins.load()
        return answer

    def structure_message(self, data: dict[str, Any]) -> Any:
        """Parse a message of the client; answer a request with invalid parameters with an error."""
        try:
            return super().structure_message(data)
        except JsonRpcException as error:
            if "method" in data and isinstance(data.get("id"), int | str):
                self._send_response(data["id"], error=error.to_response_error())
            return JsonRPCNotification(
                method="$/notRead", jsonrpc=self.VERSION, params=None
            )  # no handler answers this notification

    def handle_message(self, message: Any) -> None:
        """Answer a malformed message of the client with an error, and let pygls handle all others."""
        if getattr(message, "method", None) != MALFORMED:
            super().handle_message(message)
            return
        told = message.params
        error = {"code": told.code, "message": told.reason}
        self._send_data({"jsonrpc": self.VERSION, "id": told.answers, "error": error})

    @property
    def left(self) -> bool:
        """True if the editor requested shutdown before it exited."""
        return self._shutdown

    @lsp_method(types.TEXT_DOCUMENT_DID_OPEN)
    def lsp_text_document__did_open(self, params: types.DidOpenTextDocumentParams) -> None:
        """Add a text that was opened."""
        self._server.opened.open(params.text_document)

    @lsp_method(types.TEXT_DOCUMENT_DID_CHANGE)
    def lsp_text_document__did_change(self, params: types.DidChangeTextDocumentParams) -> None:
        """Apply changes to an open text."""
        self._server.opened.change(params.text_document, params.content_changes)

    @lsp_method(types.TEXT_DOCUMENT_DID_CLOSE)
    def lsp_text_document__did_close(self, params: types.DidCloseTextDocumentParams) -> None:
        """Remove a text that was closed."""
        self._server.opened.close(params.text_document.uri)


class Server(LanguageServer):
    """Language server of one editor, with its open documents."""

    def __init__(self, plugins: Sequence[str] = ()) -> None:
        super().__init__("softmark", __version__, protocol_cls=Protocol)
        self.protocol: Protocol
        self.opened = OpenDocuments(self, plugins)
        for method, feature in FEATURES.items():
            self.feature(method, feature.options)(self._make_handler(feature))

    def listen(self, incoming: BinaryIO, outgoing: BinaryIO) -> None:
        """Handle the messages of an editor until it exits.

        `start_io` of pygls would parse each message once more.
        """
        self._stop_event = Event()
        self.protocol.set_writer(ClosingWriter(outgoing))
        try:
            asyncio.run(self._handle(read_messages(incoming)))
        except (
            BrokenPipeError,
            KeyboardInterrupt,
            SystemExit,
        ):  # raised at the editor's `exit`; `serve` returns the exit status
            pass
        finally:
            self.shutdown()  # type: ignore[no-untyped-call]  # pygls does not annotate it

    async def _handle(self, messages: Iterator[Message]) -> None:
        loop = asyncio.get_running_loop()
        while message := await loop.run_in_executor(self.thread_pool, next, messages, None):
            try:
                self.protocol.handle_message(self.protocol.structure_message(message))
            except Exception as error:  # the editor can continue without this answer
                report(error)

    def _make_handler(self, feature: Feature) -> Callable[[Any], Any]:
        module, function = feature.answer.split(":")

        def answered(params: Any) -> Any:
            try:
                asked = getattr(params, "text_document", None)
                known = None if asked is None else self.opened.documents.get(asked.uri)
                about = self.opened if asked is None or (known and feature.wide) else known
                name = f"softmark.interpreter.language_server.{module}"
                return None if about is None else getattr(import_module(name), function)(about, params)
            except RequestRefused:
                raise
            except (Exception, SystemExit) as error:  # the editor can continue without this answer
                report(error)
                return None

        return answered


def serve(incoming: BinaryIO, outgoing: BinaryIO, plugins: Sequence[str] = ()) -> int:
    """Answer an editor's requests until it exits, and return the exit status of the protocol.

    The status is 0 if the editor requested shutdown before its exit, else 1. `plugins` are files or names of plugins to
    load in addition to those in the editor's settings. Modules for the first text are loaded during initialisation.
    """
    gc.set_threshold(*LATER)
    silence_refusals()
    server = Server(plugins)
    server.opened.checks.queue_warm_up(_preload)
    server.listen(incoming, outgoing)
    return 0 if server.protocol.left else 1


def _preload() -> None:
    """Load all constructors, and the modules that answer requests."""
    file = ROOT / "beams" / "silicone-beam.scene"
    assert Document(file.read_text(encoding="utf-8"), file.parent, file).check_result[0]
    for feature in FEATURES.values():
        import_module(f"softmark.interpreter.language_server.{feature.answer.split(':')[0]}")
