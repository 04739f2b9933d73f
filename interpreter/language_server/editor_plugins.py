"""Plugins of an editor: only those named on the command line or in the editor's settings are loaded.

They are loaded in the thread of checks, and again after a change of their file. Checks wait until then, so that words
of a plugin are not reported as unknown. Errors of a plugin are shown once, and the other plugins remain usable.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsprotocol import types
from pygls.uris import to_fs_path

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.loaded_plugin import format_exception
from softmark.interpreter.validation.constructor_registry import CATALOGUE, vocabulary_with

if TYPE_CHECKING:
    from pygls.lsp.server import LanguageServer

SUFFIX = ".py"
LATE = 10.0  # s, after which the editor reports that a plugin is still loading
FORM = 'set softmark.plugins to a list of Python files or names of installed plugins, such as ["gel.py"]'


class Plugins:
    """Plugins of an editor, and the vocabulary extended by them; `renewed` is called after each loading."""

    def __init__(
        self, server: LanguageServer, started: Sequence[str], do: Callable[[Callable[[], object]], None],
        renewed: Callable[[bool], None],
    ) -> None:  # fmt: skip
        self.server, self._started, self._do, self._renewed = server, tuple(started), do, renewed
        self.vocabulary = CATALOGUE
        self.loading = False
        self._set: tuple[str, ...] = ()
        self._latest: object = None  # identity of the latest loading
        self._shown: set[str] = set()

    def configure(self, settings: Any) -> None:
        """Read plugin names from the editor's settings; settings without a softmark section change nothing."""
        own = settings.get("softmark") if isinstance(settings, dict) else None
        if not isinstance(own, dict) or "plugins" not in own:
            return
        named = own["plugins"] or []
        if isinstance(named, list) and all(isinstance(one, str) for one in named):
            self._set = tuple(self._absolute_plugin_path(one) for one in named)
        else:
            self._show_warning_once(FORM)

    def load(self) -> None:
        """Load named plugins that are new or have changed since they were loaded."""
        named = (*self._started, *self._set)
        if not named and not self.vocabulary.plugins and not self.loading:
            return
        self.loading, self._latest = True, object()
        loop = asyncio.get_running_loop()
        late = loop.call_later(LATE, self._show_warning_once, f"these plugins load slowly: {', '.join(named)}")
        self._do(partial(self._load, loop, self._latest, named, late))

    def has(self, uris: Sequence[str]) -> bool:
        """Return whether one of these URIs is the file of a plugin, or may become it."""
        files = {os.path.realpath(path) for uri in uris if uri.endswith(SUFFIX) and (path := to_fs_path(uri))}
        named = {os.path.realpath(one) for one in (*self._started, *self._set)}
        return bool(files & (named | {plugin.file for plugin in self.vocabulary.plugins}))

    def _absolute_plugin_path(self, named: str) -> str:
        """Return the absolute path of a plugin file in the open folder; names of installed plugins are unchanged."""
        root = self.server.workspace.root_path
        by_path = named.endswith(SUFFIX) or "/" in named or os.sep in named
        return str(Path(root or "", named).absolute()) if by_path else named

    def _load(
        self, loop: asyncio.AbstractEventLoop, which: object, named: Sequence[str], late: asyncio.TimerHandle
    ) -> None:
        """Load plugins in the thread of checks, catching any exception of a plugin."""
        try:
            vocabulary, found = vocabulary_with(named)
        except BaseException as error:
            vocabulary, found = (
                CATALOGUE,
                [Diagnostic("E731", f"plugins cannot be loaded: {format_exception(error)}", None, None)],
            )
        loop.call_soon_threadsafe(self._finish_loading, which, vocabulary, found, late)

    def _finish_loading(
        self, which: object, vocabulary: Any, found: Sequence[Diagnostic], late: asyncio.TimerHandle
    ) -> None:
        late.cancel()
        if which is not self._latest:
            return
        new = vocabulary.plugins != self.vocabulary.plugins
        self.vocabulary, self.loading = (vocabulary if new else self.vocabulary), False
        said = [format_in_one_line(one) for one in found]
        for text in said:
            self._show_warning_once(text)
        self._shown.intersection_update(said)  # an error that returns after a fix is shown again
        self._renewed(new)

    def _show_warning_once(self, text: str) -> None:
        if text not in self._shown:
            self._shown.add(text)
            self.server.window_show_message(types.ShowMessageParams(types.MessageType.Warning, text))


def format_in_one_line(found: Diagnostic) -> str:
    """Return a message with its line and its help on one line."""
    line = f" (line {found.span.line})" if found.span else ""
    return f"{found.code}: {found.message}{line}" + (f"; {found.help}" if found.help else "")
