"""Where a diagnostic is in a repository, and what is said there: what formats for pull requests share."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic, Source, all_visible, encodable
from softmark.grammar.tree import Span
from softmark.interpreter.help.diagnostic_formats import Told
from softmark.records import dataclass


@dataclass(frozen=True)
class Located:
    """A file with slashes, from the root of the sources where it lies below it, and where in it; None: as a whole."""

    path: str
    span: Span | None


def unique(told: Sequence[Told]) -> list[Told]:
    """Each once: several scenes may use the file that is in error, and several models say the same of a place."""
    return list({_same(t): t for t in reversed(told)}.values())[::-1]


def _same(told: Told) -> tuple[object, ...]:
    d = told.diagnostic
    place = located(told)
    return d.code, d.message, place.path, place.span and (place.span.start, place.span.end)


def located(told: Told) -> Located:
    """The file and the span in it; of what stands in none (an argument, standard input) the file that was asked for."""
    source = told.diagnostic.source
    if source is not None and is_file(source):
        return Located(path_of(source.name), told.diagnostic.span)
    return Located(path_of(told.file), None)


def is_file(source: Source) -> bool:
    """Whether a text stands in a file, where somebody may look at it."""
    return "\0" not in source.name and os.path.isfile(source.name)


def path_of(name: str) -> str:
    """A name of a file with slashes, from the root of the sources: that of the workflow, or the folder we are in."""
    root = os.path.abspath(os.environ.get("GITHUB_WORKSPACE") or ".")
    full = os.path.abspath(name)
    inside = full.startswith(os.path.join(root, ""))
    return encodable(Path(os.path.relpath(full, root) if inside else full).as_posix())


def words(diagnostic: Diagnostic) -> str:
    """The message with what stands at its place, how to mend it, and its notes; a line each, none that steers."""
    d = diagnostic
    said = f"{d.message} ({d.label})" if d.label and d.label not in d.message else d.message
    asked = f"in `{d.source.name}`" if d.source and not is_file(d.source) else ""
    lines = [said, asked, f"help: {d.help}" if d.help else "", *(f"note: {n}" for n in d.notes)]
    return encodable(str(all_visible("\n".join(line for line in lines if line))))
