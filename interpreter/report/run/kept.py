"""What of a report was taken over from earlier runs, with its date: times are of those runs."""

from __future__ import annotations

from softmark.interpreter.report.page.document import in_words
from softmark.interpreter.report.page.markup import tag, text
from softmark.interpreter.results.report import Report

SEVERAL = 8  # names that a line lists


def sentences(report: Report) -> list[str]:
    """`kept from the run of 23 November 2026, 17:54 UTC, with its times: rod, theory; ...`, a line for each date."""
    by_date: dict[str, list[str]] = {}
    for result in report.outcomes:
        if result.kept:
            by_date.setdefault(result.kept, []).append(result.name)
    return [
        f"kept from the run of {in_words(date)}, with its times: {_named(names)}; `--fresh` computes all again"
        for date, names in by_date.items()
    ]


def _named(names: list[str]) -> str:
    more = len(names) - SEVERAL
    return ", ".join(names) if more <= 0 else f"{', '.join(names[:SEVERAL])} and {more} more"


def note(report: Report) -> str:
    """The same at the top of the page; nothing where all was computed by this run."""
    return "".join(tag("p", text(s[:1].upper() + s[1:] + "."), class_="kept where") for s in sentences(report))
