"""Loads on bodies, and the few ways in which anything loads a body.

A load has fields for the scene and says by `action` how it acts: what solves, what adds up and what checks look at that
alone. To add a load that acts in one of these ways: a class derived from Load, a line in LOADS. A new way to act is
known to nobody: it is refused by every model whose `loads` do not name it, until its formulas are written.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, Self

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.results.state_results import Moment
from softmark.interpreter.vocabulary.amplitude_words import Passed, State
from softmark.records import dataclass

Vector3 = tuple[float, float, float]

COURSE = "how it changes in a dynamic analysis, or from state to state of a static one; in full without"


@dataclass(frozen=True)
class PerMass:
    """A dead force on all matter of a body, per mass."""

    acceleration: Vector3  # m/s^2


@dataclass(frozen=True)
class PerArea:
    """A dead force per undeformed area on a part of the surface."""

    where: Any  # a condition
    traction: Vector3  # Pa


@dataclass(frozen=True)
class Tensile:
    """What a uniform stress along one direction exerts on a part of the surface, per undeformed area: a dead force."""

    where: Any  # a condition
    stress: float  # Pa
    direction: Vector3  # unit vector

    @property
    def tensor(self) -> tuple[Vector3, Vector3, Vector3]:
        """The stress, Pa: its rows."""
        x, y, z = ((self.stress * a * self.direction[0], self.stress * a * self.direction[1],
                    self.stress * a * self.direction[2]) for a in self.direction)  # fmt: skip
        return x, y, z


@dataclass(frozen=True)
class Follower:
    """A pressure on a part of the surface, inward, that stays normal to it while it moves."""

    where: Any  # a condition
    pressure: float  # Pa


@dataclass(frozen=True)
class AtPoint:
    """A dead force at one material point."""

    at: Vector3  # m
    force: Vector3  # N


@dataclass(frozen=True)
class Turning:
    """A moment on a part of the surface, without a force, that keeps its size and direction."""

    where: Any  # a condition
    moment: Vector3  # N m


@dataclass(frozen=True)
class PerLength:
    """A dead force per undeformed length along a straight line."""

    begin: Vector3  # m
    end: Vector3  # m
    force: Vector3  # N/m

    @property
    def length(self) -> float:
        """Of the line, m."""
        return math.dist(self.begin, self.end)


@dataclass(frozen=True)
class Routed:
    """A line under tension along a straight or winding way through a body, guided without friction, its ends fixed."""

    begin: Vector3  # m
    end: Vector3  # m
    tension: float  # N
    winding: float = 0.0  # rad
    guides: int | None = None  # at equal distances, None of guides all along


class Load:
    """What every load says."""

    strength = ""  # the field that says how much
    course: Any = None  # how it changes in a dynamic analysis, or from state to state

    @property
    def action(self) -> Any:
        """How it acts: one of the classes above."""
        raise NotImplementedError(f"{type(self).__name__} does not say how it acts")

    def part(self, share: float) -> Self:
        """The same at a part of its full size."""
        less: Self = scaled(self, self.strength, share)
        return less

    def in_state(self, number: int, value: float) -> Self:
        """The same in one state of a static analysis, of this value."""
        now: Self = at_state(self, value)
        return now


def at_state(thing: Any, value: float) -> Any:
    """A load or support with the course of a state, as it is in one of this value; any other is as it was.

    At a time of a quasistatic analysis its course has brought it to a part of its size, and it knows what it is a part
    of (`Passed`).
    """
    if isinstance(value, Moment):
        full, course = thing, thing.course
        if course is None or isinstance(course, State):  # of which no time has any: refused elsewhere
            return thing
        return replace(thing.part(course.at(value)), course=Passed(full))
    return replace(thing.part(value), course=None) if isinstance(thing.course, State) else thing


class MadeOf:
    """What has a material, which may pull by a course."""

    material: Any

    def in_state(self, number: int, value: float) -> Self:
        """The same in one state, of this value."""
        if getattr(self.material, "course", None) is None:
            return self
        made: Self = replace(self, material=at_state(self.material, value))  # type: ignore[type-var]
        return made


def scaled(thing: Any, field: str, share: float) -> Any:
    """The same with a number or a vector times a share."""
    full = getattr(thing, field)
    less = share * full if isinstance(full, float) else tuple(share * v for v in full)
    return replace(thing, **{field: less})


@dataclass(frozen=True)
class Gravity(Load):
    """Weight of every body: density times an acceleration, per volume before deformation."""

    strength = "magnitude"

    magnitude: Annotated[float, "m/s^2 in [0, inf)", "acceleration of free fall, 9.81 m/s^2 on Earth"]
    direction: Annotated[Vector3, "direction", "where it pulls"] = (0.0, 0.0, -1.0)
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> PerMass:
        """How it acts."""
        x, y, z = (self.magnitude * c for c in self.direction)
        return PerMass((x, y, z))


@dataclass(frozen=True)
class Traction(Load):
    """A force per undeformed area on a part of the surface, which keeps its direction (a dead load).

    Facets across the border of the selection count by the exact part of them that lies inside; the report says what the
    load comes to, beside what it comes to on the body itself.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]
    vector: Annotated[Vector3, "Pa", "force per undeformed area"]
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> PerArea:
        """How it acts."""
        return PerArea(self.where, self.vector)


