"""What a file of another program says: a mesh, what it is made of, what holds and loads it; in the file's own units.

Cells and nodes count from 0; faces (f, 2) are a cell and its side, from 0, in the order of Abaqus (`faces.side_nodes`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.importers.cell_faces import Sides
from softmark.interpreter.importers.deck_units import Declared
from softmark.solvers.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Vector = tuple[float, float, float]


class Foreign(Exception):
    """A file means something that no scene can say, so that nothing of it is carried over: why, and what to do."""

    def __init__(self, reason: str, remedy: str, code: str = "E753") -> None:
        super().__init__(reason)
        self.reason, self.remedy, self.code = reason, remedy, code


@dataclass(frozen=True)
class Law:
    """A material: its word in the language, its stresses and plain numbers there, and its density, if it has one.

    `stress_lists` and `lists` are constants of its terms, stresses and plain numbers.
    """

    word: str
    stresses: Mapping[str, float]
    plain: Mapping[str, float] = field(default_factory=dict)
    density: float | None = None
    choices: Mapping[str, str] = field(default_factory=dict)
    stress_lists: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    lists: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """Cells (k,) of one material; `law` is None where nothing of it was carried over, and `why` the reason."""

    name: str
    cells: Ints
    law: Law | None
    why: str = ""


@dataclass(frozen=True)
class Hold:
    """Nodes (k,) that are held in `components`, or moved there by `values`, lengths."""

    name: str
    nodes: Ints
    components: tuple[int, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class OnFaces:
    """A pressure, positive inward, that stays normal; or a dead traction: on faces (f, 2), as stresses."""

    name: str
    faces: Ints
    pressure: float | None = None
    traction: Vector | None = None


@dataclass(frozen=True)
class AtNodes:
    """A dead force at each of some nodes (k,)."""

    name: str
    nodes: Ints
    force: Vector


@dataclass(frozen=True)
class Set:
    """A part that has a name and nothing else: cells (k,), faces (f, 2), or nodes (k,)."""

    name: str
    members: Ints
    kind: Literal["cells", "faces", "nodes"]


@dataclass(frozen=True)
class Left:
    """What was not carried over, why, and in which line of the file."""

    what: str
    why: str
    line: int | None = None


@dataclass(frozen=True)
class Ended:
    """A load or motion whose curve is zero at the moment that is carried over, and was not before.

    `peak` is the greatest value of the curve before that moment and `when` its time, in the file's unit of time.
    """

    what: str
    curve: str
    peak: float
    when: float
    moment: float

    @property
    def described(self) -> str:
        """Sentence that reports the load as ended, with its curve and its times."""
        return (f"{self.what} is 0 at time {self.moment:g}, which is carried over: "
                f"its curve {self.curve[:20]} is {self.peak:g} at time {self.when:g}")  # fmt: skip


@dataclass
class Deck:
    """One body at rest. `mesh` is a file that a scene can read as it is; where it is None there are arrays."""

    title: str
    kind: str  # tet4, tet10, hex8, hex20
    points: Floats  # (n, 3)
    cells: Ints  # (m, a)
    parts: list[Part]
    holds: list[Hold] = field(default_factory=list)
    pushes: list[OnFaces] = field(default_factory=list)
    forces: list[AtNodes] = field(default_factory=list)
    weights: list[Vector] = field(default_factory=list)  # accelerations
    strain: str = "small"
    formulation: str | None = None
    static: bool = True
    groups: list[str] = field(default_factory=list)  # of `mesh`, by its names
    named: list[Set] = field(default_factory=list)
    mesh: Path | None = None
    pieces: int = 1  # of the body, which share no nodes
    left: list[Left] = field(default_factory=list)
    units: Declared | None = None  # as the file declares them
    ended: list[Ended] = field(default_factory=list)
    taken: list[str] = field(default_factory=list)  # how something was understood that can be understood otherwise

    @cached_property
    def sides(self) -> Sides:
        """Those of its cells, found when something asks."""
        return Sides(self.cells)

    @cached_property
    def inside_out(self) -> Ints:
        """Cells (k,) whose nodes are in an order that makes their volume negative."""
        with np.errstate(all="ignore"):  # what is not finite is refused with its place, when the scene is read
            return np.flatnonzero(Mesh(self.points, self.cells, self.kind).volumes < 0.0)
