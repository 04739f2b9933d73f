"""Functions shared by commands to read the scenes named on the command line and to print diagnostics."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic, Source, render, summary

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene


class SceneReadError(Exception):
    """Error: a scene cannot be read. `diagnostic` has the reason."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def read_scene(name: str) -> tuple[Source, Path, Path | None]:
    """Return the text, the folder and the file of a scene. Raises Unread.

    `name` is a path, a standard scene, or `-` for standard input, which has no file (None).
    """
    from softmark.interpreter.language.scene_sources import UnreadableScene, locate_scene, read_limited, read_scene_file

    try:
        if name == "-":
            data = read_limited(sys.stdin.buffer, "standard input")
            return Source("<stdin>", data.decode("utf-8", errors="replace")), Path(), None
        path = locate_scene(name)
        return read_scene_file(path), path.parent, path
    except UnreadableScene as missing:
        raise SceneReadError(Diagnostic("E401", missing.reason, None, None, help=missing.remedy)) from missing


def load(
    name: str, overrides: Sequence[str] = (), only: Sequence[str] = (), plugins: Sequence[str] = ()
) -> tuple[Scene | None, list[Diagnostic]]:
    """Return a checked scene (None if it has errors) and all its diagnostics.

    `only` lists the requested models; `overrides` are texts such as `h=3mm`.
    """
    from softmark.interpreter.validation.scene_loader import load_scene

    try:
        source, folder, file = read_scene(name)
    except SceneReadError as unread:
        return None, [unread.diagnostic]
    return load_scene(source, folder, file, overrides, only, plugins)


def supports_colour() -> bool:
    """Return whether standard error supports colours."""
    return sys.stderr.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def show(diagnostics: Sequence[Diagnostic]) -> None:
    """Print diagnostics and their number to standard error."""
    if diagnostics := _without_duplicates(diagnostics):
        print(render(_merge_equal_warnings(diagnostics), colour=supports_colour()), file=sys.stderr)
        print(f"\n{summary(diagnostics)}; more: dsl explain {diagnostics[0].code}", file=sys.stderr)


def _without_duplicates(diagnostics: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Return the diagnostics without repetitions.

    A diagnostic is repeated if several models report the same problem at the same place.
    """
    return list({(d.code, d.message, d.source, d.span): d for d in reversed(diagnostics)}.values())[::-1]


def _merge_equal_warnings(diagnostics: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Merge warnings with equal text into the first of them, with a note that lists the lines of the others."""
    first: dict[tuple[object, ...], list[Diagnostic]] = {}
    for d in diagnostics:
        alone = d.span if d.severity == "error" else None
        first.setdefault((d.code, d.message, d.source, alone), []).append(d)
    return [_with_others(group) for group in first.values()]


def _with_others(group: list[Diagnostic]) -> Diagnostic:
    lines = sorted({d.span.line for d in group[1:] if d.span})
    if not lines:
        return group[0]
    word = "line" if len(lines) == 1 else "lines"
    return replace(group[0], notes=(*group[0].notes, f"the same applies to {word} {', '.join(map(str, lines))}"))


def errors(diagnostics: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Return the errors among diagnostics."""
    return [d for d in diagnostics if d.severity == "error"]


def has_errors(diagnostics: Sequence[Diagnostic]) -> bool:
    """Return whether one of the diagnostics is an error."""
    return bool(errors(diagnostics))
