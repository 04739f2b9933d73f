"""Probes: material points at which a solution is evaluated.

To add a probe whose points follow from its fields (`stations`): a class derived from Probe and a line in PROBES. A
probe whose points come from a body or a measurement also needs a case in problem/probe_points.py.
"""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass

Vector3 = tuple[float, float, float]


class Probe:
    """Base class of probes; problem/probe_points.py finds points that do not follow from the fields of the probe."""

    @property
    def stations(self) -> tuple[Vector3, ...] | None:
        """Material points of the probe, m; None if the points come from a body or a measurement."""
        return None

    @property
    def ends(self) -> tuple[Vector3, Vector3] | None:
        """First and last point of a line, m; None for other probes."""
        return None

    @property
    def tracked(self) -> str | None:
        """Name of the measurement whose points the probe uses; None for other probes."""
        return None

    @property
    def cells(self) -> Any:
        """Mesh whose points the probe uses; None for other probes."""
        return vars(self).get("mesh")


@dataclass(frozen=True)
class Point(Probe):
    """The displacement of one material point."""

    body: Annotated[str, "body", "body that is evaluated"]
    at: Annotated[Vector3, "m", "point, by its undeformed coordinates"]

    @property
    def stations(self) -> tuple[Vector3, ...]:
        """The material point, m, as the only item."""
        return (self.at,)


@dataclass(frozen=True)
class Line(Probe):
    """Displacements at equally spaced material points of a straight line, both ends included."""

    body: Annotated[str, "body", "body that is evaluated"]
    from_: Annotated[Vector3, "m", "first point, by its undeformed coordinates"]
    to: Annotated[Vector3, "m", "last point"]
    points: Annotated[int, "1 in [2, 100000]", "number of points"] = 41

    @property
    def ends(self) -> tuple[Vector3, Vector3]:
        """First and last point of the line, m."""
        return self.from_, self.to

    @property
    def stations(self) -> tuple[Vector3, ...]:
        """Equally spaced material points of the line, m."""
        n = self.points - 1
        return tuple(
            tuple(a + (b - a) * (i / n) for a, b in zip(self.from_, self.to, strict=True))  # type: ignore[misc]
            for i in range(self.points)
        )


@dataclass(frozen=True)
class Surface(Probe):
    """The surface of a body or a part of it, as triangles over material points.

    The points are those of a surface mesh of the body's shape, with edges of about `size`; or the boundary points of a
    given `mesh`, for example to use the same points as a published study.
    """

    body: Annotated[str, "body", "body that is evaluated"]
    where: Annotated[Any | None, "condition", "part of the body, by undeformed coordinates; default: all of it"] = None
    size: Annotated[float | None, "m in (0, inf)", "edge length of the triangles; default: 1/40 of the extent"] = None
    mesh: Annotated[Any | None, "shape", "mesh whose boundary points are used"] = None


@dataclass(frozen=True)
class MeshNodes(Probe):
    """The nodes of a given mesh of the body, as in studies that compare node by node."""

    body: Annotated[str, "body", "body that is evaluated"]
    mesh: Annotated[Any, "shape", "mesh whose nodes are used"]
    where: Annotated[Any | None, "condition", "part of the body, by undeformed coordinates; default: all of it"] = None


@dataclass(frozen=True)
class Volume(Probe):
    """Quadrature points throughout a body or a part of it, each with its share of the volume.

    Each cell of a tetrahedral mesh of about `size` has four points (Hammer, Marlowe and Stroud 1956). Integrals over
    the body use them; they are exact for polynomials of degree two in each cell. Cells that are crossed by the border
    of `where`, or by the border of a part of another material, are cut there: exactly along planes, and by straight
    pieces along curved borders, with an error as small as that of a mesh of this size.
    """

    body: Annotated[str, "body", "body that is evaluated"]
    size: Annotated[
        float | None, "m in (0, inf)", "edge length of cells; default: 1/25 of the extent, or as for 5000 cells"
    ] = None
    where: Annotated[Any | None, "condition", "part of the body, by undeformed coordinates; default: all of it"] = None


@dataclass(frozen=True)
class Markers(Probe):
    """The points that were tracked in an experiment, such as beads, corners or ink dots.

    Points that the condition `where` leaves out are ignored, for example those whose motion is imposed.
    """

    body: Annotated[str, "body", "body that is evaluated"]
    of: Annotated[str, "reference", "measurement: a reference with tracked points"]
    where: Annotated[Any | None, "condition", "points to use, by undeformed coordinates; default: all"] = None

    @property
    def tracked(self) -> str:
        """Name of the measurement whose points the probe uses."""
        return self.of