@dataclass(frozen=True)
class Tension(Load):
    """What a uniform stress along a direction exerts on a part of the surface: a body that is pulled from afar.

    The force per undeformed area is T (d.n) d, with T the tension, d its direction and n the outward normal: all of it
    where the surface looks that way, none where it lies along it. It keeps its direction (a dead load). On the whole
    surface it makes the uniform stress T d d in a body of one material. Several add up to any uniform stress: three of
    one size along the axes are a pressure, negative. Facets across the border of the selection count by the exact part
    of them that lies inside. Beams refuse it.
    """

    strength = "magnitude"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]
    magnitude: Annotated[float, "Pa", "the stress, positive where it pulls"]
    direction: Annotated[Vector3, "direction", "along which line it pulls, `+x` as well as `-x`"]
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> Tensile:
        """How it acts."""
        return Tensile(self.where, self.magnitude, self.direction)


@dataclass(frozen=True)
class Pressure(Load):
    """A pressure on a part of the surface that stays normal to it while it moves (a follower load).

    Positive values push inward. It has no energy in general, so the tangent is not symmetric. A model of small strain
    takes the undeformed surface, as linear theory does. Facets across the border of the selection count by the exact
    part of them that lies inside; the report says what the load comes to, undeformed, beside what it comes to on the
    body itself.
    """

    strength = "magnitude"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation"]
    magnitude: Annotated[float, "Pa", "pressure, positive inward"]
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> Follower:
        """How it acts."""
        return Follower(self.where, self.magnitude)


@dataclass(frozen=True)
class PointForce(Load):
    """A force at one material point, which keeps its direction.

    In a solid the displacement right under a point force grows without bound as the mesh is refined: look at it from a
    distance. On a beam a point beside the axis is one of its section, which carries it along: an eccentric force. On a
    free rigid body it pulls at that point of it, wherever that goes; at rest it presses one that may go one way.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    at: Annotated[Vector3, "m", "the point, by its coordinates before deformation"]
    vector: Annotated[Vector3, "N", "the force"]
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> AtPoint:
        """How it acts."""
        return AtPoint(self.at, self.vector)


@dataclass(frozen=True)
class Torque(Load):
    """A moment on a part of the surface, without a force, that keeps its size and its direction in space.

    On a solid it is a traction around the middle of the part, t = c x (x - middle) per undeformed area, x where the
    part is now; c is such that its moment is exactly the one that is given, however the part turns and deforms, and
    its force nothing. A model of small strain takes the undeformed part. On a beam it is the moment on a whole end
    section, which Simo-Reissner theory has as its boundary condition. Such a moment has no energy under turns about
    several axes, so that the tangent is not symmetric (Argyris, Dunne and Scharpf 1978). The report says what it comes
    to, with the area. On a free rigid body, without `where`, it turns all of it.
    """

    strength = "moment"

    body: Annotated[str, "body", "the body that is loaded"]
    moment: Annotated[Vector3, "N*m", "the moment, right-handed"]
    where: Annotated[Any, "condition", "which part of its surface, by coordinates before deformation; none of a rigid"
                     " body, all of which it turns"] = EVERYWHERE  # fmt: skip
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> Turning:
        """How it acts."""
        return Turning(self.where, self.moment)


@dataclass(frozen=True)
class LineLoad(Load):
    """A force per undeformed length along a straight line, which keeps its direction (a dead load).

    On a beam the line is its axis or a part of it. In a solid it lies within the body or on its surface, and goes
    through cells from face to face. Both are integrated exactly: the resultant is that of the line on every mesh.

    Under a line of force displacements of a solid grow without bound as a mesh is refined, like the logarithm of the
    size of its cells, and stresses like its inverse (Flamant 1892; Kelvin): there is no answer to come near to. Away
    from the line there is one, as Saint-Venant says. A traction on a strip has one everywhere.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    from_: Annotated[Vector3, "m", "where the line begins, by coordinates before deformation"]
    to: Annotated[Vector3, "m", "where it ends"]
    vector: Annotated[Vector3, "N/m", "force per undeformed length"]
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> PerLength:
        """How it acts."""
        return PerLength(self.from_, self.to, self.vector)


@dataclass(frozen=True)
class Tendon(Load):
    """A tendon that runs beside the axis of a beam, through guides that follow one another closely, and is pulled.

    It goes straight through the undeformed body from one point to another, or winds about the axis on its way, and is
    carried along as the beam bends: its force follows it. Guides have no friction, so that its tension is the same all
    along and its energy the tension times its length. They may lie outside the body, as those on discs do; with
    `guides` there are so many, at equal distances along the axis, where nodes are put, and it is straight between them.
    Each end is fixed to the section that it lies in: what pulls at it is within the beam, forces and moments of a
    tendon add up to nothing, and supports carry none of it; a motor apart from the beam would take its pull from the
    support at that end. A straight tendon at a distance d bends a beam to a curvature T d / (E I) and shortens it by
    T / (E A). Beams with a straight axis take tendons, at rest and in motion; solids do not, on which it would press
    along a line, under which displacements have no limit.
    Source: Rucker and Webster (2011), IEEE Trans. Robot. 27, 1033-1044; Camarillo and others (2008), IEEE Trans.
    Robot. 24, 1262-1273.
    """

    strength = "tension"

    body: Annotated[str, "body", "the beam that it bends"]
    from_: Annotated[Vector3, "m", "where it is fixed at one end, by coordinates before deformation"]
    to: Annotated[Vector3, "m", "where it is fixed at the other"]
    tension: Annotated[float, "N in [0, inf)", "the force that it is pulled with"]
    winding: Annotated[
        float,
        "rad in [-1000, 1000]",
        "by how much it winds about the axis on its way, right-handed: `360 deg` is a turn",
    ] = 0.0
    guides: Annotated[
        int | None, "1 in [2, 200]", "how many guides it runs through, both ends among them; guided all along without"
    ] = None
    course: Annotated[Any | None, "course", COURSE] = None

    @property
    def action(self) -> Routed:
        """How it acts."""
        return Routed(self.from_, self.to, self.tension, self.winding, self.guides)
