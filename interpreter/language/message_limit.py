"""Limit on the number of diagnostics of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from softmark.grammar.diagnostic import Diagnostic

MOST = 100  # maximum number of errors or warnings shown for one scene


class DiagnosticLimitReached(Exception):
    """Exception for reaching the maximum number of diagnostics; raised by `append` and caught by `bounded`."""


class BoundedDiagnostics(list[Diagnostic]):
    """List of diagnostics that raises DiagnosticLimitReached once it holds MOST of them."""

    def append(self, diagnostic: Diagnostic, /) -> None:
        """Append one diagnostic. Raises DiagnosticLimitReached after appending the last one allowed."""
        super().append(diagnostic)
        if self.full:
            raise DiagnosticLimitReached

    def extend(self, diagnostics: Iterable[Diagnostic], /) -> None:
        """Record several diagnostics. Raises DiagnosticLimitReached."""
        for diagnostic in diagnostics:
            self.append(diagnostic)

    @contextmanager
    def stop_when_full(self) -> Iterator[None]:
        """Run the block until the list of diagnostics is full; check `full` first if it may be full already."""
        try:
            yield
        except DiagnosticLimitReached:
            return

    @property
    def full(self) -> bool:
        """True if no more diagnostics are collected."""
        return len(self) >= MOST

    def merged_diagnostics(self) -> list[Diagnostic]:
        """Return the diagnostics without duplicates, which arise if a scene is used twice."""
        found = merge_repeated(dict.fromkeys(self))
        if not self.full:
            return found
        last, problem = found[-1], f"there may be more errors: the check stops after {MOST}"
        help = "correct the errors above first"
        return [*found, Diagnostic("E131", problem, last.source, last.span, "the last one shown", help)]


def merge_repeated(found: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Merge errors that have the same message about one parameter into one, at its first place."""
    first: dict[object, list[Diagnostic]] = {}
    for d in found:
        first.setdefault((d.code, d.message, d.source, d.also) if d.also else d, []).append(d)
    return [_merge_group(group) for group in first.values()]


def _merge_group(group: list[Diagnostic]) -> Diagnostic:
    lines = sorted({d.span.line for d in group[1:] if d.span is not None})
    if not lines:
        return group[0]
    said = f"the same applies to line{'s' * (len(lines) > 1)} {', '.join(map(str, lines))}"
    return replace(group[0], notes=(*group[0].notes, said))


def shorten(found: list[Diagnostic]) -> list[Diagnostic]:
    """Return the first of many errors; if there are no errors, the first warnings and the number of the others."""
    errors = [d for d in found if d.severity == "error"]
    if len(found) <= MOST:
        return found
    if errors:
        ledger = BoundedDiagnostics()
        with ledger.stop_when_full():
            ledger.extend(errors)
        return ledger.merged_diagnostics()
    last, more = found[MOST - 1], len(found) - MOST
    note = f"{more} more warning{'s are' if more > 1 else ' is'} not shown"
    return [*found[: MOST - 1], replace(last, notes=(*last.notes, note))]
