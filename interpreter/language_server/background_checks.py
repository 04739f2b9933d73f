"""Checking what is open while it is written: the latest state alone, beside the requests and not before them.

A change makes a check due, which starts when nothing more has arrived for a moment: names, units and dimensions at
once, all else in a thread of its own. What that says of a state that is no longer the latest is dropped. Where it takes
long, what is known at once is said meanwhile, with what was said before of lines that stand there still.
"""

from __future__ import annotations

import asyncio
import gc
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import TYPE_CHECKING

from lsprotocol import types

from softmark.interpreter.language.plugin_words import blamed
from softmark.interpreter.language_server.published_diagnostics import START, diagnostics
from softmark.interpreter.language_server.request_refused import report
from softmark.interpreter.language_server.text_document import Document

if TYPE_CHECKING:
    from pygls.lsp.server import LanguageServer

PAUSE = 0.01  # s, in which further changes that are on their way arrive
PATIENCE = 0.1  # s, after which what is known is said
NEWLY = 0.001  # s, after which a thread lets another one on: an answer must not wait for a check


@dataclass(frozen=True)
class Said:
    """What was said of a state, all of it and what of it was known at once."""

    document: Document
    found: list[types.Diagnostic]
    at_once: list[types.Diagnostic]


class Checks:
    """The checks of all that is open with a server."""

    def __init__(self, server: LanguageServer, documents: dict[str, Document]) -> None:
        self.server, self.documents = server, documents
        self._due: dict[str, asyncio.TimerHandle] = {}
        self._said: dict[str, Said] = {}
        self._jobs: SimpleQueue[Callable[[], object]] = SimpleQueue()
        sys.setswitchinterval(NEWLY)
        threading.Thread(target=self._work, name="checks", daemon=True).start()

    def warm(self, *jobs: Callable[[], object]) -> None:
        """Do what the first text will need, before there is one."""
        for job in (*jobs, gc.collect, gc.freeze):
            self.do(job)

    def do(self, job: Callable[[], object]) -> None:
        """Do something in the thread, after what it has to do already."""
        self._jobs.put(job)

    def due(self, uri: str) -> None:
        """The latest state of a text is to be checked."""
        self._cancel(uri)
        self._due[uri] = asyncio.get_running_loop().call_later(PAUSE, self._start, uri)

    def forget(self, uri: str) -> None:
        """A text was closed: nothing is said of it any more."""
        self._cancel(uri)
        self._said.pop(uri, None)
        self._publish(uri, None, [])

    def _cancel(self, uri: str) -> None:
        if waiting := self._due.pop(uri, None):
            waiting.cancel()

    def _start(self, uri: str) -> None:
        """Look at what takes no time, and let the thread look at the rest."""
        self._due.pop(uri, None)
        document = self.documents[uri]
        try:
            at_once = diagnostics(document, document.compiled[1])
        except (Exception, SystemExit) as error:  # the next state may be read all the same
            report(error)
            self._publish(uri, document, failed(error))
            return
        loop = asyncio.get_running_loop()
        meanwhile = loop.call_later(PATIENCE, self._meanwhile, uri, document, at_once)
        self._jobs.put(lambda: self._check(loop, uri, document, at_once, meanwhile))

    def _work(self) -> None:
        """What the thread does: one job after the other."""
        while True:
            job = self._jobs.get()
            try:
                job()
            except (Exception, SystemExit) as error:  # said, and the next one is done all the same
                report(error)

    def _check(
        self, loop: asyncio.AbstractEventLoop, uri: str, document: Document, at_once: list[types.Diagnostic],
        meanwhile: asyncio.TimerHandle,
    ) -> None:  # fmt: skip
        if self.documents.get(uri) is document:  # else there is a later state
            try:
                found = diagnostics(document, document.checked[1])
            except (Exception, SystemExit) as error:
                report(error)
                found = [*at_once, *failed(error)]
            loop.call_soon_threadsafe(self._done, uri, Said(document, found, at_once), meanwhile)

    def _done(self, uri: str, said: Said, meanwhile: asyncio.TimerHandle) -> None:
        meanwhile.cancel()
        if self.documents.get(uri) is said.document:
            self._said[uri] = said
            self._publish(uri, said.document, said.found)

    def _meanwhile(self, uri: str, document: Document, at_once: list[types.Diagnostic]) -> None:
        if self.documents.get(uri) is document:
            before = self._said.get(uri)
            self._publish(uri, document, [*at_once, *(still(before, document) if before else ())])

    def _publish(self, uri: str, document: Document | None, found: list[types.Diagnostic]) -> None:
        version = document.version if document else None
        self.server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, found, version))


def failed(error: BaseException) -> list[types.Diagnostic]:
    """What is said in a scene whose check has failed: where that is a plugin's fault, which and why."""
    said = blamed(error)
    return [types.Diagnostic(START, said, types.DiagnosticSeverity.Error, source="softmark")] if said else []


def still(before: Said, now: Document) -> list[types.Diagnostic]:
    """What took long to find of an earlier state, where its lines stand here too, counted from the start or the end."""
    old, new = (document.text.splitlines() for document in (before.document, now))
    further = len(new) - len(old)
    kept = []
    for found in before.found:
        first, last = found.range.start, found.range.end
        lines = old[first.line : last.line + 1]
        for by in (0, further):
            if found not in before.at_once and new[first.line + by : last.line + by + 1] == lines:
                moved = types.Range(
                    types.Position(first.line + by, first.character), types.Position(last.line + by, last.character)
                )
                kept.append(types.Diagnostic(
                    moved, found.message, found.severity, found.code, found.code_description, found.source, found.tags,
                ))  # fmt: skip
                break
    return kept
