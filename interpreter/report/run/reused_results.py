"""Note on results that were reused from earlier runs, with the dates of these runs.

The computing times are those of the earlier runs.
"""

from __future__ import annotations

from softmark.interpreter.report.page.html_document import format_date
from softmark.interpreter.report.page.html_markup import prose, tag
from softmark.interpreter.results.run_report import Report

SEVERAL = 8  # names of one run that are listed


def sentence(report: Report, quote: str = "") -> str:
    """Return a sentence on the results that were reused from an earlier run; empty if there are none.

    Names stand between `quote` characters. For example: `reused from the run of 23 November 2026, 17:54 UTC, with
    its times: rod, theory; ...`.
    """
    by_date: dict[str, list[str]] = {}
    for result in report.outcomes:
        if result.kept:
            by_date.setdefault(format_date(result.kept), []).append(f"{quote}{result.name}{quote}")
    each = [
        f"reused from the run of {date}, with its times: {_join_first_names(names)}" for date, names in by_date.items()
    ]
    return f"{'; '.join(each)} (`--fresh` recomputes everything)" if each else ""


def _join_first_names(names: list[str]) -> str:
    more = len(names) - SEVERAL
    return ", ".join(names) if more <= 0 else f"{', '.join(names[:SEVERAL])} and {more} more"


def note(report: Report) -> str:
    """Return an HTML note, for the top of the page, on results that were reused from an earlier run."""
    said = sentence(report, "`")
    return tag("p", prose(f"{said[:1].upper()}{said[1:]}."), class_="kept where") if said else ""
