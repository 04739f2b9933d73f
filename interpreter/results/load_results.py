"""What a report says of a load: what it comes to on the mesh, beside what the scene asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from softmark.interpreter.results.json_records import Plain
from softmark.records import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable

Vector = tuple[float, float, float]


def vector(v: Iterable[float]) -> Vector:
    """Three numbers of an array, as those of Python."""
    x, y, z = (float(c) for c in v)
    return x, y, z


@dataclass(frozen=True)
class Resultant(Plain):
    """Force in N and moment about the origin in N m of one load at full size, undeformed, and the area in m^2.

    `exact_force` is that on the body itself, None where the body is a mesh of a file, `exact_moment` of a load that
    says where all of it acts; what acts along a line has its `length`, m. `share` is what was taken of what was asked.
    Of the area, `remainder` may belong to the selection or not, and `leaning` is selected because a facet stands for a
    curved surface that no file holds (see `deviation`).
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
        """How much of the load may be wrong, relative to it."""
        return abs(1.0 - self.share) + (self.remainder / self.area if self.area else 0.0)
