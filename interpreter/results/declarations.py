"""Declared names of a scene in its report, with the metrics that its expectations name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from softmark.records import dataclass


@dataclass(frozen=True)
class DeclaredName:
    """Name that a scene declares: `word` is its constructor, `line` the line number in the scene's text."""

    kind: str  # model, probe, body ...
    word: str = ""
    line: int | None = None
    summary: str = ""  # name of its constructor
    body: str | None = None  # body that it is declared for
    probe: str | None = None  # probe that it uses
    against: str | None = None  # reference that it compares with
    poisson: float | None = None  # Poisson's ratio, of the material of a body
    part: str = ""  # part of a symmetric body that a force, an area or an energy refers to


@dataclass(frozen=True)
class DeclaredNames:
    """Declared names of a scene in the order of its text.

    `expected` are the model metrics in the order in which expectations name them; reports show these first, as the
    purpose of the scene. `down` is the direction of gravity.
    """

    declared: Mapping[str, DeclaredName] = field(default_factory=dict)
    expected: tuple[str, ...] = ()
    down: tuple[float, float, float] = (0.0, 0.0, -1.0)

    def of_kind(self, kind: str) -> list[str]:
        """Return the names that are declared with a kind, such as `model`."""
        return [name for name, known in self.declared.items() if known.kind == kind]
