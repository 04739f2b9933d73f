"""Background checks of open documents; only the latest state is checked, without delaying requests.

After a change, a check starts once no further change has arrived for a moment. Names, units and dimensions are checked
at once. Everything else is checked in a separate thread, whose results are dropped if the text has changed meanwhile.
If the thread takes long, the immediate results are published together with earlier messages of unchanged lines.
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

from softmark.interpreter.language.loaded_plugin import find_faulty_plugin
from softmark.interpreter.language_server.published_diagnostics import START, diagnostics
from softmark.interpreter.language_server.request_error import report
from softmark.interpreter.language_server.text_document import Document

if TYPE_CHECKING:
    from pygls.lsp.server import LanguageServer

PAUSE = 0.01  # s, delay for further changes before a check starts
PATIENCE = 0.1  # s, after which the results so far are published
NEWLY = 0.001  # s, thread switch interval: an answer must not wait for a check


@dataclass(frozen=True)
class PublishedState:
    """Published diagnostics of one state of a text: all of them, and those of the immediate checks."""

    document: Document
    found: list[types.Diagnostic]
    at_once: list[types.Diagnostic]


class CheckScheduler:
    """Scheduler of the checks of all documents that are open in a server."""

    def __init__(self, server: LanguageServer, documents: dict[str, Document]) -> None:
        self.server, self.documents = server, documents
        self._due: dict[str, asyncio.TimerHandle] = {}
        self._said: dict[str, PublishedState] = {}
        self._jobs: SimpleQueue[Callable[[], object]] = SimpleQueue()
        sys.setswitchinterval(NEWLY)
        threading.Thread(target=self._run_queued_jobs, name="checks", daemon=True).start()

    def queue_warm_up(self, *jobs: Callable[[], object]) -> None:
        """Run jobs that prepare the server before the first text is opened."""
        for job in (*jobs, gc.collect, gc.freeze):
            self.do(job)

    def do(self, job: Callable[[], object]) -> None:
        """Queue a job for the background thread."""
        self._jobs.put(job)

    def schedule_check(self, uri: str) -> None:
        """Schedule a check of the latest state of the text with a URI."""
        self._cancel(uri)
        self._due[uri] = asyncio.get_running_loop().call_later(PAUSE, self._start, uri)

    def forget(self, uri: str) -> None:
        """Drop the checks and messages of a closed text."""
        self._cancel(uri)
        self._said.pop(uri, None)
        self._publish(uri, None, [])

    def _cancel(self, uri: str) -> None:
        if waiting := self._due.pop(uri, None):
            waiting.cancel()

    def _start(self, uri: str) -> None:
        """Run the fast checks now, and queue the slow ones for the thread."""
        self._due.pop(uri, None)
        document = self.documents[uri]
        try:
            at_once = diagnostics(document, document.compiled[1])
        except (Exception, SystemExit) as error:  # the next state may still compile
            report(error)
            self._publish(uri, document, describe_failure(error))
            return
        loop = asyncio.get_running_loop()
        meanwhile = loop.call_later(PATIENCE, self._publish_preliminary, uri, document, at_once)
        self._jobs.put(lambda: self._run_slow_checks(loop, uri, document, at_once, meanwhile))

    def _run_queued_jobs(self) -> None:
        """Run queued jobs one after the other, in the thread."""
        while True:
            job = self._jobs.get()
            try:
                job()
            except (Exception, SystemExit) as error:  # reported; the next job still runs
                report(error)

    def _run_slow_checks(
        self, loop: asyncio.AbstractEventLoop, uri: str, document: Document, at_once: list[types.Diagnostic],
        meanwhile: asyncio.TimerHandle,
    ) -> None:  # fmt: skip
        if self.documents.get(uri) is document:  # else there is a later state
            try:
                found = diagnostics(document, document.check_result[1])
            except (Exception, SystemExit) as error:
                report(error)
                found = [*at_once, *describe_failure(error)]
            loop.call_soon_threadsafe(self._finish_check, uri, PublishedState(document, found, at_once), meanwhile)

    def _finish_check(self, uri: str, said: PublishedState, meanwhile: asyncio.TimerHandle) -> None:
        meanwhile.cancel()
        if self.documents.get(uri) is said.document:
            self._said[uri] = said
            self._publish(uri, said.document, said.found)

    def _publish_preliminary(self, uri: str, document: Document, at_once: list[types.Diagnostic]) -> None:
        if self.documents.get(uri) is document:
            before = self._said.get(uri)
            self._publish(uri, document, [*at_once, *(find_unchanged_diagnostics(before, document) if before else ())])

    def _publish(self, uri: str, document: Document | None, found: list[types.Diagnostic]) -> None:
        version = document.version if document else None
        self.server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, found, version))


def describe_failure(error: BaseException) -> list[types.Diagnostic]:
    """Return the messages for a scene whose check raised an exception; they name the plugin if one caused it."""
    said = find_faulty_plugin(error)
    return [types.Diagnostic(START, said, types.DiagnosticSeverity.Error, source="softmark")] if said else []


def find_unchanged_diagnostics(before: PublishedState, now: Document) -> list[types.Diagnostic]:
    """Return earlier diagnostics of the slow checks that still apply.

    Their lines are unchanged, counted from the start or the end of the text.
    """
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
