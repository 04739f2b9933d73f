"""Locations and texts of diagnostics relative to a repository, shared by the formats for pull requests."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic, Source, make_all_visible, make_encodable
from softmark.grammar.tree import Span
from softmark.interpreter.help.diagnostic_formats import LocatedDiagnostic
from softmark.records import dataclass


@dataclass(frozen=True)
class RepositoryLocation:
    """Location in a repository: a path with slashes, relative to the source root if possible, and a span in the file.

    The span is None for a diagnostic about the whole file.
    """

    path: str
    span: Span | None


def without_duplicates(told: Sequence[LocatedDiagnostic]) -> list[LocatedDiagnostic]:
    """Return the diagnostics without duplicates.

    Duplicates occur if scenes share a file or several models report the same problem.
    """
    return list({_duplicate_key(t): t for t in reversed(told)}.values())[::-1]


def _duplicate_key(told: LocatedDiagnostic) -> tuple[object, ...]:
    d = told.diagnostic
    place = repository_location(told)
    return d.code, d.message, place.path, place.span and (place.span.start, place.span.end)


def repository_location(told: LocatedDiagnostic) -> RepositoryLocation:
    """Return the file and span of a diagnostic.

    A diagnostic that is not about a file (arguments, standard input) gets the file of the command line.
    """
    source = told.diagnostic.source
    if source is not None and is_file(source):
        return RepositoryLocation(repository_path(source.name), told.diagnostic.span)
    return RepositoryLocation(repository_path(told.file), None)


def is_file(source: Source) -> bool:
    """Return whether a source text comes from a file that can be opened."""
    return "\0" not in source.name and os.path.isfile(source.name)


def repository_path(name: str) -> str:
    """Return a file name with slashes, relative to the source root.

    The source root is the workspace of the GitHub workflow, or else the working folder.
    """
    root = os.path.abspath(os.environ.get("GITHUB_WORKSPACE") or ".")
    full = os.path.abspath(name)
    inside = full.startswith(os.path.join(root, ""))
    return make_encodable(Path(os.path.relpath(full, root) if inside else full).as_posix())


def full_message(diagnostic: Diagnostic) -> str:
    """Return message, label, help and notes of a diagnostic, one line each, without control characters."""
    d = diagnostic
    said = f"{d.message} ({d.label})" if d.label and d.label not in d.message else d.message
    asked = f"in `{d.source.name}`" if d.source and not is_file(d.source) else ""
    lines = [said, asked, f"help: {d.help}" if d.help else "", *(f"note: {n}" for n in d.notes)]
    return make_encodable(str(make_all_visible("\n".join(line for line in lines if line))))
