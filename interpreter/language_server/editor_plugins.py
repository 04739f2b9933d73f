"""Plugins whose words an editor knows: those that the command line or its settings name, and no others.

They are loaded beside the requests, anew where their text has changed; until then nothing is checked, so that no word
of theirs is called unknown. What is wrong with one is shown as a message, once, and the others stand.
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
from softmark.interpreter.language.plugin_words import told
from softmark.interpreter.validation.constructor_registry import CATALOGUE, vocabulary_with

if TYPE_CHECKING:
    from pygls.lsp.server import LanguageServer

SUFFIX = ".py"
LATE = 10.0  # s, after which an editor is told that a plugin is not loaded yet
FORM = 'the setting softmark.plugins is a list of Python files or names of installed plugins, such as ["gel.py"]'


class Plugins:
    """The plugins of an editor and the words that there are with them; `renewed` is called once they are loaded."""

    def __init__(
        self, server: LanguageServer, started: Sequence[str], do: Callable[[Callable[[], object]], None],
        renewed: Callable[[bool], None],
    ) -> None:  # fmt: skip
        self.server, self._started, self._do, self._renewed = server, tuple(started), do, renewed
        self.vocabulary = CATALOGUE
        self.loading = False
        self._set: tuple[str, ...] = ()
        self._latest: object = None  # which loading counts
        self._shown: set[str] = set()

    def configure(self, settings: Any) -> None:
        """Take what settings name; those that say nothing about softmark change nothing."""
        own = settings.get("softmark") if isinstance(settings, dict) else None
        if not isinstance(own, dict) or "plugins" not in own:
            return
        named = own["plugins"] or []
        if isinstance(named, list) and all(isinstance(one, str) for one in named):
            self._set = tuple(self._placed(one) for one in named)
        else:
            self._show(FORM)

    def load(self) -> None:
        """Load what is named, and what has changed since it was."""
        named = (*self._started, *self._set)
        if not named and not self.vocabulary.plugins and not self.loading:
            return
        self.loading, self._latest = True, object()
        loop = asyncio.get_running_loop()
        late = loop.call_later(LATE, self._show, f"these plugins take long to load: {', '.join(named)}")
        self._do(partial(self._load, loop, self._latest, named, late))

    def has(self, uris: Sequence[str]) -> bool:
        """Whether one of these is the file of a plugin, or may be that of one that is not there yet."""
        files = {os.path.realpath(path) for uri in uris if uri.endswith(SUFFIX) and (path := to_fs_path(uri))}
        named = {os.path.realpath(one) for one in (*self._started, *self._set)}
        return bool(files & (named | {plugin.file for plugin in self.vocabulary.plugins}))

    def _placed(self, named: str) -> str:
        """The whole path of a file, which stands in the folder that is open; names of installed plugins stay."""
        root = self.server.workspace.root_path
        by_path = named.endswith(SUFFIX) or "/" in named or os.sep in named
        return str(Path(root or "", named).absolute()) if by_path else named

    def _load(
        self, loop: asyncio.AbstractEventLoop, which: object, named: Sequence[str], late: asyncio.TimerHandle
    ) -> None:
        """In the thread of checks, which nothing that a plugin does may end."""
        try:
            vocabulary, found = vocabulary_with(named)
        except BaseException as error:
            vocabulary, found = CATALOGUE, [Diagnostic("E731", f"plugins cannot be loaded: {told(error)}", None, None)]
        loop.call_soon_threadsafe(self._loaded, which, vocabulary, found, late)

    def _loaded(self, which: object, vocabulary: Any, found: Sequence[Diagnostic], late: asyncio.TimerHandle) -> None:
        late.cancel()
        if which is not self._latest:
            return
        new = vocabulary.plugins != self.vocabulary.plugins
        self.vocabulary, self.loading = (vocabulary if new else self.vocabulary), False
        said = [in_brief(one) for one in found]
        for text in said:
            self._show(text)
        self._shown.intersection_update(said)  # what is mended and breaks again is said again
        self._renewed(new)

    def _show(self, text: str) -> None:
        if text not in self._shown:
            self._shown.add(text)
            self.server.window_show_message(types.ShowMessageParams(types.MessageType.Warning, text))


def in_brief(found: Diagnostic) -> str:
    """A message with its line and its help, on one line."""
    line = f" (line {found.span.line})" if found.span else ""
    return f"{found.code}: {found.message}{line}" + (f"; {found.help}" if found.help else "")
