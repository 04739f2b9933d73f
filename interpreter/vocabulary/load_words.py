"""Loads on bodies, and the few ways (actions) in which a load can act.

A load has fields for the scene, and its `action` describes how the load acts. Solvers, resultants and checks use only
the action. To add a load that acts in an existing way: a class derived from Load and a line in LOADS. A new kind of
action is refused by every model that does not list it in `loads`, until its formulas are written.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, Self

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.results.state_results import Moment
from softmark.interpreter.vocabulary.amplitude_words import AtOneTime, PerState
from softmark.records import dataclass

Vector3 = tuple[float, float, float]

AMPLITUDE = "amplitude over time or from state to state; default: full load from the start"


@dataclass(frozen=True)
class BodyForce:
    """Body force per mass with constant direction (a dead load)."""

    acceleration: Vector3  # m/s^2


@dataclass(frozen=True)
class SurfaceTraction:
    """Force per undeformed area on a part of the surface, with constant direction (a dead load)."""

    where: Any  # a condition
    traction: Vector3  # Pa


@dataclass(frozen=True)
class RemoteStress:
    """Traction that a uniform uniaxial stress exerts on a part of the surface, per undeformed area (a dead load)."""

    where: Any  # a condition
    stress: float  # Pa
    direction: Vector3  # unit vector

    @property
    def tensor(self) -> tuple[Vector3, Vector3, Vector3]:
        """Rows of the stress tensor, Pa."""
        x, y, z = ((self.stress * a * self.direction[0], self.stress * a * self.direction[1],
                    self.stress * a * self.direction[2]) for a in self.direction)  # fmt: skip
        return x, y, z


@dataclass(frozen=True)
class PressureLoad:
    """Pressure on a part of the surface, positive inward, normal to the deformed surface (a follower load)."""

    where: Any  # a condition
    pressure: float  # Pa


@dataclass(frozen=True)
class PointLoad:
    """Force with constant direction at one material point."""

    at: Vector3  # m
    force: Vector3  # N


@dataclass(frozen=True)
class MomentLoad:
    """Moment on a part of the surface, without a resultant force, with constant size and direction."""

    where: Any  # a condition
    moment: Vector3  # N m


@dataclass(frozen=True)
class LineForce:
    """Force per undeformed length along a straight line, with constant direction (a dead load)."""

    begin: Vector3  # m
    end: Vector3  # m
    force: Vector3  # N/m

    @property
    def length(self) -> float:
        """Length of the line, m."""
        return math.dist(self.begin, self.end)


@dataclass(frozen=True)
class TendonLoad:
    """Tendon under tension along a straight or helical route through a body, frictionless, and fixed at both ends."""

    begin: Vector3  # m
    end: Vector3  # m
    tension: float  # N
    winding: float = 0.0  # rad
    guides: int | None = None  # number of equally spaced guides, None if guided continuously


class Load:
    """Base class of loads."""

    strength = ""  # name of the field with the size of the load
    amplitude: Any = None  # amplitude over time, or from state to state

    @property
    def action(self) -> Any:
        """Action of the load: an instance of one of the classes above, which models apply."""
        raise NotImplementedError(f"{type(self).__name__} does not say how it acts")

    def part(self, share: float) -> Self:
        """Return the load scaled to the fraction `share` of its full size."""
        less: Self = scale_field(self, self.strength, share)
        return less

    def in_state(self, number: int, value: float) -> Self:
        """Return the load in one state of a static analysis, which has this number and value."""
        now: Self = in_state_of_value(self, value)
        return now


def in_state_of_value(thing: Any, value: float) -> Any:
    """Return a load, support or material as it is in the state with this value.

    Without `amplitude = per_state` it is unchanged. If `value` is a time of a quasistatic analysis, the result is
    scaled by
    the amplitude at that time, and its `amplitude` (`AtOneTime`) keeps the original at full size.
    """
    if isinstance(value, Moment):
        full, amplitude = thing, thing.amplitude
        if amplitude is None or isinstance(amplitude, PerState):  # validation refuses `amplitude = per_state` here
            return thing
        return replace(thing.part(amplitude.at(value)), amplitude=AtOneTime(full))
    return replace(thing.part(value), amplitude=None) if isinstance(thing.amplitude, PerState) else thing


class HasMaterial:
    """Base class of bodies and regions with a material; its active stress may follow an amplitude."""

    material: Any

    def in_state(self, number: int, value: float) -> Self:
        """Return the body or region in one state of a static analysis, which has this number and value."""
        if getattr(self.material, "amplitude", None) is None:
            return self
        made: Self = replace(self, material=in_state_of_value(self.material, value))  # type: ignore[type-var]
        return made


def scale_field(thing: Any, field: str, share: float) -> Any:
    """Return a copy of an object with one field, a number or a vector, multiplied by `share`."""
    full = getattr(thing, field)
    less = share * full if isinstance(full, float) else tuple(share * v for v in full)
    return replace(thing, **{field: less})


@dataclass(frozen=True)
class Gravity(Load):
    """Weight of every body: density times an acceleration, per undeformed volume."""

    strength = "magnitude"

    magnitude: Annotated[float, "m/s^2 in [0, inf)", "gravitational acceleration, 9.81 m/s^2 on Earth"]
    direction: Annotated[Vector3, "direction", "direction of gravity"] = (0.0, 0.0, -1.0)
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> BodyForce:
        """Action of the load: its acceleration as a body force per mass."""
        x, y, z = (self.magnitude * c for c in self.direction)
        return BodyForce((x, y, z))


@dataclass(frozen=True)
class Traction(Load):
    """A force per undeformed area on a part of the surface, with constant direction (a dead load).

    A facet that is only partly selected is loaded on exactly the selected part. The report gives the resultant on the
    mesh and on the exact body.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates"]
    vector: Annotated[Vector3, "Pa", "force per undeformed area"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> SurfaceTraction:
        """Action of the load: a force per undeformed area on the selected part."""
        return SurfaceTraction(self.where, self.vector)


@dataclass(frozen=True)
class RemoteStressLoad(Load):
    """Traction of a uniform remote stress along a direction, on a part of the surface.

    The force per undeformed area is T (d.n) d, with T the stress, d its direction and n the outward normal: it is
    largest where the surface faces along d and zero where it is parallel to d. Its direction stays constant (a dead
    load). On the whole surface of a body of one material it produces the uniform stress T d d. Several of them add up
    to any uniform stress: three equal ones along the axes are a hydrostatic tension, the opposite of a pressure. A
    facet that is only partly selected is loaded on exactly the selected part. Beams refuse it.
    """

    strength = "magnitude"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates"]
    magnitude: Annotated[float, "Pa", "stress, positive in tension"]
    direction: Annotated[Vector3, "direction", "direction of the stress; `+x` and `-x` mean the same"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> RemoteStress:
        """Action of the load: the traction of a remote stress on the selected part."""
        return RemoteStress(self.where, self.magnitude, self.direction)


@dataclass(frozen=True)
class Pressure(Load):
    """A pressure on a part of the surface that stays normal to the deformed surface (a follower load).

    Positive values push inward. In general it has no potential energy, so the tangent is not symmetric. Models with
    small strain apply it to the undeformed surface, as linear theory does. A facet that is only partly selected is
    loaded on exactly the selected part. The report gives the resultant on the undeformed mesh and on the exact body.
    """

    strength = "magnitude"

    body: Annotated[str, "body", "the body that is loaded"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates"]
    magnitude: Annotated[float, "Pa", "pressure, positive inward"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> PressureLoad:
        """Action of the load: a pressure normal to the deformed surface of the selected part."""
        return PressureLoad(self.where, self.magnitude)


@dataclass(frozen=True)
class PointForce(Load):
    """A force at one material point, with constant direction.

    In a solid the displacement right at a point force grows without bound as the mesh is refined, so evaluate results
    at some distance. On a beam a point off the axis moves with its cross-section: the force is eccentric. On a free
    rigid body the force stays at its material point; in a static analysis it presses a rigid body that is free to move
    in one direction.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    at: Annotated[Vector3, "m", "point, by its undeformed coordinates"]
    vector: Annotated[Vector3, "N", "force vector"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> PointLoad:
        """Action of the load: a force at one material point."""
        return PointLoad(self.at, self.vector)


@dataclass(frozen=True)
class Torque(Load):
    """A moment on a part of the surface without a resultant force; its size and direction in space stay constant.

    On a solid it is a traction about the centre of the part, t = c x (x - centre) per undeformed area, with x the
    current position. The vector c is computed so that the moment is exactly the given one and the resultant force is
    zero, however the part rotates and deforms. Models with small strain use the undeformed part. On a beam it is the
    moment on a whole end section, a boundary condition of Simo-Reissner theory. Under rotations about several axes such
    a moment has no potential energy, so the tangent is not symmetric (Argyris, Dunne and Scharpf 1978). The report
    gives the resultant and the area. On a free rigid body, without `where`, it acts on the whole body.
    """

    strength = "moment"

    body: Annotated[str, "body", "the body that is loaded"]
    moment: Annotated[Vector3, "N*m", "moment vector, right-hand rule"]
    where: Annotated[Any, "condition", "loaded part of its surface, by undeformed coordinates; omit it for a"
                     " rigid body"] = EVERYWHERE  # fmt: skip
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> MomentLoad:
        """Action of the load: a moment on the selected part, without a resultant force."""
        return MomentLoad(self.where, self.moment)


@dataclass(frozen=True)
class LineLoad(Load):
    """A force per undeformed length along a straight line, with constant direction (a dead load).

    On a beam the line is the axis or a part of it. In a solid it lies inside the body or on its surface, and crosses
    cells from face to face. It is integrated exactly, so the resultant is the same on every mesh.

    In a solid the displacement at the line grows without bound as the mesh is refined, as the logarithm of the cell
    size, and the stress as its inverse (Flamant 1892; Kelvin): results there do not converge. Away from the line they
    do, by Saint-Venant's principle. A traction on a narrow strip converges everywhere.
    """

    strength = "vector"

    body: Annotated[str, "body", "the body that is loaded"]
    from_: Annotated[Vector3, "m", "start of the line, by undeformed coordinates"]
    to: Annotated[Vector3, "m", "end of the line"]
    vector: Annotated[Vector3, "N/m", "force per undeformed length"]
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> LineForce:
        """Action of the load: a force per undeformed length along the line."""
        return LineForce(self.from_, self.to, self.vector)


@dataclass(frozen=True)
class Tendon(Load):
    """A tendon under tension that runs along a beam, off its axis, through closely spaced guides.

    In the undeformed body it runs straight from one point to another, or winds about the axis on its way. It moves with
    the beam as the beam bends, so its force is a follower force. Guides have no friction: the tension is constant along
    the tendon, and the energy is tension times length. Guides may lie outside the body, as on discs. With `guides`
    there are that many, equally spaced along the axis, with nodes at each, and the tendon is straight between them.
    Each end is fixed to its cross-section, so the pull is internal to the beam: the forces and moments of a tendon sum
    to zero and supports carry none of them. A motor outside the beam would instead pull on the support at that end. A
    straight tendon at a distance d bends a beam to a curvature T d / (E I) and shortens it by T / (E A). Only beams
    with a straight axis take tendons, in static and dynamic analyses. Solids do not: a tendon would press on them along
    a line, where displacements do not converge.
    Source: Rucker and Webster (2011), IEEE Trans. Robot. 27, 1033-1044; Camarillo and others (2008), IEEE Trans. Robot.
    24, 1262-1273.
    """

    strength = "tension"

    body: Annotated[str, "body", "beam that it bends"]
    from_: Annotated[Vector3, "m", "fixed point at one end, by undeformed coordinates"]
    to: Annotated[Vector3, "m", "fixed point at the other end"]
    tension: Annotated[float, "N in [0, inf)", "tension of the tendon"]
    winding: Annotated[
        float,
        "rad in [-1000, 1000]",
        "angle by which it winds about the axis (right-hand rule); `360 deg` is one turn",
    ] = 0.0
    guides: Annotated[
        int | None, "1 in [2, 200]", "number of guides, both ends included; default: guided continuously"
    ] = None
    amplitude: Annotated[Any | None, "amplitude", AMPLITUDE] = None

    @property
    def action(self) -> TendonLoad:
        """Action of the load: a tendon under tension, with its route and guides."""
        return TendonLoad(self.from_, self.to, self.tension, self.winding, self.guides)
