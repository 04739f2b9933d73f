"""Input and options of a run: selected models, repetitions, and callbacks for progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass as frozen

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic, Source
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.results.run_report import Report

Say = Callable[[str, str], None]  # (what is being done, detail)


@frozen(frozen=True)
class SceneText:
    """Text of a scene to be checked and run.

    File names in the text are relative to `folder`. `overrides` have the form `NAME=VALUE`.
    """

    source: Source
    folder: Path
    file: Path | None = None  # file that it was read from
    overrides: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()  # files or names of plugins


@frozen(frozen=True)
class CheckedScene:
    """Scene that was checked and has no errors, with the warnings about it."""

    scene: Scene
    warnings: tuple[Diagnostic, ...]


@dataclass
class RunOptions:
    """Options of a run: selected models, number of timed repetitions, and callbacks.

    The callbacks receive progress messages, warnings and unfinished reports.
    """

    only: tuple[str, ...] = ()
    repeat: int = 1
    say: Say = lambda what, detail: None
    begin: Callable[[Scene], None] = lambda scene: None  # called with a checked scene, before anything is computed
    keep: Callable[[Report], None] = lambda report: None
    warn: Callable[[Sequence[Diagnostic]], None] = lambda found: None
    draw: bool = True  # compute the surfaces that a report shows
    stated: tuple[str, ...] | None = None  # models that must state their errors; (): all
    free: bool = False  # other models state errors that cost nothing
    beside: bool = False  # if no kernels are cached on disk, another process may compile some
    # returns a reference: computed, or cached from another run
    recall: Callable[[Scene, Declared, Callable[[], Any]], Any] = lambda scene, reference, make: make()
