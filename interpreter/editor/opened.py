"""The texts that are open in an editor, in their latest state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from lsprotocol import types
from pygls.uris import to_fs_path

from softmark.interpreter.editor.checks import Checks
from softmark.interpreter.editor.document import Document
from softmark.interpreter.language.scene import Scene

if TYPE_CHECKING:
    from pygls.lsp.server import LanguageServer


class Opened:
    """Documents by their URI, and the server that they are open with."""

    def __init__(self, server: LanguageServer) -> None:
        self.server = server
        self.documents: dict[str, Document] = {}
        self.checks = Checks(server, self.documents)

    def open(self, item: types.TextDocumentItem) -> None:
        """A text that has been opened."""
        self._have(item.uri, document(item.uri, item.text, item.version, self._snippets))

    def change(
        self, which: types.VersionedTextDocumentIdentifier, changes: Sequence[types.TextDocumentContentChangeEvent]
    ) -> None:
        """The same text after changes, one after the other."""
        now = before = self.documents.get(which.uri) or document(which.uri, "")
        for change in changes:
            now = document(which.uri, changed(now, change), which.version, self._snippets, before.read)
        self._have(which.uri, now)

    def again(self, uri: str) -> None:
        """The same text as if nothing were known of it: what it names may have changed."""
        self._have(uri, replace(self.documents[uri]))

    def close(self, uri: str) -> None:
        """A text that is no longer open."""
        self.documents.pop(uri, None)
        self.checks.forget(uri)

    @property
    def _snippets(self) -> bool:
        known = self.server.client_capabilities.text_document
        item = known.completion.completion_item if known and known.completion else None
        return bool(item and item.snippet_support)

    def _have(self, uri: str, now: Document) -> None:
        self.documents[uri] = now
        self.checks.due(uri)


def document(
    uri: str, text: str, version: int | None = None, snippets: bool = False, earlier: Scene | None = None
) -> Document:
    """A text of a URI; what lies in no file looks for files in the working folder."""
    path = to_fs_path(uri)
    file = Path(path) if path else None
    return Document(text, file.parent if file else Path(), file, version, snippets, uri, earlier)


def changed(before: Document, change: types.TextDocumentContentChangeEvent) -> str:
    """The text after one change of a part or of all of it."""
    if not isinstance(change, types.TextDocumentContentChangePartial):
        return change.text
    start, end = before.offset(change.range.start), before.offset(change.range.end)
    return before.text[:start] + change.text + before.text[max(start, end) :]
