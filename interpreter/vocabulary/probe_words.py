"""Probes: where the answer is looked at.

To add one that gives its points as `stations`: a class derived from Probe, a line in PROBES. One that takes them from a
body or a measurement has a case in problem/probe_points.py as well.
"""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass

Vector3 = tuple[float, float, float]


class Probe:
    """What every probe says; one that gives its points needs nothing else, others are found in
    problem/probe_points.py.
    """

    @property
    def stations(self) -> tuple[Vector3, ...] | None:
        """Its material points, m; None where they are those of a body or of a measurement."""
        return None

    @property
    def ends(self) -> tuple[Vector3, Vector3] | None:
        """The two points between which all others lie, m."""
        return None

    @property
    def tracked(self) -> str | None:
        """The measurement whose points it takes."""
        return None

    @property
    def cells(self) -> Any:
        """The mesh whose points it takes."""
        return vars(self).get("mesh")


@dataclass(frozen=True)
class Point(Probe):
    """The displacement of one material point."""

    body: Annotated[str, "body", "the body that is looked at"]
    at: Annotated[Vector3, "m", "the point, by its coordinates before deformation"]

    @property
    def stations(self) -> tuple[Vector3, ...]:
        """The material points, m."""
        return (self.at,)


@dataclass(frozen=True)
class Line(Probe):
    """Displacements at equally spaced material points of a straight line, both ends included."""

    body: Annotated[str, "body", "the body that is looked at"]
    from_: Annotated[Vector3, "m", "first point, by its coordinates before deformation"]
    to: Annotated[Vector3, "m", "last point"]
    points: Annotated[int, "1 in [2, 100000]", "how many points"] = 41

    @property
    def ends(self) -> tuple[Vector3, Vector3]:
        """The first and the last of its points, m."""
        return self.from_, self.to

    @property
    def stations(self) -> tuple[Vector3, ...]:
        """The material points, m."""
        n = self.points - 1
        return tuple(
            tuple(a + (b - a) * (i / n) for a, b in zip(self.from_, self.to, strict=True))  # type: ignore[misc]
            for i in range(self.points)
        )


@dataclass(frozen=True)
class Surface(Probe):
    """The surface of a body, or a part of it: triangles over material points.

    The points are those of the surface mesh of the body's shape, of about `size`; or the boundary points of a given
    `mesh`, which makes them the same as in a study that used it.
    """

    body: Annotated[str, "body", "the body that is looked at"]
    where: Annotated[Any | None, "condition", "which part, by coordinates before deformation; all without it"] = None
    size: Annotated[float | None, "m in (0, inf)", "edge length of its triangles; a fortieth of the extent"] = None
    mesh: Annotated[Any | None, "shape", "a mesh whose boundary points are taken"] = None


@dataclass(frozen=True)
class Nodes(Probe):
    """The points of a mesh of the body, as studies that compare node by node take them."""

    body: Annotated[str, "body", "the body that is looked at"]
    mesh: Annotated[Any, "shape", "the mesh whose points are taken"]
    where: Annotated[Any | None, "condition", "which part, by coordinates before deformation; all without it"] = None


@dataclass(frozen=True)
class Volume(Probe):
    """Points throughout a body, or a part of it, each with the part of the volume that it stands for.

    Four in every cell of a tetrahedral mesh of about `size` (Hammer, Marlowe and Stroud 1956): what integrals over the
    body are made of, exact for polynomials of degree two in each cell. Cells that a border of `where`, or of a part of
    another material, passes are cut there: along planes exactly, along curved borders by straight pieces, which miss as
    little as a mesh of this size.
    """

    body: Annotated[str, "body", "the body that is looked at"]
    size: Annotated[float | None, "m in (0, inf)", "edge length of cells; a 25th of the extent, or that of 5000"] = None
    where: Annotated[Any | None, "condition", "which part, by coordinates before deformation; all without it"] = None


@dataclass(frozen=True)
class Markers(Probe):
    """The points that were tracked in an experiment: beads, corners, ink dots.

    Points that the condition leaves out were measured and are not judged, such as those whose motion is imposed.
    """

    body: Annotated[str, "body", "the body that is looked at"]
    of: Annotated[str, "reference", "the measurement: a reference of tracked points"]
    where: Annotated[Any | None, "condition", "which of them, by coordinates before deformation; all without it"] = None

    @property
    def tracked(self) -> str:
        """The measurement whose points it takes."""
        return self.of
