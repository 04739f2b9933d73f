"""What is wrong with a scene, up to a number: a text of a million errors is not worth a million messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from softmark.grammar.diagnostic import Diagnostic

MOST = 100  # errors, or warnings, that are shown of one scene


class Full(Exception):
    """Enough is known to be wrong: whoever appends gives up, `Ledger.bounded` goes on."""


class Ledger(list[Diagnostic]):
    """A list of diagnostics that raises Full once it holds MOST of them."""

    def append(self, diagnostic: Diagnostic, /) -> None:
        """Record one more. Raises Full, the last one recorded."""
        super().append(diagnostic)
        if self.full:
            raise Full

    def extend(self, diagnostics: Iterable[Diagnostic], /) -> None:
        """Record several. Raises Full."""
        for diagnostic in diagnostics:
            self.append(diagnostic)

    @contextmanager
    def bounded(self) -> Iterator[None]:
        """Do what is inside until the ledger is full; see `full` first where it may be so already."""
        try:
            yield
        except Full:
            return

    @property
    def full(self) -> bool:
        """Whether nothing more is looked for."""
        return len(self) >= MOST

    def closed(self) -> list[Diagnostic]:
        """What was found, each once: a scene that is used twice is complained about once."""
        found = together(dict.fromkeys(self))
        if not self.full:
            return found
        last, problem = found[-1], f"there may be more errors: after {MOST} no more are looked for"
        help = "mend those above first"
        return [*found, Diagnostic("E131", problem, last.source, last.span, "the last one looked at", help)]


def together(found: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Errors that say the same of one parameter wherever it is used are one, at the first of these places."""
    first: dict[object, list[Diagnostic]] = {}
    for d in found:
        first.setdefault((d.code, d.message, d.source, d.also) if d.also else d, []).append(d)
    return [_one(group) for group in first.values()]


def _one(group: list[Diagnostic]) -> Diagnostic:
    lines = sorted({d.span.line for d in group[1:] if d.span is not None})
    if not lines:
        return group[0]
    said = f"the same holds for line{'s' * (len(lines) > 1)} {', '.join(map(str, lines))}"
    return replace(group[0], notes=(*group[0].notes, said))


def shortened(found: list[Diagnostic]) -> list[Diagnostic]:
    """The first of many errors of a scene, or if it has none its first warnings and how many there are."""
    errors = [d for d in found if d.severity == "error"]
    if len(found) <= MOST:
        return found
    if errors:
        ledger = Ledger()
        with ledger.bounded():
            ledger.extend(errors)
        return ledger.closed()
    last, more = found[MOST - 1], len(found) - MOST
    note = f"{more} more warning{'s are' if more > 1 else ' is'} not shown"
    return [*found[: MOST - 1], replace(last, notes=(*last.notes, note))]
