"""Record of an imported file: mesh, materials, supports and loads, in the file's own units.

Cells and nodes count from 0; faces (f, 2) are a cell and its side, from 0, in the order of Abaqus
(`cell_faces.side_nodes`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.importers.cell_faces import CellSides
from softmark.interpreter.importers.deck_units import DeclaredUnits
from softmark.solvers.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Vector = tuple[float, float, float]


class NotImportable(Exception):
    """Exception for a file with content that no scene can express; nothing is imported.

    It has the reason and the remedy.
    """

    def __init__(self, reason: str, remedy: str, code: str = "E753") -> None:
        super().__init__(reason)
        self.reason, self.remedy, self.code = reason, remedy, code


@dataclass(frozen=True)
class ImportedLaw:
    """Material law in words of the language: its constructor, constants, and density if it has one.

    Constants are stresses or plain numbers; `stress_lists` and `lists` are such constants of several terms.
    """

    word: str
    stresses: Mapping[str, float]
    plain: Mapping[str, float] = field(default_factory=dict)
    density: float | None = None
    choices: Mapping[str, str] = field(default_factory=dict)
    stress_lists: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    lists: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class MaterialPart:
    """Cells (k,) of one material; `law` is None if it could not be imported, for the reason `why`."""

    name: str
    cells: Ints
    law: ImportedLaw | None
    why: str = ""


@dataclass(frozen=True)
class NodeSupport:
    """Support of nodes (k,) in some `components`: fixed, or moved by `values`, lengths in the file's unit."""

    name: str
    nodes: Ints
    components: tuple[int, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class FaceLoad:
    """Load on faces (f, 2): a follower pressure, positive inward, or a dead traction, in the file's unit of stress."""

    name: str
    faces: Ints
    pressure: float | None = None
    traction: Vector | None = None


@dataclass(frozen=True)
class NodeForces:
    """Dead force, the same at each of some nodes (k,)."""

    name: str
    nodes: Ints
    force: Vector


@dataclass(frozen=True)
class NamedSet:
    """Named set of cells (k,), faces (f, 2) or nodes (k,) that nothing else uses."""

    name: str
    members: Ints
    kind: Literal["cells", "faces", "nodes"]


@dataclass(frozen=True)
class NotImported:
    """Item that was not imported, with the reason and its line in the file."""

    what: str
    why: str
    line: int | None = None


@dataclass(frozen=True)
class EndedLoad:
    """Load or motion whose curve is zero at the imported time but was not before.

    `peak` is the greatest earlier value of the curve and `when` its time, in the file's unit of time.
    """

    what: str
    curve: str
    peak: float
    when: float
    moment: float

    @property
    def described(self) -> str:
        """Sentence that reports the load as ended, with its curve and the times."""
        return (
            f"{self.what} is 0 at the imported time {self.moment:g}, but its load curve {self.curve[:20]} is "
            f"{self.peak:g} at time {self.when:g}"
        )


@dataclass
class Deck:
    """One body in a static analysis, as read from a file.

    `mesh` is a file that a scene can read; if it is None, the mesh is given by arrays.
    """

    title: str
    kind: str  # tet4, tet10, hex8, hex20
    points: Floats  # (n, 3)
    cells: Ints  # (m, a)
    parts: list[MaterialPart]
    holds: list[NodeSupport] = field(default_factory=list)
    pushes: list[FaceLoad] = field(default_factory=list)
    forces: list[NodeForces] = field(default_factory=list)
    weights: list[Vector] = field(default_factory=list)  # accelerations
    strain: str = "small"
    formulation: str | None = None
    static: bool = True
    groups: list[str] = field(default_factory=list)  # groups of `mesh`, by name
    named: list[NamedSet] = field(default_factory=list)
    mesh: Path | None = None
    pieces: int = 1  # number of disjoint pieces of the body
    left: list[NotImported] = field(default_factory=list)
    units: DeclaredUnits | None = None  # as the file declares them
    ended: list[EndedLoad] = field(default_factory=list)
    taken: list[str] = field(default_factory=list)  # choices made where the file is ambiguous

    @cached_property
    def sides(self) -> CellSides:
        """Sides of the cells, found on first use."""
        return CellSides(self.cells)

    @cached_property
    def inverted_cells(self) -> Ints:
        """Cells (k,) whose node order makes their volume negative."""
        with np.errstate(all="ignore"):  # non-finite points are refused later, when the scene is read
            return np.flatnonzero(Mesh(self.points, self.cells, self.kind).volumes < 0.0)
