"""Loads on bodies."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.records import dataclass

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Gravity:
    """Weight of every body: density times an acceleration, per volume before deformation."""

    magnitude: Annotated[float, "m/s^2 in [0, inf)", "acceleration of free fall, 9.81 m/s^2 on Earth"]
    direction: Annotated[Vector3, "direction", "where it pulls"] = (0.0, 0.0, -1.0)
    course: Annotated[
        Any | None, "course", "how it changes in a dynamic analysis; in full from the start without"
    ] = None


@dataclass(frozen=True)
class Traction:
    """A force per undeformed area on a part of the surface, which keeps its direction (a dead load).

    Facets across the border of the selection count by the exact part of them that lies inside; the report says what the
    load comes to, beside what it comes to on the body itself.
    """

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]
    vector: Annotated[Vector3, "Pa", "force per undeformed area"]
    course: Annotated[
        Any | None, "course", "how it changes in a dynamic analysis; in full from the start without"
    ] = None


@dataclass(frozen=True)
class Pressure:
    """A pressure on a part of the surface that stays normal to it while it moves (a follower load).

    Positive values push inward. It has no energy in general, so the tangent is not symmetric. A model of small strain
    takes the undeformed surface, as linear theory does. Facets across the border of the selection count by the exact
    part of them that lies inside; the report says what the load comes to, undeformed, beside what it comes to on the
    body itself.
    """

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]
    magnitude: Annotated[float, "Pa", "pressure, positive inward"]
    course: Annotated[
        Any | None, "course", "how it changes in a dynamic analysis; in full from the start without"
    ] = None


@dataclass(frozen=True)
class PointForce:
    """A force at one material point, which keeps its direction.

    In a solid the displacement right under a point force grows without bound as the mesh is refined: look at it from a
    distance.
    """

    body: Annotated[str, "body", "the body that is loaded"]
    at: Annotated[Vector3, "m", "the point, by its coordinates before deformation"]
    vector: Annotated[Vector3, "N", "the force"]
    course: Annotated[
        Any | None, "course", "how it changes in a dynamic analysis; in full from the start without"
    ] = None
