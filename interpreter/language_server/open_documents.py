"""Documents that are open in an editor, in their latest state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from lsprotocol import types
from pygls.uris import to_fs_path

from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.field_schema import Vocabulary
from softmark.interpreter.language_server.background_checks import CheckScheduler
from softmark.interpreter.language_server.editor_plugins import Plugins
from softmark.interpreter.language_server.text_document import Document
from softmark.interpreter.validation.constructor_registry import CATALOGUE

if TYPE_CHECKING:
    from pygls.lsp.server import LanguageServer


class OpenDocuments:
    """Open documents by URI, with their server and its plugins."""

    def __init__(self, server: LanguageServer, plugins: Sequence[str] = ()) -> None:
        self.server = server
        self.documents: dict[str, Document] = {}
        self.checks = CheckScheduler(server, self.documents)
        self.plugins = Plugins(server, plugins, self.checks.do, self._recheck_after_plugins)
        self._waiting: set[str] = set()  # URIs of texts that wait for plugins

    def open(self, item: types.TextDocumentItem) -> None:
        """Add a text that the editor has opened."""
        self._store_document(item.uri, self._document(item.uri, item.text, item.version))

    def change(
        self, which: types.VersionedTextDocumentIdentifier, changes: Sequence[types.TextDocumentContentChangeEvent]
    ) -> None:
        """Apply changes to a text, one after the other."""
        now = before = self.documents.get(which.uri) or self._document(which.uri, "")
        for change in changes:
            now = self._document(which.uri, apply_change(now, change), which.version, before.read)
        self._store_document(which.uri, now)

    def again(self, uri: str) -> None:
        """Discard cached results of a text and check it again, because files that it names may have changed."""
        self._store_document(uri, replace(self.documents[uri], vocabulary=self.plugins.vocabulary))

    def close(self, uri: str) -> None:
        """Remove a text that has been closed."""
        self.documents.pop(uri, None)
        self.checks.forget(uri)

    @property
    def _has_snippet_support(self) -> bool:
        known = self.server.client_capabilities.text_document
        item = known.completion.completion_item if known and known.completion else None
        return bool(item and item.snippet_support)

    def _store_document(self, uri: str, now: Document) -> None:
        self.documents[uri] = now
        if self.plugins.loading:
            self._waiting.add(uri)
        else:
            self.checks.schedule_check(uri)

    def _document(self, uri: str, text: str, version: int | None = None, earlier: Scene | None = None) -> Document:
        return document(uri, text, version, self._has_snippet_support, earlier, self.plugins.vocabulary)

    def _recheck_after_plugins(self, changed: bool) -> None:
        """Check all texts again if loaded plugins `changed` the vocabulary, else only texts that waited for plugins."""
        waiting, self._waiting = self._waiting, set()
        for uri in list(self.documents if changed else waiting & self.documents.keys()):
            self.again(uri)
        can = self.server.client_capabilities.workspace
        if changed and can and can.semantic_tokens and can.semantic_tokens.refresh_support:
            self.server.workspace_semantic_tokens_refresh(None)
        if changed and can and can.inlay_hint and can.inlay_hint.refresh_support:
            self.server.workspace_inlay_hint_refresh(None)


def document(
    uri: str, text: str, version: int | None = None, snippets: bool = False, earlier: Scene | None = None,
    vocabulary: Vocabulary = CATALOGUE,
) -> Document:  # fmt: skip
    """Return the document of a text; if it has no file, named files are searched in the working folder."""
    path = to_fs_path(uri)
    if path is not None and "\0" in path:  # URI without a file
        path = None
    file = Path(path) if path else None
    return Document(text, file.parent if file else Path(), file, version, snippets, uri, earlier, vocabulary)


def apply_change(before: Document, change: types.TextDocumentContentChangeEvent) -> str:
    """Return the text after one change, which replaces a range or the whole text."""
    if not isinstance(change, types.TextDocumentContentChangePartial):
        return change.text
    start, end = before.offset(change.range.start), before.offset(change.range.end)
    return before.text[:start] + change.text + before.text[max(start, end) :]
