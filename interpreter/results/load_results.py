"""Results of a load in the report: its resultant on the mesh, and its exact resultant on the body."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.interpreter.results.json_records import JsonRecord
from softmark.records import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable

Vector = tuple[float, float, float]


def to_vector(v: Iterable[float]) -> Vector:
    """Return an array of three numbers as a tuple of Python floats."""
    x, y, z = (float(c) for c in v)
    return x, y, z


@dataclass(frozen=True)
class Resultant(JsonRecord):
    """Resultant of one load at full size on the undeformed mesh.

    It consists of `force`, N, `moment` about the origin, N m, and loaded `area`, m^2. `exact_force` is the force on the
    exact body, None for a mesh from a file. `exact_moment` is the moment on the exact body, for loads whose points of
    action are fully known. A line load has its `length`, m. `share` is the selected part of the requested area.
    `remainder` is the area that may or may not belong to the selection, m^2. `leaning` is the area, m^2, that is
    selected because flat facets represent a curved surface that no file contains (see `deviation`).
    """

    SELDOM: ClassVar[tuple[str, ...]] = ("exact_moment", "length")

    force: Vector
    moment: Vector
    area: float | None = None
    exact_force: Vector | None = None
    share: float = 1.0
    remainder: float = 0.0
    leaning: float = 0.0
    exact_moment: Vector | None = None
    length: float | None = None

    @property
    def missing(self) -> float:
        """Possible relative error of the load, due to the selection of its area."""
        return abs(1.0 - self.share) + (self.remainder / self.area if self.area else 0.0)
