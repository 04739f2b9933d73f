"""What a report says of the names that its scene declares, and of what the scene is for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from softmark.records import dataclass


@dataclass(frozen=True)
class Named:
    """A declaration: `word` is its constructor, `line` where the scene's text has it."""

    kind: str  # model, probe, body ...
    word: str = ""
    line: int | None = None
    summary: str = ""  # of its constructor
    body: str | None = None  # that it is given for
    probe: str | None = None  # that it looks at
    against: str | None = None  # what it measures from
    poisson: float | None = None  # Poisson's ratio, of the material of a body
    part: str = ""  # of a force, an area or an energy of a body that is cut by planes of symmetry: of what of it


@dataclass(frozen=True)
class Names:
    """The names of a scene in the order of its text.

    `expected` are metrics in the order in which expectations ask for them of models: whoever wrote an expectation says
    by it what the scene is for. `down` is where gravity pulls.
    """

    declared: Mapping[str, Named] = field(default_factory=dict)
    expected: tuple[str, ...] = ()
    down: tuple[float, float, float] = (0.0, 0.0, -1.0)

    def of_kind(self, kind: str) -> list[str]:
        """Names of a kind."""
        return [name for name, known in self.declared.items() if known.kind == kind]
