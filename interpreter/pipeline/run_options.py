"""What a run is told: which models, how often they are timed, whom to tell what."""

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
class Text:
    """The text of a scene: files that it names are looked for in `folder`, `overrides` read `NAME=VALUE`."""

    source: Source
    folder: Path
    file: Path | None = None  # that it was read from
    overrides: tuple[str, ...] = ()
    plugins: tuple[str, ...] = ()  # files or names of plugins that it may take words of


@frozen(frozen=True)
class Sound:
    """A scene without errors, and the doubts about it."""

    scene: Scene
    warnings: tuple[Diagnostic, ...]


@dataclass
class Options:
    """How to run: which models, how many timed repetitions, whom to tell, where to keep unfinished reports."""

    only: tuple[str, ...] = ()
    repeat: int = 1
    say: Say = lambda what, detail: None
    begin: Callable[[Scene], None] = lambda scene: None  # a sound scene, before anything is computed
    keep: Callable[[Report], None] = lambda report: None
    warn: Callable[[Sequence[Diagnostic]], None] = lambda found: None
    draw: bool = True  # find the surfaces that a report shows
    stated: tuple[str, ...] | None = None  # which models are asked what error they state themselves; (): all
    free: bool = False  # the others say what is known of their error at no cost
    beside: bool = False  # where no kernels are on disk, another process may compile some
    # how a reference is had: made, or known from another run of the same
    recall: Callable[[Scene, Declared, Callable[[], Any]], Any] = lambda scene, reference, make: make()
