"""Probes: where the answer is looked at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Point:
    """The displacement of one material point."""

    body: Annotated[str, "body", "the body that is looked at"]
    at: Annotated[Vector3, "m", "the point, by its coordinates before deformation"]

    @property
    def stations(self) -> tuple[Vector3, ...]:
        """The material points, m."""
        return (self.at,)


@dataclass(frozen=True)
class Line:
    """Displacements at equally spaced material points of a straight line, both ends included."""

    body: Annotated[str, "body", "the body that is looked at"]
    from_: Annotated[Vector3, "m", "first point, by its coordinates before deformation"]
    to: Annotated[Vector3, "m", "last point"]
    points: Annotated[int, "1 in [2, 100000]", "how many points"] = 41

    @property
    def stations(self) -> tuple[Vector3, ...]:
        """The material points, m."""
        n = self.points - 1
        return tuple(
            tuple(a + (b - a) * (i / n) for a, b in zip(self.from_, self.to, strict=True))  # type: ignore[misc]
            for i in range(self.points)
        )
